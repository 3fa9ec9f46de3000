//! Caller memory: how much a stage needs, and carving it into slices.

use crate::base::error::Error;
use crate::base::index::copy;

/// Every slice starts on a boundary of this many bytes (a cache line, and the widest SIMD register).
pub const ALIGNMENT: usize = 64;

/// Types without padding for which all bytes, whatever they hold, are a value.
///
/// # Safety
/// Every bit pattern must be a valid value of the type, and the type must have no padding bytes.
#[allow(unsafe_code)]
pub unsafe trait Plain: Copy + Send + Sync + 'static {}

/// Defines a `repr(C)` struct of plain fields that is plain itself.
macro_rules! plain_struct {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $t:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name { $($(#[$field_meta])* pub $field: $t,)* }
        const _: () = {
            const fn plain<T: $crate::base::arena::Plain>() -> usize { size_of::<T>() }
            assert!(size_of::<$name>() == 0 $(+ plain::<$t>())*, "no padding");
        };
        // SAFETY: all fields are plain, and there is no padding between or after them (both checked above).
        #[allow(unsafe_code)]
        unsafe impl $crate::base::arena::Plain for $name {}
    };
}
pub(crate) use plain_struct;

/// Defines a struct of arrays of numbers that is plain, too large for [`plain_struct`]'s default value.
macro_rules! plain_table {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $t:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name { $($(#[$field_meta])* pub $field: $t,)* }
        const _: () = {
            const fn plain<T: $crate::base::arena::Plain>() -> usize { size_of::<T>() }
            assert!(size_of::<$name>() == 0 $(+ plain::<$t>())*, "no padding");
        };
        // SAFETY: all fields are plain, and there is no padding between or after them (both checked above).
        #[allow(unsafe_code)]
        unsafe impl $crate::base::arena::Plain for $name {}
    };
}
pub(crate) use plain_table;

macro_rules! plain {
    ($($t:ty),*) => { $(
        // SAFETY: a number, or a vector of them, has no padding and any bit pattern is one.
        #[allow(unsafe_code)]
        unsafe impl Plain for $t {}
    )* };
}
plain!(u8, u16, u32, u64, i32, usize, f32, f64, glam::DVec3);

// SAFETY: an array of plain values is plain.
#[allow(unsafe_code)]
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}

/// Plain values as 32-bit words, in the machine's order.
#[allow(unsafe_code)]
pub(crate) fn words<T: Plain>(values: &[T]) -> &[u32] {
    const { assert!(size_of::<T>().is_multiple_of(size_of::<u32>()) && align_of::<T>() >= align_of::<u32>()) };
    let count = size_of_val(values) / size_of::<u32>();
    // SAFETY: the same bytes, all initialised, aligned for words, any bytes of which are one, under the same borrow.
    unsafe { core::slice::from_raw_parts(values.as_ptr().cast::<u32>(), count) }
}

/// The same, writable.
#[allow(unsafe_code)]
pub(crate) fn words_mut<T: Plain>(values: &mut [T]) -> &mut [u32] {
    const { assert!(size_of::<T>().is_multiple_of(size_of::<u32>()) && align_of::<T>() >= align_of::<u32>()) };
    let count = size_of_val(values) / size_of::<u32>();
    // SAFETY: as above, the borrow is unique, and any bytes are a value of the plain type T.
    unsafe { core::slice::from_raw_parts_mut(values.as_mut_ptr().cast::<u32>(), count) }
}

/// Counts the bytes that an [`Arena`] must hold for a series of slices.
#[derive(Clone, Copy, Debug)]
pub struct Need {
    bytes: usize,
    overflow: bool,
}

impl Default for Need {
    fn default() -> Self {
        Need::new()
    }
}

impl Need {
    /// Nothing yet, but for the bytes that align the caller's memory.
    pub const fn new() -> Self {
        Need { bytes: ALIGNMENT - 1, overflow: false }
    }

    /// Room for `count` values of type `T`.
    pub const fn and<T: Plain>(self, count: usize) -> Self {
        let (size, a) = count.overflowing_mul(size_of::<T>());
        let (padded, b) = size.overflowing_add(ALIGNMENT - 1);
        let (bytes, c) = self.bytes.overflowing_add(padded & !(ALIGNMENT - 1));
        Need { bytes, overflow: self.overflow | a | b | c }
    }

    /// Room for another series behind this one.
    pub const fn join(self, other: Need) -> Self {
        let (bytes, over) = self.bytes.overflowing_add(other.bytes - (ALIGNMENT - 1));
        Need { bytes, overflow: self.overflow | other.overflow | over }
    }

    /// The bytes, or an error where the count exceeds the address space.
    pub const fn bytes(self) -> Result<usize, Error> {
        if self.overflow { Err(Error::TooMany { what: "bytes", limit: usize::MAX }) } else { Ok(self.bytes) }
    }
}

/// Hands out aligned slices of the caller's memory, front to back, zeroed but where they are kept.
#[derive(Debug)]
pub struct Arena<'m> {
    rest: &'m mut [u8],
}

impl<'m> Arena<'m> {
    /// Takes the caller's memory; an error where it is smaller than `needed` bytes.
    pub fn new(memory: &'m mut [u8], needed: usize) -> Result<Self, Error> {
        if memory.len() < needed {
            return Err(Error::BufferTooSmall { needed, given: memory.len() });
        }
        Ok(Arena { rest: memory })
    }

    /// Bytes left, before alignment.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// The next `count` values of type `T`, all zero.
    pub fn take<T: Plain>(&mut self, count: usize) -> Result<&'m mut [T], Error> {
        self.carve(count, true)
    }

    /// The next `count` values of type `T`, as the memory holds them: those that an arena over the same memory left, or any.
    pub fn keep<T: Plain>(&mut self, count: usize) -> Result<&'m mut [T], Error> {
        self.carve(count, false)
    }

    #[allow(unsafe_code)]
    fn carve<T: Plain>(&mut self, count: usize, clear: bool) -> Result<&'m mut [T], Error> {
        let skip = self.rest.as_ptr().align_offset(ALIGNMENT);
        let needed = Need::new().and::<T>(count).bytes()?;
        let size = (needed - (ALIGNMENT - 1)).min(count.saturating_mul(size_of::<T>()));
        let short = Error::BufferTooSmall { needed, given: self.rest.len() };
        let end = match skip.checked_add(size) {
            Some(end) if end <= self.rest.len() => end,
            _ => return Err(short),
        };
        let (head, tail) = core::mem::take(&mut self.rest).split_at_mut_checked(end).ok_or(short)?;
        self.rest = tail;
        let (_, bytes) = head.split_at_mut_checked(skip).ok_or(short)?;
        if clear {
            bytes.fill(0);
        }
        const { assert!(align_of::<T>() <= ALIGNMENT) };
        // SAFETY: `bytes` is a unique borrow for 'm of `count * size_of::<T>()` initialised bytes, aligned to
        // ALIGNMENT >= align_of::<T>() (checked above), and any bytes are a value of the plain type T.
        Ok(unsafe { core::slice::from_raw_parts_mut(bytes.as_mut_ptr().cast::<T>(), count) })
    }
}

