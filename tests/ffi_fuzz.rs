//! Baked blocks give the same bits as what they were baked from, and hostile ones are refused or do no harm; no numbers
//! that a caller may hand over make the interface panic or give NaN; nor does memory that is refused. Seeded: every run tries the same; with
//! `BLIK_FUZZ_SECONDS` it goes on for so long.

#[path = "stress/ffi_faults.rs"]
mod faults;

use blik::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::time::{Duration, Instant};

/// Memory on the boundary of blocks.
#[derive(Clone)]
struct Lines(Vec<Line>);

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Line([u64; 8]);

impl Lines {
    fn new(bytes: usize) -> Lines {
        Lines(vec![Line([0; 8]); bytes.div_ceil(64)])
    }

    fn at(&mut self) -> *mut u8 {
        assert!(self.0.iter().take(1).all(|line| line.0.as_ptr().align_offset(BLIK_BLOCK_ALIGNMENT) == 0));
        self.0.as_mut_ptr().cast()
    }

    fn bytes(&mut self, size: usize) -> &mut [u8] {
        // SAFETY: there are as many bytes.
        unsafe { std::slice::from_raw_parts_mut(self.at(), size) }
    }
}

/// xorshift64*
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() >> 33) as usize % count
    }

    /// A number that programs trip over, or an ordinary one.
    fn number(&mut self) -> f64 {
        const ODD: [f64; 16] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            1e37,
            1e-37,
            1e150,
            -1e300,
            0.5,
            2.0,
        ];
        match self.below(4) {
            0 => ODD[self.below(ODD.len())],
            1 => f64::from_bits(self.next()),
            _ => (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0,
        }
    }
}

/// Vertices and facets of a floor, a mirror wall and a facet of no area.
const VERTICES: [[f64; 3]; 6] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [0., 1., 1.]];
const FACETS: [[u32; 3]; 5] = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4], [1, 1, 2]];
const MATERIALS: [u32; 5] = [0, 0, 1, 1, 0];

/// The inputs of a run, to be changed at will.
#[derive(Clone, Debug)]
struct Inputs {
    vertices: Vec<[f64; 3]>,
    facets: Vec<[u32; 3]>,
    facet_materials: Vec<u32>,
    values: [[f64; 2]; 6],
    gloss: [f64; 2],
    gloss_rays: u32,
    tolerance: f64,
    max_bounces: i32,
    radiance: [f64; 2],
    model: i32,
    up: [f64; 3],
    sun: [f64; 3],
    half_angle: f64,
    camera: [f64; 10],
    choices: [i32; 3],
    /// The light's emission, of five facets, two sides and two bands at most; all 0: the materials'.
    emission: [f64; 20],
}

impl Inputs {
    fn new() -> Inputs {
        Inputs {
            vertices: VERTICES.to_vec(),
            facets: FACETS.to_vec(),
            facet_materials: MATERIALS.to_vec(),
            values: [[0.5, 0.4], [0.0, 0.0], [0.0, 0.1], [0.1, 0.1], [0.5, 0.8], [0.0, 0.0]],
            gloss: [0.0, 0.0],
            gloss_rays: 0,
            tolerance: 0.1,
            max_bounces: -1,
            radiance: [1.0, 0.5],
            model: BLIK_SKY_OVERCAST,
            up: [0.0, 0.0, 1.0],
            sun: [1.0, 0.5, 2.0],
            half_angle: 0.2665,
            camera: [3.0, 0.5, 2.0, 0.5, 0.5, 0.3, 0.0, 0.0, 1.0, 2.0],
            choices: [0, 0, 0],
            emission: [0.0; 20],
        }
    }

