//! What holds of every scene: triangles at random, through one another, of any materials.

use crate::budget::{FURNACE, ROW, SLOPE, SPLIT};
use crate::case::{Case, SkyOf, orthographic, rms, within};
use crate::support::random::repeatable;
use crate::support::scenes::Mesh;
use crate::support::twin::{Material, Rng};
use blik_kernel::sky::SkyModel;
use proptest::prelude::*;

/// Cases of a property, each of which solves several scenes: a few, or as many as `PROPTEST_CASES` says up to 1000.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).map_or(12, |n: u32| n.min(1000))
}

/// A two-sided soup of `count` triangles of three materials, of reflectance up to `most`; emission makes up for what
/// they absorb where `furnace` is set.
fn soup(seed: u64, count: usize, most: f64, furnace: bool) -> Case {
    let mut rng = Rng(seed);
    let mut mesh = Mesh::default();
    for facet in 0..count {
        let size = 10f64.powf(-2.0 * rng.unit());
        let at = [rng.unit(), rng.unit(), rng.unit()];
        for _ in 0..3 {
            mesh.vertices.push(at.map(|x| x + size * (rng.unit() - 0.5)));
        }
        let first = 3 * facet as u32;
        mesh.facets.push([first, first + 1, first + 2]);
        mesh.materials.push(facet as u32 % 3);
    }
    let materials = [0, 1, 2].map(|_| {
        let (rho, share) = (most * rng.unit(), rng.unit());
        let emission = if furnace { 1.0 - rho } else { 0.0 };
        Material::new(rho * share, rho * (1.0 - share)).emitting(emission)
    });
    Case::new(mesh, &materials).two_sided()
}

proptest! {
    #![proptest_config(repeatable(cases()))]

    /// Furnace, and with it energy: what facets absorb they emit, and the sky is 1. And closure, row by row.
    #[test]
    fn all_is_one_in_a_furnace(seed: u64, count in 2usize..40, most in 0.1..0.98) {
        let case = soup(seed, count, most, true).sky(SkyOf::uniform(1));
        let camera = orthographic([2.0, -1.5, 1.8], [0.5; 3], 1.6, 8);
        let outcome = case.run(2, &within(1e-2), &camera);
        for pixel in &outcome.image.pixels {
            prop_assert!((f64::from(*pixel) - 1.0).abs() <= FURNACE.error + SLOPE.error, "{pixel}");
        }
        case.with_geometry(2, &within(1e-2), |_, geometry| {
            for (unknown, row) in geometry.coupling().unwrap().rows(0..geometry.elements().unknowns()) {
                if row.row.state < blik_kernel::coupling::TRACED {
                    continue;
                }
                let kept: f64 = row.targets.iter().map(|r| {
                    let facet = geometry.elements().facet_of(r.unknown()).0;
                    let specular = geometry.scene().specular(geometry.scene().material(facet))[0];
                    r.weight * row.products(r.path())[0] * (1.0 - specular)
                }).sum();
                let mirrored = row.escapes.filter(|b| row.depth(b.path) > 0);
                let through: f64 = mirrored.map(|b| b.total() * row.products(b.path)[0]).sum();
                let off = kept + through - row.row.blocked;
                let lost = row.row.truncated_weight;
                prop_assert!(off <= ROW.error && off >= -lost - ROW.error, "row {unknown}: {off:.1e}, lost {lost:.1e}");
            }
            Ok(())
        })?;
    }

    /// No facet outshines the sky; and neither threads nor the order of facets matter, but for the estimate.
    #[test]
    fn images_are_bounded_and_do_not_depend_on_how_the_work_is_done(seed: u64, count in 2usize..30) {
        let case = soup(seed, count, 1.0, false).sky(SkyOf::new(SkyModel::Gradient, &[1.0], &[0.1]));
        let camera = orthographic([2.0, -1.5, 1.8], [0.5; 3], 1.6, 8);
        let outcome = case.run(1, &within(1e-2), &camera);
        let estimate = outcome.image.report.error_estimate;
        for pixel in &outcome.image.pixels {
            prop_assert!((0.0..=1.0 + SLOPE.error + FURNACE.error).contains(&f64::from(*pixel)), "{pixel}");
        }
        let split = case.run(3, &within(1e-2), &camera);
        let same = split.pixel_bits() == outcome.pixel_bits() && split.facet_bits() == outcome.facet_bits();
        prop_assert!(same || SPLIT.error > 0.0);
        let mut order: Vec<usize> = (0..count).rev().collect();
        order.rotate_left(count / 3);
        let other = Case { mesh: case.mesh.permuted(&order), ..case.clone() }.run(2, &within(1e-2), &camera);
        let (off, both) = (rms(&outcome.image.pixels, &other.image.pixels), estimate + other.image.report.error_estimate);
        prop_assert!(off <= both + SLOPE.error, "order of facets: {off:.1e}, estimates together {both:.1e}");
    }
}
