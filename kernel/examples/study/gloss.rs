//! Kholopov's lobe: one ray, the paper's three, better sets, and the sun.

use crate::chart::{Figure, Series};
use crate::plane_kernel::{SAMPLES, eps, pair, solve, uniform, view};
use crate::plane_reference::diffuse::coupled as sees;
use crate::plane_reference::gloss::Gloss;
use blik_kernel::plane::Vec2;
use blik_kernel::plane::host::{self, Settings};
use blik_kernel::plane::light::{Capture, Light, PlaneSun, Sky};
use blik_kernel::plane::lobe::PlaneLobe;
use blik_kernel::plane::rows::Method;
use blik_kernel::plane::scene::{Basis, RaySet};

type Image = Vec<Option<f64>>;

const RATIOS: [f64; 3] = [50.0, 10.0, 3.0];
const RHO: f64 = 0.8;

fn lobe(ratio: f64) -> PlaneLobe {
    PlaneLobe::new(ratio).unwrap_or_else(|e| panic!("{e}"))
}

/// The reference solver's images under a uniform sky, four reflections.
pub struct Truths([Image; 3]);

impl Truths {
    /// Computes them: eps 1.3e-4, 5e-5 and 2e-5 against rules of 1.6 to 2 times as many points.
    pub fn new() -> Truths {
        let points = [[48, 24, 16], [40, 20, 12], [24, 12, 8]];
        Truths([0, 1, 2].map(|i| {
            let scene = pair(2.5, 0.0, RHO, Some(RATIOS[i]));
            Gloss::new(&scene, (1.0, None), 4, &points[i], 1).symmetric_image(SAMPLES, 4)
        }))
    }
}

fn settings(bounces: u32) -> Settings {
    let (basis, method) = (Basis::Constant, Method::Facets { chains: 0 });
    Settings { basis, method, max_bounces: Some(bounces), cutoff: 1e-9, solver: 1e-9, tolerance: 1e-3 }
}

/// A mirror of reflectance `rho`, or a lobe with `rays`; the image, and rays a sample beyond the first.
fn of(ratio: Option<f64>, rho: f64, rays: RaySet) -> (Image, f64) {
    let scene = pair(2.5, 0.0, rho, ratio);
    solve(&scene, 1, rays, &uniform(), &settings(4), |solved, _, scratch| {
        let seen = host::image(solved, 0.0, SAMPLES, scratch).unwrap_or_else(|e| panic!("{e}"));
        let hits: Vec<_> = seen.iter().filter(|s| s.object).collect();
        let rays = hits.iter().map(|s| f64::from(s.rays) - 1.0).sum::<f64>() / hits.len() as f64;
        (view(solved, 0.0, scratch), rays)
    })
}

fn mirror(rho: f64) -> Image {
    of(None, rho, RaySet::Gauss([1; 3])).0
}

/// eps of one ray by its reflectance, with the paper's choice (17) and the cosine-weighted mean as marks.
pub fn figure2(truths: &Truths) -> Figure {
    let mut series = Vec::new();
    for (truth, ratio) in truths.0.iter().zip(RATIOS) {
        let at = |rho: f64| (rho, eps(&mirror(rho), truth));
        let points = (0..=100).map(|i| at(f64::from(i) * 0.01)).collect();
        series.push(Series { name: format!("T0 = {ratio}"), points });
    }
    for (truth, ratio) in truths.0.iter().zip(RATIOS) {
        let lobe = lobe(ratio);
        let points = [lobe.mean_albedo(), lobe.cosine_mean_albedo()]
            .map(|mean| (RHO * mean, eps(&mirror(RHO * mean), truth)))
            .to_vec();
        series.push(Series { name: format!("T0 = {ratio}: (17), cosine mean"), points });
    }
    Figure {
        name: "figure2",
        title: "Figure 2: one ray, uniform sky, rho_0 = 0.8",
        x: "rho_s of the ray",
        y: "eps",
        log: (false, true),
        series,
    }
}

