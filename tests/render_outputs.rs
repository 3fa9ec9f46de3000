//! The content of every file that the `render` program writes.
#![cfg(feature = "std")]

#[path = "support/render.rs"]
mod render;

use render::{Folder, SCENE, read_npy};
use serde_json::Value;

/// The plate with a mirror beside it, in a number of bands, under a sky that is brighter in each.
fn scene(bands: usize) -> Folder {
    let each = |f: &dyn Fn(usize) -> f64| format!("{:?}", (0..bands).map(f).collect::<Vec<_>>());
    let keys = format!(
        "bands = {bands}\ntolerance = 2e-3\n[material.mirror]\nspecular = {}",
        each(&|band| 0.5 + 0.1 * (band % 3) as f64)
    );
    let text =
        SCENE.replacen("tolerance = 2e-3", "", 1).replace("[material.default]", "[material.default]\n");
    let text =
        text.replace("\"uniform\"", &format!("\"overcast\"\nradiance = {}", each(&|b| 1.0 + b as f64)));
    let (mesh, rest) = text.split_once("[sky]").unwrap();
    let folder = Folder::with_scene(&format!("{}\n{mesh}[sky]{rest}", keys.split_once("[").unwrap().0));
    let (_, mirror) = keys.split_once("[").unwrap();
    folder.write("scene.toml", String::from_utf8(folder.read("scene.toml")).unwrap() + "[" + mirror + "\n");
    let wall = "v 1 -1 1\nv 1 1 1\nusemtl mirror\nf 3 2 5 6\n";
    folder.write("plate.obj", render::PLATE.to_string() + wall);
    folder
}

#[test]
fn exr_and_pfm_hold_the_values_of_npy() {
    for bands in [1, 2, 3, 12] {
        let folder = scene(bands);
        let pfm: &[&str] = if matches!(bands, 1 | 3) { &["--out", "a.pfm"] } else { &[] };
        let arguments = ["scene.toml", "--out", "a.npy", "--out", "a.exr"];
        folder.render(&[&arguments[..], pfm].concat()).succeeds();
        let (shape, pixels) = read_npy(&folder.read("a.npy"));
        assert_eq!(shape, [8, 8, bands as u64]);
        let image = exr::prelude::read_all_data_from_file(folder.path("a.exr")).unwrap();
        let channels = &image.layer_data[0].channel_data.list;
        assert_eq!(channels.len(), bands);
        for band in 0..bands {
            let name = if bands == 3 { ["R", "G", "B"][band].into() } else { format!("B{band:03}") };
            let channel = channels.iter().find(|channel| channel.name.eq(name.as_str())).unwrap();
            let exr::prelude::FlatSamples::F32(plane) = &channel.sample_data.levels_as_slice()[0] else {
                panic!("{name} is not f32")
            };
            assert!(pixels.iter().skip(band).step_by(bands).eq(plane), "{name}");
        }
        if !pfm.is_empty() {
            let bytes = folder.read("a.pfm");
            let header: &[u8] = if bands == 3 { b"PF\n8 8\n-1.0\n" } else { b"Pf\n8 8\n-1.0\n" };
            let body: Vec<f32> = bytes
                .strip_prefix(header)
                .unwrap()
                .as_chunks()
                .0
                .iter()
                .copied()
                .map(f32::from_le_bytes)
                .collect();
            let rows: Vec<f32> = body.chunks(8 * bands).rev().flatten().copied().collect();
            assert!(rows == pixels);
        }
    }
}

/// Width of a pixel in bytes, and all bytes.
fn read_png(bytes: &[u8]) -> (usize, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.bit_depth), (8, 8, png::BitDepth::Eight));
    (info.color_type.samples(), pixels)
}

