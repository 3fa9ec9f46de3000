//! What signatures are made of and depend on: shares of facets, terms, and derivatives by reflectances and emissions.

use crate::call;
use crate::coupling::blik_coupling;
use crate::lights::coupled;
use crate::memory::*;
use crate::run::{Runner, blik_run};
use crate::solution::coupling_and_light;
use crate::status::*;
use crate::types::*;
use crate::view::{Signatures, blik_signature, signatures_of, wanted_cells, with_scratch};
use blik_kernel::Error;
use blik_kernel::importance::TERMS;
use blik_kernel::light::{Light, LightInput};
use blik_kernel::math::Vec3;
use blik_kernel::scene::MAX_BANDS;
use blik_kernel::stages::{Explained, Lights};
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
        let (coupling, given) = unsafe { coupling_and_light(coupling, light) }?;
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
        let given = &unsafe { coupling_and_light(coupling, light) };
        // lights in one place of the stack each: they are large
        let (coupling, given) = given.as_ref().map(|(coupling, given)| (*coupling, given)).map_err(|e| *e)?;
        let tables = [
            (shares, share_count),
            (terms, term_count),
            (by_diffuse, by_diffuse_count),
            (by_emission, by_emission_count),
        ];
        // SAFETY: by the caller's promise.
        let (runner, mut out) = unsafe {
            let signatures = (signatures, signature_count, signature_stride);
            let out = ExplainOutputs::new(coupling, (directions, direction_count), signatures, tables)?;
            (Runner::new(run)?, out)
        };
        let cells = wanted_cells(cells, coupling)?;
        let matrix = coupling.matrix()?;
        let all = coupled(coupling, &matrix);
        let light = given.light(&coupling.base.scene);
        let light = light.as_ref().map_err(|error| *error)?;
        let wanted = all.explain_bytes(light)?;
        let work = |memory: &mut [u8]| {
            if memory.len() < wanted {
                return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(wanted, memory.len()));
            }
            explain_views(&all, coupling, (given, light), (&mut out, cells), &runner, memory)
        };
        // SAFETY: by the caller's promise.
        unsafe { with_scratch(scratch, scratch_size, wanted, work) }
    })
}

/// Explains all views in scratch memory that suffices.
#[inline]
fn explain_views(
    all: &Lights<'_>,
    coupling: &blik_coupling,
    light: (&LightInput<'_>, &Light<'_>),
    (out, cells): (&mut ExplainOutputs<'_>, usize),
    runner: &Runner,
    memory: &mut [u8],
) -> Result<(), blik_error> {
    all.start(memory)?;
    let chains = coupling.settings.asked.chains(coupling.rays);
    let (views, bands) = (out.views, coupling.base.scene.bands());
    let mut number = 0;
    let done = all.explain(light, None, (views, cells), chains, memory, |_, found| {
        let forward = Vec3::from_array(views.get(number).copied().unwrap_or_default());
        put_view((found, forward), (number, bands), out);
        number += 1;
        if runner.told(number as f64 / views.len() as f64) { Ok(()) } else { Err(Error::Cancelled) }
    });
    done.map_err(|error| blik_error { index: number, ..error.into() })
}

/// Where explained signatures go.
struct ExplainOutputs<'a> {
    views: &'a [[f64; 3]],
    signatures: Signatures,
    /// Shares, terms, derivatives by diffuse reflectance and by emission; empty: not wanted.
    tables: [&'a mut [f64]; 4],
}

impl ExplainOutputs<'_> {
    /// Checks the arrays of the caller, each with its number of entries.
    ///
    /// # Safety
    /// They are null or as long as that.
    // apart: what is wrong with them does not burden the stack of solving
    #[inline(never)]
    unsafe fn new<'a>(
        coupling: &blik_coupling,
        (directions, views): (*const f64, usize),
        (signatures, count, stride): (*mut blik_signature, usize, usize),
        [shares, terms, by_diffuse, by_emission]: [(*mut f64, usize); 4],
    ) -> Result<ExplainOutputs<'a>, blik_error> {
        let scene = &coupling.base.scene;
        let (bands, facets) = (scene.bands(), scene.facets() * scene.bands());
        let room = |each: usize| views.checked_mul(each).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY));
        // SAFETY: by the caller's promise.
        unsafe {
            let signatures = Signatures::new(signatures, count, room(bands)?, stride)?;
            let tables = [
                optional_output(shares, room(facets)?, BLIK_FIELD_SHARES)?,
                optional_output(terms, room(TERMS * bands)?, BLIK_FIELD_COMPONENTS)?,
                optional_output(by_diffuse, room(facets)?, BLIK_FIELD_DIFFUSE)?,
                optional_output(by_emission, room(facets * scene.sides())?, BLIK_FIELD_EMISSION)?,
            ];
            Ok(ExplainOutputs { views: input(directions, room(3)?)?.as_chunks::<3>().0, signatures, tables })
        }
    }
}

/// Writes one view's signatures, and the tables of what they are made of and depend on.
// apart: the background's bands do not burden the stack of solving
#[inline(never)]
fn put_view(
    (found, forward): (&Explained<'_>, Vec3),
    (number, bands): (usize, usize),
    out: &mut ExplainOutputs<'_>,
) {
    let mut background = [0.0; MAX_BANDS];
    let own = (found.solved, found.sums, &mut background[..]);
    let to = &out.signatures;
    signatures_of(own, forward, |band, signature| to.put(number * bands + band, signature));
    let own = found.importance;
    let found = [&*own.shares, &*own.terms, &*own.diffuse, &*own.emission];
    for (table, found) in out.tables.iter_mut().zip(found) {
        let to = table.iter_mut().skip(number * found.len());
        to.zip(found).for_each(|(to, from)| *to = *from);
    }
}
