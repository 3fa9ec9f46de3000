//! What becomes of the rows of a coupling that is kept under a scene of other materials.

use super::Executor;
use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::coupling::Coupling;
use crate::coupling::element::Elements;
use crate::coupling::kept::{Change, Fates};
use crate::scene::Scene;

/// Memory of the comparison of two scenes and of what becomes of each row.
#[derive(Debug)]
pub struct UpdateMemory<'m> {
    /// For [`Change::new`].
    pub change: Arena<'m>,
    /// One of each row.
    pub fates: &'m mut [u8],
}

impl<'m> UpdateMemory<'m> {
    /// Bytes for a coupling of a scene.
    pub fn need(old: &Scene<'_>, elements: &Elements<'_>) -> Need {
        Change::need(old).and::<u8>(elements.unknowns())
    }

    /// Carves it out of memory.
    pub fn take(
        old: &Scene<'_>,
        elements: &Elements<'_>,
        memory: &'m mut [u8],
    ) -> Result<UpdateMemory<'m>, Error> {
        let mut arena = Arena::new(memory, UpdateMemory::need(old, elements).bytes()?)?;
        let fates = arena.take(elements.unknowns())?;
        Ok(UpdateMemory { change: arena, fates })
    }
}

/// Finds what becomes of each row, and counts them.
pub fn judge<X: Executor>(
    change: &Change<'_>,
    coupling: &Coupling<'_>,
    fates: &mut [u8],
    run: &mut X,
) -> Result<Fates, X::Error> {
    run.rows(fates, 1, 0.0, |range, out| {
        change.judge(coupling, range, out);
        Ok(())
    })?;
    Ok(Fates::count(fates))
}
