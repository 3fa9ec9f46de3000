//! Skies, suns and materials drawn for a case.

use super::Draw;
use crate::support::twin::{Material, Model, Sky, Sun};
use glam::{DVec3, dvec3};

/// Which suns a scene may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Suns {
    /// Any: point, the sun's own disc, larger discs.
    Any,
    /// Discs that rays by way of several bent mirrors find.
    Large,
}

/// A sun with the probability `p`, and a sky (always one where there is no sun).
pub fn lights(draw: &mut Draw, bands: usize, p: f64, suns: Suns) -> (Option<Sky>, Option<Sun>) {
    let sun = draw.chance(p).then(|| sun(draw, bands, suns));
    let dark = sun.is_some() && draw.chance(0.2);
    let toward = sun.as_ref().map(|s| s.direction);
    let sky = (!dark).then(|| sky(draw, bands, toward));
    (sky, sun)
}

fn sun(draw: &mut Draw, bands: usize, suns: Suns) -> Sun {
    let half_angle: f64 = match (suns, draw.whole(0, 9)) {
        (Suns::Any, 0..=3) => 0.0,
        (Suns::Any, 4..=6) => 0.2665,
        _ => draw.real(2.0, 6.0),
    };
    let direction = draw.direction(12.0, 75.0);
    let irradiance = tinted(draw, bands, 0.5, 4.0);
    Sun { direction, irradiance, half_angle: half_angle.to_radians() }
}

fn sky(draw: &mut Draw, bands: usize, sun: Option<DVec3>) -> Sky {
    let cie_sun = sun.unwrap_or(draw.direction(10.0, 70.0));
    let model = match draw.whole(0, 9) {
        0 | 1 => Model::Uniform,
        2 => Model::Hemisphere,
        3 | 4 => Model::Overcast,
        5 | 6 => Model::Cie { kind: draw.whole(1, 15), sun: cie_sun },
        7 => Model::Gradient,
        _ => table(draw, bands),
    };
    let up = if draw.chance(0.15) { draw.direction(60.0, 89.0) } else { DVec3::Z };
    // the sun of a CIE sky is above its horizon
    let up = if cie_sun.dot(up) > 0.05 { up } else { DVec3::Z };
    let ground = if draw.chance(0.5) { vec![0.0; bands] } else { tinted(draw, bands, 0.05, 0.4) };
    Sky { model, radiance: tinted(draw, bands, 0.3, 1.5), ground, up }
}

fn table(draw: &mut Draw, bands: usize) -> Model {
    let (rows, columns) = (draw.whole(2, 8), draw.whole(3, 16));
    // the kernel's tables are f32
    let values = (0..rows * columns * bands).map(|_| f64::from(draw.real(0.0, 1.5).powi(2) as f32)).collect();
    Model::Table {
        rows,
        columns,
        values,
        azimuth_zero: dvec3(draw.real(0.2, 1.0), draw.real(-1.0, 1.0), 0.0),
    }
}

/// One value per band, not too far from each other.
pub fn tinted(draw: &mut Draw, bands: usize, low: f64, high: f64) -> Vec<f64> {
    let middle = draw.scale(low, high);
    (0..bands).map(|_| if bands == 1 { middle } else { middle * draw.scale(0.6, 1.6) }).collect()
}

/// A diffuse material.
pub fn diffuse(draw: &mut Draw, bands: usize) -> Material {
    material(draw, bands, 0.05, 0.8, 0.0)
}

/// A material whose reflectances add up to `low` to `high`, a share `mirror` of it by the mirror, in every band anew.
pub fn material(draw: &mut Draw, bands: usize, low: f64, high: f64, mirror: f64) -> Material {
    let whole: Vec<f64> = (0..bands).map(|_| draw.real(low, high)).collect();
    let part = |share: f64| whole.iter().map(|w| w * share).collect();
    Material { diffuse: part(1.0 - mirror), specular: part(mirror), emission: vec![0.0; bands], gloss: None }
}

/// A mirror, often with a diffuse part.
pub fn mirror(draw: &mut Draw, bands: usize) -> Material {
    let share = if draw.chance(0.4) { 1.0 } else { draw.real(0.4, 0.95) };
    material(draw, bands, 0.4, 0.95, share)
}

/// A glossy material.
pub fn glossy(draw: &mut Draw, bands: usize) -> Material {
    let share = draw.real(0.3, 0.9);
    Material { gloss: Some(draw.scale(1.5, 20.0)), ..material(draw, bands, 0.3, 0.8, share) }
}
