//! A scene under one light, solved: from here every view is computed.

use crate::coupling::blik_coupling;
use crate::memory::*;
use crate::run::{Runner, blik_run};
use crate::status::*;
use crate::types::*;
use crate::{call, caught};
use blik_kernel::arena::{ALIGNMENT, Arena, Need};
use blik_kernel::chain::{KnownRows, Solved};
use blik_kernel::coupling::Coupling;
use blik_kernel::light::{Light, LightInput};
use blik_kernel::radiosity::solution::Solution;
use blik_kernel::scene::{MAX_BANDS, Scene};
use blik_kernel::sky::SkyInput;
use blik_kernel::sky::record::SkyRecord;
use blik_kernel::stages::{Beams, Lighting, Sizes};
use blik_kernel::sun::SunInput;
use core::ffi::c_void;

/// A solved scene in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_solution {
    tag: usize,
    pub(crate) coupling: &'static blik_coupling,
    pub(crate) light: Light<'static>,
    /// Input of the light.
    pub(crate) input: LightInput<'static>,
    pub(crate) record: Solution<'static>,
    /// Bytes that stay in use.
    pub(crate) bytes: usize,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

impl Handle for blik_solution {
    const TAG: usize = 0x5ce9_e003;

    fn tag(at: *mut Self) -> *mut usize {
        // SAFETY: only the place is computed, within memory of a handle's size.
        unsafe { &raw mut (*at).tag }
    }

    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>> {
        &mut self.owner
    }
}

impl blik_solution {
    pub(crate) fn new(
        coupling: &'static blik_coupling,
        light: Light<'static>,
        input: LightInput<'static>,
        record: Solution<'static>,
        bytes: usize,
    ) -> blik_solution {
        blik_solution {
            tag: blik_solution::TAG,
            coupling,
            light,
            input,
            record,
            bytes,
            #[cfg(feature = "std")]
            owner: None,
        }
    }

    pub(crate) fn solved(&self) -> Solved<'_> {
        let (base, settings) = (self.coupling.base, &self.coupling.settings);
        Solved {
            scene: &base.scene,
            bvh: &base.bvh,
            elements: &self.coupling.elements,
            rows: KnownRows::new(&self.coupling.matrix().unwrap_or(Coupling::part(&[]))),
            light: &self.light,
            solution: self.record,
            settings: settings.asked.chains(self.coupling.rays),
        }
    }
}

static ONES: [f64; MAX_BANDS] = [1.0; MAX_BANDS];
static ZEROS: [f64; MAX_BANDS] = [0.0; MAX_BANDS];
static PIS: [f64; MAX_BANDS] = [core::f64::consts::PI; MAX_BANDS];

/// One value per band, or the first of `defaults`.
///
/// # Safety
/// `at` is null or has `bands` values.
unsafe fn values(at: *const f64, bands: usize, defaults: &[f64]) -> Result<&[f64], blik_error> {
    if at.is_null() {
        return Ok(defaults.get(..bands).unwrap_or(defaults));
    }
    // SAFETY: by the caller's promise.
    unsafe { input(at, bands) }
}

/// # Safety
/// As for [`read`]; arrays have one value per band, the table as many as it says.
unsafe fn given_sky<'a>(sky: *const blik_sky, bands: usize) -> Result<Option<SkyInput<'a>>, blik_error> {
    if sky.is_null() {
        return Ok(None);
    }
    // SAFETY: by the caller's promise.
    let (sky, radiance, ground) = unsafe {
        let sky = read(sky)?;
        (sky, values(sky.radiance, bands, &ONES)?, values(sky.ground, bands, &ZEROS)?)
    };
    let choice = blik_error::of(BLIK_ERROR_CHOICE).at(0, 0, f64::from(sky.model));
    let table = sky.model == BLIK_SKY_TABLE;
    let record = SkyRecord {
        // the constants of the header begin with 0
        model: u64::try_from(sky.model).map_err(|_| choice)? + 1,
        cie_type: u64::from(sky.cie_type),
        up: sky.up,
        direction: if table { sky.table_azimuth_zero } else { sky.sun_direction },
        table: [sky.table_rows, sky.table_columns, sky.table_bands].map(|n| n as u64),
    };
    let count = record.samples().ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).field(BLIK_FIELD_SKY_TABLE))?;
    // SAFETY: by the caller's promise.
    let samples = unsafe { input(sky.table, count) }?;
    record.input(radiance, ground, samples).ok_or(choice).map(Some)
}

