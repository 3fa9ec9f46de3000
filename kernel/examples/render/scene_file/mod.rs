//! The scene file: TOML, read and checked key by key.

mod check;
mod keys;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::failure::{Failure, Outcome};
use crate::text_file;
use blik_kernel::camera::MAX_RESOLUTION;
use blik_kernel::scene::MOST_REFLECTANCE;
use check::Check;
use glam::DVec3;
pub use keys::Columns;
use keys::{CameraKind, CameraSampling, Keys, SkyModel};

/// The manual of the scene file: every key with its unit, range, default and meaning.
pub const MANUAL: &str = include_str!("../SCENE.md");

/// A scene as the file states it, all values checked, arrays with one entry per band.
pub struct Scene {
    /// Wanted error (eps of eq. 16), 1e-6 ..= 0.1.
    pub tolerance: f64,
    /// Number of spectral bands, 1 ..= 64.
    pub bands: usize,
    /// Longest chain of reflections; `None`: by tolerance.
    pub max_bounces: Option<u32>,
    /// Replaces the reference radiance of the error, per band.
    pub reference_radiance: Option<Vec<f64>>,
    /// The mesh file, its path already relative to the current folder.
    pub mesh: PathBuf,
    /// Both sides carry material and emission.
    pub two_sided: bool,
    /// Mirror directions use interpolated vertex normals.
    pub smooth: bool,
    /// The material tables by name.
    pub materials: BTreeMap<String, Material>,
    /// The sky; `None`: black.
    pub sky: Option<Sky>,
    /// The sun; `None`: none.
    pub sun: Option<Sun>,
    /// The camera.
    pub camera: Camera,
}

/// One material table.
pub struct Material {
    /// Diffuse reflectance per band.
    pub diffuse: Vec<f64>,
    /// Mirror reflectance per band.
    pub specular: Vec<f64>,
    /// Own diffuse radiance per band.
    pub emission: Vec<f64>,
    /// The lobe: axis ratio and number of rays (`None`: by tolerance); absent: an ideal mirror.
    pub gloss: Option<(f64, Option<u32>)>,
}

/// The sky.
pub struct Sky {
    /// Which distribution.
    pub model: Model,
    /// Its radiance (a factor for a table) per band.
    pub radiance: Vec<f64>,
    /// Radiance below the horizon per band.
    pub ground: Vec<f64>,
    /// The zenith, of any length.
    pub up: [f64; 3],
}

/// The sky's distribution.
pub enum Model {
    /// The whole sphere.
    Uniform,
    /// The upper half.
    Hemisphere,
    /// (1 + 2 cos z)/3.
    Overcast,
    /// ISO 15469.
    Cie {
        /// 1 ..= 15.
        kind: u32,
        /// Toward the sun, of any length, above the horizon.
        sun_direction: [f64; 3],
    },
    /// Linear in the height.
    Gradient,
    /// From a file.
    Table {
        /// The file, its path already relative to the current folder.
        file: PathBuf,
        /// Where the azimuth starts.
        azimuth_zero: Option<[f64; 3]>,
        /// The sense of its columns; `None`: by the kind of file.
        columns: Option<Columns>,
    },
}

impl Model {
    /// The value of the key `model`.
    pub fn name(&self) -> &'static str {
        match self {
            Model::Uniform => "uniform",
            Model::Hemisphere => "hemisphere",
            Model::Overcast => "overcast",
            Model::Cie { .. } => "cie",
            Model::Gradient => "gradient",
            Model::Table { .. } => "table",
        }
    }
}

/// The sun.
pub struct Sun {
    /// Toward the sun, of any length.
    pub direction: [f64; 3],
    /// Normal irradiance per band.
    pub irradiance: Vec<f64>,
    /// Half angle in degrees, 0 ..= 10.
    pub half_angle_deg: f64,
}

/// The camera.
pub struct Camera {
    /// Orthographic height or vertical field of view.
    pub projection: Projection,
    /// The eye.
    pub eye: [f64; 3],
    /// What it looks at.
    pub target: [f64; 3],
    /// The upward direction.
    pub up: [f64; 3],
    /// Pixels in a row.
    pub columns: usize,
    /// Rows of pixels.
    pub rows: usize,
    /// Mean over the pixel, or one ray through its centre.
    pub area_sampling: bool,
}

/// The projection of the camera.
#[derive(Clone, Copy)]
pub enum Projection {
    /// Height of the image in scene units.
    Orthographic(f64),
    /// Vertical field of view in degrees.
    Perspective(f64),
}

