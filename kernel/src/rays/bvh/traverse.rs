//! One ray through the tree: eight boxes at a time in f32, then eight facets, whose hits are confirmed in f64.
//!
//! **Boxes are conservative.** A facet that the ray hits at `t` in the arithmetic of [`ray`](crate::rays::ray) lies in
//! boxes that are never culled while the limit is at least `t`. The hit arithmetic accepts no facet whose box,
//! widened by 2^-46 of the corner's distance, the ray misses, and no `t` more than 2^-40 of it before the entry into
//! that box. The slab
//! test works with the ray's origin moved outward on every axis by `pad`, which exceeds those, the rounding
//! of the origin to f32 and the effect of replacing small direction components; its subtraction therefore has the
//! right sign, and what is left is five roundings of 2^-24 relative (of the direction, its inverse, the difference, the
//! product and the limit), which [`WIDEN`] covers.
//!
//! **So is the test of facets.** With s the mesh's size and u = 2^-24, the image of a corner in f32 is off by at most
//! 55 u s where the origin is within 4 s: less than e = 4 `pad`. The images of a facet that the ray meets surround
//! the origin and are no farther from it than twice the facet's extent x; products and rounding then leave its
//! edge functions off by less than e (8.5 x + 2.3 e). Nothing is turned down for less than e (16 x + 4 e).
//!
//! Constants of this file are measured by `cargo test --test bvh` (no hit is lost) and `cargo bench --bench counts`
//! (instructions).

#[cfg(not(target_pointer_width = "32"))]
use super::STACK;
#[cfg(target_pointer_width = "32")]
use super::path_stack::PathStack;
use super::path_stack::{self, EMPTY_STACK};
use super::{Boxes, Bvh, LEAF_CHILD, NO_LANE_FACET, PACKET_LANES, PAIR, Packet, Slack};
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::base::simd::{self, LaneTask, Lanes};
use crate::rays::ray::{First, Hit, Line, NEXT, Ray};
use core::marker::PhantomData;

/// Factor on the far side of slabs: 1 + 2^-20, above the (1 + 2^-24)^10 that near and far sides need together.
const WIDEN: f32 = 1.0 + 1.0 / (1u32 << 20) as f32;

/// Direction components below this are raised to it in the slab test: across the whole scene it moves the ray
/// by far less than `pad`, and keeps the quotients finite in f32.
const SLAB_DIRECTION_LEAST: f32 = 1e-18;

/// Origins from here on leave f32.
const FARTHEST: f64 = 1e38;

/// Times a facet's extent: error of its edge functions by that of the images.
pub(super) const LANE_EDGE_SLACK: f64 = 16.0;

/// Entries of the short stack, enough for nine levels of nodes.
pub(super) const STACK_SHORT: usize = 64;

/// Whether a tree's walk has a short stack: on 32 bits, where code and stack are scarce and f64 is slow, all trees have one
/// kind.
#[inline(always)]
pub(super) fn is_short(bvh: &Bvh) -> bool {
    cfg!(target_pointer_width = "64") && bvh.levels * 7 < STACK_SHORT
}

/// See [`Bvh::closest`].
pub(super) fn closest(bvh: &Bvh, ray: &Ray) -> Option<Hit> {
    search(bvh, ray, false)
}

/// See [`Bvh::occluded`].
pub(super) fn occluded(bvh: &Bvh, ray: &Ray) -> bool {
    search(bvh, ray, true).is_some()
}

/// The first hit, or, where `any` will do, the one that is found first.
fn search(bvh: &Bvh, ray: &Ray, any: bool) -> Option<Hit> {
    if is_short(bvh) { search_short(bvh, ray, any) } else { search_deep(bvh, ray, any) }
}

/// See [`Bvh::crossings`].
pub(super) fn crossings(bvh: &Bvh, ray: &Ray, visit: impl FnMut(&Hit)) -> Option<Hit> {
    simd::run_lanes(bvh.isa, Crossings { bvh, ray, visit })
}

/// Most hits of one ray that [`Bvh::crossings`] tells of.
const CROSSINGS_TOLD_MOST: usize = 64;

/// The search for all hits.
struct Crossings<'a, F> {
    bvh: &'a Bvh<'a>,
    ray: &'a Ray,
    visit: F,
}

