//! First hits, and chains by way of mirrors and lobes.

use crate::math::{cos, fabs, sin, sqrt};
use crate::plane::lobe::PlaneLobe;
use crate::plane::scene::{NOWHERE, PlaneScene, Primitive, RaySet};
use crate::plane::view::{Scratch, sweep};
use crate::plane::{Vec2, cross, length, reflect, toward, turned};
use crate::quadrature::rule;

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
/// No path has more lobes: each is a level of recursion.
const MOST_LOBES: u32 = 64;

impl Chains<'_> {
    /// Follows a ray and all that its reflections make of it.
    pub fn follow<S: Sink>(&self, mut leg: Leg, sink: &mut S, scratch: &mut Scratch<'_>) {
        loop {
            let Some(hit) = self.scene.first(leg.origin, leg.direction, leg.skip) else {
                return sink.escape(&leg);
            };
            if !hit.front {
                return sink.back();
            }
            sink.meet(&hit, &leg);
            match self.reflected(&hit, leg, sink, scratch) {
                Some(next) => leg = next,
                None => return,
            }
        }
    }

    /// Goes on from a hit: the mirrored ray, or `None` where the chain ends or a lobe has taken over.
    pub fn reflected<S: Sink>(
        &self,
        hit: &Hit,
        leg: Leg,
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
            Some((lobe, rays)) => {
                sink.glossy(hit, direction, lobe, &next);
                let next = Leg { lobes: leg.lobes + 1, ..next };
                self.branch(hit, next, lobe, rays, sink, scratch);
                None
            }
        }
    }

    /// The leg's share of a lobe's energy along `direction`. At a path's first two lobes the chain's floor shrinks
    /// with the share: what the reflectances leave decides where it ends, not into how many rays a lobe is split.
    /// Beyond, small shares end, so that trees that branch at every lobe are finite.
    fn part(leg: &Leg, direction: Vec2, share: f64) -> Leg {
        let floor = if leg.lobes <= 2 { leg.floor * share } else { leg.floor };
        Leg { direction, through: leg.through * share, floor, ..*leg }
    }

    /// The rays that stand for a lobe around `leg.direction`.
    fn branch<S: Sink>(
        &self,
        hit: &Hit,
        leg: Leg,
        lobe: &PlaneLobe,
        rays: RaySet,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) {
        let count = |counts: [u32; 3]| counts[(leg.lobes as usize - 1).min(2)] as usize;
        let visible = lobe.visible(leg.direction, hit.normal);
        match rays {
            RaySet::Paper { spacing, renormalised } => {
                self.paper(hit, leg, lobe, (spacing, renormalised), sink, scratch);
            }
            RaySet::Gauss(counts) => {
                let width = visible.high - visible.low;
                nodes(count(counts), |x, w| {
                    let direction = lobe.direction(leg.direction, visible.low + width * x);
                    self.follow(Self::part(&leg, direction, 0.5 * width * w), sink, scratch);
                });
            }
            RaySet::Equal(counts) => {
                let (n, width) = (count(counts), visible.high - visible.low);
                for i in 0..n {
                    let x = (i as f64 + 0.5) / n as f64;
                    let direction = lobe.direction(leg.direction, visible.low + width * x);
                    self.follow(Self::part(&leg, direction, 0.5 * width / n as f64), sink, scratch);
                }
            }
            RaySet::Split(counts) => {
                let n = count(counts);
                let Some((spans, mut rest)) =
                    sweep(self.scene, hit.point, hit.normal, hit.primitive, self.cuts, scratch)
                else {
                    let whole = RaySet::Gauss([n as u32; 3]);
                    return self.branch(hit, leg, lobe, whole, sink, scratch);
                };
                for span in spans {
                    let at = |s: f64| lobe.place(leg.direction, toward(hit.normal, s), &visible);
                    let (low, high) = (at(span.from), at(span.to));
                    let sky = span.primitive == NOWHERE;
                    if high <= low {
                        continue;
                    }
                    graded(if sky { self.sky_nodes } else { n }, |x, w| {
                        let direction = lobe.direction(leg.direction, low + (high - low) * x);
                        let ray = Self::part(&leg, direction, 0.5 * (high - low) * w);
                        if sky { sink.escape(&ray) } else { self.follow(ray, sink, &mut rest) }
                    });
                }
            }
        }
    }

    /// Three rays as eq. (18) has them.
    fn paper<S: Sink>(
        &self,
        hit: &Hit,
        leg: Leg,
        lobe: &PlaneLobe,
        (spacing, renormalised): (f64, bool),
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) {
        let (s, c) = (sin(0.5 * spacing), cos(0.5 * spacing));
        let ratio = lobe.value(s, c) / lobe.value(0.0, 1.0);
        let side = turned(leg.direction) * s;
        let ahead = leg.direction * c;
        let rays = [(leg.direction, 1.0), (ahead + side, ratio), (ahead - side, ratio)];
        let rises = |d: Vec2| d.dot(hit.normal) > 0.0;
        let share = if renormalised {
            let above: f64 = rays.iter().filter(|r| rises(r.0)).map(|r| r.1).sum();
            if above > 0.0 { lobe.albedo(leg.direction.dot(hit.normal)) / above } else { 0.0 }
        } else {
            1.0 / (1.0 + 2.0 * ratio)
        };
        for (direction, weight) in rays {
            if rises(direction) {
                self.follow(Self::part(&leg, direction, weight * share), sink, scratch);
            }
        }
    }
}

/// Calls `f` with the nodes and weights on (0, 1) of a Gauss rule of exactly `n` points for n <= 3 and any `n` of
/// [`rule`], else of panels of the 4-point rule or the next larger number of points.
pub(crate) fn nodes(n: usize, mut f: impl FnMut(f64, f64)) {
    /// Half the distances of the 2- and 3-point rules' outer nodes.
    const OFF: [f64; 2] = [0.288_675_134_594_812_9, 0.387_298_334_620_741_7];
    match n {
        0..=1 => f(0.5, 1.0),
        2 => {
            f(0.5 - OFF[0], 0.5);
            f(0.5 + OFF[0], 0.5);
        }
        3 => {
            f(0.5 - OFF[1], 5.0 / 18.0);
            f(0.5, 4.0 / 9.0);
            f(0.5 + OFF[1], 5.0 / 18.0);
        }
        4..=32 => {
            let (at, weights) = rule(n);
            at.iter().zip(weights).for_each(|(&x, &w)| f(x, w));
        }
        _ => {
            let panels = n.div_ceil(32);
            let (at, weights) = rule(32);
            for panel in 0..panels {
                for (x, w) in at.iter().zip(weights) {
                    f((panel as f64 + x) / panels as f64, w / panels as f64);
                }
            }
        }
    }
}

/// Calls `f` with the nodes and weights on (0, 1) of a rule whose nodes crowd at both ends, where what is
/// integrated has square roots: silhouettes. One node is the middle.
pub(crate) fn graded(n: usize, mut f: impl FnMut(f64, f64)) {
    if n < 3 {
        return nodes(n, f);
    }
    let mut sum = 0.0;
    nodes(n, |x, w| sum += 6.0 * x * (1.0 - x) * w);
    nodes(n, |x, w| f(x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * w / sum));
}
