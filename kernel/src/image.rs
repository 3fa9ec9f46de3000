//! The image: one chain per pixel centre, more where the radiance changes from pixel to pixel.

use crate::arena::{Arena, Need};
use crate::camera::{Camera, Sampling};
use crate::chain::{Sample, Solved, Terms};
use crate::error::{Error, Field};
use crate::index::{Index, IndexMut, copy};
use crate::math::{fabs, pow, sqrt};
use crate::qmc::{Sequence, hash2};
use crate::scene::MAX_BANDS;
use core::ops::Range;

/// What was done on a range of rows; ranges add up with [`Tally::add`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Pixels whose centre ray meets the object.
    pub object_pixels: u64,
    /// Rays through pixels.
    pub primary: u64,
    /// Rays of chains and toward the sun.
    pub chain: u64,
    /// Pixels sampled more than once.
    pub refined: u64,
    /// Sum over object pixels of the squared expected error from the diffuse solution.
    pub noise2: f64,
    /// The same of the error from sampling the pixel's area.
    pub sampling2: f64,
    /// Largest bound on what cut chains could still have brought.
    pub tail: f64,
}

impl Tally {
    /// Adds the tally of the next range.
    pub fn add(&mut self, next: &Tally) {
        self.object_pixels += next.object_pixels;
        self.primary += next.primary;
        self.chain += next.chain;
        self.refined += next.refined;
        self.noise2 += next.noise2;
        self.sampling2 += next.sampling2;
        self.tail = self.tail.max(next.tail);
    }

    /// Root mean square over the object's pixels of both errors, relative to the reference radiance.
    pub fn estimate(&self) -> f64 {
        if self.object_pixels == 0 {
            return 0.0;
        }
        sqrt((self.noise2 + self.sampling2) / self.object_pixels as f64)
    }
}

/// Where a range of rows is written: (row, column, band), row by row.
#[derive(Debug)]
pub struct Target<'o> {
    /// Radiance.
    pub image: &'o mut [f32],
    /// The terms of eq. (11): diffuse, mirror-sky, mirror-diffuse; same shape, or empty.
    pub components: [&'o mut [f32]; 3],
}

/// Bytes of scratch memory for [`rows`]: three rows of pixel centres.
pub fn scratch_bytes(camera: &Camera, bands: usize) -> Result<usize, Error> {
    Need::new().and::<f64>(3 * (camera.columns() + 2) * (3 * bands + 3)).bytes()
}

/// Fewest and most rays through a pixel that is sampled more than once.
const FEWEST: u32 = 4;
const MOST: u32 = 256;

/// A pixel whose centre differs from its neighbours by at most this many tolerances keeps the centre's value: an
/// edge of that contrast, on one pixel in five, brings an error of half the tolerance.
const FLAT: f64 = 3.0;

/// Computes the pixels of the rows in `range`. Any split into ranges gives the same bits.
///
/// Centre sampling: the radiance along the centre's ray, exactly. Area sampling: a pixel whose centre differs
/// from none of its eight neighbours by more than three tolerances keeps its centre's value; others get 4 to 256
/// rays, error about half the difference times n^-3/4.
///
/// # Errors
/// [`Error::Range`] for rows outside the image, [`Error::Length`] for outputs of another size.
pub fn rows(
    solved: &Solved<'_>,
    camera: &Camera,
    range: Range<usize>,
    target: &mut Target<'_>,
    scratch: &mut [u8],
) -> Result<Tally, Error> {
    if range.start > range.end || range.end > camera.rows() {
        return Err(Error::Range { field: Field::Rows, band: 0, value: range.end as f64 });
    }
    let bands = solved.shape.bands;
    let expected = range.len() * camera.columns() * bands;
    if target.image.len() != expected {
        return Err(Error::Length { what: "image", expected, given: target.image.len() });
    }
    for component in &target.components {
        if !component.is_empty() && component.len() != expected {
            return Err(Error::Length { what: "image component", expected, given: component.len() });
        }
    }
    let mut arena = Arena::new(scratch, scratch_bytes(camera, bands)?)?;
    let width = camera.columns() + 2;
    let stride = 3 * bands + 3;
    let lines = arena.take::<f64>(3 * width * stride)?;
    let mut painter =
        Painter { solved, camera, lines, width, stride, terms: Terms::ZERO, tally: Tally::default() };
    match camera.sampling() {
        Sampling::Centre => painter.centres(range, target),
        Sampling::Area => painter.areas(range, target),
    }
    Ok(painter.tally)
}

