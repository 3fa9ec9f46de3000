//! One ray through the tree: eight boxes at a time in f32, four facets at a time in f64.
//!
//! **Boxes are conservative.** A facet that the ray hits at `t` in the arithmetic of [`ray`](crate::ray) lies in
//! boxes that are never culled while the limit is at least `t`. The hit arithmetic accepts no facet whose box,
//! widened by 2^-46 of the corner's distance, the ray misses, and no `t` more than 2^-40 of it before the entry into
//! that box. The slab
//! test works with the ray's origin moved outward on every axis by `pad`, which exceeds those, the rounding
//! of the origin to f32 and the effect of replacing small direction components; its subtraction therefore has the
//! right sign, and what is left is three roundings of 2^-24 relative, which [`WIDEN`] covers.

use super::{Boxes, Bvh, LEAF, PAIR, Packet, STACK};
use crate::index::{Index, IndexMut};
use crate::math::{Vec3, fabs};
use crate::ray::{Hit, Line, Ray};
use crate::simd::{self, LaneTask, Lanes};

/// Factor on the far side of slabs: 1 + 2^-20, above the (1 + 2^-24)^8 that near and far sides need together.
const WIDEN: f32 = 1.0 + 1.0 / (1u32 << 20) as f32;

/// Direction components below this are raised to it in the slab test: across the whole scene it moves the ray
/// by far less than `pad`, and keeps the quotients finite in f32.
const SMALLEST: f64 = 1e-18;

/// Entries of the short stack, enough for nine levels of nodes.
const SHORT: usize = 64;

/// See [`Bvh::closest`].
pub(super) fn closest(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
    if bvh.levels * 7 < SHORT { search::<false, SHORT>(bvh, ray) } else { deep::<false>(bvh, ray) }
}

/// See [`Bvh::occluded`].
pub(super) fn occluded(bvh: &Bvh, ray: &Ray) -> bool {
    let hit = if bvh.levels * 7 < SHORT { search::<true, SHORT>(bvh, ray) } else { deep::<true>(bvh, ray) };
    hit.is_some()
}

#[inline(always)]
fn search<const ANY: bool, const N: usize>(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
    simd::run_lanes(bvh.isa, Search::<ANY, N> { bvh, ray })
}

/// Apart, so that only who has a deep tree pays for the long stack.
#[inline(never)]
fn deep<const ANY: bool>(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
    search::<ANY, STACK>(bvh, ray)
}

/// The search for the first hit, or for any.
struct Search<'a, const ANY: bool, const N: usize> {
    bvh: &'a Bvh<'a>,
    ray: &'a Ray,
}

