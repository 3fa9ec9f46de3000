//! The sky that elements see straight: their rows in pieces of scratch memory, copied to the solution in the order of the
//! rows.
//!
//! Constants of this file are measured by `cargo bench --bench stages` (seconds).

use super::Executor;
use super::light::{Lighting, Scratch};
use crate::base::arena::{ALIGNMENT, Arena, Need, View};
use crate::base::error::Error;
use crate::base::index::{IndexMut, copy};
use crate::radiosity::solution::SolutionMemory;
use crate::radiosity::straight::{self, Looking};
use crate::rays::outline::Candidates;
use crate::scene::MAX_BANDS;
use crate::settings;

/// The most lanes that look at once.
const LOOKERS: usize = 8;

/// Rows of a piece.
const STRAIGHT_PIECE_ROWS: usize = 128;

/// Bytes of one lane.
fn piece(bands: usize) -> Result<usize, Error> {
    let rows = Need::new()
        .and::<f64>(straight::stride(bands.min(MAX_BANDS)) * STRAIGHT_PIECE_ROWS)
        .and::<f32>(STRAIGHT_PIECE_ROWS);
    Ok(Candidates::need(rows, 1).bytes()?.next_multiple_of(ALIGNMENT))
}

/// Bytes in which all lanes look.
pub(super) fn bytes(bands: usize) -> Result<usize, Error> {
    Ok(LOOKERS * piece(bands)?)
}

/// Fills the solution's straight sky.
pub(super) fn fill<X: Executor>(
    of: &Lighting<'_>,
    memory: &mut SolutionMemory<'_>,
    scratch: &mut Scratch<'_>,
    run: &mut X,
) -> Result<(), X::Error> {
    let Lighting { scene, bvh, elements, coupling, light, settings } = *of;
    let (Some(sky), false) = (&light.sky, memory.straight.is_empty()) else { return Ok(()) };
    let goal = settings::straight_goal(scene, &settings.budget);
    let deepest = straight::deepest(settings.all_irradiances);
    let (reference, budget) = (&*memory.reference, &settings.budget);
    let looking = Looking { scene, bvh, elements, coupling, sky, reference, goal, budget, deepest };
    let (bands, all) = (scene.bands(), elements.unknowns());
    let (part, stride) = (piece(bands)?, straight::stride(bands));
    let lanes = run.lanes().clamp(1, LOOKERS);
    let mut first = 0;
    while first < all {
        let range = |lane: usize| {
            (first + lane * STRAIGHT_PIECE_ROWS).min(all)..(first + (lane + 1) * STRAIGHT_PIECE_ROWS).min(all)
        };
        run.pieces(scratch.lookers.head_mut(lanes * part), part, 0.0, |lane, memory| {
            let (range, size) = (range(lane), memory.len());
            let mut arena = Arena::new(memory, size)?;
            let values = arena.take::<f64>(stride * STRAIGHT_PIECE_ROWS)?.head_mut(stride * range.len());
            let variance = arena.take::<f32>(STRAIGHT_PIECE_ROWS)?.head_mut(range.len());
            straight::rows(&looking, &mut Candidates::new(&mut arena, 1)?, range, values, variance)
        })?;
        for (lane, memory_of) in scratch.lookers.chunks(part.max(1)).take(lanes).enumerate() {
            let range = range(lane);
            let mut view = View::new(memory_of);
            let (values, variance) =
                (view.take::<f64>(stride * STRAIGHT_PIECE_ROWS)?, view.take::<f32>(STRAIGHT_PIECE_ROWS)?);
            let to = stride * range.start..stride * range.end;
            copy(memory.straight.part_mut(to), values);
            copy(memory.straight_variance.part_mut(range), variance);
        }
        first += lanes * STRAIGHT_PIECE_ROWS;
    }
    Ok(())
}
