//! What the stages follow from the one number that the caller states.
//!
//! Every layer over the kernel (the owning one, the C interface, bare metal) decides here, so that all compute the
//! same bits.

use crate::base::error::{Error, Field};
use crate::base::math::{clamp, pow};
use crate::coupling::rows::RowSettings;
use crate::coupling::word::LONGEST;
use crate::radiosity::beam::BeamSettings;
use crate::radiosity::direct::Shape;
use crate::radiosity::sun_image;
use crate::scene::sun::Sun;
use crate::scene::{NO_MIRROR, Scene};
use crate::view::chain::ChainSettings;

/// What a caller asks of the stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Wanted error of the diffuse solution, relative to the reference radiance.
    pub tolerance: f64,
    /// Wanted error of images; no more than `tolerance`.
    pub image_tolerance: f64,
    /// Light reflected more often does not count; `None`: by tolerance.
    pub max_bounces: Option<u32>,
    /// Irradiance of all facets is wanted, also of those that reflect nothing diffusely.
    pub all_irradiances: bool,
    /// Directions of blocked and mirrored light are kept.
    pub directional: bool,
    /// The most first rays of all rows of the coupling; `None`: by tolerance.
    pub ray_budget: Option<u64>,
}

impl Settings {
    /// Settings of which only the solution's and the images' tolerances are given.
    ///
    /// # Errors
    /// [`Error::Range`] for one outside 1e-6 to 0.1.
    pub fn new(tolerance: f64, image_tolerance: Option<f64>) -> Result<Settings, Error> {
        check_tolerance(tolerance)?;
        let image = image_tolerance.unwrap_or(tolerance);
        check_tolerance(image)?;
        Ok(Settings {
            tolerance,
            image_tolerance: image.min(tolerance),
            max_bounces: None,
            all_irradiances: false,
            directional: true,
            ray_budget: None,
        })
    }

    /// How the rows of a scene's coupling are computed.
    pub fn rows(&self, scene: &Scene<'_>) -> RowSettings {
        RowSettings::new(scene, self.tolerance, self.max_bounces, self.directional, self.all_irradiances)
    }

    /// As [`Settings::rows`], for so many rows within the budget of rays.
    pub fn rows_within(&self, scene: &Scene<'_>, count: usize) -> RowSettings {
        let rows = self.rows(scene);
        self.ray_budget.map_or(rows, |budget| rows.within(count, budget))
    }

    /// How the chains of images are followed; `rays` is the coupling's.
    pub fn chains(&self, rays: u64) -> ChainSettings {
        chains((self.image_tolerance, self.tolerance), self.max_bounces, rays)
    }
}

/// Refuses a tolerance outside 1e-6 to 0.1.
pub fn check_tolerance(tolerance: f64) -> Result<(), Error> {
    if (1e-6..=0.1).contains(&tolerance) {
        Ok(())
    } else {
        Err(Error::Range { field: Field::Tolerance, band: 0, value: tolerance })
    }
}

/// Records that a row of the coupling may need while it grows: a ray leaves one where it is blocked and one at each
/// facet that it meets.
pub fn unmerged(rows: &RowSettings) -> usize {
    4 * rows.most_rays() as usize
}

/// Whether planes are compared ([`crate::coupling::facing::Facing`]): closed forms are for rows that keep no directions of the sky.
pub fn planes(scene: &Scene<'_>, rows: &RowSettings) -> bool {
    !rows.directional && (rows.all || scene.largest_diffuse() > 0.0)
}

/// The most probing rays of a point: all points of a triangle together have as many as a row of the coupling.
pub fn probing(rows: &RowSettings) -> u32 {
    (rows.rays / 16).clamp(16, crate::coupling::subdivide::MOST_RAYS)
}

/// Relative error of the sky's irradiance on a plane.
pub fn sky_accuracy(tolerance: f64) -> f64 {
    (0.05 * tolerance).max(1e-9)
}

/// Expected error of the straight sky over an element that circles may leave, irradiance over pi: a part of the tolerance by
/// what it adds to the element's radiance.
pub fn straight_goal(scene: &Scene<'_>, tolerance: f64) -> f64 {
    0.5 * tolerance / scene.largest_diffuse().max(0.1)
}

/// Orders of reflection are kept apart only where their number is bounded, and small; one level counts all.
pub fn shape(max_bounces: Option<u32>, bands: usize) -> Shape {
    let levels = max_bounces.filter(|&b| b <= 32).map_or(1, |b| b.max(1) as usize + 1);
    Shape { levels, bands }
}

/// How the beams that mirrors throw are traced; `None` where the scene has no use for them.
pub fn beams(
    scene: &Scene<'_>,
    sun: &Sun<'_>,
    tolerance: f64,
    max_bounces: Option<u32>,
    all_irradiances: bool,
) -> Option<BeamSettings> {
    let mirrors = |lobe: bool| {
        let is_one = |m: usize| scene.mirror(m) != NO_MIRROR && scene.gloss(m).is_some() == lobe;
        (0..scene.materials()).any(is_one)
    };
    // lobes show what flat mirrors throw on them
    let wanted = scene.largest_diffuse() > 0.0 || all_irradiances || mirrors(true) && mirrors(false);
    if scene.largest_specular() == 0.0 || !wanted || max_bounces == Some(0) {
        return None;
    }
    let rays = clamp(100.0 / tolerance, 32768.0, 1e8);
    let mirrors = max_bounces.unwrap_or(u32::MAX).min(LONGEST as u32);
    Some(BeamSettings::new(scene, sun, rays, sun_image::CUTOFF * tolerance, mirrors))
}

/// Elements of which so many tolerances of error are expected are mended by rays from points in every image: few are.
const GATHER: f64 = 3.0;

/// How far specular chains are followed, and where rays mend what elements are wrong by: an image may take as many for that
/// as another round of a coupling that took `rays`, made for the solution's tolerance, the second of the two.
pub fn chains((tolerance, solution): (f64, f64), max_bounces: Option<u32>, rays: u64) -> ChainSettings {
    let growth = (solution / tolerance) * (solution / tolerance);
    ChainSettings {
        cutoff: 0.05 * tolerance,
        max_bounces,
        tolerance,
        sky_error: sky_accuracy(tolerance),
        gather: GATHER,
        rays: (rays as f64 * 4.0 * growth) as u64,
        solution,
        pixel: (f64::INFINITY, 0.0),
        apart: false,
    }
}

/// Cells along each side of a signature's view: the outline's error, n^-3/2, half of the tolerance.
pub fn signature_cells(tolerance: f64) -> usize {
    (pow(0.5 * tolerance, -2.0 / 3.0) as usize).clamp(64, 2048)
}
