//! Form factors between points and polygons, and the lobe of glossy materials: functions without a scene.

use crate::call;
use crate::memory::{bytes, input, needed};
use crate::status::*;
use blik_kernel::form_factor::{self, Convex};
use blik_kernel::lobe::Lobe;
use blik_kernel::math::{Vec3, unit};
use core::ffi::c_void;
use core::slice::from_raw_parts;

/// The caller's corners, three numbers each.
///
/// # Safety
/// `at` has 3 `count` numbers.
unsafe fn corners<'a>(at: *const f64, count: usize) -> Result<&'a [Vec3], blik_error> {
    let numbers = count.checked_mul(3).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))?;
    // SAFETY: by the caller's promise.
    let numbers = unsafe { input(at, numbers) }?;
    if let Some(vertex) = numbers.iter().position(|x| !x.is_finite()) {
        return Err(blik_error::of(BLIK_ERROR_VERTEX).at(vertex / 3, 0, 0.0));
    }
    const { assert!(size_of::<Vec3>() == 24 && align_of::<Vec3>() == align_of::<f64>()) };
    // SAFETY: a Vec3 is three f64 (size and alignment checked above).
    Ok(unsafe { from_raw_parts(numbers.as_ptr().cast(), count) })
}

/// The one vector that `at` points to.
///
/// # Safety
/// `at` has 3 numbers.
unsafe fn vector(at: *const f64) -> Result<Vec3, blik_error> {
    // SAFETY: by the caller's promise.
    let corners = unsafe { corners(at, 1) }?;
    corners.first().copied().ok_or(blik_error::of(BLIK_ERROR_NULL))
}

/// Form factor from a point with a normal to a convex planar polygon, nothing in the way: the share that it fills of the
/// point's cosine-weighted hemisphere.
///
/// - `point`: three numbers
/// - `normal`: three numbers, of any length but zero
/// - `polygon`: corners in order, three numbers each
/// - `polygon_corners`: number of corners
/// - `factor`: receives the form factor
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_form_factor_point(
    point: *const f64,
    normal: *const f64,
    polygon: *const f64,
    polygon_corners: usize,
    error: *mut blik_error,
    factor: *mut f64,
) -> blik_status {
    call(error, || {
        let to = needed(factor)?;
        // SAFETY: by the caller's promise.
        let (point, normal, polygon) =
            unsafe { (vector(point)?, vector(normal)?, corners(polygon, polygon_corners)?) };
        let direction = blik_error::of(BLIK_ERROR_DIRECTION).field(BLIK_FIELD_DIRECTION);
        let value = form_factor::point_to_polygon(point, unit(normal).ok_or(direction)?, polygon);
        // SAFETY: not null.
        unsafe { to.write(value) };
        Ok(())
    })
}

/// Form factor from one convex planar polygon to another, nothing in the way. Only the sides from which the corners run
/// counter-clockwise see each other.
///
/// - `from`: corners in order, three numbers each
/// - `from_corners`: number of corners
/// - `polygon`: corners of the other
/// - `polygon_corners`: number of corners
/// - `factor`: receives the form factor
/// - `exchange_area`: receives the area of the first times the factor, the same bits for both orders; null: not wanted
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_form_factor_polygon(
    from: *const f64,
    from_corners: usize,
    polygon: *const f64,
    polygon_corners: usize,
    error: *mut blik_error,
    factor: *mut f64,
    exchange_area: *mut f64,
) -> blik_status {
    call(error, || {
        let to = needed(factor)?;
        // SAFETY: by the caller's promise.
        let (a, b) = unsafe { (corners(from, from_corners)?, corners(polygon, polygon_corners)?) };
        let value = form_factor::polygon_to_polygon(a, b);
        if let Ok(area) = needed(exchange_area) {
            // SAFETY: not null.
            unsafe { area.write(form_factor::exchange_area(a, b)) };
        }
        // SAFETY: not null.
        unsafe { to.write(value) };
        Ok(())
    })
}