/// Sun at 60 degrees from the view, as direction and normal irradiance.
const SUN: ([f64; 2], f64) = ([0.866_025_403_784_438_6, 0.5], 1.0);

/// The reference solver's images in the sun alone, three reflections.
pub struct SunTruths([Image; 3]);

impl SunTruths {
    /// Computes them: 5e-5, 7e-5 and 9e-4 against rules of twice as many points, in the unit of the figures.
    pub fn new() -> SunTruths {
        let points = [[160, 80], [96, 48], [48, 32]];
        SunTruths([0, 1, 2].map(|i| {
            let scene = pair(2.5, 0.0, RHO, Some(RATIOS[i]));
            Gloss::new(&scene, (0.0, Some(SUN)), 3, &points[i], 1).image(0.0, SAMPLES, SAMPLES, 3)
        }))
    }

    /// eps of one ray of reflectance `rho` that sees the sun by a cone, relative to E/Omega_eq.
    fn eps(&self, i: usize, rho: f64, cone: Capture) -> f64 {
        let sun = PlaneSun { direction: Vec2::from(SUN.0), irradiance: SUN.1, capture: Some(cone) };
        let light = Light::new(Sky::Uniform(0.0), Some(sun)).unwrap_or_else(|e| panic!("{e}"));
        let (scene, rays) = (pair(2.5, 0.0, rho, None), RaySet::Gauss([1; 3]));
        let image = solve(&scene, 1, rays, &light, &settings(3), |s, _, scratch| view(s, 0.0, scratch));
        eps(&image, &self.0[i]) * lobe(RATIOS[i]).equivalent_width(1.0)
    }
}

/// eps of one ray and the paper's cones around the sun, by the ray's reflectance.
pub fn figure3(truths: &SunTruths) -> Figure {
    let mut series = Vec::new();
    for (i, ratio) in RATIOS.into_iter().enumerate() {
        let degrees = [2.0f64, 9.0, 18.0][i];
        let half_angle = degrees.to_radians();
        let radiance = 1.0 / lobe(ratio).equivalent_width(1.0);
        let cones = [
            ("E/(2 delta)", Capture::conserving(SUN.1, half_angle)),
            ("E/Omega_eq", Capture { half_angle, radiance }),
        ];
        for (name, cone) in cones {
            let at = |rho: f64| (rho, truths.eps(i, rho, cone));
            let points = (0..=50).map(|i| at(f64::from(i) * 0.02)).collect();
            series.push(Series { name: format!("T0 = {ratio}, {degrees} deg, {name}"), points });
        }
    }
    Figure {
        name: "figure3",
        title: "Figure 3: one ray, sun at 60 degrees, rho_0 = 0.8",
        x: "rho_s of the ray",
        y: "eps Omega_eq / E",
        log: (false, true),
        series,
    }
}

/// The least eps over the ray's reflectance, by the half angle of a cone that keeps the sun's energy.
pub fn cones(truths: &SunTruths) -> Figure {
    let mut series = Vec::new();
    for (i, ratio) in RATIOS.into_iter().enumerate() {
        let at = |degrees: f64| {
            let cone = Capture::conserving(SUN.1, degrees.to_radians());
            let all = (5..=50).map(|r| truths.eps(i, f64::from(r) * 0.02, cone));
            (degrees, all.fold(f64::MAX, f64::min))
        };
        let centre = [1.6, 8.0, 24.0][i];
        let points = (0..=30).map(|k| at(centre * 3f64.powf(f64::from(k) / 15.0 - 1.0))).collect();
        series.push(Series { name: format!("T0 = {ratio}"), points });
    }
    Figure {
        name: "cones",
        title: "Cones around the sun, best rho_s for each",
        x: "half angle, degrees",
        y: "eps Omega_eq / E",
        log: (true, true),
        series,
    }
}

