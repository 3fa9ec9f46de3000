//! The sun: a point or a disc of uniform radiance.

use crate::base::error::{Error, Field};
use crate::base::math::{PI, TAU, Vec3, acos, asin, clamp, cos, frame, sin, sqrt, unit};
use crate::scene::MAX_BANDS;
use crate::scene::sky::{RADIANCE_LARGEST, SpotSun, check_bands};

/// Input of a sun.
#[derive(Clone, Copy, Debug)]
pub struct SunInput<'a> {
    /// Toward the centre of the sun; any length but zero.
    pub direction: [f64; 3],
    /// Irradiance per band of an unshaded plane that faces the sun, W m-2, 0..=1e37.
    pub irradiance: &'a [f64],
    /// Angular radius in degrees: 0 (a point) or 1e-4..=10.
    pub half_angle_deg: f64,
}

/// A validated sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun<'a> {
    direction: Vec3,
    irradiance: Irradiance<'a>,
    half_angle: f64,
    sine: f64,
    cosine: f64,
}

/// Irradiance of a plane that faces a sun.
#[derive(Clone, Copy, Debug)]
enum Irradiance<'a> {
    /// One value a band.
    Told(&'a [f64]),
    /// Of a bright spot of a sky table: a sample, one value or one of each band, the bands' factors and the spot's size.
    Spot(&'a [f32], &'a [f64], f64),
}

impl<'a> Sun<'a> {
    /// Checks `input` for a scene of `bands` bands (1..=64).
    ///
    /// # Errors
    /// [`Error::Bands`], [`Error::Direction`], [`Error::LightBandCount`]; [`Error::Range`] for a half angle
    /// that is neither 0 nor in 1e-4..=10 degrees and for an irradiance that is not finite, negative, above
    /// 1e37, or makes the disc's radiance exceed 1e37.
    pub fn new(input: &SunInput<'a>, bands: usize) -> Result<Sun<'a>, Error> {
        if !(1..=MAX_BANDS).contains(&bands) {
            return Err(Error::Bands { given: bands });
        }
        let field = Field::SunDirection;
        let direction = unit(Vec3::from_array(input.direction)).ok_or(Error::Direction { field })?;
        let degrees = input.half_angle_deg;
        if !(degrees == 0.0 || (1e-4..=10.0).contains(&degrees)) {
            return Err(Error::Range { field: Field::SunHalfAngle, band: 0, value: degrees });
        }
        check_bands(input.irradiance, bands, Field::SunIrradiance)?;
        let half_angle = degrees * (PI / 180.0);
        let (sine, cosine) = (sin(half_angle), cos(half_angle));
        let irradiance = Irradiance::Told(input.irradiance);
        let sun = Sun { direction, irradiance, half_angle, sine, cosine };
        for (band, &value) in input.irradiance.iter().enumerate() {
            if sun.disc_radiance(band) > RADIANCE_LARGEST {
                return Err(Error::Range { field: Field::SunIrradiance, band, value });
            }
        }
        Ok(sun)
    }

    /// The sun that was taken out of a sky table of these factors.
    pub(in crate::scene) fn of_spot(spot: &SpotSun<'a>, factors: &'a [f64]) -> Sun<'a> {
        let half_angle = clamp(spot.half_angle, 1e-4 * (PI / 180.0), 10.0 * (PI / 180.0));
        let irradiance = Irradiance::Spot(spot.samples, factors, spot.scale);
        let (sine, cosine) = (sin(half_angle), cos(half_angle));
        Sun { direction: spot.direction, irradiance, half_angle, sine, cosine }
    }

    /// Whether it was taken out of a sky table.
    pub fn is_of_sky(&self) -> bool {
        matches!(self.irradiance, Irradiance::Spot(..))
    }

    /// Number of spectral bands.
    pub fn bands(&self) -> usize {
        match self.irradiance {
            Irradiance::Told(values) => values.len(),
            Irradiance::Spot(_, factors, _) => factors.len(),
        }
    }

