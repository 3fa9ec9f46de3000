//! Exchange areas of many pairs at once are those of the pairs one by one, to the errors that both promise.

mod support;

use blik_kernel::Error;
use blik_kernel::form_factor::{Polygons, exchange_area};
use blik_kernel::math::Vec3;
use blik_kernel::simd::Isa;
use proptest::prelude::*;
use support::{npy, random::repeatable, scenes};

type Polygon = Vec<Vec3>;

fn v(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

/// All exchange areas, row by row, of the ranges of columns that `cuts` make.
fn matrix(isa: Isa, polygons: &[Polygon], cuts: &[usize]) -> Vec<Vec<f64>> {
    let mut memory = vec![0xa5; Polygons::bytes(polygons).unwrap()];
    let prepared = Polygons::new(isa, polygons, &mut memory).unwrap();
    assert_eq!((prepared.len(), prepared.is_empty()), (polygons.len(), polygons.is_empty()));
    let ends: Vec<usize> = cuts.iter().map(|c| *c.min(&polygons.len())).chain([polygons.len()]).collect();
    let row = |row| {
        let mut areas = vec![f64::NAN; polygons.len()];
        let mut start = 0;
        for &end in &ends {
            prepared.exchange_areas(row, start..end, &mut areas[start..end]).unwrap();
            start = end;
        }
        areas
    };
    (0..polygons.len()).map(row).collect()
}

fn double_area(polygon: &[Vec3]) -> Vec3 {
    polygon.windows(2).map(|side| (side[0] - polygon[0]).cross(side[1] - polygon[0])).sum()
}

/// What the area form leaves of a pair for which a rule is good enough: a fan of triangles, cut into sixteen each.
fn by_parts(a: &[Vec3], b: &[Vec3]) -> f64 {
    let parts = |polygon: &[Vec3]| -> Vec<[Vec3; 3]> {
        let cut = |t: &[Vec3]| {
            let (o, u, v) = (polygon[0], (t[0] - polygon[0]) / 4.0, (t[1] - polygon[0]) / 4.0);
            let at = move |i: u32, j: u32| o + u * f64::from(i) + v * f64::from(j);
            let upper =
                (0..4).flat_map(move |i| (0..4 - i).map(move |j| [at(i, j), at(i + 1, j), at(i, j + 1)]));
            let lower = (0..3)
                .flat_map(move |i| (0..3 - i).map(move |j| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
            upper.chain(lower).collect::<Vec<_>>()
        };
        polygon[1..].windows(2).flat_map(cut).collect()
    };
    let (a, b) = (parts(a), parts(b));
    a.iter().flat_map(|p| b.iter().map(move |q| exchange_area(p, q))).sum()
}

fn vector(size: f64) -> impl Strategy<Value = Vec3> {
    [-size..size, -size..size, -size..size].prop_map(Vec3::from_array)
}

/// Three to eight corners on an ellipse in any plane about the origin, some thin, or a parallelogram.
fn polygon() -> impl Strategy<Value = Polygon> {
    let shape = (prop::collection::vec(0.0..std::f64::consts::TAU, 3..9), any::<bool>(), -3.0..1.0f64);
    (shape, vector(1.0), vector(1.0)).prop_map(|((mut angles, parallel, thin), x, y)| {
        let x = (x + v(0.0, 0.0, 1e-3)).normalize();
        let y = x.cross(y + v(1e-3, 0.0, 0.0)).normalize() * 10f64.powf(thin.min(0.0));
        angles.sort_by(f64::total_cmp);
        let corner = |a: f64| x * a.cos() + y * a.sin();
        if parallel && angles.len() == 4 {
            let (u, w) = (corner(angles[0]), corner(angles[1]));
            return vec![-u - w, u - w, u + w, w - u];
        }
        angles.into_iter().map(corner).collect()
    })
}

/// Corners on a coarse grid: coincident, collinear, coplanar, touching and crossing polygons are common.
fn grid_polygon() -> impl Strategy<Value = Polygon> {
    let corner = (-2i32..3, -2i32..3, -1i32..2, 0i32..3).prop_map(|(x, y, z, tiny)| {
        v(f64::from(x), f64::from(y), f64::from(z)) + v(1e-9, -1e-15, 1e-12) * f64::from(tiny)
    });
    prop::collection::vec(corner, 0..6)
}

/// Polygons of unlike sizes about one place: many touch, cross each other's planes or are far apart in their sizes.
fn crowd() -> impl Strategy<Value = Vec<Polygon>> {
    let member = (polygon(), -3.0..0.5f64, vector(4.0)).prop_map(|(polygon, size, place)| {
        polygon.into_iter().map(|c| c * 10f64.powf(size) + place).collect::<Polygon>()
    });
    prop::collection::vec(member, 1..24)
}

proptest! {
    #![proptest_config(repeatable(60))]

    /// Each is within 1e-10 of the exact value, for separated pairs; `exchange_area` itself is, but for few that see
    /// each other edge-on: 3e-9. What rounding adds there: 1e-16 of the corners' coordinates, against heights that are a
    /// share of the areas.
    #[test]
    fn pairs_of_a_crowd(polygons in crowd()) {
        let areas = matrix(Isa::detect(), &polygons, &[]);
        for (i, a) in polygons.iter().enumerate() {
            for (j, b) in polygons.iter().enumerate().filter(|(j, _)| *j != i) {
                let (got, want) = (areas[i][j], exchange_area(a, b));
                let smaller = double_area(a).length().min(double_area(b).length());
                let off = (got - want).abs();
                prop_assert!(off <= 3e-9 * want + 1e-15 * smaller, "{i} {j}: {got:e}, expected {want:e}");
            }
        }
    }

    /// The same bits for (i, j) and (j, i), in any ranges, on every instruction set, whatever the memory held.
    #[test]
    fn bits_are_the_pairs(polygons in crowd(), cuts in [0usize..24, 0usize..24]) {
        let areas = matrix(Isa::detect(), &polygons, &[]);
        let mut cuts = cuts;
        cuts.sort_unstable();
        prop_assert_eq!(&areas, &matrix(Isa::BASELINE, &polygons, &cuts));
        for (i, row) in areas.iter().enumerate() {
            prop_assert_eq!(row[i], 0.0);
            row.iter().enumerate().for_each(|(j, area)| assert_eq!(*area, areas[j][i]));
        }
    }

    #[test]
    fn degenerate_polygons_give_numbers(
        polygons in prop::collection::vec(grid_polygon(), 1..12),
        scale in prop::sample::select(&[1.0, 1e-200, 1e-80, 1e80, 1e200, 1e307][..]),
    ) {
        let polygons: Vec<Polygon> =
            polygons.into_iter().map(|p| p.into_iter().map(|c| c * 0.3 * scale).collect()).collect();
        let areas = matrix(Isa::detect(), &polygons, &[]);
        for (i, row) in areas.iter().enumerate() {
            for (j, area) in row.iter().enumerate() {
                prop_assert!(*area >= 0.0 && area.is_finite());
                prop_assert_eq!(*area, areas[j][i]);
            }
        }
    }

    /// Every face of a drum sees the others and nothing else: 1e-10. Its lids are several patches each.
    #[test]
    fn drums_close(sides in 9usize..40, height in 0.1..3.0f64) {
        let corner = |k: usize, z: f64| {
            let (s, c) = (k as f64 / sides as f64 * std::f64::consts::TAU).sin_cos();
            v(c, s, z)
        };
        let lid = (0..sides).map(|k| corner(k, 0.0)).collect();
        let roof = (0..sides).rev().map(|k| corner(k, height)).collect();
        let wall = |k| vec![corner(k + 1, 0.0), corner(k, 0.0), corner(k, height), corner(k + 1, height)];
        let faces: Vec<Polygon> = [lid, roof].into_iter().chain((0..sides).map(wall)).collect();
        for (row, face) in matrix(Isa::detect(), &faces, &[3]).iter().zip(&faces) {
            let sum = row.iter().sum::<f64>() / (0.5 * double_area(face).length());
            prop_assert!((sum - 1.0).abs() < 1e-10, "row sum {sum}");
        }
    }
}

proptest! {
    #![proptest_config(repeatable(1000))]

    /// Pairs before each other's planes at 2 to 2,000 sizes: 1.2e-10 of the value, and what the reference's parts, cut to a
    /// quarter of the width, lose as their corners are rounded at that distance. The smaller lies at the origin.
    #[test]
    fn separated_pairs(
        a in polygon(), b in polygon(), way in vector(1.0), distance in 0.3..3.3f64, size in -2.0..0.0f64,
    ) {
        let b: Polygon = b.into_iter().map(|c| c * 10f64.powf(size)).collect();
        let shift = (way + v(0.0, 1e-3, 0.0)).normalize() * 10f64.powf(distance);
        let a: Polygon = a.into_iter().map(|c| c + shift).collect();
        let (na, nb) = (double_area(&a), double_area(&b));
        // turned to each other
        let turned = |mut p: Polygon, back: bool| { if back { p.reverse(); } p };
        let (a, b) = (turned(a, na.dot(shift) > 0.0), turned(b, nb.dot(shift) < 0.0));
        let (na, nb) = (double_area(&a), double_area(&b));
        // Edge-on, what is left of the heights is rounding of the distance.
        prop_assume!(na.length() > 1e-6 && nb.length() > 1e-6 * 100f64.powf(size));
        prop_assume!(b.iter().all(|c| (*c - a[0]).dot(na) > 1e-3 * na.length()));
        prop_assume!(a.iter().all(|c| (*c - b[0]).dot(nb) > 1e-3 * nb.length()));
        let polygons = [a, b];
        let (got, want) = (matrix(Isa::detect(), &polygons, &[])[0][1], by_parts(&polygons[0], &polygons[1]));
        let width = (0.5 * na.length()).min(0.5 * nb.length() / 10f64.powf(size));
        let rounding = 4.0 * f64::EPSILON * shift.length() / width;
        prop_assert!((got - want).abs() <= (1.2e-10 + rounding) * want, "{got:e}, expected {want:e}");
    }
}

/// The closed forms of a corner's 192 quadrilaterals: 1e-9, since some touch; and of the triangles that they are made of.
#[test]
fn quadrilaterals_of_a_corner() {
    let (mesh, _) = scenes::read_obj(&support::data("references/meshes/corner.obj"));
    let triangle = |f: usize| mesh.corners(f).map(|c| Vec3::from_array(c.to_array()));
    let quad = |q: usize| {
        let ([a, b, c], others) = (triangle(2 * q), triangle(2 * q + 1));
        let d = others.into_iter().find(|d| ![a, b, c].contains(d)).unwrap();
        // between the two corners that both have
        if !others.contains(&b) {
            vec![a, b, c, d]
        } else if !others.contains(&c) {
            vec![a, d, b, c]
        } else {
            vec![a, b, d, c]
        }
    };
    let quads: Vec<Polygon> = (0..192).map(quad).collect();
    let exact = npy::read_npz::<f64>(&support::data("references/corner_quads_exact.npz"), "F");
    let areas = matrix(Isa::detect(), &quads, &[100]);
    let area = 0.5 * double_area(&quads[0]).length();
    for (row, want) in areas.iter().zip(exact.values.chunks(192)) {
        for (got, want) in row.iter().zip(want) {
            assert!((got / area - want).abs() <= 1e-9 * want, "{:e}, expected {want:e}", got / area);
        }
    }
    let triangles: Vec<Polygon> = (0..384).map(|f| triangle(f).to_vec()).collect();
    let of_triangles = matrix(Isa::detect(), &triangles, &[]);
    for (i, row) in areas.iter().enumerate() {
        for (j, got) in row.iter().enumerate() {
            let parts: f64 =
                [0, 1].iter().flat_map(|p| [0, 1].map(|q| of_triangles[2 * i + p][2 * j + q])).sum();
            assert!((got - parts).abs() <= 1e-9 * got, "{i} {j}: {got:e}, in parts {parts:e}");
        }
    }
}

/// Far from the origin the corners are what they are: 1e-9 of a metre in the earth's radius.
#[test]
fn far_from_the_origin() {
    let pair = |o: Vec3| {
        let floor = vec![v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)];
        let wall = vec![v(9., 0., 2.), v(9., 1., 2.), v(9., 0., 3.)];
        [floor, wall].map(|p: Polygon| p.into_iter().map(|c| c + o).collect())
    };
    let at = |o| matrix(Isa::detect(), &pair(o), &[])[0][1];
    let (near, far) = (at(Vec3::ZERO), at(v(6.4e6, -3e6, 1e6)));
    assert_eq!(near, far, "whole numbers: no corner moved");
}

#[test]
fn what_is_refused() {
    let polygons = [[Vec3::X, Vec3::Y, Vec3::Z], [Vec3::ZERO, Vec3::X, Vec3::Y]];
    let needed = Polygons::bytes(&polygons).unwrap();
    let mut memory = vec![0; needed];
    let short = Polygons::new(Isa::detect(), &polygons, &mut memory[1..]).err();
    assert_eq!(short, Some(Error::BufferTooSmall { needed, given: needed - 1 }));
    let prepared = Polygons::new(Isa::detect(), &polygons, &mut memory).unwrap();
    let mut areas = [7.0; 2];
    assert!(matches!(prepared.exchange_areas(2, 0..2, &mut areas), Err(Error::Range { value: 3.0, .. })));
    assert!(matches!(prepared.exchange_areas(0, 1..3, &mut areas), Err(Error::Range { value: 3.0, .. })));
    assert!(matches!(
        prepared.exchange_areas(0, 0..1, &mut areas),
        Err(Error::Length { expected: 1, given: 2, .. })
    ));
    assert_eq!(areas, [7.0; 2], "nothing is written on an error");
    prepared.exchange_areas(0, 1..1, &mut []).unwrap();
    let none: [[Vec3; 3]; 0] = [];
    let mut memory = vec![0; Polygons::bytes(&none).unwrap()];
    assert!(Polygons::new(Isa::BASELINE, &none, &mut memory).unwrap().is_empty());
}
