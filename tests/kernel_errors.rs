//! Every error of the kernel, provoked: it names what is wrong, its text says so, and nothing is written.

#[path = "support/kernel.rs"]
mod kernel;
mod support;

use blik_kernel::base::budget::ErrorBudget;
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{Camera, CameraInput, MAX_RESOLUTION, Projection, Sampling};
use blik_kernel::coupling::{Block, Coupling};
use blik_kernel::element::Elements;
use blik_kernel::form_factor::{Convex, visible_point_to_polygon};
use blik_kernel::host::{GeometryMemory, Host, Settings};
use blik_kernel::image::{self, Target};
use blik_kernel::light::{self, TableShape};
use blik_kernel::lobe::Lobe;
use blik_kernel::math::Vec3;
use blik_kernel::plane_sides::PlaneSides;
use blik_kernel::radiosity::straight::Straight;
use blik_kernel::scene::{Gloss, MaterialInput, NO_NORMAL, Scene, SceneInput};
use blik_kernel::signature::{self, Sums, View};
use blik_kernel::sky::{Sky, SkyInput, SkyModel, SkyTable};
use blik_kernel::subdivide::SubdivisionTree;
use blik_kernel::sun::{Sun, SunInput};
use blik_kernel::{Error, Field};
use kernel::{geometry, solve, within};
use support::scenes;
use support::twin::{self, Material, Model};

/// What memory holds before a call that must not touch it.
const UNTOUCHED: u8 = 0xa5;

const GREY: MaterialInput<'static> =
    MaterialInput { diffuse: &[0.4, 0.3], specular: &[0.2, 0.1], emission: &[0.0, 1.0], gloss: None };

/// Two facets of two materials in two bands.
const GOOD: SceneInput<'static> = SceneInput {
    vertices: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]],
    facets: &[[0, 1, 2], [0, 2, 3]],
    facet_materials: &[0, 1],
    normals: &[[0.0, 0.0, 1.0], [0.0, 0.1, 2.0]],
    facet_normals: &[[0, 1, 0], [1, NO_NORMAL, 0]],
    materials: &[GREY, GREY],
    two_sided: false,
    bands: 2,
};

/// The error is `expected`, and its text holds all of `words`.
#[track_caller]
fn is(error: Error, expected: Error, words: &[&str]) {
    assert_eq!(error, expected);
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "{text:?} does not name {word:?}");
    }
    // one line, for the program's "error: ..."
    assert!(!text.contains('\n'));
}

/// Scene::new refuses `input` so, and leaves its memory alone.
#[track_caller]
fn scene_error(input: SceneInput<'_>, expected: Error, words: &[&str]) {
    let mut memory = vec![UNTOUCHED; 1 << 16];
    is(Scene::new(&input, &mut memory).unwrap_err(), expected, words);
    assert!(memory.iter().all(|&b| b == UNTOUCHED), "{expected}: memory was written");
}

