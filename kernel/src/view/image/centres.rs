//! Three rows of pixel centres, each with a column more on either side: what area sampling compares a pixel with.

use crate::base::index::{Index, IndexMut, copy};
use crate::view::chain::{Path, Terms};
use core::ops::Range;

/// Numbers of a pixel's centre beside its terms, in the order of [`Number`].
const CENTRE_NUMBERS: usize = 6;

/// Numbers of a pixel's centre behind its terms.
#[derive(Clone, Copy)]
enum Number {
    /// 1 where the centre's ray met the object.
    Object,
    /// Expected squared error from the diffuse solution, relative to the reference radiance.
    Variance,
    /// Expected squared error of lobes, relative to the reference radiance.
    Noise,
    /// [`Path::tail`].
    Tail,
    /// 1 where a lobe or a penumbra was met.
    Sampled,
    /// Difference from the neighbours, relative to the reference radiance; infinite where the pixel is to be sampled.
    Unevenness,
}

/// The rows, of which each takes the place of the one three above it.
pub(super) struct Centres<'m> {
    values: &'m mut [f64],
    width: usize,
    bands: usize,
}

/// Values of one centre.
fn stride(bands: usize) -> usize {
    3 * bands + CENTRE_NUMBERS
}

impl<'m> Centres<'m> {
    /// Values of three rows of `columns` pixels.
    pub(super) fn size(columns: usize, bands: usize) -> usize {
        3 * (columns + 2) * stride(bands)
    }

    /// Rows in memory of [`Centres::size`] values of any content, or in none.
    pub(super) fn new(values: &'m mut [f64], columns: usize, bands: usize) -> Centres<'m> {
        Centres { values, width: columns + 2, bands }
    }

    /// Where a centre stands; columns from -1 on.
    #[inline]
    pub(super) fn place(&self, row: isize, column: isize) -> usize {
        (row.rem_euclid(3) as usize * self.width + (column + 1) as usize) * stride(self.bands)
    }

    /// Diffuse, mirrored sky and mirrored diffuse radiance, `bands` values each.
    #[inline]
    pub(super) fn terms(&self, place: usize) -> &[f64] {
        self.values.part(place..place + 3 * self.bands)
    }

    #[inline]
    fn number(&self, place: usize, number: Number) -> f64 {
        self.values.at(place + 3 * self.bands + number as usize)
    }

    /// Whether the centre's ray met the object.
    #[inline]
    pub(super) fn is_object(&self, place: usize) -> bool {
        self.number(place, Number::Object) > 0.0
    }

    /// Expected squared error of lobes, relative to the reference radiance.
    #[inline]
    pub(super) fn noise(&self, place: usize) -> f64 {
        self.number(place, Number::Noise)
    }

    /// Expected squared error from the diffuse solution, relative to the reference radiance.
    #[inline]
    pub(super) fn variance(&self, place: usize) -> f64 {
        self.number(place, Number::Variance)
    }

    /// The most that chains cut before their end could still have brought, relative to the reference radiance.
    #[inline]
    pub(super) fn tail(&self, place: usize) -> f64 {
        self.number(place, Number::Tail)
    }

    /// Whether a lobe or a penumbra was met.
    #[inline]
    pub(super) fn is_sampled(&self, place: usize) -> bool {
        self.number(place, Number::Sampled) > 0.0
    }

    /// Difference from the neighbours, relative to the reference radiance; infinite where the pixel is to be sampled,
    /// or was.
    #[inline]
    pub(super) fn unevenness(&self, place: usize) -> f64 {
        self.number(place, Number::Unevenness)
    }

    /// Sets [`Centres::unevenness`].
    #[inline]
    pub(super) fn set_unevenness(&mut self, place: usize, value: f64) {
        self.values.set(place + 3 * self.bands + Number::Unevenness as usize, value);
    }

    /// Stores the terms of some pixels of a row, which all show the same, and what their ray met.
    pub(super) fn store(&mut self, row: isize, pixels: Range<isize>, terms: &Terms, path: &Path) {
        let bands = self.bands;
        let [object, sampled] = [path.object, path.sampled].map(|b| f64::from(u8::from(b)));
        for column in pixels {
            let place = self.place(row, column);
            let values = self.values.part_mut(place..place + stride(bands));
            copy(values.part_mut(0..bands), &terms.diffuse);
            copy(values.part_mut(bands..2 * bands), &terms.mirror_sky);
            copy(values.part_mut(2 * bands..3 * bands), &terms.mirror_diffuse);
            let numbers = [object, path.variance, path.noise * path.noise, path.tail, sampled, 0.0];
            copy(values.part_mut(3 * bands..3 * bands + CENTRE_NUMBERS), &numbers);
        }
    }
}
