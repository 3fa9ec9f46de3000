//! The straight sky of elements, by outlines, without rays. It is exact where no facet before the sky hides another.
//!
//! Each element is evaluated at the middles of its four quarters; where a linear function over it leaves out more than
//! is wanted, as an edge of a shadow crosses it, at those of their quarters.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors) and `cargo test --test
//! outlines` (outlines against rays).

use crate::base::budget::ErrorBudget;
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy, pieces, span};
use crate::base::math::{PI, Vec3, clamp, fabs, narrow, pow};
use crate::base::quarter::{self, QUARTERS};
use crate::base::simd::{self, Isa, LaneTask, Lanes};
use crate::coupling::element::Elements;
use crate::coupling::{ABSENT, Coupling, ENCLOSED, Row, RowView, TRACED};
use crate::radiosity::accuracy;
use crate::rays::bvh::Bvh;
use crate::rays::outline::{Basis, Candidates, OpenSky};
use crate::scene::sky::Sky;
use crate::scene::{MAX_BANDS, Scene};
use core::ops::Range;

/// Mean square departure from a linear function over what four points show of it, three of which the function meets: twice
/// the square of that of the middle from the corners, as for what rows see.
const FEW_POINTS: f64 = 8.0 / 3.0;

/// Mean square departure from a linear function that four points may not show, over the mean square of the function's own
/// slope: a shadow's edge along a narrow facet had a twelfth of it, where the points showed a hundredth of that.
const UNSEEN_SLOPE: f64 = 0.1;

/// Depth of the smallest quarters that are evaluated. Where irradiances are asked for, 64 points, as rows have rays from;
/// images average over elements: 16 points took the airplane's elements twice the seconds and left its error.
pub fn deepest(all_irradiances: bool) -> u32 {
    if all_irradiances { 3 } else { 1 }
}

/// Largest factor on a row's entries.
const ROW_SCALE_MOST: f64 = 2.0;

/// Largest difference of two blocked shares that is rounding: a row whose rays meet no sky keeps its own sum, which is
/// 1 to 5e-16.
pub const BLOCKED_ROUNDING: f64 = 1e-6;

/// Values of one unknown.
pub fn stride(bands: usize) -> usize {
    3 * bands + 3
}

/// In place of a variance: an element whose straight sky its row tells.
pub const BY_ROWS: f32 = -1.0;

/// The sky that elements see straight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Straight<'a> {
    /// Of each unknown mean irradiance and its two gradients, one value per band each, and the share of its hemisphere
    /// that is blocked, with its gradients; or nothing.
    pub values: &'a [f64],
    /// Expected squared error of that linear function over each element, over pi and relative to the reference radiance; or
    /// [`BY_ROWS`].
    pub variance: &'a [f32],
}

impl<'a> Straight<'a> {
    /// Values of an unknown, and their expected squared error.
    #[inline]
    pub fn of(&self, unknown: usize, bands: usize) -> Option<(&'a [f64], f64)> {
        let variance = *self.variance.get(unknown)?;
        let stride = stride(bands);
        let values = self.values.get(stride * unknown..stride * (unknown + 1))?;
        (variance >= 0.0).then_some((values, f64::from(variance)))
    }

    /// Factor by which a row's entries are to be multiplied so that they fill what is known to be blocked: then all that it
    /// sees comes to the whole hemisphere.
    #[inline]
    pub fn scale(&self, unknown: usize, bands: usize, row: &Row) -> f64 {
        match self.of(unknown, bands) {
            Some((values, _)) if row.state >= TRACED && row.blocked > 0.0 => {
                let blocked = values.at(3 * bands);
                if fabs(blocked - row.blocked) < BLOCKED_ROUNDING {
                    return 1.0;
                }
                clamp(blocked / row.blocked, 1.0 / ROW_SCALE_MOST, ROW_SCALE_MOST)
            }
            _ => 1.0,
        }
    }

