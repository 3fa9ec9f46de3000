//! Polygons of mesh files become triangles that cover them once: with repeated corners, whiskers, slits, straight corners
//! and holes on seams. Right areas are shoelace sums of what the polygons are made of.
#![cfg(feature = "std")]

#[path = "../kernel/examples/render/mesh_file/polygon.rs"]
mod polygon;

use glam::{DMat3, DVec2, DVec3};
use polygon::{Shape, Triangle, triangulate};

/// Random polygons of each kind.
const CASES: u64 = 400;
/// Share of the area that a whisker in rounded coordinates may take or give.
const ROUNDING: f64 = 1e-9;

struct Random(u64);

impl Random {
    /// Uniform in 0 .. 1, by splitmix64.
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e3779b97f4a7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d049bb133111eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.number() * n as f64) as usize
    }

    /// A star about `centre`: simple, in general not convex.
    fn star(&mut self, centre: DVec2, size: f64) -> Vec<DVec2> {
        let n = 3 + self.below(9);
        let step = std::f64::consts::TAU / n as f64;
        let corner = |i: usize| {
            let angle = (i as f64 + 0.8 * self.number()) * step;
            centre + DVec2::from_angle(angle) * size * (0.3 + 0.7 * self.number())
        };
        (0..n).map(corner).collect()
    }
}

fn shoelace(points: &[DVec2]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>() / 2.0
}

/// The polygon somewhere in space.
fn placed(points: &[DVec2], random: &mut Random) -> Vec<[f64; 3]> {
    let axis = DVec3::new(random.number() - 0.5, random.number() - 0.5, random.number() - 0.5).normalize();
    let turn = DMat3::from_axis_angle(axis, 6.0 * random.number());
    let offset = 10.0 * DVec3::new(random.number(), random.number(), random.number());
    points.iter().map(|p| (turn * p.extend(0.0) + offset).into()).collect()
}

/// Sum of the triangles' areas, each with the sign that it has in the polygon's sense.
fn covered(points: &[[f64; 3]]) -> (f64, f64, Shape) {
    let mut triangles = Vec::new();
    let shape = triangulate(points, &mut triangles);
    let corner = |i: usize| DVec3::from(points[i]) - DVec3::from(points[0]);
    let next = (1..points.len()).chain([0]);
    let newell: DVec3 = (0..points.len()).zip(next).map(|(i, j)| corner(i).cross(corner(j))).sum();
    let up = newell.normalize_or_zero();
    let area = |Triangle([a, b, c]): &Triangle| {
        (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a)).dot(up) / 2.0
    };
    let areas: Vec<f64> = triangles.iter().map(area).collect();
    (areas.iter().sum(), areas.iter().map(|x| x.abs()).sum(), shape)
}

fn covers_once(points: &[DVec2], area: f64, random: &mut Random, what: &str) {
    let points = placed(points, random);
    let (signed, absolute, shape) = covered(&points);
    assert!((signed - area).abs() < ROUNDING * area, "{what}: {signed} for {area}: {points:?}");
    assert!((absolute - area).abs() < ROUNDING * area, "{what}: overlaps, {absolute} for {area}: {points:?}");
    assert_eq!(shape, Shape::Simple, "{what}: {points:?}");
}

/// Repeats, whiskers and straight corners at random places.
fn decorated(points: &[DVec2], random: &mut Random) -> Vec<DVec2> {
    let mut decorated = points.to_vec();
    for _ in 0..1 + random.below(5) {
        let n = decorated.len();
        let at = random.below(n);
        let (here, next) = (decorated[at], decorated[(at + 1) % n]);
        let tip = here + DVec2::new(random.number() - 0.5, random.number() - 0.5);
        let insert: Vec<DVec2> = match random.below(6) {
            // The same corner twice or three times.
            0 => vec![here],
            1 => vec![here, here],
            // A whisker, one of two edges, and one that forks.
            2 => vec![tip, here],
            3 => vec![tip, tip + tip.perp() * 0.3, tip, here],
            4 => {
                let (left, right) = (tip + DVec2::X * 0.2, tip + DVec2::Y * 0.2);
                vec![tip, left, tip, right, tip, here]
            }
            // Straight on.
            _ => vec![here.lerp(next, 0.5)],
        };
        insert.into_iter().rev().for_each(|point| decorated.insert(at + 1, point));
    }
    if random.below(2) == 0 {
        // Closed, as some writers do.
        decorated.push(decorated[0]);
    }
    let turn = random.below(decorated.len());
    decorated.rotate_left(turn);
    decorated
}

#[test]
fn repeats_and_whiskers_go_before_anything_else() {
    for case in 0..CASES {
        let mut random = Random(case);
        let star = random.star(DVec2::ZERO, 1.0);
        let area = shoelace(&star);
        covers_once(&star, area, &mut random, "star");
        let points = decorated(&star, &mut random);
        covers_once(&points, area, &mut random, "decorated star");
        let backwards: Vec<DVec2> = points.iter().rev().copied().collect();
        covers_once(&backwards, area, &mut random, "backwards");
        let convex: Vec<DVec2> = (0..7).map(|i| DVec2::from_angle(i as f64 * 0.9)).collect();
        let points = decorated(&convex, &mut random);
        covers_once(&points, shoelace(&convex), &mut random, "decorated convex");
    }
    println!("{} polygons", 4 * CASES);
}

