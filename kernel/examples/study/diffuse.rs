//! Diffuse surfaces and ideal mirrors: error against elements and time, and three against four reflections.

use crate::chart::{Figure, Series};
use crate::plane_kernel::{SAMPLES, eps, flat, image, method, pair, uniform};
use crate::plane_reference::diffuse::{Resolution, Solution};
use blik_kernel::plane::host::Settings;
use std::time::Instant;

type Image = Vec<Option<f64>>;

fn truth(diffuse: f64, specular: f64, bounces: Option<usize>) -> Image {
    let scene = pair(2.5, diffuse, specular, None);
    Solution::new(&scene, &|_| 1.0, &[], bounces, Resolution::FINEST).image(0.0, SAMPLES)
}

/// eps between images of three and of four reflections, which the paper gives as the error of its truth, and of four
/// against all, which is that error.
pub fn bounces() -> Figure {
    let mut series = Vec::new();
    for total in [0.4, 0.6, 0.8] {
        let (mut near, mut far) = (Vec::new(), Vec::new());
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let [three, four, all] =
                [Some(3), Some(4), None].map(|b| truth(total * (1.0 - share), total * share, b));
            near.push((share, eps(&three, &four)));
            far.push((share, eps(&four, &all)));
        }
        series.push(Series { name: format!("total {total}: 3 against 4"), points: near });
        series.push(Series { name: format!("total {total}: 4 against all"), points: far });
    }
    Figure {
        name: "bounces",
        title: "Reflections counted: the paper's truth has four",
        x: "mirror share of the reflectance",
        y: "eps",
        log: (false, true),
        series,
    }
}

/// The least seconds of a few runs, and the image.
fn timed(run: impl Fn() -> Image) -> (f64, Image) {
    let mut least = f64::MAX;
    let begin = Instant::now();
    loop {
        let start = Instant::now();
        let image = run();
        least = least.min(start.elapsed().as_secs_f64());
        if begin.elapsed().as_secs_f64() > 0.1 {
            return (least, image);
        }
    }
}

/// eps against unknowns of a circle, and against seconds on one thread, at rho_d = rho_s = 0.2.
pub fn convergence() -> [Figure; 2] {
    let rho = (0.2, 0.2);
    let scene = pair(2.5, rho.0, rho.1, None);
    let truth = truth(rho.0, rho.1, None);
    let (mut by_size, mut by_time) = (Vec::new(), Vec::new());
    let mut add = |name: &str, sizes: &[u32], run: &dyn Fn(u32) -> (u32, Image)| {
        let (mut sizes_eps, mut times_eps) = (Vec::new(), Vec::new());
        for &n in sizes {
            let (unknowns, _) = run(n);
            let (seconds, image) = timed(|| run(n).1);
            let error = eps(&image, &truth);
            sizes_eps.push((f64::from(unknowns), error));
            times_eps.push((seconds * 1e3, error));
        }
        by_size.push(Series { name: name.into(), points: sizes_eps });
        by_time.push(Series { name: name.into(), points: times_eps });
    };
    let sizes = [32, 64, 128, 256, 512];
    add("A: facets, facet normals", &sizes, &|n| (n, flat(n as usize, rho, &method('A'), false)));
    add("F: linear, interpolated normals", &sizes, &|n| (n, flat(n as usize, rho, &method('F'), true)));
    let circles = |letter: char| {
        let scene = &scene;
        move |n: u32| (n, image(scene, n, &method(letter), &uniform(), 0.0))
    };
    add("D2: true circles, constant", &sizes, &circles('D'));
    add("G: true circles, linear", &sizes, &circles('G'));
    add("H: G, 4 chains a pair", &sizes, &circles('H'));
    let panels = |tolerance: f64| {
        let scene = &scene;
        let settings = Settings::for_tolerance(tolerance);
        move |n: u32| (4 * n, image(scene, n, &settings, &uniform(), 0.0))
    };
    add("Blik at 1e-4", &[4, 6, 8, 12, 16, 24], &panels(1e-4));
    add("Blik at 1e-6", &[6, 8, 12, 16, 24, 32, 48], &panels(1e-6));
    let common = |name, title, x, series| Figure { name, title, x, y: "eps", log: (true, true), series };
    [
        common("elements", "Error against unknowns, rho_d = rho_s = 0.2", "unknowns of a circle", by_size),
        common("time", "Error against time, rho_d = rho_s = 0.2", "milliseconds, one thread", by_time),
    ]
}
