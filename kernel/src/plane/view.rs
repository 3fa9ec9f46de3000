//! What a point sees: the half circle above a surface, cut at every silhouette, each span with its first hit.

use crate::base::arena::plain_struct;
use crate::base::index::{Index, IndexMut};
use crate::base::math::sqrt;
use crate::base::sort::sort;
use crate::plane::scene::{NOWHERE, PlaneScene, Primitive};
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

/// Memory of one sweep.
pub(super) struct Part<'s> {
    pub events: &'s mut [Event],
    pub active: &'s mut [u32],
    pub spans: &'s mut [Span],
}

impl Part<'_> {
    /// Finds the spans of a point as [`crate::plane::scratch::sweep`] says; their number.
    pub fn sweep(&mut self, scene: &PlaneScene<'_>, x: Vec2, n: Vec2, skip: u32, cuts: &[Vec2]) -> usize {
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
