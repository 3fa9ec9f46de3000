//! The owning layer over the kernel, for programs with a heap and threads: it asks each stage for its bytes,
//! hands the memory over and splits the rows over a thread pool of its own.
//!
//! The stages stay apart: [`Host::geometry`] once per mesh, [`Host::light`] for each light, [`Host::image`] and
//! [`Host::signature`] for each view. A new light traces no visibility rays, a new view solves nothing.

mod report;
mod rounds;

pub use report::*;
pub use rounds::Rounds;

use crate::base::arena::Memory;
use crate::base::error::Error;
use crate::base::index::IndexMut;
use crate::base::math::Vec3;
use crate::base::simd::Isa;
use crate::coupling::element::Elements;
use crate::coupling::facing::Facing;
use crate::coupling::rows::{RowSettings, fill};
use crate::coupling::subdivide::Cut;
use crate::coupling::{Block, Coupling, sink};
use crate::radiosity::System;
use crate::radiosity::accuracy;
use crate::radiosity::beam;
use crate::radiosity::direct::{self, Shape};
use crate::radiosity::limits;
use crate::radiosity::solver::{self, History, Solver};
use crate::radiosity::sun_image::{self, Noting, SunImages};
use crate::rays::bvh::Bvh;
use crate::scene::light::{self, Light};
use crate::scene::sky::{Sky, SkyInput};
use crate::scene::sun::{Sun, SunInput};
use crate::scene::{Scene, SceneInput};
use crate::settings;
use crate::view::camera::{Camera, CameraInput};
use crate::view::chain::Solved;
use crate::view::facets;
use crate::view::image::{self, Tally, Target};
use crate::view::signature::{self, Signature, Sums, View};
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;
use std::vec::Vec;

/// What the caller asks for.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The wanted error of the image, eq. 16, relative to the reference radiance: 1e-6 to 0.1.
    pub tolerance: f64,
    /// 1e-6 to 0.1. Where it is less than the tolerance, that is the solution's alone, and this the image's: rays from the
    /// points that it shows find what a solution lacks that is there sooner. For few images of little error, which take longer
    /// each; `None`: the tolerance. There are no such rays where reflections are counted, or where lobes or curved mirrors
    /// throw sunlight; the error estimate tells.
    pub image_tolerance: Option<f64>,
    /// Light reflected more often does not count; `None`: by tolerance.
    pub max_bounces: Option<u32>,
    /// Reference radiance, one value per band; `None`: from the light.
    pub reference_radiance: Option<Vec<f64>>,
    /// Irradiance of all facets is wanted, also of those that reflect nothing diffusely.
    pub all_irradiances: bool,
    /// Keep the directions of blocked and mirrored light, so that a new sky needs no rays. Where it is false,
    /// only uniform skies can light the scene, and what nothing hides is entered in closed form, sooner and more exactly.
    pub directional: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            tolerance: 2e-3,
            image_tolerance: None,
            max_bounces: None,
            reference_radiance: None,
            all_irradiances: false,
            directional: true,
        }
    }
}

impl Settings {
    /// The wanted error of images.
    fn of_image(&self) -> f64 {
        self.image_tolerance.map_or(self.tolerance, |image| image.min(self.tolerance))
    }
}

/// Threads on which all stages run.
#[derive(Debug)]
pub struct Host {
    pool: rayon::ThreadPool,
    isa: Isa,
}

/// Memory of the stages that depend on the geometry alone; give the same one again to reuse it.
#[derive(Debug, Default)]
pub struct GeometryMemory {
    scene: Memory,
    bvh: Memory,
    elements: Memory,
    slabs: Vec<Memory>,
}

/// Scene, tree, elements and coupling: everything that no light changes.
#[derive(Debug)]
pub struct Geometry<'s> {
    scene: Scene<'s>,
    bvh: Bvh<'s>,
    elements: Elements<'s>,
    blocks: Vec<Block<'s>>,
    settings: Settings,
    /// Rays of the coupling.
    rays: u64,
    report: Report,
}

