//! Two infinite glossy cylinders: the truth by path tracing on the true surfaces, and a finely faceted mesh of them
//! for the kernel.
//!
//! The setting of the study of lobes in three dimensions: axes along z, radius 1, 2.5 apart, one scan line across
//! both, seen along -y.
#![allow(dead_code)]

use crate::support::scenes::Mesh;
use crate::support::twin::{Kronecker, Rng, estimate, lobe_sample, reflect};
use glam::{DVec3, dvec2, dvec3};

/// Half the distance of the axes.
pub const HALF: f64 = 1.25;
/// Half the length of the mesh's cylinders: lobes that reach beyond it from the middle hold less than 1e-4.
const LENGTH: f64 = 60.0;

/// Where the rays of the scan line start that meet a cylinder: all run along -y, through the centres of `count` cells.
pub fn samples(count: usize) -> impl Iterator<Item = DVec3> {
    let width = 2.0 * (HALF + 1.0);
    let x = move |i: usize| -0.5 * width + width * (i as f64 + 0.5) / count as f64;
    // those between the cylinders meet nothing
    (0..count).map(x).filter(|x| (x.abs() - HALF).abs() < 1.0).map(|x| dvec3(x, 3.0, 0.0))
}

/// The first cylinder that a ray meets: point, normal and the axis' abscissa. It cannot meet the one that it is
/// `leaving`, which is convex.
pub fn hit(origin: DVec3, direction: DVec3, leaving: Option<f64>) -> Option<(DVec3, DVec3, f64)> {
    let mut best: Option<(f64, f64)> = None;
    for centre in [-HALF, HALF].into_iter().filter(|c| Some(*c) != leaving) {
        let (p, d) = (origin.truncate() - dvec2(centre, 0.0), direction.truncate());
        let (a, b, c) = (d.dot(d), p.dot(d), p.dot(p) - 1.0);
        let root = b * b - a * c;
        if root > 0.0 && b < 0.0 {
            let t = (-b - root.sqrt()) / a;
            best = best.filter(|known| known.0 < t).or(Some((t, centre)));
        }
    }
    let (t, centre) = best?;
    let point = origin + direction * t;
    let normal = (point - dvec3(centre, 0.0, point.z)).normalize();
    Some((point, normal, centre))
}

/// True where the mirror chain of a sample meets the other cylinder.
pub fn coupled(origin: DVec3) -> bool {
    let (point, normal, centre) = hit(origin, -DVec3::Y, None).expect("a sample of the object");
    hit(point, reflect(-DVec3::Y, normal), Some(centre)).is_some()
}

/// Radiance of a sample under a uniform sky of 1 and its standard error, by 8 randomisations of `rays` paths each. The
/// first three lobes' directions come from a low-discrepancy sequence, later ones at random; rays below the horizon
/// are lost.
pub fn truth(origin: DVec3, rho: f64, ratio: f64, rays: usize, seed: u64) -> (f64, f64) {
    let found = estimate(8, seed, |mut rng: Rng| {
        let sequence: Kronecker<6> = Kronecker::new(&mut rng);
        let sum: f64 = (0..rays).map(|i| path(origin, rho, ratio, &sequence.point(i), &mut rng)).sum();
        vec![sum / rays as f64]
    });
    (found.mean[0], found.standard_error[0])
}

fn path(mut origin: DVec3, rho: f64, ratio: f64, first: &[f64; 6], rng: &mut Rng) -> f64 {
    let (mut direction, mut through, mut leaving) = (-DVec3::Y, 1.0, None);
    // 0.8^80 is 2e-8
    for depth in 0..80 {
        let Some((point, normal, centre)) = hit(origin, direction, leaving) else { return through };
        let (u, v) = match first.get(2 * depth..2 * depth + 2) {
            Some(pair) => (pair[0], pair[1]),
            None => (rng.unit(), rng.unit()),
        };
        direction = lobe_sample(ratio, reflect(direction, normal), u, v);
        if direction.dot(normal) <= 0.0 {
            return 0.0;
        }
        through *= rho;
        (origin, leaving) = (point, Some(centre));
    }
    0.0
}

/// `facets` flat strips a cylinder with the cylinders' normals at their vertices.
pub fn mesh(facets: usize) -> (Mesh, Vec<[f64; 3]>) {
    let (mut mesh, mut normals) = (Mesh::default(), Vec::new());
    for centre in [-HALF, HALF] {
        let base = mesh.vertices.len() as u32;
        for k in 0..facets {
            let (s, c) = (k as f64 / facets as f64 * std::f64::consts::TAU).sin_cos();
            for z in [-LENGTH, LENGTH] {
                mesh.vertices.push([centre + c, s, z]);
                normals.push([c, s, 0.0]);
            }
            let (a, b) = (base + 2 * k as u32, base + 2 * ((k + 1) % facets) as u32);
            mesh.facets.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
            mesh.materials.extend([0, 0]);
        }
    }
    (mesh, normals)
}
