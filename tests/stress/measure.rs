//! A hostile scene, its true error, and the table of all.

use crate::judge::{Judge, Score, score};
use crate::kernel;
use crate::support::twin::{Model, Scene};
use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::host::Settings;
use std::fmt::Write as _;

/// A scene that is meant to hurt, and how one looks at it.
pub struct Hostile {
    pub family: &'static str,
    /// What makes it worse, and how much of it there is.
    pub severity: String,
    pub scene: Scene,
    pub camera: CameraInput,
    pub tolerance: f64,
}

/// A camera of a few pixels, one ray through the centre of each.
pub fn camera(eye: [f64; 3], target: [f64; 3], projection: Projection) -> CameraInput {
    let up = [0.0, 0.0, 1.0];
    CameraInput { projection, eye, target, up, columns: 10, rows: 10, sampling: Sampling::Centre }
}

/// What a run of Blik and of the judge say of it.
pub struct Row {
    pub family: &'static str,
    pub severity: String,
    pub against: &'static str,
    pub score: Score,
    pub estimate: f64,
}

/// Rounding of f32 pixels and of the judge's own f64 sums, relative to the reference radiance: below it nothing is told.
const ROUNDING: f64 = 1e-6;

impl Row {
    /// The true error, less what a number of standard errors of the judge explains.
    fn error(&self, deviations: f64) -> f64 {
        let Score { eps, high, .. } = self.score;
        let noise = high * high - eps * eps;
        (eps * eps - deviations * noise).max(0.0).sqrt()
    }

    /// True error at most the estimate, as far as the judge can tell: of hundreds of rows, two standard errors let one
    /// in forty that is honest seem not to be.
    pub fn honest(&self) -> bool {
        self.error(2.0) <= self.estimate + ROUNDING
    }

    /// True error, less three standard errors, over estimate.
    pub fn ratio(&self) -> f64 {
        self.error(3.0) / (self.estimate + ROUNDING)
    }
}

/// Blik's image: finite, not negative, not brighter than anything could be.
pub fn image(hostile: &Hostile) -> (Vec<f64>, Vec<f64>, f64) {
    let what = format!("{} {}", hostile.family, hostile.severity);
    // as programs ask: directions of the sky for skies that vary, closed forms for the others
    let directional = hostile.scene.sky.as_ref().is_some_and(|sky| !matches!(sky.model, Model::Uniform));
    let settings = Settings { directional, ..kernel::within(hostile.tolerance) };
    kernel::solve(&hostile.scene, &settings, |host, lit| {
        let image = host.image(lit, &hostile.camera, false).unwrap();
        for (at, pixel) in image.pixels.iter().enumerate() {
            assert!(pixel.is_finite() && *pixel >= 0.0, "{what}: pixel {at} is {pixel}");
        }
        lit.facets(|facet, _, _, irradiance, radiance| {
            let sound = irradiance.iter().chain(radiance).all(|x| x.is_finite() && *x >= 0.0);
            assert!(sound, "{what}: facet {facet}: {irradiance:?} {radiance:?}");
        });
        let estimate = image.report.error_estimate;
        assert!(estimate.is_finite() && estimate >= 0.0, "{what}: estimate {estimate}");
        let pixels = image.pixels.iter().map(|p| f64::from(*p)).collect();
        (pixels, lit.reference().to_vec(), estimate)
    })
}

/// Blik's image against the judge's, who may trace a number of rays.
pub fn judged(hostile: &Hostile, rays: u64, seed: u32) -> Row {
    let (pixels, reference, estimate) = image(hostile);
    let mut memory = Memory::default();
    let judge = Judge::new(&hostile.scene, &mut memory);
    let halves = judge.image(&hostile.camera, 0.1 * hostile.tolerance, rays, seed);
    let values = [&halves.values[0][..], &halves.values[1]];
    let score = score(&pixels, values, &halves.hit, &reference);
    let (family, severity) = (hostile.family, hostile.severity.clone());
    Row { family, severity, against: "judge", score, estimate }
}

/// The lines of a table, one a family: scenes, the worst error with its noise and estimate, how many are honest.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| family | scenes | against | worst error | its noise | its estimate | severity there | error <= estimate | worst ratio |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    let mut families: Vec<&str> = rows.iter().map(|r| r.family).collect();
    families.dedup();
    for family in families {
        let own: Vec<&Row> = rows.iter().filter(|r| r.family == family).collect();
        let worst = own.iter().max_by(|a, b| a.score.eps.total_cmp(&b.score.eps)).expect("a row");
        let honest = own.iter().filter(|r| r.honest()).count();
        let ratio = own.iter().map(|r| r.ratio()).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "| {family} | {} | {} | {:.1e} | {:.1e} | {:.1e} | {} | {honest} of {} | {ratio:.2} |",
            own.len(),
            worst.against,
            worst.score.eps,
            worst.score.error(),
            worst.estimate,
            worst.severity,
            own.len(),
        );
    }
    text
}
