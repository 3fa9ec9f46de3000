//! The light of a scene: sky and sun, and the reference radiance that errors are relative to.

use crate::base::error::{Error, Field};
use crate::base::index::Index;
use crate::base::math::{PI, TAU, Vec3, cos, sin, sqrt};
use crate::base::qmc::Sequence;
use crate::scene::sky::Sky;
use crate::scene::sun::Sun;
use crate::scene::{MAX_BANDS, Scene};

/// The light of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    /// The sky, if any.
    pub sky: Option<Sky<'a>>,
    /// The sun, if any.
    pub sun: Option<Sun<'a>>,
}

impl Light<'_> {
    /// Reference radiance of each band: max(E_up, E_down)/pi + E_sun/pi with the unobstructed sky irradiances
    /// of planes that face +-up; in a band without light from either, the largest emission.
    pub fn reference_radiance(&self, scene: &Scene<'_>, out: &mut [f64]) {
        out.fill(0.0);
        if let Some(sky) = &self.sky {
            let (mut up, mut down) = ([0.0; MAX_BANDS], [0.0; MAX_BANDS]);
            let bands = out.len().min(MAX_BANDS);
            sky.irradiance(sky.up(), 1e-6, &mut up[..bands]);
            sky.irradiance(-sky.up(), 1e-6, &mut down[..bands]);
            out.iter_mut().zip(up.iter().zip(&down)).for_each(|(o, (&a, &b))| *o = a.max(b) / PI);
        }
        if let Some(sun) = &self.sun {
            out.iter_mut().enumerate().for_each(|(band, o)| *o += sun.irradiance(band) / PI);
        }
        for (band, o) in out.iter_mut().enumerate().filter(|(_, o)| **o == 0.0) {
            *o = scene.largest_emission(band);
        }
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
