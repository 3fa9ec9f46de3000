//! Stack of the path from the root to the node that a traversal is at: a seventh as long as one of all waiting children.

use super::MOST_LEVELS;
use crate::base::index::IndexMut;

/// Nodes of the path, the deepest last, each with the children that are left to visit, in the traversal's own code: 0
/// where none is. Their count stands apart, so that compilers keep it in a register.
pub(super) type PathStack = [(u32, u32); MOST_LEVELS];

/// The empty stack.
pub(super) const EMPTY_STACK: PathStack = [(0, 0); MOST_LEVELS];

/// Pushes a node with the children that are left to visit.
#[inline(always)]
pub(super) fn push(stack: &mut PathStack, depth: &mut usize, node: u32, left: u32) {
    stack.set(*depth, (node, left));
    *depth += 1;
}

/// The deepest node with children left to visit; pops those without.
#[inline(always)]
pub(super) fn top<'s>(stack: &'s mut PathStack, depth: &mut usize) -> Option<&'s mut (u32, u32)> {
    while let Some(last) = depth.checked_sub(1) {
        if stack.get(last).is_some_and(|(_, left)| *left != 0) {
            return stack.get_mut(last);
        }
        *depth = last;
    }
    None
}
