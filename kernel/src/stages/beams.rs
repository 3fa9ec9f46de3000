//! Beams, sunlight that mirrors reflect: their rows in pieces of scratch memory, added to the direct light in the order
//! of the rows.

use super::light::{Lighting, SHARES, Scratch, beam_settings};
use super::{Executor, block_rows};
use crate::base::arena::ALIGNMENT;
use crate::base::error::Error;
use crate::base::index::IndexMut;
use crate::coupling::{Block, Coupling, row_builder};
use crate::radiosity::beam::{self, BeamSettings};
use crate::radiosity::solution::SolutionMemory;
use crate::radiosity::sun_image::SunImagesMut;
use crate::scene::sun::Sun;
use crate::settings;
use core::ops::Range;

/// Beams on their way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beams {
    /// Rows whose light has been added.
    rows: usize,
    /// Their rays.
    pub rays: u64,
}

impl Beams {
    /// Adds the sunlight that mirrors reflect onto elements, of all rows that are left. `memory`, of any content, is
    /// split among the lanes.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] where no row fits: to be called again with as many bytes as that says.
    pub fn add<X: Executor>(
        &mut self,
        of: &Lighting<'_>,
        solution: &mut SolutionMemory<'_>,
        scratch: &mut Scratch<'_>,
        memory: &mut [u8],
        run: &mut X,
    ) -> Result<(), X::Error> {
        let Lighting { scene, elements, light, settings, .. } = *of;
        let mut images = SunImagesMut {
            slots: &mut *solution.slots,
            reflected_irradiance: &mut *solution.reflected_irradiance,
            spread: &mut *scratch.spread,
            reference: &*solution.reference,
            corners: scene.corners(),
        };
        if self.rows == 0 {
            images.spread.fill(0.0);
            images.slots.fill(0);
            images.reflected_irradiance.fill(0.0);
        }
        let Some((settings, sun)) = beam_settings(scene, light, settings).zip(light.sun.as_ref()) else {
            return Ok(());
        };
        let all = scene.facets() * scene.sides();
        let piece = block_rows(all);
        let usual = row_builder::bytes(piece, 64, beam::unmerged(scene, elements, &settings), scene.bands())?;
        let usual = usual.next_multiple_of(ALIGNMENT);
        let size = memory.len();
        let mut lanes = run.lanes().min(size / usual.max(1)).max(1);
        while self.rows < all {
            let part = if lanes > 1 { usual } else { size };
            let first = self.rows;
            let range = |lane: usize| (first + lane * piece).min(all)..(first + (lane + 1) * piece).min(all);
            let share = 0.5 * SHARES[1] * (lanes * piece) as f64 / (all + lanes * piece) as f64;
            run.pieces(memory.head_mut(lanes * part), part, share, |lane, memory| {
                fill_lane(of, sun, &settings, range(lane), memory)
            })?;
            for memory in memory.chunks(part.max(1)).take(lanes) {
                if !self.take(memory, of, sun, scratch.direct, &mut images) {
                    break;
                }
            }
            if self.rows == first {
                if lanes == 1 {
                    return Err(Error::BufferTooSmall { needed: size.saturating_mul(3), given: size }.into());
                }
                lanes = 1;
            }
        }
        Ok(())
    }
    /// Adds the beams of a block where its rows are the next ones; false where they are not, or none fitted.
    fn take(
        &mut self,
        memory: &[u8],
        of: &Lighting<'_>,
        sun: &Sun<'_>,
        direct: &mut [f64],
        images: &mut SunImagesMut<'_>,
    ) -> bool {
        let Ok(block) = Block::open(memory) else { return false };
        let done = block.range();
        if done.start != self.rows || done.is_empty() {
            return false;
        }
        let block = [block];
        let beams = Coupling::part(&block);
        let shape = settings::shape(of.settings.max_bounces, of.scene.bands());
        beam::add(&beams, (of.coupling, of.elements), sun, shape, direct, images);
        self.rays += beams.rows(done.clone()).map(|(_, r)| r.row.all_rays()).sum::<u64>();
        self.rows = done.end;
        true
    }
}

/// Fills a lane's memory with the beams of a range of sides, as far as they fit.
fn fill_lane(
    of: &Lighting<'_>,
    sun: &Sun<'_>,
    settings: &BeamSettings,
    range: Range<usize>,
    memory: &mut [u8],
) -> Result<(), Error> {
    // so that a block of no rows stands there where none fits
    memory.head_mut(2 * ALIGNMENT).fill(0);
    if range.is_empty() {
        return Ok(());
    }
    match beam::fill(of.scene, of.bvh, of.elements, sun, settings, range, memory) {
        Ok(_) | Err(Error::BufferTooSmall { .. }) => Ok(()),
        Err(error) => Err(error),
    }
}
