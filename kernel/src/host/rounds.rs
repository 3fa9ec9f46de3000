//! Rounds: an image whose estimated error exceeds the tolerance is computed again from a finer solution.

use super::{Rays, Report, Seconds, Settings};
use crate::rounds::{self, Round};
use crate::view::estimate::Limit;

/// The rounds of one image. Each computes geometry, light and image by [`Rounds::settings`], and asks
/// [`Rounds::again`] whether there is to be another. Images of little tolerance begin with a coarser solution. The last
/// round's image need not be the one of the least estimate, where even a finer one brings nothing.
///
/// ```
/// # use blik_kernel::{camera::*, host::*, scene::*, sky::*};
/// # let material = MaterialInput { diffuse: &[0.5], specular: &[0.0], emission: &[0.0], gloss: None };
/// # let input = SceneInput { vertices: &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], facets: &[[0, 1, 2]],
/// #     facet_materials: &[], normals: &[], facet_normals: &[], materials: &[material], two_sided: false, bands: 1 };
/// # let camera = CameraInput { projection: Projection::Orthographic { height: 1.0 }, eye: [0.3, 0.3, 1.0],
/// #     target: [0.3, 0.3, 0.0], up: [0.0, 1.0, 0.0], columns: 4, rows: 4, sampling: Sampling::Centre };
/// # let sky = SkyInput { model: SkyModel::Uniform, radiance: &[1.0], ground: &[0.0], up: [0.0, 0.0, 1.0] };
/// let host = Host::new(1)?;
/// let mut rounds = Rounds::new(2e-3);
/// let mut memory = GeometryMemory::default();
/// let image = loop {
///     let settings = rounds.settings(Settings::default());
///     let geometry = host.geometry(&mut memory, &input, &settings)?;
///     let lit = host.light(&geometry, Some(&sky), None)?;
///     if let Some(look) = host.look(&lit, &camera)?
///         && rounds.at_once(&look)
///     {
///         continue;
///     }
///     let mut image = host.image(&lit, &camera, false)?;
///     if !rounds.again(&mut image.report) {
///         break image;
///     }
/// };
/// assert!(image.report.tolerance_met && image.report.tolerance == 2e-3);
/// # Ok::<(), blik_kernel::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Rounds {
    asked: f64,
    tolerance: f64,
    done: u32,
    last: Option<Round>,
    seconds: Seconds,
    rays: Rays,
}

impl Rounds {
    /// Rounds of an image whose error is to be `tolerance`.
    pub fn new(tolerance: f64) -> Rounds {
        let (seconds, rays) = (Seconds::default(), Rays::default());
        let first = rounds::first_tolerance(tolerance);
        Rounds { asked: tolerance, tolerance: first, done: 0, last: None, seconds, rays }
    }

    /// What the present round is to be computed by: `settings` but for their tolerances.
    pub fn settings(&mut self, settings: Settings) -> Settings {
        Settings { tolerance: self.tolerance, image_tolerance: Some(self.asked), ..settings }
    }

    /// Whether another round is wanted after one with this report. The report becomes that of all rounds, against the
    /// error that was asked for.
    pub fn again(&mut self, report: &mut Report) -> bool {
        let round = self.round(report);
        self.done += 1;
        self.seconds.add(&report.seconds);
        self.rays.add(&report.rays);
        report.tolerance = self.asked;
        report.tolerance_met = report.error_estimate <= self.asked;
        (report.seconds, report.rays, report.rounds) = (self.seconds, self.rays, self.done);
        let next = rounds::next_tolerance(self.asked, &round, self.last.as_ref(), self.done);
        self.last = Some(round);
        self.tolerance = next.unwrap_or(self.tolerance);
        next.is_some()
    }

    /// Whether another round is wanted before the image of the present one is made, by the report of a part of it
    /// ([`super::Host::look`]).
    pub fn at_once(&mut self, report: &Report) -> bool {
        let round = self.round(report);
        let next = rounds::at_once(self.asked, &round, self.last.as_ref(), self.done + 1);
        if let Some(next) = next {
            (self.tolerance, self.last) = (next, Some(round));
            self.done += 1;
            self.seconds.add(&report.seconds);
            self.rays.add(&report.rays);
        } else {
            // what comes before the image counts with it
            self.seconds.image += report.seconds.image;
            self.rays.primary += report.rays.primary;
            self.rays.chain += report.rays.chain;
        }
        next.is_some()
    }

    fn round(&self, report: &Report) -> Round {
        Round {
            tolerance: self.tolerance,
            estimate: report.error_estimate,
            by_visibility: report.limited_by == Limit::Visibility.name(),
            rays: report.rays.visibility,
            bytes: report.bytes.coupling,
        }
    }
}
