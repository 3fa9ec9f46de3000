//! Images of the sun: directions in which flat mirrors show it to a diffuse facet. The irradiance by an image is
//! computed at every point that is looked at, with sharp edges, instead of as a mean over an element.
//!
//! A chain of flat ideal mirrors turns the sun into one that stands elsewhere, as seen from where the chain leads its
//! light. [`crate::radiosity::beam::add`] stores the directions of such suns for each side of a facet. Rays from a
//! point toward them meet the mirrors or not, as the view's chains find. Light by way of lobes and curved mirrors, and
//! that of sides with more images than there is room for, stays a mean over elements.
//!
//! Constants of this file are measured by `cargo test --test thrown_sun --test highlights` (errors of images of the sun).

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, pieces};
use crate::base::math::{FRAC_1_PI, Vec3, clamp, frame, narrow, sqrt};
use crate::base::octahedron;
use crate::coupling::Record;
use crate::radiosity::direct::TableShape;

/// Room for images of all sides of facets together, where these are few.
const IMAGES_ROOM_LEAST: usize = 1 << 14;

/// Room for images of the sun, for each side of a facet.
const IMAGES_ROOM_PER_SIDE: usize = 2;

/// Most images of the sun of one side: each is looked for from every point.
const SIDE_IMAGES_MOST: usize = 1024;

/// Images for which `sides` sides of facets have room.
fn room(sides: usize) -> usize {
    sides.saturating_mul(IMAGES_ROOM_PER_SIDE).max(IMAGES_ROOM_LEAST)
}

/// Number of places of one image: its direction; where the list goes on, and its [`Region`]; its [`Mirrors`].
const IMAGE_PLACES: usize = 3;

/// Places for the images of `sides` sides of facets: where each side's list begins, how many images there are, and the
/// images.
pub fn places(sides: usize) -> usize {
    sides.saturating_add(1).saturating_add(room(sides).saturating_mul(IMAGE_PLACES))
}

/// The facets that show an image: one or two, each counted from 1, or more than those.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mirrors(u64);

impl Mirrors {
    /// More than two.
    const MANY: Mirrors = Mirrors(u64::MAX);

    /// With one more.
    fn with(self, mirror: usize) -> Mirrors {
        let [first, second] = self.both();
        let own = mirror as u64 + 1;
        if self == Mirrors::MANY || first == own || second == own {
            self
        } else if first == 0 {
            Mirrors(own)
        } else if second == 0 {
            Mirrors(first | own << 32)
        } else {
            Mirrors::MANY
        }
    }

    fn both(self) -> [u64; 2] {
        [self.0 & NEXT_MASK, self.0 >> 32]
    }

    /// The facets; `None` where there are more than two.
    #[inline]
    pub fn all(self) -> Option<impl Iterator<Item = usize>> {
        let all = self.both().into_iter().filter(|mirror| *mirror > 0).map(|mirror| mirror as usize - 1);
        (self != Mirrors::MANY).then_some(all)
    }
}

/// In place of where a side's list begins: it has too many images.
const SIDE_IMAGES_TOO_MANY: u64 = u64::MAX;

/// The places of one side's list from its beginning, which holds the number of an image, counted from 1; 0: no more.
#[derive(Clone, Debug)]
struct List<'a> {
    slots: &'a [u64],
    sides: usize,
    next: u64,
    left: usize,
}

impl<'a> List<'a> {
    /// Images, and where the mirrors stand that show them.
    fn of(slots: &'a [u64], sides: usize, side: usize) -> List<'a> {
        let next = slots.get(side).copied().filter(|next| *next != SIDE_IMAGES_TOO_MANY).unwrap_or(0);
        List { slots, sides, next, left: SIDE_IMAGES_MOST }
    }
}

impl Iterator for List<'_> {
    type Item = (u64, Region, Mirrors);

    #[inline]
    fn next(&mut self) -> Option<(u64, Region, Mirrors)> {
        let place = self.sides + 1 + IMAGE_PLACES * (self.next as usize).checked_sub(1)?;
        self.left = self.left.checked_sub(1)?;
        let &[packed, next, mirrors] = self.slots.get(place..place + IMAGE_PLACES)? else { return None };
        self.next = next & NEXT_MASK;
        Some((packed, Region((next >> 32) as u32), Mirrors(mirrors)))
    }
}

