//! The twin's scene: triangles, materials, light, and where mirrors show the sun.

use super::super::scenes::Mesh;
use super::bvh::Bvh;
use super::light::{Sky, Sun};
use super::{Ray, reflect};
use glam::{DMat3, DVec3};

/// From this axis ratio on a lobe is an ideal mirror.
const IDEAL: f64 = 1e4;
/// Mirror hits after which a chain is given up: perfect mirrors that face each other never let go.
pub const LONGEST_CHAIN: usize = 10_000;
/// How many images of the sun are followed at most: all of them for mirrors in a few planes.
const SUN_IMAGES: usize = 1024;

/// Reflectances and emission, per band.
#[derive(Clone, Debug)]
pub struct Material {
    /// rho_d.
    pub diffuse: Vec<f64>,
    /// rho_s, or rho_0 of the lobe.
    pub specular: Vec<f64>,
    /// The facet's own diffuse radiance.
    pub emission: Vec<f64>,
    /// Axis ratio of the lobe; `None`: an ideal mirror.
    pub gloss: Option<f64>,
}

impl Material {
    /// One band, no emission, ideal mirror.
    pub fn new(diffuse: f64, specular: f64) -> Material {
        Material::spectral(&[diffuse], &[specular])
    }

    /// Several bands, no emission, ideal mirror.
    pub fn spectral(diffuse: &[f64], specular: &[f64]) -> Material {
        let emission = vec![0.0; diffuse.len()];
        Material { diffuse: diffuse.into(), specular: specular.into(), emission, gloss: None }
    }

    /// With an emission, the same in all bands.
    pub fn emitting(mut self, radiance: f64) -> Material {
        self.emission.fill(radiance);
        self
    }

    /// The lobe's axis ratio where it has one.
    pub fn axis_ratio(&self) -> Option<f64> {
        self.gloss.filter(|&ratio| ratio < IDEAL)
    }

    /// Whether it mirrors as an ideal mirror in any band.
    pub fn is_mirror(&self) -> bool {
        self.axis_ratio().is_none() && self.specular.iter().any(|&s| s > 0.0)
    }
}

/// A scene. Its materials are those that the mesh's indices name.
pub struct Scene {
    /// Number of spectral bands.
    pub bands: usize,
    /// Corner positions per facet.
    pub corners: Vec<[DVec3; 3]>,
    /// Unit normals of the fronts; zero for a degenerate facet.
    pub normals: Vec<DVec3>,
    /// Areas.
    pub areas: Vec<f64>,
    /// Material per facet.
    pub materials: Vec<Material>,
    /// The sky, if any.
    pub sky: Option<Sky>,
    /// The sun, if any.
    pub sun: Option<Sun>,
    /// Whether backs are like fronts; else they are black and opaque.
    pub two_sided: bool,
    bvh: Bvh,
    /// The linear maps of the mirror chains that can show the sun, the identity first.
    images: Vec<DMat3>,
}

/// A ray's hit on a side that has a material.
pub struct Hit<'a> {
    /// Where.
    pub point: DVec3,
    /// The facet.
    pub facet: u32,
    /// Whether its front was hit.
    pub front: bool,
    /// Unit normal of the side that was hit.
    pub normal: DVec3,
    /// Its material.
    pub material: &'a Material,
}

/// What a ray meets.
pub enum Meeting<'a> {
    /// Nothing: the sky.
    Sky,
    /// A black back.
    Back,
    /// A side with a material.
    Side(Hit<'a>),
}

