//! The solution of the linear system: sweeps to the end, twice where elements' gradients add to the radiance that they
//! send; and its expected errors.

use super::light::{Lighting, SHARES, Scratch};
use super::{Executor, Largest};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy, pieces};
use crate::base::math::narrow;
use crate::coupling::element::Elements;
use crate::radiosity::System;
use crate::radiosity::accuracy::{self, Own};
use crate::radiosity::direct::{self, TableShape};
use crate::radiosity::limits;
use crate::radiosity::solution::{Numbers, Solution, SolutionMemory};
use crate::radiosity::solver::{History, Solver};
use crate::radiosity::straight::Straight;
use crate::radiosity::sun_image::{self, SPREAD, SunImages};
use crate::settings::Settings;
use core::ops::Range;

/// As [`Lighting::solve`].
pub(super) fn solve<'m, X: Executor>(
    of: &Lighting<'_>,
    memory: SolutionMemory<'m>,
    scratch: &mut Scratch<'_>,
    sun_rays: u64,
    run: &mut X,
) -> Result<Solution<'m>, X::Error> {
    let Lighting { scene, elements, coupling, light, settings, .. } = *of;
    let SolutionMemory {
        reference,
        irradiance,
        straight,
        straight_variance,
        sun,
        slots,
        reflected_irradiance,
        variance,
    } = memory;
    let (sun, images) = (&*sun, SunImages { slots, reflected_irradiance });
    let shape = crate::settings::shape(settings.max_bounces, scene.bands());
    let size = elements.unknowns() * shape.bands;
    let seen = Straight { values: straight, variance: straight_variance };
    let system = System { scene, elements, coupling, light, direct: &[], sun, straight: seen, shape };
    let (mut before, mut bounds) = (0, None);
    if shape.levels == 1 {
        let tables = [&mut *reference, &mut *irradiance];
        before = first_pass(&system, settings, scratch, tables, &mut bounds, run)?;
    }
    let Scratch { direct, orders, own, carried, spread, dark, .. } = scratch;
    let last = Solve { system: System { direct, ..system }, settings, reference: &*reference };
    let sweeps = last.run(orders, irradiance, &mut bounds, run)?;
    if shape.levels > 1 {
        system.lit_radiance(*dark, irradiance, reference);
    }
    let reference = &*reference;
    let radiance = last_radiance(orders, shape, size)?;
    images.take_off(shape, |unknown| elements.facet_side(unknown), irradiance);
    system.fill_absent_rows(irradiance);
    errors(&system, radiance, reference, (own, carried), variance, run)?;
    add_lamps(&system, reference, *dark, variance);
    add_images(elements, &images, spread, variance);
    let numbers = Numbers {
        reflected: seen.reflected(shape.stride(), reference, irradiance),
        brightest: limits::brightest(scene, light, reference, radiance),
        solver: sweeps.map_or(0.0, |s| s.error),
        sweeps: sweeps.map_or(shape.levels as u64, |s| u64::from(before + s.done)),
        sun_rays,
    };
    fill_absent_straight(of, sun, straight, straight_variance);
    Ok(Solution {
        shape,
        reference,
        irradiance,
        straight: Straight { values: straight, variance: straight_variance },
        sun,
        images,
        variance,
        numbers,
    })
}

/// Radiances of the unknowns, `size` values, as the last sweep left them; all orders together where they are counted.
///
/// # Errors
/// Radiances above 1e37.
fn last_radiance(orders: &[f64], shape: TableShape, size: usize) -> Result<&[f64], Error> {
    let at = if shape.levels == 1 { 0 } else { shape.levels };
    let radiance = orders.part(at * size..(at + 1) * size);
    limits::check_radiance(radiance, shape.bands)?;
    Ok(radiance)
}

/// Fills the straight sky of unknowns that have none of their own.
fn fill_absent_straight(of: &Lighting<'_>, sun: &[f64], values: &mut [f64], variance: &mut [f32]) {
    let Lighting { scene, elements, coupling, light, settings, .. } = *of;
    let shape = crate::settings::shape(settings.max_bounces, scene.bands());
    let straight = Straight::default();
    System { scene, elements, coupling, light, direct: &[], sun, straight, shape }
        .fill_absent_straight(values, variance);
}

