//! What the stages follow from the one number that the caller states, and what the error estimate is made of.
//!
//! Every layer over the kernel (the owning one, the C interface, bare metal) decides here, so that all compute the
//! same bits.

use crate::beam::BeamSettings;
use crate::chain::{ChainSettings, GATHERS};
use crate::coupling::rows::RowSettings;
use crate::coupling::word::LONGEST;
use crate::error::{Error, Field};
use crate::image::Tally;
use crate::light::{Light, Shape};
use crate::lobe::Lobe;
use crate::math::{clamp, pow, sqrt};
use crate::radiosity::{bound, sweeps};
use crate::scene::{MAX_BANDS, Scene};
use crate::sky::LARGEST;
use crate::sun::Sun;
use crate::sun_image;

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

/// Whether planes are compared ([`crate::facing::Facing`]): closed forms are for rows that keep no directions of the sky.
pub fn planes(scene: &Scene<'_>, rows: &RowSettings) -> bool {
    !rows.directional && (rows.all || scene.largest_diffuse() > 0.0)
}

/// The most probing rays of a point: all points of a triangle together have as many as a row of the coupling.
pub fn probing(rows: &RowSettings) -> u32 {
    (rows.rays / 16).clamp(16, crate::subdivide::MOST_RAYS)
}

/// Relative error of the sky's irradiance on a plane.
pub fn sky_accuracy(tolerance: f64) -> f64 {
    (0.05 * tolerance).max(1e-9)
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
    let diffuse = scene.largest_diffuse() > 0.0 || all_irradiances;
    if scene.largest_specular() == 0.0 || !diffuse || max_bounces == Some(0) {
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
    }
}

/// Cells along each side of a signature's view: the outline's error, n^-3/2, half of the tolerance.
pub fn signature_cells(tolerance: f64) -> usize {
    (pow(0.5 * tolerance, -2.0 / 3.0) as usize).clamp(64, 2048)
}

/// When the sweeps over a linear system whose weights may be negative end: as soon as the bound on their error is a
/// small part of the tolerance. [`crate::solver::Solver`] is for all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweeps {
    /// Sweeps done.
    pub done: u32,
    /// Bound on the radiances' error, relative to the reference radiance.
    pub error: f64,
    q: f64,
    goal: f64,
    most: u32,
}

impl Sweeps {
    /// Before the first sweep of a system of contraction `q` (the largest over all rows), until the bound on the error
    /// is at most `goal`.
    pub fn until(q: f64, goal: f64) -> Sweeps {
        let most = if q < 1.0 { sweeps(q, goal).saturating_add(200).min(100_000) } else { 2_000 };
        Sweeps { done: 0, error: f64::INFINITY, q, goal, most }
    }

    /// True where another sweep is wanted.
    pub fn more(&self) -> bool {
        self.error > self.goal && self.done < self.most
    }

    /// Notes a sweep that changed the radiances by at most `change`.
    ///
    /// # Errors
    /// [`Error::Diverges`] where the last sweep allowed did not end it and nothing bounds the rest.
    pub fn took(&mut self, change: f64) -> Result<(), Error> {
        self.done += 1;
        self.error = bound(change, self.q);
        if self.done >= self.most && self.q >= 1.0 {
            return Err(Error::Diverges { row_sum: self.q });
        }
        Ok(())
    }
}

/// Refuses radiances above 1e37: f32 images hold 3.4e38, and a ninth of that leaves room for sums along a chain.
pub fn check_radiance(radiance: &[f64], bands: usize) -> Result<(), Error> {
    match radiance.iter().enumerate().find(|(_, l)| l.is_nan() || **l > LARGEST) {
        Some((at, &value)) => Err(Error::Range { field: Field::Emission, band: at % bands.max(1), value }),
        None => Ok(()),
    }
}

/// Refuses a sun whose highlight in one of the scene's lobes exceeds 1e37, as [`check_radiance`] does the rest.
///
/// # Errors
/// [`Error::Range`] that names the sun's irradiance.
pub fn check_highlights(scene: &Scene<'_>, light: &Light<'_>) -> Result<(), Error> {
    let Some(sun) = &light.sun else { return Ok(()) };
    for band in 0..scene.bands() {
        if highlight(scene, sun, band) > LARGEST {
            return Err(Error::Range { field: Field::SunIrradiance, band, value: sun.irradiance(band) });
        }
    }
    Ok(())
}

/// The sun's largest radiance in any lobe: E rho_0 q at the lobe's peak.
fn highlight(scene: &Scene<'_>, sun: &Sun<'_>, band: usize) -> f64 {
    let of = |material: usize| {
        let lobe = scene.gloss(material).and_then(|ratio| Lobe::new(ratio).ok());
        let rho = scene.specular(material).get(band).copied().unwrap_or(0.0);
        lobe.map_or(0.0, |l| sun.irradiance(band) * rho * l.value(1.0))
    };
    (0..scene.materials()).map(of).fold(0.0, f64::max)
}

/// Largest radiance that any ray can see, relative to the reference: sky, sun's disc and highlight in a lobe together,
/// or diffuse radiance.
pub fn brightest(scene: &Scene<'_>, light: &Light<'_>, reference: &[f64], radiance: &[f64]) -> f64 {
    let bands = reference.len().clamp(1, MAX_BANDS);
    let mut all = [0.0; MAX_BANDS];
    let (largest, _) = all.split_at_mut(bands);
    light.largest_radiance(largest);
    if let Some(sun) = &light.sun {
        largest
            .iter_mut()
            .enumerate()
            .for_each(|(b, l)| *l += sun.disc_radiance(b) + highlight(scene, sun, b));
    }
    for values in radiance.chunks_exact(bands) {
        largest.iter_mut().zip(values).for_each(|(l, &v)| *l = f64::max(*l, v));
    }
    relative(largest, reference)
}

