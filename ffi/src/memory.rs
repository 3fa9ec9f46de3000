//! Handles in memory: where they are put, how they are told from anything else, and memory of the library's own.

use crate::status::*;
use blik_kernel::arena::ALIGNMENT;
use core::ptr::NonNull;
use core::slice::{from_raw_parts, from_raw_parts_mut};

/// Extra bytes that place a handle of type `T` and align what follows.
pub(crate) const fn head<T>() -> usize {
    size_of::<T>() + 2 * ALIGNMENT
}

/// Something that stands at the front of its memory.
pub(crate) trait Handle {
    /// Tells its kind; 0 stands for none.
    const TAG: usize;
    /// Where its tag stands; `at` points to memory of its size.
    fn tag(at: *mut Self) -> *mut usize;
    /// Memory of the library's own in which it stands, if any.
    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>>;
}

/// Memory that a handle owns, the handle's own included.
#[cfg(feature = "std")]
pub(crate) struct Owned(#[expect(dead_code, reason = "freed with the handle")] pub std::vec::Vec<Slab>);

/// A caller's object; null, misaligned or of another kind: an error.
///
/// # Safety
/// `at` is null, or an object of this kind that nobody changes during 'a, or memory of its size.
pub(crate) unsafe fn object<'a, T: Handle>(at: *const T) -> Result<&'a T, blik_error> {
    if at.is_null() {
        return Err(blik_error::of(BLIK_ERROR_NULL));
    }
    if !at.is_aligned() {
        return Err(blik_error::of(BLIK_ERROR_HANDLE));
    }
    // SAFETY: aligned, and within memory of a handle's size.
    if unsafe { T::tag(at.cast_mut()).read() } != T::TAG {
        return Err(blik_error::of(BLIK_ERROR_HANDLE));
    }
    // SAFETY: a handle of this kind, by its tag.
    Ok(unsafe { &*at })
}

/// The caller's bytes.
///
/// # Safety
/// `memory` has `size` bytes that nobody else uses during 'a.
pub(crate) unsafe fn bytes<'a>(
    memory: *mut core::ffi::c_void,
    size: usize,
) -> Result<&'a mut [u8], blik_error> {
    if size == 0 {
        return Ok(&mut []);
    }
    if memory.is_null() {
        return Err(blik_error::of(BLIK_ERROR_NULL));
    }
    // SAFETY: by the caller's promise; any bytes will do.
    Ok(unsafe { from_raw_parts_mut(memory.cast::<u8>(), size.min(isize::MAX as usize)) })
}

/// The caller's array to read.
///
/// # Safety
/// `at` has `count` values that nobody changes during 'a.
pub(crate) unsafe fn input<'a, T>(at: *const T, count: usize) -> Result<&'a [T], blik_error> {
    if count == 0 {
        return Ok(&[]);
    }
    usable(at, count)?;
    // SAFETY: by the caller's promise, and as checked.
    Ok(unsafe { from_raw_parts(at, count) })
}

/// The caller's array to write.
///
/// # Safety
/// `at` has room for `count` values that nobody else uses during 'a.
pub(crate) unsafe fn output<'a, T>(at: *mut T, count: usize) -> Result<&'a mut [T], blik_error> {
    if count == 0 {
        return Ok(&mut []);
    }
    usable(at, count)?;
    // SAFETY: by the caller's promise, and as checked; all types written are plain numbers.
    Ok(unsafe { from_raw_parts_mut(at, count) })
}

/// The caller's array to write, the field `field`, of `wanted` values: `count` is their number.
///
/// # Safety
/// As for [`output`].
pub(crate) unsafe fn output_of<'a, T>(
    (at, count): (*mut T, usize),
    wanted: usize,
    field: i32,
) -> Result<&'a mut [T], blik_error> {
    if count != wanted {
        return Err(blik_error::of(BLIK_ERROR_LENGTH).field(field).sizes(wanted, count));
    }
    // SAFETY: by the caller's promise.
    unsafe { output(at, count) }.map_err(|error| error.field(field))
}

/// As [`output`], for an array that the caller may leave out: empty for a null pointer.
///
/// # Safety
/// As for [`output`].
pub(crate) unsafe fn optional_output<'a, T>(
    (at, count): (*mut T, usize),
    wanted: usize,
    field: i32,
) -> Result<&'a mut [T], blik_error> {
    if at.is_null() {
        return Ok(&mut []);
    }
    // SAFETY: by the caller's promise.
    unsafe { output_of((at, count), wanted, field) }
}

