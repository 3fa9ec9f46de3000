//! The manual of the scene file names every key and value that the program knows, and nothing else; what the program
//! offers around it (`--check`, `--list`) works.
#![cfg(feature = "std")]

#[path = "support/render.rs"]
mod render;

use std::collections::BTreeSet;

use render::{Folder, SCENE};

const MANUAL: &str = include_str!("../kernel/examples/render/SCENE.md");

/// The rows of the manual's tables: key, unit, range, default, meaning.
fn rows() -> Vec<[&'static str; 5]> {
    let row = |line: &'static str| -> Option<[&'static str; 5]> {
        let cells: Vec<&str> =
            line.strip_prefix('|')?.strip_suffix('|')?.split(" |").map(str::trim).collect();
        let cells: Vec<&str> = cells.iter().map(|cell| cell.trim_start_matches("| ").trim()).collect();
        let cells: [&str; 5] = cells.try_into().ok()?;
        cells[0].starts_with('`').then_some(cells)
    };
    MANUAL.lines().filter_map(row).collect()
}

/// What the program says that it expects in place of an unknown key or value in `scene`.
fn expected(scene: &str) -> BTreeSet<String> {
    let told = Folder::with_scene(scene).render(&["scene.toml"]).fails(&["scene.toml"]).stderr;
    let (_, list) = told.split_once("expected ").unwrap_or_else(|| panic!("{told}"));
    list.split('`').skip(1).step_by(2).map(String::from).collect()
}

fn edited(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    SCENE.replacen(from, to, 1)
}

#[test]
fn every_key_is_in_the_manual() {
    let tables = [
        ("", format!("surprise = 1\n{SCENE}")),
        ("mesh.", edited("[mesh]", "[mesh]\nsurprise = 1")),
        ("material.", edited("[material.default]", "[material.default]\nsurprise = 1")),
        ("material.gloss.", edited("diffuse = 0.4", "gloss = { surprise = 1 }")),
        ("sky.", edited("[sky]", "[sky]\nsurprise = 1")),
        ("sun.", format!("{SCENE}[sun]\nsurprise = 1\n")),
        ("camera.", edited("[camera]", "[camera]\nsurprise = 1")),
    ];
    let mut known = BTreeSet::new();
    for (table, scene) in tables {
        let keys = expected(&scene);
        assert!(keys.len() > 1, "{table}: {keys:?}");
        known.extend(keys.into_iter().map(|key| format!("{table}{key}")));
    }
    let described: BTreeSet<String> = rows().iter().map(|row| row[0].trim_matches('`').to_string()).collect();
    assert_eq!(described, known);
    for [key, _, range, default, meaning] in rows() {
        assert!(
            !range.is_empty() && !default.is_empty() && meaning.len() > 7 && meaning.ends_with('.'),
            "{key}"
        );
    }
}

#[test]
fn every_value_is_in_the_manual() {
    let values = [
        ("sky.model", edited("\"uniform\"", "\"surprise\"")),
        ("sky.columns", edited("\"uniform\"", "\"uniform\"\ncolumns = \"surprise\"")),
        ("camera.kind", edited("\"orthographic\"", "\"surprise\"")),
        ("camera.sampling", edited("[camera]", "[camera]\nsampling = \"surprise\"")),
    ];
    for (key, scene) in values {
        let row = rows().into_iter().find(|row| row[0].trim_matches('`') == key).unwrap();
        let described: BTreeSet<String> = row[2].split(", ").map(String::from).collect();
        assert_eq!(described, expected(&scene), "{key}");
    }
}

/// A default written out changes nothing.
#[test]
fn defaults_are_what_the_manual_says() {
    let default = |key: &str| rows().into_iter().find(|row| row[0].trim_matches('`') == key).unwrap()[3];
    let mut scene = SCENE.replace("tolerance = 2e-3\n", "").replace("diffuse = 0.4\n", "specular = 0.4\n");
    scene =
        scene.replace("\"uniform\"", "\"overcast\"") + "[sun]\ndirection = [0.3, 0.2, 1]\nirradiance = 2\n";
    let plain = Folder::with_scene(&scene).image();
    let mut full = format!("tolerance = {}\nbands = {}\n{scene}", default("tolerance"), default("bands"));
    for (table, keys) in [
        ("mesh", &["two_sided", "smooth"][..]),
        ("material", &["diffuse", "emission"]),
        ("sky", &["radiance", "ground", "up"]),
        ("sun", &["half_angle_deg"]),
        ("camera", &["sampling"]),
    ] {
        let head = if table == "material" { "[material.default]".into() } else { format!("[{table}]") };
        let lines: String = keys
            .iter()
            .map(|key| (key, default(&format!("{table}.{key}"))))
            .map(|(key, value)| {
                if *key == "sampling" {
                    format!("\n{key} = \"{value}\"")
                } else {
                    format!("\n{key} = {value}")
                }
            })
            .collect();
        full = full.replacen(&head, &format!("{head}{lines}"), 1);
    }
    assert_eq!(Folder::with_scene(&full).image(), plain, "{full}");
}