/// The first of two passes, where reflections are not counted: solves without what elements send by their gradients, and adds that
/// to the direct light. Writes the reference radiance of the bands that lamps alone light, and keeps the radiances. Returns the
/// number of sweeps. `system` is without its direct light.
fn first_pass<X: Executor>(
    system: &System<'_>,
    settings: &Settings,
    scratch: &mut Scratch<'_>,
    [reference, irradiance]: [&mut [f64]; 2],
    bounds: &mut Option<Bounds>,
    run: &mut X,
) -> Result<u32, X::Error> {
    let Scratch { direct, orders, dark, first: kept, .. } = scratch;
    let shape = system.shape;
    let size = system.elements.unknowns() * shape.bands;
    let first = Solve { system: System { direct, ..*system }, settings, reference: &*reference };
    let sweeps = first.run(orders, irradiance, bounds, run)?.map_or(0, |s| s.done);
    copy(kept, orders.part(0..size));
    system.lit_radiance(*dark, irradiance, reference);
    let missed = orders.part_mut(size..2 * size);
    run.rows(missed, shape.bands, 0.0, |range, out| {
        system.gradient_source(range, irradiance, out);
        Ok(())
    })?;
    direct::add(missed, shape, direct);
    Ok(sweeps)
}

/// Adds to the expected squared errors those of the images of the sun.
fn add_images(elements: &Elements<'_>, images: &SunImages<'_>, spread: &mut [f32], variance: &mut [f32]) {
    for (unknown, (variance, spread)) in variance.iter_mut().zip(pieces(spread, SPREAD)).enumerate() {
        let known = images.are_known(elements.facet_side(unknown));
        *variance += narrow(sun_image::variance(spread, known));
    }
}

/// Adds to the expected squared errors that no ray of a row may have met a lamp: in those of the bands `dark`, as bits, in
/// which lamps are brighter than the reference radiance.
fn add_lamps(system: &System<'_>, reference: &[f64], dark: u64, variance: &mut [f32]) {
    let bands = (0..system.shape.bands).filter(|band| dark >> band & 1 == 1 && reference.at(*band) > 0.0);
    let glare = bands
        .map(|band| system.light.largest_emission(system.scene, band) / reference.at(band))
        .fold(0.0, f64::max);
    if glare <= 1.0 {
        return;
    }
    for ((_, row), variance) in system.coupling.rows(0..variance.len()).zip(variance.iter_mut()) {
        let unseen = accuracy::ROW_UNSEEN_RAYS * glare / f64::from(row.row.rays.max(1));
        *variance += if row.row.rays > 0 { narrow(unseen * unseen) } else { 0.0 };
    }
}

/// Expected squared error of each unknown; `own` and `carried` hold one and two values of each and of each band.
fn errors<X: Executor>(
    system: &System<'_>,
    radiance: &[f64],
    reference: &[f64],
    (own, carried): (&mut [Own], &mut [f32]),
    out: &mut [f32],
    run: &mut X,
) -> Result<(), X::Error> {
    let bands = system.shape.bands;
    let (mut carried, mut next) = carried.split_at_mut(own.len().min(carried.len()));
    run.rows(own, bands, 0.0, |range, out| accuracy::differences(system, radiance, reference, range, out))?;
    let own = &*own;
    for number in 0..accuracy::carried(system.scene) {
        let from = if number > 0 { &*carried } else { &[] };
        run.rows(next, bands, 0.0, |range, out| accuracy::propagate(system, own, from, range, out))?;
        core::mem::swap(&mut carried, &mut next);
    }
    run.rows(out, 1, 0.0, |range, out| accuracy::rows(system, own, carried, range, out))
}

/// Bounds on the error of a sweep, for any light.
#[derive(Clone, Copy)]
struct Bounds {
    /// The contraction of a sweep.
    q: f64,
    /// The bound on the inverse, where the contraction gives none.
    inverse: Option<f64>,
}

/// The linear system at work.
struct Solve<'a> {
    system: System<'a>,
    settings: &'a Settings,
    reference: &'a [f64],
}

