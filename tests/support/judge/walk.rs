//! Random walks of unlimited length with the sun evaluated at every facet: one sample of eq. 1.

use super::sampler::Sampler;
use super::{Judge, Spectrum, UNIT, largest, leave, product};
use crate::support::twin::{Rng, cosine_direction, lobe, lobe_sample, reflect};
use blik_kernel::ray::{Hit, Ray};
use glam::DVec3;
use std::f64::consts::{FRAC_1_PI, PI};

/// Walks from the facets of the eye's chain of mirrors are all taken where they carry more than this.
const SPLIT: f64 = 0.05;

/// A chain from the eye that carries less goes on by chance.
const FAINT_CHAIN: f64 = 0.01;

/// A walk that carries less than this share of what it began with goes on by chance.
const FAINT_WALK: f64 = 0.2;

/// One sample on its way.
pub struct Path {
    /// Its low-discrepancy numbers.
    pub sampler: Sampler,
    /// Its other random numbers.
    pub rng: Rng,
    /// Radiance found so far.
    pub sum: Spectrum,
    /// Rays traced.
    pub rays: u64,
}

impl Path {
    /// Adds `weight` times `value` times `factor`.
    pub fn add(&mut self, weight: &Spectrum, value: &Spectrum, factor: f64) {
        for (sum, (w, v)) in self.sum.iter_mut().zip(weight.iter().zip(value)) {
            *sum += w * v * factor;
        }
    }

    /// Numbers for the event `set`; far along a walk plain random ones do.
    fn four(&mut self, set: u32) -> [f64; 4] {
        if set < 64 { self.sampler.four(set) } else { std::array::from_fn(|_| self.rng.unit()) }
    }
}

