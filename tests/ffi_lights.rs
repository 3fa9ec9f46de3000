//! Many lights through the C interface: the bits of one by one, on any number of lanes and in any memory that suffices; refused
//! calls name the light and the facet.

use blik::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// A floor, a mirror wall beside it and a facet of no area.
const VERTICES: [[f64; 3]; 6] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [0., 1., 1.]];
const FACETS: [[u32; 3]; 5] = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4], [1, 1, 2]];
const MATERIALS: [u32; 5] = [0, 0, 1, 1, 0];
const BANDS: usize = 2;
const VALUES: usize = FACETS.len() * BANDS;

fn array<T>(values: &[T], format: i32) -> blik_array {
    blik_array { data: values.as_ptr().cast(), count: values.len(), stride: 0, format }
}

#[track_caller]
fn done(status: i32, error: &blik_error) {
    assert_eq!(status, BLIK_OK, "{error:?}");
}

/// A coupling whose handles live until the end of the test.
fn coupling(wall_diffuse: f64) -> *mut blik_coupling {
    let (floor, wall, mirror) = ([0.5, 0.4], [wall_diffuse; 2], [0.6, 0.7]);
    let none = blik_material {
        diffuse: null(),
        specular: null(),
        emission: null(),
        gloss_axis_ratio: 0.0,
        gloss_rays: 0,
    };
    let materials = [
        blik_material { diffuse: floor.as_ptr(), ..none },
        blik_material { diffuse: wall.as_ptr(), specular: mirror.as_ptr(), ..none },
    ];
    let mesh = blik_mesh {
        vertices: array(&VERTICES, BLIK_F64),
        facets: array(&FACETS, BLIK_U32),
        facet_materials: array(&MATERIALS, BLIK_U32),
        materials: materials.as_ptr(),
        material_count: 2,
        bands: BANDS,
        ..blik_mesh::default()
    };
    let settings = blik_settings { tolerance: 2e-2, ..blik_settings::default() };
    let (mut error, mut scene, mut coupling) = (blik_error::default(), null_mut(), null_mut());
    // SAFETY: all pointers are to values above.
    unsafe {
        done(blik_scene_create(&mesh, &mut error, &mut scene), &error);
        done(blik_coupling_create(scene, &settings, null(), &mut error, &mut coupling), &error);
    }
    coupling
}

const DIRECTIONS: [f64; 6] = [-0.3, 0.1, -1.0, -1.0, 0.0, -0.4];

/// What a call with all outputs wrote.
#[derive(Clone, Debug, PartialEq)]
struct Written {
    irradiance: Vec<f64>,
    radiance: Vec<f64>,
    signatures: Vec<[f64; 7]>,
}

fn numbers(signatures: &[blik_signature]) -> Vec<[f64; 7]> {
    let of = |s: &blik_signature| {
        [
            s.radiant_intensity,
            s.projected_area,
            s.mean_radiance,
            s.background,
            s.contrast,
            s.error_estimate,
            s.unresolved_glints,
        ]
    };
    signatures.iter().map(of).collect()
}

/// The call in this memory (the library's own where there is none); the status and what was written.
fn many(
    coupling: *const blik_coupling,
    lights: &[blik_light],
    lanes: usize,
    memory: Option<&mut [u8]>,
) -> (i32, blik_error, Written) {
    let run = blik_run { parallel: Some(blik_run_on_threads), lanes, ..blik_run::default() };
    let mut error = blik_error::default();
    let (mut irradiance, mut radiance) =
        (vec![f64::NAN; lights.len() * VALUES], vec![f64::NAN; lights.len() * VALUES]);
    // SAFETY: all are numbers.
    let mut signatures: Vec<blik_signature> = vec![unsafe { std::mem::zeroed() }; lights.len() * 2 * BANDS];
    let (scratch, size) = memory.map_or((null_mut(), 0), |m| (m.as_mut_ptr().cast::<c_void>(), m.len()));
    // SAFETY: arrays as long as stated.
    let status = unsafe {
        blik_lights(
            coupling,
            lights.as_ptr(),
            lights.len(),
            size_of::<blik_light>(),
            DIRECTIONS.as_ptr(),
            2,
            0,
            &run,
            scratch,
            size,
            &mut error,
            irradiance.as_mut_ptr(),
            irradiance.len(),
            radiance.as_mut_ptr(),
            radiance.len(),
            signatures.as_mut_ptr(),
            signatures.len(),
            size_of::<blik_signature>(),
        )
    };
    (status, error, Written { irradiance, radiance, signatures: numbers(&signatures) })
}

