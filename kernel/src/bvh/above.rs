//! Whether anything of the mesh rises above a plane: if not, no ray that starts there and goes up meets anything.

use super::{Bvh, LEAF, PAIR, STACK};
use crate::index::Index;
use crate::math::Vec3;

/// See [`Bvh::rises_above`]. Apart: its stack is no burden to what the caller does next.
#[inline(never)]
pub(super) fn rises_above(bvh: &Bvh<'_>, normal: Vec3, height: f64) -> bool {
    let n = normal.to_array();
    let mut stack = [0u32; STACK];
    let mut top = usize::from(!bvh.boxes.is_empty());
    while top > 0 {
        top -= 1;
        let node = stack.at(top) as usize;
        let (Some(boxes), Some(children)) = (bvh.boxes.get(node), bvh.children.get(node)) else { continue };
        for (i, &child) in children.iter().enumerate() {
            let i = i & 7;
            if boxes[0][0][i] > boxes[0][1][i] {
                continue;
            }
            // boxes are rounded outward: their highest corner is no lower than the facets'
            let highest: f64 = (0..3).map(|k| n[k] * f64::from(boxes[k][usize::from(n[k] > 0.0)][i])).sum();
            if highest <= height {
                continue;
            }
            if child & LEAF == 0 {
                if let Some(slot) = stack.get_mut(top) {
                    *slot = child;
                    top += 1;
                }
            } else if leaf_rises(bvh, child, normal, height) {
                return true;
            }
        }
    }
    false
}

fn leaf_rises(bvh: &Bvh<'_>, leaf: u32, normal: Vec3, height: f64) -> bool {
    let first = (leaf & !(LEAF | PAIR)) as usize;
    let packets = first..first + 1 + usize::from(leaf & PAIR != 0);
    bvh.facets.get(packets).unwrap_or(&[]).as_flattened().iter().any(|&facet| {
        let solid = bvh.solids.get(facet as usize);
        solid.is_some_and(|[a, b, c, _]| [a, b, c].iter().any(|&&x| Vec3::from_array(x).dot(normal) > height))
    })
}
