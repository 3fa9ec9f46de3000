//! Rows of extended form factors of a plane scene.

use super::scene::blik_plane_scene;
use super::{Lanes, lane_bytes, part};
use crate::memory::*;
use crate::run::{Runner, Start, blik_run};
use crate::status::*;
use crate::types::{Place, Sized_, sized};
use crate::{call, caught};
use blik_kernel::arena::{Arena, Need};
use blik_kernel::plane::rows::{self, RowInfo};
use core::ffi::c_void;

/// The coupling of a plane scene in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_plane_coupling {
    tag: usize,
    pub(super) base: &'static blik_plane_scene,
    /// Weights of all unknowns, row by row and class by class.
    pub(super) matrix: &'static [f64],
    /// Share of the half circle that shows the sky, row by row and class by class.
    pub(super) open: &'static [f64],
    info: blik_plane_coupling_info,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

impl Handle for blik_plane_coupling {
    const TAG: usize = 0x5ce9_e012;

    fn tag(at: *mut Self) -> *mut usize {
        // SAFETY: only the place is computed, within memory of a handle's size.
        unsafe { &raw mut (*at).tag }
    }

    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>> {
        &mut self.owner
    }
}

/// Numbers of a plane coupling.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_coupling_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Unknowns: rows.
    pub unknowns: usize,
    /// Rows kept for each unknown: one for each number of reflections that is told apart.
    pub classes: usize,
    /// Rows that see something of the object.
    pub coupled_rows: usize,
    /// Rays traced.
    pub rays: u64,
    /// Largest share of the brightest light that chains of a row could still have brought which were cut: a bound.
    pub dropped: f64,
    /// Bytes in use.
    pub bytes: usize,
}

impl Default for blik_plane_coupling_info {
    fn default() -> blik_plane_coupling_info {
        blik_plane_coupling_info {
            struct_size: size_of::<blik_plane_coupling_info>(),
            unknowns: 0,
            classes: 0,
            coupled_rows: 0,
            rays: 0,
            dropped: 0.0,
            bytes: 0,
        }
    }
}
sized!(blik_plane_coupling_info);

/// Reflections told apart.
pub(super) fn classes(base: &blik_plane_scene) -> usize {
    rows::classes(&base.settings.rows())
}

/// Bytes of what stays.
fn kept(base: &blik_plane_scene) -> Result<usize, blik_error> {
    let (unknowns, classes) = (base.scene.unknowns(), classes(base));
    let size = unknowns.checked_mul(unknowns).and_then(|n| n.checked_mul(classes));
    let size = size.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))?;
    let need =
        Need::new().and::<f64>(size).and::<f64>(unknowns.saturating_mul(classes)).and::<RowInfo>(unknowns);
    Ok(need.bytes()?)
}

/// Bytes with `lanes` lanes.
fn size(base: &blik_plane_scene, lanes: usize) -> Result<usize, blik_error> {
    let scratch = lane_bytes(&base.scene, 0)?.checked_mul(lanes);
    let sum =
        scratch.and_then(|s| s.checked_add(kept(base).ok()?)?.checked_add(head::<blik_plane_coupling>()));
    sum.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
}

fn build(
    base: &'static blik_plane_scene,
    memory: &'static mut [u8],
    runner: &mut Runner,
) -> Result<*mut blik_plane_coupling, blik_error> {
    let (needed, given) = (size(base, 1)?, memory.len());
    if given < needed {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, given));
    }
    let (place, rest) = place::<blik_plane_coupling>(memory)?;
    let kept = kept(base)?;
    let (own, scratch) = rest.split_at_mut_checked(kept).ok_or(blik_error::of(BLIK_ERROR_INTERNAL))?;
    let mut arena = Arena::new(own, kept)?;
    let (scene, settings) = (&base.scene, base.settings.rows());
    let (unknowns, classes) = (scene.unknowns(), classes(base));
    let matrix = arena.take::<f64>(unknowns * unknowns * classes)?;
    let open = arena.take::<f64>(unknowns * classes)?;
    let notes = arena.take::<RowInfo>(unknowns)?;
    let starts = (Start(matrix.as_mut_ptr()), Start(open.as_mut_ptr()), Start(notes.as_mut_ptr()));
    let lanes = Lanes::new(scratch, lane_bytes(scene, 0)?, runner)?;
    lanes.rows(unknowns, 1.0, (scene, 0), runner, &|range, scratch| {
        // SAFETY: ranges are disjoint and within the unknowns.
        let (matrix, open, notes) = unsafe {
            let matrix = part(&starts.0, &range, unknowns * classes);
            (matrix, part(&starts.1, &range, classes), part(&starts.2, &range, 1))
        };
        Ok(rows::fill(scene, &settings, range, matrix, open, notes, scratch)?)
    })?;
    let info = blik_plane_coupling_info {
        struct_size: size_of::<blik_plane_coupling_info>(),
        unknowns,
        classes,
        coupled_rows: notes.iter().map(|n| n.coupled as usize).sum(),
        rays: notes.iter().map(|n| u64::from(n.rays)).sum(),
        dropped: notes.iter().map(|n| n.lost).fold(0.0, f64::max),
        bytes: kept,
    };
    let handle = blik_plane_coupling {
        tag: blik_plane_coupling::TAG,
        base,
        matrix,
        open,
        info,
        #[cfg(feature = "std")]
        owner: None,
    };
    // SAFETY: `place` made room for it.
    unsafe { place.write(handle) };
    Ok(place.as_ptr())
}