#[test]
fn meshes() {
    let mut memory = vec![0; Scene::bytes(&GOOD).unwrap()];
    assert_eq!(Scene::new(&GOOD, &mut memory).unwrap().facets(), 2);
    let nan = f64::NAN;
    let bad = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, nan], [0.0, f64::INFINITY, 0.0]];
    scene_error(
        SceneInput { vertices: &bad, ..GOOD },
        Error::VertexNotFinite { vertex: 2 },
        &["vertex 2", "not finite"],
    );
    let huge = [[-1e308, 0.0, 0.0], [1e308, 0.0, 0.0], [0.0, 1e308, 0.0], [0.0; 3]];
    scene_error(SceneInput { vertices: &huge, ..GOOD }, Error::Extent, &["extent"]);
    scene_error(
        SceneInput { facets: &[[0, 1, 2], [0, 4, 3]], ..GOOD },
        Error::IndexOutOfRange { facet: 1, index: 4, vertices: 4 },
        &["facet 1", "index 4", "vertices: 4"],
    );
    scene_error(SceneInput { facets: &[], ..GOOD }, Error::NoFacets, &["no facets"]);
    for zero in [[0.0; 3], [nan, 0.0, 1.0]] {
        scene_error(
            SceneInput { normals: &[[0.0, 0.0, 1.0], zero], ..GOOD },
            Error::NormalNotFinite { normal: 1 },
            &["normal 1"],
        );
    }
    scene_error(
        SceneInput { facet_normals: &[[0, 1, 0], [1, NO_NORMAL, 2]], ..GOOD },
        Error::NormalIndexOutOfRange { facet: 1, index: 2, normals: 2 },
        &["facet 1", "index 2", "normals: 2"],
    );
    // vertices number the normals where nothing else does
    scene_error(
        SceneInput { facet_normals: &[], ..GOOD },
        Error::NormalIndexOutOfRange { facet: 0, index: 2, normals: 2 },
        &["facet 0"],
    );
    scene_error(
        SceneInput { facet_materials: &[0, 2], ..GOOD },
        Error::MaterialOutOfRange { facet: 1, material: 2, materials: 2 },
        &["facet 1", "material 2", "materials: 2"],
    );
    scene_error(
        SceneInput { facet_materials: &[0], ..GOOD },
        Error::Length { what: "facet_materials", expected: 2, given: 1 },
        &["facet_materials", "2", "1"],
    );
    scene_error(
        SceneInput { facet_normals: &[[0, 0, 0]; 3], ..GOOD },
        Error::Length { what: "facet_normals", expected: 2, given: 3 },
        &["facet_normals"],
    );
}

#[test]
fn materials() {
    scene_error(SceneInput { materials: &[], ..GOOD }, Error::NoMaterials, &["no materials"]);
    for given in [0, 65] {
        scene_error(
            SceneInput { bands: given, ..GOOD },
            Error::Bands { given },
            &["bands", &given.to_string()],
        );
    }
    let second = |bad: MaterialInput<'_>, expected: Error, words: &[&str]| {
        scene_error(SceneInput { materials: &[GREY, bad], ..GOOD }, expected, words);
    };
    let lengths = [
        (Field::Diffuse, MaterialInput { diffuse: &[0.1], ..GREY }),
        (Field::Specular, MaterialInput { specular: &[0.1], ..GREY }),
        (Field::Emission, MaterialInput { emission: &[0.1], ..GREY }),
    ];
    for (field, bad) in lengths {
        let expected = Error::BandCount { material: 1, field, expected: 2, given: 1 };
        second(bad, expected, &["material 1", field.name(), "2", "1"]);
    }
    for value in [-0.1, 1.1, f64::INFINITY] {
        let values = [0.0, value];
        let fields = [
            (Field::Diffuse, MaterialInput { diffuse: &values, ..GREY }),
            (Field::Specular, MaterialInput { specular: &values, ..GREY }),
        ];
        for (field, bad) in fields {
            let expected = Error::MaterialRange { material: 1, band: 1, field, value };
            second(bad, expected, &["material 1", "band 1", field.name(), &value.to_string()]);
        }
    }
    let expected = Error::MaterialRange { material: 1, band: 0, field: Field::Emission, value: 2e37 };
    second(MaterialInput { emission: &[2e37, 0.0], ..GREY }, expected, &["material 1", "emission"]);
    let expected = Error::ReflectanceSum { material: 1, band: 1, sum: 1.25 };
    let bad = MaterialInput { diffuse: &[0.5, 0.5], specular: &[0.5, 0.75], ..GREY };
    second(bad, expected, &["material 1", "band 1", "1.25", "exceeds 1"]);
    let gloss = |axis_ratio, rays| MaterialInput { gloss: Some(Gloss { axis_ratio, rays }), ..GREY };
    let expected = Error::MaterialRange { material: 1, band: 0, field: Field::AxisRatio, value: 0.5 };
    second(gloss(0.5, None), expected, &["axis_ratio", "0.5"]);
    let expected = Error::MaterialRange { material: 1, band: 0, field: Field::GlossRays, value: 0.0 };
    second(gloss(3.0, Some(0)), expected, &["gloss rays"]);
    let expected = Error::Range { field: Field::AxisRatio, band: 0, value: 0.5 };
    is(Lobe::new(0.5).unwrap_err(), expected, &["axis_ratio"]);
    // a value that is no number is found, too, though it equals nothing
    let bad = MaterialInput { diffuse: &[f64::NAN, 0.0], ..GREY };
    let error = Scene::new(&SceneInput { materials: &[bad], ..GOOD }, &mut [0; 4096]).unwrap_err();
    assert!(matches!(error, Error::MaterialRange { material: 0, band: 0, field: Field::Diffuse, .. }));
}

