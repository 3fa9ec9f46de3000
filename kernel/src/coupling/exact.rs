//! Entries of a row to facets that nothing hides: form factors in closed form, without rays.
//!
//! [`crate::coupling::plane_sides`] proves that nothing stands between. Such a pair's factor from a point is Lambert's.
//! Its mean over each of the element's quarters takes Gauss points as dense as the distance asks for. The quarters give
//! mean, gradients and departure from them as rays' hits would. The quadrature's error is a small part of that which
//! the row's rays would have.
//!
//! Constants of this file are measured by `cargo test --test contact` (errors beside contacts) and `cargo bench --bench
//! counts` (instructions).

use super::mirror_path::STRAIGHT;
use super::row_builder::RowBuilder;
use super::{BLOCKED, Record};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, clamp, fabs, pow, sqrt};
use crate::base::quarter::{self, Path, QUARTERS, point};
use crate::base::simd::Isa;
use crate::coupling::element::Elements;
use crate::coupling::plane_sides::{PlaneSides, ProvenVisible, Receiver};
use crate::form_factor::{TRIANGLE_LANES, TriangleBlock, point_to_triangle, point_to_triangles};
use crate::scene::{NO_MIRROR, Scene};

/// Gauss point of a triangle, of degree 1: barycentric weights of corners 1 and 2, weight (Strang and Fix, 1973).
const GAUSS_POINTS_1: [(f64, f64, f64); 1] = [(1.0 / 3.0, 1.0 / 3.0, 1.0)];

/// Three Gauss points of degree 2. See [`GAUSS_POINTS_1`].
const GAUSS_POINTS_3: [(f64, f64, f64); 3] =
    [(1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0), (2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0), (1.0 / 6.0, 2.0 / 3.0, 1.0 / 3.0)];

/// Six Gauss points of degree 4. See [`GAUSS_POINTS_1`].
const GAUSS_POINTS_6: [(f64, f64, f64); 6] = {
    const A: (f64, f64) = (0.445_948_490_915_965, 0.223_381_589_678_011);
    const B: (f64, f64) = (0.091_576_213_509_771, 0.109_951_743_655_322);
    [
        (A.0, A.0, A.1),
        (1.0 - 2.0 * A.0, A.0, A.1),
        (A.0, 1.0 - 2.0 * A.0, A.1),
        (B.0, B.0, B.1),
        (1.0 - 2.0 * B.0, B.0, B.1),
        (B.0, 1.0 - 2.0 * B.0, B.1),
    ]
};

/// Times that a quarter is cut again beside what it touches.
const CONTACT_HALVINGS_MOST: usize = 4;

/// Which rule serves a triangle of so large a radius over the distance.
#[derive(Clone, Copy, PartialEq)]
struct Rules {
    one: f64,
    three: f64,
    six: f64,
}

impl Rules {
    /// For the relative error `e` of a factor: of degrees 1, 2 and 4 it is some 0.3 x^2, 0.3 x^4 (the odd order cancels
    /// about the point) and 0.3 x^6 at the ratio x.
    fn new(e: f64) -> Rules {
        let at = |power: f64| pow(e / 0.3, 1.0 / power).min(0.6);
        Rules { one: at(2.0), three: at(4.0), six: at(6.0) }
    }

    fn of(&self, ratio: f64) -> Option<&'static [(f64, f64, f64)]> {
        match ratio {
            x if x <= self.one => Some(&GAUSS_POINTS_1),
            x if x <= self.three => Some(&GAUSS_POINTS_3),
            x if x <= self.six => Some(&GAUSS_POINTS_6),
            _ => None,
        }
    }
}

/// Entries of one row on their way into its block.
pub(super) struct Entries<'a, 'm> {
    pub scene: &'a Scene<'a>,
    pub elements: &'a Elements<'a>,
    pub builder: &'a mut RowBuilder<'m>,
    pub isa: Isa,
    /// Rays that such a row would have at most.
    pub rays: u32,
    /// Gradients by what quarters see, and departures from them.
    pub slopes: [[f64; 2]; QUARTERS],
    pub departures: [f64; QUARTERS],
}

