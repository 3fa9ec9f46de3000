//! Many lights against one coupling in one call.

use crate::call;
use crate::coupling::blik_coupling;
use crate::memory::*;
use crate::run::{Runner, Start, blik_run};
use crate::solution::given_light;
use crate::status::*;
use crate::types::*;
use crate::view::{Signatures, blik_signature, lane_bytes, measure, wanted_cells, with_scratch};
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::chain::{KnownRows, Solved};
use blik_kernel::coupling::Coupling;
use blik_kernel::facets;
use blik_kernel::light::{Light, LightInput};
use blik_kernel::math::Vec3;
use blik_kernel::radiosity::solution::Solution;
use blik_kernel::scene::MAX_BANDS;
use blik_kernel::stages::Lights;
use core::ffi::c_void;

/// The caller's array of lights, whose header may have shorter ones.
#[derive(Clone, Copy)]
struct LightArray {
    start: *const u8,
    count: usize,
    stride: usize,
}

// SAFETY: it is read alone, and the caller promises that nobody writes to it during the call.
unsafe impl Sync for LightArray {}

impl LightArray {
    /// # Safety
    /// `at` is null or has `count` entries of `stride` bytes.
    unsafe fn new(at: *const blik_light, count: usize, stride: usize) -> Result<LightArray, blik_error> {
        if stride < blik_light::FIRST || !stride.is_multiple_of(align_of::<blik_light>()) {
            return Err(blik_error::of(BLIK_ERROR_STRUCT_SIZE).sizes(size_of::<blik_light>(), stride));
        }
        let bytes = stride.checked_mul(count).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))?;
        // SAFETY: by the caller's promise.
        let all = unsafe { input(at.cast::<u8>(), bytes) }?;
        Ok(LightArray { start: all.as_ptr(), count, stride })
    }

    /// Input of one of the lights. An error tells its number as `index`; where it is about a facet's emission, as
    /// `given`.
    ///
    /// # Safety
    /// The pointers of the lights are null or valid.
    unsafe fn get(&self, number: usize, coupling: &blik_coupling) -> Result<LightInput<'_>, blik_error> {
        let at = self.start.wrapping_add(number * self.stride).cast::<blik_light>();
        // SAFETY: below `count`; by the caller's promise.
        unsafe { given_light(at, &coupling.base.scene) }.map_err(|error| of_light(error, number))
    }

    /// One of the lights, checked. Errors are as for [`LightArray::get`].
    ///
    /// # Safety
    /// As for [`LightArray::get`].
    // apart: what it is made from does not burden the stack of solving
    #[inline(never)]
    unsafe fn light(&self, number: usize, coupling: &blik_coupling) -> Result<Light<'_>, blik_error> {
        // SAFETY: by the caller's promise.
        let input = &unsafe { self.get(number, coupling) };
        let light = input.as_ref().map_err(|error| *error)?.light(&coupling.base.scene);
        light.map_err(|error| of_light(error.into(), number))
    }
}

/// An error of one of many lights.
fn of_light(error: blik_error, number: usize) -> blik_error {
    let of_facet = error.status == BLIK_ERROR_UNCOUPLED
        || error.status == BLIK_ERROR_RANGE && error.field == BLIK_FIELD_EMISSION;
    if of_facet { blik_error { given: number, ..error } } else { blik_error { index: number, ..error } }
}

/// A coupling, ready for any lights.
pub(crate) fn coupled<'a>(coupling: &'a blik_coupling, matrix: &'a Coupling<'a>) -> Lights<'a> {
    Lights {
        scene: &coupling.base.scene,
        bvh: &coupling.base.bvh,
        elements: &coupling.elements,
        coupling: matrix,
        settings: &coupling.settings.asked,
    }
}

/// Bytes of a lane: for the largest light, and for the views of its solution.
///
/// # Safety
/// As for [`LightArray::get`].
unsafe fn light_lane(coupling: &blik_coupling, lights: &LightArray) -> Result<usize, blik_error> {
    let matrix = coupling.matrix()?;
    let all = coupled(coupling, &matrix);
    let mut most = 0;
    for number in 0..lights.count {
        // SAFETY: by the caller's promise.
        let light = unsafe { lights.light(number, coupling) }?;
        most = most.max(all.bytes(&light)?);
    }
    let one = most.next_multiple_of(ALIGNMENT).checked_add(lane_bytes()? + ALIGNMENT);
    one.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))
}

