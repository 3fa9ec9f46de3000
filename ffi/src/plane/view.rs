//! What is seen of a plane scene: images, rays, the unknowns themselves, what a point sees; the lobe.

use super::scene::{blik_plane_ray, blik_plane_scene, ray};
use super::solution::blik_plane_solution;
use super::{Lanes, Scratchpad, lane_bytes, part};
use crate::call;
use crate::memory::*;
use crate::run::{Runner, Start, blik_run};
use crate::status::*;
use crate::view::rows_of;
use blik_kernel::math::sqrt;
use blik_kernel::plane::Vec2;
use blik_kernel::plane::image::View;
use blik_kernel::plane::lobe::PlaneLobe;
use blik_kernel::plane::scratch::{Scratch, sweep};
use blik_kernel::plane::view::Span;
use core::ffi::c_void;

/// What a ray of the plane brings. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_sample {
    /// Place of an image's sample, along the direction that is clockwise of the view; 0 of [`blik_plane_radiance`].
    pub abscissa: f64,
    /// Radiance: the sky's where nothing is met.
    pub radiance: f64,
    /// Bound on the light that chains could still have brought which were cut, as a share of the brightest.
    pub chain_tail: f64,
    /// Rays traced.
    pub rays: u32,
    /// 1 where the ray meets the object.
    pub object: i32,
}

/// Bytes of scratch memory with which [`blik_plane_image`] and [`blik_plane_radiance`] keep all lanes of `run` busy.
///
/// - `solution`: the solution
/// - `bytes`: receives the bytes; less is for fewer lanes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_scratch_size(
    solution: *const blik_plane_solution,
    run: *const blik_run,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (handle, runner) = unsafe { (object(solution)?, Runner::new(run)?) };
        let size = wanted(handle, &runner)?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

fn wanted(handle: &blik_plane_solution, runner: &Runner) -> Result<usize, blik_error> {
    let size = lane_bytes(&handle.coupling.base.scene, handle.cuts())?.checked_mul(runner.lanes());
    size.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
}

/// Sends a ray for each entry of `out`; `ray(i)` is its abscissa, origin and direction.
fn trace(
    handle: &blik_plane_solution,
    scratch: &mut [u8],
    runner: &mut Runner,
    out: &mut [blik_plane_sample],
    ray: &(dyn Fn(usize) -> Result<(f64, Vec2, Vec2), blik_error> + Sync),
) -> Result<(), blik_error> {
    handle.check_sky()?;
    let (scene, cuts, solved) = (&handle.coupling.base.scene, handle.cuts(), handle.solved());
    let lanes = Lanes::new(scratch, lane_bytes(scene, cuts)?, runner)?;
    let start = Start(out.as_mut_ptr());
    lanes.rows(out.len(), 1.0, (scene, cuts), runner, &|range, scratch| {
        // SAFETY: ranges are disjoint and within the samples.
        let out = unsafe { part(&start, &range, 1) };
        for (out, index) in out.iter_mut().zip(range) {
            let (abscissa, origin, direction) = ray(index)?;
            let seen = solved.radiance(origin, direction, scratch);
            *out = blik_plane_sample {
                abscissa,
                radiance: seen.radiance,
                chain_tail: seen.lost,
                rays: seen.rays,
                object: i32::from(seen.object),
            };
        }
        Ok(())
    })?;
    handle.check_sky()
}

/// Samples of the orthographic image of a plane scene: the centres of equal cells over the object's projection. However an
/// image is split into calls, its bits are the same. A call that is cancelled leaves part of them written.
///
/// - `solution`: the solution
/// - `angle`: where it is seen from: the direction (sin `angle`, cos `angle`)
/// - `samples`: samples across the whole image
/// - `first`: index of the first sample wanted
/// - `count`: number of samples wanted
/// - `out`: receives the samples
/// - `out_count`: number of samples that there is room for: `count`
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_image(
    solution: *const blik_plane_solution,
    angle: f64,
    samples: usize,
    first: usize,
    count: usize,
    run: *const blik_run,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    out: *mut blik_plane_sample,
    out_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, mut runner) = unsafe { (object(solution)?, Runner::new(run)?) };
        let view = View::new(&handle.coupling.base.scene, angle, samples)?;
        rows_of(first, count, samples)?;
        // SAFETY: by the caller's promise.
        let (out, mut scratch) = unsafe {
            (
                output_of((out, out_count), count, BLIK_FIELD_SAMPLES)?,
                Scratchpad::new(scratch, scratch_size, wanted(handle, &runner)?)?,
            )
        };
        trace(handle, scratch.bytes(), &mut runner, out, &|index| {
            let abscissa = view.abscissa(first + index);
            let (origin, direction) = view.ray(abscissa);
            Ok((abscissa, origin, direction))
        })
    })
}

