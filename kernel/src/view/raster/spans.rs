//! Spans of a line across the object: the nearest facets, and where each begins and ends.
//!
//! Constants of this file are measured by `cargo test --test raster` (spans against rays).

use super::{Samples, Triangle, View};
use crate::base::arena::{Arena, Need, plain_struct};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::rays::bvh::Bvh;
use core::ops::Range;

plain_struct! {
    /// A piece of a line on which one facet is nearest.
    pub struct Span {
        /// Where it begins, in samples from the first column.
        pub start: f64,
        /// Where it ends.
        pub end: f64,
        /// Nearness at 0, and its slope.
        pub near: [f64; 2],
        /// The facet, with `BACK` where its back shows.
        pub key: u64,
    }
}

/// Bit of a span's key: of spans that coincide the one with the lower key shows.
const BACK: u64 = 1 << 32;

/// Most spans of a line.
const LINE_SPANS_MOST: usize = 1024;

/// Visible spans of some lines: the rows of [`Samples`], without shifts.
#[derive(Debug)]
pub struct Lines<'m> {
    spans: &'m mut [Span],
    /// Of each line, places of its spans from left to right, and then the places that are free.
    order: &'m mut [u16],
    /// Spans of each line, more than [`LINE_SPANS_MOST`]: too many; and where the latest stands.
    counts: &'m mut [[usize; 2]],
    spare: &'m mut [Span],
    first: isize,
}

impl<'m> Lines<'m> {
    /// Adds the memory of `lines` lines.
    pub const fn need(need: Need, lines: usize) -> Need {
        let size = lines.saturating_mul(LINE_SPANS_MOST);
        need.and::<Span>(size).and::<u16>(size).and::<[usize; 2]>(lines).and::<Span>(LINE_SPANS_MOST)
    }

    /// Takes the memory of `lines` lines from the arena.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] where the arena has less than [`Lines::need`].
    pub fn new(arena: &mut Arena<'m>, lines: usize) -> Result<Lines<'m>, Error> {
        let size = lines.saturating_mul(LINE_SPANS_MOST);
        let (spans, order, counts) = (arena.take(size)?, arena.take::<u16>(size)?, arena.take(lines)?);
        order.iter_mut().enumerate().for_each(|(n, place)| *place = (n % LINE_SPANS_MOST) as u16);
        Ok(Lines { spans, order, counts, spare: arena.take(LINE_SPANS_MOST)?, first: 0 })
    }

    /// The spans of a row of those found last, from left to right; `None` where they are too many.
    pub fn of(&self, row: isize) -> Option<impl Iterator<Item = Span> + Clone> {
        let line = (row - self.first) as usize;
        let [count, _] = self.counts.at(line);
        let spans = self.spans.part(line * LINE_SPANS_MOST..(line + 1) * LINE_SPANS_MOST);
        let order = self.order.part(line * LINE_SPANS_MOST..line * LINE_SPANS_MOST + count);
        (count <= LINE_SPANS_MOST).then(|| order.iter().map(|&place| spans.at(usize::from(place))))
    }

    /// Finds what is nearest on rows of parallel samples, as many as there is room for at most, of as many rows as
    /// `columns` in all.
    ///
    /// Error of a span's ends: some rounding of a coordinate over the sine of the angle at which line and edge, or two
    /// facets, cross. Facets seen edge-on are left out.
    #[inline(never)]
    pub fn find(&mut self, bvh: &Bvh<'_>, samples: &Samples, columns: usize, rows: Range<isize>) {
        self.first = rows.start;
        self.counts.fill([0; 2]);
        let room = rows.start + self.counts.len() as isize;
        let mut view = View::new(bvh, samples, (0, columns), rows.start..rows.end.min(room));
        // the same rounding whichever rows are found together
        view.middle.1 = 0.5 * columns as f64;
        view.size = 2.0 + columns as f64;
        bvh.within(&view.region(), |facet| {
            if let Some((corners, normal)) = bvh.corners(facet)
                && let Some(triangle) = Triangle::new(&view, corners, normal)
                && !triangle.thin
            {
                let back = normal.dot(samples.forward) > 0.0;
                let key = u64::from(facet) | if back { BACK } else { 0 };
                for row in triangle.rows.clone() {
                    self.add(&view, &triangle, key, row);
                }
            }
            true
        });
    }

    /// Adds a facet to a line.
    fn add(&mut self, view: &View<'_>, triangle: &Triangle, key: u64, row: isize) {
        let Some((start, end)) = triangle.ends(view, row) else { return };
        let (x, y) = (-view.middle.0, row as f64 - view.middle.1);
        let [slope, down, level] = triangle.near;
        let near = [level + down * y + slope * x, slope];
        let new = Span { start: start - x, end: end - x, near, key };
        let line = (row - self.first) as usize;
        let Some([count, near]) = self.counts.get_mut(line) else { return };
        let all = line * LINE_SPANS_MOST..(line + 1) * LINE_SPANS_MOST;
        let mut own = Line { spans: self.spans.part_mut(all.clone()), order: self.order.part_mut(all) };
        *count = own.insert((*count, near), &new, self.spare, view.depth).unwrap_or(LINE_SPANS_MOST + 1);
    }
}

/// One line's spans and their order.
struct Line<'a> {
    spans: &'a mut [Span],
    order: &'a mut [u16],
}

