//! A scene under one light, solved: from here every view is computed.

use crate::coupling::{Settings, blik_coupling};
use crate::memory::*;
use crate::run::{MOST_LANES, Runner, Start, Turns, blik_run};
use crate::status::*;
use crate::types::*;
use crate::{call, caught};
use blik_kernel::Error;
use blik_kernel::accuracy;
use blik_kernel::arena::{ALIGNMENT, Arena, Need};
use blik_kernel::beam::{self, BeamSettings};
use blik_kernel::chain::Solved;
use blik_kernel::coupling::{Block, Coupling, sink};
use blik_kernel::light::{self, Light, Shape};
use blik_kernel::policy;
use blik_kernel::radiosity::System;
use blik_kernel::scene::MAX_BANDS;
use blik_kernel::sky::{Sky, SkyInput, SkyModel, SkyTable};
use blik_kernel::solver::{self, History, Solver};
use blik_kernel::sun::{Sun, SunInput};
use blik_kernel::sun_image::{self, Noting, SunImages};
use core::ffi::c_void;
use core::ops::Range;
use core::sync::atomic::{AtomicU32, Ordering};

/// A solved scene in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_solution {
    tag: usize,
    pub(crate) coupling: &'static blik_coupling,
    pub(crate) light: Light<'static>,
    /// What the light was made from.
    pub(crate) input: (Option<SkyInput<'static>>, Option<SunInput<'static>>),
    pub(crate) tables: Tables,
    pub(crate) shape: Shape,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

/// What the light gave.
#[derive(Clone, Copy)]
pub(crate) struct Tables {
    pub reference: &'static [f64],
    /// Mean and gradients of each unknown's irradiance without the sun's direct part and that of its images.
    pub irradiance: &'static [f64],
    /// Mean of cos V of the sun.
    pub sun: &'static [f64],
    pub images: SunImages<'static>,
    pub variance: &'static [f32],
    pub brightest: f64,
    pub solver: f64,
    pub sweeps: u32,
    pub sun_rays: u64,
    pub bytes: usize,
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
        input: (Option<SkyInput<'static>>, Option<SunInput<'static>>),
        tables: Tables,
        shape: Shape,
    ) -> blik_solution {
        blik_solution {
            tag: blik_solution::TAG,
            coupling,
            light,
            input,
            tables,
            shape,
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
            light: &self.light,
            irradiance: self.tables.irradiance,
            images: self.tables.images,
            shape: self.shape,
            variance: self.tables.variance,
            reference: self.tables.reference,
            brightest: self.tables.brightest,
            settings: policy::chains(
                (settings.image, settings.tolerance),
                settings.max_bounces,
                self.coupling.rays,
            ),
        }
    }
}

static ONES: [f64; MAX_BANDS] = [1.0; MAX_BANDS];
static ZEROS: [f64; MAX_BANDS] = [0.0; MAX_BANDS];
static PIS: [f64; MAX_BANDS] = [core::f64::consts::PI; MAX_BANDS];

/// The caller's light, its arrays still the caller's.
struct Given<'a> {
    sky: Option<SkyInput<'a>>,
    sun: Option<SunInput<'a>>,
    reference: Option<&'a [f64]>,
}

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
    let model = match sky.model {
        BLIK_SKY_UNIFORM => SkyModel::Uniform,
        BLIK_SKY_HEMISPHERE => SkyModel::Hemisphere,
        BLIK_SKY_OVERCAST => SkyModel::Overcast,
        BLIK_SKY_CIE => SkyModel::Cie { kind: sky.cie_type, sun_direction: sky.sun_direction },
        BLIK_SKY_GRADIENT => SkyModel::Gradient,
        BLIK_SKY_TABLE => {
            let count = sky.table_rows.checked_mul(sky.table_columns);
            let count = count.and_then(|n| n.checked_mul(sky.table_bands));
            let count = count.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).field(BLIK_FIELD_SKY_TABLE))?;
            let zero = sky.table_azimuth_zero;
            SkyModel::Table(SkyTable {
                rows: sky.table_rows,
                columns: sky.table_columns,
                bands: sky.table_bands,
                // SAFETY: by the caller's promise.
                radiance: unsafe { input(sky.table, count) }?,
                azimuth_zero: (zero != [0.0; 3]).then_some(zero),
            })
        }
        other => return Err(blik_error::of(BLIK_ERROR_CHOICE).at(0, 0, f64::from(other))),
    };
    Ok(Some(SkyInput { model, radiance, ground, up: sky.up }))
}

