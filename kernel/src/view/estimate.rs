//! The error estimate of an image: its parts, their sum and the largest of them.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (true errors beside estimates).

use crate::base::math::sqrt;
use crate::view::chain::CAUTION;
use crate::view::image::Tally;

/// The largest part of an error estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limit {
    /// The estimate is 0.
    #[default]
    Nothing,
    /// Rays and elements of the diffuse solution.
    Visibility,
    /// Rays through pixels and of lobes.
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

/// Factor c of the 95 % bound on the mean square error over n object pixels, (1 + c n^-1/2) times the expected one.
///
/// Pixel errors have heavy tails (one pixel in some hundreds errs by 10 to 20 times its expected value), so the mean
/// square over few pixels scatters. Measured by `cargo run --release --example calibrate`.
const FEW_PIXELS_FACTOR: f64 = 8.0;

/// Factor on the expected error of sampling pixels and lobes: the 95 % quantile of the true error over it. Measured by `cargo run
/// --release --example calibrate`.
const SAMPLING_CAUTION: f64 = 1.25;

/// Relative error of pixels in f32, and of directions of images of the sun.
const PIXEL_ROUNDING: f64 = 1e-7;

/// Expected eps of eq. 16 of an image, relative to the reference radiance, and its largest part: `tally` of all its
/// rows, `solver` the bound on the radiances' error.
pub fn estimate(tally: &Tally, solver: f64) -> (f64, Limit) {
    let parts = parts(tally, solver);
    let sum: f64 = parts.iter().map(|(_, e)| e * e).sum::<f64>()
        + if tally.object_pixels > 0 { PIXEL_ROUNDING * PIXEL_ROUNDING } else { 0.0 };
    let largest = parts.iter().fold((Limit::Nothing, 0.0), |a, &b| if b.1 > a.1 { b } else { a });
    (sqrt(sum), largest.0)
}

/// The parts of the estimate, each what its cause is expected to contribute.
pub fn parts(tally: &Tally, solver: f64) -> [(Limit, f64); 4] {
    let pixels = tally.object_pixels.max(1) as f64;
    [
        (
            Limit::Visibility,
            CAUTION * sqrt((1.0 + FEW_PIXELS_FACTOR / sqrt(pixels)) * (tally.noise2 / pixels).max(0.0)),
        ),
        (Limit::Sampling, SAMPLING_CAUTION * sqrt(tally.sampling2 / pixels)),
        (Limit::Solver, solver),
        (Limit::Chain, tally.tail),
    ]
}
