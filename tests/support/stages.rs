//! The kernel's stages from a mesh to its image in memory made beforehand, each cut into as many ranges as wanted.
//!
//! Nothing in [`run`] allocates, and each stage is given exactly the bytes that it asks for. What the owning layer
//! decides (rays of beams, end of the sweeps, brightest radiance) is decided here as it does, so that results agree
//! bit for bit.
#![allow(dead_code)]

use blik_kernel::Error;
use blik_kernel::accuracy::{self, Own};
use blik_kernel::beam::{self, BeamSettings};
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{Camera, CameraInput};
use blik_kernel::chain::Solved;
use blik_kernel::coupling::rows::{self, RowSettings};
use blik_kernel::coupling::{Block, Coupling};
use blik_kernel::element::Elements;
use blik_kernel::facing::Facing;
use blik_kernel::image::{self, Tally, Target};
use blik_kernel::light::{self, Light, Shape};
use blik_kernel::policy;
use blik_kernel::radiosity::{System, bound, sweeps};
use blik_kernel::scene::{MAX_BANDS, Scene, SceneInput};
use blik_kernel::signature::{self, Sums, View};
use blik_kernel::simd::Isa;
use blik_kernel::sky::{Sky, SkyInput, SkyModel};
use blik_kernel::subdivide::Cut;
use blik_kernel::sun::{Sun, SunInput};
use blik_kernel::sun_image::{self, Noting, SunImages};
use std::ops::Range;

/// How a run is carried out; what it computes does not depend on it, but for the tolerance.
#[derive(Clone, Copy)]
pub struct Plan {
    /// Ranges that each stage is cut into, 1 to 8, carried out last to first.
    pub parts: usize,
    pub isa: Isa,
    /// Builds the tree with obvhs instead of the kernel's own builder.
    pub obvhs: bool,
    pub tolerance: f64,
}

/// What was counted, besides the results in the workspace.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    pub unknowns: usize,
    pub visibility: u64,
    pub sun: u64,
    pub beams: u64,
    pub records: usize,
    pub sweeps: u32,
    pub image: Tally,
    pub signature_rays: u64,
    pub projected_area: f64,
    pub intensity: [f64; 4],
}

/// Most ranges of a stage.
const PARTS: usize = 8;
const CELLS: usize = 32;

/// All memory of a run.
pub struct Workspace {
    scene: Vec<u8>,
    bvh: Vec<u8>,
    elements: Vec<u8>,
    blocks: Vec<Vec<u8>>,
    beams: Vec<Vec<u8>>,
    trees: Vec<u8>,
    planes: Vec<u8>,
    pub tables: Tables,
    pub view: Outputs,
}

/// What light and solution write.
pub struct Tables {
    direct: Vec<f64>,
    next: Vec<f64>,
    variance: Vec<f32>,
    differences: Vec<Own>,
    carried: [Vec<f32>; 2],
    /// Mean of cos V of the sun for each unknown.
    pub sun: Vec<f64>,
    /// Diffuse radiance of each unknown, each band.
    pub radiance: Vec<f64>,
    /// Mean and gradients of each unknown's irradiance, each band.
    pub irradiance: Vec<f64>,
    /// Images of the sun, and what they throw; how much of both is in use.
    slots: Vec<u64>,
    thrown: Vec<f64>,
    images: (usize, usize),
}

impl Tables {
    fn images(&self) -> SunImages<'_> {
        SunImages { slots: &self.slots[..self.images.0], thrown: &self.thrown[..self.images.1] }
    }
}

/// What a view writes.
pub struct Outputs {
    scratch: Vec<u8>,
    sums: Vec<Sums>,
    pub pixels: Vec<f32>,
    pub terms: [Vec<f32>; 3],
}

