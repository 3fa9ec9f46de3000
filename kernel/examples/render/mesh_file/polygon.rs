//! Polygons to triangles: a fan where convex, ear clipping where not.
//!
//! A polygon's triangles cover each point as often as its outline winds round it, as long as all of them turn the same
//! way: that is what tells a polygon that crosses itself.

use glam::{DVec2, DVec3};

/// Three corners, as indices into the polygon, in its sense of rotation.
#[derive(Debug, PartialEq)]
pub struct Triangle(pub [usize; 3]);

/// What the triangles of a polygon are worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// They are the polygon.
    Simple,
    /// It crosses itself, and some of them are without meaning.
    Crossing,
}

/// A turn this far (as a sine) to the wrong side is the rounding of a file's decimals or f32, not a notch; so is an area
/// this small beside the polygon's.
const ROUNDING: f64 = 1e-6;
/// Area over the square of the extent below which a polygon has none: the rounding of its sum.
const NO_AREA: f64 = 1e-13;

/// Appends the polygon's triangles: two less than its corners, without those corners that repeat the one before or are the
/// tip of a whisker, an edge that runs back over itself. A polygon without area keeps all corners.
pub fn triangulate(points: &[[f64; 3]], triangles: &mut Vec<Triangle>) -> Shape {
    let n = points.len();
    let fan = |corners: &[usize]| {
        (2..corners.len()).map(|i| Triangle([corners[0], corners[i - 1], corners[i]])).collect::<Vec<_>>()
    };
    let all: Vec<usize> = (0..n).collect();
    if n <= 3 {
        triangles.extend(fan(&all));
        return Shape::Simple;
    }
    let Some(flat) = project(points) else {
        triangles.extend(fan(&all));
        return if is_line(points) { Shape::Simple } else { Shape::Crossing };
    };
    let area: f64 = (0..n).map(|i| flat[i].perp_dot(flat[(i + 1) % n])).sum();
    let outline = Outline { flat: &flat, least: ROUNDING * area };
    let corners = outline.simplified(all);
    let start = triangles.len();
    if outline.is_convex(&corners) {
        triangles.extend(fan(&corners));
    } else {
        outline.clip_ears(corners, triangles);
    }
    let crosses = triangles[start..].iter().any(|Triangle(t)| outline.doubled_area(*t) < -outline.least);
    if crosses { Shape::Crossing } else { Shape::Simple }
}

/// The polygon in its own plane (normal by Newell's sum), counter-clockwise; `None` where it has no area.
fn project(points: &[[f64; 3]]) -> Option<Vec<DVec2>> {
    let local = local(points);
    let normal: DVec3 = local.iter().zip(local.iter().cycle().skip(1)).map(|(a, b)| a.cross(*b)).sum();
    let extent = local.iter().map(|p| p.length_squared()).fold(0.0, f64::max);
    if normal.length() <= NO_AREA * extent {
        return None;
    }
    let (x, y) = normal.try_normalize()?.any_orthonormal_pair();
    Some(local.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect())
}

/// Relative to a corner: a mesh far from the origin keeps its digits.
fn local(points: &[[f64; 3]]) -> Vec<DVec3> {
    let origin = DVec3::from(points[0]);
    points.iter().map(|p| DVec3::from(*p) - origin).collect()
}

/// Whether all corners lie on one line.
fn is_line(points: &[[f64; 3]]) -> bool {
    let local = local(points);
    let Some(far) = local.iter().copied().max_by(|a, b| a.length().total_cmp(&b.length())) else {
        return true;
    };
    local.iter().all(|p| p.cross(far).length() <= ROUNDING * far.length_squared())
}

struct Outline<'a> {
    flat: &'a [DVec2],
    /// Twice the area that does not count.
    least: f64,
}