/// Reads and checks the scene file at `path`.
pub fn read(path: &Path) -> Outcome<Scene> {
    let bytes = std::fs::read(path).map_err(|e| Failure::at(path, e))?;
    let text = text(path, &bytes)?;
    let keys: Keys = toml::from_str(&text).map_err(|e| syntax(path, &text, &e))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let bands = keys.bands.unwrap_or(1);
    let mut check = Check { path, bands: 0 };
    if !(1..=64).contains(&bands) {
        return Err(check.fail("bands", "a whole number from 1 to 64", bands));
    }
    check.bands = bands as usize;
    let tolerance = check
        .number("tolerance", keys.tolerance.unwrap_or(2e-3), "1e-6 to 0.1", |x| (1e-6..=0.1).contains(&x))?;
    let reference_radiance = match keys.reference_radiance {
        None => None,
        some => Some(reference(&check, check.spectrum("reference_radiance", some, 0.0, f64::INFINITY)?)?),
    };
    let sun = keys.sun.map(|sun| read_sun(&check, sun)).transpose()?;
    Ok(Scene {
        tolerance,
        bands: check.bands,
        max_bounces: keys.max_bounces,
        reference_radiance,
        mesh: folder.join(keys.mesh.file),
        two_sided: keys.mesh.two_sided,
        smooth: keys.mesh.smooth,
        materials: keys
            .material
            .into_iter()
            .map(|(name, keys)| read_material(&check, &name, keys).map(|material| (name, material)))
            .collect::<Outcome<_>>()?,
        sky: keys.sky.map(|sky| read_sky(&check, folder, sky, sun.as_ref())).transpose()?,
        sun,
        camera: read_camera(&check, keys.camera)?,
    })
}

/// The file's text with line ends that TOML knows.
fn text(path: &Path, bytes: &[u8]) -> Outcome<String> {
    let text = text_file::decode(bytes);
    if !text.unicode {
        let line = text_file::lines(&text.content).find(|(_, line)| !line.is_ascii()).map_or(1, |(n, _)| n);
        return Err(Failure::at_line(path, line, "expected UTF-8 text"));
    }
    let content = text.content.into_owned();
    Ok(if content.contains('\n') { content } else { content.replace('\r', "\n") })
}

/// The parser's message with the line it speaks of, in this file format's words.
fn syntax(path: &Path, text: &str, error: &toml::de::Error) -> Failure {
    let message =
        error.message().replace("unknown field", "unknown key").replace("missing field", "missing key");
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = before.map(|before| before.matches('\n').count() + 1);
    let advice = line.and_then(|line| split_name(text.lines().nth(line - 1)?)).unwrap_or_default();
    match line {
        Some(line) => Failure::at_line(path, line, format_args!("{message}{advice}")),
        None => Failure::at(path, message),
    }
}

/// What to write for a material's name with a point in it, which TOML takes for a table in a table.
fn split_name(line: &str) -> Option<String> {
    let name = line.trim().strip_prefix("[material.")?.split(']').next()?;
    let plain = name.contains('.') && !name.contains(['"', '\'']);
    plain.then(|| format!(" (a name with a point stands in quotes: [{}])", table(name)))
}

/// How the table of a material is written, without brackets.
pub fn table(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare {
        return format!("material.{name}");
    }
    let mut quoted = String::new();
    for c in name.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted += &format!("\\u{:04X}", u32::from(c)),
            c => quoted.push(c),
        }
    }
    format!("material.\"{quoted}\"")
}

fn reference(check: &Check, values: Vec<f64>) -> Outcome<Vec<f64>> {
    // Errors are divided by it.
    match values.iter().find(|x| **x == 0.0) {
        Some(x) => Err(check.fail("reference_radiance", "a finite number above 0", x)),
        None => Ok(values),
    }
}

fn read_material(check: &Check, name: &str, keys: keys::Material) -> Outcome<Material> {
    let key = |field: &str| format!("{}.{field}", table(name));
    let diffuse = check.spectrum(&key("diffuse"), keys.diffuse, 0.0, MOST_REFLECTANCE)?;
    let specular = check.spectrum(&key("specular"), keys.specular, 0.0, MOST_REFLECTANCE)?;
    for (band, (d, s)) in diffuse.iter().zip(&specular).enumerate() {
        if d + s > MOST_REFLECTANCE {
            let what = format!("{}: diffuse + specular in band {band}", table(name));
            return Err(check.fail(&what, "at most 1", d + s));
        }
    }
    let gloss = match keys.gloss {
        None => None,
        Some(gloss) => {
            let ratio =
                check.number(&key("gloss.axis_ratio"), gloss.axis_ratio, "1 or more", |x| x >= 1.0)?;
            if gloss.rays == Some(0) {
                return Err(check.fail(&key("gloss.rays"), "1 or more", 0));
            }
            Some((ratio, gloss.rays))
        }
    };
    let emission = check.spectrum(&key("emission"), keys.emission, 0.0, f64::INFINITY)?;
    Ok(Material { diffuse, specular, emission, gloss })
}