fn one_by_one(coupling: *const blik_coupling, lights: &[blik_light]) -> Written {
    let mut all = Written { irradiance: vec![], radiance: vec![], signatures: vec![] };
    for light in lights {
        let (mut error, mut solution) = (blik_error::default(), null_mut());
        let (mut e, mut l) = (vec![0.0; VALUES], vec![0.0; VALUES]);
        // SAFETY: all are numbers.
        let mut signatures: [blik_signature; 2 * BANDS] = unsafe { std::mem::zeroed() };
        // SAFETY: arrays as long as stated.
        unsafe {
            done(blik_solution_create(coupling, light, null(), &mut error, &mut solution), &error);
            let (to_e, to_l) = (e.as_mut_ptr(), l.as_mut_ptr());
            let status = blik_facets(solution, 0, 5, &mut error, null_mut(), 0, to_e, VALUES, to_l, VALUES);
            done(status, &error);
            let (at, stride) = (signatures.as_mut_ptr(), size_of::<blik_signature>());
            let status = blik_signatures(
                solution,
                DIRECTIONS.as_ptr(),
                2,
                0,
                null(),
                null_mut(),
                0,
                &mut error,
                at,
                4,
                stride,
            );
            done(status, &error);
            blik_solution_destroy(solution);
        }
        all.irradiance.append(&mut e);
        all.radiance.append(&mut l);
        all.signatures.append(&mut numbers(&signatures));
    }
    all
}

/// Lights of all kinds: three with the same sky, an emission, none at all.
fn with_lights<R>(with: impl FnOnce(&[blik_light]) -> R) -> R {
    let sky = blik_sky { model: BLIK_SKY_OVERCAST, ..blik_sky::default() };
    let suns = [[1.0, 0.3, 1.0], [0.2, 0.1, 1.0]].map(|direction| blik_sun {
        direction,
        half_angle_deg: 0.5,
        ..blik_sun::default()
    });
    let emission: Vec<f64> = (0..VALUES).map(|n| 0.25 * (n % 4) as f64).collect();
    let reference = [2.0, 1.0];
    let none = blik_light::default();
    let emitting = blik_light { emission: emission.as_ptr(), emission_count: VALUES, ..none };
    let skies = suns.each_ref().map(|sun| blik_light { sky: &sky, sun, ..none });
    let referred = blik_light { reference_radiance: reference.as_ptr(), ..skies[0] };
    with(&[skies[0], skies[1], blik_light { sky: &sky, ..emitting }, emitting, none, referred])
}

#[test]
fn many_lights_have_the_bits_of_one_by_one() {
    let coupling = coupling(0.1);
    with_lights(|lights| {
        let expected = one_by_one(coupling, lights);
        assert!(expected.irradiance.iter().any(|e| *e > 0.1));
        for lanes in [1, 2, 5] {
            let (status, error, written) = many(coupling, lights, lanes, None);
            done(status, &error);
            assert!(written == expected, "{lanes} lanes");
        }
        let (mut error, mut bytes) = (blik_error::default(), 0);
        let stride = size_of::<blik_light>();
        // SAFETY: valid pointers.
        let status = unsafe {
            blik_lights_scratch_size(
                coupling,
                lights.as_ptr(),
                lights.len(),
                stride,
                null(),
                &mut error,
                &mut bytes,
            )
        };
        done(status, &error);
        // one lane's memory at any address is enough, also for several lanes; a byte less is not
        let mut memory = vec![0xa5; bytes + 1];
        for (start, lanes) in [(0, 1), (1, 3)] {
            let (status, error, written) =
                many(coupling, lights, lanes, Some(&mut memory[start..start + bytes]));
            done(status, &error);
            assert!(written == expected, "{lanes} lanes in the caller's memory");
        }
        let (status, error, _) = many(coupling, lights, 1, Some(&mut memory[..bytes - 1]));
        assert_eq!((status, error.needed, error.given), (BLIK_ERROR_BUFFER_TOO_SMALL, bytes, bytes - 1));
        let (status, _, written) = many(coupling, &[], 2, None);
        assert_eq!((status, written.irradiance.len(), written.signatures.len()), (BLIK_OK, 0, 0));
    });
}

