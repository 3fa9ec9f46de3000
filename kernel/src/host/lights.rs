//! Many lights in one call against one geometry, each on one thread.

use super::{Geometry, Host, MOST_BEAM_BYTES, SignatureReport, signature_report};
use crate::base::arena::Memory;
use crate::base::error::Error;
use crate::base::math::Vec3;
use crate::coupling::Coupling;
use crate::scene::light::{Light, LightInput};
use crate::settings;
use crate::stages::{Explained, Lights};
use crate::view::chain::{KnownRows, Solved};
use crate::view::importance::Importance;
use crate::view::signature::{self, View};
use crate::view::{facets, signature::Sums};
use rayon::prelude::*;
use std::vec::Vec;

/// What is wanted of each of many lights.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted<'a> {
    /// Irradiance and diffuse radiance of all facets.
    pub facets: bool,
    /// Directions from observers toward the object, whose signatures are wanted.
    pub views: &'a [Vec3],
}

/// What one of many lights gives.
#[derive(Clone, Debug, PartialEq)]
pub struct LightReport {
    /// Reference radiance, one value per band.
    pub reference_radiance: Vec<f64>,
    /// Mean irradiance of each facet, side and band, bands innermost, as [`super::Lit::facets`] gives it; empty where it is
    /// not wanted.
    pub irradiance: Vec<f64>,
    /// Diffuse radiance of each facet, side and band.
    pub radiance: Vec<f64>,
    /// The signature of each view.
    pub signatures: Vec<SignatureReport>,
    /// Rays toward the sun, from mirrors that face it, and of the signatures.
    pub rays: u64,
    /// Sweeps.
    pub sweeps: u64,
    /// Bound on the solver's error, relative to the reference radiance.
    pub solver: f64,
}

/// A thread's memory.
struct Lane {
    memory: Memory,
    view: Memory,
}

impl Host {
    /// Solves many lights against one geometry, each on one thread, with the bits of [`Host::light_of`],
    /// [`super::Lit::facets`] and [`Host::signatures`]; lights of the same sky share what is known of it.
    ///
    /// # Errors
    /// Those of [`Host::light_of`] for the first light that is refused, and its number.
    pub fn lights(
        &self,
        geometry: &Geometry<'_>,
        lights: &[LightInput<'_>],
        wanted: Wanted<'_>,
    ) -> Result<Vec<LightReport>, (usize, Error)> {
        let Geometry { scene, bvh, elements, settings, .. } = geometry;
        let coupling = geometry.coupling().map_err(|error| (0, error))?;
        let all = Lights { scene, bvh, elements, coupling: &coupling, settings };
        let one = |lane: &mut Option<Lane>, (number, input): (usize, &LightInput<'_>)| {
            all.measured(lane, input, geometry, wanted).map_err(|error| (number, error))
        };
        // lights of one sky stand side by side: a thread takes a run of them
        let run = lights.len().div_ceil(4 * self.pool.current_num_threads().max(1)).max(1);
        let results = self.pool.install(|| {
            let items = lights.par_iter().enumerate().with_min_len(run);
            items.map_init(|| None, one).collect::<Vec<_>>()
        });
        results.into_iter().collect()
    }
}

/// A signature with its parts and derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The signature.
    pub signature: SignatureReport,
    /// What the observer sees of each facet first, by facet and band, W/sr: they add up to the radiant intensity.
    pub facets: Vec<f64>,
    /// The same by material and band.
    pub materials: Vec<f64>,
    /// The radiant intensity's terms of eq. (11), by band: diffuse, mirrored sky and sun, mirrored diffuse.
    pub terms: [Vec<f64>; 3],
    /// Derivative of the radiant intensity by each facet's diffuse reflectance, by facet and band, W/sr; 0 for facets that reflect
    /// nothing diffusely in the band.
    pub by_diffuse: Vec<f64>,
    /// Derivative by the emission of each facet, side and band, m2.
    pub by_emission: Vec<f64>,
    /// Sweeps of the transposed system.
    pub sweeps: u32,
    /// What the transposed solution may be wrong by, relative to itself: a bound in the sum of magnitudes.
    pub solver: f64,
}

impl Host {
    /// Signatures under a light, what they are made of, and how they change with diffuse reflectances and emissions of all
    /// facets, on one thread. With sky and sun the radiant intensity is linear: its derivative by either's scale is the
    /// signature under that alone ([`Host::lights`]).
    ///
    /// Derivatives are those of the numbers that the kernel's equations define: of the unknowns' means and gradients,
    /// elements, rows and rays as they are. Chains between mirrors that are cut at the tolerance end there for them.
    ///
    /// # Errors
    /// Those of [`Host::light_of`], and [`Error::Range`] where `max_bounces` counts reflections.
    pub fn explain(
        &self,
        geometry: &Geometry<'_>,
        input: &LightInput<'_>,
        views: &[Vec3],
    ) -> Result<Vec<Explanation>, Error> {
        let Geometry { scene, bvh, elements, settings, .. } = geometry;
        let coupling = geometry.coupling()?;
        let all = Lights { scene, bvh, elements, coupling: &coupling, settings };
        let light = input.light(scene)?;
        let mut bytes = all.explain_bytes(&light)?;
        let cells = settings::signature_cells(&settings.budget);
        loop {
            let mut memory = Memory::new(bytes);
            all.start(memory.bytes_mut())?;
            let mut out = Vec::new();
            let (given, chains) = (geometry.reference.as_deref(), settings.chains(geometry.rays));
            let arrays: Vec<[f64; 3]> = views.iter().map(Vec3::to_array).collect();
            let wanted = (&arrays[..], cells);
            let done =
                all.explain((input, &light), given, wanted, chains, memory.bytes_mut(), |view, found| {
                    out.push(explanation(found, views[view]));
                    Ok(())
                });
            match done {
                Ok(()) => return Ok(out),
                Err(Error::BufferTooSmall { needed, .. }) if needed < MOST_BEAM_BYTES => {
                    bytes = needed.max(2 * bytes);
                }
                Err(error) => return Err(error),
            }
        }
    }
}

