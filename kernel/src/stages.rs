//! The driver of the stages: what is computed in which order, over memory that the caller hands in and by whoever runs
//! ranges of rows for it.
//!
//! The owning layer runs ranges on its pool, the C library on its caller's threads, tests in a loop ([`Executor`]). All
//! else is decided here, so that all of them give the same bits.
//!
//! Constants of this file are measured by `cargo bench --bench stages` (seconds on all lanes).

mod adjoint;
mod beams;
mod geometry;
mod light;
mod lights;
mod solve;
mod straight;
mod update;

pub use crate::coupling::rows::CouplingRows;
pub use adjoint::{AdjointMemory, AdjointReport};
pub use beams::Beams;
pub use geometry::{BlockMemory, BlockPlace, least_bytes, places, refine};
pub use light::{Lighting, Scratch, Sizes};
pub use lights::{Alone, Explained, KeptSky, Lights};
pub use update::Update;

use crate::base::error::Error;
use core::num::NonZeroUsize;
use core::ops::Range;

/// Runs the ranges of a stage, one after the other or at once.
pub trait Executor {
    /// Errors: the kernel's, and those of the executor, as that it was told to stop.
    type Error: From<Error>;

    /// Ranges that run at once.
    fn lanes(&self) -> usize;

    /// Calls `work` once with each piece of `out`, of `piece` values each but for the last, and the piece's number; returns
    /// what they gave, merged in any order. `share` is the part of the whole call's progress, 0 to 1.
    fn pieces<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        piece: usize,
        share: f64,
        work: impl Fn(usize, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Self::Error>;

    /// Splits the rows of `out` (`stride` values each) into ranges and calls `work` with each of them and its part.
    fn rows<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        stride: usize,
        share: f64,
        work: impl Fn(Range<usize>, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Self::Error> {
        // a divisor that needs no check
        let stride = NonZeroUsize::new(stride).unwrap_or(NonZeroUsize::MIN);
        let rows = (out.len() / stride).div_ceil((RANGES_PER_LANE * self.lanes()).max(1));
        let rows = rows.clamp(RANGE_ROWS_FEWEST, RANGE_ROWS_MOST);
        self.pieces(out, rows * stride.get(), share, |number, part| {
            work(number * rows..number * rows + part.len() / stride, part)
        })
    }
}

/// Ranges that a lane is given of each stage: enough that lanes which are done early find more.
const RANGES_PER_LANE: usize = 16;

/// Fewest rows of a range: below, starting it costs as much as the rows.
const RANGE_ROWS_FEWEST: usize = 16;

/// Most rows of a range: above, progress is told too seldom.
const RANGE_ROWS_MOST: usize = 4096;

/// A result of ranges beside their output. Merging must give the same whatever the order.
pub trait Merge: Default + Send {
    /// Takes in another range's result.
    fn merge(&mut self, other: Self);
}

impl Merge for () {
    fn merge(&mut self, (): ()) {}
}

/// A count, as of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count(pub u64);

impl Merge for Count {
    fn merge(&mut self, other: Count) {
        self.0 += other.0;
    }
}

/// The largest of values that are not negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Largest(pub f64);

impl Merge for Largest {
    fn merge(&mut self, other: Largest) {
        self.0 = f64::max(self.0, other.0);
    }
}

/// Largest number of lanes that an [`Executor`] may have: each takes rows and scratch memory of its own.
pub const LANES_MOST: usize = 256;

/// Rows that one piece of work fills: enough pieces to balance two dozen threads, large enough that a block's head does not
/// count.
pub fn block_rows(rows: usize) -> usize {
    rows.div_ceil(ROW_BLOCKS).clamp(BLOCK_ROWS_FEWEST, BLOCK_ROWS_MOST)
}

/// Number of blocks that the rows of a scene are split into: enough to balance two dozen threads.
const ROW_BLOCKS: usize = 256;

/// Fewest rows of one block: its head is not to count.
const BLOCK_ROWS_FEWEST: usize = 16;

/// Most rows of one block: a bound on its memory.
const BLOCK_ROWS_MOST: usize = 1024;
