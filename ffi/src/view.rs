//! Views of a solved scene: images, rays, signatures, facets.

use crate::call;
use crate::coupling::blik_coupling;
use crate::memory::*;
use crate::run::{Runner, Start, blik_run};
use crate::scene::{blik_ray, check, inside};
use crate::solution::blik_solution;
use crate::status::*;
use crate::types::*;
use blik_kernel::Error;
use blik_kernel::arena::{ALIGNMENT, Arena, Need};
use blik_kernel::camera::{Camera, CameraInput, Projection, Sampling};
use blik_kernel::chain::{ChainScratch, RaySample, Solved, Terms};
use blik_kernel::image::{self, Tally, Target, piece};
use blik_kernel::math::Vec3;
use blik_kernel::scene::{MAX_BANDS, Scene};
use blik_kernel::signature::{self, Signature, Sums, View};
use blik_kernel::{facets, policy};
use core::ffi::c_void;
use core::ops::Range;

/// Counts of the work on rows of an image; tallies of all its rows add up by [`blik_tally_add`].
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_tally {
    /// Size of this struct.
    pub struct_size: usize,
    /// Pixels whose centre ray meets the object.
    pub object_pixels: u64,
    /// Rays through pixels.
    pub primary_rays: u64,
    /// Rays of chains and toward the sun.
    pub chain_rays: u64,
    /// Pixels sampled more than once.
    pub refined_pixels: u64,
    /// Sum over object pixels of the squared expected error from the diffuse solution.
    pub noise_squared: f64,
    /// Sum over object pixels of the squared expected error from sampling the pixel's area and lobes.
    pub sampling_squared: f64,
    /// Largest bound on what cut chains could still have brought.
    pub chain_tail: f64,
}

impl Default for blik_tally {
    fn default() -> blik_tally {
        blik_tally::new(&Tally::default())
    }
}
sized!(blik_tally);

impl blik_tally {
    fn new(tally: &Tally) -> blik_tally {
        blik_tally {
            struct_size: size_of::<blik_tally>(),
            object_pixels: tally.object_pixels,
            primary_rays: tally.primary,
            chain_rays: tally.chain,
            refined_pixels: tally.refined,
            noise_squared: tally.noise2,
            sampling_squared: tally.sampling2,
            chain_tail: tally.tail,
        }
    }

    pub(crate) fn kernel(&self) -> Tally {
        Tally {
            object_pixels: self.object_pixels,
            primary: self.primary_rays,
            chain: self.chain_rays,
            refined: self.refined_pixels,
            noise2: self.noise_squared,
            sampling2: self.sampling_squared,
            tail: self.chain_tail,
        }
    }
}

/// Adds the tally of other rows of an image.
///
/// - `sum`: the sum so far, and the new one
/// - `next`: what is added
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_tally_add(
    sum: *mut blik_tally,
    next: *const blik_tally,
    error: *mut blik_error,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, so_far, next) = unsafe { (Place::new(sum)?, read(sum.cast_const())?, read(next)?) };
        let mut all = so_far.kernel();
        all.add(&next.kernel());
        to.write(blik_tally::new(&all));
        Ok(())
    })
}

/// The kernel's camera.
///
/// # Safety
/// As for [`read`].
unsafe fn camera(camera: *const blik_camera, scene: &Scene<'_>) -> Result<Camera, blik_error> {
    // SAFETY: by the caller's promise.
    let camera = unsafe { read(camera) }?;
    let choice = |number: i32| blik_error::of(BLIK_ERROR_CHOICE).at(0, 0, f64::from(number));
    let projection = match camera.projection {
        BLIK_ORTHOGRAPHIC => Projection::Orthographic { height: camera.height },
        BLIK_PERSPECTIVE => Projection::Perspective { fov_deg: camera.fov_deg },
        other => return Err(choice(other)),
    };
    let sampling = match camera.sampling {
        BLIK_SAMPLE_AREA => Sampling::Area,
        BLIK_SAMPLE_CENTRE => Sampling::Centre,
        other => return Err(choice(other)),
    };
    let (eye, target, up) = (camera.eye, camera.target, camera.up);
    let (columns, rows) = (camera.columns, camera.rows);
    Ok(Camera::new(&CameraInput { projection, eye, target, up, columns, rows, sampling }, scene)?)
}

