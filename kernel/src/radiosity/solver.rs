//! How the linear system of [`crate::radiosity`] is iterated: by plain sweeps where few do; else faster, with a bound
//! on the error all the same.
//!
//! **Faster.** Four plain sweeps, from whose changes reduced rank extrapolation finds what the slowest modes of each
//! band add up to (one mode in a closed room); then a block of Chebyshev's semi-iteration, which takes about the root
//! of the sweeps that plain ones would; and so on (A. Sidi, *Vector Extrapolation Methods*, 2017; R. Varga, *Matrix
//! Iterative Analysis*, 1962). The last sweep is a plain one, whose change bounds the error.
//!
//! **The bound.** For x' = G x + b with G >= 0 the distance of x' from the solution is at most
//! q |x' - x| |(I - G)^-1|, in the largest norm. Where all rows of G sum to q < 1, the inverse is at most 1/(1 - q).
//! Where some rows sum to 1, as in a white room with a window, any v >= 0 with (I - G) v >= 1 - d > 0 bounds it by
//! max v/(1 - d); such a v is found by the same iteration with the source 1 ([`Solver::for_inverse_bound`]).
//!
//! Constants of this file are measured by `cargo test -p blik-kernel --lib solver` (sweeps and bounds).

use crate::base::budget::ErrorBudget;
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::math::fabs;
use crate::radiosity::sweeps;
use crate::scene::{MAX_BANDS, Scene};

/// Number of solutions that [`History`] keeps.
const HISTORY_SOLUTIONS: usize = 3;

/// Most plain sweeps; where more are needed, faster ones are made.
const PLAIN_SWEEPS_MOST: u32 = 48;

/// Relative rounding of a row's sum, of which mirrors make some ten thousand terms. Measured in closed boxes to be up
/// to half of it.
const MATRIX_ROUNDING: f64 = 128.0 * f64::EPSILON;

/// Most sweeps of the accelerated iteration.
const SWEEPS_MOST: u32 = 1000;

/// Numbers of sweeps of the blocks of Chebyshev's iteration, and where their interval ends: the few modes beyond are
/// left to the extrapolation. The next longer one is taken where a block did not bring [`BLOCK_PROGRESS`].
const CHEBYSHEV_BLOCKS: [(u32, f64); 4] = [(16, 0.9), (32, 0.97), (64, 0.99), (128, 0.999)];

/// Share of the change before a block that may be left after it; above it the next block is longer.
const BLOCK_PROGRESS: f64 = 0.05;

/// Share of the change before the longest block that may be left after it. Above it only rounding changes, or modes
/// that Chebyshev's iteration does not suit.
const BLOCK_STUCK: f64 = 0.5;

/// Sum of a row from which on it cannot be told from a closed one.
const CLOSED_ROW_SUM: f64 = 1.0 - 1e-12;

/// Solutions' worth of memory that [`History`] needs beside the two that plain sweeps work on: 0 where the scene's
/// reflectances need no faster ones.
pub fn kept(scene: &Scene<'_>, goal: f64, max_bounces: Option<u32>) -> usize {
    // mirrors of at most s bring at most 1 + s + s^2 + ... times a row's share of the hemisphere
    let q = scene.largest_diffuse() / (1.0 - scene.largest_specular()).max(f64::MIN_POSITIVE);
    let few = sweeps(q.min(1.0), goal) <= PLAIN_SWEEPS_MOST;
    if few || max_bounces.is_some() { 0 } else { HISTORY_SOLUTIONS + 1 }
}

/// How an iteration goes on, and when it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    /// Sweeps done.
    pub done: u32,
    /// Bound on the radiances' error, relative to the reference radiance.
    pub error: f64,
    q: f64,
    inverse: f64,
    goal: f64,
    most: u32,
    acceleration: Option<Acceleration>,
}

/// Where the faster iteration stands.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Acceleration {
    /// Plain sweeps still to come before the next block.
    plain: u32,
    /// Sweeps of the block still to come, and their relaxation.
    left: u32,
    omega: f64,
    interval: f64,
    block: usize,
    /// No faster than plain sweeps: Chebyshev's do not suit the modes.
    slow: bool,
    /// Change of the sweep before the last block.
    before: f64,
}