/// Where a list goes on, beside the region of the image before.
const NEXT_MASK: u64 = u32::MAX as u64;

/// Where the mirrors stand that show an image: a disc across its direction, in coordinates of [`frame`] in steps of
/// [`Region::STEP`]. Both of the middle's have 11 bits, the radius, rounded up, 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Region(u32);

impl Region {
    /// Scene coordinates lie between -2 and 2.
    const STEP: f64 = 1.0 / 512.0;

    /// The radius that reaches everywhere.
    const EVERYWHERE: u32 = 1023;

    /// Middle and radius of a packed one.
    fn disc(self) -> ([f64; 2], f64) {
        let middle = [self.0 >> 21, self.0 >> 10 & 2047].map(|x| f64::from(x) * Region::STEP - 2.0);
        let radius = self.0 & Region::EVERYWHERE;
        (middle, if radius == Region::EVERYWHERE { f64::INFINITY } else { f64::from(radius) * Region::STEP })
    }

    /// The smallest that holds a disc.
    fn new([x, y]: [f64; 2], radius: f64) -> Region {
        let steps = |x: f64| clamp((x + 2.0) / Region::STEP + 0.5, 0.0, 2047.0) as u32;
        // rounding of the middle moves it by up to 2^-1/2 steps
        let radius = clamp(radius / Region::STEP + 1.75, 0.0, f64::from(Region::EVERYWHERE)) as u32;
        Region(steps(x) << 21 | steps(y) << 10 | radius)
    }

    /// The disc about a facet, seen along an axis.
    fn of(corners: &[Vec3; 3], axis: Vec3) -> ([f64; 2], f64) {
        let (x, y) = frame(axis);
        let [a, b, c] = corners.map(|corner| [corner.dot(x), corner.dot(y)]);
        let middle = [0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        let far = |p: [f64; 2]| distance(middle, p);
        (middle, far(a).max(far(b)).max(far(c)))
    }

    /// The disc about this one and another.
    fn with(self, middle: [f64; 2], radius: f64) -> Region {
        let (own, own_radius) = self.disc();
        let apart = distance(own, middle);
        if own_radius == f64::INFINITY || apart + radius <= own_radius {
            return self;
        }
        let both = 0.5 * (apart + radius + own_radius).max(2.0 * radius);
        let share = if apart > 0.0 { clamp((both - own_radius) / apart, 0.0, 1.0) } else { 0.0 };
        Region::new([0, 1].map(|k| own[k] + share * (middle[k] - own[k])), both)
    }

    /// Whether lines through the ball of radius `reach` about a point, within an angle of sine `spread` of the axis,
    /// may meet the disc.
    #[inline]
    fn may_meet(self, axis: Vec3, point: Vec3, reach: f64) -> bool {
        let (middle, radius) = self.disc();
        let (x, y) = frame(axis);
        distance(middle, [point.dot(x), point.dot(y)]) <= radius + reach
    }
}

/// Distance of two points of a plane.
#[inline(always)]
fn distance([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    sqrt((a - c) * (a - c) + (b - d) * (b - d))
}

/// Least distance of two suns (1 - cosine; 1.4e-7 rad) at which they are told apart: directions are kept to 2e-9 rad.
pub const SUN_DISTANCE_LEAST: f64 = 1e-14;

/// Largest distance (1 - cosine) of the directions of one image by way of different facets: some roundings of 2e-9 rad
/// beyond [`SUN_DISTANCE_LEAST`].
const SEEN_DISTANCE_MOST: f64 = 2.0 * SUN_DISTANCE_LEAST;

/// Longest distance between two points of a scene, at most, in scene coordinates.
const SCENE_DIAMETER: f64 = 4.0;

/// Bits of each coordinate of a direction.
const IMAGE_DIRECTION_BITS: u32 = 31;

/// The largest coordinate.
const LAST_STEP: u64 = (1 << IMAGE_DIRECTION_BITS) - 1;

/// Directions within [`SEEN_DISTANCE_MOST`], 2e-7 rad, differ by less in both coordinates, whose steps are 5e-10 rad or
/// more.
const NEAR_STEPS: i64 = 512;

/// A direction in 63 bits, to 2e-9 rad; never 0.
pub fn pack(direction: Vec3) -> u64 {
    1 << 62 | octahedron::pack::<IMAGE_DIRECTION_BITS>(direction)
}

/// The direction of a packed one.
pub fn unpack(packed: u64) -> Vec3 {
    octahedron::unpack::<IMAGE_DIRECTION_BITS>(packed & !(1 << 62))
}

/// The images that each side of a facet sees, and what they give its elements on the mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct SunImages<'a> {
    /// The lists of all sides of facets ([`places`]); empty where nothing reflects sunlight.
    pub slots: &'a [u64],
    /// Irradiance by light that can be computed at every point: for each unknown and level, one value per band; of sides
    /// with too many images, too.
    pub reflected_irradiance: &'a [f64],
}

/// The images of a side that may be seen from near a point ([`SunImages::near`]).
#[derive(Clone, Debug)]
pub struct Nearby<'a> {
    list: List<'a>,
    number: u32,
    point: Vec3,
    reach: f64,
}

