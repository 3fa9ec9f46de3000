//! The owning layer over the kernel, for programs with a heap and threads: it asks each stage for its bytes,
//! hands the memory over and splits the rows over a thread pool of its own.
//!
//! The stages stay apart: [`Host::geometry`] once per mesh, [`Host::light`] for each light, [`Host::image`] and
//! [`Host::signature`] for each view. A new light traces no visibility rays, a new view solves nothing.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors and rounds).

mod lights;
mod report;
mod rounds;
mod run;
mod update;

pub use lights::{Explanation, LightReport, Wanted};
pub use report::*;
pub use rounds::Rounds;
use run::{Progress, Run};

use crate::base::arena::{Arena, Memory};
use crate::base::error::Error;
use crate::base::math::Vec3;
use crate::base::simd::Isa;
use crate::coupling::element::Elements;
use crate::coupling::plane_sides::PlaneSides;
use crate::coupling::subdivide::SubdivisionTree;
use crate::coupling::{Block, Coupling};
use crate::radiosity::direct::TableShape;
use crate::radiosity::solution::{Numbers, Solution, SolutionMemory, SolutionSize};
use crate::radiosity::straight::Straight;
use crate::radiosity::sun_image::SunImages;
use crate::rays::bvh::Bvh;
use crate::scene::light::{self, Light, LightInput};
use crate::scene::sky::SkyInput;
use crate::scene::sun::SunInput;
use crate::scene::{Scene, SceneInput};
use crate::settings;
use crate::stages::{self, Beams, BlockMemory, BlockPlace, CouplingRows, Executor, Lighting, Sizes};
use crate::view::camera::{Camera, CameraInput};
use crate::view::chain::{KnownRows, Solved};
use crate::view::facets;
use crate::view::image::{self, Tally, Target};
use crate::view::signature::{self, Signature, Sums, View};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::AtomicUsize;
use std::time::Instant;
use std::vec::Vec;

/// Settings of the caller.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The wanted error of the image, eq. 16, relative to the reference radiance: 1e-6 to 0.1.
    pub tolerance: f64,
    /// Wanted error of images, 1e-6 to 0.1; `None`: `tolerance`. If it is smaller than `tolerance`, the diffuse
    /// solution is computed to `tolerance` only, and final gathering at the points that an image shows removes the
    /// rest: faster for one or two precise images, slower for many. There is no final gathering where lobes or curved
    /// mirrors reflect sunlight onto facets; the error estimate tells.
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
    /// The most first rays of all rows of the coupling; `None`: by tolerance. Fewer leave a larger error, which the estimate
    /// tells.
    pub ray_budget: Option<u64>,
    /// The most bytes of the coupling's rows: rows have fewer rays where more would be needed, which leave a larger error.
    /// `None`: as many as there are. Where the least rows do not fit, either, [`Error::BufferTooSmall`].
    pub memory_budget: Option<usize>,
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
            ray_budget: None,
            memory_budget: None,
        }
    }
}

impl Settings {
    /// The stages' settings.
    fn checked(&self) -> Result<settings::Settings, Error> {
        let Settings { max_bounces, all_irradiances, directional, ray_budget, .. } = *self;
        let tolerances = settings::Settings::new(self.tolerance, self.image_tolerance)?;
        Ok(settings::Settings { max_bounces, all_irradiances, directional, ray_budget, ..tolerances })
    }
}

/// Most bytes of a lane's beams: a facet's rays, all of which meet other elements, need less by far.
const MOST_BEAM_BYTES: usize = 1 << 34;

/// Share of the pieces of an image that a finer round computes first, as its inverse: they tell whether the rest is worth
/// its time.
const LOOKS: usize = 6;

/// Fewest pixels of the object among those that tell of the rest.
const LOOKED: u64 = 64;

