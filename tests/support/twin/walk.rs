//! Random walks of unlimited length: the radiance equation (eq. 1) with nothing left out.

use super::scene::{Hit, LONGEST_CHAIN, Meeting, Scene};
use super::{Estimate, Kronecker, Ray, Rng, cosine_direction, estimate, lobe, lobe_sample, reflect};
use glam::DVec3;
use std::f64::consts::PI;

/// Mirrors seen from the eye whose diffuse light is sampled by a low-discrepancy sequence of its own.
const SEQUENCES: usize = 8;

/// How much work an estimate is worth.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Walks per randomisation.
    pub rays: usize,
    /// Independent randomisations, at least 2; their spread is the standard error.
    pub randomisations: usize,
    /// Of the random numbers. Equal seeds give errors that go together: vary it from pixel to pixel.
    pub seed: u64,
    /// A walk ends where its throughput falls below this in all bands: it loses at most this times the largest
    /// radiance. A look from the eye starts one walk per diffuse facet of its chain of mirrors.
    pub threshold: f64,
}

impl Effort {
    /// `rays` walks in each of 32 randomisations, throughput to 1e-7.
    pub fn rays(rays: usize) -> Effort {
        Effort { rays, randomisations: 32, seed: 1, threshold: 1e-7 }
    }
}

/// Radiance that arrives at `origin` from the direction in which one looks (any length), per band: the background
/// (with the sun's disc where it has one), or what the first facet sends back.
pub fn radiance(scene: &Scene, origin: DVec3, direction: DVec3, effort: Effort) -> Estimate {
    let ray = Ray { origin, direction: direction.normalize(), leaving: None };
    estimate(effort.randomisations, effort.seed, |mut rng| {
        let sequences: Vec<Kronecker<2>> = (0..SEQUENCES).map(|_| Kronecker::new(&mut rng)).collect();
        let mut walk = Walk { scene, threshold: effort.threshold, rng, sum: vec![0.0; scene.bands] };
        for index in 0..effort.rays {
            walk.look(ray, index, &sequences);
        }
        walk.mean(effort.rays)
    })
}

/// Mean irradiance (not divided by pi) on a facet's front or back, per band: direct, bounced, by way of mirrors.
pub fn facet_irradiance(scene: &Scene, facet: usize, front: bool, effort: Effort) -> Estimate {
    let normal = if front { scene.normals[facet] } else { -scene.normals[facet] };
    estimate(effort.randomisations, effort.seed, |mut rng| {
        let sequence: Kronecker<4> = Kronecker::new(&mut rng);
        let mut walk = Walk { scene, threshold: effort.threshold, rng, sum: vec![0.0; scene.bands] };
        for index in (0..effort.rays).filter(|_| scene.areas[facet] > 0.0) {
            let [a, b, c, d] = sequence.point(index);
            let (origin, leaving) = (scene.point_on(facet, a, b), Some(facet as u32));
            for (toward, irradiance) in walk.sunlight(origin, facet as u32) {
                let cosine = toward.dot(normal).max(0.0);
                walk.add(&irradiance, |_| cosine);
            }
            walk.walk(
                Ray { origin, direction: cosine_direction(normal, c, d), leaving },
                vec![PI; scene.bands],
            );
        }
        walk.mean(effort.rays)
    })
}

struct Walk<'a> {
    scene: &'a Scene,
    threshold: f64,
    rng: Rng,
    sum: Vec<f64>,
}

