//! Form factors reach the closed forms of the radiative-transfer catalogues, and keep the identities.
//!
//! Values: `tests/data/cases`, most from J. R. Howell's catalogue of configuration factors, each found by two
//! methods that agree to 2e-14 or better.

mod support;

use blik_kernel::form_factor::{
    TRIANGLE_LANES, TriangleBlock, exchange_area, point_to_polygon, point_to_triangle, point_to_triangles,
    polygon_to_polygon,
};
use blik_kernel::math::Vec3;
use blik_kernel::simd::Isa;
use proptest::prelude::*;
use support::{cases, npy, random::repeatable, scenes};

fn v(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

/// x0..x1 by y0..y1 at height z, facing up.
fn floor(x: [f64; 2], y: [f64; 2], z: f64) -> [Vec3; 4] {
    [v(x[0], y[0], z), v(x[1], y[0], z), v(x[1], y[1], z), v(x[0], y[1], z)]
}

/// The same, facing down.
fn ceiling(x: [f64; 2], y: [f64; 2], z: f64) -> [Vec3; 4] {
    let [a, b, c, d] = floor(x, y, z);
    [d, c, b, a]
}

/// Rectangle on the edge x = 0, 0 <= y <= 1 of the floor x > 0, raised by an angle from it; faces the floor.
fn wall(h: f64, angle_deg: f64) -> [Vec3; 4] {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    [v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(h * cos, 1.0, h * sin), v(h * cos, 0.0, h * sin)]
}

const UNIT: [f64; 2] = [0.0, 1.0];

#[track_caller]
fn close(id: &str, got: f64, want: f64, relative: f64) {
    let off = got / want - 1.0;
    assert!(off.abs() <= relative, "{id}: {got:e}, expected {want:e}, off {off:e}");
}

/// Compares with the reference value of the case `id`.
#[track_caller]
fn reach(id: &str, got: f64, relative: f64) {
    close(id, got, cases::value(id), relative);
}

/// Separated pairs: 1e-10, what the routine promises.
#[test]
fn separated_polygons() {
    for (id, b, c) in [
        ("FF-C11-1x1@1.0", 1.0, 1.0),
        ("FF-C11-1x2@1.0", 2.0, 1.0),
        ("FF-C11-1x1@0.1", 1.0, 0.1),
        ("FF-C11-1x1@10.0", 1.0, 10.0),
        ("FF-C11-1x1@0.001", 1.0, 0.001),
        ("FF-C11-1x1@1.0e-6", 1.0, 1e-6),
        ("FF-C11-1x1@1.0e+4", 1.0, 1e4),
    ] {
        let (low, high) = (floor(UNIT, [0.0, b], 0.0), ceiling(UNIT, [0.0, b], c));
        reach(id, polygon_to_polygon(&low, &high), 1e-10);
        assert_eq!(polygon_to_polygon(&high, &low), polygon_to_polygon(&low, &high), "{id}");
    }
    let shifted = ceiling([1.0, 2.0], UNIT, 1.0);
    reach("FF-OFF-1", polygon_to_polygon(&floor(UNIT, UNIT, 0.0), &shifted), 1e-10);
    let up = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let down = [v(0.0, 0.0, 1.0), v(0.0, 1.0, 1.0), v(1.0, 0.0, 1.0)];
    reach("FF-TRI-1", polygon_to_polygon(&up, &down), 1e-10);
    let crossing = [v(2.0, 0.0, -1.0), v(2.0, 0.0, 1.0), v(2.0, 1.0, 1.0), v(2.0, 1.0, -1.0)];
    reach("FF-CLIP", polygon_to_polygon(&floor(UNIT, UNIT, 0.0), &crossing), 1e-10);
    for (id, width) in [("FF-NEEDLE-1e-3", 1e-3), ("FF-NEEDLE-1e-6", 1e-6)] {
        let (sliver, square) = (floor([0.0, width], UNIT, 0.0), ceiling(UNIT, UNIT, 1.0));
        reach(id, polygon_to_polygon(&sliver, &square), 1e-10);
        close(id, exchange_area(&square, &sliver), cases::value(id) * width, 1e-10);
    }
}

/// Touching pairs: 1e-9, what the routine promises.
#[test]
fn polygons_that_share_an_edge() {
    for (id, w, h) in [
        ("FF-C14-l1w1.0h1.0", 1.0, 1.0),
        ("FF-C14-l1w2.0h0.5", 2.0, 0.5),
        ("FF-C14-l1w1.0h0.0001", 1.0, 1e-4),
    ] {
        reach(id, polygon_to_polygon(&floor([0.0, w], UNIT, 0.0), &wall(h, 90.0)), 1e-9);
    }
    for (id, angle) in [("FF-C16-30", 30.0), ("FF-C16-60", 60.0), ("FF-C16-135", 135.0)] {
        reach(id, polygon_to_polygon(&floor(UNIT, UNIT, 0.0), &wall(1.0, angle)), 1e-9);
    }
    let flat = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let upright = [v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(0.0, 0.0, 1.0)];
    reach("FF-TRI-3", polygon_to_polygon(&flat, &upright), 1e-9);
    let corners = [v(1.0, 1.0, 1.0), v(1.0, -1.0, -1.0), v(-1.0, 1.0, -1.0), v(-1.0, -1.0, 1.0)];
    let faces = inward_faces(&corners, &[&[0, 1, 2], &[0, 1, 3], &[0, 2, 3], &[1, 2, 3]]);
    reach("FF-TETRA", polygon_to_polygon(&faces[0], &faces[3]), 1e-9);
}

/// The closed-form factors among the 192 quadrilaterals of a corner of three squares, 8 x 8 each: touching,
/// near, and far. 1e-9 as they touch; zeros within a wall are exact.
#[test]
fn quadrilaterals_of_a_corner() {
    let (mesh, _) = scenes::read_obj(&support::data("references/meshes/corner.obj"));
    let quads: Vec<Vec<Vec3>> =
        (0..192).map(|q| joined(mesh.corners(2 * q), mesh.corners(2 * q + 1))).collect();
    let exact = npy::read_npz::<f64>(&support::data("references/corner_quads_exact.npz"), "F");
    assert_eq!(exact.shape, [192, 192]);
    for (a, row) in quads.iter().zip(exact.values.chunks(192)) {
        for (b, want) in quads.iter().zip(row) {
            let got = polygon_to_polygon(a, b);
            assert!((got - want).abs() <= 1e-9 * want, "{a:?} {b:?}: {got:e}, expected {want:e}");
        }
    }
}

/// The quadrilateral of two triangles that share a diagonal.
fn joined(a: [Vec3; 3], b: [Vec3; 3]) -> Vec<Vec3> {
    let mut corners = vec![];
    for k in 0..3 {
        let (from, to) = (a[k], a[(k + 1) % 3]);
        corners.push(from);
        if b.contains(&from) && b.contains(&to) {
            corners.extend(b.iter().filter(|c| **c != from && **c != to));
        }
    }
    corners
}

/// A point's factor has a closed form without quadrature: a few roundings are left.
#[test]
fn points() {
    let up = v(0.0, 0.0, 1.0);
    let above = ceiling([0.0, 1.0], [0.0, 2.0], 1.0);
    reach("FF-B3", point_to_polygon(Vec3::ZERO, up, &above), 1e-14);
    let upright = [v(1.0, 0.0, 0.0), v(1.0, 0.0, 1.0), v(1.0, 1.0, 1.0), v(1.0, 1.0, 0.0)];
    reach("FF-B4", point_to_polygon(Vec3::ZERO, up, &upright), 1e-14);
    let sunk = upright.map(|c| if c.z == 0.0 { c - up * 3.0 } else { c });
    close("FF-B4, sunk", point_to_polygon(Vec3::ZERO, up, &sunk), cases::value("FF-B4"), 1e-14);
    let [a, b, c, d] = sunk;
    let halves = [[a, b, c], [c, d, a]].map(|t| point_to_triangle(Vec3::ZERO, up, &t));
    close("FF-B4, sunk halves", halves.iter().sum(), cases::value("FF-B4"), 1e-14);
    // Small and far, cos cos' A / (pi r^2): the next term of the expansion is 1e-12 of it, rounding 1e6 eps.
    let far = floor([1e6, 1e6 + 1.0], UNIT, 1e6);
    let centre = v(1e6 + 0.5, 0.5, 1e6);
    let want = centre.z * centre.z / (std::f64::consts::PI * centre.length_squared().powi(2));
    close("far", point_to_polygon(Vec3::ZERO, up, &far), want, 1e-9);
}

#[test]
fn what_a_point_cannot_see_is_zero() {
    let up = v(0.0, 0.0, 1.0);
    let square = floor(UNIT, UNIT, 0.0);
    let below = floor(UNIT, UNIT, -1.0);
    for (what, p, polygon) in [
        ("in the plane, inside", v(0.3, 0.4, 0.0), &square[..]),
        ("in the plane, outside", v(3.0, 0.4, 0.0), &square),
        ("on an edge", v(0.5, 0.0, 0.0), &square),
        ("on a corner", v(0.0, 0.0, 0.0), &square),
        ("below the horizon", v(0.5, 0.5, 0.0), &below),
        ("nothing", v(0.5, 0.5, 0.0), &[]),
        ("two corners", v(0.5, 0.5, -1.0), &square[..2]),
    ] {
        assert_eq!(point_to_polygon(p, up, polygon), 0.0, "{what}");
    }
    let [a, b, c, _] = ceiling(UNIT, UNIT, 1e-12);
    // So near that it fills the hemisphere, but for the square of 1e-12 over the distance to the edges.
    close("close above", point_to_triangle((a + b + c) / 3.0 - up * 1e-12, up, &[a, b, c]), 1.0, 1e-10);
}

/// The faces of a convex body, each turned so that its front faces inward.
fn inward_faces(corners: &[Vec3], faces: &[&[usize]]) -> Vec<Vec<Vec3>> {
    let centre = corners.iter().sum::<Vec3>() / corners.len() as f64;
    let turned = |face: &&[usize]| {
        let mut face: Vec<Vec3> = face.iter().map(|&k| corners[k]).collect();
        if (face[1] - face[0]).cross(face[2] - face[0]).dot(centre - face[0]) < 0.0 {
            face.reverse();
        }
        face
    };
    faces.iter().map(turned).collect()
}

/// Every face of a closed convex body sees the others and nothing else: 1e-10, what the routine promises.
fn rows_close(faces: &[Vec<Vec3>]) -> Result<(), TestCaseError> {
    for a in faces {
        let row: f64 = faces.iter().map(|b| polygon_to_polygon(a, b)).sum();
        prop_assert!((row - 1.0).abs() < 1e-10, "row sum {row}, off {:e}", row - 1.0);
    }
    Ok(())
}

fn vector(size: f64) -> impl Strategy<Value = Vec3> {
    [-size..size, -size..size, -size..size].prop_map(Vec3::from_array)
}

fn triangle() -> impl Strategy<Value = [Vec3; 3]> {
    [vector(1.0), vector(1.0), vector(1.0)]
}

/// Corners on a coarse grid: coincident, collinear, coplanar, touching and crossing polygons are common.
fn grid_polygon() -> impl Strategy<Value = Vec<Vec3>> {
    let corner = (-2i32..3, -2i32..3, -1i32..2, 0i32..3).prop_map(|(x, y, z, tiny)| {
        v(f64::from(x), f64::from(y), f64::from(z)) + v(1e-9, -1e-15, 1e-12) * f64::from(tiny)
    });
    prop::collection::vec(corner, 0..6)
}

/// Gauss points and weights on [0, 1], five nodes.
const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668, 0.118463442528095),
    (0.230765344947158, 0.239314335249683),
    (0.5, 0.284444444444444),
    (0.769234655052842, 0.239314335249683),
    (0.953089922969332, 0.118463442528095),
];

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn tetrahedra_close(corners in [vector(1.0), vector(1.0), vector(1.0), vector(1.0)]) {
        let [a, b, c, d] = corners;
        prop_assume!((b - a).cross(c - a).dot(d - a).abs() > 0.05);
        rows_close(&inward_faces(&corners, &[&[0, 1, 2], &[0, 1, 3], &[0, 2, 3], &[1, 2, 3]]))?;
    }

    #[test]
    fn parallelepipeds_close(o in vector(5.0), x in vector(1.0), y in vector(1.0), z in vector(1.0)) {
        prop_assume!(x.cross(y).dot(z).abs() > 0.05);
        let corner = |k| o + x * f64::from(k & 1) + y * f64::from(k >> 1 & 1) + z * f64::from(k >> 2);
        let corners: Vec<Vec3> = (0..8).map(corner).collect();
        let faces: [&[usize]; 6] =
            [&[0, 1, 3, 2], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 3, 7, 6], &[0, 2, 6, 4], &[1, 3, 7, 5]];
        rows_close(&inward_faces(&corners, &faces))?;
    }

    /// A drum: its lids have more corners than the routine keeps in one piece.
    #[test]
    fn drums_close(sides in 9usize..20, height in 0.1..3.0f64) {
        let ring = |z: f64| (0..sides).map(move |k| {
            let (s, c) = (k as f64 / sides as f64 * std::f64::consts::TAU).sin_cos();
            v(c, s, z)
        });
        let corners: Vec<Vec3> = ring(0.0).chain(ring(height)).collect();
        let lids = [(0..sides).collect::<Vec<_>>(), (sides..2 * sides).collect()];
        let walls = (0..sides).map(|k| vec![k, (k + 1) % sides, sides + (k + 1) % sides, sides + k]);
        let faces: Vec<Vec<usize>> = lids.into_iter().chain(walls).collect();
        let faces: Vec<&[usize]> = faces.iter().map(Vec::as_slice).collect();
        rows_close(&inward_faces(&corners, &faces))?;
    }

    /// The same bits whichever is named first, and never more than the smaller area.
    #[test]
    fn exchange_areas_are_symmetric_and_bounded(a in triangle(), b in triangle(), shift in vector(30.0)) {
        let area = |t: &[Vec3; 3]| 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).length();
        for b in [b, b.map(|c| c + shift)] {
            let exchange = exchange_area(&a, &b);
            prop_assert_eq!(exchange, exchange_area(&b, &a));
            prop_assert!((0.0..=area(&a).min(area(&b)) * (1.0 + 1e-15)).contains(&exchange));
            prop_assert!((polygon_to_polygon(&a, &b) * area(&a) - exchange).abs() <= 1e-15 * area(&a));
        }
    }

    /// Cutting a polygon in two changes nothing, though other rules and other panels are at work: to 1e-10 for
    /// separated pairs, but for rounding against the perimeters where they see each other edge-on.
    #[test]
    fn parts_add_up(a in triangle(), b in triangle(), shift in vector(12.0), cut in 0.01..0.99f64) {
        let b = b.map(|c| c + shift);
        let middle = b[1] + (b[2] - b[1]) * cut;
        let whole = exchange_area(&a, &b);
        let parts = exchange_area(&a, &[b[0], b[1], middle]) + exchange_area(&a, &[b[0], middle, b[2]]);
        prop_assert!((whole - parts).abs() <= 1e-10 * whole + 1e-14, "{whole:e} {:e}", parts / whole - 1.0);
    }

    /// Moving and scaling both polygons changes nothing but by the rounding of their corners.
    #[test]
    fn rigid_motion_and_scale_change_nothing(
        a in triangle(), b in triangle(), shift in vector(3.0), x in vector(1.0), y in vector(1.0),
        scale in -30i32..30,
    ) {
        prop_assume!(x.cross(y).length() > 0.1);
        let (x, z) = (x.normalize(), x.cross(y).normalize());
        let y = z.cross(x);
        let b = b.map(|c| c + shift);
        let moved = |c: Vec3| ((x * c.x + y * c.y + z * c.z) + shift) * 10f64.powi(scale);
        let (before, after) = (polygon_to_polygon(&a, &b), polygon_to_polygon(&a.map(moved), &b.map(moved)));
        prop_assert!((before - after).abs() <= 1e-12 + 1e-9 * before, "{before:e} {after:e}");
    }

    /// The factor from a polygon is the mean of the factors from its points.
    #[test]
    fn a_polygon_is_the_mean_of_its_points(a in triangle(), b in triangle(), shift in vector(1.0)) {
        prop_assume!(shift.length() > 0.3);
        let b = b.map(|c| c + shift.normalize() * 7.0);
        let normal = (a[1] - a[0]).cross(a[2] - a[0]);
        let behind = |p: &Vec3| (*p - b[0]).dot((b[1] - b[0]).cross(b[2] - b[0])) <= 0.0;
        prop_assume!(normal.length() > 0.1 && !a.iter().any(behind));
        prop_assume!(b.iter().all(|c| (*c - a[0]).dot(normal) > 0.0));
        let mut mean = 0.0;
        for (s, ws) in GAUSS {
            for (t, wt) in GAUSS {
                let p = a[0] + (a[1] - a[0]) * s + (a[2] - a[1]) * (s * t);
                mean += 2.0 * s * ws * wt * point_to_triangle(p, normal.normalize(), &b);
            }
        }
        // Five points each way at a distance of at least twice the size: (1/4)^9.
        let factor = polygon_to_polygon(&a, &b);
        prop_assert!((mean - factor).abs() <= 1e-5 * factor + 1e-14, "{mean:e} {factor:e}");
    }

    /// On every instruction set the same bits, and the scalar routine's value: both round numbers up to pi/2 pi
    /// a dozen times.
    #[test]
    fn batches_agree_with_single_triangles(triangles in prop::collection::vec(triangle(), 3 * TRIANGLE_LANES)) {
        let n = v(0.0, 0.0, 1.0);
        let p = v(0.1, -0.2, -1.01);
        let mut blocks = [TriangleBlock::EMPTY; 4];
        for (k, t) in triangles.iter().enumerate() {
            blocks[k / TRIANGLE_LANES].set(k % TRIANGLE_LANES, t);
        }
        let (mut wide, mut narrow) = ([[-1.0; TRIANGLE_LANES]; 4], [[-1.0; TRIANGLE_LANES]; 4]);
        point_to_triangles(Isa::detect(), p, n, &blocks, &mut wide);
        point_to_triangles(Isa::BASELINE, p, n, &blocks, &mut narrow);
        prop_assert_eq!(wide, narrow);
        for (got, t) in wide.iter().flatten().zip(&triangles) {
            prop_assert!((got - point_to_triangle(p, n, t)).abs() <= 1e-15);
        }
        prop_assert_eq!(wide[3], [0.0; TRIANGLE_LANES]);
    }

    #[test]
    fn degenerate_input_gives_numbers(
        a in grid_polygon(), b in grid_polygon(), p in vector(2.0),
        scale in prop::sample::select(&[1.0, 1e-200, 1e-80, 1e80, 1e200, 1e307][..]),
    ) {
        let scaled = |t: &[Vec3]| t.iter().map(|c| *c * 0.3 * scale).collect::<Vec<_>>();
        let (a, b) = (scaled(&a), scaled(&b));
        let n = v(0.6, 0.0, 0.8);
        for p in [p * scale, Vec3::ZERO, *a.first().unwrap_or(&p)] {
            prop_assert!((0.0..=1.0).contains(&point_to_polygon(p, n, &b)));
        }
        prop_assert!((0.0..=1.0).contains(&polygon_to_polygon(&a, &b)));
        let exchange = exchange_area(&a, &b);
        prop_assert!(exchange >= 0.0 && exchange.is_finite());
        prop_assert_eq!(exchange, exchange_area(&b, &a));
    }
}
