//! How finely each facet is cut: where the share of the hemisphere that is dark (blocked by facets that do
//! not shine) changes over the facet in a way that no linear function follows, such as where another facet pierces it or stands on it.
//!
//! Geometry, materials and tolerance decide, never sky and sun.

use crate::bvh::Bvh;
use crate::element::MAX_DIVISIONS;
use crate::error::Error;
use crate::index::{Index, span};
use crate::math::{Vec3, frame};
use crate::mirror::{Surface, opens_to_sky};
use crate::qmc::{Sequence, cosine_direction, hash2, triangle};
use crate::ray::Ray;
use crate::scene::Scene;
use core::ops::Range;

/// Bins along each edge of a probed facet.
const EDGE: usize = 4;
/// Bins of a facet.
const BINS: usize = EDGE * EDGE;
/// The most probing rays of a bin.
pub const MOST_RAYS: u32 = 256;
/// The variance counts from so many times the rays' noise on: half of the even facets pass the first, to be probed
/// further, and one in a thousand the second.
const SUSPECT: f64 = 1.0;
const CERTAIN: f64 = 3.0;

/// Probes each facet of `range`: how far the blocked share of the hemisphere departs from a linear function of
/// the position, as a variance less what the rays' noise explains; 0 where that is all. Returns the rays traced.
///
/// Each side is probed from 16 bins with `rays` rays each (1 to [`MOST_RAYS`]; as many as a row of the coupling has
/// serve the same error), a quarter of that where they show nothing.
pub fn probe(
    scene: &Scene<'_>,
    bvh: &Bvh<'_>,
    rays: u32,
    range: Range<usize>,
    out: &mut [f64],
) -> Result<u64, Error> {
    if out.len() != span(&range) {
        return Err(Error::Length { what: "unevenness", expected: span(&range), given: out.len() });
    }
    let shining = (0..scene.bands()).any(|band| scene.largest_emission(band) > 0.0);
    let mut probe = Probe { scene, bvh, rays: rays.clamp(1, MOST_RAYS), shining, traced: 0 };
    for (facet, value) in range.zip(out) {
        *value = 0.0;
        let dark = scene.diffuse(scene.material(facet)).iter().all(|&d| d == 0.0);
        if scene.areas().at(facet) == 0.0 || dark {
            continue;
        }
        for side in 0..scene.sides() {
            if opens_to_sky(scene, bvh, facet, scene.side_normal(facet, side)) {
                continue;
            }
            *value = f64::max(*value, probe.side(facet, side));
        }
    }
    Ok(probe.traced)
}

struct Probe<'a> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    rays: u32,
    /// Whether some facets shine by themselves.
    shining: bool,
    traced: u64,
}

impl Probe<'_> {
    /// Whether a ray brings neither light from outside nor from a facet that shines by itself.
    #[inline]
    fn dark(&self, ray: &Ray) -> bool {
        if !self.shining {
            return self.bvh.occluded(ray);
        }
        let Some(hit) = self.bvh.closest(ray) else { return false };
        let surface = Surface::of_hit(self.scene, &hit);
        surface.is_none_or(|s| self.scene.emission(s.material).iter().all(|&l| l == 0.0))
    }

    /// Unevenness of the share of the hemisphere that is dark over one side of a facet.
    fn side(&mut self, facet: usize, side: usize) -> f64 {
        let mut blocked = [0u32; BINS];
        let (x, y) = frame(self.scene.side_normal(facet, side));
        let sequence = Sequence::new(hash2((facet * 2 + side) as u32, 0x5b0b_e000));
        // all bins in turn, so that an open or even facet is known after a quarter of the rays
        for index in 0..self.rays {
            for (bin, count) in blocked.iter_mut().enumerate() {
                let at = index * BINS as u32 + bin as u32;
                let (p, q) = sequence.pair(at, 2);
                let (u, v) = in_bin(bin, triangle(p, q));
                let origin = Surface::new(self.scene, facet, side, u, v);
                let (p, q) = sequence.pair(at, 0);
                let (dx, dy, dz) = cosine_direction(p, q);
                let direction: Vec3 = x * dx + y * dy + origin.normal * dz;
                *count += u32::from(self.dark(&origin.leave(direction)));
            }
            self.traced += BINS as u64;
            if index + 1 == self.rays / 4 && unevenness(&blocked, self.rays / 4, SUSPECT) == 0.0 {
                return 0.0;
            }
        }
        unevenness(&blocked, self.rays, CERTAIN)
    }
}

