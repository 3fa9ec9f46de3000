//! Kholopov's lobe in the plane by recursion: at each hit the part of the lobe that escapes in closed form, what
//! meets a body by a Gauss rule in the lobe's own energy. Light is reflected a given number of times at most.

use super::scene::{Scene, V, at_angle, cross, dot, reflect};
use super::{gauss, graded};

/// q/rho_0 at an angle alpha to the mirror direction.
pub fn lobe(ratio: f64, alpha: f64) -> f64 {
    let k = (ratio * ratio - 1.0).sqrt();
    let (s, c) = alpha.sin_cos();
    if c <= 0.0 { 0.0 } else { k / (2.0 * k.atan()) * c / (c * c + ratio * ratio * s * s) }
}

/// Energy of the lobe below an angle alpha, 0 to 1.
fn energy(ratio: f64, alpha: f64) -> f64 {
    let k = (ratio * ratio - 1.0).sqrt();
    let half_pi = std::f64::consts::FRAC_PI_2;
    0.5 + 0.5 * (k * alpha.clamp(-half_pi, half_pi).sin()).atan() / k.atan()
}

/// The angle below which the lobe holds `energy`.
fn angle(ratio: f64, energy: f64) -> f64 {
    let k = (ratio * ratio - 1.0).sqrt();
    (((2.0 * energy - 1.0) * k.atan()).tan() / k).clamp(-1.0, 1.0).asin()
}

/// A point sun: direction toward it and normal irradiance.
pub type Sun = (V, f64);

/// Scene, uniform sky, sun, and how finely lobes are integrated.
pub struct Gloss<'a> {
    scene: &'a Scene,
    sky: f64,
    sun: Option<Sun>,
    /// The rule for what a hit at the first, second, ... bounce of a path sees.
    rules: Vec<Vec<(f64, f64)>>,
    /// Diffuse radiance by 1, 2, ... reflections at most: surface, panel, node.
    levels: Vec<Vec<Vec<f64>>>,
    panels: usize,
    nodes: Vec<(f64, f64)>,
}

/// Gauss points of a panel of diffuse radiance.
const ORDER: usize = 5;

