//! Packing of a finished block: its parts are moved together, and the unused memory is given back.

use super::mirror_path::MirrorPath;
use super::{Head, Record, Row};
use crate::base::arena::{ALIGNMENT, Arena, View};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};

/// Bytes of a block of rows, paths and records without room to spare, on a boundary of
/// [`ALIGNMENT`].
pub fn bytes(rows: usize, paths: usize, bands: usize, records: usize) -> usize {
    starts(rows, paths, bands)[3] + records * size_of::<Record>()
}

/// Where rows, paths, products and records start.
fn starts(rows: usize, paths: usize, bands: usize) -> [usize; 4] {
    let after = |start: usize, size: usize| (start + size).next_multiple_of(ALIGNMENT);
    let at_rows = after(0, size_of::<Head>());
    let at_paths = after(at_rows, (rows + 1) * size_of::<Row>());
    let at_products = after(at_paths, paths * size_of::<MirrorPath>());
    [at_rows, at_paths, at_products, after(at_products, paths * bands * size_of::<f64>())]
}

/// Moves the rows, paths and records of the finished block in `memory`, which starts on a boundary of [`ALIGNMENT`],
/// together at its start; the bytes that it then needs.
pub fn pack(memory: &mut [u8]) -> Result<usize, Error> {
    let mut head = View::new(memory).take::<Head>(1)?.first().copied().unwrap_or_default();
    let (bands, paths, rows) = (head.bands as usize, head.paths as usize, head.rows as usize);
    let from = starts(head.room as usize, head.capacity as usize, bands);
    let to = starts(rows, paths, bands);
    let records = head.records as usize;
    let sizes = [
        (rows + 1) * size_of::<Row>(),
        paths * size_of::<MirrorPath>(),
        paths * bands * size_of::<f64>(),
        records * size_of::<Record>(),
    ];
    // every part moves down, and none over one that is still to be moved
    for ((from, to), size) in from.into_iter().zip(to).zip(sizes) {
        if from + size > memory.len() || to > from {
            return Err(Error::Mismatch { what: "coupling block" });
        }
        move_down(memory, from, to, size);
    }
    (head.room, head.capacity) = (head.rows, head.paths);
    if let Some(place) = Arena::new(memory, 0)?.take::<Head>(1)?.first_mut() {
        *place = head;
    }
    Ok(bytes(rows, paths, bands, records))
}

/// As `copy_within` toward the front, without a way to panic.
pub fn move_down(memory: &mut [u8], from: usize, to: usize, size: usize) {
    let Some(part) = memory.get_mut(to..) else { return };
    let Some(back) = from.checked_sub(to).filter(|back| *back > 0) else { return };
    // word by word where both start on one: blocks do
    if back.is_multiple_of(8) && size.is_multiple_of(8) {
        let (paths, _) = part.as_chunks_mut::<8>();
        for at in 0..size / 8 {
            paths.set(at, paths.at(at + back / 8));
        }
    } else {
        for at in 0..size {
            part.set(at, part.at(at + back));
        }
    }
}
