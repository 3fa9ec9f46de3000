//! Elements: facets cut into quarters as [`crate::coupling::subdivide`] decides, on each of which diffuse light varies
//! linearly; and clusters of facets ([`crate::coupling::cluster`]), of which the mean is known. Clusters come first.
//!
//! The cut depends on geometry, materials and tolerance, never on the light. An unknown of the linear system is one
//! side of one element: unknown = element * sides + side.

mod bake;

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::base::quarter::{self, Path, QUARTERS};
use crate::coupling::cluster::{CLUSTERS_MADE, Clusters};
use crate::coupling::subdivide::{Node, SubdivisionTree};
use crate::scene::Scene;
use core::ops::Range;

/// Which elements each facet has.
#[derive(Clone, Copy, Debug)]
pub struct Elements<'m> {
    /// Of each node of the trees: [`ELEMENT_NODE`] and its element, or the first of its four quarters' nodes.
    nodes: &'m [u32],
    /// The facet of each element; of a cluster its largest.
    facet: &'m [u32],
    path: &'m [u32],
    facets: usize,
    sides: usize,
    groups: Groups<'m>,
    memory: usize,
}

/// The facets of clusters.
#[derive(Clone, Copy, Debug)]
struct Groups<'m> {
    /// The first of each cluster's facets in `members`, and one past the last of all.
    starts: &'m [u32],
    /// The facets, cluster by cluster.
    members: &'m [u32],
    /// Share of its cluster's area that a facet and those before it have.
    sums: &'m [f32],
    /// Area of each cluster over that of its largest facet.
    shares: &'m [f64],
}

/// Quarters of quarters that a cluster's area is told apart by.
const CLUSTER_STEPS: u32 = 12;

/// Marks nodes that are elements.
const ELEMENT_NODE: u32 = 1 << 31;

/// A point on an element: its local coordinates, each the barycentric weight of a corner less 1/3.
pub type Local = (f64, f64);

/// The quarters of a node that still wait while a tree is walked.
const NODES_WAITING: usize = Path::DEEPEST as usize * (QUARTERS - 1) + 1;

/// Calls `leaf` with (facet, node, path) of every element, by facet, first quarters first. `child` gives a node's first
/// quarter, `None` for an element. False where `leaf` says so or the trees are deeper than can be.
fn walk(
    facets: impl Iterator<Item = usize>,
    child: impl Fn(usize) -> Option<usize>,
    mut leaf: impl FnMut(usize, usize, Path) -> bool,
) -> bool {
    for facet in facets {
        let mut waiting = [(0usize, Path::default()); NODES_WAITING];
        waiting.set(0, (facet, Path::default()));
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (node, path) = waiting.at(count);
            match child(node) {
                None if !leaf(facet, node, path) => return false,
                None => {}
                Some(_) if path.depth() >= Path::DEEPEST => return false,
                Some(first) => {
                    for quarter in (0..QUARTERS).rev() {
                        waiting.set(count, (first + quarter, path.step(quarter)));
                        count += 1;
                    }
                }
            }
        }
    }
    true
}

impl<'m> Elements<'m> {
    /// Bytes for facets cut like this.
    pub fn bytes(tree: &SubdivisionTree<'_>) -> Result<usize, Error> {
        let clusters = tree.clusters();
        Elements::need(tree.nodes().len(), count(tree), (clusters.count(), clusters.facets())).bytes()
    }

    fn need(nodes: usize, elements: usize, (clusters, members): (usize, usize)) -> Need {
        let need = Need::new().and::<u32>(nodes).and::<u32>(elements).and::<u32>(elements);
        need.and::<u32>(clusters + 1).and::<u32>(members).and::<f32>(members).and::<f64>(clusters)
    }

