//! Rounds of an image: the tolerance of the first solution, and whether another, finer one is wanted.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors, rounds and seconds).

use crate::base::math::sqrt;
use crate::settings::check_tolerance;
use crate::view::chain::GATHERS;

/// Most rounds of one image.
const ROUNDS_MOST: u32 = 3;

/// Least ratio of a round's tolerance to the one before: half the tolerance takes some four times as long.
const ROUND_STEP_LEAST: f64 = 0.3;

/// Largest ratio of a round's tolerance to the one before: a round that is hardly finer is not worth its start.
const ROUND_STEP_MOST: f64 = 0.7;

/// Ratio of a round's error estimate to the one before above which no other round follows, once the solution is as fine as
/// asked: the next would gain as little.
const ROUND_GAIN_IDLE: f64 = 0.8;

/// Most rays that another round may be expected to take.
const ROUND_RAYS_MOST: f64 = 2e8;

/// Most bytes of coupling that another round may be expected to take.
const ROUND_BYTES_MOST: f64 = (2u64 << 30) as f64;

/// Tolerance of an image's first solution over that of the image. Final gathering finds the rest, and reflected light
/// counts with the reflectance, from many elements whose errors differ. Measured by `cargo run --release --example
/// calibrate`.
const FIRST_ROUND_FACTOR: f64 = 3.0;

/// Largest tolerance of a first solution: coarser elements tell nothing.
const FIRST_TOLERANCE_MOST: f64 = 0.02;

/// Tolerance of an image below which that of its first solution goes with its power of 3/4 alone. Rays of rows go with
/// the power -1.5 of theirs, and more elements have them; rays from points go with the power -1.3 of the image's.
const FINE_IMAGE: f64 = 2e-3;

/// Largest factor by which the estimate of a part of an image exceeds that of all.
const REGION_FACTOR: f64 = 1.15;

/// The tolerance of the solution of an image's first round.
pub fn first_tolerance(asked: f64) -> f64 {
    if GATHERS {
        asked.max(
            FIRST_TOLERANCE_MOST.min(FIRST_ROUND_FACTOR * asked * sqrt(sqrt(FINE_IMAGE / asked)).max(1.0)),
        )
    } else {
        asked
    }
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
pub fn next_tolerance(asked: f64, last: &Round, before: Option<&Round>, rounds: u32) -> Option<f64> {
    let coarse = last.tolerance > asked;
    let idle = !coarse && before.is_some_and(|before| last.estimate > ROUND_GAIN_IDLE * before.estimate);
    let done = last.estimate <= asked || rounds >= ROUNDS_MOST || !last.by_visibility || idle;
    let most = (last.rays as f64 / ROUND_RAYS_MOST).max(last.bytes as f64 / ROUND_BYTES_MOST);
    let least = ROUND_STEP_LEAST.min(asked / last.tolerance).max(sqrt(most));
    // no ray was traced, as every row is in closed form: finer ones are as cheap
    let wanted = if coarse && last.rays == 0 { asked / last.tolerance } else { asked / last.estimate };
    let step = wanted.min(ROUND_STEP_MOST).max(least);
    let next = step * last.tolerance;
    (!done && step <= ROUND_STEP_MOST && check_tolerance(next).is_ok()).then_some(next)
}

/// As [`next_tolerance`] after a look at a part of the image: where that is far from what is asked, the rest is not
/// worth its rays.
pub fn at_once(asked: f64, look: &Round, before: Option<&Round>, rounds: u32) -> Option<f64> {
    (look.estimate > REGION_FACTOR * asked).then(|| next_tolerance(asked, look, before, rounds)).flatten()
}
