//! Working memory of sweeps, and of the lobes that a path has met.

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::plane::Vec2;
use crate::plane::fork::Fork;
use crate::plane::path::MOST_LOBES;
use crate::plane::scene::PlaneScene;
use crate::plane::view::{Event, Part, Span};

/// Sweeps that can be under way at once: of a row, and of the lobes of a path.
pub const LEVELS: usize = 4;

/// Working memory of sweeps.
#[derive(Debug)]
pub struct Scratch<'m> {
    events: &'m mut [Event],
    active: &'m mut [u32],
    spans: &'m mut [Span],
    /// Entries of one sweep in `events`, `active` and `spans`.
    room: [usize; 3],
    /// Sweeps of lobes under way.
    level: usize,
    /// Lobes that a path has met.
    forks: &'m mut [Fork],
}

impl<'m> Scratch<'m> {
    fn room(scene: &PlaneScene<'_>, cuts: usize) -> [usize; 3] {
        let primitives = scene.primitives().len();
        let events = 2 * primitives + cuts;
        [events, primitives, events + 1]
    }

    /// Bytes for sweeps of a scene with at most `cuts` further cuts.
    pub fn bytes(scene: &PlaneScene<'_>, cuts: usize) -> Result<usize, Error> {
        let [events, active, spans] = Scratch::room(scene, cuts).map(|n| n.saturating_mul(LEVELS));
        let need = Need::new().and::<Event>(events).and::<u32>(active).and::<Span>(spans);
        need.and::<Fork>(Scratch::lobes(scene)).bytes()
    }

    /// Lobes of a path.
    fn lobes(scene: &PlaneScene<'_>) -> usize {
        if scene.is_glossy() { MOST_LOBES as usize } else { 0 }
    }

    /// Working memory in the caller's.
    pub fn new(scene: &PlaneScene<'_>, cuts: usize, memory: &'m mut [u8]) -> Result<Scratch<'m>, Error> {
        let mut arena = Arena::new(memory, Scratch::bytes(scene, cuts)?)?;
        let room = Scratch::room(scene, cuts);
        Ok(Scratch {
            events: arena.take(room[0] * LEVELS)?,
            active: arena.take(room[1] * LEVELS)?,
            spans: arena.take(room[2] * LEVELS)?,
            room,
            level: 0,
            forks: arena.take(Scratch::lobes(scene))?,
        })
    }

    /// An error where it has no room for sweeps of this scene with `cuts` cuts.
    pub(crate) fn check(&self, scene: &PlaneScene<'_>, cuts: usize) -> Result<(), Error> {
        if self.fits(scene, cuts) { Ok(()) } else { Err(Error::Mismatch { what: "plane scratch" }) }
    }

    fn fits(&self, scene: &PlaneScene<'_>, cuts: usize) -> bool {
        Scratch::room(scene, cuts).iter().zip(self.room).all(|(needed, room)| *needed <= room)
            && Scratch::lobes(scene) <= self.forks.len()
    }

    /// One sweep's part, and the rest for the sweeps within; `None` where there is none.
    fn split(&mut self) -> Option<(Part<'_>, Scratch<'_>)> {
        let room = self.room;
        let (events, more_events) = self.events.split_at_mut_checked(room[0])?;
        let (active, more_active) = self.active.split_at_mut_checked(room[1])?;
        let (spans, more_spans) = self.spans.split_at_mut_checked(room[2])?;
        let forks = &mut *self.forks;
        let rest =
            Scratch { events: more_events, active: more_active, spans: more_spans, room, level: 0, forks };
        Some((Part { events, active, spans }, rest))
    }

    /// Sweeps from where a lobe is met, which is then under way; the number of spans, or `None` where no memory is left or
    /// it is another scene's.
    pub(super) fn nested(
        &mut self,
        scene: &PlaneScene<'_>,
        x: Vec2,
        n: Vec2,
        skip: u32,
        cuts: &[Vec2],
    ) -> Option<usize> {
        if !self.fits(scene, cuts.len()) {
            return None;
        }
        let [events, active, spans] = self.room.map(|room| self.level * room..(self.level + 1) * room);
        let mut mine = Part {
            events: self.events.get_mut(events)?,
            active: self.active.get_mut(active)?,
            spans: self.spans.get_mut(spans)?,
        };
        self.level += 1;
        Some(mine.sweep(scene, x, n, skip, cuts))
    }

    /// Keeps a lobe under way.
    pub(super) fn enter(&mut self, forks: &mut usize, fork: Fork) {
        self.forks.set(*forks, fork);
        *forks += 1;
    }

    /// The lobe under way that was met last, and the spans of its sweep.
    pub(super) fn under_way(&mut self, last: usize) -> Option<(&mut Fork, &[Span])> {
        let fork = self.forks.get_mut(last)?;
        let own = self.level.saturating_sub(1) * self.room[2];
        Some((fork, self.spans.part(own..self.level * self.room[2])))
    }

    /// That lobe is done.
    pub(super) fn leave(&mut self, last: usize) {
        let split = self.forks.get(last).is_some_and(|fork| fork.spans > 0);
        self.level = self.level.saturating_sub(usize::from(split));
    }
}

/// The spans that the point `x` on primitive `skip` sees above its normal `n`, in the order of rising sines,
/// with memory for the sweeps that chains start. `cuts` are directions where spans end besides. `None` where
/// no memory is left or it is another scene's.
pub fn sweep<'s>(
    scene: &PlaneScene<'_>,
    x: Vec2,
    n: Vec2,
    skip: u32,
    cuts: &[Vec2],
    scratch: &'s mut Scratch<'_>,
) -> Option<(&'s [Span], Scratch<'s>)> {
    if !scratch.fits(scene, cuts.len()) {
        return None;
    }
    let (mut mine, rest) = scratch.split()?;
    let count = mine.sweep(scene, x, n, skip, cuts);
    Some((mine.spans.head(count), rest))
}
