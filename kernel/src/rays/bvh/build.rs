//! The compact builder: a binary tree by the binned surface area heuristic, in place and without recursion.
//!
//! This work is based on I. Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007.
//!
//! Constants of this file are measured by `cargo bench --bench counts` (instructions of `tree`, `closest` and `occluded`).

use super::{Boxes, MOST_LEVELS, PACKET_LANES};
use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::base::sort;

/// A box in f32 that holds its content's f64 coordinates: low, high.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aabb {
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl Aabb {
    pub const EMPTY: Aabb = Aabb { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    fn of(corners: &[Vec3; 3]) -> Aabb {
        let [a, b, c] = *corners;
        Aabb {
            low: a.min(b).min(c).to_array().map(|x| {
                let near = x as f32;
                if f64::from(near) > x { near.next_down() } else { near }
            }),
            high: a.max(b).max(c).to_array().map(|x| {
                let near = x as f32;
                if f64::from(near) < x { near.next_up() } else { near }
            }),
        }
    }

    #[inline(always)]
    pub fn join(&mut self, other: &Aabb) {
        for (own, &low) in self.low.iter_mut().zip(&other.low) {
            *own = if low < *own { low } else { *own };
        }
        for (own, &high) in self.high.iter_mut().zip(&other.high) {
            *own = if high > *own { high } else { *own };
        }
    }

    /// Half the surface; 0 for an empty box.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let side = |axis: usize| self.high[axis] - self.low[axis];
        let (x, y, z) = (side(0), side(1), side(2));
        if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
    }

    /// Twice the centre.
    #[inline(always)]
    fn centre(&self, axis: usize) -> f32 {
        self.low.at(axis) + self.high.at(axis)
    }

    pub fn read(&[low, high]: &[[f32; 3]; 2]) -> Aabb {
        Aabb { low, high }
    }

    pub fn store(&self) -> [[f32; 3]; 2] {
        [self.low, self.high]
    }

    /// Writes this box as child number `child` of a node.
    pub fn write(&self, boxes: &mut Boxes, child: usize) {
        for ((axis, low), high) in boxes.iter_mut().zip(self.low).zip(self.high) {
            let [lows, highs] = axis;
            lows.set(child, low);
            highs.set(child, high);
        }
    }
}

/// The boxes of all facets, by index.
pub(super) struct Facets<'s> {
    boxes: &'s [[[f32; 3]; 2]],
}

impl Facets<'_> {
    #[inline(always)]
    pub fn get(&self, facet: u32) -> Aabb {
        self.boxes.get(facet as usize).map_or(Aabb::EMPTY, Aabb::read)
    }
}

/// A binary tree: node 0 is the root; children stand behind their parent, a pair side by side.
pub(super) struct Binary<'s> {
    pub boxes: &'s mut [[[f32; 3]; 2]],
    /// First and count: a leaf's range of `order`; count 0: an inner node's first child.
    pub links: &'s mut [[u32; 2]],
    /// Facets of nonzero area, so that each leaf's stand together.
    pub order: &'s mut [u32],
    /// Nodes in use.
    pub nodes: usize,
}

impl<'s> Binary<'s> {
    /// Memory for [`Binary::prepare`].
    pub const fn need(facets: usize) -> Need {
        Need::new()
            .and::<[[f32; 3]; 2]>(facets)
            .and::<[[f32; 3]; 2]>(facets * 2)
            .and::<[u32; 2]>(facets * 2)
            .and::<u32>(facets)
    }

    /// Finds the facets' boxes and makes room for a tree over those of nonzero area.
    pub fn prepare(
        corners: &[[Vec3; 3]],
        areas: &[f64],
        arena: &mut Arena<'s>,
    ) -> Result<(Facets<'s>, Binary<'s>), Error> {
        let own = arena.take::<[[f32; 3]; 2]>(corners.len())?;
        let boxes = arena.take::<[[f32; 3]; 2]>(corners.len() * 2)?;
        let links = arena.take::<[u32; 2]>(corners.len() * 2)?;
        let order = arena.take::<u32>(corners.len())?;
        for (place, facet) in own.iter_mut().zip(corners) {
            *place = Aabb::of(facet).store();
        }
        let mut live = 0;
        let kept = (0u32..).zip(areas).filter(|(_, area)| **area != 0.0).map(|(facet, _)| facet);
        for (place, facet) in order.iter_mut().zip(kept) {
            *place = facet;
            live += 1;
        }
        let order = order.head_mut(live);
        Ok((Facets { boxes: own }, Binary { boxes, links, order, nodes: 0 }))
    }

    /// Appends a node; its number. Nothing where there is no room, which two nodes a facet always leave.
    pub fn push(&mut self, bounds: &Aabb, first: u32, count: u32) -> u32 {
        if let (Some(place), Some(link)) = (self.boxes.get_mut(self.nodes), self.links.get_mut(self.nodes)) {
            *place = bounds.store();
            *link = [first, count];
            self.nodes += 1;
        }
        self.nodes as u32 - 1
    }
}

/// Bins per axis.
const SPLIT_BINS: usize = 16;