    /// Blocked share of an unknown's hemisphere: mean and gradients; and the gradients by which those that a row's entries
    /// have, times their scale, fall short of it, where the row is one of rays.
    pub fn blocked(&self, unknown: usize, bands: usize, row: &RowView<'_>) -> Option<Blocked> {
        let (values, _) = self.of(unknown, bands)?;
        let [mean, a, b] = [0, 1, 2].map(|k| values.at(3 * bands + k));
        if mean <= 0.0 || row.row.state < TRACED {
            return None;
        }
        let scale = self.scale(unknown, bands, &row.row);
        let mut short = [a, b];
        for (bundle, sign) in row.straight_sky() {
            let sign = sign * scale * bundle.rays();
            short.iter_mut().zip(bundle.gradient).for_each(|(s, g)| *s += sign * f64::from(g));
        }
        Some(([mean, a, b], short))
    }

    /// [`crate::radiosity::solution::Numbers::reflected`] of a gathered table of `stride` values an unknown.
    pub fn reflected(&self, stride: usize, reference: &[f64], irradiance: &[f64]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (unknown, values) in irradiance.chunks(stride.max(1)).enumerate() {
            let Some((sky, _)) = self.of(unknown, reference.len()) else { continue };
            let bands = reference.iter().enumerate().filter(|(_, reference)| **reference > 0.0);
            let of = |(band, reference): (usize, &f64)| {
                (values.at(band) - sky.at(band)).max(0.0) / (PI * reference)
            };
            sum += bands.map(of).fold(0.0, f64::max);
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { 1.0 }
    }

    /// Whether outlines tell an unknown's straight sky.
    #[inline]
    pub fn knows(&self, unknown: usize) -> bool {
        self.variance.get(unknown).is_some_and(|v| *v >= 0.0)
    }
}

/// Blocked share of a hemisphere, mean and gradients; and by which gradients a row's entries fall short of it.
pub type Blocked = ([f64; 3], [f64; 2]);

/// Which function of direction outlines integrate for a sky; `None` where they cannot.
pub fn basis(bvh: &Bvh<'_>, sky: &Sky<'_>) -> Option<Basis> {
    if bvh.outlines().is_empty() || !sky.is_linear() {
        return None;
    }
    Some(if sky.is_uniform() { Basis::Whole } else { Basis::Horizon(sky.up()) })
}

/// Irradiance of each band by what is open of a sky.
pub fn irradiance(open: &OpenSky, sky: &Sky<'_>, out: &mut [f64]) {
    let of = |(above, below): (f64, f64)| (PI * above, PI * below);
    sky.open_irradiance(of(open.halves()), of(open.heights()), out);
}

/// Input of [`rows`].
#[derive(Clone, Copy, Debug)]
pub struct Looking<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its tree, with outlines.
    pub bvh: &'a Bvh<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// Its coupling.
    pub coupling: &'a Coupling<'a>,
    /// The sky.
    pub sky: &'a Sky<'a>,
    /// Reference radiance, one value per band.
    pub reference: &'a [f64],
    /// Expected error of irradiance over pi to reach, relative to the largest radiance.
    pub goal: f64,
    /// The wanted errors and their shares.
    pub budget: &'a ErrorBudget,
    /// Depth of the smallest quarters that are evaluated ([`deepest`]).
    pub deepest: u32,
}

/// Straight sky of the unknowns of `range`, into their parts of [`Straight`]'s tables.
///
/// # Errors
/// [`Error::Length`] for a table of the wrong size.
pub fn rows(
    of: &Looking<'_>,
    candidates: &mut Candidates<'_>,
    range: Range<usize>,
    values: &mut [f64],
    variance: &mut [f32],
) -> Result<(), Error> {
    let bands = of.scene.bands().clamp(1, MAX_BANDS);
    let expected = stride(bands) * span(&range);
    if values.len() != expected || variance.len() != span(&range) {
        return Err(Error::Length { what: "straight sky", expected, given: values.len() });
    }
    let basis = basis(of.bvh, of.sky);
    for ((unknown, values), variance) in range.zip(pieces(values, stride(bands))).zip(variance) {
        *variance = match basis.and_then(|basis| row(of, candidates, basis, unknown, values)) {
            Some(square) => narrow(square),
            None => BY_ROWS,
        };
    }
    Ok(())
}

