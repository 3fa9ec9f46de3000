//! The plane model through the C interface: the owning layer's results bit for bit, in the caller's memory and in its
//! own, on one lane and on several; refused calls name what is wrong and write nothing.

use blik::*;
use blik_kernel::plane::Vec2;
use blik_kernel::plane::host::{self, Settings};
use blik_kernel::plane::image::Seen;
use blik_kernel::plane::light::{Capture, Light, PlaneSun, Sky};
use blik_kernel::plane::rows::Method;
use blik_kernel::plane::scene::{Basis, BodyInput, PlaneGloss, PlaneInput, PlaneMaterial, RaySet, Shape};
use std::ffi::c_void;
use std::ptr::{null, null_mut};

const SAMPLES: usize = 97;
const ANGLE: f64 = 0.3;

/// A wedge between two circles, counter-clockwise.
static WEDGE: [[f64; 2]; 4] = [[-0.5, -1.5], [0.6, -1.4], [0.3, -0.9], [-0.4, -0.8]];
static JUMPS: [[f64; 2]; 2] = [[1.0, 0.0], [-1.0, 0.2]];

fn brightness(d: Vec2) -> f64 {
    if d.y > 0.0 { 1.0 + 0.5 * d.x } else { 0.2 }
}

unsafe extern "C" fn asked(_: *mut c_void, x: f64, y: f64) -> f64 {
    brightness(Vec2::new(x, y))
}

unsafe extern "C" fn wrong(_: *mut c_void, x: f64, _: f64) -> f64 {
    if x > 0.0 { f64::NAN } else { 1.0 }
}

/// What is asked of both.
#[derive(Clone, Copy)]
struct Case {
    varying: bool,
    sun: bool,
    capture: f64,
    bounces: Option<u32>,
}

fn kernel(case: &Case) -> (Vec<Seen>, [f64; 3]) {
    let gloss = PlaneGloss { axis_ratio: 6.0, rays: Some(RaySet::Split([4, 2, 1])) };
    let materials = [
        PlaneMaterial { diffuse: 0.5, specular: 0.3, gloss: None },
        PlaneMaterial { diffuse: 0.2, specular: 0.5, gloss: Some(gloss) },
    ];
    let circle = |x| Shape::Circle { centre: [x, 0.0], radius: 1.0 };
    let bodies = [
        BodyInput { shape: circle(-1.3), material: 0, elements: 12 },
        BodyInput { shape: circle(1.3), material: 0, elements: 12 },
        BodyInput {
            shape: Shape::Polyline { points: &WEDGE, closed: true, smooth: true },
            material: 1,
            elements: 2,
        },
    ];
    let sky = match case.varying {
        true => Sky::Varying { radiance: &brightness, jumps: &JUMPS.map(Vec2::from) },
        false => Sky::Uniform(1.5),
    };
    let sun = case.sun.then_some(PlaneSun {
        direction: Vec2::new(1.0, 2.0),
        irradiance: 0.7,
        capture: (case.capture != 0.0).then(|| Capture::conserving(0.7, case.capture)),
    });
    let light = Light::new(sky, sun).unwrap();
    let settings = Settings { max_bounces: case.bounces, ..Settings::for_tolerance(1e-3) };
    let input = PlaneInput { bodies: &bodies, materials: &materials };
    host::solve(&input, &light, &settings, |solved, report, scratch| {
        let seen = host::image(solved, ANGLE, SAMPLES, scratch).unwrap();
        (seen, [report.contraction, report.solver, report.tail])
    })
    .unwrap()
}

/// The same scene as C has it.
struct Arrays {
    materials: [blik_plane_material; 2],
    bodies: [blik_plane_body; 3],
}

impl Arrays {
    fn new() -> Arrays {
        let material = blik_plane_material::default();
        let circle = |x| blik_plane_body { centre: [x, 0.0], elements: 12, ..blik_plane_body::default() };
        let wedge = blik_plane_body {
            shape: BLIK_PLANE_POLYGON,
            smooth: 1,
            material: 1,
            elements: 2,
            points: WEDGE.as_ptr().cast(),
            point_count: WEDGE.len(),
            ..blik_plane_body::default()
        };
        Arrays {
            materials: [
                blik_plane_material { diffuse: 0.5, specular: 0.3, ..material },
                blik_plane_material {
                    diffuse: 0.2,
                    specular: 0.5,
                    gloss_axis_ratio: 6.0,
                    ray_set: BLIK_PLANE_RAYS_SPLIT,
                    rays: [4, 2, 1],
                    ..material
                },
            ],
            bodies: [circle(-1.3), circle(1.3), wedge],
        }
    }