/// An image of the sun, as a point sees it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Image {
    /// Its number on its side.
    pub number: u32,
    /// Its direction.
    pub axis: Vec3,
    /// Mirrors that show it.
    pub mirrors: Mirrors,
}

impl Iterator for Nearby<'_> {
    type Item = Image;

    fn next(&mut self) -> Option<Image> {
        loop {
            let (packed, region, mirrors) = self.list.next()?;
            self.number += 1;
            let axis = unpack(packed);
            if region.may_meet(axis, self.point, self.reach) {
                return Some(Image { number: self.number - 1, axis, mirrors });
            }
        }
    }
}

/// The images of [`SunImages`] while beams are added to them.
#[derive(Debug, Default)]
pub struct SunImagesMut<'a> {
    /// As [`SunImages::slots`]; all 0 to begin with.
    pub slots: &'a mut [u64],
    /// As [`SunImages::reflected_irradiance`]; all 0 to begin with.
    pub reflected_irradiance: &'a mut [f64],
    /// Where on its element light falls that may stay a mean, [`SPREAD`] values an unknown; all 0 to begin with.
    pub spread: &'a mut [f32],
    /// Reference radiance, one value per band.
    pub reference: &'a [f64],
    /// Corners of all facets.
    pub corners: &'a [[Vec3; 3]],
}

/// Values that tell where on an element light falls: for that of lobes and curved mirrors and for that of images its sum,
/// relative to the reference radiance, its weighted places and squared distances from the middle, and the rays.
pub const SPREAD: usize = 10;

/// Mean of the squared distance of an element's points from its middle, in local coordinates a^2 + a b + b^2.
const ELEMENT_SPREAD2: f64 = 1.0 / 12.0;

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
    let share = clamp(apart / ELEMENT_SPREAD2, 1.0 / (IMAGE_SHARE_LEAST * count + 1.0), 1.0);
    sum * sum * (1.0 / share - 1.0 + 1.0 / (count * sqrt(count)))
}

/// Inverse of the least share of an element that an image of the sun is taken to fill, where all its rays fall on one
/// place.
const IMAGE_SHARE_LEAST: f64 = 16.0;