/// Straight sky of one unknown; its expected squared error.
fn row(
    of: &Looking<'_>,
    candidates: &mut Candidates<'_>,
    basis: Basis,
    unknown: usize,
    values: &mut [f64],
) -> Option<f64> {
    values.fill(0.0);
    if of.coupling.row(unknown).state == ABSENT {
        return Some(0.0);
    }
    if of.elements.is_cluster(unknown) {
        let (_, row) = of.coupling.rows(unknown..unknown + 1).next()?;
        return simd::run_lanes(Isa::detect(), ClusterSky { of, unknown, row: &row, values });
    }
    let (facet, side) = of.elements.facet_of(unknown);
    if !candidates.prepare(of.scene, of.bvh, (facet, side)) {
        return None;
    }
    let bands = of.scene.bands().clamp(1, MAX_BANDS);
    let mut seen = [0.0; MAX_BANDS];
    if candidates.is_clear() {
        let corners = of.elements.corners(of.scene, unknown / of.scene.sides().max(1));
        let open = candidates.open(of.scene, of.bvh, middle(&corners, 0, 0), basis, of.goal)?;
        irradiance(&open, of.sky, seen.head_mut(bands));
        copy(values, seen.head(bands));
        values.set(3 * bands, if open.inside { 0.0 } else { 1.0 - open.values[0] });
        return Some(0.0);
    }
    let goal = of.goal * of.goal;
    let reflects = of.scene.diffuse(of.scene.material(facet)).iter().any(|d| *d > 0.0);
    let mut fit = fit(of, candidates, basis, unknown, 1)?;
    for depth in 2..=of.deepest {
        // what is blocked alone decides: a band has the same bits whatever others there are
        if fit.departure(bands) <= of.budget.straight_departure * goal {
            break;
        }
        fit = self::fit(of, candidates, basis, unknown, depth)?;
    }
    if fit.outside == 0 {
        return Some(0.0);
    }
    let row = of.coupling.row(unknown);
    let hidden = fit.mean(bands);
    let least = row.blocked / ROW_SCALE_MOST - BLOCKED_ROUNDING;
    if row.state >= TRACED && !(least..=row.blocked * ROW_SCALE_MOST + BLOCKED_ROUNDING).contains(&hidden) {
        // the row's rays have missed what hides the sky: nothing says what comes from there
        return None;
    }
    fit.write(bands, values);
    let departure = fit.largest_departure(of.reference, bands);
    // the mean of stratified points is wrong by an edge that crosses n^1/2 of their n quarters
    let of_mean = departure / pow(fit.points as f64, 1.5);
    (reflects || of_mean <= of.budget.straight_mean * goal).then_some(departure + fit.error)
}

/// The straight sky of a cluster, as its row's rays tell it: points of it look for themselves.
struct ClusterSky<'a, 'o> {
    of: &'a Looking<'a>,
    unknown: usize,
    row: &'a RowView<'a>,
    values: &'o mut [f64],
}