/// Largest ratio over the bands that have a reference.
fn relative(values: &[f64], reference: &[f64]) -> f64 {
    values.iter().zip(reference).filter(|(_, r)| **r > 0.0).map(|(v, r)| v / r).fold(0.0, f64::max)
}

/// The largest part of an error estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limit {
    /// The estimate is 0.
    #[default]
    Nothing,
    /// Rays and elements of the diffuse solution.
    Visibility,
    /// Rays through pixels.
    Sampling,
    /// The sweeps that were not done.
    Solver,
    /// Chains that were cut.
    Chain,
}

impl Limit {
    /// The word for reports.
    pub const fn name(self) -> &'static str {
        match self {
            Limit::Nothing => "nothing",
            Limit::Visibility => "visibility",
            Limit::Sampling => "sampling",
            Limit::Solver => "solver",
            Limit::Chain => "chain",
        }
    }
}

/// On the calibration's scenes the true error of the diffuse solution is up to so many times what its halves and
/// quarters, and parts of the rays from points, tell, in nineteen of twenty: a few elements may carry it.
const CAUTION: f64 = 1.9;

/// One pixel in some hundreds is wrong by ten to twenty times what is expected of it: the mean square of the errors of n
/// pixels differs from the expected one by the more the fewer they are, one and so many parts of n^-1/2 in nineteen of
/// twenty.
const FEW: f64 = 8.0;

/// The same of errors from sampling pixels.
const UNSEEN: f64 = 1.25;

/// What pixels of f32 and directions of images of the sun are wrong by.
const ROUNDING: f64 = 1e-7;

/// Expected eps of eq. 16 of an image, relative to the reference radiance, and its largest part: `tally` of all its
/// rows, `solver` the bound on the radiances' error.
pub fn estimate(tally: &Tally, solver: f64) -> (f64, Limit) {
    let pixels = tally.object_pixels.max(1) as f64;
    let parts = [
        (Limit::Visibility, CAUTION * sqrt((1.0 + FEW / sqrt(pixels)) * (tally.noise2 / pixels).max(0.0))),
        (Limit::Sampling, UNSEEN * sqrt(tally.sampling2 / pixels)),
        (Limit::Solver, solver),
        (Limit::Chain, tally.tail),
    ];
    let sum: f64 = parts.iter().map(|(_, e)| e * e).sum::<f64>()
        + if tally.object_pixels > 0 { ROUNDING * ROUNDING } else { 0.0 };
    let largest = parts.iter().fold((Limit::Nothing, 0.0), |a, &b| if b.1 > a.1 { b } else { a });
    (sqrt(sum), largest.0)
}

/// Estimates up to so many tolerances are let pass: on the calibration's scenes they are about twice the error.
const PASSES: f64 = 1.75;

/// The same while the solution is coarser than asked: what is not mended by rays from points may be that wrong.
const PASSES_COARSE: f64 = 1.35;

/// The most rounds of one image, and the most and the least by which the tolerance falls from one to the next: half of it
/// takes some four times as long.
const ROUNDS: u32 = 3;
const STEPS: (f64, f64) = (0.4, 0.7);

/// A round that leaves so much of the last one's estimate: more rounds would, too, once they are as fine as asked.
const IDLE: f64 = 0.8;

/// The most rays and bytes that another round may be expected to take.
const MOST_RAYS: f64 = 2e8;
const MOST_BYTES: f64 = (2u64 << 30) as f64;

/// Solutions of images of less tolerance begin with this, and go on from it if rays from points cannot do the rest.
const COARSE: f64 = 2e-3;

/// The tolerance of the solution of an image's first round.
pub fn first(asked: f64) -> f64 {
    if GATHERS { asked.max(COARSE.min(20.0 * asked)) } else { asked }
}

/// One round of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// The tolerance that its solution was computed to.
    pub tolerance: f64,
    /// The error estimate that it came to.
    pub estimate: f64,
    /// Whether the diffuse solution limits it ([`Limit::Visibility`]).
    pub by_visibility: bool,
    /// Rays of visibility traced.
    pub rays: u64,
    /// Bytes of the coupling.
    pub bytes: usize,
}

/// The tolerance of another round for an image of which `asked` was wanted, after the round `last`, number `rounds`, and
/// the one `before` it; `None` where the image is good enough, would hardly be better, or would take too much.
pub fn again(asked: f64, last: &Round, before: Option<&Round>, rounds: u32) -> Option<f64> {
    let coarse = last.tolerance > asked;
    let idle = !coarse && before.is_some_and(|before| last.estimate > IDLE * before.estimate);
    let passes = if coarse { PASSES_COARSE } else { PASSES };
    let done = last.estimate <= passes * asked || rounds >= ROUNDS || !last.by_visibility || idle;
    let most = (last.rays as f64 / MOST_RAYS).max(last.bytes as f64 / MOST_BYTES);
    let least = STEPS.0.min(asked / last.tolerance).max(sqrt(most));
    // closed forms are as cheap as that
    let wanted = if coarse && last.rays == 0 { asked / last.tolerance } else { asked / last.estimate };
    let step = wanted.min(STEPS.1).max(least);
    let next = step * last.tolerance;
    (!done && step <= STEPS.1 && check_tolerance(next).is_ok()).then_some(next)
}
