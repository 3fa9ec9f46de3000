//! How good a result is, and what was done for it.

use crate::call;
use crate::memory::{needed, object};
use crate::solution::blik_solution;
use crate::status::*;
use crate::view::blik_tally;
use blik_kernel::policy::{self, Limit, Round};
use blik_kernel::settings::Settings as Asked;

/// `limited_by` of [`blik_report`]: the estimate is 0.
pub const BLIK_LIMIT_NOTHING: i32 = 0;
/// `limited_by` of [`blik_report`]: rays and elements of the diffuse solution.
pub const BLIK_LIMIT_VISIBILITY: i32 = 1;
/// `limited_by` of [`blik_report`]: rays through pixels.
pub const BLIK_LIMIT_SAMPLING: i32 = 2;
/// `limited_by` of [`blik_report`]: sweeps that were not done.
pub const BLIK_LIMIT_SOLVER: i32 = 3;
/// `limited_by` of [`blik_report`]: chains that were cut.
pub const BLIK_LIMIT_CHAIN: i32 = 4;

/// What comes back with an image.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_report {
    /// The wanted error, of the solution where images have one of their own.
    pub tolerance: f64,
    /// Expected error of the image (eps of eq. 16), relative to the reference radiance.
    pub error_estimate: f64,
    /// Certain bound on the distance of the radiances from the solution of the discrete system.
    pub certified_solver: f64,
    /// Certain bound on what chains that were cut could still have brought to a pixel.
    pub certified_chain_tail: f64,
    /// Certain bound on the weight of couplings that were cut, as a share of the hemisphere.
    pub certified_dropped: f64,
    /// Rays that coupling traced.
    pub visibility_rays: u64,
    /// Rays toward the sun, and of the beams that mirrors throw.
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
    /// The largest part of the estimate, `BLIK_LIMIT_*`.
    pub limited_by: i32,
}

/// The report of an image from the tally of all its rows; reads the whole coupling.
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_get_report(
    solution: *const blik_solution,
    tally: *const blik_tally,
    error: *mut blik_error,
    report: *mut blik_report,
) -> i32 {
    call(error, || {
        let to = needed(report)?;
        let tally = needed(tally.cast_mut())?;
        // SAFETY: by the caller's promise.
        let (solution, tally): (&blik_solution, _) = unsafe { (object(solution)?, tally.read()) };
        for value in [tally.noise_squared, tally.sampling_squared, tally.chain_tail] {
            if !(0.0..f64::INFINITY).contains(&value) {
                return Err(blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_TALLY).at(0, 0, value));
            }
        }
        let coupling = solution.coupling.info()?;
        let (base, numbers) = (solution.coupling.base, &solution.record.numbers);
        let Asked { tolerance, image_tolerance, .. } = solution.coupling.settings.asked;
        let (estimate, limit) = policy::estimate(&tally.kernel(), numbers.solver);
        let report = blik_report {
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
            tolerance_met: i32::from(estimate <= image_tolerance),
            limited_by: match limit {
                Limit::Nothing => BLIK_LIMIT_NOTHING,
                Limit::Visibility => BLIK_LIMIT_VISIBILITY,
                Limit::Sampling => BLIK_LIMIT_SAMPLING,
                Limit::Solver => BLIK_LIMIT_SOLVER,
                Limit::Chain => BLIK_LIMIT_CHAIN,
            },
        };
        // SAFETY: not null.
        unsafe { to.write(report) };
        Ok(())
    })
}

/// Whether an image had better be computed again, to a finer tolerance: `report` is that of the last round, which was
/// number `rounds` (1 for the first), `before` that of the round before it, or null, and `asked` the wanted error. Writes the
/// tolerance of the next round's coupling, or 0 where the image is good enough, would hardly be better, would take too
/// much, or has had three rounds. With a null `report` it is the first round's: coarser than `asked` where that is little,
/// since rays from the image's points find the rest; `image_tolerance` of the settings is `asked` in every round. This is
/// what the program `render` and the Rust interface go by; an estimate of up to one and three quarters of the error asked
/// for passes, after a round coarser than that up to 1.35.
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_next_tolerance(
    report: *const blik_report,
    before: *const blik_report,
    asked: f64,
    rounds: u32,
    error: *mut blik_error,
    tolerance: *mut f64,
) -> i32 {
    call(error, || {
        let to = needed(tolerance)?;
        policy::check_tolerance(asked)?;
        let round = |report: &blik_report| Round {
            tolerance: report.tolerance,
            estimate: report.error_estimate,
            by_visibility: report.limited_by == BLIK_LIMIT_VISIBILITY,
            rays: report.visibility_rays,
            bytes: report.bytes,
        };
        // SAFETY: null or valid by the caller's promise.
        let (last, before) = unsafe { (report.as_ref().map(round), before.as_ref().map(round)) };
        let next = match last {
            None => policy::first(asked),
            Some(last) => policy::again(asked, &last, before.as_ref(), rounds).unwrap_or(0.0),
        };
        // SAFETY: not null.
        unsafe { to.write(next) };
        Ok(())
    })
}