impl Solve<'_> {
    /// Fills the table of irradiances, the second time from the radiances before, which stand first of all `orders` (last
    /// where orders of reflection are kept apart). Returns how the sweeps went; none of orders kept apart.
    fn run<X: Executor>(
        &self,
        orders: &mut [f64],
        irradiance: &mut [f64],
        bounds: &mut Option<Bounds>,
        run: &mut X,
    ) -> Result<Option<Solver>, X::Error> {
        let shape = self.system.shape;
        let size = self.system.elements.unknowns() * shape.bands;
        if shape.levels > 1 {
            self.orders(orders, size, irradiance, run)?;
            return Ok(None);
        }
        let (from, rest) = split(orders, size);
        let (to, history) = split(rest, size);
        let sweeps = self.converge([&mut *from, to], history, bounds, run)?;
        let radiance = &*from;
        run.rows(irradiance, shape.stride(), SHARES[3], |range, out| {
            self.system.gather(range, 0, |_| radiance, out)
        })?;
        Ok(Some(sweeps))
    }

    /// The radiances before any reflection.
    fn start<X: Executor>(&self, radiance: &mut [f64], run: &mut X) -> Result<(), X::Error> {
        run.rows(radiance, self.system.shape.bands, 0.0, |range, out| {
            self.system.start(range, out);
            Ok(())
        })
    }

    /// Sweeps until the solution, which then stands in the first of both, is good enough.
    fn converge<X: Executor>(
        &self,
        [from, to]: [&mut [f64]; 2],
        history: &mut [f64],
        bounds: &mut Option<Bounds>,
        run: &mut X,
    ) -> Result<Solver, X::Error> {
        let Settings { budget, max_bounces, .. } = *self.settings;
        let (known, mut before) = (bounds.is_some(), 0);
        let Bounds { q, inverse } = match bounds {
            Some(bounds) => *bounds,
            None => {
                let (found, sweeps) = self.bounds([&mut *from, &mut *to], history, run)?;
                before = sweeps;
                *bounds.insert(found)
            }
        };
        // a sweep from a solution adds a reflection to all that it has
        if !known || max_bounces.is_some() {
            self.start(from, run)?;
        }
        let mut solver = Solver::new(q, inverse, &budget, max_bounces, !history.is_empty());
        let ends =
            self.iterate(&mut solver, [&mut *from, &mut *to], history, run, |range, from, to, relax| {
                self.system.relaxed_sweep(range, from, to, self.reference, relax)
            })?;
        solver.finish(ends[0], self.reference, max_bounces);
        if solver.done % 2 == 1 {
            from.iter_mut().zip(to).for_each(|(from, to)| *from = *to);
        }
        solver.done += before;
        Ok(solver)
    }

    /// The bounds, and the sweeps that finding them took.
    fn bounds<X: Executor>(
        &self,
        [from, to]: [&mut [f64]; 2],
        history: &mut [f64],
        run: &mut X,
    ) -> Result<(Bounds, u32), X::Error> {
        let bands = self.system.shape.bands;
        let Largest(q) =
            run.rows(to, bands, SHARES[2], |range, _| Ok(Largest(self.system.contraction(range))))?;
        let row_deficits = from.len().min(history.len());
        run.rows(history.head_mut(row_deficits), bands, 0.0, |range, out| {
            self.system.row_deficits(range, out);
            Ok(())
        })?;
        if !Solver::is_closed(q, self.settings.max_bounces) {
            return Ok((Bounds { q, inverse: None }, 0));
        }
        from.fill(0.0);
        let mut unit = Solver::for_inverse_bound();
        let ends = self.iterate(&mut unit, [from, to], history, run, |range, from, to, relax| {
            self.system.unit_sweep(range, from, to, relax)
        })?;
        Ok((Bounds { q, inverse: Some(unit.inverse(ends[1], q)?) }, unit.done))
    }

    /// Iterates to the end: the latest solution, and the one before.
    fn iterate<'o, X: Executor>(
        &self,
        solver: &mut Solver,
        [mut latest, mut next]: [&'o mut [f64]; 2],
        history: &mut [f64],
        run: &mut X,
        sweep: impl Fn(Range<usize>, &[f64], &mut [f64], f64) -> f64 + Sync,
    ) -> Result<[&'o [f64]; 2], X::Error> {
        let bands = self.system.shape.bands;
        let mut history = History::new(history, latest.len());
        while solver.is_unfinished() {
            let (seen, relaxation) = (&*latest, solver.relaxation());
            let Largest(change) =
                run.rows(next, bands, 0.0, |range, out| Ok(Largest(sweep(range, seen, out, relaxation))))?;
            core::mem::swap(&mut latest, &mut next);
            if solver.record_sweep(change) {
                history.push(next, latest, bands, |at| self.system.weight(at));
            }
        }
        Ok([latest, next])
    }

    /// Each order of reflection from those before it.
    fn orders<X: Executor>(
        &self,
        orders: &mut [f64],
        size: usize,
        irradiance: &mut [f64],
        run: &mut X,
    ) -> Result<(), X::Error> {
        let shape = self.system.shape;
        let share = (SHARES[2] + SHARES[3]) / shape.levels as f64;
        self.start(orders.head_mut(size), run)?;
        for level in 0..shape.levels {
            let (done, rest) = split(orders, size * (level + 1));
            let order = |at: usize| done.part(at * size..(at + 1) * size);
            run.rows(irradiance, shape.stride(), share, |range, out| {
                self.system.gather(range, level, order, out)
            })?;
            let table = &*irradiance;
            run.rows(rest.head_mut(size), shape.bands, 0.0, |range, out| {
                self.system.reflect(range, level, table, out);
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// As `split_at_mut`, without a way to panic.
fn split<T>(values: &mut [T], at: usize) -> (&mut [T], &mut [T]) {
    values.split_at_mut(at.min(values.len()))
}
