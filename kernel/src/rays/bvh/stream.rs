//! Many rays through the tree together.
//!
//! Each node is tested by all rays of a group that meet it before the next is: the boxes stay in registers and cache,
//! and nothing that a ray finds decides where another goes, so that the processor works ahead. Children follow in the
//! order of their distance from the ray to which they are nearest.
//!
//! Constants of this file are measured by `cargo bench --bench stages` (seconds).

use super::traverse::{self, LaneRay, STACK_SHORT, TraversalRay};
use super::{Bvh, LEAF_CHILD, PAIR, STACK};
use crate::base::index::IndexMut;
use crate::base::simd::{self, LaneTask, Lanes};
use crate::rays::ray::{Hit, Ray};

/// Rays of a group. Large groups are faster (128 rays of a facet trace at 1.2 times the speed of 64) and take stack, some
/// 250 bytes a ray with what a caller keeps of each, which machines without the standard library lack.
pub(crate) const STREAM_RAYS: usize = if cfg!(feature = "std") { 128 } else { 8 };

/// Words of a set of rays.
const RAY_SET_WORDS: usize = STREAM_RAYS.div_ceil(32);

type Set = [u32; RAY_SET_WORDS];

/// A child that is left to visit, and the rays that meet it, none of them before `near`.
#[derive(Clone, Copy)]
struct Visit {
    near: f32,
    child: u32,
    rays: Set,
}

/// See [`Bvh::closest_many`].
pub(super) fn closest(bvh: &Bvh, rays: &[Ray], hits: &mut [Option<Hit>]) {
    for (rays, hits) in rays.chunks(STREAM_RAYS).zip(hits.chunks_mut(STREAM_RAYS)) {
        search(bvh, rays, hits, false);
    }
}

/// See [`Bvh::occluded_many`].
pub(super) fn occluded(bvh: &Bvh, rays: &[Ray], occluded: &mut [bool]) {
    for (rays, occluded) in rays.chunks(STREAM_RAYS).zip(occluded.chunks_mut(STREAM_RAYS)) {
        let mut hits = [None; STREAM_RAYS];
        search(bvh, rays, &mut hits, true);
        occluded.iter_mut().zip(hits).for_each(|(place, hit)| *place = hit.is_some());
    }
}

fn search(bvh: &Bvh, rays: &[Ray], hits: &mut [Option<Hit>], any: bool) {
    if traverse::is_short(bvh) { short(bvh, rays, hits, any) } else { deep(bvh, rays, hits, any) }
}

/// Not inlined: its stack frame ends before the caller uses the hits.
#[inline(never)]
fn short(bvh: &Bvh, rays: &[Ray], hits: &mut [Option<Hit>], any: bool) {
    simd::run_lanes(bvh.isa, Search::<STACK_SHORT> { bvh, rays, hits, any });
}

/// Apart, so that only who has a deep tree pays for the long stack; small stacks have no room for it.
#[inline(never)]
fn deep(bvh: &Bvh, rays: &[Ray], hits: &mut [Option<Hit>], any: bool) {
    if cfg!(feature = "std") {
        simd::run_lanes(bvh.isa, Search::<STACK> { bvh, rays, hits, any });
        return;
    }
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = traverse::search_deep(bvh, ray, any);
    }
}

/// The search for the first hits, or for any, of one group.
struct Search<'a, const N: usize> {
    bvh: &'a Bvh<'a>,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
    any: bool,
}

impl<const N: usize> LaneTask for Search<'_, N> {
    type Out = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut walks = [TraversalRay::IDLE; STREAM_RAYS];
        let mut alive = [0; RAY_SET_WORDS];
        for (i, ((walk, ray), hit)) in walks.iter_mut().zip(self.rays).zip(&mut *self.hits).enumerate() {
            *hit = None;
            if let Some(begun) = TraversalRay::new(self.bvh, ray) {
                *walk = begun;
                alive[i / 32 % RAY_SET_WORDS] |= 1 << (i % 32);
            }
        }
        if !self.bvh.boxes.is_empty() {
            let Search { bvh, rays, hits, any } = self;
            Group { lanes, bvh, rays, hits, walks: &mut walks, alive, any }.walk::<N>();
        }
    }
}

