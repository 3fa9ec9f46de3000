//! The linear system of eq. 12 with form factors counted by rays, solved by Gauss elimination.

use super::scene::{LONGEST_CHAIN, Meeting, Scene};
use super::walk::mirrored;
use super::{Kronecker, Ray, Rng, cosine_direction, lobe, reflect};
use std::f64::consts::PI;

/// A chain of mirrors ends where its product of reflectances falls below this in all bands.
const CHAIN_END: f64 = 1e-9;

/// The system I = emission + rho_d (light + factors I), one radiance per facet side.
///
/// Unknowns: facet f's front is f; with two-sided facets its back is (number of facets) + f.
#[derive(Clone, Debug)]
pub struct Dense {
    /// Number of unknowns.
    pub unknowns: usize,
    /// Number of spectral bands.
    pub bands: usize,
    /// Area per unknown.
    pub areas: Vec<f64>,
    /// rho_d, (unknowns, bands).
    pub diffuse: Vec<f64>,
    /// Emission, (unknowns, bands).
    pub emission: Vec<f64>,
    /// Form factors, straight and by way of mirrors, (receiver, source, bands).
    pub factors: Vec<f64>,
    /// Irradiance / pi from sky and sun, straight and by way of mirrors, (unknowns, bands).
    pub light: Vec<f64>,
}

impl Dense {
    /// Counts form factors with `rays` rays from every facet side, their points and directions from one randomised
    /// low-discrepancy sequence per side.
    pub fn gather(scene: &Scene, rays: usize, rng: Rng) -> Dense {
        let facets = scene.areas.len();
        let unknowns = if scene.two_sided { 2 * facets } else { facets };
        let per_band = |values: fn(&super::Material) -> &Vec<f64>| {
            (0..unknowns).flat_map(|i| values(&scene.materials[i % facets]).clone()).collect()
        };
        let mut dense = Dense {
            unknowns,
            bands: scene.bands,
            areas: (0..unknowns).map(|i| scene.areas[i % facets]).collect(),
            diffuse: per_band(|m| &m.diffuse),
            emission: per_band(|m| &m.emission),
            factors: vec![0.0; unknowns * unknowns * scene.bands],
            light: vec![0.0; unknowns * scene.bands],
        };
        for row in (0..unknowns).filter(|i| scene.areas[i % facets] > 0.0) {
            dense.gather_row(scene, row, rays, rng.child(row as u64));
        }
        dense
    }

    fn gather_row(&mut self, scene: &Scene, row: usize, rays: usize, mut rng: Rng) {
        let facet = row % scene.areas.len();
        let normal = if row == facet { scene.normals[facet] } else { -scene.normals[facet] };
        let sequence: Kronecker<4> = Kronecker::new(&mut rng);
        for index in 0..rays {
            let [a, b, c, d] = sequence.point(index);
            let origin = scene.point_on(facet, a, b);
            for (toward, irradiance) in scene.sunlight(origin, facet as u32, rng.unit(), rng.unit()) {
                let share = toward.dot(normal).max(0.0) / (PI * rays as f64);
                self.add_light(row, |band| irradiance[band] * share);
            }
            let direction = cosine_direction(normal, c, d);
            self.follow(scene, row, Ray { origin, direction, leaving: Some(facet as u32) }, rays, &mut rng);
        }
    }

    /// Counts one ray for its row at every facet of its chain, and at the sky where the chain ends.
    fn follow(&mut self, scene: &Scene, row: usize, mut ray: Ray, rays: usize, rng: &mut Rng) {
        let mut product = vec![1.0 / rays as f64; self.bands];
        for _ in 0..LONGEST_CHAIN {
            let hit = match scene.meet(&ray) {
                Meeting::Sky => {
                    let sky = scene.background(ray.direction, false);
                    return self.add_light(row, |b| product[b] * sky[b]);
                }
                Meeting::Back => return,
                Meeting::Side(hit) => hit,
            };
            let facet = hit.facet as usize;
            let source = if hit.front { facet } else { facet + scene.areas.len() };
            let start = (row * self.unknowns + source) * self.bands;
            self.factors[start..][..self.bands].iter_mut().zip(&product).for_each(|(f, p)| *f += p);
            product.iter_mut().zip(&hit.material.specular).for_each(|(p, s)| *p *= s);
            if product.iter().all(|p| p * (rays as f64) < CHAIN_END) {
                return;
            }
            if let Some(ratio) = hit.material.axis_ratio() {
                let mirror = reflect(ray.direction, hit.normal);
                for (toward, e) in scene.sunlight(hit.point, hit.facet, rng.unit(), rng.unit()) {
                    let visible = if toward.dot(hit.normal) > 0.0 { 1.0 } else { 0.0 };
                    let q = visible * lobe(ratio, toward.dot(mirror));
                    self.add_light(row, |b| product[b] * e[b] * q);
                }
            }
            let Some(next) = mirrored(&hit, ray.direction, rng) else { return };
            ray = next;
        }
    }

