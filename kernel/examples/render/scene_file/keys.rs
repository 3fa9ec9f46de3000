//! The keys of the scene file as they are written, before their values are checked.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Deserialize;
use serde::de::{self, Deserializer, SeqAccess, Visitor};

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keys {
    pub tolerance: Option<f64>,
    pub bands: Option<i64>,
    pub max_bounces: Option<u32>,
    pub reference_radiance: Option<Values>,
    pub mesh: Mesh,
    #[serde(default)]
    pub material: BTreeMap<String, Material>,
    pub sky: Option<Sky>,
    pub sun: Option<Sun>,
    pub camera: Camera,
}

/// `[mesh]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    pub file: PathBuf,
    #[serde(default)]
    pub two_sided: bool,
    #[serde(default)]
    pub smooth: bool,
}

/// `[material.NAME]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    pub diffuse: Option<Values>,
    pub specular: Option<Values>,
    pub emission: Option<Values>,
    pub gloss: Option<Gloss>,
}

/// `gloss` of a material.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gloss {
    pub axis_ratio: f64,
    pub rays: Option<u32>,
}

/// `[sky]`. Keys that the chosen model does not use may stand there, without effect.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sky {
    pub model: SkyModel,
    pub radiance: Option<Values>,
    pub ground: Option<Values>,
    pub up: Option<[f64; 3]>,
    #[serde(rename = "type")]
    pub kind: Option<i64>,
    pub sun_direction: Option<[f64; 3]>,
    pub file: Option<PathBuf>,
    pub azimuth_zero: Option<[f64; 3]>,
    pub columns: Option<Columns>,
}

/// `model` of the sky.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkyModel {
    Uniform,
    Hemisphere,
    Overcast,
    Cie,
    Gradient,
    Table,
}

/// Sense of a table's columns, seen from the zenith.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Columns {
    /// As a panorama is seen from inside, left to right.
    Clockwise,
    /// As azimuths are counted in mathematics.
    CounterClockwise,
}

/// `[sun]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    pub direction: [f64; 3],
    pub irradiance: Values,
    pub half_angle_deg: Option<f64>,
}

/// `[camera]`. The other kind's key may stand there, without effect.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    pub kind: CameraKind,
    pub eye: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    pub height: Option<f64>,
    pub fov_deg: Option<f64>,
    pub resolution: [i64; 2],
    pub sampling: Option<CameraSampling>,
}

/// `kind` of the camera.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraKind {
    Orthographic,
    Perspective,
}

/// `sampling` of the camera.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraSampling {
    Area,
    Centre,
}

/// One number for all bands, or one per band.
pub enum Values {
    /// The same in every band.
    Same(f64),
    /// One per band.
    Each(Vec<f64>),
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValuesVisitor)
    }
}

struct ValuesVisitor;

impl<'de> Visitor<'de> for ValuesVisitor {
    type Value = Values;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, or an array of one number per band")
    }

    fn visit_i64<E: de::Error>(self, x: i64) -> Result<Values, E> {
        Ok(Values::Same(x as f64))
    }

    fn visit_f64<E: de::Error>(self, x: f64) -> Result<Values, E> {
        Ok(Values::Same(x))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Values, A::Error> {
        let mut values = Vec::new();
        while let Some(x) = seq.next_element()? {
            values.push(x);
        }
        Ok(Values::Each(values))
    }
}
