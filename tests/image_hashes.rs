//! One image of each family of scenes has the stored bits on every processor, instruction set and number of threads.
//!
//! A commit that changes numbers on purpose stores the new hashes: `UPDATE_HASHES=1 cargo test --test image_hashes`.

#[path = "support/case.rs"]
mod case;
#[path = "support/plane_kernel.rs"]
mod plane_kernel;
#[allow(dead_code)]
#[path = "support/plane_reference/mod.rs"]
mod plane_reference;
#[path = "support/stages.rs"]
mod stages;
mod support;

use blik_kernel::camera::{CameraInput, Sampling};
use blik_kernel::host::Settings;
use blik_kernel::simd::Isa;
use blik_kernel::sky::{SkyModel, SkyTable};
use case::{Case, SkyOf, SunOf, orthographic, perspective, within};
use plane_kernel::method;
use stages::{Plan, Workspace};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use support::scenes;
use support::twin::Material;

const TOLERANCE: f64 = 1e-2;
const PIXELS: usize = 31;

/// A lit scene and a view of it.
struct View {
    case: Case,
    camera: CameraInput,
}

fn area(camera: CameraInput) -> CameraInput {
    CameraInput { sampling: Sampling::Area, ..camera }
}

fn above(case: Case) -> View {
    View { case, camera: area(orthographic([3.0, 2.0, 2.5], [0.4, 0.45, 0.3], 2.0, PIXELS)) }
}

fn ball(material: u32) -> scenes::Mesh {
    scenes::sphere(1).of_material(material).scaled(0.2).translated([0.45, 0.4, 0.5])
}

/// A white corner under a uniform sky.
fn white() -> View {
    above(Case::new(scenes::corner(2).of_material(0), &[Material::new(1.0, 0.0)]).sky(SkyOf::uniform(1)))
}

/// A corner of three different mirrors under a gradient, seen from near by.
fn mirrors() -> View {
    let materials = [Material::new(0.5, 0.2), Material::new(0.1, 0.7), Material::new(0.0, 0.9)];
    let sky = SkyOf::new(SkyModel::Gradient, &[1.0], &[0.2]);
    let camera = area(perspective([2.0, 1.5, 1.2], [0.3, 0.3, 0.3], 40.0, PIXELS));
    View { case: Case::new(scenes::corner(2), &materials).sky(sky), camera }
}

/// A lobe above diffuse and mirror facets, lit by the sun's disc, in three bands.
fn lobe() -> View {
    let glossy = Material { gloss: Some(8.0), ..Material::spectral(&[0.2, 0.3, 0.1], &[0.5, 0.4, 0.6]) };
    let materials = [
        Material::spectral(&[0.6, 0.5, 0.3], &[0.0; 3]),
        Material::spectral(&[0.1, 0.2, 0.0], &[0.7, 0.5, 0.9]),
        Material::spectral(&[0.3; 3], &[0.0; 3]),
        glossy,
    ];
    let case = Case::new(scenes::corner(2).joined(&ball(3)), &materials)
        .sky(SkyOf::new(SkyModel::Overcast, &[1.0, 0.8, 0.6], &[0.2, 0.3, 0.4]))
        .sun(SunOf::new([0.5, 0.7, 0.9], &[2.0, 1.5, 1.0], 0.5));
    above(case)
}

/// The samples of a table with a bright spot, which is taken for a sun.
static TABLE: [f32; 16 * 32] = {
    let mut values = [0.0; 16 * 32];
    let mut place = 0;
    while place < values.len() {
        let (row, column) = (place / 32, place % 32);
        values[place] = 0.2 + 0.05 * (16 - row) as f32 + 0.01 * (column % 8) as f32;
        place += 1;
    }
    values[3 * 32 + 5] = 4000.0;
    values
};

/// Diffuse facets under a table that holds a sun, and another sun.
fn table() -> View {
    let materials = [Material::new(0.5, 0.0), Material::new(0.7, 0.0), Material::new(0.3, 0.0)];
    let model = SkyModel::Table(SkyTable {
        rows: 16,
        columns: 32,
        bands: 1,
        radiance: &TABLE,
        azimuth_zero: Some([1.0, 0.0, 0.0]),
    });
    let mesh = scenes::corner(2).joined(&ball(1));
    let case = Case::new(mesh, &materials).sky(SkyOf::new(model, &[1.0], &[0.0]));
    above(case.sun(SunOf::new([0.2, 0.8, 0.6], &[1.0], 0.3)))
}

