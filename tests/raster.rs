//! Drawn facets are those that rays meet: every sample that the item buffer is sure of has the hit of `Bvh::closest`, and
//! few are left to rays; what a line shows from end to end is what rays along it meet.

use blik_kernel::arena::{Arena, Memory, Need};
use blik_kernel::bvh::Bvh;
use blik_kernel::math::{Vec3, frame};
use blik_kernel::raster::{Items, Lines, NO_FACET_DRAWN, Samples, UNSURE};
use blik_kernel::ray::normal;
use blik_kernel::simd::Isa;

type Facet = [Vec3; 3];

const COLUMNS: usize = 61;
const ROWS: usize = 40;

/// A closed ball of `n` x 2n quads, each of two facets.
fn ball(n: usize, centre: Vec3, radius: f64) -> Vec<Facet> {
    let at = |i: usize, j: usize| {
        let (t, p) = (i as f64 / n as f64, (j % (2 * n)) as f64 / n as f64);
        let (t, p) = (t * std::f64::consts::PI, p * std::f64::consts::PI);
        let ring = if i == 0 || i == n { 0.0 } else { t.sin() };
        centre + radius * Vec3::new(ring * p.cos(), ring * p.sin(), t.cos())
    };
    let quads = (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j)));
    let facets = quads.flat_map(|(i, j)| {
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    });
    facets.filter(|f| normal(f).length() > 0.0).collect()
}

/// A cube of side 2 `half`.
fn cube(centre: Vec3, half: f64) -> Vec<Facet> {
    let mut all = Vec::new();
    for (axis, side) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
        let mut n = [0.0; 3];
        n[axis] = side;
        let n = Vec3::from_array(n);
        let (x, y) = frame(n);
        let corner = |a: f64, b: f64| centre + half * (n + x * a + y * b);
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        all.extend([[a, b, c], [a, c, d]]);
    }
    all
}

/// Bodies that pass through each other, facets twice over, a needle and a facet of no area.
fn meshes() -> Vec<(&'static str, Vec<Facet>)> {
    let mut mixed = ball(9, Vec3::ZERO, 0.7);
    mixed.extend(cube(Vec3::new(0.3, -0.2, 0.1), 0.5));
    let mut twice = cube(Vec3::ZERO, 0.6);
    twice.extend(cube(Vec3::ZERO, 0.6));
    // backs before fronts that coincide with them, from other corners on
    let mut sheets: Vec<Facet> = cube(Vec3::ZERO, 0.6).iter().map(|&[a, b, c]| [b, a, c]).collect();
    sheets.extend(cube(Vec3::ZERO, 0.6));
    let mut odd = ball(6, Vec3::new(0.1, 0.0, 0.0), 0.4);
    odd.push([Vec3::new(-0.9, -0.9, 0.5), Vec3::new(0.9, 0.9, 0.5), Vec3::new(0.9, 0.9 + 1e-9, 0.5)]);
    odd.push([Vec3::new(-0.5, 0.5, 0.6), Vec3::new(0.5, 0.5, 0.6), Vec3::new(0.0, 0.5, 0.6)]);
    vec![
        ("ball", ball(14, Vec3::ZERO, 0.9)),
        ("cube", cube(Vec3::ZERO, 0.8)),
        ("mixed", mixed),
        ("twice", twice),
        ("sheets", sheets),
        ("odd", odd),
    ]
}

