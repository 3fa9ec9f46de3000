//! The counted work again by way of the C interface, in the caller's memory, as a program in C would have it done: what
//! the calls cost beside the kernel's own work.

use crate::scene::{Case, EYE, camera};
use blik::*;
use std::hint::black_box;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

/// What is counted, and what it is compared with.
pub const PAIRS: [(&str, &str); 4] =
    [("c_geometry", "geometry"), ("c_light", "light"), ("c_image", "image"), ("c_signature", "signature")];

/// Asks for a size.
fn size(of: impl FnOnce(*mut usize) -> i32) -> Vec<u8> {
    let mut bytes = 0;
    assert_eq!(of(&mut bytes), BLIK_OK);
    vec![0; bytes]
}

/// Where the handles stand.
#[derive(Default)]
struct Memory {
    scene: Vec<u8>,
    coupling: Vec<u8>,
    solution: Vec<u8>,
}

/// Calls `step` before each work; the work is `counted_NAME`.
pub fn run(case: &Case, pixels: usize, step: fn()) {
    let mut memory = Memory { coupling: vec![0; 64 << 20], ..Memory::default() };
    case.with_input(|input| {
        let material = |m: &blik_kernel::scene::MaterialInput<'_>| blik_material {
            diffuse: m.diffuse.as_ptr(),
            specular: m.specular.as_ptr(),
            emission: m.emission.as_ptr(),
            gloss_axis_ratio: 0.0,
            gloss_rays: 0,
        };
        let materials: Vec<blik_material> = input.materials.iter().map(material).collect();
        let array = |data, count, format| blik_array { data, count, stride: 0, format };
        let mesh = blik_mesh {
            vertices: array(input.vertices.as_ptr().cast(), input.vertices.len(), BLIK_F64),
            facets: array(input.facets.as_ptr().cast(), input.facets.len(), BLIK_U32),
            facet_materials: array(
                input.facet_materials.as_ptr().cast(),
                input.facet_materials.len(),
                BLIK_U32,
            ),
            materials: materials.as_ptr(),
            material_count: materials.len(),
            bands: input.bands,
            ..blik_mesh::default()
        };
        // SAFETY: all arrays outlive the calls, and memory is as large as asked.
        memory.scene = size(|bytes| unsafe { blik_scene_size(&mesh, null_mut(), bytes) });
        let settings = blik_settings { tolerance: case.settings.tolerance, ..blik_settings::default() };
        step();
        let coupling = counted_c_geometry(&mesh, &settings, &mut memory);
        let ground = vec![0.1; input.bands];
        let sky = blik_sky { model: BLIK_SKY_OVERCAST, ground: ground.as_ptr(), ..blik_sky::default() };
        let irradiance = vec![2.0; input.bands];
        let sun =
            blik_sun { direction: [0.3, 0.2, 1.0], irradiance: irradiance.as_ptr(), ..blik_sun::default() };
        let light = blik_light { sky: &sky, sun: &sun, ..blik_light::default() };
        // SAFETY: as above.
        memory.solution = size(|bytes| unsafe { blik_solution_size(coupling, &light, null_mut(), bytes) });
        step();
        let solution = counted_c_light(coupling, &light, &mut memory.solution);
        step();
        counted_c_image(solution, pixels);
        step();
        counted_c_signature(solution);
    });
}

#[inline(never)]
fn counted_c_geometry(
    mesh: &blik_mesh,
    settings: &blik_settings,
    memory: &mut Memory,
) -> *const blik_coupling {
    let (mut scene, mut coupling) = (null_mut(), null_mut());
    let (own, rows) = (&mut memory.scene, &mut memory.coupling);
    // SAFETY: memory outlives the handles.
    unsafe {
        let status = blik_scene_init(mesh, own.as_mut_ptr().cast(), own.len(), null_mut(), &mut scene);
        assert_eq!(status, BLIK_OK);
        let place = rows.as_mut_ptr().cast();
        let status =
            blik_coupling_init(scene, settings, null(), place, rows.len(), null_mut(), &mut coupling);
        assert_eq!(status, BLIK_OK);
    }
    coupling
}

#[inline(never)]
fn counted_c_light(
    coupling: *const blik_coupling,
    light: &blik_light,
    memory: &mut [u8],
) -> *const blik_solution {
    let mut solution = null_mut();
    let place = memory.as_mut_ptr().cast();
    // SAFETY: memory outlives the handle.
    let status = unsafe {
        blik_solution_init(coupling, light, null(), place, memory.len(), null_mut(), &mut solution)
    };
    assert_eq!(status, BLIK_OK);
    solution
}

#[inline(never)]
fn counted_c_image(solution: *const blik_solution, pixels: usize) {
    let mut view: blik_camera = blik_camera::default();
    let input = camera(EYE, 2.6, pixels);
    (view.eye, view.target, view.up, view.height) = (input.eye, input.target, input.up, 2.6);
    (view.columns, view.rows) = (pixels, pixels);
    let mut image = vec![0.0f32; pixels * pixels];
    // SAFETY: a live handle, and arrays as long as said.
    unsafe {
        let mut scratch = size(|bytes| blik_image_scratch_size(solution, &view, null(), null_mut(), bytes));
        let (place, bytes) = (scratch.as_mut_ptr().cast(), scratch.len());
        let (count, to) = (image.len(), image.as_mut_ptr());
        let mut tally = blik_tally::default();
        let mut report = blik_report::default();
        let status = blik_image(
            solution,
            &view,
            null(),
            place,
            bytes,
            null_mut(),
            to,
            count,
            null_mut(),
            0,
            &mut tally,
        );
        assert_eq!(status, BLIK_OK);
        assert_eq!(blik_get_report(solution, &tally, null_mut(), &mut report), BLIK_OK);
    }
    black_box(image);
}

#[inline(never)]
fn counted_c_signature(solution: *const blik_solution) {
    let direction = [-1.0, -0.5, -2.0];
    let mut signature = MaybeUninit::uninit();
    // SAFETY: a live handle; one direction and one band.
    let status = unsafe {
        let (at, to) = (direction.as_ptr(), signature.as_mut_ptr());
        blik_signatures(
            solution,
            at,
            1,
            0,
            null(),
            null_mut(),
            0,
            null_mut(),
            to,
            1,
            size_of::<blik_signature>(),
        )
    };
    assert_eq!(status, BLIK_OK);
    // SAFETY: written.
    black_box(unsafe { signature.assume_init() });
}
