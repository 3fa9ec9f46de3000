//! The same bits however the work is split, over how many threads, with which tree, on which instruction set, and
//! again.

#[path = "support/case.rs"]
mod case;
#[path = "support/stages.rs"]
mod stages;
mod support;

use blik_kernel::camera::{CameraInput, Sampling};
use blik_kernel::host::Settings;
use blik_kernel::simd::Isa;
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, timeless, within};
use stages::{Counts, Plan, Workspace};
use support::scenes;
use support::twin::Material;

const TOLERANCE: f64 = 2e-2;
const PIXELS: usize = 23;

/// Three bands; two mirrors, a lobe and a diffuse material; every kind of light.
fn spectral() -> Case {
    let glossy = Material { gloss: Some(8.0), ..Material::spectral(&[0.2, 0.3, 0.1], &[0.5, 0.4, 0.6]) };
    let materials = [
        Material::spectral(&[0.6, 0.5, 0.3], &[0.0; 3]),
        Material::spectral(&[0.1, 0.2, 0.0], &[0.7, 0.5, 0.9]),
        Material::spectral(&[0.0; 3], &[0.9, 0.6, 0.8]),
        glossy.emitting(0.05),
    ];
    let body = scenes::sphere(1).of_material(3).scaled(0.2).translated([0.45, 0.4, 0.5]);
    Case::new(scenes::corner(2).joined(&body), &materials)
        .sky(SkyOf::new(SkyModel::Gradient, &[1.0, 0.8, 0.6], &[0.2, 0.3, 0.4]))
        .sun(SunOf::new([0.5, 0.7, 0.9], &[2.0, 1.5, 1.0], 0.5))
        .two_sided()
}

/// One band, an ideal mirror and diffuse facets under a uniform sky.
fn plain() -> Case {
    let materials = [Material::new(0.5, 0.2), Material::new(0.4, 0.0), Material::new(0.0, 0.5)];
    Case::new(scenes::corner(3), &materials).sky(SkyOf::uniform(1))
}

fn camera() -> CameraInput {
    let camera = orthographic([3.0, 2.0, 2.5], [0.4, 0.45, 0.3], 2.0, PIXELS);
    CameraInput { sampling: Sampling::Area, ..camera }
}

#[test]
fn threads_change_no_bit() {
    for case in [spectral(), plain()] {
        let settings = within(TOLERANCE);
        // enough rows for the pieces of work to differ
        let camera = || CameraInput { rows: 150, ..camera() };
        let first = case.run(1, &settings, &camera());
        for threads in [2, 3, 8] {
            let other = case.run(threads, &settings, &camera());
            assert_eq!(first.pixel_bits(), other.pixel_bits(), "{threads} threads");
            assert_eq!(first.facet_bits(), other.facet_bits(), "{threads} threads");
            assert_eq!(timeless(&first.image.report), timeless(&other.image.report), "{threads} threads");
        }
        let again = case.run(1, &settings, &camera());
        assert_eq!(first.pixel_bits(), again.pixel_bits());
        assert_eq!(first.facet_bits(), again.facet_bits());
        assert_eq!(timeless(&first.image.report), timeless(&again.image.report), "a second run");
    }
}

/// One run over the kernel's own ranges.
fn staged(case: &Case, plan: Plan) -> (Counts, Vec<u32>, Vec<u64>) {
    let bands = case.bands();
    let mut work = Workspace::new(case.mesh.facets.len(), 8192, bands, PIXELS * PIXELS, 1 << 23);
    let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(SunOf::input));
    let counts = case
        .with_input(|input| stages::run(&mut work, input, sky.as_ref(), sun.as_ref(), &camera(), &plan))
        .unwrap();
    (counts, work.pixel_bits(), work.table_bits())
}

#[test]
fn splits_trees_and_instruction_sets_change_no_bit() {
    for case in [spectral(), plain()] {
        let plan = Plan { parts: 1, isa: Isa::BASELINE, obvhs: false, tolerance: TOLERANCE };
        let first = staged(&case, plan);
        assert!(first.0.records > 500 && first.0.image.refined > 0, "something is computed: {:?}", first.0);
        let others = [
            Plan { parts: 2, ..plan },
            Plan { parts: 3, isa: Isa::detect(), ..plan },
            Plan { parts: 8, obvhs: true, ..plan },
            Plan { isa: Isa::detect(), obvhs: true, ..plan },
            plan,
        ];
        for other in others {
            let (mut counts, pixels, tables) = staged(&case, other);
            let what = format!("{} parts, {:?}, obvhs {}", other.parts, other.isa, other.obvhs);
            assert_eq!(first.1, pixels, "{what}: pixels");
            assert_eq!(first.2, tables, "{what}: irradiances, radiances, sun");
            // where areas are sampled, rows of pixels beside a range are traced for it too; sums of errors are added
            // up in another order
            let seen = first.0.image;
            assert_eq!(counts.image.refined, seen.refined, "{what}");
            assert_eq!(counts.image.object_pixels, seen.object_pixels, "{what}");
            counts.image = seen;
            assert_eq!(counts, first.0, "{what}: counts");
        }
    }
}

#[test]
fn the_owning_layer_gives_the_stages_bits() {
    for (case, directional) in [(spectral(), true), (plain(), false)] {
        let host = case.run(2, &Settings { directional, ..within(TOLERANCE) }, &camera());
        let plan = Plan { parts: 3, isa: Isa::BASELINE, obvhs: false, tolerance: TOLERANCE };
        let (counts, pixels, _) = staged(&case, plan);
        assert_eq!(host.pixel_bits(), pixels);
        let report = &host.image.report;
        assert_eq!(report.sweeps, counts.sweeps);
        assert_eq!(report.rays.visibility, counts.visibility);
        assert_eq!(report.rays.sun, counts.sun + counts.beams);
    }
}
