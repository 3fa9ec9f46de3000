//! Elements: facets cut into S^2 congruent triangles, on each of which diffuse light varies linearly.
//!
//! The cut depends on geometry, materials and tolerance, never on the light. An unknown of the linear system
//! is one side of one element: unknown = element * sides + side.

use crate::arena::{Arena, Need};
use crate::error::Error;
use crate::math::{Vec3, sqrt};
use crate::scene::Scene;

/// The finest cut of one facet: 64^2 elements.
pub const MAX_DIVISIONS: u32 = 64;

/// Which elements each facet has.
#[derive(Clone, Copy, Debug)]
pub struct Elements<'m> {
    first: &'m [u32],
    divisions: &'m [u32],
    facet: &'m [u32],
    roughness: &'m [f32],
    sides: usize,
    memory: usize,
}

/// A point on an element: its local coordinates, each the barycentric weight of a corner less 1/3.
pub type Local = (f64, f64);

impl<'m> Elements<'m> {
    /// Bytes for facets cut as `divisions` says.
    pub fn bytes(divisions: &[u32]) -> Result<usize, Error> {
        let elements = count(divisions)?;
        let facets = divisions.len();
        Need::new().and::<u32>(facets + 1).and::<u32>(facets).and::<u32>(elements).and::<f32>(facets).bytes()
    }

    /// Cuts each facet's edges into `divisions` parts (1 to [`MAX_DIVISIONS`]; degenerate facets: 1).
    ///
    /// `unevenness` is what [`crate::subdivide::probe`] found, by facet; empty: nothing is known of it.
    pub fn new(
        scene: &Scene<'_>,
        divisions: &[u32],
        unevenness: &[f64],
        memory: &'m mut [u8],
    ) -> Result<Elements<'m>, Error> {
        if divisions.len() != scene.facets() {
            let (expected, given) = (scene.facets(), divisions.len());
            return Err(Error::Length { what: "divisions", expected, given });
        }
        let needed = Elements::bytes(divisions)?;
        let elements = count(divisions)?;
        let mut arena = Arena::new(memory, needed)?;
        let first = arena.take::<u32>(divisions.len() + 1)?;
        let kept = arena.take::<u32>(divisions.len())?;
        let facet = arena.take::<u32>(elements)?;
        let roughness = arena.take::<f32>(divisions.len())?;
        for ((r, &v), &s) in roughness.iter_mut().zip(unevenness).zip(divisions) {
            *r = sqrt((v / f64::from(s.max(1))).max(0.0)) as f32;
        }
        let mut at = 0;
        for (f, &s) in divisions.iter().enumerate() {
            let s = s.clamp(1, MAX_DIVISIONS);
            first[f] = at as u32;
            kept[f] = s;
            facet[at..at + (s * s) as usize].fill(f as u32);
            at += (s * s) as usize;
        }
        first[divisions.len()] = at as u32;
        Ok(Elements { first, divisions: kept, facet, roughness, sides: scene.sides(), memory: needed })
    }

    /// Number of elements.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.facet.len()
    }

    /// Number of unknowns: elements times sides.
    #[inline(always)]
    pub fn unknowns(&self) -> usize {
        self.facet.len() * self.sides
    }

    /// Facet and side of an unknown.
    #[inline(always)]
    pub fn facet_of(&self, unknown: usize) -> (usize, usize) {
        (self.facet[unknown / self.sides] as usize, unknown % self.sides)
    }

    /// The unknowns of one side of a facet.
    pub fn unknowns_of(&self, facet: usize, side: usize) -> impl Iterator<Item = usize> + use<> {
        let sides = self.sides;
        (self.first[facet] as usize..self.first[facet + 1] as usize).map(move |e| e * sides + side)
    }

    /// Share of its facet's area that each of a facet's elements has.
    #[inline(always)]
    pub fn share(&self, facet: usize) -> f64 {
        let s = f64::from(self.divisions[facet]);
        1.0 / (s * s)
    }

    /// The unknown at the point of barycentric weights (u, v) of a facet's side, and the point on its element.
    #[inline(always)]
    pub fn locate(&self, facet: usize, side: usize, u: f64, v: f64) -> (usize, Local) {
        let s = self.divisions[facet];
        let first = self.first[facet] as usize;
        if s == 1 {
            return (first * self.sides + side, (u - 1.0 / 3.0, v - 1.0 / 3.0));
        }
        let n = f64::from(s);
        let cell = |x: f64, end: u32| ((x * n) as u32).min(end); // the cast saturates at 0
        let i = cell(u, s - 1);
        let j = cell(v, s - 1 - i);
        let (a, b) = (u * n - f64::from(i), v * n - f64::from(j));
        let upper = a + b > 1.0 && i + j + 1 < s;
        let element = first + (i * (2 * s - i) + 2 * j) as usize + usize::from(upper);
        let (a, b) = if upper { (1.0 - a, 1.0 - b) } else { (a, b) };
        (element * self.sides + side, (a - 1.0 / 3.0, b - 1.0 / 3.0))
    }

    /// Barycentric weights in the facet of the point (a, b) (weights of corners 1 and 2) of an element.
    #[inline(always)]
    pub fn in_facet(&self, element: usize, a: f64, b: f64) -> (f64, f64) {
        let facet = self.facet[element] as usize;
        let s = self.divisions[facet];
        let mut rest = element as u32 - self.first[facet];
        let mut i = 0;
        while rest >= 2 * (s - i) - 1 {
            rest -= 2 * (s - i) - 1;
            i += 1;
        }
        let (j, upper) = (rest / 2, rest % 2 == 1);
        let n = f64::from(s);
        if upper {
            ((f64::from(i + 1) - a) / n, (f64::from(j + 1) - b) / n)
        } else {
            ((f64::from(i) + a) / n, (f64::from(j) + b) / n)
        }
    }

    /// How far the blocked share of the hemisphere departs from linear functions over a facet's elements, rms.
    #[inline(always)]
    pub fn roughness(&self, facet: usize) -> f64 {
        f64::from(self.roughness[facet])
    }

    /// Corners of an element in scene coordinates, wound as its facet.
    pub fn corners(&self, scene: &Scene<'_>, element: usize) -> [Vec3; 3] {
        let triangle = &scene.corners()[self.facet[element] as usize];
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(a, b)| {
            let (u, v) = self.in_facet(element, a, b);
            point(triangle, u, v)
        })
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.memory
    }
}

