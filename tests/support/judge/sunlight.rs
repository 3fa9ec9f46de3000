//! From where the sun's light arrives at a point: straight and by way of ideal mirrors.

use super::walk::Path;
use super::{Judge, Spectrum, UNIT, largest, leave, product};
use crate::support::twin::reflect;
use glam::{DMat3, DVec3};

/// Mirrors whose reflections generate at most this many linear maps are followed through any sequence.
const MAPS: usize = 16;

/// Chains of mirrors toward the sun end where they keep less than this.
const FAINT: f64 = 1e-5;

/// The ideal mirrors of a scene, in one of two ways.
pub enum Mirrors {
    /// Few directions of mirrors: the maps of all their sequences, without the identity. Whatever way the sun comes, its
    /// direction is one of the maps'.
    Maps(Vec<DMat3>),
    /// Many directions: each facet is tried alone. What two mirrors and more throw is left to rays that meet the disc.
    Facets(Vec<Mirror>),
}

/// A flat mirror: point q of its plane lies in the facet where (q - corner).dual are the weights of corners 1 and 2.
pub struct Mirror {
    facet: u32,
    normal: DVec3,
    corner: DVec3,
    dual: [DVec3; 2],
}

impl Mirrors {
    /// The mirrors among facets given as (index, corners, unit normal).
    pub fn new(mirrors: &[(u32, [DVec3; 3], DVec3)]) -> Mirrors {
        let mut single = Vec::new();
        for (_, _, normal) in mirrors {
            insert(
                &mut single,
                DMat3::from_cols_array_2d(
                    &DMat3::IDENTITY.to_cols_array_2d().map(|axis| reflect(axis.into(), *normal).to_array()),
                ),
            );
            if single.len() >= MAPS {
                break;
            }
        }
        let mut maps = vec![DMat3::IDENTITY];
        let mut next = 0;
        while next < maps.len() && maps.len() <= MAPS {
            for mirror in &single {
                let map = *mirror * maps[next];
                insert(&mut maps, map);
            }
            next += 1;
        }
        if maps.len() <= MAPS {
            return Mirrors::Maps(maps.split_off(1));
        }
        Mirrors::Facets(
            mirrors.iter().map(|(facet, corners, normal)| Mirror::new(*facet, corners, *normal)).collect(),
        )
    }

    /// Whether rays that have met `mirrors` ideal mirrors since they left a diffuse facet or a lobe may see the disc:
    /// nothing else counts that light.
    pub fn leave_to_rays(&self, mirrors: u32) -> bool {
        matches!(self, Mirrors::Facets(_)) && mirrors >= 2
    }
}

fn insert(maps: &mut Vec<DMat3>, map: DMat3) {
    if maps.iter().all(|known| !known.abs_diff_eq(map, 1e-9)) {
        maps.push(map);
    }
}

impl Mirror {
    fn new(facet: u32, [a, b, c]: &[DVec3; 3], normal: DVec3) -> Mirror {
        let (e1, e2) = (*b - *a, *c - *a);
        let n = e1.cross(e2);
        let scale = 1.0 / n.length_squared();
        Mirror { facet, normal, corner: *a, dual: [e2.cross(n) * scale, n.cross(e1) * scale] }
    }

    /// The direction from `point` to the sun's image in this mirror, where the facet shows it.
    fn shows(&self, point: DVec3, toward: DVec3, two_sided: bool) -> Option<DVec3> {
        let lit = toward.dot(self.normal);
        let height = (point - self.corner).dot(self.normal);
        // light falls on the side on which the point lies
        if lit * height <= 0.0 || (lit < 0.0 && !two_sided) {
            return None;
        }
        let direction = toward - self.normal * (2.0 * lit);
        let q = point + direction * (height / lit) - self.corner;
        let (u, v) = (q.dot(self.dual[0]), q.dot(self.dual[1]));
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(direction)
    }
}

impl Judge<'_> {
    /// Calls `each` with every direction above `normal` from which light of the point `toward` of the sun's disc
    /// arrives at a point of a facet, and the share that mirrors leave of it.
    pub fn sunlight(
        &self,
        path: &mut Path,
        (point, normal, facet): (DVec3, DVec3, u32),
        toward: DVec3,
        mut each: impl FnMut(&mut Path, DVec3, &Spectrum),
    ) {
        if toward.dot(normal) > 0.0 {
            path.rays += 1;
            let place = (point, normal, facet);
            if !self.bvh.occluded(&leave(point, normal, facet, toward)) {
                each(path, toward, &UNIT);
            } else if matches!(self.mirrors, Mirrors::Maps(_))
                // two mirrors face to face show the sun where it stands
                && let Some(share) = self.by_mirrors(path, place, toward, toward)
            {
                each(path, toward, &share);
            }
        }
        match &self.mirrors {
            Mirrors::Maps(maps) => {
                let mut seen = [toward; MAPS + 1];
                for (k, map) in maps.iter().enumerate() {
                    let direction = *map * toward;
                    // maps that differ may show the sun at one place: it is one sun
                    let known = seen[..=k].iter().any(|d| d.distance_squared(direction) < 1e-18);
                    seen[k + 1] = direction;
                    if !known
                        && direction.dot(normal) > 0.0
                        && let Some(share) = self.by_mirrors(path, (point, normal, facet), direction, toward)
                    {
                        each(path, direction, &share);
                    }
                }
            }
            Mirrors::Facets(mirrors) => {
                for mirror in mirrors.iter().filter(|m| m.facet != facet) {
                    if let Some(direction) = mirror.shows(point, toward, self.two_sided)
                        && direction.dot(normal) > 0.0
                        && let Some(share) =
                            self.by_mirror(path, (point, normal, facet), direction, mirror, toward)
                    {
                        each(path, direction, &share);
                    }
                }
            }
        }
    }

    /// What mirrors leave of the light that comes from `direction`, if their chain ends in the sky toward `end`.
    fn by_mirrors(
        &self,
        path: &mut Path,
        (point, normal, facet): (DVec3, DVec3, u32),
        direction: DVec3,
        end: DVec3,
    ) -> Option<Spectrum> {
        let (mut ray, mut share) = (leave(point, normal, facet, direction), UNIT);
        loop {
            path.rays += 1;
            let Some(hit) = self.bvh.closest(&ray) else {
                return (ray.direction.distance_squared(end) < 1e-18).then_some(share);
            };
            let (normal, point) = self.side(&hit)?;
            let surface = &self.surfaces[hit.facet as usize];
            share = product(&share, &surface.specular);
            if !surface.mirror || largest(&share) < FAINT {
                return None;
            }
            ray = leave(point, normal, hit.facet, reflect(ray.direction, normal));
        }
    }

    /// The same by way of one mirror alone.
    fn by_mirror(
        &self,
        path: &mut Path,
        (point, normal, facet): (DVec3, DVec3, u32),
        direction: DVec3,
        mirror: &Mirror,
        toward: DVec3,
    ) -> Option<Spectrum> {
        path.rays += 2;
        let hit =
            self.bvh.closest(&leave(point, normal, facet, direction)).filter(|h| h.facet == mirror.facet)?;
        let (normal, point) = self.side(&hit)?;
        let free = !self.bvh.occluded(&leave(point, normal, hit.facet, toward));
        free.then_some(self.surfaces[hit.facet as usize].specular)
    }
}