struct Painter<'a, 's> {
    solved: &'a Solved<'a>,
    camera: &'a Camera,
    /// Three rows of pixel centres, with a column more on either side: three terms, then object, noise, tail.
    lines: &'s mut [f64],
    width: usize,
    stride: usize,
    terms: Terms,
    tally: Tally,
}

impl Painter<'_, '_> {
    fn centres(&mut self, range: Range<usize>, target: &mut Target<'_>) {
        let columns = self.camera.columns();
        for (i, row) in range.enumerate() {
            self.line(row as isize, 0..columns as isize);
            for j in 0..columns {
                let at = self.slot(row as isize, j as isize);
                self.note(at);
                self.write(target, i * columns + j, at);
            }
        }
    }

    fn areas(&mut self, range: Range<usize>, target: &mut Target<'_>) {
        let columns = self.camera.columns() as isize;
        let (first, last) = (range.start as isize, range.end as isize);
        if first < last {
            self.line(first - 1, -1..columns + 1);
            self.line(first, -1..columns + 1);
        }
        for row in first..last {
            self.line(row + 1, -1..columns + 1);
            for j in 0..columns {
                let at = self.slot(row, j);
                self.note(at);
                let index = (row - first) as usize * columns as usize + j as usize;
                let contrast = self.contrast(row, j);
                if contrast <= FLAT * self.solved.settings.tolerance {
                    self.write(target, index, at);
                } else {
                    self.refine(target, index, row as usize, j as usize, contrast);
                }
            }
        }
    }

    /// Where a pixel's centre stands in the lines.
    #[inline]
    fn slot(&self, row: isize, column: isize) -> usize {
        (row.rem_euclid(3) as usize * self.width + (column + 1) as usize) * self.stride
    }

    /// Computes the centres of a row.
    fn line(&mut self, row: isize, columns: Range<isize>) {
        let bands = self.solved.shape.bands;
        for j in columns {
            let ray = self.camera.ray(j as f64 + 0.5, row as f64 + 0.5);
            self.terms.clear(bands);
            let path =
                self.solved.radiance(&ray, Sample::Alone(hash2(row as u32, j as u32)), &mut self.terms);
            self.tally.primary += 1;
            self.tally.chain += u64::from(path.rays);
            let at = self.slot(row, j);
            let slot = self.lines.part_mut(at..at + self.stride);
            copy(slot.part_mut(0..bands), &self.terms.diffuse);
            copy(slot.part_mut(bands..2 * bands), &self.terms.mirror_sky);
            copy(slot.part_mut(2 * bands..3 * bands), &self.terms.mirror_diffuse);
            let notes = [f64::from(u8::from(path.object)), path.noise, path.tail];
            copy(slot.part_mut(3 * bands..3 * bands + 3), &notes);
        }
    }

    /// Counts an object pixel and its expected errors.
    fn note(&mut self, at: usize) {
        let end = at + self.stride;
        let (object, noise, tail) = (self.lines.at(end - 3), self.lines.at(end - 2), self.lines.at(end - 1));
        if object > 0.0 {
            self.tally.object_pixels += 1;
            self.tally.noise2 += noise * noise;
            self.tally.tail = self.tally.tail.max(tail);
        }
    }

