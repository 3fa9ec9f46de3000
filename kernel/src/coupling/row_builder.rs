//! Writes rows of records into a block of caller memory.
//!
//! Constants of this file are measured by `cargo test --test furnace` (what cut chains leave out).

use super::kept::Kept;
use super::mirror_path::{MirrorPath, MirrorPaths, STRAIGHT};
use super::{BLOCKED, ENCLOSED, Head, Record, Row, RowView, bundle};
use crate::base::arena::{ALIGNMENT, Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::sort;
use crate::coupling::plane_sides::SIDE_SET_WORDS;
use crate::scene::Scene;
use crate::scene::pose::Pose;
use core::cmp::Ordering;
use core::ops::Range;

/// Bytes of a block that holds `rows` rows of about `records` records each; a row needs room for `unmerged`
/// records while it grows.
pub fn bytes(rows: usize, records: usize, unmerged: usize, bands: usize) -> Result<usize, Error> {
    let all = rows.saturating_mul(records).saturating_add(unmerged);
    let capacity = path_capacity(all.saturating_mul(2 * size_of::<Record>()), bands);
    // behind the block, a set of sides while rows are made
    fixed(rows, capacity, bands).and::<Record>(all).and::<u64>(2 * ALIGNMENT / 8 + SIDE_SET_WORDS).bytes()
}

/// Paths that a block of `bytes` bytes has room for: 1/16 of it.
fn path_capacity(bytes: usize, bands: usize) -> usize {
    (bytes / 16 / size_of::<MirrorPath>().saturating_add(bands.saturating_mul(8)).max(1))
        .clamp(16, BLOCKED as usize)
}

fn fixed(rows: usize, capacity: usize, bands: usize) -> Need {
    Need::new().and::<Head>(1).and::<Row>(rows + 1).and::<MirrorPath>(capacity).and::<f64>(capacity * bands)
}

/// Largest remainder of a chain's light that is taken to go on as it went so far; beyond, what the chain met says too
/// little of the rest.
pub(crate) const CLOSED_REMAINDER_MOST: f64 = 0.5;

/// The rows of a block while they are being written.
#[derive(Debug)]
pub struct RowBuilder<'m> {
    /// The paths of the block.
    pub paths: MirrorPaths<'m>,
    head: &'m mut Head,
    rows: &'m mut [Row],
    records: &'m mut [Record],
    start: usize,
    used: usize,
    done: usize,
}