/// Input of the caller's light: pointers and lengths are checked, values are not (`LightInput::light` does); its arrays
/// are still the caller's.
///
/// # Safety
/// As for [`given_sky`].
pub(crate) unsafe fn given_light<'a>(
    light: *const blik_light,
    scene: &Scene<'_>,
) -> Result<LightInput<'a>, blik_error> {
    let bands = scene.bands();
    // SAFETY: by the caller's promise.
    let (light, sky) = unsafe {
        let light = read(light)?;
        (light, given_sky(light.sky, bands)?)
    };
    let sun = if light.sun.is_null() {
        None
    } else {
        // SAFETY: by the caller's promise.
        let (sun, irradiance) = unsafe {
            let sun = read(light.sun)?;
            (sun, values(sun.irradiance, bands, &PIS)?)
        };
        Some(SunInput { direction: sun.direction, irradiance, half_angle_deg: sun.half_angle_deg })
    };
    let reference = if light.reference_radiance.is_null() {
        None
    } else {
        // SAFETY: by the caller's promise.
        Some(unsafe { input(light.reference_radiance, bands) }?)
    };
    if light.emission.is_null() && light.emission_count > 0 {
        return Err(blik_error::of(BLIK_ERROR_NULL).field(BLIK_FIELD_EMISSION));
    }
    let all = scene.facets() * scene.sides() * bands;
    if !light.emission.is_null() && light.emission_count != all {
        return Err(blik_error::of(BLIK_ERROR_LENGTH)
            .field(BLIK_FIELD_EMISSION)
            .sizes(all, light.emission_count));
    }
    // SAFETY: by the caller's promise.
    let emission = unsafe { input(light.emission, light.emission_count) }?;
    Ok(LightInput { sky, sun, emission, reference })
}

/// A coupling, and what a light for it is made from ([`given_light`]).
///
/// # Safety
/// As for [`object`] and [`given_sky`].
pub(crate) unsafe fn coupling_and_light<'a>(
    coupling: *const blik_coupling,
    light: *const blik_light,
) -> Result<(&'a blik_coupling, LightInput<'a>), blik_error> {
    // SAFETY: by the caller's promise.
    unsafe {
        let coupling: &blik_coupling = object(coupling)?;
        Ok((coupling, given_light(light, &coupling.base.scene)?))
    }
}

/// Counts of a solution's values and bytes.
struct Plan {
    sizes: Sizes,
    /// Samples of the sky's table.
    samples: usize,
    /// Values of the light's own emission.
    emission: usize,
}

impl Plan {
    fn new(coupling: &blik_coupling, given: &LightInput<'_>) -> Result<Plan, blik_error> {
        let scene = &coupling.base.scene;
        let samples = given.sky.map_or(0, |sky| sky.model.samples().len());
        let light = given.light(scene)?;
        let sizes =
            Sizes::new((scene, &coupling.base.bvh), &coupling.elements, &light, &coupling.settings.asked)?;
        Ok(Plan { sizes, samples, emission: given.emission.len() })
    }

    /// Bytes that stay in use.
    fn kept(&self) -> Need {
        let bands = self.sizes.shape().bands;
        let light = Need::new().and::<f64>(bands).and::<f64>(bands).and::<f64>(bands);
        let light = light.and::<f32>(self.samples).and::<f64>(self.emission);
        light.join(self.sizes.solution.need())
    }

    /// All bytes, with beams on the given number of lanes.
    fn bytes(&self, lanes: usize) -> Result<usize, blik_error> {
        let all = self.kept().join(self.sizes.scratch()).and::<u8>(self.sizes.beams(lanes));
        let size = all.bytes()?.checked_add(head::<blik_solution>());
        size.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
    }
}

