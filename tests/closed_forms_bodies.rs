//! What a distant observer measures of spheres and cylinders, against closed forms (tests/data/cases/README.md).

#[path = "support/kernel.rs"]
mod kernel;
mod support;

use blik_kernel::host::Lit;
use blik_kernel::math::Vec3;
use blik_kernel::signature::{self, View};
use glam::{DVec3, dvec3};
use kernel::{Soup, solve, solve_soup, within};
use std::f64::consts::{PI, TAU};
use support::cases;
use support::scenes::{self, Mesh};
use support::twin::{Material, Model, Scene, Sky, Sun};

#[track_caller]
fn close(what: &str, value: f64, truth: f64, tolerance: f64) {
    println!("{what}: {value}, truth {truth}, off by {:.1e} of {tolerance:.1e}", (value - truth).abs());
    assert!((value - truth).abs() <= tolerance, "{what}: {value}, not {truth}");
}

/// Radiant intensity and projected area toward -`forward`, from `cells` x `cells` rays.
fn look(lit: &Lit<'_>, forward: DVec3, cells: usize) -> (f64, f64) {
    let solved = lit.solved();
    let view = View::new(&solved, Vec3::from_array(forward.to_array()), cells).unwrap();
    let mut scratch = vec![0; signature::scratch_bytes().unwrap()];
    let sums = signature::whole(&solved, &view, &mut scratch).unwrap();
    (sums.intensity[0], sums.area)
}

/// The unit sphere with its true normals at the vertices; interpolated between them they are radial everywhere.
fn mirror_sphere(level: u32) -> (Mesh, Soup) {
    let mesh = scenes::sphere(level);
    let mut soup = Soup::new(&Scene::new(&mesh, &[Material::new(0.0, 1.0)]));
    soup.normals = (0..mesh.facets.len()).flat_map(|f| mesh.corners(f)).map(|c| c.to_array()).collect();
    (mesh, soup)
}

/// How deep the facets' middles lie inside the unit sphere at most.
fn depth(mesh: &Mesh) -> f64 {
    let inside = |f| {
        let [a, b, c] = mesh.corners(f);
        1.0 - (a + b + c).length() / 3.0
    };
    (0..mesh.facets.len()).map(inside).fold(0.0, f64::max)
}

#[test]
fn a_lambert_sphere_in_the_sun() {
    let mesh = scenes::sphere(4);
    let material = [Material::new(1.0, 0.0)];
    for degrees in [0, 45, 90, 135] {
        let phase = f64::from(degrees).to_radians();
        let toward = dvec3(phase.sin(), 0.0, phase.cos());
        let scene = Scene::new(&mesh, &material).sun(Sun::new(toward, 1.0, 0.0));
        // the convex mesh's own intensity, by hand: sum of A cos cos / pi
        let share = |f: usize| {
            let n = scene.normals[f];
            scene.areas[f] * n.dot(toward).max(0.0) * n.z.max(0.0) / PI
        };
        let of_mesh: f64 = (0..scene.areas.len()).map(share).sum();
        let id = format!("I-LSPHERE-{degrees}");
        // facets lie up to 2 h inside the unit sphere (h: the deepest point), which takes that share of the area; at
        // a phase of 135 degrees the crescent is of limbs alone, and single facets matter: as much of the full disc
        close(&id, of_mesh, cases::value(&id), 2.0 * depth(&mesh) * cases::value("I-LSPHERE-0"));
        let (intensity, _) = solve(&scene, &within(2e-2), |_, lit| look(lit, -DVec3::Z, 256));
        // 256^2 rays: n^-3/2 of the value for the outline, here of the full disc's
        close(&id, intensity, of_mesh, 256f64.powf(-1.5) * cases::value("I-LSPHERE-0"));
    }
}

#[test]
fn a_mirror_sphere_scatters_the_sun_alike_in_all_directions() {
    let (mesh, soup) = mirror_sphere(4);
    let half_angle = 5f64.to_radians();
    let sun = Sun::new(DVec3::Z, 1.0, half_angle);
    // the disc's flux through a sphere is 2 pi (1 - cos) of its radiance E/(pi sin^2), more than E
    let brighter = 2.0 / (1.0 + half_angle.cos());
    let scene = Scene::new(&mesh, &[Material::new(0.0, 1.0)]).sun(sun);
    solve_soup(&soup, &scene, &within(2e-2), |_, lit| {
        for degrees in [30, 60, 90, 120] {
            let phase = f64::from(degrees).to_radians();
            let (intensity, _) = look(lit, -dvec3(phase.sin(), 0.0, phase.cos()), 768);
            let truth = cases::value("I-MSPHERE") * brighter;
            // the highlight, pi/4 (5 degrees)^2 of a disc of pi, has 0.15 % of 768^2 pi/4 rays, 870 of them:
            // 870^-3/4 = 0.6 %; the mesh lies up to h inside and mirrors from there, 2 h less
            close(
                &format!("I-MSPHERE at {degrees}"),
                intensity,
                truth,
                (2.0 * 0.6e-2 + 2.0 * depth(&mesh)) * truth,
            );
        }
    });
}

