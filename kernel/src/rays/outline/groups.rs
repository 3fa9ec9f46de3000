//! Bounds of runs of edges, by which those that cannot matter to a facet are passed over together: a fine mesh
//! has thousands of edges of which few are outlines from anywhere near.

use super::Block;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, sqrt, unit};
use crate::base::simd::{Lanes64, WIDTH, Wide, spread};
use core::ops::Range;

/// Blocks of [`WIDTH`] edges that one bound is for: more turn too many ways. Measured by `cargo bench --bench peers` on bodies
/// cut into 100,000 facets.
pub const GROUP: usize = 4;

/// What a bound leaves to rounding, and to facets that share a plane to 1e-7 (scene coordinates).
const BOUND_SLACK: f64 = 1e-6;

/// Rows of [`EdgeGroups`]: centre and radius of a ball about the edges; axis, cosine and sine of the half angle of a cone of
/// both facets' normals. The cosine is -1 where they turn anywhere, or an edge has one facet.
const BOUND_ROWS: usize = 9;

/// Bounds of [`WIDTH`] groups of edges, lane by lane.
pub type EdgeGroups = [[f64; WIDTH]; BOUND_ROWS];

/// Blocks of bounds for `blocks` blocks; none for few, which are looked at one by one.
pub fn count(blocks: usize) -> usize {
    if blocks > GROUP { blocks.div_ceil(GROUP * WIDTH) } else { 0 }
}

/// Fills the bounds of edges, of which there are `edges`.
pub fn of_edges(blocks: &[Block], edges: usize, out: &mut [EdgeGroups]) {
    for (number, lanes) in out.iter_mut().enumerate() {
        for lane in 0..WIDTH {
            let first = (number * WIDTH + lane) * GROUP * WIDTH;
            let bound = of_run(blocks, first..edges.min(first + GROUP * WIDTH));
            lanes.iter_mut().zip(bound).for_each(|(row, x)| row.set(lane, x));
        }
    }
}

fn of_run(blocks: &[Block], edges: Range<usize>) -> [f64; BOUND_ROWS] {
    let value = |edge: usize, row: usize| {
        blocks.get(edge / WIDTH).map_or(0.0, |block| block.get(row).map_or(0.0, |r| r.at(edge % WIDTH)))
    };
    let vector =
        |edge: usize, row: usize| Vec3::new(value(edge, row), value(edge, row + 1), value(edge, row + 2));
    let (mut low, mut high, mut axis) =
        (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY), Vec3::ZERO);
    for edge in edges.clone() {
        for end in [0, 3].map(|row| vector(edge, row)) {
            (low, high) = (low.min(end), high.max(end));
        }
        axis += vector(edge, 6) + vector(edge, 10);
    }
    if edges.is_empty() {
        // below everything, and turned from it
        return [0.0, 0.0, 0.0, f64::NEG_INFINITY, 0.0, 0.0, 1.0, 1.0, 0.0];
    }
    let centre = (low + high) * 0.5;
    let axis = unit(axis).unwrap_or(Vec3::Z);
    let (mut radius, mut cosine): (f64, f64) = (0.0, 1.0);
    for edge in edges {
        for end in [0, 3].map(|row| vector(edge, row)) {
            radius = radius.max((end - centre).length_squared());
        }
        cosine = [6, 10].map(|row| vector(edge, row).dot(axis)).into_iter().fold(cosine, f64::min);
        // one facet alone: always an outline
        if value(edge, 15) == 0.0 {
            cosine = -1.0;
        }
    }
    let cosine = if cosine > 0.0 { cosine - BOUND_SLACK } else { -1.0 };
    let sine = sqrt((1.0 - cosine * cosine).max(0.0));
    let [x, y, z] = axis.to_array();
    [centre.x, centre.y, centre.z, sqrt(radius) + BOUND_SLACK, x, y, z, cosine, sine]
}

/// Points of a facet for which groups are looked at: a ball about it, its normal and the height of its plane.
#[derive(Clone, Copy, Debug)]
pub struct Below {
    pub centre: Vec3,
    pub radius: f64,
    pub normal: Vec3,
    pub height: f64,
}

/// [`Below`], the same in all lanes.
pub struct BelowLanes<F> {
    centre: [F; 3],
    reach: F,
    normal: [F; 3],
    least: F,
    zero: F,
}

impl<F: Wide> BelowLanes<F> {
    #[inline(always)]
    pub fn new<L: Lanes64<F = F>>(lanes: L, below: &Below) -> BelowLanes<F> {
        BelowLanes {
            centre: spread(lanes, below.centre),
            reach: lanes.all(below.radius + BOUND_SLACK),
            normal: spread(lanes, below.normal),
            least: lanes.all(below.height - BOUND_SLACK),
            zero: lanes.all(0.0),
        }
    }

    /// Which groups may have edges that rise above a facet's plane and are outlines from some point of it. From within `reach`
    /// of the way from the facet to the edges, the planes of a cone of normals show one side where the way's height over all of
    /// them, D cos(angle +- half angle), exceeds it.
    #[inline(always)]
    pub fn may_matter<L: Lanes64<F = F>>(&self, lanes: L, groups: &EdgeGroups) -> u32 {
        let row = |k: usize| lanes.of(&groups[k]);
        let (x, y, z, radius) = (row(0), row(1), row(2), row(3));
        let rises = x * self.normal[0] + y * self.normal[1] + z * self.normal[2] + radius;
        let (x, y, z) = (x - self.centre[0], y - self.centre[1], z - self.centre[2]);
        let along = x * row(4) + y * row(5) + z * row(6);
        let across = x * x + y * y + z * z - along * along;
        let over = along.abs() * row(7) - (radius + self.reach);
        let beyond = over * over - across.max(self.zero) * (row(8) * row(8));
        L::F::bits(rises.gt(self.least))
            & !(L::F::bits(over.gt(self.zero)) & L::F::bits(beyond.gt(self.zero)))
    }
}