/// Copies the caller's arrays but for the reference radiance, so that the light lives as long as its memory.
fn keep(
    given: &LightInput<'_>,
    plan: &Plan,
    arena: &mut Arena<'static>,
) -> Result<LightInput<'static>, blik_error> {
    let bands = plan.sizes.shape().bands;
    let mut copy = |from: &[f64]| -> Result<&'static [f64], blik_error> {
        let to = arena.take::<f64>(bands)?;
        to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        Ok(to)
    };
    let (radiance, ground) = match &given.sky {
        Some(sky) => (copy(sky.radiance)?, copy(sky.ground)?),
        None => (copy(&[])?, copy(&[])?),
    };
    let irradiance = copy(given.sun.map_or(&[], |s| s.irradiance))?;
    let samples = arena.take::<f32>(plan.samples)?;
    let emission = arena.take::<f64>(plan.emission)?;
    emission.iter_mut().zip(given.emission).for_each(|(to, from)| *to = *from);
    let sky = given.sky.and_then(|sky| {
        samples.iter_mut().zip(sky.model.samples()).for_each(|(to, from)| *to = *from);
        SkyRecord::new(&sky).input(radiance, ground, samples)
    });
    let sun = given.sun.map(|sun| SunInput {
        direction: sun.direction,
        irradiance,
        half_angle_deg: sun.half_angle_deg,
    });
    Ok(LightInput { sky, sun, emission, reference: None })
}

fn build(
    coupling: &'static blik_coupling,
    given: &LightInput<'_>,
    memory: &'static mut [u8],
    runner: &mut Runner,
) -> Result<*mut blik_solution, blik_error> {
    let plan = Plan::new(coupling, given)?;
    let (needed, size) = (plan.bytes(1)?, memory.len());
    if size < needed {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, size));
    }
    let (place, rest) = place::<blik_solution>(memory)?;
    let mut arena = Arena::new(rest, 0)?;
    let kept = keep(given, &plan, &mut arena)?;
    let (scene, elements) = (&coupling.base.scene, &coupling.elements);
    // in one place of the stack: it is large
    let light = kept.light(scene);
    let light = light.as_ref().map_err(|error| *error)?;
    let mut solution = plan.sizes.solution.take(&mut arena)?;
    let mut scratch = plan.sizes.take_scratch(&mut arena)?;
    let beam_memory = arena.keep::<u8>(arena.left().saturating_sub(ALIGNMENT))?;
    let matrix = coupling.matrix()?;
    let settings = &coupling.settings.asked;
    let bvh = &coupling.base.bvh;
    let lighting = Lighting { scene, bvh, elements, coupling: &matrix, light, settings };
    let mut rays = lighting.direct(given.reference, &mut solution, &mut scratch, runner)?;
    let mut beams = Beams::default();
    beams.add(&lighting, &mut solution, &mut scratch, beam_memory, runner)?;
    rays += beams.rays;
    let record = lighting.solve(solution, &mut scratch, rays, runner)?;
    let bytes = plan.kept().bytes()?;
    // SAFETY: `place` made room for it.
    unsafe { put(place, coupling, light, &kept, &record, bytes) };
    Ok(place.as_ptr())
}

/// Writes the handle.
///
/// # Safety
/// There is room for it.
// apart: it does not burden the stack of solving
#[inline(never)]
unsafe fn put(
    place: core::ptr::NonNull<blik_solution>,
    coupling: &'static blik_coupling,
    light: &Light<'static>,
    kept: &LightInput<'static>,
    record: &Solution<'static>,
    bytes: usize,
) {
    // SAFETY: by the caller's promise.
    unsafe { place.write(blik_solution::new(coupling, *light, *kept, *record, bytes)) };
}