/// Bytes of the scratch memory for some rows.
fn rows_bytes(camera: &Camera, solution: &blik_solution) -> Result<usize, blik_error> {
    Ok(image::scratch_bytes(camera, &solution.coupling.base.scene, &solution.coupling.elements)?)
}

/// Bytes of one lane's scratch memory, and of the tallies before them.
fn scratch_parts(camera: &Camera, solution: &blik_solution) -> Result<(usize, usize), blik_error> {
    let lane = rows_bytes(camera, solution)?.next_multiple_of(ALIGNMENT);
    let tallies = camera.rows().div_ceil(piece(camera.rows())) * size_of::<Tally>();
    Ok((tallies.next_multiple_of(ALIGNMENT) + ALIGNMENT, lane))
}

/// Bytes of scratch memory with which [`blik_image`] keeps all lanes of `run` busy.
///
/// - `solution`: the solution
/// - `camera`: the camera
/// - `bytes`: receives the bytes; less is for fewer lanes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_image_scratch_size(
    solution: *const blik_solution,
    camera: *const blik_camera,
    run: *const blik_run,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (solution, runner): (&blik_solution, _) = unsafe { (object(solution)?, Runner::new(run)?) };
        // SAFETY: by the caller's promise.
        let camera = unsafe { self::camera(camera, &solution.coupling.base.scene) }?;
        let (fixed, lane) = scratch_parts(&camera, solution)?;
        // SAFETY: not null.
        unsafe { to.write(fixed + lane * runner.lanes()) };
        Ok(())
    })
}

/// Calls `work` with the caller's scratch memory; with `wanted` bytes of the heap's where that is null and there is a
/// heap.
///
/// # Safety
/// `scratch` is null or memory of `size` bytes.
pub(crate) unsafe fn with_scratch<R>(
    scratch: *mut c_void,
    size: usize,
    wanted: usize,
    work: impl FnOnce(&mut [u8]) -> Result<R, blik_error>,
) -> Result<R, blik_error> {
    #[cfg(feature = "std")]
    if scratch.is_null() {
        let mut own = Slab::new(wanted)?;
        // SAFETY: the slab lives until `work` has ended.
        return work(unsafe { own.bytes_mut() });
    }
    let _ = wanted;
    // SAFETY: by the caller's promise.
    work(unsafe { bytes(scratch, if scratch.is_null() { 0 } else { size }) }?)
}

/// Where pixels go.
struct Out<'a> {
    pixels: &'a mut [f32],
    components: [&'a mut [f32]; 3],
}

impl Out<'_> {
    /// # Safety
    /// Arrays have as many entries as said.
    unsafe fn new<'a>(
        pixels: (*mut f32, usize),
        components: (*mut f32, usize),
        expected: usize,
    ) -> Result<Out<'a>, blik_error> {
        // SAFETY: by the caller's promise.
        let (pixels, all) = unsafe {
            let pixels = output_of(pixels, expected, BLIK_FIELD_PIXELS)?;
            (pixels, optional_output(components, 3 * expected, BLIK_FIELD_COMPONENTS)?)
        };
        if all.is_empty() {
            return Ok(Out { pixels, components: [&mut [], &mut [], &mut []] });
        }
        let count = expected;
        let parts = all.split_at_mut_checked(count).and_then(|(a, rest)| {
            let (b, c) = rest.split_at_mut_checked(count)?;
            Some([a, b, c])
        });
        let components = parts.ok_or(blik_error::of(BLIK_ERROR_INTERNAL))?;
        Ok(Out { pixels, components })
    }
}