impl<'m> RowBuilder<'m> {
    /// An empty block for the rows of `range`.
    pub fn new(
        range: &Range<usize>,
        bands: usize,
        directional: bool,
        memory: &'m mut [u8],
    ) -> Result<RowBuilder<'m>, Error> {
        let capacity = path_capacity(memory.len(), bands);
        let needed = fixed(range.len(), capacity, bands).and::<Record>(64).bytes()?;
        let mut arena = Arena::new(memory, needed)?;
        let head = arena.take::<Head>(1)?;
        let rows = arena.take::<Row>(range.len() + 1)?;
        let paths = arena.take::<MirrorPath>(capacity)?;
        let products = arena.take::<f64>(capacity * bands)?;
        let room = arena.left().saturating_sub(ALIGNMENT) / size_of::<Record>();
        let records = arena.take::<Record>(room.min(u32::MAX as usize))?;
        let head = head.first_mut().ok_or(Error::BufferTooSmall { needed, given: 0 })?;
        *head = Head {
            first: range.start as u64,
            capacity: capacity as u64,
            bands: bands as u64,
            room: range.len() as u64,
            directional: u64::from(directional),
            ..Head::default()
        };
        Ok(RowBuilder {
            paths: MirrorPaths::new(paths, products, bands),
            head,
            rows,
            records,
            start: 0,
            used: 0,
            done: 0,
        })
    }

    /// Adds a record to the present row; `None` where the memory is full.
    #[inline]
    pub fn push(&mut self, record: Record) -> Option<()> {
        *self.records.get_mut(self.used)? = record;
        self.used += 1;
        Some(())
    }

    /// Records so far.
    pub fn used(&self) -> usize {
        self.used
    }

    /// Closes a chain that has become dim, whose records are those from `start` on: the rest, `rest` of the light that
    /// it set out for, is taken to go on as it went so far, S + rest S + rest^2 S ... = S/(1 - rest). Where all facets
    /// shine alike that is exact; no more than `rest` is added anywhere.
    pub fn close(&mut self, start: usize, rest: f64) {
        if !(0.0..=CLOSED_REMAINDER_MOST).contains(&rest) {
            return;
        }
        let all = 1.0 / (1.0 - rest);
        for record in self.records.part_mut(start..self.used).iter_mut().filter(|r| !r.is_escape()) {
            record.weight *= all;
            record.moment = record.moment.map(|m| (f64::from(m) * all) as f32);
        }
    }

    /// The path with one more mirror; `Err(true)` where the chain must end, since one row alone has used up all
    /// paths; `Err(false)` where more memory or an empty block helps.
    #[inline]
    pub fn extend_path(&mut self, path: u16, class: u32, scene: &Scene<'_>) -> Result<u16, bool> {
        let alone = self.done == 0;
        self.paths.push(path, class, scene).ok_or_else(|| alone && self.paths.is_exhausted())
    }

    /// Drops the present row.
    pub fn drop_row(&mut self) {
        self.used = self.start;
    }

    /// Records of the present row so far.
    pub fn present(&self) -> usize {
        self.used - self.start
    }

    /// Sorts the records of the present row and adds up those that `join` takes for the same, so that a row of many rays
    /// needs no memory for each; returns how many are left.
    pub fn merge_duplicates(&mut self, join: impl Fn(&mut Record, &Record) -> bool) -> usize {
        let row = self.records.part_mut(self.start..self.used);
        let paths = &self.paths;
        sort::sort(row, &|a: &Record, b: &Record| order(paths, a, b));
        let kept = merge(row, join);
        self.used = self.start + kept;
        kept
    }

    /// Ends the present row with what `finish` leaves of each record: sorts the records and adds up those that `join`
    /// takes for the same.
    pub fn end_row(
        &mut self,
        stats: Row,
        finish: impl Fn(Record) -> Option<Record>,
        join: impl Fn(&mut Record, &Record) -> bool,
    ) {
        let row = self.records.part_mut(self.start..self.used);
        let mut kept = 0;
        for i in 0..row.len() {
            if let Some(record) = finish(row.at(i)) {
                row.set(kept, record);
                kept += 1;
            }
        }
        let row = row.head_mut(kept);
        let paths = &self.paths;
        sort::sort(row, &|a: &Record, b: &Record| order(paths, a, b));
        let kept = merge(row, join);
        let row = row.head_mut(kept);
        let targets = row.partition_point(|r| !r.is_escape());
        let escapes = self.start + targets;
        let enclosed = stats.state == ENCLOSED;
        let path = if enclosed { STRAIGHT } else { BLOCKED };
        let own = row.part(targets..kept).iter().filter(|r| r.path() == path).map(|r| r.weight).sum::<f64>();
        let blocked = if enclosed { 1.0 - own } else { own };
        let packed = bundle::pack(row.part_mut(targets..kept));
        self.rows.set(self.done, Row { start: self.start as u32, escapes: escapes as u32, blocked, ..stats });
        self.done += 1;
        self.start = escapes + packed;
        self.used = self.start;
    }

    /// Adds a row of another coupling as it is, its paths by their classes now, the directions of its escapes turned as
    /// its part is; `None` where the memory is full.
    pub(super) fn copy_row(
        &mut self,
        row: &RowView<'_>,
        (kept, pose): (&Kept<'_>, Option<&Pose>),
        scene: &Scene<'_>,
    ) -> Option<()> {
        let mut known = [(STRAIGHT, STRAIGHT); PATHS_KNOWN];
        let paths = &mut self.paths;
        let mut path = |old: u16| carry(paths, (row, kept, scene), old, &mut known);
        for record in row.targets {
            let key = record.key & !u64::from(u16::MAX) | u64::from(path(record.path())?);
            *self.records.get_mut(self.used)? = Record { key, ..*record };
            self.used += 1;
        }
        let escapes = self.used;
        let end = escapes + row.escapes.room();
        let pose = pose.filter(|_| self.head.directional != 0);
        row.escapes.copy(self.records.get_mut(escapes..end)?, path, pose)?;
        self.used = end;
        self.rows.set(self.done, Row { start: self.start as u32, escapes: escapes as u32, ..row.row });
        self.done += 1;
        self.start = self.used;
        Some(())
    }

    /// Ends the block and returns the number of rows in it.
    pub fn end(self) -> usize {
        if let Some(end) = self.rows.get_mut(self.done) {
            end.start = self.used as u32;
        }
        self.head.rows = self.done as u64;
        self.head.records = self.used as u64;
        self.head.paths = self.paths.used() as u64;
        self.done
    }
}

