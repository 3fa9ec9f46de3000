//! From a scene to its coupling: refinement of facets into elements, and the rows of all elements, in memory of the
//! caller's.
//!
//! Constants of this file are measured by `cargo bench --bench stages` (seconds and bytes).

use super::{Count, Executor, LANES_MOST, block_rows};
use crate::base::arena::{ALIGNMENT, plain_struct};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::coupling::pack::{move_down, pack};
use crate::coupling::plane_sides::PlaneSides;
use crate::coupling::rows::{CouplingRows, RowSettings, fill};
use crate::coupling::subdivide::SubdivisionTree;
use crate::coupling::{Block, row_builder};
use crate::rays::bvh::Bvh;
use crate::scene::Scene;
use crate::settings::{self, Settings};
use core::ops::Range;

/// Share of the progress that cutting the facets takes; their rows take the rest.
const CUT_SHARE: f64 = 0.1;

/// Share of the rows' progress that the first round of several lanes takes, which leaves few rows.
const FIRST_ROUND_SHARE: f64 = 0.9;

/// Records that a row is taken to have before any is done, and the least that is reserved for one.
const LEAST_RECORDS: usize = 64;

/// Refines `tree` until nothing is left to refine; returns the rays.
pub fn refine<X: Executor>(
    scene: &Scene<'_>,
    bvh: &Bvh<'_>,
    plane_sides: &PlaneSides<'_>,
    settings: &Settings,
    tree: &mut SubdivisionTree<'_>,
    run: &mut X,
) -> Result<u64, X::Error> {
    let probing = settings::probing(&settings.rows(scene));
    let mut rays = 0;
    loop {
        let (level, unevenness) = tree.newest_level();
        let Count(traced) = run.rows(unevenness, 1, CUT_SHARE, |range, out| {
            level.probe(scene, bvh, plane_sides, (probing, &settings.budget), range, out).map(Count)
        })?;
        rays += traced;
        if !tree.refine(scene) {
            return Ok(rays);
        }
    }
}

/// Memory in which blocks of rows stand one after the other.
pub trait BlockMemory: Send {
    /// Lends memory for one block, on a boundary of [`ALIGNMENT`]: `bytes`, or fewer where no more is left.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] of a system that gives none.
    fn lend(&mut self, bytes: usize) -> Result<&mut [u8], Error>;

    /// Keeps the first `bytes` of what was lent last.
    fn keep(&mut self, bytes: usize);
}

/// Most records that a row is given room for while it grows.
const MOST_UNMERGED: usize = 1 << 28;

