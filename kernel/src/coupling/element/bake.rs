//! Elements in baked blocks.

use super::{ELEMENT_NODE, Elements, walk};
use crate::base::arena::View;
use crate::base::arena::Writer;
use crate::base::error::Error;
use crate::base::index::Index;
use crate::scene::Scene;

impl<'m> Elements<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.put(&[self.nodes.len() as u64, self.facet.len() as u64])?;
        writer.put(self.first)?;
        writer.put(self.nodes)?;
        writer.put(self.facet)?;
        writer.put(self.path)
    }

    pub(crate) fn get(view: &mut View<'m>, scene: &Scene<'_>) -> Result<Elements<'m>, Error> {
        let counts = view.take::<u64>(2)?;
        let (nodes, elements) = (counts.at(0) as usize, counts.at(1) as usize);
        let facets = scene.facets();
        if nodes < facets || elements > nodes || nodes > ELEMENT_NODE as usize {
            return Err(Error::Block);
        }
        let first = view.take::<u32>(facets + 1)?;
        let nodes = view.take::<u32>(nodes)?;
        let facet = view.take::<u32>(elements)?;
        let path = view.take::<u32>(elements)?;
        // quarters come after what they are quarters of: a walk down ends
        let sound = |(node, &child): (usize, &u32)| {
            child & ELEMENT_NODE != 0
                || (child as usize > node && (child as usize) < nodes.len().saturating_sub(3))
        };
        if !nodes.iter().enumerate().all(sound) {
            return Err(Error::Block);
        }
        let child = |node: usize| Some(nodes.at(node)).filter(|c| c & ELEMENT_NODE == 0).map(|c| c as usize);
        let mut at = 0;
        let good = walk(facets, child, |of, node, steps| {
            let same = nodes.at(node) == ELEMENT_NODE | at as u32
                && facet.get(at).is_some_and(|f| *f as usize == of)
                && path.get(at).is_some_and(|p| *p == steps.0)
                && first.get(of).is_some_and(|start| *start as usize <= at)
                && first.get(of + 1).is_some_and(|end| *end as usize > at);
            at += 1;
            same
        });
        let ordered = first.iter().zip(first.iter().skip(1)).all(|(a, b)| a <= b)
            && first.first() == Some(&0)
            && first.last() == Some(&(elements as u32));
        if !good || !ordered || at != elements {
            return Err(Error::Block);
        }
        let memory = Elements::need(facets, nodes.len(), elements).bytes()?;
        Ok(Elements { first, nodes, facet, path, sides: scene.sides(), memory })
    }
}
