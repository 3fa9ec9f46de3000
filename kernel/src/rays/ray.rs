//! Rays, and the one arithmetic in which a ray meets a facet.
//!
//! Every hit is computed here or, lane by lane, with the same operations in the same order: what a ray hits
//! does not depend on the tree that found it. This work is based on S. Woop, C. Benthin, I. Wald,
//! "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013, carried out in f64.
//!
//! **Watertight.** The corners are moved to the ray's origin and sheared along it into a plane; each image is a
//! function of the ray and that corner alone, so facets that share a corner share its image. An edge function
//! `p q' - q p'` of two images is a difference of two rounded products: rounding is monotonic, so it has the
//! right sign or is zero, and where it is zero it is found again from exact products. All signs are therefore
//! those of the images, and a sign that is truly zero counts as inside on both sides of the edge: the images of a
//! closed mesh cover the ray without a gap, at edges and corners too, and a facet far smaller than its distance
//! from the ray is not hit by accident.
//!
//! Constants of this file are measured by `cargo test --test bvh --test sheets` (hits at edges, at grazing angles and on
//! sheets that coincide).

use crate::base::index::Index;
use crate::base::math::{Vec3, fabs};

/// A half line, or a piece of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Unit vector along it.
    pub direction: Vec3,
    /// Hits at `t >= t_max` do not count; infinity for no limit.
    pub t_max: f64,
    /// The facet that the ray leaves, never hit; `u32::MAX` for none.
    pub skip: u32,
}

/// Where a ray meets a facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the origin along the ray, in lengths of its direction, greater than 0.
    ///
    /// Off from the facet's plane by some 8 eps |corner - origin| / |cos(direction, normal)| with eps = 2^-53,
    /// whatever the facet's aspect, and never beyond the facet's own bounding box by more than that with cosine 2^-10.
    pub t: f64,
    /// Index of the facet.
    pub facet: u32,
    /// Barycentric weight of corner 1, in 0..=1.
    pub u: f64,
    /// Barycentric weight of corner 2, in 0..=1.
    pub v: f64,
    /// Whether the ray meets the side on which the corners run counter-clockwise.
    pub front: bool,
}

impl Ray {
    /// From `origin` along the unit vector `direction`, without end and leaving no facet.
    pub fn new(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction, t_max: f64::INFINITY, skip: u32::MAX }
    }
}

/// Distance between sheets that count as one, in units of the mesh's size and the ray's length together: twice what rays at
/// a cosine of 2^-8 leave of a facet's `t` by rounding, and a third of the smallest gap that is told from contact.
const COINCIDENT: f64 = 1.0 / (1u64 << 42) as f64;

/// The first of the hits of one ray: the one of least `t`, but among facets that coincide there a front comes before a back,
/// then the least `t`, then the lowest index. The same whatever the order in which hits come.
#[derive(Clone, Copy, Debug)]
pub(crate) struct First {
    /// The mesh's size.
    pub scale: f64,
    /// Hits from here on do not count.
    pub t_max: f64,
    /// The least `t` of all hits; `t_max` before the first.
    pub nearest: f64,
}

impl First {
    /// Before the first hit.
    #[inline(always)]
    pub fn new(scale: f64, t_max: f64) -> First {
        First { scale, t_max, nearest: t_max }
    }

    /// Notes a hit, which becomes the `best` where it is the first of all so far.
    #[inline(always)]
    pub fn note(&mut self, hit: Hit, best: &mut Option<Hit>) {
        if hit.t < self.nearest {
            self.nearest = hit.t;
            let stays = !hit.front && best.is_some_and(|best| best.front && self.reaches(best.t));
            *best = if stays { *best } else { Some(hit) };
        } else if self.reaches(hit.t)
            && let Some(kept) = *best
        {
            let sooner = hit.t < kept.t || hit.t == kept.t && hit.facet < kept.facet;
            if hit.front & (!kept.front | sooner) || !hit.front & !kept.front & sooner {
                *best = Some(hit);
            }
        }
    }

