//! From the binary tree to nodes of eight.

use super::build::{Aabb, Binary};
use super::{Boxes, LEAF_CHILD, NO_LANE_FACET, PACKET_LANES, PAIR};
use crate::base::index::{Index, IndexMut};

/// Size of the tree of nodes of eight.
pub(super) struct Made {
    pub nodes: usize,
    pub packets: usize,
    pub levels: usize,
}

/// Collapses the tree: each node takes in the largest of its inner children until it has eight or only leaves.
/// Leaves' facets go to `lanes`.
///
/// Nodes wait in the array that they will fill: the first child of one not yet made is its binary node.
pub(super) fn collapse(
    tree: &Binary,
    boxes: &mut [Boxes],
    children: &mut [[u32; 8]],
    facets: &mut [[u32; PACKET_LANES]],
) -> Made {
    let empty = tree.nodes == 0;
    let mut lanes = Lanes::new(facets, tree.order.len());
    let (mut node, mut nodes, mut levels, mut level_end) = (0, usize::from(!empty), 0, 0);
    while node < nodes {
        if node == level_end {
            (levels, level_end) = (levels + 1, nodes);
        }
        let (members, count) = open(tree, children.at(node)[0]);
        boxes.set(node, [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3]);
        for (child, &member) in members.iter().take(count).enumerate() {
            let [first, facets] = tree.links.at(member as usize);
            if let Some(boxes) = boxes.get_mut(node) {
                Aabb::read(&tree.boxes.at(member as usize)).write(boxes, child);
            }
            let made = if facets == 0 {
                if let Some(place) = children.get_mut(nodes) {
                    place[0] = member;
                }
                nodes += 1;
                nodes as u32 - 1
            } else {
                let own = tree.order.iter().skip(first as usize).take(facets as usize);
                lanes.place(own)
            };
            if let Some(children) = children.get_mut(node) {
                children.set(child, made);
            }
        }
        node += 1;
    }
    Made { nodes, packets: lanes.used.div_ceil(PACKET_LANES), levels }
}

/// The up to eight descendants of a binary node that become children of one node.
fn open(tree: &Binary, root: u32) -> ([u32; 8], usize) {
    let inner = |member: u32| tree.links.at(member as usize)[1] == 0;
    let mut members = [root; 8];
    let mut count = 1;
    while count < 8 {
        let area = |member: u32| Aabb::read(&tree.boxes.at(member as usize)).half_area();
        let candidates = members.iter().take(count).enumerate().filter(|&(_, &member)| inner(member));
        let largest = candidates.fold(None, |best: Option<(usize, f32)>, (place, &member)| match best {
            Some((_, most)) if area(member) <= most => best,
            _ => Some((place, area(member))),
        });
        let Some((place, _)) = largest else { break };
        let first = tree.links.at(members.at(place) as usize)[0];
        members.set(place, first);
        members.set(count, first + 1);
        count += 1;
    }
    (members, count)
}

/// Hands out lanes of packets to leaves.
struct Lanes<'a> {
    facets: &'a mut [[u32; PACKET_LANES]],
    used: usize,
    /// Lanes that may still be left empty.
    spare: usize,
}

impl<'a> Lanes<'a> {
    fn new(facets: &'a mut [[u32; PACKET_LANES]], live: usize) -> Self {
        facets.iter_mut().for_each(|lanes| *lanes = [NO_LANE_FACET; PACKET_LANES]);
        Lanes { facets, used: 0, spare: live }
    }

    /// The child that stands for the leaf of these facets, at most [`PACKET_LANES`]. The other facets of its packets, where
    /// there are any, are tested along with it, which changes no hit.
    fn place<'f>(&mut self, leaf: impl ExactSizeIterator<Item = &'f u32>) -> u32 {
        let (start, count) = (self.used % PACKET_LANES, leaf.len());
        let skipped = PACKET_LANES - start;
        if start + count > PACKET_LANES && skipped <= self.spare {
            self.spare -= skipped;
            self.used += skipped;
        }
        let (first, last) = (self.used / PACKET_LANES, (self.used + count - 1) / PACKET_LANES);
        let free = self.facets.as_flattened_mut().iter_mut().skip(self.used);
        free.zip(leaf).for_each(|(lane, &facet)| *lane = facet);
        self.used += count;
        LEAF_CHILD | first as u32 | if last > first { PAIR } else { 0 }
    }
}
