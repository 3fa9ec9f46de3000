//! Fine detail: facets far smaller than a triangle that stand close before it.
//!
//! What arrives at a triangle changes beside them within a small part of it. Points or rays that are spread over all of
//! the triangle are few there, and can miss them.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors beside fine detail).

use crate::base::math::{Vec3, sqrt, unit};
use crate::rays::bvh::{Bvh, HalfSpace};

/// Height of a facet over a plane from which it stands before it, over its longest edge: above the rounding of corners.
const RISES: f64 = 0.01;

/// One side of a triangle, and which facets count as detail near it.
pub(crate) struct DetailSearch {
    /// Corners, counter-clockwise or clockwise.
    pub corners: [Vec3; 3],
    /// Normal of the side.
    pub normal: Vec3,
    /// Facets whose longest edge is shorter than this are small.
    pub small: f64,
    /// Distance from the triangle up to which they are near.
    pub reach: f64,
    /// Most facets that are examined.
    pub most: u32,
}

impl DetailSearch {
    /// Whether small facets stand near the triangle; where more than the most would have to be examined, `many`.
    // not inlined: keeps it out of the stack frame of rays
    #[inline(never)]
    pub fn finds(&self, bvh: &Bvh<'_>, many: bool) -> bool {
        let [a, b, c] = self.corners;
        let beside = |from: Vec3, to: Vec3, other: Vec3| {
            let normal = unit((to - from).cross(self.normal)).unwrap_or(Vec3::ZERO);
            let normal = if (other - from).dot(normal) < 0.0 { -normal } else { normal };
            HalfSpace { normal, height: from.dot(normal).min(to.dot(normal)) - self.reach }
        };
        let heights = self.corners.map(|corner| corner.dot(self.normal));
        let low = heights.into_iter().fold(f64::INFINITY, f64::min);
        let high = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let region = [
            beside(a, b, c),
            beside(b, c, a),
            beside(c, a, b),
            HalfSpace { normal: self.normal, height: low },
            HalfSpace { normal: -self.normal, height: -high - self.reach },
        ];
        let (mut found, mut seen) = (false, 0);
        bvh.within(&region, |facet: u32| {
            let Some((own, _)) = bvh.corners(facet) else { return true };
            found = self.is_small(&own, high);
            seen += 1;
            !found && seen < self.most
        });
        found || many && seen >= self.most
    }

    /// Whether a facet is small and stands before the plane.
    fn is_small(&self, facet: &[Vec3; 3], plane: f64) -> bool {
        let [a, b, c] = *facet;
        let own = (a - b).length_squared().max((b - c).length_squared()).max((c - a).length_squared());
        own < self.small * self.small
            && facet.iter().any(|corner| corner.dot(self.normal) - plane > RISES * sqrt(own))
    }
}
