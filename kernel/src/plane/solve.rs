//! Solves eq. (12) for the diffuse radiance of all unknowns, by the sweeps of [`crate::radiosity`]: rows are
//! independent, so that any split gives the same bits, and the change of a sweep bounds the error.

use crate::base::error::Error;
use crate::base::index::copy;
use crate::base::math::fabs;
use crate::plane::scene::PlaneScene;
pub use crate::radiosity::{bound, sweeps};
use core::ops::Range;

/// When the sweeps over a linear system whose weights may be negative end: as soon as the bound on their error is a
/// small part of the tolerance. [`crate::radiosity::solver::Solver`] is for all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweeps {
    /// Sweeps done.
    pub done: u32,
    /// Bound on the radiances' error, relative to the reference radiance.
    pub error: f64,
    q: f64,
    goal: f64,
    most: u32,
}

impl Sweeps {
    /// Before the first sweep of a system of contraction `q` (the largest over all rows), until the bound on the error
    /// is at most `goal`.
    pub fn until(q: f64, goal: f64) -> Sweeps {
        let most = if q < 1.0 { sweeps(q, goal).saturating_add(200).min(100_000) } else { 2_000 };
        Sweeps { done: 0, error: f64::INFINITY, q, goal, most }
    }

    /// True where another sweep is wanted.
    pub fn more(&self) -> bool {
        self.error > self.goal && self.done < self.most
    }

    /// Notes a sweep that changed the radiances by at most `change`.
    ///
    /// # Errors
    /// [`Error::Diverges`] where the last sweep allowed did not end it and nothing bounds the rest.
    pub fn took(&mut self, change: f64) -> Result<(), Error> {
        self.done += 1;
        self.error = bound(change, self.q);
        if self.done >= self.most && self.q >= 1.0 {
            return Err(Error::Diverges { row_sum: self.q });
        }
        Ok(())
    }
}

/// How [`System::solve`] went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relaxed {
    /// Contraction of a sweep; 0 where reflections are told apart.
    pub contraction: f64,
    /// Sweeps made.
    pub sweeps: u32,
    /// Bound on the error of all radiances: certified where the contraction is below 1, else by the sweeps' observed
    /// decay.
    pub error: f64,
}

/// Everything that stays fixed while the system is solved.
#[derive(Clone, Copy, Debug)]
pub struct System<'a> {
    scene: &'a PlaneScene<'a>,
    matrix: &'a [f64],
    direct: &'a [f64],
    unknowns: usize,
    classes: usize,
}