    fn all(&self) -> blik_plane_bodies {
        blik_plane_bodies {
            bodies: self.bodies.as_ptr(),
            body_count: self.bodies.len(),
            materials: self.materials.as_ptr(),
            material_count: self.materials.len(),
            ..blik_plane_bodies::default()
        }
    }
}

fn settings() -> blik_plane_settings {
    blik_plane_settings { tolerance: 1e-3, ..blik_plane_settings::default() }
}

/// Memory at an odd address, of any content.
struct Block(Vec<u8>);

impl Block {
    fn new(bytes: usize) -> Block {
        Block(vec![0xa5; bytes + 1])
    }

    fn at(&mut self) -> *mut c_void {
        self.0[1..].as_mut_ptr().cast()
    }
}

#[track_caller]
fn done(status: i32, error: &blik_error) {
    assert_eq!(status, BLIK_OK, "{error:?}");
}

fn interface(case: &Case, run: &blik_run, own: bool) -> (Vec<Seen>, [f64; 3]) {
    let arrays = Arrays::new();
    let (all, mut error) = (arrays.all(), blik_error::default());
    let settings = blik_plane_settings { max_bounces: case.bounces.map_or(-1, |b| b as i32), ..settings() };
    let mut sky = blik_plane_sky { radiance: 1.5, ..blik_plane_sky::default() };
    if case.varying {
        sky.radiance_of = Some(asked);
        (sky.jumps, sky.jump_count) = (JUMPS.as_ptr().cast(), JUMPS.len());
    }
    let sun = blik_plane_sun {
        direction: [1.0, 2.0],
        irradiance: 0.7,
        capture_half_angle: case.capture,
        ..blik_plane_sun::default()
    };
    let sun = if case.sun { &raw const sun } else { null() };
    let light = blik_plane_light { sky: &sky, sun, ..blik_plane_light::default() };
    let mut bytes = 0;
    // SAFETY: all pointers are to values above; memory outlives the handles in it.
    unsafe {
        if own {
            let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
            done(blik_plane_scene_create(&all, &settings, &mut error, &mut scene), &error);
            done(blik_plane_coupling_create(scene, run, &mut error, &mut coupling), &error);
            done(blik_plane_solution_create(coupling, &light, run, &mut error, &mut solution), &error);
            let seen = views(coupling, solution, run, null_mut(), 0);
            blik_plane_solution_destroy(solution);
            blik_plane_coupling_destroy(coupling);
            blik_plane_scene_destroy(scene);
            return seen;
        }
        let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
        done(blik_plane_scene_size(&all, &mut error, &mut bytes), &error);
        let mut blocks = [Block::new(bytes), Block::new(0), Block::new(0), Block::new(0)];
        let memory = blocks[0].at();
        let status = blik_plane_scene_init(&all, &settings, memory, bytes - 1, &mut error, &mut scene);
        assert!(status == BLIK_ERROR_BUFFER_TOO_SMALL && error.needed == bytes && scene.is_null());
        done(blik_plane_scene_init(&all, &settings, memory, bytes, &mut error, &mut scene), &error);
        done(blik_plane_coupling_size(scene, run, &mut error, &mut bytes), &error);
        blocks[1] = Block::new(bytes);
        let memory = blocks[1].at();
        done(blik_plane_coupling_init(scene, run, memory, bytes, &mut error, &mut coupling), &error);
        done(blik_plane_solution_size(coupling, &light, run, &mut error, &mut bytes), &error);
        blocks[2] = Block::new(bytes);
        let memory = blocks[2].at();
        done(
            blik_plane_solution_init(coupling, &light, run, memory, bytes, &mut error, &mut solution),
            &error,
        );
        done(blik_plane_scratch_size(solution, run, &mut error, &mut bytes), &error);
        blocks[3] = Block::new(bytes);
        views(coupling, solution, run, blocks[3].at(), bytes)
    }
}

