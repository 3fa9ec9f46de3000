//! Skies, the sun and the directional lobe, as the scene file defines them.

use super::in_frame;
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Parameters a, b, c, d, e of the 15 skies of ISO 15469:2004.
const CIE: [[f64; 5]; 15] = [
    [4.0, -0.70, 0.0, -1.0, 0.0],
    [4.0, -0.70, 2.0, -1.5, 0.15],
    [1.1, -0.8, 0.0, -1.0, 0.0],
    [1.1, -0.8, 2.0, -1.5, 0.15],
    [0.0, -1.0, 0.0, -1.0, 0.0],
    [0.0, -1.0, 2.0, -1.5, 0.15],
    [0.0, -1.0, 5.0, -2.5, 0.30],
    [0.0, -1.0, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.30],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// How a sky's radiance depends on direction.
#[derive(Clone, Debug)]
pub enum Model {
    /// `radiance` on the whole sphere.
    Uniform,
    /// `radiance` above the horizon.
    Hemisphere,
    /// radiance (1 + 2 dir.up)/3 above the horizon.
    Overcast,
    /// ISO 15469 with `radiance` at the zenith, above the horizon.
    Cie {
        /// 1 to 15.
        kind: usize,
        /// Toward the sun; above the horizon.
        sun: DVec3,
    },
    /// ground + (radiance - ground)(1 + dir.up)/2 on the whole sphere.
    Gradient,
    /// `radiance` times a table over the whole sphere, bilinear between the centres of its cells.
    Table {
        /// Rows from the zenith down.
        rows: usize,
        /// Columns counter-clockwise from `azimuth_zero`, seen from +up.
        columns: usize,
        /// (rows, columns, bands).
        values: Vec<f64>,
        /// Direction of azimuth 0 once projected off `up`.
        azimuth_zero: DVec3,
    },
}

/// A sky.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Its law.
    pub model: Model,
    /// Radiance per band.
    pub radiance: Vec<f64>,
    /// Radiance below the horizon, per band.
    pub ground: Vec<f64>,
    /// Zenith; any length.
    pub up: DVec3,
}

impl Sky {
    /// A sky of one band with the zenith +z.
    pub fn new(model: Model, radiance: f64, ground: f64) -> Sky {
        Sky { model, radiance: vec![radiance], ground: vec![ground], up: DVec3::Z }
    }

    /// Radiance that arrives from the unit direction `d`, per band.
    pub fn radiance(&self, d: DVec3) -> Vec<f64> {
        let up = self.up.normalize();
        let height = d.dot(up);
        let share = match &self.model {
            Model::Uniform => 1.0,
            Model::Gradient => {
                let mix = |(r, g): (&f64, &f64)| g + (r - g) * (1.0 + height) / 2.0;
                return self.radiance.iter().zip(&self.ground).map(mix).collect();
            }
            Model::Table { rows, columns, values, azimuth_zero } => {
                let cells = bilinear(d, up, *azimuth_zero, *rows, *columns);
                let bands = self.radiance.len();
                let at = |b: usize| cells.iter().map(|(cell, w)| w * values[cell * bands + b]).sum::<f64>();
                return self.radiance.iter().enumerate().map(|(b, r)| r * at(b)).collect();
            }
            _ if height < 0.0 => return self.ground.clone(),
            Model::Hemisphere => 1.0,
            Model::Overcast => (1.0 + 2.0 * height) / 3.0,
            Model::Cie { kind, sun } => cie(*kind, d, sun.normalize(), up),
        };
        self.radiance.iter().map(|r| r * share).collect()
    }
}

/// Radiance over zenith radiance of the sky `kind`, ISO 15469.
fn cie(kind: usize, d: DVec3, sun: DVec3, up: DVec3) -> f64 {
    let [a, b, c, slope, e] = CIE[kind - 1];
    // gradation; at the horizon b/0 is minus infinity and its exponential 0
    let phi = |cos_zenith: f64| 1.0 + a * (b / cos_zenith.max(0.0)).exp();
    // indicatrix
    let f = |chi: f64| 1.0 + c * ((slope * chi).exp() - (slope * FRAC_PI_2).exp()) + e * chi.cos().powi(2);
    let angle = |p: DVec3, q: DVec3| p.cross(q).length().atan2(p.dot(q));
    f(angle(d, sun)) * phi(d.dot(up)) / (f(angle(up, sun)) * phi(1.0))
}

