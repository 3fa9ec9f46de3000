//! How good a result is, and what was done for it.

use crate::call;
use crate::memory::object;
use crate::solution::blik_solution;
use crate::status::*;
use crate::types::{Place, Sized_, read, sized};
use crate::view::blik_tally;
use blik_kernel::base::budget::ErrorBudget;
use blik_kernel::policy::{self, Limit, Round};

/// The largest part of the estimate of a [`blik_report`].
pub type blik_limit = i32;

/// The estimate is 0.
pub const BLIK_LIMIT_NOTHING: i32 = 0;
/// Rays and elements of the diffuse solution.
pub const BLIK_LIMIT_VISIBILITY: i32 = 1;
/// Rays through pixels.
pub const BLIK_LIMIT_SAMPLING: i32 = 2;
/// Sweeps that were not done.
pub const BLIK_LIMIT_SOLVER: i32 = 3;
/// Chains that were cut.
pub const BLIK_LIMIT_CHAIN: i32 = 4;

/// Report of an image: work that was done, error estimates and bounds.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_report {
    /// Size of this struct.
    pub struct_size: usize,
    /// The wanted error, of the solution where images have one of their own.
    pub tolerance: f64,
    /// Expected error of the image (rms over the pixels that meet the object), relative to the reference radiance.
    pub error_estimate: f64,
    /// Certain bound on the distance of the radiances from the solution of the discrete system.
    pub certified_solver: f64,
    /// Certain bound on what chains that were cut could still have brought to a pixel.
    pub certified_chain_tail: f64,
    /// Certain bound on the weight of couplings that were cut, as a share of the hemisphere.
    pub certified_dropped: f64,
    /// Rays that coupling traced.
    pub visibility_rays: u64,
    /// Rays toward the sun, and of beams, which mirrors reflect.
    pub sun_rays: u64,
    /// Rays through pixels.
    pub primary_rays: u64,
    /// Rays of specular chains and toward the sun from what pixels see.
    pub chain_rays: u64,
    /// Form factors kept.
    pub pairs: u64,
    /// Rows of the coupling that nothing needed.
    pub skipped_rows: u64,
    /// Rows of the coupling that see the sky alone.
    pub open_rows: u64,
    /// Elements.
    pub elements: usize,
    /// Bytes of the scene, of the coupling and of the solution.
    pub bytes: usize,
    /// Sweeps over the linear system.
    pub sweeps: u32,
    /// 1 where the estimate is at most the wanted error of images.
    pub tolerance_met: i32,
    /// The largest part of the estimate.
    pub limited_by: blik_limit,
}

impl Default for blik_report {
    fn default() -> blik_report {
        blik_report {
            struct_size: size_of::<blik_report>(),
            tolerance: 0.0,
            error_estimate: 0.0,
            certified_solver: 0.0,
            certified_chain_tail: 0.0,
            certified_dropped: 0.0,
            visibility_rays: 0,
            sun_rays: 0,
            primary_rays: 0,
            chain_rays: 0,
            pairs: 0,
            skipped_rows: 0,
            open_rows: 0,
            elements: 0,
            bytes: 0,
            sweeps: 0,
            tolerance_met: 0,
            limited_by: BLIK_LIMIT_NOTHING,
        }
    }
}

/// The rounds of an image: what was asked, and what the last round came to.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_rounds {
    /// Size of this struct.
    pub struct_size: usize,
    /// The wanted error of the image, 1e-6 to 0.1: `image_tolerance` of the settings of every round; default 2e-3.
    pub asked: f64,
    /// Tolerance of the coupling of the next round; set by [`blik_rounds_next`].
    pub tolerance: f64,
    /// Rounds so far; kept by [`blik_rounds_next`], as all that follows.
    pub done: u32,
    /// Not 0: the diffuse solution limited the last round.
    pub last_by_visibility: i32,
    /// Tolerance of the last round.
    pub last_tolerance: f64,
    /// Error estimate of the last round.
    pub last_estimate: f64,
    /// Rays of visibility of the last round.
    pub last_rays: u64,
    /// Bytes of the last round.
    pub last_bytes: usize,
}

impl Default for blik_rounds {
    fn default() -> blik_rounds {
        blik_rounds {
            struct_size: size_of::<blik_rounds>(),
            asked: 2e-3,
            tolerance: 0.0,
            done: 0,
            last_by_visibility: 0,
            last_tolerance: 0.0,
            last_estimate: 0.0,
            last_rays: 0,
            last_bytes: 0,
        }
    }
}
sized!(blik_report, blik_rounds);

