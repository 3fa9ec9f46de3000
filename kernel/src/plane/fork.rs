//! Lobes that a path has met, each with those of its rays that are still to be followed: a path of any number of lobes
//! takes no stack.

use crate::base::arena::plain_struct;
use crate::base::index::Index;
use crate::base::math::{cos, sin};
use crate::plane::lobe::{PlaneLobe, Visible};
use crate::plane::nodes::{graded_node, graded_sum, node, points};
use crate::plane::path::{Chains, Hit, PathState, Sink};
use crate::plane::scene::{NOWHERE, PlaneScene, RaySet};
use crate::plane::view::Span;
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
        /// [`PathState::throughput`] and [`PathState::floor`] of what it reflects.
        pub throughput: f64,
        /// See `through`.
        pub floor: f64,
        /// The visible part, W.
        pub visible: [f64; 2],
        /// The part under way: all that is visible, or what one span takes of it.
        pub part: [f64; 2],
        /// Sum of the weights of the part's nodes; of the paper's three rays, the share of the middle one, and `part` holds
        /// the angle between the others.
        pub sum: f64,
        /// The primitive.
        pub primitive: u32,
        /// Its material.
        pub material: u32,
        /// [`PathState::depth`] of its rays.
        pub depth: u32,
        /// [`PathState::lobes`] of its rays.
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
        /// What the part's rays are: [`FORK_MIDPOINTS`], [`NODES`], [`GRADED`] or [`PAPER`].
        pub kind: u32,
        /// Points asked of the part's rule.
        pub wanted: u32,
        /// Keeps the size a multiple of eight.
        pub unused: u32,
    }
}

/// Midpoints of equal shares.
const FORK_MIDPOINTS: u32 = 0;
/// Gauss nodes.
const NODES: u32 = 1;
/// Gauss nodes that crowd at both ends.
const GRADED: u32 = 2;
/// Eq. (18).
const PAPER: u32 = 3;

impl Fork {
    /// The lobe around `state.direction` that is met at `hit`, `state.lobes` counting it. `sweep` finds the spans that
    /// a split lobe sees, and their number, where there is memory for them.
    pub(super) fn new(
        scene: &PlaneScene<'_>,
        hit: &Hit,
        state: &PathState,
        material: u32,
        sweep: impl FnOnce() -> Option<usize>,
    ) -> Option<Fork> {
        let (lobe, rays) = scene.lobe(material)?;
        let visible = lobe.visible(state.direction, hit.normal);
        let mut fork = Fork {
            point: hit.point.to_array(),
            normal: hit.normal.to_array(),
            direction: state.direction.to_array(),
            throughput: state.throughput,
            floor: state.floor,
            visible: [visible.low, visible.high],
            part: [visible.low, visible.high],
            primitive: hit.primitive,
            material,
            depth: state.depth,
            lobes: state.lobes,
            ..Fork::default()
        };
        match rays {
            RaySet::Paper { spacing, renormalised } => {
                fork.part[0] = spacing;
                fork.sum = fork.paper_share(lobe, renormalised);
                (fork.kind, fork.rays) = (PAPER, 3);
            }
            RaySet::Gauss(counts) => fork.ask(NODES, fork.count(counts)),
            RaySet::Equal(counts) => (fork.kind, fork.rays) = (FORK_MIDPOINTS, fork.count(counts)),
            RaySet::Split(counts) => match sweep() {
                Some(spans) => fork.spans = spans as u32,
                None => fork.ask(NODES, fork.count(counts)),
            },
        }
        Some(fork)
    }

    /// Takes the nodes of a rule for the part's rays.
    fn ask(&mut self, kind: u32, wanted: u32) {
        (self.kind, self.wanted, self.ray, self.rays) = (kind, wanted, 0, points(wanted as usize) as u32);
    }

    /// Rays by the place of the lobe in its path.
    fn count(&self, counts: [u32; 3]) -> u32 {
        let [first, second, later] = counts;
        match self.lobes {
            0..=1 => first,
            2 => second,
            _ => later,
        }
    }