#[test]
fn skies() {
    let good = SkyInput {
        model: SkyModel::Overcast,
        radiance: &[1.0, 2.0],
        ground: &[0.0, 0.1],
        up: [0.0, 0.0, 2.0],
    };
    let refused = |input: SkyInput<'_>, expected: Error, words: &[&str]| {
        is(Sky::new(&input, 2).unwrap_err(), expected, words);
    };
    assert!(Sky::new(&good, 2).is_ok());
    is(Sky::new(&good, 0).unwrap_err(), Error::Bands { given: 0 }, &["bands"]);
    let expected = Error::LightBandCount { field: Field::SkyRadiance, expected: 2, given: 1 };
    refused(SkyInput { radiance: &[1.0], ..good }, expected, &["sky radiance", "2", "1"]);
    let expected = Error::LightBandCount { field: Field::SkyGround, expected: 2, given: 3 };
    refused(SkyInput { ground: &[0.0; 3], ..good }, expected, &["sky ground"]);
    let expected = Error::Range { field: Field::SkyRadiance, band: 1, value: -1.0 };
    refused(SkyInput { radiance: &[1.0, -1.0], ..good }, expected, &["sky radiance", "band 1", "-1"]);
    let expected = Error::Range { field: Field::SkyGround, band: 0, value: 2e37 };
    refused(SkyInput { ground: &[2e37, 0.0], ..good }, expected, &["sky ground", "band 0"]);
    for up in [[0.0; 3], [f64::NAN, 0.0, 1.0]] {
        refused(SkyInput { up, ..good }, Error::Direction { field: Field::SkyUp }, &["sky up"]);
    }
    let cie = |kind, sun_direction| SkyInput { model: SkyModel::Cie { kind, sun_direction }, ..good };
    let expected = Error::Range { field: Field::SkyType, band: 0, value: 16.0 };
    refused(cie(16, [0.0, 0.0, 1.0]), expected, &["sky type", "16"]);
    let expected = Error::Direction { field: Field::SkySunDirection };
    refused(cie(1, [0.0; 3]), expected, &["sky sun_direction"]);
    let expected = Error::Range { field: Field::SkySunDirection, band: 0, value: -1.0 };
    refused(cie(1, [0.0, 0.0, -2.0]), expected, &["sky sun_direction", "-1"]);
    let samples = [1.0f32; 12];
    let whole = SkyTable { rows: 2, columns: 3, bands: 2, radiance: &samples, azimuth_zero: None };
    let table = |table| SkyInput { model: SkyModel::Table(table), ..good };
    assert!(Sky::new(&table(whole), 2).is_ok());
    let expected = Error::Length { what: "sky table", expected: 12, given: 11 };
    refused(table(SkyTable { radiance: &samples[1..], ..whole }), expected, &["sky table", "12", "11"]);
    let expected = Error::LightBandCount { field: Field::SkyTable, expected: 2, given: 3 };
    refused(table(SkyTable { bands: 3, ..whole }), expected, &["sky table"]);
    let expected = Error::Direction { field: Field::SkyAzimuthZero };
    refused(
        table(SkyTable { azimuth_zero: Some([0.0, 0.0, 3.0]), ..whole }),
        expected,
        &["sky azimuth_zero"],
    );
    let mut bad = samples;
    bad[7] = -2.0;
    let expected = Error::Range { field: Field::SkyTable, band: 1, value: -2.0 };
    refused(table(SkyTable { radiance: &bad, ..whole }), expected, &["sky table", "band 1", "-2"]);
}

