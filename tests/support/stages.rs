//! The kernel's stages from a mesh to its image in memory made beforehand, each cut into as many ranges as wanted.
//!
//! Nothing in [`run`] allocates, and each stage is given exactly the bytes that it asks for. What the owning layer
//! decides (rays of beams, end of the sweeps, brightest radiance) is decided here as it does, so that results agree
//! bit for bit.
#![allow(dead_code)]

use blik_kernel::Error;
use blik_kernel::arena::{Arena, Memory};
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{Camera, CameraInput};
use blik_kernel::chain::{KnownRows, Solved};
use blik_kernel::coupling::{Block, Coupling};
use blik_kernel::element::Elements;
use blik_kernel::image::{self, Tally, Target};
use blik_kernel::light::Light;
use blik_kernel::plane_sides::PlaneSides;
use blik_kernel::radiosity::solution::Solution;
use blik_kernel::scene::{Scene, SceneInput};
use blik_kernel::settings;
use blik_kernel::signature::{self, Sums, View};
use blik_kernel::simd::Isa;
use blik_kernel::sky::{SkyInput, SkyModel};
use blik_kernel::stages::{self, Beams, BlockPlace, CouplingRows, Executor, Lighting, Merge, Sizes};
use blik_kernel::subdivide::SubdivisionTree;
use blik_kernel::sun::SunInput;
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

/// Most ranges of a stage, and most blocks of its coupling.
const PARTS: usize = 8;
const BLOCKS: usize = 1024;
const CELLS: usize = 32;

/// All memory of a run.
pub struct Workspace {
    scene: Vec<u8>,
    bvh: Vec<u8>,
    elements: Vec<u8>,
    blocks: Memory,
    places: Vec<BlockPlace>,
    trees: Vec<u8>,
    planes: Vec<u8>,
    pub tables: Tables,
    pub view: Outputs,
}

/// Memory of a solution and of the stages that make it.
pub struct Tables {
    kept: Vec<u8>,
    scratch: Vec<u8>,
    beams: Vec<u8>,
    /// The bits of reference radiance, irradiances, sun and expected errors; as many as are in use.
    bits: Vec<u64>,
    used: usize,
}

/// Notes the bits of a solution; returns how many.
fn note(solution: &Solution<'_>, bits: &mut [u64]) -> usize {
    let Solution { reference, irradiance, sun, variance, .. } = solution;
    let wide = reference.iter().chain(*irradiance).chain(*sun).map(|x| x.to_bits());
    let all = wide.chain(variance.iter().map(|x| u64::from(x.to_bits())));
    bits.iter_mut().zip(all).map(|(to, from)| *to = from).count()
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
            blocks: Memory::new(PARTS * block),
            places: vec![BlockPlace::default(); BLOCKS],
            // what a table of planes takes at most
            planes: vec![0xa5; 10 << 20],
            // trees of quarters, at the tightest tolerance of these tests
            trees: vec![0xa5; SubdivisionTree::bytes(facets, 5e-4, 0).unwrap()],
            // solutions of small rooms: sixteen values of each unknown and band, and those of the images of the sun
            tables: Tables {
                kept: vec![0xa5; 64 * (8 * bands * unknowns + 2 * facets) + 65536],
                scratch: vec![0xa5; 256 * bands * unknowns + (4 << 20)],
                beams: vec![0xa5; PARTS * block],
                bits: vec![0; 8 * bands * unknowns],
                used: 0,
            },
            view: Outputs {
                scratch: vec![0xa5; 4 << 20],
                // rows of cells, and of facets that may show glints
                sums: vec![Sums::ZERO; CELLS + facets],
                pixels: image.clone(),
                terms: [image.clone(), image.clone(), image],
            },
        }
    }

    /// The bits of pixels and components.
    pub fn pixel_bits(&self) -> Vec<u32> {
        self.view.pixels.iter().chain(self.view.terms.iter().flatten()).map(|p| p.to_bits()).collect()
    }

    /// The bits of the solution.
    pub fn table_bits(&self) -> Vec<u64> {
        self.tables.bits[..self.tables.used].to_vec()
    }
}

/// Runs ranges one after the other, last to first.
struct Backward {
    parts: usize,
}

impl Executor for Backward {
    type Error = Error;

    fn lanes(&self) -> usize {
        self.parts
    }

