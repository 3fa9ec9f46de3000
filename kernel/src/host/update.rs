//! A coupling that is kept while materials change and parts move.

use super::{Bytes, Clock, Geometry, GeometryMemory, Host, Report, Run, Seconds, blocks};
use crate::base::arena::{Arena, Memory};
use crate::base::error::Error;
use crate::coupling::Coupling;
use crate::coupling::kept::{Change, Fates, Kept, ROW_REDONE};
use crate::coupling::motion::Motion;
use crate::coupling::plane_sides::PlaneSides;
use crate::rays::bvh::Bvh;
use crate::scene::pose::Parts;
use crate::scene::{Scene, SceneInput};
use crate::settings;
use crate::stages::{self, CouplingRows, UpdateMemory};
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
        if !scene.has_mesh_of(&kept.scene) {
            return Err(Error::Mismatch { what: "mesh" });
        }
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
        if !scene.has_areas_of(&kept.scene) {
            return Err(Error::Mismatch { what: "mesh" });
        }
        let mut seconds = Seconds { scene: clock.lap(), ..Seconds::default() };
        *bvh_memory = Memory::new(Bvh::bytes(scene.facets())?);
        let bvh = Bvh::build(scene.corners(), scene.areas(), self.isa, bvh_memory.bytes_mut())?;
        seconds.bvh = clock.lap();
        self.renewed(kept, (scene, bvh), slabs, Some(parts), (seconds, clock))
    }

    /// The coupling of a scene that differs from that of `kept` in materials and in the poses of parts.
    fn renewed<'n>(
        &self,
        kept: &'n Geometry<'n>,
        (scene, bvh): (Scene<'n>, Bvh<'n>),
        slabs: &'n mut Vec<Memory>,
        parts: Option<&Parts<'_>>,
        (seconds, mut clock): (Seconds, Clock),
    ) -> Result<Geometry<'n>, Error> {
        let (elements, settings, memory_budget) = (kept.elements, kept.settings, kept.memory_budget);
        let bytes = Bytes { scene: scene.memory(), bvh: bvh.memory(), ..kept.report.bytes };
        let mut report = Report { bytes, seconds, ..kept.report.clone() };
        (report.rays.visibility, report.pairs, report.certified) = Default::default();
        report.skipped.clear();
        let (matrix, mut run) = (kept.coupling()?, Run::new(self));
        let mut scratch = Memory::new(UpdateMemory::need(&kept.scene, &elements).bytes()?);
        let UpdateMemory { mut change, fates } =
            UpdateMemory::take(&kept.scene, &elements, scratch.bytes_mut())?;
        let mut moved = Memory::new(Motion::need(parts.map_or(0, |parts| parts.poses.len())).bytes()?);
        let mut moved = Arena::new(moved.bytes_mut(), 0)?;
        let motion = parts.map(|parts| Motion::new(&kept.scene, *parts, &mut moved)).transpose()?;
        let all = settings.rows(&scene).all;
        let change = Change::new(&kept.scene, &scene, &elements, all, &mut change)?;
        let change = change.moved(motion.as_ref(), settings.directional);
        let blocks = if change.is_diffuse_alone(&matrix) {
            report.rows = Fates { kept: elements.unknowns() as u64, ..Fates::default() };
            kept.blocks.clone()
        } else {
            report.rows = stages::judge(&change, &matrix, fates, &mut run)?;
            let rows = settings.rows_within(&scene, elements.unknowns());
            let wanted = report.rows.redone > 0 && settings::planes(&scene, &rows);
            let mut planes = Memory::new(PlaneSides::bytes(&scene, wanted)?);
            let plane_sides = &PlaneSides::new(&scene, &bvh, wanted, planes.bytes_mut())?;
            let kept = Some(Kept { coupling: &matrix, change: &change, fates });
            let rows =
                CouplingRows { scene: &scene, bvh: &bvh, elements: &elements, plane_sides, rows, kept };
            blocks(&rows, memory_budget, slabs, &mut run)?
        };
        let coupling = Coupling::new(&blocks, elements.unknowns())?;
        let redone = |(unknown, _): &(usize, _)| fates.get(*unknown).is_some_and(|fate| *fate == ROW_REDONE);
        let rows = coupling.rows(0..elements.unknowns()).filter(redone);
        report.rays.visibility = rows.map(|(_, row)| row.row.all_rays()).sum();
        report.count_rows(&coupling);
        report.count_scene(&scene, settings.directional, elements.unknowns());
        report.bytes.coupling = coupling.memory() + elements.memory();
        report.seconds.coupling = clock.lap();
        let (reference, rays) = (kept.reference.clone(), coupling.rays());
        Ok(Geometry { scene, bvh, elements, blocks, settings, reference, memory_budget, rays, report })
    }
}
