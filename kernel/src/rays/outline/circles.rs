//! Overlap of counted facets along great circles through the pole: the difference of their sum from the blocked share.
//!
//! Each circle is crossed by outlines on either side of the pole; between crossings the number of facets stays, and that of
//! counted ones. Eight circles are a set; later sets lie between those before.
//!
//! Constants of this file are measured by `cargo test --test outlines` (errors beside estimates) and `cargo run --release
//! --example calibrate` (errors of images).

use super::Basis;
use super::candidates::{Active, Crossing, Frame, Over};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{PI, cos, pow, sin, sqrt};
use crate::base::qmc::hash2;
use crate::base::simd::{Isa, Lanes64, WIDTH, Wide, WideTask, run_wide};
use crate::base::sort::sort;

/// Number of half circles of a set.
const HALVES: usize = 2 * WIDTH;

/// Number of parts of the half circles; the differences between them tell the error.
const CIRCLE_SETS: usize = 4;

/// Error of the mean of the parts over that of independent ones: they fill one another's gaps.
const CIRCLE_SETS_CORRELATION: f64 = 0.6;

/// Least relative error of the overlap that one set of circles finds, of outlines that cross at random.
const CIRCLES_ERROR_LEAST: f64 = 0.1;

/// Power of the number of sets with which that error falls.
const CIRCLES_ERROR_POWER: f64 = 1.7;

/// Error of one set where half circles meet more than [`SIMPLE_OUTLINES_MOST`] outlines, or outlines of several bodies, and
/// none covers another: an overlap may lie between circles. It falls with the square of the number of sets.
const MISSED_OVERLAP: f64 = 4e-3;

/// Most outlines on a half circle for which no overlap can lie between circles.
const SIMPLE_OUTLINES_MOST: usize = 2;

/// Most sets of half circles at one point.
const SETS_MOST: u32 = 16;

/// Overlap of outlines, by half circles.
pub(super) struct Found {
    /// The mean over all directions of counted facets less one where anything is, each part of a basis over pi; or of what
    /// is open.
    pub values: [f64; 4],
    /// Which of both: the one of less error.
    pub is_open: bool,
    /// Expected error of the first value.
    pub error: f64,
}

/// Sums over half circles, of both that [`Found`] tells of.
type Sums = [[f64; 4]; 2];

/// Largest difference of the two independent answers (open shares and heights), beyond their errors, at which both are
/// trusted. Above it one of them is wrong, and rays decide.
///
/// It is far above what circles leave: stairs and nested boxes under an overcast sky have some such points in a
/// thousand.
const ANSWERS_DIFFERENCE_MOST: f64 = 0.02;