impl CouplingRows<'_> {
    /// Pieces that the rows are split into, each with [`BlockMemory`] of its own.
    pub fn pieces(&self) -> usize {
        let all = self.elements.unknowns();
        all.div_ceil(block_rows(all))
    }

    /// Computes all rows, each piece in its own one of `memories`, of which there are [`CouplingRows::pieces`].
    pub fn fill<M: BlockMemory, X: Executor>(&self, memories: &mut [M], run: &mut X) -> Result<(), X::Error> {
        let all = self.elements.unknowns();
        let piece = block_rows(all);
        run.pieces(memories, 1, 1.0 - CUT_SHARE, |number, memory| {
            let range = number * piece..((number + 1) * piece).min(all);
            memory.first_mut().map_or(Ok(()), |memory| self.fill_range(range, memory))
        })
    }

    /// Computes rows of `range` in order, until all are done or the memory is full.
    fn fill_range(&self, range: Range<usize>, memory: &mut impl BlockMemory) -> Result<(), Error> {
        let CouplingRows { scene, elements, rows, .. } = self;
        let piece = block_rows(elements.unknowns());
        let (mut next, mut records, mut unmerged) = (range.start, LEAST_RECORDS, settings::unmerged(rows));
        while next < range.end {
            let until = (next + piece).min(range.end);
            let wanted = row_builder::bytes(until - next, records, unmerged, scene.bands())?;
            let wanted = wanted.next_multiple_of(ALIGNMENT);
            let block = memory.lend(wanted)?;
            match fill(self, next..until, block) {
                Ok(done) => {
                    next += done;
                    records = LEAST_RECORDS.max(Block::open(block)?.records() / done.max(1) + 16);
                    let size = pack(block)?;
                    memory.keep(size);
                }
                Err(Error::BufferTooSmall { .. }) if block.len() < wanted => return Ok(()),
                Err(Error::BufferTooSmall { .. }) if unmerged < MOST_UNMERGED => unmerged *= 4,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Places for blocks that [`CouplingRows::fill_in`] needs, with any number of lanes.
    pub fn places(&self) -> usize {
        places(self.elements.unknowns())
    }

    /// Computes all rows in one piece of memory, which starts on a boundary of [`ALIGNMENT`]: first each lane its share of
    /// the rows in its share of the memory, then one after the other what did not fit. Blocks are moved together after each
    /// round. With `fit`, rows have fewer rays where those wanted do not fit. Returns the blocks in the order of their rows,
    /// and the bytes that they take.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] with the bytes that all rows probably need.
    pub fn fill_in<'p, X: Executor>(
        &self,
        memory: &mut [u8],
        places: &'p mut [BlockPlace],
        fit: bool,
        run: &mut X,
    ) -> Result<(&'p [BlockPlace], usize), X::Error> {
        let mut of = *self;
        let (used, end) = loop {
            let mut packer = Packer { of: &of, memory: &mut *memory, places: &mut *places, used: 0, end: 0 };
            match packer.run(run)? {
                Ok(()) => break (packer.used, packer.end),
                Err(short) => match of.rows.fewer().filter(|_| fit) {
                    Some(fewer) => of.rows = fewer,
                    None => return Err(short.into()),
                },
            }
        };
        let done = places.head_mut(used);
        sort(done, |place| place.first);
        Ok((done, end))
    }
}

/// The most blocks that `rows` rows are spread over.
pub fn places(rows: usize) -> usize {
    2 * rows.div_ceil(block_rows(rows)) + 8 + LANES_MOST.min(rows.div_ceil(LANE_ROWS))
}

/// Fewest rows of a lane where the rows in one piece of memory are split over several.
const LANE_ROWS: usize = 16;

/// Bytes in which rows may begin: those of one piece, while the last of them grows.
pub fn least_bytes(scene: &Scene<'_>, rows: &RowSettings, unknowns: usize) -> Result<usize, Error> {
    row_builder::bytes(block_rows(unknowns), LEAST_RECORDS, settings::unmerged(rows), scene.bands())
}

plain_struct! {
    /// Where a finished block stands.
    pub struct BlockPlace {
        /// Its first row.
        pub first: usize,
        /// Its rows.
        pub rows: usize,
        /// Its first byte.
        pub at: usize,
        /// Its bytes.
        pub size: usize,
    }
}

impl BlockPlace {
    /// Opens it in the memory that [`CouplingRows::fill_in`] was given.
    pub fn open<'m>(&self, memory: &'m [u8]) -> Result<Block<'m>, Error> {
        Block::open(memory.part(self.at..self.at + self.size))
    }
}

/// One lane's share of the memory.
struct Region<'m> {
    memory: &'m mut [u8],
    at: usize,
}

impl BlockMemory for Region<'_> {
    fn lend(&mut self, bytes: usize) -> Result<&mut [u8], Error> {
        let end = self.memory.len().min(self.at.saturating_add(bytes));
        Ok(self.memory.part_mut(self.at.min(end)..end))
    }

    fn keep(&mut self, bytes: usize) {
        self.at += bytes.next_multiple_of(ALIGNMENT);
    }
}

/// Rows at work in one piece of memory.
struct Packer<'a> {
    of: &'a CouplingRows<'a>,
    memory: &'a mut [u8],
    /// The blocks so far.
    places: &'a mut [BlockPlace],
    used: usize,
    end: usize,
}