impl Scene {
    /// One-sided facets in the dark; `materials[mesh.materials[f]]` is the material of facet f.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Scene {
        let corners: Vec<_> = (0..mesh.facets.len()).map(|f| mesh.corners(f)).collect();
        let normal = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).normalize_or_zero();
        Scene {
            bands: materials[0].diffuse.len(),
            normals: corners.iter().map(normal).collect(),
            areas: (0..mesh.facets.len()).map(|f| mesh.area(f)).collect(),
            materials: mesh.materials.iter().map(|&m| materials[m as usize].clone()).collect(),
            bvh: Bvh::new(corners.clone()),
            corners,
            sky: None,
            sun: None,
            two_sided: false,
            images: Vec::new(),
        }
    }

    /// The same under a sky.
    pub fn sky(mut self, sky: Sky) -> Scene {
        self.sky = Some(sky);
        self
    }

    /// The same with both sides alike.
    pub fn two_sided(mut self, two_sided: bool) -> Scene {
        self.two_sided = two_sided;
        self
    }

    /// The same in the sun. The sun by way of ideal mirrors onto lobes and diffuse facets is followed through every
    /// sequence of mirrors while their reflections make at most 1024 different maps (mirrors in a few planes: any
    /// depth), shorter sequences first.
    pub fn sun(mut self, sun: Sun) -> Scene {
        self.sun = Some(sun);
        let mut mirrors: Vec<DMat3> = Vec::new();
        for (normal, _) in self.normals.iter().zip(&self.materials).filter(|(_, m)| m.is_mirror()) {
            let columns = DMat3::IDENTITY.to_cols_array_2d().map(|axis| reflect(axis.into(), *normal));
            insert(&mut mirrors, DMat3::from_cols(columns[0], columns[1], columns[2]));
        }
        self.images = vec![DMat3::IDENTITY];
        let mut next = 0;
        while next < self.images.len() && self.images.len() < SUN_IMAGES {
            for mirror in &mirrors {
                let image = *mirror * self.images[next];
                insert(&mut self.images, image);
            }
            next += 1;
        }
        self
    }

    /// What a ray meets first.
    pub fn meet(&self, ray: &Ray) -> Meeting<'_> {
        let Some((t, facet)) = self.bvh.hit(ray) else { return Meeting::Sky };
        let (normal, material) = (self.normals[facet as usize], &self.materials[facet as usize]);
        let front = normal.dot(ray.direction) < 0.0;
        if !front && !self.two_sided {
            return Meeting::Back;
        }
        let normal = if front { normal } else { -normal };
        Meeting::Side(Hit { point: ray.origin + t * ray.direction, facet, front, normal, material })
    }

    /// Radiance of the background toward `d`, per band: the sky's and, where asked, the sun's disc.
    pub fn background(&self, d: DVec3, sees_disc: bool) -> Vec<f64> {
        let mut radiance = self.sky.as_ref().map_or(vec![0.0; self.bands], |sky| sky.radiance(d));
        if let Some(sun) = self.sun.as_ref().filter(|_| sees_disc) {
            radiance.iter_mut().zip(sun.disc(d)).for_each(|(r, disc)| *r += disc);
        }
        radiance
    }

    /// From where the sun's light arrives at a point of a facet: directions, straight and by way of ideal mirrors,
    /// each with the irradiance per band on a plane that faces it. (u, v) in [0, 1)^2 choose the point of its disc.
    pub fn sunlight(&self, point: DVec3, facet: u32, u: f64, v: f64) -> Vec<(DVec3, Vec<f64>)> {
        let Some(sun) = &self.sun else { return Vec::new() };
        let (toward, weight) = sun.sample(u, v);
        let mut found: Vec<(DVec3, Vec<f64>)> = Vec::new();
        for image in &self.images {
            let direction = *image * toward;
            let ray = Ray { origin: point, direction, leaving: Some(facet) };
            // maps that differ may show the sun at one place: it is one sun
            if found.iter().all(|(d, _)| d.distance(direction) > 1e-9)
                && let Some(product) = self.mirrored(ray, toward)
            {
                let irradiance = sun.irradiance.iter().zip(product).map(|(e, p)| e * p * weight);
                found.push((direction, irradiance.collect()));
            }
        }
        found
    }

    /// The product of mirror reflectances along the chain of a ray, if it ends in the sky toward `end`.
    fn mirrored(&self, mut ray: Ray, end: DVec3) -> Option<Vec<f64>> {
        let mut product = vec![1.0; self.bands];
        for _ in 0..LONGEST_CHAIN {
            match self.meet(&ray) {
                Meeting::Sky => return (ray.direction.distance(end) < 1e-9).then_some(product),
                Meeting::Side(hit) if hit.material.is_mirror() => {
                    product.iter_mut().zip(&hit.material.specular).for_each(|(p, s)| *p *= s);
                    if product.iter().all(|&p| p < 1e-9) {
                        return None;
                    }
                    let direction = reflect(ray.direction, hit.normal);
                    ray = Ray { origin: hit.point, direction, leaving: Some(hit.facet) };
                }
                _ => return None,
            }
        }
        None
    }

    /// The point of a facet for (u, v) in [0, 1)^2, uniform over its area.
    pub fn point_on(&self, facet: usize, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.corners[facet];
        let root = u.sqrt();
        a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v)
    }
}

/// Adds a map that is not yet there.
fn insert(maps: &mut Vec<DMat3>, map: DMat3) {
    if maps.iter().all(|known| !known.abs_diff_eq(map, 1e-9)) {
        maps.push(map);
    }
}