    /// Whether what is met at `t` coincides with the nearest.
    #[inline(always)]
    fn reaches(&self, t: f64) -> bool {
        t - self.nearest <= COINCIDENT * (self.scale + self.nearest) && t < self.t_max
    }
}

/// Where the ray meets one facet, whose index is `facet`: what a search of the whole mesh would find if it had
/// this facet alone. `None` too for a ray that has no direction or is not finite.
///
/// `skip` and `t_max` of the ray hold; the facet's plane is found anew at every call.
pub fn intersect(ray: &Ray, facet: u32, corners: &[Vec3; 3]) -> Option<Hit> {
    if facet == ray.skip {
        return None;
    }
    let line = Line::new(ray)?;
    let moved = corners.map(|corner| corner - ray.origin);
    let edges = line.edges(moved.map(|m| line.image(m.to_array())));
    line.hit(facet, edges, moved, normal(corners)).filter(|hit| hit.t < ray.t_max)
}

/// The facet's normal times twice its area, each component within some ulp of the exact one, so that the plane of
/// a needle is as good as that of any facet.
pub fn normal(corners: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|corner| corner.to_array());
    let component = |i: usize, j: usize| {
        let (p, q) = (difference(b[i], a[i]), difference(c[j], a[j]));
        let (r, s) = (difference(b[j], a[j]), difference(c[i], a[i]));
        let ((x, x_low), (y, y_low)) = (product(p.0, q.0), product(r.0, s.0));
        let (high, low) = difference(x, y);
        high + (low + (x_low - y_low) + ((p.0 * q.1 + p.1 * q.0) - (r.0 * s.1 + r.1 * s.0)))
    };
    Vec3::new(component(1, 2), component(2, 0), component(0, 1))
}

/// a - b and its rounding error (Knuth).
fn difference(a: f64, b: f64) -> (f64, f64) {
    let high = a - b;
    let part = high - a;
    (high, (a - (high - part)) - (b + part))
}

/// a b and its rounding error (Dekker), without FMA so that every target gives the same bits.
fn product(a: f64, b: f64) -> (f64, f64) {
    let split = |x: f64| {
        let scaled = x * 134_217_729.0; // 2^27 + 1: halves the 53 bits
        let high = scaled - (scaled - x);
        (high, x - high)
    };
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    let high = a * b;
    (high, ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2)
}

/// Relative slack of a facet's box: far above the rounding of the sheared images (some 2^-51 of the corner's
/// distance), far below what the boxes of the tree are widened by.
pub(crate) const FACET_BOX_SLACK: f64 = 1.0 / (1u64 << 46) as f64;

/// Up to this squared cosine a facet's plane is not trusted alone. Above it, t is within 2^-40 of the corner's
/// distance of the entry into the facet's box, or after.
const HIT_COSINE2_GRAZING: f64 = 1.0 / (1u64 << 20) as f64;

/// Components of a direction below this are raised to it where they divide.
const DIVISOR_LEAST: f64 = 1e-200;

/// [`Line::edges`] with the right signs, and within an ulp or so.
#[cold]
fn exact_edges([a, b, c]: [[f64; 2]; 3]) -> [f64; 3] {
    let cross = |p: [f64; 2], q: [f64; 2]| {
        let ((x, x_low), (y, y_low)) = (product(p[0], q[1]), product(p[1], q[0]));
        (x - y) + (x_low - y_low)
    };
    [cross(c, b), cross(a, c), cross(b, a)]
}

/// The axes that follow each, in turn.
pub(crate) const NEXT: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Quantities of a ray that are the same for all facets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    direction: Vec3,
    /// The axes of the image plane, and the one along which corners are sheared (the direction's largest).
    pub axes: [usize; 3],
    pub shear: [f64; 2],
}