/// A scene under one light, solved.
#[derive(Debug)]
pub struct Lit<'g> {
    geometry: &'g Geometry<'g>,
    light: Light<'g>,
    shape: Shape,
    reference: Vec<f64>,
    irradiance: Vec<f64>,
    sun: Vec<f64>,
    suns: Suns,
    variance: Vec<f32>,
    brightest: f64,
    report: Report,
}

/// The system while it is solved.
#[derive(Debug, Default)]
struct Solving {
    /// The solution.
    radiance: Vec<f64>,
    next: Vec<f64>,
    history: Vec<f64>,
    /// As [`Host::bounds`] gives them, once they are known.
    bounds: Option<(f64, Option<f64>)>,
}

/// What mirrors throw of the sun.
#[derive(Debug, Default)]
struct Suns {
    slots: Vec<u64>,
    thrown: Vec<f64>,
}

impl Suns {
    fn images(&self) -> SunImages<'_> {
        SunImages { slots: &self.slots, thrown: &self.thrown }
    }
}

/// A photometric image: rows from the top, (row, column, band).
#[derive(Debug)]
pub struct Image {
    /// Pixels across.
    pub columns: usize,
    /// Pixels down.
    pub rows: usize,
    /// Spectral bands.
    pub bands: usize,
    /// Radiance.
    pub pixels: Vec<f32>,
    /// The terms of eq. (11): diffuse, mirror-sky, mirror-diffuse; same shape.
    pub components: Option<[Vec<f32>; 3]>,
    /// What was done and how good it is.
    pub report: Report,
}