#[test]
fn lights_of_an_older_header_are_read() {
    let coupling = coupling(0.1);
    with_lights(|lights| {
        let older = std::mem::offset_of!(blik_light, emission);
        let expected = one_by_one(coupling, &lights[..1]);
        let mut light = lights[0];
        light.struct_size = older;
        // as that program has it: nothing beyond
        (light.emission, light.emission_count) = (std::ptr::dangling(), 77);
        let (status, error, written) = many(coupling, &[light], 1, None);
        done(status, &error);
        assert!(written == expected);
    });
}

#[test]
fn refused_calls_name_the_light_and_the_facet() {
    let coupling = coupling(0.0);
    with_lights(|lights| {
        let refused = |number: usize, light: blik_light| {
            let mut all = lights.to_vec();
            // facets of the mirror emit nothing: it neither reflects diffusely nor emits
            all.retain(|light| light.emission.is_null());
            all.insert(number, light);
            let (status, error, written) = many(coupling, &all, 2, None);
            assert_eq!(error.status, status);
            assert!(written.irradiance.iter().all(|e| e.is_nan()), "found before anything is written");
            error
        };
        let emission = |at: usize, value: f64| {
            let mut emission = vec![0.0; VALUES];
            emission[at] = value;
            emission
        };
        let none = blik_light::default();
        for (number, at, value, status) in [
            (0, 3, -1.0, BLIK_ERROR_RANGE),
            (2, 3, f64::NAN, BLIK_ERROR_RANGE),
            (1, 4, 1.0, BLIK_ERROR_UNCOUPLED),
        ] {
            let values = emission(at, value);
            let light = blik_light { emission: values.as_ptr(), emission_count: VALUES, ..none };
            let error = refused(number, light);
            assert_eq!((error.status, error.field), (status, BLIK_FIELD_EMISSION));
            assert_eq!((error.index, error.given), (at / BANDS, number), "facet and light");
        }
        let values = emission(0, 1.0);
        let error = refused(1, blik_light { emission: values.as_ptr(), emission_count: 3, ..none });
        assert_eq!((error.status, error.field, error.index), (BLIK_ERROR_LENGTH, BLIK_FIELD_EMISSION, 1));
        assert_eq!((error.needed, error.given), (VALUES, 3));
        let error = refused(1, blik_light { emission_count: 3, ..none });
        assert_eq!((error.status, error.field, error.index), (BLIK_ERROR_NULL, BLIK_FIELD_EMISSION, 1));
        let sun = blik_sun { direction: [0.0; 3], ..blik_sun::default() };
        let error = refused(2, blik_light { sun: &sun, ..none });
        assert_eq!((error.status, error.field), (BLIK_ERROR_DIRECTION, BLIK_FIELD_SUN_DIRECTION));
        assert_eq!(error.index, 2);
        let mut short = none;
        short.struct_size = 8;
        assert_eq!(refused(0, short).status, BLIK_ERROR_STRUCT_SIZE);
        let mut error = blik_error::default();
        for stride in [0, 8, size_of::<blik_light>() - 1, size_of::<blik_light>() + 1] {
            let mut bytes = 0;
            // SAFETY: valid pointers.
            let status = unsafe {
                blik_lights_scratch_size(coupling, lights.as_ptr(), 1, stride, null(), &mut error, &mut bytes)
            };
            // the older struct's size is one, too
            assert_eq!(status, BLIK_ERROR_STRUCT_SIZE, "{stride}");
        }
    });
}