/// A whisker that runs on along an edge, past its corner, and comes back, in coordinates with the digits of f32 and of a
/// file's decimals.
#[test]
fn overshoots_in_rounded_coordinates_take_nothing() {
    for case in 0..CASES {
        let mut random = Random(case);
        let star = random.star(DVec2::ZERO, 1.0);
        let mut points = star.clone();
        let at = random.below(points.len());
        let before = points[(at + points.len() - 1) % points.len()];
        points.insert(at, points[at] + (points[at] - before) * 0.4);
        for round in [|x: f64| f64::from(x as f32), |x: f64| (x * 1e7).round() / 1e7] {
            let rounded: Vec<[f64; 3]> = points.iter().map(|p| [round(p.x), round(p.y), 0.0]).collect();
            let (signed, absolute, _) = covered(&rounded);
            // The rounding of corners at distance 1, along outlines of length 10 at most.
            let area = shoelace(&star);
            assert!(
                (signed - area).abs() < 1e-6 && (absolute - area).abs() < 1e-5,
                "{case}: {absolute} for {area}"
            );
        }
    }
    println!("{} polygons", 2 * CASES);
}

fn cross(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// The outline with a hole on a seam that crosses nothing; `None` where there is no such seam.
fn with_hole(outline: &[DVec2], hole: &[DVec2], others: &[Vec<DVec2>]) -> Option<Vec<DVec2>> {
    let edges = |ring: &[DVec2]| -> Vec<(DVec2, DVec2)> {
        ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)).collect()
    };
    let walls: Vec<(DVec2, DVec2)> = edges(outline)
        .into_iter()
        .chain(edges(hole))
        .chain(others.iter().flat_map(|other| edges(other)))
        .collect();
    for (i, a) in outline.iter().enumerate() {
        for (j, b) in hole.iter().enumerate() {
            // Inside the outline at a: between its two edges.
            let (before, after) =
                (outline[(i + outline.len() - 1) % outline.len()], outline[(i + 1) % outline.len()]);
            let left = |u: DVec2, v: DVec2| u.perp_dot(v) > 0.0;
            let (u, v, w) = (after - *a, before - *a, *b - *a);
            let inside = if left(u, v) { left(u, w) && left(w, v) } else { !(left(v, w) && left(w, u)) };
            if inside && !walls.iter().any(|(c, d)| cross(*a, *b, *c, *d)) {
                let mut ring = outline[..=i].to_vec();
                ring.extend(hole[j..].iter().chain(&hole[..=j]).rev());
                ring.extend(&outline[i..]);
                return Some(ring);
            }
        }
    }
    None
}

#[test]
fn holes_hang_on_seams() {
    let mut count = 0;
    for case in 0..CASES {
        let mut random = Random(case);
        let outer = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(DVec2::from);
        let places = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(DVec2::from);
        let holes: Vec<Vec<DVec2>> =
            places[..1 + random.below(4)].iter().map(|place| random.star(*place, 0.9)).collect();
        let mut ring = outer.to_vec();
        let mut area = shoelace(&outer);
        for (i, hole) in holes.iter().enumerate() {
            let Some(next) = with_hole(&ring, hole, &holes[i + 1..]) else { continue };
            ring = next;
            area -= shoelace(hole);
        }
        covers_once(&ring, area, &mut random, "holes");
        let points = decorated(&ring, &mut random);
        covers_once(&points, area, &mut random, "decorated holes");
        count += 2;
    }
    println!("{count} polygons");
}

#[test]
fn crossing_polygons_are_told() {
    let polygon = |points: &[[f64; 2]]| points.iter().map(|[x, y]| [*x, *y, 0.0]).collect::<Vec<[f64; 3]>>();
    let star: Vec<[f64; 2]> =
        (0..5).map(|i| DVec2::from_angle(f64::from(i) * 0.8 * std::f64::consts::PI).into()).collect();
    let crossing = [
        polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]),
        polygon(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]),
        polygon(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.0, -1.0], [0.0, 4.0]]),
    ];
    for points in crossing {
        assert_eq!(covered(&points).2, Shape::Crossing, "{points:?}");
    }
    // Five times round its corners, twice round its middle.
    let (_, _, shape) = covered(&polygon(&star));
    assert_eq!(shape, Shape::Crossing);
    // Without area nothing can cross.
    assert_eq!(covered(&polygon(&[[0.0, 0.0], [1.0, 0.0], [3.0, 0.0], [2.0, 0.0]])).2, Shape::Simple);
    assert_eq!(covered(&polygon(&[[1.0, 1.0]; 5])).2, Shape::Simple);
}

#[test]
fn many_corners_take_no_minute() {
    // A comb of 1000 teeth and a spiral: ears are found beside the last one.
    let teeth = 1000;
    let mut comb: Vec<[f64; 3]> =
        (0..2 * teeth).rev().map(|i| [f64::from(i), f64::from(i % 2) * 5.0 + 1.0, 0.0]).collect();
    comb.extend([[0.0, 0.0, 0.0], [f64::from(2 * teeth - 1), 0.0, 0.0]]);
    let start = std::time::Instant::now();
    let (signed, absolute, shape) = covered(&comb);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    assert!(shape == Shape::Simple && (signed - absolute).abs() < 1e-6 && signed > 0.0);
}