impl Acceleration {
    fn new(q: f64) -> Acceleration {
        let plain = HISTORY_SOLUTIONS as u32 + 1;
        let interval = q.min(CHEBYSHEV_BLOCKS[0].1);
        Acceleration { plain, left: 0, omega: 1.0, interval, block: 0, slow: false, before: f64::INFINITY }
    }

    /// Counts a sweep that changed the radiances by at most `change`; false where going on brings nothing.
    fn step(&mut self, q: f64, change: f64, near: bool) -> bool {
        let squared = self.interval * self.interval;
        if self.plain == 0 {
            let next = 1.0 - 0.25 * squared * self.omega;
            self.omega = if self.omega == 1.0 { 1.0 / (1.0 - 0.5 * squared) } else { 1.0 / next };
            self.left = self.left.saturating_sub(1);
            if self.left == 0 || near {
                (self.plain, self.omega) = (HISTORY_SOLUTIONS as u32 + 1, 1.0);
            }
            return true;
        }
        self.plain = self.plain.saturating_sub(1);
        if self.plain > 0 {
            return true;
        }
        if change > BLOCK_PROGRESS * self.before {
            if change > BLOCK_STUCK * self.before && self.block + 1 == CHEBYSHEV_BLOCKS.len() {
                if self.slow {
                    return false;
                }
                self.slow = true;
            }
            self.block = (self.block + 1).min(CHEBYSHEV_BLOCKS.len() - 1);
        }
        let (length, end) = CHEBYSHEV_BLOCKS.get(self.block).copied().unwrap_or_default();
        self.interval = if self.slow { 0.0 } else { q.min(end) };
        (self.left, self.before) = (length, change);
        true
    }
}

impl Solver {
    /// Before the first sweep of a system of contraction `q` (the largest over all rows). `inverse`: the bound that
    /// [`Solver::for_inverse_bound`] found, where [`Solver::is_closed`] asks for it; `fast`: there is a [`History`].
    pub fn new(
        q: f64,
        inverse: Option<f64>,
        budget: &ErrorBudget,
        max_bounces: Option<u32>,
        fast: bool,
    ) -> Solver {
        let inverse = inverse.unwrap_or(1.0 / (1.0 - q).max(f64::MIN_POSITIVE));
        let needed = sweeps(q, budget.solver);
        let fast = fast && max_bounces.is_none() && needed > PLAIN_SWEEPS_MOST;
        // a sweep adds a reflection, and so does what sees the radiances
        let most = match max_bounces {
            Some(bounces) => bounces.saturating_sub(1),
            None if fast => SWEEPS_MOST,
            None => needed.saturating_add(200).min(100_000),
        };
        let acceleration = fast.then(|| Acceleration::new(q));
        let goal = if fast { budget.solver_accelerated } else { budget.solver };
        Solver { done: 0, error: f64::INFINITY, q, inverse, goal, most, acceleration }
    }

    /// For the source 1, from 0: how the bound on the inverse is found. Ends where a sweep adds no more than 1/2
    /// anywhere.
    pub fn for_inverse_bound() -> Solver {
        let acceleration = Some(Acceleration::new(1.0));
        Solver {
            done: 0,
            error: f64::INFINITY,
            q: 1.0,
            inverse: 1.0,
            goal: 0.5,
            most: SWEEPS_MOST,
            acceleration,
        }
    }

    /// True where a contraction bounds nothing, and [`Solver::for_inverse_bound`] has to.
    pub fn is_closed(q: f64, max_bounces: Option<u32>) -> bool {
        q >= CLOSED_ROW_SUM && max_bounces.is_none()
    }

    /// True where another sweep is wanted.
    pub fn is_unfinished(&self) -> bool {
        self.error > self.goal && self.done < self.most
    }

    /// Relaxation of the next sweep: the share of the step from the solution before last that is made.
    pub fn relaxation(&self) -> f64 {
        self.acceleration.filter(|p| p.plain == 0).map_or(1.0, |p| p.omega)
    }

