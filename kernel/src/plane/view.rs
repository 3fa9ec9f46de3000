//! What a point sees: the half circle above a surface, cut at every silhouette, each span with its first hit.

use crate::base::arena::{Arena, Need, plain_struct};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::sqrt;
use crate::base::sort::sort;
use crate::plane::fork::Fork;
use crate::plane::scene::{NOWHERE, PlaneScene, Primitive};
use crate::plane::trace::MOST_LOBES;
use crate::plane::{Vec2, cross, length, toward};

plain_struct! {
    /// A part of the half circle: directions whose sines to the normal are from `from` to `to`.
    pub struct Span {
        /// Lower sine.
        pub from: f64,
        /// Upper sine.
        pub to: f64,
        /// First hit, or [`NOWHERE`] for the sky.
        pub primitive: u32,
        /// Keeps the size a multiple of eight.
        pub unused: u32,
    }
}

plain_struct! {
    /// A silhouette.
    pub struct Event {
        /// Sine of its direction.
        pub at: f64,
        /// What begins or ends, or [`NOWHERE`] for a mere cut.
        pub primitive: u32,
        /// 1 where it begins.
        pub begins: u32,
    }
}

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

    /// An error where it has no room for sweeps of this scene with so many cuts.
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

/// Memory of one sweep.
struct Part<'s> {
    events: &'s mut [Event],
    active: &'s mut [u32],
    spans: &'s mut [Span],
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

impl Part<'_> {
    /// See [`sweep`]; the number of spans.
    fn sweep(&mut self, scene: &PlaneScene<'_>, x: Vec2, n: Vec2, skip: u32, cuts: &[Vec2]) -> usize {
        let mut count = 0;
        for body in scene.bodies() {
            for index in body.first..body.first + body.count {
                let Some(p) = scene.primitives().get(index as usize).filter(|_| index != skip) else {
                    continue;
                };
                if let Some((from, to)) = extent(p, x, n, body.closed == 1)
                    && to > from
                {
                    self.events.set(count, Event { at: from, primitive: index, begins: 1 });
                    self.events.set(count + 1, Event { at: to, primitive: index, begins: 0 });
                    count += 2;
                }
            }
        }
        for cut in cuts.iter().filter(|cut| cut.dot(n) > 0.0) {
            self.events.set(count, Event { at: cross(n, *cut), primitive: NOWHERE, begins: 0 });
            count += 1;
        }
        let events = self.events.head_mut(count);
        sort(events, &|a, b| a.at.total_cmp(&b.at).then(a.primitive.cmp(&b.primitive)));
        if count > 0 {
            return walk(scene, x, n, events, self.active, self.spans);
        }
        self.spans.set(0, Span { from: -1.0, to: 1.0, primitive: NOWHERE, unused: 0 });
        1
    }
}

/// Walks from silhouette to silhouette and keeps what begins and ends.
fn walk(
    scene: &PlaneScene<'_>,
    x: Vec2,
    n: Vec2,
    events: &[Event],
    active: &mut [u32],
    spans: &mut [Span],
) -> usize {
    let (mut live, mut count, mut from) = (0, 0, -1.0);
    let end = Event { at: 1.0, primitive: NOWHERE, begins: 0 };
    for event in events.iter().chain(core::iter::once(&end)) {
        let to = event.at.clamp(-1.0, 1.0);
        if to - from > 1e-15 {
            let primitive = nearest(scene, x, toward(n, 0.5 * (from + to)), active.head(live));
            spans.set(count, Span { from, to, primitive, unused: 0 });
            count += 1;
            from = to;
        }
        if event.primitive == NOWHERE {
            continue;
        }
        if event.begins == 1 {
            active.set(live, event.primitive);
            live += 1;
        } else if let Some(at) = active.head(live).iter().position(|&p| p == event.primitive) {
            live -= 1;
            active.set(at, active.at(live));
        }
    }
    count
}

/// The first hit among the primitives that a direction between silhouettes meets.
fn nearest(scene: &PlaneScene<'_>, x: Vec2, d: Vec2, active: &[u32]) -> u32 {
    if let [only] = active {
        return *only;
    }
    let (mut best, mut least) = (NOWHERE, f64::INFINITY);
    for &index in active {
        if let Some(p) = scene.primitives().get(index as usize) {
            let t = distance(p, x, d);
            if t < least || (t == least && index < best) {
                (best, least) = (index, t);
            }
        }
    }
    best
}

/// Distance along the ray to a primitive that the ray meets, but for rounding.
pub(crate) fn distance(p: &Primitive, x: Vec2, d: Vec2) -> f64 {
    let a = Vec2::from(p.a) - x;
    if p.kind == 0 {
        let along = a.dot(d);
        let off = a - d * along;
        return along - sqrt((p.b[0] * p.b[0] - off.dot(off)).max(0.0));
    }
    let b = Vec2::from(p.b) - x;
    let (ca, cb) = (cross(d, a), cross(d, b));
    let span = ca - cb;
    let t = if span == 0.0 { 0.5 } else { (ca / span).clamp(0.0, 1.0) };
    (a + (b - a) * t).dot(d)
}

/// Sines between which a primitive lies above the horizon of `x`, if any of it does and its front may be seen.
fn extent(p: &Primitive, x: Vec2, n: Vec2, closed: bool) -> Option<(f64, f64)> {
    let a = Vec2::from(p.a) - x;
    if p.kind == 0 {
        let (away, radius) = (length(a), p.b[0]);
        if a.dot(n) <= -radius {
            return None;
        }
        let sine = (radius / away).min(1.0);
        let cosine = sqrt((1.0 - sine) * (1.0 + sine));
        let axis = a / away;
        let side = Vec2::new(-axis.y, axis.x) * sine;
        let (left, right) = (axis * cosine + side, axis * cosine - side);
        let (up, down) = (left.dot(n) > 0.0, right.dot(n) > 0.0);
        if !up && !down {
            return None;
        }
        let from = if down { cross(n, right) } else { -1.0 };
        let to = if up { cross(n, left) } else { 1.0 };
        return Some((from.clamp(-1.0, 1.0), to.clamp(-1.0, 1.0)));
    }
    let b = Vec2::from(p.b) - x;
    let facing = -a.dot(Vec2::from(p.normal));
    if closed && facing <= 0.0 {
        return None;
    }
    let (ya, yb) = (a.dot(n), b.dot(n));
    if ya <= 0.0 && yb <= 0.0 {
        return None;
    }
    let (xa, xb) = (cross(n, a), cross(n, b));
    // where the segment dips below the horizon: the side on which it does
    let side = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    let horizon = || side((xa * yb - xb * ya) * (yb - ya));
    let from_a = if ya > 0.0 { xa / length(a) } else { horizon() };
    let from_b = if yb > 0.0 { xb / length(b) } else { horizon() };
    Some((from_a.min(from_b), from_a.max(from_b)))
}
