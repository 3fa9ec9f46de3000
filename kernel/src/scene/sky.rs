//! The sky: radiance by direction, and the irradiance of planes that nothing shades.
//!
//! Uniform, hemisphere, overcast (Moon and Spencer) and gradient skies have closed forms; the general sky of
//! ISO 15469 (`cie`) and sampled skies (`table`) are integrated numerically.
//!
//! Constants of this file are measured by `cargo test --test table_suns` (suns of sky tables).

mod cie;
pub mod record;
mod sum;
mod table;

use crate::base::error::{Error, Field};
use crate::base::math::{PI, Vec3, atan2, cos, fabs, sin, sqrt, unit};
use crate::scene::MAX_BANDS;
use cie::Cie;
pub(in crate::scene) use table::SpotSun;
use table::Table;

/// A spot that gives this share of the irradiance of a plane that faces it is a sun: its shadows have edges, and rays that
/// look for the sky would meet it or not.
const SUN_SHARE: f64 = 0.05;

/// Radiance and irradiance above this are refused, so that f32 images stay finite.
pub(crate) const RADIANCE_LARGEST: f64 = 1e37;

/// How the sky's radiance depends on direction. `up` is the zenith of [`SkyInput`].
#[derive(Clone, Copy, Debug)]
pub enum SkyModel<'a> {
    /// `radiance` over the whole sphere; `ground` and `up` have no meaning.
    Uniform,
    /// `radiance` where dir.up >= 0, else `ground`.
    Hemisphere,
    /// CIE overcast sky: `radiance` (1 + 2 dir.up)/3 where dir.up >= 0, else `ground`.
    Overcast,
    /// General sky of ISO 15469:2004 (CIE S 011), zenith radiance `radiance`, where dir.up >= 0, else `ground`.
    Cie {
        /// The standard's sky type, 1..=15.
        kind: u32,
        /// Toward the sun; any length; above the horizon.
        sun_direction: [f64; 3],
    },
    /// `ground` + (`radiance` - `ground`)(1 + dir.up)/2 over the whole sphere, without a horizon.
    Gradient,
    /// Samples over the whole sphere, times `radiance`; `ground` has no meaning.
    Table(SkyTable<'a>),
}

/// A sky sampled at equal steps of elevation and azimuth.
///
/// Row r lies at elevation 90 - (r + 1/2) 180/rows degrees, column c at azimuth (c + 1/2) 360/columns degrees
/// from `azimuth_zero`, counter-clockwise seen from +up. Between these centres the radiance is bilinear; it
/// wraps in azimuth and keeps the outermost rows' values up to the poles.
#[derive(Clone, Copy, Debug)]
pub struct SkyTable<'a> {
    /// Steps of elevation, at least 1.
    pub rows: usize,
    /// Steps of azimuth, at least 1.
    pub columns: usize,
    /// Values per sample: 1 (the same in all bands) or the scene's number of bands.
    pub bands: usize,
    /// `rows` x `columns` x `bands` values, finite, >= 0, row by row.
    pub radiance: &'a [f32],
    /// Azimuth 0, projected off up; absent: [1, 0, 0], or [0, 1, 0] where that is parallel to up.
    pub azimuth_zero: Option<[f64; 3]>,
}

/// Input of a sky.
#[derive(Clone, Copy, Debug)]
pub struct SkyInput<'a> {
    /// Dependence on direction.
    pub model: SkyModel<'a>,
    /// Radiance per band as the model uses it, W m-2 sr-1, 0..=1e37 (for a table a factor).
    pub radiance: &'a [f64],
    /// Radiance below the horizon per band, W m-2 sr-1, 0..=1e37.
    pub ground: &'a [f64],
    /// Toward the zenith; any length but zero.
    pub up: [f64; 3],
}

#[derive(Clone, Copy, Debug)]
enum Model<'a> {
    Uniform,
    Hemisphere,
    Overcast,
    Cie(Cie),
    Gradient,
    Table(Table<'a>),
}

/// A validated sky.
#[derive(Clone, Copy, Debug)]
pub struct Sky<'a> {
    model: Model<'a>,
    radiance: &'a [f64],
    ground: &'a [f64],
    up: Vec3,
}

/// One value per band, each in 0..=1e37.
pub(crate) fn check_bands(values: &[f64], bands: usize, field: Field) -> Result<(), Error> {
    if values.len() != bands {
        return Err(Error::LightBandCount { field, expected: bands, given: values.len() });
    }
    match values.iter().position(|value| !(0.0..=RADIANCE_LARGEST).contains(value)) {
        Some(band) => Err(Error::Range { field, band, value: values.get(band).copied().unwrap_or_default() }),
        None => Ok(()),
    }
}