    /// A ray that carries the share `share` of the lobe's energy. At a path's first two lobes the chain's floor shrinks with
    /// the share: what the reflectances leave decides where it ends, not into how many rays a lobe is split. Beyond, small
    /// shares end, so that trees that branch at every lobe are finite.
    fn state(&self, direction: Vec2, share: f64) -> PathState {
        let floor = if self.lobes <= 2 { self.floor * share } else { self.floor };
        PathState {
            origin: Vec2::from(self.point),
            direction,
            skip: self.primitive,
            throughput: self.throughput * share,
            floor,
            depth: self.depth,
            lobes: self.lobes,
        }
    }

    /// The next ray to follow; rays toward the sky go to the sink. `spans` are those of the lobe's own sweep.
    pub(super) fn next<S: Sink>(
        &mut self,
        chains: &Chains<'_>,
        spans: &[Span],
        sink: &mut S,
    ) -> Option<PathState> {
        let lobe = chains.scene.lobe_alone(self.material)?;
        loop {
            if self.ray >= self.rays && !self.next_span(chains, lobe, spans) {
                return None;
            }
            let number = self.ray as usize;
            self.ray += 1;
            if self.kind == PAPER {
                let (ray, weight) = self.paper_ray(lobe, number);
                if ray.dot(Vec2::from(self.normal)) > 0.0 {
                    return Some(self.state(ray, weight * self.sum));
                }
                continue;
            }
            let [low, high] = self.part;
            let (n, width) = (self.wanted as usize, high - low);
            let (x, share) = match self.kind {
                FORK_MIDPOINTS => {
                    let n = f64::from(self.rays);
                    ((number as f64 + 0.5) / n, 0.5 * width / n)
                }
                NODES => {
                    let (x, w) = node(n, number);
                    (x, 0.5 * width * w)
                }
                _ => {
                    let (x, w) = graded_node(n, number, self.sum);
                    (x, 0.5 * width * w)
                }
            };
            let ray = self.state(lobe.direction(Vec2::from(self.direction), low + width * x), share);
            if self.sky == 0 {
                return Some(ray);
            }
            sink.escape(&ray);
        }
    }

    /// Goes on to the next span that takes a part of the lobe.
    fn next_span(&mut self, chains: &Chains<'_>, lobe: &PlaneLobe, spans: &[Span]) -> bool {
        let [low, high] = self.visible;
        let at = |s: f64| {
            let d = toward(Vec2::from(self.normal), s);
            lobe.place(Vec2::from(self.direction), d, &Visible { low, high })
        };
        let rest = spans.part(self.span as usize..self.spans as usize);
        let mut parts = rest.iter().zip(1..).map(|(span, done)| (span, done, at(span.from), at(span.to)));
        let Some((span, done, low, high)) = parts.find(|(_, _, low, high)| high > low) else { return false };
        let sky = span.primitive == NOWHERE;
        let own = match chains.scene.lobe(self.material) {
            Some((_, RaySet::Split(counts))) => self.count(counts),
            _ => 1,
        };
        let wanted = if sky { chains.sky_nodes as u32 } else { own };
        (self.span, self.sky, self.part) = (self.span + done, u32::from(sky), [low, high]);
        self.sum = graded_sum(wanted as usize);
        self.ask(GRADED, wanted);
        true
    }

    /// One of the three rays of eq. (18), and its weight.
    fn paper_ray(&self, lobe: &PlaneLobe, number: usize) -> (Vec2, f64) {
        let [spacing, _] = self.part;
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
    fn paper_share(&self, lobe: &PlaneLobe, renormalised: bool) -> f64 {
        let rays = [0, 1, 2].map(|number| self.paper_ray(lobe, number));
        let normal = Vec2::from(self.normal);
        if !renormalised {
            return 1.0 / (1.0 + 2.0 * rays[1].1);
        }
        let above: f64 = rays.iter().filter(|ray| ray.0.dot(normal) > 0.0).map(|ray| ray.1).sum();
        if above > 0.0 { lobe.albedo(Vec2::from(self.direction).dot(normal)) / above } else { 0.0 }
    }
}
