//! The judge: images and facet irradiances by path tracing (eq. 1), fast enough to be a reference.
//!
//! Light, lobes and materials are the twin's; from the kernel it takes the search for a ray's first hit and nothing
//! else. Every value comes twice, from two independent sets of samples: [`score`] needs both to measure an error below
//! the reference's own noise, and states how well it knows it.
//!
//! Exact but for its noise, with one exception: where mirrors of many directions (more than a few planes) follow each
//! other, what a point sun throws by two of them and more is left out. Of a disc it is found by rays that meet it.
//!
//! Apart from the twin's support modules: a test takes it with `#[path = "support/judge/mod.rs"] mod judge;`.
// Each binary uses a part.
#![allow(dead_code, unused_imports)]

mod cause;
mod sampler;
mod score;
mod sunlight;
mod view;
mod walk;

pub use sampler::mix;
pub use score::{Score, score};
pub use view::{Halves, ray};

use crate::support::twin::{Material, Rng, Scene, Sky, Sun, cosine_direction};
use blik_kernel::arena::Memory;
use blik_kernel::bvh::Bvh;
use blik_kernel::ray::Ray;
use blik_kernel::simd::Isa;
use glam::DVec3;
use sampler::Sampler;
use std::f64::consts::FRAC_1_PI;
use sunlight::Mirrors;
use walk::Path;

/// One value per band, of three at most; bands that are not there are 0.
pub type Spectrum = [f64; 3];

const UNIT: Spectrum = [1.0; 3];

/// Rays start so far above their facet: scenes are some units large.
const OFFSET: f64 = 1e-10;

/// What a facet reflects and emits.
struct Surface {
    diffuse: Spectrum,
    specular: Spectrum,
    emission: Spectrum,
    /// Axis ratio of a lobe.
    gloss: Option<f64>,
    /// Whether it is an ideal mirror.
    mirror: bool,
}

impl Surface {
    fn new(material: &Material) -> Surface {
        Surface {
            diffuse: spectrum(&material.diffuse),
            specular: spectrum(&material.specular),
            emission: spectrum(&material.emission),
            gloss: material.axis_ratio().filter(|_| material.specular.iter().any(|&s| s > 0.0)),
            mirror: material.is_mirror(),
        }
    }
}

/// A scene ready for paths.
pub struct Judge<'m> {
    bands: usize,
    corners: Vec<[DVec3; 3]>,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    surfaces: Vec<Surface>,
    sky: Option<Sky>,
    sun: Option<Sun>,
    two_sided: bool,
    mirrors: Mirrors,
    bvh: Bvh<'m>,
}

impl<'m> Judge<'m> {
    /// The judge of the twin's scene, of at most three bands and some units large; `memory` holds its tree.
    pub fn new(scene: &Scene, memory: &'m mut Memory) -> Judge<'m> {
        *memory = Memory::new(Bvh::bytes(scene.corners.len()).expect("facets"));
        let bvh =
            Bvh::build_obvhs(&scene.corners, &scene.areas, Isa::detect(), memory.bytes_mut()).expect("tree");
        let mirrors: Vec<_> = (0..scene.corners.len())
            .filter(|&f| scene.materials[f].is_mirror() && scene.areas[f] > 0.0)
            .map(|f| (f as u32, scene.corners[f], scene.normals[f]))
            .collect();
        Judge {
            bands: scene.bands,
            corners: scene.corners.clone(),
            normals: scene.normals.clone(),
            areas: scene.areas.clone(),
            surfaces: scene.materials.iter().map(Surface::new).collect(),
            sky: scene.sky.clone(),
            sun: scene.sun.clone(),
            two_sided: scene.two_sided,
            mirrors: Mirrors::new(&mirrors),
            bvh,
        }
    }

    /// The reference radiance per band: max(E_up, E_down)/pi + E_sun/pi; in the dark the largest emission.
    pub fn reference(&self) -> Vec<f64> {
        const DIRECTIONS: u32 = 1 << 14;
        let mut sides = [[0.0; 3]; 2];
        if let Some(sky) = &self.sky {
            let up = sky.up.normalize();
            for index in 0..DIRECTIONS {
                let [u, v, ..] = Sampler { seed: 1, index }.four(0);
                for (side, normal) in sides.iter_mut().zip([up, -up]) {
                    let radiance = spectrum(&sky.radiance(cosine_direction(normal, u, v)));
                    side.iter_mut().zip(radiance).for_each(|(s, l)| *s += l / f64::from(DIRECTIONS));
                }
            }
        }
        let sun = self.sun.as_ref().map_or([0.0; 3], |s| spectrum(&s.irradiance).map(|e| e * FRAC_1_PI));
        let dark = self.sky.is_none() && self.sun.is_none();
        let emission = |band: usize| self.surfaces.iter().map(|s| s.emission[band]).fold(0.0, f64::max);
        (0..self.bands)
            .map(|b| if dark { emission(b) } else { sides[0][b].max(sides[1][b]) + sun[b] })
            .collect()
    }

    /// Whether the sun is followed through mirrors of any number and order: they lie in a few planes.
    pub fn follows_all_mirrors(&self) -> bool {
        matches!(self.mirrors, Mirrors::Maps(_))
    }

    /// Mean irradiance (not divided by pi) on the sides `(facet, front)`, each from twice `samples` (at most 65,536)
    /// paths: the halves, (side, band).
    pub fn irradiances(&self, sides: &[(usize, bool)], samples: u32, seed: u32) -> [Vec<f64>; 2] {
        let mut sums = vec![[[0.0; 3]; 2]; sides.len()];
        view::in_parallel(&mut sums, 1, |index, sum| {
            let (facet, front) = sides[index];
            let normal = if front { self.normals[facet] } else { -self.normals[facet] };
            for (half, sum) in sum[0].iter_mut().enumerate() {
                let seed = mix(mix(seed, index as u32), half as u32);
                for index in 0..samples {
                    let mut path = path(Sampler { seed, index });
                    let [u, v, s, t] = path.sampler.four(0);
                    let ([a, b, c], root) = (self.corners[facet], u.sqrt());
                    let point = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
                    self.receive(&mut path, (point, normal, facet as u32), [s, t]);
                    sum.iter_mut().zip(path.sum).for_each(|(s, x)| *s += x / f64::from(samples));
                }
            }
        });
        [0, 1].map(|half| sums.iter().flat_map(|s| s[half][..self.bands].to_vec()).collect())
    }
}

/// A path that has not begun.
fn path(sampler: Sampler) -> Path {
    Path { sampler, rng: Rng(u64::from(mix(sampler.seed, sampler.index)) << 16), sum: [0.0; 3], rays: 0 }
}

/// The ray that leaves a point of a facet on the side of `normal`.
fn leave(point: DVec3, normal: DVec3, facet: u32, direction: DVec3) -> Ray {
    Ray { skip: facet, ..Ray::new(point + normal * OFFSET, direction) }
}

fn spectrum(values: &[f64]) -> Spectrum {
    std::array::from_fn(|band| values.get(band).copied().unwrap_or(0.0))
}

fn product(a: &Spectrum, b: &Spectrum) -> Spectrum {
    std::array::from_fn(|band| a[band] * b[band])
}

fn largest(a: &Spectrum) -> f64 {
    a[0].max(a[1]).max(a[2])
}