    /// The elements of a cut.
    // apart, as are the trees: does not burden the stack of probing
    #[inline(never)]
    pub fn new(
        scene: &Scene<'_>,
        tree: &SubdivisionTree<'_>,
        memory: &'m mut [u8],
    ) -> Result<Elements<'m>, Error> {
        let (facets, trees): (usize, &[Node]) = (tree.facets(), tree.nodes());
        if facets != scene.facets() {
            return Err(Error::Mismatch { what: "cut" });
        }
        let needed = Elements::bytes(tree)?;
        let elements = count(tree);
        let mut arena = Arena::new(memory, needed)?;
        let nodes = arena.take::<u32>(trees.len())?;
        let facet_of = arena.take::<u32>(elements)?;
        let paths = arena.take::<u32>(elements)?;
        for (node, tree) in nodes.iter_mut().zip(trees) {
            *node = tree.child;
        }
        let child = |node: usize| trees.get(node).map(|n| n.child as usize).filter(|c| *c != 0);
        let clusters = tree.clusters();
        let groups = Groups::new(scene, clusters, facet_of, &mut arena)?;
        let mut at = clusters.count();
        for (element, facets) in clusters.iter().enumerate() {
            facets.iter().for_each(|facet| nodes.set(*facet as usize, ELEMENT_NODE | element as u32));
        }
        let alone = |facet: &usize| trees.get(*facet).is_some_and(|node| node.cluster == 0);
        walk((0..facets).filter(alone), child, |facet, node, path| {
            nodes.set(node, ELEMENT_NODE | at as u32);
            facet_of.set(at, facet as u32);
            paths.set(at, path.0);
            at += 1;
            true
        });
        let sides = scene.sides();
        Ok(Elements { nodes, facet: facet_of, path: paths, facets, sides, groups, memory: needed })
    }

    /// Number of elements.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.facet.len()
    }

    /// Number of unknowns: elements times sides.
    #[inline(always)]
    pub fn unknowns(&self) -> usize {
        self.facet.len() * self.sides
    }

    /// Facet and side of an unknown.
    #[inline(always)]
    pub fn facet_of(&self, unknown: usize) -> (usize, usize) {
        if self.sides == 1 {
            // without a division
            return (self.facet.at(unknown) as usize, 0);
        }
        (self.facet.at(unknown / self.sides.max(1)) as usize, unknown % self.sides.max(1))
    }

    /// Clusters, which are the first elements.
    #[inline(always)]
    fn clusters(&self) -> usize {
        if CLUSTERS_MADE { self.groups.shares.len() } else { 0 }
    }

    /// Whether an unknown's element is a cluster of facets: of its light the mean is known.
    #[inline(always)]
    pub fn is_cluster(&self, unknown: usize) -> bool {
        unknown < self.clusters() * self.sides
    }

    /// The facets of an element: one, or a cluster's.
    pub fn facets_of(&self, unknown: usize) -> &'m [u32] {
        let element = unknown / self.sides.max(1);
        if self.is_cluster(unknown) {
            self.groups.of(element)
        } else {
            self.facet.get(element..element + 1).unwrap_or(&[])
        }
    }

    /// Elements before any facet was quartered.
    pub fn roots(&self) -> usize {
        self.facets - self.groups.members.len() + self.clusters()
    }

    /// Area of an unknown's element.
    #[inline(always)]
    pub fn area(&self, scene: &Scene<'_>, unknown: usize) -> f64 {
        scene.areas().at(self.facet_of(unknown).0) * self.share(unknown)
    }

    /// Sides of all facets.
    #[inline(always)]
    pub fn facet_sides(&self) -> usize {
        self.facets * self.sides
    }

    /// The place of a facet's side among those of which images of the sun are kept: its own, or its cluster's.
    #[inline(always)]
    pub fn kept_side(&self, facet: usize, side: usize) -> usize {
        let node = self.nodes.at(facet);
        let element = (node & !ELEMENT_NODE) as usize;
        if node & ELEMENT_NODE != 0 && element < self.clusters() {
            self.facet.at(element) as usize * self.sides + side
        } else {
            facet * self.sides + side
        }
    }

    /// The place of an unknown's side of a facet among them: facet * sides + side.
    #[inline(always)]
    pub fn facet_side(&self, unknown: usize) -> usize {
        let (facet, side) = self.facet_of(unknown);
        facet * self.sides + side
    }

    /// The unknowns of one side of a facet.
    pub fn unknowns_of(&self, facet: usize, side: usize) -> impl Iterator<Item = usize> + Clone + use<> {
        let sides = self.sides;
        self.range(facet).map(move |e| e * sides + side)
    }

    /// The elements of a facet: by the first and the last of its quarters' quarters.
    fn range(&self, facet: usize) -> Range<usize> {
        let end = |quarter: usize| {
            let mut node = self.nodes.at(facet);
            while node & ELEMENT_NODE == 0 && node > 0 {
                node = self.nodes.at(node as usize + quarter);
            }
            (node & !ELEMENT_NODE) as usize
        };
        end(0)..end(QUARTERS - 1) + 1
    }

    /// The unknowns of what was cut together with an unknown's element: the other quarters of one triangle, or what those
    /// were cut into, some thirty at most.
    pub fn neighbours(&self, unknown: usize) -> impl Iterator<Item = usize> {
        let (sides, facet) = (self.sides.max(1), self.facet_of(unknown).0);
        let side = unknown % sides;
        let own = Path(self.path.at(unknown / sides));
        let Range { start, end } = self.range(facet);
        let at = unknown / sides;
        (1..16)
            .flat_map(move |step| [at.checked_sub(step), at.checked_add(step)])
            .flatten()
            .filter(move |e| (start..end).contains(e) && own.is_quarter_beside(Path(self.path.at(*e))))
            .map(move |e| e * sides + side)
    }

    /// Share of its facet's area that an unknown's element has; of a cluster's largest facet's, above 1.
    #[inline(always)]
    pub fn share(&self, unknown: usize) -> f64 {
        let element = unknown / self.sides.max(1);
        match self.groups.shares.get(element) {
            Some(share) if CLUSTERS_MADE => *share,
            _ => Path(self.path.at(element)).share(),
        }
    }

    /// The unknown at the point of barycentric weights (u, v) of a facet's side, and the point on its element.
    #[inline(always)]
    pub fn locate(&self, facet: usize, side: usize, u: f64, v: f64) -> (usize, Local) {
        let (mut node, mut point) = (self.nodes.at(facet), (u, v));
        for _ in 0..Path::DEEPEST {
            if node & ELEMENT_NODE != 0 {
                break;
            }
            let (quarter, next) = quarter::into(point.0, point.1);
            (node, point) = (self.nodes.at(node as usize + quarter), next);
        }
        ((node & !ELEMENT_NODE) as usize * self.sides + side, (point.0 - 1.0 / 3.0, point.1 - 1.0 / 3.0))
    }

    /// The facet at the point (a, b) (weights of corners 1 and 2) of an element, and the point's weights there. A cluster is
    /// taken for a triangle whose quarters' quarters are its facets, one after the other.
    #[inline(always)]
    pub fn place(&self, element: usize, a: f64, b: f64) -> (usize, f64, f64) {
        if element < self.clusters() {
            return self.groups.place(element, (a, b));
        }
        let (u, v) = self.in_facet(element, a, b);
        (self.facet.at(element) as usize, u, v)
    }

    /// As [`Elements::locate`], with the point on the triangle that a cluster is taken for.
    pub fn locate_within(&self, facet: usize, side: usize, u: f64, v: f64) -> (usize, Local) {
        let (unknown, local) = self.locate(facet, side, u, v);
        let local = if self.is_cluster(unknown) {
            self.groups.local(unknown / self.sides.max(1), facet)
        } else {
            local
        };
        (unknown, local)
    }

    /// Barycentric weights in the facet of the point (a, b) (weights of corners 1 and 2) of an element that is no cluster.
    #[inline(always)]
    fn in_facet(&self, element: usize, a: f64, b: f64) -> (f64, f64) {
        Path(self.path.at(element)).out_of(a, b)
    }

    /// Corners of an element in scene coordinates, wound as its facet; of a cluster those of its largest.
    pub fn corners(&self, scene: &Scene<'_>, element: usize) -> [Vec3; 3] {
        Path(self.path.at(element)).corners(&scene.corners().at(self.facet.at(element) as usize))
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.memory
    }
}