/// An element that the row sees.
#[derive(Clone, Copy)]
struct Target {
    unknown: usize,
    corners: [Vec3; 3],
    normal: Vec3,
    glows: bool,
    mirror: Option<usize>,
}

impl Target {
    /// Common quantities of all elements of a side of a facet.
    fn side(scene: &Scene<'_>, facet: usize, side: usize) -> Target {
        let material = scene.material(facet);
        let glows = scene.glows(material);
        let mirror = mirror_kind(scene.mirror(material));
        Target { unknown: 0, corners: [Vec3::ZERO; 3], normal: scene.side_normal(facet, side), glows, mirror }
    }

    /// One of them.
    fn element(self, scene: &Scene<'_>, elements: &Elements<'_>, unknown: usize) -> Target {
        let corners = elements.corners(scene, unknown / scene.sides().max(1));
        Target { unknown, corners, ..self }
    }
}

/// The elements of a side of a facet.
fn targets<'a>(
    scene: &'a Scene<'a>,
    elements: &'a Elements<'a>,
    facet: usize,
    side: usize,
) -> impl Iterator<Item = Target> + use<'a> {
    let of = Target::side(scene, facet, side);
    elements.unknowns_of(facet, side).map(move |unknown| of.element(scene, elements, unknown))
}

/// Elements that one rule serves, until they fill all lanes: their unknowns alone, since all that is known of them would
/// take a few kilobytes of stack.
#[derive(Clone, Copy)]
struct Lanes {
    unknowns: [u32; TRIANGLE_LANES],
    count: usize,
}

/// Mirrors whose rays are told apart: classes beyond share a kind with others.
pub(super) const MIRROR_KINDS: usize = 7;

/// The kind of a material's mirror.
pub(super) fn mirror_kind(class: u32) -> Option<usize> {
    (class != NO_MIRROR).then_some(class as usize % MIRROR_KINDS)
}

/// Shares of the hemisphere that entries fill, as each quarter of the element sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// All of them.
    pub shares: [f64; QUARTERS],
    /// Those to mirrors, by the kind of their first one.
    pub mirrored: [[f64; MIRROR_KINDS]; QUARTERS],
    /// Factor on the entries that closes the row where it sees nothing else.
    pub scale: f64,
}

impl Default for Known {
    fn default() -> Self {
        Known { shares: [0.0; QUARTERS], mirrored: [[0.0; MIRROR_KINDS]; QUARTERS], scale: 1.0 }
    }
}

impl Known {
    fn add(&mut self, target: &Target, factors: &[f64; QUARTERS]) {
        for ((share, mirrored), factor) in self.shares.iter_mut().zip(&mut self.mirrored).zip(factors) {
            *share += factor;
            if let Some(mirrored) = target.mirror.and_then(|kind| mirrored.get_mut(kind)) {
                *mirrored += factor;
            }
        }
    }

    /// Sum over the whole element.
    pub fn share(&self) -> f64 {
        0.25 * self.shares.iter().sum::<f64>()
    }

    /// What is missing of a closed room, or too much, is the quadrature's error.
    fn close(&mut self, error: f64) {
        if fabs(1.0 - self.share()) <= error {
            self.scale = 1.0 / self.share();
            self.shares = [1.0; QUARTERS];
            self.mirrored = self.mirrored.map(|all| all.map(|share| self.scale * share));
        }
    }
}

/// Share of the sky that entries block, in whatever direction.
#[derive(Default)]
struct Blocked {
    weight: f64,
    gradient: [f64; 2],
    departure: f64,
}