/// Threads on which all stages run.
#[derive(Debug)]
pub struct Host {
    pool: rayon::ThreadPool,
    isa: Isa,
    progress: Option<Progress>,
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
///
/// It borrows its memory:
///
/// ```no_run
/// # use blik_kernel::{host::{Geometry, GeometryMemory, Host, Settings}, scene::SceneInput};
/// # fn make(host: &Host, input: &SceneInput<'_>) {
/// let mut memory = GeometryMemory::default();
/// let geometry = host.geometry(&mut memory, input, &Settings::default()).unwrap();
/// geometry.report();
/// # }
/// ```
///
/// ```compile_fail,E0597
/// # use blik_kernel::{host::{Geometry, GeometryMemory, Host, Settings}, scene::SceneInput};
/// # fn make(host: &Host, input: &SceneInput<'_>) {
/// let geometry = {
///     let mut memory = GeometryMemory::default();
///     host.geometry(&mut memory, input, &Settings::default()).unwrap()
/// };
/// geometry.report();
/// # }
/// ```
#[derive(Debug)]
pub struct Geometry<'s> {
    scene: Scene<'s>,
    bvh: Bvh<'s>,
    elements: Elements<'s>,
    blocks: Vec<Block<'s>>,
    settings: settings::Settings,
    /// The caller's reference radiance.
    reference: Option<Vec<f64>>,
    /// As [`Settings::memory_budget`].
    memory_budget: Option<usize>,
    /// Rays of the coupling.
    rays: u64,
    report: Report,
}

/// A scene under one light, solved.
///
/// It borrows its geometry:
///
/// ```no_run
/// # use blik_kernel::{host::{Geometry, Host, Lit}, light::LightInput};
/// # fn make(host: &Host, geometry: Geometry<'_>, input: &LightInput<'_>) {
/// let lit = host.light_of(&geometry, input).unwrap();
/// lit.solved();
/// drop(geometry);
/// # }
/// ```
///
/// ```compile_fail,E0505
/// # use blik_kernel::{host::{Geometry, Host, Lit}, light::LightInput};
/// # fn make(host: &Host, geometry: Geometry<'_>, input: &LightInput<'_>) {
/// let lit = host.light_of(&geometry, input).unwrap();
/// drop(geometry);
/// lit.solved();
/// # }
/// ```
#[derive(Debug)]
pub struct Lit<'g> {
    geometry: &'g Geometry<'g>,
    light: Light<'g>,
    shape: TableShape,
    tables: Tables,
    numbers: Numbers,
    report: Report,
}

/// Memory of a solution.
#[derive(Debug)]
struct Tables {
    reference: Vec<f64>,
    irradiance: Vec<f64>,
    straight: Vec<f64>,
    straight_variance: Vec<f32>,
    sun: Vec<f64>,
    slots: Vec<u64>,
    reflected_irradiance: Vec<f64>,
    variance: Vec<f32>,
}

impl Tables {
    fn new(size: &SolutionSize) -> Tables {
        Tables {
            reference: std::vec![0.0; size.shape.bands],
            irradiance: std::vec![0.0; size.table()],
            straight: std::vec![0.0; size.straight().0],
            straight_variance: std::vec![0.0; size.straight().1],
            sun: std::vec![0.0; size.unknowns],
            slots: std::vec![0; size.places],
            reflected_irradiance: std::vec![0.0; size.reflected_irradiance()],
            variance: std::vec![0.0; size.unknowns],
        }
    }

    fn memory(&mut self) -> SolutionMemory<'_> {
        SolutionMemory {
            reference: &mut self.reference,
            irradiance: &mut self.irradiance,
            straight: &mut self.straight,
            straight_variance: &mut self.straight_variance,
            sun: &mut self.sun,
            slots: &mut self.slots,
            reflected_irradiance: &mut self.reflected_irradiance,
            variance: &mut self.variance,
        }
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
    /// Report: work that was done, error estimates and bounds.
    pub report: Report,
}

