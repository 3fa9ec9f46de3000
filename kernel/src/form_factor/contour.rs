//! The double contour form, A F = (1/2 pi) int int ln r dx . dy: the integral along one edge in closed form,
//! along the other by Gauss points, graded toward the places where the closed form is singular or nearly so.
//!
//! Constants of this file are measured by `cargo test --test form_factor` (errors) and `cargo bench --bench counts`
//! (instructions).

use super::angle::wide_angle;
use super::convex::{CAPACITY, Convex, edges};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, fabs, sqrt};
use crate::base::quadrature::Gauss;
use crate::base::simd::{Isa, Lanes64, WIDTH, Wide, WideTask, run_wide};

/// Panels shorter than this share of an edge are not split further: over one, the integrand's singular part
/// (x ln x) weighs 1e-12, of which the rule still gets all but 1e-4.
const SHORTEST: f64 = 1e-6;

/// The Gauss rules in use: of as many points as there are lanes, and of twice as many.
static FEW: Gauss<WIDTH> = Gauss::new();
static MANY: Gauss<{ 2 * WIDTH }> = Gauss::new();

/// Panels that wait while those to the left of them are done: a split leaves nine tenths of a panel at most and is made
/// again but for panels of more than [`SHORTEST`], 131 times at the worst; 14 in all tests. The last to fit is not split.
const PANELS_WAITING: usize = 32;

/// An edge of the inner polygon.
#[derive(Clone, Copy)]
struct Edge {
    start: Vec3,
    direction: Vec3,
    length: f64,
    /// Cosine of the angle between it and the outer edge.
    weight: f64,
}

/// A singular point t + i h of the integrand, in units of the outer edge's length.
#[derive(Clone, Copy)]
struct Singular {
    t: f64,
    h: f64,
}

/// Constants of the integrand along one outer edge.
struct Integrand {
    isa: Isa,
    start: Vec3,
    side: Vec3,
    inner: [Edge; CAPACITY],
    corners: usize,
    singular: [Singular; 2 * CAPACITY],
    singulars: usize,
}

/// The double integral of ln r over the contours of both polygons, whose extent is about 1.
#[inline(never)]
pub(super) fn integral(isa: Isa, outer: &Convex, inner: &Convex) -> f64 {
    let nothing = Edge { start: Vec3::ZERO, direction: Vec3::ZERO, length: 0.0, weight: 0.0 };
    let mut integrand = Integrand {
        isa,
        start: Vec3::ZERO,
        side: Vec3::ZERO,
        inner: [nothing; CAPACITY],
        corners: inner.corners().len(),
        singular: [Singular { t: 0.0, h: 0.0 }; 2 * CAPACITY],
        singulars: 0,
    };
    let mut sum = 0.0;
    for (start, end) in edges(outer.corners()) {
        let side = end - start;
        let length = sqrt(side.dot(side));
        if length > 0.0 {
            integrand.along(start, side, length, inner);
            sum += length * integrand.whole();
        }
    }
    sum
}

impl Integrand {
    /// For an edge of the outer polygon.
    fn along(&mut self, start: Vec3, side: Vec3, length: f64, polygon: &Convex) {
        let direction = side / length;
        (self.start, self.side, self.singulars) = (start, side, 0);
        for (k, (a, b)) in edges(polygon.corners()).enumerate() {
            let inner = sqrt((b - a).dot(b - a));
            let along = if inner > 0.0 { (b - a) / inner } else { Vec3::ZERO };
            let edge = Edge { start: a, direction: along, length: inner, weight: along.dot(direction) };
            if let Some(slot) = self.inner.get_mut(k) {
                *slot = edge;
            }
            self.add_corner(&edge, direction, length);
            self.add_line(&edge, direction, length);
        }
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

    /// The integral over the edge, [0, 1], in panels split until every singular point is far enough for a rule.
    fn whole(&self) -> f64 {
        let (mut from, mut to, mut sum) = (0.0, 1.0, 0.0);
        let (mut ends, mut waiting) = ([0.0; PANELS_WAITING], 0);
        loop {
            let width = to - from;
            let (worst, sum_of_radii) = self.nearest(from, to);
            // Half the sum of the distances to both ends, in half widths, is (rho + 1/rho)/2 for the ellipse of
            // convergence rho; n points leave rho^(-2n).
            if sum_of_radii > 4.8 {
                sum += self.points(from, width, &FEW.nodes, &FEW.weights);
            } else if sum_of_radii > 1.6 || width <= SHORTEST || waiting >= PANELS_WAITING {
                sum += self.points(from, width, &MANY.nodes, &MANY.weights);
            } else {
                ends.set(waiting, to);
                waiting += 1;
                to = cut(from, to, worst);
                continue;
            }
            if waiting == 0 {
                return sum;
            }
            waiting -= 1;
            (from, to) = (to, ends.at(waiting));
        }
    }

    /// The integral over a panel by a rule.
    fn points(&self, from: f64, width: f64, nodes: &[f64], weights: &[f64]) -> f64 {
        let (nodes, weights) = (nodes.as_chunks().0, weights.as_chunks().0);
        let inner = self.inner.get(..self.corners).unwrap_or(&[]);
        let Some(first) = inner.first() else {
            return 0.0;
        };
        let (start, side) = (self.start + self.side * from, self.side * width);
        width * run_wide(self.isa, Panel { start, side, nodes, weights, first, inner })
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
}

/// The mean over a panel, start + side t, of the inner integral times the cosine between the edges, all edges.
///
/// int ln r ds = s ln r - s + d atan(s/d); the -s sum to zero around the polygon and are left out.
struct Panel<'a> {
    start: Vec3,
    side: Vec3,
    nodes: &'a [[f64; WIDTH]],
    weights: &'a [[f64; WIDTH]],
    first: &'a Edge,
    inner: &'a [Edge],
}

impl WideTask for Panel<'_> {
    type Out = f64;

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> f64 {
        let mut total = lanes.all(0.0);
        for (nodes, weights) in self.nodes.iter().zip(self.weights) {
            let t = lanes.of(nodes);
            let x = lanes.all(self.start.x) + lanes.all(self.side.x) * t;
            let y = lanes.all(self.start.y) + lanes.all(self.side.y) * t;
            let z = lanes.all(self.start.z) + lanes.all(self.side.z) * t;
            // Backward, so that each corner's logarithm is taken once: an edge ends where the one before it began.
            let to = self.first.start;
            let (dx, dy, dz) = (lanes.all(to.x) - x, lanes.all(to.y) - y, lanes.all(to.z) - z);
            let mut log_end = half_log(lanes, dx * dx + dy * dy + dz * dz);
            let mut sum = lanes.all(0.0);
            for edge in self.inner.iter().rev() {
                let Edge { start: to, direction: along, .. } = edge;
                let (ax, ay, az) = (lanes.all(along.x), lanes.all(along.y), lanes.all(along.z));
                let (dx, dy, dz) = (lanes.all(to.x) - x, lanes.all(to.y) - y, lanes.all(to.z) - z);
                let log_start = half_log(lanes, dx * dx + dy * dy + dz * dz);
                let s = dx * ax + dy * ay + dz * az;
                let (cx, cy, cz) = (dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax);
                let d2 = cx * cx + cy * cy + cz * cz;
                let (d, length) = (d2.sqrt(), lanes.all(edge.length));
                let end = s + length;
                let angle = wide_angle(lanes, d * length, d2 + s * end);
                sum = sum + lanes.all(edge.weight) * (end * log_end - s * log_start + d * angle);
                log_end = log_start;
            }
            total = total + lanes.of(weights) * sum;
        }
        let [a, b, c, d, e, f, g, h] = total.array();
        ((a + b) + (c + d)) + ((e + f) + (g + h))
    }
}

