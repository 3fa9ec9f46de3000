//! A coupling that is kept under a scene of other materials and of parts at other poses: what becomes of each row, and the
//! rows of the new coupling.

use super::Executor;
use crate::base::arena::{ALIGNMENT, Arena};
use crate::base::error::Error;
use crate::coupling::Coupling;
use crate::coupling::element::Elements;
use crate::coupling::kept::{Change, Fates, Kept, ROW_REDONE};
use crate::coupling::motion::Motion;
use crate::coupling::plane_sides::PlaneSides;
use crate::coupling::rows::CouplingRows;
use crate::rays::bvh::Bvh;
use crate::scene::Scene;
use crate::scene::pose::Parts;
use crate::settings::{self, Settings};

/// A coupling that is kept, and the scene that it is to be of.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    /// The scene of the coupling.
    pub old: &'a Scene<'a>,
    /// Its elements, which stay.
    pub elements: &'a Elements<'a>,
    /// Its rows.
    pub coupling: &'a Coupling<'a>,
    /// By which it was made.
    pub settings: &'a Settings,
    /// The new scene and its tree.
    pub scene: &'a Scene<'a>,
    /// The tree of the new scene.
    pub bvh: &'a Bvh<'a>,
    /// The parts that stand elsewhere in the new scene, and where; `None`: nothing moved.
    pub parts: Option<Parts<'a>>,
}

impl Update<'_> {
    fn planes(&self) -> bool {
        settings::planes(self.scene, &self.settings.rows(self.scene))
    }

    fn poses(&self) -> usize {
        self.parts.map_or(0, |parts| parts.poses.len())
    }

    /// Bytes of scratch memory for [`Update::run`].
    pub fn bytes(&self) -> Result<usize, Error> {
        let planes = PlaneSides::bytes(self.scene, self.planes())?;
        let need = Change::need(self.old).join(Motion::need(self.poses()));
        need.and::<u8>(self.elements.unknowns()).and::<u8>(planes + 2 * ALIGNMENT).bytes()
    }

    /// Finds what becomes of each row and calls `fill` with the rows of the new coupling; with `None` where all that is kept
    /// is the new coupling as it is. Returns what `fill` does, the counts of rows, and of each row what became of it.
    ///
    /// # Errors
    /// Those of [`Change::new`] and [`Motion::new`]; [`Error::Mismatch`] for another mesh.
    pub fn run<'m, T, X: Executor>(
        &self,
        memory: &'m mut [u8],
        run: &mut X,
        fill: impl FnOnce(Option<&CouplingRows<'_>>, &mut X) -> Result<T, X::Error>,
    ) -> Result<(T, Fates, &'m [u8]), X::Error> {
        let Update { old, elements, coupling, settings, scene, bvh, parts } = *self;
        let mut arena = Arena::new(memory, self.bytes()?)?;
        let fates = arena.take::<u8>(elements.unknowns())?;
        let plane_memory = arena.keep::<u8>(PlaneSides::bytes(scene, self.planes())?)?;
        let rest = arena.keep::<u8>(arena.left().saturating_sub(ALIGNMENT))?;
        let mut arena = Arena::new(&mut *rest, 0)?;
        if parts.is_none() && !scene.has_mesh_of(old) {
            return Err(Error::Mismatch { what: "mesh" }.into());
        }
        let motion = parts.map(|parts| Motion::new(old, scene, parts, &mut arena)).transpose()?;
        let change = Change::new(old, scene, elements, settings.rows(scene).all, &mut arena)?;
        let change = change.moved(motion.as_ref(), settings.directional);
        if change.is_diffuse_alone(coupling) {
            let all = Fates { kept: elements.unknowns() as u64, ..Fates::default() };
            return Ok((fill(None, run)?, all, fates));
        }
        run.rows(fates, 1, 0.0, |range, out| {
            change.judge(coupling, range, out);
            Ok(())
        })?;
        let count = Fates::count(fates);
        let plane_sides = &PlaneSides::new(scene, bvh, count.redone > 0 && self.planes(), plane_memory)?;
        let rows = settings.rows_within(scene, elements.unknowns());
        let kept = Some(Kept { coupling, change: &change, fates });
        let rows = CouplingRows { scene, bvh, elements, plane_sides, rows, kept };
        Ok((fill(Some(&rows), run)?, count, fates))
    }

    /// Rays of the rows of a coupling that were computed anew.
    pub fn rays(coupling: &Coupling<'_>, fates: &[u8]) -> u64 {
        let redone = |(unknown, _): &(usize, _)| fates.get(*unknown).is_some_and(|fate| *fate == ROW_REDONE);
        let rows = coupling.rows(0..coupling.unknowns()).filter(redone);
        rows.map(|(_, row)| row.row.all_rays()).sum()
    }
}
