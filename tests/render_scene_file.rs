//! The scene file: what is refused, and in which words.
#![cfg(feature = "std")]

#[path = "support/render.rs"]
mod render;

use render::{Folder, SCENE, npy};

/// The scene with one piece of its text replaced.
fn edited(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    SCENE.replacen(from, to, 1)
}

fn refuses(scene: &str, words: &[&str]) {
    Folder::with_scene(scene).fails_without_trace(&["scene.toml"], &[&["scene.toml"], words].concat());
}

#[test]
fn unknown_keys_are_named_with_their_line() {
    refuses(&format!("surprise = 1\n{SCENE}"), &["scene.toml:1:", "unknown key", "surprise"]);
    for table in ["[mesh]", "[material.default]", "[sky]", "[camera]"] {
        refuses(&edited(table, &format!("{table}\nsurprise = 1")), &["unknown key", "surprise"]);
    }
    refuses(&format!("{SCENE}[sun]\nsurprise = 1\n"), &["unknown key", "surprise"]);
    refuses(&format!("{SCENE}[moon]\n"), &["unknown key", "moon"]);
    let gloss = edited("diffuse = 0.4", "gloss = { axis_ratio = 3, roughness = 1 }");
    refuses(&gloss, &["scene.toml:5:", "unknown key", "roughness"]);
}

#[test]
fn missing_keys_are_named() {
    for (line, key) in [
        ("[mesh]\nfile = \"plate.obj\"\n", "`mesh`"),
        ("file = \"plate.obj\"\n", "`file`"),
        ("kind = \"orthographic\"\n", "`kind`"),
        ("eye = [0, 0, 5]\n", "`eye`"),
        ("target = [0, 0, 0]\n", "`target`"),
        ("up = [0, 1, 0]\n", "`up`"),
        ("height = 4.0\n", "`camera.height`"),
        ("resolution = [8, 8]\n", "`resolution`"),
        ("model = \"uniform\"\n", "`model`"),
    ] {
        refuses(&edited(line, ""), &["missing key", key]);
    }
    let (without_camera, _) = SCENE.split_once("[camera]").unwrap();
    refuses(without_camera, &["missing key", "`camera`"]);
    refuses(&edited("\"orthographic\"", "\"perspective\""), &["`camera.fov_deg`"]);
    refuses(&edited("\"uniform\"", "\"cie\""), &["`sky.type`"]);
    refuses(&edited("\"uniform\"", "\"cie\"\ntype = 5"), &["`sky.sun_direction`"]);
    refuses(&edited("\"uniform\"", "\"table\""), &["`sky.file`"]);
    refuses(&format!("{SCENE}[sun]\nirradiance = 1\n"), &["`direction`"]);
    refuses(&format!("{SCENE}[sun]\ndirection = [0, 0, 1]\n"), &["`irradiance`"]);
}

