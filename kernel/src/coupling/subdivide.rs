//! Adaptive subdivision of facets into quarters, where the irradiance departs from a linear function: about objects
//! that stand on a facet or pierce it.
//!
//! Geometry, materials and tolerance decide, never sky and sun. It goes level by level:
//! [`SubdivisionTree::newest_level`] gives the newest triangles, [`Level::probe`] (on any range of them) measures their
//! unevenness, [`SubdivisionTree::refine`] quarters those whose error counts most. Triangles far larger than objects
//! close before them are quartered first: their probed points are too far from each other to show such objects.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors and elements) and `cargo bench
//! --bench stages` (seconds).

use crate::base::arena::{Arena, plain_struct};
use crate::base::budget::ErrorBudget;
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, span};
use crate::base::math::{Vec3, frame, sqrt};
use crate::base::qmc::{Sequence, cosine_direction, hash2};
use crate::base::quarter::{Path, QUARTERS, out_of};
use crate::base::simd::Isa;
use crate::coupling::cluster::Clusters;
use crate::coupling::detail::DetailSearch;
use crate::coupling::plane_sides::{PlaneSides, ProvenVisible, Receiver, SIDE_SET_WORDS};
use crate::form_factor::{TRIANGLE_LANES, TriangleBlock, point_to_triangle, point_to_triangles};
use crate::rays::bvh::{AnswerBuffer, Bvh};
use crate::rays::surface::{Surface, opens_to_sky};
use crate::scene::Scene;
use core::ops::Range;

/// Probed points of a triangle: the middles of its quarters' quarters.
const PROBE_POINTS: usize = QUARTERS * QUARTERS;

/// Most rays from one probed point.
pub const PROBE_RAYS_MOST: u32 = 1024;

/// Fewest rays from one probed point.
const PROBE_RAYS_FEWEST: u32 = 16;

/// Share of black backs among the first hits of a point from which on it lies inside a body, where nothing sees it.
pub const INSIDE: f64 = 0.9375;

/// Most facets seen by a triangle's points for which closed forms cost less than rays.
const PROBE_CLOSED_FORMS_MOST: usize = 2048;

/// Least unevenness that counts, in units of its noise (estimated from half of the rays), once a point has all its
/// rays.
///
/// An even triangle exceeds it with the probability 1e-4.
const UNEVENNESS_CERTAIN: f64 = 1.0;

/// Unevenness, in units of its noise, above which a triangle takes no more rays: they would not change the decision.
const UNEVENNESS_CLEAR: f64 = 4.0;

/// Unevenness of a triangle half of which is hidden in a body, times 4: points near the edge see part of the inside.
const HALF_HIDDEN_UNEVENNESS: f64 = 0.04;

/// Share of the unevenness of a smooth function that a quarter keeps.
const QUARTER_UNEVENNESS: f64 = 1.0 / 16.0;

/// Longest edge of detail before a triangle, over the root of the triangle's area, for which the triangle is quartered.
///
/// Rays of its points meet what is larger. Of a box on a floor fifty times as long they miss the box at a quarter of
/// this value, and the image is wrong by 3.5e-2 with no sign of it.
const DETAIL: f64 = 0.5;

/// Largest distance of detail from a triangle, over the root of the triangle's area, for which the triangle is
/// quartered: light changes over lengths like the distance, which two quarters' size is to match.
const DETAIL_REACH: f64 = 0.5;

/// Most facets that are examined for detail near a triangle. If more are near, and none of them small, they are as
/// large as it.
const DETAIL_FACETS: u32 = 1024;

/// Unevenness of triangles with detail before them.
const DETAILED: f64 = f64::INFINITY;

plain_struct! {
    /// A facet, a quarter of one, or a quarter of that.
    pub struct Node {
        /// The facet.
        pub facet: u32,
        /// Which part of it: a [`Path`].
        pub path: u32,
        /// The first of its four quarters; 0: it is an element, or part of one.
        pub child: u32,
        /// 1 and the number of its cluster; 0: none.
        pub cluster: u32,
    }
}