impl Entries<'_, '_> {
    /// Adds the entries of all that is proven to be clear. `None` where the memory is full.
    // apart, as what follows: none burdens the stack of another
    #[inline(never)]
    pub fn add(
        mut self,
        receiver: &Receiver,
        plane_sides: &PlaneSides<'_>,
        clear: &ProvenVisible<'_>,
        known: &mut Known,
    ) -> Option<()> {
        // a small part of the error of rays, 0.9 n^-2/3
        let error = 0.05 * pow(f64::from(self.rays), -2.0 / 3.0);
        let rules = Rules::new(error);
        let quarters = [0, 1, 2, 3].map(|q| Path::default().step(q).corners(&receiver.corners));
        let place = Place { receiver, quarters, rules, middle: middle(&receiver.corners) };
        let mut lanes = [Lanes { unknowns: [0; TRIANGLE_LANES], count: 0 }; 3];
        let mut blocked = Blocked::default();
        let sides = self.scene.sides();
        for facet in plane_sides.before(receiver.facet, receiver.side) {
            for side in (0..sides).filter(|&side| clear.has(facet, side, sides)) {
                for target in targets(self.scene, self.elements, facet, side) {
                    let Some(class) = place.class(self.scene, facet, side, &target) else {
                        self.near(&place, &target, (known, &mut blocked))?;
                        continue;
                    };
                    let Some(lanes) = lanes.get_mut(class) else { continue };
                    lanes.unknowns.set(lanes.count, target.unknown as u32);
                    lanes.count += 1;
                    if lanes.count == TRIANGLE_LANES {
                        self.flush(&place, class, lanes, (known, &mut blocked))?;
                    }
                }
            }
        }
        for (class, lanes) in lanes.iter_mut().enumerate() {
            self.flush(&place, class, lanes, (known, &mut blocked))?;
        }
        self.block(&blocked)?;
        if clear.all {
            known.close(error);
        }
        Some(())
    }

    /// Adds an element that no rule serves as it is.
    #[inline(never)]
    fn near(
        &mut self,
        place: &Place<'_>,
        target: &Target,
        (known, blocked): (&mut Known, &mut Blocked),
    ) -> Option<()> {
        let factors = place.quarters.each_ref().map(|q| place.mean(q, target));
        known.add(target, &factors);
        self.entry(place, target, factors, true, blocked)
    }

    /// Evaluates the elements of one rule.
    #[inline(never)]
    fn flush(
        &mut self,
        place: &Place<'_>,
        class: usize,
        lanes: &mut Lanes,
        (known, blocked): (&mut Known, &mut Blocked),
    ) -> Option<()> {
        let unknowns = lanes.unknowns.head(lanes.count);
        lanes.count = 0;
        if unknowns.is_empty() {
            return Some(());
        }
        let means = self.means(place, class, unknowns);
        for (lane, &unknown) in unknowns.iter().enumerate() {
            let (facet, side) = self.elements.facet_of(unknown as usize);
            let target =
                Target::side(self.scene, facet, side).element(self.scene, self.elements, unknown as usize);
            let factors = means.each_ref().map(|of| of.at(lane));
            known.add(&target, &factors);
            self.entry(place, &target, factors, false, blocked)?;
        }
        Some(())
    }

    /// Form factors of the receiver's quarters to these elements, by a rule.
    #[inline(never)]
    fn means(&self, place: &Place<'_>, class: usize, unknowns: &[u32]) -> [[f64; TRIANGLE_LANES]; QUARTERS] {
        let rule: &[(f64, f64, f64)] = match class {
            0 => &GAUSS_POINTS_1,
            1 => &GAUSS_POINTS_3,
            _ => &GAUSS_POINTS_6,
        };
        let mut block = TriangleBlock::EMPTY;
        for (lane, &unknown) in unknowns.iter().enumerate() {
            block.set(lane, &self.elements.corners(self.scene, unknown as usize / self.scene.sides().max(1)));
        }
        let mut means = [[0.0; TRIANGLE_LANES]; QUARTERS];
        for (quarter, means) in place.quarters.iter().zip(&mut means) {
            for &(u, v, weight) in rule {
                let mut factors = [[0.0; TRIANGLE_LANES]];
                let from = point(quarter, u, v);
                let block = core::slice::from_ref(&block);
                point_to_triangles(self.isa, from, place.receiver.normal, block, &mut factors);
                means.iter_mut().zip(factors[0]).for_each(|(mean, factor)| *mean += weight * factor);
            }
        }
        means
    }