fn with_tree<R>(mesh: &[Facet], work: impl FnOnce(&Bvh<'_>) -> R) -> R {
    let areas: Vec<f64> = mesh.iter().map(|facet| 0.5 * normal(facet).length()).collect();
    let mut memory = Memory::new(Bvh::bytes(mesh.len()).unwrap());
    work(&Bvh::build(mesh, &areas, Isa::detect(), memory.bytes_mut()).unwrap())
}

/// A view of `size` about the origin along `forward`; `back` is how far before it the eye is.
fn samples(forward: Vec3, back: f64, size: f64, parallel: bool) -> Samples {
    let forward = forward.normalize();
    let (right, up) = frame(forward);
    let step = 2.0 * size / COLUMNS as f64;
    Samples {
        eye: -forward * back + right * 0.01,
        forward,
        right,
        up,
        parallel,
        first: (-size + 0.5 * step, size * ROWS as f64 / COLUMNS as f64),
        step: (step, -step),
        shear: 0.0,
        turn: 0.0,
    }
}

/// Compares all samples, in blocks of `together` rows; returns how many meet something, and how many are left to rays.
fn compare(what: &str, bvh: &Bvh<'_>, samples: &Samples, together: usize) -> (usize, usize) {
    let bytes = Items::need(Need::new(), COLUMNS, together).bytes().unwrap();
    let mut memory = Memory::new(bytes);
    let mut arena = Arena::new(memory.bytes_mut(), bytes).unwrap();
    let mut items = Items::new(&mut arena, COLUMNS, together).unwrap();
    assert_eq!(items.rows(), together);
    let (mut met, mut unsure) = (0, 0);
    for first in (0..ROWS as isize).step_by(together) {
        let rows = first..(first + together as isize).min(ROWS as isize);
        items.draw(bvh, samples, rows.clone(), 0);
        for row in rows {
            // nothing is skipped that is something
            for skipped in 0..items.next(row, 0, COLUMNS as isize) {
                assert_eq!(items.facet(row, skipped), NO_FACET_DRAWN, "{what}: {row}, {skipped}");
            }
            for column in 0..COLUMNS as isize {
                let ray = samples.ray(row, column as f64 + samples.shift(row));
                let truth = bvh.closest(&ray).map_or(NO_FACET_DRAWN, |hit| hit.facet);
                let drawn = items.facet(row, column);
                met += usize::from(truth != NO_FACET_DRAWN);
                unsure += usize::from(drawn == UNSURE);
                assert!(drawn == UNSURE || drawn == truth, "{what}: {row}, {column}: {drawn}, not {truth}");
            }
        }
    }
    (met, unsure)
}

#[test]
fn drawn_facets_are_those_that_rays_meet() {
    let views =
        [Vec3::X, -Vec3::Z, Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.3, -0.8, 0.5), Vec3::new(-1e-3, 1.0, 1e-7)];
    for (name, mesh) in meshes() {
        with_tree(&mesh, |bvh| {
            for (n, forward) in views.into_iter().enumerate() {
                // far off, very far off, close by, among the facets; the last two with facets across the eye's plane
                for (back, size, parallel) in [
                    (3.0, 1.1, true),
                    (1e6, 1.1, true),
                    (0.1, 1.1, true),
                    (3.0, 0.4, false),
                    (30.0, 0.037, false),
                    (1e4, 1.1e-4, false),
                    (1.0, 3.0, false),
                    (0.05, 1.0, false),
                ] {
                    let what = format!("{name}, view {n}, from {back}, parallel {parallel}");
                    let samples = samples(forward, back, size, parallel);
                    let (met, unsure) = compare(&what, bvh, &samples, 7);
                    assert_eq!(compare(&what, bvh, &samples, ROWS).0, met);
                    // rays decide where facets coincide, where they pass the plane of an eye of parallel rays, and
                    // along edges through centres: a grid that is in line with the mesh has many
                    let generic = n == 3 && !["twice", "sheets"].contains(&name) && (back > 1.0 || !parallel);
                    assert!(!generic || unsure * 50 <= met.max(50), "{what}: {unsure} of {met} left to rays");
                }
            }
        });
    }
}

#[test]
fn rows_may_be_shifted_and_slanted() {
    let mesh = ball(12, Vec3::new(0.1, 0.0, 0.0), 0.8);
    with_tree(&mesh, |bvh| {
        let plain = samples(Vec3::new(0.3, -0.8, 0.5), 2.0, 1.1, true);
        let slanted = Samples { shear: 0.013, turn: 0.618_033_988_749_894_9, ..plain };
        assert!(compare("slanted", bvh, &slanted, 8).0 > 500);
        let shifts: Vec<f64> = (0..ROWS as isize).map(|row| slanted.shift(row)).collect();
        assert!(shifts.iter().all(|s| (0.0..1.0).contains(s)) && shifts[0] != shifts[1]);
    });
}

#[test]
fn lines_show_what_rays_along_them_meet() {
    let lines = 16;
    let bytes = Lines::need(Need::new(), lines).bytes().unwrap();
    let mut memory = Memory::new(bytes);
    for (name, mesh) in meshes() {
        with_tree(&mesh, |bvh| {
            let mut arena = Arena::new(memory.bytes_mut(), bytes).unwrap();
            let mut found = Lines::new(&mut arena, lines).unwrap();
            let samples = samples(Vec3::new(0.3, -0.8, 0.5), 2.0, 1.1, true);
            let mut total = 0.0;
            for row in 0..ROWS as isize {
                if row % lines as isize == 0 {
                    found.find(bvh, &samples, COLUMNS, row..row + lines as isize);
                }
                let spans: Vec<_> = found.of(row).unwrap().collect();
                let mut last = f64::NEG_INFINITY;
                for span in &spans {
                    // in order, without overlap
                    assert!(span.start >= last && span.end > span.start, "{name}, row {row}: {spans:?}");
                    last = span.end;
                    total += span.end - span.start;
                    // between ends that are off by roundings
                    for at in [0.001, 0.3, 0.5, 0.999] {
                        let at = span.start + at * (span.end - span.start);
                        let hit = bvh.closest(&samples.ray(row, at));
                        let facet = hit.map_or(NO_FACET_DRAWN, |h| h.facet);
                        assert!(
                            facet == span.facet() || span.end - span.start < 1e-9,
                            "{name}, row {row} at {at}: {facet}, not {}",
                            span.facet()
                        );
                    }
                }
                // and nothing is left out
                for n in 0..200 {
                    let at = COLUMNS as f64 * (f64::from(n) + 0.5) / 200.0;
                    let covered = spans.iter().any(|s| (s.start..=s.end).contains(&at));
                    assert_eq!(
                        bvh.closest(&samples.ray(row, at)).is_some(),
                        covered,
                        "{name}, row {row} at {at}"
                    );
                }
            }
            assert!(total > 100.0, "{name}: {total}");
        });
    }
}
