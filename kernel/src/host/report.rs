//! The report that comes with every result: its estimated error, the work done, what was left out.

use crate::base::budget::ErrorBudget;
use crate::coupling::kept::Fates;
use crate::coupling::{ABSENT, Coupling, OPEN};
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::sky::Sky;
use crate::view::estimate;
use crate::view::image::Tally;
use std::vec::Vec;

/// The keys of the program's `report.json`; seconds of reading and writing are the program's own.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Report {
    /// The wanted error.
    pub tolerance: f64,
    /// Reference radiance of each band.
    pub reference_radiance: Vec<f64>,
    /// Where it comes from: "given", "sky and sun", or "what emission lights" where there is neither.
    pub reference_from: &'static str,
    /// Expected eps of eq. 16 of this image, relative to the reference radiance.
    pub error_estimate: f64,
    /// True where the estimate is at most the tolerance.
    pub tolerance_met: bool,
    /// Bounds that hold for certain.
    pub certified: Certified,
    /// The largest part of the estimate.
    pub limited_by: &'static str,
    /// The error budget, share by share.
    pub budget: Vec<BudgetShare>,
    /// Rounds in which the image was computed ([`super::Rounds`]); seconds and rays are those of all of them.
    pub rounds: u32,
    pub facets: usize,
    pub degenerate_facets: usize,
    pub bands: usize,
    pub elements: usize,
    pub pairs: Pairs,
    /// What became of the coupling's rows; without [`super::Host::update`] all were computed.
    pub rows: Fates,
    pub rays: Rays,
    pub sweeps: u32,
    pub bytes: Bytes,
    pub seconds: Seconds,
    /// What the scene did not need, with how often.
    pub skipped: Vec<(&'static str, u64)>,
    pub signature: SignatureReport,
}

/// Bounds, relative to the reference radiance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certified {
    /// Distance of the radiances from the solution of the discrete system.
    pub solver: f64,
    /// What specular chains that were cut could still have brought to a pixel.
    pub chain_tail: f64,
    /// Weight of couplings cut by the same rule, as a share of the hemisphere.
    pub dropped: f64,
    /// What no bound covers.
    pub excludes: Vec<&'static str>,
}

/// A share of the error budget ([`ErrorBudget`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetShare {
    /// The field of [`ErrorBudget`].
    pub name: &'static str,
    /// What might be spent.
    pub allowed: f64,
    /// What was spent, as the estimate or a bound has it; `None` where it is measured as a part of another share alone.
    pub spent: Option<f64>,
}

/// Facet pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Pairs {
    pub tested: u64,
    pub culled: u64,
    pub exact: u64,
    pub sampled: u64,
}

/// Rays traced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Rays {
    pub visibility: u64,
    pub sun: u64,
    pub chain: u64,
    pub primary: u64,
}

impl Rays {
    /// Adds those of another round.
    pub(super) fn add(&mut self, other: &Rays) {
        self.visibility += other.visibility;
        self.sun += other.sun;
        self.chain += other.chain;
        self.primary += other.primary;
    }
}

/// Bytes in use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Bytes {
    pub scene: usize,
    pub bvh: usize,
    pub coupling: usize,
    pub light: usize,
    pub image: usize,
}

/// Seconds of each stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Seconds {
    pub scene: f64,
    pub bvh: f64,
    pub coupling: f64,
    pub light: f64,
    pub radiosity: f64,
    pub image: f64,
}

impl Seconds {
    /// Adds those of another round.
    pub(super) fn add(&mut self, other: &Seconds) {
        self.scene += other.scene;
        self.bvh += other.bvh;
        self.coupling += other.coupling;
        self.light += other.light;
        self.radiosity += other.radiosity;
        self.image += other.image;
    }
}

