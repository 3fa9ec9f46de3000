//! Lobes that a path has met, each with those of its rays that are still to be followed: a path of any number of lobes
//! takes no stack.

use crate::arena::plain_struct;
use crate::math::{cos, sin};
use crate::plane::lobe::{PlaneLobe, Visible};
use crate::plane::scene::{NOWHERE, RaySet};
use crate::plane::trace::{Chains, Hit, Leg, Sink, graded_node, graded_sum, node, points};
use crate::plane::view::{Scratch, Span};
use crate::plane::{Vec2, toward, turned};

plain_struct! {
    /// A lobe under way.
    pub struct Fork {
        /// Where it is met.
        pub point: [f64; 2],
        /// Unit normal there.
        pub normal: [f64; 2],
        /// Its middle, the mirror direction.
        pub direction: [f64; 2],
        /// [`Leg::through`] and [`Leg::floor`] of what it reflects.
        pub through: f64,
        /// See `through`.
        pub floor: f64,
        /// The visible part, W.
        pub visible: [f64; 2],
        /// The part under way: all that is visible, or what one span takes of it.
        pub part: [f64; 2],
        /// Sum of the weights of the part's nodes; of the paper's three rays, the share of the middle one.
        pub sum: f64,
        /// The primitive.
        pub primitive: u32,
        /// Its material.
        pub material: u32,
        /// [`Leg::depth`] of its rays.
        pub depth: u32,
        /// [`Leg::lobes`] of its rays.
        pub lobes: u32,
        /// The next ray of the part, and how many it has.
        pub ray: u32,
        /// See `ray`.
        pub rays: u32,
        /// The next span, and how many there are: 0 where the lobe is not split.
        pub span: u32,
        /// See `span`.
        pub spans: u32,
        /// 1 where the part's span shows the sky.
        pub sky: u32,
        /// Keeps the size a multiple of eight.
        pub unused: u32,
    }
}

impl Fork {
    /// The lobe around `leg.direction` that is met at `hit`, `leg.lobes` counting it.
    pub(super) fn new(
        chains: &Chains<'_>,
        hit: &Hit,
        leg: &Leg,
        material: u32,
        scratch: &mut Scratch<'_>,
    ) -> Option<Fork> {
        let (lobe, rays) = chains.scene.lobe(material)?;
        let visible = lobe.visible(leg.direction, hit.normal);
        let mut fork = Fork {
            point: hit.point.to_array(),
            normal: hit.normal.to_array(),
            direction: leg.direction.to_array(),
            through: leg.through,
            floor: leg.floor,
            visible: [visible.low, visible.high],
            part: [visible.low, visible.high],
            primitive: hit.primitive,
            material,
            depth: leg.depth,
            lobes: leg.lobes,
            ..Fork::default()
        };
        match rays {
            RaySet::Paper { spacing, renormalised } => {
                fork.sum = fork.paper_share(lobe, spacing, renormalised);
                fork.rays = 3;
            }
            RaySet::Gauss(counts) => fork.rays = points(fork.count(counts)) as u32,
            RaySet::Equal(counts) => fork.rays = fork.count(counts) as u32,
            RaySet::Split(counts) => {
                match scratch.nested(chains.scene, hit.point, hit.normal, hit.primitive, chains.cuts) {
                    Some(spans) => fork.spans = spans as u32,
                    None => fork.rays = points(fork.count(counts)) as u32,
                }
            }
        }
        Some(fork)
    }

    /// Rays by the place of the lobe in its path.
    fn count(&self, counts: [u32; 3]) -> usize {
        let [first, second, later] = counts;
        (match self.lobes {
            0..=1 => first,
            2 => second,
            _ => later,
        }) as usize
    }

    /// A ray that carries the share `share` of the lobe's energy. At a path's first two lobes the chain's floor shrinks with
    /// the share: what the reflectances leave decides where it ends, not into how many rays a lobe is split. Beyond, small
    /// shares end, so that trees that branch at every lobe are finite.
    fn leg(&self, direction: Vec2, share: f64) -> Leg {
        let floor = if self.lobes <= 2 { self.floor * share } else { self.floor };
        Leg {
            origin: Vec2::from(self.point),
            direction,
            skip: self.primitive,
            through: self.through * share,
            floor,
            depth: self.depth,
            lobes: self.lobes,
        }
    }