fn read_sun(check: &Check, keys: keys::Sun) -> Outcome<Sun> {
    let half_angle = keys.half_angle_deg.unwrap_or(0.2665);
    Ok(Sun {
        direction: check.direction("sun.direction", keys.direction)?,
        irradiance: check.spectrum("sun.irradiance", Some(keys.irradiance), 0.0, f64::INFINITY)?,
        half_angle_deg: check.number("sun.half_angle_deg", half_angle, "0, or 1e-4 to 10", |x| {
            x == 0.0 || (1e-4..=10.0).contains(&x)
        })?,
    })
}

fn read_sky(check: &Check, folder: &Path, keys: keys::Sky, sun: Option<&Sun>) -> Outcome<Sky> {
    let up = check.direction("sky.up", keys.up.unwrap_or([0.0, 0.0, 1.0]))?;
    let model = match keys.model {
        SkyModel::Uniform => Model::Uniform,
        SkyModel::Hemisphere => Model::Hemisphere,
        SkyModel::Overcast => Model::Overcast,
        SkyModel::Gradient => Model::Gradient,
        SkyModel::Cie => {
            let kind = check.required("sky.type", keys.kind, "model = \"cie\" needs it (1 to 15)")?;
            if !(1..=15).contains(&kind) {
                return Err(check.fail("sky.type", "1 to 15", kind));
            }
            let given = keys.sun_direction.or(sun.map(|sun| sun.direction));
            let why = "model = \"cie\" needs it or [sun]";
            let sun_direction =
                check.direction("sky.sun_direction", check.required("sky.sun_direction", given, why)?)?;
            if sun_direction.iter().zip(up).map(|(s, u)| s * u).sum::<f64>() <= 0.0 {
                return Err(check.fail("sky.sun_direction", "a direction above the horizon", sun_direction));
            }
            Model::Cie { kind: kind as u32, sun_direction }
        }
        SkyModel::Table => {
            let file = check.required("sky.file", keys.file, "model = \"table\" needs it")?;
            let azimuth_zero =
                keys.azimuth_zero.map(|d| check.direction("sky.azimuth_zero", d)).transpose()?;
            Model::Table { file: folder.join(file), azimuth_zero, columns: keys.columns }
        }
    };
    let radiance = check.spectrum("sky.radiance", keys.radiance, 1.0, f64::INFINITY)?;
    let ground = check.spectrum("sky.ground", keys.ground, 0.0, f64::INFINITY)?;
    Ok(Sky { model, radiance, ground, up })
}

/// Pixels and bands of an image together: what a file of 4 GiB holds.
const MOST_VALUES: usize = 1 << 30;

fn read_camera(check: &Check, keys: keys::Camera) -> Outcome<Camera> {
    let projection = match keys.kind {
        CameraKind::Orthographic => {
            let height = check.required("camera.height", keys.height, "kind = \"orthographic\" needs it")?;
            Projection::Orthographic(check.number(
                "camera.height",
                height,
                "a finite number above 0",
                |x| x > 0.0,
            )?)
        }
        CameraKind::Perspective => {
            let fov = check.required("camera.fov_deg", keys.fov_deg, "kind = \"perspective\" needs it")?;
            Projection::Perspective(
                check.number("camera.fov_deg", fov, "above 0 and below 180", |x| x > 0.0 && x < 180.0)?,
            )
        }
    };
    let pixels = keys.resolution.iter().try_fold(check.bands, |product, n| {
        usize::try_from(*n)
            .ok()
            .filter(|n| (1..=MAX_RESOLUTION).contains(n))
            .and_then(|n| product.checked_mul(n))
    });
    if pixels.is_none_or(|values| values > MOST_VALUES) {
        let expected = "[columns, rows], both 1 to 65536, with at most 2^30 values in all";
        return Err(check.fail("camera.resolution", expected, keys.resolution));
    }
    let eye = check.point("camera.eye", keys.eye)?;
    let target = check.point("camera.target", keys.target)?;
    let up = check.direction("camera.up", keys.up)?;
    // Found here, before any work, rather than by the kernel after it.
    let forward = DVec3::from(target) - DVec3::from(eye);
    if forward == DVec3::ZERO {
        return Err(check.fail("camera.target", "another point than camera.eye", target));
    }
    if forward.cross(up.into()).length() <= 1e-12 * forward.length() * DVec3::from(up).length() {
        return Err(check.fail("camera.up", "a direction not parallel to target - eye", up));
    }
    Ok(Camera {
        projection,
        eye,
        target,
        up,
        columns: keys.resolution[0] as usize,
        rows: keys.resolution[1] as usize,
        area_sampling: matches!(keys.sampling, None | Some(CameraSampling::Area)),
    })
}