    /// Adds one entry, by what the receiver's quarters see of the target.
    fn entry(
        &mut self,
        place: &Place<'_>,
        target: &Target,
        factors: [f64; QUARTERS],
        near: bool,
        blocked: &mut Blocked,
    ) -> Option<()> {
        let weight = 0.25 * factors.iter().sum::<f64>();
        if weight <= 0.0 {
            return Some(());
        }
        let gradient = self.gradient(&factors);
        let departure: f64 = self.departures.iter().zip(factors).map(|(d, f)| d * f).sum();
        if target.glows {
            let moment = if near {
                place.near_moment(target)
            } else {
                lean(place.middle, place.receiver.normal, &target.corners, target.normal)
            };
            self.builder.push(Record {
                half_differences: mark(departure),
                moment: moment.map(|m| (weight * m) as f32),
                ..Record::target((target.unknown, (0.0, 0.0)), STRAIGHT, weight, gradient.map(|g| g as f32))
            })?;
        }
        blocked.weight += weight;
        blocked.gradient[0] += gradient[0];
        blocked.gradient[1] += gradient[1];
        blocked.departure += departure;
        Some(())
    }

    fn gradient(&self, factors: &[f64; QUARTERS]) -> [f64; 2] {
        let mut gradient = [0.0; 2];
        for (slopes, factor) in self.slopes.iter().zip(factors) {
            gradient.iter_mut().zip(slopes).for_each(|(g, slope)| *g += slope * factor);
        }
        gradient
    }

    /// Share of the sky that all entries block.
    fn block(&mut self, blocked: &Blocked) -> Option<()> {
        let gradient = blocked.gradient.map(|g| g as f32);
        let record = Record::escape(None, BLOCKED, blocked.weight, gradient);
        self.builder.push(Record { half_differences: mark(blocked.departure), ..record })
    }
}

/// Factor by which light near a contact may depart further from a linear function than the means over quarters show.
///
/// Measured in a corner of three walls: 2.3 on coarse elements, 1.1 on fine ones.
const CONTACT_CURVATURE_FACTOR: f64 = 2.0;

/// Marks a record as exact until its row ends: its checks are final.
fn mark(departure: f64) -> [f32; 4] {
    let departure = (CONTACT_CURVATURE_FACTOR * departure) as f32;
    [f32::INFINITY, 0.0, departure, departure]
}

/// The finished record, times `scale`, where it is one that was marked as exact.
pub(super) fn finished(record: &Record, scale: f64) -> Option<Record> {
    let [marked, _, one, other] = record.half_differences;
    let finished = Record {
        weight: scale * record.weight,
        gradient: record.gradient.map(|g| scale as f32 * g),
        half_differences: [0.0, 0.0, one, other],
        moment: record.moment.map(|m| scale as f32 * m),
        ..*record
    };
    (marked == f32::INFINITY).then_some(finished)
}

/// The receiver and what follows from it.
struct Place<'a> {
    receiver: &'a Receiver,
    quarters: [[Vec3; 3]; QUARTERS],
    rules: Rules,
    middle: Vec3,
}