    /// The same sun seen in another direction, a unit vector: its image in mirrors.
    pub fn seen_toward(&self, direction: Vec3) -> Sun<'a> {
        Sun { direction, ..*self }
    }

    /// Unit vector toward the centre.
    pub fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Irradiance of a plane that faces the sun, W m-2; 0 for a band that is not there.
    pub fn irradiance(&self, band: usize) -> f64 {
        match self.irradiance {
            Irradiance::Told(values) => values.get(band).copied().unwrap_or(0.0),
            Irradiance::Spot(samples, factors, scale) => {
                let sample = samples.get(band).or(samples.first().filter(|_| samples.len() == 1));
                let sample = sample.map_or(0.0, |x| f64::from(*x));
                scale * sample * factors.get(band).copied().unwrap_or(0.0)
            }
        }
    }

    /// Angular radius in radians; 0 for a point.
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }

    /// Whether the sun has no extent.
    pub fn is_point(&self) -> bool {
        self.half_angle == 0.0
    }

    /// Radiance of the disc, E/(pi sin^2(half angle)), W m-2 sr-1; 0 for a point, which rays never meet.
    pub fn disc_radiance(&self, band: usize) -> f64 {
        if self.is_point() { 0.0 } else { self.irradiance(band) / (PI * self.sine * self.sine) }
    }

    /// Whether the unit vector `direction` points into the disc, its edge included; never for a point.
    pub fn contains(&self, direction: Vec3) -> bool {
        let across = direction.cross(self.direction);
        !self.is_point() && direction.dot(self.direction) > 0.0 && across.dot(across) <= self.sine * self.sine
    }

    /// Irradiance of an unshaded plane that faces the unit vector `normal`, over that of one that faces the
    /// sun: the mean over the disc of max(0, n.d), in 0..=1.
    ///
    /// A disc across the plane's horizon: Lambert's contour integral along the disc's edge and the horizon,
    /// arranged so that no large terms cancel. Error: a few ulp of the half angle.
    pub fn cosine(&self, normal: Vec3) -> f64 {
        let height = normal.dot(self.direction);
        if height >= self.sine {
            return height.min(1.0);
        }
        if self.is_point() || height <= -self.sine {
            return 0.0;
        }
        let across = sqrt(1.0 - height * height);
        // the disc's edge is above the plane for azimuths below `arc`; the horizon crosses it over 2 `chord`
        let arc = acos(clamp(-self.cosine * height / (self.sine * across), -1.0, 1.0));
        let sine = sqrt((self.sine - height) * (self.sine + height)) / across;
        let chord = asin(sine.min(1.0));
        let product = sine * self.cosine / across;
        let lune = segment(chord, product) + height * height * product;
        ((arc * height + lune / (self.sine * self.sine)) / PI).max(0.0)
    }

    /// A direction of the disc for (`u`, `v`) in the unit square, uniform in the solid angle *projected along
    /// the sun's direction* (Shirley and Chiu's concentric map of the square to the disc).
    ///
    /// Each of n samples so stands for the same share E/n of the irradiance of a plane that faces the sun, and
    /// for [`Sun::share`] of it on any other plane. The mean share of samples that come in opposite pairs
    /// ((u, v) and (1 - u, 1 - v)) is then exact on every plane that the whole disc is above.
    pub fn sample(&self, u: f64, v: f64) -> Vec3 {
        let (x, y) = concentric(u, v);
        let (first, second) = frame(self.direction);
        let (x, y) = (self.sine * x, self.sine * y);
        first * x + second * y + self.direction * sqrt(1.0 - (x * x + y * y))
    }

    /// max(0, n.d)/(s.d): what a sample `direction` gives a plane that faces the unit vector `normal`, over
    /// what it gives one that faces the sun.
    pub fn share(&self, direction: Vec3, normal: Vec3) -> f64 {
        normal.dot(direction).max(0.0) / direction.dot(self.direction).max(self.cosine)
    }
}

/// angle - `product`, where `product` is sin(angle) cos(angle), for an angle in 0..pi/2.
fn segment(angle: f64, product: f64) -> f64 {
    if angle > 0.2 {
        return angle - product;
    }
    // (2 a - sin 2 a)/2 by its series, whose first omitted term is below 1e-17 of the sum
    let square = 4.0 * angle * angle;
    let (mut term, mut sum) = (angle * square / 6.0, 0.0);
    for k in 1..8 {
        sum += term;
        let k = 2.0 * f64::from(k);
        term *= -square / ((k + 2.0) * (k + 3.0));
    }
    sum
}

/// Area-preserving map of the unit square to the unit disc that keeps neighbours together.
fn concentric(u: f64, v: f64) -> (f64, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return (0.0, 0.0);
    }
    let (radius, turn) = if a * a > b * b { (a, b / a / 8.0) } else { (b, 0.25 - a / b / 8.0) };
    (radius * cos(TAU * turn), radius * sin(TAU * turn))
}