impl Workspace {
    /// Memory for `facets` facets cut into up to `unknowns` unknowns, `block` bytes of coupling a part.
    pub fn new(facets: usize, unknowns: usize, bands: usize, pixels: usize, block: usize) -> Workspace {
        let image = vec![f32::NAN; pixels * bands];
        Workspace {
            scene: vec![0xa5; facets * 512 + 8192],
            bvh: vec![0xa5; Bvh::bytes(facets).unwrap()],
            elements: vec![0xa5; 4 * (unknowns + 4 * facets) + 1024],
            blocks: vec![vec![0xa5; block]; PARTS],
            beams: vec![vec![0xa5; block]; PARTS],
            // what a table of planes takes at most
            planes: vec![0xa5; 10 << 20],
            // trees of quarters, at the tightest tolerance of these tests
            trees: vec![0xa5; Cut::bytes(facets, 5e-4).unwrap()],
            tables: Tables {
                direct: vec![f64::NAN; 3 * bands * unknowns],
                next: vec![f64::NAN; bands * unknowns],
                variance: vec![f32::NAN; unknowns],
                differences: vec![[f32::NAN; 2]; bands * unknowns],
                carried: [(); 2].map(|()| vec![f32::NAN; bands * unknowns]),
                sun: vec![f64::NAN; unknowns],
                radiance: vec![f64::NAN; bands * unknowns],
                irradiance: vec![f64::NAN; 3 * bands * unknowns],
                slots: vec![u64::MAX; sun_image::places(2 * facets)],
                thrown: vec![f64::NAN; bands * unknowns],
                images: (0, 0),
            },
            view: Outputs {
                scratch: vec![0xa5; 1 << 20],
                sums: vec![Sums::ZERO; CELLS],
                pixels: image.clone(),
                terms: [image.clone(), image.clone(), image],
            },
        }
    }

    /// The bits of pixels and components.
    pub fn pixel_bits(&self) -> Vec<u32> {
        self.view.pixels.iter().chain(self.view.terms.iter().flatten()).map(|p| p.to_bits()).collect()
    }

    /// The bits of the first `unknowns` unknowns' irradiances, radiances and sun.
    pub fn table_bits(&self, unknowns: usize, bands: usize) -> Vec<u64> {
        let Tables { irradiance, radiance, sun, .. } = &self.tables;
        let parts = [&irradiance[..3 * bands * unknowns], &radiance[..bands * unknowns], &sun[..unknowns]];
        parts.iter().flat_map(|p| p.iter()).map(|x| x.to_bits()).collect()
    }
}

/// Calls `work` for each of `parts` ranges of `rows` rows, last to first, with its part of `out` (`stride` values a
/// row).
fn split<T>(
    parts: usize,
    rows: usize,
    stride: usize,
    mut out: &mut [T],
    mut work: impl FnMut(Range<usize>, &mut [T]) -> Result<(), Error>,
) -> Result<(), Error> {
    for part in (0..parts).rev() {
        let range = part * rows / parts..(part + 1) * rows / parts;
        let (before, own) = out.split_at_mut(range.start * stride);
        work(range, own)?;
        out = before;
    }
    Ok(())
}

/// Fills one block per range and opens them; ranges must fit into their blocks.
fn fill_blocks<'m>(
    parts: usize,
    count: usize,
    memory: &'m mut [Vec<u8>],
    mut fill: impl FnMut(Range<usize>, &mut [u8]) -> Result<usize, Error>,
) -> Result<[Block<'m>; PARTS], Error> {
    split(parts, parts, 1, &mut memory[..parts], |part, block| {
        let range = part.start * count / parts..(part.start + 1) * count / parts;
        let wanted = range.len();
        assert_eq!(fill(range, &mut block[0])?, wanted, "the blocks of the workspace are large enough");
        Ok(())
    })?;
    let memory = &*memory;
    let mut blocks = [Block::open(&memory[0])?; PARTS];
    for (block, memory) in blocks.iter_mut().zip(&memory[..parts]) {
        *block = Block::open(memory)?;
    }
    Ok(blocks)
}