impl Given<'_> {
    /// # Safety
    /// As for [`given_sky`].
    unsafe fn new<'a>(light: *const blik_light, bands: usize) -> Result<Given<'a>, blik_error> {
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
        if let Some(reference) = reference {
            light::check_reference(reference, bands)?;
        }
        let given = Given { sky, sun, reference };
        given.light(bands)?;
        Ok(given)
    }

    /// The kernel's light, checked.
    fn light(&self, bands: usize) -> Result<Light<'_>, Error> {
        Ok(Light {
            sky: self.sky.as_ref().map(|s| Sky::new(s, bands)).transpose()?,
            sun: self.sun.as_ref().map(|s| Sun::new(s, bands)).transpose()?,
        })
    }
}

/// How many of each thing a solution holds.
struct Sizes {
    shape: Shape,
    unknowns: usize,
    /// Radiances of all unknowns that are kept at once while solving.
    orders: usize,
    samples: usize,
    beams: usize,
    /// Places for images of the sun, and values of what they throw.
    images: (usize, usize),
}

impl Sizes {
    fn new(coupling: &blik_coupling, given: &Given<'_>) -> Result<Sizes, blik_error> {
        let Settings { max_bounces, .. } = coupling.settings;
        let scene = &coupling.base.scene;
        let shape = policy::shape(max_bounces, scene.bands());
        let samples = match given.sky.map(|s| s.model) {
            Some(SkyModel::Table(table)) => table.radiance.len(),
            _ => 0,
        };
        let light = given.light(scene.bands())?;
        let (mut beams, mut images) = (0, (0, 0));
        let unknowns = coupling.elements.unknowns();
        if let Some(settings) = light.sun.as_ref().and_then(|sun| beam_settings(coupling, sun)) {
            beams = sink::bytes(16, 64, beam::unmerged(scene, &coupling.elements, &settings), scene.bands())?;
            let sides = coupling.elements.facet_sides();
            images = (sun_image::places(sides), unknowns * shape.levels * shape.bands);
        }
        Ok(Sizes {
            shape,
            unknowns,
            orders: if shape.levels == 1 {
                2 + solver::kept(scene, coupling.settings.tolerance, max_bounces)
            } else {
                shape.levels + 1
            },
            samples,
            beams,
            images,
        })
    }

    /// What stays.
    fn kept(&self) -> Need {
        let bands = self.shape.bands;
        Need::new()
            .and::<f64>(bands)
            .and::<f64>(bands)
            .and::<f64>(bands)
            .and::<f64>(bands)
            .and::<f32>(self.samples)
            .and::<f64>(self.unknowns)
            .and::<f64>(self.unknowns * self.shape.stride())
            .and::<f32>(self.unknowns)
            .and::<u64>(self.images.0)
            .and::<f64>(self.images.1)
    }

    /// What is needed to make it; the beams of each lane.
    fn bytes(&self) -> Result<usize, blik_error> {
        let all = self.kept().and::<f64>(self.unknowns * self.shape.stride());
        let values = self.unknowns * self.shape.bands;
        let all = all.and::<f64>(values * self.orders).and::<accuracy::Own>(values).and::<f32>(2 * values);
        let all = all.and::<u8>(self.beams);
        let size = all.bytes()?.checked_add(head::<blik_solution>());
        size.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
    }
}

fn beam_settings(coupling: &blik_coupling, sun: &Sun<'_>) -> Option<BeamSettings> {
    let Settings { image, max_bounces, all, .. } = coupling.settings;
    policy::beams(&coupling.base.scene, sun, image, max_bounces, all)
}