impl Host {
    /// A pool of `threads` threads; 0: as many as there are cores.
    ///
    /// # Errors
    /// [`Error::TooMany`] where the system gives no threads.
    pub fn new(threads: usize) -> Result<Host, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|_| Error::TooMany { what: "threads", limit: threads })?;
        Ok(Host { pool, isa: Isa::detect(), progress: None })
    }

    /// The same threads with a progress function: it is told the share, 0 to 1, that is done of a call of
    /// [`Host::geometry`], [`Host::light`] or [`Host::image`], by one thread at a time. False stops the call, which then
    /// returns [`Error::Cancelled`].
    #[must_use]
    pub fn with_progress(self, told: impl FnMut(f64) -> bool + Send + 'static) -> Host {
        Host { progress: Some(Progress::new(told)), ..self }
    }

    /// Scene, tree, elements and coupling of a mesh.
    pub fn geometry<'s>(
        &self,
        memory: &'s mut GeometryMemory,
        input: &SceneInput<'_>,
        settings: &Settings,
    ) -> Result<Geometry<'s>, Error> {
        let (reference, memory_budget) = (settings.reference_radiance.clone(), settings.memory_budget);
        let settings = settings.checked()?;
        if let Some(reference) = &reference {
            light::check_reference(reference, input.bands)?;
        }
        let mut report = Report { tolerance: settings.budget.image, bands: input.bands, ..Report::default() };
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
        let rows = settings.rows(&scene);
        let wanted = settings::planes(&scene, &rows);
        let mut planes = Memory::new(PlaneSides::bytes(&scene, wanted)?);
        let plane_sides = PlaneSides::new(&scene, &bvh, wanted, planes.bytes_mut())?;
        let clusters = settings.clusters(&scene);
        let mut trees =
            Memory::new(SubdivisionTree::bytes(scene.facets(), settings.budget.solution, clusters)?);
        let mut cut = SubdivisionTree::new(&scene, &settings.budget, clusters, trees.bytes_mut())?;
        let mut run = Run::new(self);
        report.rays.visibility += stages::refine(&scene, &bvh, &plane_sides, &settings, &mut cut, &mut run)?;
        *element_memory = Memory::new(Elements::bytes(&cut)?);
        let elements = Elements::new(&scene, &cut, element_memory.bytes_mut())?;
        report.elements = elements.count();
        let rows = settings.rows_within(&scene, elements.unknowns());
        let rows = CouplingRows {
            scene: &scene,
            bvh: &bvh,
            elements: &elements,
            plane_sides: &plane_sides,
            rows,
            kept: None,
        };
        let blocks = blocks(&rows, memory_budget, slabs, &mut run)?;
        let coupling = Coupling::new(&blocks, elements.unknowns())?;
        let rays = coupling.rays();
        report.rays.visibility += rays;
        report.rows.redone = elements.unknowns() as u64;
        report.count_rows(&coupling);
        report.count_scene(&scene, settings.directional, elements.unknowns());
        report.bytes.coupling = coupling.memory() + elements.memory();
        report.seconds.coupling = clock.lap();
        Ok(Geometry { scene, bvh, elements, blocks, settings, reference, memory_budget, rays, report })
    }

    /// The light of a scene, solved: no visibility is computed again.
    ///
    /// # Errors
    /// What [`Light::new`] refuses, radiances above 1e37 ([`crate::radiosity::limits::check_radiance`],
    /// [`crate::radiosity::limits::check_highlights`]), a system that diverges.
    pub fn light<'g>(
        &self,
        geometry: &'g Geometry<'g>,
        sky: Option<&SkyInput<'g>>,
        sun: Option<&SunInput<'g>>,
    ) -> Result<Lit<'g>, Error> {
        let (sky, sun) = (sky.copied(), sun.copied());
        self.light_of(geometry, &LightInput { sky, sun, ..LightInput::default() })
    }

    /// As [`Host::light`], of any light: sky, sun, an emission of each facet in place of the materials', and a reference
    /// radiance in place of that of [`Settings::reference_radiance`]. New temperatures are another emission: no ray is
    /// traced for them.
    ///
    /// # Errors
    /// Those of [`Host::light`], and what [`LightInput::light`] refuses.
    pub fn light_of<'g>(&self, geometry: &'g Geometry<'g>, input: &LightInput<'g>) -> Result<Lit<'g>, Error> {
        // within the pool at once: each stage of its own would wake and wait for it
        self.pool.install(|| self.light_within(geometry, input))
    }

    fn light_within<'g>(&self, geometry: &'g Geometry<'g>, input: &LightInput<'g>) -> Result<Lit<'g>, Error> {
        let Geometry { scene, bvh, elements, settings, .. } = geometry;
        let mut report = geometry.report.clone();
        let mut clock = Clock::start();
        let light = input.light(scene)?;
        let coupling = geometry.coupling()?;
        let lighting = Lighting { scene, bvh, elements, coupling: &coupling, light: &light, settings };
        let sizes = Sizes::new((scene, bvh), elements, &light, settings)?;
        let size = sizes.solution;
        let mut tables = Tables::new(&size);
        let mut scratch = Memory::new(sizes.scratch().bytes()?);
        let mut scratch = sizes.take_scratch(&mut Arena::new(scratch.bytes_mut(), 0)?)?;
        let (mut memory, mut run) = (tables.memory(), Run::new(self));
        let given = input.reference.or(geometry.reference.as_deref());
        let mut sun_rays = lighting.direct(given, &mut memory, &mut scratch, &mut run)?;
        let (mut beams, mut bytes) = (Beams::default(), sizes.beams(run.lanes()));
        while let Err(error) =
            beams.add(&lighting, &mut memory, &mut scratch, Memory::new(bytes).bytes_mut(), &mut run)
        {
            match error {
                Error::BufferTooSmall { needed, .. } if needed < MOST_BEAM_BYTES => bytes = needed,
                error => return Err(error),
            }
        }
        sun_rays += beams.rays;
        report.rays.sun += sun_rays;
        report.count_light(&light, size.unknowns);
        report.bytes.light = 8 * (size.table() + size.unknowns + size.places + size.reflected_irradiance());
        report.seconds.light = clock.lap();
        let numbers = lighting.solve(memory, &mut scratch, sun_rays, &mut run)?.numbers;
        report.sweeps = numbers.sweeps as u32;
        report.certified.solver = numbers.solver;
        report.reference_radiance = tables.reference.clone();
        report.reference_from = match (given, &light.sky, &light.sun) {
            (Some(_), ..) => "given",
            (None, None, None) => "what emission lights",
            _ => "sky and sun",
        };
        report.seconds.radiosity = clock.lap();
        Ok(Lit { geometry, light, shape: sizes.shape(), tables, numbers, report })
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
        let tally = self.paint(&solved, &camera, 1, &mut pixels, &mut terms)?;
        let mut report = lit.report.clone();
        report.bytes.image = 4 * (size + 3 * part);
        let (signature, rays) = self.signature(lit, camera.forward())?;
        report.signature = signature;
        report.rays.primary = tally.primary + rays;
        report.rays.chain += tally.chain;
        report.seconds.image = clock.lap();
        report.finish(&tally, columns * rows, &lit.geometry.settings.budget);
        Ok(Image { columns, rows, bands, pixels, components: components.then_some(terms), report })
    }

    /// The report of a part of an image, to tell what the image's would be; `None` where the image is small.
    pub fn look(&self, lit: &Lit<'_>, camera: &CameraInput) -> Result<Option<Report>, Error> {
        let camera = Camera::new(camera, &lit.geometry.scene)?;
        let (columns, rows, bands) = (camera.columns(), camera.rows(), lit.shape.bands);
        if rows < LOOKS * image::piece(rows) {
            return Ok(None);
        }
        let mut clock = Clock::start();
        let mut pixels = std::vec![0f32; rows * columns * bands];
        let tally = self.paint(&lit.solved(), &camera, LOOKS, &mut pixels, &mut [const { Vec::new() }; 3])?;
        let mut report = lit.report.clone();
        report.rays.primary = tally.primary;
        report.rays.chain += tally.chain;
        report.seconds.image = clock.lap();
        report.finish(&tally, columns * rows, &lit.geometry.settings.budget);
        // a few pixels of the object tell nothing
        Ok((tally.object_pixels >= LOOKED).then_some(report))
    }

    /// Computes every `step`th piece of an image's rows, in parallel.
    fn paint(
        &self,
        solved: &Solved<'_>,
        camera: &Camera,
        step: usize,
        pixels: &mut [f32],
        terms: &mut [Vec<f32>; 3],
    ) -> Result<Tally, Error> {
        let (rows, bands) = (camera.rows(), solved.shape.bands);
        let piece = image::piece(rows);
        let chunk = piece * camera.columns() * bands;
        let scratch = image::scratch_bytes(camera, solved.scene, solved.elements)?;
        let mut parts = terms.each_mut().map(|t| t.chunks_mut(chunk));
        let mut jobs = Vec::new();
        for (i, image) in pixels.chunks_mut(chunk).enumerate() {
            let components = parts.each_mut().map(|p| p.next().unwrap_or_default());
            if i % step == step / 2 {
                jobs.push((i * piece..((i + 1) * piece).min(rows), Target { image, components }));
            }
        }
        let (run, finished, parts) = (Run::new(self), AtomicUsize::new(0), jobs.len());
        let tallies = self.pool.install(|| {
            let paint = |memory: &mut Memory, (range, mut target): (Range<usize>, Target<'_>)| {
                let tally = image::rows(solved, camera, range, &mut target, memory.bytes_mut())?;
                run.tell(&finished, parts, 1.0)?;
                Ok::<_, Error>(tally)
            };
            let memory = || Memory::new(scratch);
            jobs.into_par_iter().map_init(memory, paint).collect::<Result<Vec<_>, _>>()
        })?;
        let mut tally = Tally::default();
        tallies.iter().for_each(|t| tally.add(t));
        Ok(tally)
    }

    /// Signature that a distant observer who looks along `forward` measures, and the rays that it took.
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

    /// Report of the work so far.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

