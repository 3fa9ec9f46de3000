//! The straight sky at a point, by outlines, in place of its element's linear function.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors).

use super::gather::{BANDS, PIXEL_ELEMENTS_KEPT, find};
use super::{OccluderCache, Solved, linear};
use crate::base::arena::plain_table;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{PI, clamp, fabs};
use crate::coupling::element::Local;
use crate::radiosity::straight;
use crate::rays::surface::Surface;
use crate::scene::MAX_BANDS;

/// Largest factor, either way, by which the blocked share at a point may differ from the element's linear function.
/// Beyond it the light from what is blocked cannot be told from the element's.
const BLOCKED_RATIO_MOST: f64 = 2.0;

plain_table! {
    /// The straight sky at the first point of some elements in one pixel.
    pub struct KeptSkies {
        /// Irradiance beyond the element's linear function.
        pub beyond: [[f64; BANDS]; PIXEL_ELEMENTS_KEPT],
        /// Whether it is known, what is blocked beyond the element's linear function, and [`OpenAt::variance`].
        pub rest: [[f64; 3]; PIXEL_ELEMENTS_KEPT],
        /// The unknowns.
        pub unknowns: [u64; PIXEL_ELEMENTS_KEPT],
        /// Elements that are kept.
        pub count: u64,
    }
}

impl KeptSkies {
    /// None.
    pub const ZERO: KeptSkies = KeptSkies {
        beyond: [[0.0; BANDS]; PIXEL_ELEMENTS_KEPT],
        rest: [[0.0; 3]; PIXEL_ELEMENTS_KEPT],
        unknowns: [0; PIXEL_ELEMENTS_KEPT],
        count: 0,
    };

    fn find(&self, unknown: usize) -> Option<usize> {
        find(&self.unknowns, self.count, unknown)
    }
}

/// The straight sky at a point.
pub(super) struct OpenAt<'a> {
    /// Its irradiance, one value per band.
    pub irradiance: [f64; BANDS],
    /// Part of it that the element's irradiance holds, mean and gradients.
    pub held: &'a [f64],
    /// Share of the hemisphere that is open, weighed by the cosine.
    pub share: f64,
    /// By what all else that arrives counts at the point: as what is blocked there to what is by the element's linear
    /// function.
    pub ratio: f64,
    /// What is blocked by the element's linear function.
    pub by_element: f64,
    /// Whether both are so far apart that the ratio tells nothing: then rays from the point find all else.
    pub doubtful: bool,
    /// Expected squared error of the irradiance over pi, relative to the reference radiance.
    pub variance: f64,
}

