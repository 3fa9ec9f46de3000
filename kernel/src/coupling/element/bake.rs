//! Elements in baked blocks.

use super::{ELEMENT_NODE, Elements, Groups, walk};
use crate::base::arena::View;
use crate::base::arena::Writer;
use crate::base::error::Error;
use crate::base::index::Index;
use crate::coupling::cluster::CLUSTERS_MADE;
use crate::scene::Scene;

impl<'m> Elements<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let groups = &self.groups;
        let counts = [self.nodes.len(), self.facet.len(), groups.shares.len(), groups.members.len()];
        writer.put(&counts.map(|count| count as u64))?;
        writer.put(self.nodes)?;
        writer.put(self.facet)?;
        writer.put(self.path)?;
        writer.put(groups.starts)?;
        writer.put(groups.members)?;
        writer.put(groups.sums)?;
        writer.put(groups.shares)
    }

    pub(crate) fn get(view: &mut View<'m>, scene: &Scene<'_>) -> Result<Elements<'m>, Error> {
        let counts = view.take::<u64>(4)?;
        let [nodes, elements, clusters, members] = [0, 1, 2, 3].map(|k| counts.at(k) as usize);
        let facets = scene.facets();
        if nodes < facets
            || elements > nodes
            || nodes > ELEMENT_NODE as usize
            || clusters > elements
            || members > facets
            || !CLUSTERS_MADE && clusters > 0
        {
            return Err(Error::Block);
        }
        let nodes = view.take::<u32>(nodes)?;
        let facet = view.take::<u32>(elements)?;
        let path = view.take::<u32>(elements)?;
        let (starts, members) = (view.take::<u32>(clusters + 1)?, view.take::<u32>(members)?);
        let (sums, shares) = (view.take::<f32>(members.len())?, view.take::<f64>(clusters)?);
        let groups = Groups { starts, members, sums, shares };
        if !groups.is_sound(scene, (facet, nodes)) {
            return Err(Error::Block);
        }
        // quarters come after what they are quarters of: a walk down ends
        let sound = |(node, &child): (usize, &u32)| {
            child & ELEMENT_NODE != 0
                || (child as usize > node && (child as usize) < nodes.len().saturating_sub(3))
        };
        if !nodes.iter().enumerate().all(sound) {
            return Err(Error::Block);
        }
        let child = |node: usize| Some(nodes.at(node)).filter(|c| c & ELEMENT_NODE == 0).map(|c| c as usize);
        let mut at = clusters;
        // those of clusters were looked at
        let alone = |facet: &usize| {
            nodes.at(*facet) & ELEMENT_NODE == 0 || (nodes.at(*facet) & !ELEMENT_NODE) as usize >= clusters
        };
        let good = walk((0..facets).filter(alone), child, |of, node, steps| {
            let same = nodes.at(node) == ELEMENT_NODE | at as u32
                && facet.get(at).is_some_and(|f| *f as usize == of)
                && path.get(at).is_some_and(|p| *p == steps.0);
            at += 1;
            same
        });
        if !good || at != elements {
            return Err(Error::Block);
        }
        let memory = Elements::need(nodes.len(), elements, (clusters, members.len())).bytes()?;
        Ok(Elements { nodes, facet, path, facets, sides: scene.sides(), groups, memory })
    }
}

impl Groups<'_> {
    /// Whether clusters have facets each of which knows its cluster, all of one material, and shares that fill it; `facet` is
    /// the facet of each element, `nodes` those of all facets first.
    fn is_sound(&self, scene: &Scene<'_>, (facet, nodes): (&[u32], &[u32])) -> bool {
        let filled =
            self.starts.first() == Some(&0) && self.starts.last() == Some(&(self.members.len() as u32));
        // facets that know a cluster are as many as its members: none is left out, none stands twice
        let known = nodes.iter().take(scene.facets()).filter(|node| {
            **node & ELEMENT_NODE != 0 && ((**node & !ELEMENT_NODE) as usize) < self.shares.len()
        });
        filled
            && known.count() == self.members.len()
            && (0..self.shares.len()).all(|cluster| {
                let range = self.range(cluster);
                let (members, sums) = (self.of(cluster), self.sums.part(range.clone()));
                let material = scene.material(facet.at(cluster) as usize);
                let mut last = 0.0;
                range.start < range.end
                    && members.contains(&facet.at(cluster))
                    && members.iter().all(|&own| {
                        nodes.at(own as usize) == ELEMENT_NODE | cluster as u32
                            && scene.material(own as usize) == material
                    })
                    && sums.iter().all(|&sum| {
                        let grows = sum >= core::mem::replace(&mut last, sum);
                        grows && sum <= 1.0
                    })
                    && self.shares.get(cluster).is_some_and(|share| share.is_finite() && *share >= 1.0)
            })
    }
}
