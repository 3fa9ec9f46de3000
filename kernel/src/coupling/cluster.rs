//! Clusters: neighbouring facets of one material that face alike, of which light needs one element together where a mesh has
//! more facets than its tolerance asks for.
//!
//! One tree over all facets, split where positions or normals differ most, the heaviest node first; its leaves are the
//! clusters. Facets that alone have a cluster's area stand alone, and may be quartered as those of coarse meshes are. The
//! radiance of a cluster is its mean: what images show of one is found at the points that they show.
//!
//! Constants of this file are measured by `cargo test --test clusters -- --nocapture` (errors of images and irradiances)
//! and `BLIK_BENCH_LARGE=1 cargo bench --bench stages -- facets` (seconds).

use crate::base::arena::{Arena, Need, plain_struct};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::scene::Scene;

/// Clusters of a scene, times the solution's tolerance: with 4,000 at 6e-3 the mean radiances of clusters leave 4e-4 of images
/// of bodies and bowls, a fifth of what the image at 2e-3 may be wrong by.
const CLUSTERS_PER_TOLERANCE: f64 = 24.0;

/// Facets beyond which there are clusters. Up to it the planes of all facets are compared with each other, and closed forms
/// stand for what nothing hides.
pub const CLUSTERED_FACETS: usize = 8192;

/// Whether facets share elements: not where stack and memory are small.
pub(crate) const CLUSTERS_MADE: bool = cfg!(feature = "std");

/// Facets over clusters from which on clusters are worth what they leave out.
const CLUSTERING_RATIO_LEAST: f64 = 1.5;

/// Length that stands for a unit of the normal, in scene coordinates, in which the object fills [-1, 1]: less mixes both sides
/// of a wing, more cuts bumps apart.
const CLUSTER_NORMAL_LENGTH: f64 = 0.3;

/// Weight of a node's area and facets beside that of how much its normals vary: even nodes show shadows, too.
const CLUSTER_EVENNESS_WEIGHT: f64 = 0.1;

/// Levels to which the facets of a cluster are put in order: rays of rows start in 16 parts of it.
const CLUSTER_ORDER_LEVELS: u32 = 4;

/// Coordinates by which nodes are split: of positions and normals.
const CLUSTER_FEATURES: usize = 6;

plain_struct! {
    /// A node of the tree that is a leaf so far.
    pub struct Leaf {
        /// What splitting it is worth; below 0: it cannot be split.
        pub worth: f64,
        /// Where it is to be split.
        pub place: f64,
        /// First of its facets, in the order of the tree.
        pub start: u32,
        /// One past the last.
        pub end: u32,
        /// The coordinate by which it is to be split.
        pub feature: u64,
    }
}

/// The clusters of a scene that have more than one facet.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clusters<'m> {
    order: &'m [u32],
    leaves: &'m [Leaf],
}

/// Number of clusters wanted of a scene of `facets` facets at a solution's tolerance; 0: its facets stay alone.
pub fn wanted(facets: usize, tolerance: f64) -> usize {
    let clusters = CLUSTERS_PER_TOLERANCE / tolerance;
    if CLUSTERS_MADE && facets > CLUSTERED_FACETS && facets as f64 > CLUSTERING_RATIO_LEAST * clusters {
        clusters as usize
    } else {
        0
    }
}

/// Leaves that there is room for: large facets and materials take some beside those that are wanted.
fn room(facets: usize, clusters: usize) -> usize {
    if clusters == 0 { 0 } else { facets.min(2 * clusters) }
}

impl<'m> Clusters<'m> {
    /// Bytes for a scene of `facets` facets, of which `clusters` clusters are wanted.
    pub fn need(facets: usize, clusters: usize) -> Need {
        let facets_in_tree = if clusters == 0 { 0 } else { facets };
        Need::new().and::<u32>(facets_in_tree).and::<Leaf>(room(facets, clusters))
    }

