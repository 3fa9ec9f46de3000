//! The plane model: circles and polylines in two dimensions, as the paper validates its method.

mod coupling;
mod scene;
mod solution;
mod types;
mod view;

pub use coupling::*;
pub use scene::*;
pub use solution::*;
pub use types::*;
pub use view::*;

use crate::memory::bytes;
use crate::run::{Runner, Start};
use crate::status::*;
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::plane::scene::PlaneScene;
use blik_kernel::plane::scratch::Scratch;
use core::ffi::c_void;
use core::ops::Range;

/// Rows or samples of one piece of work.
const PLANE_PIECE_ROWS: usize = 8;

/// What is done with a range of rows.
type Rows<'a> = dyn Fn(Range<usize>, &mut Scratch<'_>) -> Result<(), blik_error> + Sync + 'a;

/// Scratch memory of a stage, a part for each lane.
struct Lanes {
    start: Start<u8>,
    size: usize,
    count: usize,
}

/// Bytes of one lane's scratch memory.
fn lane_bytes(scene: &PlaneScene<'_>, cuts: usize) -> Result<usize, blik_error> {
    let size = Scratch::bytes(scene, cuts)?.checked_next_multiple_of(ALIGNMENT);
    size.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
}

impl Lanes {
    /// As many lanes of `size` bytes as the memory holds and the runner has.
    fn new(memory: &mut [u8], size: usize, runner: &Runner) -> Result<Lanes, blik_error> {
        let count = (memory.len() / size.max(1)).min(runner.lanes());
        if count == 0 {
            return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(size, memory.len()));
        }
        Ok(Lanes { start: Start(memory.as_mut_ptr()), size, count })
    }

    /// Calls `work` with ranges that cover all `rows` and scratch memory for a scene whose spans have up to `cuts`
    /// cuts.
    fn rows(
        &self,
        rows: usize,
        share: f64,
        (scene, cuts): (&PlaneScene<'_>, usize),
        runner: &mut Runner,
        work: &Rows<'_>,
    ) -> Result<(), blik_error> {
        runner.each(rows.div_ceil(PLANE_PIECE_ROWS), self.count, share, &|lane, item| {
            // SAFETY: a lane's part is used by that lane alone, one item after the other; there are `count` parts.
            let memory =
                unsafe { core::slice::from_raw_parts_mut(self.start.at(lane * self.size), self.size) };
            let mut scratch = Scratch::new(scene, cuts, memory)?;
            work(item * PLANE_PIECE_ROWS..((item + 1) * PLANE_PIECE_ROWS).min(rows), &mut scratch)
        })
    }
}

/// The part of an array that belongs to a range of rows of `stride` values each.
///
/// # Safety
/// The array has the rows of `range`, and nobody else uses these.
unsafe fn part<'a, T>(start: &Start<T>, range: &Range<usize>, stride: usize) -> &'a mut [T] {
    let count = range.end.saturating_sub(range.start);
    // SAFETY: by the caller's promise.
    unsafe { core::slice::from_raw_parts_mut(start.at(range.start * stride), count * stride) }
}

/// The caller's scratch memory, or with the standard library and a null pointer memory of the heap.
struct Scratchpad {
    #[cfg(feature = "std")]
    own: Option<crate::memory::Slab>,
    given: &'static mut [u8],
}

impl Scratchpad {
    /// # Safety
    /// `memory` is null or has `size` bytes that nobody else uses as long as this lives.
    unsafe fn new(memory: *mut c_void, size: usize, _wanted: usize) -> Result<Scratchpad, blik_error> {
        // SAFETY: by the caller's promise.
        let given = unsafe { bytes(memory, if memory.is_null() { 0 } else { size }) }?;
        #[cfg(feature = "std")]
        let own = if memory.is_null() { Some(crate::memory::Slab::new(_wanted)?) } else { None };
        Ok(Scratchpad {
            #[cfg(feature = "std")]
            own,
            given,
        })
    }

    fn bytes(&mut self) -> &mut [u8] {
        #[cfg(feature = "std")]
        if let Some(slab) = &mut self.own {
            // SAFETY: the slab lives as long as this, and is lent once at a time.
            return unsafe { slab.bytes_mut() };
        }
        self.given
    }
}