#[test]
fn suns() {
    let good = SunInput { direction: [1.0, 0.0, 1.0], irradiance: &[1.0, 2.0], half_angle_deg: 0.2665 };
    let refused = |input: SunInput<'_>, expected: Error, words: &[&str]| {
        is(Sun::new(&input, 2).unwrap_err(), expected, words);
    };
    assert!(Sun::new(&good, 2).is_ok());
    is(Sun::new(&good, 65).unwrap_err(), Error::Bands { given: 65 }, &["bands", "65"]);
    let expected = Error::Direction { field: Field::SunDirection };
    refused(SunInput { direction: [0.0; 3], ..good }, expected, &["sun direction"]);
    let expected = Error::LightBandCount { field: Field::SunIrradiance, expected: 2, given: 0 };
    refused(SunInput { irradiance: &[], ..good }, expected, &["sun irradiance"]);
    let expected = Error::Range { field: Field::SunIrradiance, band: 1, value: -2.0 };
    refused(SunInput { irradiance: &[1.0, -2.0], ..good }, expected, &["sun irradiance", "band 1", "-2"]);
    for value in [-1.0, 5e-5, 10.5] {
        let expected = Error::Range { field: Field::SunHalfAngle, band: 0, value };
        refused(
            SunInput { half_angle_deg: value, ..good },
            expected,
            &["half_angle_deg", &value.to_string()],
        );
    }
    // finite, but its disc is not
    let expected = Error::Range { field: Field::SunIrradiance, band: 0, value: 1e30 };
    let dazzling = SunInput { irradiance: &[1e30, 1.0], half_angle_deg: 1e-4, ..good };
    refused(dazzling, expected, &["sun irradiance"]);
}

#[test]
fn cameras() {
    let good = CameraInput {
        projection: Projection::Orthographic { height: 2.0 },
        eye: [0.0, -3.0, 1.0],
        target: [0.0, 0.0, 0.0],
        up: [0.0, 0.0, 1.0],
        columns: 4,
        rows: 3,
        sampling: Sampling::Centre,
    };
    let mut memory = vec![0; Scene::bytes(&GOOD).unwrap()];
    let scene = Scene::new(&GOOD, &mut memory).unwrap();
    assert!(Camera::new(&good, &scene).is_ok());
    let infinite = [0.0, f64::INFINITY, 0.0];
    let value = f64::INFINITY;
    let range = |field, value| Error::Range { field, band: 0, value };
    let bad = [
        (CameraInput { eye: infinite, ..good }, range(Field::CameraEye, value)),
        (CameraInput { target: infinite, ..good }, range(Field::CameraTarget, value)),
        (CameraInput { up: infinite, ..good }, range(Field::CameraUp, value)),
        (CameraInput { up: [0.0; 3], ..good }, Error::Direction { field: Field::CameraUp }),
        (CameraInput { up: [0.0, 6.0, -2.0], ..good }, Error::CameraFrame { field: Field::CameraUp }),
        (CameraInput { target: good.eye, ..good }, Error::CameraFrame { field: Field::CameraTarget }),
        (CameraInput { columns: 0, ..good }, range(Field::Resolution, 0.0)),
        (CameraInput { rows: MAX_RESOLUTION + 1, ..good }, range(Field::Resolution, 65537.0)),
        (
            CameraInput { projection: Projection::Orthographic { height: 0.0 }, ..good },
            range(Field::CameraHeight, 0.0),
        ),
        (
            CameraInput { projection: Projection::Perspective { fov_deg: 180.0 }, ..good },
            range(Field::CameraFieldOfView, 180.0),
        ),
    ];
    for (input, expected) in bad {
        let (Error::Range { field, .. } | Error::Direction { field } | Error::CameraFrame { field }) =
            expected
        else {
            unreachable!("all of these name a field");
        };
        is(Camera::new(&input, &scene).unwrap_err(), expected, &[field.name()]);
    }
}