/// # Safety
/// Handles are valid.
unsafe fn views(
    coupling: *const blik_plane_coupling,
    solution: *const blik_plane_solution,
    run: *const blik_run,
    scratch: *mut c_void,
    size: usize,
) -> (Vec<Seen>, [f64; 3]) {
    let mut error = blik_error::default();
    let none = blik_plane_sample { abscissa: 0.0, radiance: -1.0, chain_tail: 0.0, rays: 0, object: 0 };
    let mut out = vec![none; SAMPLES];
    let (head, tail) = out.split_at_mut(40);
    let mut info = blik_plane_solution_info::default();
    let mut rows = blik_plane_coupling_info::default();
    // SAFETY: by the caller's promise, and as many samples as said.
    unsafe {
        for (first, part) in [(0, head), (40, tail)] {
            let (count, to) = (part.len(), part.as_mut_ptr());
            let status = blik_plane_image(
                solution, ANGLE, SAMPLES, first, count, run, scratch, size, &mut error, to, count,
            );
            done(status, &error);
        }
        // the same along rays of the caller's
        let rays: Vec<blik_plane_ray> = out
            .iter()
            .map(|s| {
                let (along, toward) = ([ANGLE.cos(), -ANGLE.sin()], [ANGLE.sin(), ANGLE.cos()]);
                let origin = [0, 1].map(|k| along[k] * s.abscissa + toward[k] * 9.0);
                blik_plane_ray { origin, direction: toward.map(|x| -x) }
            })
            .collect();
        let mut again = vec![none; SAMPLES];
        let to = again.as_mut_ptr();
        let status = blik_plane_radiance(
            solution,
            rays.as_ptr(),
            SAMPLES,
            run,
            scratch,
            size,
            &mut error,
            to,
            SAMPLES,
        );
        done(status, &error);
        // the same lines, from elsewhere on them: a sample next to a silhouette may differ
        let near = |(a, b): (&blik_plane_sample, &blik_plane_sample)| (a.radiance - b.radiance).abs() < 1e-9;
        assert!(out.iter().zip(&again).filter(|pair| near(*pair)).count() >= SAMPLES - 3);
        done(blik_plane_solution_get_info(solution, &mut error, &mut info), &error);
        done(blik_plane_coupling_get_info(coupling, &mut error, &mut rows), &error);
    }
    let seen = |s: &blik_plane_sample| Seen {
        radiance: s.radiance,
        object: s.object == 1,
        rays: s.rays,
        lost: s.chain_tail,
    };
    (out.iter().map(seen).collect(), [info.contraction, info.solver_error, rows.dropped])
}

#[test]
fn the_plane_model_has_the_owning_layers_bits() {
    let three = blik_run { parallel: Some(blik_run_on_threads), lanes: 3, ..blik_run::default() };
    let one = blik_run::default();
    let usual = Case { varying: false, sun: false, capture: 0.0, bounces: None };
    for case in [
        usual,
        Case { bounces: Some(3), ..usual },
        Case { varying: true, sun: true, ..usual },
        Case { sun: true, capture: 0.1, bounces: Some(2), ..usual },
    ] {
        let expected = kernel(&case);
        assert!(expected.0.iter().any(|s| s.object && s.radiance > 0.1));
        for (run, own) in [(&one, true), (&one, false), (&three, false), (&three, true)] {
            assert!(interface(&case, run, own) == expected, "own {own}, {} lanes", run.lanes);
        }
    }
}

/// Makes a scene with changed input; the error.
fn refused(change: impl FnOnce(&mut Arrays, &mut blik_plane_bodies, &mut blik_plane_settings)) -> blik_error {
    let mut arrays = Arrays::new();
    let (mut all, mut settings) = (arrays.all(), settings());
    change(&mut arrays, &mut all, &mut settings);
    let (mut scene, mut error) = (null_mut(), blik_error::default());
    // SAFETY: pointers are valid.
    let status = unsafe { blik_plane_scene_create(&all, &settings, &mut error, &mut scene) };
    assert!(status != BLIK_OK && status == error.status && scene.is_null());
    error
}

