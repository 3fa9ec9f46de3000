//! Integrals over [0, 1] of what changes in jumps: intervals are halved where their ends differ, so that a jump costs
//! a ray for each bit of its place.
//!
//! Values are vectors of three terms of `bands` each; how far two of them are apart is the largest difference of the
//! bands' sums, relative to the reference radiance.
//!
//! Constants of this file are measured by `cargo test -p blik-kernel --lib line_integral` (errors and rays).

use crate::base::index::{Index, IndexMut, copy};
use crate::base::math::fabs;

/// Error of the trapezoid rule over an interval of width 1 in which the value jumps by 1 at an unknown place: the
/// standard deviation of a uniform distribution.
const JUMP: f64 = 0.29;

/// Number of values that an integral holds at a time: the left end of what is left to do, and the right ends of halves.
const SLOTS: usize = 20;

/// Numbers beside the values of a place: the place, its value's squared error, the error of the interval to its left.
const PLACE_NOTES: usize = 3;

/// Memory of one integral of vectors of `stride` values.
pub(super) const fn memory(stride: usize) -> usize {
    SLOTS * (stride + PLACE_NOTES)
}

/// How values are compared.
#[derive(Clone, Copy)]
pub(super) struct Measure<'a> {
    pub bands: usize,
    pub reference: &'a [f64],
}

impl Measure<'_> {
    /// Values of a vector.
    pub(super) fn stride(&self) -> usize {
        3 * self.bands
    }

    /// Largest absolute value of all bands, relative to the reference.
    fn largest(&self, of: impl Fn(usize) -> f64) -> f64 {
        let mut largest: f64 = 0.0;
        for band in 0..self.bands {
            let d = fabs(of(band));
            if d > 0.0 {
                largest = largest.max(d / self.reference.at(band));
            }
        }
        largest
    }

    /// The three terms in one band.
    fn sum(&self, v: &[f64], band: usize) -> f64 {
        v.at(band) + v.at(self.bands + band) + v.at(2 * self.bands + band)
    }

    /// How far two vectors are apart.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    pub(super) fn step(&self, a: &[f64], b: &[f64]) -> f64 {
        self.largest(|band| self.sum(a, band) - self.sum(b, band))
    }

    /// How far `m` is from the mean of `a` and `b`.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    pub(super) fn bend(&self, a: &[f64], m: &[f64], b: &[f64]) -> f64 {
        self.largest(|band| self.sum(m, band) - 0.5 * (self.sum(a, band) + self.sum(b, band)))
    }
}

/// How finely an integral is done.
#[derive(Clone, Copy)]
pub(super) struct Fineness {
    /// Equal intervals to begin with.
    pub parts: usize,
    /// Shift of the places between them.
    pub shift: f64,
    /// Error wanted of an interval.
    pub goal: f64,
    /// Narrower intervals are not halved.
    pub narrowest: f64,
}

impl Fineness {
    /// One of the first places, from 0 to 1: the ends of equal parts, those within the unit interval shifted.
    fn place(&self, number: usize) -> f64 {
        match number {
            0 => 0.0,
            number if number >= self.parts => 1.0,
            number => number as f64 / self.parts as f64 + self.shift,
        }
    }
}

/// The integral over [0, 1], written to `out`, and its expected squared error.
///
/// `value` fills in the vector at a place and returns its squared error; `None` ends it all. An interval counts by the
/// trapezoid rule once its ends, or its middle and its ends' mean, differ so little that the jump which that would
/// be brings no more than the goal.
#[inline(never)]
pub(super) fn integrate(
    measure: &Measure<'_>,
    fineness: &Fineness,
    memory: &mut [f64],
    out: &mut [f64],
    value: &mut dyn FnMut(f64, &mut [f64]) -> Option<f64>,
) -> Option<f64> {
    let stride = measure.stride();
    out.fill(0.0);
    let mut error2 = 0.0;
    put(memory, (stride, 0), fineness.place(0), value)?;
    for number in 1..=fineness.parts {
        put(memory, (stride, 1), fineness.place(number), value)?;
        let mut top = 1;
        while top > 0 {
            match add_interval(measure, fineness, memory, top, out) {
                Some(square) => {
                    error2 += square;
                    top -= 1;
                }
                None => {
                    let middle = 0.5 * (note(memory, (stride, 0), 0) + note(memory, (stride, top), 0));
                    put(memory, (stride, top + 1), middle, value)?;
                    check_bend(measure, fineness, memory, top);
                    top += 1;
                }
            }
        }
    }
    Some(error2)
}

/// A note on a slot's place: 0: the place; 1: its value's squared error; 2: the error of the interval to its left, where that
/// is known, else negative.
fn note(memory: &[f64], (stride, slot): (usize, usize), number: usize) -> f64 {
    memory.at(slot * (stride + PLACE_NOTES) + stride + number)
}