impl Lit<'_> {
    /// The solved scene as the kernel's ray and image routines take it.
    pub fn solved(&self) -> Solved<'_> {
        let Geometry { scene, bvh, elements, settings, rays, .. } = self.geometry;
        let (light, solution, settings) = (&self.light, self.solution(), settings.chains(*rays));
        let rows = KnownRows::new(&self.geometry.coupling().unwrap_or(Coupling::part(&[])));
        Solved { scene, bvh, elements, rows, light, solution, settings }
    }

    /// The record of the solution.
    pub fn solution(&self) -> Solution<'_> {
        let Tables {
            reference,
            irradiance,
            straight,
            straight_variance,
            sun,
            slots,
            reflected_irradiance,
            variance,
        } = &self.tables;
        Solution {
            shape: self.shape,
            reference,
            irradiance,
            straight: Straight { values: straight, variance: straight_variance },
            sun,
            images: SunImages { slots, reflected_irradiance },
            variance,
            numbers: self.numbers,
        }
    }

    /// The cells of a signature along `forward`.
    fn view(&self, solved: &Solved<'_>, forward: Vec3) -> Result<View, Error> {
        View::new(solved, forward, settings::signature_cells(&self.geometry.settings.budget))
    }

    /// Signature by the sums over all cells along `forward`, and their rays.
    fn signature(&self, forward: Vec3, sums: &Sums) -> (SignatureReport, u64) {
        (signature_report(&self.light, self.reference(), forward, sums), sums.rays)
    }

    /// Reference radiance, one value per band.
    pub fn reference(&self) -> &[f64] {
        &self.tables.reference
    }

    /// Report of the work so far.
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
                facets::side(
                    &solved,
                    &coupling,
                    &self.tables.sun,
                    facet,
                    side,
                    &mut irradiance,
                    &mut radiance,
                );
                each(facet, side, scene.area(facet), &irradiance, &radiance);
            }
        }
    }
}