/// Bytes of memory with which [`blik_plane_coupling_init`] keeps all lanes of `run` busy.
///
/// - `scene`: the scene
/// - `bytes`: receives the bytes; less is for fewer lanes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_coupling_size(
    scene: *const blik_plane_scene,
    run: *const blik_run,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (base, runner) = unsafe { (object(scene)?, Runner::new(run)?) };
        let size = size(base, runner.lanes())?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Computes the extended form factors of all unknowns of a plane scene in the caller's memory: once for its bodies and
/// materials, whatever the light.
///
/// - `scene`: the scene, which must outlive the coupling
/// - `coupling`: receives the coupling
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the coupling is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_coupling_init(
    scene: *const blik_plane_scene,
    run: *const blik_run,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    coupling: *mut *mut blik_plane_coupling,
) -> blik_status {
    call(error, || {
        let to = needed(coupling)?;
        // SAFETY: by the caller's promise.
        let (base, mut runner, memory) = unsafe { (object(scene)?, Runner::new(run)?, bytes(memory, size)?) };
        let made = build(base, memory, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Computes the extended form factors of all unknowns of a plane scene in memory of its own.
///
/// - `scene`: the scene, which must outlive the coupling
/// - `coupling`: receives the coupling; to be ended by [`blik_plane_coupling_destroy`]
///
/// # Safety
/// Pointers are null or valid.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_coupling_create(
    scene: *const blik_plane_scene,
    run: *const blik_run,
    error: *mut blik_error,
    coupling: *mut *mut blik_plane_coupling,
) -> blik_status {
    call(error, || {
        let to = needed(coupling)?;
        // SAFETY: by the caller's promise.
        let (base, mut runner) = unsafe { (object(scene)?, Runner::new(run)?) };
        let mut slab = Slab::new(size(base, runner.lanes())?)?;
        // SAFETY: the handle owns the slab, or is never made.
        let made = build(base, unsafe { slab.bytes_mut() }, &mut runner)?;
        // SAFETY: just made, and not null.
        unsafe {
            (*made).owner = Some(std::boxed::Box::new(Owned(std::vec![slab])));
            to.write(made);
        }
        Ok(())
    })
}

/// Ends a plane coupling and frees what it owns.
///
/// - `coupling`: the coupling, whose solutions have ended before; null: nothing
///
/// # Safety
/// Null or a coupling that nobody uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_coupling_destroy(coupling: *mut blik_plane_coupling) {
    let _ = caught(|| {
        // SAFETY: by the caller's promise.
        unsafe { end(coupling) };
        Ok(())
    });
}

/// Numbers of a plane coupling.
///
/// - `coupling`: the coupling
/// - `info`: receives them; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_coupling_get_info(
    coupling: *const blik_plane_coupling,
    error: *mut blik_error,
    info: *mut blik_plane_coupling_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, handle): (_, &blik_plane_coupling) = unsafe { (Place::new(info)?, object(coupling)?) };
        to.write(handle.info);
        Ok(())
    })
}

/// Rows of extended form factors.
///
/// - `coupling`: the coupling
/// - `first`: index of the first row
/// - `count`: number of rows
/// - `factors`: receives for each row and class the factors toward all unknowns; null: not wanted
/// - `factor_count`: number of values that there is room for: `count` x classes x unknowns
/// - `open`: receives for each row and class the share that shows the sky; null: not wanted
/// - `open_count`: number of values that there is room for: `count` x classes
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_coupling_get_rows(
    coupling: *const blik_plane_coupling,
    first: usize,
    count: usize,
    error: *mut blik_error,
    factors: *mut f64,
    factor_count: usize,
    open: *mut f64,
    open_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let handle: &blik_plane_coupling = unsafe { object(coupling) }?;
        let range = crate::view::rows_of(first, count, handle.info.unknowns)?;
        let (unknowns, classes) = (handle.info.unknowns, handle.info.classes);
        // SAFETY: by the caller's promise.
        let (factors, open) = unsafe {
            let factors = (factors, factor_count);
            let factors = optional_output(factors, count * classes * unknowns, BLIK_FIELD_FACTORS)?;
            (factors, optional_output((open, open_count), count * classes, BLIK_FIELD_FACTORS)?)
        };
        let copy = |to: &mut [f64], from: &[f64], stride: usize| {
            to.iter_mut().zip(from.iter().skip(range.start * stride)).for_each(|(to, from)| *to = *from);
        };
        copy(factors, handle.matrix, classes * unknowns);
        copy(open, handle.open, classes);
        Ok(())
    })
}
