//! The sky that elements see straight, by outlines: no rays, and exact where nothing that may cover the sky is covered
//! itself.
//!
//! Each element is looked at from the middles of its four quarters. Those at its corners make the gradient; by how much the
//! middle one departs from their mean tells what the linear function over the element leaves out.

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy, pieces, span};
use crate::base::math::{PI, Vec3, clamp, fabs, narrow};
use crate::base::quarter::{self, QUARTERS};
use crate::coupling::element::Elements;
use crate::coupling::word::EMPTY;
use crate::coupling::{ABSENT, BLOCKED, Coupling, ENCLOSED, Row, RowView, TRACED};
use crate::rays::bvh::Bvh;
use crate::rays::outline::{Basis, Candidates, OpenSky};
use crate::scene::sky::Sky;
use crate::scene::{MAX_BANDS, Scene};
use core::ops::Range;

/// Mean square departure from a linear function over that of the middle from the corners: as for what rows see.
const DEPARTURE: f64 = 2.0;

/// The most by which a row's entries are multiplied.
const MOST_SCALE: f64 = 2.0;

/// Difference of two blocked shares that is rounding: a row whose rays meet no sky keeps its own sum, which is 1 to 5e-16.
pub const SAME: f64 = 1e-6;

/// Mean square departure from a linear function, in squares of the goal, from which on the middles of the quarters are too
/// few for a side that reflects nothing and of which the irradiance alone is asked: the row's rays tell the sky then.
const MOST_DEPARTURE: f64 = 4.0;

/// Values of one unknown.
pub fn stride(bands: usize) -> usize {
    3 * bands + 3
}

/// In place of a variance: an element whose straight sky its row tells.
pub const BY_ROWS: f32 = -1.0;

/// The sky that elements see straight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Straight<'a> {
    /// Of each unknown mean irradiance and its two gradients, one value per band each, and the share of its hemisphere that is
    /// blocked, with its gradients; or nothing.
    pub values: &'a [f64],
    /// Expected squared error of that linear function over each element, over pi and relative to the reference radiance; or
    /// [`BY_ROWS`].
    pub variance: &'a [f32],
}

impl<'a> Straight<'a> {
    /// What is known of an unknown: its values, and their expected squared error.
    #[inline]
    pub fn of(&self, unknown: usize, bands: usize) -> Option<(&'a [f64], f64)> {
        let variance = *self.variance.get(unknown)?;
        let stride = stride(bands);
        let values = self.values.get(stride * unknown..stride * (unknown + 1))?;
        (variance >= 0.0).then_some((values, f64::from(variance)))
    }

    /// By what a row's entries are to be multiplied so that they fill what is known to be blocked: then all that it sees comes
    /// to the whole hemisphere.
    #[inline]
    pub fn scale(&self, unknown: usize, bands: usize, row: &Row) -> f64 {
        match self.of(unknown, bands) {
            Some((values, _)) if row.state >= TRACED && row.blocked > 0.0 => {
                let blocked = values.at(3 * bands);
                if fabs(blocked - row.blocked) < SAME {
                    return 1.0;
                }
                clamp(blocked / row.blocked, 1.0 / MOST_SCALE, MOST_SCALE)
            }
            _ => 1.0,
        }
    }

    /// What is blocked of an unknown's hemisphere: mean and gradients; and the gradients by which those that a row's entries
    /// have, times their scale, fall short of it, where the row is one of rays.
    pub fn blocked(&self, unknown: usize, bands: usize, row: &RowView<'_>) -> Option<Blocked> {
        let (values, _) = self.of(unknown, bands)?;
        let [mean, a, b] = [0, 1, 2].map(|k| values.at(3 * bands + k));
        if mean <= 0.0 || row.row.state < TRACED {
            return None;
        }
        let scale = self.scale(unknown, bands, &row.row);
        let mut short = [a, b];
        for bundle in row.escapes.into_iter().filter(|bundle| matches!(bundle.word, BLOCKED | EMPTY)) {
            // what is open has the other sign
            let sign = if bundle.word == BLOCKED && row.row.state != ENCLOSED { -scale } else { scale };
            let sign = sign * bundle.rays();
            short.iter_mut().zip(bundle.gradient).for_each(|(s, g)| *s += sign * f64::from(g));
        }
        Some(([mean, a, b], short))
    }