fn usable<T>(at: *const T, count: usize) -> Result<(), blik_error> {
    if at.is_null() {
        return Err(blik_error::of(BLIK_ERROR_NULL));
    }
    if !at.is_aligned() {
        return Err(blik_error::of(BLIK_ERROR_ALIGNMENT));
    }
    match count.checked_mul(size_of::<T>()) {
        Some(bytes) if bytes <= isize::MAX as usize => Ok(()),
        _ => Err(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(isize::MAX as usize, count)),
    }
}

/// A pointer that must not be null.
pub(crate) fn needed<T>(at: *mut T) -> Result<NonNull<T>, blik_error> {
    NonNull::new(at).filter(|p| p.is_aligned()).ok_or(blik_error::of(BLIK_ERROR_NULL))
}

/// Cuts room for a handle off the front of `memory`: where it goes, and the rest.
pub(crate) fn place<T>(memory: &mut [u8]) -> Result<(NonNull<T>, &mut [u8]), blik_error> {
    let skip = memory.as_ptr().align_offset(ALIGNMENT);
    let size = size_of::<T>().next_multiple_of(ALIGNMENT);
    let short = blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(head::<T>(), memory.len());
    if memory.len() < head::<T>() {
        return Err(short);
    }
    let (_, memory) = memory.split_at_mut_checked(skip).ok_or(short)?;
    let (own, rest) = memory.split_at_mut_checked(size).ok_or(short)?;
    const { assert!(align_of::<T>() <= ALIGNMENT) };
    Ok((NonNull::from(own).cast(), rest))
}

/// Ends a handle: null is nothing to end.
///
/// # Safety
/// `at` is null or a handle of this kind that nobody uses any more.
pub(crate) unsafe fn end<T: Handle>(at: *mut T) {
    // SAFETY: by the caller's promise.
    if unsafe { object(at) }.is_err() {
        return;
    }
    // SAFETY: a handle, and nobody else uses it.
    unsafe { T::tag(at).write(0) };
    #[cfg(feature = "std")]
    // SAFETY: as above.
    drop(unsafe { &mut *at }.owner().take());
}

/// Zeroed memory of the system, aligned to [`ALIGNMENT`], freed when dropped.
#[cfg(feature = "std")]
pub(crate) struct Slab {
    start: NonNull<u8>,
    layout: std::alloc::Layout,
}

// SAFETY: plain memory with one owner.
#[cfg(feature = "std")]
unsafe impl Send for Slab {}
// SAFETY: shared, it is only read.
#[cfg(feature = "std")]
unsafe impl Sync for Slab {}

#[cfg(feature = "std")]
impl Slab {
    pub fn new(bytes: usize) -> Result<Slab, blik_error> {
        let error = blik_error::of(BLIK_ERROR_MEMORY).sizes(bytes, 0);
        let layout = std::alloc::Layout::from_size_align(bytes.max(1), ALIGNMENT).map_err(|_| error)?;
        // SAFETY: the size is not 0.
        let start = NonNull::new(unsafe { std::alloc::alloc_zeroed(layout) }).ok_or(error)?;
        Ok(Slab { start, layout })
    }

    /// Gives back all but the first `bytes`; they may move.
    pub fn shrink(&mut self, bytes: usize) {
        let bytes = bytes.clamp(1, self.layout.size());
        let Ok(layout) = std::alloc::Layout::from_size_align(bytes, ALIGNMENT) else { return };
        // SAFETY: allocated with this layout, and the new size is neither 0 nor larger.
        let moved = unsafe { std::alloc::realloc(self.start.as_ptr(), self.layout, bytes) };
        if let Some(start) = NonNull::new(moved) {
            (self.start, self.layout) = (start, layout);
        }
    }

    /// Its bytes for as long as the handle lives that owns it.
    ///
    /// # Safety
    /// The slab outlives the result, and nobody else has its bytes.
    pub unsafe fn bytes_mut(&mut self) -> &'static mut [u8] {
        // SAFETY: allocated, initialised, and ours alone by the caller's promise.
        unsafe { from_raw_parts_mut(self.start.as_ptr(), self.layout.size()) }
    }

    /// Its bytes to read.
    ///
    /// # Safety
    /// The slab outlives the result, and nobody writes to it.
    pub unsafe fn bytes(&self) -> &'static [u8] {
        // SAFETY: as above.
        unsafe { from_raw_parts(self.start.as_ptr(), self.layout.size()) }
    }
}

#[cfg(feature = "std")]
impl Drop for Slab {
    fn drop(&mut self) {
        // SAFETY: allocated with this layout.
        unsafe { std::alloc::dealloc(self.start.as_ptr(), self.layout) };
    }
}
