//! Bundles: a row's escapes to the sky in little memory. Most rays of a row count alike and differ in their directions
//! alone.
//!
//! While a row grows an escape is a [`Record`]; in a finished row rays of the same path, weight, gradient and half
//! differences are a bundle, and each costs the four bytes of its direction. Bundles stand where the row's records did:
//! 32-bit words, each bundle a head and its directions, zeros to the end of the last record.

use super::Record;
use crate::base::arena;
use crate::base::index::{Index, IndexMut, copy};
use crate::base::math::Vec3;
use crate::base::octahedron::{self, SKY_BITS};
use crate::scene::pose::Pose;
use core::cmp::Ordering;

/// Words of a bundle's head: count, path, weight (2), gradient (2), half differences (4).
const HEAD: usize = 10;

/// The word of a head that holds the path.
const PATH_WORD: usize = 1;

/// Words of a record.
const RECORD_WORDS: usize = size_of::<Record>() / size_of::<u32>();

/// Rays that leave a row by the same path and count alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bundle<'m> {
    /// Number of their path.
    pub path: u16,
    /// Share of the cosine hemisphere of each ray, mean over the element.
    pub weight: f64,
    /// Change of the weight with the local coordinates.
    pub gradient: [f32; 2],
    /// As [`Record::half_differences`].
    pub half_differences: [f32; 4],
    /// The rays' directions, packed; of a row without directions, one ray for all.
    pub packed: &'m [u32],
}

impl<'m> Bundle<'m> {
    /// Rays.
    #[inline(always)]
    pub fn rays(&self) -> f64 {
        self.packed.len() as f64
    }

    /// Share of the cosine hemisphere of all rays.
    #[inline(always)]
    pub fn total(&self) -> f64 {
        self.rays() * self.weight
    }

    /// The rays' directions, to 6.6e-5 rad.
    pub fn directions(&self) -> impl Iterator<Item = Vec3> + use<'m> {
        self.packed.iter().map(|packed| octahedron::unpack::<SKY_BITS>(u64::from(*packed)))
    }
}

/// The bundles of a row.
#[derive(Clone, Copy, Debug)]
pub struct Bundles<'m>(&'m [u32]);

impl<'m> Bundles<'m> {
    /// Those that stand in the place of these records.
    #[inline(always)]
    pub fn new(records: &'m [Record]) -> Bundles<'m> {
        Bundles(arena::words(records))
    }

    /// Records' worth of room.
    pub(super) fn room(self) -> usize {
        self.0.len() / RECORD_WORDS
    }

    /// Copies them to as many records, the paths by `path`, the directions turned as a part is; `None` where the path is.
    pub(super) fn copy(
        self,
        to: &mut [Record],
        mut path: impl FnMut(u16) -> Option<u16>,
        pose: Option<&Pose>,
    ) -> Option<()> {
        let (all, to) = (self.0.len(), arena::words_mut(to));
        copy(to, self.0);
        let mut rest = self;
        loop {
            let at = all - rest.0.len();
            let Some(bundle) = rest.next() else { return Some(()) };
            to.set(at + PATH_WORD, u32::from(path(bundle.path)?));
            let Some(pose) = pose else { continue };
            let turned = bundle.directions().map(|d| octahedron::pack::<SKY_BITS>(pose.turn(d)) as u32);
            to.part_mut(at + HEAD..all).iter_mut().zip(turned).for_each(|(to, packed)| *to = packed);
        }
    }

    /// Words that belong to no bundle: zeros, where all is sound.
    pub(super) fn rest(mut self) -> &'m [u32] {
        while self.next().is_some() {}
        self.0
    }
}

impl<'m> Iterator for Bundles<'m> {
    type Item = Bundle<'m>;

