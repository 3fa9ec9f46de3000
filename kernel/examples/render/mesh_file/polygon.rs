//! Polygons to triangles: a fan where convex, ear clipping where not.

use glam::{DVec2, DVec3};

/// Three corners, as indices into the polygon, in its sense of rotation.
#[derive(Debug, PartialEq)]
pub struct Triangle(pub [usize; 3]);

/// A turn this far (as a sine) to the wrong side is the rounding of a file's decimals or f32, not a notch.
const ROUNDING: f64 = 1e-6;

/// Appends the `points.len() - 2` triangles of the polygon.
///
/// A polygon that crosses itself, or has no area, gives as many triangles, some of them without meaning.
pub fn triangulate(points: &[[f64; 3]], triangles: &mut Vec<Triangle>) {
    let n = points.len();
    if n > 3 {
        let flat = project(points);
        if (0..n).any(|i| turn(&flat, i, (i + 1) % n, (i + 2) % n) < -ROUNDING) {
            return clip_ears(&flat, triangles);
        }
    }
    triangles.extend((2..n).map(|i| Triangle([0, i - 1, i])));
}

/// The polygon in its own plane (normal by Newell's sum), counter-clockwise.
fn project(points: &[[f64; 3]]) -> Vec<DVec2> {
    let origin = DVec3::from(points[0]);
    // Relative to a corner: a mesh far from the origin keeps its digits.
    let local: Vec<DVec3> = points.iter().map(|p| DVec3::from(*p) - origin).collect();
    let normal: DVec3 = local.iter().zip(local.iter().cycle().skip(1)).map(|(a, b)| a.cross(*b)).sum();
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    let (x, y) = normal.any_orthonormal_pair();
    local.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect()
}

/// Sine of the turn from a-b to b-c; 0 where two of them coincide.
fn turn(flat: &[DVec2], a: usize, b: usize, c: usize) -> f64 {
    let (u, v) = (flat[b] - flat[a], flat[c] - flat[b]);
    let lengths = u.length() * v.length();
    if lengths > 0.0 { u.perp_dot(v) / lengths } else { 0.0 }
}

fn clip_ears(flat: &[DVec2], triangles: &mut Vec<Triangle>) {
    let mut rest: Vec<usize> = (0..flat.len()).collect();
    while rest.len() > 3 {
        let n = rest.len();
        let corner = |i: usize| [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
        let ear = (0..n).find(|i| is_ear(flat, &rest, corner(*i)));
        // A polygon that crosses itself may have no ear: its sharpest corner then.
        let ear = ear.unwrap_or_else(|| {
            let sharpness = |i: usize| corner_turn(flat, corner(i));
            (0..n).max_by(|i, j| sharpness(*i).total_cmp(&sharpness(*j))).unwrap_or(0)
        });
        triangles.push(Triangle(corner(ear)));
        rest.remove(ear);
    }
    triangles.push(Triangle([rest[0], rest[1], rest[2]]));
}

fn corner_turn(flat: &[DVec2], [a, b, c]: [usize; 3]) -> f64 {
    turn(flat, a, b, c)
}

/// Whether the corner turns left and no other corner of the rest lies in its triangle.
fn is_ear(flat: &[DVec2], rest: &[usize], [a, b, c]: [usize; 3]) -> bool {
    if corner_turn(flat, [a, b, c]) <= 0.0 {
        return false;
    }
    let side = |p: usize, q: usize, r: DVec2| (flat[q] - flat[p]).perp_dot(r - flat[p]);
    !rest.iter().filter(|i| ![a, b, c].contains(i)).map(|i| flat[*i]).any(|p| {
        // A corner that touches an ear's corner (the seam to a hole) does not spoil it.
        let touches = [a, b, c].iter().any(|i| flat[*i] == p);
        !touches && side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0
    })
}