impl Place<'_> {
    /// The rule, by its number, that serves all quarters for a target that is wholly above the receiver's horizon, and
    /// the receiver above its own; none for others.
    fn class(&self, scene: &Scene<'_>, facet: usize, side: usize, target: &Target) -> Option<usize> {
        let radius = radius(&self.receiver.corners, self.middle);
        let distance = distance(self.middle, &target.corners) - 0.5 * radius;
        if distance <= 0.0 || !self.receiver.faces(scene, (facet, side), &target.corners) {
            return None;
        }
        match self.rules.of(0.5 * radius / distance)?.len() {
            1 => Some(0),
            3 => Some(1),
            _ => Some(2),
        }
    }

    /// From a point of the receiver to (a part of) a target: 0 from behind it.
    fn point_factor(&self, point: Vec3, part: &[Vec3; 3], target: &Target) -> f64 {
        let before = (point - part[0]).dot(target.normal) > 0.0;
        if before { point_to_triangle(point, self.receiver.normal, part) } else { 0.0 }
    }

    /// The mean over a triangle of the receiver of the factor to a target: of its quarters, and theirs, as far as these
    /// are too large for a rule.
    fn mean(&self, triangle: &[Vec3; 3], target: &Target) -> f64 {
        const UNUSED_TRIANGLE: ([Vec3; 3], usize, f64) = ([Vec3::ZERO; 3], 0, 0.0);
        // triangles in quarters, the next quarter, and the sum over those before
        let (mut whole, mut depth) = ([UNUSED_TRIANGLE; CONTACT_HALVINGS_MOST], 0);
        let mut part = *triangle;
        loop {
            let centre = middle(&part);
            let ratio = radius(&part, centre) / distance(centre, &target.corners).max(f64::MIN_POSITIVE);
            if ratio > self.rules.six && depth < CONTACT_HALVINGS_MOST {
                whole.set(depth, (part, 1, 0.0));
                depth += 1;
                part = Path::default().step(0).corners(&part);
                continue;
            }
            let of = |&(u, v, weight): &(f64, f64, f64)| {
                weight * self.point_factor(point(&part, u, v), &target.corners, target)
            };
            let mut mean: f64 = self.rules.of(ratio).unwrap_or(&GAUSS_POINTS_6).iter().map(of).sum();
            part = loop {
                let Some((triangle, next, sum)) = depth.checked_sub(1).and_then(|d| whole.get_mut(d)) else {
                    return mean;
                };
                *sum += 0.25 * mean;
                if *next < QUARTERS {
                    *next += 1;
                    break Path::default().step(*next - 1).corners(triangle);
                }
                mean = *sum;
                depth -= 1;
            };
        }
    }

    /// Where on a near target its light comes from on average, in its local coordinates: by its quarters.
    fn near_moment(&self, target: &Target) -> [f64; 2] {
        let (mut sum, mut moment) = (0.0, [0.0; 2]);
        for number in 0..QUARTERS {
            let part = Path::default().step(number).corners(&target.corners);
            let factor: f64 = self.quarters.iter().map(|q| self.point_factor(middle(q), &part, target)).sum();
            let (a, b) = quarter::out_of(number, (1.0 / 3.0, 1.0 / 3.0));
            sum += factor;
            moment[0] += factor * (a - 1.0 / 3.0);
            moment[1] += factor * (b - 1.0 / 3.0);
        }
        if sum > 0.0 { moment.map(|m| m / sum) } else { [0.0; 2] }
    }
}

/// Where on a triangle, in its local coordinates, light between it and a far point of this normal passes on average, by
/// the slope of cos cos'/r^2 over it.
fn lean(point: Vec3, normal: Vec3, corners: &[Vec3; 3], facing: Vec3) -> [f64; 2] {
    let [p, q, r] = *corners;
    let to = middle(corners) - point;
    let (square, own, other) = (to.dot(to), to.dot(normal), to.dot(facing));
    if square <= 0.0 || own <= 0.0 || other >= 0.0 {
        return [0.0; 2];
    }
    let slope = normal / own + facing / other - to * (4.0 / square);
    let (a, b) = (slope.dot(q - p), slope.dot(r - p));
    // mean squares of local coordinates are 1/18, their mean product -1/36; a third of the way to the sides at most
    [(2.0 * a - b) / 36.0, (2.0 * b - a) / 36.0].map(|m| clamp(m, -1.0 / 9.0, 1.0 / 9.0))
}