/// The image that a camera sees, row 0 at the top, bands innermost. A call that is cancelled leaves part of it written.
///
/// - `solution`: the solution
/// - `camera`: the camera
/// - `pixels`: receives radiance by row, column and band: rows x columns x bands values
/// - `pixel_count`: number of values that `pixels` has room for: rows x columns x bands
/// - `components`: receives the three terms of the radiance one after the other, each like `pixels`: diffuse, mirrored sky
///   and sun, mirrored diffuse. Null: not wanted
/// - `component_count`: number of values that there is room for: three times `pixel_count`
/// - `tally`: receives what was done, for `blik_get_report`; its `struct_size` is set before. Null: not wanted
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_image(
    solution: *const blik_solution,
    camera: *const blik_camera,
    run: *const blik_run,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    pixels: *mut f32,
    pixel_count: usize,
    components: *mut f32,
    component_count: usize,
    tally: *mut blik_tally,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (solution, mut runner): (&blik_solution, _) = unsafe { (object(solution)?, Runner::new(run)?) };
        // SAFETY: by the caller's promise.
        let camera = &unsafe { self::camera(camera, &solution.coupling.base.scene) };
        // in one place of the stack: it is large
        let camera = camera.as_ref().map_err(|error| *error)?;
        let bands = solution.record.shape.bands;
        // SAFETY: by the caller's promise.
        let (mut out, tally) = unsafe {
            let expected = camera.rows() * camera.columns() * bands;
            let out = Out::new((pixels, pixel_count), (components, component_count), expected)?;
            (out, Place::optional(tally)?)
        };
        let (fixed, lane) = scratch_parts(camera, solution)?;
        let wanted = fixed + lane * runner.lanes();
        let work = |given: &mut [u8]| paint(solution, camera, &mut out, given, &mut runner);
        // SAFETY: by the caller's promise.
        let sum = unsafe { with_scratch(scratch, scratch_size, wanted, work) }?;
        if let Some(to) = tally {
            to.write(blik_tally::new(&sum));
        }
        Ok(())
    })
}

/// Computes all rows in pieces, as many at once as the scratch memory has room for.
fn paint(
    solution: &blik_solution,
    camera: &Camera,
    out: &mut Out<'_>,
    scratch: &mut [u8],
    runner: &mut Runner,
) -> Result<Tally, blik_error> {
    let (rows, bands) = (camera.rows(), solution.record.shape.bands);
    let (fixed, lane_size) = scratch_parts(camera, solution)?;
    let lanes = scratch.len().saturating_sub(fixed) / lane_size.max(1);
    if lanes == 0 {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(fixed + lane_size, scratch.len()));
    }
    let (front, buffers) = scratch.split_at_mut(fixed.min(scratch.len()));
    let skip = front.as_ptr().align_offset(align_of::<Tally>());
    let tallies = Start(front.as_mut_ptr().wrapping_add(skip).cast::<Tally>());
    let (buffers, piece) = (Start(buffers.as_mut_ptr()), piece(rows));
    let items = rows.div_ceil(piece);
    let stride = camera.columns() * bands;
    let mut solved = solution.solved();
    image::prepare(&mut solved, camera);
    let pixels = Start(out.pixels.as_mut_ptr());
    let [a, b, c] = &mut out.components;
    let with = !a.is_empty();
    let parts = [a, b, c].map(|part| Start(part.as_mut_ptr()));
    runner.each(items, lanes.min(runner.lanes()), 1.0, &|lane, item| {
        let range = item * piece..((item + 1) * piece).min(rows);
        let size = range.len() * stride;
        // SAFETY: every item is handed out once, so that parts of the image are disjoint; a lane's buffer is used by
        // that lane alone, and there are as many tallies as items.
        let done = unsafe {
            let own = |start: &Start<f32>, size| {
                let at = if size > 0 { range.start * stride } else { 0 };
                core::slice::from_raw_parts_mut(start.at(at), size)
            };
            let part = if with { size } else { 0 };
            let components = parts.each_ref().map(|start| own(start, part));
            let mut target = Target { image: own(&pixels, size), components };
            let buffer = core::slice::from_raw_parts_mut(buffers.at(lane * lane_size), lane_size);
            image::prepared_rows(&solved, camera, range, &mut target, buffer)
        };
        // where it stands: it is large
        let tally = done.as_ref().map_err(|error| *error)?;
        // SAFETY: as above.
        unsafe { tallies.at(item).write(*tally) };
        Ok(())
    })?;
    let mut sum = Tally::default();
    for item in 0..items {
        // SAFETY: written by the item.
        sum.add(&unsafe { tallies.at(item).read() });
    }
    Ok(sum)
}