impl Packer<'_> {
    /// All rounds; how much memory is wanted where there is too little.
    fn run<X: Executor>(&mut self, run: &mut X) -> Result<Result<(), Error>, X::Error> {
        let all = self.of.elements.unknowns();
        let piece = block_rows(all);
        let lanes = run.lanes().min(LANES_MOST).min(all.div_ceil(LANE_ROWS)).max(1);
        let left = 1.0 - CUT_SHARE;
        let mut gap = 0..all;
        if lanes > 1 {
            self.round(gap, lanes, FIRST_ROUND_SHARE * left, run)?;
            gap = self.gap(0);
        }
        while !gap.is_empty() {
            let part = if lanes > 1 { 1.0 - FIRST_ROUND_SHARE } else { 1.0 };
            let share = part * left * gap.len() as f64 / all as f64;
            // one piece at a time, so that progress is told and a stop is heard
            let next = gap.start..gap.end.min(gap.start + piece);
            let own = share * next.len() as f64 / gap.len() as f64;
            if !self.round(next, 1, own, run)? {
                return Ok(Err(self.short()));
            }
            gap = self.gap(gap.start);
        }
        Ok(Ok(()))
    }

    /// One round with `lanes` lanes over one gap; true where it did any row.
    fn round<X: Executor>(
        &mut self,
        gap: Range<usize>,
        lanes: usize,
        share: f64,
        run: &mut X,
    ) -> Result<bool, X::Error> {
        let (of, before) = (self.of, self.used);
        let free = self.memory.len().saturating_sub(self.end);
        let part = (free / lanes.max(1)) & !(ALIGNMENT - 1);
        if part == 0 {
            return Ok(false);
        }
        let cut = |lane: usize| gap.start + gap.len() * lane / lanes.max(1);
        let regions = self.memory.part_mut(self.end..self.end + lanes * part);
        run.pieces(regions, part, share, |lane, memory| {
            let mut region = Region { memory, at: 0 };
            of.fill_range(cut(lane)..cut(lane + 1), &mut region)?;
            // a block of no rows behind the last
            region.lend(2 * ALIGNMENT)?.fill(0);
            Ok(())
        })?;
        let start = self.end;
        for lane in 0..lanes {
            let (mut at, region_end) = (start + lane * part, start + (lane + 1) * part);
            let mut next = cut(lane);
            while next < cut(lane + 1) && self.used < self.places.len() {
                let memory = self.memory.part(at..region_end);
                let Ok(block) = Block::open(memory) else { break };
                let rows = block.range();
                if rows.is_empty() || rows.start != next {
                    break;
                }
                let size = block.extent(memory).next_multiple_of(ALIGNMENT);
                move_down(self.memory, at, self.end, size);
                let place = BlockPlace { first: next, rows: rows.end - next, at: self.end, size };
                self.places.set(self.used, place);
                self.used += 1;
                self.end += size;
                (next, at) = (rows.end, at + size);
            }
        }
        Ok(self.used > before)
    }

    /// The first gap in the rows that are done at or after `from`.
    fn gap(&self, from: usize) -> Range<usize> {
        let all = self.of.elements.unknowns();
        let places = || self.places.iter().take(self.used);
        let mut start = from;
        while let Some(place) = places().find(|p| p.first <= start && start < p.first + p.rows) {
            start = place.first + place.rows;
        }
        let end = places().map(|p| p.first).filter(|first| *first >= start).min().unwrap_or(all);
        start.min(all)..end.min(all)
    }

    /// How much memory the rows done so far say that all need.
    fn short(&self) -> Error {
        let CouplingRows { scene, elements, rows, .. } = self.of;
        let (all, given) = (elements.unknowns(), self.memory.len());
        let done: usize = self.places.iter().take(self.used).map(|p| p.rows).sum();
        let per_row = self.end.checked_div(done).unwrap_or(0);
        let fixed =
            row_builder::bytes(1, LEAST_RECORDS, settings::unmerged(rows), scene.bands()).unwrap_or(0);
        let needed = per_row.saturating_mul(all).saturating_add(per_row * (all - done) / 4);
        Error::BufferTooSmall { needed: needed.saturating_add(2 * fixed).max(given + fixed), given }
    }
}

/// Insertion sort: the blocks come nearly in order, and are few.
fn sort(places: &mut [BlockPlace], key: impl Fn(&BlockPlace) -> usize) {
    for end in 1..places.len() {
        for at in (1..=end).rev() {
            let Some([a, b]) = places.get_mut(at - 1..=at) else { break };
            if key(a) <= key(b) {
                break;
            }
            core::mem::swap(a, b);
        }
    }
}