fn middle(triangle: &[Vec3; 3]) -> Vec3 {
    (triangle[0] + triangle[1] + triangle[2]) / 3.0
}

/// Distance of the farthest corner.
fn radius(triangle: &[Vec3; 3], from: Vec3) -> f64 {
    sqrt(triangle.iter().map(|c| (*c - from).length_squared()).fold(0.0, f64::max))
}

/// Distance of a point from a triangle.
fn distance(point: Vec3, triangle: &[Vec3; 3]) -> f64 {
    let [a, b, c] = *triangle;
    let normal = (b - a).cross(c - a);
    let inside = |p: Vec3, q: Vec3| (q - p).cross(point - p).dot(normal) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        let height = (point - a).dot(normal);
        return sqrt(height * height / normal.length_squared().max(f64::MIN_POSITIVE));
    }
    let to_side = |p: Vec3, q: Vec3| {
        let side = q - p;
        let along = (point - p).dot(side) / side.length_squared().max(f64::MIN_POSITIVE);
        (point - p - side * clamp(along, 0.0, 1.0)).length_squared()
    };
    sqrt(to_side(a, b).min(to_side(b, c)).min(to_side(c, a)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math::unit;
    use crate::base::qmc::hash2;
    use crate::form_factor::polygon_to_polygon;

    fn place(corners: [Vec3; 3], error: f64) -> (Receiver, Rules) {
        let normal = unit((corners[1] - corners[0]).cross(corners[2] - corners[0])).unwrap();
        (Receiver { facet: 0, side: 0, normal, corners }, Rules::new(error))
    }

    /// The mean over a triangle of the factor to another, by this module and in closed form.
    fn both(a: [Vec3; 3], b: [Vec3; 3], error: f64) -> (f64, f64) {
        let (receiver, rules) = place(a, error);
        let normal = unit((b[1] - b[0]).cross(b[2] - b[0])).unwrap();
        let target = Target { unknown: 0, corners: b, normal, glows: true, mirror: None };
        let quarters = [0, 1, 2, 3].map(|q| Path::default().step(q).corners(&a));
        let place = Place { receiver: &receiver, quarters, rules, middle: middle(&a) };
        let own = place.quarters.iter().map(|q| 0.25 * place.mean(q, &target)).sum();
        (own, polygon_to_polygon(&a, &b))
    }

    #[test]
    fn quadrature_keeps_its_error_whatever_the_distance() {
        let random = |i: u32, k: u32| f64::from(hash2(i, k)) / f64::from(u32::MAX);
        for error in [1e-3, 1e-4, 2e-5] {
            let (mut worst, mut touching): (f64, f64) = (0.0, 0.0);
            for i in 0..300 {
                let point = |k: u32| Vec3::new(random(i, 3 * k), random(i, 3 * k + 1), random(i, 3 * k + 2));
                let a = [Vec3::ZERO, Vec3::new(0.5 + random(i, 90), 0.0, 0.0), Vec3::new(0.3, 1.0, 0.0)];
                let up = Vec3::Z * (0.02 + 2.0 * random(i, 91));
                let b = [point(0) + up, point(2) + up, point(1) + up];
                let (own, exact) = both(a, b, error);
                worst = worst.max((own - exact).abs());
                // a wall on one of its sides
                let wall = [a[1], a[0], Vec3::new(random(i, 92), 0.3 * random(i, 93), 0.2 + random(i, 94))];
                let (own, exact) = both(a, wall, error);
                touching = touching.max((own - exact).abs());
            }
            // cuts end where sub-triangles beside a common edge hold some 1e-5 of the factor
            assert!(worst < 0.5 * error && touching < error, "{error:e}: {worst:e} {touching:e}");
        }
    }
}