impl<F: FnMut(&Hit)> LaneTask for Crossings<'_, F> {
    type Out = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> Option<Hit> {
        let (bvh, ray) = (self.bvh, self.ray);
        let mut walk = TraversalRay::new(bvh, ray)?;
        let line = Line::new(ray)?;
        let beam = LaneRay::new(lanes, &walk);
        let (mut stack, mut depth) = (EMPTY_STACK, 0);
        // leaves that share a packet show its facets twice
        let (mut seen, mut count) = ([0; CROSSINGS_TOLD_MOST], 0);
        let mut best = None;
        let mut next = 0;
        loop {
            if next & LEAF_CHILD == 0 {
                let (near, far) = beam.slabs(bvh.boxes.get(next as usize)?, walk.limit);
                path_stack::push(&mut stack, &mut depth, next, lanes.le8(near, far));
            } else {
                let first = (next & !(LEAF_CHILD | PAIR)) as usize;
                for index in first..=first + usize::from(next & PAIR != 0) {
                    let Some(packet) = bvh.lanes(index) else { return best };
                    let mut set = beam.inside(packet);
                    while set != 0 {
                        let facet = packet.2[set.trailing_zeros() as usize & 7];
                        set &= set - 1;
                        let Some(hit) = bvh.meet(&line, ray, facet) else { continue };
                        if count < CROSSINGS_TOLD_MOST && !seen.head(count).contains(&facet) {
                            seen.set(count, facet);
                            count += 1;
                            (self.visit)(&hit);
                        }
                        walk.first.note(hit, &mut best);
                    }
                }
            }
            let Some((node, left)) = path_stack::top(&mut stack, &mut depth) else { return best };
            let child = left.ilog2() as usize & 7;
            *left &= !(1 << child);
            next = bvh.children.get(*node as usize)?[child];
        }
    }
}

/// Search with the short stack. Not inlined: the frame of deep trees' search stays free of it.
#[inline(never)]
fn search_short(bvh: &Bvh, ray: &Ray, any: bool) -> Option<Hit> {
    simd::run_lanes(bvh.isa, Search::<[u64; STACK_SHORT]> { bvh, ray, any, stack: PhantomData })
}

/// Search with the long stack. Not inlined: its frame is paid for by deep trees alone.
#[inline(never)]
pub(super) fn search_deep(bvh: &Bvh, ray: &Ray, any: bool) -> Option<Hit> {
    #[cfg(target_pointer_width = "32")]
    return simd::run_lanes(bvh.isa, Search::<PathStack> { bvh, ray, any, stack: PhantomData });
    #[cfg(not(target_pointer_width = "32"))]
    simd::run_lanes(bvh.isa, Search::<[u64; STACK]> { bvh, ray, any, stack: PhantomData })
}

/// The search for the first hit, or for any: not two searches, which would be twice the code.
struct Search<'a, S: Stack> {
    bvh: &'a Bvh<'a>,
    ray: &'a Ray,
    any: bool,
    stack: PhantomData<S>,
}

impl<S: Stack> LaneTask for Search<'_, S> {
    type Out = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<Hit> {
        TraversalRay::new(self.bvh, self.ray)?.search::<L, S>(lanes, self.bvh, self.ray, self.any)
    }
}

/// Stack of the nodes that a search has yet to visit. Its height stands apart, so that compilers keep it in a register.
trait Stack {
    /// The empty stack.
    const EMPTY: Self;
    /// Pushes the children of a node that the ray meets (`hits`, as bits; not 0) and enters at `near`, but for the
    /// nearest, which it returns.
    fn push_children(
        &mut self,
        top: &mut usize,
        node: u32,
        children: &[u32; 8],
        near: &[f32; 8],
        hits: u32,
    ) -> u32;
    /// Pops the next child that the ray enters before its limit.
    fn pop(&mut self, top: &mut usize, ray: &TraversalRay, bvh: &Bvh) -> Option<u32>;
}

/// Children with the distances at which the ray enters them.
impl<const N: usize> Stack for [u64; N] {
    const EMPTY: Self = [0; N];