impl Judge<'_> {
    /// The normal of the side that was hit and the point; `None` where it is the black back of a one-sided facet.
    pub fn side(&self, hit: &Hit) -> Option<(DVec3, DVec3)> {
        if !hit.front && !self.two_sided {
            return None;
        }
        let normal = self.normals[hit.facet as usize];
        let [a, b, c] = self.corners[hit.facet as usize];
        let point = a + (b - a) * hit.u + (c - a) * hit.v;
        Some((if hit.front { normal } else { -normal }, point))
    }

    /// One look along a ray: its whole chain of mirrors, with a walk from each diffuse facet of it.
    /// Returns whether the ray meets the object.
    pub fn look(&self, path: &mut Path, mut ray: Ray, first: [f64; 2]) -> bool {
        let mut weight = UNIT;
        // ideal mirrors since the last lobe; none so far: the disc is in sight
        let mut mirrors = None;
        for depth in 0.. {
            path.rays += 1;
            let Some(hit) = self.bvh.closest(&ray) else {
                self.see_background(path, ray.direction, mirrors, &weight);
                return depth > 0;
            };
            let Some((normal, point)) = self.side(&hit) else { return true };
            let at = (point, normal, hit.facet);
            let surface = &self.surfaces[hit.facet as usize];
            let set = 8 * depth + 1;
            self.own_light(path, at, ray.direction, &weight, set);
            let [u, v, s, t] = if depth == 0 && surface.gloss.is_none() {
                [first[0], first[1], 0.0, 0.0]
            } else {
                path.four(set + 1)
            };
            let scattered = product(&weight, &surface.diffuse);
            let chance = (largest(&scattered) / SPLIT).min(1.0);
            if chance > 0.0 && (chance == 1.0 || path.rng.unit() < chance) {
                let scattered = scattered.map(|w| w / chance);
                self.walk(
                    path,
                    leave(point, normal, hit.facet, cosine_direction(normal, u, v)),
                    scattered,
                    set + 2,
                );
            }
            weight = product(&weight, &surface.specular);
            let chance = (largest(&weight) / FAINT_CHAIN).min(1.0);
            if chance == 0.0 || (chance < 1.0 && path.rng.unit() >= chance) {
                return true;
            }
            weight = weight.map(|w| w / chance);
            let Some(next) = self.mirrored(at, ray.direction, [s, t]) else { return true };
            mirrors = if surface.gloss.is_some() { Some(0) } else { mirrors.map(|m| m + 1) };
            ray = next;
        }
        true
    }

    /// A walk that takes the diffuse or the mirrored way at every facet, by their shares.
    pub fn walk(&self, path: &mut Path, mut ray: Ray, mut weight: Spectrum, mut set: u32) {
        let faint = FAINT_WALK * largest(&weight);
        let mut mirrors = 0;
        loop {
            path.rays += 1;
            let Some(hit) = self.bvh.closest(&ray) else {
                return self.see_background(path, ray.direction, Some(mirrors), &weight);
            };
            let Some((normal, point)) = self.side(&hit) else { return };
            let at = (point, normal, hit.facet);
            let surface = &self.surfaces[hit.facet as usize];
            self.own_light(path, at, ray.direction, &weight, set);
            let diffuse = product(&weight, &surface.diffuse);
            let specular = product(&weight, &surface.specular);
            let both = largest(&diffuse) + largest(&specular);
            if both == 0.0 {
                return;
            }
            let [u, v, s, t] = path.four(set + 1);
            let share = largest(&diffuse) / both;
            if s < share {
                weight = diffuse.map(|w| w / share);
                ray = leave(point, normal, hit.facet, cosine_direction(normal, u, v));
                mirrors = 0;
            } else {
                weight = specular.map(|w| w / (1.0 - share));
                let Some(next) = self.mirrored(at, ray.direction, [u, v]) else { return };
                ray = next;
                mirrors = if surface.gloss.is_some() { 0 } else { mirrors + 1 };
            }
            let chance = (largest(&weight) / faint).min(1.0);
            if chance < 1.0 && t >= chance {
                return;
            }
            weight = weight.map(|w| w / chance);
            set += 2;
        }
    }

    /// The ray that goes on from a mirror or lobe; `None` where the lobe's ray would enter the facet and is lost.
    fn mirrored(
        &self,
        (point, normal, facet): (DVec3, DVec3, u32),
        travelling: DVec3,
        [u, v]: [f64; 2],
    ) -> Option<Ray> {
        let mirror = reflect(travelling, normal);
        let direction = match self.surfaces[facet as usize].gloss {
            Some(ratio) => lobe_sample(ratio, mirror, u, v),
            None => mirror,
        };
        (direction.dot(normal) > 0.0).then(|| leave(point, normal, facet, direction))
    }

    /// Sky, and the sun's disc where the ray comes from the eye by ideal mirrors alone or carries what
    /// [`Judge::sunlight`] leaves out.
    fn see_background(&self, path: &mut Path, direction: DVec3, mirrors: Option<u32>, weight: &Spectrum) {
        if let Some(sky) = &self.sky {
            path.add(weight, &super::spectrum(&sky.radiance(direction)), 1.0);
        }
        if let Some(sun) = &self.sun
            && sun.half_angle > 0.0
            && mirrors.is_none_or(|m| self.mirrors.leave_to_rays(m))
        {
            path.add(weight, &super::spectrum(&sun.disc(direction)), 1.0);
        }
    }

    /// What a facet sends back along a ray by itself and from the sun: emission, rho_d E cos/pi, rho_0 E q.
    fn own_light(
        &self,
        path: &mut Path,
        at: (DVec3, DVec3, u32),
        travelling: DVec3,
        weight: &Spectrum,
        set: u32,
    ) {
        let surface = &self.surfaces[at.2 as usize];
        path.add(weight, &surface.emission, 1.0);
        let Some(sun) = &self.sun else { return };
        if surface.gloss.is_none() && largest(&surface.diffuse) == 0.0 {
            return;
        }
        let mirror = reflect(travelling, at.1);
        self.sunlit(path, sun, at, set, |path, direction, e| {
            path.add(weight, &product(e, &surface.diffuse), direction.dot(at.1) * FRAC_1_PI);
            if let Some(ratio) = surface.gloss {
                path.add(weight, &product(e, &surface.specular), lobe(ratio, direction.dot(mirror)));
            }
        });
    }

    /// Calls `each` with the directions from which sunlight arrives and its irradiance on a plane that faces it.
    fn sunlit(
        &self,
        path: &mut Path,
        sun: &crate::support::twin::Sun,
        at: (DVec3, DVec3, u32),
        set: u32,
        mut each: impl FnMut(&mut Path, DVec3, &Spectrum),
    ) {
        let [u, v, ..] = if sun.half_angle > 0.0 { path.four(set) } else { [0.0; 4] };
        let (toward, factor) = sun.sample(u, v);
        let irradiance = super::spectrum(&sun.irradiance).map(|e| e * factor);
        self.sunlight(path, at, toward, |path, direction, share| {
            each(path, direction, &product(&irradiance, share))
        });
    }

    /// One sample of the irradiance at a point of a facet's side, given its direction's numbers.
    pub fn receive(&self, path: &mut Path, at: (DVec3, DVec3, u32), [u, v]: [f64; 2]) {
        let (point, normal, facet) = at;
        if let Some(sun) = &self.sun {
            self.sunlit(path, sun, at, 1, |path, direction, e| path.add(&UNIT, e, direction.dot(normal)));
        }
        self.walk(path, leave(point, normal, facet, cosine_direction(normal, u, v)), [PI; 3], 2);
    }
}
