//! Images of the sun: where a flat mirror shows it to a diffuse facet, what arrives is computed at every point that is
//! looked at, with sharp edges, instead of as a mean over an element.
//!
//! A chain of flat ideal mirrors turns the sun into one that stands elsewhere, as seen from where the chain throws its
//! light. [`crate::radiosity::beam::add`] notes, for each side of a facet, in which directions such suns stand; rays from a point
//! toward them meet the mirrors or not, as the view's chains find. Light by way of lobes and curved mirrors, and that of sides
//! with more images than there is room for, stays a mean over elements.

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, pieces};
use crate::base::math::{FRAC_1_PI, Vec3, clamp, narrow, sqrt};
use crate::base::octahedron;
use crate::coupling::Record;
use crate::radiosity::direct::Shape;

/// Room for images of all sides of facets together: where these are few, and for each.
const ROOM: (usize, usize) = (1 << 14, 2);

/// The most images of one side: each is looked for from every point.
const MOST: usize = 1024;

/// Images for which `sides` sides of facets have room.
fn room(sides: usize) -> usize {
    sides.saturating_mul(ROOM.1).max(ROOM.0)
}

/// Places for the images of `sides` sides of facets: where each side's list begins, how many images there are, and the
/// images with where the list goes on.
pub fn places(sides: usize) -> usize {
    sides.saturating_add(1).saturating_add(room(sides).saturating_mul(2))
}

/// Where a side's list would begin: it has too many images.
const MANY: u64 = u64::MAX;

/// The places of one side's list from its beginning, which holds the number of an image, counted from 1; 0: no more.
#[derive(Clone, Debug)]
struct List<'a> {
    slots: &'a [u64],
    sides: usize,
    next: u64,
    left: usize,
}

impl<'a> List<'a> {
    fn of(slots: &'a [u64], sides: usize, side: usize) -> List<'a> {
        let next = slots.get(side).copied().filter(|next| *next != MANY).unwrap_or(0);
        List { slots, sides, next, left: MOST }
    }
}

impl Iterator for List<'_> {
    type Item = u64;

    #[inline]
    fn next(&mut self) -> Option<u64> {
        let place = self.sides + 1 + 2 * (self.next as usize).checked_sub(1)?;
        self.left = self.left.checked_sub(1)?;
        let (packed, next) = (*self.slots.get(place)?, *self.slots.get(place + 1)?);
        self.next = next;
        Some(packed)
    }
}

/// Suns this close to each other (1 - cosine; 1.4e-7 rad) are one: directions are kept to 2e-9.
pub const SAME: f64 = 1e-14;

/// Directions of one image by way of different facets are this close together (1 - cosine): some roundings of 2e-9 rad
/// beyond [`SAME`].
const SEEN: f64 = 2.0 * SAME;

/// Bits of each coordinate of a direction.
const BITS: u32 = 31;

/// A direction in 63 bits, to 2e-9 rad; never 0.
pub fn pack(direction: Vec3) -> u64 {
    1 << 62 | octahedron::pack::<BITS>(direction)
}

/// The direction of a packed one.
pub fn unpack(packed: u64) -> Vec3 {
    octahedron::unpack::<BITS>(packed & !(1 << 62))
}

/// The images that each side of a facet sees, and what they give its elements on the mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct SunImages<'a> {
    /// The lists of all sides of facets ([`places`]); empty where nothing throws sunlight.
    pub slots: &'a [u64],
    /// Irradiance by light that can be computed at every point: for each unknown and level, one value per band; of sides
    /// with too many images, too.
    pub thrown: &'a [f64],
}

/// The same while light is noted.
#[derive(Debug, Default)]
pub struct Noting<'a> {
    /// As [`SunImages::slots`]; all 0 to begin with.
    pub slots: &'a mut [u64],
    /// As [`SunImages::thrown`]; all 0 to begin with.
    pub thrown: &'a mut [f64],
    /// Where on its element light falls that may stay a mean, [`SPREAD`] values an unknown; all 0 to begin with.
    pub spread: &'a mut [f32],
    /// Reference radiance, one value per band.
    pub reference: &'a [f64],
}

/// Values that tell where on an element light falls: for that of lobes and curved mirrors and for that of images its sum,
/// relative to the reference radiance, its weighted places and squared distances from the middle, and the rays.
pub const SPREAD: usize = 10;