/// Reads back, front to back, what an [`Arena`] over the same memory handed out.
#[derive(Clone, Copy, Debug)]
pub struct View<'m> {
    rest: &'m [u8],
}

impl<'m> View<'m> {
    /// Reads this memory; it must start at the same address modulo [`ALIGNMENT`] as the arena's did.
    pub fn new(memory: &'m [u8]) -> Self {
        View { rest: memory }
    }

    /// The next `count` values of type `T`.
    #[allow(unsafe_code)]
    pub fn take<T: Plain>(&mut self, count: usize) -> Result<&'m [T], Error> {
        let skip = self.rest.as_ptr().align_offset(ALIGNMENT);
        let size = count.saturating_mul(size_of::<T>());
        let short = Error::BufferTooSmall { needed: skip.saturating_add(size), given: self.rest.len() };
        let (_, rest) = self.rest.split_at_checked(skip).ok_or(short)?;
        let (bytes, rest) = rest.split_at_checked(size).ok_or(short)?;
        self.rest = rest;
        const { assert!(align_of::<T>() <= ALIGNMENT) };
        // SAFETY: `bytes` is a shared borrow for 'm of `count * size_of::<T>()` initialised bytes, aligned to
        // ALIGNMENT >= align_of::<T>() (checked above), and any bytes are a value of the plain type T.
        Ok(unsafe { core::slice::from_raw_parts(bytes.as_ptr().cast::<T>(), count) })
    }
}