#[test]
fn memory_of_the_wrong_size() {
    let needed = Scene::bytes(&GOOD).unwrap();
    let mut memory = vec![UNTOUCHED; needed - 1];
    let expected = Error::BufferTooSmall { needed, given: needed - 1 };
    let words = [needed.to_string(), (needed - 1).to_string()];
    is(Scene::new(&GOOD, &mut memory).unwrap_err(), expected, &[&words[0], &words[1]]);
    assert!(memory.iter().all(|&b| b == UNTOUCHED));
    let mut memory = vec![0; needed];
    let scene = Scene::new(&GOOD, &mut memory).unwrap();
    let needed = Bvh::bytes(2).unwrap();
    let mut small = vec![UNTOUCHED; needed - 1];
    let isa = blik_kernel::simd::Isa::detect();
    let error = Bvh::build_obvhs(scene.corners(), scene.areas(), isa, &mut small).unwrap_err();
    is(error, Error::BufferTooSmall { needed, given: needed - 1 }, &["too small"]);
    assert!(small.iter().all(|&b| b == UNTOUCHED));
    let needed = SubdivisionTree::bytes(2, 1e-2, 0).unwrap();
    let mut small = vec![UNTOUCHED; needed - 1];
    let error = SubdivisionTree::new(&scene, &ErrorBudget::new(1e-2, 1e-2), 0, &mut small).unwrap_err();
    is(error, Error::BufferTooSmall { needed, given: needed - 1 }, &["too small"]);
    assert!(small.iter().all(|&b| b == UNTOUCHED));
    let mut trees = vec![0; needed];
    let cut = SubdivisionTree::new(&scene, &ErrorBudget::new(1e-2, 1e-2), 0, &mut trees).unwrap();
    let needed = Elements::bytes(&cut).unwrap();
    let mut small = vec![UNTOUCHED; needed - 1];
    let error = Elements::new(&scene, &cut, &mut small).unwrap_err();
    is(error, Error::BufferTooSmall { needed, given: needed - 1 }, &["too small"]);
    assert!(small.iter().all(|&b| b == UNTOUCHED));
    assert!(matches!(Block::open(&[]).unwrap_err(), Error::BufferTooSmall { given: 0, .. }));
    // as many elements as an index holds, the finest subdivision of these facets goes beyond
    let error = SubdivisionTree::bytes(1 << 29, 1e-6, 0).unwrap_err();
    is(error, Error::TooMany { what: "elements", limit: 1 << 29 }, &["too many elements", "536870912"]);
    // more pieces of a polygon than there is room for
    let triangle = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]].map(Vec3::from_array);
    let blocker = [[0.1, 0.1, 0.5], [0.2, 0.1, 0.5], [0.1, 0.2, 0.5]].map(Vec3::from_array);
    let mut scratch = [Convex::EMPTY; 1];
    let error =
        visible_point_to_polygon(Vec3::ZERO, Vec3::Z, &triangle, [&blocker], &mut scratch).unwrap_err();
    is(error, Error::TooMany { what: "visible pieces of a polygon", limit: 1 }, &["visible pieces"]);
}