/// Barycentric weights in the facet of a point of a bin: bins are the triangles of an edge cut in [`EDGE`].
fn in_bin(bin: usize, (a, b): (f64, f64)) -> (f64, f64) {
    let (mut i, mut rest) = (0, bin);
    while rest >= 2 * (EDGE - i) - 1 {
        rest -= 2 * (EDGE - i) - 1;
        i += 1;
    }
    let (j, n) = (rest / 2, EDGE as f64);
    if rest % 2 == 1 {
        (((i + 1) as f64 - a) / n, ((j + 1) as f64 - b) / n)
    } else {
        ((i as f64 + a) / n, (j as f64 + b) / n)
    }
}

/// Variance of the bins' blocked shares (each counted over so many `rays`) about their best linear function, less
/// what the rays' noise brings; 0 where it is not `least` times that.
fn unevenness(blocked: &[u32; BINS], rays: u32, least: f64) -> f64 {
    let n = BINS as f64;
    let share = |count: u32| f64::from(count) / f64::from(rays);
    let mean = share(blocked.iter().sum::<u32>()) / n;
    // moments about the centroid, in barycentric coordinates
    let (mut xx, mut xy, mut yy, mut xb, mut yb, mut bb) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (bin, &count) in blocked.iter().enumerate() {
        let (x, y) = in_bin(bin, (1.0 / 3.0, 1.0 / 3.0));
        let (x, y, b) = (x - 1.0 / 3.0, y - 1.0 / 3.0, share(count) - mean);
        xx += x * x;
        xy += x * y;
        yy += y * y;
        xb += x * b;
        yb += y * b;
        bb += b * b;
    }
    let determinant = xx * yy - xy * xy;
    let explained = (yy * xb * xb - 2.0 * xy * xb * yb + xx * yb * yb) / determinant;
    let residual = (bb - explained).max(0.0) / (n - 3.0);
    let noise = mean * (1.0 - mean) / f64::from(rays);
    if residual > least * noise { residual - noise } else { 0.0 }
}

/// Elements that a mesh of any facets may have beyond that, at a tolerance of 2e-3.
const COARSE: f64 = 1024.0;

/// Divisions of each facet's edges from its unevenness.
///
/// A jump leaves an error in the elements that it crosses, a share 1/S of them: the facet's part of the image's
/// mean square error is a V rho^2/S with its share `a` of the area. The least number of elements for a given
/// sum over all facets has S ~ (a V rho^2)^(1/3). The sum is (tolerance/2)^2, or what 1 + 2e-3/tolerance
/// times as many elements as there are facets, and some more for coarse meshes, reach.
pub fn divisions(
    scene: &Scene<'_>,
    unevenness: &[f64],
    tolerance: f64,
    out: &mut [u32],
) -> Result<(), Error> {
    for given in [unevenness.len(), out.len()] {
        if given != scene.facets() {
            return Err(Error::Length { what: "divisions", expected: scene.facets(), given });
        }
    }
    // where all facets are degenerate nothing is cut
    let total = scene.areas().iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let root = |facet: usize| {
        let rho = scene.diffuse(scene.material(facet)).iter().fold(0.0, |a: f64, &b| a.max(b));
        libm::cbrt(scene.areas().at(facet) / total * unevenness.at(facet) * rho * rho)
    };
    let goal = 0.25 * tolerance * tolerance;
    let mut factor = (0..scene.facets()).map(|f| root(f) * root(f)).sum::<f64>() / goal;
    let most = most_elements(scene.facets(), tolerance) as f64;
    loop {
        let mut elements = 0.0;
        for (facet, s) in out.iter_mut().enumerate() {
            *s = (libm::ceil(factor * root(facet)).min(f64::from(MAX_DIVISIONS)) as u32).max(1);
            elements += f64::from(*s * *s);
        }
        if elements <= most {
            return Ok(());
        }
        factor *= 0.8;
    }
}

/// The most elements that [`divisions`] cuts `facets` facets into.
pub fn most_elements(facets: usize, tolerance: f64) -> usize {
    (facets as f64 * (1.0 + 2e-3 / tolerance) + COARSE * (2e-3 / tolerance).min(1.0)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_is_uneven_and_a_slope_is_not() {
        let of = |f: fn(f64, f64) -> f64| {
            let mut bins = [0; BINS];
            for (bin, b) in bins.iter_mut().enumerate() {
                let (x, y) = in_bin(bin, (1.0 / 3.0, 1.0 / 3.0));
                *b = (1000.0 * f(x, y)) as u32;
            }
            unevenness(&bins, 1000, CERTAIN)
        };
        assert_eq!(of(|x, y| 0.2 + 0.3 * x + 0.4 * y), 0.0);
        assert_eq!(of(|_, _| 1.0), 0.0);
        assert!(of(|x, _| if x < 0.3 { 1.0 } else { 0.1 }) > 0.03);
    }
}
