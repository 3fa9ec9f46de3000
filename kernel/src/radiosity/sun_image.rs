//! Images of the sun: where a flat mirror shows it to a diffuse facet, what arrives is computed at every point that is
//! looked at, with sharp edges, instead of as a mean over an element.
//!
//! A chain of flat ideal mirrors turns the sun into one that stands elsewhere, as seen from where the chain throws its
//! light. [`crate::radiosity::beam::add`] notes, for each side of a facet, in which directions such suns stand; rays from a point
//! toward them meet the mirrors or not, as the view's chains find. Light by way of lobes and curved mirrors, and that of sides
//! with more images than there is room for, stays a mean over elements.

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, pieces};
use crate::base::math::Vec3;
use crate::base::octahedron;
use crate::radiosity::direct::Shape;

/// Room for images, in all, where facets are few, and the least and the most of one side of a facet.
const ROOM: usize = 1 << 16;
const SLOTS: (usize, usize) = (4, 16);

/// Slots of each side of a facet.
fn slots(sides: usize) -> usize {
    (ROOM / sides.max(1)).clamp(SLOTS.0, SLOTS.1)
}

/// Places for the images of `sides` sides of facets.
pub fn places(sides: usize) -> usize {
    sides.saturating_mul(slots(sides))
}

/// In a side's first slot: it has too many images.
const MANY: u64 = u64::MAX;

/// Suns this close to each other (1 - cosine; 1.4e-7 rad) are one: directions are kept to 2e-9.
pub const SAME: f64 = 1e-14;

/// Directions of one image by way of different facets are this close together (1 - cosine): some roundings of 2e-9 rad
/// beyond [`SAME`].
const SEEN: f64 = 2.0 * SAME;

/// Chains of mirrors end where the product of their reflectances falls below so many tolerances.
pub const CUTOFF: f64 = 1e-3;

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
    /// Of each side of a facet: packed directions, then zeros; empty where nothing throws sunlight.
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
}

impl Noting<'_> {
    /// Notes an image in the direction `packed` for one of `sides` sides of facets.
    pub fn note(&mut self, sides: usize, side: usize, packed: u64) {
        let slots = slots(sides);
        let own = self.slots.part_mut(side * slots..(side + 1) * slots);
        let direction = unpack(packed);
        for slot in own.iter_mut() {
            match *slot {
                MANY => return,
                0 => {
                    *slot = packed;
                    return;
                }
                other if 1.0 - unpack(other).dot(direction) < SAME => return,
                _ => {}
            }
        }
        own.set(0, MANY);
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
        let slots = if self.slots.is_empty() { 0 } else { slots(sides) };
        let own: &'a [u64] = self.slots.get(side * slots..(side + 1) * slots).unwrap_or(&[]);
        own.iter().take_while(|p| **p != 0 && **p != MANY).map(|p| unpack(*p))
    }

    /// Whether [`SunImages::of`] gives all images that one of `sides` sides of facets may see; else their light stays a mean.
    #[inline]
    pub fn are_known(&self, sides: usize, side: usize) -> bool {
        self.slots.is_empty() || self.slots.at(side * slots(sides)) != MANY
    }

    /// Whether one of `sides` sides of facets may see an image in the direction `axis`: where its images are known, one of
    /// them stands there.
    pub fn may_show(&self, sides: usize, side: usize, axis: Vec3) -> bool {
        if self.slots.is_empty() || !self.are_known(sides, side) {
            return true;
        }
        self.of(sides, side).any(|own| 1.0 - own.dot(axis) < SEEN)
    }

    /// What such light gives an unknown on one level on the mean, one value per band; nothing where it stays a mean.
    #[inline]
    pub fn mean(
        &self,
        shape: Shape,
        (sides, side): (usize, usize),
        (unknown, level): (usize, usize),
    ) -> &'a [f64] {
        if self.slots.is_empty() || !self.are_known(sides, side) {
            return &[];
        }
        let start = (unknown * shape.levels + level) * shape.bands;
        self.thrown.get(start..start + shape.bands).unwrap_or(&[])
    }

    /// Takes such light off the means in the gathered table of all unknowns; `side_of` gives an unknown's side of a facet,
    /// one of `sides`.
    pub fn take_off(&self, shape: Shape, sides: usize, side_of: impl Fn(usize) -> usize, table: &mut [f64]) {
        if self.slots.is_empty() {
            return;
        }
        for (unknown, values) in pieces(table, shape.stride()).enumerate() {
            for (level, part) in pieces(values, 3 * shape.bands).enumerate() {
                let thrown = self.mean(shape, (sides, side_of(unknown)), (unknown, level));
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
        let sides = ROOM / SLOTS.0;
        let (mut slots, mut thrown) = ([0; ROOM], [1.0; ROOM / SLOTS.0]);
        assert_eq!(places(sides), ROOM);
        let mut noting = Noting { slots: &mut slots, thrown: &mut thrown };
        for x in [0.0, 0.1, 0.1, 0.0, 0.2] {
            noting.note(sides, 1, pack(Vec3::new(x, 0.0, 1.0).normalize()));
        }
        for x in 0..5 {
            noting.note(sides, 2, pack(Vec3::new(f64::from(x), 0.0, 1.0).normalize()));
        }
        let shape = Shape { levels: 1, bands: 1 };
        let images = SunImages::new(&slots, &thrown, sides, sides, shape).unwrap();
        assert_eq!([0, 1, 2].map(|side| images.of(sides, side).count()), [0, 3, 0]);
        assert_eq!([0, 1, 2].map(|side| images.are_known(sides, side)), [true, true, false]);
        let mut table = [3.0; 3 * ROOM / SLOTS.0];
        images.take_off(shape, sides, |unknown| unknown, &mut table);
        assert_eq!([table[3], table[4], table[6]], [2.0, 3.0, 3.0]);
        assert!(SunImages::new(&slots[1..], &thrown, sides, sides, shape).is_err());
        let none = SunImages::new(&[], &[], sides, sides, shape).unwrap();
        assert_eq!(none.of(sides, 1).count(), 0);
        none.take_off(shape, sides, |unknown| unknown, &mut table);
        assert_eq!(table[3], 2.0);
    }
}
