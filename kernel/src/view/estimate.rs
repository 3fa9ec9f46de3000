//! The error estimate of an image: its parts, their sum and the largest of them.

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

/// One pixel in some hundreds is wrong by ten to twenty times what is expected of it: the mean square of the errors of n
/// pixels differs from the expected one by the more the fewer they are, one and so many parts of n^-1/2 in nineteen of
/// twenty.
const FEW_PIXELS_FACTOR: f64 = 8.0;

/// The same of errors from sampling pixels.
const SAMPLING_CAUTION: f64 = 1.25;

/// What pixels of f32 and directions of images of the sun are wrong by.
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
