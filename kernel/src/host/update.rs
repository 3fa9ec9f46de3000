//! A coupling that is kept while materials change and parts move.

use super::{Bytes, Clock, Geometry, GeometryMemory, Host, Report, Run, Seconds, blocks};
use crate::base::arena::Memory;
use crate::base::error::Error;
use crate::coupling::Coupling;
use crate::rays::bvh::Bvh;
use crate::scene::pose::Parts;
use crate::scene::{Scene, SceneInput};
use crate::stages::Update;
use std::vec::Vec;

impl Host {
    /// The geometry of the same mesh with other materials, by what still holds of a coupling: reflectances, emissions and
    /// lobes of all materials, and which facet has which. New diffuse reflectances and emissions trace no ray; rows that run
    /// through mirrors are multiplied by new products of reflectances; the rest is computed anew, and [`Report::rows`] says
    /// how many rows that were. Elements stay those of `kept`, and so do the rays of rows that are kept: where reflectances
    /// rose, a coupling from scratch may have more of them; estimates tell what that comes to.
    ///
    /// # Errors
    /// What [`Host::geometry`] refuses; [`Error::Mismatch`] for another mesh; [`Error::Uncoupled`] for a facet that shares an
    /// element with facets of another material.
    pub fn update<'n>(
        &self,
        kept: &'n Geometry<'n>,
        memory: &'n mut GeometryMemory,
        input: &SceneInput<'_>,
    ) -> Result<Geometry<'n>, Error> {
        let mut clock = Clock::start();
        memory.scene = Memory::new(Scene::bytes(input)?);
        let scene = Scene::new(input, memory.scene.bytes_mut())?;
        let seconds = Seconds { scene: clock.lap(), ..Seconds::default() };
        self.renewed(kept, (scene, kept.bvh), &mut memory.slabs, None, (seconds, clock))
    }

    /// The geometry of a mesh whose parts are moved, by what still holds of the coupling of `kept`, in which all stand where
    /// the mesh `input` has them: rows are kept whose rays can meet nothing that moved against them, before or after
    /// ([`crate::coupling::motion`]); the rest is computed anew. Materials may be other ones, too, as for [`Host::update`].
    ///
    /// The result depends on `kept` and on the poses, not on poses before. It differs from a coupling from scratch in that
    /// elements are those of `kept`, and that rays of rows that are kept turn with their parts: by what the estimates of both
    /// tell.
    ///
    /// # Errors
    /// Those of [`Host::update`] and of [`Parts::check`].
    pub fn pose<'n>(
        &self,
        kept: &'n Geometry<'n>,
        memory: &'n mut GeometryMemory,
        input: &SceneInput<'_>,
        parts: &Parts<'_>,
    ) -> Result<Geometry<'n>, Error> {
        let mut clock = Clock::start();
        let GeometryMemory { scene: scene_memory, bvh: bvh_memory, slabs, .. } = memory;
        *scene_memory = Memory::new(Scene::bytes(input)?);
        let scene = Scene::posed(input, parts, scene_memory.bytes_mut())?;
        let mut seconds = Seconds { scene: clock.lap(), ..Seconds::default() };
        *bvh_memory = Memory::new(Bvh::bytes(scene.facets())?);
        let bvh = Bvh::build(scene.corners(), scene.areas(), self.isa, bvh_memory.bytes_mut())?;
        seconds.bvh = clock.lap();
        self.renewed(kept, (scene, bvh), slabs, Some(*parts), (seconds, clock))
    }

    /// The coupling of a scene that differs from that of `kept` in materials and in the poses of parts.
    fn renewed<'n>(
        &self,
        kept: &'n Geometry<'n>,
        (scene, bvh): (Scene<'n>, Bvh<'n>),
        slabs: &'n mut Vec<Memory>,
        parts: Option<Parts<'_>>,
        (seconds, mut clock): (Seconds, Clock),
    ) -> Result<Geometry<'n>, Error> {
        let (elements, settings, memory_budget) = (kept.elements, kept.settings, kept.memory_budget);
        let bytes = Bytes { scene: scene.memory(), bvh: bvh.memory(), ..kept.report.bytes };
        let mut report = Report { bytes, seconds, ..kept.report.clone() };
        (report.rays.visibility, report.pairs, report.certified) = Default::default();
        report.skipped.clear();
        let (matrix, mut run) = (kept.coupling()?, Run::new(self));
        let update = Update {
            old: &kept.scene,
            elements: &elements,
            coupling: &matrix,
            settings: &settings,
            scene: &scene,
            bvh: &bvh,
            parts,
        };
        let mut scratch = Memory::new(update.bytes()?);
        let (blocks, fates, each) = update.run(scratch.bytes_mut(), &mut run, |rows, run| match rows {
            Some(rows) => blocks(rows, memory_budget, slabs, run),
            None => Ok(kept.blocks.clone()),
        })?;
        let coupling = Coupling::new(&blocks, elements.unknowns())?;
        report.rows = fates;
        report.rays.visibility = Update::rays(&coupling, each);
        report.count_rows(&coupling);
        report.count_scene(&scene, settings.directional, elements.unknowns());
        report.bytes.coupling = coupling.memory() + elements.memory();
        report.seconds.coupling = clock.lap();
        let (reference, rays) = (kept.reference.clone(), coupling.rays());
        Ok(Geometry { scene, bvh, elements, blocks, settings, reference, memory_budget, rays, report })
    }
}
