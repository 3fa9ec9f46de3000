//! Lobes in three dimensions: two infinite cylinders, one scan line, as in the plane.

use crate::case::{Case, SkyOf, within};
use crate::chart::{Figure, Series};
use crate::cylinders;
use crate::support::twin::Material;
use blik_kernel::chain::{RaySample, Terms};
use blik_kernel::math::Vec3;
use blik_kernel::ray::Ray;
use glam::DVec3;

const RATIOS: [f64; 3] = [50.0, 10.0, 3.0];
const RHO: f64 = 0.8;
const SAMPLES: usize = 320;
/// Strips of a cylinder: four times as many change eps by 2e-4 at most.
const STRIPS: usize = 720;
/// Paths of the truth, in each of eight randomisations of a sample.
const PATHS: usize = 4096;

/// A sample of the scan line: origin, radiance, its standard error, and whether its mirror chain meets both cylinders.
struct Truth {
    origin: DVec3,
    radiance: f64,
    error: f64,
    coupled: bool,
}

fn truth(ratio: f64) -> Vec<Truth> {
    let of = |(seed, origin)| {
        let (radiance, error) = cylinders::truth(origin, RHO, ratio, PATHS, seed);
        Truth { origin, radiance, error, coupled: cylinders::coupled(origin) }
    };
    (0..).zip(cylinders::samples(SAMPLES)).map(of).collect()
}

fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = errors.fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
    f64::sqrt(sum / count)
}

/// Rays beyond the first a sample, and eps of all samples, of coupled and of uncoupled ones.
fn line(ratio: f64, truth: &[Truth], rays: Option<u32>, tolerance: f64) -> (f64, [f64; 3]) {
    let (mesh, normals) = cylinders::mesh(STRIPS);
    let material = Material { gloss: Some(ratio), ..Material::new(0.0, RHO) };
    let mut case = Case::new(mesh, &[material]).sky(SkyOf::uniform(1));
    (case.normals, case.gloss_rays) = (normals, rays);
    let seen: Vec<(f64, f64)> = case.with_lit(1, &within(tolerance), |_, lit| {
        let solved = lit.solved();
        let look = |(index, t): (u32, &Truth)| {
            let origin = solved.scene.to_scene(Vec3::from_array(t.origin.to_array()));
            let mut terms = Terms::ZERO;
            let path = solved.radiance(&Ray::new(origin, -Vec3::Y), RaySample::Integrate(index), &mut terms);
            (terms.sum(0), f64::from(path.rays))
        };
        (0..).zip(truth).map(look).collect()
    });
    let eps = |keep: &dyn Fn(&Truth) -> bool| {
        rms(truth.iter().zip(&seen).filter(|(t, _)| keep(t)).map(|(t, s)| s.0 - t.radiance))
    };
    let traced = seen.iter().map(|s| s.1).sum::<f64>() / seen.len() as f64;
    (traced, [eps(&|_| true), eps(&|t| t.coupled), eps(&|t| !t.coupled)])
}

/// eps against rays a sample, for sets of a given size and for those that a tolerance chooses; and the former's coupled
/// and uncoupled samples apart.
pub fn rays() -> [Figure; 2] {
    let (mut whole, mut apart) = (Vec::new(), Vec::new());
    for ratio in RATIOS {
        let truth = truth(ratio);
        let noise = rms(truth.iter().map(|t| t.error));
        let fixed = [1, 4, 7, 19, 37, 61, 121, 250, 500, 1000].map(|n| line(ratio, &truth, Some(n), 1e-3));
        let of = |what: usize| fixed.iter().map(|(rays, eps)| (*rays, eps[what])).collect();
        whole.push(Series { name: format!("T0 = {ratio} (truth +-{noise:.1e})"), points: of(0) });
        apart.push(Series { name: format!("T0 = {ratio}: coupled"), points: of(1) });
        apart.push(Series { name: format!("T0 = {ratio}: uncoupled"), points: of(2) });
        let chosen = [2e-2, 1e-2, 6e-3, 3e-3, 2e-3].map(|t| line(ratio, &truth, None, t));
        let points = chosen.iter().map(|(rays, eps)| (*rays, eps[0])).collect();
        whole.push(Series { name: format!("T0 = {ratio}: by tolerance"), points });
    }
    let common = |name, title, series| {
        let (x, y, log) = ("rays a sample", "eps", (true, true));
        Figure { name, title, x, y, log, series }
    };
    [
        common("space", "Lobes in three dimensions: two cylinders", whole),
        common("space_coupled", "Three dimensions: coupled and uncoupled samples", apart),
    ]
}
