//! report.json.

use std::collections::BTreeMap;
use std::io::{self, Write};

use blik_kernel::host;
use serde::Serialize;

use crate::view::View;

/// What was computed, how well, and with what effort. The fields are the keys of the file.
#[derive(Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: &'static str,
    /// The wanted error.
    pub tolerance: f64,
    /// What errors are relative to, per band.
    pub reference_radiance: Vec<f64>,
    /// Where it comes from.
    pub reference_from: &'static str,
    /// Estimate of the true eps of the image.
    pub error_estimate: f64,
    /// Whether the estimate is within the tolerance.
    pub tolerance_met: bool,
    /// What is truly bounded.
    pub certified: Certified,
    /// The largest part of the estimate.
    pub limited_by: &'static str,
    /// Shares of the error budget, by name.
    pub budget: BTreeMap<&'static str, Share>,
    /// Rounds in which the image was computed, each finer than the one before.
    pub rounds: u32,
    /// Facets of the mesh.
    pub facets: usize,
    /// Facets without area, kept out of the physics.
    pub degenerate_facets: usize,
    /// Spectral bands.
    pub bands: usize,
    /// Elements that carry an unknown.
    pub elements: usize,
    /// Pairs of elements.
    pub pairs: Pairs,
    /// Rays by purpose.
    pub rays: Rays,
    /// Sweeps of the solver.
    pub sweeps: u32,
    /// Memory by stage.
    pub bytes: Bytes,
    /// Time by stage.
    pub seconds: Seconds,
    /// Work left out, by kind.
    pub skipped: BTreeMap<&'static str, u64>,
    /// The image's integrals.
    pub signature: Signature,
    /// What the camera sees.
    pub view: View,
    /// What was passed over, not applied, or is seldom meant; as on standard error.
    pub warnings: Vec<String>,
}

/// Bounds, relative to the reference radiance.
#[derive(Serialize)]
pub struct Certified {
    pub solver: f64,
    pub chain_tail: f64,
    pub dropped: f64,
    /// What the bounds do not cover.
    pub excludes: Vec<&'static str>,
}

/// A share of the error budget: what might be spent and what was, `None` where that is measured as a part of another share.
#[derive(Serialize)]
pub struct Share {
    pub allowed: f64,
    pub spent: Option<f64>,
}

/// Counts of pairs.
#[derive(Serialize)]
pub struct Pairs {
    pub tested: u64,
    pub culled: u64,
    pub exact: u64,
    pub sampled: u64,
}

/// Counts of rays.
#[derive(Serialize)]
pub struct Rays {
    pub visibility: u64,
    pub sun: u64,
    pub chain: u64,
    pub primary: u64,
}

/// Bytes of each stage.
#[derive(Serialize)]
pub struct Bytes {
    pub scene: usize,
    pub bvh: usize,
    pub coupling: usize,
    pub light: usize,
    pub image: usize,
}

/// Seconds of each stage.
#[derive(Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub scene: f64,
    pub bvh: f64,
    pub coupling: f64,
    pub light: f64,
    pub radiosity: f64,
    pub image: f64,
    /// All files but this one.
    pub write: f64,
    pub total: f64,
}

/// What an observer measures who does not resolve the object.
#[derive(Serialize)]
pub struct Signature {
    /// W/sr per band.
    pub radiant_intensity: Vec<f64>,
    /// In the mesh's unit, squared.
    pub projected_area: f64,
    /// Radiant intensity over projected area, per band.
    pub mean_radiance: Vec<f64>,
    /// Against the background, per band; `None` where that is 0.
    pub contrast: Vec<Option<f64>>,
    /// What the radiant intensity is expected to be wrong by, W/sr.
    pub error: Vec<f64>,
    /// What glints that may lie between cells bring on the mean, W/sr; not among the error.
    pub unresolved_glints: Vec<f64>,
}

impl Report {
    /// The kernel's report in the file's words; seconds of reading, writing and in total are 0.
    pub fn new(of: host::Report, view: View) -> Self {
        Report {
            version: env!("CARGO_PKG_VERSION"),
            tolerance: of.tolerance,
            reference_radiance: of.reference_radiance,
            reference_from: of.reference_from,
            error_estimate: of.error_estimate,
            tolerance_met: of.tolerance_met,
            certified: Certified {
                solver: of.certified.solver,
                chain_tail: of.certified.chain_tail,
                dropped: of.certified.dropped,
                excludes: of.certified.excludes,
            },
            limited_by: of.limited_by,
            budget: of
                .budget
                .into_iter()
                .map(|share| (share.name, Share { allowed: share.allowed, spent: share.spent }))
                .collect(),
            rounds: of.rounds,
            facets: of.facets,
            degenerate_facets: of.degenerate_facets,
            bands: of.bands,
            elements: of.elements,
            pairs: Pairs {
                tested: of.pairs.tested,
                culled: of.pairs.culled,
                exact: of.pairs.exact,
                sampled: of.pairs.sampled,
            },
            rays: Rays {
                visibility: of.rays.visibility,
                sun: of.rays.sun,
                chain: of.rays.chain,
                primary: of.rays.primary,
            },
            sweeps: of.sweeps,
            bytes: Bytes {
                scene: of.bytes.scene,
                bvh: of.bytes.bvh,
                coupling: of.bytes.coupling,
                light: of.bytes.light,
                image: of.bytes.image,
            },
            seconds: Seconds {
                scene: of.seconds.scene,
                bvh: of.seconds.bvh,
                coupling: of.seconds.coupling,
                light: of.seconds.light,
                radiosity: of.seconds.radiosity,
                image: of.seconds.image,
                ..Seconds::default()
            },
            skipped: of.skipped.into_iter().collect(),
            signature: Signature {
                radiant_intensity: of.signature.radiant_intensity,
                projected_area: of.signature.projected_area,
                mean_radiance: of.signature.mean_radiance,
                contrast: of.signature.contrast,
                error: of.signature.error,
                unresolved_glints: of.signature.unresolved_glints,
            },
            view,
            warnings: Vec::new(),
        }
    }
}

/// Writes the report.
pub fn write(report: &Report, mut to: impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut to, report)?;
    writeln!(to)
}
