//! What a weighted sum of radiances along rays is made of, and its derivatives: shares of the facets that are seen, terms, and
//! by how much the sum changes with each unknown's irradiance, each facet's diffuse reflectance and emission where they are
//! looked at.
//!
//! The derivative by irradiance is the importance of the unknowns (B. Smits, J. Arvo, D. Salesin, *An Importance-Driven
//! Radiosity Algorithm*, 1992); what it comes to by way of reflections, the transposed system tells
//! ([`crate::radiosity::adjoint`]).

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy};
use crate::base::math::FRAC_1_PI;
use crate::coupling::element::{Elements, Local};
use crate::rays::surface::Surface;
use crate::scene::{MAX_BANDS, Scene};
use crate::view::chain::Terms;

/// Terms of a radiance: diffuse, mirrored sky and sun, mirrored diffuse.
pub const TERMS: usize = 3;

/// Sums over weighted rays, bands innermost, in the caller's memory.
#[derive(Debug)]
pub struct Importance<'m> {
    /// Derivative by the mean and both gradients of each unknown's irradiance, of the shape of a solution's table.
    pub irradiance: &'m mut [f64],
    /// Derivative by the diffuse reflectance of each facet, W/sr where the sum is a radiant intensity; 0 for facets that reflect
    /// nothing diffusely.
    pub diffuse: &'m mut [f64],
    /// Derivative by the emission of each facet and side.
    pub emission: &'m mut [f64],
    /// Radiant intensity by the rays that meet each facet first, by facet: they add up to the sum.
    pub shares: &'m mut [f64],
    /// The sum's [`TERMS`].
    pub terms: &'m mut [f64],
    /// Weight of the present ray: the sum's change by a radiance of 1 along it.
    weight: f64,
    /// Radiance of the present ray before what is noted of it.
    before: &'m mut [f64],
    bands: usize,
    sides: usize,
}

impl<'m> Importance<'m> {
    /// Values of each table.
    fn counts(scene: &Scene<'_>, elements: &Elements<'_>) -> [usize; 6] {
        let bands = scene.bands();
        let facets = scene.facets() * bands;
        [3 * elements.unknowns() * bands, facets, facets * scene.sides(), facets, TERMS * bands, MAX_BANDS]
    }

    /// Bytes of its memory.
    pub fn need(scene: &Scene<'_>, elements: &Elements<'_>) -> Need {
        let counts = Importance::counts(scene, elements);
        counts.iter().fold(Need::new(), |need, count| need.and::<f64>(*count))
    }

    /// All zero, carved out of an arena.
    pub fn take(
        scene: &Scene<'_>,
        elements: &Elements<'_>,
        arena: &mut Arena<'m>,
    ) -> Result<Importance<'m>, Error> {
        let [irradiance, diffuse, emission, shares, terms, before] = Importance::counts(scene, elements);
        Ok(Importance {
            irradiance: arena.take(irradiance)?,
            diffuse: arena.take(diffuse)?,
            emission: arena.take(emission)?,
            shares: arena.take(shares)?,
            terms: arena.take(terms)?,
            weight: 0.0,
            before: arena.take(before)?,
            bands: scene.bands(),
            sides: scene.sides(),
        })
    }

    /// The same tables for a shorter time.
    pub(crate) fn lend(&mut self) -> Importance<'_> {
        Importance {
            irradiance: &mut *self.irradiance,
            diffuse: &mut *self.diffuse,
            emission: &mut *self.emission,
            shares: &mut *self.shares,
            terms: &mut *self.terms,
            weight: self.weight,
            before: &mut *self.before,
            bands: self.bands,
            sides: self.sides,
        }
    }

    /// The weight of the rays that follow.
    pub(crate) fn weigh(&mut self, weight: f64) {
        self.weight = weight;
    }

    /// Adds the present ray's terms, and its share to the facet that it meets first.
    pub(crate) fn add_ray(&mut self, first: usize, terms: &Terms) {
        let weight = self.weight;
        for band in 0..self.bands {
            let all = [terms.diffuse.at(band), terms.mirror_sky.at(band), terms.mirror_diffuse.at(band)];
            for (term, value) in all.iter().enumerate() {
                let at = term * self.bands + band;
                self.terms.set(at, self.terms.at(at) + weight * value);
            }
        }
        let share: [f64; MAX_BANDS] = core::array::from_fn(|band| weight * terms.sum(band));
        self.add_share(first, &share);
    }

    /// Adds what was found of a facet's mirror apart from rays, one value per band: it is mirrored sun.
    pub(crate) fn add_glints(&mut self, facet: usize, values: &[f64]) {
        for (band, value) in values.iter().enumerate().take(self.bands) {
            let at = self.bands + band;
            self.terms.set(at, self.terms.at(at) + value);
        }
        self.add_share(facet, values);
    }

    fn add_share(&mut self, facet: usize, values: &[f64]) {
        let to = self.shares.part_mut(facet * self.bands..(facet + 1) * self.bands);
        to.iter_mut().zip(values).for_each(|(to, value)| *to += value);
    }

    /// Notes a facet that the present ray meets behind mirrors of the product `throughput`, before it adds to the radiance
    /// `before` what the facet reflects.
    pub(crate) fn meet(&mut self, surface: &Surface, throughput: &[f64], before: &[f64]) {
        let place = (surface.facet * self.sides + surface.side) * self.bands;
        let to = self.emission.part_mut(place..place + self.bands);
        to.iter_mut().zip(throughput).for_each(|(to, through)| *to += self.weight * through);
        copy(self.before, before);
    }

    /// Notes that the radiance is now `after`: what the facet reflects of the irradiance of its unknown, of which the share
    /// `ratio` counts at the point, and of all else that arrives there.
    pub(crate) fn reflect(
        &mut self,
        surface: &Surface,
        (unknown, (a, b), ratio): (usize, Local, f64),
        (diffuse, throughput): (&[f64], &[f64]),
        after: &[f64],
    ) {
        let bands = self.bands;
        for (band, (rho, through)) in diffuse.iter().zip(throughput).enumerate().take(bands) {
            if *rho > 0.0 {
                let at = surface.facet * bands + band;
                let arrives = (after.at(band) - self.before.at(band)) / rho;
                self.diffuse.set(at, self.diffuse.at(at) + self.weight * arrives);
            }
            let share = self.weight * through * rho * FRAC_1_PI * ratio;
            for (part, factor) in [1.0, a, b].iter().enumerate() {
                let at = (3 * unknown + part) * bands + band;
                self.irradiance.set(at, self.irradiance.at(at) + share * factor);
            }
        }
    }
}