    #[inline(always)]
    fn next(&mut self) -> Option<Bundle<'m>> {
        let (&[count, path, w0, w1, g0, g1, c0, c1, c2, c3], rest) = self.0.split_first_chunk::<HEAD>()?;
        if count == 0 {
            return None;
        }
        let (packed, rest) = rest.split_at_checked(count as usize)?;
        self.0 = rest;
        Some(Bundle {
            path: path as u16,
            weight: f64::from_bits(u64::from(w0) | u64::from(w1) << 32),
            gradient: [g0, g1].map(f32::from_bits),
            half_differences: [c0, c1, c2, c3].map(f32::from_bits),
            packed,
        })
    }
}

/// The head of a record's bundle, but for the count.
fn head(record: &Record) -> [u32; HEAD] {
    let weight = record.weight.to_bits();
    let [g0, g1] = record.gradient.map(f32::to_bits);
    let [c0, c1, c2, c3] = record.half_differences.map(f32::to_bits);
    [0, u32::from(record.path()), weight as u32, (weight >> 32) as u32, g0, g1, c0, c1, c2, c3]
}

/// An order in which escapes of the same path that count alike are neighbours.
#[inline]
pub(super) fn order(a: &Record, b: &Record) -> Ordering {
    let of = |r: &Record| {
        (r.weight.to_bits(), r.gradient.map(f32::to_bits), r.half_differences.map(f32::to_bits), r.key)
    };
    of(a).cmp(&of(b))
}

/// Turns escapes in that order into bundles, in their place; how many records' room they need.
pub(super) fn pack(escapes: &mut [Record]) -> usize {
    let (mut at, mut last, mut own) = (0, 0, [0; HEAD]);
    for number in 0..escapes.len() {
        let record = escapes.at(number);
        // one record makes 11 words of its 14 at most: what is written has been read
        let words = arena::words_mut(escapes);
        let next = head(&record);
        // one by one: a comparison of arrays is a call
        if at == 0 || next.iter().zip(&own).any(|(a, b)| a != b) {
            (last, own) = (at, next);
            copy(words.part_mut(at..at + HEAD), &own);
            at += HEAD;
        }
        words.set(last, words.at(last) + 1);
        words.set(at, record.packed());
        at += 1;
    }
    let needed = at.div_ceil(RECORD_WORDS);
    arena::words_mut(escapes).part_mut(at..needed * RECORD_WORDS).fill(0);
    needed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_back_from_bundles() {
        let escape = |i: u32| {
            let angle = f64::from(i) * 0.37;
            let direction = Vec3::new(angle.cos(), angle.sin(), 0.3).normalize();
            let record = Record::escape(Some(direction), (i % 3) as u16, 0.25, [i as f32 % 2.0, 1.0]);
            Record { half_differences: [0.5, -0.0, 0.0, i as f32 % 2.0], ..record }
        };
        for count in [0, 1, 2, 40] {
            let mut records = [Record::default(); 40];
            records.iter_mut().zip(0..).for_each(|(record, i)| *record = escape(i));
            let records = &mut records[..count];
            records.sort_by(|a, b| a.path().cmp(&b.path()).then(order(a, b)));
            let mut before = [Record::default(); 40];
            before[..count].copy_from_slice(records);
            let needed = pack(records);
            assert!(needed <= count && (count < 40 || needed < 10), "{needed} for {count}");
            let bundles = Bundles::new(&records[..needed]);
            let mut before = before[..count].iter();
            for bundle in bundles {
                for packed in bundle.packed {
                    let record = before.next().unwrap();
                    let own = Record { key: record.key, weight: bundle.weight, ..Record::default() };
                    let own = Record {
                        gradient: bundle.gradient,
                        half_differences: bundle.half_differences,
                        ..own
                    };
                    assert_eq!(&own, record);
                    assert_eq!((bundle.path, *packed), (record.path(), record.packed()));
                }
                // as far apart as directions are rounded
                let (kept, given) =
                    (bundle.directions().next().unwrap(), Vec3::new(0.0, 0.0, 0.3 / 1.09f64.sqrt()));
                assert!((kept.z - given.z).abs() < 6.6e-5);
            }
            assert!(before.next().is_none());
            assert!(bundles.rest().iter().all(|word| *word == 0));
            assert_eq!(bundles.count(), if count == 40 { 6 } else { count });
        }
    }
}