/// Looks along as many circles as it takes for an error of `goal`. `None` where more crossings are met than there is room
/// for, or where what is open along circles contradicts the contours, `contour` without what covers them. `one`: all
/// outlines are of one body.
pub(super) fn look(
    isa: Isa,
    (frame, basis): (&Frame, Basis),
    (active, one, contour): (&[Active], bool, [f64; 4]),
    over: &Over,
    goal: f64,
    (crossings, sorted): (&mut [Crossing], &mut [Crossing]),
) -> Option<Found> {
    // by where the point is, so that circles of neighbours lie apart
    let [x, y, z] = frame.point.to_array().map(|x| (x * 65536.0) as i32 as u32);
    let start = f64::from(hash2(x, hash2(y, z))) / 4_294_967_296.0;
    let (mut sums, mut parts) = ([[0.0; 4]; 2], [[0.0; CIRCLE_SETS]; 2]);
    let (mut set, mut sets, mut most) = (0u32, 1u32, 0);
    loop {
        while set < sets {
            // sets in the order that halves the gaps
            let turn = start + f64::from(set.reverse_bits()) / 4_294_967_296.0;
            let angles: [f64; WIDTH] = core::array::from_fn(|k| PI * (k as f64 + turn) / WIDTH as f64);
            let circles = (angles.map(cos), angles.map(sin));
            let count = run_wide(isa, Cross { circles: &circles, active, crossings: &mut *crossings })?;
            let (own, met) = walk(frame, basis, &circles, over, crossings.head(count), sorted);
            most = most.max(met);
            for (half, terms) in own.iter().enumerate() {
                sums.iter_mut().flatten().zip(terms.iter().flatten()).for_each(|(sum, term)| *sum += term);
                let part = part_of(half, set, sets);
                for (sums, term) in parts.iter_mut().zip(terms) {
                    let sum = sums.at(part) + term[0];
                    sums.set(part, sum);
                }
            }
            set += 1;
        }
        let lines = f64::from(sets) * HALVES as f64;
        let means = sums.map(|sums| sums[0] / lines);
        // lines that agree by chance do not end it
        let amounts = [means[0].abs(), means[1].min(1.0 - means[1])];
        let missed =
            if most > SIMPLE_OUTLINES_MOST || !one { MISSED_OVERLAP / f64::from(sets * sets) } else { 0.0 };
        let least = |k: usize| {
            (CIRCLES_ERROR_LEAST * amounts.at(k) * pow(f64::from(sets), -CIRCLES_ERROR_POWER)).max(missed)
        };
        let error = |k: usize| spread(&parts[k], lines).max(least(k));
        let errors = [error(0), error(1)];
        let is_open = errors[1] < errors[0];
        let error = errors[usize::from(is_open)];
        let most = ANSWERS_DIFFERENCE_MOST + 4.0 * (errors[0] + errors[1]);
        let sign = if frame.above { 1.0 } else { -1.0 };
        let apart = |k: usize, sign: f64| (contour[k] + sign * (sums[0][k] - sums[1][k]) / lines).abs();
        if [apart(0, 1.0), apart(1, sign), apart(2, 1.0), apart(3, sign)].iter().any(|apart| *apart > most) {
            return None;
        }
        if error <= goal || sets >= SETS_MOST {
            let [whole, high, near, near_high] = sums[usize::from(is_open)].map(|sum| sum / lines);
            return Some(Found { values: [whole, sign * high, near, sign * near_high], is_open, error });
        }
        parts.iter_mut().for_each(|parts| *parts = gathered(parts, sets));
        sets *= 2;
    }
}

/// The part of the half circles to which one of set number `set` belongs, of `sets` sets.
fn part_of(half: usize, set: u32, sets: u32) -> usize {
    match sets {
        1 => half % CIRCLE_SETS,
        2 => half % 2 + 2 * (set as usize),
        _ => set as usize * CIRCLE_SETS / sets as usize,
    }
}

/// Expected error of the mean of `lines` lines, from the differences between the sums of its parts, which are spread
/// alike.
fn spread(parts: &[f64; CIRCLE_SETS], lines: f64) -> f64 {
    let mean = parts.iter().sum::<f64>() / CIRCLE_SETS as f64;
    let square =
        parts.iter().map(|p| (p - mean) * (p - mean)).sum::<f64>() / (CIRCLE_SETS * (CIRCLE_SETS - 1)) as f64;
    CIRCLE_SETS_CORRELATION * sqrt(square) * CIRCLE_SETS as f64 / lines
}

/// The sums of the parts of twice as many lines, as far as they are done.
fn gathered(&[a, b, c, d]: &[f64; CIRCLE_SETS], sets: u32) -> [f64; CIRCLE_SETS] {
    // of one set every other half circle goes on as a part
    if sets == 1 { [a + c, b + d, 0.0, 0.0] } else { [a + b, c + d, 0.0, 0.0] }
}

/// Finds where the circles cross outlines.
struct Cross<'a> {
    circles: &'a ([f64; WIDTH], [f64; WIDTH]),
    active: &'a [Active],
    crossings: &'a mut [Crossing],
}