#[test]
fn outputs_of_the_wrong_size() {
    let scene = twin::Scene::new(&scenes::corner(1), &vec![Material::new(0.4, 0.3); 3]).sky(twin::Sky::new(
        Model::Uniform,
        1.0,
        1.0,
    ));
    solve(&scene, &within(1e-2), |_, lit| {
        let solved = lit.solved();
        let input = CameraInput {
            projection: Projection::Orthographic { height: 2.0 },
            eye: [3.0, 3.0, 3.0],
            target: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            columns: 4,
            rows: 3,
            sampling: Sampling::Area,
        };
        let camera = Camera::new(&input, solved.scene).unwrap();
        let mut scratch = vec![0; image::scratch_bytes(&camera, solved.scene, solved.elements).unwrap()];
        let (mut pixels, mut part) = ([7.0f32; 12], [7.0f32; 5]);
        let expected = Error::Length { what: "image", expected: 8, given: 12 };
        let mut target = Target { image: &mut pixels, components: Default::default() };
        is(image::rows(&solved, &camera, 0..2, &mut target, &mut scratch).unwrap_err(), expected, &["image"]);
        let expected = Error::Range { field: Field::Rows, band: 0, value: 4.0 };
        is(
            image::rows(&solved, &camera, 1..4, &mut target, &mut scratch).unwrap_err(),
            expected,
            &["row range"],
        );
        let given = scratch.len() - 1;
        let error = image::rows(&solved, &camera, 0..3, &mut target, &mut scratch[1..]).unwrap_err();
        is(error, Error::BufferTooSmall { needed: given + 1, given }, &["too small"]);
        let components = [&mut part[..], &mut [], &mut []];
        let mut target = Target { image: &mut pixels, components };
        let expected = Error::Length { what: "image component", expected: 12, given: 5 };
        is(
            image::rows(&solved, &camera, 0..3, &mut target, &mut scratch).unwrap_err(),
            expected,
            &["component"],
        );
        assert_eq!((pixels, part), ([7.0; 12], [7.0; 5]));

        let error = View::new(&solved, Vec3::ZERO, 8).unwrap_err();
        is(error, Error::Direction { field: Field::Direction }, &["direction"]);
        let view = View::new(&solved, Vec3::Z, 8).unwrap();
        let mut sums = [Sums { area: 7.0, ..Sums::ZERO }; 3];
        let expected = Error::Length { what: "signature rows", expected: 8, given: 3 };
        let mut scratch = vec![0; signature::scratch_bytes().unwrap()];
        let error = signature::rows(&solved, &view, 0..8, &mut scratch, &mut sums).unwrap_err();
        is(error, expected, &["signature rows"]);
        let given = scratch.len() - 1;
        let error = signature::rows(&solved, &view, 0..3, &mut scratch[..given], &mut sums).unwrap_err();
        is(error, Error::BufferTooSmall { needed: given + 1, given }, &["too small"]);
        assert!(sums.iter().all(|s| s.area == 7.0));

        let mut values = [7.0; 5];
        let mut trees = vec![0; SubdivisionTree::bytes(solved.scene.facets(), 1e-3, 0).unwrap()];
        let mut cut =
            SubdivisionTree::new(solved.scene, &ErrorBudget::new(1e-3, 1e-3), 0, &mut trees).unwrap();
        let (work, _) = cut.newest_level();
        let error = work
            .probe(
                solved.scene,
                solved.bvh,
                &PlaneSides::NONE,
                (16, &ErrorBudget::new(1e-3, 1e-3)),
                0..6,
                &mut values,
            )
            .unwrap_err();
        is(error, Error::Length { what: "unevenness", expected: 6, given: 5 }, &["unevenness"]);
        assert_eq!(values, [7.0; 5]);
    });
}