    #[inline(always)]
    fn push_children(
        &mut self,
        top: &mut usize,
        _: u32,
        children: &[u32; 8],
        near: &[f32; 8],
        mut hits: u32,
    ) -> u32 {
        let entry = |hits: u32| {
            let child = hits.trailing_zeros() as usize & 7;
            u64::from(near[child].to_bits()) << 32 | u64::from(children[child])
        };
        let mut nearest = entry(hits);
        let bottom = *top;
        hits &= hits - 1;
        while hits != 0 {
            let other = entry(hits);
            push(self, bottom, top, nearest.max(other));
            nearest = nearest.min(other);
            hits &= hits - 1;
        }
        nearest as u32
    }

    #[inline(always)]
    fn pop(&mut self, top: &mut usize, ray: &TraversalRay, _: &Bvh) -> Option<u32> {
        while *top > 0 {
            *top -= 1;
            let entry = self.get(*top).copied()?;
            if f32::from_bits((entry >> 32) as u32) <= ray.limit {
                return Some(entry as u32);
            }
        }
        None
    }
}

/// Nodes with the places of their children, four bits each, the nearest lowest; their distances are computed again. It
/// takes a seventh of the memory of children with distances.
#[cfg(target_pointer_width = "32")]
impl Stack for PathStack {
    const EMPTY: Self = EMPTY_STACK;

    #[inline(always)]
    fn push_children(
        &mut self,
        top: &mut usize,
        node: u32,
        children: &[u32; 8],
        near: &[f32; 8],
        mut hits: u32,
    ) -> u32 {
        let (mut sorted, mut count) = ([0; 8], 0);
        while hits != 0 {
            let child = hits.trailing_zeros() & 7;
            let entry = u64::from(near[child as usize].to_bits()) << 32 | u64::from(child);
            push(&mut sorted, 0, &mut count, entry);
            hits &= hits - 1;
        }
        let last = count.saturating_sub(1);
        let others = sorted.head(last).iter().fold(0, |places, &entry| places << 4 | 8 | entry as u32);
        path_stack::push(self, top, node, others);
        children[sorted.at(last) as usize & 7]
    }

    #[inline(always)]
    fn pop(&mut self, top: &mut usize, ray: &TraversalRay, bvh: &Bvh) -> Option<u32> {
        loop {
            let (node, places) = path_stack::top(self, top)?;
            let child = *places as usize & 7;
            *places >>= 4;
            let (boxes, children) = (bvh.boxes.get(*node as usize)?, bvh.children.get(*node as usize)?);
            if ray.entry(boxes, child) <= ray.limit {
                return Some(children[child]);
            }
        }
    }
}

/// A ray prepared for the traversal: origin and inverse direction in f32, limits, shear. Axes are four, so that the
/// compiler takes them together.
#[derive(Clone, Copy)]
pub(super) struct TraversalRay {
    /// Origin for the near and the far sides, and 1/direction.
    near: [f32; 4],
    far: [f32; 4],
    inverse: [f32; 4],
    /// The least distance of a hit for the boxes: from `start`, rounded up by more than what coincides lies apart.
    pub limit: f32,
    /// Which side of a box the ray meets first, by axis.
    side: [u8; 3],
    axes: [u8; 3],
    origin: [f32; 3],
    shear: [f32; 2],
    /// Error of an image.
    error: f32,
    skip: u32,
    /// Where the f32 origin stands on the ray, and how far it was moved outward.
    start: f64,
    pad: f64,
    /// The first hit so far.
    first: First,
}

impl TraversalRay {
    /// No ray.
    pub const IDLE: TraversalRay = TraversalRay {
        near: [0.0; 4],
        far: [0.0; 4],
        inverse: [0.0; 4],
        limit: 0.0,
        side: [0; 3],
        axes: [0; 3],
        origin: [0.0; 3],
        shear: [0.0; 2],
        error: 0.0,
        skip: NO_LANE_FACET,
        start: 0.0,
        pad: 0.0,
        first: First { scale: 0.0, t_max: 0.0, nearest: 0.0 },
    };

