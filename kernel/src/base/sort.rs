//! Sorting and selecting in place that cannot panic, whatever the order given: the core library's do where it is none.
//!
//! Constants of this file are measured by `cargo bench --bench counts` (instructions).

use crate::base::index::{Index, IndexMut};
use core::cmp::Ordering;

/// Slices up to this are sorted by insertion.
const INSERTION_SORT_MOST: usize = 20;

/// Parts that wait while longer ones are sorted: each is at most half of the one before, so that a million values need no
/// more. The last to fit is sorted as a heap.
const SORT_PARTS_WAITING: usize = 16;

/// Sorts `slice`; equal values end in any order.
pub(crate) fn sort<T: Copy + Default>(slice: &mut [T], compare: &impl Fn(&T, &T) -> Ordering) {
    if slice.len() <= INSERTION_SORT_MOST {
        return insertion(slice, compare);
    }
    // as often as halving would need, and as much again: beyond, the values are made to defeat the pivots
    let depth = 2 * (usize::BITS - slice.len().leading_zeros());
    quick(slice, compare, depth);
}

fn quick<T: Copy + Default>(slice: &mut [T], compare: &impl Fn(&T, &T) -> Ordering, depth: u32) {
    let (mut longer, mut waiting) = ([(0, 0, 0); SORT_PARTS_WAITING], 0);
    let (mut start, mut end, mut depth) = (0, slice.len(), depth);
    loop {
        let part = slice.part_mut(start..end);
        if part.len() > INSERTION_SORT_MOST && depth > 0 && waiting < SORT_PARTS_WAITING {
            depth -= 1;
            let cut = start + partition(part, compare);
            let (low, high) = ((start, cut), (cut + 1, end));
            // the shorter part goes on in this loop, so that few wait
            let (short, long) = if cut - start < end - cut - 1 { (low, high) } else { (high, low) };
            longer.set(waiting, (long.0, long.1, depth));
            waiting += 1;
            (start, end) = short;
            continue;
        }
        if part.len() > INSERTION_SORT_MOST {
            heap(part, compare)
        } else {
            insertion(part, compare)
        }
        let Some(next) = waiting.checked_sub(1) else { return };
        waiting = next;
        (start, end, depth) = longer.at(waiting);
    }
}

/// Puts the `count` least values first.
pub(crate) fn select<T: Copy + Default>(
    mut slice: &mut [T],
    mut count: usize,
    compare: &impl Fn(&T, &T) -> Ordering,
) {
    let mut depth = 2 * (usize::BITS - slice.len().leading_zeros());
    while slice.len() > INSERTION_SORT_MOST && count > 0 && count < slice.len() {
        if depth == 0 {
            return heap(slice, compare);
        }
        depth -= 1;
        let cut = partition(slice, compare).min(slice.len());
        if count <= cut {
            slice = slice.head_mut(cut);
        } else {
            count -= cut + 1;
            slice = slice.part_mut(cut + 1..slice.len());
        }
    }
    insertion(slice, compare);
}

/// Moves a value of middle size to its place, what is less before it and what is not behind; its place.
fn partition<T: Copy + Default>(slice: &mut [T], compare: &impl Fn(&T, &T) -> Ordering) -> usize {
    let last = slice.len().saturating_sub(1);
    let (a, b, c) = (slice.at(0), slice.at(last / 2), slice.at(last));
    let less = |a: &T, b: &T| compare(a, b) == Ordering::Less;
    let middle = match (less(&a, &b), less(&b, &c), less(&a, &c)) {
        (true, true, _) | (false, false, _) => last / 2,
        (true, false, true) | (false, true, false) => last,
        _ => 0,
    };
    let pivot = slice.at(middle);
    slice.set(middle, slice.at(last));
    slice.set(last, pivot);
    // equal values go to either side in turn, so that many of them do no harm
    let (mut low, mut high) = (0, last);
    loop {
        while low < high && compare(&slice.at(low), &pivot) == Ordering::Less {
            low += 1;
        }
        while low < high && compare(&slice.at(high - 1), &pivot) == Ordering::Greater {
            high -= 1;
        }
        if low + 1 >= high {
            break;
        }
        let (x, y) = (slice.at(low), slice.at(high - 1));
        slice.set(low, y);
        slice.set(high - 1, x);
        low += 1;
        high -= 1;
    }
    let x = slice.at(low);
    slice.set(low, pivot);
    slice.set(last, x);
    low
}

