//! Elements in baked blocks.

use super::{Elements, MAX_DIVISIONS};
use crate::arena::View;
use crate::bake::Writer;
use crate::error::Error;
use crate::index::Index;
use crate::scene::Scene;

impl<'m> Elements<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.put(self.divisions)?;
        writer.put(self.first)?;
        writer.put(self.facet)?;
        writer.put(self.roughness)
    }

    pub(crate) fn get(view: &mut View<'m>, scene: &Scene<'_>) -> Result<Elements<'m>, Error> {
        let divisions = view.take::<u32>(scene.facets())?;
        if divisions.iter().any(|s| !(1..=MAX_DIVISIONS).contains(s)) {
            return Err(Error::Block);
        }
        let memory = Elements::bytes(divisions)?;
        let first = view.take::<u32>(divisions.len() + 1)?;
        let facet = view.take::<u32>(super::count(divisions)?)?;
        let roughness = view.take::<f32>(divisions.len())?;
        // the root of a variance of shares
        if roughness.iter().any(|r| !(0.0..=10.0).contains(r)) {
            return Err(Error::Block);
        }
        let mut at = 0;
        for (index, (&s, &start)) in divisions.iter().zip(first).enumerate() {
            let own = facet.part(at..at + (s * s) as usize);
            if start as usize != at || own.iter().any(|f| *f as usize != index) {
                return Err(Error::Block);
            }
            at += own.len();
        }
        if first.last().map(|end| *end as usize) != Some(at) {
            return Err(Error::Block);
        }
        Ok(Elements { first, divisions, facet, roughness, sides: scene.sides(), memory })
    }
}
