//! What the keys of the scene file mean, seen in the images of the `render` program.
#![cfg(feature = "std")]

#[path = "support/render.rs"]
mod render;

use glam::{DMat3, DVec3, dvec3};
use render::{Folder, PLATE, SCENE, npy};

/// Rounding of an image to f32, of a few operations.
const F32: f64 = 5e-7;

fn edited(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    SCENE.replacen(from, to, 1)
}

fn close(got: f32, want: f64, tolerance: f64) -> bool {
    (f64::from(got) - want).abs() <= tolerance * want.abs().max(1.0)
}

/// A perspective look along `forward` at the sky alone: the plate lies behind the eye.
fn sky_scene(sky: &str, forward: DVec3) -> String {
    format!(
        "[mesh]\nfile = \"plate.obj\"\n[material.default]\n[sky]\n{sky}\n[camera]\nkind = \"perspective\"\n\
         eye = [0, 0, 3]\ntarget = [{}, {}, {}]\nup = [0, 0, 1]\nfov_deg = 100\nresolution = [6, 8]\n\
         sampling = \"centre\"\n",
        forward.x,
        forward.y,
        forward.z + 3.0
    )
}

/// Direction through the centre of pixel (row, column) of that camera.
fn pixel_direction(forward: DVec3, row: usize, column: usize) -> DVec3 {
    let f = forward.normalize();
    let r = f.cross(DVec3::Z).normalize();
    let height = 2.0 * 50f64.to_radians().tan();
    let x = ((column as f64 + 0.5) / 6.0 - 0.5) * height * 6.0 / 8.0;
    let y = (0.5 - (row as f64 + 0.5) / 8.0) * height;
    (f + r * x + r.cross(f) * y).normalize()
}

/// Compares the sky in two opposite views with `radiance`, pixel by pixel.
fn sky_shows(folder: &Folder, sky: &str, tolerance: f64, radiance: impl Fn(DVec3) -> f64) {
    // The first looks up a little, so that both views hold zenith, nadir or horizon off their centres.
    for forward in [dvec3(1.0, 0.4, 0.7), dvec3(-1.0, 0.3, -0.1)] {
        folder.write("scene.toml", sky_scene(sky, forward));
        let (shape, pixels) = folder.image();
        assert_eq!(shape, [8, 6, 1]);
        for (i, pixel) in pixels.iter().enumerate() {
            let direction = pixel_direction(forward, i / 6, i % 6);
            let want = radiance(direction);
            assert!(close(*pixel, want, tolerance), "{sky}: {direction}: {pixel} for {want}");
        }
    }
}

#[test]
fn skies_are_what_their_formulas_say() {
    let folder = Folder::with_scene(SCENE);
    let up = dvec3(0.5, -0.3, 1.0).normalize();
    let keys = "radiance = 2\nground = 0.25\nup = [5, -3, 10]";
    let height = |d: DVec3| d.dot(up);
    let above = |d: DVec3, radiance: f64| if height(d) >= 0.0 { radiance } else { 0.25 };
    sky_shows(&folder, &format!("model = \"uniform\"\n{keys}"), F32, |_| 2.0);
    sky_shows(&folder, &format!("model = \"hemisphere\"\n{keys}"), F32, |d| above(d, 2.0));
    let overcast = |d: DVec3| above(d, 2.0 * (1.0 + 2.0 * height(d)) / 3.0);
    sky_shows(&folder, &format!("model = \"overcast\"\n{keys}"), F32, overcast);
    let gradient = |d: DVec3| 0.25 + 1.75 * (1.0 + height(d)) / 2.0;
    sky_shows(&folder, &format!("model = \"gradient\"\n{keys}"), F32, gradient);
    sky_shows(&folder, "model = \"hemisphere\"", F32, |d| if d.z >= 0.0 { 1.0 } else { 0.0 });
}

