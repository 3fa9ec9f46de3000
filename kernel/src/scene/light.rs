//! The light of a scene: sky and sun, and the reference radiance that errors are relative to.

use crate::base::error::{Error, Field};
use crate::base::index::Index;
use crate::base::math::{PI, TAU, Vec3, cos, sin, sqrt};
use crate::base::qmc::Sequence;
use crate::scene::sky::{RADIANCE_LARGEST, Sky, SkyInput};
use crate::scene::sun::{Sun, SunInput};
use crate::scene::{MAX_BANDS, Scene};

/// The light of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    /// The sky, if any.
    pub sky: Option<Sky<'a>>,
    /// The sun, if any.
    pub sun: Option<Sun<'a>>,
    /// Own diffuse radiance of each facet, side and band, bands innermost, W m-2 sr-1, in place of the materials' emission;
    /// empty: the materials' ([`Light::with_emission`]).
    pub emission: &'a [f64],
}

/// Input of a light.
#[derive(Clone, Copy, Debug, Default)]
pub struct LightInput<'a> {
    /// The sky, if any.
    pub sky: Option<SkyInput<'a>>,
    /// The sun, if any.
    pub sun: Option<SunInput<'a>>,
    /// As [`Light::emission`].
    pub emission: &'a [f64],
    /// The radiance per band to which errors are related; `None`: from the light.
    pub reference: Option<&'a [f64]>,
}

impl<'a> LightInput<'a> {
    /// The light of a scene, checked.
    ///
    /// # Errors
    /// What [`Light::new`], [`Light::with_emission`] and [`check_reference`] refuse.
    pub fn light(&self, scene: &Scene<'_>) -> Result<Light<'a>, Error> {
        if let Some(reference) = self.reference {
            check_reference(reference, scene.bands())?;
        }
        // in one place of the stack: it is large
        let mut light = Light::new(self.sky.as_ref(), self.sun.as_ref(), scene.bands());
        if let Ok(light) = &mut light {
            check_emission(scene, self.emission)?;
            light.emission = self.emission;
        }
        light
    }
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
        let mut light = Light::as_given(sky, sun, bands);
        if let Ok(light) = &mut light {
            light.take_sun();
        }
        light
    }

    /// A light of sky and sun as they are given.
    // apart, as is the next: the parts of a light being made do not burden the stack of finding the sun
    #[inline(never)]
    fn as_given(
        sky: Option<&SkyInput<'a>>,
        sun: Option<&SunInput<'a>>,
        bands: usize,
    ) -> Result<Light<'a>, Error> {
        let sky = sky.map(|input| Sky::new(input, bands)).transpose()?;
        let sun = sun.map(|input| Sun::new(input, bands)).transpose()?;
        Ok(Light { sky, sun, emission: &[] })
    }

    /// Makes a table's bright spot the sun where there is none.
    #[inline(never)]
    fn take_sun(&mut self) {
        if let (Some(sky), None) = (&mut self.sky, &self.sun) {
            self.sun = sky.take_sun().map(|(spot, factors)| Sun::of_spot(&spot, factors));
        }
    }

    /// The same with an emission of its own: `values` for each facet, side and band, bands innermost, 0..=1e37 W m-2 sr-1; empty:
    /// the materials'. A new emission asks for no rays.
    ///
    /// # Errors
    /// [`Error::LightBandCount`] for another number of values, [`Error::FacetRange`] for one out of range, and
    /// [`Error::Uncoupled`] where a facet emits whose material neither reflects diffusely nor emits: couplings have no entries
    /// for what it sends.
    pub fn with_emission(self, scene: &Scene<'_>, values: &'a [f64]) -> Result<Light<'a>, Error> {
        check_emission(scene, values)?;
        Ok(Light { emission: values, ..self })
    }
}

impl Light<'_> {
    /// Own diffuse radiance of a facet's side, one value per band.
    #[inline(always)]
    pub fn emission<'s>(&'s self, scene: &Scene<'s>, facet: usize, side: usize) -> &'s [f64] {
        if self.emission.is_empty() {
            return scene.emission(scene.material(facet));
        }
        let start = (facet * scene.sides() + side) * scene.bands();
        self.emission.part(start..start + scene.bands())
    }

    /// Largest emission of the scene in one band.
    pub fn largest_emission(&self, scene: &Scene<'_>, band: usize) -> f64 {
        if self.emission.is_empty() {
            return scene.largest_emission(band);
        }
        self.emission.iter().skip(band).step_by(scene.bands().max(1)).fold(0.0, |a, &b| f64::max(a, b))
    }

    /// Whether any facet emits.
    pub fn emits(&self, scene: &Scene<'_>) -> bool {
        (0..scene.bands()).any(|band| self.largest_emission(scene, band) > 0.0)
    }

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
            *o = self.largest_emission(scene, band);
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

/// Checks a light's own emission; see [`Light::with_emission`].
fn check_emission(scene: &Scene<'_>, values: &[f64]) -> Result<(), Error> {
    let stride = scene.sides() * scene.bands();
    let (expected, field) = (scene.facets() * stride, Field::Emission);
    if !values.is_empty() && values.len() != expected {
        return Err(Error::LightBandCount { field, expected, given: values.len() });
    }
    for (at, &value) in values.iter().enumerate() {
        let (facet, band) = (at / stride.max(1), at % scene.bands().max(1));
        if !(0.0..=RADIANCE_LARGEST).contains(&value) {
            return Err(Error::FacetRange { facet, band, field, value });
        }
        if value > 0.0 && scene.areas().at(facet) > 0.0 && !scene.glows(scene.material(facet)) {
            return Err(Error::Uncoupled { facet, field });
        }
    }
    Ok(())
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