impl Host {
    /// A pool of so many threads; 0: as many as there are cores.
    ///
    /// # Errors
    /// [`Error::TooMany`] where the system gives no threads.
    pub fn new(threads: usize) -> Result<Host, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|_| Error::TooMany { what: "threads", limit: threads })?;
        Ok(Host { pool, isa: Isa::detect() })
    }

    /// Scene, tree, elements and coupling of a mesh.
    pub fn geometry<'s>(
        &self,
        memory: &'s mut GeometryMemory,
        input: &SceneInput<'_>,
        settings: &Settings,
    ) -> Result<Geometry<'s>, Error> {
        settings::check_tolerance(settings.tolerance)?;
        if let Some(image) = settings.image_tolerance {
            settings::check_tolerance(image)?;
        }
        if let Some(reference) = &settings.reference_radiance {
            light::check_reference(reference, input.bands)?;
        }
        let mut report = Report { tolerance: settings.of_image(), bands: input.bands, ..Report::default() };
        let mut clock = Clock::start();
        let GeometryMemory { scene: scene_memory, bvh: bvh_memory, elements: element_memory, slabs } = memory;
        *scene_memory = Memory::new(Scene::bytes(input)?);
        let scene = Scene::new(input, scene_memory.bytes_mut())?;
        report.facets = scene.facets();
        report.degenerate_facets = scene.degenerate();
        report.bytes.scene = scene.memory();
        report.seconds.scene = clock.lap();
        *bvh_memory = Memory::new(Bvh::bytes(scene.facets())?);
        let bvh = Bvh::build(scene.corners(), scene.areas(), self.isa, bvh_memory.bytes_mut())?;
        report.bytes.bvh = bvh.memory();
        report.seconds.bvh = clock.lap();
        let rows = RowSettings::new(
            &scene,
            settings.tolerance,
            settings.max_bounces,
            settings.directional,
            settings.all_irradiances,
        );
        let wanted = settings::planes(&scene, &rows);
        let mut planes = Memory::new(Facing::bytes(&scene, wanted)?);
        let facing = Facing::new(&scene, &bvh, wanted, planes.bytes_mut())?;
        let mut trees = Memory::new(Cut::bytes(scene.facets(), settings.tolerance)?);
        let mut cut = Cut::new(&scene, settings.tolerance, trees.bytes_mut())?;
        let probing = settings::probing(&rows);
        loop {
            let (work, unevenness) = cut.work();
            let probes = self.split(unevenness, 1, |range, out| {
                work.probe(&scene, &bvh, &facing, (probing, settings.tolerance), range, out)
            })?;
            report.rays.visibility += probes.iter().sum::<u64>();
            if !cut.refine(&scene) {
                break;
            }
        }
        *element_memory = Memory::new(Elements::bytes(&cut)?);
        let elements = Elements::new(&scene, &cut, element_memory.bytes_mut())?;
        report.elements = elements.count();
        let unmerged = settings::unmerged(&rows);
        *slabs = self.blocks(elements.unknowns(), unmerged, scene.bands(), |range, memory| {
            fill(&scene, &bvh, &elements, &facing, &rows, range, memory)
        })?;
        let blocks = slabs.iter().map(|s| Block::open(s.bytes())).collect::<Result<Vec<_>, _>>()?;
        let coupling = Coupling::new(&blocks, elements.unknowns())?;
        let rays = coupling.rays();
        report.rays.visibility += rays;
        report.count_rows(&coupling);
        report.count_scene(&scene, settings.directional, elements.unknowns());
        report.bytes.coupling = coupling.memory() + elements.memory();
        report.seconds.coupling = clock.lap();
        Ok(Geometry { scene, bvh, elements, blocks, settings: settings.clone(), rays, report })
    }

    /// Fills blocks with all `rows` rows, each of some `unmerged` records while it grows, in parallel.
    fn blocks(
        &self,
        rows: usize,
        unmerged: usize,
        bands: usize,
        fill: impl Fn(Range<usize>, &mut [u8]) -> Result<usize, Error> + Sync,
    ) -> Result<Vec<Memory>, Error> {
        // enough pieces to balance two dozen threads, large enough that a block's head does not count
        let piece = rows.div_ceil(256).clamp(16, 1024);
        let pieces: Vec<Range<usize>> =
            (0..rows).step_by(piece).map(|start| start..(start + piece).min(rows)).collect();
        let filled = self.pool.install(|| {
            pieces
                .into_par_iter()
                .map(|range| fill_piece(range, unmerged, bands, &fill))
                .collect::<Result<Vec<_>, _>>()
        })?;
        Ok(filled.into_iter().flatten().collect())
    }

    /// The light of a scene, solved: no visibility is computed again.
    ///
    /// # Errors
    /// What [`Sky::new`] and [`Sun::new`] refuse, radiances above 1e37 ([`limits::check_radiance`],
    /// [`limits::check_highlights`]), a system that diverges.
    pub fn light<'g>(
        &self,
        geometry: &'g Geometry<'g>,
        sky: Option<&SkyInput<'g>>,
        sun: Option<&SunInput<'g>>,
    ) -> Result<Lit<'g>, Error> {
        // within the pool at once: each stage of its own would wake and wait for it
        self.pool.install(|| self.light_within(geometry, sky, sun))
    }

    fn light_within<'g>(
        &self,
        geometry: &'g Geometry<'g>,
        sky: Option<&SkyInput<'g>>,
        sun: Option<&SunInput<'g>>,
    ) -> Result<Lit<'g>, Error> {
        let (scene, elements) = (&geometry.scene, &geometry.elements);
        let bands = scene.bands();
        let mut report = geometry.report.clone();
        let mut clock = Clock::start();
        let light = Light {
            sky: sky.map(|s| Sky::new(s, bands)).transpose()?,
            sun: sun.map(|s| Sun::new(s, bands)).transpose()?,
        };
        limits::check_highlights(scene, &light)?;
        let mut reference = std::vec![0.0; bands];
        match &geometry.settings.reference_radiance {
            Some(given) => reference.copy_from_slice(given),
            None => light.reference_radiance(scene, &mut reference),
        }
        let coupling = geometry.coupling()?;
        let shape = settings::shape(geometry.settings.max_bounces, bands);
        let unknowns = elements.unknowns();
        let mut direct = std::vec![0.0; unknowns * shape.stride()];
        if let Some(sky) = &light.sky {
            let accuracy = settings::sky_accuracy(geometry.settings.of_image());
            self.split(&mut direct, shape.stride(), |range, out| {
                direct::sky_rows(scene, elements, &coupling, sky, accuracy, range, shape, out)
            })?;
        }
        let mut lit_share = std::vec![0.0; unknowns];
        let mut suns = Suns::default();
        if let Some(sun) = &light.sun {
            let rays = self.split(&mut lit_share, 1, |range, out| {
                direct::sun_rows(scene, &geometry.bvh, elements, &coupling, sun, range, out)
            })?;
            report.rays.sun += rays.iter().sum::<u64>();
            report.rays.sun += self.beams(geometry, sun, shape, &mut direct, &mut suns)?;
        }
        report.count_light(&light, unknowns);
        report.bytes.light = 8 * (direct.len() + lit_share.len() + suns.slots.len() + suns.thrown.len());
        report.seconds.light = clock.lap();
        let (coupling, light) = (&coupling, &light);
        let system = System { scene, elements, coupling, light, direct: &direct, sun: &lit_share, shape };
        let mut solving = Solving { radiance: std::vec![0.0; unknowns * bands], ..Solving::default() };
        let mut irradiance =
            self.solve(&system, &geometry.settings, &reference, &mut solving, &mut report)?;
        if shape.levels == 1 {
            let mut missed = std::vec![0.0; unknowns * bands];
            self.split(&mut missed, bands, |range, out| {
                system.slopes(range, &irradiance, out);
                Ok(())
            })?;
            direct::add(&missed, shape, &mut direct);
            let system = System { scene, elements, coupling, light, direct: &direct, sun: &lit_share, shape };
            irradiance = self.solve(&system, &geometry.settings, &reference, &mut solving, &mut report)?;
        }
        let radiance = solving.radiance;
        limits::check_radiance(&radiance, bands)?;
        let system = System { scene, elements, coupling, light, direct: &direct, sun: &lit_share, shape };
        let sides = elements.facet_sides();
        suns.images().take_off(shape, sides, |unknown| elements.facet_side(unknown), &mut irradiance);
        system.extend(&mut irradiance);
        let variance = self.accuracy(&system, &radiance, &reference)?;
        let brightest = limits::brightest(scene, light, &reference, &radiance);
        report.reference_radiance = reference.clone();
        report.seconds.radiosity = clock.lap();
        let light = *light;
        let sun = lit_share;
        Ok(Lit { geometry, light, shape, reference, irradiance, sun, suns, variance, brightest, report })
    }

    /// Expected squared error of each unknown.
    fn accuracy(&self, system: &System<'_>, radiance: &[f64], reference: &[f64]) -> Result<Vec<f32>, Error> {
        let (bands, unknowns) = (system.shape.bands, system.elements.unknowns());
        let mut differences = std::vec![[0.0; 2]; unknowns * bands];
        self.split(&mut differences, bands, |range, out| {
            accuracy::differences(system, radiance, reference, range, out)
        })?;
        let (mut carried, mut next) = (std::vec![0.0; unknowns * bands], std::vec![0.0; unknowns * bands]);
        for number in 0..accuracy::carried(system.scene) {
            let from = if number > 0 { &carried[..] } else { &[] };
            self.split(&mut next, bands, |range, out| {
                accuracy::carry(system, &differences, from, range, out)
            })?;
            core::mem::swap(&mut carried, &mut next);
        }
        let mut variance = std::vec![0.0; unknowns];
        self.split(&mut variance, 1, |range, out| {
            accuracy::rows(system, &differences, &carried, range, out)
        })?;
        Ok(variance)
    }

    /// Adds the sunlight that mirrors throw to the irradiance table; returns the rays traced.
    fn beams(
        &self,
        geometry: &Geometry<'_>,
        sun: &Sun<'_>,
        shape: Shape,
        table: &mut [f64],
        suns: &mut Suns,
    ) -> Result<u64, Error> {
        let scene = &geometry.scene;
        let Settings { max_bounces, all_irradiances, .. } = geometry.settings;
        let tolerance = geometry.settings.of_image();
        let Some(settings) = settings::beams(scene, sun, tolerance, max_bounces, all_irradiances) else {
            return Ok(0);
        };
        let rows = scene.facets() * scene.sides();
        let slabs = self.blocks(rows, 1024, scene.bands(), |range, memory| {
            beam::fill(scene, &geometry.bvh, &geometry.elements, sun, &settings, range, memory)
        })?;
        let blocks = slabs.iter().map(|s| Block::open(s.bytes())).collect::<Result<Vec<_>, _>>()?;
        let beams = Coupling::new(&blocks, rows)?;
        *suns = Suns {
            slots: std::vec![0; sun_image::places(rows)],
            thrown: std::vec![0.0; geometry.elements.unknowns() * shape.levels * shape.bands],
        };
        let mut noting = Noting { slots: &mut suns.slots, thrown: &mut suns.thrown };
        beam::add(&beams, (&geometry.coupling()?, &geometry.elements), sun, shape, table, &mut noting);
        Ok(beams.rows(0..rows).map(|(_, r)| r.row.all_rays()).sum())
    }

    /// Solves for the diffuse radiance, the second time from the solution before; returns the irradiance table.
    fn solve(
        &self,
        system: &System<'_>,
        settings: &Settings,
        reference: &[f64],
        solving: &mut Solving,
        report: &mut Report,
    ) -> Result<Vec<f64>, Error> {
        let (bands, unknowns) = (system.shape.bands, system.elements.unknowns());
        let mut irradiance = std::vec![0.0; unknowns * system.shape.stride()];
        if system.shape.levels == 1 {
            report.certified.solver = self.converge(system, settings, reference, solving, report)?;
            self.split(&mut irradiance, system.shape.stride(), |range, out| {
                system.gather(range, 0, |_| &solving.radiance, out)
            })?;
            return Ok(irradiance);
        }
        let mut orders = std::vec![core::mem::take(&mut solving.radiance)];
        orders.iter_mut().try_for_each(|first| self.start(system, first))?;
        for level in 0..system.shape.levels {
            self.split(&mut irradiance, system.shape.stride(), |range, out| {
                system.gather(range, level, |order| &orders[order], out)
            })?;
            let mut next = std::vec![0.0; unknowns * bands];
            self.split(&mut next, bands, |range, out| {
                system.reflect(range, level, &irradiance, out);
                Ok(())
            })?;
            orders.push(next);
            report.sweeps += 1;
        }
        solving.radiance = orders.pop().unwrap_or_default();
        Ok(irradiance)
    }

    /// The radiances before any reflection.
    fn start(&self, system: &System<'_>, radiance: &mut [f64]) -> Result<(), Error> {
        self.split(radiance, system.shape.bands, |range, out| {
            system.start(range, out);
            Ok(())
        })?;
        Ok(())
    }

    /// Sweeps until the bound on the error is a small part of the tolerance; returns the bound.
    fn converge(
        &self,
        system: &System<'_>,
        settings: &Settings,
        reference: &[f64],
        solving: &mut Solving,
        report: &mut Report,
    ) -> Result<f64, Error> {
        let Settings { tolerance, max_bounces, .. } = *settings;
        let bounds = match solving.bounds {
            Some(bounds) => bounds,
            None => self.bounds(system, settings, solving, report)?,
        };
        // a sweep from a solution adds a reflection to all that it has
        if solving.bounds.is_none() || max_bounces.is_some() {
            self.start(system, &mut solving.radiance)?;
        }
        solving.bounds = Some(bounds);
        let Solving { radiance, next, history, .. } = solving;
        let mut solver = Solver::new(bounds.0, bounds.1, tolerance, max_bounces, !history.is_empty());
        self.iterate(&mut solver, system, [radiance, next], history, |range, from, to, relax| {
            system.relaxed_sweep(range, from, to, reference, relax)
        })?;
        solver.finish(radiance, reference, max_bounces);
        report.sweeps += solver.done;
        Ok(solver.error)
    }

    /// The contraction of a sweep and, where it needs one, the bound on the inverse; they hold for any light.
    fn bounds(
        &self,
        system: &System<'_>,
        settings: &Settings,
        solving: &mut Solving,
        report: &mut Report,
    ) -> Result<(f64, Option<f64>), Error> {
        let Settings { tolerance, max_bounces, .. } = *settings;
        let size = solving.radiance.len();
        let mut probe = std::vec![0u8; system.elements.unknowns()];
        let parts = self.split(&mut probe, 1, |range, _| Ok(system.contraction(range)))?;
        let q = parts.into_iter().fold(0.0, f64::max);
        solving.next = std::vec![0.0; size];
        solving.history = std::vec![0.0; solver::kept(system.scene, tolerance, max_bounces) * size];
        let deficits = size.min(solving.history.len());
        self.split(solving.history.head_mut(deficits), system.shape.bands, |range, out| {
            system.deficits(range, out);
            Ok(())
        })?;
        if !Solver::is_closed(q, max_bounces) {
            return Ok((q, None));
        }
        let Solving { radiance, next, history, .. } = solving;
        radiance.fill(0.0);
        let mut unit = Solver::unit();
        self.iterate(&mut unit, system, [radiance, next], history, |range, from, to, relax| {
            system.unit_sweep(range, from, to, relax)
        })?;
        report.sweeps += unit.done;
        Ok((q, Some(unit.inverse(next, q)?)))
    }

    /// Iterates to the end: the latest solution stands in the first of both, the one before in the second.
    fn iterate(
        &self,
        solver: &mut Solver,
        system: &System<'_>,
        [latest, next]: [&mut Vec<f64>; 2],
        history: &mut [f64],
        sweep: impl Fn(Range<usize>, &[f64], &mut [f64], f64) -> f64 + Sync,
    ) -> Result<(), Error> {
        let bands = system.shape.bands;
        let mut history = History::new(history, latest.len());
        while solver.more() {
            let relaxation = solver.relaxation();
            let changes = self.split(next, bands, |range, out| Ok(sweep(range, latest, out, relaxation)))?;
            core::mem::swap(latest, next);
            if solver.took(changes.into_iter().fold(0.0, f64::max)) {
                history.note(next, latest, bands, |at| system.weight(at));
            }
        }
        Ok(())
    }

    /// Runs `work` over ranges of rows, each with its part of `out` (`stride` values a row), in parallel.
    fn split<T: Send, R: Send>(
        &self,
        out: &mut [T],
        stride: usize,
        work: impl Fn(Range<usize>, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<Vec<R>, Error> {
        let rows = out.len() / stride.max(1);
        let piece = rows.div_ceil(8 * self.pool.current_num_threads()).max(16);
        self.pool.install(|| {
            out.par_chunks_mut(piece * stride.max(1))
                .enumerate()
                .map(|(i, part)| work(i * piece..i * piece + part.len() / stride.max(1), part))
                .collect()
        })
    }

    /// The image that a camera sees of a solved scene; with `components`, the terms of eq. (11) too.
    pub fn image(&self, lit: &Lit<'_>, camera: &CameraInput, components: bool) -> Result<Image, Error> {
        let camera = Camera::new(camera, &lit.geometry.scene)?;
        let mut clock = Clock::start();
        let solved = lit.solved();
        let (columns, rows, bands) = (camera.columns(), camera.rows(), lit.shape.bands);
        let size = rows * columns * bands;
        let mut pixels = std::vec![0f32; size];
        let part = if components { size } else { 0 };
        let mut terms = [(); 3].map(|()| std::vec![0f32; part]);
        let tally = self.paint(&solved, &camera, &mut pixels, &mut terms)?;
        let mut report = lit.report.clone();
        report.bytes.image = 4 * (size + 3 * part);
        let (signature, rays) = self.signature(lit, camera.forward())?;
        report.signature = signature;
        report.rays.primary = tally.primary + rays;
        report.rays.chain += tally.chain;
        report.seconds.image = clock.lap();
        report.finish(&tally, columns * rows);
        Ok(Image { columns, rows, bands, pixels, components: components.then_some(terms), report })
    }

    /// Computes all rows of an image in parallel pieces.
    fn paint(
        &self,
        solved: &Solved<'_>,
        camera: &Camera,
        pixels: &mut [f32],
        terms: &mut [Vec<f32>; 3],
    ) -> Result<Tally, Error> {
        let (rows, bands) = (camera.rows(), solved.shape.bands);
        let piece = image::piece(rows);
        let chunk = piece * camera.columns() * bands;
        let scratch = image::scratch_bytes(camera, bands)?;
        let mut parts = terms.each_mut().map(|t| t.chunks_mut(chunk));
        let mut jobs = Vec::new();
        for (i, image) in pixels.chunks_mut(chunk).enumerate() {
            let components = parts.each_mut().map(|p| p.next().unwrap_or_default());
            jobs.push((i * piece..((i + 1) * piece).min(rows), Target { image, components }));
        }
        let tallies = self.pool.install(|| {
            let paint = |memory: &mut Memory, (range, mut target): (Range<usize>, Target<'_>)| {
                image::rows(solved, camera, range, &mut target, memory.bytes_mut())
            };
            let memory = || Memory::new(scratch);
            jobs.into_par_iter().map_init(memory, paint).collect::<Result<Vec<_>, _>>()
        })?;
        let mut tally = Tally::default();
        tallies.iter().for_each(|t| tally.add(t));
        Ok(tally)
    }

    /// What a distant observer who looks along `forward` measures, and the rays that it took.
    ///
    /// The background of the contrast is the sky in that direction.
    pub fn signature(&self, lit: &Lit<'_>, forward: Vec3) -> Result<(SignatureReport, u64), Error> {
        let solved = lit.solved();
        let view = lit.view(&solved, forward)?;
        let mut rows = std::vec![Sums::ZERO; view.rows()];
        // few pieces: what lies in two of them is drawn twice
        let piece = rows.len().div_ceil(2 * self.pool.current_num_threads()).max(16);
        let size = signature::scratch_bytes()?;
        self.pool.install(|| {
            rows.par_chunks_mut(piece).enumerate().try_for_each(|(i, out)| {
                let range = i * piece..i * piece + out.len();
                signature::rows(&solved, &view, range, Memory::new(size).bytes_mut(), out)
            })
        })?;
        let mut sums = Sums::ZERO;
        rows.iter().for_each(|row| sums.add(row));
        Ok(lit.signature(forward, &sums))
    }

    /// [`Host::signature`] of many observers, each on one thread: the same numbers.
    pub fn signatures(&self, lit: &Lit<'_>, forward: &[Vec3]) -> Result<Vec<(SignatureReport, u64)>, Error> {
        let solved = lit.solved();
        let size = signature::scratch_bytes()?;
        let measure = |memory: &mut Memory, forward: &Vec3| {
            let view = lit.view(&solved, *forward)?;
            let sums = signature::whole(&solved, &view, memory.bytes_mut())?;
            Ok(lit.signature(*forward, sums))
        };
        self.pool.install(|| forward.par_iter().map_init(|| Memory::new(size), measure).collect())
    }
}

impl Geometry<'_> {
    /// The coupling of all elements.
    pub fn coupling(&self) -> Result<Coupling<'_>, Error> {
        Coupling::new(&self.blocks, self.elements.unknowns())
    }

    /// The scene.
    pub fn scene(&self) -> &Scene<'_> {
        &self.scene
    }

    /// The tree.
    pub fn bvh(&self) -> &Bvh<'_> {
        &self.bvh
    }

    /// The elements.
    pub fn elements(&self) -> &Elements<'_> {
        &self.elements
    }

    /// What was done so far.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