/// What a distant observer who looks along the camera's direction measures of the whole object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignatureReport {
    /// W/sr in each band.
    pub radiant_intensity: Vec<f64>,
    /// In the caller's square units.
    pub projected_area: f64,
    /// Radiant intensity over projected area, each band.
    pub mean_radiance: Vec<f64>,
    /// (mean radiance - background)/background; none where the background is 0.
    pub contrast: Vec<Option<f64>>,
    /// What the radiant intensity is expected to be wrong by, W/sr in each band.
    pub error: Vec<f64>,
    /// Glints that may lie between cells, or be met by chance and count too much: what they bring on the mean, W/sr in each
    /// band; not among the error.
    pub unresolved_glints: Vec<f64>,
}

impl Report {
    /// Counts what the coupling's rows did.
    pub(super) fn count_rows(&mut self, coupling: &Coupling<'_>) {
        let (mut skipped, mut open) = (0, 0);
        for (_, row) in coupling.rows(0..coupling.unknowns()) {
            self.pairs.sampled += row.targets.len() as u64;
            self.certified.dropped = self.certified.dropped.max(row.row.truncated_weight);
            skipped += u64::from(row.row.state == ABSENT);
            open += u64::from(row.row.state == OPEN);
        }
        self.pairs.tested = self.pairs.sampled;
        self.skip("black or degenerate rows", skipped);
        self.skip("rows open to the sky alone", open);
    }

    /// Notes work that was not needed, and how often; nothing where it was needed everywhere.
    fn skip(&mut self, what: &'static str, count: u64) {
        if count > 0 {
            self.skipped.push((what, count));
        }
    }

    /// What geometry and materials spare the coupling of `rows` rows.
    pub(super) fn count_scene(&mut self, scene: &Scene<'_>, directional: bool, rows: usize) {
        let mirrors = |&facet: &usize| scene.specular(scene.material(facet)).iter().any(|&rho| rho > 0.0);
        let others = scene.facets() - (0..scene.facets()).filter(mirrors).count();
        self.skip("facets that end every chain", others as u64);
        self.skip("rows without directions of the sky", if directional { 0 } else { rows as u64 });
    }

    /// What a light of `rows` rows lacks.
    pub(super) fn count_light(&mut self, light: &Light<'_>, rows: usize) {
        let uniform = light.sky.as_ref().is_some_and(Sky::is_uniform);
        self.skip("rows of a uniform sky, by closure", if uniform { rows as u64 } else { 0 });
        self.skip("rows without a sun", if light.sun.is_none() { rows as u64 } else { 0 });
    }

    /// The shares of a budget beside what an image spent of them.
    fn shares(&self, budget: &ErrorBudget, tally: &Tally) -> Vec<BudgetShare> {
        let [visibility, sampling, solver, tail] =
            estimate::parts(tally, self.certified.solver).map(|(_, error)| Some(error));
        let spent = |name| match name {
            "image" => Some(self.error_estimate),
            "solution" => visibility,
            "pixels" => sampling,
            "solver" => solver,
            "chains" => tail,
            "row_chains" => Some(self.certified.dropped),
            _ => None,
        };
        budget.shares().map(|(name, allowed)| BudgetShare { name, allowed, spent: spent(name) }).to_vec()
    }

    /// Adds the part of an image of `pixels` pixels and draws the conclusions.
    pub(super) fn finish(&mut self, tally: &Tally, pixels: usize, budget: &ErrorBudget) {
        self.skip("pixels beside the object", (pixels as u64).saturating_sub(tally.object_pixels));
        self.skip("pixels of which the centre is enough", (pixels as u64).saturating_sub(tally.refined));
        self.certified.chain_tail = tally.tail;
        self.certified.excludes = std::vec!["visibility", "light", "interpolation", "sampling"];
        let (error, limit) = estimate::estimate(tally, self.certified.solver);
        (self.error_estimate, self.limited_by) = (error, limit.name());
        self.tolerance_met = self.error_estimate <= self.tolerance;
        self.budget = self.shares(budget, tally);
    }
}