impl LaneTask for ClusterSky<'_, '_> {
    type Out = Option<f64>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<f64> {
        let ClusterSky { of, unknown, row, values } = self;
        let bands = of.scene.bands().clamp(1, MAX_BANDS);
        let mut light = [0.0; MAX_BANDS];
        let mut checks = [[0.0; 4]; MAX_BANDS];
        let (light, checks) = (light.head_mut(bands), checks.head_mut(bands));
        let (mesh, sky) = ((of.scene, of.elements), (of.sky, of.goal));
        let of_normals = whole_sky(mesh, sky, unknown, of.reference, values.head_mut(bands));
        if row.row.state == ENCLOSED {
            values.head_mut(bands).fill(0.0);
        }
        for (bundle, sign) in row.straight_sky() {
            of.sky.sum(lanes, bundle.packed, light);
            light.iter_mut().for_each(|l| *l *= sign);
            values.iter_mut().zip(&*light).for_each(|(sum, l)| *sum += PI * bundle.weight * l);
            accuracy::add(checks, bundle.half_differences, light.iter().copied());
        }
        values.iter_mut().for_each(|value| *value = value.max(0.0));
        values.set(3 * bands, row.row.blocked);
        let relative = checks.iter().zip(of.reference).filter(|(_, reference)| **reference > 0.0);
        let variance =
            relative.map(|(checks, reference)| accuracy::square(checks.map(|c| c / reference), 1.0));
        Some(variance.fold(0.0, f64::max) + of_normals)
    }
}

