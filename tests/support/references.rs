//! The reference images and irradiances of another program (`tests/data/references/README.md`).

use super::scene_file::Camera;
use super::twin::{Meeting, Ray, Scene, reflect};
use super::{data, metric, npy};
use std::path::{Path, PathBuf};

/// One reference image, with the reference irradiances where there are any.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Its name: mesh, diffuse and specular reflectance, light.
    pub id: String,
    /// The scene, in the project's own format.
    pub scene: PathBuf,
    /// The image, `.npy` f32 of (rows, columns).
    pub image: PathBuf,
    /// Masks `hit` and `disputed`, `.npz` bool of the image's shape.
    pub masks: PathBuf,
    /// The image's noise: rms over object pixels.
    pub image_standard_error: f64,
    /// Irradiance per facet.
    pub facets: Option<FacetReference>,
}

/// Reference irradiances of all facets, front side, in the mesh file's order.
#[derive(Clone, Debug)]
pub struct FacetReference {
    /// `.npz` with `E_over_pi` and `sem`.
    pub file: PathBuf,
    /// The noise: rms over facets.
    pub standard_error: f64,
}

impl Reference {
    /// The image.
    pub fn image(&self) -> npy::Array<f32> {
        npy::read(&self.image)
    }

    /// The pixels that count: hit and not disputed.
    pub fn counted(&self) -> Vec<bool> {
        let mask = |name| npy::read_npz::<bool>(&self.masks, name).values;
        metric::counted(&mask("hit"), &mask("disputed"))
    }

    /// Those of them in which the reference is right: not [`led_astray`].
    pub fn sound(&self, scene: &Scene, camera: &Camera) -> Vec<bool> {
        let astray = led_astray(scene, camera);
        self.counted().iter().zip(&astray).map(|(&counted, &astray)| counted && !astray).collect()
    }
}

/// The reference's renderer starts the rays that leave a point p so far off the surface, times 1 + |p| (the largest
/// coordinate).
pub const OFFSET: f64 = 9e-5;

/// The pixels whose chains of mirrors that offset sends elsewhere: they meet more or fewer mirrors than rays that start on
/// the surface do. On facets of a hundred offsets that is one chain in some hundreds, and the reference is wrong there.
pub fn led_astray(scene: &Scene, camera: &Camera) -> Vec<bool> {
    let [columns, rows] = camera.resolution;
    let differs = |pixel: usize| {
        let (origin, direction) = camera.ray(pixel / columns, pixel % columns);
        let ray = Ray { origin, direction, leaving: None };
        mirrors(scene, ray, 0.0) != mirrors(scene, ray, OFFSET)
    };
    (0..rows * columns).map(differs).collect()
}

/// How many mirrors a ray meets, up to 30, before it ends in the sky, on a black back (1) or on no mirror (2).
fn mirrors(scene: &Scene, mut ray: Ray, offset: f64) -> (u32, u32) {
    for count in 0..30 {
        match scene.meet(&ray) {
            Meeting::Sky => return (count, 0),
            Meeting::Back => return (count, 1),
            Meeting::Side(hit) if !hit.material.is_mirror() => return (count, 2),
            Meeting::Side(hit) => {
                let away = offset * (1.0 + hit.point.abs().max_element());
                let leaving = if offset > 0.0 { None } else { Some(hit.facet) };
                let origin = hit.point + hit.normal * away;
                ray = Ray { origin, direction: reflect(ray.direction, hit.normal), leaving };
            }
        }
    }
    (30, 0)
}

impl FacetReference {
    /// Mean incident irradiance / pi per facet.
    pub fn irradiance_over_pi(&self) -> Vec<f64> {
        self.column("E_over_pi")
    }

    /// Standard error of each.
    pub fn standard_errors(&self) -> Vec<f64> {
        self.column("sem")
    }

    fn column(&self, name: &str) -> Vec<f64> {
        npy::read_npz::<f32>(&self.file, name).values.iter().map(|&x| f64::from(x)).collect()
    }
}

/// All references: those in `tests/data/references`, then those of the folder `BLIK_REFERENCES` (default
/// `../shared/references` beside the checkout) that are not among them, when that folder exists.
pub fn all() -> Vec<Reference> {
    let mut found = in_folder(&data("references"));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let more = std::env::var_os("BLIK_REFERENCES").unwrap_or_else(|| "../shared/references".into());
    let more = root.join(more);
    if more.is_dir() {
        for reference in in_folder(&more) {
            if found.iter().all(|known| known.id != reference.id) {
                found.push(reference);
            }
        }
    }
    found
}

/// The reference of this id, wherever it is.
pub fn named(id: &str) -> Reference {
    all().into_iter().find(|r| r.id == id).unwrap_or_else(|| panic!("no reference {id}"))
}

fn in_folder(folder: &Path) -> Vec<Reference> {
    let index = folder.join("index.csv");
    let mut reader = csv::Reader::from_path(&index).unwrap_or_else(|e| panic!("{}: {e}", index.display()));
    let rows: Vec<(String, String, f64)> =
        reader.deserialize().map(|row| row.unwrap_or_else(|e| panic!("{}: {e}", index.display()))).collect();
    let masks: Vec<String> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix("_masks.npz").map(str::to_string))
        .collect();
    let image = |(id, _, standard_error): &(String, String, f64)| {
        let mesh = masks.iter().find(|m| id.starts_with(&format!("{m}_")));
        let facets = rows.iter().find(|(other, kind, _)| other == id && kind == "facets");
        Reference {
            id: id.clone(),
            scene: folder.join(format!("{id}.toml")),
            image: folder.join(format!("{id}.npy")),
            masks: folder.join(format!("{}_masks.npz", mesh.unwrap_or_else(|| panic!("no masks for {id}")))),
            image_standard_error: *standard_error,
            facets: facets.map(|(_, _, standard_error)| FacetReference {
                file: folder.join(format!("{id}_facets.npz")),
                standard_error: *standard_error,
            }),
        }
    };
    rows.iter().filter(|(_, kind, _)| kind == "image").map(image).collect()
}