    fn add_light(&mut self, row: usize, value: impl Fn(usize) -> f64) {
        self.light[row * self.bands..][..self.bands].iter_mut().enumerate().for_each(|(b, l)| *l += value(b));
    }

    /// The same system with one radiance per group: `groups[i]` is the group of unknown i, groups counted from 0.
    /// Reflectances of a group are those of its last unknown; emission and rows are area means.
    pub fn grouped(&self, groups: &[usize]) -> Dense {
        let (count, bands) = (groups.iter().max().expect("no group") + 1, self.bands);
        let mut areas = vec![0.0; count];
        groups.iter().zip(&self.areas).for_each(|(&g, a)| areas[g] += a);
        let zeros = || vec![0.0; count * bands];
        let mut all = Dense {
            unknowns: count,
            bands,
            diffuse: zeros(),
            emission: zeros(),
            light: zeros(),
            factors: vec![0.0; count * count * bands],
            areas,
        };
        for (i, &gi) in groups.iter().enumerate() {
            let share = self.areas[i] / all.areas[gi];
            for b in 0..bands {
                all.diffuse[gi * bands + b] = self.diffuse[i * bands + b];
                all.emission[gi * bands + b] += share * self.emission[i * bands + b];
                all.light[gi * bands + b] += share * self.light[i * bands + b];
                for (j, &gj) in groups.iter().enumerate() {
                    let from = self.factors[(i * self.unknowns + j) * bands + b];
                    all.factors[(gi * count + gj) * bands + b] += share * from;
                }
            }
        }
        all
    }

    /// The form factor from receiver `i` to source `j` in a band.
    pub fn factor(&self, i: usize, j: usize, band: usize) -> f64 {
        self.factors[(i * self.unknowns + j) * self.bands + band]
    }

    /// Diffuse radiances, (unknowns, bands).
    pub fn radiances(&self) -> Vec<f64> {
        let n = self.unknowns;
        let mut radiances = vec![0.0; n * self.bands];
        for band in 0..self.bands {
            let at = |i: usize| i * self.bands + band;
            let entry = |i: usize, j: usize| {
                f64::from(u8::from(i == j)) - self.diffuse[at(i)] * self.factor(i, j, band)
            };
            let matrix = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
            let right =
                (0..n).map(|i| self.emission[at(i)] + self.diffuse[at(i)] * self.light[at(i)]).collect();
            solve_linear(matrix, right).into_iter().enumerate().for_each(|(i, x)| radiances[at(i)] = x);
        }
        radiances
    }

    /// Irradiances / pi, (unknowns, bands), in the light of the given diffuse radiances.
    pub fn irradiances_over_pi(&self, radiances: &[f64]) -> Vec<f64> {
        let (n, bands) = (self.unknowns, self.bands);
        let bounced = |i, b| (0..n).map(|j| self.factor(i, j, b) * radiances[j * bands + b]).sum::<f64>();
        (0..n * bands).map(|k| self.light[k] + bounced(k / bands, k % bands)).collect()
    }
}

/// Solves a dense linear system by Gauss elimination with row pivots.
pub fn solve_linear(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for k in 0..n {
        let size = |i: &usize| matrix[*i][k].abs();
        let pivot = (k..n).max_by(|i, j| size(i).total_cmp(&size(j))).unwrap_or(k);
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        let (done, rest) = matrix.split_at_mut(k + 1);
        for (i, row) in rest.iter_mut().enumerate() {
            let factor = row[k] / done[k][k];
            if factor != 0.0 {
                row[k..].iter_mut().zip(&done[k][k..]).for_each(|(x, p)| *x -= factor * p);
                right[k + 1 + i] -= factor * right[k];
            }
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| matrix[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / matrix[k][k];
    }
    right
}
