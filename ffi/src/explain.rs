//! What signatures are made of and depend on: shares of facets, terms, and derivatives by reflectances and emissions.

use crate::call;
use crate::coupling::blik_coupling;
use crate::lights::coupled;
use crate::memory::*;
use crate::run::blik_run;
use crate::solution::given_light;
use crate::status::*;
use crate::types::*;
use crate::view::{Signatures, blik_signature, signatures_of, wanted_cells, with_scratch};
use blik_kernel::Error;
use blik_kernel::importance::TERMS;
use blik_kernel::math::Vec3;
use blik_kernel::scene::MAX_BANDS;
use blik_kernel::stages::Explained;
use core::ffi::c_void;

/// Bytes of scratch memory for [`blik_explain`]. More is for scenes with mirrors that scatter sunlight.
///
/// - `coupling`: the coupling
/// - `light`: the light
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_explain_scratch_size(
    coupling: *const blik_coupling,
    light: *const blik_light,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (coupling, given) = unsafe {
            let coupling: &blik_coupling = object(coupling)?;
            (coupling, given_light(light, &coupling.base.scene)?)
        };
        let matrix = coupling.matrix()?;
        let size = coupled(coupling, &matrix).explain_bytes(&given.light(&coupling.base.scene)?)?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Solves a scene for its light and tells of the signature in each direction what it is made of and how it changes with
/// diffuse reflectances and emissions of all facets, by the transposed system. Shares of facets, and terms, add up to the radiant
/// intensity. Derivatives are those of the numbers that the solver's equations define, of elements and rays as they are; chains
/// between mirrors that are cut at the tolerance end there for them. With sky and sun signatures are linear: their derivatives by
/// those are the signatures under each alone (`blik_lights`). Refused where `max_bounces` counts reflections
/// (`BLIK_ERROR_RANGE`). The whole call runs on the calling thread; calls on other threads may run besides.
///
/// - `coupling`: the coupling
/// - `light`: the light
/// - `directions`: three numbers a view, from the observer toward the object, of any length but zero
/// - `direction_count`: number of views
/// - `cells`: cells along each side of the projection, one ray each, up to 65536; 0: by tolerance
/// - `run`: the defaults or a progress function, told once a view; tasks are not used
/// - `signatures`: receives one entry a view and band, bands innermost: the bits of `blik_signatures`
/// - `signature_count`: number of entries that there is room for: views x bands
/// - `signature_stride`: bytes from one entry to the next: `sizeof(blik_signature)`
/// - `shares`: receives what the observer sees of each facet first, W/sr, one value a view, facet and band; null: not wanted
/// - `share_count`: number of values that there is room for: views x facets x bands
/// - `terms`: receives three values a view and band, W/sr: all bands' diffuse, then mirrored sky and sun, then mirrored diffuse;
///   null: not wanted
/// - `term_count`: number of values that there is room for: views x 3 x bands
/// - `by_diffuse`: receives derivatives of the radiant intensity by each facet's diffuse reflectance, W/sr, one value a view,
///   facet and band; 0 where a facet reflects nothing diffusely in the band; null: not wanted
/// - `by_diffuse_count`: number of values that there is room for: views x facets x bands
/// - `by_emission`: receives derivatives by the emission of each facet and side, in the square of the mesh's unit, one value a
///   view, facet, side and band; null: not wanted
/// - `by_emission_count`: number of values that there is room for: views x facets x sides x bands
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_explain(
    coupling: *const blik_coupling,
    light: *const blik_light,
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
    shares: *mut f64,
    share_count: usize,
    terms: *mut f64,
    term_count: usize,
    by_diffuse: *mut f64,
    by_diffuse_count: usize,
    by_emission: *mut f64,
    by_emission_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (coupling, given) = unsafe {
            let coupling: &blik_coupling = object(coupling)?;
            (coupling, &given_light(light, &coupling.base.scene))
        };
        // lights in one place of the stack each: they are large
        let given = given.as_ref().map_err(|error| *error)?;
        // SAFETY: by the caller's promise.
        let runner = unsafe { crate::run::Runner::new(run) }?;
        let scene = &coupling.base.scene;
        let (too_many, views, bands) = (blik_error::of(BLIK_ERROR_TOO_MANY), direction_count, scene.bands());
        let facets = scene.facets() * bands;
        let room = |each: usize| views.checked_mul(each).ok_or(too_many);
        // SAFETY: by the caller's promise.
        let (directions, to, mut tables) = unsafe {
            let to = Signatures::new(signatures, signature_count, room(bands)?, signature_stride)?;
            let tables = [
                optional_output((shares, share_count), room(facets)?, BLIK_FIELD_SHARES)?,
                optional_output((terms, term_count), room(TERMS * bands)?, BLIK_FIELD_COMPONENTS)?,
                optional_output((by_diffuse, by_diffuse_count), room(facets)?, BLIK_FIELD_DIFFUSE)?,
                optional_output(
                    (by_emission, by_emission_count),
                    room(facets * scene.sides())?,
                    BLIK_FIELD_EMISSION,
                )?,
            ];
            (input(directions, room(3)?)?, to, tables)
        };
        let cells = wanted_cells(cells, coupling)?;
        let matrix = coupling.matrix()?;
        let all = coupled(coupling, &matrix);
        let light = given.light(scene);
        let light = light.as_ref().map_err(|error| *error)?;
        let chains = coupling.settings.asked.chains(coupling.rays);
        let wanted = all.explain_bytes(light)?;
        let work = |memory: &mut [u8]| {
            if memory.len() < wanted {
                return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(wanted, memory.len()));
            }
            all.start(memory)?;
            let (mut number, views) = (0, (directions.as_chunks::<3>().0, cells));
            let done = all.explain((given, light), None, views, chains, memory, |_, found| {
                let forward = Vec3::from_array(views.0.get(number).copied().unwrap_or_default());
                put_view((found, forward), (number, bands), &to, &mut tables);
                number += 1;
                if runner.told(number as f64 / views.0.len() as f64) { Ok(()) } else { Err(Error::Cancelled) }
            });
            done.map_err(|error| blik_error { index: number, ..error.into() })
        };
        // SAFETY: by the caller's promise.
        unsafe { with_scratch(scratch, scratch_size, wanted, work) }
    })
}

/// Writes one view's signatures, and the tables of what they are made of and depend on.
// apart: the background's bands do not burden the stack of solving
#[inline(never)]
fn put_view(
    (found, forward): (&Explained<'_>, Vec3),
    (number, bands): (usize, usize),
    to: &Signatures,
    tables: &mut [&mut [f64]; 4],
) {
    let mut background = [0.0; MAX_BANDS];
    let own = (found.solved, found.sums, &mut background[..]);
    signatures_of(own, forward, |band, signature| to.put(number * bands + band, signature));
    let own = found.importance;
    let found = [&*own.shares, &*own.terms, &*own.diffuse, &*own.emission];
    for (table, found) in tables.iter_mut().zip(found) {
        let to = table.iter_mut().skip(number * found.len());
        to.zip(found).for_each(|(to, from)| *to = *from);
    }
}
