//! The plane model where input is odd but allowed: bodies that touch, lie apart or face away, one element, perfect and
//! black surfaces, lobes of any width. And where it is not: it is refused by name.

#[path = "support/plane_kernel.rs"]
mod plane_kernel;
#[allow(dead_code)]
#[path = "support/plane_reference/mod.rs"]
mod plane_reference;

use blik_kernel::plane::Vec2;
use blik_kernel::plane::host::{self, Settings};
use blik_kernel::plane::image::Seen;
use blik_kernel::plane::light::Light;
use blik_kernel::plane::scene::{Basis, BodyInput, PlaneGloss, PlaneInput, PlaneMaterial, RaySet, Shape};
use blik_kernel::{Error, Field};
use plane_kernel::{method, pair, solve, uniform, view};
use plane_reference::scene::Scene;

fn matt(diffuse: f64, specular: f64) -> PlaneMaterial {
    PlaneMaterial { diffuse, specular, gloss: None }
}

fn circle(x: f64, radius: f64) -> BodyInput<'static> {
    BodyInput { shape: Shape::Circle { centre: [x, 0.0], radius }, material: 0, elements: 8 }
}

/// 200 samples of a scene of one material seen at 0.2 radians.
fn look(
    bodies: &[BodyInput<'_>],
    material: PlaneMaterial,
    light: &Light<'_>,
    settings: &Settings,
) -> Result<Vec<Seen>, Error> {
    let input = PlaneInput { bodies, materials: &[material] };
    host::solve(&input, light, settings, |solved, report, scratch| {
        assert!(report.contraction.is_finite() && report.solver.is_finite(), "{report:?}");
        host::image(solved, 0.2, 200, scratch)
    })?
}

/// The lowest and highest radiance of the object's samples.
fn extremes(seen: &[Seen]) -> (f64, f64) {
    assert!(seen.iter().all(|s| s.radiance.is_finite() && s.lost.is_finite()), "{seen:?}");
    let values = seen.iter().filter(|s| s.object).map(|s| s.radiance);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// All bases and methods, reflections counted and not.
fn methods() -> Vec<Settings> {
    let exact = |settings| Settings { cutoff: 1e-13, solver: 1e-13, ..settings };
    let mut all = vec![exact(Settings::for_tolerance(1e-2)), exact(Settings::for_tolerance(1e-4))];
    for basis in [Basis::Constant, Basis::Linear, Basis::Panels(6)] {
        all.push(exact(Settings { basis, ..method('G') }));
    }
    all.push(exact(Settings { max_bounces: Some(64), ..method('G') }));
    all
}

fn one(body: BodyInput<'static>) -> BodyInput<'static> {
    BodyInput { elements: 1, ..body }
}

#[test]
fn furnaces_of_any_shape() {
    // below the circle and as thin as can be
    let line = [[-1.0, -1.2], [-1.0, -1.2 - 1e-6], [1.0, -1.2 - 1e-6], [1.0, -1.2]];
    let shape = Shape::Polyline { points: &line, closed: true, smooth: false };
    let slab = BodyInput { shape, material: 0, elements: 1 };
    let scenes = [
        ("one circle", vec![circle(0.0, 1.0)]),
        ("touching", vec![circle(-1.0, 1.0), circle(1.0, 1.0)]),
        ("touching but for an ulp", vec![circle(-1.0, 1.0), circle(1.0 + 3e-16, 1.0)]),
        ("one element", vec![one(circle(-1.1, 1.0)), one(circle(1.1, 1.0))]),
        ("a grain beside a globe", vec![circle(-1.0, 1.0), circle(1e-7, 1e-7)]),
        ("far apart", vec![circle(0.0, 1.0), circle(1e9, 1.0)]),
        ("tiny", vec![circle(-1.1e-60, 1e-60), circle(1.1e-60, 1e-60)]),
        ("huge", vec![circle(-1.1e60, 1e60), circle(1.1e60, 1e60)]),
        ("on a thin slab", vec![circle(0.0, 1.0), slab]),
    ];
    for (name, bodies) in &scenes {
        for settings in methods() {
            let mirror = extremes(&look(bodies, matt(0.7, 0.3), &uniform(), &settings).unwrap());
            // between circle and slab 64 reflections leave out a little
            let near = if settings.max_bounces.is_some() { 1e-5 } else { 1e-9 };
            // the lowest is infinite where no sample meets the object
            assert!(mirror.0 > 1.0 - near && mirror.1 < 1.0 + 1e-9, "{name} {settings:?}: {mirror:?}");
            // a lobe keeps at least half of rho_0; polynomials overshoot a little next to where bodies touch
            let rays = Some(RaySet::Gauss([1; 3]));
            let glossy =
                PlaneMaterial { gloss: Some(PlaneGloss { axis_ratio: 20.0, rays }), ..matt(0.7, 0.3) };
            let gloss = extremes(&look(bodies, glossy, &uniform(), &settings).unwrap());
            assert!(gloss.0 > 0.7 && gloss.1 < 1.01, "{name} {settings:?}: {gloss:?}");
        }
    }
}

#[test]
fn black_and_perfect_surfaces() {
    let bodies = [circle(-1.0, 1.0), circle(1.0, 1.0)];
    for settings in methods() {
        let of = |material| extremes(&look(&bodies, material, &uniform(), &settings).unwrap());
        assert_eq!(of(matt(0.0, 0.0)), (0.0, 0.0));
        // nothing diffuse to solve for; where reflections are counted the cusp keeps what is reflected more often
        let (low, high) = of(matt(0.0, 1.0));
        assert!(high <= 1.0 && (low == 1.0 || settings.max_bounces.is_some()), "{low} {high}");
        let (low, high) = of(matt(1.0, 0.0));
        assert!((low - 1.0).abs() < 1e-9 && (high - 1.0).abs() < 1e-9 || settings.max_bounces.is_some());
    }
}

#[test]
fn closed_rooms_end() {
    // a room that no light enters or leaves, with a dim circle inside: chains need not end, and are cut
    let room = [[2.0, 2.0], [2.0, -2.0], [-2.0, -2.0], [-2.0, 2.0]];
    let shape = Shape::Polyline { points: &room, closed: true, smooth: false };
    let bodies =
        [BodyInput { shape, material: 0, elements: 1 }, BodyInput { material: 1, ..circle(0.3, 0.5) }];
    let light = uniform();
    for wall in [matt(0.0, 1.0), matt(0.2, 0.7), matt(1.0, 0.0)] {
        let input = PlaneInput { bodies: &bodies, materials: &[wall, matt(0.5, 0.0)] };
        let settings = Settings::for_tolerance(1e-2);
        let inside = host::solve(&input, &light, &settings, |solved, _, scratch| {
            solved.radiance(Vec2::new(-1.0, 0.5), Vec2::new(0.6, -0.8), scratch)
        });
        assert_eq!(inside.unwrap().radiance, 0.0, "{wall:?}");
    }
}

#[test]
fn bright_wells() {
    // polynomials have negative weights, so that rows' absolute sums may exceed 1 where nothing diverges
    let well = [[1.0, 3.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 3.0]];
    let shape = Shape::Polyline { points: &well, closed: false, smooth: false };
    for (rho, elements) in [((0.95, 0.05), 2), ((1.0, 0.0), 4), ((0.5, 0.5), 1)] {
        for settings in [Settings::for_tolerance(1e-4), Settings { basis: Basis::Panels(6), ..method('G') }] {
            let bodies = [BodyInput { shape, material: 0, elements }];
            let input = PlaneInput { bodies: &bodies, materials: &[matt(rho.0, rho.1)] };
            let seen = host::solve(&input, &uniform(), &settings, |solved, report, scratch| {
                assert!(report.solver < 1e-5, "{rho:?}: {report:?}");
                solved.radiance(Vec2::new(0.3, 5.0), Vec2::new(0.0, -1.0), scratch).radiance
            });
            // a furnace: what chains cut at 1e-5 leave, 20 times over between bright walls
            let radiance = seen.unwrap_or_else(|e| panic!("{rho:?} {settings:?}: {e}"));
            assert!((radiance - 1.0).abs() < 1e-4, "{rho:?}: {radiance}");
        }
    }
}

#[test]
fn backs_and_edges() {
    let seen_from_above = |points: &[[f64; 2]], smooth| {
        let shape = Shape::Polyline { points, closed: false, smooth };
        let bodies = [BodyInput { shape, material: 0, elements: 3 }];
        look(&bodies, matt(0.5, 0.5), &uniform(), &Settings::for_tolerance(1e-3)).unwrap()
    };
    for smooth in [false, true] {
        // fronts are on the right of the direction
        let front = seen_from_above(&[[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], smooth);
        assert!(front.iter().all(|s| s.object && (s.radiance - 1.0).abs() < 1e-12));
        let back = seen_from_above(&[[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]], smooth);
        assert!(back.iter().all(|s| s.object && s.radiance == 0.0));
        // there and back again
        let folded = seen_from_above(&[[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0]], smooth);
        assert!(extremes(&folded).1 <= 1.0 + 1e-12);
    }
    // seen along its length it has no width: every sample is the same ray
    let shape = Shape::Polyline { points: &[[0.0, 1.0], [0.0, -1.0]], closed: false, smooth: false };
    let bodies = [BodyInput { shape, material: 0, elements: 3 }];
    let input = PlaneInput { bodies: &bodies, materials: &[matt(0.5, 0.5)] };
    let seen = host::solve(&input, &uniform(), &Settings::for_tolerance(1e-3), |solved, _, scratch| {
        host::image(solved, 0.0, 3, scratch)
    });
    assert!(seen.unwrap().unwrap().iter().all(|s| s.radiance.is_finite()));
}

#[test]
fn lobes_of_any_width() {
    // the tolerance chooses the rays of widths that the study does not have too
    let exact = Settings { max_bounces: Some(4), cutoff: 1e-12, ..Settings::for_tolerance(1e-2) };
    let image = |scene: &Scene, rays: Option<RaySet>, settings: &Settings| -> Vec<f64> {
        solve(scene, 1, rays, &uniform(), settings, |solved, _, scratch| {
            let seen = host::image(solved, 0.0, 200, scratch).unwrap();
            seen.iter().filter(|s| s.object).map(|s| s.radiance).collect()
        })
    };
    for ratio in [1.0, 1.5, 4.0, 5.0, 7.0, 9.0, 25.0, 200.0, 2000.0, 9999.0] {
        let scene = pair(2.5, 0.0, 0.8, Some(ratio));
        // an eighth of the error of the rays that it judges
        let truth = image(&scene, Some(RaySet::Split([64, 16, 4])), &exact);
        for tolerance in [1e-2, 2e-3] {
            let settings = Settings { max_bounces: Some(4), ..Settings::for_tolerance(tolerance) };
            let got = plane_reference::eps(&image(&scene, None, &settings), &truth, |_| true, 1.0);
            println!("T = {ratio} at {tolerance:.0e}: {got:.1e}");
            assert!(got < tolerance, "{ratio}: {got}");
        }
    }
    // from 1e4 on an ideal mirror, bit by bit
    let mirror = |ratio| {
        solve(&pair(2.5, 0.2, 0.6, ratio), 8, None, &uniform(), &exact, |s, _, scratch| view(s, 0.0, scratch))
    };
    assert!(mirror(Some(1e4)) == mirror(None) && mirror(Some(f64::MAX)) == mirror(None));
}

#[test]
fn settings_out_of_range_are_refused() {
    let refused = |settings: Settings, field| {
        let error = look(&[circle(0.0, 1.0)], matt(0.5, 0.5), &uniform(), &settings).unwrap_err();
        assert!(matches!(error, Error::Range { field: f, .. } if f == field), "{error:?}");
    };
    let good = Settings::for_tolerance(1e-3);
    for tolerance in [0.0, -1.0, 0.2, 1e-14, f64::NAN, f64::INFINITY] {
        refused(Settings::for_tolerance(tolerance), Field::Tolerance);
        refused(Settings { tolerance, ..good }, Field::Tolerance);
    }
    for share in [-1e-9, 1.5, f64::NAN] {
        refused(Settings { cutoff: share, ..good }, Field::Tolerance);
        refused(Settings { solver: share, ..good }, Field::Tolerance);
    }
    // reflections are told apart up to 64
    for most in [0, 65, u32::MAX] {
        refused(Settings { max_bounces: Some(most), ..good }, Field::MaxBounces);
    }
    let gloss = |axis_ratio, rays| {
        let glossy = PlaneMaterial { gloss: Some(PlaneGloss { axis_ratio, rays }), ..matt(0.2, 0.5) };
        look(&[circle(0.0, 1.0)], glossy, &uniform(), &good).unwrap_err()
    };
    for ratio in [0.5, f64::NAN, f64::INFINITY] {
        let error = gloss(ratio, None);
        assert!(matches!(error, Error::MaterialRange { field: Field::AxisRatio, .. }), "{error:?}");
    }
    for rays in [RaySet::Gauss([0, 1, 1]), RaySet::Paper { spacing: f64::NAN, renormalised: true }] {
        let error = gloss(10.0, Some(rays));
        assert!(matches!(error, Error::MaterialRange { field: Field::GlossRays, .. }), "{error:?}");
    }
}
