//! Form factors with opaque triangles in the way: closed forms, closure of a furnished room, limits.

mod support;

use blik_kernel::Error;
use blik_kernel::form_factor::{
    Convex, point_to_polygon, polygon_to_polygon, visible_point_to_polygon, visible_polygon_to_polygon,
};
use blik_kernel::math::Vec3;
use proptest::prelude::*;
use support::{cases, random::repeatable};

fn v(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

/// A rectangle at height z, facing up, as a polygon and as two triangles.
fn level(x: [f64; 2], y: [f64; 2], z: f64) -> ([Vec3; 4], [[Vec3; 3]; 2]) {
    let [a, b, c, d] = [v(x[0], y[0], z), v(x[1], y[0], z), v(x[1], y[1], z), v(x[0], y[1], z)];
    ([a, b, c, d], [[a, b, c], [a, c, d]])
}

/// Unit squares at z = 0 and 1 with a rectangle between: the values are exact (two-dimensional convolution of
/// the unobstructed kernel, agreeing with a clipped projection to 7e-17). 1e-6 of the value is asked for, the
/// tolerance handed over is a sixth of it.
#[test]
fn squares_with_a_rectangle_between() {
    let (low, _) = level([0.0, 1.0], [0.0, 1.0], 0.0);
    let (mut high, _) = level([0.0, 1.0], [0.0, 1.0], 1.0);
    high.reverse();
    for (id, x, y, z) in [
        ("FF-OBST-1", [0.25, 0.75], [0.25, 0.75], 0.5),
        ("FF-OBST-2", [0.25, 0.75], [0.25, 0.75], 0.25),
        ("FF-OBST-4", [0.0, 0.5], [0.0, 0.25], 0.5),
    ] {
        let want = cases::value(id);
        let (_, blocker) = level(x, y, z);
        let mut scratch = [Convex::EMPTY; 32];
        let got = visible_polygon_to_polygon(&low, &high, &blocker, want * 1e-6 / 6.0, &mut scratch).unwrap();
        assert!((got.value / want - 1.0).abs() < 1e-6, "{id}: {}, expected {want}", got.value);
        assert!(
            (got.value - want).abs() < got.error && got.error < want * 1e-6,
            "{id}: error {:e}",
            got.error
        );
    }
}

#[test]
fn what_hides_nothing() {
    let (p, n) = (v(0.3, 0.4, 0.0), v(0.0, 0.0, 1.0));
    let (polygon, itself) = level([0.0, 1.0], [0.0, 1.0], 1.0);
    let whole = point_to_polygon(p, n, &polygon);
    let beyond = [v(0.0, 0.0, 1.5), v(2.0, 0.0, 1.5), v(0.0, 2.0, 1.5)];
    let edge_on = [v(0.3, 0.4, 0.2), v(0.3, 0.4, 0.5), v(0.9, 0.4, 0.5)];
    let receiver = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let below = receiver.map(|c| c - n * 0.5);
    let behind_the_point = [v(-1.0, -1.0, -0.1), v(2.0, -1.0, -0.1), v(0.0, 2.0, -0.1)];
    let aside = [v(4.0, 0.0, 0.5), v(5.0, 0.0, 0.5), v(4.0, 1.0, 0.5)];
    let needle = [v(0.1, 0.1, 0.5), v(0.1, 0.1, 0.5), v(0.9, 0.9, 0.5)];
    for occluder in [itself[0], itself[1], beyond, edge_on, receiver, below, behind_the_point, aside, needle]
    {
        let mut scratch = [Convex::EMPTY; 1];
        let visible = visible_point_to_polygon(p, n, &polygon, &[occluder], &mut scratch).unwrap();
        assert_eq!(visible, whole, "{occluder:?}");
    }
}

#[test]
fn what_hides_all_and_what_passes_through() {
    let (p, n) = (v(0.3, 0.4, 0.0), v(0.0, 0.0, 1.0));
    let (polygon, _) = level([0.0, 1.0], [0.0, 1.0], 1.0);
    let mut scratch = [Convex::EMPTY; 8];
    let lid = [v(-9.0, -9.0, 0.5), v(9.0, -9.0, 0.5), v(0.0, 9.0, 0.5)];
    assert_eq!(visible_point_to_polygon(p, n, &polygon, &[lid], &mut scratch), Ok(0.0));
    // An upright plate x = 0.6 that passes through the polygon hides what lies behind its part below.
    let (x, far) = (0.6, 50.0);
    let plate = [v(x, -far, -far), v(x, far, -far), v(x, 0.4, far)];
    let near_side = [v(0.0, 0.0, 1.0), v(x, 0.0, 1.0), v(x, 1.0, 1.0), v(0.0, 1.0, 1.0)];
    let visible = visible_point_to_polygon(p, n, &polygon, &[plate], &mut scratch).unwrap();
    // A dozen roundings of numbers below 1.
    assert!((visible - point_to_polygon(p, n, &near_side)).abs() < 4e-15);
}

#[test]
fn too_little_scratch_is_an_error() {
    let (p, n) = (v(0.5, 0.5, 0.0), v(0.0, 0.0, 1.0));
    let (polygon, _) = level([0.0, 1.0], [0.0, 1.0], 1.0);
    let (_, occluder) = level([0.4, 0.6], [0.4, 0.6], 0.5);
    for places in 0..8 {
        let mut scratch = vec![Convex::EMPTY; places];
        let got = visible_point_to_polygon(p, n, &polygon, &occluder, &mut scratch);
        let error = Error::TooMany { what: "visible pieces of a polygon", limit: places };
        assert!(got.is_ok() || got == Err(error), "{got:?}");
        assert_eq!(got.is_ok(), places >= 4, "{places} places");
    }
}

fn vector(size: f64) -> impl Strategy<Value = Vec3> {
    [-size..size, -size..size, -size..size].prop_map(Vec3::from_array)
}

fn triangle() -> impl Strategy<Value = [Vec3; 3]> {
    [vector(0.95), vector(0.95), vector(0.95)]
}

/// The six walls of the room -1..1.
fn walls() -> Vec<[Vec3; 4]> {
    let mut walls = vec![];
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |s: f64, t: f64| {
                let mut c = [s; 3];
                (c[axis], c[(axis + 2) % 3]) = (side, t);
                Vec3::from_array(c)
            };
            walls.push([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        }
    }
    walls
}

proptest! {
    #![proptest_config(repeatable(300))]

    /// Whatever stands in a room, and passes through what else stands there: a point sees in every direction
    /// exactly one thing, so that the shares of all add up to 1. Rounding: hundreds of pieces, 1e-12.
    #[test]
    fn a_furnished_room_closes(
        furniture in prop::collection::vec(triangle(), 0..9), p in vector(0.9), n in vector(1.0),
    ) {
        prop_assume!(n.length() > 0.1);
        let n = n.normalize();
        let mut scratch = [Convex::EMPTY; 512];
        let mut sum = 0.0;
        for wall in walls() {
            let part = visible_point_to_polygon(p, n, &wall, &furniture, &mut scratch).unwrap();
            prop_assert!((0.0..=point_to_polygon(p, n, &wall) + 1e-15).contains(&part));
            sum += part;
        }
        for (k, piece) in furniture.iter().enumerate() {
            let others = furniture.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, t)| t);
            sum += visible_point_to_polygon(p, n, piece, others, &mut scratch).unwrap();
        }
        prop_assert!((sum - 1.0).abs() < 1e-12, "{:e}", sum - 1.0);
    }

    /// Both ways of the exchange and the order of the occluders agree within the errors stated.
    #[test]
    fn visible_factors_are_reciprocal(a in triangle(), b in triangle(), between in triangle()) {
        let a = a.map(|c| c - v(0.0, 0.0, 2.0));
        let b = b.map(|c| c + v(0.0, 0.0, 2.0));
        let area = |t: &[Vec3; 3]| 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).length();
        prop_assume!(area(&a) > 0.05 && area(&b) > 0.05);
        let mut scratch = [Convex::EMPTY; 64];
        let forth = visible_polygon_to_polygon(&a, &b, &[between], 1e-5, &mut scratch).unwrap();
        let back = visible_polygon_to_polygon(&b, &a, &[between], 1e-5, &mut scratch).unwrap();
        let allowed = forth.error * area(&a) + back.error * area(&b) + 1e-14;
        prop_assert!((forth.value * area(&a) - back.value * area(&b)).abs() <= allowed);
        prop_assert!(forth.value <= polygon_to_polygon(&a, &b));
        let free = visible_polygon_to_polygon(&a, &b, &[], 1e-6, &mut scratch).unwrap();
        prop_assert!((free.value - polygon_to_polygon(&a, &b)).abs() <= free.error);
    }

    #[test]
    fn degenerate_occluders_give_numbers(
        corners in prop::collection::vec((-2i32..3, -2i32..3, -1i32..3), 12), p in vector(1.0),
    ) {
        let corners: Vec<Vec3> =
            corners.iter().map(|&(x, y, z)| v(f64::from(x), f64::from(y), f64::from(z)) * 0.5).collect();
        let triangles: Vec<[Vec3; 3]> = corners.chunks(3).map(|c| [c[0], c[1], c[2]]).collect();
        let mut scratch = [Convex::EMPTY; 256];
        for p in [p, corners[0], (corners[3] + corners[4]) * 0.5] {
            for n in [v(0.0, 0.0, 1.0), v(0.6, 0.0, 0.8)] {
                let got = visible_point_to_polygon(p, n, &triangles[0], &triangles[1..], &mut scratch).unwrap();
                prop_assert!((0.0..=point_to_polygon(p, n, &triangles[0]) + 1e-9).contains(&got), "{got}");
            }
        }
    }
}