    /// Notes a sweep whose plain step would have changed the radiances by at most `change`; true where the sweep's
    /// two solutions are to be handed to [`History::push`].
    pub fn record_sweep(&mut self, change: f64) -> bool {
        self.done += 1;
        let plain = self.relaxation() == 1.0;
        let bound = if change == 0.0 { 0.0 } else { change * self.q * self.inverse };
        self.error = if plain { bound } else { f64::INFINITY };
        let Some(acceleration) = &mut self.acceleration else { return false };
        let noted = acceleration.plain > 0;
        if !acceleration.step(self.q, change, bound <= 0.5 * self.goal) {
            self.most = self.done;
        }
        noted && self.is_unfinished()
    }

    /// After the last sweep: adds the rounding of the `radiance` itself; light of more reflections than count is no
    /// error. `reference` has one value per band.
    pub fn finish(&mut self, radiance: &[f64], reference: &[f64], max_bounces: Option<u32>) {
        if max_bounces.is_some() && self.done >= self.most {
            self.error = 0.0;
            return;
        }
        let (mut largest, bands): (f64, usize) = (0.0, reference.len().max(1));
        for (band, &reference) in reference.iter().enumerate().filter(|(_, r)| **r > 0.0) {
            let own = radiance.iter().skip(band).step_by(bands).fold(0.0, |a, &b| f64::max(a, b));
            largest = largest.max(own / reference);
        }
        self.error = self.error.max(MATRIX_ROUNDING * largest * self.inverse);
    }

    /// The bound on the inverse from the end of [`Solver::for_inverse_bound`]: `solution` before the last sweep.
    ///
    /// # Errors
    /// [`Error::Diverges`] where none was found; `row_sum` is what rows add up to.
    pub fn inverse(&self, solution: &[f64], row_sum: f64) -> Result<f64, Error> {
        let (low, high) = solution.iter().fold((0.0, 0.0), |(a, b), &v| (f64::min(a, v), f64::max(b, v)));
        // beyond, a sweep's increase of 1 drowns in rounding
        if self.error <= self.goal && low >= 0.0 && high < 1.0 / (1.0 - CLOSED_ROW_SUM) {
            Ok(high.max(1.0) / (1.0 - self.error.max(0.0)))
        } else {
            Err(Error::Diverges { row_sum })
        }
    }
}

/// The latest solutions, from which the next is extrapolated.
#[derive(Debug)]
pub struct History<'m> {
    /// Share that each row absorbs or lets out of a radiance of 1: the change that adding 1 everywhere makes up for.
    row_deficits: &'m [f64],
    solutions: &'m mut [f64],
    filled: usize,
}