fn insertion<T: Copy + Default>(slice: &mut [T], compare: &impl Fn(&T, &T) -> Ordering) {
    for end in 1..slice.len() {
        let value = slice.at(end);
        let mut at = end;
        while at > 0 && compare(&value, &slice.at(at - 1)) == Ordering::Less {
            slice.set(at, slice.at(at - 1));
            at -= 1;
        }
        slice.set(at, value);
    }
}

fn heap<T: Copy + Default>(slice: &mut [T], compare: &impl Fn(&T, &T) -> Ordering) {
    let count = slice.len();
    for root in (0..count / 2).rev() {
        sift(slice, root, count, compare);
    }
    for end in (1..count).rev() {
        let (first, last) = (slice.at(0), slice.at(end));
        slice.set(0, last);
        slice.set(end, first);
        sift(slice, 0, end, compare);
    }
}

/// Lets the value at `root` sink to its place in the heap of the first `count` values.
fn sift<T: Copy + Default>(
    slice: &mut [T],
    mut root: usize,
    count: usize,
    compare: &impl Fn(&T, &T) -> Ordering,
) {
    let value = slice.at(root);
    while 2 * root + 1 < count {
        let mut child = 2 * root + 1;
        if child + 1 < count && compare(&slice.at(child), &slice.at(child + 1)) == Ordering::Less {
            child += 1;
        }
        if compare(&value, &slice.at(child)) != Ordering::Less {
            break;
        }
        slice.set(root, slice.at(child));
        root = child;
    }
    slice.set(root, value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::qmc::hash;

    #[test]
    fn sorts_and_selects_as_the_core_library_does() {
        let patterns: [fn(u32) -> u32; 6] = [
            hash,
            |i| i,
            |i| 100_000 - i,
            |i| hash(i) % 7,
            |_| 5,
            |i| if i % 2 == 0 { i } else { 100_000 - i },
        ];
        for count in [0, 1, 2, 3, 19, 20, 21, 22, 100, 1000, 5000] {
            for pattern in patterns {
                let mut storage = [0u32; 5000];
                let values = &mut storage[..count];
                values.iter_mut().zip(0..).for_each(|(v, i)| *v = pattern(i));
                let (mut wanted, mut heaped, mut selected) = ([0u32; 5000], [0u32; 5000], [0u32; 5000]);
                for copy in [&mut wanted, &mut heaped, &mut selected] {
                    copy[..count].copy_from_slice(values);
                }
                wanted[..count].sort_unstable();
                sort(values, &u32::cmp);
                heap(&mut heaped[..count], &u32::cmp);
                assert!(values == &wanted[..count] && heaped == wanted);
                for least in [0, count.min(1), count / 3, count / 2, count] {
                    let part = &mut selected[..count];
                    select(part, least, &u32::cmp);
                    let (low, high) = part.split_at(least);
                    assert!(low.iter().max() <= high.iter().min() || low.is_empty() || high.is_empty());
                }
            }
        }
    }

    #[test]
    fn an_order_that_is_none_still_ends() {
        let mut values = [0u32; 500];
        values.iter_mut().zip(0..).for_each(|(v, i)| *v = hash(i));
        for answer in [Ordering::Less, Ordering::Greater, Ordering::Equal] {
            sort(&mut values, &|_, _| answer);
            select(&mut values, 100, &|_, _| answer);
        }
        sort(&mut values, &|a, b| hash(a ^ b).cmp(&hash(*a)));
    }
}
