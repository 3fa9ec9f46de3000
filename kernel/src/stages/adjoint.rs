//! Derivatives of a weighted sum of radiances by all reflectances and emissions, by the transposed system.
//!
//! Constants of this file are measured by `cargo test --test gradients` (derivatives against differences).

use super::light::{Lighting, Scratch};
use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, pieces};
use crate::base::math::FRAC_1_PI;
use crate::radiosity::System;
use crate::radiosity::direct::TableShape;
use crate::radiosity::solution::Solution;
use crate::radiosity::sweeps;
use crate::view::importance::Importance;

/// The most sweeps of a transposed solution.
const TRANSPOSED_SWEEPS_MOST: u32 = 10_000;

/// Sweeps that go on where rounding alone changes what they make.
const TRANSPOSED_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Memory of a transposed solution beside the forward one's.
#[derive(Debug)]
pub struct AdjointMemory<'m> {
    /// The table of the first pass.
    table: &'m mut [f64],
    /// Derivatives by it.
    weights: &'m mut [f64],
    /// Derivatives by radiances of unknowns, their transposed solution twice, and irradiances.
    source: &'m mut [f64],
    lambda: [&'m mut [f64]; 2],
    irradiance: &'m mut [f64],
}

impl<'m> AdjointMemory<'m> {
    /// Bytes for a number of unknowns.
    pub fn need(unknowns: usize, shape: TableShape) -> Need {
        let (table, values) = (unknowns * 3 * shape.bands, unknowns * shape.bands);
        let need = Need::new().and::<f64>(table).and::<f64>(table);
        (0..4).fold(need, |need, _| need.and::<f64>(values))
    }

    /// Carves it out of an arena.
    pub fn take(
        unknowns: usize,
        shape: TableShape,
        arena: &mut Arena<'m>,
    ) -> Result<AdjointMemory<'m>, Error> {
        let (table, values) = (unknowns * 3 * shape.bands, unknowns * shape.bands);
        Ok(AdjointMemory {
            table: arena.take(table)?,
            weights: arena.take(table)?,
            source: arena.take(values)?,
            lambda: [arena.take(values)?, arena.take(values)?],
            irradiance: arena.take(values)?,
        })
    }
}

/// How a transposed solution went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AdjointReport {
    /// Sweeps of both passes.
    pub sweeps: u32,
    /// The last change of a sweep relative to the solution, over 1 less the contraction: a bound in the sum of magnitudes; infinite
    /// where rows reflect all light.
    pub error: f64,
}

impl Lighting<'_> {
    /// Completes the derivatives by diffuse reflectances and emissions that rays noted: adds what changes by way of all
    /// reflections. `scratch` is as [`Lighting::solve`] left it, with the radiances of its first pass kept ([`super::Sizes::keeping_first`]).
    ///
    /// The derivative is that of the numbers that the solver's equations define: elements, rows and rays stay what they are.
    // apart on small machines: does not burden the stack of the signature
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    pub fn differentiate(
        &self,
        solution: &Solution<'_>,
        scratch: &mut Scratch<'_>,
        importance: &mut Importance<'_>,
        memory: &mut AdjointMemory<'_>,
    ) -> Result<AdjointReport, Error> {
        let Lighting { scene, elements, coupling, light, .. } = *self;
        let shape = solution.shape;
        if shape.levels > 1 {
            return Err(Error::Mismatch { what: "derivatives of counted reflections" });
        }
        let size = elements.unknowns() * shape.bands;
        let (straight, sun) = (solution.straight, solution.sun);
        let with = |direct| System { scene, elements, coupling, light, direct, sun, straight, shape };
        let mut report = AdjointReport::default();
        // what the second pass saw
        let system = with(&*scratch.direct);
        let Importance { irradiance: asked, diffuse, emission, .. } = importance;
        system.absent_rows_transposed(asked);
        memory.source.fill(0.0);
        let second = scratch.orders.part(0..size);
        system.gather_transposed(second, asked, memory.source, memory.irradiance);
        self.transposed(&system, memory, &mut report);
        system.add_derivatives(memory.lambda[0], memory.irradiance, diffuse, emission);
        // by what slopes of the first pass added to it
        let first = &*scratch.first;
        system.gather(0..elements.unknowns(), 0, |_| first, memory.table)?;
        self.missed(&system, asked, memory);
        memory.weights.fill(0.0);
        system.slopes_transposed(memory.lambda[1], memory.table, memory.weights, diffuse);
        memory.source.fill(0.0);
        system.gather_transposed(first, memory.weights, memory.source, memory.irradiance);
        self.transposed(&system, memory, &mut report);
        // what arrived at first had no slopes
        system.gradient_source(0..elements.unknowns(), memory.table, memory.lambda[1]);
        memory.irradiance.iter_mut().zip(&*memory.lambda[1]).for_each(|(all, slopes)| *all -= slopes);
        system.add_derivatives(memory.lambda[0], memory.irradiance, diffuse, emission);
        Ok(report)
    }

    /// How the sum changes with what slopes bring each unknown, in the second of both solutions: by its own table and by what it
    /// sends.
    fn missed(&self, system: &System<'_>, asked: &[f64], memory: &mut AdjointMemory<'_>) {
        let bands = system.shape.bands;
        let [lambda, missed] = &mut memory.lambda;
        for (unknown, out) in pieces(missed, bands).enumerate() {
            let facet = self.elements.facet_of(unknown).0;
            let rho = self.scene.diffuse(self.scene.material(facet));
            let start = system.shape.at(unknown, 0).start;
            for (band, out) in out.iter_mut().enumerate() {
                let sent = FRAC_1_PI * rho.at(band) * lambda.at(unknown * bands + band);
                *out = asked.at(start + band) + sent;
            }
        }
    }

    /// Solves lambda = w + (rho_d K)^T lambda for the source; the solution stands in the first of both.
    fn transposed(&self, system: &System<'_>, memory: &mut AdjointMemory<'_>, report: &mut AdjointReport) {
        let goal = self.settings.budget.solver;
        let q = system.contraction(0..self.elements.unknowns());
        let most = sweeps(q, goal.max(TRANSPOSED_ROUNDING)).saturating_add(200).min(TRANSPOSED_SWEEPS_MOST);
        let AdjointMemory { source, lambda: [latest, next], .. } = memory;
        latest.iter_mut().zip(&**source).for_each(|(to, from)| *to = *from);
        let slack = if q < 1.0 { q / (1.0 - q) } else { f64::INFINITY };
        for _ in 0..most {
            let change = system.sweep_transposed(source, latest, next);
            core::mem::swap(latest, next);
            report.sweeps += 1;
            let error = if change == 0.0 { 0.0 } else { change * slack };
            let enough = if slack < f64::INFINITY { error <= goal } else { change <= goal };
            if enough || change <= TRANSPOSED_ROUNDING {
                report.error = report.error.max(error);
                return;
            }
        }
        report.error = f64::INFINITY;
    }
}
