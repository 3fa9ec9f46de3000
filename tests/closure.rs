//! The coupling's rows close: what an element sees is facets, blacks and sky, and nothing is lost or seen twice.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::coupling::{ABSENT, RowView};
use case::{Case, within};
use std::collections::HashMap;
use support::scenes::{self, Mesh};
use support::twin::Material;

/// Weight of the straight targets, of all first hits, and of everything that mirrors bring.
struct Shares {
    straight: f64,
    blocked: f64,
    mirrored: f64,
}

fn shares(row: &RowView<'_>) -> Shares {
    let sum = |records: &mut dyn Iterator<Item = f64>| records.sum::<f64>();
    Shares {
        straight: sum(&mut row.targets.iter().filter(|r| row.depth(r.path()) == 0).map(|r| r.weight)),
        blocked: row.row.blocked,
        mirrored: sum(&mut row
            .targets
            .iter()
            .filter(|r| row.depth(r.path()) > 0)
            .map(|r| r.weight * row.products(r.path())[0]))
            + sum(&mut row
                .escapes
                .filter(|b| row.depth(b.path) > 0)
                .map(|b| b.total() * row.products(b.path)[0])),
    }
}

#[test]
fn a_closed_room_is_all_targets() {
    let case = Case::new(scenes::cube_inside().subdivided(1), &[Material::new(0.5, 0.0)]);
    case.with_geometry(2, &within(5e-3), |_, geometry| {
        for (unknown, row) in geometry.coupling().unwrap().rows(0..geometry.elements().unknowns()) {
            let s = shares(&row);
            // sums of some hundred shares of size 1/n
            assert!((s.straight - 1.0).abs() < 1e-13, "row {unknown}: {}", s.straight);
            assert!((s.blocked - 1.0).abs() < 1e-13, "row {unknown}: {}", s.blocked);
        }
    });
}