    /// Whether outlines tell an unknown's straight sky.
    #[inline]
    pub fn knows(&self, unknown: usize) -> bool {
        self.variance.get(unknown).is_some_and(|v| *v >= 0.0)
    }
}

/// What is blocked of a hemisphere, mean and gradients; and by which gradients a row's entries fall short of it.
pub type Blocked = ([f64; 3], [f64; 2]);

/// How outlines are to be looked at for a sky; `None` where they do not tell.
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

/// What [`rows`] works on.
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
    let (facet, side) = of.elements.facet_of(unknown);
    if !candidates.prepare(of.scene, of.bvh, (facet, side)) {
        return None;
    }
    let corners = of.elements.corners(of.scene, unknown / of.scene.sides().max(1));
    let bands = of.scene.bands().clamp(1, MAX_BANDS);
    let mut blocked = [0.0; QUARTERS];
    let mut seen = [[0.0; MAX_BANDS]; QUARTERS];
    let (mut outside, mut error) = ([false; QUARTERS], 0.0);
    for number in 0..QUARTERS {
        let open = candidates.open(of.scene, of.bvh, middle(&corners, number), basis, of.goal)?;
        let seen = seen.get_mut(number)?.head_mut(bands);
        irradiance(&open, of.sky, seen);
        outside.set(number, !open.inside);
        blocked.set(number, if open.inside { 0.0 } else { 1.0 - open.values[0] });
        error += open.error * open.error / (QUARTERS * QUARTERS) as f64;
        if candidates.is_clear() {
            copy(values, seen);
            values.set(3 * bands, 1.0 - open.values[0]);
            return Some(0.0);
        }
    }
    let count = outside.iter().filter(|o| **o).count();
    if count == 0 {
        return Some(0.0);
    }
    let hidden = blocked.iter().sum::<f64>() / count as f64;
    let row = of.coupling.row(unknown);
    let least = row.blocked / MOST_SCALE - SAME;
    if row.state >= TRACED && !(least..=row.blocked * MOST_SCALE + SAME).contains(&hidden) {
        // the row's rays have missed what hides the sky: nothing says what comes from there
        return None;
    }
    values.set(3 * bands, hidden);
    if count == QUARTERS {
        values.set(3 * bands + 1, 2.0 * (blocked[1] - blocked[0]));
        values.set(3 * bands + 2, 2.0 * (blocked[2] - blocked[0]));
    }
    let mut departure: f64 = 0.0;
    for band in 0..bands {
        let of_quarter = |n: usize| if outside.at(n) { seen.get(n).map_or(0.0, |s| s.at(band)) } else { 0.0 };
        let mean = (0..QUARTERS).map(of_quarter).sum::<f64>() / count as f64;
        values.set(band, mean);
        let corner = [0, 1, 2].map(of_quarter);
        let scale = of.reference.at(band);
        let scale = if scale > 0.0 { 1.0 / (PI * scale) } else { 0.0 };
        if count == QUARTERS {
            // from quarter to quarter barycentric weights change by a half
            values.set(bands + band, 2.0 * (corner[1] - corner[0]));
            values.set(2 * bands + band, 2.0 * (corner[2] - corner[0]));
            let bend = of_quarter(3) - (corner[0] + corner[1] + corner[2]) / 3.0;
            departure = departure.max(DEPARTURE * (scale * bend) * (scale * bend));
        } else {
            let spread = (0..QUARTERS).filter(|&n| outside.at(n)).map(|n| of_quarter(n) - mean);
            let square = spread.map(|d| d * d).sum::<f64>() / count as f64;
            departure = departure.max(DEPARTURE * scale * scale * square);
        }
    }
    let reflects = of.scene.diffuse(of.scene.material(facet)).iter().any(|d| *d > 0.0);
    (reflects || departure <= MOST_DEPARTURE * of.goal * of.goal).then_some(departure + error)
}

/// The middle of one of a triangle's quarters.
fn middle(corners: &[Vec3; 3], number: usize) -> Vec3 {
    let (u, v) = quarter::out_of(number, (1.0 / 3.0, 1.0 / 3.0));
    quarter::point(corners, u, v)
}