/// Bytes of scratch memory with which [`blik_lights`] keeps all lanes of `run` busy. More speeds up scenes with mirrors that
/// scatter sunlight.
///
/// - `coupling`: the coupling
/// - `lights`: the lights
/// - `light_count`: number of lights
/// - `light_stride`: bytes from one light to the next: `sizeof(blik_light)`
/// - `bytes`: receives the bytes; less is for fewer lanes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_lights_scratch_size(
    coupling: *const blik_coupling,
    lights: *const blik_light,
    light_count: usize,
    light_stride: usize,
    run: *const blik_run,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (runner, lane) = unsafe {
            let (coupling, runner): (&blik_coupling, _) = (object(coupling)?, Runner::new(run)?);
            let lights = LightArray::new(lights, light_count, light_stride)?;
            (runner, light_lane(coupling, &lights)?)
        };
        let size = lane.checked_mul(runner.lanes()).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Where the results of many lights go.
struct LightOutputs {
    /// Values of one light's irradiances and radiances; 0 where they are not wanted.
    values: [usize; 2],
    facets: [Start<f64>; 2],
    signatures: Option<Signatures>,
    /// Three numbers a view.
    directions: &'static [f64],
    cells: usize,
}

/// Solves many lights against one coupling: suns, skies, emissions of facets. Each is solved by one task; lights of the same
/// sky share what is known of it. The results have the bits of `blik_solution_init`, `blik_facets` and `blik_signatures` one by
/// one. To have what sun, sky and emission bring apart, light the scene by each alone (an emission of zeros where facets emit),
/// with one `reference_radiance`: they add up to what all bring together, to the tolerance. Outputs of lights that
/// were done before one is refused are written. An error's `index` is the light's number; where a facet's emission
/// is refused, `index` is the facet and `given` the light's number.
///
/// - `coupling`: the coupling
/// - `lights`: the lights
/// - `light_count`: number of lights
/// - `light_stride`: bytes from one light to the next: `sizeof(blik_light)`
/// - `directions`: three numbers a view, from the observer toward the object, of any length but zero
/// - `direction_count`: number of views
/// - `cells`: cells along each side of the projection, one ray each, up to 65536; 0: by tolerance
/// - `irradiance`: receives mean irradiance, one value a light, facet, side and band, bands innermost; null: not wanted
/// - `irradiance_count`: number of values that there is room for: lights x facets x sides x bands
/// - `radiance`: receives as many diffuse radiances; null: not wanted
/// - `radiance_count`: number of values that there is room for: lights x facets x sides x bands
/// - `signatures`: receives one entry a light, view and band, bands innermost; null where there are no views
/// - `signature_count`: number of entries that there is room for: lights x views x bands
/// - `signature_stride`: bytes from one entry to the next: `sizeof(blik_signature)`
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_lights(
    coupling: *const blik_coupling,
    lights: *const blik_light,
    light_count: usize,
    light_stride: usize,
    directions: *const f64,
    direction_count: usize,
    cells: usize,
    run: *const blik_run,
    scratch: *mut c_void,
    scratch_size: usize,
    error: *mut blik_error,
    irradiance: *mut f64,
    irradiance_count: usize,
    radiance: *mut f64,
    radiance_count: usize,
    signatures: *mut blik_signature,
    signature_count: usize,
    signature_stride: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (coupling, mut runner, lights): (&blik_coupling, _, _) = unsafe {
            let lights = LightArray::new(lights, light_count, light_stride)?;
            (object(coupling)?, Runner::new(run)?, lights)
        };
        let scene = &coupling.base.scene;
        let (too_many, bands) = (blik_error::of(BLIK_ERROR_TOO_MANY), scene.bands());
        let values = scene.facets() * scene.sides() * bands;
        let all = values.checked_mul(light_count).ok_or(too_many)?;
        let entries = direction_count.checked_mul(light_count).and_then(|n| n.checked_mul(bands));
        let numbers = direction_count.checked_mul(3).ok_or(too_many)?;
        // SAFETY: by the caller's promise.
        let out = unsafe {
            let e = optional_output((irradiance, irradiance_count), all, BLIK_FIELD_IRRADIANCE)?;
            let l = optional_output((radiance, radiance_count), all, BLIK_FIELD_RADIANCE)?;
            let entries = entries.ok_or(too_many)?;
            let signatures = match direction_count {
                0 if signature_count == 0 => None,
                _ => Some(Signatures::new(signatures, signature_count, entries, signature_stride)?),
            };
            LightOutputs {
                values: [&*e, &*l].map(|out| if out.is_empty() { 0 } else { values }),
                facets: [Start(e.as_mut_ptr()), Start(l.as_mut_ptr())],
                signatures,
                directions: input(directions, numbers)?,
                cells: wanted_cells(cells, coupling)?,
            }
        };
        // SAFETY: by the caller's promise.
        let lane = unsafe { light_lane(coupling, &lights) }?;
        let wanted = lane.checked_mul(runner.lanes()).ok_or(too_many)?;
        let work = |given: &mut [u8]| solve_all(coupling, &lights, &out, given, lane, &mut runner);
        // SAFETY: by the caller's promise.
        unsafe { with_scratch(scratch, scratch_size, wanted, work) }
    })
}