/// The same in another place: turned and moved.
fn turned(points: &[Vec3], number: usize) -> Vec<Vec3> {
    let angle = number as f64;
    let turn = glam::DQuat::from_axis_angle(v(0.3, angle.sin(), 0.9 * angle.cos()).normalize(), angle);
    points.iter().map(|p| turn * *p + v(angle, -0.5 * angle, 0.1)).collect()
}

fn triangles(points: &[Vec3]) -> Vec<[Vec3; 3]> {
    points.chunks(3).map(|t| [t[0], t[1], t[2]]).collect()
}

/// Unit squares face to face at distance g, a wall across all of the gap at x = w: each side sees its own half, all four
/// rectangles unobstructed and in closed form.
#[test]
fn a_wall_on_the_plane_parts_what_it_stands_on() {
    for number in 0..14 {
        let w = 0.1 + 0.8 * (0.37 + 0.618 * number as f64).fract();
        let gap = [1.0, 0.3, 0.05, 2.0][number % 4];
        let rectangle = |x: [f64; 2], z: f64| level(x, [0.0, 1.0], z).0.to_vec();
        let facing = |x: [f64; 2]| rectangle(x, gap).into_iter().rev().collect::<Vec<_>>();
        // on the plane, or through it
        let foot = if number % 2 == 0 { 0.0 } else { -0.4 };
        let wall = [
            [v(w, -1.0, foot), v(w, 2.0, foot), v(w, 2.0, gap)],
            [v(w, -1.0, foot), v(w, 2.0, gap), v(w, -1.0, gap)],
        ];
        let part = |x: [f64; 2]| (x[1] - x[0]) * polygon_to_polygon(&rectangle(x, 0.0), &facing(x));
        let truth = part([0.0, w]) + part([w, 1.0]);
        let [a, b] = [turned(&rectangle([0.0, 1.0], 0.0), number), turned(&facing([0.0, 1.0]), number)];
        let wall = triangles(&turned(wall.as_flattened(), number));
        let mut scratch = vec![Convex::EMPTY; 256];
        for (from, to) in [(&a, &b), (&b, &a)] {
            let got = visible_polygon_to_polygon(from, to, &wall, 1e-6, &mut scratch).unwrap();
            println!("{number}: {:.9}, off {:.1e}, error {:.1e}", got.value, got.value - truth, got.error);
            assert!((got.value - truth).abs() <= got.error.max(1e-9), "{number}: {}, not {truth}", got.value);
        }
    }
}

