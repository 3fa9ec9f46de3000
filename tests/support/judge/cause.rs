//! What is difficult about a pixel: for sorting errors by their likely causes.

use super::sampler::Sampler;
use super::view::ray;
use super::{Judge, leave, path};
use crate::support::twin::{cosine_direction, in_frame, reflect};
use blik_kernel::camera::{CameraInput, Sampling};
use blik_kernel::ray::Hit;
use glam::{DVec3, dvec3};
use std::f64::consts::TAU;

/// Points tried around a pixel's own, and directions from each.
const AROUND: (u32, u32) = (24, 24);

/// Difficulties, hardest to see past first.
pub const CAUSES: [&str; 9] =
    ["gloss", "mirror to sky", "outline", "contact", "shadow edge", "beam", "steep", "smooth", "background"];

impl Judge<'_> {
    /// The difficulty of what a pixel shows, one of [`CAUSES`], and whether it is seen in a mirror. A facet's light is
    /// held in elements that have the share `shares[facet]` of its area.
    ///
    /// * `outline`: the pixel, a mean, has facets of several directions;
    /// * `contact`: the element reaches into or under another body;
    /// * `shadow edge`: part of the sun's disc is in sight, or from part of the pixel;
    /// * `beam`: mirrors throw the sun on part of the element;
    /// * `steep`: the open part of the sky varies by more than a tenth on the element.
    pub fn cause(&self, camera: &CameraInput, pixel: usize, shares: &[f64]) -> (&'static str, bool) {
        let (row, column) = ((pixel / camera.columns) as f64, (pixel % camera.columns) as f64);
        let mut ray_in = ray(camera, column + 0.5, row + 0.5);
        let Some(mut hit) = self.bvh.closest(&ray_in) else { return ("background", false) };
        let area = camera.sampling == Sampling::Area;
        let mut corners = Vec::new();
        for (x, y) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].into_iter().filter(|_| area) {
            let Some(other) = self.bvh.closest(&ray(camera, column + x, row + y)) else {
                return ("outline", false);
            };
            let [n, m] = [hit, other].map(|h| self.normals[h.facet as usize]);
            if n.dot(m) < 0.7 {
                return ("outline", false);
            }
            corners.extend(self.side(&other).map(|(normal, point)| (point, normal, other.facet)));
        }
        let mut mirrored = false;
        for _ in 0..8 {
            let surface = &self.surfaces[hit.facet as usize];
            let Some((normal, point)) = self.side(&hit) else { return ("smooth", mirrored) };
            if surface.gloss.is_some() {
                return ("gloss", mirrored);
            }
            // mirrors that send back more by themselves than what they show
            if !surface.mirror || super::largest(&surface.diffuse) > super::largest(&surface.specular) {
                break;
            }
            mirrored = true;
            corners.clear();
            ray_in = leave(point, normal, hit.facet, reflect(ray_in.direction, normal));
            let Some(next) = self.bvh.closest(&ray_in) else { return ("mirror to sky", true) };
            hit = next;
        }
        (self.on_facet(&hit, shares[hit.facet as usize], corners), mirrored)
    }

    /// The difficulty of the light at a point of a facet, and at others of the same pixel.
    fn on_facet(&self, hit: &Hit, share: f64, mut others: Vec<(DVec3, DVec3, u32)>) -> &'static str {
        let Some((normal, point)) = self.side(hit) else { return "smooth" };
        let at = (point, normal, hit.facet);
        let radius = (2.0 * self.areas[hit.facet as usize] * share).sqrt();
        let near: Vec<DVec3> = (0..AROUND.0)
            .map(|index| {
                let [u, v, ..] = Sampler { seed: 11, index }.four(0);
                let (r, (s, c)) = (radius * u.sqrt(), (TAU * v).sin_cos());
                point + in_frame(normal, dvec3(c, s, 0.0)) * r
            })
            .filter(|p| self.is_on(hit.facet, *p))
            .collect();
        let seen: Vec<[f64; 2]> = near.iter().map(|&p| self.open((p, normal, hit.facet))).collect();
        let spread = |values: &dyn Fn(&[f64; 2]) -> f64| {
            let all = || seen.iter().map(values);
            all().fold(0.0, f64::max) - all().fold(1.0, f64::min)
        };
        if seen.iter().any(|s| s[1] > 0.9) {
            return "contact";
        }
        if let Some(sun) = &self.sun {
            let (mut lit, mut tried, mut beams) = (0, 0, 0);
            others.push(at);
            for (point, normal, facet) in others {
                for index in 0..AROUND.1 {
                    let [u, v, ..] = Sampler { seed: 12, index }.four(0);
                    let toward = sun.sample(u, v).0;
                    if toward.dot(normal) > 0.0 {
                        tried += 1;
                        lit += u32::from(!self.bvh.occluded(&leave(point, normal, facet, toward)));
                    }
                }
            }
            if lit != 0 && lit != tried {
                return "shadow edge";
            }
            let by_mirror = |p: DVec3| {
                let mut trial = path(Sampler { seed: 13, index: 0 });
                let (toward, mut found) = (sun.sample(0.5, 0.5).0, false);
                self.sunlight(&mut trial, (p, at.1, at.2), toward, |_, d, _| {
                    found |= d.distance(toward) > 1e-9
                });
                found
            };
            beams += near.iter().filter(|&&p| by_mirror(p)).count();
            if by_mirror(point) && beams < near.len() || beams != 0 && beams != near.len() {
                return "beam";
            }
        }
        if spread(&|s| s[0]) > 0.1 { "steep" } else { "smooth" }
    }

    /// Whether a point of a facet's plane lies on the facet.
    fn is_on(&self, facet: u32, p: DVec3) -> bool {
        let corners = self.corners[facet as usize];
        let normal = self.normals[facet as usize];
        (0..3).all(|k| (corners[(k + 1) % 3] - corners[k]).cross(p - corners[k]).dot(normal) >= 0.0)
    }

    /// Shares of the rays from a point that meet nothing, and that meet black backs.
    fn open(&self, (point, normal, facet): (DVec3, DVec3, u32)) -> [f64; 2] {
        let mut shares = [0.0; 2];
        for index in 0..AROUND.1 {
            let [u, v, ..] = Sampler { seed: 14, index }.four(0);
            let ray = leave(point, normal, facet, cosine_direction(normal, u, v));
            match self.bvh.closest(&ray) {
                None => shares[0] += 1.0 / f64::from(AROUND.1),
                Some(hit) if self.side(&hit).is_none() => shares[1] += 1.0 / f64::from(AROUND.1),
                Some(_) => {}
            }
        }
        shares
    }
}
