//! The way from the root to where a walk is: a stack a seventh as long as one of all children that wait.

use super::MOST_LEVELS;
use crate::base::index::IndexMut;

/// Nodes under way, the deepest last, each with the children that are left to visit, in the walk's own code, which is 0
/// where none is. Their count stands apart, so that compilers keep it in a register.
pub(super) type Way = [(u32, u32); MOST_LEVELS];

/// None under way.
pub(super) const START: Way = [(0, 0); MOST_LEVELS];

/// Enters a node.
#[inline(always)]
pub(super) fn enter(way: &mut Way, depth: &mut usize, node: u32, left: u32) {
    way.set(*depth, (node, left));
    *depth += 1;
}

/// The deepest node of which anything is left; those below it are left for good.
#[inline(always)]
pub(super) fn deepest<'w>(way: &'w mut Way, depth: &mut usize) -> Option<&'w mut (u32, u32)> {
    while let Some(last) = depth.checked_sub(1) {
        if way.get(last).is_some_and(|(_, left)| *left != 0) {
            return way.get_mut(last);
        }
        *depth = last;
    }
    None
}
