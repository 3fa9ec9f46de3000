//! Where an element is far larger than what stands about a point of it, in a view that shows that: rows, whose rays leave
//! all of an element, can have missed it, and its linear function tells nothing of its surroundings.

use super::Solved;
use super::gather::GATHERS;
use crate::bvh::Half;
use crate::index::Index;
use crate::math::{Vec3, frame, sqrt};
use crate::mirror::Surface;

/// What irradiance over pi may be wrong by beside such things, relative to the reference radiance.
pub(super) const CROWDED: f64 = 0.1;

/// Pixels that an element fills from which on a view may show what its rays have missed.
const PIXELS: f64 = 16.0;

/// Facets are small up to this part of an element's size, and near up to so many times their own.
const SMALL: f64 = 0.125;
const NEAR: f64 = 5.0;

/// Facets that are looked at: where there are more, they are parts of larger things.
const MOST: u32 = 64;

impl Solved<'_> {
    /// Whether facets far smaller than its element stand near a point that a ray met after so long a way.
    #[inline]
    pub(super) fn is_crowded(&self, surface: &Surface, unknown: usize, far: f64) -> bool {
        let (area, per_square) = self.settings.pixel;
        let element = self.scene.areas().at(surface.facet) * self.elements.share(unknown);
        GATHERS
            && element > PIXELS * (area + per_square * far * far)
            && self.bvh.is_own()
            && self.small_near(surface, sqrt(element))
    }

    #[inline(never)]
    fn small_near(&self, surface: &Surface, size: f64) -> bool {
        let (point, normal) = (surface.point, surface.normal);
        let (x, y) = frame(normal);
        let reach = NEAR * SMALL * size;
        let half = |normal: Vec3, below: f64| Half { normal, height: point.dot(normal) - below };
        let halves = [
            half(x, reach),
            half(-x, reach),
            half(y, reach),
            half(-y, reach),
            half(normal, 0.0),
            half(-normal, reach),
        ];
        let (mut found, mut seen) = (false, 0);
        self.bvh.within(&halves, |facet: u32| {
            let Some((corners, _)) = self.bvh.corners(facet) else { return true };
            let [a, b, c] = corners.map(|corner| corner - point);
            let own = (a - b).length_squared().max((b - c).length_squared()).max((c - a).length_squared());
            let distance = (a + b + c).length_squared() / 9.0;
            let above = [a, b, c].iter().any(|corner| corner.dot(normal) > 0.01 * sqrt(own));
            found = own < SMALL * SMALL * size * size && distance < NEAR * NEAR * own && above;
            seen += 1;
            !found && seen < MOST
        });
        found
    }
}