    /// `None` where the ray meets nothing for certain.
    #[inline(always)]
    pub fn new(bvh: &Bvh, ray: &Ray) -> Option<Self> {
        let scale = bvh.scale;
        let mut origin = wide(ray.origin);
        // 2^-20 of the scene is 4 times the rounding of an origin within 4 times its size.
        let mut pad = scale * (1.0 / (1u64 << 20) as f64);
        let mut start = 0.0;
        if !origin.iter().all(|x| x.abs() <= 4.0 * scale as f32) {
            let distance = ray.origin.abs().max_element();
            pad += distance * (1.0 / (1u64 << 38) as f64);
            start = entry(bvh, ray.origin, Line::inverse(ray.direction), pad)?;
            let moved = ray.origin + ray.direction * start;
            // from so far away that not even the entry into the box is near it, nothing is hit; infinities would meet
            // the children that there are not
            if moved.abs().max_element() + pad > FARTHEST {
                return None;
            }
            origin = wide(moved);
        }
        let direction = wide(ray.direction);
        let inverse =
            direction.map(|c| 1.0 / if c.abs() > SLAB_DIRECTION_LEAST { c } else { SLAB_DIRECTION_LEAST });
        let [x, y, z, _] = direction.map(f32::abs);
        let along = if (x > y) & (x > z) { 0 } else { 2 - usize::from(y > z) };
        let [first, second] = NEXT.at(along);
        let outward = pad as f32;
        let away = inverse.map(|c| if c < 0.0 { -outward } else { outward });
        let mut walk = TraversalRay {
            near: [origin[0] + away[0], origin[1] + away[1], origin[2] + away[2], origin[3] + away[3]],
            far: [origin[0] - away[0], origin[1] - away[1], origin[2] - away[2], origin[3] - away[3]],
            inverse,
            side: [inverse[0] < 0.0, inverse[1] < 0.0, inverse[2] < 0.0].map(u8::from),
            axes: [first as u8, second as u8, along as u8],
            origin: [origin.at(first), origin.at(second), origin.at(along)],
            shear: [direction.at(first) * inverse.at(along), direction.at(second) * inverse.at(along)],
            error: 4.0 * outward,
            skip: ray.skip,
            start,
            pad,
            first: First::new(scale, ray.t_max),
            limit: 0.0,
        };
        walk.shorten();
        Some(walk)
    }

    /// Sets the limit to the distance of the nearest hit.
    #[inline(always)]
    fn shorten(&mut self) {
        self.limit = (self.first.nearest - self.start + self.pad) as f32 * WIDEN;
    }

    /// Depth-first traversal: nearest child first, the rest on the stack with their distances.
    #[inline(always)]
    fn search<L: Lanes, S: Stack>(mut self, lanes: L, bvh: &Bvh, ray: &Ray, any: bool) -> Option<Hit> {
        let beam = LaneRay::new(lanes, &self);
        let (mut stack, mut top) = (S::EMPTY, 0);
        let mut best = None;
        let mut next = if bvh.boxes.is_empty() { return None } else { 0 };
        loop {
            if next & LEAF_CHILD == 0 {
                let boxes = bvh.boxes.get(next as usize)?;
                let children = bvh.children.get(next as usize)?;
                let (near, far) = beam.slabs(boxes, self.limit);
                let hits = lanes.le8(near, far);
                if hits != 0 {
                    next = stack.push_children(&mut top, next, children, &lanes.store8(near), hits);
                    continue;
                }
            } else {
                self.leaf(&beam, bvh, ray, next, &mut best);
                if any && best.is_some() {
                    return best;
                }
            }
            let Some(child) = stack.pop(&mut top, &self, bvh) else { return best };
            next = child;
        }
    }

    /// Where the ray enters one of a node's boxes that it meets: as [`LaneRay::slabs`] has it.
    #[cfg(target_pointer_width = "32")]
    #[inline(always)]
    fn entry(&self, boxes: &Boxes, child: usize) -> f32 {
        let mut entry = 0.0;
        for (k, sides) in boxes.iter().enumerate() {
            let near = (sides[usize::from(self.side[k] & 1)][child & 7] - self.near[k]) * self.inverse[k];
            entry = if near > entry { near } else { entry };
        }
        entry
    }