/// Radiance against rays.
///
/// - `solution`: the solution
/// - `rays`: the rays, as for `blik_plane_first_hits`, which start on no body
/// - `count`: number of rays
/// - `out`: receives one sample a ray
/// - `out_count`: number of samples that there is room for: `count`
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_radiance(
    solution: *const blik_plane_solution,
    rays: *const blik_plane_ray,
    count: usize,
    run: *const blik_run,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    out: *mut blik_plane_sample,
    out_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, mut runner) = unsafe { (object(solution)?, Runner::new(run)?) };
        // SAFETY: by the caller's promise.
        let (rays, out, mut scratch) = unsafe {
            let scratch = Scratchpad::new(scratch, scratch_size, wanted(handle, &runner)?)?;
            (input(rays, count)?, output_of((out, out_count), count, BLIK_FIELD_SAMPLES)?, scratch)
        };
        rays.iter().enumerate().try_for_each(|(index, one)| ray(one, index).map(|_| ()))?;
        let none = blik_error::of(BLIK_ERROR_INTERNAL);
        trace(handle, scratch.bytes(), &mut runner, out, &|index| {
            let (origin, direction) = ray(rays.get(index).ok_or(none)?, index)?;
            Ok((0.0, origin, direction))
        })
    })
}

/// An unknown of a plane solution. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_unknown {
    /// Where it stands.
    pub point: [f64; 2],
    /// Unit normal of the surface there.
    pub normal: [f64; 2],
    /// Diffuse radiance without the sun's direct part.
    pub radiance: f64,
    /// Circle or segment, counted over all bodies.
    pub primitive: u32,
}

/// Unknowns of a plane solution.
///
/// - `solution`: the solution
/// - `first`: index of the first unknown
/// - `count`: number of unknowns
/// - `unknowns`: receives the unknowns
/// - `unknown_count`: number of unknowns that there is room for: `count`
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_get_unknowns(
    solution: *const blik_plane_solution,
    first: usize,
    count: usize,
    error: *mut blik_error,
    unknowns: *mut blik_plane_unknown,
    unknown_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let handle = unsafe { object(solution) }?;
        let scene = &handle.coupling.base.scene;
        let range = rows_of(first, count, scene.unknowns())?;
        // SAFETY: by the caller's promise.
        let out = unsafe { output_of((unknowns, unknown_count), count, BLIK_FIELD_SAMPLES) }?;
        for (out, unknown) in out.iter_mut().zip(range) {
            let (primitive, v) = scene.unknown(unknown);
            let place = scene.place(primitive, v);
            *out = blik_plane_unknown {
                point: place.point.to_array(),
                normal: place.normal.to_array(),
                radiance: handle.radiances().get(unknown).copied().unwrap_or(0.0),
                primitive: primitive as u32,
            };
        }
        Ok(())
    })
}

/// A part of what a point of the plane sees. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_span {
    /// Sine of the angle to the normal at which it begins, counter-clockwise positive.
    pub from: f64,
    /// Sine at which it ends: half the difference is its form factor.
    pub to: f64,
    /// The circle or segment that is seen, `BLIK_NO_FACET` for the sky.
    pub primitive: u32,
}

/// Bytes of scratch memory for [`blik_plane_visible`], and the most spans that it finds.
///
/// - `scene`: the scene
/// - `bytes`: receives the bytes
/// - `most_spans`: receives the number of spans
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_visible_size(
    scene: *const blik_plane_scene,
    error: *mut blik_error,
    bytes: *mut usize,
    most_spans: *mut usize,
) -> blik_status {
    call(error, || {
        let (to, most) = (needed(bytes)?, needed(most_spans)?);
        // SAFETY: by the caller's promise.
        let scene = &unsafe { object(scene) }?.scene;
        let size = Scratch::bytes(scene, 0)?;
        // SAFETY: not null.
        unsafe {
            to.write(size);
            most.write(2 * scene.primitives().len() + 1);
        }
        Ok(())
    })
}