/// From the mesh to image and signature; results are left in the workspace.
pub fn run(
    work: &mut Workspace,
    input: &SceneInput<'_>,
    sky: Option<&SkyInput<'_>>,
    sun: Option<&SunInput<'_>>,
    camera: &CameraInput,
    plan: &Plan,
) -> Result<Counts, Error> {
    let mut counts = Counts::default();
    let parts = plan.parts;
    let bytes = Scene::bytes(input)?;
    let scene = Scene::new(input, &mut work.scene[..bytes])?;
    let bytes = Bvh::bytes(scene.facets())?;
    let build = if plan.obvhs { Bvh::build_obvhs } else { Bvh::build };
    let bvh = build(scene.corners(), scene.areas(), plan.isa, &mut work.bvh[..bytes])?;

    // uniform skies need no directions: what nothing hides is in closed form then
    let directional = !sky.is_some_and(|sky| matches!(sky.model, SkyModel::Uniform));
    let facing = Facing::new(&scene, &bvh, !directional, &mut work.planes)?;
    let settings = RowSettings::new(&scene, plan.tolerance, None, directional, false);
    let probing = policy::probing(&settings);
    let mut cut = Cut::new(&scene, plan.tolerance, &mut work.trees)?;
    loop {
        let (fresh, unevenness) = cut.work();
        split(parts, fresh.len(), 1, unevenness, |range, out| {
            counts.visibility += fresh.probe(&scene, &bvh, &facing, (probing, plan.tolerance), range, out)?;
            Ok(())
        })?;
        if !cut.refine(&scene) {
            break;
        }
    }
    let bytes = Elements::bytes(&cut)?;
    let elements = Elements::new(&scene, &cut, &mut work.elements[..bytes])?;
    counts.unknowns = elements.unknowns();
    let blocks = fill_blocks(parts, counts.unknowns, &mut work.blocks, |range, memory| {
        rows::fill(&scene, &bvh, &elements, &facing, &settings, range, memory)
    })?;
    let coupling = Coupling::new(&blocks[..parts], counts.unknowns)?;
    counts.visibility += coupling.rays();
    for (_, row) in coupling.rows(0..counts.unknowns) {
        counts.records += row.targets.len() + row.escapes.map(|b| b.packed.len()).sum::<usize>();
    }

    let light = Light {
        sky: sky.map(|s| Sky::new(s, scene.bands())).transpose()?,
        sun: sun.map(|s| Sun::new(s, scene.bands())).transpose()?,
    };
    let shape = Shape { levels: 1, bands: scene.bands() };
    let mut reference = [0.0; MAX_BANDS];
    light.reference_radiance(&scene, &mut reference[..shape.bands]);
    let reference = &reference[..shape.bands];
    let stage = Stage {
        scene: &scene,
        bvh: &bvh,
        elements: &elements,
        coupling: &coupling,
        light: &light,
        shape,
        reference,
        plan,
    };
    stage.shine(&mut work.tables, &mut work.beams, &mut counts)?;
    let brightest = stage.solve(&mut work.tables, &mut counts)?;
    stage.view(&work.tables, brightest, camera, &mut work.view, &mut counts)?;
    Ok(counts)
}

/// What the later stages share.
struct Stage<'a> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    elements: &'a Elements<'a>,
    coupling: &'a Coupling<'a>,
    light: &'a Light<'a>,
    shape: Shape,
    reference: &'a [f64],
    plan: &'a Plan,
}