    /// Changes some of it.
    fn spoil(&mut self, random: &mut Random) {
        for _ in 0..1 + random.below(3) {
            let x = random.number();
            let odd = [0, 1, 5, 6, 7, 1000, u32::MAX, 1 << 31][random.below(8)];
            match random.below(14) {
                0 => self.vertices[random.below(6)][random.below(3)] = x,
                1 => self.facets[random.below(5)][random.below(3)] = odd,
                2 => self.facet_materials[random.below(5)] = odd,
                3 => self.values[random.below(6)][random.below(2)] = x,
                4 => self.gloss[random.below(2)] = x.abs() * 20.0,
                5 => self.gloss_rays = odd,
                6 => self.max_bounces = odd as i32,
                7 => self.radiance[random.below(2)] = x,
                8 => self.model = random.below(8) as i32 - 1,
                9 => self.up[random.below(3)] = x,
                10 => self.sun[random.below(3)] = x,
                11 => self.half_angle = x,
                12 => self.emission[random.below(20)] = x.abs(),
                _ => match random.below(3) {
                    0 => self.choices[random.below(3)] = random.below(4) as i32 - 1,
                    1 => self.tolerance = if x > 0.02 { x } else { -x },
                    _ => self.camera[random.below(10)] = x,
                },
            }
        }
    }
}

/// Handles in memory of the library's own, ended when dropped.
struct Handles {
    scene: *mut blik_scene,
    coupling: *mut blik_coupling,
    solution: *mut blik_solution,
}

impl Drop for Handles {
    fn drop(&mut self) {
        // SAFETY: null or made by create, and used by nobody any more.
        unsafe {
            blik_solution_destroy(self.solution);
            blik_coupling_destroy(self.coupling);
            blik_scene_destroy(self.scene);
        }
    }
}

/// Refused for a reason of the caller's, or done.
#[track_caller]
fn refused(status: i32) -> bool {
    let of_updates = [BLIK_ERROR_UNCOUPLED, BLIK_ERROR_PART, BLIK_ERROR_POSE].contains(&status);
    assert!(of_updates || (BLIK_OK..BLIK_ERROR_INTERNAL).contains(&status), "status {status}");
    status != BLIK_OK
}

/// Where a mesh has a part.
const REST: blik_pose =
    blik_pose { rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], translation: [0.0; 3] };

/// Calls `with` with parts of the inputs' facets, every other one of them, of which the second stands as told.
fn with_parts<R>(inputs: &Inputs, pose: blik_pose, with: impl FnOnce(&blik_parts) -> R) -> R {
    let facets: Vec<u32> = (0..inputs.facets.len() as u32).map(|facet| facet % 2).collect();
    let poses = [REST, pose];
    with(&blik_parts {
        facet_parts: facets.as_ptr(),
        facet_count: facets.len(),
        poses: poses.as_ptr(),
        pose_count: 2,
        ..blik_parts::default()
    })
}

/// A scene of the inputs whose second part is moved, and its coupling by what holds of another's, as far as they go.
fn renewed(kept: *const blik_coupling, inputs: &Inputs, pose: blik_pose) -> Option<Handles> {
    let mut made = Handles { scene: null_mut(), coupling: null_mut(), solution: null_mut() };
    // SAFETY: arrays as long as stated; what their numbers are is what is tested.
    let status = with_parts(inputs, pose, |parts| unsafe {
        match with_mesh(inputs, |mesh| blik_scene_pose_create(mesh, parts, null_mut(), &mut made.scene)) {
            BLIK_OK => blik_update_create(kept, made.scene, parts, null(), null_mut(), &mut made.coupling),
            status => status,
        }
    });
    (!refused(status)).then_some(made)
}