#[test]
fn values_out_of_range_are_named() {
    let sun = |keys: &str| format!("{SCENE}[sun]\n{keys}\n");
    let cie = |keys: &str| edited("\"uniform\"", &format!("\"cie\"\n{keys}"));
    let cases: &[(String, &str)] = &[
        (edited("2e-3", "1e-7"), "tolerance"),
        (edited("2e-3", "0.2"), "tolerance"),
        (edited("2e-3", "nan"), "tolerance"),
        (edited("tolerance", "bands = 0\ntolerance"), "bands"),
        (edited("tolerance", "bands = 65\ntolerance"), "bands"),
        (edited("tolerance", "reference_radiance = 0\ntolerance"), "reference_radiance"),
        (edited("tolerance", "reference_radiance = [1, 1]\ntolerance"), "reference_radiance"),
        (edited("diffuse = 0.4", "diffuse = 1.1"), "material.default.diffuse"),
        (edited("diffuse = 0.4", "diffuse = -0.1"), "material.default.diffuse"),
        (edited("diffuse = 0.4", "specular = inf"), "material.default.specular"),
        (edited("diffuse = 0.4", "diffuse = 0.6\nspecular = 0.6"), "diffuse + specular"),
        (edited("diffuse = 0.4", "emission = -1"), "material.default.emission"),
        (edited("diffuse = 0.4", "diffuse = [0.4, 0.4]"), "material.default.diffuse"),
        (edited("diffuse = 0.4", "gloss = { axis_ratio = 0.5 }"), "material.default.gloss.axis_ratio"),
        (edited("diffuse = 0.4", "gloss = { axis_ratio = 2, rays = 0 }"), "material.default.gloss.rays"),
        (edited("\"uniform\"", "\"uniform\"\nradiance = -1"), "sky.radiance"),
        (edited("\"uniform\"", "\"uniform\"\nradiance = [1, 2]"), "sky.radiance"),
        (edited("\"uniform\"", "\"overcast\"\nground = nan"), "sky.ground"),
        (edited("\"uniform\"", "\"overcast\"\nup = [0, 0, 0]"), "sky.up"),
        (cie("type = 0\nsun_direction = [0, 0, 1]"), "sky.type"),
        (cie("type = 16\nsun_direction = [0, 0, 1]"), "sky.type"),
        (cie("type = 5\nsun_direction = [1, 0, -0.1]"), "above the horizon"),
        (cie("type = 5\nsun_direction = [0, 0, 0]"), "sky.sun_direction"),
        (edited("eye = [0, 0, 5]", "eye = [0, 0, nan]"), "camera.eye"),
        (edited("target = [0, 0, 0]", "target = [0, 0, 5]"), "camera.target"),
        (edited("up = [0, 1, 0]", "up = [0, 0, 0]"), "camera.up"),
        (edited("up = [0, 1, 0]", "up = [0, 0, 2]"), "camera.up"),
        (edited("height = 4.0", "height = 0"), "camera.height"),
        (edited("kind = \"orthographic\"", "kind = \"perspective\"\nfov_deg = 180"), "camera.fov_deg"),
        (edited("[8, 8]", "[0, 8]"), "camera.resolution"),
        (edited("[8, 8]", "[8, -8]"), "camera.resolution"),
        (edited("[8, 8]", "[9000000000000000000, 9]"), "camera.resolution"),
        (sun("direction = [0, 0, 0]\nirradiance = 1"), "sun.direction"),
        (sun("direction = [0, inf, 0]\nirradiance = 1"), "sun.direction"),
        (sun("direction = [0, 0, 1]\nirradiance = -1"), "sun.irradiance"),
        (sun("direction = [0, 0, 1]\nirradiance = 1\nhalf_angle_deg = 11"), "sun.half_angle_deg"),
        (sun("direction = [0, 0, 1]\nirradiance = 1\nhalf_angle_deg = 1e-5"), "sun.half_angle_deg"),
    ];
    for (scene, key) in cases {
        refuses(scene, &[key, "expected"]);
    }
}

#[test]
fn syntax_and_types_are_told_with_their_line() {
    for (scene, line) in [
        (edited("2e-3", "\"small\""), "scene.toml:1:"),
        (edited("2e-3", "= 3"), "scene.toml:1:"),
        (edited("diffuse = 0.4", "diffuse = true"), "scene.toml:5:"),
        (edited("\"uniform\"", "\"foggy\""), "scene.toml:7:"),
        (edited("[0, 0, 5]", "[0, 0]"), "scene.toml:10:"),
        (edited("\"orthographic\"", "\"fisheye\""), "scene.toml:9:"),
        (edited("tolerance", "max_bounces = -1\ntolerance"), "scene.toml:1:"),
    ] {
        refuses(&scene, &[line, "expected"]);
    }
}

/// A mesh of two facets for each of the names.
fn named(names: &[&str]) -> String {
    let facets = names.iter().map(|name| format!("usemtl {name}\nf 1 2 3\n"));
    "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_string() + &facets.collect::<String>()
}

#[test]
fn materials_must_match_the_mesh() {
    let folder = Folder::with_scene(&edited("[material.default]", "[material.wing]"));
    folder.write("plate.obj", named(&["body"]));
    folder.fails_without_trace(&["scene.toml"], &["[material.body]", "[material.default]", "plate.obj"]);
    let folder = Folder::with_scene(&edited("[material.default]\ndiffuse = 0.4\n", ""));
    folder.fails_without_trace(&["scene.toml"], &["[material.default]"]);
    // A library of materials serves many meshes.
    let library =
        edited("[material.default]", "[material.wing]\n[material.\"two words\"]\n[material.default]");
    let folder = Folder::with_scene(&library);
    let told = folder.render(&["scene.toml"]).succeeds().stderr;
    assert!(told.contains("[material.wing]") && told.contains("[material.\"two words\"]"), "{told}");
}

