//! The C interface gives the owning layer's results bit for bit, in memory of the caller and in its own, on one lane and
//! on several; refused calls name what is wrong and write nothing.

#[path = "support/case.rs"]
mod case;
#[path = "ffi/plane.rs"]
mod plane;
mod support;

use blik::*;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::host::Settings;
use blik_kernel::scene::SceneInput;
use blik_kernel::sky::{SkyInput, SkyModel};
use blik_kernel::sun::SunInput;
use case::{Case, SkyOf, SunOf, orthographic, within};
use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut};
use support::scenes;
use support::twin::Material;

const PIXELS: usize = 24;

/// Three bands, a mirror, a lobe, sky and sun.
fn case() -> Case {
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

fn view() -> CameraInput {
    let camera = orthographic([3.0, 2.0, 2.5], [0.4, 0.45, 0.3], 2.0, PIXELS);
    CameraInput { sampling: Sampling::Area, ..camera }
}

/// The kernel's input as C has it; the arrays stay the input's.
struct Arrays {
    mesh: blik_mesh,
    _materials: Vec<blik_material>,
}

fn array<T>(values: &[T], format: i32) -> blik_array {
    blik_array { data: values.as_ptr().cast(), count: values.len(), stride: 0, format }
}

fn mesh(input: &SceneInput<'_>) -> Arrays {
    let materials: Vec<blik_material> = input
        .materials
        .iter()
        .map(|m| blik_material {
            diffuse: m.diffuse.as_ptr(),
            specular: m.specular.as_ptr(),
            emission: m.emission.as_ptr(),
            gloss_axis_ratio: m.gloss.map_or(0.0, |g| g.axis_ratio),
            gloss_rays: m.gloss.and_then(|g| g.rays).unwrap_or(0),
        })
        .collect();
    let mesh = blik_mesh {
        vertices: array(input.vertices, BLIK_F64),
        facets: array(input.facets, BLIK_U32),
        facet_materials: array(input.facet_materials, BLIK_U32),
        materials: materials.as_ptr(),
        material_count: materials.len(),
        bands: input.bands,
        two_sided: i32::from(input.two_sided),
        ..blik_mesh::default()
    };
    Arrays { mesh, _materials: materials }
}

fn camera(input: &CameraInput) -> blik_camera {
    let mut camera = blik_camera::default();
    (camera.eye, camera.target, camera.up) = (input.eye, input.target, input.up);
    (camera.columns, camera.rows) = (input.columns, input.rows);
    match input.projection {
        Projection::Orthographic { height } => camera.height = height,
        Projection::Perspective { fov_deg } => {
            (camera.projection, camera.fov_deg) = (BLIK_PERSPECTIVE, fov_deg);
        }
    }
    camera
}

fn sky(input: &SkyInput<'_>) -> blik_sky {
    let mut sky = blik_sky { model: BLIK_SKY_OVERCAST, ..blik_sky::default() };
    (sky.radiance, sky.ground, sky.up) = (input.radiance.as_ptr(), input.ground.as_ptr(), input.up);
    sky
}

fn sun(input: &SunInput<'_>) -> blik_sun {
    let mut sun = blik_sun::default();
    (sun.direction, sun.half_angle_deg) = (input.direction, input.half_angle_deg);
    sun.irradiance = input.irradiance.as_ptr();
    sun
}

fn settings(tolerance: f64) -> blik_settings {
    blik_settings { tolerance, ..blik_settings::default() }
}

fn threads(lanes: usize) -> blik_run {
    blik_run { parallel: Some(blik_run_on_threads), lanes, ..blik_run::default() }
}

#[track_caller]
fn done(status: i32, error: &blik_error) {
    assert_eq!(status, BLIK_OK, "{error:?}");
}

/// What a run of the interface left.
#[derive(Debug, PartialEq)]
struct Results {
    pixels: Vec<u32>,
    components: Vec<u32>,
    facets: Vec<u64>,
    intensity: Vec<u64>,
    estimate: f64,
    rays: [u64; 4],
}

/// Everything through the C interface; `own`: in the library's memory.
fn run(case: &Case, tolerance: f64, run: &blik_run, own: bool) -> Results {
    case.with_input(|input| {
        let arrays = mesh(input);
        let (sky, sun) = (sky(&case.sky.as_ref().unwrap().input()), sun(&case.sun.as_ref().unwrap().input()));
        let light = blik_light { sky: &sky, sun: &sun, ..blik_light::default() };
        let (settings, camera) = (settings(tolerance), camera(&view()));
        let mut error = blik_error::default();
        // SAFETY: all pointers are to values above; memory outlives the handles in it.
        unsafe {
            if own {
                let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
                done(blik_scene_create(&arrays.mesh, &mut error, &mut scene), &error);
                done(blik_coupling_create(scene, &settings, run, &mut error, &mut coupling), &error);
                done(blik_solution_create(coupling, &light, run, &mut error, &mut solution), &error);
                let results = views(solution, &camera, run, input, null_mut(), 0);
                blik_solution_destroy(solution);
                blik_coupling_destroy(coupling);
                blik_scene_destroy(scene);
                return results;
            }
            let mut bytes = 0;
            done(blik_scene_size(&arrays.mesh, &mut error, &mut bytes), &error);
            let mut memory = [vec![0xa5u8; bytes], vec![], vec![], vec![]];
            let [own, coupled, lit, scratch] = &mut memory;
            let mut scene = null_mut();
            let at = |memory: &mut Vec<u8>| memory.as_mut_ptr().cast::<c_void>();
            done(blik_scene_init(&arrays.mesh, at(own), bytes, &mut error, &mut scene), &error);
            done(blik_coupling_size(scene, &settings, &mut error, &mut bytes), &error);
            let (mut coupling, mut tries) = (null_mut(), 0);
            loop {
                coupled.resize(bytes, 0xa5);
                let status =
                    blik_coupling_init(scene, &settings, run, at(coupled), bytes, &mut error, &mut coupling);
                if status != BLIK_ERROR_BUFFER_TOO_SMALL {
                    done(status, &error);
                    break;
                }
                assert!(error.needed > bytes && error.given == bytes, "{error:?}");
                bytes = error.needed;
                tries += 1;
                assert!(tries < 8, "the advice leads to enough: {bytes}");
            }
            done(blik_solution_size(coupling, &light, &mut error, &mut bytes), &error);
            *lit = vec![0xa5; bytes];
            let mut solution = null_mut();
            let status = blik_solution_init(coupling, &light, run, at(lit), bytes, &mut error, &mut solution);
            done(status, &error);
            done(blik_image_scratch_size(solution, &camera, run, &mut error, &mut bytes), &error);
            *scratch = vec![0xa5; bytes];
            views(solution, &camera, run, input, at(scratch), bytes)
        }
    })
}

/// Image, facets, signature and report.
///
/// # Safety
/// As for the functions called.
unsafe fn views(
    solution: *const blik_solution,
    camera: &blik_camera,
    run: &blik_run,
    input: &SceneInput<'_>,
    scratch: *mut c_void,
    size: usize,
) -> Results {
    let mut error = blik_error::default();
    let count = camera.rows * camera.columns * input.bands;
    let (mut pixels, mut components) = (vec![0f32; count], vec![0f32; 3 * count]);
    let facets = input.facets.len();
    let (mut irradiance, mut radiance) = (vec![0.0; facets * input.bands], vec![0.0; facets * input.bands]);
    let forward: [f64; 3] = std::array::from_fn(|k| camera.target[k] - camera.eye[k]);
    let (mut tally, mut report) = (blik_tally::default(), blik_report::default());
    // SAFETY: all are numbers.
    let mut signatures: [blik_signature; 3] = unsafe { std::mem::zeroed() };
    // SAFETY: arrays as long as stated.
    unsafe {
        let (p, c) = (pixels.as_mut_ptr(), components.as_mut_ptr());
        let t = &raw mut tally;
        done(blik_image(solution, camera, run, scratch, size, &mut error, p, count, c, 3 * count, t), &error);
        let (e, l) = (irradiance.as_mut_ptr(), radiance.as_mut_ptr());
        let n = irradiance.len();
        done(blik_facets(solution, 0, facets, &mut error, null_mut(), 0, e, n, l, n), &error);
        let s = signatures.as_mut_ptr();
        let (from, stride) = (forward.as_ptr(), size_of::<blik_signature>());
        done(
            blik_signatures(solution, from, 1, 0, run, null_mut(), 0, &mut error, s, input.bands, stride),
            &error,
        );
        done(blik_get_report(solution, &tally, &mut error, &mut report), &error);
        rows_agree(solution, camera, &pixels, &tally);
    }
    Results {
        pixels: pixels.iter().map(|p| p.to_bits()).collect(),
        components: components.iter().map(|p| p.to_bits()).collect(),
        facets: irradiance.iter().chain(&radiance).map(|x| x.to_bits()).collect(),
        intensity: signatures.iter().map(|s| s.radiant_intensity.to_bits()).collect(),
        estimate: report.error_estimate,
        rays: [report.visibility_rays, report.sun_rays, report.primary_rays, report.chain_rays],
    }
}

/// The image row by row is the whole image, and its tallies add up to the whole's.
///
/// # Safety
/// As for the functions called.
unsafe fn rows_agree(solution: *const blik_solution, camera: &blik_camera, whole: &[f32], all: &blik_tally) {
    let stride = whole.len() / camera.rows;
    let mut error = blik_error::default();
    let (mut sum, mut tally) = (blik_tally::default(), blik_tally::default());
    for row in 0..camera.rows {
        let mut pixels = vec![0f32; stride];
        // SAFETY: arrays as long as stated.
        let status = unsafe {
            let (p, t) = (pixels.as_mut_ptr(), &raw mut tally);
            blik_image_rows(solution, camera, row, 1, null_mut(), 0, &mut error, p, stride, null_mut(), 0, t)
        };
        done(status, &error);
        assert!(pixels == whole[row * stride..(row + 1) * stride], "row {row}");
        // SAFETY: both are valid.
        done(unsafe { blik_tally_add(&mut sum, &tally, &mut error) }, &error);
    }
    assert_eq!((sum.object_pixels, sum.refined_pixels), (all.object_pixels, all.refined_pixels));
}

#[test]
fn the_interface_gives_the_owning_layers_bits() {
    let case = case();
    let host = case.run(2, &within(2e-2), &view());
    let alone = blik_run::default();
    let first = run(&case, 2e-2, &alone, true);
    assert_eq!(host.pixel_bits(), [&first.pixels[..], &first.components].concat());
    for lanes in [1, 3, 8] {
        for own in [true, false] {
            assert!(run(&case, 2e-2, &threads(lanes), own) == first, "{lanes} lanes, own memory: {own}");
        }
    }
    case.with_lit(1, &within(2e-2), |_, lit| {
        let (mut irradiance, mut radiance) = (Vec::new(), Vec::new());
        lit.facets(|_, _, _, e, l| {
            irradiance.extend(e.iter().map(|x| x.to_bits()));
            radiance.extend(l.iter().map(|x| x.to_bits()));
        });
        assert_eq!(first.facets, [irradiance, radiance].concat());
    });
}

#[test]
fn bounded_bounces_agree_too() {
    let case = case();
    case.with_input(|input| {
        let arrays = mesh(input);
        let (sky, sun) = (sky(&case.sky.as_ref().unwrap().input()), sun(&case.sun.as_ref().unwrap().input()));
        let light = blik_light { sky: &sky, sun: &sun, ..blik_light::default() };
        let settings = blik_settings { max_bounces: 2, ..settings(5e-2) };
        let mut error = blik_error::default();
        let host = Settings { max_bounces: Some(2), ..within(5e-2) };
        let host = case.run(2, &host, &view());
        for lanes in [1, 4] {
            let run = threads(lanes);
            // SAFETY: all pointers are to values above.
            unsafe {
                let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
                done(blik_scene_create(&arrays.mesh, &mut error, &mut scene), &error);
                done(blik_coupling_create(scene, &settings, &run, &mut error, &mut coupling), &error);
                done(blik_solution_create(coupling, &light, &run, &mut error, &mut solution), &error);
                let seen = views(solution, &camera(&view()), &run, input, null_mut(), 0);
                assert_eq!(host.pixel_bits(), [&seen.pixels[..], &seen.components].concat(), "{lanes} lanes");
                blik_solution_destroy(solution);
                blik_coupling_destroy(coupling);
                blik_scene_destroy(scene);
            }
        }
    });
}

/// Vertices as single precision in records with other data between, and 16-bit indices.
#[test]
fn strided_single_precision_is_the_same_mesh() {
    #[repr(C)]
    struct Vertex {
        other: u16,
        position: [f32; 3],
        colour: u32,
    }
    let case = case();
    case.with_input(|input| {
        let exact = |v: &[f64; 3]| v.iter().all(|&x| f64::from(x as f32) == x);
        assert!(input.vertices.iter().all(exact), "this mesh is exact in single precision");
        let records: Vec<Vertex> = input
            .vertices
            .iter()
            .map(|v| Vertex { other: 7, position: v.map(|x| x as f32), colour: 9 })
            .collect();
        assert!(records.iter().all(|v| v.other == 7 && v.colour == 9));
        let facets: Vec<[u16; 4]> =
            input.facets.iter().map(|f| [f[0] as u16, f[1] as u16, f[2] as u16, 0xffff]).collect();
        let mut arrays = mesh(input);
        let mut scenes = [null_mut(); 2];
        let mut error = blik_error::default();
        // SAFETY: all pointers are to values above.
        unsafe {
            done(blik_scene_create(&arrays.mesh, &mut error, &mut scenes[0]), &error);
            arrays.mesh.vertices = blik_array {
                data: (&raw const records[0].position).cast(),
                count: records.len(),
                stride: size_of::<Vertex>(),
                format: BLIK_F32,
            };
            arrays.mesh.facets = blik_array { stride: 8, ..array(&facets, BLIK_U16) };
            done(blik_scene_create(&arrays.mesh, &mut error, &mut scenes[1]), &error);
            let rays: Vec<blik_ray> = (0..500)
                .map(|i| {
                    let at = |k: f64| (f64::from(i) * k).sin();
                    let direction = blik_kernel::math::Vec3::new(at(0.3), at(0.7), -1.0).normalize();
                    let skip = BLIK_NO_FACET;
                    let origin = [0.5 + at(1.1), 0.5 + at(1.7), 2.0];
                    blik_ray { origin, direction: direction.to_array(), t_max: f64::INFINITY, skip }
                })
                .collect();
            let hits = scenes.map(|scene| {
                let mut hits: Vec<blik_hit> = Vec::with_capacity(rays.len());
                let mut any = vec![9u8; rays.len()];
                let (r, n) = (rays.as_ptr(), rays.len());
                done(blik_closest_hits(scene, r, n, null(), &mut error, hits.as_mut_ptr(), n), &error);
                hits.set_len(n);
                done(blik_any_hits(scene, r, n, &threads(2), &mut error, any.as_mut_ptr(), n), &error);
                assert!(hits.iter().zip(&any).all(|(h, a)| (h.facet != BLIK_NO_FACET) == (*a == 1)));
                hits.iter().map(|h| (h.facet, h.t.to_bits(), h.front)).collect::<Vec<_>>()
            });
            assert_eq!(hits[0], hits[1]);
            assert!(hits[0].iter().any(|h| h.0 != BLIK_NO_FACET));
            scenes.into_iter().for_each(|scene| blik_scene_destroy(scene));
        }
    });
}

/// The error that a call leaves.
#[track_caller]
fn refused(status: i32, call: impl FnOnce(*mut blik_error) -> i32) -> blik_error {
    let mut error = blik_error::default();
    assert_eq!(call(&mut error), status, "{error:?}");
    assert_eq!(error.status, status);
    // SAFETY: static text.
    assert!(!unsafe { CStr::from_ptr(blik_status_text(status)) }.to_bytes().is_empty());
    error
}

#[test]
fn refused_calls_say_what_is_wrong_and_write_nothing() {
    let case = case();
    case.with_input(|input| {
        let arrays = mesh(input);
        let mut out = 0xbad as *mut blik_scene;
        let mut create = |change: &dyn Fn(&mut blik_mesh), status| {
            let mut mesh = arrays.mesh;
            change(&mut mesh);
            // SAFETY: the mesh is the test's, and what is wrong with it is what is tested.
            let error = refused(status, |e| unsafe { blik_scene_create(&mesh, e, &mut out) });
            assert_eq!(out as usize, 0xbad);
            error
        };
        create(&|m| m.struct_size = 0, BLIK_ERROR_STRUCT_SIZE);
        create(&|m| m.vertices.data = null(), BLIK_ERROR_NULL);
        create(&|m| m.vertices.format = BLIK_U8, BLIK_ERROR_CHOICE);
        create(&|m| m.vertices.stride = 8, BLIK_ERROR_LENGTH);
        create(&|m| m.facets.count = 0, BLIK_ERROR_NO_FACETS);
        create(&|m| m.facets.count = usize::MAX / 2, BLIK_ERROR_TOO_MANY);
        create(&|m| m.material_count = 0, BLIK_ERROR_NO_MATERIALS);
        create(&|m| m.bands = 65, BLIK_ERROR_BANDS);
        let error = create(&|m| m.vertices.count -= 1, BLIK_ERROR_VERTEX_INDEX);
        assert_eq!(error.value, (input.vertices.len() - 1) as f64);
        assert!(input.facets[error.index].contains(&(error.value as u32)));
        let mut vertices = input.vertices.to_vec();
        vertices[3][1] = f64::NAN;
        let error = create(&|m| m.vertices.data = vertices.as_ptr().cast(), BLIK_ERROR_VERTEX);
        assert_eq!(error.index, 3);
        // SAFETY: null and garbage are what is tested.
        unsafe {
            assert_eq!(blik_scene_create(&arrays.mesh, null_mut(), null_mut()), BLIK_ERROR_NULL);
            let mut bytes = 7;
            let settings = settings(1e-2);
            refused(BLIK_ERROR_NULL, |e| blik_coupling_size(null(), &settings, e, &mut bytes));
            let garbage = [0u64; 512];
            let scene = garbage.as_ptr().cast::<blik_scene>();
            refused(BLIK_ERROR_HANDLE, |e| blik_coupling_size(scene, &settings, e, &mut bytes));
            assert_eq!(bytes, 7);
            let mut scene = null_mut();
            assert_eq!(blik_scene_create(&arrays.mesh, null_mut(), &mut scene), BLIK_OK);
            let wrong = blik_settings { tolerance: 0.5, ..settings };
            let error = refused(BLIK_ERROR_RANGE, |e| blik_coupling_size(scene, &wrong, e, &mut bytes));
            assert_eq!((error.field, error.value), (BLIK_FIELD_TOLERANCE, 0.5));
            blik_scene_destroy(scene);
            blik_scene_destroy(null_mut());
        }
    });
}

/// Rays that are none are refused by all who take rays, with the field and the ray's index, and nothing is written.
#[test]
fn rays_that_are_none_are_refused() {
    let case = case();
    case.with_input(|input| {
        let arrays = mesh(input);
        let sky = sky(&case.sky.as_ref().unwrap().input());
        let light = blik_light { sky: &sky, ..blik_light::default() };
        let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
        let mut error = blik_error::default();
        // SAFETY: all pointers are to values above.
        unsafe {
            done(blik_scene_create(&arrays.mesh, &mut error, &mut scene), &error);
            done(blik_coupling_create(scene, &settings(0.1), null(), &mut error, &mut coupling), &error);
            done(blik_solution_create(coupling, &light, null(), &mut error, &mut solution), &error);
        }
        let facets = input.facets.len() as u32;
        let good = blik_ray { origin: [0.5, 0.5, 3.0], ..blik_ray::default() };
        // all three, with one ray among good ones; what each says
        let ask = |ray: blik_ray| {
            let rays = [good, good, ray, good];
            let mut radiance = [7.0; 12];
            // SAFETY: all are numbers.
            let mut hits: [blik_hit; 4] = unsafe { std::mem::zeroed() };
            let mut any = [9u8; 4];
            let mut errors = [blik_error::default(); 3];
            let r = rays.as_ptr();
            // SAFETY: arrays as long as stated.
            let statuses = unsafe {
                let [a, b, c] = errors.each_mut().map(|e| e as *mut blik_error);
                let l = radiance.as_mut_ptr();
                [
                    blik_radiance(solution, r, 4, null(), null_mut(), 0, a, l, 12),
                    blik_closest_hits(scene, r, 4, null(), b, hits.as_mut_ptr(), 4),
                    blik_any_hits(scene, r, 4, null(), c, any.as_mut_ptr(), 4),
                ]
            };
            let written = radiance != [7.0; 12] || hits.iter().any(|h| h.t != 0.0) || any != [9; 4];
            assert!(statuses.iter().all(|s| *s == statuses[0]), "{statuses:?}");
            assert_eq!(written, statuses[0] == BLIK_OK);
            assert!(
                written || errors.iter().all(|e| (e.index, e.field) == (2, errors[0].field)),
                "{errors:?}"
            );
            (statuses[0], errors[0].field)
        };
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for k in 0..3 {
                let mut ray = good;
                ray.origin[k] = x;
                assert_eq!(ask(ray), (BLIK_ERROR_RANGE, BLIK_FIELD_RAY_ORIGIN));
                let mut ray = good;
                ray.direction[k] = x;
                assert_eq!(ask(ray), (BLIK_ERROR_DIRECTION, BLIK_FIELD_RAY_DIRECTION));
            }
        }
        for direction in [[0.0; 3], [0.0, 0.0, -3.0], [0.0, 0.0, 0.5], [1e-200, 0.0, 0.0], [1e200; 3]] {
            assert_eq!(ask(blik_ray { direction, ..good }), (BLIK_ERROR_DIRECTION, BLIK_FIELD_RAY_DIRECTION));
        }
        for t_max in [f64::NAN, -1.0, f64::NEG_INFINITY] {
            assert_eq!(ask(blik_ray { t_max, ..good }), (BLIK_ERROR_RANGE, BLIK_FIELD_RAY_T_MAX));
        }
        for skip in [facets, facets + 7, BLIK_NO_FACET - 1] {
            assert_eq!(ask(blik_ray { skip, ..good }), (BLIK_ERROR_RANGE, BLIK_FIELD_RAY_SKIP));
        }
        // a direction that was a unit vector in single precision, no limit, and the last facet to skip
        let third = f64::from(1.0 / 3f32.sqrt());
        let direction = [-third, third, -third];
        for t_max in [0.0, 1.0, f64::MAX, f64::INFINITY] {
            assert_eq!(ask(blik_ray { t_max, direction, skip: facets - 1, ..good }).0, BLIK_OK);
        }
        // SAFETY: used by nobody any more.
        unsafe {
            blik_solution_destroy(solution);
            blik_coupling_destroy(coupling);
            blik_scene_destroy(scene);
        }
    });
}