#[test]
fn help_names_the_manual_and_its_example_is_good() {
    let folder = Folder::with_scene(SCENE);
    let help = folder.render(&["--help"]).succeeds().stdout;
    assert!(help.contains("SCENE.md") && help.contains("--manual"), "{help}");
    assert_eq!(folder.render(&["--manual"]).succeeds().stdout, MANUAL);
    let example = MANUAL.split("```").nth(1).unwrap().strip_prefix("toml\n").unwrap();
    folder.write("example.toml", example.replace("aircraft.obj", "plate.obj"));
    let told = folder.render(&["--check", "example.toml"]).succeeds();
    assert_eq!(told.stderr, "");
    assert!(
        told.stdout.contains("example.toml: good: 512 x 512 pixels, 2 facets, 1 material, 1 band"),
        "{}",
        told.stdout
    );
}

#[test]
fn check_reads_everything_and_writes_nothing() {
    let folder = Folder::with_scene(SCENE);
    let before = folder.contents();
    let told = folder.render(&["scene.toml", "--check"]).succeeds().stdout;
    assert!(told.contains("64 pixel centres, 16 show the object and 48 the background"), "{told}");
    assert!(before == folder.contents());
    let table = |keys: &str| edited("\"uniform\"", &format!("\"table\"\nfile = \"{keys}\""));
    for (scene, words) in [
        (edited("plate.obj", "missing.obj"), &["missing.obj"][..]),
        (edited("[material.default]", "[material.wing]"), &["[material.default]"]),
        (edited("plate.obj\"", "plate.obj\"\nsmooth = true"), &["vertex normals"]),
        (table("missing.exr"), &["missing.exr"]),
        (edited("diffuse = 0.4", "diffuse = 2"), &["material.default.diffuse"]),
        (edited("diffuse = 0.4", "emission = 1e38"), &["emission"]),
    ] {
        Folder::with_scene(&scene).fails_without_trace(&["--check", "scene.toml"], words);
    }
    for arguments in [
        &["--check"][..],
        &["--check", "scene.toml", "--out", "a.png"],
        &["--list", "plate.obj", "scene.toml"],
    ] {
        folder.render(arguments).refuses(2, &["expected a mesh file"; 0]);
    }
}

#[test]
fn what_is_seldom_meant_is_told() {
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 2 3 4\nf 5 8 7 6\n\
                f 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    let view = edited(
        "eye = [0, 0, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]",
        "eye = [5, 4, 3]\ntarget = [0.5, 0.5, 0.5]\nup = [0, 0, 1]",
    );
    let two_sided = view.replace("plate.obj\"", "plate.obj\"\ntwo_sided = true");
    let away = edited("target = [0, 0, 0]", "target = [0, 0, 9]");
    let dark = edited("[sky]\nmodel = \"uniform\"\n", "");
    let behind = edited("[sky]\nmodel = \"uniform\"\n", "[sun]\ndirection = [0.5, 0, -1]\nirradiance = 1\n");
    // The scene, whether its mesh is the cube with its fronts inward, and what is told.
    let cases: &[(&str, bool, Option<&str>)] = &[
        (SCENE, false, None),
        (&view, true, Some("100 % of what is seen are backs")),
        (&two_sided, true, None),
        (&away, false, Some("no pixel's centre meets the object, which lies between [-1.0, -1.0, 0.0] and")),
        (&dark, false, Some("nothing shines")),
        (&behind, false, Some("the image is black")),
    ];
    for (scene, inward, words) in cases {
        let folder = Folder::with_scene(scene);
        if *inward {
            folder.write("plate.obj", cube);
        }
        let run = folder.render(&["scene.toml", "--out", "a.npy", "--report", "r.json"]).succeeds();
        let report: serde_json::Value = serde_json::from_slice(&folder.contents()["r.json"]).unwrap();
        let view = &report["view"];
        assert_eq!(view["samples"], 64);
        let sum: u64 = ["fronts", "backs", "background"].iter().map(|key| view[*key].as_u64().unwrap()).sum();
        assert_eq!(sum, 64);
        assert_eq!(view["backs"].as_u64().unwrap() > 0, words.is_some_and(|words| words.contains("backs")));
        let warnings = report["warnings"].as_array().unwrap();
        match words {
            None => assert!(run.stderr.is_empty() && warnings.is_empty(), "{run:?}"),
            Some(words) => {
                assert!(run.stderr.starts_with("warning: ") && run.stderr.contains(words), "{run:?}");
                assert!(warnings.iter().any(|warning| warning.as_str().unwrap().contains(words)), "{report}");
            }
        }
    }
}