/// ln(x)/2 within 3e-16 (1 + |ln x|); 0 where x is 0 or subnormal.
///
/// ln x = e ln 2 + 2 atanh(z), z = (m - 1)/(m + 1) for x = 2^e m with m in [1/sqrt 2, sqrt 2): the series in z^2 <= 0.0295
/// leaves 1e-17 after eleven terms.
#[inline(always)]
fn half_log<L: Lanes64>(lanes: L, x: L::F) -> L::F {
    const HALF_LN2_HIGH: f64 = 0.5 * 6.931_471_803_691_238e-1;
    const HALF_LN2_LOW: f64 = 0.5 * 1.908_214_929_270_587_7e-10;
    let (fraction, exponent) = (x.fraction(), x.exponent());
    let (one, half) = (lanes.all(1.0), lanes.all(0.5));
    let large = fraction.gt(lanes.all(core::f64::consts::SQRT_2));
    let m = (fraction * half).where_else(large, fraction);
    let e = (exponent + one).where_else(large, exponent);
    let z = (m - one) / (m + one);
    let z2 = z * z;
    let z4 = z2 * z2;
    let z8 = z4 * z4;
    let low = (lanes.all(1.0 / 3.0) + lanes.all(1.0 / 5.0) * z2)
        + (lanes.all(1.0 / 7.0) + lanes.all(1.0 / 9.0) * z2) * z4;
    let mid = (lanes.all(1.0 / 11.0) + lanes.all(1.0 / 13.0) * z2)
        + (lanes.all(1.0 / 15.0) + lanes.all(1.0 / 17.0) * z2) * z4;
    let high = lanes.all(1.0 / 19.0) + lanes.all(1.0 / 21.0) * z2;
    let series = low + (mid + high * z8) * z8;
    let log = lanes.all(HALF_LN2_HIGH) * e + (z + (z * z2 * series + lanes.all(HALF_LN2_LOW) * e));
    log.where_else(x.gt(lanes.all(f64::MIN_POSITIVE)), lanes.all(0.0))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math::log;

    struct Logs([f64; WIDTH]);

    impl WideTask for Logs {
        type Out = [f64; WIDTH];

        #[inline(always)]
        fn run<L: Lanes64>(self, lanes: L) -> [f64; WIDTH] {
            half_log(lanes, lanes.of(&self.0)).array()
        }
    }

    /// 3e-16 (1 + |ln x|): the series' 1e-17, and two or three roundings of numbers of at most that size.
    #[test]
    fn logarithms() {
        for k in -4000i32..4000 {
            let x: [f64; WIDTH] = core::array::from_fn(|n| {
                libm::exp2(0.2 * f64::from(k) + 0.025 * n as f64).max(f64::MIN_POSITIVE * 2.0)
            });
            for isa in Isa::all() {
                for (got, x) in run_wide(isa, Logs(x)).into_iter().zip(x) {
                    let want = 0.5 * log(x);
                    assert!((got - want).abs() <= 3e-16 * (1.0 + want.abs()), "ln {x:e}: {got:e} {want:e}");
                }
            }
        }
        assert_eq!(run_wide(Isa::BASELINE, Logs([0.0; WIDTH])), [0.0; WIDTH]);
    }
}