/// The light of `inputs`, handed to `with`.
fn with_light<R>(inputs: &Inputs, with: impl FnOnce(&blik_light) -> R) -> R {
    let mut sky = blik_sky::default();
    (sky.model, sky.radiance, sky.up) = (inputs.model, inputs.radiance.as_ptr(), inputs.up);
    sky.sun_direction = inputs.sun;
    let samples = [1.0f32; 8];
    (sky.table, sky.table_rows, sky.table_columns) = (samples.as_ptr(), 2, 4);
    let mut sun = blik_sun::default();
    (sun.direction, sun.half_angle_deg) = (inputs.sun, inputs.half_angle);
    let mut light = blik_light { sky: &sky, sun: &sun, ..blik_light::default() };
    if inputs.emission.iter().any(|x| *x != 0.0) {
        light.emission = inputs.emission.as_ptr();
        light.emission_count = 4 * inputs.facets.len() / if inputs.choices[2] == 0 { 2 } else { 1 };
    }
    with(&light)
}

/// The mesh of `inputs`, handed to `with`.
fn with_mesh<R>(inputs: &Inputs, with: impl FnOnce(&blik_mesh) -> R) -> R {
    let [d0, s0, e0, d1, s1, e1] = inputs.values.each_ref().map(|v| v.as_ptr());
    let material = |diffuse, specular, emission, ratio| blik_material {
        diffuse,
        specular,
        emission,
        gloss_axis_ratio: ratio,
        gloss_rays: inputs.gloss_rays,
    };
    let materials = [material(d0, s0, e0, inputs.gloss[0]), material(d1, s1, e1, inputs.gloss[1])];
    let mut mesh = blik_mesh::default();
    (mesh.vertices.data, mesh.vertices.count) = (inputs.vertices.as_ptr().cast(), inputs.vertices.len());
    (mesh.facets.data, mesh.facets.count) = (inputs.facets.as_ptr().cast(), inputs.facets.len());
    mesh.facet_materials.data = inputs.facet_materials.as_ptr().cast();
    mesh.facet_materials.count = inputs.facet_materials.len();
    (mesh.materials, mesh.material_count, mesh.bands) = (materials.as_ptr(), 2, 2);
    mesh.two_sided = inputs.choices[2];
    with(&mesh)
}

/// From the inputs to a solution, as far as it goes.
fn prepare(inputs: &Inputs) -> Option<Handles> {
    let mut settings = blik_settings::default();
    (settings.tolerance, settings.max_bounces) = (inputs.tolerance, inputs.max_bounces);
    let mut made = Handles { scene: null_mut(), coupling: null_mut(), solution: null_mut() };
    // SAFETY: arrays as long as stated; what their numbers are is what is tested.
    unsafe {
        if refused(with_mesh(inputs, |mesh| blik_scene_create(mesh, null_mut(), &mut made.scene)))
            || refused(blik_coupling_create(made.scene, &settings, null(), null_mut(), &mut made.coupling))
        {
            return None;
        }
        let lit = |light: &blik_light| {
            blik_solution_create(made.coupling, light, null(), null_mut(), &mut made.solution)
        };
        if refused(with_light(inputs, lit)) {
            return None;
        }
    }
    Some(made)
}

const PIXELS: usize = 6;

/// The pixels that a camera sees, finite all.
fn image(solution: *const blik_solution, inputs: &Inputs) -> Option<Vec<u32>> {
    let mut camera = blik_camera::default();
    let [a, b, c, d, e, f, g, h, i, size] = inputs.camera;
    (camera.eye, camera.target, camera.up) = ([a, b, c], [d, e, f], [g, h, i]);
    (camera.height, camera.fov_deg) = (size, size);
    (camera.projection, camera.sampling) = (inputs.choices[0], inputs.choices[1]);
    (camera.columns, camera.rows) = (PIXELS, PIXELS);
    let mut pixels = vec![0f32; PIXELS * PIXELS * 2];
    let (out, count) = (pixels.as_mut_ptr(), pixels.len());
    // SAFETY: arrays as long as stated.
    let status = unsafe {
        let none = null_mut();
        blik_image(solution, &camera, null(), none, 0, null_mut(), out, count, null_mut(), 0, null_mut())
    };
    if refused(status) {
        return None;
    }
    assert!(pixels.iter().all(|p| p.is_finite()));
    Some(pixels.iter().map(|p| p.to_bits()).collect())
}