/// A struct is as long as it says: nothing behind is read or written, and lengths that never were are refused.
#[test]
fn structs_are_as_long_as_they_say() {
    let case = case();
    case.with_input(|input| {
        let arrays = mesh(input);
        let (mut scene, mut error, mut bytes) = (null_mut(), blik_error::default(), 0);
        // SAFETY: all pointers are to values above, and room for more than any struct.
        unsafe {
            done(blik_scene_create(&arrays.mesh, &mut error, &mut scene), &error);
            let first = std::mem::offset_of!(blik_settings, image_tolerance);
            for size in (0..size_of::<blik_settings>() + 64).chain([usize::MAX, 1 << 40]) {
                // what stands behind would be refused as a tolerance
                let mut room = [f64::NAN; 32];
                let at = room.as_mut_ptr().cast::<blik_settings>();
                at.write(blik_settings { image_tolerance: f64::NAN, ..settings(0.1) });
                (*at).struct_size = size;
                let status = blik_coupling_size(scene, at, &mut error, &mut bytes);
                let whole = size_of::<blik_settings>();
                let expected = match size {
                    size if size < first || size > whole => BLIK_ERROR_STRUCT_SIZE,
                    // the member is read, or a part of it
                    size if size > first => BLIK_ERROR_RANGE,
                    _ => BLIK_OK,
                };
                // the first bytes of a number may make one that is allowed
                assert!(status == expected || (size > first && size < whole), "{size}: {status}");
                if status == BLIK_ERROR_STRUCT_SIZE {
                    assert_eq!((error.needed, error.given), (whole, size));
                }
            }
            for size in 0..2 * size_of::<blik_scene_info>() {
                let mut room = [0xa5a5_a5a5_a5a5_a5a5u64; 32];
                room[0] = size as u64;
                let before = room;
                let status = blik_scene_get_info(scene, &mut error, room.as_mut_ptr().cast());
                let own = size == size_of::<blik_scene_info>();
                assert_eq!(status, if own { BLIK_OK } else { BLIK_ERROR_STRUCT_SIZE });
                let words = if own { size / 8 } else { 0 };
                assert!(room[words..] == before[words..] && room[0] == size as u64);
            }
            blik_scene_destroy(scene);
        }
    });
}