/// Adds the interval from the left end to the slot `top`, which becomes the left end, and returns its expected squared error;
/// `None` where it is to be halved.
// apart on small machines, as is the next: does not burden the stack of the values
#[cfg_attr(target_pointer_width = "32", inline(never))]
fn add_interval(
    measure: &Measure<'_>,
    fineness: &Fineness,
    memory: &mut [f64],
    top: usize,
    out: &mut [f64],
) -> Option<f64> {
    let stride = measure.stride();
    let size = stride + PLACE_NOTES;
    let known = note(memory, (stride, top), 2);
    let width = note(memory, (stride, top), 0) - note(memory, (stride, 0), 0);
    let (left, right) = (memory.part(0..stride), memory.part(top * size..top * size + stride));
    let error = if known >= 0.0 { known } else { JUMP * width * measure.step(left, right) };
    let is_fine = known >= 0.0 || error <= fineness.goal || width <= fineness.narrowest || top + 1 >= SLOTS;
    if !is_fine {
        return None;
    }
    add(out, left, right, 0.5 * width);
    let ends = note(memory, (stride, 0), 1) + note(memory, (stride, top), 1);
    let (first, rest) = memory.split_at_mut_checked(size).unwrap_or_default();
    copy(first, rest.part((top - 1) * size..top * size));
    Some(error * error + 0.5 * width * width * ends)
}

/// Notes the error of both halves of an interval whose middle stands above `top`, where that is near enough to its ends' mean.
#[cfg_attr(target_pointer_width = "32", inline(never))]
fn check_bend(measure: &Measure<'_>, fineness: &Fineness, memory: &mut [f64], top: usize) {
    let stride = measure.stride();
    let size = stride + PLACE_NOTES;
    let vector = |slot: usize| memory.part(slot * size..slot * size + stride);
    let width = note(memory, (stride, top), 0) - note(memory, (stride, 0), 0);
    let error = JUMP * width * measure.bend(vector(0), vector(top + 1), vector(top));
    if error <= fineness.goal {
        memory.set((top + 1) * size + stride + 2, error);
        memory.set(top * size + stride + 2, 0.0);
    }
}

/// Fills in the values at a place and its notes.
#[cfg_attr(target_pointer_width = "32", inline(never))]
fn put(
    memory: &mut [f64],
    (stride, slot): (usize, usize),
    x: f64,
    value: &mut dyn FnMut(f64, &mut [f64]) -> Option<f64>,
) -> Option<()> {
    let size = stride + PLACE_NOTES;
    let node = memory.part_mut(slot * size..(slot + 1) * size);
    let square = value(x, node.head_mut(stride))?;
    copy(node.part_mut(stride..stride + PLACE_NOTES), &[x, square, -1.0]);
    Some(())
}

/// Adds `weight` times the sums of two vectors.
#[cfg_attr(target_pointer_width = "32", inline(never))]
fn add(out: &mut [f64], left: &[f64], right: &[f64], weight: f64) {
    out.iter_mut().zip(left).zip(right).for_each(|((o, l), r)| *o += weight * (l + r));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of `f`, its estimated error, and the values that it took.
    fn integral(goal: f64, f: impl Fn(f64) -> f64) -> (f64, f64, u32) {
        let measure = Measure { bands: 1, reference: &[2.0] };
        let fineness = Fineness { parts: 4, shift: 0.05, goal, narrowest: 1e-4 };
        let (mut work, mut out, mut count) = ([0.0; memory(3)], [0.0; 3], 0);
        let square = integrate(&measure, &fineness, &mut work, &mut out, &mut |x, slot| {
            count += 1;
            slot.copy_from_slice(&[0.5 * f(x), 0.5 * f(x), 0.0]);
            Some(0.0)
        });
        assert!((out[0] - out[1]).abs() < 1e-15 && out[2] == 0.0);
        (out[0] + out[1], 2.0 * square.unwrap().sqrt(), count)
    }

    #[test]
    fn a_jump_costs_a_ray_for_each_bit_of_its_place() {
        for place in [0.01, 0.3, 0.4242, 0.61, 0.99] {
            let (sum, error, count) = integral(1e-4, |x| if x < place { 3.0 } else { 1.0 });
            // an interval of width w about the jump of 2 is wrong by w at most; the goal is 0.29 w
            assert!(
                (sum - (1.0 + 2.0 * place)).abs() < 1e-4 / 0.29 && error < 2e-4,
                "{place}: {sum} {error}"
            );
            assert!(count <= 5 + 10, "{place}: {count} rays");
        }
    }

    #[test]
    fn straight_lines_are_exact_and_smooth_curves_nearly() {
        let (sum, error, count) = integral(1e-3, |x| 1.0 + 4.0 * x);
        // rounding
        assert!((sum - 3.0).abs() < 1e-14 && count <= 9, "{sum} {error} {count}");
        let (sum, error, _) = integral(1e-4, |x| x * x);
        // of 0.29 w |bend|, w the width, a parabola's trapezoids are wrong by 1.15 w |bend|
        assert!((sum - 1.0 / 3.0).abs() < 4.0 * error.max(1e-5), "{sum} {error}");
    }

    #[test]
    fn a_value_that_is_refused_ends_it() {
        let measure = Measure { bands: 1, reference: &[1.0] };
        let fineness = Fineness { parts: 1, shift: 0.0, goal: 1e-3, narrowest: 1e-3 };
        let (mut work, mut out) = ([0.0; memory(3)], [0.0; 3]);
        assert!(integrate(&measure, &fineness, &mut work, &mut out, &mut |_, _| None).is_none());
    }
}