/// Copies the caller's arrays, so that the light lives as long as its memory.
fn keep(given: &Given<'_>, sizes: &Sizes, arena: &mut Arena<'static>) -> Result<Given<'static>, blik_error> {
    let bands = sizes.shape.bands;
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
    let reference = copy(given.reference.unwrap_or(&[]))?;
    let samples = arena.take::<f32>(sizes.samples)?;
    let sky = given.sky.map(|sky| {
        let model = match sky.model {
            SkyModel::Table(table) => {
                samples.iter_mut().zip(table.radiance).for_each(|(to, from)| *to = *from);
                SkyModel::Table(SkyTable {
                    rows: table.rows,
                    columns: table.columns,
                    bands: table.bands,
                    radiance: samples,
                    azimuth_zero: table.azimuth_zero,
                })
            }
            SkyModel::Uniform => SkyModel::Uniform,
            SkyModel::Hemisphere => SkyModel::Hemisphere,
            SkyModel::Overcast => SkyModel::Overcast,
            SkyModel::Gradient => SkyModel::Gradient,
            SkyModel::Cie { kind, sun_direction } => SkyModel::Cie { kind, sun_direction },
        };
        SkyInput { model, radiance, ground, up: sky.up }
    });
    let sun = given.sun.map(|sun| SunInput {
        direction: sun.direction,
        irradiance,
        half_angle_deg: sun.half_angle_deg,
    });
    Ok(Given { sky, sun, reference: given.reference.map(|_| reference) })
}

/// Shares of the progress: direct light, sweeps, gathering.
const SHARES: [f64; 4] = [0.3, 0.3, 0.2, 0.2];

fn build(
    coupling: &'static blik_coupling,
    given: &Given<'_>,
    memory: &'static mut [u8],
    runner: &mut Runner,
) -> Result<*mut blik_solution, blik_error> {
    let sizes = Sizes::new(coupling, given)?;
    let (needed, size) = (sizes.bytes()?, memory.len());
    if size < needed {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, size));
    }
    let (place, rest) = place::<blik_solution>(memory)?;
    let mut arena = Arena::new(rest, 0)?;
    let (scene, elements) = (&coupling.base.scene, &coupling.elements);
    let given = keep(given, &sizes, &mut arena)?;
    let light = Light {
        sky: given.sky.as_ref().map(|s| Sky::new(s, scene.bands())).transpose()?,
        sun: given.sun.as_ref().map(|s| Sun::new(s, scene.bands())).transpose()?,
    };
    policy::check_highlights(scene, &light)?;
    let reference = arena_reference(&given, &light, coupling, &mut arena)?;
    let (unknowns, shape) = (sizes.unknowns, sizes.shape);
    let sun = arena.take::<f64>(unknowns)?;
    let irradiance = arena.take::<f64>(unknowns * shape.stride())?;
    let variance = arena.take::<f32>(unknowns)?;
    let (slots, thrown) = (arena.take::<u64>(sizes.images.0)?, arena.take::<f64>(sizes.images.1)?);
    let direct = arena.take::<f64>(unknowns * shape.stride())?;
    let orders = arena.take::<f64>(unknowns * shape.bands * sizes.orders)?;
    let own = arena.take::<accuracy::Own>(unknowns * shape.bands)?;
    let carried = arena.take::<f32>(2 * unknowns * shape.bands)?;
    let scratch = arena.take::<u8>(arena.left().saturating_sub(ALIGNMENT))?;

    let matrix = coupling.matrix()?;
    let shine = Shine { coupling, matrix: &matrix, light: &light, shape };
    let mut noting = Noting { slots: &mut *slots, thrown: &mut *thrown };
    let sun_rays = shine.direct(direct, sun, &mut noting, scratch, runner)?;
    let system = System { scene, elements, coupling: &matrix, light: &light, direct: &[], sun: &*sun, shape };
    let settings = &coupling.settings;
    let (mut before, mut bounds) = (0, None);
    if shape.levels == 1 {
        let first = Solve { system: System { direct, ..system }, settings, reference };
        before = first.run(orders, irradiance, &mut bounds, runner)?.0.map_or(0, |s| s.done);
        let internal = blik_error::of(BLIK_ERROR_INTERNAL);
        let size = unknowns * shape.bands;
        let missed = orders.get_mut(size..2 * size).ok_or(internal)?;
        runner.rows(missed, shape.bands, 0.0, |range, out| {
            system.slopes(range, irradiance, out);
            Ok(())
        })?;
        light::add(missed, shape, direct);
    }
    let solve = Solve { system: System { direct, ..system }, settings, reference };
    let (sweeps, radiance) = solve.run(orders, irradiance, &mut bounds, runner)?;
    policy::check_radiance(radiance, shape.bands)?;
    let images = SunImages { slots, thrown };
    images.take_off(shape, elements.facet_sides(), |unknown| elements.facet_side(unknown), irradiance);
    system.extend(irradiance);
    errors(&system, radiance, reference, (own, carried), variance, runner)?;
    let tables = Tables {
        reference,
        irradiance,
        sun,
        images,
        variance,
        brightest: policy::brightest(scene, &light, reference, radiance),
        solver: sweeps.map_or(0.0, |s| s.error),
        sweeps: sweeps.map_or(shape.levels as u32, |s| before + s.done),
        sun_rays,
        bytes: sizes.kept().bytes()?,
    };
    // SAFETY: `place` made room for it.
    unsafe { place.write(blik_solution::new(coupling, light, (given.sky, given.sun), tables, shape)) };
    Ok(place.as_ptr())
}