impl<'a> Sky<'a> {
    /// Checks `input` for a scene of `bands` bands (1..=64).
    ///
    /// # Errors
    /// [`Error::Bands`], [`Error::LightBandCount`], [`Error::Range`] for a value that is not finite, negative
    /// or leads to a radiance above 1e37 (also a sky type outside 1..=15 and a sun not above the horizon, with
    /// the sine of its elevation), [`Error::Direction`] for a direction that is zero or not finite or an
    /// `azimuth_zero` along `up`, [`Error::Length`] for a table of the wrong size. What has no meaning for the
    /// model is not looked at.
    pub fn new(input: &SkyInput<'a>, bands: usize) -> Result<Sky<'a>, Error> {
        if !(1..=MAX_BANDS).contains(&bands) {
            return Err(Error::Bands { given: bands });
        }
        check_bands(input.radiance, bands, Field::SkyRadiance)?;
        let whole_sphere = matches!(input.model, SkyModel::Uniform | SkyModel::Table(_));
        if !whole_sphere {
            check_bands(input.ground, bands, Field::SkyGround)?;
        }
        let up = match (unit(Vec3::from_array(input.up)), input.model) {
            (Some(up), _) => up,
            (None, SkyModel::Uniform) => Vec3::Z,
            (None, _) => return Err(Error::Direction { field: Field::SkyUp }),
        };
        let model = match input.model {
            SkyModel::Uniform => Model::Uniform,
            SkyModel::Hemisphere => Model::Hemisphere,
            SkyModel::Overcast => Model::Overcast,
            SkyModel::Gradient => Model::Gradient,
            SkyModel::Cie { kind, sun_direction } => {
                let cie = Cie::new(kind, sun_direction, up)?;
                for (band, &radiance) in input.radiance.iter().enumerate() {
                    if radiance * cie.largest() > RADIANCE_LARGEST {
                        return Err(Error::Range { field: Field::SkyRadiance, band, value: radiance });
                    }
                }
                Model::Cie(cie)
            }
            SkyModel::Table(table) => Model::Table(Table::new(&table, input.radiance, up)?),
        };
        let ground = if whole_sphere { &[] } else { input.ground };
        Ok(Sky { model, radiance: input.radiance, ground, up })
    }

    /// Takes a table's bright spot out, if it carries a large share of what the brightest plane receives.
    pub(in crate::scene) fn take_sun(&mut self) -> Option<(SpotSun<'a>, &'a [f64])> {
        let Model::Table(table) = &mut self.model else { return None };
        let whole = *table;
        let spot = table.take_sun(self.radiance)?;
        let mut facing = [0.0; MAX_BANDS];
        let facing = facing.get_mut(..self.radiance.len())?;
        whole.irradiance(spot.direction, 1e-3, facing);
        let share = |(band, all): (usize, &f64)| {
            let sample = spot.samples.get(band).or(spot.samples.first()).map_or(0.0, |x| f64::from(*x));
            if *all > 0.0 { spot.scale * sample / all } else { 0.0 }
        };
        let most = facing.iter().enumerate().map(share).fold(0.0, f64::max);
        if most < SUN_SHARE {
            *table = whole;
            return None;
        }
        Some((spot, self.radiance))
    }

    /// Number of spectral bands.
    pub fn bands(&self) -> usize {
        self.radiance.len()
    }

    /// Unit vector toward the zenith; +z for a uniform sky given without one.
    pub fn up(&self) -> Vec3 {
        self.up
    }

    /// Whether the radiance is known to be the same in all directions of the whole sphere.
    pub fn is_uniform(&self) -> bool {
        match self.model {
            Model::Uniform => true,
            Model::Hemisphere | Model::Gradient => self.radiance == self.ground,
            _ => false,
        }
    }

    /// Radiance per band that arrives from the unit vector `direction` (pointing to the sky), into `out`.
    ///
    /// Right to a few ulp; for `cie` within 1e-7 of the value next to the sun's direction.
    pub fn radiance(&self, direction: Vec3, out: &mut [f64]) {
        let height = direction.dot(self.up);
        let above = height >= 0.0;
        match &self.model {
            Model::Uniform => copy(self.radiance, out),
            Model::Gradient => self.combine(0.5 + 0.5 * height, 0.5 - 0.5 * height, out),
            Model::Table(table) => {
                table.radiance(direction, out);
                scale(out, self.radiance);
            }
            _ if !above => copy(self.ground, out),
            Model::Hemisphere => copy(self.radiance, out),
            Model::Overcast => self.combine((1.0 + 2.0 * height) / 3.0, 0.0, out),
            Model::Cie(cie) => self.combine(cie.relative_radiance(direction, height), 0.0, out),
        }
    }

    /// Irradiance per band of an unshaded plane that faces the unit vector `normal`: the integral of radiance
    /// times cosine over its hemisphere, into `out`.
    ///
    /// Closed forms to a relative 1e-12 for all but two models. `cie`: quadrature whose points follow from
    /// `relative_error` (1e-7 at best; see `sky/cie.rs` for the measured errors). `table`: the bilinear
    /// interpolant exactly but for the cells on the plane's horizon (see `sky/table.rs`); takes a time
    /// proportional to the table's size.
    pub fn irradiance(&self, normal: Vec3, relative_error: f64, out: &mut [f64]) {
        let cosine = normal.dot(self.up);
        // pi (1 -+ cos)/2 as squares of chords: nothing cancels next to the poles
        let sky = 0.25 * PI * (normal + self.up).length_squared();
        let ground = 0.25 * PI * (normal - self.up).length_squared();
        match &self.model {
            Model::Uniform => self.combine(PI, 0.0, out),
            Model::Hemisphere => self.combine(sky, ground, out),
            Model::Overcast => self.combine((sky + 2.0 * height_moment(normal, self.up)) / 3.0, ground, out),
            Model::Gradient => {
                let tilt = PI / 3.0 * cosine;
                self.combine(0.5 * PI + tilt, 0.5 * PI - tilt, out);
            }
            Model::Cie(cie) => self.combine(cie.irradiance(normal, self.up, relative_error), ground, out),
            Model::Table(table) => {
                table.irradiance(normal, relative_error, out);
                scale(out, self.radiance);
            }
        }
    }

    /// Whether the radiance is a linear function of the direction's height above the horizon, on either side of it: then
    /// [`Sky::open_irradiance`] tells the irradiance where a part of the sky is hidden.
    pub fn is_linear(&self) -> bool {
        !matches!(self.model, Model::Cie(_) | Model::Table(_))
    }

    /// Irradiance per band where only a part of the sky is open, into `out`: by the integrals of the cosine over what is
    /// open above and below the horizon, and by those of cosine times height. Zero where the sky is not linear.
    pub fn open_irradiance(&self, (above, below): (f64, f64), (high, low): (f64, f64), out: &mut [f64]) {
        let whole = above + below;
        match &self.model {
            Model::Uniform => self.combine(whole, 0.0, out),
            Model::Hemisphere => self.combine(above, below, out),
            Model::Overcast => self.combine((above + 2.0 * high) / 3.0, below, out),
            Model::Gradient => {
                let tilt = 0.5 * (high + low);
                self.combine(0.5 * whole + tilt, 0.5 * whole - tilt, out);
            }
            Model::Cie(_) | Model::Table(_) => out.fill(0.0),
        }
    }

    /// Upper bound of the radiance per band over all directions, into `out`: attained but for `cie`, where it
    /// is the product of the largest indicatrix and the largest gradation. Reads the whole of a table.
    pub fn largest_radiance(&self, out: &mut [f64]) {
        match &self.model {
            Model::Uniform => copy(self.radiance, out),
            Model::Table(table) => {
                table.largest(out);
                scale(out, self.radiance);
            }
            model => {
                let factor = if let Model::Cie(cie) = model { cie.largest() } else { 1.0 };
                for ((out, radiance), ground) in out.iter_mut().zip(self.radiance).zip(self.ground) {
                    *out = (radiance * factor).max(*ground);
                }
            }
        }
    }

    /// `sky` times the radiance plus `ground` times the ground's, per band.
    fn combine(&self, sky: f64, ground: f64, out: &mut [f64]) {
        for (band, (out, radiance)) in out.iter_mut().zip(self.radiance).enumerate() {
            *out = sky * radiance + ground * self.ground.get(band).copied().unwrap_or(0.0);
        }
    }
}

fn copy(from: &[f64], out: &mut [f64]) {
    for (out, value) in out.iter_mut().zip(from) {
        *out = *value;
    }
}

fn scale(out: &mut [f64], factors: &[f64]) {
    for (out, factor) in out.iter_mut().zip(factors) {
        *out *= factor;
    }
}

/// Integral of (d.normal)(d.up) over the directions d above both planes: (2/3)(sin c - c cos c), where c is the
/// angle between `normal` and -`up`.
fn height_moment(normal: Vec3, up: Vec3) -> f64 {
    let cross = normal.cross(up);
    let c = atan2(sqrt(cross.dot(cross)), -normal.dot(up));
    if fabs(c) > 0.3 {
        return 2.0 / 3.0 * (sin(c) - c * cos(c));
    }
    // the difference cancels for small angles: its series, sum over k of (-1)^(k+1) 2k c^(2k+1)/(2k+1)!
    let square = c * c;
    let (mut term, mut sum) = (c * square / 3.0, 0.0);
    for k in 1..8 {
        sum += term;
        let k = f64::from(k);
        term *= -square * (k + 1.0) / (k * (2.0 * k + 2.0) * (2.0 * k + 3.0));
    }
    2.0 / 3.0 * sum
}
