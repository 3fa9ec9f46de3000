//! Facets that reach into a convex region: of a row of pixels, or of parallel rays that leave a facet.
//!
//! Constants of this file are measured by `cargo test --test bvh` (no facet is lost).

use super::path_stack::{EMPTY_STACK, push, top};
use super::{Boxes, Bvh, LEAF_CHILD, PACKET_LANES, PAIR, Packet};
use crate::base::math::{Vec3, fabs};
use crate::base::simd::{self, LaneTask, Lanes};
use crate::rays::ray::{First, Hit, Line, Ray};

/// A half space: points p with p.normal >= height; `normal` is a unit vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfSpace {
    pub normal: Vec3,
    pub height: f64,
}

impl Bvh<'_> {
    /// Whether hits come from this tree, not from a tracer of the caller's.
    pub(crate) fn is_own(&self) -> bool {
        self.external.is_none()
    }

    /// Calls `visit` with all facets that reach into the region common to all halves, and maybe others, until it
    /// returns false. A facet is left out where all its corners are outside of one half for certain: to 4 roundings of
    /// a coordinate and of the height.
    pub(crate) fn within<const N: usize>(&self, halves: &[HalfSpace; N], visit: impl FnMut(u32) -> bool) {
        simd::run_lanes(self.isa, Within { bvh: self, halves, visit });
    }

    /// Corners and normal (of any length) of a facet.
    #[inline(always)]
    pub(crate) fn corners(&self, facet: u32) -> Option<([Vec3; 3], Vec3)> {
        let [a, b, c, normal] = self.solids.get(facet as usize)?.map(Vec3::from_array);
        Some(([a, b, c], normal))
    }

    /// The ray's hit with this facet, in the arithmetic of all hits; `line` is the ray's, or that of a parallel one.
    #[inline]
    pub(crate) fn meet(&self, line: &Line, ray: &Ray, facet: u32) -> Option<Hit> {
        let &[a, b, c, normal] = self.solids.get(facet as usize)?;
        let moved = [a, b, c].map(|corner| Vec3::from_array(corner) - ray.origin);
        let edges = line.edges(moved.map(|m| line.image(m.to_array())));
        line.hit(facet, edges, moved, Vec3::from_array(normal))
    }

    /// [`Bvh::closest`] where the ray can meet none but these facets.
    #[inline]
    pub(crate) fn closest_among(&self, ray: &Ray, facets: &[u32]) -> Option<Hit> {
        let line = Line::new(ray)?;
        let (mut first, mut best) = (First::new(self.scale, ray.t_max), None);
        for &facet in facets.iter().filter(|facet| **facet != ray.skip) {
            if let Some(hit) = self.meet(&line, ray, facet) {
                first.note(hit, &mut best);
            }
        }
        best
    }
}

struct Within<'a, F, const N: usize> {
    bvh: &'a Bvh<'a>,
    halves: &'a [HalfSpace; N],
    visit: F,
}

impl<F: FnMut(u32) -> bool, const N: usize> LaneTask for Within<'_, F, N> {
    type Out = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let bvh = self.bvh;
        let mut planes = [Plane::new(lanes, &HalfSpace { normal: Vec3::ZERO, height: 0.0 }, 0.0); N];
        for (plane, half) in planes.iter_mut().zip(self.halves) {
            *plane = Plane::new(lanes, half, bvh.scale);
        }
        let (mut stack, mut depth) = (EMPTY_STACK, 0);
        let mut next = 0;
        loop {
            if next & LEAF_CHILD == 0 {
                let Some(boxes) = bvh.boxes.get(next as usize) else { return };
                // loops rather than closures, which are not inlined into code compiled for another instruction set
                let mut reached = 0xff;
                for plane in &planes {
                    reached &= plane.reached_by_boxes(boxes);
                }
                push(&mut stack, &mut depth, next, reached);
            } else if !self.leaf(&planes, next) {
                return;
            }
            let Some((node, left)) = top(&mut stack, &mut depth) else { return };
            let child = left.ilog2() as usize & 7;
            *left &= !(1 << child);
            let Some(children) = bvh.children.get(*node as usize) else { return };
            next = children[child];
        }
    }
}