#[test]
fn refused_plane_calls_name_what_is_wrong() {
    use blik_error as e;
    let is = |error: e, status: i32, field: i32, index: usize| {
        assert!((error.status, error.field, error.index) == (status, field, index), "{error:?}");
    };
    is(refused(|_, all, _| all.struct_size = 0), BLIK_ERROR_STRUCT_SIZE, 0, 0);
    is(refused(|_, all, _| all.bodies = null()), BLIK_ERROR_NULL, 0, 0);
    is(refused(|_, all, _| all.body_count = 0), BLIK_ERROR_NO_FACETS, 0, 0);
    is(refused(|_, all, _| all.material_count = 0), BLIK_ERROR_NO_MATERIALS, 0, 0);
    is(refused(|_, all, _| all.body_stride = 8), BLIK_ERROR_STRUCT_SIZE, 0, 0);
    is(refused(|_, all, _| all.body_count = usize::MAX / 2), BLIK_ERROR_TOO_MANY, 0, 0);
    is(refused(|a, _, _| a.bodies[1].shape = 3), BLIK_ERROR_CHOICE, 0, 1);
    is(refused(|a, _, _| a.bodies[2].points = null()), BLIK_ERROR_NULL, 0, 2);
    is(refused(|a, _, _| a.bodies[2].point_count = 2), BLIK_ERROR_BODY, BLIK_FIELD_BODY_POINTS, 2);
    is(refused(|a, _, _| a.bodies[0].radius = f64::NAN), BLIK_ERROR_BODY, BLIK_FIELD_BODY_POINTS, 0);
    is(refused(|a, _, _| a.bodies[0].radius = 0.0), BLIK_ERROR_BODY, BLIK_FIELD_BODY_RADIUS, 0);
    is(refused(|a, _, _| a.bodies[1].elements = 0), BLIK_ERROR_BODY, BLIK_FIELD_BODY_ELEMENTS, 1);
    is(refused(|a, _, _| a.bodies[1].material = 2), BLIK_ERROR_MATERIAL_INDEX, 0, 1);
    is(refused(|a, _, _| a.materials[1].diffuse = -1.0), BLIK_ERROR_MATERIAL, BLIK_FIELD_DIFFUSE, 1);
    is(refused(|a, _, _| a.materials[0].diffuse = 0.9), BLIK_ERROR_REFLECTANCE_SUM, 0, 0);
    is(refused(|a, _, _| a.materials[1].ray_set = 9), BLIK_ERROR_CHOICE, 0, 1);
    is(refused(|a, _, _| a.materials[1].rays[1] = 0), BLIK_ERROR_MATERIAL, BLIK_FIELD_GLOSS_RAYS, 1);
    is(refused(|_, _, s| s.tolerance = 0.2), BLIK_ERROR_RANGE, BLIK_FIELD_TOLERANCE, 0);
    is(refused(|_, _, s| s.tolerance = f64::NAN), BLIK_ERROR_RANGE, BLIK_FIELD_TOLERANCE, 0);
    is(refused(|_, _, s| s.cutoff = 1.5), BLIK_ERROR_RANGE, BLIK_FIELD_TOLERANCE, 0);
    is(refused(|_, _, s| s.max_bounces = 65), BLIK_ERROR_RANGE, BLIK_FIELD_MAX_BOUNCES, 0);
    is(refused(|_, _, s| s.basis = 4), BLIK_ERROR_CHOICE, 0, 0);
    is(refused(|_, _, s| s.basis = BLIK_PLANE_PANELS), BLIK_ERROR_RANGE, BLIK_FIELD_PLANE_ORDER, 0);
    is(refused(|_, _, s| s.method = BLIK_PLANE_SPLIT), BLIK_ERROR_RANGE, BLIK_FIELD_PLANE_POINTS, 0);
}

