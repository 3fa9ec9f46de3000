//! The double contour form, A F = (1/2 pi) int int ln r dx . dy: the integral along one edge in closed form,
//! along the other by Gauss points, graded toward the places where the closed form is singular or nearly so.

use super::angle::angle;
use super::convex::{CAPACITY, Convex, edges};
use super::rule::{GAUSS_6, GAUSS_10, GAUSS_16, Rule};
use crate::math::{Vec3, fabs, log, sqrt};

/// Panels shorter than this share of an edge are not split further: over one, the integrand's singular part
/// (x ln x) weighs 1e-12, of which the rule still gets all but 1e-4.
const SHORTEST: f64 = 1e-6;

/// An edge of the inner polygon.
#[derive(Clone, Copy)]
struct Edge {
    start: Vec3,
    direction: Vec3,
    length: f64,
}

/// A singular point t + i h of the integrand, in units of the outer edge's length.
#[derive(Clone, Copy)]
struct Singular {
    t: f64,
    h: f64,
}

/// What the integrand along one outer edge needs.
struct Integrand {
    start: Vec3,
    side: Vec3,
    inner: [Edge; CAPACITY],
    /// Cosines between the outer edge and the inner ones.
    weights: [f64; CAPACITY],
    corners: usize,
    singular: [Singular; 2 * CAPACITY],
    singulars: usize,
}

/// The double integral of ln r over the contours of both polygons, whose extent is about 1.
pub(super) fn integral(outer: &Convex, inner: &Convex) -> f64 {
    let mut sum = 0.0;
    for (start, end) in edges(outer.corners()) {
        let side = end - start;
        let length = sqrt(side.dot(side));
        if length > 0.0 {
            sum += length * Integrand::new(start, side, length, inner).panel(0.0, 1.0);
        }
    }
    sum
}

impl Integrand {
    fn new(start: Vec3, side: Vec3, length: f64, polygon: &Convex) -> Integrand {
        let direction = side / length;
        let nothing = Edge { start: Vec3::ZERO, direction: Vec3::ZERO, length: 0.0 };
        let mut this = Integrand {
            start,
            side,
            inner: [nothing; CAPACITY],
            weights: [0.0; CAPACITY],
            corners: polygon.corners().len(),
            singular: [Singular { t: 0.0, h: 0.0 }; 2 * CAPACITY],
            singulars: 0,
        };
        let slots = this.inner.iter_mut().zip(&mut this.weights);
        for ((slot, weight), (a, b)) in slots.zip(edges(polygon.corners())) {
            let length = sqrt((b - a).dot(b - a));
            let along = if length > 0.0 { (b - a) / length } else { Vec3::ZERO };
            *slot = Edge { start: a, direction: along, length };
            *weight = along.dot(direction);
        }
        for k in this.inner.into_iter().take(this.corners) {
            this.add_corner(&k, direction, length);
            this.add_line(&k, direction, length);
        }
        this
    }

    /// ln r is singular where the outer edge meets a corner.
    fn add_corner(&mut self, edge: &Edge, direction: Vec3, length: f64) {
        let to = edge.start - self.start;
        let off = to.cross(direction);
        self.add(Singular { t: to.dot(direction) / length, h: sqrt(off.dot(off)) / length });
    }

    /// d atan(s/d) is singular where the outer edge meets the inner one between its ends.
    fn add_line(&mut self, edge: &Edge, direction: Vec3, length: f64) {
        let across = direction.cross(edge.direction);
        let sine2 = across.dot(across);
        if sine2 < 1e-24 {
            return;
        }
        let from = self.start - edge.start;
        let off = from.cross(edge.direction);
        let t = -off.dot(across) / sine2;
        let s = (from + direction * t).dot(edge.direction);
        if s > -0.01 * edge.length && s < 1.01 * edge.length {
            let gap = from.dot(across);
            self.add(Singular { t: t / length, h: fabs(gap) / (sine2 * length) });
        }
    }

    fn add(&mut self, singular: Singular) {
        if let Some(slot) = self.singular.get_mut(self.singulars) {
            *slot = singular;
            self.singulars += 1;
        }
    }

    /// The integral over [from, to], split until every singular point is far enough for a rule.
    fn panel(&self, from: f64, to: f64) -> f64 {
        let width = to - from;
        let (worst, sum_of_radii) = self.nearest(from, to);
        // Half the sum of the distances to both ends, in half widths, is (rho + 1/rho)/2 for the ellipse of
        // convergence rho; n points leave rho^(-2n).
        let rule: Rule = match sum_of_radii {
            x if x > 10.0 => GAUSS_6,
            x if x > 3.2 => GAUSS_10,
            x if x > 1.6 || width <= SHORTEST => GAUSS_16,
            _ => {
                let cut = cut(from, to, worst);
                return self.panel(from, cut) + self.panel(cut, to);
            }
        };
        rule.iter().map(|(x, w)| w * self.at(from + width * x)).sum::<f64>() * width
    }

    /// The singular point that limits convergence on [from, to] most, and its half sum of distances.
    fn nearest(&self, from: f64, to: f64) -> (Singular, f64) {
        let mut nearest = (Singular { t: 0.0, h: 0.0 }, f64::INFINITY);
        for z in self.singular.iter().take(self.singulars) {
            let (x, y, h2) = (z.t - from, z.t - to, z.h * z.h);
            let sum = (sqrt(x * x + h2) + sqrt(y * y + h2)) / (to - from);
            if sum < nearest.1 {
                nearest = (*z, sum);
            }
        }
        nearest
    }

    /// The inner integral at the point `t` of the outer edge, times the cosine between the edges, all edges.
    ///
    /// int ln r ds = s ln r - s + d atan(s/d); the -s sum to zero around the polygon and are left out.
    fn at(&self, t: f64) -> f64 {
        let x = self.start + self.side * t;
        let inner = self.inner.get(..self.corners).unwrap_or(&[]);
        let half_log = |to: Vec3| {
            let r2 = to.dot(to);
            if r2 > 0.0 { 0.5 * log(r2) } else { 0.0 }
        };
        let Some(first) = inner.first() else {
            return 0.0;
        };
        // Backward, so that each corner's logarithm is taken once: an edge ends where the one before it began.
        let mut log_end = half_log(first.start - x);
        let mut sum = 0.0;
        for (edge, weight) in inner.iter().zip(&self.weights).rev() {
            let to = edge.start - x;
            let log_start = half_log(to);
            let s = to.dot(edge.direction);
            let off = to.cross(edge.direction);
            let d2 = off.dot(off);
            let d = sqrt(d2);
            let end = s + edge.length;
            let angle = angle(d * edge.length, d2 + s * end);
            sum += weight * (end * log_end - s * log_start + d * angle);
            log_end = log_start;
        }
        sum
    }
}

/// Where to split [from, to] because of the singular point z: at it, or nearer to the end that is nearer to it.
fn cut(from: f64, to: f64, z: Singular) -> f64 {
    let (width, place) = (to - from, (z.t - from) / (to - from));
    let share = match place {
        x if (0.1..=0.9).contains(&x) => x,
        _ if z.h > 0.2 * width => 0.5,
        x if x < 0.1 => 0.25,
        _ => 0.75,
    };
    from + width * share
}