    fn write(&self, target: &mut Target<'_>, index: usize, at: usize) {
        let bands = self.solved.shape.bands;
        let slot = self.lines.part(at..at + 3 * bands);
        for band in 0..bands {
            let sum = slot.at(band) + slot.at(bands + band) + slot.at(2 * bands + band);
            target.image.set(index * bands + band, sum as f32);
            for (c, component) in target.components.iter_mut().enumerate().filter(|(_, o)| !o.is_empty()) {
                component.set(index * bands + band, slot.at(c * bands + band) as f32);
            }
        }
    }

    /// Largest difference between a pixel's centre and its neighbours', relative to the reference radiance.
    fn contrast(&self, row: isize, column: isize) -> f64 {
        let bands = self.solved.shape.bands;
        let value = |at: usize, band: usize| {
            self.lines.at(at + band) + self.lines.at(at + bands + band) + self.lines.at(at + 2 * bands + band)
        };
        let centre = self.slot(row, column);
        let mut largest: f64 = 0.0;
        for i in row - 1..=row + 1 {
            for j in column - 1..=column + 1 {
                let at = self.slot(i, j);
                for band in 0..bands {
                    let difference = fabs(value(at, band) - value(centre, band));
                    if difference > 0.0 {
                        largest = largest.max(difference / self.solved.reference.at(band));
                    }
                }
            }
        }
        largest
    }

    /// The mean over a pixel's square, from as many rays as the contrast asks for.
    fn refine(&mut self, target: &mut Target<'_>, index: usize, row: usize, column: usize, contrast: f64) {
        let bands = self.solved.shape.bands;
        let seed = hash2(row as u32, column as u32);
        let sequence = Sequence::new(seed);
        let mut sums = Terms::ZERO;
        let (mut low, mut high) = ([f64::INFINITY; MAX_BANDS], [f64::NEG_INFINITY; MAX_BANDS]);
        let (mut n, mut goal) = (0u32, FEWEST);
        let mut error = 0.0;
        while n < goal {
            let (x, y) = sequence.pair(n, 0);
            let ray = self.camera.ray(column as f64 + x, row as f64 + y);
            self.terms.clear(bands);
            let path = self.solved.radiance(&ray, Sample::OneOf { seed, index: n }, &mut self.terms);
            self.tally.primary += 1;
            self.tally.chain += u64::from(path.rays);
            sums.add(&self.terms, bands);
            for (band, (low, high)) in low.iter_mut().zip(&mut high).enumerate().take(bands) {
                *low = low.min(self.terms.sum(band));
                *high = high.max(self.terms.sum(band));
            }
            n += 1;
            if n == goal {
                let mut seen: f64 = 0.0;
                for ((low, high), reference) in low.iter().zip(&high).zip(self.solved.reference) {
                    let d = high - low;
                    if d > 0.0 {
                        seen = seen.max(d / reference);
                    }
                }
                // what n rays have not seen of the neighbours' contrast lies in some 1/sqrt(n) of the pixel
                error = 0.5 * seen.max(contrast / sqrt(f64::from(n))) * pow(f64::from(n), -0.75);
                // a tenth of the pixels lies on edges: sqrt(10) times the tolerance there is the tolerance
                if error > 2.0 * self.solved.settings.tolerance && goal < MOST {
                    goal *= 2;
                }
            }
        }
        self.tally.refined += 1;
        self.tally.sampling2 += 0.25 * error * error;
        let share = 1.0 / f64::from(n);
        for band in 0..bands {
            let terms = [sums.diffuse.at(band), sums.mirror_sky.at(band), sums.mirror_diffuse.at(band)];
            target.image.set(index * bands + band, ((terms[0] + terms[1] + terms[2]) * share) as f32);
            for (component, term) in target.components.iter_mut().zip(terms).filter(|(o, _)| !o.is_empty()) {
                component.set(index * bands + band, (term * share) as f32);
            }
        }
    }
}