fn explanation(found: &Explained<'_>, forward: Vec3) -> Explanation {
    let (scene, bands) = (found.solved.scene, found.solved.shape.bands);
    let Importance { shares, terms, diffuse, emission, .. } = found.importance;
    let mut materials = std::vec![0.0; scene.materials() * bands];
    for (facet, share) in shares.chunks(bands).enumerate() {
        let to = materials.iter_mut().skip(scene.material(facet) * bands);
        to.zip(share).for_each(|(to, share)| *to += share);
    }
    let term = |number: usize| terms[number * bands..(number + 1) * bands].to_vec();
    Explanation {
        signature: signature_report(found.solved.light, found.solved.reference, forward, found.sums),
        facets: shares.to_vec(),
        materials,
        terms: [term(0), term(1), term(2)],
        by_diffuse: diffuse.to_vec(),
        by_emission: emission.to_vec(),
        sweeps: found.report.sweeps,
        solver: found.report.error,
    }
}

impl Lights<'_> {
    /// What one light gives, solved in a lane's memory.
    fn measured(
        &self,
        lane: &mut Option<Lane>,
        input: &LightInput<'_>,
        geometry: &Geometry<'_>,
        wanted: Wanted<'_>,
    ) -> Result<LightReport, Error> {
        let light = input.light(self.scene)?;
        let mut needed = self.bytes(&light)?;
        loop {
            let lane = self.lane(lane, needed)?;
            let (given, memory) = (geometry.reference.as_deref(), lane.memory.bytes_mut());
            match self.solve(input, &light, given, memory) {
                Ok(solution) => {
                    let (scene, bvh, elements) = (self.scene, self.bvh, self.elements);
                    let settings = self.settings.chains(geometry.rays);
                    let rows = KnownRows::new(self.coupling);
                    let solved = Solved { scene, bvh, elements, rows, light: &light, solution, settings };
                    let cells = settings::signature_cells(&self.settings.budget);
                    return report(&solved, self.coupling, wanted, cells, lane.view.bytes_mut());
                }
                Err(Error::BufferTooSmall { needed: more, .. }) if more < MOST_BEAM_BYTES => needed = more,
                Err(error) => return Err(error),
            }
        }
    }

    /// A lane of `bytes` bytes at least.
    fn lane<'l>(&self, lane: &'l mut Option<Lane>, bytes: usize) -> Result<&'l mut Lane, Error> {
        if lane.as_ref().is_none_or(|lane| lane.memory.bytes().len() < bytes) {
            let mut memory = Memory::new(bytes);
            self.start(memory.bytes_mut())?;
            *lane = Some(Lane { memory, view: Memory::new(signature::scratch_bytes()?) });
        }
        lane.as_mut().ok_or(Error::OutOfMemory { bytes })
    }
}

/// What a solved light gives.
fn report(
    solved: &Solved<'_>,
    coupling: &Coupling<'_>,
    wanted: Wanted<'_>,
    cells: usize,
    scratch: &mut [u8],
) -> Result<LightReport, Error> {
    let (scene, bands) = (solved.scene, solved.shape.bands);
    let mut report = LightReport {
        reference_radiance: solved.reference.to_vec(),
        irradiance: Vec::new(),
        radiance: Vec::new(),
        signatures: Vec::new(),
        rays: solved.numbers.sun_rays,
        sweeps: solved.numbers.sweeps,
        solver: solved.numbers.solver,
    };
    if wanted.facets {
        let values = scene.facets() * scene.sides() * bands;
        report.irradiance = std::vec![0.0; values];
        report.radiance = std::vec![0.0; values];
        let sides = report.irradiance.chunks_mut(bands).zip(report.radiance.chunks_mut(bands));
        for (place, (e, l)) in sides.enumerate() {
            let (facet, side) = (place / scene.sides(), place % scene.sides());
            facets::side(solved, coupling, solved.sun, facet, side, e, l);
        }
    }
    for forward in wanted.views {
        let view = View::new(solved, *forward, cells)?;
        let sums: &Sums = signature::whole(solved, &view, scratch)?;
        report.rays += sums.rays;
        report.signatures.push(signature_report(solved.light, solved.reference, *forward, sums));
    }
    Ok(report)
}

/// The radiance of the sky behind an object.
pub(super) fn background(light: &Light<'_>, forward: Vec3, bands: usize) -> Vec<f64> {
    let mut background = std::vec![0.0; bands];
    if let Some(sky) = &light.sky {
        sky.radiance(forward, &mut background);
    }
    background
}
