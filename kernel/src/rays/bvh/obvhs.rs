//! The tree built by the crate obvhs, brought into the kernel's binary form.

use super::build::{Aabb, Binary, Facets, binned};
use super::{MOST_LEVELS, PACKET_LANES};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ploc::{PlocSearchDistance, SortPrecision};
use obvhs::{BvhBuildParams, aabb};
use std::time::Duration;
use std::vec::Vec;

/// Nothing is split, since a facet stands in one leaf, and nothing collapsed, since that is done here.
const SETTINGS: BvhBuildParams = BvhBuildParams {
    pre_split: false,
    ploc_search_distance: PlocSearchDistance::High,
    search_depth_threshold: 2,
    reinsertion_batch_ratio: 0.2,
    post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
    sort_precision: SortPrecision::U64,
    max_prims_per_leaf: 1,
    collapse_traversal_cost: 1.0,
};

/// PLOC with reinsertion.
pub(super) fn ploc(facets: &Facets, tree: &mut Binary) {
    if tree.order.is_empty() {
        return;
    }
    let boxes: Vec<aabb::Aabb> = tree.order.iter().map(|&facet| boxed(&facets.get(facet))).collect();
    let built = build_bvh2(&boxes, SETTINGS, &mut Duration::default());
    if !convert(&built, tree) {
        tree.nodes = 0;
        binned(facets, tree);
    }
}

fn boxed(own: &Aabb) -> aabb::Aabb {
    aabb::Aabb::new(own.low.into(), own.high.into())
}

/// Facets below each node of `built`.
fn counts(built: &Bvh2) -> Vec<u32> {
    let mut counts = vec![0; built.nodes.len()];
    let mut stack = vec![(0usize, false)];
    while let Some((node, done)) = stack.pop() {
        let own = &built.nodes[node];
        let first = own.first_index as usize;
        if own.is_leaf() {
            counts[node] = own.prim_count;
        } else if done {
            counts[node] = counts[first] + counts[first + 1];
        } else {
            stack.extend([(node, true), (first, false), (first + 1, false)]);
        }
    }
    counts
}

/// Copies `built`, its subtrees of up to [`PACKET_LANES`] facets made leaves. False where it is too deep.
fn convert(built: &Bvh2, tree: &mut Binary) -> bool {
    let counts = counts(built);
    let facets: Vec<u32> = tree.order.to_vec();
    let mut ordered = Vec::with_capacity(facets.len());
    // Node of `built`, its place in `tree` and its level.
    tree.push(&unboxed(&built.nodes[0].aabb), 0, 0);
    let mut stack = vec![(0usize, 0usize, 0usize)];
    while let Some((node, place, level)) = stack.pop() {
        if counts[node] as usize <= PACKET_LANES {
            tree.links[place] = [ordered.len() as u32, counts[node]];
            leaves(built, node, |own| ordered.push(facets[own as usize]));
            continue;
        }
        // deeper trees, which take meshes of absurd proportions, are left to the kernel's own builder
        if level == MOST_LEVELS {
            return false;
        }
        let first = built.nodes[node].first_index as usize;
        let left = tree.push(&unboxed(&built.nodes[first].aabb), 0, 0);
        let right = tree.push(&unboxed(&built.nodes[first + 1].aabb), 0, 0);
        tree.links[place] = [left, 0];
        stack.extend([(first + 1, right as usize, level + 1), (first, left as usize, level + 1)]);
    }
    tree.order.copy_from_slice(&ordered);
    true
}

/// Visits the primitives below a node.
fn leaves(built: &Bvh2, node: usize, mut visit: impl FnMut(u32)) {
    let mut stack = vec![node];
    while let Some(node) = stack.pop() {
        let own = &built.nodes[node];
        let first = own.first_index as usize;
        if own.is_leaf() {
            built.primitive_indices[first..first + own.prim_count as usize]
                .iter()
                .for_each(|&own| visit(own));
        } else {
            stack.extend([first + 1, first]);
        }
    }
}

fn unboxed(own: &aabb::Aabb) -> Aabb {
    Aabb { low: own.min.to_array(), high: own.max.to_array() }
}