#[test]
fn the_cie_sky_is_that_of_iso_15469() {
    let folder = Folder::with_scene(SCENE);
    // Type 12, clear sky: the standard's parameters a to e.
    let (a, b, c, d, e) = (-1.0, -0.32, 10.0, -3.0, 0.45);
    let sun = dvec3(0.4, 0.6, 0.5).normalize();
    let gradation = |cos_zenith: f64| 1.0 + a * (b / cos_zenith).exp();
    let indicatrix = |angle: f64| {
        1.0 + c * ((d * angle).exp() - (d * std::f64::consts::FRAC_PI_2).exp()) + e * angle.cos().powi(2)
    };
    let radiance = |direction: DVec3| {
        if direction.z < 0.0 {
            return 0.1;
        }
        let angle = direction.dot(sun).clamp(-1.0, 1.0).acos();
        let relative = gradation(direction.z) * indicatrix(angle) / gradation(1.0) / indicatrix(sun.z.acos());
        3.0 * relative
    };
    let keys = "model = \"cie\"\ntype = 12\nradiance = 3\nground = 0.1";
    sky_shows(&folder, &format!("{keys}\nsun_direction = [4, 6, 5]"), F32, radiance);
    // Without a direction of its own: that of the sun, which lies outside both views.
    let lit = format!("{keys}\n[sun]\ndirection = [4, 6, 5]\nirradiance = 1\nhalf_angle_deg = 0");
    sky_shows(&folder, &lit, F32, radiance);
}

#[test]
fn sky_tables_are_interpolated_between_their_centres() {
    let (rows, columns) = (3usize, 4usize);
    let table: Vec<f32> = (0..12).map(|i| ((i * 7) % 12) as f32 / 4.0).collect();
    let folder = Folder::with_scene(SCENE);
    folder.write("sky.npy", npy(&[3, 4], &table));
    let sample = |zero: DVec3, up: DVec3| {
        let table = table.clone();
        move |d: DVec3| {
            let (elevation, east) = (d.dot(up).asin().to_degrees(), up.cross(zero));
            let azimuth = d.dot(east).atan2(d.dot(zero)).to_degrees();
            let row = ((90.0 - elevation) * rows as f64 / 180.0 - 0.5).clamp(0.0, rows as f64 - 1.0);
            let column = (azimuth * columns as f64 / 360.0 - 0.5).rem_euclid(columns as f64);
            let at = |r: f64, c: f64| f64::from(table[r as usize * columns + c as usize % columns]);
            let (r, c) = (row.floor(), column.floor());
            let below = (r + 1.0).min(rows as f64 - 1.0);
            let along = |r: f64| at(r, c) + (column - c) * (at(r, c + 1.0) - at(r, c));
            2.0 * (along(r) + (row - r) * (along(below) - along(r)))
        }
    };
    let keys = "model = \"table\"\nradiance = 2\nfile = \"sky.npy\"";
    // A table may be stored in f32 angles: its steps are of size 1 in 90 degrees.
    let angles = 2e-6;
    sky_shows(&folder, keys, angles, sample(DVec3::X, DVec3::Z));
    let turned = format!("{keys}\nazimuth_zero = [0, -2, 1]");
    sky_shows(&folder, &turned, angles, sample(-DVec3::Y, DVec3::Z));
    // Where the default is parallel to up, y takes its place.
    sky_shows(&folder, &format!("{keys}\nup = [1, 0, 0]"), angles, sample(DVec3::Y, DVec3::X));
}