/// Signature by the sums over all cells along `forward`.
fn signature_report(light: &Light<'_>, reference: &[f64], forward: Vec3, sums: &Sums) -> SignatureReport {
    let bands = reference.len();
    let background = lights::background(light, forward, bands);
    let of = |band: usize| Signature::new(sums, band, reference[band], background[band]);
    SignatureReport {
        radiant_intensity: (0..bands).map(|b| of(b).intensity).collect(),
        projected_area: sums.area,
        mean_radiance: (0..bands).map(|b| of(b).mean_radiance).collect(),
        contrast: (0..bands).map(|b| of(b).contrast).collect(),
        error: (0..bands).map(|b| of(b).error).collect(),
        unresolved_glints: (0..bands).map(|b| of(b).unresolved).collect(),
    }
}

/// Computes all rows, in memory that `slabs` keeps: as much as they need, or within a budget.
fn blocks<'s>(
    rows: &CouplingRows<'_>,
    memory_budget: Option<usize>,
    slabs: &'s mut Vec<Memory>,
    run: &mut Run<'_>,
) -> Result<Vec<Block<'s>>, Error> {
    let Some(bytes) = memory_budget else {
        let mut pieces: Vec<Slabs> = (0..rows.pieces()).map(|_| Slabs::default()).collect();
        rows.fill(&mut pieces, run)?;
        *slabs = pieces.into_iter().flat_map(|piece| piece.blocks).collect();
        return slabs.iter().map(|s| Block::open(s.bytes())).collect();
    };
    let mut slab = Memory::new(bytes);
    let mut places = std::vec![BlockPlace::default(); rows.places()];
    let (places, end) = rows.fill_in(slab.bytes_mut(), &mut places, true, run)?;
    slab.truncate(end);
    *slabs = std::vec![slab];
    let memory = slabs.first().map_or(&[][..], Memory::bytes);
    places.iter().map(|place| place.open(memory)).collect()
}

/// Memory of one piece's blocks, each of its own.
#[derive(Debug, Default)]
struct Slabs {
    blocks: Vec<Memory>,
    kept: usize,
}

impl BlockMemory for Slabs {
    fn lend(&mut self, bytes: usize) -> Result<&mut [u8], Error> {
        self.blocks.truncate(self.kept);
        self.blocks.push(Memory::new(bytes));
        Ok(self.blocks.last_mut().map(Memory::bytes_mut).unwrap_or_default())
    }

    fn keep(&mut self, bytes: usize) {
        if let Some(last) = self.blocks.last_mut() {
            last.truncate(bytes);
        }
        self.kept = self.blocks.len();
    }
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