    /// The clusters of a scene's facets, about `clusters` of them; none where its materials and large facets alone are more than there is room
    /// for. `area` is that of the object, over which errors are taken.
    pub fn new(
        scene: &Scene<'_>,
        clusters: usize,
        area: f64,
        arena: &mut Arena<'m>,
    ) -> Result<Clusters<'m>, Error> {
        let facets = if clusters == 0 { 0 } else { scene.facets() };
        let order = arena.take::<u32>(facets)?;
        let leaves = arena.take::<Leaf>(room(scene.facets(), clusters))?;
        if !CLUSTERS_MADE || clusters == 0 {
            return Ok(Clusters::default());
        }
        let largest = area / clusters as f64;
        let clustered = |facet: usize| scene.areas().at(facet) <= largest;
        let mut count = 0;
        for facet in (0..facets).filter(|facet| clustered(*facet)) {
            order.set(count, facet as u32);
            count += 1;
        }
        let order = order.head_mut(count);
        let mut tree = Tree { scene, order, leaves, used: 0, all: count, area };
        let Some(()) = tree.materials().and_then(|()| tree.grow(clusters)) else {
            return Ok(Clusters::default());
        };
        let Tree { order, leaves, used, .. } = tree;
        Ok(Clusters { order, leaves: leaves.head(used) })
    }

    /// The clusters, each the numbers of its facets: two at least.
    pub fn iter(&self) -> impl Iterator<Item = &'m [u32]> + use<'m> {
        let order = self.order;
        let leaves = self.leaves.iter().filter(|leaf| leaf.end - leaf.start > 1);
        leaves.map(move |leaf| order.get(leaf.start as usize..leaf.end as usize).unwrap_or(&[]))
    }

    /// Their number.
    pub fn count(&self) -> usize {
        self.iter().count()
    }

    /// Facets in them.
    pub fn facets(&self) -> usize {
        self.iter().map(<[u32]>::len).sum()
    }
}

/// The tree while it grows: its leaves, a heap by what splitting them is worth.
struct Tree<'a, 'm> {
    scene: &'a Scene<'a>,
    order: &'m mut [u32],
    leaves: &'m mut [Leaf],
    used: usize,
    all: usize,
    area: f64,
}

/// Coordinates of a facet, and its weight.
fn features(scene: &Scene<'_>, facet: u32) -> ([f64; CLUSTER_FEATURES], f64) {
    let facet = facet as usize;
    let [a, b, c] = scene.corners().at(facet);
    let (middle, normal): (Vec3, Vec3) =
        ((a + b + c) / 3.0, scene.normals().at(facet) * CLUSTER_NORMAL_LENGTH);
    ([middle.x, middle.y, middle.z, normal.x, normal.y, normal.z], scene.areas().at(facet))
}

/// Weighted mean and variance of each coordinate, and the sum of weights, of facets.
fn moments(scene: &Scene<'_>, facets: &[u32]) -> ([f64; CLUSTER_FEATURES], [f64; CLUSTER_FEATURES], f64) {
    let (mut sums, mut squares, mut weight) = ([0.0; CLUSTER_FEATURES], [0.0; CLUSTER_FEATURES], 0.0);
    // about the first facet: squares of far coordinates would cancel
    let origin = facets.first().map_or([0.0; CLUSTER_FEATURES], |first| features(scene, *first).0);
    for &facet in facets {
        let (x, w) = features(scene, facet);
        weight += w;
        for (((sum, square), x), origin) in sums.iter_mut().zip(&mut squares).zip(x).zip(origin) {
            let x = x - origin;
            *sum += w * x;
            *square += w * x * x;
        }
    }
    if weight > 0.0 {
        for ((sum, square), origin) in sums.iter_mut().zip(&mut squares).zip(origin) {
            let mean = *sum / weight;
            *square = (*square / weight - mean * mean).max(0.0);
            *sum = mean + origin;
        }
    }
    (sums, squares, weight)
}

/// Puts those of a range's facets before a place first, and returns how many they are; half of them where none or all are.
fn partition(scene: &Scene<'_>, facets: &mut [u32], feature: usize, place: f64) -> usize {
    let before = |facet: u32| features(scene, facet).0.at(feature) < place;
    let (mut low, mut high) = (0, facets.len());
    while low < high {
        if before(facets.at(low)) {
            low += 1;
        } else {
            high -= 1;
            facets.swap(low, high);
        }
    }
    if low == 0 || low == facets.len() { facets.len() / 2 } else { low }
}

