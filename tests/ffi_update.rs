//! Couplings that are kept, through the C interface: the light of one from scratch, the same bits in any memory that suffices and
//! on any number of lanes; refused calls name the facet or the part.

use blik::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

const BANDS: usize = 2;

/// A body and a panel beside it, of two facets each on every side: part 0 of material 0, part 1 of material 1.
struct Craft {
    vertices: Vec<[f64; 3]>,
    facets: Vec<[u32; 3]>,
    parts: Vec<u32>,
}

fn craft() -> Craft {
    let mut craft = Craft { vertices: Vec::new(), facets: Vec::new(), parts: Vec::new() };
    for (part, low, high) in [(0, [-1.0; 3], [1.0; 3]), (1, [-0.9, 1.5, -0.05], [0.9, 4.0, 0.05])] {
        let start = craft.vertices.len() as u32;
        let corner = |k: u32| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] });
        craft.vertices.extend((0..8).map(corner));
        for [a, b, c, d] in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        {
            craft.facets.extend([[a, b, c], [a, c, d]].map(|f| f.map(|v: u32| start + v)));
            craft.parts.extend([part; 2]);
        }
    }
    craft
}

fn array<T>(values: &[T], format: i32) -> blik_array {
    blik_array { data: values.as_ptr().cast(), count: values.len(), stride: 0, format }
}

#[track_caller]
fn done(status: i32, error: &blik_error) {
    assert_eq!(status, BLIK_OK, "{error:?}");
}

/// Reflectances of the body and the panel.
#[derive(Clone, Copy)]
struct Finish {
    diffuse: [[f64; BANDS]; 2],
    specular: [[f64; BANDS]; 2],
}

const FINISH: Finish = Finish { diffuse: [[0.5, 0.3], [0.2, 0.4]], specular: [[0.0, 0.0], [0.4, 0.2]] };

/// Calls `with` with the mesh as C has it.
fn with_mesh<R>(craft: &Craft, finish: &Finish, with: impl FnOnce(&blik_mesh) -> R) -> R {
    let material = |k: usize| blik_material {
        diffuse: finish.diffuse[k].as_ptr(),
        specular: finish.specular[k].as_ptr(),
        emission: null(),
        gloss_axis_ratio: 0.0,
        gloss_rays: 0,
    };
    let materials = [material(0), material(1)];
    with(&blik_mesh {
        vertices: array(&craft.vertices, BLIK_F64),
        facets: array(&craft.facets, BLIK_U32),
        facet_materials: array(&craft.parts, BLIK_U32),
        materials: materials.as_ptr(),
        material_count: 2,
        bands: BANDS,
        ..blik_mesh::default()
    })
}

fn parts_of(facets: &[u32], poses: &[blik_pose]) -> blik_parts {
    blik_parts {
        facet_parts: facets.as_ptr(),
        facet_count: facets.len(),
        poses: poses.as_ptr(),
        pose_count: poses.len(),
        ..blik_parts::default()
    }
}

fn pose(quaternion: [f64; 4], translation: [f64; 3]) -> blik_pose {
    let (mut error, mut pose) =
        (blik_error::default(), blik_pose { rotation: [0.0; 9], translation: [0.0; 3] });
    // SAFETY: arrays as long as stated.
    let status = unsafe {
        blik_pose_from_quaternion(quaternion.as_ptr(), translation.as_ptr(), &mut error, &mut pose)
    };
    done(status, &error);
    pose
}

const REST: blik_pose =
    blik_pose { rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], translation: [0.0; 3] };

