//! From a point to a polygon: Lambert's contour sum.
//!
//! Constants of this file are measured by `cargo test --test form_factor` (errors).

use super::angle::angle;
use super::convex::{double_area, edges};
use crate::base::math::{FRAC_1_PI, Vec3, sqrt};

/// Distances from a plane below this share of the polygon's size are rounding: the point lies in the plane.
const POINT_PLANE_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Form factor from the point `p` with the unit normal `n` to a planar `polygon`, clipped to p's horizon.
///
/// Geometric: both sides of the polygon count alike, facing is the caller's business. 0 where p lies in the
/// polygon's plane. In [0, 1]; rounding error about 1e-16 (1 + angle) for the polygon's angular size, that is
/// relatively 1e-16 r/s for a polygon of size s at a distance r. The polygon is convex or wholly above the
/// horizon. Lambert's sum, (1/2 pi) sum theta (a x b)/|a x b| . n.
pub fn point_to_polygon(p: Vec3, n: Vec3, polygon: &[Vec3]) -> f64 {
    let Some(first) = polygon.first() else {
        return 0.0;
    };
    if in_plane(*first - p, double_area(polygon), polygon, p) {
        return 0.0;
    }
    let mut sum = 0.0;
    let (mut leave, mut enter) = (None, None);
    for (a, b) in edges(polygon) {
        let (side, a, b) = (b - a, a - p, b - p);
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha >= 0.0 && hb >= 0.0 {
            sum += edge(a, b, side, n);
        } else if ha > 0.0 {
            let cut = a + side * (ha / (ha - hb));
            sum += edge(a, cut, cut - a, n);
            leave = Some(cut);
        } else if hb > 0.0 {
            let cut = b - side * (hb / (hb - ha));
            sum += edge(cut, b, b - cut, n);
            enter = Some(cut);
        } else if ha == 0.0 {
            leave = Some(a);
        } else if hb == 0.0 {
            enter = Some(b);
        }
    }
    if let (Some(a), Some(b)) = (leave, enter) {
        // The cut along the horizon: both ends lie in the plane through p whose normal is n.
        sum += edge(a, b, b - a, n);
    }
    share(sum)
}

/// Form factor from the point `p` with the unit normal `n` to the triangle `t`: as [`point_to_polygon`], faster.
pub fn point_to_triangle(p: Vec3, n: Vec3, t: &[Vec3; 3]) -> f64 {
    let [u, v, w] = *t;
    let (a, b, c) = (u - p, v - p, w - p);
    let low = a.dot(n).min(b.dot(n)).min(c.dot(n));
    if low >= 0.0 {
        let (ab, bc, ca) = (v - u, w - v, u - w);
        if in_plane(a, ab.cross(bc), t, p) {
            return 0.0;
        }
        share(edge(a, b, ab, n) + edge(b, c, bc, n) + edge(c, a, ca, n))
    } else if a.dot(n).max(b.dot(n)).max(c.dot(n)) <= 0.0 {
        0.0
    } else {
        point_to_polygon(p, n, t)
    }
}

/// Whether p, from which a corner of the polygon lies at `a`, is in the plane with the (unscaled) normal.
#[inline(always)]
fn in_plane(a: Vec3, normal: Vec3, polygon: &[Vec3], p: Vec3) -> bool {
    let height = a.dot(normal);
    let reach = polygon.iter().fold(0.0, |m: f64, c| m.max((*c - p).length_squared()));
    let above =
        height * height > POINT_PLANE_ROUNDING * POINT_PLANE_ROUNDING * reach * normal.length_squared();
    // Asked this way round, an overflow that gives no number counts as in the plane.
    !above
}

/// One term of Lambert's sum, without the factor 1/(2 pi): the edge from `a` to `b`, `side` = b - a.
///
/// The cross product is taken with the side, which is known better than the difference of two far corners.
#[inline(always)]
fn edge(a: Vec3, b: Vec3, side: Vec3, n: Vec3) -> f64 {
    let cross = a.cross(side);
    let sine = sqrt(cross.dot(cross));
    if sine > 0.0 { angle(sine, a.dot(b)) / sine * cross.dot(n) } else { 0.0 }
}

/// Lambert's sum as a share of the hemisphere.
#[inline(always)]
pub(super) fn share(sum: f64) -> f64 {
    let share = sum.abs() * (0.5 * FRAC_1_PI);
    if share >= 0.0 { share.min(1.0) } else { 0.0 }
}