/// The four cells around a direction and their weights.
fn bilinear(d: DVec3, up: DVec3, azimuth_zero: DVec3, rows: usize, columns: usize) -> [(usize, f64); 4] {
    let off_up = |v: DVec3| v - up * v.dot(up);
    let along = azimuth_zero.normalize();
    let x = if off_up(along).length() > 1e-9 { off_up(along) } else { off_up(DVec3::Y) }.normalize();
    let azimuth = d.dot(up.cross(x)).atan2(d.dot(x)).rem_euclid(TAU);
    let polar = off_up(d).length().atan2(d.dot(up));
    let row = (polar / PI * rows as f64 - 0.5).clamp(0.0, rows as f64 - 1.0);
    let column = azimuth / TAU * columns as f64 - 0.5;
    let (r0, c0) = (row.floor(), column.floor());
    let (fr, fc) = (row - r0, column - c0);
    let cell = |r: f64, c: f64| {
        (r as usize).min(rows - 1) * columns + (c as i64).rem_euclid(columns as i64) as usize
    };
    [
        (cell(r0, c0), (1.0 - fr) * (1.0 - fc)),
        (cell(r0, c0 + 1.0), (1.0 - fr) * fc),
        (cell(r0 + 1.0, c0), fr * (1.0 - fc)),
        (cell(r0 + 1.0, c0 + 1.0), fr * fc),
    ]
}

/// The sun.
#[derive(Clone, Debug)]
pub struct Sun {
    /// Toward it; any length.
    pub direction: DVec3,
    /// On a plane that faces it, per band.
    pub irradiance: Vec<f64>,
    /// Of its disc, radians; 0: a point.
    pub half_angle: f64,
}

impl Sun {
    /// A sun of one band.
    pub fn new(direction: DVec3, irradiance: f64, half_angle: f64) -> Sun {
        Sun { direction, irradiance: vec![irradiance], half_angle }
    }

    /// Radiance of its disc toward the unit direction `d`, per band: E/(pi sin^2 half angle) inside, 0 outside and
    /// for a point.
    pub fn disc(&self, d: DVec3) -> Vec<f64> {
        let axis = self.direction.normalize();
        let inside = self.half_angle > 0.0 && d.cross(axis).length().atan2(d.dot(axis)) <= self.half_angle;
        let factor = if inside { 1.0 / (PI * self.half_angle.sin().powi(2)) } else { 0.0 };
        self.irradiance.iter().map(|e| e * factor).collect()
    }

    /// A direction toward the disc for (u, v) in [0, 1)^2 and its weight: the mean of weight g(direction) is the
    /// integral of the disc's radiance times g, per unit of irradiance.
    pub fn sample(&self, u: f64, v: f64) -> (DVec3, f64) {
        let axis = self.direction.normalize();
        let (radius, angle) = (self.half_angle.sin() * u.sqrt(), TAU * v);
        let cosine = (1.0 - radius * radius).sqrt();
        // uniform over the projected disc: the density over solid angle is cosine/(pi sin^2)
        (in_frame(axis, dvec3(radius * angle.cos(), radius * angle.sin(), cosine)), 1.0 / cosine)
    }
}

/// The lobe q per unit of rho_0 at the angle of cosine `cosine` from the mirror direction, in 3-D
/// (C cos/(cos^2 + T^2 sin^2), C = (T^2 - 1)/(pi ln T^2)); 0 beyond 90 degrees.
pub fn lobe(axis_ratio: f64, cosine: f64) -> f64 {
    let t2 = axis_ratio * axis_ratio;
    let c = if t2 - 1.0 < 1e-9 { 1.0 / PI } else { (t2 - 1.0) / (PI * t2.ln()) };
    let cosine = cosine.max(0.0);
    c * cosine / (cosine * cosine + t2 * (1.0 - cosine * cosine))
}

/// The direction of (u, v) distributed as the whole lobe about the unit mirror direction: its angle is
/// asin sqrt((T^2u - 1)/(T^2 - 1)).
pub fn lobe_sample(axis_ratio: f64, mirror: DVec3, u: f64, v: f64) -> DVec3 {
    let t2 = axis_ratio * axis_ratio;
    let sine2 = if t2 - 1.0 < 1e-9 { u } else { ((t2.powf(u) - 1.0) / (t2 - 1.0)).min(1.0) };
    let (radius, angle) = (sine2.sqrt(), TAU * v);
    in_frame(mirror, dvec3(radius * angle.cos(), radius * angle.sin(), (1.0 - sine2).sqrt()))
}