/// Expected squared error of each unknown; `own` and `carried` hold one and two values of each and of each band.
fn errors(
    system: &System<'_>,
    radiance: &[f64],
    reference: &[f64],
    (own, carried): (&mut [accuracy::Own], &mut [f32]),
    out: &mut [f32],
    runner: &mut Runner,
) -> Result<(), blik_error> {
    let bands = system.shape.bands;
    let short = blik_error::of(BLIK_ERROR_INTERNAL);
    let (mut carried, mut next) = carried.split_at_mut_checked(own.len()).ok_or(short)?;
    runner
        .rows(own, bands, 0.0, |range, out| accuracy::differences(system, radiance, reference, range, out))?;
    let own = &*own;
    for number in 0..accuracy::carried(system.scene) {
        let from = if number > 0 { &*carried } else { &[] };
        runner.rows(next, bands, 0.0, |range, out| accuracy::carry(system, own, from, range, out))?;
        core::mem::swap(&mut carried, &mut next);
    }
    runner.rows(out, 1, 0.0, |range, out| accuracy::rows(system, own, carried, range, out))
}

/// The reference radiance: the caller's, or from the light.
fn arena_reference(
    given: &Given<'static>,
    light: &Light<'_>,
    coupling: &blik_coupling,
    arena: &mut Arena<'static>,
) -> Result<&'static [f64], blik_error> {
    if let Some(reference) = given.reference {
        return Ok(reference);
    }
    let reference = arena.take::<f64>(coupling.base.scene.bands())?;
    light.reference_radiance(&coupling.base.scene, reference);
    Ok(reference)
}

/// Direct light at work.
struct Shine<'a> {
    coupling: &'a blik_coupling,
    matrix: &'a Coupling<'a>,
    light: &'a Light<'a>,
    shape: Shape,
}

