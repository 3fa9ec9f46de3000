//! The kernel never allocates: the whole pipeline runs in memory that the caller hands over, exactly as much as each
//! stage asks for, and a stage that gets less says so and writes nothing.

#[path = "support/case.rs"]
mod case;
#[path = "support/stages.rs"]
mod stages;
mod support;

use blik_kernel::Error;
use blik_kernel::base::budget::ErrorBudget;
use blik_kernel::beam::{self, BeamSettings};
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{Camera, CameraInput, Sampling};
use blik_kernel::coupling::rows::{self, CouplingRows, RowSettings};
use blik_kernel::coupling::{Block, Coupling, row_builder};
use blik_kernel::element::Elements;
use blik_kernel::image::{self, Target};
use blik_kernel::light::{self, Light, TableShape};
use blik_kernel::plane_sides::PlaneSides;
use blik_kernel::radiosity::System;
use blik_kernel::radiosity::straight::Straight;
use blik_kernel::scene::Scene;
use blik_kernel::signature::{self, Sums, View};
use blik_kernel::simd::Isa;
use blik_kernel::sky::SkyModel;
use blik_kernel::subdivide::SubdivisionTree;
use case::{Case, SkyOf, SunOf, orthographic, within};
use stages::{Plan, Workspace};
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;
use support::scenes;
use support::twin::Material;

/// Counts what the thread takes from the heap.
struct Counter;

thread_local! {
    static TAKEN: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: hands every call on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counter {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        TAKEN.set(TAKEN.get() + 1);
        // SAFETY: the caller's promises are passed on.
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { Heap.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        TAKEN.set(TAKEN.get() + 1);
        // SAFETY: as above.
        unsafe { Heap.realloc(memory, layout, size) }
    }
}

#[global_allocator]
static COUNTER: Counter = Counter;

/// Heap calls of this thread while `work` runs.
fn taken<R>(work: impl FnOnce() -> R) -> (u64, R) {
    let before = TAKEN.get();
    let result = work();
    (TAKEN.get() - before, result)
}

/// Three bands; mirrors, a lobe, diffuse facets; sky and sun.
fn scene() -> Case {
    let glossy = Material { gloss: Some(8.0), ..Material::spectral(&[0.2, 0.3, 0.1], &[0.5, 0.4, 0.6]) };
    let materials = [
        Material::spectral(&[0.6, 0.5, 0.3], &[0.0; 3]),
        Material::spectral(&[0.1, 0.2, 0.0], &[0.7, 0.5, 0.9]),
        glossy.emitting(0.05),
    ];
    Case::new(scenes::corner(2), &materials)
        .sky(SkyOf::new(SkyModel::Overcast, &[1.0, 0.8, 0.6], &[0.2, 0.3, 0.4]))
        .sun(SunOf::new([0.5, 0.7, 0.9], &[2.0, 1.5, 1.0], 0.5))
}

const PIXELS: usize = 17;

fn camera() -> CameraInput {
    let camera = orthographic([3.0, 2.0, 2.5], [0.4, 0.45, 0.3], 2.0, PIXELS);
    CameraInput { sampling: Sampling::Area, ..camera }
}

#[test]
fn the_counter_counts() {
    assert_eq!(taken(|| std::hint::black_box(vec![1u8; 10]).len()), (1, 10));
    assert_eq!(taken(|| 1).0, 0);
}

#[test]
fn the_whole_pipeline_allocates_nothing() {
    let case = scene();
    let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(SunOf::input));
    let mut work = Workspace::new(case.mesh.facets.len(), 8192, 3, PIXELS * PIXELS, 1 << 23);
    case.with_input(|input| {
        for (parts, isa) in [(1, Isa::BASELINE), (3, Isa::detect())] {
            let plan = Plan { parts, isa, obvhs: false, tolerance: 2e-2 };
            let (calls, counts) =
                taken(|| stages::run(&mut work, input, sky.as_ref(), sun.as_ref(), &camera(), &plan));
            let counts = counts.unwrap();
            assert!(counts.records > 1000 && counts.sun > 0 && counts.beams > 0 && counts.image.refined > 0);
            assert_eq!(calls, 0, "{parts} parts");
        }
    });
    // and it did the work: the owning layer, which does allocate, gives the same
    let host = case.run(1, &within(2e-2), &camera());
    assert_eq!(host.pixel_bits(), work.pixel_bits());
}