/// Rows of the image that a camera sees, for schedulers and processes of the caller. However an image is split, its bits
/// are the same.
///
/// - `solution`: the solution
/// - `camera`: the camera
/// - `first`: index of the first row
/// - `rows`: number of rows
/// - `pixels`: receives radiance by row, column and band: `rows` x columns x bands values
/// - `pixel_count`: number of values that `pixels` has room for: `rows` x columns x bands
/// - `components`: receives the three terms of the radiance one after the other, each like `pixels`: diffuse, mirrored sky
///   and sun, mirrored diffuse. Null: not wanted
/// - `component_count`: number of values that there is room for: three times `pixel_count`
/// - `tally`: receives what was done, for `blik_get_report`; its `struct_size` is set before. Null: not wanted
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_image_rows(
    solution: *const blik_solution,
    camera: *const blik_camera,
    first: usize,
    rows: usize,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    pixels: *mut f32,
    pixel_count: usize,
    components: *mut f32,
    component_count: usize,
    tally: *mut blik_tally,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let solution: &blik_solution = unsafe { object(solution) }?;
        // SAFETY: by the caller's promise.
        let camera = &unsafe { self::camera(camera, &solution.coupling.base.scene) };
        // in one place of the stack: it is large
        let camera = camera.as_ref().map_err(|error| *error)?;
        let bands = solution.record.shape.bands;
        let range = rows_of(first, rows, camera.rows())?;
        let expected = rows * camera.columns() * bands;
        // SAFETY: by the caller's promise.
        let (out, tally) = unsafe {
            let out = Out::new((pixels, pixel_count), (components, component_count), expected)?;
            (out, Place::optional(tally)?)
        };
        let mut target = Target { image: out.pixels, components: out.components };
        let wanted = rows_bytes(camera, solution)?;
        let mut solved = solution.solved();
        image::prepare(&mut solved, camera);
        let work = |given: &mut [u8]| Ok(image::prepared_rows(&solved, camera, range, &mut target, given)?);
        // SAFETY: by the caller's promise.
        let sum = unsafe { with_scratch(scratch, scratch_size, wanted, work) }?;
        if let Some(to) = tally {
            to.write(blik_tally::new(&sum));
        }
        Ok(())
    })
}

pub(crate) fn rows_of(first: usize, rows: usize, all: usize) -> Result<Range<usize>, blik_error> {
    match first.checked_add(rows) {
        Some(end) if end <= all => Ok(first..end),
        _ => Err(blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_ROWS).at(0, 0, first as f64)),
    }
}

/// Bytes of one lane's scratch memory while rays are followed, or a signature is found, and the sky behind it.
pub(crate) fn lane_bytes() -> Result<usize, blik_error> {
    let rays = Need::new().and::<Terms>(1).and::<ChainScratch>(1).bytes()?;
    let signature = signature::scratch_bytes()? + Need::new().and::<f64>(MAX_BANDS).bytes()?;
    Ok(rays.max(signature).next_multiple_of(ALIGNMENT))
}

/// Bytes of scratch memory with which [`blik_radiance`] and [`blik_signatures`] keep all lanes of `run` busy.
///
/// - `solution`: the solution
/// - `bytes`: receives the bytes; less is for fewer lanes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_radiance_scratch_size(
    solution: *const blik_solution,
    run: *const blik_run,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let runner = unsafe { object(solution).and(Runner::new(run)) }?;
        let size = lane_bytes()? * runner.lanes();
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Calls `work` for all `items` with the scratch memory of their lanes, as many lanes as that has room for.
fn follow(
    items: usize,
    scratch: &mut [u8],
    runner: &mut Runner,
    work: impl Fn(usize, &mut [u8]) -> Result<(), blik_error> + Sync,
) -> Result<(), blik_error> {
    let (own, given) = (lane_bytes()?, scratch.len());
    let lanes = given / own;
    if lanes == 0 {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(own, given));
    }
    let start = Start(scratch.as_mut_ptr());
    runner.each(items, lanes.min(runner.lanes()), 1.0, &|lane, item| {
        // SAFETY: a lane's memory is used by that lane alone.
        work(item, unsafe { core::slice::from_raw_parts_mut(start.at(lane * own), own) })
    })
}

