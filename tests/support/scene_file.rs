//! A scene file as the twin sees it. It trusts the file: no check of keys, OBJ meshes and `.npy` tables alone, flat
//! normals alone.

use super::npy;
use super::scenes::{Mesh, read_obj};
use super::twin::{Material, Model, Scene, Sky, Sun};
use glam::DVec3;
use std::path::Path;
use toml::{Table, Value};

/// A camera.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Eye, or a point of the image plane's centre line.
    pub eye: DVec3,
    /// Unit axes: view direction, right, up of the image.
    pub axes: [DVec3; 3],
    /// Height of the image, at distance 1 for a perspective camera.
    pub height: f64,
    /// Whether rays start at the eye.
    pub perspective: bool,
    /// Columns and rows.
    pub resolution: [usize; 2],
}

impl Camera {
    /// Origin and unit direction of the ray through a pixel's centre; row 0 at the top.
    pub fn ray(&self, row: usize, column: usize) -> (DVec3, DVec3) {
        let [f, r, u] = self.axes;
        let [columns, rows] = self.resolution.map(|n| n as f64);
        let x = ((column as f64 + 0.5) / columns - 0.5) * self.height * columns / rows;
        let y = (0.5 - (row as f64 + 0.5) / rows) * self.height;
        let offset = r * x + u * y;
        if self.perspective { (self.eye, (f + offset).normalize()) } else { (self.eye + offset, f) }
    }
}

/// What a file holds beside the scene: the mesh as it shares its vertices, and what errors are relative to.
pub struct Extra {
    /// The mesh.
    pub mesh: Mesh,
    /// Material of each index that the mesh names.
    pub materials: Vec<Material>,
    /// Reference radiance per band, where the file gives it.
    pub reference_radiance: Option<Vec<f64>>,
}

/// Reads scene and camera; panics with the path when it cannot.
pub fn read(path: &Path) -> (Scene, Camera) {
    let (scene, camera, _) = read_all(path);
    (scene, camera)
}

/// The same with the rest.
pub fn read_all(path: &Path) -> (Scene, Camera, Extra) {
    let what = path.display().to_string();
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{what}: {e}"));
    let file: Table = text.parse().unwrap_or_else(|e| panic!("{what}: {e}"));
    let bands = file.get("bands").map_or(1, |b| number(b) as usize);
    let folder = path.parent().expect("a file has a folder");
    let mesh_table = table(&file, "mesh").expect("[mesh]");
    assert!(!flag(mesh_table, "smooth"), "{what}: the twin knows no interpolated normals");
    let (mesh, names) = read_obj(&folder.join(text_of(mesh_table, "file")));
    let materials: Vec<Material> = names.iter().map(|name| material(&file, name, bands)).collect();
    let mut scene = Scene::new(&mesh, &materials).two_sided(flag(mesh_table, "two_sided"));
    if let Some(entries) = table(&file, "sky") {
        scene = scene.sky(sky(entries, table(&file, "sun"), folder, bands));
    }
    if let Some(entries) = table(&file, "sun") {
        let half_angle = entries.get("half_angle_deg").map_or(0.2665, number).to_radians();
        let irradiance = per_band(entries, "irradiance", 0.0, bands);
        scene = scene.sun(Sun { direction: vector(entries, "direction", None), irradiance, half_angle });
    }
    let reference = |_| per_band(&file, "reference_radiance", 1.0, bands);
    let reference_radiance = file.get("reference_radiance").map(reference);
    (scene, camera(table(&file, "camera").expect("[camera]")), Extra { mesh, materials, reference_radiance })
}

fn material(file: &Table, name: &str, bands: usize) -> Material {
    let all = table(file, "material").expect("[material]");
    let entries =
        table(all, name).or_else(|| table(all, "default")).unwrap_or_else(|| panic!("material {name}"));
    Material {
        diffuse: per_band(entries, "diffuse", 0.0, bands),
        specular: per_band(entries, "specular", 0.0, bands),
        emission: per_band(entries, "emission", 0.0, bands),
        gloss: table(entries, "gloss").map(|gloss| number(&gloss["axis_ratio"])),
    }
}

fn sky(entries: &Table, sun: Option<&Table>, folder: &Path, bands: usize) -> Sky {
    let model = match text_of(entries, "model") {
        "uniform" => Model::Uniform,
        "hemisphere" => Model::Hemisphere,
        "overcast" => Model::Overcast,
        "gradient" => Model::Gradient,
        "cie" => {
            let own = entries.contains_key("sun_direction").then(|| vector(entries, "sun_direction", None));
            let sun =
                own.or_else(|| sun.map(|s| vector(s, "direction", None))).expect("a sun for the CIE sky");
            Model::Cie { kind: number(&entries["type"]) as usize, sun }
        }
        "table" => {
            let read = npy::read::<f32>(&folder.join(text_of(entries, "file")));
            let (rows, columns) = (read.shape[0], read.shape[1]);
            let given = read.shape.get(2).copied().unwrap_or(1);
            let spread = |cell: &[f32]| (0..bands).map(|b| f64::from(cell[b % given])).collect::<Vec<_>>();
            let values = read.values.chunks(given).flat_map(spread).collect();
            let azimuth_zero = vector(entries, "azimuth_zero", Some(DVec3::X));
            Model::Table { rows, columns, values, azimuth_zero }
        }
        other => panic!("sky model {other}"),
    };
    Sky {
        model,
        radiance: per_band(entries, "radiance", 1.0, bands),
        ground: per_band(entries, "ground", 0.0, bands),
        up: vector(entries, "up", Some(DVec3::Z)),
    }
}

fn camera(entries: &Table) -> Camera {
    let eye = vector(entries, "eye", None);
    let f = (vector(entries, "target", None) - eye).normalize();
    let r = f.cross(vector(entries, "up", None)).normalize();
    let perspective = text_of(entries, "kind") == "perspective";
    let height = if perspective {
        2.0 * (number(&entries["fov_deg"]).to_radians() / 2.0).tan()
    } else {
        number(&entries["height"])
    };
    let pixels = entries["resolution"].as_array().expect("resolution");
    let resolution = [number(&pixels[0]) as usize, number(&pixels[1]) as usize];
    Camera { eye, axes: [f, r, r.cross(f)], height, perspective, resolution }
}

fn table<'a>(entries: &'a Table, key: &str) -> Option<&'a Table> {
    entries.get(key)?.as_table()
}

fn flag(entries: &Table, key: &str) -> bool {
    entries.get(key).and_then(Value::as_bool).unwrap_or(false)
}

fn text_of<'a>(entries: &'a Table, key: &str) -> &'a str {
    entries.get(key).and_then(Value::as_str).unwrap_or_else(|| panic!("text for {key}"))
}

fn number(value: &Value) -> f64 {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|i| i as f64))
        .unwrap_or_else(|| panic!("number: {value:?}"))
}

fn vector(entries: &Table, key: &str, default: Option<DVec3>) -> DVec3 {
    let read = |value: &Value| {
        let v: Vec<f64> = value.as_array().expect(key).iter().map(number).collect();
        DVec3::new(v[0], v[1], v[2])
    };
    entries.get(key).map(read).or(default).unwrap_or_else(|| panic!("no {key}"))
}

fn per_band(entries: &Table, key: &str, default: f64, bands: usize) -> Vec<f64> {
    match entries.get(key) {
        None => vec![default; bands],
        Some(Value::Array(values)) => values.iter().map(number).collect(),
        Some(value) => vec![number(value); bands],
    }
}
