//! Whether a point lies inside a body, where no light comes.
//!
//! Constants of this file are measured by `cargo test --test aircraft` (points inside bodies).

use crate::base::math::{Vec3, unit};
use crate::rays::bvh::Bvh;
use crate::rays::ray::Ray;

/// Facets that a line may cross before it is taken to lead nowhere.
const CROSSINGS_MOST: u32 = 64;

/// Rays that rise by an angle of this tangent look around.
const RISE: f64 = 0.5;

/// Whether the point of a facet from which a ray leaves lies inside a body: from within a closed body every line leaves
/// more bodies than it enters. Lines to four sides are followed, turned about the facet's normal as the ray is, all above
/// the facet, which may belong to no body itself. Sheets that show their backs to all four sides are taken for a body.
pub fn inside(bvh: &Bvh<'_>, ray: &Ray, normal: Vec3) -> bool {
    let flat = ray.direction - normal * ray.direction.dot(normal);
    // straight up has no side: any will do
    let along = unit(flat).unwrap_or_else(|| crate::base::math::frame(normal).0);
    let across = normal.cross(along);
    [along, across, -along, -across].into_iter().all(|side| leaves(bvh, ray, side + normal * RISE))
}

/// Whether the line from a ray's origin in another direction leaves more bodies than it enters.
fn leaves(bvh: &Bvh<'_>, from: &Ray, direction: Vec3) -> bool {
    let Some(direction) = unit(direction) else { return false };
    let mut ray = Ray { direction, t_max: f64::INFINITY, ..*from };
    let mut left = 0;
    for _ in 0..CROSSINGS_MOST {
        let Some(hit) = bvh.closest(&ray) else { return left > 0 };
        left += if hit.front { -1 } else { 1 };
        ray = Ray { origin: ray.origin + direction * hit.t, skip: hit.facet, ..ray };
    }
    false
}
