//! Indexing that cannot panic: places out of range read as zero and are not written. What calls these never asks for
//! one; but a compiler that cannot see that would put a panic there, and no panic may be reachable without the
//! standard library (the C library is tested for it).

use core::ops::Range;

/// Reading.
pub(crate) trait Index<T> {
    /// The value at `index`.
    fn at(&self, index: usize) -> T
    where
        T: Copy + Default;
    /// The first `count` values.
    fn head(&self, count: usize) -> &[T];
    /// The values of a range.
    fn part(&self, range: Range<usize>) -> &[T];
}

/// Writing.
pub(crate) trait IndexMut<T> {
    /// The first `count` values.
    fn head_mut(&mut self, count: usize) -> &mut [T];
    /// The values of a range.
    fn part_mut(&mut self, range: Range<usize>) -> &mut [T];
    /// Sets the value at `index`.
    fn set(&mut self, index: usize, value: T);
}

impl<T> Index<T> for [T] {
    #[inline(always)]
    fn at(&self, index: usize) -> T
    where
        T: Copy + Default,
    {
        match self.get(index) {
            Some(value) => *value,
            None => T::default(),
        }
    }

    #[inline(always)]
    fn head(&self, count: usize) -> &[T] {
        self.get(..count).unwrap_or(self)
    }

    #[inline(always)]
    fn part(&self, range: Range<usize>) -> &[T] {
        self.get(range).unwrap_or(&[])
    }
}

impl<T> IndexMut<T> for [T] {
    #[inline(always)]
    fn head_mut(&mut self, count: usize) -> &mut [T] {
        let count = count.min(self.len());
        self.split_at_mut(count).0
    }

    #[inline(always)]
    fn part_mut(&mut self, range: Range<usize>) -> &mut [T] {
        self.get_mut(range).unwrap_or(&mut [])
    }

    #[inline(always)]
    fn set(&mut self, index: usize, value: T) {
        if let Some(place) = self.get_mut(index) {
            *place = value;
        }
    }
}

/// Length of a range. That of the standard library comes with an assertion that compilers do not always see through.
#[inline(always)]
pub(crate) fn span(range: &Range<usize>) -> usize {
    range.end.saturating_sub(range.start)
}

/// Pieces of `size` values each, as of `chunks_exact_mut`, but none where that is 0.
#[inline(always)]
pub(crate) fn pieces<T>(values: &mut [T], size: usize) -> Pieces<'_, T> {
    Pieces { rest: values, size }
}

/// The pieces still to come.
pub(crate) struct Pieces<'a, T> {
    rest: &'a mut [T],
    size: usize,
}

impl<'a, T> Iterator for Pieces<'a, T> {
    type Item = &'a mut [T];

    #[inline(always)]
    fn next(&mut self) -> Option<&'a mut [T]> {
        let (piece, rest) = core::mem::take(&mut self.rest).split_at_mut_checked(self.size)?;
        self.rest = rest;
        (self.size > 0).then_some(piece)
    }
}

/// The same to read, as of `chunks_exact`.
#[inline(always)]
pub(crate) fn parts<T>(mut values: &[T], size: usize) -> impl Iterator<Item = &[T]> {
    core::iter::from_fn(move || {
        let (part, rest) = values.split_at_checked(size)?;
        values = rest;
        (size > 0).then_some(part)
    })
}

/// Copies as many values as both have.
#[inline(always)]
pub(crate) fn copy<T: Copy>(to: &mut [T], from: &[T]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
