//! One ray through the tree: eight boxes at a time in f32, four facets at a time in f64.
//!
//! **Boxes are conservative.** A facet that the ray hits at `t` in the arithmetic of [`ray`](crate::ray) lies in
//! boxes that are never culled while the limit is at least `t`. The hit arithmetic accepts no facet whose box,
//! widened by 2^-46 of the corner's distance, the ray misses, and no `t` before its entry into that box. The slab
//! test works with the ray's origin moved outward on every axis by `pad`, which exceeds that slack, the rounding
//! of the origin to f32 and the effect of replacing small direction components; its subtraction therefore has the
//! right sign, and what is left is three roundings of 2^-24 relative, which [`WIDEN`] covers.

use super::{Boxes, Bvh, LEAF, PAIR, Packet};
use crate::math::{Vec3, fabs};
use crate::ray::{Hit, Line, Ray};
use crate::simd::{self, Task};

/// Factor on the far side of slabs: 1 + 2^-20, above the (1 + 2^-24)^8 that near and far sides need together.
const WIDEN: f32 = 1.0 + 1.0 / (1u32 << 20) as f32;

/// Direction components below this are raised to it in the slab test: across the whole scene it moves the ray
/// by far less than `pad`, and keeps the quotients finite in f32.
const SMALLEST: f64 = 1e-18;

/// Entries of the short stack, enough for nine levels of nodes.
const SHORT: usize = 64;

/// Entries that the deepest tree needs: seven a level, at most 69 levels.
const LONG: usize = 512;

/// See [`Bvh::closest`].
pub(super) fn closest(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
    simd::run(bvh.isa, Search::<false> { bvh, ray })
}

/// See [`Bvh::occluded`].
pub(super) fn occluded(bvh: &Bvh, ray: &Ray) -> bool {
    simd::run(bvh.isa, Search::<true> { bvh, ray }).is_some()
}

/// The search for the first hit, or for any.
struct Search<'a, const ANY: bool> {
    bvh: &'a Bvh<'a>,
    ray: &'a Ray,
}

impl<const ANY: bool> Task for Search<'_, ANY> {
    type Out = Option<Hit>;

    #[inline(always)]
    fn run(self) -> Option<Hit> {
        if self.bvh.levels * 7 < SHORT {
            Walk::new(self.bvh, self.ray)?.search::<ANY, SHORT>()
        } else {
            Walk::new(self.bvh, self.ray)?.search::<ANY, LONG>()
        }
    }
}

/// A ray on its way, and the best hit so far.
struct Walk<'a> {
    bvh: &'a Bvh<'a>,
    ray: &'a Ray,
    line: Line,
    /// Which side of a box the ray meets first, by axis.
    side: [usize; 3],
    /// Origin for the near and the far sides, and 1/direction.
    near: [f32; 3],
    far: [f32; 3],
    inverse: [f32; 3],
    /// Where the f32 origin stands on the ray, and how far it was moved outward.
    start: f64,
    pad: f64,
    best: Option<Hit>,
    /// Hits must lie before this; equal `t` counts when the facet's index is lower.
    nearest: f64,
    /// `nearest` for the boxes: from `start`, rounded up.
    limit: f32,
}

impl<'a> Walk<'a> {
    /// `None` where the ray meets nothing for certain.
    #[inline(always)]
    fn new(bvh: &'a Bvh<'a>, ray: &'a Ray) -> Option<Self> {
        let line = Line::new(ray)?;
        let scale = bvh.low.abs().max(bvh.high.abs()).max_element();
        let distance = ray.origin.abs().max_element();
        // 2^-20 of the scene is 4 times the rounding of an origin within 4 times its size.
        let pad = scale * (1.0 / (1u64 << 20) as f64) + distance * (1.0 / (1u64 << 44) as f64);
        let mut origin = ray.origin;
        let mut start = 0.0;
        if distance > 4.0 * scale {
            start = entry(bvh, ray.origin, line.inverse, pad)?;
            origin += ray.direction * start;
        }
        let direction = ray.direction.to_array();
        let inverse =
            direction.map(|c| if fabs(c) > SMALLEST { (1.0 / c) as f32 } else { (1.0 / SMALLEST) as f32 });
        let outward = inverse.map(|c| if c < 0.0 { -pad } else { pad });
        let origin = origin.to_array();
        let mut walk = Walk {
            bvh,
            ray,
            line,
            side: inverse.map(|c| usize::from(c < 0.0)),
            near: [0, 1, 2].map(|k| (origin[k] + outward[k]) as f32),
            far: [0, 1, 2].map(|k| (origin[k] - outward[k]) as f32),
            inverse,
            start,
            pad,
            best: None,
            nearest: ray.t_max,
            limit: 0.0,
        };
        walk.shorten(ray.t_max);
        Some(walk)
    }

    /// Sets the limit to the hit distance `t`.
    #[inline(always)]
    fn shorten(&mut self, t: f64) {
        self.nearest = t;
        self.limit = (t - self.start + self.pad) as f32 * WIDEN;
    }

    /// The walk itself: nearest child first, the rest on the stack with their distances.
    #[inline(always)]
    fn search<const ANY: bool, const N: usize>(mut self) -> Option<Hit> {
        let mut stack = [0u64; N];
        let mut top = 0;
        let mut next = if self.bvh.boxes.is_empty() { return None } else { 0u32 };
        loop {
            if next & LEAF == 0 {
                let boxes = self.bvh.boxes.get(next as usize)?;
                let children = self.bvh.children.get(next as usize)?;
                let (near, mut hits) = self.slabs(boxes);
                let bottom = top;
                while hits != 0 {
                    let child = hits.trailing_zeros() as usize & 7;
                    hits &= hits - 1;
                    let entry = u64::from(near[child].to_bits()) << 32 | u64::from(children[child]);
                    push(&mut stack, bottom, &mut top, entry);
                }
            } else {
                self.leaf(next);
                if ANY && self.best.is_some() {
                    return self.best;
                }
            }
            next = loop {
                if top == 0 {
                    return self.best;
                }
                top -= 1;
                let entry = stack.get(top).copied()?;
                if f32::from_bits((entry >> 32) as u32) <= self.limit {
                    break entry as u32;
                }
            };
        }
    }