/// Rays of one piece.
const RADIANCE_PIECE_RAYS: usize = 256;

/// Radiance against rays.
///
/// - `solution`: the solution
/// - `rays`: the rays, as for `blik_closest_hits`
/// - `count`: number of rays
/// - `radiance`: receives one value a ray and band, bands innermost
/// - `radiance_count`: number of values that there is room for: `count` x bands
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_radiance(
    solution: *const blik_solution,
    rays: *const blik_ray,
    count: usize,
    run: *const blik_run,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    radiance: *mut f64,
    radiance_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (solution, mut runner): (&blik_solution, _) = unsafe { (object(solution)?, Runner::new(run)?) };
        let bands = solution.record.shape.bands;
        let all = count.checked_mul(bands).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))?;
        // SAFETY: by the caller's promise.
        let (rays, out) = unsafe {
            (input(rays, count)?, output_of((radiance, radiance_count), all, BLIK_FIELD_RADIANCE)?)
        };
        let (solved, scene) = (solution.solved(), &solution.coupling.base.scene);
        check(scene, rays)?;
        let start = Start(out.as_mut_ptr());
        let wanted = lane_bytes()? * runner.lanes();
        let work = |given: &mut [u8]| {
            follow(count.div_ceil(RADIANCE_PIECE_RAYS), given, &mut runner, |item, memory| {
                let short = Error::BufferTooSmall { needed: lane_bytes()?, given: memory.len() };
                let mut arena = Arena::new(memory, 0)?;
                let (terms, work) = (arena.take::<Terms>(1)?, arena.take::<ChainScratch>(1)?);
                let (terms, work) = (terms.first_mut().ok_or(short)?, work.first_mut().ok_or(short)?);
                let first = item * RADIANCE_PIECE_RAYS;
                let own = rays.iter().skip(first).take(RADIANCE_PIECE_RAYS);
                // SAFETY: every item is handed out once, and its values lie within the array.
                let out =
                    unsafe { core::slice::from_raw_parts_mut(start.at(first * bands), own.len() * bands) };
                for ((index, ray), out) in (first..).zip(own).zip(out.chunks_exact_mut(bands.max(1))) {
                    let ray = inside(scene, ray);
                    terms.clear(bands);
                    let hit = solution.coupling.base.bvh.closest(&ray);
                    solved.radiance_at((&ray, hit), RaySample::Integrate(index as u32), terms, work);
                    out.iter_mut().enumerate().for_each(|(band, l)| *l = terms.sum(band));
                }
                Ok(())
            })
        };
        // SAFETY: by the caller's promise.
        unsafe { with_scratch(scratch, scratch_size, wanted, work) }
    })
}

/// Signature in one direction and band, as a distant observer measures it. Arrays of it have a stride: it may grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_signature {
    /// Radiant intensity toward the observer, W/sr.
    pub radiant_intensity: f64,
    /// Area of the object's projection, in the square of the mesh's unit.
    pub projected_area: f64,
    /// Radiant intensity over projected area; 0 where nothing is seen.
    pub mean_radiance: f64,
    /// Radiance of the sky behind.
    pub background: f64,
    /// (mean radiance - background)/background; 0 where the background is 0.
    pub contrast: f64,
    /// Expected error of the radiant intensity, W/sr.
    pub error_estimate: f64,
    /// Glints that may lie between cells, or be met by chance and count too much: what they bring on the mean, W/sr; not
    /// among the error.
    pub unresolved_glints: f64,
}

/// Cells along a side of a view.
const MOST_CELLS: usize = 65536;