/// The facets' trees of quarters while they grow.
#[derive(Debug)]
pub struct SubdivisionTree<'m> {
    nodes: &'m mut [Node],
    unevenness: &'m mut [f64],
    clusters: Clusters<'m>,
    used: usize,
    fresh: usize,
    facets: usize,
    /// Elements before any was quartered: facets alone, and clusters.
    roots: usize,
    /// Area that counts as the object's ([`counted_area`]).
    area: f64,
    /// Mean square error, over the object's area, of the triangles that stay as they are.
    settled: f64,
    goal: f64,
    most: usize,
}

/// The newest triangles.
#[derive(Clone, Copy, Debug)]
pub struct Level<'a> {
    nodes: &'a [Node],
    roots: usize,
    area: f64,
}

/// Largest area of a facet that counts, over that of all smaller ones. A view is of those where it is larger by far, as
/// the ground that they stand on.
const COUNTED_AREA_RATIO: f64 = 8.0;

/// The area over which the mean square error is taken, that of all facets: each adds up to [`COUNTED_AREA_RATIO`] times
/// what those up to its size, to a factor of 2, add.
fn counted_area(areas: &[f64]) -> f64 {
    const SIZES: usize = 64;
    let largest = areas.iter().fold(0.0, |a: f64, &b| a.max(b));
    let (mut sums, mut counts) = ([0.0; SIZES], [0usize; SIZES]);
    for &area in areas.iter().filter(|area| **area > 0.0) {
        let (mut size, mut limit) = (SIZES - 1, 0.5 * largest);
        while area <= limit && size > 0 {
            (size, limit) = (size - 1, 0.5 * limit);
        }
        if let (Some(sum), Some(count)) = (sums.get_mut(size), counts.get_mut(size)) {
            (*sum, *count) = (*sum + area, *count + 1);
        }
    }
    let mut total = 0.0;
    for (sum, count) in sums.into_iter().zip(counts).filter(|(_, count)| *count > 0) {
        let each = sum / count as f64;
        let mut left = count;
        while left > 0 && total < each / COUNTED_AREA_RATIO {
            total += if total > 0.0 { COUNTED_AREA_RATIO * total } else { each };
            left -= 1;
        }
        total += left as f64 * each;
    }
    total.max(f64::MIN_POSITIVE)
}

/// Number of elements beyond its facets that any mesh may have, at a tolerance of 2e-3.
const MESH_ELEMENTS_FREE: f64 = 4096.0;

/// The most elements of a scene of `facets` facets: 1 + 2e-3/tolerance times as many, and some more for coarse meshes.
pub fn most_elements(facets: usize, tolerance: f64) -> usize {
    let finer = 2e-3 / tolerance;
    (facets as f64 * (1.0 + finer) + MESH_ELEMENTS_FREE * finer.min(1.0)) as usize
}

/// Most nodes of the trees of `facets` facets: those of trees with [`most_elements`] leaves.
fn most_nodes(facets: usize, tolerance: f64) -> usize {
    // each cut adds four nodes and three elements
    facets.saturating_add(
        (most_elements(facets, tolerance).saturating_sub(facets) / 3).saturating_mul(QUARTERS),
    )
}

impl<'m> SubdivisionTree<'m> {
    /// Bytes for the trees of `facets` facets, of which `clusters` clusters are wanted.
    pub fn bytes(facets: usize, tolerance: f64, clusters: usize) -> Result<usize, Error> {
        let nodes = most_nodes(facets, tolerance);
        // two sides and the flag bit of a coupling's record must fit into 32 bits
        let limit = 1usize << 29;
        if nodes > limit {
            return Err(Error::TooMany { what: "elements", limit });
        }
        Clusters::need(facets, clusters).and::<Node>(nodes).and::<f64>(nodes).bytes()
    }

