//! Settings of all stages, derived from the one tolerance that the caller states.
//!
//! Every layer over the kernel (the owning one, the C interface, bare metal) decides here, so that all compute the
//! same bits.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors and seconds).

use crate::base::budget::ErrorBudget;
use crate::base::error::{Error, Field};
use crate::base::math::{clamp, pow};
use crate::coupling::cluster;
use crate::coupling::mirror_path::MIRRORS_MOST;
use crate::coupling::rows::RowSettings;
use crate::radiosity::beam::BeamSettings;
use crate::radiosity::direct::TableShape;
use crate::scene::sun::Sun;
use crate::scene::{NO_MIRROR, Scene};
use crate::view::chain::{ChainSettings, PixelArea, finds_thrown_sun};

/// What a caller asks of the stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The wanted errors and their shares; that of images is no more than that of the solution.
    pub budget: ErrorBudget,
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
            budget: ErrorBudget::new(tolerance, image.min(tolerance)),
            max_bounces: None,
            all_irradiances: false,
            directional: true,
            ray_budget: None,
        })
    }

    /// How the rows of a scene's coupling are computed.
    pub fn rows(&self, scene: &Scene<'_>) -> RowSettings {
        RowSettings::new(scene, &self.budget, self.max_bounces, self.directional, self.all_irradiances)
    }

    /// Clusters of facets that a scene's elements are to be ([`cluster`]); 0: each facet stays alone. So it is where the
    /// irradiance of each is wanted, and where points find no light for themselves: what curved mirrors and narrow lobes throw
    /// of the sun stays a mean over elements.
    pub fn clusters(&self, scene: &Scene<'_>) -> usize {
        let apart = self.all_irradiances || !finds_thrown_sun(scene);
        if apart { 0 } else { cluster::wanted(scene.facets(), self.budget.solution) }
    }

    /// As [`Settings::rows`], for `count` rows within the budget of rays.
    pub fn rows_within(&self, scene: &Scene<'_>, count: usize) -> RowSettings {
        let rows = self.rows(scene);
        self.ray_budget.map_or(rows, |budget| rows.within(count, budget))
    }

    /// How far specular chains are followed, and on which elements final gathering is used: an image may take as many for
    /// that as another round of a coupling that took `rays`.
    pub fn chains(&self, rays: u64) -> ChainSettings<'_> {
        let ErrorBudget { solution, image, gathering, .. } = self.budget;
        let growth = (solution / image) * (solution / image);
        let finer = if solution > image { COARSE_GROWTH } else { ROUND_GROWTH };
        ChainSettings {
            budget: &self.budget,
            max_bounces: self.max_bounces,
            gather: gathering,
            rays: (rays as f64 * finer * growth) as u64,
            pixel: PixelArea::INFINITE,
            apart: false,
        }
    }
}

/// Rays of a round of half the tolerance over those of the last: twice as many rows of nearly three times the rays,
/// less what needs none. It is multiplied by the square of how much finer the image is than the solution.
const ROUND_GROWTH: f64 = 4.0;

/// Factor on the rays of a round, as [`ROUND_GROWTH`], where the solution is coarser than the image.
///
/// Rows take the power 1.5 of how much finer they are, elements the rest. Above it, corners of mirrors took 40 times
/// the seconds of a finer solution (`cargo run --release --example calibrate`).
const COARSE_GROWTH: f64 = 3.0;

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

/// Whether planes are compared ([`crate::coupling::plane_sides::PlaneSides`]): closed forms are for rows that keep no
/// directions of the sky.
pub fn planes(scene: &Scene<'_>, rows: &RowSettings) -> bool {
    !rows.directional && (rows.all || scene.largest_diffuse() > 0.0)
}

/// The most probing rays of a point: all points of a triangle together have as many as a row of the coupling.
pub fn probing(rows: &RowSettings) -> u32 {
    (rows.rays / 16).clamp(16, crate::coupling::subdivide::PROBE_RAYS_MOST)
}

/// Expected error of the straight sky over an element that circles may leave, irradiance over pi: a part of the images'
/// by what it adds to the element's radiance.
pub fn straight_goal(scene: &Scene<'_>, budget: &ErrorBudget) -> f64 {
    budget.straight / scene.largest_diffuse().max(0.1)
}

/// Orders of reflection are kept apart only where their number is bounded, and small; one level counts all.
pub fn shape(max_bounces: Option<u32>, bands: usize) -> TableShape {
    let levels = max_bounces.filter(|&b| b <= 32).map_or(1, |b| b.max(1) as usize + 1);
    TableShape { levels, bands }
}

/// Settings of the beams that mirrors reflect; `None` where the scene has no use for them.
pub fn beams(scene: &Scene<'_>, sun: &Sun<'_>, settings: &Settings) -> Option<BeamSettings> {
    let Settings { budget, max_bounces, all_irradiances, .. } = *settings;
    let mirrors = |lobe: bool| {
        let is_one = |m: usize| scene.mirror(m) != NO_MIRROR && scene.gloss(m).is_some() == lobe;
        (0..scene.materials()).any(is_one)
    };
    // lobes show the sunlight that flat mirrors reflect onto them
    let wanted = scene.largest_diffuse() > 0.0 || all_irradiances || mirrors(true) && mirrors(false);
    if scene.largest_specular() == 0.0 || !wanted || max_bounces == Some(0) {
        return None;
    }
    let rays = clamp(BEAM_RAYS / budget.image, FEWEST_BEAM_RAYS, MOST_BEAM_RAYS);
    let mirrors = max_bounces.unwrap_or(u32::MAX).min(MIRRORS_MOST as u32);
    Some(BeamSettings::new(scene, sun, rays, budget.beam_chains, mirrors))
}

/// Rays of all beams together, times the images' error: an element that a hundredth of them meets is wrong by n^-3/4 of
/// that.
const BEAM_RAYS: f64 = 100.0;

/// Fewest rays of all beams together: fewer leave elements unmet.
const FEWEST_BEAM_RAYS: f64 = 32768.0;

/// Most rays of all beams together: more take minutes.
const MOST_BEAM_RAYS: f64 = 1e8;

/// Cells along each side of a signature's view, n: the outline's error is n^-3/2.
pub fn signature_cells(budget: &ErrorBudget) -> usize {
    (pow(budget.outline, -2.0 / 3.0) as usize).clamp(64, 2048)
}