impl<'m> History<'m> {
    /// `memory` has room for [`kept`] solutions of `size` values each, the first of which holds the deficits
    /// ([`crate::radiosity::System::row_deficits`]).
    pub fn new(memory: &'m mut [f64], size: usize) -> History<'m> {
        let (row_deficits, solutions) = memory.split_at_mut(size.min(memory.len()));
        History { row_deficits, solutions, filled: 0 }
    }

    /// Keeps `old`, or replaces `new`, which a plain sweep made of it, by what they all lead to in each of `bands`.
    /// `weight` of each value: the element's area over rho_d, so that sums are fluxes.
    pub fn push(&mut self, old: &[f64], new: &mut [f64], bands: usize, weight: impl Fn(usize) -> f64) {
        let size = old.len();
        if self.solutions.len() < HISTORY_SOLUTIONS * size {
            return;
        }
        if self.filled < HISTORY_SOLUTIONS {
            let slot = self.solutions.iter_mut().skip(self.filled * size).take(size);
            slot.zip(old).for_each(|(to, from)| *to = *from);
            self.filled += 1;
            return;
        }
        self.filled = 0;
        for band in 0..bands.min(MAX_BANDS) {
            self.extrapolate(old, new, bands, band, &weight);
        }
    }

    /// The combination of the solutions whose change is least, new - t_0 d_0 - t_1 d_1 - t_2 d_2 with the changes d_0
    /// (the latest) to d_3 and the least squares t of d_0 by the differences of neighbouring ones; and 1 everywhere so
    /// often that the flux of what is left of the change balances.
    ///
    /// What mirrors and walls absorb of a radiance of 1 is known to rounding, where the differences drown in that of the
    /// solutions: a room of reflectance 1 - 1e-9 is filled at once.
    fn extrapolate(
        &self,
        old: &[f64],
        new: &mut [f64],
        bands: usize,
        band: usize,
        weight: &impl Fn(usize) -> f64,
    ) {
        let size = old.len();
        let changes = |at: usize, new: f64| {
            let [a, b, c] = [0, 1, 2].map(|k| self.solutions.at(k * size + at));
            let x = old.at(at);
            [new - x, x - c, c - b, b - a]
        };
        let steps = |d: [f64; 4]| [d[0] - d[1], d[1] - d[2], d[2] - d[3]];
        let (mut gram, mut right) = ([[0.0; HISTORY_SOLUTIONS]; HISTORY_SOLUTIONS], [0.0; HISTORY_SOLUTIONS]);
        for (at, &value) in new.iter().enumerate().skip(band).step_by(bands.max(1)) {
            let d = changes(at, value);
            let columns = steps(d);
            for ((row, right), x) in gram.iter_mut().zip(&mut right).zip(columns) {
                row.iter_mut().zip(columns).for_each(|(m, y)| *m += x * y);
                *right += x * d[0];
            }
        }
        let theta = least_squares(gram, right);
        let product = |values: &[f64]| theta.iter().zip(values).map(|(t, x)| t * x).sum::<f64>();
        let (mut left, mut made_up) = (0.0, 0.0);
        for (at, &value) in new.iter().enumerate().skip(band).step_by(bands.max(1)) {
            let d = changes(at, value);
            let weight = weight(at);
            left += weight * (d[0] - product(&steps(d)));
            made_up += weight * self.row_deficits.at(at);
        }
        let level = if made_up > 0.0 { left / made_up } else { 0.0 };
        for (at, value) in new.iter_mut().enumerate().skip(band).step_by(bands.max(1)) {
            // radiances and their bound are not negative
            let next = (*value - product(&changes(at, *value)) + level).max(0.0);
            if fabs(next) < f64::INFINITY {
                *value = next;
            }
        }
    }
}

/// Solves the normal equations by elimination; what depends on those before, to rounding, is left out.
fn least_squares(
    mut gram: [[f64; HISTORY_SOLUTIONS]; HISTORY_SOLUTIONS],
    mut right: [f64; HISTORY_SOLUTIONS],
) -> [f64; HISTORY_SOLUTIONS] {
    /// A column that the others explain to 1e-5 of its length says nothing of its own.
    const DEPENDENT: f64 = 1e-10;
    let squares = [gram[0][0], gram[1][1], gram[2][2]];
    let mut used = [false; HISTORY_SOLUTIONS];
    for (k, (used, square)) in used.iter_mut().zip(squares).enumerate() {
        let row = gram.at(k);
        let (pivot, own) = (row.at(k), right.at(k));
        *used = pivot > DEPENDENT * square && pivot > 0.0;
        if !*used {
            continue;
        }
        for (lower, right) in gram.iter_mut().zip(&mut right).skip(k + 1) {
            let factor = lower.at(k) / pivot;
            lower.iter_mut().zip(row).for_each(|(x, y)| *x -= factor * y);
            *right -= factor * own;
        }
    }
    let mut theta = [0.0; HISTORY_SOLUTIONS];
    for k in (0..HISTORY_SOLUTIONS).rev().filter(|&k| used.at(k)) {
        let row = gram.at(k);
        let rest: f64 = row.iter().zip(theta).skip(k + 1).map(|(m, t)| m * t).sum();
        let value = (right.at(k) - rest) / row.at(k);
        if let Some(place) = theta.get_mut(k) {
            *place = if fabs(value) < f64::INFINITY { value } else { 0.0 };
        }
    }
    theta
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    /// Iterates x = G x + b to the end; the solution and the solver.
    fn solve(g: &[Vec<f64>], b: &[f64], mut solver: Solver) -> (Vec<f64>, Vec<f64>, Solver) {
        let n = b.len();
        let (mut x, mut next) = (b.to_vec(), b.to_vec());
        if solver.goal == 0.5 {
            x.fill(0.0);
        }
        let mut memory = std::vec![0.0; (HISTORY_SOLUTIONS + 1) * n];
        memory.iter_mut().zip(g).for_each(|(d, row)| *d = 1.0 - row.iter().sum::<f64>());
        let mut history = History::new(&mut memory, n);
        while solver.is_unfinished() {
            let relax = solver.relaxation();
            let mut change: f64 = 0.0;
            for (i, row) in g.iter().enumerate() {
                let new = b[i] + row.iter().zip(&x).map(|(g, x)| g * x).sum::<f64>();
                change = change.max(if solver.goal == 0.5 { new - x[i] } else { (new - x[i]).abs() });
                next[i] = relax * (new - next[i]) + next[i];
            }
            core::mem::swap(&mut x, &mut next);
            if solver.record_sweep(change) {
                history.push(&next, &mut x, 1, |_| 1.0);
            }
        }
        (x, next, solver)
    }

    /// A corridor of `n` cells, each of which sees itself and its neighbours.
    fn corridor(n: usize, rho: f64) -> Vec<Vec<f64>> {
        let near = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 0.5,
            1 => 0.25,
            _ => 0.0,
        };
        (0..n)
            .map(|i| {
                let mut row: Vec<f64> = (0..n).map(|j| near(i, j)).collect();
                let missing = 1.0 - row.iter().sum::<f64>();
                row[i] += missing;
                row.iter().map(|x| rho * x).collect()
            })
            .collect()
    }