    /// Every facet whole, and to be probed where it is in none of about `clusters` clusters.
    // apart: does not burden the stack of probing
    #[inline(never)]
    pub fn new(
        scene: &Scene<'_>,
        budget: &ErrorBudget,
        clusters: usize,
        memory: &'m mut [u8],
    ) -> Result<SubdivisionTree<'m>, Error> {
        let facets = scene.facets();
        let mut arena = Arena::new(memory, SubdivisionTree::bytes(facets, budget.solution, clusters)?)?;
        let area = counted_area(scene.areas());
        let clusters = Clusters::new(scene, clusters, area, &mut arena)?;
        let roots = facets - clusters.facets() + clusters.count();
        let capacity = most_nodes(facets, budget.solution);
        let nodes = arena.take::<Node>(capacity)?;
        let unevenness = arena.take::<f64>(capacity)?;
        for (facet, (node, expected)) in nodes.iter_mut().zip(unevenness.iter_mut()).take(facets).enumerate()
        {
            *node = Node { facet: facet as u32, ..Node::default() };
            *expected = 0.0;
        }
        for (number, facets) in clusters.iter().enumerate() {
            for facet in facets {
                if let Some(node) = nodes.get_mut(*facet as usize) {
                    node.cluster = number as u32 + 1;
                }
            }
        }
        Ok(SubdivisionTree {
            nodes,
            unevenness,
            clusters,
            used: facets,
            fresh: 0,
            facets,
            roots,
            area,
            settled: 0.0,
            goal: budget.elements,
            most: most_elements(roots, budget.solution),
        })
    }

    /// The triangles to be probed, and where their unevenness is to stand: what is expected of each, to begin with.
    pub fn newest_level(&mut self) -> (Level<'_>, &mut [f64]) {
        let range = self.fresh..self.used;
        (
            Level { nodes: self.nodes.part(range.clone()), roots: self.roots, area: self.area },
            self.unevenness.part_mut(range),
        )
    }

    /// Quarters those of the probed triangles whose errors count most, and says whether there are new ones.
    ///
    /// A triangle's part of the mean square error over the object is a V rho^2 (its share a of the area, unevenness V).
    /// Those with the least stay as they are, as long as their sum is within half of what is left of a small part of
    /// the tolerance's square. Those with detail before them are quartered whatever they count, the largest first.
    #[inline(never)]
    pub fn refine(&mut self, scene: &Scene<'_>) -> bool {
        let range = self.fresh..self.used;
        let area = |node: &Node| Path(node.path).share() * scene.areas().at(node.facet as usize) / self.area;
        let weight = |node: &Node| {
            let rho = scene.largest_diffuse_of(node.facet as usize);
            area(node).min(1.0) * rho * rho
        };
        for (node, value) in
            self.nodes.iter().zip(self.unevenness.iter_mut()).take(self.used).skip(self.fresh)
        {
            let uneven = value.max(0.0);
            *value = if uneven == DETAILED { DETAILED } else { weight(node) * uneven };
        }
        let values = self.unevenness.part(range.clone());
        let elements = self.roots + (self.used - self.facets) / QUARTERS * (QUARTERS - 1);
        let cuts = (self.most.saturating_sub(elements) * 3 / (4 * (QUARTERS - 1)))
            .min(self.nodes.len().saturating_sub(self.used) / QUARTERS);
        let nodes = self.nodes.part(range.clone());
        let detailed =
            || nodes.iter().zip(values).filter(|(_, value)| **value == DETAILED).map(|(n, _)| area(n));
        let largest = threshold(detailed, 0.0, cuts);
        let cuts = cuts.saturating_sub(detailed().filter(|area| *area >= largest).count());
        let threshold =
            threshold(|| values.iter().copied().filter(|v| *v != DETAILED), self.goal - self.settled, cuts);
        for at in range.clone() {
            let (node, value) = (self.nodes.at(at), self.unevenness.at(at));
            let path = Path(node.path);
            let detailed = value == DETAILED;
            let stays = if detailed { area(&node) < largest } else { value < threshold };
            let value = if detailed { 0.0 } else { value };
            if stays || node.cluster != 0 || path.depth() >= Path::DEEPEST {
                self.settled += value;
                continue;
            }
            self.nodes.set(at, Node { child: self.used as u32, ..node });
            for quarter in 0..QUARTERS {
                self.nodes.set(self.used, Node { path: path.step(quarter).0, child: 0, ..node });
                self.unevenness
                    .set(self.used, QUARTER_UNEVENNESS * value / weight(&node).max(f64::MIN_POSITIVE));
                self.used += 1;
            }
        }
        self.fresh = range.end;
        self.used > self.fresh
    }

    /// All nodes: first the facets', children after their parents.
    pub fn nodes(&self) -> &[Node] {
        self.nodes.part(0..self.used)
    }

    /// Facets.
    pub fn facets(&self) -> usize {
        self.facets
    }

    /// The clusters of facets that are elements together.
    pub fn clusters(&self) -> Clusters<'m> {
        self.clusters
    }
}