/// The light three times in one call: the same finite numbers each time, or refused.
fn lights(coupling: *const blik_coupling, inputs: &Inputs, run: *const blik_run) -> Result<Vec<u64>, i32> {
    let values = 4 * inputs.facets.len() / if inputs.choices[2] == 0 { 2 } else { 1 };
    let (mut e, mut l) = (vec![0.0; 3 * values], vec![0.0; 3 * values]);
    // SAFETY: all are numbers.
    let mut signatures: [blik_signature; 6] = unsafe { std::mem::zeroed() };
    let direction = [-0.3, 0.1, -1.0];
    let status = with_light(inputs, |light| {
        let all = [*light; 3];
        let (sizes, none) = ((size_of::<blik_light>(), size_of::<blik_signature>()), null_mut());
        let (to_e, to_l, to) = (e.as_mut_ptr(), l.as_mut_ptr(), signatures.as_mut_ptr());
        // SAFETY: arrays as long as stated.
        unsafe {
            blik_lights(
                coupling,
                all.as_ptr(),
                3,
                sizes.0,
                direction.as_ptr(),
                1,
                8,
                run,
                none,
                0,
                null_mut(),
                to_e,
                e.len(),
                to_l,
                l.len(),
                to,
                6,
                sizes.1,
            )
        }
    });
    if status == BLIK_ERROR_MEMORY || status == BLIK_ERROR_CANCELLED || refused(status) {
        return Err(status);
    }
    let intensities = signatures.map(|s| s.radiant_intensity);
    let all = e.iter().chain(&l).chain(&intensities);
    assert!(all.clone().all(|x| x.is_finite() && *x >= 0.0), "{inputs:?}");
    assert!(e[..values] == e[values..2 * values] && e[..values] == e[2 * values..], "the same light");
    assert!(intensities[..2] == intensities[4..], "the same light");
    Ok(all.map(|x| x.to_bits()).collect())
}

/// What two signatures are made of: finite, and all of it adds up; or refused.
fn explain(coupling: *const blik_coupling, inputs: &Inputs, run: *const blik_run) -> Result<Vec<u64>, i32> {
    let (facets, sides) = (inputs.facets.len(), if inputs.choices[2] == 0 { 1 } else { 2 });
    let (mut shares, mut terms) = (vec![0.0; 4 * facets], vec![0.0; 12]);
    let (mut diffuse, mut emission) = (vec![0.0; 4 * facets], vec![0.0; 4 * facets * sides]);
    // SAFETY: all are numbers.
    let mut signatures: [blik_signature; 4] = unsafe { std::mem::zeroed() };
    let directions = [-0.3, 0.1, -1.0, 1.0, 0.0, 0.0];
    let status = with_light(inputs, |light| {
        let (none, to) = (null_mut(), signatures.as_mut_ptr());
        let at = [&mut shares, &mut terms, &mut diffuse, &mut emission].map(|x| (x.as_mut_ptr(), x.len()));
        let from = directions.as_ptr();
        let stride = size_of::<blik_signature>();
        // SAFETY: arrays as long as stated.
        unsafe {
            blik_explain(
                coupling,
                light,
                from,
                2,
                8,
                run,
                none,
                0,
                null_mut(),
                to,
                4,
                stride,
                at[0].0,
                at[0].1,
                at[1].0,
                at[1].1,
                at[2].0,
                at[2].1,
                at[3].0,
                at[3].1,
            )
        }
    });
    if status == BLIK_ERROR_MEMORY || status == BLIK_ERROR_CANCELLED || refused(status) {
        return Err(status);
    }
    let all = [&shares[..], &terms, &diffuse, &emission].concat();
    assert!(all.iter().all(|x| x.is_finite()), "{inputs:?}");
    for (number, signature) in signatures.iter().enumerate() {
        let (view, band) = (number / 2, number % 2);
        let own: f64 = (0..facets).map(|facet| shares[2 * (view * facets + facet) + band]).sum();
        let sum: f64 = (0..3).map(|term| terms[6 * view + 2 * term + band]).sum();
        let whole = signature.radiant_intensity;
        // the same numbers in another order
        assert!((own - whole).abs() <= 1e-12 * whole && (sum - whole).abs() <= 1e-12 * whole, "{inputs:?}");
    }
    Ok(all.iter().map(|x| x.to_bits()).collect())
}