/// Bytes of memory that [`blik_solution_init`] needs for this light, at any address. More speeds up scenes with mirrors
/// and a sun on several threads.
///
/// - `coupling`: the coupling
/// - `light`: the light
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_size(
    coupling: *const blik_coupling,
    light: *const blik_light,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (coupling, given) = unsafe { coupling_and_light(coupling, light) }?;
        let size = Plan::new(coupling, &given)?.bytes(1)?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Lights a scene and solves for its diffuse radiance, in the caller's memory. Another light is another call, in the
/// same memory or other: the coupling is not computed anew, and no ray toward the sky is traced. Where mirrors scatter
/// sunlight over many more elements than usual, the call returns `BLIK_ERROR_BUFFER_TOO_SMALL`, and `error->needed`
/// says how many bytes probably do.
///
/// - `coupling`: the coupling, which must outlive the solution
/// - `light`: the light; not needed afterwards
/// - `solution`: receives the solution
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the solution is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_init(
    coupling: *const blik_coupling,
    light: *const blik_light,
    run: *const blik_run,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    solution: *mut *mut blik_solution,
) -> blik_status {
    call(error, || {
        let to = needed(solution)?;
        // SAFETY: by the caller's promise.
        let given = &unsafe { coupling_and_light(coupling, light) };
        // in one place of the stack: it is large
        let (coupling, given) = given.as_ref().map(|(coupling, given)| (*coupling, given)).map_err(|e| *e)?;
        // SAFETY: by the caller's promise.
        let (mut runner, memory) = unsafe { (Runner::new(run)?, bytes(memory, size)?) };
        let made = build(coupling, given, memory, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Bytes beyond which memory for beams is not enlarged.
#[cfg(feature = "std")]
const BEAM_BYTES_MOST: usize = if usize::BITS > 32 { 1 << 34 } else { 1 << 30 };

/// Lights a scene and solves for its diffuse radiance, in memory of its own.
///
/// - `coupling`: the coupling, which must outlive the solution
/// - `light`: the light; not needed afterwards
/// - `solution`: receives the solution; to be ended by [`blik_solution_destroy`]
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_create(
    coupling: *const blik_coupling,
    light: *const blik_light,
    run: *const blik_run,
    error: *mut blik_error,
    solution: *mut *mut blik_solution,
) -> blik_status {
    call(error, || {
        let to = needed(solution)?;
        // SAFETY: by the caller's promise.
        let ((coupling, given), mut runner) =
            unsafe { (coupling_and_light(coupling, light)?, Runner::new(run)?) };
        let mut size = Plan::new(coupling, &given)?.bytes(runner.lanes())?;
        loop {
            let mut slab = Slab::new(size)?;
            // SAFETY: the handle owns the slab, or is never made.
            match build(coupling, &given, unsafe { slab.bytes_mut() }, &mut runner) {
                Ok(made) => {
                    // SAFETY: just made, and not null.
                    unsafe {
                        (*made).owner = Some(std::boxed::Box::new(Owned(std::vec![slab])));
                        to.write(made);
                    }
                    return Ok(());
                }
                Err(error) if error.status == BLIK_ERROR_BUFFER_TOO_SMALL && size < BEAM_BYTES_MOST => {
                    size = size.saturating_mul(4);
                }
                Err(error) => return Err(error),
            }
        }
    })
}

/// Ends a solution and frees what it owns.
///
/// - `solution`: the solution; null: nothing
///
/// # Safety
/// Null or a solution that nobody uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_destroy(solution: *mut blik_solution) {
    let _ = caught(|| {
        // SAFETY: by the caller's promise.
        unsafe { end(solution) };
        Ok(())
    });
}

/// Numbers of a solution.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_solution_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Facets of its scene, degenerate ones included.
    pub facets: usize,
    /// Sides of a facet that carry its material: 1 or 2.
    pub sides: usize,
    /// Spectral bands.
    pub bands: usize,
}

impl Default for blik_solution_info {
    fn default() -> blik_solution_info {
        blik_solution_info { struct_size: size_of::<blik_solution_info>(), facets: 0, sides: 0, bands: 0 }
    }
}
sized!(blik_solution_info);

/// Numbers of a solution: what arrays of its results are as long as.
///
/// - `solution`: the solution
/// - `info`: receives them; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_get_info(
    solution: *const blik_solution,
    error: *mut blik_error,
    info: *mut blik_solution_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, solution): (_, &blik_solution) = unsafe { (Place::new(info)?, object(solution)?) };
        let scene = &solution.coupling.base.scene;
        let (facets, sides, bands) = (scene.facets(), scene.sides(), scene.bands());
        to.write(blik_solution_info { facets, sides, bands, ..blik_solution_info::default() });
        Ok(())
    })
}

/// Reference radiance, to which tolerance and errors are related.
///
/// - `solution`: the solution
/// - `radiance`: receives one value per band
/// - `radiance_count`: number of values that there is room for: bands
///
/// # Safety
/// Pointers are null or valid; `radiance` has one value per band.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_get_reference(
    solution: *const blik_solution,
    error: *mut blik_error,
    radiance: *mut f64,
    radiance_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let solution: &blik_solution = unsafe { object(solution) }?;
        let reference = solution.record.reference;
        // SAFETY: by the caller's promise.
        let out = unsafe { output_of((radiance, radiance_count), reference.len(), BLIK_FIELD_RADIANCE)? };
        out.iter_mut().zip(reference).for_each(|(to, from)| *to = *from);
        Ok(())
    })
}