#[test]
fn stages_of_different_scenes() {
    let small = twin::Scene::new(&scenes::tilted_square(0.0), &[Material::new(0.4, 0.0)]);
    let large = twin::Scene::new(&scenes::corner(2), &vec![Material::new(0.4, 0.0); 3]);
    let sky = SkyInput { model: SkyModel::Overcast, radiance: &[1.0], ground: &[0.0], up: [0.0, 0.0, 1.0] };
    let mismatch = Error::Mismatch { what: "coupling block" };
    let uniform_only = Settings { directional: false, ..within(1e-2) };
    geometry(&small, &uniform_only, |host, few| {
        geometry(&large, &within(1e-2), |_, many| {
            // a tree's areas of another scene
            let needed = Bvh::bytes(24).unwrap();
            let isa = blik_kernel::simd::Isa::detect();
            let mut memory = vec![UNTOUCHED; needed];
            let error =
                Bvh::build_obvhs(many.scene().corners(), few.scene().areas(), isa, &mut memory).unwrap_err();
            is(error, Error::Length { what: "areas", expected: 24, given: 2 }, &["areas"]);
            assert!(memory.iter().all(|&b| b == UNTOUCHED));
        });
        let coupling = few.coupling().unwrap();
        is(Coupling::new(&[], 2).unwrap_err(), mismatch, &["coupling block", "another scene"]);
        assert_eq!(coupling.unknowns(), few.elements().unknowns());
        // a sky with directions on a coupling that kept none
        let expected = Error::Mismatch { what: "coupling without directions" };
        is(host.light(few, Some(&sky), None).unwrap_err(), expected, &["without directions"]);
        let shape = TableShape { levels: 1, bands: 1 };
        let checked = Sky::new(&sky, 1).unwrap();
        let all = 0..coupling.unknowns();
        let mut table = vec![7.0; all.len() * shape.stride()];
        let (scene, elements) = (few.scene(), few.elements());
        let error = light::sky_rows(
            scene,
            elements,
            &coupling,
            (&checked, &Straight::default()),
            1e-3,
            all.clone(),
            shape,
            &mut table,
        );
        is(error.unwrap_err(), expected, &["coupling"]);
        let error = light::sky_rows(
            scene,
            elements,
            &coupling,
            (&checked, &Straight::default()),
            1e-3,
            all.clone(),
            shape,
            &mut table[1..],
        );
        let (expected, given) = (table.len(), table.len() - 1);
        is(
            error.unwrap_err(),
            Error::Length { what: "irradiance table", expected, given },
            &["irradiance table"],
        );
        let sun = SunInput { direction: [0.0, 0.0, 1.0], irradiance: &[1.0], half_angle_deg: 0.0 };
        let sun = Sun::new(&sun, 1).unwrap();
        let error =
            light::sun_rows(scene, few.bvh(), elements, &coupling, &sun, all.clone(), &mut table[..1]);
        let expected = Error::Length { what: "sun table", expected: all.len(), given: 1 };
        is(error.unwrap_err(), expected, &["sun table"]);
        assert!(table.iter().all(|&x| x == 7.0));
        // light of another number of bands
        let two = SkyInput { radiance: &[1.0, 1.0], ground: &[0.0, 0.0], ..sky };
        let expected = Error::LightBandCount { field: Field::SkyRadiance, expected: 1, given: 2 };
        is(host.light(few, Some(&two), None).unwrap_err(), expected, &["sky radiance"]);
    });
}

#[test]
fn settings() {
    let host = Host::new(1).unwrap();
    let refused = |settings: Settings, expected: Error, words: &[&str]| {
        let mut memory = GeometryMemory::default();
        is(host.geometry(&mut memory, &GOOD, &settings).unwrap_err(), expected, words);
    };
    for value in [0.0, 1e-7, 0.2] {
        let expected = Error::Range { field: Field::Tolerance, band: 0, value };
        let of_image = Settings { image_tolerance: Some(value), ..within(0.1) };
        refused(within(value), expected, &["tolerance", &value.to_string()]);
        refused(of_image, expected, &["tolerance", &value.to_string()]);
    }
    let reference = |values: &[f64]| Settings { reference_radiance: Some(values.to_vec()), ..within(1e-2) };
    let expected = Error::LightBandCount { field: Field::ReferenceRadiance, expected: 2, given: 1 };
    refused(reference(&[1.0]), expected, &["reference_radiance"]);
    let expected = Error::Range { field: Field::ReferenceRadiance, band: 1, value: 0.0 };
    refused(reference(&[1.0, 0.0]), expected, &["reference_radiance", "band 1"]);
}

#[test]
fn a_closed_room_that_keeps_all_light() {
    let white = [Material::new(1.0, 0.0).emitting(1.0)];
    let scene = twin::Scene::new(&scenes::cube_inside(), &white);
    geometry(&scene, &within(0.1), |host, geometry| {
        // every row sums to 1 exactly: a power of two of rays
        let error = host.light(geometry, None, None).unwrap_err();
        is(error, Error::Diverges { row_sum: 1.0 }, &["diverge", "row sum 1"]);
    });
    is(Error::Cancelled, Error::Cancelled, &["cancelled"]);
}