impl<const ANY: bool, const N: usize> LaneTask for Search<'_, ANY, N> {
    type Out = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<Hit> {
        Walk::new(self.bvh, self.ray)?.search::<L, ANY, N>(lanes)
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
        let scale = bvh.scale;
        let distance = ray.origin.abs().max_element();
        // 2^-20 of the scene is 4 times the rounding of an origin within 4 times its size.
        let pad = scale * (1.0 / (1u64 << 20) as f64) + distance * (1.0 / (1u64 << 38) as f64);
        let mut origin = ray.origin;
        let mut start = 0.0;
        if distance > 4.0 * scale {
            start = entry(bvh, ray.origin, line.inverse, pad)?;
            origin += ray.direction * start;
        }
        let direction = ray.direction.to_array();
        let inverse =
            direction.map(|c| if fabs(c) > SMALLEST { (1.0 / c) as f32 } else { (1.0 / SMALLEST) as f32 });
        let outward = Vec3::from_array(inverse.map(|c| if c < 0.0 { -pad } else { pad }));
        let mut walk = Walk {
            bvh,
            ray,
            line,
            side: inverse.map(|c| usize::from(c < 0.0)),
            near: (origin + outward).to_array().map(|x| x as f32),
            far: (origin - outward).to_array().map(|x| x as f32),
            inverse,
            start,
            pad,
            best: None,
            nearest: ray.t_max,
            limit: 0.0,
        };
        // from so far away that not even the entry into the box is near it, nothing is hit; infinities would meet the
        // children that there are not
        if !walk.near.iter().chain(&walk.far).all(|x| x.is_finite()) {
            return None;
        }
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
    fn search<L: Lanes, const ANY: bool, const N: usize>(mut self, lanes: L) -> Option<Hit> {
        let beam = Beam::new(lanes, &self);
        let mut stack = [0u64; N];
        let mut top = 0;
        let mut next = if self.bvh.boxes.is_empty() { return None } else { 0 };
        loop {
            if next & LEAF == 0 {
                let boxes = self.bvh.boxes.get(next as usize)?;
                let children = self.bvh.children.get(next as usize)?;
                let (near, mut hits) = beam.slabs(boxes, self.limit);
                let near = lanes.store8(near);
                let entry = |hits: u32| {
                    let child = hits.trailing_zeros() as usize & 7;
                    u64::from(near[child].to_bits()) << 32 | u64::from(children[child])
                };
                if hits != 0 {
                    let mut nearest = entry(hits);
                    let bottom = top;
                    hits &= hits - 1;
                    while hits != 0 {
                        let other = entry(hits);
                        push(&mut stack, bottom, &mut top, nearest.max(other));
                        nearest = nearest.min(other);
                        hits &= hits - 1;
                    }
                    next = nearest as u32;
                    continue;
                }
            } else {
                self.leaf(lanes, &beam, next);
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

    /// Tests the packets of a leaf.
    #[inline(always)]
    fn leaf<L: Lanes>(&mut self, lanes: L, beam: &Beam<L>, leaf: u32) {
        let first = (leaf & !(LEAF | PAIR)) as usize;
        self.packet(lanes, beam, first);
        if leaf & PAIR != 0 {
            self.packet(lanes, beam, first + 1);
        }
    }

    #[inline(always)]
    fn packet<L: Lanes>(&mut self, lanes: L, beam: &Beam<L>, index: usize) {
        let bvh = self.bvh;
        let (Some(packet), Some(facets)) = (bvh.packets.get(index), bvh.facets.get(index)) else { return };
        let (edges, mut inside) = beam.edges(packet);
        if inside != 0 {
            let edges = [lanes.store4(edges[0]), lanes.store4(edges[1]), lanes.store4(edges[2])];
            while inside != 0 {
                let lane = inside.trailing_zeros() as usize & 3;
                inside &= inside - 1;
                self.facet(packet, facets[lane], lane, [edges[0][lane], edges[1][lane], edges[2][lane]]);
            }
        }
    }

    /// Takes the hit with one facet where it is better than the best so far.
    #[inline(always)]
    fn facet(&mut self, packet: &Packet, facet: u32, lane: usize, edges: [f64; 3]) {
        if facet == self.ray.skip {
            return;
        }
        let [a, b, c, normal] = packet;
        let origin = self.ray.origin;
        let moved = [vector(a, lane) - origin, vector(b, lane) - origin, vector(c, lane) - origin];
        let Some(hit) = self.line.hit(facet, edges, moved, vector(normal, lane)) else { return };
        let tie = hit.t == self.nearest && self.best.is_some_and(|best| facet < best.facet);
        if hit.t < self.nearest || tie {
            self.shorten(hit.t);
            self.best = Some(hit);
        }
    }
}

/// One lane of a packet's row of vectors.
#[inline(always)]
fn vector([x, y, z]: &[[f64; 4]; 3], lane: usize) -> Vec3 {
    Vec3::new(x[lane & 3], y[lane & 3], z[lane & 3])
}

/// What the lanes need of a ray, in every lane.
struct Beam<L: Lanes> {
    lanes: L,
    side: [usize; 3],
    near: [L::F8; 3],
    far: [L::F8; 3],
    inverse: [L::F8; 3],
    axes: [usize; 3],
    origin: [L::F4; 3],
    shear: [L::F4; 2],
}

impl<L: Lanes> Beam<L> {
    #[inline(always)]
    fn new(lanes: L, walk: &Walk) -> Self {
        let origin = walk.ray.origin.to_array();
        let [first, second, along] = walk.line.axes;
        let (n, f, i) = (walk.near, walk.far, walk.inverse);
        Beam {
            lanes,
            side: walk.side,
            near: [lanes.splat8(n[0]), lanes.splat8(n[1]), lanes.splat8(n[2])],
            far: [lanes.splat8(f[0]), lanes.splat8(f[1]), lanes.splat8(f[2])],
            inverse: [lanes.splat8(i[0]), lanes.splat8(i[1]), lanes.splat8(i[2])],
            axes: walk.line.axes,
            origin: [
                lanes.splat4(origin.at(first)),
                lanes.splat4(origin.at(second)),
                lanes.splat4(origin.at(along)),
            ],
            shear: [lanes.splat4(walk.line.shear[0]), lanes.splat4(walk.line.shear[1])],
        }
    }

    /// Where the ray enters the eight boxes, and which of them it meets before the limit, as bits.
    #[inline(always)]
    fn slabs(&self, boxes: &Boxes, limit: f32) -> (L::F8, u32) {
        let lanes = self.lanes;
        let mut near = lanes.splat8(0.0);
        let mut far = lanes.splat8(f32::INFINITY);
        let rays = self.near.iter().zip(&self.far).zip(&self.inverse).zip(&self.side);
        for ([low, high], (((&start, &end), &inverse), &side)) in boxes.iter().zip(rays) {
            let (first, last) = if side == 0 { (low, high) } else { (high, low) };
            let entry = lanes.sub8(lanes.load8(first), start);
            let exit = lanes.sub8(lanes.load8(last), end);
            near = lanes.max8(lanes.mul8(entry, inverse), near);
            far = lanes.min8(lanes.mul8(exit, inverse), far);
        }
        let far = lanes.min8(lanes.mul8(far, lanes.splat8(WIDEN)), lanes.splat8(limit));
        (near, lanes.le8(near, far))
    }

    /// The edge functions of four facets, and which facets may have the ray inside: [`Line::edges`], lane by lane.
    #[inline(always)]
    fn edges(&self, packet: &Packet) -> ([L::F4; 3], u32) {
        let lanes = self.lanes;
        let [a, b, c] = [self.image(&packet[0]), self.image(&packet[1]), self.image(&packet[2])];
        let edges = [self.cross(c, b), self.cross(a, c), self.cross(b, a)];
        let least = lanes.min4(lanes.min4(edges[0], edges[1]), edges[2]);
        let most = lanes.max4(lanes.max4(edges[0], edges[1]), edges[2]);
        let zero = lanes.splat4(0.0);
        (edges, lanes.le4(zero, least) | lanes.le4(most, zero))
    }

    // Methods rather than closures, which are not inlined into code compiled for another instruction set.

    #[inline(always)]
    fn image(&self, corner: &[[f64; 4]; 3]) -> [L::F4; 2] {
        let lanes = self.lanes;
        let [first, second, along] = self.axes;
        let depth = self.moved(corner, along, self.origin[2]);
        [
            lanes.sub4(self.moved(corner, first, self.origin[0]), lanes.mul4(self.shear[0], depth)),
            lanes.sub4(self.moved(corner, second, self.origin[1]), lanes.mul4(self.shear[1], depth)),
        ]
    }

    #[inline(always)]
    fn moved(&self, corner: &[[f64; 4]; 3], axis: usize, origin: L::F4) -> L::F4 {
        let row = if axis < 3 { &corner[axis] } else { &corner[0] };
        self.lanes.sub4(self.lanes.load4(row), origin)
    }

    #[inline(always)]
    fn cross(&self, p: [L::F4; 2], q: [L::F4; 2]) -> L::F4 {
        self.lanes.sub4(self.lanes.mul4(p[0], q[1]), self.lanes.mul4(p[1], q[0]))
    }
}

/// Puts an entry on the stack, which above `bottom` is sorted so that the nearest comes off first.
#[inline(always)]
fn push<const N: usize>(stack: &mut [u64; N], bottom: usize, top: &mut usize, entry: u64) {
    let mut place = (*top).min(N - 1);
    *top = place + 1;
    while place > bottom
        && let Some(&below) = stack.get(place - 1)
        && below < entry
    {
        stack.set(place, below);
        place -= 1;
    }
    stack.set(place, entry);
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