/// The least value that is to be cut: those below sum up to half of `left` at most, those from it on are `cuts` at
/// most.
fn threshold<V: Iterator<Item = f64>>(values: impl Fn() -> V, left: f64, cuts: usize) -> f64 {
    if values().sum::<f64>() <= left || cuts == 0 {
        return f64::INFINITY;
    }
    let mut threshold = values().fold(0.0, |a: f64, b| a.max(b));
    while values().filter(|v| *v < threshold).sum::<f64>() > 0.5 * left && threshold > f64::MIN_POSITIVE {
        threshold *= 0.8;
    }
    while values().filter(|v| *v >= threshold).count() > cuts {
        threshold *= 1.1;
    }
    threshold
}

impl Level<'_> {
    /// Triangles.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Probes the triangles of `range`: how far what arrives departs from a linear function of the position, as a
    /// variance (of shares of the hemisphere) free of the rays' noise; where noise hides it, what `out` held before
    /// (at most the noise). Returns the rays traced.
    ///
    /// From 16 points of each side go up to `rays` rays ([`PROBE_RAYS_MOST`] at most), along the same directions: what all
    /// points see alike brings no noise. The product of what two halves of the directions leave of a linear function is
    /// free of the noise's bias. Rays end as soon as they settle the matter.
    pub fn probe(
        &self,
        scene: &Scene<'_>,
        bvh: &Bvh<'_>,
        plane_sides: &PlaneSides<'_>,
        (rays, budget): (u32, &ErrorBudget),
        range: Range<usize>,
        out: &mut [f64],
    ) -> Result<u64, Error> {
        if out.len() != span(&range) {
            return Err(Error::Length { what: "unevenness", expected: span(&range), given: out.len() });
        }
        let rays = rays.clamp(PROBE_RAYS_FEWEST, PROBE_RAYS_MOST);
        let many = most_elements(self.roots, budget.solution) as f64;
        let mut probe = Probe { scene, bvh, plane_sides, rays, negligible: 0.0, traced: 0 };
        for (node, value) in self.nodes.part(range).iter().zip(out) {
            let expected = core::mem::take(value);
            let facet = node.facet as usize;
            let rho = scene.largest_diffuse_of(facet);
            if scene.areas().at(facet) == 0.0 || rho == 0.0 || node.cluster != 0 {
                continue;
            }
            let share = Path(node.path).share() * scene.areas().at(facet) / self.area;
            probe.negligible = budget.probes / (rho * rho) * (1.0 / (many * share)).max(1.0);
            for side in 0..scene.sides() {
                if node.path == 0 && opens_to_sky(scene, bvh, facet, scene.side_normal(facet, side)) {
                    continue;
                }
                *value = if *value == DETAILED || probe.has_detail(node, side) {
                    DETAILED
                } else {
                    value.max(probe.side(node, side, expected))
                };
            }
        }
        Ok(probe.traced)
    }
}

struct Probe<'a> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    plane_sides: &'a PlaneSides<'a>,
    rays: u32,
    /// An unevenness that need not be known better.
    negligible: f64,
    traced: u64,
}

/// Facets whose form factors are computed together, and by how much each is brighter than the sky.
struct Together {
    block: TriangleBlock,
    brightness: [f64; TRIANGLE_LANES],
    count: usize,
}

impl Together {
    fn put(&mut self, triangle: &[Vec3; 3], brightness: f64) {
        self.block.set(self.count, triangle);
        self.brightness.set(self.count, brightness);
        self.count += 1;
    }

    /// Adds what they send to each point, and forgets them.
    fn take(&mut self, isa: Isa, points: &[Vec3; PROBE_POINTS], normal: Vec3, sums: &mut Sums) {
        for (sum, point) in sums.iter_mut().zip(points) {
            let mut factors = [[0.0; TRIANGLE_LANES]];
            point_to_triangles(isa, *point, normal, core::slice::from_ref(&self.block), &mut factors);
            let terms = factors[0].iter().zip(&self.brightness).take(self.count);
            *sum += terms.map(|(factor, brightness)| factor * brightness).sum::<f64>();
        }
        self.count = 0;
    }
}