    /// Where the ray enters the eight boxes, and which of them it meets before the limit, as bits.
    #[inline(always)]
    fn slabs(&self, boxes: &Boxes) -> ([f32; 8], u32) {
        let mut near = [0.0f32; 8];
        let mut far = [f32::INFINITY; 8];
        for axis in 0..3 {
            let (first, second) =
                (&boxes[axis][self.side[axis] & 1], &boxes[axis][1 - (self.side[axis] & 1)]);
            for i in 0..8 {
                let a = (first[i] - self.near[axis]) * self.inverse[axis];
                let b = (second[i] - self.far[axis]) * self.inverse[axis];
                near[i] = if a > near[i] { a } else { near[i] };
                far[i] = if b < far[i] { b } else { far[i] };
            }
        }
        let mut hits = 0;
        for i in 0..8 {
            let widened = far[i] * WIDEN;
            let end = if self.limit < widened { self.limit } else { widened };
            hits |= u32::from(near[i] <= end) << i;
        }
        (near, hits)
    }

    /// Tests the packets of a leaf.
    #[inline(always)]
    fn leaf(&mut self, leaf: u32) {
        let first = (leaf & !(LEAF | PAIR)) as usize;
        self.packet(first);
        if leaf & PAIR != 0 {
            self.packet(first + 1);
        }
    }

    #[inline(always)]
    fn packet(&mut self, index: usize) {
        let bvh = self.bvh;
        let (Some(packet), Some(facets)) = (bvh.packets.get(index), bvh.facets.get(index)) else { return };
        let (edges, mut inside) = self.edges(packet);
        while inside != 0 {
            let lane = inside.trailing_zeros() as usize & 3;
            inside &= inside - 1;
            self.facet(packet, facets[lane], lane, edges.map(|e| e[lane]));
        }
    }

    /// The edge functions of four facets, and which facets may have the ray inside: [`Line::edges`], lane by lane.
    #[inline(always)]
    fn edges(&self, packet: &Packet) -> ([[f64; 4]; 3], u32) {
        let [first, second, along] = self.line.axes;
        let origin = self.ray.origin.to_array();
        let mut images = [[[0.0f64; 4]; 2]; 3];
        for (image, corner) in images.iter_mut().zip(packet) {
            for i in 0..4 {
                let mut moved = [0.0; 3];
                moved[along] = corner[along][i] - origin[along];
                image[0][i] = (corner[first][i] - origin[first]) - self.line.shear[0] * moved[along];
                image[1][i] = (corner[second][i] - origin[second]) - self.line.shear[1] * moved[along];
            }
        }
        let [a, b, c] = images;
        let mut edges = [[0.0f64; 4]; 3];
        let mut inside = 0;
        for i in 0..4 {
            let at = |image: [[f64; 4]; 2]| [image[0][i], image[1][i]];
            let [e0, e1, e2] = self.line.edges([at(a), at(b), at(c)]);
            (edges[0][i], edges[1][i], edges[2][i]) = (e0, e1, e2);
            let least = if e0 < e1 { e0 } else { e1 };
            let least = if e2 < least { e2 } else { least };
            let most = if e0 > e1 { e0 } else { e1 };
            let most = if e2 > most { e2 } else { most };
            inside |= u32::from((least >= 0.0) | (most <= 0.0)) << i;
        }
        (edges, inside)
    }

    /// Takes the hit with one facet where it is better than the best so far.
    #[inline(always)]
    fn facet(&mut self, packet: &Packet, facet: u32, lane: usize, edges: [f64; 3]) {
        if facet == self.ray.skip {
            return;
        }
        let [a, b, c, normal] = (*packet).map(|rows| Vec3::from_array(rows.map(|row| row[lane])));
        let origin = self.ray.origin;
        let Some(hit) = self.line.hit(facet, edges, [a - origin, b - origin, c - origin], normal) else {
            return;
        };
        let tie = hit.t == self.nearest && self.best.is_some_and(|best| facet < best.facet);
        if hit.t < self.nearest || tie {
            self.shorten(hit.t);
            self.best = Some(hit);
        }
    }
}

/// Puts an entry on the stack, which above `bottom` is sorted so that the nearest comes off first.
#[inline(always)]
fn push<const N: usize>(stack: &mut [u64; N], bottom: usize, top: &mut usize, entry: u64) {
    let mut place = (*top).min(N - 1);
    while place > bottom && stack[place - 1] < entry {
        stack[place] = stack[place - 1];
        place -= 1;
    }
    stack[place] = entry;
    *top = (*top).min(N - 1) + 1;
}

/// Where a ray from afar enters the mesh's box, at least 0; `None` where it misses.
fn entry(bvh: &Bvh, origin: Vec3, inverse: Vec3, pad: f64) -> Option<f64> {
    let margin = inverse.abs() * pad;
    let (a, b) = ((bvh.low - origin) * inverse, (bvh.high - origin) * inverse);
    let near = (a.min(b) - margin).max_element();
    let far = (a.max(b) + margin).min_element();
    let start = if near > 0.0 { near } else { 0.0 };
    (start <= far).then_some(start)
}
