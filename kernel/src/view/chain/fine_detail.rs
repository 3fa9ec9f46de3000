//! Points near geometry that is much smaller than their element.
//!
//! The coupling samples an element as a whole and may have missed such detail, and the linear function over the element
//! does not show its shadow. Where an image resolves the detail, final gathering ([`super::gather`]) is used instead.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors beside fine detail).

use super::Solved;
use super::gather::GATHERS;
use crate::base::arena::plain_table;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, frame, sqrt};
use crate::rays::bvh::HalfSpace;
use crate::rays::surface::Surface;

/// Error of irradiance over pi that is assumed beside fine detail, relative to the reference radiance.
///
/// A shadow of a thin object changes the irradiance by about this much. `cargo run --release --example calibrate`
/// compares the estimates with true errors.
pub(super) const FINE_DETAIL_ERROR: f64 = 0.1;

/// Area of an element, in pixels, above which an image may resolve what the element's rays have missed.
const DETAIL_PIXELS_LEAST: f64 = 16.0;

/// Longest edge of a facet that counts as fine detail, as a share of the root of the element's area.
///
/// Rays of a row, spread over the element, meet what is larger.
const DETAIL_SIZE_MOST: f64 = 0.125;

/// Largest distance of fine detail from a point, in longest edges of the detail: its shadow is faint beyond.
const DETAIL_DISTANCE_MOST: f64 = 5.0;

/// Most facets that are examined about one point.
///
/// If there are more, they count as fine detail where the element fills [`CROWDED_PIXELS_LEAST`], else as parts of larger
/// objects.
const DETAIL_FACETS_MOST: u32 = 64;

/// Area of an element, in pixels, above which many facets near a point count as fine detail: the view is then of the
/// element's surroundings.
const CROWDED_PIXELS_LEAST: f64 = 256.0;

/// Number of elements whose answers are kept.
const DETAIL_ELEMENTS_KEPT: usize = if GATHERS { 64 } else { 0 };

plain_table! {
    /// What is known of the elements that were asked about latest.
    pub struct DetailCache {
        /// Each at its number's place: twice the unknown's number and 2, and 1 where small facets may stand near it.
        pub known: [u64; DETAIL_ELEMENTS_KEPT],
    }
}

impl DetailCache {
    /// Nothing is known.
    pub const ZERO: DetailCache = DetailCache { known: [0; DETAIL_ELEMENTS_KEPT] };
}

impl Solved<'_> {
    /// Whether facets far smaller than its element stand near a point that a ray met after so long a way.
    #[inline]
    pub(super) fn has_fine_detail_nearby(
        &self,
        surface: &Surface,
        unknown: usize,
        far: f64,
        known: &mut DetailCache,
    ) -> bool {
        let element = self.elements.area(self.scene, unknown);
        let pixel = self.settings.pixel.at(far);
        let near = |many: bool| Near { normal: surface.normal, size: sqrt(element), many };
        GATHERS
            && !self.elements.is_cluster(unknown)
            && element > DETAIL_PIXELS_LEAST * pixel
            && self.bvh.is_own()
            && self.element_has_fine_detail(unknown, &near(true), known)
            && self.finds_small_facets(&near(element > CROWDED_PIXELS_LEAST * pixel), &[surface.point; 3])
    }

    /// Whether small facets stand near any point of an element, or too many facets to tell.
    #[inline]
    fn element_has_fine_detail(&self, unknown: usize, near: &Near, known: &mut DetailCache) -> bool {
        let (place, name) = (unknown % DETAIL_ELEMENTS_KEPT.max(1), 2 * (unknown as u64 + 1));
        if known.known.at(place) & !1 != name {
            let corners = self.elements.corners(self.scene, unknown / self.scene.sides());
            let detailed = self.finds_small_facets(near, &corners);
            known.known.set(place, name | u64::from(detailed));
        }
        known.known.at(place) & 1 != 0
    }

    /// Whether small facets stand before the points of a triangle, or of a point alone.
    #[inline(never)]
    fn finds_small_facets(&self, near: &Near, corners: &[Vec3; 3]) -> bool {
        let (x, y) = frame(near.normal);
        let reach = DETAIL_DISTANCE_MOST * DETAIL_SIZE_MOST * near.size;
        let half = |normal: Vec3, below: f64| {
            let least = corners.iter().map(|corner| corner.dot(normal)).fold(f64::INFINITY, f64::min);
            HalfSpace { normal, height: least - below }
        };
        let halves = [
            half(x, reach),
            half(-x, reach),
            half(y, reach),
            half(-y, reach),
            half(near.normal, 0.0),
            half(-near.normal, reach),
        ];
        let alone = corners[0] == corners[1];
        let (mut found, mut seen) = (false, 0);
        self.bvh.within(&halves, |facet: u32| {
            let Some((own, _)) = self.bvh.corners(facet) else { return true };
            found = near.is_small(&own, corners[0], alone);
            seen += 1;
            !found && seen < DETAIL_FACETS_MOST
        });
        found || near.many && seen >= DETAIL_FACETS_MOST
    }
}

/// An element's side.
struct Near {
    normal: Vec3,
    /// Root of its area.
    size: f64,
    /// Whether many facets count as small ones.
    many: bool,
}

impl Near {
    /// Whether a facet is small beside it, stands before its plane and, where it is a point that counts, near.
    fn is_small(&self, facet: &[Vec3; 3], point: Vec3, alone: bool) -> bool {
        let [a, b, c] = facet.map(|corner| corner - point);
        let own = (a - b).length_squared().max((b - c).length_squared()).max((c - a).length_squared());
        let distance = (a + b + c).length_squared() / 9.0;
        let above = [a, b, c].iter().any(|corner| corner.dot(self.normal) > 0.01 * sqrt(own));
        let near = !alone || distance < DETAIL_DISTANCE_MOST * DETAIL_DISTANCE_MOST * own;
        own < DETAIL_SIZE_MOST * DETAIL_SIZE_MOST * self.size * self.size && near && above
    }
}