/// Sums over the rays of each point.
type Sums = [f64; PROBE_POINTS];

impl Probe<'_> {
    /// Whether what stands close before one side of a triangle is far smaller than it.
    fn has_detail(&self, node: &Node, side: usize) -> bool {
        let facet = node.facet as usize;
        let (path, normal) = (Path(node.path), self.scene.side_normal(facet, side));
        let size = sqrt(path.share() * self.scene.areas().at(facet));
        let corners = path.corners(&self.scene.corners().at(facet));
        let (small, reach) = (DETAIL * size, DETAIL_REACH * size);
        path.depth() < Path::DEEPEST
            && self.bvh.is_own()
            && DetailSearch { corners, normal, small, reach, most: DETAIL_FACETS }.finds(self.bvh, false)
    }

    /// Unevenness of one side of a triangle.
    fn side(&mut self, node: &Node, side: usize, expected: f64) -> f64 {
        let facet = node.facet as usize;
        let normal = self.scene.side_normal(facet, side);
        // only the points differ: surfaces of their own would enlarge the stack frame
        let points = core::array::from_fn(|point| {
            let (a, b) = middle(point);
            let (u, v) = Path(node.path).out_of(a, b);
            Surface::new(self.scene, facet, side, u, v).point
        });
        if let Some(even) = self.closed(node, side, &points) {
            return even;
        }
        let from = Surface::new(self.scene, facet, side, 0.0, 0.0);
        let (x, y) = frame(normal);
        let sequence = Sequence::new(hash2((facet * 2 + side) as u32, 0x5b0b_e000 ^ node.path));
        let (mut sums, mut half, mut backs) =
            ([0.0; PROBE_POINTS], [0.0; PROBE_POINTS], [0u32; PROBE_POINTS]);
        let (mut index, mut goal) = (0, PROBE_RAYS_FEWEST.min(self.rays));
        loop {
            while index < goal {
                if 2 * index == goal {
                    half = sums;
                }
                let (p, q) = sequence.pair(index, 0);
                let (dx, dy, dz) = cosine_direction(p, q);
                let direction = x * dx + y * dy + normal * dz;
                self.shoot((&from, &points), direction, &mut sums, &mut backs);
                index += 1;
            }
            let inside = |backs: u32| f64::from(backs) >= INSIDE * f64::from(index);
            let seen = backs.map(|b| !inside(b));
            let (even, noise) = residuals(&half, &sums, &seen, 0.5 * f64::from(index));
            if even + noise < self.negligible || even > UNEVENNESS_CLEAR * noise {
                return even;
            }
            if goal >= self.rays {
                return if even > UNEVENNESS_CERTAIN * noise { even } else { expected.min(noise) };
            }
            goal = (2 * goal).min(self.rays);
        }
    }

    /// Unevenness without rays, where nothing hides anything and rays would cost more.
    // not inlined: keeps its triangles out of the stack frame of the rays
    #[inline(never)]
    fn closed(&self, node: &Node, side: usize, points: &[Vec3; PROBE_POINTS]) -> Option<f64> {
        let facet = node.facet as usize;
        let normal = self.scene.side_normal(facet, side);
        let corners = Path(node.path).corners(&self.scene.corners().at(facet));
        let receiver = Receiver { facet, side, normal, corners };
        let mut proven = [0; SIDE_SET_WORDS];
        let mut clear = ProvenVisible::new(&mut proven);
        if !clear.prove_whole(self.scene, self.plane_sides, &receiver, PROBE_CLOSED_FORMS_MOST) {
            return None;
        }
        Some(self.closed_residuals(&receiver, &clear, points))
    }

    /// The unevenness of a triangle whose visible facets are all proven, by closed forms.
    // not inlined: keeps its sums out of the stack frame of the proof
    #[inline(never)]
    fn closed_residuals(
        &self,
        receiver: &Receiver,
        clear: &ProvenVisible<'_>,
        points: &[Vec3; PROBE_POINTS],
    ) -> f64 {
        let Receiver { facet, side, normal, .. } = *receiver;
        let mut sums = [1.0; PROBE_POINTS];
        let mut together =
            Together { block: TriangleBlock::EMPTY, brightness: [0.0; TRIANGLE_LANES], count: 0 };
        for other in self.plane_sides.before(facet, side) {
            let (triangle, sides) = (self.scene.corners().at(other), self.scene.sides());
            for other_side in (0..sides).filter(|&s| clear.has(other, s, sides)) {
                let surface = Surface::new(self.scene, other, other_side, 1.0 / 3.0, 1.0 / 3.0);
                let brightness = self.brightness(&surface) - 1.0;
                if receiver.faces(self.scene, (other, other_side), &triangle) {
                    together.put(&triangle, brightness);
                    if together.count == TRIANGLE_LANES {
                        together.take(self.bvh.isa(), points, normal, &mut sums);
                    }
                    continue;
                }
                for (sum, &point) in sums.iter_mut().zip(points) {
                    if (point - surface.point).dot(surface.normal) > 0.0 {
                        *sum += brightness * point_to_triangle(point, normal, &triangle);
                    }
                }
            }
        }
        together.take(self.bvh.isa(), points, normal, &mut sums);
        let half = sums.map(|sum| 0.5 * sum);
        residuals(&half, &sums, &[true; PROBE_POINTS], 0.5).0
    }

    /// One ray from each point of the facet side that `from` stands for, all along one direction.
    #[inline]
    fn shoot(
        &mut self,
        (from, points): (&Surface, &[Vec3; PROBE_POINTS]),
        direction: Vec3,
        sums: &mut Sums,
        backs: &mut [u32; PROBE_POINTS],
    ) {
        let mut ahead = AnswerBuffer::default();
        let any = |n: u32| Surface { point: points.at(n as usize), ..*from }.spawn_ray(direction);
        for ((n, sum), backs) in (0..PROBE_POINTS as u32).zip(sums).zip(backs) {
            *sum += match self.bvh.closest_of(&mut ahead, n, PROBE_POINTS as u32, any) {
                None => 1.0,
                Some(hit) => match Surface::of_hit(self.scene, &hit) {
                    None => {
                        *backs += 1;
                        0.0
                    }
                    Some(surface) => self.brightness(&surface),
                },
            };
        }
        self.traced += PROBE_POINTS as u64;
    }

    /// What a facet may send, the sky sending 1: before light is known, facets are told apart by where they face.
    #[inline]
    fn brightness(&self, surface: &Surface) -> f64 {
        let most = |values: &[f64]| values.iter().fold(0.0, |a: f64, &b| a.max(b));
        if most(self.scene.emission(surface.material)) > 0.0 {
            return 1.0;
        }
        let toward = Vec3::new(0.36, 0.48, 0.8);
        // a mirror shows some of both
        let mirrored = if most(self.scene.specular(surface.material)) > 0.0 { 0.5 } else { 0.0 };
        0.5 * most(self.scene.diffuse(surface.material)) * (1.0 + surface.normal.dot(toward)) + mirrored
    }
}