    /// Tests the packets of a leaf.
    #[inline(always)]
    fn leaf<L: Lanes>(&mut self, beam: &LaneRay<L>, bvh: &Bvh, ray: &Ray, leaf: u32, best: &mut Option<Hit>) {
        let first = (leaf & !(LEAF_CHILD | PAIR)) as usize;
        for index in first..=first + usize::from(leaf & PAIR != 0) {
            let Some(lanes) = bvh.lanes(index) else { return };
            self.confirm(bvh, ray, lanes.2, beam.inside(lanes), best);
        }
    }

    /// Exact test in f64 of the facets of a packet that the f32 test left in the set; keeps the best hit.
    #[inline(always)]
    pub fn confirm(
        &mut self,
        bvh: &Bvh,
        ray: &Ray,
        facets: &[u32; PACKET_LANES],
        mut set: u32,
        best: &mut Option<Hit>,
    ) {
        while set != 0 {
            let lane = set.trailing_zeros() as usize & 7;
            set &= set - 1;
            self.facet(bvh, ray, facets[lane], best);
        }
    }

    /// Takes the hit with one facet where it is better than the best so far.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline(always))]
    fn facet(&mut self, bvh: &Bvh, ray: &Ray, facet: u32, best: &mut Option<Hit>) {
        let Some(&[a, b, c, normal]) = bvh.solids.get(facet as usize) else { return };
        let Some(line) = Line::new(ray) else { return };
        let moved = [a, b, c].map(|corner| Vec3::from_array(corner) - ray.origin);
        let edges = line.edges(moved.map(|m| line.image(m.to_array())));
        let Some(hit) = line.hit(facet, edges, moved, Vec3::from_array(normal)) else { return };
        self.first.note(hit, best);
        self.shorten();
    }
}

/// A traversal ray in every lane.
pub(super) struct LaneRay<L: Lanes> {
    lanes: L,
    side: [u8; 3],
    near: [L::Same; 3],
    far: [L::Same; 3],
    inverse: [L::Same; 3],
    skip: u32,
    axes: [u8; 3],
    origin: [L::Same; 3],
    shear: [L::Same; 2],
    error: f32,
}

impl<L: Lanes> LaneRay<L> {
    #[inline(always)]
    pub fn new(lanes: L, ray: &TraversalRay) -> Self {
        let (n, f, i, o) = (ray.near, ray.far, ray.inverse, ray.origin);
        LaneRay {
            lanes,
            side: ray.side,
            near: [lanes.same(n[0]), lanes.same(n[1]), lanes.same(n[2])],
            far: [lanes.same(f[0]), lanes.same(f[1]), lanes.same(f[2])],
            inverse: [lanes.same(i[0]), lanes.same(i[1]), lanes.same(i[2])],
            skip: ray.skip,
            axes: ray.axes,
            origin: [lanes.same(o[0]), lanes.same(o[1]), lanes.same(o[2])],
            shear: [lanes.same(ray.shear[0]), lanes.same(ray.shear[1])],
            error: ray.error,
        }
    }

    /// Where the ray enters the eight boxes, and where it leaves them or is at its limit: meets them, if that is no
    /// sooner.
    #[inline(always)]
    pub fn slabs(&self, boxes: &Boxes, limit: f32) -> (L::F8, L::F8) {
        let lanes = self.lanes;
        let mut near = lanes.splat8(0.0);
        let mut far = lanes.splat8(f32::INFINITY);
        let rays = self.near.iter().zip(&self.far).zip(&self.inverse).zip(&self.side);
        for (sides, (((&start, &end), &inverse), &side)) in boxes.iter().zip(rays) {
            let (first, last) = (&sides[usize::from(side & 1)], &sides[usize::from(side & 1 ^ 1)]);
            let inverse = lanes.lanes(inverse);
            let entry = lanes.sub8(lanes.load8(first), lanes.lanes(start));
            let exit = lanes.sub8(lanes.load8(last), lanes.lanes(end));
            near = lanes.max8(lanes.mul8(entry, inverse), near);
            far = lanes.min8(lanes.mul8(exit, inverse), far);
        }
        let far = lanes.min8(lanes.mul8(far, lanes.splat8(WIDEN)), lanes.splat8(limit));
        (near, far)
    }

