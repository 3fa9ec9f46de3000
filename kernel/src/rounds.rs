//! Rounds of an image: the tolerance of the first solution, and whether another, finer one is wanted.

use crate::base::math::sqrt;
use crate::settings::check_tolerance;
use crate::view::chain::GATHERS;

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
    /// Whether the diffuse solution limits it ([`crate::view::estimate::Limit::Visibility`]).
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