/// A lamp in the dark, both sides of all facets.
fn lamp() -> View {
    let materials = [
        Material::new(0.5, 0.0),
        Material::new(0.4, 0.3),
        Material::new(0.6, 0.0),
        Material::new(0.2, 0.0).emitting(3.0),
    ];
    above(Case::new(scenes::corner(2).joined(&ball(3)), &materials).two_sided())
}

/// A mirror ball with interpolated normals.
fn smooth() -> View {
    let materials =
        [Material::new(0.5, 0.0), Material::new(0.4, 0.0), Material::new(0.3, 0.0), Material::new(0.1, 0.8)];
    let floor = scenes::corner(2);
    let ball = ball(3);
    let outward = |p: &[f64; 3]| [p[0] - 0.45, p[1] - 0.4, p[2] - 0.5];
    let inward = floor.vertices.iter().map(|_| [0.0, 0.0, 1.0]);
    let normals = inward.chain(ball.vertices.iter().map(outward)).collect();
    let case = Case { normals, ..Case::new(floor.joined(&ball), &materials) };
    above(case.sky(SkyOf::new(SkyModel::Gradient, &[1.0], &[0.3])))
}

/// The FNV-1a hash of some bytes.
fn hash(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn hash_of(bits: &[u32]) -> u64 {
    assert!(bits.iter().filter(|bits| **bits != 0).count() > PIXELS * PIXELS / 8, "an image");
    hash(bits.iter().flat_map(|bits| bits.to_le_bytes()))
}

/// The hash of a view's pixels and components, the same however it is computed.
fn view(name: &str, View { case, camera }: &View) -> u64 {
    let directional = !matches!(case.sky.as_ref().map(|sky| sky.model), Some(SkyModel::Uniform));
    let settings = Settings { directional, ..within(TOLERANCE) };
    let hosted = [1, 3].map(|threads| hash_of(&case.run(threads, &settings, camera).pixel_bits()));
    let staged = [(1, Isa::BASELINE), (3, Isa::BASELINE), (2, Isa::detect())].map(|(parts, isa)| {
        let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(SunOf::input));
        let plan = Plan { parts, isa, obvhs: false, tolerance: TOLERANCE };
        let mut work = Workspace::new(case.mesh.facets.len(), 16384, case.bands(), PIXELS * PIXELS, 1 << 24);
        case.with_input(|input| stages::run(&mut work, input, sky.as_ref(), sun.as_ref(), camera, &plan))
            .unwrap();
        hash_of(&work.pixel_bits())
    });
    assert!(hosted.iter().chain(&staged).all(|hash| *hash == hosted[0]), "{name}: {hosted:x?} {staged:x?}");
    hosted[0]
}

/// The hash of an image of the model in two dimensions.
fn plane() -> u64 {
    let scene = plane_kernel::pair(2.5, 0.3, 0.5, None);
    let image = plane_kernel::image(&scene, 64, &method('H'), &plane_kernel::uniform(), 0.1);
    assert!(image.iter().flatten().count() > 500, "an image");
    hash(image.iter().flat_map(|radiance| radiance.unwrap_or(-1.0).to_le_bytes()))
}

fn stored() -> PathBuf {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let data = above.map(|p| p.join("tests/data")).find(|p| p.is_dir()).unwrap();
    data.join("image_hashes.txt")
}

#[test]
fn images_have_the_stored_bits() {
    let views = [
        ("white", white()),
        ("mirrors", mirrors()),
        ("lobe", lobe()),
        ("table", table()),
        ("lamp", lamp()),
        ("smooth", smooth()),
    ];
    let mut all = String::new();
    for (name, scene) in &views {
        writeln!(all, "{name} {:016x}", view(name, scene)).unwrap();
    }
    writeln!(all, "plane {:016x}", plane()).unwrap();
    if std::env::var_os("UPDATE_HASHES").is_some() {
        fs::write(stored(), &all).unwrap();
    }
    let known = fs::read_to_string(stored()).unwrap_or_default();
    assert_eq!(all, known, "UPDATE_HASHES=1 stores what a change of numbers brings");
}