/// Runs `work` on one byte less than `needed`, of a known content, and finds it refused and untouched.
fn short(what: &str, needed: usize, work: impl FnOnce(&mut [u8]) -> Option<Error>) {
    let mut memory = vec![0xa5; needed - 1];
    let error = work(&mut memory);
    assert_eq!(error, Some(Error::BufferTooSmall { needed, given: needed - 1 }), "{what}");
    assert!(memory.iter().all(|&b| b == 0xa5), "{what}: nothing is written");
}

/// Runs `work` on a slice one entry too short and on one too long: refused by its length, and untouched.
fn wrong<T: Copy + PartialEq>(
    what: &str,
    expected: usize,
    mark: T,
    mut work: impl FnMut(&mut [T]) -> Option<Error>,
) {
    for given in [expected - 1, expected + 1] {
        let mut out = vec![mark; given];
        match work(&mut out) {
            Some(Error::Length { expected: e, given: g, .. }) => {
                assert_eq!((e, g), (expected, given), "{what}")
            }
            other => panic!("{what}: {other:?}"),
        }
        assert!(out.iter().all(|&x| x == mark), "{what}: nothing is written");
    }
}

#[test]
fn scene_tree_and_elements_refuse_one_byte_less() {
    scene().with_input(|input| {
        let bytes = Scene::bytes(input).unwrap();
        short("scene", bytes, |memory| Scene::new(input, memory).err());
        let mut memory = vec![0; bytes];
        let scene = Scene::new(input, &mut memory).unwrap();
        let facets = scene.facets();
        let bytes = Bvh::bytes(facets).unwrap();
        let (corners, areas) = (scene.corners(), scene.areas());
        short("tree", bytes, |memory| Bvh::build(corners, areas, Isa::BASELINE, memory).err());
        short("tree", bytes, |memory| Bvh::build_obvhs(corners, areas, Isa::BASELINE, memory).err());
        let mut memory = vec![0; bytes];
        let bvh = Bvh::build(corners, areas, Isa::BASELINE, &mut memory).unwrap();
        let bytes = PlaneSides::bytes(&scene, true).unwrap();
        short("planes", bytes, |memory| PlaneSides::new(&scene, &bvh, true, memory).err());
        short("trees", SubdivisionTree::bytes(facets, 1e-2, 0).unwrap(), |memory| {
            SubdivisionTree::new(&scene, &ErrorBudget::new(1e-2, 1e-2), 0, memory).err()
        });
        let mut trees = vec![0; SubdivisionTree::bytes(facets, 1e-2, 0).unwrap()];
        let mut cut = SubdivisionTree::new(&scene, &ErrorBudget::new(1e-2, 1e-2), 0, &mut trees).unwrap();
        let (work, _) = cut.newest_level();
        wrong("unevenness", facets, f64::MAX, |out| {
            work.probe(&scene, &bvh, &PlaneSides::NONE, (16, &ErrorBudget::new(1e-2, 1e-2)), 0..facets, out)
                .err()
        });
        let bytes = Elements::bytes(&cut).unwrap();
        short("elements", bytes, |memory| Elements::new(&scene, &cut, memory).err());
    });
}

/// A solved scene in memory of the test, for the stages that come after the coupling.
fn with_stages(check: impl FnOnce(&System<'_>, &Bvh<'_>, &RowSettings)) {
    let case = scene();
    case.with_geometry(1, &within(5e-2), |_, geometry| {
        let (scene, elements, coupling) =
            (geometry.scene(), geometry.elements(), geometry.coupling().unwrap());
        let (sky, sun) = (case.sky.as_ref().unwrap().input(), case.sun.as_ref().unwrap().input());
        let light = Light::new(Some(&sky), Some(&sun), 3).unwrap();
        let shape = TableShape { levels: 1, bands: 3 };
        let direct = vec![0.5; elements.unknowns() * shape.stride()];
        let lit = vec![0.5; elements.unknowns()];
        let (light, direct, sun) = (&light, &direct[..], &lit[..]);
        let straight = Straight::default();
        let system = System { scene, elements, coupling: &coupling, light, direct, sun, straight, shape };
        let rows = RowSettings::new(scene, &ErrorBudget::new(5e-2, 5e-2), None, true, false);
        check(&system, geometry.bvh(), &rows);
    });
}

/// Fills a block of memory with rows and says how many they are.
type Fill<'a> = dyn FnMut(&mut [u8]) -> Result<usize, Error> + 'a;