/// Builds the tree, level by level: nodes not yet split are leaves, and the array of nodes is the queue.
pub(super) fn binned(facets: &Facets, tree: &mut Binary) {
    if tree.order.is_empty() {
        return;
    }
    let all = bounds(facets, tree.order);
    tree.push(&all, 0, tree.order.len() as u32);
    let (mut node, mut level, mut level_end) = (0, 0, 1);
    while node < tree.nodes {
        if node == level_end {
            (level, level_end) = (level + 1, tree.nodes);
        }
        let [first, count] = tree.links.at(node);
        if count as usize > PACKET_LANES {
            let range = first as usize..(first + count) as usize;
            let halvings =
                (count as usize).div_ceil(PACKET_LANES).next_power_of_two().trailing_zeros() as usize;
            // halved by count where the levels that halving takes (25 for 2^28 facets) are all that are left
            let by_area = level + halvings < MOST_LEVELS;
            let left = split(facets, tree.order.part_mut(range.clone()), by_area);
            let own = tree.order.part(range);
            let (a, b) = own.split_at(left.min(own.len()));
            let (a, b) = (bounds(facets, a), bounds(facets, b));
            let pair = tree.push(&a, first, left as u32);
            tree.push(&b, first + left as u32, count - left as u32);
            tree.links.set(node, [pair, 0]);
        }
        node += 1;
    }
}

fn bounds(facets: &Facets, order: &[u32]) -> Aabb {
    let mut all = Aabb::EMPTY;
    order.iter().for_each(|&facet| all.join(&facets.get(facet)));
    all
}

/// Reorders `order` into two parts that are not empty; the length of the first.
fn split(facets: &Facets, order: &mut [u32], by_area: bool) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for &facet in order.iter() {
        let bounds = facets.get(facet);
        for axis in 0..3 {
            let centre = bounds.centre(axis);
            let (least, most) = (low.at(axis).min(centre), high.at(axis).max(centre));
            low.set(axis, least);
            high.set(axis, most);
        }
    }
    if by_area && let Some((axis, plane)) = best_plane(facets, order, &low, &high) {
        let bin = Binning::new(low.at(axis), high.at(axis));
        let left = partition(order, |facet| bin.of(facets.get(facet).centre(axis)) < plane);
        if left > 0 && left < order.len() {
            return left;
        }
    }
    let widest = (1..3).fold(0, |a, b| if high.at(b) - low.at(b) > high.at(a) - low.at(a) { b } else { a });
    let half = order.len() / 2;
    let key = |facet: &u32| facets.get(*facet).centre(widest);
    sort::select(order, half, &|a: &u32, b: &u32| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    half
}

/// Maps centres to bins.
struct Binning {
    low: f32,
    scale: f32,
}

impl Binning {
    fn new(low: f32, high: f32) -> Binning {
        Binning { low, scale: if high > low { SPLIT_BINS as f32 / (high - low) } else { 0.0 } }
    }

    /// The cast saturates, and takes NaN (0 times infinity) to 0.
    #[inline(always)]
    fn of(&self, centre: f32) -> usize {
        (((centre - self.low) * self.scale) as usize).min(SPLIT_BINS - 1)
    }
}

/// The axis and the first bin of the right part that cost least: surface times packets, summed over both parts.
fn best_plane(facets: &Facets, order: &[u32], low: &[f32; 3], high: &[f32; 3]) -> Option<(usize, usize)> {
    let mut best = None;
    let mut least = f32::INFINITY;
    for axis in (0..3).filter(|&axis| high.at(axis) > low.at(axis)) {
        let binning = Binning::new(low.at(axis), high.at(axis));
        let mut bins = [(Aabb::EMPTY, 0u32); SPLIT_BINS];
        for &facet in order {
            let own = facets.get(facet);
            let Some((bounds, count)) = bins.get_mut(binning.of(own.centre(axis))) else { continue };
            bounds.join(&own);
            *count += 1;
        }
        let mut right = [0.0f32; SPLIT_BINS];
        let mut sweep = (Aabb::EMPTY, 0u32);
        for (place, bin) in right.iter_mut().zip(&bins).rev() {
            *place = cost(&mut sweep, bin);
        }
        sweep = (Aabb::EMPTY, 0);
        for (plane, (bin, right)) in (1..).zip(bins.iter().zip(right.iter().skip(1))) {
            let total = cost(&mut sweep, bin) + right;
            if total < least && sweep.1 > 0 && (sweep.1 as usize) < order.len() {
                (least, best) = (total, Some((axis, plane)));
            }
        }
    }
    best
}

/// Adds one bin to a sweep; what the sweep then costs.
#[inline(always)]
fn cost(sweep: &mut (Aabb, u32), bin: &(Aabb, u32)) -> f32 {
    sweep.0.join(&bin.0);
    sweep.1 += bin.1;
    sweep.0.half_area() * sweep.1.div_ceil(PACKET_LANES as u32) as f32
}

/// Puts those that are `left` first; how many they are.
fn partition(order: &mut [u32], left: impl Fn(u32) -> bool) -> usize {
    let mut count = 0;
    for i in 0..order.len() {
        let facet = order.at(i);
        if left(facet) {
            order.set(i, order.at(count));
            order.set(count, facet);
            count += 1;
        }
    }
    count
}