impl Shine<'_> {
    /// Sky, sun and beams; the rays traced.
    fn direct(
        &self,
        direct: &mut [f64],
        lit: &mut [f64],
        images: &mut Noting<'_>,
        scratch: &mut [u8],
        runner: &mut Runner,
    ) -> Result<u64, blik_error> {
        let (base, elements) = (self.coupling.base, &self.coupling.elements);
        if let Some(sky) = &self.light.sky {
            let accuracy = policy::sky_accuracy(self.coupling.settings.image);
            runner.rows(direct, self.shape.stride(), SHARES[0], |range, out| {
                light::sky_rows(&base.scene, elements, self.matrix, sky, accuracy, range, self.shape, out)
            })?;
        }
        let Some(sun) = &self.light.sun else { return Ok(0) };
        let rays = Turns::new(0u64);
        runner.rows(lit, 1, 0.5 * SHARES[1], |range, out| {
            let traced = light::sun_rows(&base.scene, &base.bvh, elements, self.matrix, sun, range, out)?;
            rays.with(|all| *all += traced);
            Ok(())
        })?;
        let traced = rays.into_inner();
        match beam_settings(self.coupling, sun) {
            Some(settings) => Ok(traced + self.beams(sun, &settings, (direct, images), scratch, runner)?),
            None => Ok(traced),
        }
    }

    /// Adds the sunlight that mirrors throw: each lane traces its rows in its part of the scratch memory, and the
    /// results are added in the order of the rows.
    #[inline(never)]
    fn beams(
        &self,
        sun: &Sun<'_>,
        settings: &BeamSettings,
        (direct, images): (&mut [f64], &mut Noting<'_>),
        scratch: &mut [u8],
        runner: &mut Runner,
    ) -> Result<u64, blik_error> {
        let (base, elements) = (self.coupling.base, &self.coupling.elements);
        let (scene, rows) = (&base.scene, base.scene.facets() * base.scene.sides());
        let piece = rows.div_ceil(256).clamp(16, 1024);
        let usual = sink::bytes(piece, 64, beam::unmerged(scene, elements, settings), scene.bands())?;
        let mut lanes = runner.lanes().min(scratch.len() / usual.max(1)).max(1);
        let (mut next, mut traced) = (0, 0);
        let size = scratch.len();
        let start = Start(scratch.as_mut_ptr());
        while next < rows {
            let part = (size / lanes.max(1)) & !(ALIGNMENT - 1);
            let part = if lanes > 1 { part.min(usual.next_multiple_of(ALIGNMENT)) } else { part };
            let range = |lane: usize| (next + lane * piece).min(rows)..(next + (lane + 1) * piece).min(rows);
            // a bit each: which lanes' blocks hold rows
            let done = [const { AtomicU32::new(0) }; MOST_LANES.div_ceil(32)];
            let share = 0.5 * SHARES[1] * (lanes * piece) as f64 / (rows + lanes * piece) as f64;
            runner.each(lanes, lanes, share, &|_, lane| {
                if range(lane).is_empty() {
                    return Ok(());
                }
                // SAFETY: every lane is one item: its part of the scratch memory is its own.
                let memory = unsafe { core::slice::from_raw_parts_mut(start.at(lane * part), part) };
                match beam::fill(scene, &base.bvh, elements, sun, settings, range(lane), memory) {
                    Ok(_) => {
                        if let Some(word) = done.get(lane / 32) {
                            word.fetch_or(1 << (lane % 32), Ordering::Release);
                        }
                    }
                    Err(Error::BufferTooSmall { .. }) => {}
                    Err(error) => return Err(error.into()),
                }
                Ok(())
            })?;
            let before = next;
            let is_done = |lane: &usize| {
                done.get(lane / 32).is_some_and(|word| word.load(Ordering::Acquire) >> (lane % 32) & 1 == 1)
            };
            for lane in (0..lanes).filter(is_done) {
                let wanted: Range<usize> =
                    (before + lane * piece).min(rows)..(before + (lane + 1) * piece).min(rows);
                if wanted.start != next {
                    break;
                }
                // SAFETY: all lanes have ended: the memory is this thread's alone.
                let memory = unsafe { core::slice::from_raw_parts(start.at(lane * part), part) };
                let block = [Block::open(memory)?];
                let done = block[0].range().len();
                let thrown = Coupling::part(&block);
                beam::add(&thrown, (self.matrix, elements), sun, self.shape, direct, images);
                let thrown = thrown.rows(wanted.start..wanted.start + done);
                traced += thrown.map(|(_, r)| r.row.all_rays()).sum::<u64>();
                next += done;
            }
            if next == before {
                if lanes == 1 {
                    let needed = size.saturating_mul(3);
                    return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, size));
                }
                lanes = 1;
            }
        }
        Ok(traced)
    }
}

/// What bounds the error of a sweep.
#[derive(Clone, Copy)]
struct Bounds {
    q: f64,
    inverse: Option<f64>,
}

/// The linear system at work.
struct Solve<'a> {
    system: System<'a>,
    settings: &'a Settings,
    reference: &'a [f64],
}