/// Mean of the squared distance of an element's points from its middle, in local coordinates a^2 + a b + b^2.
const EVEN: f64 = 1.0 / 12.0;

/// Expected squared error of the irradiance over pi of an unknown, relative to the reference radiance, where light that is
/// not the same all over its element counts as a mean: `spread` are its values, of which images count where they are not
/// `known`.
///
/// Light that falls on the share p of the element has the variance 1/p - 1 of its squared mean; p is taken from how far
/// apart the rays fall. Of n rays the mean itself is off by some n^-3/4.
pub fn variance(spread: &[f32], known: bool) -> f64 {
    let counted = |k: usize| {
        let images = if known { 0.0 } else { f64::from(spread.at(k + SPREAD / 2)) };
        f64::from(spread.at(k)) + images
    };
    let [sum, a, b, square, count] = [0, 1, 2, 3, 4].map(counted);
    if sum <= 0.0 || count <= 0.0 {
        return 0.0;
    }
    let (a, b) = (a / sum, b / sum);
    let apart = square / sum - (a * a + a * b + b * b);
    let share = clamp(apart / EVEN, 1.0 / (SMALLEST * count + 1.0), 1.0);
    sum * sum * (1.0 / share - 1.0 + 1.0 / (count * sqrt(count)))
}

/// Rays that all fall on one place of an element: they are said to fill one over so many of them.
const SMALLEST: f64 = 16.0;

impl Noting<'_> {
    /// Notes an image in the direction `packed` for one of `sides` sides of facets.
    pub fn note(&mut self, sides: usize, side: usize, packed: u64) {
        let direction = unpack(packed);
        let (mut last, mut count) = (side, 0);
        for (number, other) in List::of(self.slots, sides, side).enumerate() {
            if 1.0 - unpack(other).dot(direction) < SAME {
                return;
            }
            let place = self.slots.at(last) as usize;
            (last, count) = (sides + 2 * place, number + 1);
        }
        if self.slots.at(last) == MANY {
            return;
        }
        let used = self.slots.at(sides) as usize;
        if count >= MOST || used >= room(sides) {
            self.slots.set(side, MANY);
            return;
        }
        let place = sides + 1 + 2 * used;
        self.slots.set(place, packed);
        self.slots.set(place + 1, 0);
        self.slots.set(last, used as u64 + 1);
        self.slots.set(sides, used as u64 + 1);
    }

    /// Notes where on its element a record's light falls; `irradiance` is that of each band for a weight of 1, `exposed` the
    /// part of the element that is not inside a body.
    pub fn spread(
        &mut self,
        unknown: usize,
        record: &Record,
        exposed: f64,
        irradiance: impl Fn(usize) -> f64,
    ) {
        let bands = self.reference.iter().enumerate().filter(|(_, reference)| **reference > 0.0);
        let most = bands.map(|(band, reference)| irradiance(band) / reference).fold(0.0, f64::max);
        let scale = FRAC_1_PI * most / exposed;
        let start = unknown * SPREAD + if record.image() == 0 { 0 } else { SPREAD / 2 };
        let [a, b, square, count] = record.places();
        let own = [record.weight, a.into(), b.into(), square.into()].map(|x: f64| narrow(scale * x));
        let to = self.spread.part_mut(start..start + SPREAD / 2);
        to.iter_mut().zip(own.iter().chain([&count])).for_each(|(to, from)| *to += from);
    }

    /// Adds irradiance of one band of an unknown on one level.
    pub fn add(&mut self, shape: Shape, (unknown, level): (usize, usize), band: usize, irradiance: f64) {
        if let Some(value) = self.thrown.get_mut((unknown * shape.levels + level) * shape.bands + band) {
            *value += irradiance;
        }
    }
}

