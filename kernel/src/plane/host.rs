//! The owning layer over the plane model, for programs with a heap: one thread, as the paper's times are.

use crate::arena::Memory;
use crate::error::{Error, Field};
use crate::plane::image::{self, Seen, Solved, View};
use crate::plane::light::{self, Light};
use crate::plane::rows::{self, Method, RowInfo, RowSettings, check_bounces};
use crate::plane::scene::{Basis, PlaneInput, PlaneScene};
use crate::plane::solve::{System, bound};
use crate::plane::view::Scratch;
use crate::policy::Sweeps;
use std::vec;
use std::vec::Vec;

/// How a scene is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How the diffuse radiance varies.
    pub basis: Basis,
    /// How rows are integrated.
    pub method: Method,
    /// Light reflected more often does not count, 1 to 64; `None`: by `cutoff`.
    pub max_bounces: Option<u32>,
    /// Chains end where their mirrors leave less than this share.
    pub cutoff: f64,
    /// Bound on the solver's error, relative to the brightest light.
    pub solver: f64,
    /// Wanted error, relative to the sky: chooses the rays of lobes that have none of their own.
    pub tolerance: f64,
}

impl Settings {
    /// Settings with which bodies that are cut finely enough reach this error, relative to the sky: circles of
    /// 12 elements at 1e-4 and of 16 at 1e-5 in the two-circle study, more where bodies nearly touch. A tolerance
    /// beyond 1e-13 to 0.1 is refused by [`solve`].
    pub fn for_tolerance(tolerance: f64) -> Settings {
        let t = tolerance.clamp(1e-13, 0.1);
        let points = if t >= 5e-5 {
            6
        } else if t >= 5e-6 {
            8
        } else {
            16
        };
        Settings {
            basis: Basis::Panels(4),
            method: Method::Split { points },
            max_bounces: None,
            cutoff: 0.1 * t,
            solver: 0.01 * t,
            tolerance,
        }
    }
}

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
/// Those of the stages; [`Error::Range`] where a setting is out of range; [`Error::Diverges`] where a closed part of the scene reflects all light.
pub fn solve<R>(
    input: &PlaneInput<'_>,
    light: &Light<'_>,
    settings: &Settings,
    with: impl FnOnce(&Solved<'_>, &Report, &mut Scratch<'_>) -> R,
) -> Result<R, Error> {
    let rows =
        RowSettings { method: settings.method, max_bounces: settings.max_bounces, cutoff: settings.cutoff };
    check_bounces(&rows)?;
    check_settings(settings)?;
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
        light::fill(&scene, light, &rows, 0..unknowns, &open, &mut direct, &mut scratch)?;
        report.coupled = info.iter().map(|i| i.coupled as usize).sum();
        report.rays = info.iter().map(|i| u64::from(i.rays)).sum();
        report.tail = info.iter().map(|i| i.lost).fold(0.0, f64::max);
        let system = System::new(&scene, &matrix, &direct)?;
        relax(&system, settings, unknowns, &mut radiance, &mut report)?;
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

/// Refuses shares that are none.
fn check_settings(settings: &Settings) -> Result<(), Error> {
    for value in [settings.cutoff, settings.solver] {
        if !(0.0..=1.0).contains(&value) {
            return Err(Error::Range { field: Field::Tolerance, band: 0, value });
        }
    }
    Ok(())
}

/// Solves the system, level by level or by sweeps.
fn relax(
    system: &System<'_>,
    settings: &Settings,
    unknowns: usize,
    radiance: &mut Vec<f64>,
    report: &mut Report,
) -> Result<(), Error> {
    if settings.max_bounces.is_some() {
        for bounces in 1..=system.levels() {
            let (lower, to) = radiance.split_at_mut((bounces - 1) * unknowns);
            system.level(0..unknowns, bounces, lower, &mut to[..unknowns]);
        }
        return Ok(());
    }
    report.contraction = system.contraction(0..unknowns);
    let goal = settings.solver.max(1e-15);
    let mut sweeps = Sweeps::until(report.contraction, goal);
    let mut next = radiance.clone();
    // from no light, the first change is the brightest radiance before interreflection
    let (mut scale, mut before, mut decay) = (0.0, 0.0, f64::INFINITY);
    while sweeps.more() {
        let change = system.sweep(0..unknowns, radiance, &mut next);
        core::mem::swap(radiance, &mut next);
        scale = f64::max(scale, change);
        sweeps.took(if scale > 0.0 { change / scale } else { 0.0 })?;
        report.solver = sweeps.error * scale;
        if report.contraction >= 1.0 {
            // polynomials have negative weights: sweeps contract that no row's absolute sum proves to
            let latest = change / before;
            report.solver = bound(change, f64::max(latest, decay));
            decay = latest;
            if change == 0.0 || report.solver <= goal * scale {
                break;
            }
        }
        before = change;
    }
    report.sweeps = sweeps.done;
    Ok(())
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
