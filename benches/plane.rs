//! The plane model of the paper's validation on one thread: two circles, distance 2.5, uniform sky, 1,000 samples.
//!
//! A run is everything: scene, coupling, solution, image. Errors are printed beside the times, measured against the
//! reference solver; the bench fails where one is above the tolerance asked for. `cargo bench --bench plane`

#[path = "../tests/support/plane_kernel.rs"]
mod plane_kernel;
#[allow(dead_code)]
#[path = "../tests/support/plane_reference/mod.rs"]
mod plane_reference;

use blik_kernel::plane::host::Settings;
use blik_kernel::plane::rows::Method;
use blik_kernel::plane::scene::{Basis, RaySet};
use criterion::{Criterion, criterion_group, criterion_main};
use plane_kernel::{SAMPLES, eps, image, method, pair, solve, uniform, view};
use plane_reference::diffuse::{Resolution, Solution};
use plane_reference::gloss::Gloss;
use std::hint::black_box;

/// Prints an error and ends the bench where it is above what was asked for.
fn hold(what: &str, eps: f64, asked: f64) {
    println!("{what}: eps {eps:.1e}");
    if eps.is_nan() || eps > asked {
        println!("{what}: {asked:.1e} was asked for");
        std::process::exit(1);
    }
}

/// Diffuse surfaces and ideal mirrors: the kernel's own method at two tolerances, and the study's method H.
fn diffuse_mirror(c: &mut Criterion) {
    let mut group = c.benchmark_group("plane_diffuse_mirror");
    for (rd, rs) in [(0.4, 0.0), (0.2, 0.2), (0.2, 0.6)] {
        let scene = pair(2.5, rd, rs, None);
        let truth = Solution::new(&scene, &|_| 1.0, &[], None, Resolution::FINEST).image(0.0, SAMPLES);
        let runs = [
            ("1e-4", Settings::for_tolerance(1e-4), 12),
            ("1e-5", Settings::for_tolerance(1e-5), 16),
            ("H128", method('H'), 128),
        ];
        for (name, settings, elements) in runs {
            let run = || image(&scene, elements, &settings, &uniform(), 0.0);
            hold(&format!("rho_d {rd}, rho_s {rs}, {name}"), eps(&run(), &truth), settings.tolerance);
            group.bench_function(format!("{rd}_{rs}/{name}"), |b| b.iter(|| black_box(run())));
        }
    }
    group.finish();
}

/// Lobes of rho_0 = 0.8, four reflections at most: the paper's three rays, three Gauss rays, and sets by tolerance.
fn gloss(c: &mut Criterion) {
    let mut group = c.benchmark_group("plane_gloss");
    let (basis, method) = (Basis::Constant, Method::Facets { chains: 0 });
    let settings =
        Settings { basis, method, max_bounces: Some(4), cutoff: 1e-9, solver: 1e-9, tolerance: 1e-2 };
    for ratio in [50.0, 10.0, 3.0] {
        let scene = pair(2.5, 0.0, 0.8, Some(ratio));
        let truth = Gloss::new(&scene, (1.0, None), 4, &[48, 24, 16], 1).symmetric_image(SAMPLES, 4);
        let lobe = blik_kernel::plane::lobe::PlaneLobe::new(ratio).expect("a ratio above 1");
        let paper = RaySet::Paper { spacing: lobe.equivalent_width(1.0), renormalised: false };
        let sets = [
            ("paper_3", Some(paper), 1e-2),
            ("gauss_3", Some(RaySet::Gauss([3, 3, 1])), 1e-2),
            ("1e-2", None, 1e-2),
            ("2e-3", None, 2e-3),
        ];
        for (name, set, tolerance) in sets {
            let settings = Settings { tolerance, ..settings };
            let run = || solve(&scene, 1, set, &uniform(), &settings, |s, _, scratch| view(s, 0.0, scratch));
            // the fixed sets ask for no error
            let asked = if set.is_none() { tolerance } else { f64::INFINITY };
            hold(&format!("T0 {ratio}, {name}"), eps(&run(), &truth), asked);
            group.bench_function(format!("T{ratio}/{name}"), |b| b.iter(|| black_box(run())));
        }
    }
    group.finish();
}

criterion_group!(benches, diffuse_mirror, gloss);
criterion_main!(benches);
