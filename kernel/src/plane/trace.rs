//! First hits, and chains by way of mirrors and lobes.

use crate::base::index::Index;
use crate::base::math::{fabs, sqrt};
use crate::base::quadrature::rule;
use crate::plane::fork::Fork;
use crate::plane::lobe::PlaneLobe;
use crate::plane::scene::{NOWHERE, PlaneScene, Primitive};
use crate::plane::view::Scratch;
use crate::plane::{Vec2, cross, length, reflect};

/// A first hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// What is met.
    pub primitive: u32,
    /// Where.
    pub point: Vec2,
    /// Unit normal of the front.
    pub normal: Vec2,
    /// Whether the front is met.
    pub front: bool,
}

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

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub origin: Vec2,
    pub direction: Vec2,
    /// The primitive that it leaves.
    pub skip: u32,
    /// Product of the reflectances so far, times the ray's weight.
    pub through: f64,
    /// The chain ends where less is left.
    pub floor: f64,
    /// Surfaces met.
    pub depth: u32,
    /// Lobes among them.
    pub lobes: u32,
}

/// What takes up a chain's light.
pub(crate) trait Sink {
    /// The front of a primitive is met after `leg.depth` mirrors.
    fn meet(&mut self, hit: &Hit, leg: &Leg);
    /// The chain leaves the object.
    fn escape(&mut self, leg: &Leg);
    /// A black back is met.
    fn back(&mut self) {}
    /// A lobe is met, around the direction `mirrored`; `through` includes its reflectance.
    fn glossy(&mut self, _hit: &Hit, _mirrored: Vec2, _lobe: &PlaneLobe, _leg: &Leg) {}
    /// A chain is cut that could still bring so much of the brightest light.
    fn lost(&mut self, _through: f64) {}
}

/// How far chains go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chains<'a> {
    pub scene: &'a PlaneScene<'a>,
    /// Most surfaces that reflect along a chain.
    pub most: u32,
    /// Nodes of lobe parts that escape: 1 where all escapes bring the same.
    pub sky_nodes: usize,
    /// Directions at which the sky jumps.
    pub cuts: &'a [Vec2],
}

/// No chain is longer, whatever its reflectances.
const LONGEST: u32 = 100_000;
/// No path has more lobes.
pub(super) const MOST_LOBES: u32 = 64;

