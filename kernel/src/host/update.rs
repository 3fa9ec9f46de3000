//! A coupling that is kept while materials change.

use super::{Bytes, Clock, Geometry, GeometryMemory, Host, Report, Run, Seconds, blocks};
use crate::base::arena::Memory;
use crate::base::error::Error;
use crate::coupling::Coupling;
use crate::coupling::kept::{Change, Fates, Kept, ROW_REDONE};
use crate::coupling::plane_sides::PlaneSides;
use crate::scene::{Scene, SceneInput};
use crate::settings;
use crate::stages::{self, CouplingRows, UpdateMemory};

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
        let (elements, settings) = (kept.elements, kept.settings);
        let GeometryMemory { scene: scene_memory, slabs, .. } = memory;
        *scene_memory = Memory::new(Scene::bytes(input)?);
        let scene = Scene::new(input, scene_memory.bytes_mut())?;
        if !scene.has_mesh_of(&kept.scene) {
            return Err(Error::Mismatch { what: "mesh" });
        }
        let mut report = Report {
            bytes: Bytes { scene: scene.memory(), ..kept.report.bytes },
            seconds: Seconds { scene: clock.lap(), ..Seconds::default() },
            ..kept.report.clone()
        };
        (report.rays.visibility, report.pairs, report.certified) = Default::default();
        report.skipped.clear();
        let (matrix, mut run) = (kept.coupling()?, Run::new(self));
        let mut scratch = Memory::new(UpdateMemory::need(&kept.scene, &elements).bytes()?);
        let UpdateMemory { mut change, fates } =
            UpdateMemory::take(&kept.scene, &elements, scratch.bytes_mut())?;
        let change = Change::new(&kept.scene, &scene, &elements, settings.rows(&scene).all, &mut change)?;
        let blocks = if change.is_diffuse_alone(&matrix) {
            report.rows = Fates { kept: elements.unknowns() as u64, ..Fates::default() };
            kept.blocks.clone()
        } else {
            report.rows = stages::judge(&change, &matrix, fates, &mut run)?;
            let rows = settings.rows_within(&scene, elements.unknowns());
            let wanted = report.rows.redone > 0 && settings::planes(&scene, &rows);
            let mut planes = Memory::new(PlaneSides::bytes(&scene, wanted)?);
            let plane_sides = &PlaneSides::new(&scene, &kept.bvh, wanted, planes.bytes_mut())?;
            let kept_rows = Some(Kept { coupling: &matrix, change: &change, fates });
            let (bvh, elements) = (&kept.bvh, &elements);
            let rows = CouplingRows { scene: &scene, bvh, elements, plane_sides, rows, kept: kept_rows };
            blocks(&rows, kept.memory_budget, slabs, &mut run)?
        };
        let coupling = Coupling::new(&blocks, elements.unknowns())?;
        let redone = |(unknown, _): &(usize, _)| fates.get(*unknown).is_some_and(|fate| *fate == ROW_REDONE);
        let all = coupling.rows(0..elements.unknowns());
        report.rays.visibility = all.filter(redone).map(|(_, row)| row.row.all_rays()).sum();
        report.count_rows(&coupling);
        report.count_scene(&scene, settings.directional, elements.unknowns());
        report.bytes.coupling = coupling.memory() + elements.memory();
        report.seconds.coupling = clock.lap();
        let (bvh, reference, rays) = (kept.bvh, kept.reference.clone(), coupling.rays());
        let memory_budget = kept.memory_budget;
        Ok(Geometry { scene, bvh, elements, blocks, settings, reference, memory_budget, rays, report })
    }
}
