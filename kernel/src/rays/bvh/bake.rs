//! Trees in baked blocks.

use super::{
    BVH_FACETS_MOST, Boxes, Bvh, LEAF_CHILD, NO_LANE_FACET, PAIR, Packet, STACK, Slack, Solid, extent,
    packed, solid,
};
use crate::base::arena::Writer;
use crate::base::arena::{View, plain_struct};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::math::Vec3;
use crate::base::simd::Isa;
use crate::rays::outline::Outlines;
use crate::scene::Scene;

plain_struct! {
    /// A tree without its arrays.
    pub struct Head {
        /// Nodes.
        pub nodes: u64,
        /// Packets of facets.
        pub packets: u64,
    }
}

impl<'m> Bvh<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.put(&[Head { nodes: self.boxes.len() as u64, packets: self.packets.len() as u64 }])?;
        writer.put(self.boxes)?;
        writer.put(self.children)?;
        writer.put(self.packets)?;
        writer.put(self.slacks)?;
        writer.put(self.facets)?;
        writer.put(self.solids)?;
        self.outlines.put(writer)
    }

    pub(crate) fn get(view: &mut View<'m>, scene: &Scene<'_>, isa: Isa) -> Result<Bvh<'m>, Error> {
        let head = view.take::<Head>(1)?.first().copied().ok_or(Error::Block)?;
        if head.nodes > BVH_FACETS_MOST as u64 || head.packets > BVH_FACETS_MOST as u64 {
            return Err(Error::Block);
        }
        let (nodes, packets) = (head.nodes as usize, head.packets as usize);
        let (low, high) = extent(scene.corners(), scene.areas())?;
        let mut bvh = Bvh {
            boxes: view.take::<Boxes>(nodes)?,
            children: view.take(nodes)?,
            packets: view.take::<Packet>(packets)?,
            slacks: view.take::<Slack>(packets)?,
            facets: view.take(packets)?,
            solids: view.take::<Solid>(scene.facets())?,
            levels: 0,
            low,
            high,
            scale: low.abs().max(high.abs()).max_element(),
            isa,
            external: None,
            outlines: Outlines::get(view, scene.facets())?,
        };
        bvh.levels = bvh.sound_levels().ok_or(Error::Block)?;
        if bvh.packets_sound(scene) { Ok(bvh) } else { Err(Error::Block) }
    }

    /// The levels of a tree whose nodes stand in order, each the child of one before it, with room on the stack;
    /// `None` for anything else. Walks over it end.
    fn sound_levels(&self) -> Option<usize> {
        let (mut next, mut levels, mut level_end) = (1, 0, 0);
        for (node, (boxes, children)) in self.boxes.iter().zip(self.children).enumerate() {
            if node == level_end {
                (levels, level_end) = (levels + 1, next);
            }
            for (child, &link) in children.iter().enumerate() {
                let side = |axis: usize, side: usize| boxes.at(axis).at(side).at(child);
                let low = [0, 1, 2].map(|axis| side(axis, 0));
                let high = [0, 1, 2].map(|axis| side(axis, 1));
                if low == [f32::INFINITY; 3] && high == [f32::NEG_INFINITY; 3] {
                    continue;
                }
                if !low.iter().zip(&high).all(|(l, h)| l.is_finite() && h.is_finite() && l <= h) {
                    return None;
                }
                if link & LEAF_CHILD != 0 {
                    let first = (link & !(LEAF_CHILD | PAIR)) as usize;
                    if first + usize::from(link & PAIR != 0) >= self.packets.len() {
                        return None;
                    }
                } else if link as usize == next {
                    next += 1;
                } else {
                    return None;
                }
            }
        }
        let all = if self.boxes.is_empty() { next == 1 } else { next == self.boxes.len() };
        (all && levels * 7 < STACK).then_some(levels)
    }

    /// Packets and solids are copies of the facets that they name, each facet of nonzero area in one lane.
    fn packets_sound(&self, scene: &Scene<'_>) -> bool {
        let mut live = 0;
        for ((packet, slack), lanes) in self.packets.iter().zip(self.slacks).zip(self.facets) {
            let known = |facet: &u32| *facet == NO_LANE_FACET || scene.areas().at(*facet as usize) > 0.0;
            if !lanes.iter().all(known) {
                return false;
            }
            live += lanes.iter().filter(|facet| **facet != NO_LANE_FACET).count();
            let wanted = packed(lanes, scene.corners());
            let differs = |(a, b): (&f32, &f32)| a.to_bits() != b.to_bits();
            let (rows, kept) = (wanted.0.as_flattened().as_flattened(), packet.as_flattened().as_flattened());
            if rows.iter().zip(kept).any(differs) || wanted.1.iter().zip(slack).any(differs) {
                return false;
            }
        }
        let same = |(kept, facet): (&Solid, &[Vec3; 3])| {
            kept.as_flattened()
                .iter()
                .zip(solid(facet).as_flattened())
                .all(|(a, b)| a.to_bits() == b.to_bits())
        };
        live == scene.facets() - scene.degenerate() && self.solids.iter().zip(scene.corners()).all(same)
    }
}