impl Stage<'_> {
    /// Direct light.
    fn shine(&self, tables: &mut Tables, beams: &mut [Vec<u8>], counts: &mut Counts) -> Result<(), Error> {
        let (parts, stride, tolerance) = (self.plan.parts, self.shape.stride(), self.plan.tolerance);
        let (scene, bvh, elements) = (self.scene, self.bvh, self.elements);
        let direct = &mut tables.direct[..counts.unknowns * stride];
        direct.fill(0.0);
        if let Some(sky) = &self.light.sky {
            split(parts, counts.unknowns, stride, direct, |range, out| {
                light::sky_rows(scene, elements, self.coupling, sky, 0.05 * tolerance, range, self.shape, out)
            })?;
        }
        let lit = &mut tables.sun[..counts.unknowns];
        lit.fill(0.0);
        tables.images = (0, 0);
        let Some(sun) = &self.light.sun else { return Ok(()) };
        split(parts, counts.unknowns, 1, lit, |range, out| {
            counts.sun += light::sun_rows(scene, bvh, elements, self.coupling, sun, range, out)?;
            Ok(())
        })?;
        let settings =
            BeamSettings::new(scene, sun, (100.0 / tolerance).clamp(32768.0, 1e8), 1e-3 * tolerance, 1000);
        let mirrors = scene.facets() * scene.sides();
        let blocks = fill_blocks(parts, mirrors, beams, |range, memory| {
            beam::fill(scene, bvh, elements, sun, &settings, range, memory)
        })?;
        let thrown = Coupling::new(&blocks[..parts], mirrors)?;
        tables.images = (sun_image::places(mirrors), counts.unknowns * self.shape.bands);
        let (slots, means) = (&mut tables.slots[..tables.images.0], &mut tables.thrown[..tables.images.1]);
        slots.fill(0);
        means.fill(0.0);
        let mut noting = Noting { slots, thrown: means };
        beam::add(&thrown, (self.coupling, elements), sun, self.shape, direct, &mut noting);
        counts.beams = thrown.rows(0..mirrors).map(|(_, r)| r.row.all_rays()).sum();
        Ok(())
    }

    /// Radiances and irradiances; returns the largest radiance that a ray can see over the reference.
    fn solve(&self, tables: &mut Tables, counts: &mut Counts) -> Result<f64, Error> {
        let (parts, bands, unknowns) = (self.plan.parts, self.shape.bands, counts.unknowns);
        let (rows, stride) = (unknowns * bands, self.shape.stride());
        let Tables { direct, sun, radiance, next, irradiance, slots, thrown, images, .. } = &mut *tables;
        let (direct, irradiance) = (&mut direct[..unknowns * stride], &mut irradiance[..unknowns * stride]);
        let system = self.system(direct, &sun[..unknowns]);
        split(parts, unknowns, bands, &mut radiance[..rows], |range, out| {
            system.start(range, out);
            Ok(())
        })?;
        self.sweeps(
            direct,
            &sun[..unknowns],
            [&mut radiance[..rows], &mut next[..rows]],
            irradiance,
            counts,
        )?;
        let missed = &mut next[..rows];
        let system = self.system(direct, &sun[..unknowns]);
        split(parts, unknowns, bands, missed, |range, out| {
            system.slopes(range, irradiance, out);
            Ok(())
        })?;
        light::add(missed, self.shape, direct);
        self.sweeps(
            direct,
            &sun[..unknowns],
            [&mut radiance[..rows], &mut next[..rows]],
            irradiance,
            counts,
        )?;
        let images = SunImages { slots: &slots[..images.0], thrown: &thrown[..images.1] };
        let side_of = |unknown| self.elements.facet_side(unknown);
        images.take_off(self.shape, self.elements.facet_sides(), side_of, irradiance);
        self.system(direct, &sun[..unknowns]).extend(irradiance);
        let brightest = policy::brightest(self.scene, self.light, self.reference, &radiance[..rows]);
        self.errors(tables, unknowns)?;
        Ok(brightest)
    }

    /// The expected squared error of each unknown.
    fn errors(&self, tables: &mut Tables, unknowns: usize) -> Result<(), Error> {
        let (parts, bands, rows) = (self.plan.parts, self.shape.bands, unknowns * self.shape.bands);
        let Tables { direct, sun, radiance, variance, differences, carried: [from, to], .. } = tables;
        let system = self.system(&direct[..unknowns * self.shape.stride()], &sun[..unknowns]);
        let own = &mut differences[..rows];
        split(parts, unknowns, bands, own, |range, out| {
            accuracy::differences(&system, &radiance[..rows], self.reference, range, out)
        })?;
        let (mut from, mut to) = (&mut from[..rows], &mut to[..rows]);
        for number in 0..accuracy::carried(self.scene) {
            let known = if number > 0 { &from[..] } else { &[] };
            split(parts, unknowns, bands, to, |range, out| accuracy::carry(&system, own, known, range, out))?;
            std::mem::swap(&mut from, &mut to);
        }
        split(parts, unknowns, 1, &mut variance[..unknowns], |range, out| {
            accuracy::rows(&system, own, from, range, out)
        })
    }

    fn system<'b>(&'b self, direct: &'b [f64], sun: &'b [f64]) -> System<'b> {
        System {
            scene: self.scene,
            elements: self.elements,
            coupling: self.coupling,
            light: self.light,
            direct,
            sun,
            shape: self.shape,
        }
    }

    /// Sweeps to the end from what the first of both tables holds, and gathers; the radiances stand there then.
    fn sweeps(
        &self,
        direct: &[f64],
        sun: &[f64],
        [mut from, mut to]: [&mut [f64]; 2],
        irradiance: &mut [f64],
        counts: &mut Counts,
    ) -> Result<(), Error> {
        let (parts, bands, unknowns) = (self.plan.parts, self.shape.bands, counts.unknowns);
        let system = self.system(direct, sun);
        let q = system.contraction(0..unknowns);
        let goal = 1e-3 * self.plan.tolerance;
        let most = sweeps(q, goal) + 200;
        let (mut error, mut done) = (f64::INFINITY, 0);
        while error > goal && done < most {
            let mut change: f64 = 0.0;
            split(parts, unknowns, bands, to, |range, out| {
                change = change.max(system.sweep(range, from, out, self.reference));
                Ok(())
            })?;
            std::mem::swap(&mut from, &mut to);
            done += 1;
            error = bound(change, q);
        }
        counts.sweeps += done;
        to.copy_from_slice(from);
        split(parts, unknowns, self.shape.stride(), irradiance, |range, out| {
            system.gather(range, 0, |_| from, out)
        })
    }

    /// Image and signature.
    fn view(
        &self,
        tables: &Tables,
        brightest: f64,
        camera: &CameraInput,
        out: &mut Outputs,
        counts: &mut Counts,
    ) -> Result<(), Error> {
        let (parts, bands, tolerance) = (self.plan.parts, self.shape.bands, self.plan.tolerance);
        let solved = Solved {
            scene: self.scene,
            bvh: self.bvh,
            elements: self.elements,
            light: self.light,
            irradiance: &tables.irradiance[..counts.unknowns * self.shape.stride()],
            images: tables.images(),
            shape: self.shape,
            variance: &tables.variance[..counts.unknowns],
            reference: self.reference,
            brightest,
            settings: policy::chains((tolerance, tolerance), None, self.coupling.rays()),
        };
        let camera = Camera::new(camera, self.scene)?;
        let bytes = image::scratch_bytes(&camera, bands)?;
        let scratch = &mut out.scratch[..bytes];
        let stride = camera.columns() * bands;
        let [first, second, third] = &mut out.terms;
        let mut rest = [&mut out.pixels[..], first, second, third];
        for part in (0..parts).rev() {
            let range = part * camera.rows() / parts..(part + 1) * camera.rows() / parts;
            let [image, a, b, c] = rest.map(|all| {
                let (before, own) = all.split_at_mut(range.start * stride);
                (before, own)
            });
            rest = [image.0, a.0, b.0, c.0];
            let mut target = Target { image: image.1, components: [a.1, b.1, c.1] };
            counts.image.add(&image::rows(&solved, &camera, range, &mut target, scratch)?);
        }
        let view = View::new(&solved, camera.forward(), out.sums.len())?;
        let scratch = &mut out.scratch[..signature::scratch_bytes()?];
        split(parts, view.rows(), 1, &mut out.sums, |range, out| {
            signature::rows(&solved, &view, range, scratch, out)
        })?;
        let mut sums = Sums::ZERO;
        out.sums.iter().for_each(|row| sums.add(row));
        (counts.projected_area, counts.signature_rays) = (sums.area, sums.rays);
        counts.intensity.copy_from_slice(&sums.intensity[..4]);
        Ok(())
    }
}