#[test]
fn coupling_and_beams_refuse_memory_that_holds_no_row() {
    with_stages(|system, bvh, settings| {
        let (scene, elements, n) = (system.scene, system.elements, system.elements.unknowns());
        let beams = BeamSettings::new(scene, system.light.sun.as_ref().unwrap(), 1000.0, 1e-3, 10);
        let mut fills: [Box<Fill<'_>>; 2] = [
            Box::new(|memory| {
                let plane_sides = &PlaneSides::NONE;
                let of = CouplingRows { scene, bvh, elements, plane_sides, rows: *settings, kept: None };
                rows::fill(&of, 0..n, memory)
            }),
            Box::new(|memory| {
                let (sun, facets) = (system.light.sun.as_ref().unwrap(), scene.facets());
                beam::fill(scene, bvh, elements, sun, &beams, 0..facets, memory)
            }),
        ];
        for fill in &mut fills {
            // below the head and 64 records nothing is written
            for bytes in [0, 1, 1000] {
                let mut memory = vec![0xa5; bytes];
                let error = fill(&mut memory).unwrap_err();
                assert!(
                    matches!(error, Error::BufferTooSmall { needed, given } if given == bytes && needed > given)
                );
                assert!(memory.iter().all(|&b| b == 0xa5), "nothing is written");
            }
        }
        // memory for some rows takes those, and says how many; the rest goes to the next block
        let mut memory = vec![0xa5; row_builder::bytes(n, 16, 4 * settings.rays as usize, 3).unwrap()];
        let done = fills[0](&mut memory).unwrap();
        assert!(done > 0 && done < n, "{done} of {n} rows");
        let block = Block::open(&memory).unwrap();
        assert_eq!(block.range(), 0..done);
        assert_eq!(Coupling::new(&[block], n).unwrap_err(), Error::Mismatch { what: "coupling block" });
        assert!(Block::open(&memory[..100]).is_err());
    });
}

#[test]
fn light_solution_image_and_signature_refuse_tables_of_the_wrong_size() {
    with_stages(|system, bvh, _| {
        let System { scene, elements, coupling, light, straight, shape, .. } = *system;
        let n = elements.unknowns();
        let (sky, sun) = (light.sky.as_ref().unwrap(), light.sun.as_ref().unwrap());
        let table = n * shape.stride();
        wrong("sky", table, f64::MAX, |out| {
            light::sky_rows(scene, elements, coupling, (sky, &straight), 1e-3, 0..n, shape, out).err()
        });
        wrong("sun", n, f64::MAX, |out| {
            light::sun_rows(scene, bvh, elements, coupling, sun, 0..n, out).err()
        });
        let radiance = vec![0.5; n * shape.bands];
        wrong("irradiance", table, f64::MAX, |out| system.gather(0..n, 0, |_| &radiance, out).err());

        let case = self::scene();
        case.with_lit(1, &within(5e-2), |_, lit| {
            let solved = lit.solved();
            let camera = Camera::new(&camera(), solved.scene).unwrap();
            let bytes = image::scratch_bytes(&camera, solved.scene, solved.elements).unwrap();
            let size = PIXELS * PIXELS * 3;
            let mut scratch = vec![0; bytes];
            wrong("image", size, 7.5f32, |out| {
                let mut target = Target { image: out, components: [&mut [], &mut [], &mut []] };
                image::rows(&solved, &camera, 0..PIXELS, &mut target, &mut scratch).err()
            });
            let mut pixels = vec![7.5f32; size];
            wrong("component", size, 7.5f32, |out| {
                let mut target = Target { image: &mut pixels, components: [&mut [], out, &mut []] };
                image::rows(&solved, &camera, 0..PIXELS, &mut target, &mut scratch).err()
            });
            short("scratch", bytes, |memory| {
                let mut target = Target { image: &mut pixels, components: [&mut [], &mut [], &mut []] };
                image::rows(&solved, &camera, 0..PIXELS, &mut target, memory).err()
            });
            let mut target = Target { image: &mut pixels, components: [&mut [], &mut [], &mut []] };
            let beyond = image::rows(&solved, &camera, 1..PIXELS + 1, &mut target, &mut scratch);
            assert!(matches!(beyond, Err(Error::Range { .. })), "a row that the image does not have");
            assert!(pixels.iter().all(|&p| p == 7.5), "no pixel is written");
            let view = View::new(&solved, camera.forward(), 8).unwrap();
            let mut scratch = vec![0; signature::scratch_bytes().unwrap()];
            for given in [7, 9] {
                let mut sums = vec![Sums { area: -1.0, ..Sums::ZERO }; given];
                let refused = signature::rows(&solved, &view, 0..8, &mut scratch, &mut sums);
                assert!(matches!(refused, Err(Error::Length { expected: 8, .. })), "{refused:?}");
                assert!(sums.iter().all(|s| s.area == -1.0), "nothing is written");
            }
        });
    });
}