impl Walk<'_> {
    fn mean(self, rays: usize) -> Vec<f64> {
        self.sum.iter().map(|s| s / rays as f64).collect()
    }

    /// Adds `weight` times a factor per band.
    fn add(&mut self, weight: &[f64], factor: impl Fn(usize) -> f64) {
        self.sum.iter_mut().zip(weight).enumerate().for_each(|(b, (s, w))| *s += w * factor(b));
    }

    fn sunlight(&mut self, point: DVec3, facet: u32) -> Vec<(DVec3, Vec<f64>)> {
        let (u, v) = (self.rng.unit(), self.rng.unit());
        self.scene.sunlight(point, facet, u, v)
    }

    /// One look from the eye: the whole chain of mirrors, with a diffuse walk from each of its facets.
    fn look(&mut self, mut ray: Ray, index: usize, sequences: &[Kronecker<2>]) {
        let mut weight = vec![1.0; self.scene.bands];
        // rays of a lobe never see the disc: the lobe is evaluated there
        let mut sees_disc = true;
        for depth in 0..LONGEST_CHAIN {
            let hit = match self.scene.meet(&ray) {
                Meeting::Sky => {
                    let background = self.scene.background(ray.direction, sees_disc);
                    return self.add(&weight, |b| background[b]);
                }
                Meeting::Back => return,
                Meeting::Side(hit) => hit,
            };
            self.own_light(&hit, ray.direction, &weight);
            let scattered = product(&weight, &hit.material.diffuse);
            if largest(&scattered) > 0.0 {
                let next = match sequences.get(depth) {
                    Some(sequence) => sequence.point(index),
                    None => [self.rng.unit(), self.rng.unit()],
                };
                let direction = cosine_direction(hit.normal, next[0], next[1]);
                self.walk(Ray { origin: hit.point, direction, leaving: Some(hit.facet) }, scattered);
            }
            weight = product(&weight, &hit.material.specular);
            sees_disc &= hit.material.axis_ratio().is_none();
            if largest(&weight) < self.threshold {
                return;
            }
            let Some(next) = mirrored(&hit, ray.direction, &mut self.rng) else { return };
            ray = next;
        }
    }

    /// A walk that takes one of the diffuse and the mirrored way at every facet, by their shares.
    fn walk(&mut self, mut ray: Ray, mut weight: Vec<f64>) {
        while largest(&weight) >= self.threshold {
            let hit = match self.scene.meet(&ray) {
                Meeting::Sky => {
                    let background = self.scene.background(ray.direction, false);
                    return self.add(&weight, |b| background[b]);
                }
                Meeting::Back => return,
                Meeting::Side(hit) => hit,
            };
            self.own_light(&hit, ray.direction, &weight);
            let diffuse = product(&weight, &hit.material.diffuse);
            let specular = product(&weight, &hit.material.specular);
            let share = largest(&diffuse) / (largest(&diffuse) + largest(&specular));
            if self.rng.unit() < share {
                weight = diffuse.iter().map(|w| w / share).collect();
                let direction = cosine_direction(hit.normal, self.rng.unit(), self.rng.unit());
                ray = Ray { origin: hit.point, direction, leaving: Some(hit.facet) };
            } else {
                weight = specular.iter().map(|w| w / (1.0 - share)).collect();
                let Some(next) = mirrored(&hit, ray.direction, &mut self.rng) else { return };
                ray = next;
            }
        }
    }

    /// What a facet sends back along a ray by itself and from the sun: emission, rho_d E cos/pi, rho_0 E q.
    fn own_light(&mut self, hit: &Hit, travelling: DVec3, weight: &[f64]) {
        let material = hit.material;
        self.add(weight, |b| material.emission[b]);
        if self.scene.sun.is_none() {
            return;
        }
        let mirror = reflect(travelling, hit.normal);
        for (toward, irradiance) in self.sunlight(hit.point, hit.facet) {
            let cosine = toward.dot(hit.normal);
            if cosine > 0.0 {
                let gloss = material.axis_ratio().map_or(0.0, |ratio| lobe(ratio, toward.dot(mirror)));
                let share = |b: usize| material.diffuse[b] * cosine / PI + material.specular[b] * gloss;
                self.add(weight, |b| irradiance[b] * share(b));
            }
        }
    }
}

/// The ray that goes on from a mirror or lobe; `None` where the lobe's ray would enter the facet and is lost.
pub fn mirrored(hit: &Hit, travelling: DVec3, rng: &mut Rng) -> Option<Ray> {
    let mirror = reflect(travelling, hit.normal);
    let direction = match hit.material.axis_ratio() {
        Some(ratio) => lobe_sample(ratio, mirror, rng.unit(), rng.unit()),
        None => mirror,
    };
    let ray = Ray { origin: hit.point, direction, leaving: Some(hit.facet) };
    (direction.dot(hit.normal) > 0.0).then_some(ray)
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

fn largest(a: &[f64]) -> f64 {
    a.iter().copied().fold(0.0, f64::max)
}
