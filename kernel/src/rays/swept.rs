//! The region that a facet sweeps along a direction, or a narrow cone of them: what no facet reaches into stands in the way
//! of no ray that leaves the facet so.
//!
//! Constants of this file are measured by `cargo test --test determinism` (the same bits as by rays alone).

use crate::base::index::IndexMut;
use crate::base::math::{Vec3, sqrt};
use crate::rays::bvh::HalfSpace;
use crate::rays::surface::OFFSET;

/// Facets that come this near to the region in which rays run are taken to be in it: far above the rounding of points,
/// directions and hits.
pub(crate) const SWEPT_MARGIN: f64 = 1.0 / (1u64 << 26) as f64;

/// The half spaces whose common region holds all rays that leave a facet of these corners on the side of `normal` along
/// `direction`, or along any within an angle of sine `spread` of it, from where rays start; `None` where the direction is too
/// near to an edge's for such a region.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub(crate) fn swept(
    corners: &[Vec3; 3],
    normal: Vec3,
    direction: Vec3,
    spread: f64,
) -> Option<[HalfSpace; 4]> {
    let top = corners.iter().map(|c| c.dot(normal)).fold(f64::NEG_INFINITY, f64::max);
    // rays start twice as high
    let plane = HalfSpace { normal, height: top + 0.5 * OFFSET };
    let mut halves = [plane; 4];
    let [a, b, c] = *corners;
    for (half, (from, to, other)) in halves.part_mut(1..4).iter_mut().zip([(a, b, c), (b, c, a), (c, a, b)]) {
        let inward = inward(to - from, other - from, direction, spread)?;
        *half = HalfSpace { normal: inward, height: inward.dot(from).min(inward.dot(to)) - SWEPT_MARGIN };
    }
    Some(halves)
}

/// The normal of the plane along an edge and the direction, turned outward so far that all within the spread are on the
/// side of the other corner; `None` where they are all around.
#[cfg_attr(target_pointer_width = "32", inline(never))]
fn inward(edge: Vec3, other: Vec3, direction: Vec3, spread: f64) -> Option<Vec3> {
    let across = edge.cross(direction);
    let length = sqrt(across.dot(across));
    let edge_length = sqrt(edge.dot(edge));
    // the sine of the angle between edge and direction, of which the spread is to be a part
    let sine = length / edge_length;
    if !(sine > 4.0 * spread && sine > 1e-6) {
        return None;
    }
    let across = across * (if across.dot(other) < 0.0 { -1.0 } else { 1.0 } / length);
    if spread == 0.0 {
        return Some(across);
    }
    // the direction's part at right angles to the edge
    let ahead = direction - edge * (edge.dot(direction) / (edge_length * edge_length));
    let ahead = ahead / sqrt(ahead.dot(ahead));
    let turn = spread / sine;
    Some(across * sqrt(1.0 - turn * turn) + ahead * turn)
}