impl<'a> Solved<'a> {
    /// [`Solved::open_at`] as the first point of its element in a pixel tells it: from point to point of one element in one
    /// pixel the straight sky differs by as much as the element's linear function.
    pub(super) fn open_in_pixel(
        &self,
        surface: &Surface,
        unknown: usize,
        local: Local,
        kept: &mut KeptSkies,
        occluders: &mut OccluderCache<'_>,
    ) -> Option<OpenAt<'a>> {
        let bands = self.shape.bands.min(BANDS);
        let key = self.pixel_key(surface, unknown);
        if let Some(place) = kept.find(key) {
            let (held, _) = self.straight.of(unknown, bands)?;
            let [known, beyond, variance] = kept.rest.at(place);
            let mut irradiance = kept.beyond.get(place).copied()?;
            for (band, value) in irradiance.iter_mut().enumerate().take(bands) {
                *value = (*value + linear(held, bands, local, band)).max(0.0);
            }
            // what is blocked goes with it, so that both fill the hemisphere
            let by_element = blocked_by_element(held, bands, local);
            let blocked = clamp(beyond + by_element, 0.0, 1.0);
            let (ratio, doubtful) = ratio(blocked, by_element);
            let share = 1.0 - blocked;
            let open = OpenAt { irradiance, held, share, ratio, by_element, doubtful, variance };
            return (known > 0.0).then_some(open);
        }
        let open = self.open_at(surface, unknown, local, occluders);
        let place = kept.count as usize;
        if place < PIXEL_ELEMENTS_KEPT {
            kept.unknowns.set(place, key as u64);
            kept.count += 1;
            let Some(open) = &open else {
                kept.rest.set(place, [0.0; 3]);
                return None;
            };
            let by_element = blocked_by_element(open.held, bands, local);
            kept.rest.set(place, [1.0, 1.0 - open.share - by_element, open.variance]);
            if let Some(beyond) = kept.beyond.get_mut(place) {
                for (band, (to, value)) in beyond.iter_mut().zip(&open.irradiance).enumerate().take(bands) {
                    *to = value - linear(open.held, bands, local, band);
                }
            }
        }
        open
    }

    /// Squared difference of the irradiance over pi that the whole sky brings a facet of a cluster from what it brings the
    /// cluster's largest, which faces elsewhere, relative to the reference radiance, in the band where that is most; 0 where
    /// outlines do not tell the straight sky.
    pub(super) fn turned_sky(&self, surface: &Surface, unknown: usize) -> f64 {
        let (Some(sky), true) = (&self.light.sky, self.elements.is_cluster(unknown)) else { return 0.0 };
        let (largest, side) = self.elements.facet_of(unknown);
        let normals = [surface.normal, self.scene.side_normal(largest, side)];
        if !self.straight.knows(unknown) || sky.is_uniform() || normals[0] == normals[1] {
            return 0.0;
        }
        let mut light = [[0.0; MAX_BANDS]; 2];
        for (light, normal) in light.iter_mut().zip(normals) {
            sky.irradiance(normal, self.settings.budget.sky, light.head_mut(self.shape.bands));
        }
        let [own, other] = light;
        let bands = own.iter().zip(other).zip(self.reference).filter(|(_, reference)| **reference > 0.0);
        let square = bands.map(|((own, other), reference)| (own - other) / (PI * reference)).map(|x| x * x);
        square.fold(0.0, f64::max)
    }

    /// Whether the linear function over an element of this expected squared error is too little for a point of such a
    /// weight.
    #[inline]
    pub(super) fn wants_look(&self, weight: f64, variance: f64) -> bool {
        let most = self.settings.budget.open_sky;
        weight * weight * variance > most * most
    }

    /// The straight sky at a point. `None` where outlines do not tell it.
    #[inline(never)]
    pub(super) fn open_at(
        &self,
        surface: &Surface,
        unknown: usize,
        local: Local,
        occluders: &mut OccluderCache<'_>,
    ) -> Option<OpenAt<'a>> {
        let sky = self.light.sky.as_ref()?;
        let bands = self.shape.bands;
        let (held, _) = self.straight.of(unknown, bands)?;
        if bands > BANDS {
            return None;
        }
        let basis = straight::basis(self.bvh, sky)?;
        let candidates = &mut occluders.candidates;
        if !candidates.prepare(self.scene, self.bvh, (surface.facet, surface.side)) {
            return None;
        }
        // whatever the point counts: bands of different weights get the same bits
        let goal = self.settings.budget.circles;
        let open = candidates.open(self.scene, self.bvh, surface.point, basis, goal)?;
        let mut irradiance = [0.0; BANDS];
        straight::irradiance(&open, sky, irradiance.head_mut(bands));
        let share = open.values[0];
        let by_element = blocked_by_element(held, bands, local);
        let (ratio, doubtful) = ratio(1.0 - share, by_element);
        let variance = open.error * open.error;
        Some(OpenAt { irradiance, held, share, ratio, by_element, doubtful, variance })
    }
}

/// Share of the hemisphere that is blocked at a point by an element's linear function.
fn blocked_by_element(held: &[f64], bands: usize, local: Local) -> f64 {
    linear(held.part(3 * bands..3 * bands + 3), 1, local, 0)
}

/// By what all else that arrives counts where this share of the hemisphere is blocked, beside that by an element's linear
/// function; and whether they are so far apart that it tells nothing.
fn ratio(blocked: f64, by_element: f64) -> (f64, bool) {
    let same = fabs(blocked - by_element) < straight::BLOCKED_ROUNDING;
    let ratio = if same { 1.0 } else { blocked / by_element.max(f64::MIN_POSITIVE) };
    let within = clamp(ratio, 1.0 / BLOCKED_RATIO_MOST, BLOCKED_RATIO_MOST);
    (within, within != ratio)
}