#[test]
fn sky_tables_come_in_three_formats() {
    use exr::prelude::{WritableImage, write_rgb_file};
    use npyz::WriterBuilder;
    let colours: Vec<f32> = (0..36).map(|i| (i * 5 % 36) as f32).collect();
    let scene = |file: &str| {
        // Pictures would run the other way round.
        let sky = format!("model = \"table\"\ncolumns = \"counter_clockwise\"\nfile = \"{file}\"");
        format!("bands = 3\n{}", sky_scene(&sky, dvec3(1.0, 0.2, 0.3)))
    };
    let folder = Folder::with_scene(&scene("sky.npy"));
    folder.write("sky.npy", npy(&[3, 4, 3], &colours));
    let expected = folder.image();
    assert_eq!(expected.0, [8, 6, 3]);
    // Fortran order and f64, as NumPy may store it.
    let mut fortran = Vec::new();
    let options = npyz::WriteOptions::new().default_dtype().shape(&[3, 4, 3]).order(npyz::Order::Fortran);
    let mut writer = options.writer(&mut fortran).begin_nd().unwrap();
    for (band, column, row) in (0..36).map(|i| (i / 12, i / 3 % 4, i % 3)) {
        writer.push(&f64::from(colours[(row * 4 + column) * 3 + band])).unwrap();
    }
    writer.finish().unwrap();
    folder.write("fortran.npy", fortran).write("scene.toml", scene("fortran.npy"));
    assert!(folder.image() == expected);
    for (header, big) in [("PF\n4 3\n-1\n", false), ("PF 4 3 1.0\n", true)] {
        let mut bytes = header.as_bytes().to_vec();
        for value in colours.chunks(12).rev().flatten() {
            bytes.extend(if big { value.to_be_bytes() } else { value.to_le_bytes() });
        }
        folder.write("sky.pfm", bytes).write("scene.toml", scene("sky.pfm"));
        assert!(folder.image() == expected, "{header}");
    }
    let colour = |x: usize, y: usize| {
        let i = (y * 4 + x) * 3;
        (colours[i], colours[i + 1], colours[i + 2])
    };
    write_rgb_file(folder.path("sky.exr"), 4, 3, colour).unwrap();
    folder.write("scene.toml", scene("sky.exr"));
    assert!(folder.image() == expected);
    // One band serves all.
    folder.write("sky.npy", npy(&[1, 1, 1], &[0.75])).write("scene.toml", scene("sky.npy"));
    assert!(folder.image().1.iter().all(|x| *x == 0.75));
    let layer = exr::prelude::Layer::new(
        (1, 1),
        exr::prelude::LayerAttributes::default(),
        exr::prelude::Encoding::UNCOMPRESSED,
        exr::prelude::AnyChannels::sort(
            [exr::prelude::AnyChannel::new("Y", exr::prelude::FlatSamples::F32(vec![0.75]))]
                .into_iter()
                .collect(),
        ),
    );
    exr::prelude::Image::from_layer(layer).write().to_file(folder.path("sky.exr")).unwrap();
    folder.write("scene.toml", scene("sky.exr"));
    assert!(folder.image().1.iter().all(|x| *x == 0.75));
}

/// What stands to the right in a panorama stands to the right of it in an image from inside.
#[test]
fn panoramas_are_not_mirrored() {
    let (rows, columns) = (90usize, 360usize);
    let mut picture = vec![0f32; rows * columns];
    for row in 40..50 {
        picture[row * columns + 100] = 1.0;
        picture[row * columns + 110] = 2.0;
    }
    let mut pfm = b"Pf\n360 90\n-1.0\n".to_vec();
    picture.chunks(columns).rev().flatten().for_each(|x| pfm.extend(x.to_le_bytes()));
    let scene = |keys: &str, azimuth_deg: f64| {
        let (y, x) = azimuth_deg.to_radians().sin_cos();
        let target = format!("target = [{x}, {y}, 3]");
        sky_scene(&format!("model = \"table\"\nfile = \"sky.pfm\"{keys}"), DVec3::X)
            .replace("target = [1, 0, 3]", &target)
            .replace("fov_deg = 100", "fov_deg = 40")
            .replace("resolution = [6, 8]", "resolution = [81, 41]")
    };
    // Column 100 lies 100.5 degrees from the first one's left edge, clockwise where nothing else is said.
    for (keys, azimuth, right) in [
        ("", -100.5, true),
        ("\ncolumns = \"clockwise\"", -100.5, true),
        ("\ncolumns = \"counter_clockwise\"", 100.5, false),
    ] {
        let folder = Folder::with_scene(&scene(keys, azimuth));
        folder.write("sky.pfm", &pfm).write("plate.obj", PLATE);
        let (_, pixels) = folder.image();
        let row = &pixels[20 * 81..21 * 81];
        let of = |from: f32, to: f32| {
            let found: Vec<usize> = (0..81).filter(|i| row[*i] > from && row[*i] <= to).collect();
            found.iter().sum::<usize>() as f64 / found.len() as f64
        };
        let (one, two) = (of(0.5, 1.0), of(1.0, 2.0));
        assert!((one - 40.0).abs() < 2.0, "{keys}: {one}");
        assert_eq!(two > one, right, "{keys}: {one}, {two}");
    }
}