#[test]
fn a_plane_sky_that_is_not_a_number_and_wrong_calls_are_refused() {
    let arrays = Arrays::new();
    let (all, settings, mut error) = (arrays.all(), settings(), blik_error::default());
    let mut sky = blik_plane_sky::default();
    let mut light = blik_plane_light { sky: &sky, ..blik_plane_light::default() };
    let mut sample = blik_plane_sample { abscissa: 0.0, radiance: 0.0, chain_tail: 0.0, rays: 0, object: 0 };
    let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
    // SAFETY: pointers are valid, or null.
    unsafe {
        done(blik_plane_scene_create(&all, &settings, &mut error, &mut scene), &error);
        done(blik_plane_coupling_create(scene, null(), &mut error, &mut coupling), &error);
        sky.radiance_of = Some(wrong);
        light.sky = &sky;
        let status = blik_plane_solution_create(coupling, &light, null(), &mut error, &mut solution);
        assert!(status == BLIK_ERROR_RANGE && error.field == BLIK_FIELD_SKY_RADIANCE && solution.is_null());
        sky = blik_plane_sky { jump_count: 13, ..blik_plane_sky::default() };
        light.sky = &sky;
        let status = blik_plane_solution_create(coupling, &light, null(), &mut error, &mut solution);
        assert!(status == BLIK_ERROR_TOO_MANY && error.needed == 12 && error.given == 13);
        sky = blik_plane_sky { radiance: -1.0, ..blik_plane_sky::default() };
        light.sky = &sky;
        let status = blik_plane_solution_create(coupling, &light, null(), &mut error, &mut solution);
        assert!(status == BLIK_ERROR_RANGE && error.field == BLIK_FIELD_SKY_RADIANCE);
        sky.radiance = 1.0;
        light.sky = &sky;
        done(blik_plane_solution_create(coupling, &light, null(), &mut error, &mut solution), &error);
        let mut image = |angle, samples, first, count, size| {
            let scratch = (&raw mut error).cast();
            let status = blik_plane_image(
                solution,
                angle,
                samples,
                first,
                count,
                null(),
                scratch,
                size,
                &mut error,
                &mut sample,
                count,
            );
            (status, error.field)
        };
        assert_eq!(image(f64::NAN, 1, 0, 1, 0), (BLIK_ERROR_RANGE, BLIK_FIELD_DIRECTION));
        assert_eq!(image(0.0, 0, 0, 1, 0), (BLIK_ERROR_RANGE, BLIK_FIELD_RESOLUTION));
        assert_eq!(image(0.0, 9, 9, 1, 0), (BLIK_ERROR_RANGE, BLIK_FIELD_ROWS));
        assert_eq!(image(0.0, 9, 0, 1, 8).0, BLIK_ERROR_BUFFER_TOO_SMALL);
        let ray = blik_plane_ray { origin: [0.0, 9.0], direction: [0.0, -2.0] };
        let status =
            blik_plane_radiance(solution, &ray, 1, null(), null_mut(), 0, &mut error, &mut sample, 1);
        assert!(status == BLIK_ERROR_DIRECTION && error.index == 0);
        let status = blik_plane_image(
            coupling.cast_const().cast(),
            0.0,
            1,
            0,
            1,
            null(),
            null_mut(),
            0,
            &mut error,
            &mut sample,
            1,
        );
        assert_eq!(status, BLIK_ERROR_HANDLE);
        // what a point sees fills its half circle; its circle is on none of the spans
        let (mut bytes, mut most, mut count) = (0, 0, 0);
        done(blik_plane_visible_size(scene, &mut error, &mut bytes, &mut most), &error);
        let mut spans = vec![blik_plane_span { from: 0.0, to: 0.0, primitive: 0 }; most];
        let (point, normal) = ([-0.3, 0.0], [3.0, 0.0]);
        let mut visible = |capacity| {
            let (at, n, to) = (point.as_ptr(), normal.as_ptr(), spans.as_mut_ptr());
            blik_plane_visible(scene, at, n, 0, null_mut(), 0, &mut error, to, capacity, &mut count)
        };
        assert_eq!(visible(1), BLIK_ERROR_LENGTH);
        assert_eq!(visible(most), BLIK_OK);
        assert!(count >= 3 && spans[0].from == -1.0 && spans[count - 1].to == 1.0);
        assert!(spans[..count].windows(2).all(|w| w[0].to == w[1].from));
        let circle = spans[..count].iter().find(|s| s.primitive == 1).unwrap();
        // a circle of radius 1 seen from 1.6 off its centre
        assert!((circle.to - circle.from - 2.0 / 1.6).abs() < 1e-12);
        // the row's form factors and sky share add up: sky, and what diffuse and mirror surfaces leave
        let mut info = blik_plane_scene_info::default();
        done(blik_plane_scene_get_info(scene, &mut error, &mut info), &error);
        let unknowns = info.unknowns;
        let (mut row, mut open) = (vec![0.0; unknowns], [0.0]);
        done(
            {
                let (to, of_sky) = (row.as_mut_ptr(), open.as_mut_ptr());
                blik_plane_coupling_get_rows(coupling, 5, 1, &mut error, to, unknowns, of_sky, 1)
            },
            &error,
        );
        let sum: f64 = row.iter().sum::<f64>() + open[0];
        assert!(sum > 0.999 && sum < 1.4 && open[0] > 0.3, "{sum}");
        let status =
            blik_plane_coupling_get_rows(coupling, unknowns, 1, &mut error, null_mut(), 0, null_mut(), 0);
        assert!(status == BLIK_ERROR_RANGE && error.field == BLIK_FIELD_ROWS);
        let mut place = std::mem::MaybeUninit::<blik_plane_unknown>::uninit();
        done(blik_plane_get_unknowns(solution, 5, 1, &mut error, place.as_mut_ptr(), 1), &error);
        let place = place.assume_init();
        assert!(place.primitive == 0 && place.radiance > 0.2 && place.radiance < 1.0);
        let rays = [
            blik_plane_ray { origin: [-1.3, 5.0], direction: [0.0, -1.0] },
            blik_plane_ray { origin: [-1.3, 5.0], direction: [0.0, 1.0] },
        ];
        let mut hits = [std::mem::zeroed::<blik_plane_hit>(); 2];
        done(blik_plane_first_hits(scene, rays.as_ptr(), 2, &mut error, hits.as_mut_ptr(), 2), &error);
        assert!(hits[0].primitive == 0 && hits[0].point == [-1.3, 1.0] && hits[1].primitive == BLIK_NO_FACET);
        blik_plane_solution_destroy(solution);
        blik_plane_coupling_destroy(coupling);
        blik_plane_scene_destroy(scene);
        let mut lobe = std::mem::zeroed::<blik_plane_lobe>();
        done(blik_plane_gloss(10.0, 1.0, 0.0, &mut error, &mut lobe), &error);
        assert!(lobe.albedo == 1.0 && lobe.mean_albedo < 1.0 && lobe.value > 1.0);
        assert_eq!(blik_plane_gloss(0.5, 1.0, 0.0, &mut error, &mut lobe), BLIK_ERROR_RANGE);
        assert_eq!(blik_plane_gloss(10.0, f64::NAN, 0.0, &mut error, &mut lobe), BLIK_ERROR_RANGE);
    }
}