impl<'a> SunImages<'a> {
    /// Images for which a mesh of so many sides of facets has room, and means for so many unknowns.
    ///
    /// # Errors
    /// [`Error::Length`] for slices of other lengths; both may be empty where nothing throws sunlight.
    pub fn new(
        slots: &'a [u64],
        thrown: &'a [f64],
        sides: usize,
        unknowns: usize,
        shape: Shape,
    ) -> Result<SunImages<'a>, Error> {
        let (places, means) = (places(sides), unknowns * shape.levels * shape.bands);
        if slots.is_empty() && thrown.is_empty() {
            return Ok(SunImages::default());
        }
        if slots.len() != places || thrown.len() != means {
            return Err(Error::Length { what: "images of the sun", expected: places, given: slots.len() });
        }
        Ok(SunImages { slots, thrown })
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        size_of_val(self.slots) + size_of_val(self.thrown)
    }

    /// Directions toward the images that one of `sides` sides of facets may see.
    #[inline]
    pub fn of(&self, sides: usize, side: usize) -> impl Iterator<Item = Vec3> + use<'a> {
        List::of(self.slots, sides, side).map(unpack)
    }

    /// Whether [`SunImages::of`] gives all images that one of `sides` sides of facets may see; else their light stays a mean.
    #[inline]
    pub fn are_known(&self, side: usize) -> bool {
        self.slots.is_empty() || self.slots.at(side) != MANY
    }

    /// Whether one of `sides` sides of facets may see an image in the direction `axis`: where its images are known, one of
    /// them stands there.
    pub fn may_show(&self, sides: usize, side: usize, axis: Vec3) -> bool {
        if self.slots.is_empty() || !self.are_known(side) {
            return true;
        }
        self.of(sides, side).any(|own| 1.0 - own.dot(axis) < SEEN)
    }

    /// What such light gives an unknown on one level on the mean, one value per band; nothing where it stays a mean.
    #[inline]
    pub fn mean(&self, shape: Shape, side: usize, (unknown, level): (usize, usize)) -> &'a [f64] {
        if self.slots.is_empty() || !self.are_known(side) {
            return &[];
        }
        let start = (unknown * shape.levels + level) * shape.bands;
        self.thrown.get(start..start + shape.bands).unwrap_or(&[])
    }

    /// Takes such light off the means in the gathered table of all unknowns; `side_of` gives an unknown's side of a facet.
    pub fn take_off(&self, shape: Shape, side_of: impl Fn(usize) -> usize, table: &mut [f64]) {
        if self.slots.is_empty() {
            return;
        }
        for (unknown, values) in pieces(table, shape.stride()).enumerate() {
            for (level, part) in pieces(values, 3 * shape.bands).enumerate() {
                let thrown = self.mean(shape, side_of(unknown), (unknown, level));
                // rounding apart, no less than nothing is left
                part.iter_mut().zip(thrown).for_each(|(mean, thrown)| *mean = (*mean - thrown).max(0.0));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_noted_once_and_too_many_are_means() {
        let sides = 3;
        let mut slots = [0; 3 + 1 + 2 * ROOM.0];
        let mut thrown = [1.0; 3];
        assert_eq!(places(sides), slots.len());
        let mut noting =
            Noting { slots: &mut slots, thrown: &mut thrown, spread: &mut [], reference: &[1.0] };
        for x in [0.0, 0.1, 0.1, 0.0, 0.2] {
            noting.note(sides, 1, pack(Vec3::new(x, 0.0, 1.0).normalize()));
        }
        for x in 0..MOST + 3 {
            noting.note(sides, 2, pack(Vec3::new(1e-3 * x as f64, 0.0, 1.0).normalize()));
            noting.note(sides, 1, pack(Vec3::new(0.2, 0.0, 1.0).normalize()));
        }
        noting.note(sides, 1, pack(Vec3::new(0.3, 0.0, 1.0).normalize()));
        let shape = Shape { levels: 1, bands: 1 };
        let images = SunImages::new(&slots, &thrown, sides, sides, shape).unwrap();
        assert_eq!([0, 1, 2].map(|side| images.of(sides, side).count()), [0, 4, 0]);
        assert_eq!([0, 1, 2].map(|side| images.are_known(side)), [true, true, false]);
        let mut table = [3.0; 9];
        images.take_off(shape, |unknown| unknown, &mut table);
        assert_eq!([table[3], table[4], table[6]], [2.0, 3.0, 3.0]);
        assert!(SunImages::new(&slots[1..], &thrown, sides, sides, shape).is_err());
        let none = SunImages::new(&[], &[], sides, sides, shape).unwrap();
        assert_eq!(none.of(sides, 1).count(), 0);
        none.take_off(shape, |unknown| unknown, &mut table);
        assert_eq!(table[3], 2.0);
    }
}
