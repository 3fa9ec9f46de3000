//! The tests' own tools read what they should and measure what they say.

mod support;

use support::{cases, metric, references, scenes};

#[test]
fn eps_is_the_rms_over_counted_pixels_of_the_worst_band() {
    let reference = [0.0; 8];
    let image = [3.0, 1.0, 4.0, 1.0, 100.0, 100.0, 100.0, 100.0];
    let counted = metric::counted(&[true, true, true, false], &[false, false, true, false]);
    let eps = metric::eps(&image, &reference, &counted, &[1.0, 0.1]);
    // sqrt((9 + 16)/2); sqrt((1 + 1)/2) / 0.1: exact but for two roundings
    assert!((eps[0] - 12.5f64.sqrt()).abs() < 1e-15 && (eps[1] - 10.0).abs() < 1e-14, "{eps:?}");
    assert_eq!(metric::worst(&eps).0, 1);
    assert!((metric::corrected(5.0, 3.0) - 4.0).abs() < 1e-15 && metric::corrected(1.0, 2.0) == 0.0);
}

#[test]
#[should_panic(expected = "pixel 1")]
fn a_pixel_that_is_no_number_is_named() {
    metric::eps(&[0.0, f32::NAN], &[0.0, 0.0], &[true, true], &[1.0]);
}

#[test]
fn cases_are_found_by_their_id() {
    assert_eq!(cases::all().len(), 203);
    assert_eq!(cases::value("S-CLOSE"), 1.0);
    assert!(cases::all()["I-MSPHERE-PIX(0.3,0.4)"].description.starts_with("mirror unit sphere"));
}

#[test]
#[should_panic(expected = "no case M-NONE")]
fn a_missing_case_is_named() {
    cases::value("M-NONE");
}

#[test]
fn references_are_complete() {
    let all = references::all();
    assert!(all.len() >= 7);
    for reference in &all {
        let (image, counted) = (reference.image(), reference.counted());
        assert_eq!(image.shape, [256, 256], "{}", reference.id);
        assert_eq!(image.values.len(), counted.len(), "{}", reference.id);
        // an image differs from itself by nothing, and every counted value is finite
        assert_eq!(metric::eps(&image.values, &image.values, &counted, &[1.0]), [0.0]);
        let text = std::fs::read_to_string(&reference.scene).expect("the scene file");
        let mesh =
            text.lines().find_map(|line| line.strip_prefix("file = ")).expect("its mesh").trim_matches('"');
        let (mesh, _) = scenes::read_obj(&reference.scene.with_file_name(mesh));
        if let Some(facets) = &reference.facets {
            assert_eq!(facets.irradiance_over_pi().len(), mesh.facets.len(), "{}", reference.id);
            let noise = metric::rms(&facets.standard_errors(), &vec![0.0; mesh.facets.len()]);
            // the index gives three digits
            assert!((noise / facets.standard_error - 1.0).abs() < 5e-3, "{}: {noise}", reference.id);
        }
    }
}

#[test]
fn the_corner_is_the_reference_mesh() {
    let (file, names) = scenes::read_obj(&support::data("references/meshes/corner.obj"));
    assert_eq!(names, ["g0", "g1", "g2"]);
    assert_eq!(file, scenes::corner(8));
}

#[test]
fn closed_bodies_are_watertight_and_of_their_volume() {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    // icosahedron of circumradius 1: volume 5 (3 + sqrt 5)/12 a^3, edge a = 2/sqrt(1 + g^2)
    let icosahedron = 5.0 * (3.0 + 5f64.sqrt()) / 12.0 * (2.0 / (1.0 + g * g).sqrt()).powi(3);
    let bodies = [
        (scenes::cube_outside(), 1.0),
        (scenes::cube_inside(), -1.0),
        (scenes::cube_outside().subdivided(2), 1.0),
        (scenes::cube_outside().rotated([1.0, 2.0, 3.0], 1.0).scaled(2.0).translated([5.0, 6.0, 7.0]), 8.0),
        (scenes::sphere(0), icosahedron),
        (scenes::sphere(0).flipped(), -icosahedron),
    ];
    for (mesh, volume) in bodies {
        assert!(mesh.is_watertight());
        // a few dozen sums of numbers below 1000
        assert!((mesh.volume() - volume).abs() < 1e-11, "{} against {volume}", mesh.volume());
    }
    let sphere = scenes::sphere(4);
    assert!(sphere.is_watertight() && sphere.facets.len() == 20 * 256);
    // an inscribed facet of circumradius r lies 3/8 r^2 inside on average, thrice that in volume; r up to 0.045
    let missing = 1.0 - sphere.volume() / (4.0 / 3.0 * std::f64::consts::PI);
    assert!(missing > 0.0 && missing < 2.3e-3, "{missing}");
    assert!(!scenes::light_pipe().is_watertight());
}