/// The middle of a quarter's quarter, in weights of corners 1 and 2.
fn middle(point: usize) -> (f64, f64) {
    out_of(point / QUARTERS, out_of(point % QUARTERS, (1.0 / 3.0, 1.0 / 3.0)))
}

/// Unevenness by the product of both halves' residuals about their best linear functions over the points seen, and the
/// noise of a half in it. `half` and `all` are sums over the first half's and all rays; a half has `rays` rays.
#[inline(never)]
fn residuals(half: &Sums, all: &Sums, seen: &[bool; PROBE_POINTS], rays: f64) -> (f64, f64) {
    let count = seen.iter().filter(|s| **s).count() as f64;
    if count == 0.0 {
        return (0.0, 0.0);
    }
    // moments about the middle of the points seen: of the weights x, y, of the halves' means a, b
    let mut means = [0.0; 4];
    let row = |point: usize| {
        let (x, y) = middle(point);
        [x, y, half.at(point) / rays, (all.at(point) - half.at(point)) / rays]
    };
    let points = || (0..PROBE_POINTS).filter(|p| seen.at(*p));
    points().for_each(|p| means.iter_mut().zip(row(p)).for_each(|(m, v)| *m += v / count));
    let mut products = [[0.0; 4]; 4];
    for p in points() {
        let mut r = row(p);
        r.iter_mut().zip(means).for_each(|(v, m)| *v -= m);
        for (line, a) in products.iter_mut().zip(r) {
            line.iter_mut().zip(r).for_each(|(s, b)| *s += a * b);
        }
    }
    let [[xx, xy, xa, xb], [_, yy, ya, yb], [_, _, aa, ab], [_, _, _, bb]] = products;
    let determinant = xx * yy - xy * xy;
    let hidden = 1.0 - count / PROBE_POINTS as f64;
    if hidden > 0.0 {
        // no linear function is known where quarters are hidden, nor what the points beside their edge see
        let freedom = (count - 1.0).max(1.0);
        let cross = ab / freedom + HALF_HIDDEN_UNEVENNESS * hidden * (1.0 - hidden);
        return (cross, (0.5 * (aa + bb) - ab).max(0.0) / freedom);
    }
    let explained = |(x, y): (f64, f64), (z, w): (f64, f64)| {
        (yy * x * z - xy * (x * w + y * z) + xx * y * w) / determinant
    };
    let (a, b) = ((xa, ya), (xb, yb));
    let cross = ab - explained(a, b);
    let squares = aa - explained(a, a) + bb - explained(b, b);
    let freedom = (count - 3.0).max(1.0);
    (cross / freedom, (0.5 * squares - cross).max(0.0) / freedom)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_is_uneven_and_a_slope_is_not() {
        let of = |f: fn(f64, f64) -> f64, error: f64| {
            let mut sums = [[0.0; PROBE_POINTS]; 2];
            let [half, all] = &mut sums;
            for (point, (half, all)) in half.iter_mut().zip(all).enumerate() {
                let (x, y) = middle(point);
                // errors of opposite signs in the halves
                let noise = if point % 3 == 0 { error } else { 0.0 };
                *half = 500.0 * (f(x, y) + noise);
                *all = *half + 500.0 * (f(x, y) - noise);
            }
            residuals(&sums[0], &sums[1], &[true; PROBE_POINTS], 500.0)
        };
        let (even, noise) = of(|x, y| 0.2 + 0.3 * x + 0.4 * y, 0.0);
        assert!(even.abs() < 1e-15 && noise < 1e-15); // rounding
        let (jump, _) = of(|x, _| if x < 0.3 { 1.0 } else { 0.1 }, 0.0);
        assert!(jump > 0.03);
        let (even, noise) = of(|x, _| 0.3 * x, 0.1);
        assert!(noise > 1e-3 && even < 0.0, "noise of opposite signs is no unevenness: {even}");
    }

    #[test]
    fn points_inside_bodies_do_not_count() {
        let of = |inside: f64| {
            let (mut sums, mut seen) = ([[0.0; PROBE_POINTS]; 2], [true; PROBE_POINTS]);
            let [half, all] = &mut sums;
            for (point, ((half, all), seen)) in half.iter_mut().zip(all).zip(&mut seen).enumerate() {
                let (x, y) = middle(point);
                *seen = x + y < 0.7;
                *half = if *seen { 1.0 + x - y } else { inside };
                *all = 2.0 * *half;
            }
            residuals(&sums[0], &sums[1], &seen, 1.0)
        };
        assert_eq!(of(0.0), of(9.0));
        assert!(of(0.0).0 > 0.01, "but their edge does");
    }

    #[test]
    fn the_least_errors_stay() {
        let values = [1.0, 2.0, 4.0, 8.0, 100.0];
        assert_eq!(threshold(|| values.into_iter(), 200.0, 5), f64::INFINITY);
        assert_eq!(threshold(|| values.into_iter(), 1.0, 0), f64::INFINITY);
        let within = threshold(|| values.into_iter(), 7.0, 5);
        assert!(within > 2.0 && within <= 4.0);
        let few = threshold(|| values.into_iter(), 7.0, 1);
        assert!(few > 8.0 && few <= 100.0);
    }
}
