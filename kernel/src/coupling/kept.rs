//! What is kept of a coupling where materials change: rows that still hold are copied, all others are computed anew.
//!
//! Rows hold form factors and the mirrors on the way, no reflectance: new diffuse reflectances leave all of them as they
//! are, and new mirror reflectances the products of their paths alone. A row is computed anew where its rays may have met
//! what sent or mirrored nothing and does now, where facets that were one mirror class are so no longer, where mirrors
//! reflect more and chains had been cut, and where nothing needed the row before.
//!
//! Constants of this file are measured by `cargo test --test update` (rows that are kept and their bits).

use super::mirror_path::STRAIGHT;
use super::{ABSENT, BLOCKED, Coupling, OPEN, RowView};
use crate::base::arena::{Arena, Need};
use crate::base::error::{Error, Field};
use crate::base::index::{Index, IndexMut};
use crate::base::math::fabs;
use crate::coupling::element::Elements;
use crate::coupling::motion::Motion;
use crate::scene::pose::Pose;
use crate::scene::{NO_MIRROR, Scene};
use core::ops::Range;

/// What becomes of a row: it is kept as it is.
pub const ROW_KEPT: u8 = 0;
/// What becomes of a row: it is kept with other products of mirror reflectances.
pub const ROW_RESCALED: u8 = 1;
/// What becomes of a row: it is computed anew.
pub const ROW_REDONE: u8 = 2;

/// The class of facets that were one mirror and are several.
const MIRROR_SPLIT: u32 = u32::MAX - 1;

/// Mark of a facet that is a target of rows and was none.
const NEW_TARGET: u8 = 1;

/// Mark of a facet that mirrors and did not.
const NEW_MIRROR: u8 = 2;

/// Share of the hemisphere by which what a row's rays met may differ from what its entries say, by rounding.
const ACCOUNTED_SHARE: f64 = 1e-6;

/// How a scene differs from that of a coupling.
#[derive(Clone, Copy, Debug)]
pub struct Change<'a> {
    /// The scene before.
    old: &'a Scene<'a>,
    /// The scene now.
    new: &'a Scene<'a>,
    elements: &'a Elements<'a>,
    /// Of each material of the old scene that names a mirror class: the class or, of no reflectance, the material of the new
    /// scene that stands for it; or [`MIRROR_SPLIT`].
    mirrors: &'a [u32],
    /// Of each facet [`NEW_TARGET`] and [`NEW_MIRROR`].
    facets: &'a [u8],
    /// Rows of sides that reflect nothing diffusely are wanted, too.
    all: bool,
    /// What rows cannot tell that they met is now a target or mirrors.
    unseen: bool,
    /// Some facet mirrors that did not.
    mirror: bool,
    /// Some mirror reflects more than before.
    grown: bool,
    /// Some path's product is another.
    rescaled: bool,
    /// Some mirror class has another name.
    renamed: bool,
    /// Rows keep the directions of escapes.
    directional: bool,
    /// What moved.
    motion: Option<&'a Motion<'a>>,
}

impl<'a> Change<'a> {
    /// Bytes for scenes of as many facets and, before, materials.
    pub fn need(old: &Scene<'_>) -> Need {
        Need::new().and::<u32>(old.materials()).and::<u8>(old.facets())
    }