unsafe extern "C" fn stop(user: *mut c_void, done: f64) -> i32 {
    // SAFETY: the test's counter.
    let calls = unsafe { &mut *user.cast::<(u32, f64)>() };
    assert!((0.0..=1.0).contains(&done) && done >= calls.1, "{done} after {}", calls.1);
    *calls = (calls.0 + 1, done);
    i32::from(calls.0 == 3)
}

unsafe extern "C" fn watch(user: *mut c_void, done: f64) -> i32 {
    // SAFETY: as above.
    unsafe { stop(user, done) };
    0
}

#[test]
fn progress_rises_to_one_and_can_stop_a_stage() {
    let case = case();
    case.with_input(|input| {
        let arrays = mesh(input);
        let settings = settings(5e-2);
        let mut error = blik_error::default();
        let (mut scene, mut coupling) = (null_mut(), null_mut());
        // SAFETY: all pointers are to values above.
        unsafe {
            done(blik_scene_create(&arrays.mesh, &mut error, &mut scene), &error);
            let mut calls = (0u32, 0.0f64);
            let user = (&raw mut calls).cast::<c_void>();
            let run = blik_run { progress: Some(stop), progress_user: user, ..blik_run::default() };
            let status = blik_coupling_create(scene, &settings, &run, &mut error, &mut coupling);
            assert_eq!((status, calls.0), (BLIK_ERROR_CANCELLED, 3));
            assert!(coupling.is_null());
            calls = (0, 0.0);
            let run = blik_run { progress: Some(watch), ..run };
            done(blik_coupling_create(scene, &settings, &run, &mut error, &mut coupling), &error);
            assert!(calls.0 >= 4 && (calls.1 - 1.0).abs() < 1e-9, "{calls:?}");
            blik_coupling_destroy(coupling);
            blik_scene_destroy(scene);
        }
    });
}