/// Four unit squares in the plane z = 0 of emissions 1 to 4: lower left, lower right, upper left, upper right.
fn quarters(camera: &str) -> Folder {
    let mut scene = "[mesh]\nfile = \"quarters.obj\"\n".to_string();
    let mut mesh = String::new();
    for (i, (x, y)) in [(-1, -1), (0, -1), (-1, 0), (0, 0)].into_iter().enumerate() {
        scene += &format!("[material.m{i}]\nemission = {}\n", i + 1);
        let (u, v) = (x + 1, y + 1);
        mesh += &format!("v {x} {y} 0\nv {u} {y} 0\nv {u} {v} 0\nv {x} {v} 0\nusemtl m{i}\nf -4 -3 -2 -1\n");
    }
    let folder = Folder::with_scene(&(scene + "[camera]\n" + camera));
    folder.write("quarters.obj", mesh);
    folder
}

#[test]
fn rows_run_down_and_columns_to_the_right() {
    let camera = "kind = \"orthographic\"\neye = [0, 0, 5]\ntarget = [0, 0, -2]\nup = [0, 3, 1]\nheight = 4\n\
                  resolution = [8, 4]\nsampling = \"centre\"\n";
    let (shape, pixels) = quarters(camera).image();
    assert_eq!(shape, [4, 8, 1]);
    #[rustfmt::skip]
    let expected = [
        0., 0., 0., 0., 0., 0., 0., 0.,
        0., 0., 0., 3., 4., 0., 0., 0.,
        0., 0., 0., 1., 2., 0., 0., 0.,
        0., 0., 0., 0., 0., 0., 0., 0.,
    ];
    assert_eq!(pixels, expected);
    // The other up turns the image round.
    let turned = camera.replace("[0, 3, 1]", "[0, -3, 1]");
    assert_eq!(quarters(&turned).image().1, expected.iter().rev().copied().collect::<Vec<f32>>());
}

#[test]
fn the_field_of_view_is_vertical() {
    // At distance 2 the squares' outer edges stand at 26.57 degrees: 1/2 of the tangent of 45 degrees.
    let camera = "kind = \"perspective\"\neye = [0, 0, 2]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_deg = 90\n\
                  resolution = [8, 4]\nsampling = \"centre\"\n";
    let (_, pixels) = quarters(camera).image();
    let seen: Vec<usize> = (0..32).filter(|i| pixels[*i] > 0.0).collect();
    assert_eq!(seen, [11, 12, 19, 20]);
}

#[test]
fn nothing_before_the_eye_is_seen_and_nothing_else_is_clipped() {
    let camera = |eye: f64| {
        format!(
            "kind = \"orthographic\"\neye = [0, 0, {eye}]\ntarget = [0, 0, -1e4]\nup = [0, 1, 0]\nheight = 2\n\
             resolution = [2, 2]\n"
        )
    };
    assert_eq!(quarters(&camera(-1e-3)).image().1, [0.0; 4]);
    assert_eq!(quarters(&camera(1e-3)).image().1, [3.0, 4.0, 1.0, 2.0]);
    assert_eq!(quarters(&camera(1e6)).image().1, [3.0, 4.0, 1.0, 2.0]);
}