fn srgb(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    255.0 * if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[test]
fn png_shows_the_chosen_bands_over_the_reference_radiance() {
    for (bands, options, shown, exposure) in [
        (1, &[][..], &[0][..], 1.0),
        (2, &[], &[0], 1.0),
        (3, &[], &[0, 1, 2], 1.0),
        (3, &["--exposure", "2.5"], &[0, 1, 2], 2.5),
        (3, &["--bands", "1"], &[1], 1.0),
        (5, &["--bands", "4,0,4", "--exposure", "0.5"], &[4, 0, 4], 0.5),
    ] {
        let folder = scene(bands);
        let arguments = ["scene.toml", "--out", "a.npy", "--out", "a.PNG", "--report", "r.json"];
        folder.render(&[&arguments[..], options].concat()).succeeds();
        let (_, pixels) = read_npy(&folder.read("a.npy"));
        let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
        let (samples, bytes) = read_png(&folder.read("a.PNG"));
        assert_eq!(samples, shown.len());
        for (i, byte) in bytes.iter().enumerate() {
            let band = shown[i % samples];
            let reference = report["reference_radiance"][band].as_f64().unwrap();
            // Overcast: 7/9 of the zenith's radiance.
            assert!((reference - 7.0 / 9.0 * (1.0 + band as f64)).abs() < 1e-12 * reference);
            let radiance = f64::from(pixels[i / samples * bands + band]);
            let want = srgb(exposure * radiance / reference);
            assert!((f64::from(*byte) - want).abs() <= 0.5 + 1e-9, "{byte} for {want}");
        }
    }
}

#[test]
fn the_components_add_up_to_the_image() {
    let folder = scene(2);
    folder.render(&["scene.toml", "--out", "a.npy", "--components", "c"]).succeeds();
    let (shape, image) = read_npy(&folder.read("a.npy"));
    let parts = ["c_diffuse.npy", "c_mirror_sky.npy", "c_mirror_diffuse.npy"].map(|name| {
        let (part_shape, part) = read_npy(&folder.read(name));
        assert_eq!(part_shape, shape);
        part
    });
    // The plate, which is all diffuse.
    for i in (8 * 3 + 3) * 2..(8 * 3 + 5) * 2 {
        let sum: f32 = parts.iter().map(|part| part[i]).sum();
        assert!((sum - image[i]).abs() <= 1e-6 * image[i], "{sum} for {}", image[i]);
        assert_eq!((parts[1][i], parts[2][i]), (0.0, 0.0));
    }
    // From the side the mirror shows the plate below and the ground beyond it.
    let text = String::from_utf8(folder.read("scene.toml")).unwrap();
    let side =
        text.replace("eye = [0, 0, 5]", "eye = [-5, 0, 1]").replace("up = [0, 1, 0]", "up = [0, 0, 1]");
    let side = side.replace("[sky]", "[sky]\nground = [0.2, 0.3]").replace("[8, 8]", "[32, 32]");
    folder.write("scene.toml", side);
    folder.render(&["scene.toml", "--out", "a.npy", "--components", "c"]).succeeds();
    let (_, image) = read_npy(&folder.read("a.npy"));
    let parts = ["c_diffuse.npy", "c_mirror_sky.npy", "c_mirror_diffuse.npy"]
        .map(|name| read_npy(&folder.read(name)).1);
    assert!(parts.iter().all(|part| part.iter().any(|x| *x > 0.0)));
    let sums = (0..image.len()).map(|i| parts.iter().map(|part| part[i]).sum::<f32>());
    assert!(sums.zip(&image).all(|(sum, x)| sum <= x * (1.0 + 1e-6)));
}

fn rows(folder: &Folder) -> (Vec<String>, Vec<Vec<String>>) {
    let bytes = folder.read("f.csv");
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let head = reader.headers().unwrap().iter().map(String::from).collect();
    (head, reader.records().map(|row| row.unwrap().iter().map(String::from).collect()).collect())
}

#[test]
fn facets_come_by_index_then_side() {
    use std::f64::consts::PI;
    let sunlit = "[sun]\ndirection = [3, 0, 4]\nirradiance = [2, 1]\nhalf_angle_deg = 0\n";
    let text = format!("bands = 2\n{SCENE}{sunlit}").replace("[mesh]", "[mesh]\ntwo_sided = true");
    let folder =
        Folder::with_scene(&text.replace("diffuse = 0.4", "diffuse = [0.4, 0.3]\nemission = [0, 7]"));
    // The middle one has no area.
    folder.write("plate.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 1 3\nf 1 3 4\n");
    folder.render(&["scene.toml", "--out", "a.npy", "--facets", "f.csv", "--report", "r.json"]).succeeds();
    let (head, rows) = rows(&folder);
    let columns = ["irradiance_0", "irradiance_1", "diffuse_radiance_0", "diffuse_radiance_1"];
    assert_eq!(head, [&["index", "side", "area"], &columns[..]].concat());
    let sides: Vec<(&str, &str)> = rows.iter().map(|row| (row[0].as_str(), row[1].as_str())).collect();
    assert_eq!(sides, [("0", "0"), ("0", "1"), ("1", "0"), ("1", "1"), ("2", "0"), ("2", "1")]);
    for row in &rows {
        let values: Vec<f64> = row[2..].iter().map(|text| text.parse().unwrap()).collect();
        // 17 significant digits.
        assert!(
            row[2..].iter().all(|text| text.split(['e', '.']).map(str::len).take(2).sum::<usize>() == 17)
        );
        if row[0] == "1" {
            assert_eq!(values, [0.0; 5]);
            continue;
        }
        // The sun at cosine 0.8 on the front alone; the uniform sky on both sides.
        let sun = if row[1] == "0" { 0.8 } else { 0.0 };
        let irradiance = [PI + 2.0 * sun, PI + sun];
        let want =
            [2.0, irradiance[0], irradiance[1], 0.4 * irradiance[0] / PI, 7.0 + 0.3 * irradiance[1] / PI];
        for (value, want) in values.iter().zip(want) {
            assert!((value - want).abs() < 1e-9 * want, "{row:?}: {value} for {want}");
        }
    }
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    assert_eq!((&report["facets"], &report["degenerate_facets"]), (&3.into(), &1.into()));
}

#[test]
fn irradiances_of_black_facets_are_there_when_asked_for() {
    let folder = Folder::with_scene(&SCENE.replace("diffuse = 0.4", ""));
    folder.render(&["scene.toml", "--out", "a.npy", "--facets", "f.csv"]).succeeds();
    for row in rows(&folder).1 {
        let irradiance: f64 = row[3].parse().unwrap();
        assert!((irradiance - std::f64::consts::PI).abs() < 1e-9, "{row:?}");
        assert_eq!(row[4].parse(), Ok(0.0));
    }
}

#[test]
fn the_report_has_every_key() {
    let folder = scene(2);
    folder.render(&["scene.toml", "--out", "a.npy", "--report", "r.json"]).succeeds();
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    let number = |value: &Value| value.as_f64().is_some_and(|x| x >= 0.0);
    for key in ["tolerance", "error_estimate", "facets", "degenerate_facets", "bands", "elements", "sweeps"] {
        assert!(number(&report[key]), "{key}: {report}");
    }
    for (table, keys) in [
        ("certified", &["solver", "chain_tail", "dropped"][..]),
        ("pairs", &["tested", "culled", "exact", "sampled"]),
        ("rays", &["visibility", "sun", "chain", "primary"]),
        ("bytes", &["scene", "bvh", "coupling", "light", "image"]),
        ("seconds", &["read", "scene", "bvh", "coupling", "light", "radiosity", "image", "write", "total"]),
        ("signature", &["projected_area"]),
    ] {
        keys.iter().for_each(|key| assert!(number(&report[table][key]), "{table}.{key}: {report}"));
    }
    for list in [
        &report["reference_radiance"],
        &report["signature"]["radiant_intensity"],
        &report["signature"]["mean_radiance"],
    ] {
        assert!(list.as_array().is_some_and(|list| list.len() == 2 && list.iter().all(number)), "{report}");
    }
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert!(report["certified"]["excludes"].is_array() && report["limited_by"].is_string());
    assert!(report["skipped"].is_object());
    let met = report["error_estimate"].as_f64() <= report["tolerance"].as_f64();
    assert_eq!(report["tolerance_met"], met);
    let seconds = |key: &str| report["seconds"][key].as_f64().unwrap();
    assert!(seconds("total") >= seconds("image") + seconds("read"));
    // Looking down, the background is the ground, which is 0.
    assert_eq!(report["signature"]["contrast"], serde_json::json!([null, null]));
    let area = report["signature"]["projected_area"].as_f64().unwrap();
    assert!((area - 4.0).abs() < 0.05, "{area}");
}

#[test]
fn the_reference_radiance_may_be_given() {
    let folder = scene(2);
    let text = String::from_utf8(folder.read("scene.toml")).unwrap();
    folder.write("scene.toml", format!("reference_radiance = [0.5, 4]\n{text}"));
    folder.render(&["scene.toml", "--out", "a.npy", "--report", "r.json"]).succeeds();
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    assert_eq!(report["reference_radiance"], serde_json::json!([0.5, 4.0]));
}

#[test]
fn a_tolerance_that_is_missed_is_a_warning() {
    // The finer one is hard on an image of so few pixels, all of the plate's outline among them.
    let folder = scene(1);
    let text = String::from_utf8(folder.read("scene.toml")).unwrap();
    for tolerance in ["0.1", "5e-4"] {
        folder.write("scene.toml", text.replace("2e-3", tolerance));
        let run = folder.render(&["scene.toml", "--out", "a.npy", "--report", "r.json"]);
        let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
        assert_eq!(run.code, Some(0));
        assert_eq!(run.stderr.starts_with("warning: "), report["tolerance_met"] == false, "{run:?}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let folder = scene(2);
    let run = |threads: &str| {
        let files = ["--out", "a.npy", "--out", "a.exr", "--facets", "f.csv", "--threads", threads];
        folder.render(&[&["scene.toml"], &files[..]].concat()).succeeds();
        ["a.npy", "a.exr", "f.csv"].map(|name| folder.read(name))
    };
    let one = run("1");
    assert!(["0", "2", "3", "8"].iter().all(|threads| run(threads) == one));
}