impl Solve<'_> {
    /// Fills the table of irradiances, the second time from the radiances before; the radiances that the last sweep gave,
    /// which stand first of all `orders`, and how the sweeps went (none where orders of reflection are kept apart).
    fn run<'o>(
        &self,
        orders: &'o mut [f64],
        irradiance: &mut [f64],
        bounds: &mut Option<Bounds>,
        runner: &mut Runner,
    ) -> Result<(Option<Solver>, &'o [f64]), blik_error> {
        let shape = self.system.shape;
        let size = self.system.elements.unknowns() * shape.bands;
        let short = blik_error::of(BLIK_ERROR_INTERNAL);
        if shape.levels > 1 {
            self.orders(orders, size, irradiance, runner)?;
            let last = orders.get(size * shape.levels..).ok_or(short)?;
            return Ok((None, last));
        }
        let (from, rest) = orders.split_at_mut_checked(size).ok_or(short)?;
        let (to, history) = rest.split_at_mut_checked(size).ok_or(short)?;
        let sweeps = self.converge([&mut *from, to], history, bounds, runner)?;
        let radiance = &*from;
        runner.rows(irradiance, shape.stride(), SHARES[3], |range, out| {
            self.system.gather(range, 0, |_| radiance, out)
        })?;
        Ok((Some(sweeps), radiance))
    }

    fn start(&self, radiance: &mut [f64], runner: &mut Runner) -> Result<(), blik_error> {
        runner.rows(radiance, self.system.shape.bands, 0.0, |range, out| {
            self.system.start(range, out);
            Ok(())
        })
    }

    /// Sweeps until the solution, which then stands in the first of both, is good enough.
    fn converge(
        &self,
        [from, to]: [&mut [f64]; 2],
        history: &mut [f64],
        bounds: &mut Option<Bounds>,
        runner: &mut Runner,
    ) -> Result<Solver, blik_error> {
        let Settings { tolerance, max_bounces, .. } = *self.settings;
        let (known, mut before) = (bounds.is_some(), 0);
        let Bounds { q, inverse } = match bounds {
            Some(bounds) => *bounds,
            None => {
                let (found, sweeps) = self.bounds([&mut *from, &mut *to], history, runner)?;
                before = sweeps;
                *bounds.insert(found)
            }
        };
        // a sweep from a solution adds a reflection to all that it has
        if !known || max_bounces.is_some() {
            self.start(from, runner)?;
        }
        let mut solver = Solver::new(q, inverse, tolerance, max_bounces, !history.is_empty());
        let ends =
            self.iterate(&mut solver, [&mut *from, &mut *to], history, runner, |range, from, to, relax| {
                self.system.relaxed_sweep(range, from, to, self.reference, relax)
            })?;
        solver.finish(ends[0], self.reference, max_bounces);
        if solver.done % 2 == 1 {
            from.iter_mut().zip(to).for_each(|(from, to)| *from = *to);
        }
        solver.done += before;
        Ok(solver)
    }

    /// What holds for any light: the contraction of a sweep and, where it needs one, the bound on the inverse; and the
    /// sweeps that it took.
    fn bounds(
        &self,
        [from, to]: [&mut [f64]; 2],
        history: &mut [f64],
        runner: &mut Runner,
    ) -> Result<(Bounds, u32), blik_error> {
        let largest = Turns::new(0.0);
        runner.ranges(self.system.elements.unknowns(), SHARES[2], |range| {
            let q = self.system.contraction(range);
            largest.with(|all| *all = f64::max(*all, q));
            Ok(())
        })?;
        let q = largest.into_inner();
        let deficits = history.get_mut(..from.len()).unwrap_or_default();
        runner.rows(deficits, self.system.shape.bands, 0.0, |range, out| {
            self.system.deficits(range, out);
            Ok(())
        })?;
        if !Solver::is_closed(q, self.settings.max_bounces) {
            return Ok((Bounds { q, inverse: None }, 0));
        }
        from.fill(0.0);
        let mut unit = Solver::unit();
        let ends = self.iterate(&mut unit, [from, to], history, runner, |range, from, to, relax| {
            self.system.unit_sweep(range, from, to, relax)
        })?;
        Ok((Bounds { q, inverse: Some(unit.inverse(ends[1], q)?) }, unit.done))
    }

    /// Iterates to the end: the latest solution, and the one before.
    fn iterate<'o>(
        &self,
        solver: &mut Solver,
        [mut latest, mut next]: [&'o mut [f64]; 2],
        history: &mut [f64],
        runner: &mut Runner,
        sweep: impl Fn(Range<usize>, &[f64], &mut [f64], f64) -> f64 + Sync,
    ) -> Result<[&'o [f64]; 2], blik_error> {
        let bands = self.system.shape.bands;
        let mut history = History::new(history, latest.len());
        while solver.more() {
            let change = Turns::new(0.0);
            let (seen, relaxation) = (&*latest, solver.relaxation());
            runner.rows(next, bands, 0.0, |range, out| {
                let own = sweep(range, seen, out, relaxation);
                change.with(|all| *all = f64::max(*all, own));
                Ok(())
            })?;
            core::mem::swap(&mut latest, &mut next);
            if solver.took(change.into_inner()) {
                history.note(next, latest, bands, |at| self.system.weight(at));
            }
        }
        Ok([latest, next])
    }

    /// Each order of reflection from those before it.
    fn orders(
        &self,
        orders: &mut [f64],
        size: usize,
        irradiance: &mut [f64],
        runner: &mut Runner,
    ) -> Result<(), blik_error> {
        let shape = self.system.shape;
        let share = (SHARES[2] + SHARES[3]) / shape.levels as f64;
        let short = blik_error::of(BLIK_ERROR_INTERNAL);
        self.start(orders.get_mut(..size).ok_or(short)?, runner)?;
        for level in 0..shape.levels {
            let (done, rest) = orders.split_at_mut_checked(size * (level + 1)).ok_or(short)?;
            let order = |at: usize| done.get(at * size..(at + 1) * size).unwrap_or_default();
            runner.rows(irradiance, shape.stride(), share, |range, out| {
                self.system.gather(range, level, order, out)
            })?;
            let (table, next) = (&*irradiance, rest.get_mut(..size).ok_or(short)?);
            runner.rows(next, shape.bands, 0.0, |range, out| {
                self.system.reflect(range, level, table, out);
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// Bytes of memory that [`blik_solution_init`] needs for this light, at any address. More speeds up scenes with
/// mirrors and a sun on several threads. Where mirrors scatter sunlight over many more elements than usual, the call
/// returns `BLIK_ERROR_BUFFER_TOO_SMALL` and `error->needed` says how many bytes probably do.
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_size(
    coupling: *const blik_coupling,
    light: *const blik_light,
    error: *mut blik_error,
    bytes: *mut usize,
) -> i32 {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (coupling, given) = unsafe {
            let coupling: &blik_coupling = object(coupling)?;
            (coupling, Given::new(light, coupling.base.scene.bands())?)
        };
        let size = Sizes::new(coupling, &given)?.bytes()?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Lights a scene and solves for its diffuse radiance, in the caller's memory. For another light call it again, with
/// the same memory or other: the coupling is not computed anew, and no ray toward the sky is traced. The coupling must
/// outlive the solution.
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
    solution: *mut *const blik_solution,
) -> i32 {
    call(error, || {
        let to = needed(solution)?;
        // SAFETY: by the caller's promise.
        let (coupling, given, mut runner, memory) = unsafe {
            let coupling: &blik_coupling = object(coupling)?;
            let given = Given::new(light, coupling.base.scene.bands())?;
            (coupling, given, Runner::new(run)?, bytes(memory, size)?)
        };
        let made = build(coupling, &given, memory, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// As [`blik_solution_init`], in memory of its own; to be ended by [`blik_solution_destroy`].
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
) -> i32 {
    call(error, || {
        let to = needed(solution)?;
        // SAFETY: by the caller's promise.
        let (coupling, given, mut runner) = unsafe {
            let coupling: &blik_coupling = object(coupling)?;
            let given = Given::new(light, coupling.base.scene.bands())?;
            (coupling, given, Runner::new(run)?)
        };
        let sizes = Sizes::new(coupling, &given)?;
        let mut more = sizes.beams * 4 * (runner.lanes() - 1);
        loop {
            let mut slab = Slab::new(sizes.bytes()? + more)?;
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
                Err(error) if error.status == BLIK_ERROR_BUFFER_TOO_SMALL && more < 1 << 32 => {
                    more = 4 * (more + sizes.beams);
                }
                Err(error) => return Err(error),
            }
        }
    })
}

/// Ends a solution and frees what it owns; nothing for null.
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

/// Reference radiance of each band, to which tolerance and errors are related.
///
/// # Safety
/// Pointers are null or valid; `radiance` has one value per band.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_solution_get_reference(
    solution: *const blik_solution,
    error: *mut blik_error,
    radiance: *mut f64,
) -> i32 {
    call(error, || {
        // SAFETY: by the caller's promise.
        let solution: &blik_solution = unsafe { object(solution) }?;
        let reference = solution.tables.reference;
        // SAFETY: by the caller's promise.
        let out = unsafe { output(radiance, reference.len()) }?;
        out.iter_mut().zip(reference).for_each(|(to, from)| *to = *from);
        Ok(())
    })
}