#[test]
fn one_turned_wall_is_counted() {
    // A closed room seen from inside; one wall's corners run the other way.
    let room = "v 0 0 0\nv 3 0 0\nv 3 2 0\nv 0 2 0\nv 0 0 2\nv 3 0 2\nv 3 2 2\nv 0 2 2\nf 1 2 3 4\nf 5 8 7 6\n\
                f 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n";
    let scene = edited(
        "kind = \"orthographic\"\neye = [0, 0, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]",
        "kind = \"perspective\"\nfov_deg = 60\neye = [1.5, 0.2, 1]\ntarget = [1.5, 2, 1]\nup = [0, 0, 1]",
    );
    let turned = room.replace("f 4 3 7 8", "f 8 7 3 4");
    let backs = |mesh: &str| {
        let folder = Folder::with_scene(&scene);
        folder.write("plate.obj", mesh);
        let run = folder.render(&["scene.toml", "--report", "r.json"]).succeeds();
        let report: serde_json::Value = serde_json::from_slice(&folder.contents()["r.json"]).unwrap();
        let told =
            run.stdout.contains("backs, which are black") && run.stderr.contains("of what is seen are backs");
        (report["view"]["backs"].as_u64().unwrap(), told)
    };
    assert_eq!(backs(room), (0, false));
    let (count, told) = backs(&turned);
    assert!(count > 32 && told, "{count}");
}

#[test]
fn lists_are_scenes_to_start_from() {
    let folder = Folder::with_scene(SCENE);
    folder.write("two words.mtl", "# library\nnewmtl body\nKd 0.6 0.3 0.1\nKs 0.8 0.1 0.1\nNs 100\nnewmtl Lamp.1\nKd 0\nKe 2 2 2\nmap_Kd x.png\n");
    folder.write(
        "body.obj",
        "mtllib two words.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nusemtl body\n\
         f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nusemtl Lamp.1\nf 2 3 7 6\nf 3 4 8 7\nusemtl none\nf 4 1 5 8\n",
    );
    let list = folder.render(&["--list", "body.obj"]).succeeds().stdout;
    for words in [
        "# body.obj: 12 facets, 3 materials",
        "1 x 1 x 1",
        "open edges: 0; edges of more than two facets: 0; edges where fronts and backs meet: 0",
        "closed bodies whose fronts look outward: 1",
        "# 6 facets, area 3\n[material.body]\n# scaled",
        "# 4 facets, area 2\n[material.\"Lamp.1\"]\ndiffuse = 0\nemission = 2\n",
        "# 2 facets, area 1; the file says no more\n[material.none]\ndiffuse = 0.4\n",
        "bands = 3",
    ] {
        assert!(list.contains(words), "{words}: {list}");
    }
    // 0.6 + 0.8 is too much for a surface: both shrink alike.
    assert!(list.contains("diffuse = [0.428571, 0.3, 0.1]\nspecular = [0.571428, 0.1, 0.1]"), "{list}");
    folder.write("listed.toml", &list);
    assert_eq!(folder.render(&["--check", "listed.toml"]).succeeds().stderr, "");
    let image = folder.render(&["listed.toml"]).succeeds().stderr;
    assert_eq!(image, "");
    // Inside out, open, and two bodies that touch nothing.
    let cube = std::fs::read_to_string(folder.path("body.obj")).unwrap();
    let turned: String = cube
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    folder.write("turned.obj", turned);
    assert!(
        folder
            .render(&["--list", "turned.obj"])
            .succeeds()
            .stdout
            .contains("fronts look inward, as of a room: 1")
    );
    folder.write("open.obj", cube.replace("f 4 1 5 8", "f 5 1 4\nv 9 9 9\nv 8 9 9\nv 9 8 9\nf -1 -2 -3"));
    let open = folder.render(&["--list", "open.obj"]).succeeds().stdout;
    assert!(
        open.contains("open sheets: 2") && open.contains("open edges: 6") && open.contains("meet: 2"),
        "{open}"
    );
    folder.write("missing.obj", format!("mtllib gone.mtl\n{cube}"));
    assert!(folder.render(&["--list", "missing.obj"]).succeeds().stdout.contains("# warning: gone.mtl"));
    folder.render(&["--list", "gone.obj"]).fails(&["gone.obj"]);
    // The values of a glTF file.
    folder.write(
        "a.gltf",
        "{\"asset\": {\"version\": \"2.0\"}, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}], \
        \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}, \"material\": 0}]}], \
        \"materials\": [{\"name\": \"m\", \"doubleSided\": true, \"emissiveFactor\": [0, 0, 1], \
        \"pbrMetallicRoughness\": {\"baseColorFactor\": [0.5, 0.5, 0.5, 1], \"metallicFactor\": 0.5}}], \
        \"accessors\": [{\"bufferView\": 0, \"componentType\": 5121, \"count\": 3, \"type\": \"VEC3\"}], \
        \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 9}], \
        \"buffers\": [{\"byteLength\": 9, \"uri\": \"data:,%00%00%00%01%00%00%00%01%00\"}]}",
    );
    let list = folder.render(&["--list", "a.gltf"]).succeeds().stdout;
    assert!(
        list.contains("two_sided = true")
            && list.contains("diffuse = 0.25\nspecular = 0.25\nemission = [0, 0, 1]"),
        "{list}"
    );
}