impl Line {
    /// `None` where the direction is zero or anything is not finite.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Option<Line> {
        let d = ray.direction.to_array();
        let [x, y, z] = d.map(fabs);
        // without branches, which no processor foresees
        let along = if (x > y) & (x > z) { 0 } else { 2 - usize::from(y > z) };
        let largest = [x, y, z].at(along);
        if !(largest > DIVISOR_LEAST && (x + y + z).is_finite() && ray.origin.is_finite()) {
            return None;
        }
        let backward = usize::from(d.at(along) < 0.0); // keeps the sense of rotation
        let first = NEXT.at(along)[backward];
        let second = NEXT.at(along)[1 - backward];
        let inverse = 1.0 / d.at(along);
        Some(Line {
            direction: ray.direction,
            axes: [first, second, along],
            shear: [d.at(first) * inverse, d.at(second) * inverse],
        })
    }

    /// 1 / direction, large instead of infinite.
    pub fn inverse(direction: Vec3) -> Vec3 {
        Vec3::from_array(
            direction.to_array().map(|c| 1.0 / if fabs(c) > DIVISOR_LEAST { c } else { DIVISOR_LEAST }),
        )
    }

    /// The image of a corner, given relative to the ray's origin.
    #[inline(always)]
    pub fn image(&self, moved: [f64; 3]) -> [f64; 2] {
        let [first, second, along] = self.axes;
        let depth = moved.at(along);
        [moved.at(first) - self.shear[0] * depth, moved.at(second) - self.shear[1] * depth]
    }

    /// The three edge functions of the corners' images: twice the areas that the ray spans with the edges opposite
    /// to corners 0, 1 and 2. All at least 0: the ray may pass the front; all at most 0: the back.
    #[inline(always)]
    pub fn edges(&self, [a, b, c]: [[f64; 2]; 3]) -> [f64; 3] {
        [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]]
    }

    /// The hit, from the edge functions, the corners relative to the origin and the normal (of any length).
    #[inline(always)]
    pub fn hit(&self, facet: u32, edges: [f64; 3], moved: [Vec3; 3], normal: Vec3) -> Option<Hit> {
        let [e0, e1, e2] =
            if edges.contains(&0.0) { exact_edges(moved.map(|m| self.image(m.to_array()))) } else { edges };
        let front = e0 >= 0.0 && e1 >= 0.0 && e2 >= 0.0;
        let back = e0 <= 0.0 && e1 <= 0.0 && e2 <= 0.0;
        if front == back {
            return None; // outside; or all zero: seen edge-on, where its neighbours stand for it
        }
        let cosine = normal.dot(self.direction);
        let mut t = normal.dot(moved[0]) / cosine;
        if cosine * cosine <= HIT_COSINE2_GRAZING * normal.dot(normal) {
            t = self.clamp(t, &moved);
        }
        if !(t > 0.0 && t < f64::INFINITY) {
            return None;
        }
        let sum = e0 + e1 + e2;
        Some(Hit { t, facet, u: e1 / sum, v: e2 / sum, front })
    }

    /// `t`, or the nearest value at which the ray is inside the facet's bounding box. Grazing rays need it, for
    /// which the plane alone says little, and the boxes of the tree rely on it. NaN (0/0: the ray lies in the plane)
    /// becomes the entry.
    #[cold]
    fn clamp(&self, t: f64, moved: &[Vec3; 3]) -> f64 {
        let [a, b, c] = *moved;
        let reach = a.abs().max(b.abs()).max(c.abs()).max_element();
        let inverse = Line::inverse(self.direction);
        let slack = inverse.abs() * (reach * FACET_BOX_SLACK);
        let (p, q, r) = (a * inverse, b * inverse, c * inverse);
        let entry = (p.min(q).min(r) - slack).max_element();
        let exit = (p.max(q).max(r) + slack).min_element();
        let below = if t < exit { t } else { exit };
        if below > entry && !t.is_nan() { below } else { entry }
    }
}