/// Cells along a side of a view, by a coupling's tolerance where none are asked for.
pub(crate) fn wanted_cells(cells: usize, coupling: &blik_coupling) -> Result<usize, blik_error> {
    if cells > MOST_CELLS {
        let too_many = blik_error::of(BLIK_ERROR_TOO_MANY).field(BLIK_FIELD_CELLS);
        return Err(too_many.sizes(MOST_CELLS, cells));
    }
    let budget = &coupling.settings.asked.budget;
    Ok(if cells == 0 { policy::signature_cells(budget) } else { cells })
}

/// Signatures of the whole object, as distant observers measure them, without an image.
///
/// - `solution`: the solution
/// - `directions`: three numbers a view, from the observer toward the object, of any length but zero
/// - `direction_count`: number of views
/// - `cells`: cells along each side of the projection, one ray each, up to 65536; 0: by tolerance
/// - `signatures`: receives one entry a view and band, bands innermost
/// - `signature_count`: number of entries that there is room for: views x bands
/// - `signature_stride`: bytes from one entry to the next: `sizeof(blik_signature)`
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_signatures(
    solution: *const blik_solution,
    directions: *const f64,
    direction_count: usize,
    cells: usize,
    run: *const blik_run,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    signatures: *mut blik_signature,
    signature_count: usize,
    signature_stride: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (solution, mut runner): (&blik_solution, _) = unsafe { (object(solution)?, Runner::new(run)?) };
        let bands = solution.record.shape.bands;
        let too_many = blik_error::of(BLIK_ERROR_TOO_MANY);
        let views = direction_count;
        let (all, numbers) =
            (views.checked_mul(bands).ok_or(too_many)?, views.checked_mul(3).ok_or(too_many)?);
        // SAFETY: by the caller's promise.
        let (directions, out) = unsafe {
            let out = Signatures::new(signatures, signature_count, all, signature_stride)?;
            (input(directions, numbers)?, out)
        };
        let cells = wanted_cells(cells, solution.coupling)?;
        let wanted = lane_bytes()? * runner.lanes();
        let work = |given: &mut [u8]| {
            follow(views, given, &mut runner, |view, memory| {
                let direction = directions.get(3 * view..).and_then(|d| d.first_chunk::<3>()).copied();
                let direction = Vec3::from_array(direction.unwrap_or_default());
                let measured = measure(&solution.solved(), direction, cells, memory, |band, signature| {
                    out.put(view * bands + band, signature);
                });
                measured.map_err(|error| blik_error { index: view, ..error })
            })
        };
        // SAFETY: by the caller's promise.
        unsafe { with_scratch(scratch, scratch_size, wanted, work) }
    })
}

/// The caller's array of signatures, whose header may have shorter ones.
pub(crate) struct Signatures {
    start: Start<u8>,
    stride: usize,
}

impl Signatures {
    /// The shortest that there ever was.
    const FIRST: usize = size_of::<blik_signature>();

    /// # Safety
    /// `at` is null or has room for `count` entries of `stride` bytes.
    pub unsafe fn new(
        at: *mut blik_signature,
        count: usize,
        wanted: usize,
        stride: usize,
    ) -> Result<Signatures, blik_error> {
        let refused = |status| blik_error::of(status).field(BLIK_FIELD_SIGNATURES);
        if count != wanted {
            return Err(refused(BLIK_ERROR_LENGTH).sizes(wanted, count));
        }
        if stride < Signatures::FIRST {
            return Err(refused(BLIK_ERROR_STRUCT_SIZE).sizes(Signatures::FIRST, stride));
        }
        let bytes = stride.checked_mul(count).ok_or(refused(BLIK_ERROR_TOO_MANY))?;
        // SAFETY: by the caller's promise.
        let out = unsafe { output(at.cast::<u8>(), bytes) }?;
        Ok(Signatures { start: Start(out.as_mut_ptr()), stride })
    }

    /// Writes an entry, which nobody else does.
    pub fn put(&self, index: usize, value: blik_signature) {
        let size = self.stride.min(size_of::<blik_signature>());
        // SAFETY: within the caller's array by the promise of `new` and the indices of the views.
        unsafe {
            let from = (&raw const value).cast::<u8>();
            core::ptr::copy_nonoverlapping(from, self.start.at(index * self.stride), size);
        }
    }
}

