//! A point of a facet's side at which light is reflected: where rays from it start, its mirror direction, the rays of
//! its lobe.
//!
//! Constants of this file are measured by `cargo test --release --test stress rays -- --nocapture` (rays that leak through
//! closed meshes).

use crate::base::index::Index;
use crate::base::math::{Vec3, reflect, sqrt};
use crate::base::quarter::point;
use crate::rays::bvh::Bvh;
use crate::rays::ray::{Hit, Ray};
use crate::scene::lobe::Lobe;
use crate::scene::{NO_MIRROR, Scene};

/// Height above their facet at which rays start, in scene coordinates (the object fills [-1, 1]): some 256 times the
/// rounding error of a point on a facet, and a tenth of the smallest gap that is told from contact.
pub const OFFSET: f64 = 1.0 / (1u64 << 44) as f64;

/// Least barycentric weight below which a point may be on an edge.
const AT_EDGE: f64 = 1e-9;

/// Distance by which points on an edge are moved inward, in scene coordinates: as much farther than rays start above
/// their facet as facets that meet at a degree need.
const STEP_IN: f64 = 256.0 * OFFSET;

/// True where nothing rises above the plane of a facet's side by as much as its rays start above it.
pub fn opens_to_sky(scene: &Scene<'_>, bvh: &Bvh<'_>, facet: usize, normal: Vec3) -> bool {
    let height = scene.corners().at(facet).iter().map(|c| c.dot(normal)).fold(f64::NEG_INFINITY, f64::max);
    !bvh.rises_above(normal, height + 0.5 * OFFSET)
}

/// A point on a side of a facet that carries a material.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The facet.
    pub facet: usize,
    /// 0: front, 1: back.
    pub side: usize,
    /// Its material.
    pub material: usize,
    /// Barycentric weight of corner 1.
    pub u: f64,
    /// Barycentric weight of corner 2.
    pub v: f64,
    /// The point.
    pub point: Vec3,
    /// Unit normal of the side.
    pub normal: Vec3,
}

impl Surface {
    /// The point of barycentric weights `u`, `v` on a side of a facet.
    #[inline]
    pub fn new(scene: &Scene<'_>, facet: usize, side: usize, u: f64, v: f64) -> Surface {
        Surface {
            facet,
            side,
            material: scene.material(facet),
            u,
            v,
            point: point(&scene.corners().at(facet), u, v),
            normal: scene.side_normal(facet, side),
        }
    }

    /// The surface that a hit met; `None` where it is the black back of a one-sided facet.
    #[inline]
    pub fn of_hit(scene: &Scene<'_>, hit: &Hit) -> Option<Surface> {
        if !hit.front && scene.sides() == 1 {
            return None;
        }
        let mut surface = Surface::new(scene, hit.facet as usize, usize::from(!hit.front), hit.u, hit.v);
        if hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < AT_EDGE {
            surface.step_in(scene);
        }
        Some(surface)
    }

    /// Moves a point at the facet's edge a little toward its middle: from the edge itself, light that goes on toward the
    /// facet beyond would start in that one's plane, and slip out between the two.
    #[cold]
    fn step_in(&mut self, scene: &Scene<'_>) {
        let [a, b, c] = scene.corners().at(self.facet);
        let inward = (a + b + c) / 3.0 - self.point;
        let distance = sqrt(inward.length_squared());
        if distance > 0.0 {
            self.point += inward * (STEP_IN / distance).min(0.5);
        }
    }

    /// The ray that leaves in `direction`.
    #[inline]
    pub fn spawn_ray(&self, direction: Vec3) -> Ray {
        Ray {
            origin: self.point + self.normal * OFFSET,
            direction,
            t_max: f64::INFINITY,
            skip: self.facet as u32,
        }
    }

    /// The direction in which light comes that is mirrored against `direction` (the way the ray arrived).
    ///
    /// Interpolated normals are bent toward the facet's own where the mirror direction would go below it.
    #[inline]
    pub fn mirrored(&self, scene: &Scene<'_>, direction: Vec3) -> Vec3 {
        if !scene.is_smooth() {
            return reflect(direction, self.normal);
        }
        let normal = scene.mirror_normal(self.facet, self.side, self.u, self.v);
        let mirrored = reflect(direction, normal);
        let height = mirrored.dot(self.normal);
        // a mirror direction that grazes the facet: the least change that keeps it above
        let least = 1e-3;
        if height >= least {
            return mirrored;
        }
        let lifted = mirrored + self.normal * (least - height);
        crate::base::math::unit(lifted).unwrap_or(self.normal)
    }

    /// The mirror at this point, if its material is one.
    #[inline]
    pub fn mirror(&self, scene: &Scene<'_>) -> Option<Mirror> {
        let class = scene.mirror(self.material);
        if class == NO_MIRROR {
            return None;
        }
        Some(Mirror { class, lobe: scene.gloss(self.material).and_then(|ratio| Lobe::new(ratio).ok()) })
    }

    /// The normal of the flat ideal mirror at this point, if it is one.
    pub fn flat_mirror(&self, scene: &Scene<'_>) -> Option<Vec3> {
        let ideal = scene.mirror(self.material) != NO_MIRROR && scene.gloss(self.material).is_none();
        if ideal { scene.flat_normal(self.facet, self.side) } else { None }
    }

    /// The direction toward the light for a ray that arrived along `direction`, and the share of the class's
    /// mirror reflectance that applies: 1 for an ideal mirror, the lobe's albedo over rho_0 for a lobe, of
    /// which `u`, `v` choose the ray.
    #[inline]
    pub fn sample_reflection(
        &self,
        scene: &Scene<'_>,
        mirror: &Mirror,
        direction: Vec3,
        u: f64,
        v: f64,
    ) -> (Vec3, f64) {
        let mirrored = self.mirrored(scene, direction);
        match &mirror.lobe {
            None => (mirrored, 1.0),
            Some(lobe) => {
                let cosine = mirrored.dot(self.normal);
                (lobe.sample(mirrored, self.normal, u, v), lobe.albedo(cosine))
            }
        }
    }
}

/// Mirror reflection at a point.
#[derive(Clone, Debug)]
pub struct Mirror {
    /// Mirror class of the material.
    pub class: u32,
    /// The lobe, or an ideal mirror.
    pub lobe: Option<Lobe>,
}