impl<'a> System<'a> {
    /// Joins all rows ([`crate::plane::rows::fill`]) and their light ([`crate::plane::direct::fill`]).
    ///
    /// # Errors
    /// [`Error::Length`] where they do not fit the scene and one another.
    pub fn new(scene: &'a PlaneScene<'a>, matrix: &'a [f64], direct: &'a [f64]) -> Result<System<'a>, Error> {
        let unknowns = scene.unknowns();
        let classes = direct.len() / unknowns.max(1);
        for (what, expected, given) in [
            ("plane light", unknowns * classes.max(1), direct.len()),
            ("plane matrix", unknowns.saturating_mul(unknowns * classes), matrix.len()),
        ] {
            if expected != given {
                return Err(Error::Length { what, expected, given });
            }
        }
        Ok(System { scene, matrix, direct, unknowns, classes })
    }

    /// Levels of the solution: one where all reflections count, else one for each number that may.
    pub fn levels(&self) -> usize {
        self.classes
    }

    /// The largest of rho_d times the absolute sum of a row, over the rows of `range`: the contraction of a
    /// sweep.
    pub fn contraction(&self, range: Range<usize>) -> f64 {
        let row = |unknown| {
            let sum: f64 = self.part(unknown, 0).iter().map(|&x| fabs(x)).sum();
            self.diffuse(unknown) * sum
        };
        range.map(row).fold(0.0, f64::max)
    }

    /// One sweep over the rows of `range`, where all reflections count: from the radiances of all unknowns
    /// those of the range. Returns the largest change.
    pub fn sweep(&self, range: Range<usize>, from: &[f64], to: &mut [f64]) -> f64 {
        let mut change = 0.0;
        for (unknown, out) in range.zip(to) {
            let direct = self.direct.get(unknown * self.classes).copied().unwrap_or(0.0);
            *out = self.diffuse(unknown) * (direct + dot(self.part(unknown, 0), from));
            let old = from.get(unknown).copied().unwrap_or(0.0);
            change = f64::max(change, fabs(*out - old));
        }
        change
    }

    /// Radiances of the unknowns of `range` from light reflected at most `bounces` times (1 to
    /// [`System::levels`]), given `lower`: those of all unknowns for 1, 2, ... reflections, one after the
    /// other.
    pub fn level(&self, range: Range<usize>, bounces: usize, lower: &[f64], to: &mut [f64]) {
        for (unknown, out) in range.zip(to) {
            let direct = self.direct.iter().skip(unknown * self.classes).take(bounces.min(self.classes));
            let mut sum: f64 = direct.sum();
            for class in 0..bounces.min(self.classes).saturating_sub(1) {
                let level = bounces - 2 - class;
                let from = lower.get(level * self.unknowns..(level + 1) * self.unknowns).unwrap_or(&[]);
                sum += dot(self.part(unknown, class), from);
            }
            *out = self.diffuse(unknown) * sum;
        }
    }

    /// Solves the system to `radiance` (as many values as [`System::levels`] times the unknowns, all 0), with
    /// `scratch` for as many values as unknowns: by sweeps until the error is at most `goal` of the brightest light,
    /// or without a goal level by level, one for each number of reflections.
    ///
    /// # Errors
    /// [`Error::Length`]; [`Error::Diverges`] where a closed part of the scene reflects all light.
    pub fn solve(
        &self,
        goal: Option<f64>,
        radiance: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<Relaxed, Error> {
        for (what, expected, given) in [
            ("plane radiances", self.unknowns * self.classes, radiance.len()),
            ("plane scratch", self.unknowns, scratch.len()),
        ] {
            if expected != given {
                return Err(Error::Length { what, expected, given });
            }
        }
        let Some(goal) = goal else {
            for bounces in 1..=self.classes {
                let at = ((bounces - 1) * self.unknowns).min(radiance.len());
                let (lower, to) = radiance.split_at_mut(at);
                self.level(0..self.unknowns, bounces, lower, to);
            }
            return Ok(Relaxed::default());
        };
        let goal = goal.max(1e-15);
        let mut relaxed = Relaxed { contraction: self.contraction(0..self.unknowns), ..Relaxed::default() };
        let mut sweeps = Sweeps::until(relaxed.contraction, goal);
        let (mut from, mut to) = (&mut *radiance, &mut *scratch);
        // from no light, the first change is the brightest radiance before interreflection
        let (mut scale, mut before, mut decay) = (0.0, 0.0, f64::INFINITY);
        while sweeps.more() {
            let change = self.sweep(0..self.unknowns, from, to);
            core::mem::swap(&mut from, &mut to);
            scale = f64::max(scale, change);
            sweeps.took(if scale > 0.0 { change / scale } else { 0.0 })?;
            relaxed.error = sweeps.error * scale;
            if relaxed.contraction >= 1.0 {
                // polynomials have negative weights: sweeps contract that no row's absolute sum proves to
                let latest = change / before;
                relaxed.error = bound(change, f64::max(latest, decay));
                decay = latest;
                if change == 0.0 || relaxed.error <= goal * scale {
                    break;
                }
            }
            before = change;
        }
        relaxed.sweeps = sweeps.done;
        if sweeps.done % 2 == 1 {
            copy(radiance, scratch);
        }
        Ok(relaxed)
    }

    fn part(&self, unknown: usize, class: usize) -> &'a [f64] {
        let at = (unknown * self.classes + class) * self.unknowns;
        self.matrix.get(at..at + self.unknowns).unwrap_or(&[])
    }

    fn diffuse(&self, unknown: usize) -> f64 {
        let (primitive, _) = self.scene.unknown(unknown);
        self.scene.primitives().get(primitive).map_or(0.0, |p| self.scene.diffuse(p.material))
    }
}

/// Scalar product in four lanes.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let ((a4, a), (b4, b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let rest: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    for (a, b) in a4.iter().zip(b4) {
        for (lane, (x, y)) in lanes.iter_mut().zip(a.iter().zip(b)) {
            *lane += x * y;
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}