/// eps of three rays by their spacing: as printed, and sharing the visible lobe's energy.
pub fn figure5(truths: &Truths) -> Figure {
    let mut series = Vec::new();
    for (truth, ratio) in truths.0.iter().zip(RATIOS) {
        for renormalised in [false, true] {
            let at = |share: f64| {
                let spacing = share * lobe(ratio).equivalent_width(1.0);
                (share, eps(&of(Some(ratio), RHO, RaySet::Paper { spacing, renormalised }).0, truth))
            };
            let points = (0..=60).map(|i| at(f64::from(i) * 0.05)).collect();
            let how = if renormalised { "(18), sum A(theta)" } else { "(18), sum rho_0" };
            series.push(Series { name: format!("T0 = {ratio}: {how}"), points });
        }
    }
    Figure {
        name: "figure5",
        title: "Figure 5: three rays, uniform sky, rho_0 = 0.8",
        x: "spacing / Omega_eq",
        y: "eps",
        log: (false, true),
        series,
    }
}

/// eps against rays a sample for the paper's rays, Gauss nodes with the tree cut, and lobes split at silhouettes.
pub fn rays(truths: &Truths) -> Figure {
    let gauss = [[1; 3], [2, 2, 1], [3, 3, 1], [6, 3, 1], [8, 4, 1], [16, 6, 1], [32, 6, 1], [64, 8, 2]];
    let split = [[1; 3], [2, 1, 1], [4, 2, 1], [8, 4, 1], [8, 4, 2], [16, 8, 2], [24, 8, 4]];
    let mut series = Vec::new();
    for (truth, ratio) in truths.0.iter().zip(RATIOS) {
        let at = |set: RaySet| {
            let (image, rays) = of(Some(ratio), RHO, set);
            (rays, eps(&image, truth))
        };
        let spacing = lobe(ratio).equivalent_width(1.0);
        let paper = vec![at(RaySet::Paper { spacing, renormalised: false })];
        series.push(Series { name: format!("T0 = {ratio}: (18)"), points: paper });
        for (name, points) in [
            ("Gauss", gauss.map(RaySet::Gauss).map(at).to_vec()),
            ("split", split.map(RaySet::Split).map(at).to_vec()),
        ] {
            series.push(Series { name: format!("T0 = {ratio}: {name}"), points });
        }
    }
    Figure {
        name: "rays",
        title: "Lobes: error against rays, uniform sky",
        x: "rays a sample",
        y: "eps",
        log: (true, true),
        series,
    }
}

/// eps of samples that see the other body and of those that do not, by rays: one, (18), and ever more Gauss nodes.
pub fn coupled(truths: &Truths) -> Figure {
    let mut series = Vec::new();
    for (truth, ratio) in truths.0.iter().zip(RATIOS) {
        let scene = pair(2.5, 0.0, RHO, Some(ratio));
        let coupled: Vec<bool> = scene.view(0.0, SAMPLES).into_iter().map(|ray| sees(&scene, ray)).collect();
        let spacing = lobe(ratio).equivalent_width(1.0);
        let images = [
            mirror(RHO * lobe(ratio).cosine_mean_albedo()),
            of(Some(ratio), RHO, RaySet::Paper { spacing, renormalised: false }).0,
            of(Some(ratio), RHO, RaySet::Gauss([3, 3, 1])).0,
            of(Some(ratio), RHO, RaySet::Gauss([8, 4, 1])).0,
            of(Some(ratio), RHO, RaySet::Gauss([32, 6, 1])).0,
        ];
        for (name, which) in [("coupled", true), ("uncoupled", false)] {
            let pick = |image: &Image| -> Image {
                image.iter().zip(&coupled).map(|(v, &c)| v.filter(|_| c == which)).collect()
            };
            let points =
                images.iter().zip(1..).map(|(image, i)| (f64::from(i), eps(&pick(image), &pick(truth))));
            series.push(Series { name: format!("T0 = {ratio}: {name}"), points: points.collect() });
        }
    }
    Figure {
        name: "coupled",
        title: "Coupled and uncoupled samples apart",
        x: "1: one ray, 2: (18), 3 to 5: 3, 8, 32 Gauss nodes",
        y: "eps",
        log: (false, true),
        series,
    }
}