#[test]
fn advice_on_material_names_works_when_pasted() {
    for names in [
        &["Material.001", "white paint"][..],
        &["plain", "with-dash", "under_score", "7"],
        &["quote\"inside", "back\\slash", "it's", "a]b", "#1", "\u{e4}\u{f6}\u{fc}", "tab\tinside"],
        &["a.b.c", "..", "=", "[x]", "*", "(null)", "C:\\paint\\"],
    ] {
        let folder = Folder::with_scene(&edited("[material.default]\ndiffuse = 0.4\n", ""));
        folder.write("plate.obj", named(names));
        let told = folder.render(&["scene.toml"]).fails(&["no table"]).stderr;
        // All names at once.
        let list = told.split_once("expected ").unwrap().1.split_once(", or [material.default]").unwrap().0;
        let mut rest = list;
        let mut tables = String::new();
        for _ in names {
            // A header ends at "]," or at the end; names hold brackets only in quotes.
            let end = header_end(rest);
            tables += &format!("{}\ndiffuse = 0.4\n", &rest[..end]);
            rest = rest[end..].trim_start_matches(", ");
        }
        assert_eq!(rest, "", "{told}");
        folder.write("scene.toml", edited("[material.default]\ndiffuse = 0.4\n", &tables));
        assert_eq!(folder.render(&["scene.toml"]).succeeds().stderr, "", "{tables}");
    }
    // What is written without quotes is told how to write.
    refuses(
        &edited("[material.default]", "[material.Material.001]"),
        &["scene.toml:", "[material.\"Material.001\"]"],
    );
}

/// The length of the TOML table header that begins the text.
fn header_end(text: &str) -> usize {
    let (mut quoted, mut escaped) = (false, false);
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            ']' if !quoted => return at + 1,
            _ => {}
        }
    }
    panic!("no header: {text}");
}

#[test]
fn reflectances_add_up_to_1_within_single_precision() {
    // The floats nearest to x and to 1 - x, as a simulator in single precision holds a perfect reflector.
    let pairs = (1..200).map(|i| i as f32 / 199.7).map(|x| (f64::from(x), f64::from(1.0 - x)));
    let over: Vec<(f64, f64)> = pairs.filter(|(x, rest)| x + rest > 1.0).take(8).collect();
    for (diffuse, specular) in &over {
        let scene = edited("diffuse = 0.4", &format!("diffuse = {diffuse}\nspecular = {specular}"));
        Folder::with_scene(&scene).render(&["scene.toml"]).succeeds();
    }
    // The example that was reported, and the same in the digits that f32 needs.
    assert_eq!(over.len(), 8);
    for (diffuse, specular) in [("0.44949105381965637", "0.550508975982666"), ("0.44949105", "0.550509")] {
        let scene = edited("diffuse = 0.4", &format!("diffuse = {diffuse}\nspecular = {specular}"));
        Folder::with_scene(&scene).render(&["scene.toml"]).succeeds();
    }
    Folder::with_scene(&edited("diffuse = 0.4", "diffuse = 1.0000001")).render(&["scene.toml"]).succeeds();
    refuses(&edited("diffuse = 0.4", "diffuse = 1.000001"), &["material.default.diffuse", "0 to 1"]);
    refuses(
        &edited("diffuse = 0.4", "diffuse = 0.5\nspecular = 0.500001"),
        &["diffuse + specular", "at most 1"],
    );
}

#[test]
fn the_scene_file_has_any_mark_and_any_line_end() {
    let plain = Folder::with_scene(SCENE).image();
    for end in ["\n", "\r\n", "\r"] {
        let text = SCENE.replace('\n', end);
        let wide: Vec<u16> = std::iter::once(0xfeff).chain(text.encode_utf16()).collect();
        let little = wide.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big = wide.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for content in [text.clone().into_bytes(), format!("\u{feff}{text}").into_bytes(), little, big] {
            let folder = Folder::with_scene(SCENE);
            folder.write("scene.toml", content);
            assert_eq!(folder.image(), plain);
        }
    }
    let folder = Folder::with_scene(SCENE);
    folder.write("scene.toml", [SCENE.as_bytes(), b"# Gr\xfcn\n"].concat());
    folder.fails_without_trace(&["scene.toml"], &["scene.toml:15:", "UTF-8"]);
}