    #[test]
    fn a_corridor_and_a_room_need_few_sweeps() {
        let budget = ErrorBudget::new(1e-3, 1e-3);
        for (n, q, most) in [(6, 0.999, 150), (6, 1.0 - 1e-9, 200), (60, 0.9, 100), (60, 0.999, 1000)] {
            let g = corridor(n, q);
            // what is at one end is not at the other: not the uniform solution of the first step
            let b: Vec<f64> = (0..n).map(|i| if i < n / 3 { 1.0 } else { 0.0 }).collect();
            let (x, _, solver) = solve(&g, &b, Solver::new(q, None, &budget, None, true));
            // energy: (1 - q) times the sum is what is sent out; rounding of 1 - q beside it
            let (sum, sent) = (x.iter().sum::<f64>() * (1.0 - q), b.iter().sum::<f64>());
            assert!((sum / sent - 1.0).abs() < 1e-6, "{n} cells, q {q}: {sum}, not {sent}");
            std::println!("{n} cells, q {q}: {} sweeps, bound {:.1e}", solver.done, solver.error);
            assert!(solver.done <= most, "{n} cells, q {q}: {} sweeps", solver.done);
            // the bound is one: residual of the result times the inverse
            let worst = (0..n).map(|i| {
                let new = b[i] + g[i].iter().zip(&x).map(|(g, x)| g * x).sum::<f64>();
                (new - x[i]).abs()
            });
            assert!(worst.fold(0.0, f64::max) <= solver.error * 1.01 + 1e-6 * x[0], "{n} cells, q {q}");
        }
    }

    #[test]
    fn a_white_room_with_a_window_is_bounded_and_one_without_is_not() {
        let mut g = corridor(20, 1.0);
        let closed = solve(&g, &[1.0; 20], Solver::for_inverse_bound());
        assert!(closed.2.inverse(&closed.1, 1.0).is_err());
        // the last cell loses a tenth: the inverse is that of a random walk, at most 20 + sum over 20 cells' way
        g[19][19] -= 0.1;
        let (_, solution, solver) = solve(&g, &[1.0; 20], Solver::for_inverse_bound());
        let inverse = solver.inverse(&solution, 1.0).unwrap();
        // exactly: v = G v + 1 by flux: the last cell has 20/0.1, each step back adds (cells behind)/0.25
        let exact = 200.0 + (1..20).map(|k| k as f64 / 0.25).sum::<f64>();
        assert!((exact * 0.999..2.5 * exact).contains(&inverse), "{inverse}, exactly {exact}");
    }
}