impl Lit<'_> {
    /// The solved scene as the kernel's ray and image routines take it.
    pub fn solved(&self) -> Solved<'_> {
        let settings = &self.geometry.settings;
        Solved {
            scene: &self.geometry.scene,
            bvh: &self.geometry.bvh,
            elements: &self.geometry.elements,
            light: &self.light,
            irradiance: &self.irradiance,
            images: self.suns.images(),
            shape: self.shape,
            variance: &self.variance,
            reference: &self.reference,
            brightest: self.brightest,
            settings: settings::chains(
                (settings.of_image(), settings.tolerance),
                settings.max_bounces,
                self.geometry.rays,
            ),
        }
    }

    /// The cells of a signature along `forward`.
    fn view(&self, solved: &Solved<'_>, forward: Vec3) -> Result<View, Error> {
        View::new(solved, forward, settings::signature_cells(self.geometry.settings.tolerance))
    }

    /// What the sums over all cells of a signature along `forward` say, and their rays.
    fn signature(&self, forward: Vec3, sums: &Sums) -> (SignatureReport, u64) {
        let bands = self.shape.bands;
        let mut background = std::vec![0.0; bands];
        if let Some(sky) = &self.light.sky {
            sky.radiance(forward, &mut background);
        }
        let of = |band: usize| Signature::new(sums, band, background[band]);
        let report = SignatureReport {
            radiant_intensity: (0..bands).map(|b| of(b).intensity).collect(),
            projected_area: sums.area,
            mean_radiance: (0..bands).map(|b| of(b).mean_radiance).collect(),
            contrast: (0..bands).map(|b| of(b).contrast).collect(),
        };
        (report, sums.rays)
    }

    /// Reference radiance, one value per band.
    pub fn reference(&self) -> &[f64] {
        &self.reference
    }

    /// What was done so far.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Calls `each` with (facet, side, area, irradiance, diffuse radiance) for every side that carries a
    /// material, by facet, then side. Irradiance is the mean over the facet of all that arrives; diffuse
    /// radiance is emission + rho_d irradiance/pi. Degenerate facets: zeros.
    pub fn facets(&self, mut each: impl FnMut(usize, usize, f64, &[f64], &[f64])) {
        let (scene, solved) = (&self.geometry.scene, self.solved());
        let Ok(coupling) = self.geometry.coupling() else { return };
        let (mut irradiance, mut radiance) =
            (std::vec![0.0; self.shape.bands], std::vec![0.0; self.shape.bands]);
        for facet in 0..scene.facets() {
            for side in 0..scene.sides() {
                facets::side(&solved, &coupling, &self.sun, facet, side, &mut irradiance, &mut radiance);
                each(facet, side, scene.area(facet), &irradiance, &radiance);
            }
        }
    }
}

