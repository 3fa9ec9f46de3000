//! Bodies become primitives.

use super::{Body, BodyInput, Primitive, Shape, segments};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::plane::{Vec2, length};

/// Lays out one body's primitives; counts its elements on.
pub(super) fn lay_out(
    input: &BodyInput<'_>,
    body: usize,
    first: usize,
    elements: &mut u32,
    out: &mut [Primitive],
) -> Result<Body, Error> {
    let material = input.material as u32;
    let count = out.len() as u32;
    let mut kept = Body { first: first as u32, count, closed: 1, material, ..Body::default() };
    for (i, p) in out.iter_mut().enumerate() {
        *p = match input.shape {
            Shape::Circle { centre, radius } => {
                Primitive { a: centre, b: [radius, 0.0], ..Primitive::default() }
            }
            Shape::Polyline { points, smooth, .. } => {
                Primitive { kind: 1, smooth: u32::from(smooth), ..segment(&input.shape, points, i) }
            }
        };
        *p = Primitive { body: body as u32, material, elements: input.elements, first: *elements, ..*p };
        let limit = 1 << 26;
        *elements = elements.saturating_add(input.elements);
        if *elements > limit {
            return Err(Error::TooMany { what: "elements", limit: limit as usize });
        }
    }
    match input.shape {
        Shape::Circle { centre, radius } => (kept.centre, kept.radius) = (centre, radius),
        Shape::Polyline { points, closed, .. } => {
            kept.closed = u32::from(closed);
            let sum = points.iter().fold(Vec2::ZERO, |sum, &p| sum + Vec2::from(p) / points.len() as f64);
            let radius = points.iter().fold(0.0, |r: f64, &p| r.max(length(Vec2::from(p) - sum)));
            (kept.centre, kept.radius) = (sum.to_array(), radius * (1.0 + 1e-12));
        }
    }
    Ok(kept)
}

/// Segment `i` of a polyline with its normals.
fn segment(shape: &Shape<'_>, points: &[[f64; 2]], i: usize) -> Primitive {
    let (n, count) = (points.len(), segments(shape));
    let ends =
        |i: usize| (Vec2::from(points.at(i)), Vec2::from(points.at(if i + 1 < n { i + 1 } else { 0 })));
    let normal = |i: usize| {
        let (a, b) = ends(i);
        let d = b - a;
        Vec2::new(d.y, -d.x) / length(d)
    };
    let between = |i: usize, j: usize| {
        let sum = normal(i) + normal(j);
        let size = length(sum);
        if size > 1e-9 { sum / size } else { normal(i) }
    };
    let closed = count == n;
    let before = if i > 0 { i - 1 } else { if closed { n - 1 } else { 0 } };
    let after = if i + 1 < count { i + 1 } else { if closed { 0 } else { i } };
    let (a, b) = ends(i);
    Primitive {
        a: a.to_array(),
        b: b.to_array(),
        normal: normal(i).to_array(),
        start_normal: between(before, i).to_array(),
        end_normal: between(i, after).to_array(),
        ..Primitive::default()
    }
}