    /// Compares two scenes of one mesh; `all` as in [`crate::coupling::rows::RowSettings::all`].
    ///
    /// # Errors
    /// [`Error::Mismatch`] for scenes of other facets, sides or bands; [`Error::Uncoupled`] for a facet that shares an
    /// element with facets of another material.
    pub fn new(
        old: &'a Scene<'a>,
        new: &'a Scene<'a>,
        elements: &'a Elements<'a>,
        all: bool,
        arena: &mut Arena<'a>,
    ) -> Result<Change<'a>, Error> {
        let same = old.facets() == new.facets() && old.sides() == new.sides() && old.bands() == new.bands();
        if !same || elements.facet_sides() != new.facets() * new.sides() {
            return Err(Error::Mismatch { what: "scene" });
        }
        check_clusters(new, elements)?;
        let mirrors = arena.take::<u32>(old.materials())?;
        let facets = arena.take::<u8>(old.facets())?;
        let mut change = Change {
            old,
            new,
            elements,
            mirrors: &[],
            facets: &[],
            all,
            unseen: false,
            mirror: false,
            grown: false,
            rescaled: false,
            renamed: false,
            directional: true,
            motion: None,
        };
        mirrors.fill(NO_MIRROR);
        for (facet, mark) in facets.iter_mut().enumerate().filter(|(facet, _)| new.areas().at(*facet) > 0.0) {
            *mark = change.mark(facet, mirrors);
        }
        (change.mirrors, change.facets) = (mirrors, facets);
        Ok(change)
    }

    /// The same where parts have moved, of rows with or without directions.
    pub fn moved(self, motion: Option<&'a Motion<'a>>, directional: bool) -> Change<'a> {
        Change { motion, directional, ..self }
    }

    /// The marks of a facet; notes what became of its mirror class.
    fn mark(&mut self, facet: usize, mirrors: &mut [u32]) -> u8 {
        let (Change { old, new, .. }, [was, is]) = (*self, [self.old, self.new].map(|s| s.material(facet)));
        let (glowed, glows) = (old.glows(was), new.glows(is));
        let (class, mirror) = (old.mirror(was), new.mirror(is));
        let mut mark = if glows && !glowed { NEW_TARGET } else { 0 };
        if class == NO_MIRROR {
            if mirror != NO_MIRROR {
                mark |= NEW_MIRROR;
                self.mirror = true;
            }
        } else {
            let place = class as usize;
            let now = mirrors.at(place);
            let same = || same_mirror(new, now as usize, is);
            // lobes send rays elsewhere; a mirror of no reflectance sends none
            let bent = mirror != NO_MIRROR && old.gloss(was) != new.gloss(is);
            let split = bent || now == MIRROR_SPLIT || now != NO_MIRROR && !same();
            let own = if mirror == NO_MIRROR { is as u32 } else { mirror };
            mirrors.set(place, if split { MIRROR_SPLIT } else { own });
            self.renamed |= split || own != class;
            for (before, after) in old.specular(was).iter().zip(new.specular(is)) {
                self.rescaled |= before != after;
                self.grown |= after > before;
            }
        }
        self.unseen |= mark & NEW_TARGET != 0 || mark & NEW_MIRROR != 0 && !glowed;
        mark
    }

    /// Whether nothing but diffuse reflectances and emissions may be other ones, and no row is wanted that was not.
    pub fn is_diffuse_alone(&self, coupling: &Coupling<'_>) -> bool {
        let none = self.motion.is_none()
            && !(self.unseen || self.mirror || self.grown || self.rescaled || self.renamed);
        none && coupling.rows(0..coupling.unknowns()).all(|(unknown, row)| self.is_enough(unknown, &row))
    }

    /// What becomes of the rows of `range`, written to `fates`.
    pub fn judge(&self, coupling: &Coupling<'_>, range: Range<usize>, fates: &mut [u8]) {
        for ((unknown, row), fate) in coupling.rows(range).zip(fates) {
            *fate = self.fate(unknown, &row);
        }
    }

    fn fate(&self, unknown: usize, row: &RowView<'_>) -> u8 {
        if !self.is_enough(unknown, row) {
            return ROW_REDONE;
        }
        if row.row.state == ABSENT {
            return ROW_KEPT;
        }
        let keeps = |motion: &Motion<'_>| motion.keeps(self.elements, unknown, row, self.directional);
        if !self.motion.is_none_or(keeps) {
            return ROW_REDONE;
        }
        if row.row.state == OPEN {
            return ROW_KEPT;
        }
        let mark = |mark: u8| {
            let marked = |facet: &u32| self.facets.at(*facet as usize) & mark != 0;
            row.targets.iter().any(|r| self.elements.facets_of(r.unknown()).iter().any(marked))
        };
        let redone = self.unseen && !is_accounted(row)
            || self.mirror && mark(NEW_MIRROR)
            || self.grown && row.row.truncated_weight > 0.0;
        if redone {
            return ROW_REDONE;
        }
        let paths = row.targets.iter().map(|r| r.path()).chain(row.escapes.map(|b| b.path));
        let mut fate = ROW_KEPT;
        let changed = self.rescaled || self.renamed;
        for path in paths.filter(|path| changed && !matches!(*path, STRAIGHT | BLOCKED)) {
            let mut at = path;
            while at != STRAIGHT {
                let entry = row.path(at);
                if self.mirrors.at(entry.class as usize) == MIRROR_SPLIT {
                    return ROW_REDONE;
                }
                at = entry.parent;
            }
            fate = if self.rescaled { ROW_RESCALED } else { ROW_KEPT };
        }
        fate
    }

    /// Whether a row is there that is wanted.
    fn is_enough(&self, unknown: usize, row: &RowView<'_>) -> bool {
        let facet = self.elements.facet_of(unknown).0;
        let black = self.new.diffuse(self.new.material(facet)).iter().all(|rho| *rho == 0.0);
        row.row.state != ABSENT || self.new.areas().at(facet) == 0.0 || black && !self.all
    }
}