impl<'a> Gloss<'a> {
    /// Prepares images of light reflected at most `bounces` times. `points`: of the rules at the first, second,
    /// ... bounce; the last serves the rest. `panels`: of each surface's diffuse radiance, on circles.
    pub fn new(
        scene: &'a Scene,
        (sky, sun): (f64, Option<Sun>),
        bounces: usize,
        points: &[usize],
        panels: usize,
    ) -> Gloss<'a> {
        let rules = points.iter().map(|&n| graded(n)).collect();
        let nodes = gauss(ORDER);
        let mut gloss = Gloss { scene, sky, sun, rules, levels: Vec::new(), panels, nodes };
        if scene.surfaces.iter().any(|s| s.diffuse > 0.0) {
            for bounce in 1..=bounces {
                let level = (0..scene.surfaces.len()).map(|s| gloss.level(s, bounce)).collect();
                gloss.levels.push(level);
            }
        }
        gloss
    }

    /// Diffuse radiance at all nodes of a surface by at most `bounces` reflections.
    fn level(&self, surface: usize, bounces: usize) -> Vec<f64> {
        let s = &self.scene.surfaces[surface];
        let node = |i: usize| {
            let t = ((i / ORDER) as f64 + self.nodes[i % ORDER].0) / self.panels as f64;
            let (x, n) = s.place(t);
            s.diffuse * self.half_circle(x, n, surface, bounces - 1)
        };
        (0..self.panels * ORDER).map(node).collect()
    }

    /// Mean of the radiance that arrives at a point, reflected at most `bounces` times before.
    fn half_circle(&self, x: V, n: V, skip: usize, bounces: usize) -> f64 {
        let mut sum = 0.0;
        for (a, b, seen) in self.scene.parts(x, n, skip) {
            let (a, b) = (a.sin(), b.sin());
            if seen.is_none() {
                sum += 0.5 * (b - a) * self.sky;
            } else if bounces > 0 {
                for (u, w) in &self.rules[0] {
                    let d = at_angle(n, (a + (b - a) * u).asin());
                    sum += 0.5 * (b - a) * w * self.arriving(x, d, skip, bounces, 1);
                }
            }
        }
        sum + self.sun.map_or(0.0, |(d, e)| {
            let lit = dot(d, n) > 0.0 && self.scene.first(x, d, skip).is_none();
            if lit { 0.5 * e * dot(d, n) } else { 0.0 }
        })
    }

    /// Radiance that arrives along the ray from `x`: the sky's, or what a hit sends.
    fn arriving(&self, x: V, d: V, skip: usize, bounces: usize, depth: usize) -> f64 {
        match self.scene.first(x, d, skip) {
            None => self.sky,
            Some(hit) => self.leaving(hit.point, hit.normal, hit.surface, d, bounces, depth),
        }
    }

    /// Radiance that leaves `x` against the ray `d`, reflected at most `bounces` times, this one included.
    fn leaving(&self, x: V, n: V, surface: usize, d: V, bounces: usize, depth: usize) -> f64 {
        if bounces == 0 {
            return 0.0;
        }
        let s = &self.scene.surfaces[surface];
        let mut sum = self.diffuse(surface, s.parameter(x), bounces);
        let mirror = reflect(d, n);
        let Some(ratio) = s.lobe.filter(|_| s.specular > 0.0) else {
            if s.specular > 0.0 {
                sum += s.specular * self.arriving(x, mirror, surface, bounces - 1, depth + 1);
            }
            return sum;
        };
        let tilt = cross(n, mirror).atan2(dot(n, mirror));
        let rule = &self.rules[depth.min(self.rules.len() - 1)];
        let mut glossy = 0.0;
        for (a, b, seen) in self.scene.parts(x, n, surface) {
            let (low, high) = (energy(ratio, a - tilt), energy(ratio, b - tilt));
            if seen.is_none() {
                glossy += (high - low) * self.sky;
            } else if bounces > 1 && high > low {
                for (u, w) in rule {
                    let alpha = angle(ratio, low + (high - low) * u);
                    let d = at_angle(mirror, alpha);
                    glossy += (high - low) * w * self.arriving(x, d, surface, bounces - 1, depth + 1);
                }
            }
        }
        if let Some((d, e)) = self.sun
            && dot(d, n) > 0.0
            && self.scene.first(x, d, surface).is_none()
        {
            glossy += e * lobe(ratio, cross(mirror, d).atan2(dot(mirror, d)));
        }
        sum + s.specular * glossy
    }

    fn diffuse(&self, surface: usize, t: f64, bounces: usize) -> f64 {
        let Some(level) = self.levels.get(bounces - 1) else { return 0.0 };
        let w = t * self.panels as f64;
        let panel = (w as usize).min(self.panels - 1);
        let x = w - panel as f64;
        let weight = |i: usize| -> f64 {
            let others = (0..ORDER).filter(|&j| j != i);
            others.map(|j| (x - self.nodes[j].0) / (self.nodes[i].0 - self.nodes[j].0)).product()
        };
        (0..ORDER).map(|i| weight(i) * level[surface][panel * ORDER + i]).sum()
    }

    /// The samples of a view of a scene that is its own mirror image in x, seen from g = 0 under a uniform sky.
    pub fn symmetric_image(&self, m: usize, bounces: usize) -> Vec<Option<f64>> {
        let mut half = self.image(0.0, m, m / 2, bounces);
        half.extend_from_within(..);
        half[m / 2..].reverse();
        half
    }

    /// The first `count` of the `m` samples of a view, `None` where the object is missed.
    pub fn image(&self, g: f64, m: usize, count: usize, bounces: usize) -> Vec<Option<f64>> {
        let ray = |(o, d): (V, V)| {
            let hit = self.scene.first(o, d, usize::MAX)?;
            Some(self.leaving(hit.point, hit.normal, hit.surface, d, bounces, 0))
        };
        self.scene.view(g, m).into_iter().take(count).map(ray).collect()
    }
}