impl SunImagesMut<'_> {
    /// Notes an image in the direction `packed` for one of `sides` sides of facets, that a `mirror` shows.
    pub fn note(&mut self, sides: usize, side: usize, packed: u64, mirror: usize) {
        let direction = unpack(packed);
        let disc =
            |axis: Vec3| self.corners.get(mirror).map_or(([0.0; 2], f64::INFINITY), |c| Region::of(c, axis));
        let (mut last, mut count) = (side, 0);
        for (number, (other, region, mirrors)) in List::of(self.slots, sides, side).enumerate() {
            // of this image where the list goes on
            last = sides + IMAGE_PLACES * ((self.slots.at(last) & NEXT_MASK) as usize) - 1;
            let axis = unpack(other);
            if 1.0 - axis.dot(direction) < SUN_DISTANCE_LEAST {
                let (middle, radius) = disc(axis);
                let next = self.slots.at(last) & NEXT_MASK;
                self.slots.set(last, next | u64::from(region.with(middle, radius).0) << 32);
                self.slots.set(last + 1, mirrors.with(mirror).0);
                return;
            }
            count = number + 1;
        }
        if count == 0 && self.slots.at(last) == SIDE_IMAGES_TOO_MANY {
            return;
        }
        let used = self.slots.at(sides) as usize;
        if count >= SIDE_IMAGES_MOST || used >= room(sides) {
            self.slots.set(side, SIDE_IMAGES_TOO_MANY);
            return;
        }
        let (middle, radius) = disc(direction);
        let place = sides + 1 + IMAGE_PLACES * used;
        self.slots.set(place, packed);
        self.slots.set(place + 1, u64::from(Region::new(middle, radius).0) << 32);
        self.slots.set(place + 2, Mirrors::default().with(mirror).0);
        self.slots.set(last, self.slots.at(last) & !NEXT_MASK | (used as u64 + 1));
        self.slots.set(sides, used as u64 + 1);
    }

    /// Notes where on its element a record's light falls; `irradiance` is that of each band for a weight of 1,
    /// `visible_share` the part of the element that is not inside a body.
    pub fn spread(
        &mut self,
        unknown: usize,
        record: &Record,
        visible_share: f64,
        irradiance: impl Fn(usize) -> f64,
    ) {
        let bands = self.reference.iter().enumerate().filter(|(_, reference)| **reference > 0.0);
        let most = bands.map(|(band, reference)| irradiance(band) / reference).fold(0.0, f64::max);
        let scale = FRAC_1_PI * most / visible_share;
        let start = unknown * SPREAD + if record.image() == 0 { 0 } else { SPREAD / 2 };
        let [a, b, square, count] = record.places();
        let own = [record.weight, a.into(), b.into(), square.into()].map(|x: f64| narrow(scale * x));
        let to = self.spread.part_mut(start..start + SPREAD / 2);
        to.iter_mut().zip(own.iter().chain([&count])).for_each(|(to, from)| *to += from);
    }

    /// Adds irradiance of one band of an unknown on one level.
    pub fn add(&mut self, shape: TableShape, unknown: usize, level: usize, band: usize, irradiance: f64) {
        if let Some(value) =
            self.reflected_irradiance.get_mut((unknown * shape.levels + level) * shape.bands + band)
        {
            *value += irradiance;
        }
    }
}