/// What a point sees of a plane scene, split at every silhouette.
///
/// - `scene`: the scene
/// - `point`: two numbers
/// - `normal`: two numbers, of any length but zero
/// - `skip`: the circle or segment on which the point is, or `BLIK_NO_FACET`
/// - `spans`: receives the spans, in the order of rising sines
/// - `capacity`: number of spans that there is room for; more are an error that tells how many
/// - `count`: receives the number of spans
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated; `point` and `normal` have two numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_visible(
    scene: *const blik_plane_scene,
    point: *const f64,
    normal: *const f64,
    skip: u32,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    spans: *mut blik_plane_span,
    capacity: usize,
    count: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(count)?;
        // SAFETY: by the caller's promise.
        let scene = &unsafe { object(scene) }?.scene;
        // SAFETY: by the caller's promise.
        let (point, normal, out, mut pad) = unsafe {
            let pad = Scratchpad::new(scratch, scratch_size, Scratch::bytes(scene, 0)?)?;
            (vector(point)?, vector(normal)?, output(spans, capacity)?, pad)
        };
        let size = sqrt(normal.dot(normal));
        if !(size > 0.0 && size.is_finite() && point.is_finite()) {
            return Err(blik_error::of(BLIK_ERROR_DIRECTION).field(BLIK_FIELD_DIRECTION));
        }
        let mut scratch = Scratch::new(scene, 0, pad.bytes())?;
        let seen = sweep(scene, point, normal / size, skip, &[], &mut scratch);
        let (found, _): (&[Span], _) = seen.ok_or(blik_error::of(BLIK_ERROR_INTERNAL))?;
        if found.len() > capacity {
            return Err(blik_error::of(BLIK_ERROR_LENGTH).sizes(found.len(), capacity));
        }
        for (out, span) in out.iter_mut().zip(found) {
            *out = blik_plane_span { from: span.from, to: span.to, primitive: span.primitive };
        }
        // SAFETY: not null.
        unsafe { to.write(found.len()) };
        Ok(())
    })
}

/// The two numbers that `at` points to.
///
/// # Safety
/// `at` is null or has 2 numbers.
unsafe fn vector(at: *const f64) -> Result<Vec2, blik_error> {
    // SAFETY: by the caller's promise.
    let numbers = unsafe { input(at, 2) }?;
    numbers.first_chunk().copied().map(Vec2::from_array).ok_or(blik_error::of(BLIK_ERROR_INTERNAL))
}

/// Closed forms of the lobe in the plane, for a specular reflectance of 1. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_lobe {
    /// Share of light from everywhere that it mirrors toward the view: 1 at normal view, 1/2 at grazing.
    pub albedo: f64,
    /// Its value per radian at the angle from the mirror direction.
    pub value: f64,
    /// Width of a top hat of its peak and visible energy, radians.
    pub equivalent_width: f64,
    /// Mean of the albedo over the angle of incidence.
    pub mean_albedo: f64,
    /// Mean of the albedo weighed by the cosine.
    pub cosine_mean_albedo: f64,
}

/// The lobe of a glossy material of the plane.
///
/// - `gloss_axis_ratio`: long over short axis of the lobe, 1 or more
/// - `cos_view`: cosine of the angle between view and normal, 0 to 1
/// - `off`: angle from the mirror direction in radians
/// - `lobe`: receives the closed forms
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_gloss(
    gloss_axis_ratio: f64,
    cos_view: f64,
    off: f64,
    error: *mut blik_error,
    lobe: *mut blik_plane_lobe,
) -> blik_status {
    call(error, || {
        let to = needed(lobe)?;
        let own = PlaneLobe::new(gloss_axis_ratio)?;
        let range = blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_DIRECTION);
        if !(0.0..=1.0).contains(&cos_view) {
            return Err(range.at(0, 0, cos_view));
        }
        if !off.is_finite() {
            return Err(range.at(0, 0, off));
        }
        let lobe = blik_plane_lobe {
            albedo: own.albedo(cos_view),
            value: own.value(blik_kernel::math::sin(off), blik_kernel::math::cos(off)),
            equivalent_width: own.equivalent_width(cos_view),
            mean_albedo: own.mean_albedo(),
            cosine_mean_albedo: own.cosine_mean_albedo(),
        };
        // SAFETY: not null.
        unsafe { to.write(lobe) };
        Ok(())
    })
}
