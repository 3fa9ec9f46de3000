//! What no derived radiance may exceed, and the largest that a ray can see.

use crate::base::error::{Error, Field};
use crate::scene::light::Light;
use crate::scene::lobe::Lobe;
use crate::scene::sky::RADIANCE_LARGEST;
use crate::scene::sun::Sun;
use crate::scene::{MAX_BANDS, Scene};

/// Refuses radiances above 1e37: f32 images hold 3.4e38, and a ninth of that leaves room for sums along a chain.
pub fn check_radiance(radiance: &[f64], bands: usize) -> Result<(), Error> {
    match radiance.iter().enumerate().find(|(_, l)| l.is_nan() || **l > RADIANCE_LARGEST) {
        Some((at, &value)) => Err(Error::Range { field: Field::Emission, band: at % bands.max(1), value }),
        None => Ok(()),
    }
}

/// Refuses a sun whose highlight in one of the scene's lobes exceeds 1e37, as [`check_radiance`] does the rest.
///
/// # Errors
/// [`Error::Range`] that names the sun's irradiance.
pub fn check_highlights(scene: &Scene<'_>, light: &Light<'_>) -> Result<(), Error> {
    let Some(sun) = &light.sun else { return Ok(()) };
    for band in 0..scene.bands() {
        if highlight(scene, sun, band) > RADIANCE_LARGEST {
            return Err(Error::Range { field: Field::SunIrradiance, band, value: sun.irradiance(band) });
        }
    }
    Ok(())
}

/// The sun's largest radiance in any lobe: E rho_0 q at the lobe's peak.
fn highlight(scene: &Scene<'_>, sun: &Sun<'_>, band: usize) -> f64 {
    let of = |material: usize| {
        let lobe = scene.gloss(material).and_then(|ratio| Lobe::new(ratio).ok());
        let rho = scene.specular(material).get(band).copied().unwrap_or(0.0);
        lobe.map_or(0.0, |l| sun.irradiance(band) * rho * l.value(1.0))
    };
    (0..scene.materials()).map(of).fold(0.0, f64::max)
}

/// Largest radiance that any ray can see, relative to the reference: sky, sun's disc and highlight in a lobe together,
/// or diffuse radiance.
pub fn brightest(scene: &Scene<'_>, light: &Light<'_>, reference: &[f64], radiance: &[f64]) -> f64 {
    let bands = reference.len().clamp(1, MAX_BANDS);
    let mut all = [0.0; MAX_BANDS];
    let (largest, _) = all.split_at_mut(bands);
    light.largest_radiance(largest);
    if let Some(sun) = &light.sun {
        largest
            .iter_mut()
            .enumerate()
            .for_each(|(b, l)| *l += sun.disc_radiance(b) + highlight(scene, sun, b));
    }
    for values in radiance.chunks_exact(bands) {
        largest.iter_mut().zip(values).for_each(|(l, &v)| *l = f64::max(*l, v));
    }
    relative(largest, reference)
}

/// Largest ratio over the bands that have a reference.
fn relative(values: &[f64], reference: &[f64]) -> f64 {
    values.iter().zip(reference).filter(|(_, r)| **r > 0.0).map(|(v, r)| v / r).fold(0.0, f64::max)
}