/// The coordinate of most variance.
fn widest(variances: &[f64; CLUSTER_FEATURES]) -> usize {
    let wider = |best: usize, at: usize| if variances.at(at) > variances.at(best) { at } else { best };
    (1..CLUSTER_FEATURES).fold(0, wider)
}

impl Tree<'_, '_> {
    /// One leaf of each material; `None` where there is no room.
    fn materials(&mut self) -> Option<()> {
        let scene = self.scene;
        crate::base::sort::sort(self.order, &|a: &u32, b: &u32| {
            (scene.material(*a as usize), a).cmp(&(scene.material(*b as usize), b))
        });
        let mut start = 0;
        while start < self.order.len() {
            let material = scene.material(self.order.at(start) as usize);
            let of = |facet: &u32| scene.material(*facet as usize) == material;
            let end = start + self.order.get(start..)?.partition_point(of);
            self.push(start as u32, end as u32)?;
            start = end;
        }
        Some(())
    }

    /// Splits leaves until they are `clusters`.
    fn grow(&mut self, clusters: usize) -> Option<()> {
        let most = clusters.min(self.leaves.len());
        while self.used < most {
            let leaf = self.pop()?;
            if leaf.worth < 0.0 {
                self.put(leaf)?;
                break;
            }
            let range = leaf.start as usize..leaf.end as usize;
            let facets = self.order.get_mut(range)?;
            let middle = leaf.start + partition(self.scene, facets, leaf.feature as usize, leaf.place) as u32;
            self.push(leaf.start, middle)?;
            self.push(middle, leaf.end)?;
        }
        // neighbours in the tree have rows beside each other
        crate::base::sort::sort(self.leaves.head_mut(self.used), &|a: &Leaf, b: &Leaf| a.start.cmp(&b.start));
        for at in 0..self.used {
            let leaf = self.leaves.at(at);
            self.put_in_order(leaf.start as usize, leaf.end as usize, CLUSTER_ORDER_LEVELS);
        }
        Some(())
    }

    /// Puts the facets of a leaf in the order of some levels of a tree below it.
    fn put_in_order(&mut self, start: usize, end: usize, levels: u32) {
        if levels == 0 || end - start < 3 {
            return;
        }
        let Some(facets) = self.order.get_mut(start..end) else { return };
        let (means, variances, _) = moments(self.scene, facets);
        let feature = widest(&variances);
        let middle = start + partition(self.scene, facets, feature, means.at(feature));
        self.put_in_order(start, middle, levels - 1);
        self.put_in_order(middle, end, levels - 1);
    }

    /// A new leaf.
    fn push(&mut self, start: u32, end: u32) -> Option<()> {
        let facets = self.order.get(start as usize..end as usize)?;
        let (means, variances, area) = moments(self.scene, facets);
        let feature = widest(&variances);
        let [.., x, y, z] = variances;
        let normals = (x + y + z) / (CLUSTER_NORMAL_LENGTH * CLUSTER_NORMAL_LENGTH);
        let weight = area / self.area + f64::from(end - start) / self.all.max(1) as f64;
        let worth =
            if end - start > 1 && area > 0.0 { weight * (CLUSTER_EVENNESS_WEIGHT + normals) } else { -1.0 };
        self.put(Leaf { worth, place: means.at(feature), start, end, feature: feature as u64 })
    }

    fn put(&mut self, leaf: Leaf) -> Option<()> {
        let mut at = self.used;
        *self.leaves.get_mut(at)? = leaf;
        self.used += 1;
        while at > 0 && self.is_less((at - 1) / 2, at) {
            self.leaves.swap(at, (at - 1) / 2);
            at = (at - 1) / 2;
        }
        Some(())
    }

    fn pop(&mut self) -> Option<Leaf> {
        let best = *self.leaves.first().filter(|_| self.used > 0)?;
        self.used -= 1;
        self.leaves.swap(0, self.used);
        let mut at = 0;
        loop {
            let mut largest = at;
            for child in [2 * at + 1, 2 * at + 2] {
                if child < self.used && self.is_less(largest, child) {
                    largest = child;
                }
            }
            if largest == at {
                return Some(best);
            }
            self.leaves.swap(at, largest);
            at = largest;
        }
    }

    fn is_less(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.leaves.at(a), self.leaves.at(b));
        a.worth < b.worth || (a.worth == b.worth && a.start > b.start)
    }
}