/// Paths of a copied row that are remembered: rows name the same few again and again.
const PATHS_KNOWN: usize = 64;

/// The path in `paths` that a copied row's becomes, all of whose mirrors are by their classes now; `None` where the table is
/// full. `known` holds paths of the row and what they became.
fn carry(
    paths: &mut MirrorPaths<'_>,
    (row, kept, scene): (&RowView<'_>, &Kept<'_>, &Scene<'_>),
    path: u16,
    known: &mut [(u16, u16)],
) -> Option<u16> {
    if matches!(path, STRAIGHT | BLOCKED) {
        return Some(path);
    }
    let (mut at, mut steps) = (path, 0);
    let mut new = loop {
        let (old, new) = known.at(at as usize % PATHS_KNOWN);
        if old == at {
            break new;
        }
        (at, steps) = (row.path(at).parent, steps + 1);
        if at == STRAIGHT {
            break STRAIGHT;
        }
    };
    for back in (0..steps).rev() {
        // links lead from the last mirror to the first
        let at = (0..back).fold(path, |at, _| row.path(at).parent);
        new = paths.push(new, kept.class(row.path(at).class), scene)?;
        known.set(at as usize % PATHS_KNOWN, (at, new));
    }
    Some(new)
}

/// Adds up neighbours that are the same and returns how many records are left. Their weights are summed with what each
/// addition rounds off: thousands of equal ones would all be rounded the same way.
fn merge(row: &mut [Record], join: impl Fn(&mut Record, &Record) -> bool) -> usize {
    let (mut kept, mut lost) = (0usize, 0.0);
    for i in 0..row.len() {
        let record = row.at(i);
        if let Some(last) = row.get_mut(kept.wrapping_sub(1)) {
            let before = last.weight;
            if join(last, &record) {
                // Knuth's two-sum
                let added = last.weight - before;
                lost += (before - (last.weight - added)) + (record.weight - added);
                continue;
            }
            last.weight += core::mem::take(&mut lost);
        }
        row.set(kept, record);
        kept += 1;
    }
    if let Some(last) = row.get_mut(kept.wrapping_sub(1)) {
        last.weight += lost;
    }
    kept
}

/// The order of a row: targets by what they are, then by path; behind them escapes by path, then as bundles need it;
/// whatever the paths' numbers in this block.
fn order(paths: &MirrorPaths<'_>, a: &Record, b: &Record) -> Ordering {
    let escape = a.is_escape();
    let by_path = || match (a.path(), b.path()) {
        (a, b) if a == b => Ordering::Equal,
        (BLOCKED, _) => Ordering::Greater,
        (_, BLOCKED) => Ordering::Less,
        (a, b) => paths.compare(a, b),
    };
    let first = if escape && b.is_escape() { Ordering::Equal } else { (a.key >> 16).cmp(&(b.key >> 16)) };
    first.then_with(by_path).then_with(|| if escape { bundle::order(a, b) } else { Ordering::Equal })
}