#[test]
fn form_factors_need_no_scene() {
    let square = |z: f64, up: bool| {
        let corners = [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]];
        let mut corners = corners.as_flattened().to_vec();
        if !up {
            corners = corners.chunks(3).rev().flatten().copied().collect();
        }
        corners
    };
    let (low, high) = (square(0.0, true), square(1.0, false));
    let mut error = blik_error::default();
    let (mut factor, mut area, mut visible, mut estimate) = (0.0, 0.0, 0.0, 0.0);
    let occluder = [-1.0, -1.0, 0.5, 4.0, -1.0, 0.5, -1.0, 4.0, 0.5];
    let mut scratch = vec![0u8; blik_form_factor_scratch_size(64)];
    // SAFETY: arrays as long as stated.
    unsafe {
        let (a, b) = (low.as_ptr(), high.as_ptr());
        done(blik_form_factor_polygon(a, 4, b, 4, &mut error, &mut factor, &mut area), &error);
        let (memory, size) = (scratch.as_mut_ptr().cast(), scratch.len());
        let o = occluder.as_ptr();
        let status = blik_form_factor_visible(
            a,
            4,
            b,
            4,
            o,
            1,
            1e-4,
            memory,
            size,
            &mut error,
            &mut visible,
            &mut estimate,
        );
        done(status, &error);
        let mut albedo = 0.0;
        done(blik_gloss(10.0, 1.0, 1.0, &mut error, &mut albedo, null_mut()), &error);
        assert!(albedo > 0.9 && albedo <= 1.0, "{albedo}");
    }
    // two opposed unit squares at distance 1 (Hottel)
    assert!((factor - 0.199_824_895_7).abs() < 1e-9 && (area - factor).abs() < 1e-12, "{factor}");
    assert!(visible <= estimate, "all hidden: {visible}");
}