impl<F: FnMut(u32) -> bool, const N: usize> Within<'_, F, N> {
    /// False where that was enough.
    #[inline(always)]
    fn leaf<L: Lanes>(&mut self, planes: &[Plane<L>; N], leaf: u32) -> bool {
        let first = (leaf & !(LEAF_CHILD | PAIR)) as usize;
        for index in first..=first + usize::from(leaf & PAIR != 0) {
            let Some((packet, _, facets)) = self.bvh.lanes(index) else { return false };
            let mut left = 0xff;
            for plane in planes {
                left &= plane.reached_by_facets(packet);
            }
            while left != 0 {
                let facet = facets[left.trailing_zeros() as usize % PACKET_LANES];
                left &= left - 1;
                if self.reaches(facet) && !(self.visit)(facet) {
                    return false;
                }
            }
        }
        true
    }

    #[inline(always)]
    fn reaches(&self, facet: u32) -> bool {
        let Some([a, b, c, _]) = self.bvh.solids.get(facet as usize) else { return false };
        let corners = [a, b, c].map(|&corner| Vec3::from_array(corner));
        self.halves.iter().all(|half| {
            let slack = HALF_SPACE_ROUNDING * (self.bvh.scale + fabs(half.height));
            corners.iter().any(|corner| corner.dot(half.normal) >= half.height - slack)
        })
    }
}

/// Error of p.normal - height in f64, in units of the coordinates: a dot product's and the height's roundings.
const HALF_SPACE_ROUNDING: f64 = 4.0 / (1u64 << 53) as f64;

/// The same in f32: roundings of the normal, of three products and their sums, and of the coordinates of facets.
const SLACK32: f64 = 1.0 / (1u64 << 20) as f64;

/// A half space in every lane.
#[derive(Clone, Copy)]
struct Plane<L: Lanes> {
    lanes: L,
    /// The first component, and those of the others with the sign changed: lanes subtract and do not add.
    normal: [L::Same; 3],
    /// Which side of a box is farthest along the normal.
    side: [usize; 3],
    height: L::Same,
}

impl<L: Lanes> Plane<L> {
    #[inline(always)]
    fn new(lanes: L, half: &HalfSpace, scale: f64) -> Plane<L> {
        let [x, y, z] = half.normal.to_array();
        let height = half.height - SLACK32 * (scale + fabs(half.height));
        Plane {
            lanes,
            normal: [lanes.same(x as f32), lanes.same(-y as f32), lanes.same(-z as f32)],
            side: [usize::from(x > 0.0), usize::from(y > 0.0), usize::from(z > 0.0)],
            height: lanes.same(height as f32),
        }
    }

    /// The boxes that reach into the half space; places without a child do not.
    #[inline(always)]
    fn reached_by_boxes(&self, boxes: &Boxes) -> u32 {
        let [x, y, z] = self.side;
        let corner = [&boxes[0][x & 1], &boxes[1][y & 1], &boxes[2][z & 1]];
        self.lanes.le8(self.lanes.lanes(self.height), self.dot(corner))
    }

    #[inline(always)]
    fn reached_by_facets(&self, packet: &Packet) -> u32 {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = packet;
        let (a, b, c) = (self.dot([ax, ay, az]), self.dot([bx, by, bz]), self.dot([cx, cy, cz]));
        let lanes = self.lanes;
        lanes.le8(lanes.lanes(self.height), lanes.max8(lanes.max8(a, b), c))
    }

    #[inline(always)]
    fn dot(&self, [x, y, z]: [&[f32; 8]; 3]) -> L::F8 {
        let lanes = self.lanes;
        let sum = lanes.mul8(lanes.load8(x), lanes.lanes(self.normal[0]));
        let sum = lanes.sub8(sum, lanes.mul8(lanes.load8(y), lanes.lanes(self.normal[1])));
        lanes.sub8(sum, lanes.mul8(lanes.load8(z), lanes.lanes(self.normal[2])))
    }
}