/// Turned about the y axis.
fn turned(angle: f64) -> blik_pose {
    pose([(0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0], [0.0; 3])
}

fn scene(craft: &Craft, finish: &Finish, parts: Option<&blik_parts>) -> *mut blik_scene {
    let (mut error, mut scene) = (blik_error::default(), null_mut());
    let status = with_mesh(craft, finish, |mesh| {
        // SAFETY: all pointers are to values that live during the call.
        unsafe {
            match parts {
                None => blik_scene_create(mesh, &mut error, &mut scene),
                Some(parts) => blik_scene_pose_create(mesh, parts, &mut error, &mut scene),
            }
        }
    });
    done(status, &error);
    scene
}

fn coupling(scene: *const blik_scene) -> *mut blik_coupling {
    let settings = blik_settings { tolerance: 1e-2, ..blik_settings::default() };
    let (mut error, mut coupling) = (blik_error::default(), null_mut());
    // SAFETY: all pointers are to values above.
    let status = unsafe { blik_coupling_create(scene, &settings, null(), &mut error, &mut coupling) };
    done(status, &error);
    coupling
}

/// Radiant intensity and its expected error, by band.
fn signature(coupling: *const blik_coupling) -> Vec<[f64; 2]> {
    let (direction, irradiance) = ([0.3, -0.5, -0.8], [3.0, 2.0]);
    let sun = blik_sun { direction: [0.2, 0.1, 1.0], irradiance: irradiance.as_ptr(), ..blik_sun::default() };
    let light = blik_light { sun: &sun, ..blik_light::default() };
    // SAFETY: all are numbers.
    let mut out: [blik_signature; BANDS] = unsafe { std::mem::zeroed() };
    let mut error = blik_error::default();
    // SAFETY: arrays as long as stated.
    let status = unsafe {
        blik_lights(
            coupling,
            &light,
            1,
            size_of::<blik_light>(),
            direction.as_ptr(),
            1,
            0,
            null(),
            null_mut(),
            0,
            &mut error,
            null_mut(),
            0,
            null_mut(),
            0,
            out.as_mut_ptr(),
            BANDS,
            size_of::<blik_signature>(),
        )
    };
    done(status, &error);
    out.iter().map(|s| [s.radiant_intensity, s.error_estimate]).collect()
}

fn info(coupling: *const blik_coupling) -> blik_update_info {
    let (mut error, mut info) = (blik_error::default(), blik_update_info::default());
    // SAFETY: all pointers are to values above.
    done(unsafe { blik_update_get_info(coupling, &mut error, &mut info) }, &error);
    info
}

fn destroy(coupling: *mut blik_coupling, scene: *mut blik_scene) {
    // SAFETY: made by the library, and used no more.
    unsafe {
        blik_coupling_destroy(coupling);
        blik_scene_destroy(scene);
    }
}

#[test]
fn poses_and_materials_are_as_from_scratch_in_any_memory() {
    let craft = craft();
    let base = scene(&craft, &FINISH, None);
    let kept = coupling(base);
    let all = info(kept);
    assert!(all.kept == 0 && all.redone > 0 && all.rays > 0);
    let other = Finish { diffuse: [[0.3, 0.6], [0.3, 0.4]], ..FINISH };
    let dimmer = Finish { specular: [[0.0, 0.0], [0.2, 0.2]], ..FINISH };
    for (name, poses, finish) in [
        ("rest", Some([REST, REST]), FINISH),
        ("turned", Some([REST, turned(0.7)]), FINISH),
        ("turned, of other materials", Some([REST, turned(2.0)]), other),
        ("all moved", Some([turned(1.0), turned(1.0)]), FINISH),
        ("diffuse", None, other),
        ("mirror", None, dimmer),
    ] {
        let parts = poses.as_ref().map(|poses| parts_of(&craft.parts, poses));
        let at = parts.as_ref().map_or(null(), std::ptr::from_ref);
        let own = scene(&craft, &finish, parts.as_ref());
        let scratch = coupling(own);
        let wanted = signature(scratch);
        let (mut error, mut made) = (blik_error::default(), null_mut());
        // SAFETY: all pointers are to values above.
        done(unsafe { blik_update_create(kept, own, at, null(), &mut error, &mut made) }, &error);
        let (found, numbers) = (signature(made), info(made));
        println!("{name}: {numbers:?}");
        for ([a, ea], [b, eb]) in found.iter().zip(&wanted) {
            assert!((a - b).abs() <= ea + eb, "{name}: {a} +- {ea}, {b} +- {eb}");
        }
        let unmoved = poses.is_none_or(|[a, b]| a.rotation == b.rotation);
        assert!((numbers.redone == 0) == unmoved && (numbers.rays == 0) == unmoved, "{name}: {numbers:?}");
        assert!((numbers.rescaled > 0) == (name == "mirror"), "{name}: {numbers:?}");
        // in memory of the caller, as little as it takes
        let mut size = 0;
        // SAFETY: all pointers are to values above.
        done(unsafe { blik_update_size(kept, own, at, &mut error, &mut size) }, &error);
        for lanes in [1, 3] {
            let mut size = size;
            loop {
                let mut memory = vec![0xa5u8; size];
                let mut again = null_mut();
                let run = blik_run { parallel: Some(blik_run_on_threads), lanes, ..blik_run::default() };
                let to = memory.as_mut_ptr().cast::<c_void>();
                // SAFETY: memory as long as stated, which outlives the coupling.
                let status =
                    unsafe { blik_update_init(kept, own, at, &run, to, size, &mut error, &mut again) };
                if status == BLIK_ERROR_BUFFER_TOO_SMALL {
                    assert!(error.needed > size, "{name}: {error:?}");
                    size = error.needed;
                    continue;
                }
                done(status, &error);
                assert!(signature(again) == found, "{name}: {lanes} lanes");
                assert_eq!(info(again).redone, numbers.redone);
                // SAFETY: the memory is dropped afterwards.
                unsafe { blik_coupling_destroy(again) };
                break;
            }
        }
        let mut few = vec![0u8; 1000];
        let (to, mut again) = (few.as_mut_ptr().cast(), null_mut());
        // SAFETY: memory as long as stated.
        let status = unsafe { blik_update_init(kept, own, at, null(), to, 1000, &mut error, &mut again) };
        assert!(status == BLIK_ERROR_BUFFER_TOO_SMALL && again.is_null());
        // SAFETY: the scene goes last.
        unsafe { blik_coupling_destroy(made) };
        destroy(scratch, own);
    }
    destroy(kept, base);
}

#[test]
fn what_is_wrong_with_parts_and_scenes_is_named() {
    let craft = craft();
    let base = scene(&craft, &FINISH, None);
    let kept = coupling(base);
    let mut error = blik_error::default();
    let mut refused = |parts: &blik_parts| {
        let mut made = null_mut();
        // SAFETY: all pointers are to values that live during the call.
        let status = with_mesh(&craft, &FINISH, |mesh| unsafe {
            blik_scene_pose_create(mesh, parts, &mut error, &mut made)
        });
        assert!(made.is_null());
        (status, error.index, error.field)
    };
    let mut long = REST;
    long.rotation[4] = 1.1;
    let (facets, two) = (&craft.parts[..], [REST, REST]);
    assert_eq!(refused(&parts_of(&facets[1..], &two)), (BLIK_ERROR_LENGTH, 0, BLIK_FIELD_PARTS));
    assert_eq!(refused(&parts_of(facets, &two[..1])), (BLIK_ERROR_PART, 12, BLIK_FIELD_NONE));
    assert_eq!(refused(&parts_of(facets, &[REST, long])), (BLIK_ERROR_POSE, 1, BLIK_FIELD_NONE));
    let absent = blik_parts { poses: null(), ..parts_of(facets, &two) };
    assert_eq!(refused(&absent), (BLIK_ERROR_NULL, 0, BLIK_FIELD_PARTS));
    let short = blik_parts { struct_size: 8, ..parts_of(facets, &two) };
    assert_eq!(refused(&short).0, BLIK_ERROR_STRUCT_SIZE);
    let zero = [0.0; 4];
    let mut pose = REST;
    // SAFETY: arrays as long as stated.
    let status = unsafe { blik_pose_from_quaternion(zero.as_ptr(), zero.as_ptr(), &mut error, &mut pose) };
    assert!(status == BLIK_ERROR_POSE && pose.rotation == REST.rotation);
    // a scene whose parts stand where the call does not say
    let (poses, others) = ([REST, turned(0.5)], [REST, turned(0.6)]);
    let posed = scene(&craft, &FINISH, Some(&parts_of(facets, &poses)));
    for parts in [null(), &raw const *Box::leak(Box::new(parts_of(facets, &others)))] {
        let mut made = null_mut();
        // SAFETY: all pointers are to values above.
        let status = unsafe { blik_update_create(kept, posed, parts, null(), &mut error, &mut made) };
        assert!(status == BLIK_ERROR_HANDLE && made.is_null());
    }
    let fewer = Craft { facets: craft.facets[1..].to_vec(), parts: facets[1..].to_vec(), ..craft };
    let other = scene(&fewer, &FINISH, None);
    let mut made = null_mut();
    // SAFETY: all pointers are to values above.
    unsafe {
        let status = blik_update_create(kept, other, null(), null(), &mut error, &mut made);
        assert!(status == BLIK_ERROR_HANDLE && made.is_null());
        assert_eq!(blik_update_create(null(), other, null(), null(), &mut error, &mut made), BLIK_ERROR_NULL);
        let none = other.cast::<blik_coupling>();
        assert_eq!(blik_update_create(none, other, null(), null(), &mut error, &mut made), BLIK_ERROR_HANDLE);
        blik_scene_destroy(other);
        blik_scene_destroy(posed);
    }
    destroy(kept, base);
}
