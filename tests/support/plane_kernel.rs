//! Hands the plane reference's scenes to the kernel, so that both compute the same one.
//!
//! Apart from the support modules that use no kernel code: a test takes it with
//! `#[path = "support/plane_kernel.rs"] mod plane_kernel;` beside `mod plane_reference`.
#![allow(dead_code)]

use crate::plane_reference::scene::{Scene, Shape, Surface};
use blik_kernel::plane::host::{self, Report, Settings};
use blik_kernel::plane::image::{Seen, Solved};
use blik_kernel::plane::light::{Light, Sky};
use blik_kernel::plane::rows::Method;
use blik_kernel::plane::scene::{
    Basis, BodyInput, PlaneGloss, PlaneInput, PlaneMaterial, RaySet, Shape as Body,
};
use blik_kernel::plane::scratch::Scratch;

/// Samples of an image, as the study has them.
pub const SAMPLES: usize = 1000;

/// Two circles of radius 1, `distance` between their centres.
pub fn pair(distance: f64, diffuse: f64, specular: f64, lobe: Option<f64>) -> Scene {
    let circle =
        |x: f64| Surface { shape: Shape::Circle { centre: [x, 0.0], radius: 1.0 }, diffuse, specular, lobe };
    Scene { surfaces: vec![circle(-0.5 * distance), circle(0.5 * distance)] }
}

/// The ten variants of the study: totals 0.4 and 0.8, mirror shares 0, 1/4, 1/2, 3/4, 1.
pub fn variants() -> Vec<(f64, f64)> {
    let of =
        |total: f64| (0..5).map(move |i| (total * (1.0 - f64::from(i) / 4.0), total * f64::from(i) / 4.0));
    [0.4, 0.8].into_iter().flat_map(of).collect()
}

/// The kernel's methods of the study, by the letters of its tables.
pub fn method(letter: char) -> Settings {
    let (basis, method) = match letter {
        'A' | 'D' => (Basis::Constant, Method::Facets { chains: 1 }),
        'G' | 'F' => (Basis::Linear, Method::Facets { chains: 1 }),
        'H' => (Basis::Linear, Method::Facets { chains: 4 }),
        _ => panic!("no method {letter}"),
    };
    Settings { basis, method, max_bounces: None, cutoff: 1e-9, solver: 1e-10, tolerance: 1e-3 }
}

/// Solves a scene whose surfaces are cut into `elements` and hands the solution over. `rays` of lobes: `None` leaves
/// them to the settings' tolerance.
pub fn solve<R>(
    scene: &Scene,
    elements: u32,
    rays: impl Into<Option<RaySet>>,
    light: &Light<'_>,
    settings: &Settings,
    with: impl FnOnce(&Solved<'_>, &Report, &mut Scratch<'_>) -> R,
) -> R {
    let rays = rays.into();
    let material = |s: &Surface| PlaneMaterial {
        diffuse: s.diffuse,
        specular: s.specular,
        gloss: s.lobe.map(|axis_ratio| PlaneGloss { axis_ratio, rays }),
    };
    let ends: Vec<[[f64; 2]; 2]> = scene
        .surfaces
        .iter()
        .map(|s| match s.shape {
            Shape::Circle { .. } => [[0.0; 2]; 2],
            Shape::Segment { a, b } => [a, b],
        })
        .collect();
    let body = |(index, s): (usize, &Surface)| BodyInput {
        shape: match s.shape {
            Shape::Circle { centre, radius } => Body::Circle { centre, radius },
            Shape::Segment { .. } => Body::Polyline { points: &ends[index], closed: false, smooth: false },
        },
        material: index,
        elements,
    };
    let materials: Vec<PlaneMaterial> = scene.surfaces.iter().map(material).collect();
    let bodies: Vec<BodyInput<'_>> = scene.surfaces.iter().enumerate().map(body).collect();
    host::solve(&PlaneInput { bodies: &bodies, materials: &materials }, light, settings, with)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// A circle of radius 1 as a polygon of `n` sides.
fn polygon(x: f64, n: usize) -> Vec<[f64; 2]> {
    let corner = |i: usize| {
        let (s, c) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
        [x + c, s]
    };
    (0..n).map(corner).collect()
}

/// The study's method A: two circles at 2.5 as polygons of `n` sides. `smooth`: with interpolated normals, method F.
pub fn flat(n: usize, rho: (f64, f64), settings: &Settings, smooth: bool) -> Vec<Option<f64>> {
    let points = [polygon(-1.25, n), polygon(1.25, n)];
    let body = |points| BodyInput {
        shape: Body::Polyline { points, closed: true, smooth },
        material: 0,
        elements: 1,
    };
    let bodies = [body(&points[0]), body(&points[1])];
    let materials = [PlaneMaterial { diffuse: rho.0, specular: rho.1, gloss: None }];
    let input = PlaneInput { bodies: &bodies, materials: &materials };
    host::solve(&input, &uniform(), settings, |solved, _, scratch| view(solved, 0.0, scratch))
        .unwrap_or_else(|e| panic!("{e}"))
}

/// A uniform sky of 1.
pub fn uniform() -> Light<'static> {
    Light::new(Sky::Uniform(1.0), None).unwrap()
}

/// The kernel's image of a scene of diffuse surfaces and ideal mirrors, `None` where a sample misses the object.
pub fn image(
    scene: &Scene,
    elements: u32,
    settings: &Settings,
    light: &Light<'_>,
    g: f64,
) -> Vec<Option<f64>> {
    solve(scene, elements, RaySet::Gauss([3; 3]), light, settings, |solved, _, scratch| {
        view(solved, g, scratch)
    })
}

/// A view of a solution.
pub fn view(solved: &Solved<'_>, g: f64, scratch: &mut Scratch<'_>) -> Vec<Option<f64>> {
    let seen: Vec<Seen> = host::image(solved, g, SAMPLES, scratch).unwrap();
    seen.iter().map(|s| s.object.then_some(s.radiance)).collect()
}

/// eps of eq. (16) over the samples that hit; both must hit the same.
pub fn eps(mine: &[Option<f64>], truth: &[Option<f64>]) -> f64 {
    assert!(mine.iter().zip(truth).all(|(a, b)| a.is_some() == b.is_some()), "silhouettes differ");
    let flat = |x: &[Option<f64>]| x.iter().map(|v| v.unwrap_or(0.0)).collect::<Vec<_>>();
    crate::plane_reference::eps(&flat(mine), &flat(truth), |i| truth[i].is_some(), 1.0)
}