/// The report of an image; reads the whole coupling.
///
/// - `solution`: the solution
/// - `tally`: the tally of all rows of the image
/// - `report`: receives the report; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_get_report(
    solution: *const blik_solution,
    tally: *const blik_tally,
    error: *mut blik_error,
    report: *mut blik_report,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, solution, tally): (_, &blik_solution, _) =
            unsafe { (Place::new(report)?, object(solution)?, read(tally)?) };
        for value in [tally.noise_squared, tally.sampling_squared, tally.chain_tail] {
            if !(0.0..f64::INFINITY).contains(&value) {
                return Err(blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_TALLY).at(0, 0, value));
            }
        }
        let coupling = solution.coupling.info()?;
        let (base, numbers) = (solution.coupling.base, &solution.record.numbers);
        let ErrorBudget { solution: tolerance, image, .. } = solution.coupling.settings.asked.budget;
        let (estimate, limit) = policy::estimate(&tally.kernel(), numbers.solver);
        to.write(blik_report {
            struct_size: size_of::<blik_report>(),
            tolerance,
            error_estimate: estimate,
            certified_solver: numbers.solver,
            certified_chain_tail: tally.chain_tail,
            certified_dropped: coupling.dropped,
            visibility_rays: coupling.rays,
            sun_rays: numbers.sun_rays,
            primary_rays: tally.primary_rays,
            chain_rays: tally.chain_rays,
            pairs: coupling.pairs,
            skipped_rows: coupling.skipped_rows,
            open_rows: coupling.open_rows,
            elements: coupling.elements,
            bytes: base.scene.memory() + base.bvh.memory() + coupling.bytes + solution.bytes,
            sweeps: numbers.sweeps as u32,
            tolerance_met: i32::from(estimate <= image),
            limited_by: match limit {
                Limit::Nothing => BLIK_LIMIT_NOTHING,
                Limit::Visibility => BLIK_LIMIT_VISIBILITY,
                Limit::Sampling => BLIK_LIMIT_SAMPLING,
                Limit::Solver => BLIK_LIMIT_SOLVER,
                Limit::Chain => BLIK_LIMIT_CHAIN,
            },
        });
        Ok(())
    })
}

/// Whether an image had better be computed again, and to what tolerance: a loop that the program `render` and the Rust
/// interface go by, too.
///
/// Writes to `tolerance` of the rounds that of the next round's coupling, or 0 where the image is good enough, would hardly
/// be better, would take too much, or has had three rounds. The first round is coarser than `asked` where that is little,
/// since rays from the image's points find the rest.
///
/// - `rounds`: the rounds, set by `blik_rounds_init` and then by nothing but this call
/// - `report`: the report of the image of the last round; null before the first
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_rounds_next(
    rounds: *mut blik_rounds,
    report: *const blik_report,
    error: *mut blik_error,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, mut rounds) = unsafe { (Place::new(rounds)?, read(rounds.cast_const())?) };
        policy::check_tolerance(rounds.asked)?;
        if report.is_null() {
            let asked = rounds.asked;
            to.write(blik_rounds {
                asked,
                tolerance: policy::first_tolerance(asked),
                ..blik_rounds::default()
            });
            return Ok(());
        }
        // SAFETY: by the caller's promise.
        let report = unsafe { read(report) }?;
        let last = Round {
            tolerance: report.tolerance,
            estimate: report.error_estimate,
            by_visibility: report.limited_by == BLIK_LIMIT_VISIBILITY,
            rays: report.visibility_rays,
            bytes: report.bytes,
        };
        let before = Round {
            tolerance: rounds.last_tolerance,
            estimate: rounds.last_estimate,
            by_visibility: rounds.last_by_visibility != 0,
            rays: rounds.last_rays,
            bytes: rounds.last_bytes,
        };
        let before = (rounds.done > 0).then_some(&before);
        rounds.done = rounds.done.saturating_add(1);
        rounds.tolerance = policy::next_tolerance(rounds.asked, &last, before, rounds.done).unwrap_or(0.0);
        rounds.last_by_visibility = i32::from(last.by_visibility);
        (rounds.last_tolerance, rounds.last_estimate) = (last.tolerance, last.estimate);
        (rounds.last_rays, rounds.last_bytes) = (last.rays, last.bytes);
        to.write(rounds);
        Ok(())
    })
}