/// Solves all lights, as many at once as the scratch memory has room for lanes of `least` bytes.
fn solve_all(
    coupling: &blik_coupling,
    lights: &LightArray,
    out: &LightOutputs,
    scratch: &mut [u8],
    least: usize,
    runner: &mut Runner,
) -> Result<(), blik_error> {
    let matrix = coupling.matrix()?;
    let all = coupled(coupling, &matrix);
    let given = scratch.len();
    let lanes = (given / least.max(1)).min(runner.lanes());
    if lanes == 0 {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(least, given));
    }
    // what is more than needed is for mirrors that scatter sunlight
    let lane = given / lanes;
    for memory in scratch.chunks_exact_mut(lane.max(1)).take(lanes) {
        all.start(memory)?;
    }
    let start = Start(scratch.as_mut_ptr());
    runner.each(lights.count, lanes, 1.0, &|lane_number, number| {
        // SAFETY: a lane's memory is used by that lane alone; the lights are the caller's promise.
        let (memory, light) = unsafe {
            let memory = core::slice::from_raw_parts_mut(start.at(lane_number * lane), lane);
            (memory, &lights.light(number, coupling))
        };
        // in one place of the stack: it is large
        let light = light.as_ref().map_err(|error| *error)?;
        let (memory, scratch) = memory.split_at_mut_checked(lane - lane_bytes()?).unwrap_or_default();
        let of_light = |error| of_light(error, number);
        // SAFETY: by the caller's promise.
        let solution = unsafe { solve_one(&all, coupling, lights, (number, light), memory) };
        let solution = solution.as_ref().map_err(|error| of_light(*error))?;
        put_light(&all, coupling, (number, light), solution, out, scratch).map_err(of_light)
    })
}

/// Solves one light.
///
/// # Safety
/// As for [`LightArray::get`].
// apart: what the light is made from does not burden the stack of its views
#[inline(never)]
unsafe fn solve_one<'m>(
    all: &Lights<'_>,
    coupling: &blik_coupling,
    lights: &LightArray,
    (number, light): (usize, &Light<'_>),
    memory: &'m mut [u8],
) -> Result<Solution<'m>, blik_error> {
    // SAFETY: by the caller's promise.
    let input = &unsafe { lights.get(number, coupling) };
    let input = input.as_ref().map_err(|error| *error)?;
    Ok(all.solve(input, light, None, memory)?)
}

/// Writes what is wanted of a solved light.
// apart: does not burden the stack of solving
#[inline(never)]
fn put_light(
    all: &Lights<'_>,
    coupling: &blik_coupling,
    (number, light): (usize, &Light<'_>),
    solution: &Solution<'_>,
    out: &LightOutputs,
    scratch: &mut [u8],
) -> Result<(), blik_error> {
    let settings = coupling.settings.asked.chains(coupling.rays);
    let (scene, bvh, elements, solution) = (all.scene, all.bvh, all.elements, *solution);
    let bands = scene.bands();
    let rows = KnownRows::new(all.coupling);
    let solved = Solved { scene, bvh, elements, rows, light, solution, settings };
    let parts = [0, 1].map(|k| {
        // SAFETY: every light is handed out once, and the arrays have `values` entries for each.
        unsafe { core::slice::from_raw_parts_mut(out.facets[k].at(number * out.values[k]), out.values[k]) }
    });
    if parts.iter().any(|part| !part.is_empty()) {
        put_facets(&solved, all.coupling, parts);
    }
    let Some(signatures) = &out.signatures else { return Ok(()) };
    let views = out.directions.len() / 3;
    for (view, direction) in out.directions.as_chunks::<3>().0.iter().enumerate() {
        measure(&solved, Vec3::from_array(*direction), out.cells, scratch, |band, signature| {
            signatures.put((number * views + view) * bands + band, signature);
        })?;
    }
    Ok(())
}

/// Writes irradiances and radiances of all facets, those that there is room for.
// apart: their bands do not burden the stack of signatures
#[inline(never)]
fn put_facets(solved: &Solved<'_>, coupling: &Coupling<'_>, [irradiance, radiance]: [&mut [f64]; 2]) {
    let (scene, bands) = (solved.scene, solved.scene.bands());
    let mut both = [[0.0; MAX_BANDS]; 2];
    let [e, l] = both.each_mut().map(|all| all.split_at_mut(bands.min(MAX_BANDS)).0);
    for place in 0..scene.facets() * scene.sides() {
        let (facet, side) = (place / scene.sides().max(1), place % scene.sides().max(1));
        facets::side(solved, coupling, solved.sun, facet, side, e, l);
        irradiance.iter_mut().skip(place * bands).zip(&*e).for_each(|(to, from)| *to = *from);
        radiance.iter_mut().skip(place * bands).zip(&*l).for_each(|(to, from)| *to = *from);
    }
}