impl Chains<'_> {
    /// Follows a ray and all that its reflections make of it.
    pub fn follow<S: Sink>(&self, leg: Leg, sink: &mut S, scratch: &mut Scratch<'_>) {
        self.go_on(Some(leg), 0, sink, scratch);
    }

    /// Follows all that the reflection of a ray at a hit makes of it.
    pub fn reflect<S: Sink>(&self, hit: &Hit, leg: Leg, sink: &mut S, scratch: &mut Scratch<'_>) {
        let mut forks = 0;
        let next = self.reflected(hit, leg, &mut forks, sink, scratch);
        self.go_on(next, forks, sink, scratch);
    }

    /// Follows a ray, and those that the lobes under way have left.
    #[inline(never)]
    fn go_on<S: Sink>(
        &self,
        mut next: Option<Leg>,
        mut forks: usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) {
        loop {
            while let Some(leg) = next {
                next = self.step(leg, &mut forks, sink, scratch);
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
        leg: Leg,
        forks: &mut usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) -> Option<Leg> {
        let Some(hit) = self.scene.first(leg.origin, leg.direction, leg.skip) else {
            sink.escape(&leg);
            return None;
        };
        if !hit.front {
            sink.back();
            return None;
        }
        sink.meet(&hit, &leg);
        self.reflected(&hit, leg, forks, sink, scratch)
    }

    /// The next ray of the lobes under way, those met last first.
    fn resume<S: Sink>(&self, forks: &mut usize, sink: &mut S, scratch: &mut Scratch<'_>) -> Option<Leg> {
        while let Some(last) = forks.checked_sub(1) {
            let (fork, spans) = scratch.under_way(last)?;
            if let Some(leg) = fork.next(self, spans, sink) {
                return Some(leg);
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
        leg: Leg,
        forks: &mut usize,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) -> Option<Leg> {
        let material = self.scene.primitives().get(hit.primitive as usize)?.material;
        let through = leg.through * self.scene.specular(material);
        if through == 0.0 || leg.depth >= self.most {
            return None;
        }
        if through < leg.floor || leg.depth >= LONGEST || leg.lobes >= MOST_LOBES {
            sink.lost(through);
            return None;
        }
        let direction = self.scene.mirrored(hit, leg.direction);
        let (origin, skip, depth) = (hit.point, hit.primitive, leg.depth + 1);
        let next = Leg { origin, direction, skip, through, depth, ..leg };
        match self.scene.lobe(material) {
            None => Some(next),
            Some((lobe, _)) => {
                sink.glossy(hit, direction, lobe, &next);
                let next = Leg { lobes: leg.lobes + 1, ..next };
                let fork = Fork::new(self, hit, &next, material, scratch)?;
                scratch.enter(forks, fork);
                None
            }
        }
    }
}

/// Nodes of the Gauss rule of exactly `n` points for n <= 3 and any `n` of [`rule`], else of panels of the 4-point rule or
/// the next larger number of points.
#[inline]
pub(crate) fn points(n: usize) -> usize {
    match n {
        0..=1 => 1,
        2..=3 => n,
        4..=32 => rule(n).0.len(),
        _ => 32 * n.div_ceil(32),
    }
}

/// One of the nodes of that rule on (0, 1), and its weight.
#[inline]
pub(crate) fn node(n: usize, number: usize) -> (f64, f64) {
    /// Half the distances of the 2- and 3-point rules' outer nodes.
    const OFF: [f64; 2] = [0.288_675_134_594_812_9, 0.387_298_334_620_741_7];
    match (n, number) {
        (0..=1, _) => (0.5, 1.0),
        (2, 0) => (0.5 - OFF[0], 0.5),
        (2, _) => (0.5 + OFF[0], 0.5),
        (3, 0) => (0.5 - OFF[1], 5.0 / 18.0),
        (3, 1) => (0.5, 4.0 / 9.0),
        (3, _) => (0.5 + OFF[1], 5.0 / 18.0),
        (4..=32, _) => {
            let (at, weights) = rule(n);
            (at.at(number), weights.at(number))
        }
        _ => {
            let panels = n.div_ceil(32) as f64;
            let (at, weights) = rule(32);
            (((number / 32) as f64 + at.at(number % 32)) / panels, weights.at(number % 32) / panels)
        }
    }
}

/// Calls `f` with all nodes and weights of that rule.
pub(crate) fn nodes(n: usize, mut f: impl FnMut(f64, f64)) {
    for number in 0..points(n) {
        let (x, w) = node(n, number);
        f(x, w);
    }
}

/// A node on (0, 1) of a rule whose nodes crowd at both ends, where what is integrated has square roots: silhouettes. One
/// node is the middle. `sum` is that of [`graded_sum`].
#[inline]
pub(crate) fn graded_node(n: usize, number: usize, sum: f64) -> (f64, f64) {
    let (x, w) = node(n, number);
    if n < 3 { (x, w) } else { (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * w / sum) }
}

/// What makes the weights of that rule's nodes sum to 1.
pub(crate) fn graded_sum(n: usize) -> f64 {
    let mut sum = 0.0;
    nodes(n, |x, w| sum += 6.0 * x * (1.0 - x) * w);
    sum
}

/// Calls `f` with all nodes and weights of that rule.
pub(crate) fn graded(n: usize, mut f: impl FnMut(f64, f64)) {
    let sum = graded_sum(n);
    for number in 0..points(n) {
        let (x, w) = graded_node(n, number, sum);
        f(x, w);
    }
}