    /// The next ray to follow; rays toward the sky go to the sink. `spans` are those of the lobe's own sweep.
    pub(super) fn next<S: Sink>(&mut self, chains: &Chains<'_>, spans: &[Span], sink: &mut S) -> Option<Leg> {
        let (lobe, rays) = chains.scene.lobe(self.material)?;
        loop {
            if self.ray >= self.rays && !self.next_span(chains, lobe, rays, spans) {
                return None;
            }
            let number = self.ray as usize;
            self.ray += 1;
            let ([low, high], direction) = (self.part, Vec2::from(self.direction));
            let at = |x: f64| lobe.direction(direction, low + (high - low) * x);
            match rays {
                RaySet::Paper { spacing, .. } => {
                    let (ray, weight) = self.paper_ray(lobe, spacing, number);
                    if ray.dot(Vec2::from(self.normal)) > 0.0 {
                        return Some(self.leg(ray, weight * self.sum));
                    }
                }
                RaySet::Equal(_) => {
                    let n = f64::from(self.rays);
                    return Some(self.leg(at((number as f64 + 0.5) / n), 0.5 * (high - low) / n));
                }
                RaySet::Split(counts) if self.spans > 0 => {
                    let n = if self.sky == 1 { chains.sky_nodes } else { self.count(counts) };
                    let (x, w) = graded_node(n, number, self.sum);
                    let ray = self.leg(at(x), 0.5 * (high - low) * w);
                    if self.sky == 0 {
                        return Some(ray);
                    }
                    sink.escape(&ray);
                }
                RaySet::Gauss(counts) | RaySet::Split(counts) => {
                    let (x, w) = node(self.count(counts), number);
                    return Some(self.leg(at(x), 0.5 * (high - low) * w));
                }
            }
        }
    }

    /// Goes on to the next span that takes a part of the lobe.
    fn next_span(&mut self, chains: &Chains<'_>, lobe: &PlaneLobe, rays: RaySet, spans: &[Span]) -> bool {
        let RaySet::Split(counts) = rays else { return false };
        let [low, high] = self.visible;
        let at = |s: f64| {
            let d = toward(Vec2::from(self.normal), s);
            lobe.place(Vec2::from(self.direction), d, &Visible { low, high })
        };
        while let Some(span) = spans.get(self.span as usize).filter(|_| self.span < self.spans) {
            self.span += 1;
            let (low, high) = (at(span.from), at(span.to));
            if high > low {
                self.sky = u32::from(span.primitive == NOWHERE);
                let n = if self.sky == 1 { chains.sky_nodes } else { self.count(counts) };
                (self.part, self.ray, self.rays) = ([low, high], 0, points(n) as u32);
                self.sum = graded_sum(n);
                return true;
            }
        }
        false
    }

    /// One of the three rays of eq. (18), and its weight.
    fn paper_ray(&self, lobe: &PlaneLobe, spacing: f64, number: usize) -> (Vec2, f64) {
        let (s, c) = (sin(0.5 * spacing), cos(0.5 * spacing));
        let ratio = lobe.value(s, c) / lobe.value(0.0, 1.0);
        let direction = Vec2::from(self.direction);
        let (side, ahead) = (turned(direction) * s, direction * c);
        match number {
            0 => (direction, 1.0),
            1 => (ahead + side, ratio),
            _ => (ahead - side, ratio),
        }
    }

    /// What of the lobe's energy goes by the weight of 1.
    fn paper_share(&self, lobe: &PlaneLobe, spacing: f64, renormalised: bool) -> f64 {
        let rays = [0, 1, 2].map(|number| self.paper_ray(lobe, spacing, number));
        let normal = Vec2::from(self.normal);
        if !renormalised {
            return 1.0 / (1.0 + 2.0 * rays[1].1);
        }
        let above: f64 = rays.iter().filter(|ray| ray.0.dot(normal) > 0.0).map(|ray| ray.1).sum();
        if above > 0.0 { lobe.albedo(Vec2::from(self.direction).dot(normal)) / above } else { 0.0 }
    }
}