    fn pieces<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        piece: usize,
        _share: f64,
        work: impl Fn(usize, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Error> {
        let mut all = R::default();
        for (number, part) in out.chunks_mut(piece).enumerate().rev() {
            all.merge(work(number, part)?);
        }
        Ok(all)
    }

    /// As many ranges as asked for, whatever their rows.
    fn rows<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        stride: usize,
        _share: f64,
        work: impl Fn(Range<usize>, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Error> {
        let (mut all, rows) = (R::default(), out.len() / stride.max(1));
        split(self.parts, rows, stride, out, |range, part| {
            all.merge(work(range, part)?);
            Ok(())
        })?;
        Ok(all)
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
    let plane_sides = PlaneSides::new(&scene, &bvh, !directional, &mut work.planes)?;
    let asked = settings::Settings { directional, ..settings::Settings::new(plan.tolerance, None)? };
    let mut cut = SubdivisionTree::new(&scene, &asked.budget, asked.clusters(&scene), &mut work.trees)?;
    let mut run = Backward { parts };
    counts.visibility += stages::refine(&scene, &bvh, &plane_sides, &asked, &mut cut, &mut run)?;
    let bytes = Elements::bytes(&cut)?;
    let elements = Elements::new(&scene, &cut, &mut work.elements[..bytes])?;
    counts.unknowns = elements.unknowns();
    let rows = asked.rows(&scene);
    let rows = CouplingRows {
        scene: &scene,
        bvh: &bvh,
        elements: &elements,
        plane_sides: &plane_sides,
        rows,
        kept: None,
    };
    let places = &mut work.places[..rows.places()];
    let (places, end) = rows.fill_in(work.blocks.bytes_mut(), places, false, &mut run)?;
    let mut blocks = [Block::EMPTY; BLOCKS];
    for (block, place) in blocks.iter_mut().zip(places) {
        *block = place.open(&work.blocks.bytes()[..end])?;
    }
    let coupling = Coupling::new(&blocks[..places.len()], counts.unknowns)?;
    counts.visibility += coupling.rays();
    for (_, row) in coupling.rows(0..counts.unknowns) {
        counts.records += row.targets.len() + row.escapes.map(|b| b.packed.len()).sum::<usize>();
    }

    let light = Light::new(sky, sun, scene.bands())?;
    let lighting = Lighting {
        scene: &scene,
        bvh: &bvh,
        elements: &elements,
        coupling: &coupling,
        light: &light,
        settings: &asked,
    };
    let Tables { kept, scratch, beams: beam_memory, bits, used } = &mut work.tables;
    let sizes = Sizes::new((&scene, &bvh), &elements, &light, &asked)?;
    let needed = sizes.solution.need().bytes()?;
    let mut memory = sizes.solution.take(&mut Arena::new(&mut kept[..needed], needed)?)?;
    let needed = sizes.scratch().bytes()?;
    let mut scratch = sizes.take_scratch(&mut Arena::new(&mut scratch[..needed], needed)?)?;
    counts.sun = lighting.direct(None, &mut memory, &mut scratch, &mut run)?;
    let mut beams = Beams::default();
    beams.add(&lighting, &mut memory, &mut scratch, beam_memory, &mut run)?;
    counts.beams = beams.rays;
    let solution = lighting.solve(memory, &mut scratch, counts.sun + counts.beams, &mut run)?;
    counts.sweeps = solution.numbers.sweeps as u32;
    let settings = asked.chains(coupling.rays());
    let rows = KnownRows::new(&coupling);
    let solved =
        Solved { scene: &scene, bvh: &bvh, elements: &elements, rows, light: &light, solution, settings };
    view(&solved, parts, camera, &mut work.view, &mut counts)?;
    *used = note(&solution, bits);
    Ok(counts)
}

/// Image and signature.
fn view(
    solved: &Solved<'_>,
    parts: usize,
    camera: &CameraInput,
    out: &mut Outputs,
    counts: &mut Counts,
) -> Result<(), Error> {
    let bands = solved.shape.bands;
    let camera = Camera::new(camera, solved.scene)?;
    let bytes = image::scratch_bytes(&camera, solved.scene, solved.elements)?;
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
        counts.image.add(&image::rows(solved, &camera, range, &mut target, scratch)?);
    }
    let view = View::new(solved, camera.forward(), CELLS)?;
    let rows = &mut out.sums[..view.rows()];
    let scratch = &mut out.scratch[..signature::scratch_bytes()?];
    split(parts, view.rows(), 1, rows, |range, out| signature::rows(solved, &view, range, scratch, out))?;
    let mut sums = Sums::ZERO;
    rows.iter().for_each(|row| sums.add(row));
    (counts.projected_area, counts.signature_rays) = (sums.area, sums.rays);
    counts.intensity.copy_from_slice(&sums.intensity[..4]);
    Ok(())
}