/// A block of a solved scene.
fn baked(made: &Handles) -> (Lines, usize) {
    let mut size = 0;
    // SAFETY: handles of this test; the block has the size asked for.
    unsafe {
        assert_eq!(blik_bake_size(made.coupling, made.solution, null_mut(), &mut size), BLIK_OK);
        let mut block = Lines::new(size);
        let at = block.at().cast();
        assert_eq!(blik_bake(made.coupling, made.solution, at, size, null_mut()), BLIK_OK);
        (block, size)
    }
}

/// Loads a block and hands its handles to `with`.
fn loaded<R>(
    block: &mut Lines,
    size: usize,
    with: impl FnOnce(*const blik_scene, *const blik_coupling, *const blik_solution) -> R,
) -> Result<R, i32> {
    let (mut scene, mut coupling, mut solution) = (null_mut(), null_mut(), null_mut());
    let mut bytes = 0;
    let at = block.at().cast::<c_void>();
    // SAFETY: the block has its length in bytes, and outlives the handles.
    unsafe {
        let status = blik_load_size(at, size, null_mut(), &mut bytes);
        if refused(status) {
            return Err(status);
        }
        let mut memory = vec![0xa5u8; bytes];
        let to = memory.as_mut_ptr().cast();
        let status = blik_load(at, size, to, bytes, null_mut(), &mut scene, &mut coupling, &mut solution);
        if refused(status) {
            return Err(status);
        }
        Ok(with(scene, coupling, solution))
    }
}

/// A solution of a loaded coupling under another light, and what it shows.
fn relit(coupling: *const blik_coupling, inputs: &Inputs) -> Option<Vec<u32>> {
    let mut solution = null_mut();
    // SAFETY: a loaded coupling.
    let lit = |light: &blik_light| unsafe {
        blik_solution_create(coupling, light, null(), null_mut(), &mut solution)
    };
    if refused(with_light(inputs, lit)) {
        return None;
    }
    let pixels = image(solution, inputs);
    // SAFETY: just made, and used by nobody any more.
    unsafe { blik_solution_destroy(solution) };
    pixels
}

#[test]
fn a_loaded_block_shows_and_relights_the_same_bits() {
    let inputs = Inputs { gloss: [0.0, 9.0], ..Inputs::new() };
    let made = prepare(&inputs).unwrap();
    let (mut block, size) = baked(&made);
    let other = Inputs { model: BLIK_SKY_TABLE, sun: [0.2, 0.9, 0.5], ..inputs.clone() };
    let wanted = [image(made.solution, &inputs), relit(made.coupling, &other)];
    assert!(wanted[0].is_some() && wanted[0] != wanted[1]);
    // at another place, and again from what was loaded
    for _ in 0..2 {
        let mut moved = block.clone();
        let shown = loaded(&mut moved, size, |scene, coupling, solution| {
            // SAFETY: all are numbers; loaded handles.
            let info = unsafe {
                let mut info = blik_scene_info::default();
                assert_eq!(blik_scene_get_info(scene, null_mut(), &mut info), BLIK_OK);
                info
            };
            assert_eq!((info.facets, info.degenerate_facets, info.bands), (5, 1, 2));
            let shown = [image(solution, &inputs), relit(coupling, &other)];
            let again = Handles { scene: null_mut(), coupling: null_mut(), solution: null_mut() };
            let again = Handles { coupling: coupling.cast_mut(), solution: solution.cast_mut(), ..again };
            let (block, size) = baked(&again);
            std::mem::forget(again);
            (shown, block, size)
        });
        let (shown, again, same) = shown.unwrap();
        assert_eq!(shown, wanted);
        assert_eq!(same, size);
        block = again;
    }
}