/// Elements of a tree: its leaves and clusters.
fn count(tree: &SubdivisionTree<'_>) -> usize {
    tree.nodes().iter().filter(|n| n.child == 0 && n.cluster == 0).count() + tree.clusters().count()
}

/// The largest of some facets, the first of them where more are.
fn largest(scene: &Scene<'_>, facets: &[u32]) -> u32 {
    let area = |facet: u32| scene.areas().at(facet as usize);
    let first = facets.first().copied().unwrap_or(0);
    facets.iter().fold(first, |best, &facet| if area(facet) > area(best) { facet } else { best })
}

impl<'m> Groups<'m> {
    /// The facets of all clusters; the largest of each is written to `facet_of`.
    fn new(
        scene: &Scene<'_>,
        clusters: Clusters<'_>,
        facet_of: &mut [u32],
        arena: &mut Arena<'m>,
    ) -> Result<Groups<'m>, Error> {
        let (count, facets) = (clusters.count(), clusters.facets());
        let starts = arena.take::<u32>(count + 1)?;
        let members = arena.take::<u32>(facets)?;
        let sums = arena.take::<f32>(facets)?;
        let shares = arena.take::<f64>(count)?;
        let mut at = 0;
        for (cluster, facets) in clusters.iter().enumerate() {
            let area = |facet: &u32| scene.areas().at(*facet as usize);
            let all = facets.iter().map(area).sum::<f64>();
            let mut sum = 0.0;
            for facet in facets {
                sum += area(facet);
                members.set(at, *facet);
                sums.set(at, if all > 0.0 { (sum / all) as f32 } else { 1.0 });
                at += 1;
            }
            starts.set(cluster + 1, at as u32);
            let largest = largest(scene, facets);
            facet_of.set(cluster, largest);
            let one = scene.areas().at(largest as usize);
            shares.set(cluster, if one > 0.0 { all / one } else { 1.0 });
        }
        Ok(Groups { starts, members, sums, shares })
    }

    fn range(&self, cluster: usize) -> Range<usize> {
        self.starts.at(cluster) as usize..self.starts.at(cluster + 1) as usize
    }

    fn of(&self, cluster: usize) -> &'m [u32] {
        self.members.get(self.range(cluster)).unwrap_or(&[])
    }

    /// See [`Elements::place`].
    fn place(&self, cluster: usize, mut point: (f64, f64)) -> (usize, f64, f64) {
        let (mut at, mut part) = (0.0, 1.0);
        for _ in 0..CLUSTER_STEPS {
            let (quarter, next) = quarter::into(point.0, point.1);
            part *= 1.0 / QUARTERS as f64;
            at += part * quarter as f64;
            point = next;
        }
        let range = self.range(cluster);
        let before = self.sums.part(range.clone()).partition_point(|sum| f64::from(*sum) <= at);
        let member = (range.start + before).min(range.end.saturating_sub(1));
        (self.members.at(member) as usize, point.0, point.1)
    }

    /// The point of a cluster's triangle at which one of its facets begins.
    fn local(&self, cluster: usize, facet: usize) -> Local {
        let range = self.range(cluster);
        let found = self.of(cluster).iter().position(|own| *own as usize == facet).unwrap_or(0);
        let at = if found > 0 { f64::from(self.sums.at(range.start + found - 1)) } else { 0.0 };
        let mut digits = (at * f64::from(1u32 << (2 * CLUSTER_STEPS))) as u32;
        let mut point = (1.0 / 3.0, 1.0 / 3.0);
        for _ in 0..CLUSTER_STEPS {
            point = quarter::out_of((digits & 3) as usize, point);
            digits >>= 2;
        }
        (point.0 - 1.0 / 3.0, point.1 - 1.0 / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::budget::ErrorBudget;
    use crate::scene::{MaterialInput, SceneInput};

    #[test]
    fn locate_and_in_facet_are_inverse_and_cover_the_facet() {
        let material = MaterialInput { diffuse: &[0.5], specular: &[0.0], emission: &[0.0], gloss: None };
        let input = SceneInput {
            vertices: &[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 2.0, 1.0]],
            facets: &[[0, 1, 2], [0, 2, 1]],
            facet_materials: &[],
            normals: &[],
            facet_normals: &[],
            materials: &[material],
            two_sided: true,
            bands: 1,
        };
        let mut memory = [0u8; 4096];
        let scene = Scene::new(&input, &mut memory).unwrap();
        for cuts in [0, 1, 3, 6] {
            let mut memory = [0u8; 1 << 18];
            let mut tree =
                SubdivisionTree::new(&scene, &ErrorBudget::new(1e-3, 1e-3), 0, &mut memory).unwrap();
            // the first facet and then always one corner and the middle of what was cut
            for _ in 0..cuts {
                let (_, values) = tree.newest_level();
                values
                    .iter_mut()
                    .enumerate()
                    .for_each(|(i, v)| *v = if i % 4 == 0 || i % 4 == 3 { 1.0 } else { 0.0 });
                assert!(tree.refine(&scene));
            }
            let mut memory = [0u8; 1 << 16];
            let elements = Elements::new(&scene, &tree, &mut memory).unwrap();
            let own = elements.unknowns_of(0, 1).map(|u| u / 2);
            assert_eq!(own.clone().count() + 1, elements.count());
            let (mut area, mut share) = (0.0, 0.0);
            for e in own {
                for (a, b) in [(0.2, 0.3), (0.7, 0.1), (0.05, 0.9)] {
                    let (u, v) = elements.in_facet(e, a, b);
                    let (unknown, (la, lb)) = elements.locate(0, 1, u, v);
                    assert_eq!(elements.facet_of(unknown), (0, 1));
                    assert_eq!(unknown, e * 2 + 1, "{cuts} cuts");
                    // rounding of weights near 1, doubled at each of six steps
                    assert!((la + 1.0 / 3.0 - a).abs() < 1e-13 && (lb + 1.0 / 3.0 - b).abs() < 1e-13);
                }
                let [p, q, r] = elements.corners(&scene, e);
                area += 0.5 * (q - p).cross(r - p).dot(scene.normals()[0]);
                share += elements.share(e * 2);
            }
            // a sum of some hundred terms rounds each time
            assert!((area - scene.areas()[0]).abs() < 1e-13 && (share - 1.0).abs() < 1e-15);
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (-1e-17, 1.0 + 1e-16)] {
                let (unknown, _) = elements.locate(0, 0, u, v);
                assert_eq!(elements.facet_of(unknown), (0, 0));
            }
        }
    }
}