/// Fills blocks with the rows of one range, as many blocks as it takes.
fn fill_piece(
    range: Range<usize>,
    mut unmerged: usize,
    bands: usize,
    fill: &impl Fn(Range<usize>, &mut [u8]) -> Result<usize, Error>,
) -> Result<Vec<Memory>, Error> {
    let mut slabs = Vec::new();
    let mut next = range.start;
    let mut records = 64;
    while next < range.end {
        let mut slab = Memory::new(sink::bytes(range.end - next, records, unmerged, bands)?);
        match fill(next..range.end, slab.bytes_mut()) {
            Ok(done) => {
                next += done;
                let block = Block::open(slab.bytes())?;
                records = 64.max(block.records() / done + 16);
                let extent = block.extent(slab.bytes());
                slab.truncate(extent);
                slabs.push(slab);
            }
            Err(Error::BufferTooSmall { .. }) if unmerged < 1 << 28 => unmerged *= 4,
            Err(error) => return Err(error),
        }
    }
    Ok(slabs)
}

struct Clock(Instant);

impl Clock {
    fn start() -> Clock {
        Clock(Instant::now())
    }

    /// Seconds since the last lap.
    fn lap(&mut self) -> f64 {
        let seconds = self.0.elapsed().as_secs_f64();
        self.0 = Instant::now();
        seconds
    }
}