fn count(divisions: &[u32]) -> Result<usize, Error> {
    // two sides and the flag bit of a coupling record must fit into 32 bits
    let limit = 1usize << 29;
    let elements = divisions.iter().try_fold(0usize, |sum, &s| {
        let s = s.clamp(1, MAX_DIVISIONS) as usize;
        sum.checked_add(s * s).filter(|&sum| sum <= limit)
    });
    elements.ok_or(Error::TooMany { what: "elements", limit })
}

/// The point of barycentric weights `u`, `v` (corners 1 and 2) of a triangle.
#[inline(always)]
pub fn point(triangle: &[Vec3; 3], u: f64, v: f64) -> Vec3 {
    let [a, b, c] = *triangle;
    a + (b - a) * u + (c - a) * v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MaterialInput, SceneInput};

    #[test]
    fn locate_and_in_facet_are_inverse_and_cover_the_facet() {
        let material = MaterialInput { diffuse: &[0.5], specular: &[0.0], emission: &[0.0], gloss: None };
        let input = SceneInput {
            vertices: &[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 2.0, 1.0]],
            facets: &[[0, 1, 2], [0, 2, 1]],
            facet_materials: &[],
            normals: &[],
            facet_normals: &[],
            materials: &[material],
            two_sided: true,
            bands: 1,
        };
        let mut memory = [0u8; 4096];
        let scene = Scene::new(&input, &mut memory).unwrap();
        for s in [1, 2, 5, 64] {
            let mut memory = [0u8; 32768 + 4096];
            let elements = Elements::new(&scene, &[s, 1], &[], &mut memory).unwrap();
            assert_eq!(elements.count(), (s * s + 1) as usize);
            let mut area = 0.0;
            for e in 0..(s * s) as usize {
                for (a, b) in [(0.2, 0.3), (0.7, 0.1), (0.05, 0.9)] {
                    let (u, v) = elements.in_facet(e, a, b);
                    let (unknown, (la, lb)) = elements.locate(0, 1, u, v);
                    assert_eq!(elements.facet_of(unknown), (0, 1));
                    assert_eq!(unknown, e * 2 + 1, "s {s}");
                    // rounding of u * s with s <= 64
                    assert!((la + 1.0 / 3.0 - a).abs() < 1e-12 && (lb + 1.0 / 3.0 - b).abs() < 1e-12);
                }
                let [p, q, r] = elements.corners(&scene, e);
                area += 0.5 * (q - p).cross(r - p).dot(scene.normals()[0]);
            }
            // a sum of s^2 terms rounds each time
            assert!((area - scene.areas()[0]).abs() < f64::from(s * s) * f64::EPSILON);
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (-1e-17, 1.0 + 1e-16)] {
                let (unknown, _) = elements.locate(0, 0, u, v);
                assert_eq!(elements.facet_of(unknown), (0, 0));
            }
        }
    }
}