/// Irradiance that the whole sky brings an unknown, one value per band of `out`: of a cluster the mean over 16 of its facets
/// (4 for skies whose irradiance is a quadrature), one of each part of its area. Returns the variance of that over them, over pi and relative to the reference radiance, in
/// the band where it is largest.
pub fn whole_sky(
    (scene, elements): (&Scene<'_>, &Elements<'_>),
    (sky, relative_error): (&Sky<'_>, f64),
    unknown: usize,
    reference: &[f64],
    out: &mut [f64],
) -> f64 {
    let (own, side) = elements.facet_of(unknown);
    if !elements.is_cluster(unknown) || sky.is_uniform() {
        sky.irradiance(scene.side_normal(own, side), relative_error, out);
        return 0.0;
    }
    let (mut light, mut squares) = ([0.0; MAX_BANDS], [0.0; MAX_BANDS]);
    let light = light.head_mut(out.len());
    out.fill(0.0);
    // skies that are no sums of a few functions take thousands of samples each
    let depth = if sky.is_linear() { 2 } else { 1 };
    let points = QUARTERS.pow(depth);
    let mut last = None;
    for number in 0..points {
        let (a, b) = place(number, depth);
        let (facet, ..) = elements.place(unknown / scene.sides().max(1), a, b);
        let normal = scene.side_normal(facet, side);
        if last != Some(normal) {
            sky.irradiance(normal, relative_error, light);
            last = Some(normal);
        }
        for ((sum, square), x) in out.iter_mut().zip(&mut squares).zip(&*light) {
            *sum += x / points as f64;
            *square += x * x / points as f64;
        }
    }
    let bands = out.iter().zip(squares).zip(reference).filter(|(_, reference)| **reference > 0.0);
    let variance = bands.map(|((mean, square), l)| (square - mean * mean).max(0.0) / (PI * PI * l * l));
    variance.fold(0.0, f64::max)
}

/// Straight sky at the middles of an element's quarters of one depth: sums of what is seen and, last, of the share that is
/// blocked, by which a linear function is fitted to them.
struct Fit {
    points: usize,
    /// Points that are not inside a closed body; the others see nothing.
    outside: usize,
    /// Expected squared error of the mean by circles.
    error: f64,
    /// Of each band, and of what is blocked: sums of its values, of their products with both local coordinates, and of their
    /// squares.
    sums: [[f64; 4]; MAX_BANDS + 1],
}

/// Looks from the middles of the quarters of a depth.
fn fit(
    of: &Looking<'_>,
    candidates: &mut Candidates<'_>,
    basis: Basis,
    unknown: usize,
    depth: u32,
) -> Option<Fit> {
    let corners = of.elements.corners(of.scene, unknown / of.scene.sides().max(1));
    let bands = of.scene.bands().clamp(1, MAX_BANDS);
    let points = QUARTERS.pow(depth);
    let mut fit = Fit { points, outside: 0, error: 0.0, sums: [[0.0; 4]; MAX_BANDS + 1] };
    for number in 0..points {
        let (u, v) = place(number, depth);
        let open = candidates.open(of.scene, of.bvh, quarter::point(&corners, u, v), basis, of.goal)?;
        fit.error += open.error * open.error / (points * points) as f64;
        if open.inside {
            continue;
        }
        fit.outside += 1;
        let mut seen = [0.0; MAX_BANDS + 1];
        irradiance(&open, of.sky, seen.head_mut(bands));
        seen.set(bands, 1.0 - open.values[0]);
        let (u, v) = (u - 1.0 / 3.0, v - 1.0 / 3.0);
        for (sums, x) in fit.sums.iter_mut().zip(seen).take(bands + 1) {
            let terms = [x, x * u, x * v, x * x];
            sums.iter_mut().zip(terms).for_each(|(sum, x)| *sum += x);
        }
    }
    Some(fit)
}

impl Fit {
    /// Mean over the points outside.
    fn mean(&self, of: usize) -> f64 {
        self.sums.get(of).map_or(0.0, |s| s[0]) / self.outside.max(1) as f64
    }

    /// Mean, and least squares' gradients by the weights of corners 1 and 2; those are 0 where some points are inside.
    fn linear(&self, of: usize) -> [f64; 3] {
        let mean = self.mean(of);
        let Some([_, u, v, _]) = self.sums.get(of).filter(|_| self.outside == self.points) else {
            return [mean, 0.0, 0.0];
        };
        // the weights' second moments over the points are s, s and -s/2, where 4/3 s is by how much u and v determine them
        let s = self.second_moment();
        [mean, (u + 0.5 * v) / (0.75 * s), (v + 0.5 * u) / (0.75 * s)]
    }

    /// Writes means and gradients of all bands, and those of the blocked share after them.
    fn write(&self, bands: usize, values: &mut [f64]) {
        for band in 0..=bands {
            let [mean, a, b] = self.linear(band);
            let [at_mean, at_a, at_b] = if band < bands {
                [0, 1, 2].map(|k| k * bands + band)
            } else {
                [0, 1, 2].map(|k| 3 * bands + k)
            };
            values.set(at_mean, mean);
            values.set(at_a, a);
            values.set(at_b, b);
        }
    }

    /// Sum of the squares of the weight of a corner less 1/3: 1/18 a point over the triangle, less that within the quarters.
    fn second_moment(&self) -> f64 {
        let n = self.points as f64;
        n / 18.0 * (1.0 - 1.0 / n)
    }

    /// Mean square departure of one sum's values from the linear function.
    fn departure(&self, of: usize) -> f64 {
        let free = if self.outside == self.points { self.points - 3 } else { self.outside.max(1) };
        let factor = if self.points == QUARTERS { FEW_POINTS } else { 1.0 };
        let Some([sum, u, v, square]) = self.sums.get(of) else { return 0.0 };
        let [mean, a, b] = self.linear(of);
        let bend = factor * ((square - mean * sum - a * u - b * v) / free as f64).max(0.0);
        // four points may lie in a plane by chance
        let slope =
            if self.points == QUARTERS { UNSEEN_SLOPE * (a * u + b * v) / self.points as f64 } else { 0.0 };
        bend.max(slope)
    }

    /// The largest of all bands, of irradiance over pi relative to the reference radiance.
    fn largest_departure(&self, reference: &[f64], bands: usize) -> f64 {
        let of = |band: usize| {
            let scale = reference.at(band);
            let scale = if scale > 0.0 { 1.0 / (PI * scale) } else { 0.0 };
            scale * scale * self.departure(band)
        };
        (0..bands).map(of).fold(0.0, f64::max)
    }
}

/// Where the middle of a quarter of a depth lies: weights of corners 1 and 2.
fn place(number: usize, depth: u32) -> (f64, f64) {
    (0..depth).fold((1.0 / 3.0, 1.0 / 3.0), |at, step| quarter::out_of(number >> (2 * step) & 3, at))
}

/// The middle of one of a triangle's quarters of a depth.
fn middle(corners: &[Vec3; 3], number: usize, depth: u32) -> Vec3 {
    let (u, v) = place(number, depth);
    quarter::point(corners, u, v)
}