/// A plate that leans from an edge of the lower square through the upper one: what lies beyond its line on that shows.
#[test]
fn a_leaning_plate_hides_one_side_of_its_line() {
    for number in 0..12 {
        let gap = [0.05, 0.2, 0.5][number % 3];
        let slope = (0.1 + 0.8 * (0.2 + 0.618 * number as f64).fract()) / gap;
        let plate = [v(-50.0, 0.0, 0.0), v(50.0, 0.0, 0.0), v(0.0, 20.0 * slope, 20.0)];
        let low = level([0.0, 1.0], [0.0, 1.0], 0.0).0.to_vec();
        let high = |y: f64| level([0.0, 1.0], [y, 1.0], gap).0.into_iter().rev().collect::<Vec<_>>();
        let truth = polygon_to_polygon(&low, &high(gap * slope));
        let [a, b] = [turned(&low, number), turned(&high(0.0), number)];
        let plate = triangles(&turned(&plate, number));
        let mut scratch = vec![Convex::EMPTY; 256];
        for (from, to) in [(&a, &b), (&b, &a)] {
            let got = visible_polygon_to_polygon(from, to, &plate, 1e-6, &mut scratch).unwrap();
            println!("{number}: {:.9}, off {:.1e}, error {:.1e}", got.value, got.value - truth, got.error);
            assert!((got.value - truth).abs() <= got.error, "{number}: {}, not {truth}", got.value);
        }
    }
}