#[test]
fn area_sampling_is_the_mean_over_the_pixel() {
    // The plate's edges at +-1 cut the pixels of height 4/7 at a quarter: 1 / (4/7) = 1.75 from the middle.
    let scene = edited("[8, 8]", "[7, 7]").replace("height = 4.0", "height = 4.0\nsampling = \"area\"");
    let folder = Folder::with_scene(&scene);
    let (_, pixels) = folder.image();
    assert_eq!(folder.image().1, pixels);
    let share = |i: usize| [0.0, 0.25, 1.0, 1.0, 1.0, 0.25, 0.0][i];
    for (i, pixel) in pixels.iter().enumerate() {
        let want = 1.0 - 0.6 * share(i / 7) * share(i % 7);
        // Of the pixels that are cut, the tolerance is a mean over the object's; here a few times that.
        let tolerance = if want == 0.4 || want == 1.0 { F32 } else { 2e-2 };
        assert!(close(*pixel, want, tolerance), "pixel {i}: {pixel} for {want}");
    }
    let centre = Folder::with_scene(&scene.replace("area", "centre")).image().1;
    for (i, pixel) in centre.iter().enumerate() {
        let want = if (2..5).contains(&(i / 7)) && (2..5).contains(&(i % 7)) { 0.4 } else { 1.0 };
        assert!(close(*pixel, want, F32), "pixel {i}: {pixel} for {want}");
    }
}

#[test]
fn backs_are_black_or_like_the_front() {
    let below = edited("eye = [0, 0, 5]", "eye = [0, 0, -5]");
    let middle = |scene: &str| Folder::with_scene(scene).image().1[8 * 4 + 4];
    assert_eq!(middle(&below), 0.0);
    let two_sided = below.replace("[mesh]", "[mesh]\ntwo_sided = true");
    assert!(close(middle(&two_sided), 0.4, F32));
    assert_eq!(
        middle(&two_sided.replace("diffuse = 0.4", "emission = 3").replace("[sky]", "[sky]\nradiance = 0")),
        3.0
    );
}

#[test]
fn the_sun_is_seen_as_a_disc_or_not_at_all() {
    let sun = |half_angle: &str| {
        let scene = edited("eye = [0, 0, 5]", "eye = [0, 0, -5]")
            .replace("target = [0, 0, 0]", "target = [0, 9, -5]");
        let scene = scene.replace("up = [0, 1, 0]", "up = [0, 0, 1]").replace("[8, 8]", "[1, 1]");
        // Below the horizon of a hemisphere: the sun knows neither horizon nor ground.
        let scene = scene.replace("\"uniform\"", "\"hemisphere\"\nground = 0.5");
        format!(
            "{scene}sampling = \"centre\"\n[sun]\ndirection = [0, 8, -0.001]\nirradiance = 2\n{half_angle}"
        )
    };
    let seen = |half_angle: &str| f64::from(Folder::with_scene(&sun(half_angle)).image().1[0]);
    let disc = |degrees: f64| 2.0 / std::f64::consts::PI / degrees.to_radians().sin().powi(2);
    for (keys, want) in [
        ("half_angle_deg = 0", 1.0),
        ("half_angle_deg = 1", 1.0 + disc(1.0)),
        ("", 1.0 + disc(0.2665)),
        ("half_angle_deg = 0.005", 1.0),
    ] {
        let got = seen(keys);
        assert!((got - want).abs() <= F32 * want, "{keys}: {got} for {want}");
    }
}

#[test]
fn smooth_turns_the_mirror_direction_only() {
    let normals = "vn 0.2 0 1\nvn 0.2 0 1\nvn 0.2 0 1\nvn 0.2 0 1\n";
    let mesh = PLATE.replace("f 1 2 3 4", &format!("{normals}f 1//1 2//2 3//3 4//4"));
    let gradient = |d: DVec3| 0.2 + 0.8 * (1.0 + d.z) / 2.0;
    let scene = |keys: &str, material: &str| {
        edited("diffuse = 0.4", material)
            .replace("\"uniform\"", "\"gradient\"\nground = 0.2")
            .replace("[mesh]", &format!("[mesh]\n{keys}"))
    };
    let middle = |scene: String| {
        let folder = Folder::with_scene(&scene);
        folder.write("plate.obj", &mesh);
        folder.image().1[8 * 4 + 4]
    };
    let flat = middle(scene("smooth = false", "specular = 0.5"));
    assert!(close(flat, 0.5 * gradient(DVec3::Z), F32));
    let n = dvec3(0.2, 0.0, 1.0).normalize();
    let mirrored = 2.0 * n.z * n - DVec3::Z;
    let smooth = middle(scene("smooth = true", "specular = 0.5"));
    assert!(close(smooth, 0.5 * gradient(mirrored), F32), "{smooth}");
    let diffuse = |keys| middle(scene(keys, "diffuse = 0.5"));
    assert_eq!(diffuse("smooth = true"), diffuse("smooth = false"));
}

