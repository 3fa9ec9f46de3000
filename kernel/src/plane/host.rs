//! The owning layer over the plane model, for programs with a heap: one thread, as the paper's times are.

use crate::base::arena::Memory;
use crate::base::error::Error;
use crate::plane::direct;
use crate::plane::image::{self, Seen, Solved, View};
use crate::plane::light::Light;
use crate::plane::rows::{self, RowInfo};
use crate::plane::scene::{PlaneInput, PlaneScene};
use crate::plane::scratch::Scratch;
pub use crate::plane::settings::Settings;
use crate::plane::solve::System;
use std::vec;
use std::vec::Vec;

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Unknowns of the system.
    pub unknowns: usize,
    /// Rows that see something of the object.
    pub coupled: usize,
    /// Rays of the rows.
    pub rays: u64,
    /// Contraction of a sweep.
    pub contraction: f64,
    /// Sweeps made.
    pub sweeps: u32,
    /// Bound on the solver's error: certified where the contraction is below 1, else by the sweeps' observed decay.
    pub solver: f64,
    /// Certified bound on what cut chains of a row could still bring, relative to the brightest light.
    pub tail: f64,
}

/// Solves a scene and hands the solution, the report and working memory to `with`.
///
/// # Errors
/// Those of the stages; [`Error::Range`] where a setting is out of range; [`Error::Diverges`] where a closed
/// part of the scene reflects all light.
pub fn solve<R>(
    input: &PlaneInput<'_>,
    light: &Light<'_>,
    settings: &Settings,
    with: impl FnOnce(&Solved<'_>, &Report, &mut Scratch<'_>) -> R,
) -> Result<R, Error> {
    settings.check()?;
    let rows = settings.rows();
    let mut memory = Memory::new(PlaneScene::bytes(input)?);
    let scene = PlaneScene::new(input, settings.basis, settings.tolerance, memory.bytes_mut())?;
    let cuts = light.cuts().len();
    let mut memory = Memory::new(Scratch::bytes(&scene, cuts)?);
    let mut scratch = Scratch::new(&scene, cuts, memory.bytes_mut())?;
    let (unknowns, classes) = (scene.unknowns(), rows::classes(&rows));
    let diffuse = input.bodies.iter().any(|b| input.materials[b.material].diffuse > 0.0);
    let mut report = Report { unknowns, ..Report::default() };
    let mut radiance = vec![0.0; unknowns * classes];
    if diffuse {
        let mut matrix = vec![0.0; unknowns * unknowns * classes];
        let (mut open, mut direct) = (vec![0.0; unknowns * classes], vec![0.0; unknowns * classes]);
        let mut info = vec![RowInfo::default(); unknowns];
        rows::fill(&scene, &rows, 0..unknowns, &mut matrix, &mut open, &mut info, &mut scratch)?;
        direct::fill(&scene, light, &rows, 0..unknowns, &open, &mut direct, &mut scratch)?;
        report.coupled = info.iter().map(|i| i.coupled as usize).sum();
        report.rays = info.iter().map(|i| u64::from(i.rays)).sum();
        report.tail = info.iter().map(|i| i.lost).fold(0.0, f64::max);
        let system = System::new(&scene, &matrix, &direct)?;
        let goal = settings.max_bounces.is_none().then_some(settings.solver);
        let relaxed = system.solve(goal, &mut radiance, &mut vec![0.0; unknowns])?;
        report.contraction = relaxed.contraction;
        (report.sweeps, report.solver) = (relaxed.sweeps, relaxed.error);
    }
    let solved = Solved {
        scene: &scene,
        light,
        radiance: &radiance,
        max_bounces: settings.max_bounces,
        cutoff: settings.cutoff,
    };
    Ok(with(&solved, &report, &mut scratch))
}

/// A view's samples.
pub fn image(
    solved: &Solved<'_>,
    angle: f64,
    samples: usize,
    scratch: &mut Scratch<'_>,
) -> Result<Vec<Seen>, Error> {
    let view = View::new(solved.scene, angle, samples)?;
    let mut out = vec![Seen::default(); samples];
    image::fill(solved, &view, 0..samples, &mut out, scratch)?;
    Ok(out)
}