/// Whether two materials of a scene are one mirror.
fn same_mirror(scene: &Scene<'_>, a: usize, b: usize) -> bool {
    let dull = scene.mirror(a) == NO_MIRROR && scene.mirror(b) == NO_MIRROR;
    dull || scene.specular(a) == scene.specular(b) && scene.gloss(a) == scene.gloss(b)
}

/// Whether all that a row's rays met is among its targets, and none was mirrored.
fn is_accounted(row: &RowView<'_>) -> bool {
    let straight = row.targets.iter().all(|r| r.path() == STRAIGHT);
    let met = row.targets.iter().map(|r| r.weight).sum::<f64>();
    let mut escapes = row.escapes;
    row.row.chain_rays == 0
        && straight
        && escapes.all(|bundle| matches!(bundle.path, STRAIGHT | BLOCKED))
        && fabs(row.row.blocked - met) <= ACCOUNTED_SHARE
}

/// Refuses facets of one element that have several materials.
fn check_clusters(scene: &Scene<'_>, elements: &Elements<'_>) -> Result<(), Error> {
    for unknown in (0..elements.unknowns()).take_while(|unknown| elements.is_cluster(*unknown)) {
        let own = scene.material(elements.facet_of(unknown).0);
        let other = elements.facets_of(unknown).iter().find(|facet| scene.material(**facet as usize) != own);
        if let Some(facet) = other {
            return Err(Error::Uncoupled { facet: *facet as usize, field: Field::FacetMaterials });
        }
    }
    Ok(())
}

/// A coupling of which rows are kept.
#[derive(Clone, Copy, Debug)]
pub struct Kept<'a> {
    /// The rows.
    pub coupling: &'a Coupling<'a>,
    /// How the scene differs from theirs.
    pub change: &'a Change<'a>,
    /// State of each row after the change.
    pub fates: &'a [u8],
}

impl<'a> Kept<'a> {
    /// The row of an unknown where it is kept.
    pub(super) fn row(&self, unknown: usize) -> Option<RowView<'a>> {
        let redone = self.fates.get(unknown).is_none_or(|fate| *fate == ROW_REDONE);
        if redone { None } else { self.coupling.rows(unknown..unknown + 1).next().map(|(_, row)| row) }
    }

    /// How the directions of an unknown's row are turned, where they are.
    pub(super) fn pose(&self, unknown: usize) -> Option<&Pose> {
        let facet = self.change.elements.facet_of(unknown).0;
        self.change.motion.map(|motion| motion.pose(facet)).filter(|pose| !pose.is_unturned())
    }

    /// The class that stands for one of the old scene's.
    pub(super) fn class(&self, class: u32) -> u32 {
        self.change.mirrors.get(class as usize).copied().unwrap_or(class)
    }
}

/// Counts of a coupling's rows that were kept, rescaled and redone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fates {
    /// Rows kept as they are.
    pub kept: u64,
    /// Rows kept with other products of mirror reflectances.
    pub rescaled: u64,
    /// Rows computed anew.
    pub redone: u64,
}

impl Fates {
    /// Counts them.
    pub fn count(fates: &[u8]) -> Fates {
        let of = |fate: u8| fates.iter().filter(|f| **f == fate).count() as u64;
        Fates { kept: of(ROW_KEPT), rescaled: of(ROW_RESCALED), redone: of(ROW_REDONE) }
    }
}