impl WideTask for Cross<'_> {
    type Out = Option<usize>;

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> Option<usize> {
        let Cross { circles: (c, s), active, crossings } = self;
        let (wc, ws, zero) = (lanes.of(c), lanes.of(s), lanes.all(0.0));
        let mut count = 0;
        for block in active {
            let [axs, ays, azs, bxs, bys, bzs, jumps, counts] = block;
            for (lane, (&jump, &counted)) in jumps.iter().zip(counts).enumerate() {
                let [ax, ay, az] = [axs[lane], ays[lane], azs[lane]];
                let [bx, by, bz] = [bxs[lane], bys[lane], bzs[lane]];
                // which side of each circle's plane the ends are on: the same for all edges that end there
                let wa = lanes.all(ay) * wc - lanes.all(ax) * ws;
                let wb = lanes.all(by) * wc - lanes.all(bx) * ws;
                let (left, right) = (L::F::bits(wa.gt(zero)), L::F::bits(wb.gt(zero)));
                let mut met = left ^ right;
                if met == 0 {
                    continue;
                }
                let (wa, wb) = (wa.abs().array(), wb.abs().array());
                let counter = ax * by - ay * bx > 0.0;
                let sign = if counter { 1.0 } else { -1.0 };
                while met != 0 {
                    let k = met.trailing_zeros() as usize % WIDTH;
                    met &= met - 1;
                    let z = az * wb[k] + bz * wa[k];
                    if z <= 0.0 {
                        continue;
                    }
                    let r = (ax * c[k] + ay * s[k]) * wb[k] + (bx * c[k] + by * s[k]) * wa[k];
                    let ahead = (left >> k & 1 == 1) != counter;
                    let half = if ahead { k } else { k + WIDTH };
                    let at = r * r / (r * r + z * z);
                    *crossings.get_mut(count)? = [at, sign * jump, sign * counted, half as f64];
                    count += 1;
                }
            }
        }
        Some(count)
    }
}

/// Sums along each half circle, and the most outlines that one meets.
fn walk(
    frame: &Frame,
    basis: Basis,
    (cosines, _): &([f64; WIDTH], [f64; WIDTH]),
    over: &Over,
    crossings: &[Crossing],
    sorted: &mut [Crossing],
) -> ([Sums; HALVES], usize) {
    let half = |crossing: &Crossing| crossing[3] as usize % HALVES;
    let mut starts = [0; HALVES + 1];
    for crossing in crossings {
        starts[half(crossing) + 1] += 1;
    }
    for k in 0..HALVES {
        starts[k + 1] += starts[k];
    }
    let mut next = starts;
    for crossing in crossings {
        let place = &mut next[half(crossing)];
        sorted.set(*place, *crossing);
        *place += 1;
    }
    let most = starts.windows(2).map(|w| w.at(1) - w.at(0)).max().unwrap_or(0);
    let sums = core::array::from_fn(|k| {
        let own = sorted.part_mut(starts[k]..starts[k + 1]);
        sort(own, &|a, b| a[0].total_cmp(&b[0]));
        let cosine = if k < WIDTH { cosines[k] } else { -cosines.at(k - WIDTH) };
        along(frame, basis, cosine, over, own)
    });
    (sums, most)
}

/// The sums along one half circle, whose azimuth has this cosine.
fn along(frame: &Frame, basis: Basis, cosine: f64, over: &Over, crossings: &[Crossing]) -> Sums {
    let (mut all, mut counted) = (f64::from(over.all), f64::from(over.counted));
    let (mut sums, mut from) = ([[0.0; 4]; 2], 0.0);
    let mut add = |all: f64, counted: f64, from: f64, to: f64| {
        let weights = [counted - if all == 0.0 { 0.0 } else { 1.0 }, if all == 0.0 { 1.0 } else { 0.0 }];
        if to > from && weights != [0.0; 2] {
            let terms = stretch(frame, basis, cosine, from, to);
            for (sums, weight) in sums.iter_mut().zip(weights) {
                sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * term);
            }
        }
    };
    for &[at, jump, count, _] in crossings {
        add(all, counted, from, at);
        from = at;
        all += jump;
        counted += count;
    }
    add(all, counted, from, 1.0);
    sums
}

/// Integral between two crossings of a half circle, each part of a basis.
#[inline]
fn stretch(frame: &Frame, basis: Basis, cosine: f64, from: f64, to: f64) -> [f64; 4] {
    if basis == Basis::Whole {
        return [to - from, 0.0, 0.0, 0.0];
    }
    let (x, z) = frame.zenith;
    let tilt = x * cosine;
    // where the near side of the horizon ends
    let most = if tilt >= 0.0 { 1.0 } else { z * z / (z * z + tilt * tilt) };
    let high = |q: f64| {
        let c = sqrt((1.0 - q).max(0.0));
        (z * (1.0 - c * c * c) + tilt * q * sqrt(q)) * (2.0 / 3.0)
    };
    let (near, far) = (from.min(most), to.min(most));
    [to - from, high(to) - high(from), far - near, high(far) - high(near)]
}
