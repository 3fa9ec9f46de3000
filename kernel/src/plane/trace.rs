//! First hits, and chains by way of mirrors and lobes.
//!
//! Constants of this file are measured by `cargo bench --bench plane` (errors and seconds).

use crate::base::math::{fabs, sqrt};
use crate::plane::fork::Fork;
pub use crate::plane::path::Hit;
use crate::plane::path::{Chains, MOST_LOBES, PathState, Sink};
use crate::plane::scene::{NOWHERE, PlaneScene, Primitive};
use crate::plane::scratch::Scratch;
use crate::plane::{Vec2, cross, length, reflect};

/// Distance to a primitive, if the ray meets it.
#[inline(always)]
fn meet(p: &Primitive, origin: Vec2, direction: Vec2) -> Option<f64> {
    let a = Vec2::from(p.a) - origin;
    if p.kind == 0 {
        let along = a.dot(direction);
        let off = a - direction * along;
        let square = p.b[0] * p.b[0] - off.dot(off);
        let t = along - if square > 0.0 { sqrt(square) } else { return None };
        return (t > 0.0).then_some(t);
    }
    // segments that share an end agree on its side of the ray: nothing passes between them
    let b = Vec2::from(p.b) - origin;
    let (ca, cb) = (cross(direction, a), cross(direction, b));
    if (ca >= 0.0) == (cb >= 0.0) {
        return None;
    }
    let t = (a + (b - a) * (ca / (ca - cb))).dot(direction);
    (t > 0.0).then_some(t)
}

impl PlaneScene<'_> {
    /// The first hit of a ray that leaves primitive `skip`: the least distance, ties to the lowest index.
    #[inline]
    pub fn first(&self, origin: Vec2, direction: Vec2, skip: u32) -> Option<Hit> {
        let (mut best, mut least) = (NOWHERE, f64::INFINITY);
        for body in self.bodies() {
            if body.count > 4 {
                let away = Vec2::from(body.centre) - origin;
                if fabs(cross(direction, away)) > body.radius || away.dot(direction) < -body.radius {
                    continue;
                }
            }
            for index in body.first..body.first + body.count {
                if index == skip {
                    continue;
                }
                let Some(p) = self.primitives().get(index as usize) else { continue };
                if let Some(t) = meet(p, origin, direction)
                    && t < least
                {
                    (best, least) = (index, t);
                }
            }
        }
        let p = self.primitives().get(best as usize)?;
        let point = origin + direction * least;
        if p.kind == 0 {
            let centre = Vec2::from(p.a);
            let radial = point - centre;
            let normal = radial / length(radial);
            return Some(Hit { primitive: best, point: centre + normal * p.b[0], normal, front: true });
        }
        let normal = Vec2::from(p.normal);
        Some(Hit { primitive: best, point, normal, front: normal.dot(direction) < 0.0 })
    }

    /// Mirror direction at a hit, by interpolated normals where the surface is smooth, never below it.
    #[inline(always)]
    pub(crate) fn mirrored(&self, hit: &Hit, direction: Vec2) -> Vec2 {
        let Some(p) = self.primitives().get(hit.primitive as usize).filter(|p| p.smooth == 1) else {
            return reflect(direction, hit.normal);
        };
        let along = Vec2::from(p.b) - Vec2::from(p.a);
        let t = ((hit.point - Vec2::from(p.a)).dot(along) / along.dot(along)).clamp(0.0, 1.0);
        let blend = Vec2::from(p.start_normal) * (1.0 - t) + Vec2::from(p.end_normal) * t;
        let mirrored = reflect(direction, blend / length(blend));
        let below = mirrored.dot(hit.normal);
        if below > 0.0 {
            return mirrored;
        }
        let flat = mirrored - hit.normal * (below - 1e-9);
        flat / length(flat)
    }
}

/// No chain is longer, whatever its reflectances.
const PLANE_CHAIN_MOST: u32 = 100_000;
impl Chains<'_> {
    /// Follows a ray and all that its reflections make of it.
    pub fn follow<S: Sink>(&self, state: PathState, sink: &mut S, scratch: &mut Scratch<'_>) {
        self.go_on(Some(state), 0, sink, scratch);
    }

    /// Follows all that the reflection of a ray at a hit makes of it.
    pub fn reflect<S: Sink>(&self, hit: &Hit, state: PathState, sink: &mut S, scratch: &mut Scratch<'_>) {
        let mut forks = 0;
        let next = self.reflected(hit, state, &mut forks, sink, scratch);
        self.go_on(next, forks, sink, scratch);
    }

    /// Follows a ray, and those that the lobes under way have left.
    #[inline(never)]
    fn go_on<S: Sink>(
        &self,
        mut next: Option<PathState>,
        mut forks: usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) {
        loop {
            while let Some(state) = next {
                next = self.step(state, &mut forks, sink, scratch);
            }
            next = self.resume(&mut forks, sink, scratch);
            if next.is_none() {
                return;
            }
        }
    }

    /// Follows a ray to the next hit: the mirrored ray, or `None` where the chain ends or a lobe has taken over.
    #[inline(always)]
    fn step<S: Sink>(
        &self,
        state: PathState,
        forks: &mut usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) -> Option<PathState> {
        let Some(hit) = self.scene.first(state.origin, state.direction, state.skip) else {
            sink.escape(&state);
            return None;
        };
        if !hit.front {
            sink.back();
            return None;
        }
        sink.meet(&hit, &state);
        self.reflected(&hit, state, forks, sink, scratch)
    }

    /// The next ray of the lobes under way, those met last first.
    fn resume<S: Sink>(
        &self,
        forks: &mut usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) -> Option<PathState> {
        while let Some(last) = forks.checked_sub(1) {
            let (fork, spans) = scratch.under_way(last)?;
            if let Some(state) = fork.next(self, spans, sink) {
                return Some(state);
            }
            scratch.leave(last);
            *forks = last;
        }
        None
    }

    /// Goes on from a hit: the mirrored ray, or `None` where the chain ends or a lobe has taken over.
    fn reflected<S: Sink>(
        &self,
        hit: &Hit,
        state: PathState,
        forks: &mut usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) -> Option<PathState> {
        let material = self.scene.primitives().get(hit.primitive as usize)?.material;
        let throughput = state.throughput * self.scene.specular(material);
        if throughput == 0.0 || state.depth >= self.most {
            return None;
        }
        if throughput < state.floor || state.depth >= PLANE_CHAIN_MOST || state.lobes >= MOST_LOBES {
            sink.lost(throughput);
            return None;
        }
        let direction = self.scene.mirrored(hit, state.direction);
        let (origin, skip, depth) = (hit.point, hit.primitive, state.depth + 1);
        let next = PathState { origin, direction, skip, throughput, depth, ..state };
        match self.scene.lobe(material) {
            None => Some(next),
            Some((lobe, _)) => {
                sink.glossy(hit, direction, lobe, &next);
                let next = PathState { lobes: state.lobes + 1, ..next };
                let sweep = || scratch.nested(self.scene, hit.point, hit.normal, hit.primitive, self.cuts);
                let fork = Fork::new(self.scene, hit, &next, material, sweep)?;
                scratch.enter(forks, fork);
                None
            }
        }
    }
}