#[test]
fn bad_meshes_are_told_with_file_and_line() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases: &[(String, &[&str])] = &[
        (String::new(), &["empty", "at least one facet"]),
        (triangle.into(), &["empty", "at least one facet"]),
        (format!("v 0 nan 0\n{triangle}f 1 2 3\n"), &["plate.obj:1:", "not finite"]),
        (format!("{triangle}v 1e999 0 0\nf 1 2 4\n"), &["plate.obj:4:", "not finite"]),
        (format!("{triangle}f 1 2 4\n"), &["plate.obj:4:", "vertex index 4", "1 to 3"]),
        (format!("{triangle}f 0 1 2\n"), &["plate.obj:4:", "vertex index 0", "1 to 3"]),
        (format!("{triangle}f 1 2 -4\n"), &["plate.obj:4:", "out of range"]),
        (format!("{triangle}f 1 2\n"), &["plate.obj:4:", "3 corners"]),
        (format!("{triangle}f 1 2 x\n"), &["plate.obj:4:", "\"x\""]),
        (format!("{triangle}v 1 2\nf 1 2 3\n"), &["plate.obj:4:", "three numbers"]),
        (format!("{triangle}v 1 2 y\nf 1 2 3\n"), &["plate.obj:4:", "\"y\""]),
    ];
    for (mesh, words) in cases {
        let folder = Folder::with_scene(SCENE);
        folder.write("plate.obj", mesh);
        folder.fails_without_trace(&["scene.toml"], &[&["plate.obj"], *words].concat());
    }
    let folder = Folder::with_scene(SCENE);
    folder.fails_without_trace(&["missing.toml"], &["missing.toml", "No such file"]);
    folder.write("scene.toml", edited("plate.obj", "missing.obj"));
    folder.fails_without_trace(&["scene.toml"], &["missing.obj", "No such file"]);
    folder.write("scene.toml", edited("plate.obj", "plate.3ds")).write("plate.3ds", "");
    folder.fails_without_trace(&["scene.toml"], &["plate.3ds", ".obj, .ply, .stl, .gltf or .glb"]);
    folder.write("scene.toml", edited("plate.obj", "plate.obj\"\nsmooth = true\n#"));
    folder.fails_without_trace(&["scene.toml"], &["plate.obj", "smooth", "vertex normals"]);
    // Normals are looked at where they are asked for.
    for (normals, words) in [
        ("f 1//1 2//1 3//1\n", "plate.obj:4: normal index 1 is out of range"),
        ("f 1//-1 2//-1 3//-1\n", "plate.obj:4: normal index -1 is out of range"),
        ("vn 0 0 0\nf 1//1 2//1 3//1\n", "plate.obj:4: vertex normal"),
        ("vn nan 0 0\nvn 0 0 1\nf 1//1 2//2 3//2\n", "plate.obj:4: vertex normal"),
        ("vn 0 0\nf 1//1 2//1 3//1\n", "plate.obj:4: vertex normal"),
    ] {
        folder.write("plate.obj", format!("{triangle}{normals}"));
        folder.fails_without_trace(&["scene.toml"], &[words, "smooth"]);
    }
    folder.write("plate.obj", format!("{triangle}vn 0 0 0\nvn 0 0 1\nf 1//2 2//2 3//2\n"));
    folder.render(&["scene.toml"]).succeeds();
}

#[test]
fn bad_sky_tables_are_told() {
    let table = |name: &str| edited("\"uniform\"", &format!("\"table\"\nfile = \"{name}\""));
    let ones = [1.0; 24];
    let folder = Folder::with_scene(&table("sky.npy"));
    let run = |words: &[&str]| folder.fails_without_trace(&["scene.toml"], &[&["sky."], words].concat());
    run(&["No such file"]);
    for shape in [&[24][..], &[2, 2, 2, 3], &[2, 4, 3], &[0, 4], &[2, 6, 2]] {
        let values = &ones[..shape.iter().product::<u64>() as usize];
        folder.write("sky.npy", npy(shape, values));
        run(&["wrong size", "rows x columns"]);
    }
    folder.write("sky.npy", npy(&[2, 2], &[1.0, 1.0, -1.0, 1.0]));
    run(&["row 1, column 0", "finite radiance from 0 up"]);
    folder.write("sky.npy", npy(&[2, 2], &[1.0, f32::NAN, 1.0, 1.0]));
    run(&["row 0, column 1", "finite radiance"]);
    folder.write("sky.npy", &npy(&[2, 2], &[1.0; 4])[..100]);
    run(&[]);
    folder.write("sky.pfm", "Pf\n2 2\n-1.0\n0123").write("scene.toml", table("sky.pfm"));
    run(&["wrong size", "2 x 2"]);
    folder.write("sky.pfm", "P6\n2 2\n255\n0123");
    run(&["not a PFM file"]);
    folder.write("sky.exr", "not an image").write("scene.toml", table("sky.exr"));
    run(&["sky.exr"]);
    folder.write("sky.txt", "1 1").write("scene.toml", table("sky.txt"));
    run(&[".npy, .exr, .hdr or .pfm"]);
}

#[test]
fn keys_of_the_other_kind_and_model_have_no_effect() {
    // The design's example carries both the height and the field of view.
    let plain = Folder::with_scene(SCENE).image();
    let scene = edited("height = 4.0", "height = 4.0\nfov_deg = 30\nsampling = \"area\"");
    let scene = scene.replace("\"uniform\"", "\"uniform\"\nground = 0.5\nup = [1, 2, 3]\nradiance = 1.0");
    assert_eq!(plain, Folder::with_scene(&scene).image());
}