/// Owned memory that starts on a boundary of [`ALIGNMENT`] bytes, wherever it is moved.
#[cfg(feature = "std")]
#[derive(Debug, Default)]
pub struct Memory(std::vec::Vec<Line>);

#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line([u8; ALIGNMENT]);

#[cfg(feature = "std")]
impl Memory {
    /// At least `bytes` zeroed bytes.
    pub fn new(bytes: usize) -> Memory {
        Memory(std::vec![Line([0; ALIGNMENT]); bytes.div_ceil(ALIGNMENT)])
    }

    /// Keeps the first `bytes` and gives the rest back.
    pub fn truncate(&mut self, bytes: usize) {
        self.0.truncate(bytes.div_ceil(ALIGNMENT));
        self.0.shrink_to_fit();
    }

    /// Its size in bytes.
    pub fn size(&self) -> usize {
        self.0.len() * ALIGNMENT
    }

    /// The bytes.
    #[allow(unsafe_code)]
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: lines are plain arrays of bytes without padding, contiguous in the vector.
        unsafe { core::slice::from_raw_parts(self.0.as_ptr().cast::<u8>(), self.size()) }
    }

    /// The bytes, writable.
    #[allow(unsafe_code)]
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        let size = self.size();
        // SAFETY: as above, and the borrow is unique.
        unsafe { core::slice::from_raw_parts_mut(self.0.as_mut_ptr().cast::<u8>(), size) }
    }
}

/// Writer of a block's arrays, one after the other, or counter of their bytes.
pub(crate) struct Writer<'o> {
    memory: Option<&'o mut [u8]>,
    at: usize,
}

impl<'o> Writer<'o> {
    /// A writer that only counts.
    pub fn counting() -> Writer<'o> {
        Writer { memory: None, at: 0 }
    }

    /// A writer into a block's memory.
    pub fn new(memory: &'o mut [u8]) -> Writer<'o> {
        Writer { memory: Some(memory), at: 0 }
    }

    /// Bytes written so far, or counted.
    pub fn extent(&self) -> usize {
        self.at
    }

    pub fn put<T: Plain>(&mut self, values: &[T]) -> Result<(), Error> {
        let start = self.at.next_multiple_of(ALIGNMENT);
        self.at = start.checked_add(size_of_val(values)).ok_or(Error::Block)?;
        let Some(memory) = &mut self.memory else { return Ok(()) };
        let given = memory.len();
        let part = memory.get_mut(start..).ok_or(Error::BufferTooSmall { needed: self.at, given })?;
        let to = Arena::new(part, 0)?.take::<T>(values.len())?;
        copy(to, values);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_the_bytes_asked_for_are_enough_wherever_they_start() {
        let needed = Need::new().and::<u8>(3).and::<f64>(5).and::<u32>(0).and::<u16>(7).bytes().unwrap();
        let mut memory = [0xffu8; 1024];
        for start in 0..ALIGNMENT {
            let mut arena = Arena::new(&mut memory[start..start + needed], needed).unwrap();
            assert_eq!(arena.take::<u8>(3).unwrap(), &[0; 3]);
            assert_eq!(arena.take::<f64>(5).unwrap(), &[0.0; 5]);
            assert!(arena.take::<u32>(0).unwrap().is_empty());
            let last = arena.take::<u16>(7).unwrap();
            last.fill(0xffff);
            assert!(arena.take::<u8>(ALIGNMENT * 2).is_err());
        }
        assert_eq!(
            Arena::new(&mut memory[..needed - 1], needed).unwrap_err(),
            Error::BufferTooSmall { needed, given: needed - 1 }
        );
        assert!(Need::new().and::<u64>(usize::MAX / 2).bytes().is_err());
    }

    #[test]
    fn a_view_reads_what_the_arena_wrote() {
        let mut memory = [0u8; 512];
        let mut arena = Arena::new(&mut memory, 512).unwrap();
        arena.take::<u16>(3).unwrap().copy_from_slice(&[1, 2, 3]);
        arena.take::<f64>(2).unwrap().copy_from_slice(&[0.5, 1.5]);
        let mut view = View::new(&memory);
        assert_eq!(view.take::<u16>(3).unwrap(), &[1, 2, 3]);
        assert_eq!(view.take::<f64>(2).unwrap(), &[0.5, 1.5]);
        assert!(view.take::<f64>(64).is_err());
    }
}