#[test]
fn a_mirror_cylinder_in_the_sun() {
    // 64 flat strips around z, smooth: in the plane across the axis, per length and radian
    let strips = 64;
    let point = |k: usize, z: f64| {
        let a = TAU * k as f64 / strips as f64;
        dvec3(a.cos(), a.sin(), z)
    };
    let (mut mesh, mut normals) = (Mesh::default(), Vec::new());
    for k in 0..strips {
        let corners = [point(k, 0.0), point(k + 1, 0.0), point(k + 1, 1.0), point(k, 1.0)];
        let base = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners.map(|c| c.to_array()));
        for facet in [[0, 1, 2], [0, 2, 3]] {
            mesh.facets.push(facet.map(|i| base + i as u32));
            mesh.materials.push(0);
            normals.extend(facet.map(|i: usize| dvec3(corners[i].x, corners[i].y, 0.0).to_array()));
        }
    }
    let half_angle = 5f64.to_radians();
    let phase = 90f64.to_radians();
    let toward_sun = dvec3(phase.cos(), phase.sin(), 0.0);
    let scene = Scene::new(&mesh, &[Material::new(0.0, 1.0)]).sun(Sun::new(toward_sun, 1.0, half_angle));
    let mut soup = Soup::new(&scene);
    soup.normals = normals;
    let (intensity, _) = solve_soup(&soup, &scene, &within(2e-2), |_, lit| look(lit, -DVec3::X, 512));
    // Toward the observer in the plane the disc shows its width, 2 a, of radiance E/(pi sin^2 a): the case's intensity
    // per radian times that. Strips lie 1 - cos(pi/64) = 1.2e-3 inside; 512^2 rays on a highlight of 3 % of the width:
    // its edges, 16 columns apart, to half a column in a sequence of 512 rows, 0.1 %; a^2/24 = 3e-4
    let truth = cases::value("I-MCYL-90") * 2.0 * half_angle / (PI * half_angle.sin().powi(2));
    close("I-MCYL-90", intensity, truth, 3e-3 * truth);
}

#[test]
fn pixels_of_a_mirror_sphere() {
    let (mesh, soup) = mirror_sphere(5);
    // L = 1 + 0.5 dir_z
    let scene = Scene::new(&mesh, &[Material::new(0.0, 1.0)]).sky(Sky::new(Model::Gradient, 1.5, 0.5));
    let inside = depth(&mesh);
    solve_soup(&soup, &scene, &within(2e-3), |_, lit| {
        for (y, z) in [(0.0, 0.0), (0.3, 0.4), (0.6, -0.6), (0.0, 0.99)] {
            let id = format!("I-MSPHERE-PIX({y:.1},{z})").replace(",0)", ",0.0)");
            let value = kernel::radiance(lit, [3.0, y, z], [-1.0, 0.0, 0.0], 0);
            // a ray meets a facet up to h inside: with the radius r = 1 - h the law reads z sqrt(r^2 - y^2 - z^2)/r^2
            let law = |r: f64| 1.0 + z * (r * r - y * y - z * z).sqrt() / (r * r);
            let truth = cases::value(&id);
            close(&id, value, truth, (law(1.0 - inside) - law(1.0)).abs() + 1e-12);
        }
        // the whole disc, from the side and from above: as much as the sphere's outline shows of a sky of 1
        for (id, forward) in [("I-MSPHERE-TOT", -DVec3::X), ("I-MSPHERE-TOP", -DVec3::Z)] {
            let (intensity, area) = look(lit, forward, 256);
            // the mesh's outline is up to h inside, 2 h of the area; 256^2 rays: n^-3/2
            let tolerance = (2.0 * inside + 256f64.powf(-1.5)) * PI;
            close(id, intensity, cases::value(id), tolerance);
            close("projected area", area, PI, tolerance);
        }
    });
}

#[test]
fn the_contrast_of_a_convex_body_under_a_uniform_sky() {
    let scene =
        Scene::new(&scenes::sphere(2), &[Material::new(0.4, 0.0)]).sky(Sky::new(Model::Uniform, 1.0, 1.0));
    solve(&scene, &within(2e-3), |host, lit| {
        let (report, _) = host.signature(lit, Vec3::new(0.3, -0.5, 0.2)).unwrap();
        let truth = cases::value("I-CONTRAST-DIFF");
        // the sum of some thousand equal radiances, and its division by as many
        close("I-CONTRAST-DIFF", report.contrast[0].unwrap(), truth, 1e-12);
        // in every pixel
        let value = kernel::radiance(lit, [0.1, 0.2, 3.0], [0.0, 0.0, -1.0], 0);
        close("I-CONTRAST-DIFF, pixel", value - 1.0, truth, 1e-14);
    });
}