impl Outline<'_> {
    fn doubled_area(&self, [a, b, c]: [usize; 3]) -> f64 {
        (self.flat[b] - self.flat[a]).perp_dot(self.flat[c] - self.flat[a])
    }

    /// Sine and cosine of the turn from a-b to b-c; `None` where two of them coincide.
    fn turn(&self, [a, b, c]: [usize; 3]) -> Option<(f64, f64)> {
        let (u, v) = (self.flat[b] - self.flat[a], self.flat[c] - self.flat[b]);
        let lengths = u.length() * v.length();
        (lengths > 0.0).then(|| (u.perp_dot(v) / lengths, u.dot(v) / lengths))
    }

    /// Whether b repeats a or is the tip of a whisker.
    fn is_superfluous(&self, corner: [usize; 3]) -> bool {
        let tip = |(sine, cosine): (f64, f64)| {
            cosine < 0.0 && sine.abs() <= ROUNDING && self.doubled_area(corner).abs() <= self.least
        };
        self.flat[corner[0]] == self.flat[corner[1]] || self.turn(corner).is_some_and(tip)
    }

    /// The corners without superfluous ones; all of them where fewer than three were left.
    fn simplified(&self, all: Vec<usize>) -> Vec<usize> {
        let mut rest = all.clone();
        let (mut at, mut passed) = (0, 0);
        while rest.len() >= 3 && passed < rest.len() {
            let n = rest.len();
            at %= n;
            if self.is_superfluous([rest[(at + n - 1) % n], rest[at], rest[(at + 1) % n]]) {
                rest.remove(at);
                // Its neighbours may have become superfluous.
                at = (at + n - 2) % (n - 1);
                passed = 0;
            } else {
                at += 1;
                passed += 1;
            }
        }
        if rest.len() < 3 { all } else { rest }
    }

    /// Whether the outline turns left at every corner, and once round in all.
    fn is_convex(&self, corners: &[usize]) -> bool {
        let n = corners.len();
        let mut angle = 0.0;
        for i in 0..n {
            let turn = self.turn([corners[i], corners[(i + 1) % n], corners[(i + 2) % n]]);
            let (sine, cosine) = turn.unwrap_or((0.0, 1.0));
            if sine < -ROUNDING {
                return false;
            }
            angle += sine.atan2(cosine);
        }
        angle < 3.0 * std::f64::consts::PI
    }

    fn clip_ears(&self, mut rest: Vec<usize>, triangles: &mut Vec<Triangle>) {
        let mut at = 0;
        while rest.len() > 3 {
            let n = rest.len();
            let corner = |i: usize| [rest[(i + n - 1) % n], rest[i % n], rest[(i + 1) % n]];
            // Corners on an ear's edge spoil it only where there is no other ear.
            let free = |least: f64| (at..at + n).find(|i| self.is_ear(&rest, corner(*i), least));
            let found = free(0.0).or_else(|| free(self.least));
            // Between the two sides of a slit nothing is left but corners without area.
            let found =
                found.or_else(|| (at..at + n).find(|i| self.doubled_area(corner(*i)).abs() <= self.least));
            // A polygon that crosses itself may have neither: its sharpest corner then.
            let sharpness = |i: &usize| self.turn(corner(*i)).map_or(0.0, |turn| turn.0);
            let sharpest = || (0..n).max_by(|i, j| sharpness(i).total_cmp(&sharpness(j))).unwrap_or(0);
            let ear = found.unwrap_or_else(sharpest) % n;
            if !self.is_superfluous(corner(ear)) {
                triangles.push(Triangle(corner(ear)));
            }
            rest.remove(ear);
            at = ear % (n - 1);
        }
        if let [a, b, c] = rest[..] {
            triangles.push(Triangle([a, b, c]));
        }
    }

    /// Whether the corner turns left and no other corner of the rest lies deeper than `least` in its triangle.
    fn is_ear(&self, rest: &[usize], ear: [usize; 3], least: f64) -> bool {
        let [a, b, c] = ear;
        if self.doubled_area(ear) <= 0.0 {
            return false;
        }
        !rest.iter().filter(|i| !ear.contains(i)).any(|&p| {
            // A corner that touches an ear's corner (the seam to a hole) does not spoil it.
            let touches = ear.iter().any(|i| self.flat[*i] == self.flat[p]);
            !touches && [[a, b, p], [b, c, p], [c, a, p]].iter().all(|t| self.doubled_area(*t) >= least)
        })
    }
}
