//! Whether anything of the mesh rises above a plane: if not, no ray that starts there and goes up meets anything.

use super::path_stack::{EMPTY_STACK, push, top};
use super::{Bvh, LEAF_CHILD, PAIR};
use crate::base::math::Vec3;

/// See [`Bvh::rises_above`]. Not inlined: its stack frame ends before the caller goes on.
#[inline(never)]
pub(super) fn rises_above(bvh: &Bvh<'_>, normal: Vec3, height: f64) -> bool {
    let n = normal.to_array();
    let (mut stack, mut depth) = (EMPTY_STACK, 0);
    push(&mut stack, &mut depth, 0, 0xff);
    while let Some((node, left)) = top(&mut stack, &mut depth) {
        let i = left.trailing_zeros() as usize & 7;
        *left &= *left - 1;
        let node = *node as usize;
        let (Some(boxes), Some(children)) = (bvh.boxes.get(node), bvh.children.get(node)) else {
            return false;
        };
        if boxes[0][0][i] > boxes[0][1][i] {
            continue;
        }
        // boxes are rounded outward: their highest corner is no lower than the facets'
        let highest: f64 = (0..3).map(|k| n[k] * f64::from(boxes[k][usize::from(n[k] > 0.0)][i])).sum();
        if highest <= height {
            continue;
        }
        if children[i] & LEAF_CHILD == 0 {
            push(&mut stack, &mut depth, children[i], 0xff);
        } else if leaf_rises(bvh, children[i], normal, height) {
            return true;
        }
    }
    false
}

fn leaf_rises(bvh: &Bvh<'_>, leaf: u32, normal: Vec3, height: f64) -> bool {
    let first = (leaf & !(LEAF_CHILD | PAIR)) as usize;
    let packets = first..first + 1 + usize::from(leaf & PAIR != 0);
    bvh.facets.get(packets).unwrap_or(&[]).as_flattened().iter().any(|&facet| {
        let solid = bvh.solids.get(facet as usize);
        solid.is_some_and(|[a, b, c, _]| [a, b, c].iter().any(|&&x| Vec3::from_array(x).dot(normal) > height))
    })
}