impl Line<'_> {
    /// The span at a place in the order.
    #[inline]
    fn at(&self, place: usize) -> Span {
        self.spans.at(usize::from(self.order.at(place)))
    }

    /// The first of `count` spans that ends beyond x, sought from `near` on: facets that follow each other in the tree lie
    /// near each other.
    #[inline]
    fn find(&self, count: usize, near: usize, x: f64) -> usize {
        let mut place = near.min(count);
        while place < count && self.at(place).end <= x {
            place += 1;
        }
        while place > 0 && self.at(place - 1).end > x {
            place -= 1;
        }
        place
    }

    /// Puts a span among `count` others, sought from `near` on; returns how many there are then, `None` where there is no
    /// room.
    fn insert(
        &mut self,
        (count, near): (usize, &mut usize),
        new: &Span,
        spare: &mut [Span],
        margin: f64,
    ) -> Option<usize> {
        if count > LINE_SPANS_MOST {
            return None;
        }
        let first = self.find(count, *near, new.start);
        *near = first;
        let mut pieces = Pieces { spans: spare, count: 0, changed: false };
        let (mut at, mut last) = (new.start, first);
        while last < count {
            let old = &self.at(last);
            if old.start >= new.end {
                break;
            }
            last += 1;
            let (start, end) = (old.start.max(new.start), old.end.min(new.end));
            pieces.push(new, at, start, true)?;
            pieces.push(old, old.start, start, false)?;
            let (left, right) = (new.lead(old, start), new.lead(old, end));
            if left.max(right) <= margin && (left.min(right) < -margin || old.key < new.key) {
                pieces.push(old, start, end, false)?;
            } else if left.min(right) >= -margin {
                pieces.push(new, start, end, true)?;
            } else {
                // the same whichever of both came first
                let cross = -(new.near[0] - old.near[0]) / (new.near[1] - old.near[1]);
                let cross = if cross > start { cross.min(end) } else { start };
                let (one, other) = if left > right { (new, old) } else { (old, new) };
                pieces.push(one, start, cross, true)?;
                pieces.push(other, cross, end, true)?;
            }
            pieces.push(old, end, old.end, false)?;
            at = end;
        }
        pieces.push(new, at, new.end, true)?;
        if !pieces.changed {
            return Some(count);
        }
        let (made, gone) = (pieces.count, last - first);
        let total = count - gone + made;
        if total > LINE_SPANS_MOST {
            return None;
        }
        // free places come in, or go
        if made > gone {
            turn(self.order.part_mut(last..total), total - count);
        } else {
            let part = self.order.part_mut(first + made..count);
            turn(part, part.len().saturating_sub(count - total));
        }
        for (place, piece) in self.order.part(first..first + made).iter().zip(&*spare) {
            self.spans.set(usize::from(*place), *piece);
        }
        Some(total)
    }
}

/// Puts the last `count` before the others, as `rotate_right` does, in which a panic may be reached.
fn turn(places: &mut [u16], count: usize) {
    places.reverse();
    let (head, tail) = places.split_at_mut(count.min(places.len()));
    head.reverse();
    tail.reverse();
}

impl Span {
    /// The facet.
    #[inline]
    pub fn facet(&self) -> u32 {
        self.key as u32
    }

    /// How much nearer it is than another, at x.
    #[inline]
    fn lead(&self, other: &Span, x: f64) -> f64 {
        (self.near[0] - other.near[0]) + (self.near[1] - other.near[1]) * x
    }
}

/// Pieces from left to right.
struct Pieces<'s> {
    spans: &'s mut [Span],
    count: usize,
    /// Whether any differs from what was there.
    changed: bool,
}

impl Pieces<'_> {
    #[inline]
    fn push(&mut self, of: &Span, start: f64, end: f64, new: bool) -> Option<()> {
        if start >= end {
            return Some(());
        }
        self.changed |= new;
        if let Some(last) = self.count.checked_sub(1).and_then(|n| self.spans.get_mut(n))
            && last.key == of.key
            && last.end == start
        {
            last.end = end;
            return Some(());
        }
        *self.spans.get_mut(self.count)? = Span { start, end, ..*of };
        self.count += 1;
        Some(())
    }
}