impl<'a> SunImages<'a> {
    /// The images of a mesh with `sides` sides of facets, and the means of `unknowns` unknowns.
    ///
    /// # Errors
    /// [`Error::Length`] for slices of other lengths; both may be empty where nothing reflects sunlight.
    pub fn new(
        slots: &'a [u64],
        reflected_irradiance: &'a [f64],
        sides: usize,
        unknowns: usize,
        shape: TableShape,
    ) -> Result<SunImages<'a>, Error> {
        let (places, means) = (places(sides), unknowns * shape.levels * shape.bands);
        if slots.is_empty() && reflected_irradiance.is_empty() {
            return Ok(SunImages::default());
        }
        if slots.len() != places || reflected_irradiance.len() != means {
            return Err(Error::Length { what: "images of the sun", expected: places, given: slots.len() });
        }
        Ok(SunImages { slots, reflected_irradiance })
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        size_of_val(self.slots) + size_of_val(self.reflected_irradiance)
    }

    /// Directions toward the images that one of `sides` sides of facets may see.
    #[inline]
    pub fn of(&self, sides: usize, side: usize) -> impl Iterator<Item = Vec3> + use<'a> {
        List::of(self.slots, sides, side).map(|(packed, ..)| unpack(packed))
    }

    /// Those that one of `sides` sides of facets may see from within `reach` of a point, where the
    /// light of each is spread over angles of the sine `spread`.
    #[inline]
    pub fn near(&self, sides: usize, side: usize, point: Vec3, reach: f64, spread: f64) -> Nearby<'a> {
        // more than the tangent over the longest distance in a scene
        let reach = reach + 2.0 * spread * SCENE_DIAMETER;
        Nearby { list: List::of(self.slots, sides, side), number: 0, point, reach }
    }

    /// Whether [`SunImages::of`] gives all images that one of `sides` sides of facets may see; else their light stays a
    /// mean.
    #[inline]
    pub fn are_known(&self, side: usize) -> bool {
        self.slots.is_empty() || self.slots.at(side) != SIDE_IMAGES_TOO_MANY
    }

    /// Whether one of `sides` sides of facets may see an image in the direction `axis`: where its images are known, one of
    /// them stands there.
    pub fn may_show(&self, sides: usize, side: usize, axis: Vec3) -> bool {
        if self.slots.is_empty() || !self.are_known(side) {
            return true;
        }
        // most differ in their bits already; at the rims of the octahedron's square, those do not tell
        let places = |packed: u64| [packed >> IMAGE_DIRECTION_BITS, packed].map(|x| (x & LAST_STEP) as i64);
        let near = places(pack(axis));
        let rim = near.iter().any(|x| !(NEAR_STEPS..=LAST_STEP as i64 - NEAR_STEPS).contains(x));
        let may_be = |packed: u64| {
            let [a, b] = places(packed);
            rim || (a - near[0]).abs() < NEAR_STEPS && (b - near[1]).abs() < NEAR_STEPS
        };
        let mut list = List::of(self.slots, sides, side);
        list.any(|(packed, ..)| may_be(packed) && 1.0 - unpack(packed).dot(axis) < SEEN_DISTANCE_MOST)
    }

    /// Irradiance that such light gives an unknown on one level on the mean, one value per band; nothing where it stays a mean.
    #[inline]
    pub fn mean(&self, shape: TableShape, side: usize, unknown: usize, level: usize) -> &'a [f64] {
        if self.slots.is_empty() || !self.are_known(side) {
            return &[];
        }
        let start = (unknown * shape.levels + level) * shape.bands;
        self.reflected_irradiance.get(start..start + shape.bands).unwrap_or(&[])
    }

    /// Takes such light off the means in the gathered table of all unknowns; `side_of` gives an unknown's side of a facet.
    pub fn take_off(&self, shape: TableShape, side_of: impl Fn(usize) -> usize, table: &mut [f64]) {
        if self.slots.is_empty() {
            return;
        }
        for (unknown, values) in pieces(table, shape.stride()).enumerate() {
            for (level, part) in pieces(values, 3 * shape.bands).enumerate() {
                let reflected_irradiance = self.mean(shape, side_of(unknown), unknown, level);
                // rounding apart, no less than nothing is left
                part.iter_mut()
                    .zip(reflected_irradiance)
                    .for_each(|(mean, reflected_irradiance)| *mean = (*mean - reflected_irradiance).max(0.0));
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
        let mut slots = [0; 3 + 1 + IMAGE_PLACES * IMAGES_ROOM_LEAST];
        let mut reflected_irradiance = [1.0; 3];
        assert_eq!(places(sides), slots.len());
        let mut images_mut = SunImagesMut {
            slots: &mut slots,
            reflected_irradiance: &mut reflected_irradiance,
            spread: &mut [],
            reference: &[1.0],
            corners: &[],
        };
        for x in [0.0, 0.1, 0.1, 0.0, 0.2] {
            images_mut.note(sides, 1, pack(Vec3::new(x, 0.0, 1.0).normalize()), 0);
        }
        for x in 0..SIDE_IMAGES_MOST + 3 {
            images_mut.note(sides, 2, pack(Vec3::new(1e-3 * x as f64, 0.0, 1.0).normalize()), 0);
            images_mut.note(sides, 1, pack(Vec3::new(0.2, 0.0, 1.0).normalize()), 0);
        }
        images_mut.note(sides, 1, pack(Vec3::new(0.3, 0.0, 1.0).normalize()), 0);
        let shape = TableShape { levels: 1, bands: 1 };
        let images = SunImages::new(&slots, &reflected_irradiance, sides, sides, shape).unwrap();
        assert_eq!([0, 1, 2].map(|side| images.of(sides, side).count()), [0, 4, 0]);
        assert_eq!([0, 1, 2].map(|side| images.are_known(side)), [true, true, false]);
        let mut table = [3.0; 9];
        images.take_off(shape, |unknown| unknown, &mut table);
        assert_eq!([table[3], table[4], table[6]], [2.0, 3.0, 3.0]);
        assert!(SunImages::new(&slots[1..], &reflected_irradiance, sides, sides, shape).is_err());
        let none = SunImages::new(&[], &[], sides, sides, shape).unwrap();
        assert_eq!(none.of(sides, 1).count(), 0);
        none.take_off(shape, |unknown| unknown, &mut table);
        assert_eq!(table[3], 2.0);
    }
}