struct Group<'a, L> {
    lanes: L,
    bvh: &'a Bvh<'a>,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
    walks: &'a mut [TraversalRay; STREAM_RAYS],
    /// Rays that still look for a hit.
    alive: Set,
    any: bool,
}

impl<L: Lanes> Group<'_, L> {
    #[inline(always)]
    fn walk<const N: usize>(mut self) {
        let mut stack = [Visit { near: 0.0, child: 0, rays: self.alive }; N];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let Some(&Visit { near, child, mut rays }) = stack.get(top) else { return };
            if self.any {
                rays.iter_mut().zip(self.alive).for_each(|(own, alive)| *own &= alive);
            }
            if child & LEAF_CHILD == 0 {
                self.node(child, &rays, &mut stack, &mut top);
            } else {
                self.leaf(near, child, &rays);
            }
        }
    }

    /// Puts the children that the rays meet on the stack, the nearest on top.
    #[inline(always)]
    fn node<const N: usize>(&self, node: u32, rays: &Set, stack: &mut [Visit; N], top: &mut usize) {
        let (Some(boxes), Some(children)) =
            (self.bvh.boxes.get(node as usize), self.bvh.children.get(node as usize))
        else {
            return;
        };
        let lanes = self.lanes;
        let infinite = lanes.splat8(f32::INFINITY);
        let mut nearest = infinite;
        let mut marks = [[0; 8]; RAY_SET_WORDS];
        for (word, (&rays, marks)) in rays.iter().zip(&mut marks).enumerate() {
            let mut met = lanes.none8();
            let mut left = rays;
            while left != 0 {
                let bit = left & left.wrapping_neg();
                let walk = &self.walks[(word * 32 + left.trailing_zeros() as usize) % STREAM_RAYS];
                left ^= bit;
                let (near, far) = LaneRay::new(lanes, walk).slabs(boxes, walk.limit);
                let mask = lanes.mask8(near, far);
                met = lanes.mark8(met, mask, bit);
                nearest = lanes.min8(lanes.choose8(mask, near, infinite), nearest);
            }
            *marks = lanes.marks8(met);
        }
        let mut hits = lanes.le8(nearest, lanes.splat8(f32::MAX));
        let nearest = lanes.store8(nearest);
        let bottom = *top;
        while hits != 0 {
            let child = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            let near = nearest[child];
            let mut place = (*top).min(N - 1);
            *top = place + 1;
            while place > bottom
                && let Some(&below) = stack.get(place - 1)
                && below.near < near
            {
                stack.set(place, below);
                place -= 1;
            }
            let mut rays = [0; RAY_SET_WORDS];
            rays.iter_mut().zip(&marks).for_each(|(own, marks)| *own = marks[child]);
            stack.set(place, Visit { near, child: children[child], rays });
        }
    }

    /// Tests the packets of a leaf: first which of the rays may meet which facets, then whether they do.
    #[inline(always)]
    fn leaf(&mut self, near: f32, leaf: u32, rays: &Set) {
        let first = (leaf & !(LEAF_CHILD | PAIR)) as usize;
        for index in first..=first + usize::from(leaf & PAIR != 0) {
            let Some(packet) = self.bvh.lanes(index) else { return };
            let mut found = [(0u8, 0u8); STREAM_RAYS];
            let mut count = 0;
            for (word, &rays) in rays.iter().enumerate() {
                let mut left = rays;
                while left != 0 {
                    let number = (word * 32 + left.trailing_zeros() as usize) % STREAM_RAYS;
                    left &= left - 1;
                    let walk = &self.walks[number];
                    let inside = LaneRay::new(self.lanes, walk).inside(packet);
                    found[count % STREAM_RAYS] = (number as u8, inside as u8);
                    count += usize::from((inside != 0) & (walk.limit >= near));
                }
            }
            for &(number, inside) in found.iter().take(count) {
                let number = usize::from(number) % STREAM_RAYS;
                let (Some(ray), Some(hit)) = (self.rays.get(number), self.hits.get_mut(number)) else {
                    continue;
                };
                self.walks[number].confirm(self.bvh, ray, packet.2, u32::from(inside), hit);
                if self.any && hit.is_some() {
                    self.alive[number / 32 % RAY_SET_WORDS] &= !(1 << (number % 32));
                }
            }
        }
    }
}
