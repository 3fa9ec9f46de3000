//! The light of a scene: sky and sun, and the reference radiance that errors are relative to.

use crate::base::error::{Error, Field};
use crate::base::index::Index;
use crate::base::math::{PI, TAU, Vec3, cos, sin, sqrt};
use crate::base::qmc::Sequence;
use crate::scene::sky::{Sky, SkyInput};
use crate::scene::sun::{Sun, SunInput};
use crate::scene::{MAX_BANDS, Scene};

/// The light of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    /// The sky, if any.
    pub sky: Option<Sky<'a>>,
    /// The sun, if any.
    pub sun: Option<Sun<'a>>,
}

impl<'a> Light<'a> {
    /// A light of sky and sun, for a scene of `bands` bands. Where there is no sun and the sky is a table in which a small
    /// bright spot carries a large share of what arrives, that spot becomes the sun: its shadows have edges.
    ///
    /// # Errors
    /// What [`Sky::new`] and [`Sun::new`] refuse.
    pub fn new(
        sky: Option<&SkyInput<'a>>,
        sun: Option<&SunInput<'a>>,
        bands: usize,
    ) -> Result<Light<'a>, Error> {
        let mut sky = sky.map(|input| Sky::new(input, bands)).transpose()?;
        let sun = sun.map(|input| Sun::new(input, bands)).transpose()?;
        let spot = match (&mut sky, &sun) {
            (Some(sky), None) => sky.take_sun().map(|(spot, factors)| Sun::of_spot(&spot, factors)),
            _ => None,
        };
        Ok(Light { sky, sun: sun.or(spot) })
    }
}

impl Light<'_> {
    /// Reference radiance of each band; returns, as bits, the bands without light from sky or sun.
    ///
    /// It is max(E_up, E_down)/pi + E_sun/pi with the unobstructed sky irradiances of planes that face +-up; in a band
    /// without light from either, the largest emission, in whose place comes what it lights, once that is known.
    pub fn reference_radiance(&self, scene: &Scene<'_>, out: &mut [f64]) -> u64 {
        out.fill(0.0);
        if let Some(sky) = &self.sky {
            let (mut up, mut down) = ([0.0; MAX_BANDS], [0.0; MAX_BANDS]);
            let bands = out.len().min(MAX_BANDS);
            sky.irradiance(sky.up(), 1e-6, &mut up[..bands]);
            sky.irradiance(-sky.up(), 1e-6, &mut down[..bands]);
            if let Some(sun) = self.sun.as_ref().filter(|sun| sun.is_of_sky()) {
                let add = |to: &mut [f64], normal| {
                    let cosine = sun.cosine(normal);
                    to.iter_mut().enumerate().for_each(|(band, e)| *e += cosine * sun.irradiance(band));
                };
                add(&mut up[..bands], sky.up());
                add(&mut down[..bands], -sky.up());
            }
            out.iter_mut().zip(up.iter().zip(&down)).for_each(|(o, (&a, &b))| *o = a.max(b) / PI);
        }
        if let Some(sun) = self.sun.as_ref().filter(|sun| !sun.is_of_sky()) {
            out.iter_mut().enumerate().for_each(|(band, o)| *o += sun.irradiance(band) / PI);
        }
        let mut dark = 0;
        for (band, o) in out.iter_mut().enumerate().filter(|(_, o)| **o == 0.0) {
            *o = scene.largest_emission(band);
            dark |= 1 << (band % MAX_BANDS);
        }
        dark
    }

    /// Root mean square of the sky's radiance over all directions in each band, from 4,096 of them: to some percent
    /// but where a bright spot fills less than a thousandth of the sphere.
    pub fn rms_radiance(&self, out: &mut [f64]) {
        out.fill(0.0);
        let Some(sky) = &self.sky else { return };
        let (points, sequence) = (4096, Sequence::new(0x5e1f_0000));
        let mut radiance = [0.0; MAX_BANDS];
        let radiance = &mut radiance[..out.len().min(MAX_BANDS)];
        for index in 0..points {
            let (u, v) = sequence.pair(index, 0);
            let (z, (sin, cos)) = (2.0 * u - 1.0, (sin(TAU * v), cos(TAU * v)));
            let r = sqrt(1.0 - z * z);
            sky.radiance(Vec3::new(r * cos, r * sin, z), radiance);
            out.iter_mut().zip(radiance.iter()).for_each(|(o, l)| *o += l * l);
        }
        out.iter_mut().for_each(|o| *o = sqrt(*o / f64::from(points)));
    }

    /// The largest radiance that a ray can bring straight from the sky in each band; the sun's disc apart.
    pub fn largest_radiance(&self, out: &mut [f64]) {
        out.fill(0.0);
        if let Some(sky) = &self.sky {
            sky.largest_radiance(out);
        }
    }
}

/// Checks a light's reference radiance given by the user: one positive finite value per band.
pub fn check_reference(values: &[f64], bands: usize) -> Result<(), Error> {
    let field = Field::ReferenceRadiance;
    if values.len() != bands {
        return Err(Error::LightBandCount { field, expected: bands, given: values.len() });
    }
    match values.iter().position(|v| !(*v > 0.0 && v.is_finite())) {
        Some(band) => Err(Error::Range { field, band, value: values.at(band) }),
        None => Ok(()),
    }
}