    /// Which of eight facets may have the ray inside, as bits; not the one to skip.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline(always))]
    pub fn inside(&self, (packet, slack, facets): (&Packet, &Slack, &[u32; PACKET_LANES])) -> u32 {
        let lanes = self.lanes;
        let [a, b, c] = [self.image(&packet[0]), self.image(&packet[1]), self.image(&packet[2])];
        let edges = [self.cross(c, b), self.cross(a, c), self.cross(b, a)];
        let least = lanes.min8(lanes.min8(edges[0], edges[1]), edges[2]);
        let most = lanes.max8(lanes.max8(edges[0], edges[1]), edges[2]);
        let less = lanes.mul8(lanes.load8(slack), lanes.splat8(-self.error));
        let less = lanes.sub8(less, lanes.splat8(4.0 * self.error * self.error));
        let more = lanes.sub8(lanes.splat8(0.0), less);
        (lanes.le8(less, least) | lanes.le8(most, more)) & !lanes.same8(facets, self.skip)
    }

    // Methods rather than closures, which are not inlined into code compiled for another instruction set.

    #[inline(always)]
    fn image(&self, corner: &[[f32; 8]; 3]) -> [L::F8; 2] {
        let lanes = self.lanes;
        let [first, second, along] = self.axes;
        let depth = self.moved(corner, along, self.origin[2]);
        [
            lanes.sub8(
                self.moved(corner, first, self.origin[0]),
                lanes.mul8(lanes.lanes(self.shear[0]), depth),
            ),
            lanes.sub8(
                self.moved(corner, second, self.origin[1]),
                lanes.mul8(lanes.lanes(self.shear[1]), depth),
            ),
        ]
    }

    #[inline(always)]
    fn moved(&self, corner: &[[f32; 8]; 3], axis: u8, origin: L::Same) -> L::F8 {
        let row = &corner[usize::from(if axis < 3 { axis } else { 0 })];
        self.lanes.sub8(self.lanes.load8(row), self.lanes.lanes(origin))
    }

    #[inline(always)]
    fn cross(&self, p: [L::F8; 2], q: [L::F8; 2]) -> L::F8 {
        self.lanes.sub8(self.lanes.mul8(p[0], q[1]), self.lanes.mul8(p[1], q[0]))
    }
}

/// A vector in f32, and a fourth number to fill the lanes.
#[inline(always)]
fn wide(v: Vec3) -> [f32; 4] {
    let [x, y, z] = v.to_array();
    [x, y, z, 0.0].map(|x| x as f32)
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

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::base::qmc::Sequence;
    use crate::base::simd::Isa;
    use crate::rays::ray::intersect;
    use std::vec::Vec;

    #[test]
    fn crossings_are_all_hits_and_their_first() {
        let (points, rays) = (Sequence::new(3), Sequence::new(4));
        let place = |sequence: Sequence, n: u32| {
            let ((x, y), (z, _)) = (sequence.pair(n, 0), sequence.pair(n, 2));
            Vec3::new(x - 0.5, y - 0.5, z - 0.5)
        };
        // small ones, so that leaves share packets
        let corners: Vec<[Vec3; 3]> = (0..500)
            .map(|n| [0, 1, 2].map(|k| place(points, n) + 0.4 * place(points, 1000 + 3 * n + k)))
            .collect();
        let areas = std::vec![1.0; corners.len()];
        for isa in Isa::all() {
            let mut memory = std::vec![0; Bvh::bytes(corners.len()).unwrap()];
            let bvh = Bvh::build(&corners, &areas, isa, &mut memory).unwrap();
            let mut most = 0;
            for n in 0..300 {
                let direction = place(rays, 1000 + n).normalize();
                let ray = Ray { skip: n, ..Ray::new(place(rays, n), direction) };
                let mut found = Vec::new();
                let first = bvh.crossings(&ray, |hit| found.push(*hit));
                found.sort_by_key(|hit| hit.facet);
                let all = corners.iter().enumerate();
                let want: Vec<Hit> =
                    all.filter_map(|(f, corners)| intersect(&ray, f as u32, corners)).collect();
                assert_eq!(found, want);
                assert_eq!(first, bvh.closest(&ray));
                most = most.max(found.len());
            }
            assert!(most > 4, "{most}");
        }
    }
}