/// The two methods of the paper, through the interface.
#[test]
fn the_papers_methods_are_those_of_the_owning_layer() {
    let body = blik_plane_body { elements: 32, ..blik_plane_body::default() };
    let bodies = [body, blik_plane_body { centre: [2.2, 0.0], ..body }];
    let material = blik_plane_material { diffuse: 0.3, specular: 0.1, ..blik_plane_material::default() };
    let all = blik_plane_bodies {
        bodies: bodies.as_ptr(),
        body_count: 2,
        materials: &material,
        material_count: 1,
        ..blik_plane_bodies::default()
    };
    let shape = |x| Shape::Circle { centre: [x, 0.0], radius: 1.0 };
    let inputs = [0.0, 2.2].map(|x| BodyInput { shape: shape(x), material: 0, elements: 32 });
    let materials = [PlaneMaterial { diffuse: 0.3, specular: 0.1, gloss: None }];
    let light = Light::new(Sky::Uniform(1.0), None).unwrap();
    let sky = blik_plane_sky::default();
    let given = blik_plane_light { sky: &sky, ..blik_plane_light::default() };
    for (basis, kernels) in [(BLIK_PLANE_CONSTANT, Basis::Constant), (BLIK_PLANE_LINEAR, Basis::Linear)] {
        let chosen = blik_plane_settings {
            basis,
            method: BLIK_PLANE_FACETS,
            points: 1,
            cutoff: 1e-9,
            solver: 1e-10,
            ..settings()
        };
        let own = Settings {
            basis: kernels,
            method: Method::Facets { chains: 1 },
            max_bounces: None,
            cutoff: 1e-9,
            solver: 1e-10,
            tolerance: 1e-3,
        };
        let input = PlaneInput { bodies: &inputs, materials: &materials };
        let expected = host::solve(&input, &light, &own, |solved, _, _| solved.radiance.to_vec()).unwrap();
        let mut error = blik_error::default();
        let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
        // SAFETY: pointers are valid.
        unsafe {
            done(blik_plane_scene_create(&all, &chosen, &mut error, &mut scene), &error);
            done(blik_plane_coupling_create(scene, null(), &mut error, &mut coupling), &error);
            done(blik_plane_solution_create(coupling, &given, null(), &mut error, &mut solution), &error);
            let mut out = vec![std::mem::zeroed::<blik_plane_unknown>(); expected.len()];
            done(
                blik_plane_get_unknowns(solution, 0, out.len(), &mut error, out.as_mut_ptr(), out.len()),
                &error,
            );
            assert!(out.iter().map(|u| u.radiance).eq(expected));
            blik_plane_solution_destroy(solution);
            blik_plane_coupling_destroy(coupling);
            blik_plane_scene_destroy(scene);
        }
    }
}