#[test]
fn damaged_blocks_are_refused() {
    let made = prepare(&Inputs::new()).unwrap();
    let (block, size) = baked(&made);
    let mut random = Random(77);
    for _ in 0..500 {
        let mut damaged = block.clone();
        let at = random.below(size);
        damaged.bytes(size)[at] ^= 1 << random.below(8);
        assert_eq!(loaded(&mut damaged, size, |_, _, _| ()), Err(BLIK_ERROR_BLOCK), "byte {at}");
    }
    for cut in [8, 64, size / 2, size - 1] {
        assert_eq!(loaded(&mut block.clone(), cut, |_, _, _| ()), Err(BLIK_ERROR_BLOCK), "{cut} bytes");
    }
}

/// The block's checksum, made right after a change: what a forger would do.
fn forge(bytes: &mut [u8]) {
    let mut sum = 0x9e37_79b9_7f4a_7c15_u64;
    for (at, word) in bytes.chunks_exact(8).enumerate() {
        let word = if at == 3 { 0 } else { u64::from_ne_bytes(word.try_into().unwrap()) };
        sum = (sum ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        sum ^= sum >> 32;
    }
    bytes[24..32].copy_from_slice(&sum.to_ne_bytes());
}

/// How long fuzzing goes on beyond its fixed count.
fn until() -> Instant {
    let seconds = std::env::var("BLIK_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    Instant::now() + Duration::from_secs(seconds)
}

#[test]
fn forged_blocks_do_no_harm() {
    let inputs = Inputs::new();
    let made = prepare(&inputs).unwrap();
    let (block, size) = baked(&made);
    let (end, mut random, mut accepted) = (until(), Random(1), 0);
    let mut tries = 0;
    while tries < 2000 || Instant::now() < end {
        tries += 1;
        let mut forged = block.clone();
        let bytes = forged.bytes(size);
        for _ in 0..1 + random.below(2) {
            let at = random.below(size);
            match random.below(3) {
                0 => bytes[at] ^= 1 << random.below(8),
                1 => bytes[at] = random.next() as u8,
                _ => {
                    let word = at & !7;
                    let value = random.number().to_bits();
                    bytes[word..word + 8].copy_from_slice(&value.to_ne_bytes());
                }
            }
        }
        forge(bytes);
        let seen = loaded(&mut forged, size, |_, coupling, solution| {
            image(solution, &inputs);
            // beams of mirrors take most of the time: the sun shines now and then
            if tries % 16 == 0 {
                relit(coupling, &inputs);
            }
        });
        accepted += u32::from(seen.is_ok());
    }
    // weights, light and the bytes between the arrays may be anything in their range
    println!("{accepted} of {tries} forged blocks accepted");
    assert!(accepted > 0 && accepted < tries, "{accepted} of {tries}");
}

#[test]
fn odd_numbers_are_refused_or_shown_finite() {
    let (end, mut random, mut shown, mut tries, mut posed) = (until(), Random(2), 0, 0, 0);
    // some tenths of a second each: .ci/long goes on for half an hour
    while tries < 200 || Instant::now() < end {
        tries += 1;
        let mut inputs = Inputs::new();
        inputs.spoil(&mut random);
        let Some(made) = prepare(&inputs) else { continue };
        shown += u32::from(image(made.solution, &inputs).is_some());
        assert!(lights(made.coupling, &inputs, null()).is_ok(), "as the solution");
        // other materials, and a part turned and moved by odd numbers
        let mut other = Inputs { vertices: inputs.vertices.clone(), ..inputs.clone() };
        other.values[random.below(6)][random.below(2)] = random.number();
        let mut pose = REST;
        let quaternion = [1.0, random.number(), random.number(), random.number()];
        let translation = [0.1, random.number(), 0.0];
        // SAFETY: arrays as long as stated.
        unsafe {
            blik_pose_from_quaternion(quaternion.as_ptr(), translation.as_ptr(), null_mut(), &mut pose);
        }
        if random.below(4) == 0 {
            pose.rotation[random.below(9)] = random.number();
        }
        if let Some(again) = renewed(made.coupling, &other, pose) {
            posed += 1;
            // light too bright for what reflects now may be refused
            let _ = lights(again.coupling, &other, null());
        }
        // reflections are counted for small numbers of them
        let counted = (0..=32).contains(&inputs.max_bounces);
        assert_eq!(explain(made.coupling, &inputs, null()).is_err(), counted, "{inputs:?}");
    }
    println!("{shown} of {tries} inputs shown, {posed} with a part moved");
    assert!(posed > 2, "{posed} of {tries}");
    assert!(10 * shown > tries / 2, "{shown} of {tries}");
}

/// Whatever the numbers of a ray, all who take rays agree on whether it is one, and answer with numbers.
#[test]
fn odd_rays_are_refused_or_answered() {
    let inputs = Inputs { gloss: [0.0, 9.0], ..Inputs::new() };
    let made = prepare(&inputs).unwrap();
    let (end, mut random, mut tries, mut answered) = (until(), Random(3), 0, 0);
    while tries < 20_000 || Instant::now() < end {
        tries += 1;
        let angle = random.number();
        let mut ray = blik_ray { origin: [0.4, 0.3, 2.0], ..blik_ray::default() };
        if angle.abs() < 1.0 {
            ray.direction = [angle, 0.0, -(1.0 - angle * angle).sqrt()];
        }
        for _ in 0..random.below(3) {
            let x = random.number();
            match random.below(4) {
                0 => ray.origin[random.below(3)] = x,
                1 => ray.direction[random.below(3)] = x,
                2 => ray.t_max = x,
                _ => ray.skip = [0, 4, 5, 6, u32::MAX, 1 << 31][random.below(6)],
            }
        }
        let (mut radiance, mut any) = ([f64::NAN; 2], [9u8]);
        let mut hit = blik_hit { t: f64::NAN, u: f64::NAN, v: f64::NAN, facet: 77, front: 9 };
        let mut error = blik_error::default();
        // SAFETY: live handles, arrays as long as stated.
        let statuses = unsafe {
            [
                blik_radiance(made.solution, &ray, 1, null(), null_mut(), 0, &mut error, &mut radiance[0], 2),
                blik_closest_hits(made.scene, &ray, 1, null(), &mut error, &mut hit, 1),
                blik_any_hits(made.scene, &ray, 1, null(), &mut error, &mut any[0], 1),
            ]
        };
        assert!(statuses.iter().all(|status| *status == statuses[0]), "{ray:?}: {statuses:?}");
        if refused(statuses[0]) {
            assert!(
                (BLIK_FIELD_RAY_ORIGIN..=BLIK_FIELD_RAY_SKIP).contains(&error.field),
                "{ray:?}: {error:?}"
            );
            assert!(radiance.iter().all(|l| l.is_nan()) && hit.facet == 77 && any == [9], "{ray:?}");
            continue;
        }
        answered += 1;
        assert!(radiance.iter().all(|l| l.is_finite() && *l >= 0.0), "{ray:?}: {radiance:?}");
        assert!(hit.t >= 0.0 && hit.u.is_finite() && hit.v.is_finite(), "{ray:?}: {hit:?}");
        assert_eq!(any[0] == 1, hit.facet != BLIK_NO_FACET, "{ray:?}: {hit:?}");
    }
    println!("{answered} of {tries} rays answered");
    assert!(answered > tries / 10 && answered < tries, "{answered} of {tries}");
}