#[test]
fn bands_are_independent() {
    let scene = edited("tolerance", "bands = 3\ntolerance")
        .replace(
            "diffuse = 0.4",
            "diffuse = [0.4, 0.2, 0.0]\nspecular = [0.1, 0.2, 0.3]\nemission = [0, 0, 1]",
        )
        .replace("\"uniform\"", "\"uniform\"\nradiance = [1, 2, 3]");
    let (shape, pixels) = Folder::with_scene(&scene).image();
    assert_eq!(shape, [8, 8, 3]);
    for (band, want) in [0.5, 0.8, 1.9].into_iter().enumerate() {
        let (middle, corner) = (pixels[(8 * 4 + 4) * 3 + band], pixels[band]);
        assert!(close(middle, want, F32), "band {band}: {middle}");
        assert_eq!(corner, band as f32 + 1.0);
    }
}

#[test]
fn gloss_reflects_its_albedo_at_normal_view() {
    let gloss = |keys: &str| edited("diffuse = 0.4", &format!("specular = 0.4\ngloss = {{ {keys} }}"));
    let middle = |keys: &str| Folder::with_scene(&gloss(keys)).image().1[8 * 4 + 4];
    for keys in ["axis_ratio = 10, rays = 7", "axis_ratio = 3", "axis_ratio = 1e5"] {
        // Under a uniform sky the lobe gives A(0) = rho_0, whichever rays carry it.
        assert!(close(middle(keys), 0.4, 2e-3), "{keys}: {}", middle(keys));
    }
}

#[test]
fn lengths_of_directions_do_not_matter() {
    let sun = |scale: f64| {
        let direction = DMat3::from_diagonal(DVec3::splat(scale)) * dvec3(0.3, 0.2, 1.0);
        let camera = SCENE.replace("up = [0, 1, 0]", &format!("up = [0, {scale}, 0]"));
        format!(
            "{camera}[sun]\ndirection = [{}, {}, {}]\nirradiance = 3\n",
            direction.x, direction.y, direction.z
        )
    };
    assert_eq!(Folder::with_scene(&sun(1.0)).image(), Folder::with_scene(&sun(1024.0)).image());
}

#[test]
fn a_scene_without_light_is_black() {
    let (dark, _) = SCENE.split_once("[sky]").unwrap();
    let (_, camera) = SCENE.split_once("[camera]").unwrap();
    let folder = Folder::with_scene(&format!("{dark}[camera]{camera}"));
    assert_eq!(folder.image().1, [0.0; 64]);
    folder.render(&["scene.toml", "--report", "r.json"]).succeeds();
    let report: serde_json::Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    // what rounding to f32 may bring is always told
    assert_eq!(report["error_estimate"], 1e-7);
    assert_eq!(report["reference_radiance"][0], 0.0);
}

#[test]
fn every_mesh_format_gives_the_same_image() {
    let expected = Folder::with_scene(SCENE).image();
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n\
               -1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n4 0 1 2 3\n";
    let facet = |a: &str, b: &str, c: &str| {
        format!("facet normal 0 0 1\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    };
    let stl = facet("-1 -1 0", "1 -1 0", "1 1 0") + &facet("-1 -1 0", "1 1 0", "-1 1 0");
    for (name, content) in [("plate.ply", ply.to_string()), ("plate.STL", format!("solid\n{stl}endsolid\n"))]
    {
        let folder = Folder::with_scene(&SCENE.replace("plate.obj", name));
        folder.write(name, content);
        assert!(folder.image() == expected, "{name}");
    }
}