/// Measures one view; `put` takes the signature of each band.
pub(crate) fn measure(
    solved: &Solved<'_>,
    forward: Vec3,
    cells: usize,
    scratch: &mut [u8],
    put: impl Fn(usize, blik_signature),
) -> Result<(), blik_error> {
    let view = View::new(solved, forward, cells)?;
    let (scratch, rest) = scratch.split_at_mut_checked(signature::scratch_bytes()?).unwrap_or_default();
    let sums = signature::whole(solved, &view, scratch)?;
    let background = Arena::new(rest, 0)?.take::<f64>(solved.shape.bands)?;
    signatures_of((solved, sums, background), forward, put);
    Ok(())
}

/// Signatures of each band by the sums of a view along `forward`; `background` has room for a value of each.
pub(crate) fn signatures_of(
    (solved, sums, background): (&Solved<'_>, &Sums, &mut [f64]),
    forward: Vec3,
    mut put: impl FnMut(usize, blik_signature),
) {
    let background = background.get_mut(..solved.shape.bands).unwrap_or_default();
    if let Some(sky) = &solved.light.sky {
        sky.radiance(blik_kernel::math::unit(forward).unwrap_or(forward), &mut *background);
    }
    for (band, &mut background) in background.iter_mut().enumerate() {
        let reference = solved.reference.get(band).copied().unwrap_or(0.0);
        let own = Signature::new(sums, band, reference, background);
        let signature = blik_signature {
            radiant_intensity: own.intensity,
            projected_area: sums.area,
            mean_radiance: own.mean_radiance,
            background,
            contrast: own.contrast.unwrap_or(0.0),
            error_estimate: own.error,
            unresolved_glints: own.unresolved,
        };
        put(band, signature);
    }
}

/// Area, mean irradiance (all that arrives, not divided by pi) and diffuse radiance of facets. Degenerate facets: zeros.
///
/// - `solution`: the solution
/// - `first`: index of the first facet
/// - `count`: number of facets
/// - `areas`: receives one value a facet; null: not wanted
/// - `area_count`: number of values that there is room for: `count`
/// - `irradiance`: receives one value a facet, side and band, bands innermost; null: not wanted
/// - `irradiance_count`: number of values that there is room for: `count` x sides x bands
/// - `radiance`: receives as many; null: not wanted
/// - `radiance_count`: number of values that there is room for: `count` x sides x bands
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_facets(
    solution: *const blik_solution,
    first: usize,
    count: usize,
    error: *mut blik_error,
    areas: *mut f64,
    area_count: usize,
    irradiance: *mut f64,
    irradiance_count: usize,
    radiance: *mut f64,
    radiance_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let solution: &blik_solution = unsafe { object(solution) }?;
        let (solved, scene) = (solution.solved(), &solution.coupling.base.scene);
        let coupling = solution.coupling.matrix()?;
        let (bands, sides) = (solution.record.shape.bands, scene.sides());
        let range = rows_of(first, count, scene.facets())?;
        let size = count * sides * bands;
        // SAFETY: by the caller's promise.
        let (areas, irradiance, radiance) = unsafe {
            (
                optional_output((areas, area_count), count, BLIK_FIELD_AREAS)?,
                optional_output((irradiance, irradiance_count), size, BLIK_FIELD_IRRADIANCE)?,
                optional_output((radiance, radiance_count), size, BLIK_FIELD_RADIANCE)?,
            )
        };
        for (area, facet) in areas.iter_mut().zip(range.clone()) {
            *area = scene.area(facet);
        }
        let mut values = [[0.0; MAX_BANDS]; 2];
        let [e, l] = values.each_mut().map(|all| all.split_at_mut(bands.min(MAX_BANDS)).0);
        for (at, facet) in range.enumerate() {
            for side in 0..sides {
                facets::side(&solved, &coupling, solution.record.sun, facet, side, e, l);
                let start = (at * sides + side) * bands;
                irradiance.iter_mut().skip(start).zip(&*e).for_each(|(to, from)| *to = *from);
                radiance.iter_mut().skip(start).zip(&*l).for_each(|(to, from)| *to = *from);
            }
        }
        Ok(())
    })
}