#[test]
fn what_is_missing_from_the_targets_is_black() {
    // the ceiling is black: a floor facet misses the form factor between opposite faces of a cube,
    // (2/pi)(ln(2/sqrt 3) + 2 sqrt 2 atan(1/sqrt 2) - pi/2); its two facets together see that much
    let mesh = scenes::cube_inside().with_materials(&[0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    let case = Case::new(mesh, &[Material::new(0.5, 0.0), Material::new(0.0, 0.0)]);
    let root = 2f64.sqrt();
    let opposite = std::f64::consts::FRAC_2_PI
        * ((2.0 / 3f64.sqrt()).ln() + 2.0 * root * (1.0 / root).atan() - std::f64::consts::FRAC_PI_2);
    case.with_geometry(2, &within(2e-3), |_, geometry| {
        let elements = geometry.elements();
        let (mut missing, mut rays) = (0.0, u32::MAX);
        for (unknown, row) in geometry.coupling().unwrap().rows(0..elements.unknowns()) {
            let (facet, s) = (elements.facet_of(unknown).0, shares(&row));
            match facet {
                0 | 1 => {
                    missing += 0.5 * elements.share(unknown) * (s.blocked - s.straight);
                    rays = rays.min(row.row.rays);
                }
                2 | 3 => assert_eq!(row.row.state, ABSENT, "a black facet needs no row"),
                _ => {}
            }
        }
        // a row's error is about sqrt(F (1 - F)) n^-2/3
        let error = (opposite * (1.0 - opposite)).sqrt() * f64::from(rays).powf(-2.0 / 3.0);
        println!("missing {missing}, form factor {opposite}, stated error {error:.1e}");
        assert!((missing - opposite).abs() < 3.0 * error);
    });
}

#[test]
fn rows_through_mirrors_close_too() {
    // Along a chain each facet i keeps 1 - rho_s of what reaches it and passes rho_s on: the kept shares, the
    // escapes and the straight sky add up to 1, less what chains lose that are cut.
    let pairs = [(0.3, 0.6), (0.2, 0.4), (0.5, 0.45)];
    let materials = pairs.map(|(d, s)| Material::new(d, s));
    let room = scenes::plates_in_pipe();
    for (name, mesh, sides) in [("corner", scenes::corner(2), 2), ("room", room, 1), ("box", open_box(), 2)] {
        let mut case = Case::new(mesh, &materials);
        case.two_sided = sides == 2;
        case.with_geometry(2, &within(5e-3), |_, geometry| {
            let elements = geometry.elements();
            let mut mirrored = 0.0f64;
            for (unknown, row) in geometry.coupling().unwrap().rows(0..elements.unknowns()) {
                let kept = row.targets.iter().map(|r| {
                    let facet = elements.facet_of(r.unknown()).0;
                    let specular = geometry.scene().specular(geometry.scene().material(facet))[0];
                    r.weight * row.products(r.path())[0] * (1.0 - specular)
                });
                let through = row.escapes.filter(|b| row.depth(b.path) > 0);
                let through: f64 = through.map(|b| b.total() * row.products(b.path)[0]).sum();
                let s = shares(&row);
                mirrored = mirrored.max(s.mirrored);
                let sum = kept.sum::<f64>() + through + 1.0 - s.blocked;
                // roundings of at most a few thousand terms; a cut chain is a loss, never a gain
                assert!(sum <= 1.0 + 1e-12, "{name}, row {unknown}: {sum}");
                assert!(
                    1.0 - sum <= row.row.truncated_weight + 1e-12,
                    "{name}, row {unknown}: {sum} {}",
                    row.row.truncated_weight
                );
            }
            assert!(mirrored > 0.1, "{name}: mirrors bring {mirrored}");
        });
    }
}

fn open_box() -> Mesh {
    scenes::box_open(1.0, 1.5, 0.75, 1)
}

#[test]
fn a_mirror_pipe_loses_no_ray() {
    // diffuse floor, walls that mirror all: each ray of the floor leaves by the open top, straight or mirrored
    let case = Case::new(scenes::light_pipe(), &[Material::new(0.5, 0.0), Material::new(0.0, 1.0)]);
    case.with_geometry(2, &within(5e-3), |_, geometry| {
        let floor = |u: usize| geometry.elements().facet_of(u).0 < 2;
        let rows = geometry.coupling().unwrap().rows(0..geometry.elements().unknowns());
        for (unknown, row) in rows.filter(|(u, _)| floor(*u)) {
            let s = shares(&row);
            assert!(row.targets.is_empty(), "nothing comes back");
            assert!(s.mirrored > 0.5, "most of the sky is seen in mirrors");
            // sums of shares of 1/n, n a power of two; a chain that grazes the floor may meet a thousand mirrors
            let left = s.mirrored + row.row.truncated_weight - s.blocked;
            assert!(left.abs() < 1e-13, "row {unknown}: {} of {}", s.mirrored, s.blocked);
            assert!(row.row.truncated_weight < 1e-2, "row {unknown}: {} lost", row.row.truncated_weight);
        }
    });
}

#[test]
fn couplings_are_reciprocal_straight_and_through_mirrors() {
    let mixed = [Material::new(0.4, 0.3), Material::new(0.3, 0.5), Material::new(0.5, 0.2)];
    let plain = [Material::new(0.5, 0.0)];
    let corner = scenes::corner(2);
    let boxed = scenes::box_open(1.0, 1.5, 0.75, 1).of_material(0);
    for (name, mesh, materials) in [("box", boxed, &plain[..]), ("corner of mirrors", corner, &mixed[..])] {
        Case::new(mesh, materials).with_geometry(2, &within(1e-3), |_, geometry| {
            let (scene, elements) = (geometry.scene(), geometry.elements());
            let area = |unknown: usize| {
                let facet = elements.facet_of(unknown).0;
                scene.areas()[facet] * elements.share(unknown)
            };
            // the mirrors that a path met are told from one another by their product
            let mut factors: HashMap<(usize, usize, u64), f64> = HashMap::new();
            let mut rays = Vec::new();
            for (unknown, row) in geometry.coupling().unwrap().rows(0..elements.unknowns()) {
                rays.push(f64::from(row.row.rays));
                for r in row.targets {
                    factors.insert((unknown, r.unknown(), row.products(r.path())[0].to_bits()), r.weight);
                }
            }
            let (mut square, mut stated, mut pairs) = (0.0, 0.0, 0);
            for (&(i, j, path), &there) in &factors {
                let back = factors.get(&(j, i, path)).copied().unwrap_or(0.0);
                let difference = area(i) * there - area(j) * back;
                // that of independent rays
                let of = |k: usize, f: f64| area(k) * (f * (1.0 - f) / rays[k]).max(0.0).sqrt();
                let error = of(i, there).hypot(of(j, back));
                // and a few rays where a handful decide
                let slack = 5.0 * error + 4.0 * (area(i) / rays[i] + area(j) / rays[j]);
                assert!(difference.abs() < slack, "{name}, {i} {j}: {there} {back}");
                (square, stated, pairs) =
                    (square + difference * difference, stated + error * error, pairs + 1);
            }
            let ratio: f64 = (square / stated).sqrt();
            println!("{name}: rms of {pairs} pairs {ratio} of independent rays' error");
            // well-spread rays are never worse than independent ones
            assert!(pairs > 1000 && ratio < 1.0, "{name}: {ratio} over {pairs} pairs");
        });
    }
}

#[test]
fn a_convex_body_is_not_coupled() {
    for (name, mesh) in [("cube", scenes::cube_outside()), ("sphere", scenes::sphere(2))] {
        let case = Case::new(mesh, &[Material::new(0.5, 0.4)]);
        case.with_geometry(2, &within(2e-3), |_, geometry| {
            let coupling = geometry.coupling().unwrap();
            for (unknown, row) in coupling.rows(0..coupling.unknowns()) {
                assert_ne!(row.row.state, ABSENT, "the row is there");
                assert!(row.targets.is_empty() && row.escapes.count() == 0, "{name}: row {unknown}");
            }
            assert_eq!(geometry.report().pairs.sampled, 0);
            assert_eq!(geometry.elements().count(), geometry.scene().facets(), "{name}: nothing to divide");
        });
    }
}
