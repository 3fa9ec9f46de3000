//! Bright spots of sky tables are suns: what they light has the shadows of a sun of their irradiance, size and place.

#[path = "support/kernel.rs"]
mod kernel;
mod support;

use glam::dvec3;
use kernel::{radiance, solve, within};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use support::scenes::Mesh;
use support::twin::{Material, Model, Rng, Scene, Sky, Sun};

/// A floor of 4 by 4 below a black plate of 1 by 1 at height 1, open on both sides.
fn floor_and_plate() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-2.0, -2.0, 0.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 4.0, 0.0), 2, 0);
    mesh.rectangle(dvec3(-0.5, -0.5, 1.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0), 1, 1);
    mesh.rectangle(dvec3(-0.5, -0.5, 1.0), dvec3(0.0, 1.0, 0.0), dvec3(1.0, 0.0, 0.0), 1, 1);
    mesh
}

fn table(rows: usize, columns: usize, values: Vec<f64>, bands: usize) -> Sky {
    let model = Model::Table { rows, columns, values, azimuth_zero: dvec3(1.0, 0.0, 0.0) };
    Sky { radiance: vec![1.0; bands], ground: vec![0.0; bands], ..Sky::new(model, 1.0, 0.0) }
}

#[test]
fn a_bright_spot_is_a_sun() {
    let mut rng = Rng(51);
    let mesh = floor_and_plate();
    let materials = [Material::new(0.5, 0.0), Material::new(0.0, 0.0)];
    for number in 0..14 {
        let (rows, columns) = [(128, 256), (64, 128), (256, 512)][number % 3];
        let (row, column) =
            ((rows as f64 * (0.1 + 0.3 * rng.unit())) as usize, (columns as f64 * rng.unit()) as usize);
        let mut values = vec![1.0; rows * columns];
        // one texel, or a bright one among others beside it, across the seam too
        let spots: &[(usize, usize, f64)] = if number % 2 == 0 {
            &[(0, 0, 1.0)]
        } else {
            &[(0, 0, 1.0), (0, 1, 0.6), (1, 0, 0.5), (1, 1, 0.25)]
        };
        let bright = 1e4 * 10f64.powf(1.5 * rng.unit());
        let step = (PI / rows as f64, TAU / columns as f64);
        let (mut middle, mut energy, mut parts) = (dvec3(0.0, 0.0, 0.0), 0.0, Vec::new());
        for &(down, aside, share) in spots {
            let (r, c) = (row + down, (column + aside) % columns);
            values[r * columns + c] = 1.0 + bright * share;
            let height = FRAC_PI_2 - (r as f64 + 0.5) * step.0;
            let (s, co) = ((c as f64 + 0.5) * step.1).sin_cos();
            let toward = dvec3(height.cos() * co, height.cos() * s, height.sin());
            let own = bright * share * step.0 * step.1 * height.cos();
            middle += toward * own;
            energy += own;
            parts.push((toward, own, height));
        }
        let direction = middle.normalize();
        // as wide as the bilinear hats are
        let square: f64 =
            parts.iter().map(|(d, own, _)| own * (*d - direction).length_squared()).sum::<f64>() / energy;
        let width = step.1 * parts[0].2.cos();
        let half = (2.0 * (square + (step.0 * step.0 + width * width) / 6.0)).sqrt();
        let reference = [(energy + PI) / PI];
        let settings = within(2e-3);
        let seen = |scene: &Scene| {
            solve(scene, &settings, |_, lit| {
                let mut all = Vec::new();
                for (x, y) in (0..12).flat_map(|i| (0..12).map(move |j| (i, j))) {
                    let [x, y] = [x, y].map(|k| -1.9 + 3.8 * f64::from(k) / 11.0);
                    all.push(radiance(lit, [x + 1e-3, y, 0.9], [0.0, 0.0, -1.0], 0));
                }
                all
            })
        };
        let plain = || Scene::new(&mesh, &materials);
        let of_table = seen(&plain().sky(table(rows, columns, values, 1)));
        let of_sun =
            seen(&plain().sky(Sky::new(Model::Uniform, 1.0, 1.0)).sun(Sun::new(direction, energy, half)));
        let differences: Vec<f64> =
            of_table.iter().zip(&of_sun).map(|(a, b)| (a - b) / reference[0]).collect();
        let eps = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64).sqrt();
        let dark = of_sun.iter().filter(|l| **l < 0.6).count();
        println!("{number}: eps {eps:.1e}, {dark} in shadow, E {energy:.2}");
        // both within the tolerance, and the penumbra of a disc in place of that of a hat
        assert!(eps < 6e-3, "{number}: {eps}");
        assert!(number % 2 == 1 || dark > 0, "{number}: no shadow");
    }
}

/// What is no sun stays a sky: bright but wide, or small but dim.
#[test]
fn wide_or_dim_spots_stay() {
    let mesh = floor_and_plate();
    let materials = [Material::new(0.5, 0.0), Material::new(0.0, 0.0)];
    let (rows, columns) = (64, 128);
    let wide = |r: usize, c: usize| if (12..30).contains(&r) && (30..60).contains(&c) { 50.0 } else { 1.0 };
    let dim = |r: usize, c: usize| if (r, c) == (20, 40) { 30.0 } else { 1.0 };
    for of in [&wide as &dyn Fn(usize, usize) -> f64, &dim] {
        let values = (0..rows * columns).map(|k| of(k / columns, k % columns)).collect();
        let scene = Scene::new(&mesh, &materials).sky(table(rows, columns, values, 1));
        solve(&scene, &within(1e-2), |_, lit| assert!(lit.solved().light.sun.is_none()));
    }
}