/// Bytes of scratch memory for [`blik_form_factor_visible`].
///
/// - `pieces`: convex pieces that the visible part may fall into: each occluder cuts every piece that its outline crosses
///   into at most four
#[unsafe(no_mangle)]
pub extern "C" fn blik_form_factor_scratch_size(pieces: usize) -> usize {
    pieces.saturating_mul(size_of::<Convex>()).saturating_add(align_of::<Convex>())
}

/// Form factor from one convex planar polygon to what opaque triangles leave visible of another.
///
/// - `from`: corners in order, three numbers each
/// - `from_corners`: number of corners
/// - `polygon`: corners of the other
/// - `polygon_corners`: number of corners
/// - `occluders`: the triangles, nine numbers each
/// - `occluder_count`: number of triangles
/// - `tolerance`: wanted absolute error, above 0
/// - `scratch`: memory of [`blik_form_factor_scratch_size`] bytes
/// - `scratch_size`: its bytes
/// - `factor`: receives the form factor
/// - `error_estimate`: receives its expected error; null: not wanted
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_form_factor_visible(
    from: *const f64,
    from_corners: usize,
    polygon: *const f64,
    polygon_corners: usize,
    occluders: *const f64,
    occluder_count: usize,
    tolerance: f64,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    factor: *mut f64,
    error_estimate: *mut f64,
) -> blik_status {
    call(error, || {
        let to = needed(factor)?;
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_TOLERANCE).at(0, 0, tolerance));
        }
        let triangles = occluder_count.checked_mul(3).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))?;
        // SAFETY: by the caller's promise.
        let (a, b, occluders, scratch) = unsafe {
            (
                corners(from, from_corners)?,
                corners(polygon, polygon_corners)?,
                corners(occluders, triangles)?,
                bytes(scratch, scratch_size)?,
            )
        };
        let (occluders, _) = occluders.as_chunks::<3>();
        let skip = scratch.as_ptr().align_offset(align_of::<Convex>());
        let count = scratch.len().saturating_sub(skip) / size_of::<Convex>();
        let start = scratch.as_mut_ptr().wrapping_add(skip).cast::<Convex>();
        for i in 0..count {
            // SAFETY: aligned, and `count` of them fit behind `skip`.
            unsafe { start.add(i).write(Convex::EMPTY) };
        }
        let pieces: &mut [Convex] = match count {
            0 => &mut [],
            // SAFETY: all have just been written.
            _ => unsafe { core::slice::from_raw_parts_mut(start, count) },
        };
        let estimate = form_factor::visible_polygon_to_polygon(a, b, occluders, tolerance, pieces)?;
        if let Ok(place) = needed(error_estimate) {
            // SAFETY: not null.
            unsafe { place.write(estimate.error) };
        }
        // SAFETY: not null.
        unsafe { to.write(estimate.value) };
        Ok(())
    })
}

/// The lobe of a glossy material, for a specular reflectance of 1.
///
/// - `gloss_axis_ratio`: long over short axis of the lobe, 1 or more
/// - `cos_view`: cosine of the angle between view and normal
/// - `cos_off`: cosine of the angle from the mirror direction
/// - `albedo`: receives the share of light from everywhere that it mirrors toward the view, at most 1; null: not wanted
/// - `value`: receives its value in sr-1; null: not wanted
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_gloss(
    gloss_axis_ratio: f64,
    cos_view: f64,
    cos_off: f64,
    error: *mut blik_error,
    albedo: *mut f64,
    value: *mut f64,
) -> blik_status {
    call(error, || {
        let lobe = Lobe::new(gloss_axis_ratio)?;
        let range = blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_DIRECTION);
        if let Some(&cosine) = [cos_view, cos_off].iter().find(|c| !(-1.0..=1.0).contains(*c)) {
            return Err(range.at(0, 0, cosine));
        }
        if let Ok(to) = needed(albedo) {
            // SAFETY: not null.
            unsafe { to.write(lobe.albedo(cos_view)) };
        }
        if let Ok(to) = needed(value) {
            // SAFETY: not null.
            unsafe { to.write(lobe.value(cos_off)) };
        }
        Ok(())
    })
}
