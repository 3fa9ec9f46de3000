//! The outlines of one facet: the edges that are outlines from some of its points, and the facets over their pole.
//!
//! Constants of this file are measured by `cargo test --test outlines` (outlines against rays) and `cargo bench --bench
//! counts` (instructions).

use super::contour::{self, Contour, sweep};
use super::groups::{Below, BelowLanes, GROUP};
use super::{
    BOTH, Basis, Block, KEEPS_OUTLINES, OUTLINE_HEIGHT_SLACK, OpenSky, Outlines, circles, plane, precedes,
    product,
};
use crate::base::arena::{Arena, Need, plain_struct};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, frame, sqrt, unit};
use crate::base::simd::{Isa, Lanes64, WIDTH, Wide, WideTask, run_wide, spread};
use crate::rays::bvh::{Bvh, HalfSpace};
use crate::scene::Scene;

/// Most edges that are examined for one facet: where more may be outlines, rays cost less.
const OUTLINE_EDGES_MOST: usize = 1024;

/// Most blocks of edges of one facet.
const CANDIDATE_BLOCKS: usize = if KEEPS_OUTLINES { OUTLINE_EDGES_MOST / WIDTH } else { 0 };

/// Most facets over the pole of one facet.
const POLES: usize = if KEEPS_OUTLINES { 512 } else { 0 };

/// Number of lists that are kept for facets that need the largest.
const LISTS: usize = if KEEPS_OUTLINES { 32 } else { 0 };

/// Number of crossings of outlines with the horizon for which there is room.
const CROSSINGS: usize = if KEEPS_OUTLINES { 2 * OUTLINE_EDGES_MOST + 16 * WIDTH } else { 0 };

/// In place of a count of edges: too many, and rays decide.
const EDGES_TOO_MANY: u32 = u32::MAX;

/// Largest height of a plane above a corner, in scene coordinates, whose sign may be rounding.
const PLANE_HEIGHT_ROUNDING: f64 = 1e-13;

/// Number of rows of an active edge: both ends in the frame of the point, and its jumps of all and of counted facets.
pub(super) const ACTIVE: usize = 8;

/// Edges that are outlines from a point, lane by lane.
pub(super) type Active = [[f64; WIDTH]; ACTIVE];

/// Where a half circle crosses an outline: the square of the sine of the angle from the pole, both jumps, and the half
/// circle's number.
pub(super) type Crossing = [f64; 4];

/// Frame of a point: the pole is its normal, the first axis points toward the horizon's zenith as far as may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub point: Vec3,
    pub axes: [Vec3; 3],
    /// Zenith of the near side of the horizon, on which the pole is: along the first axis and the pole.
    pub zenith: (f64, f64),
    /// Whether that is the side above the horizon.
    pub above: bool,
}

impl Frame {
    fn new(point: Vec3, normal: Vec3, basis: Basis) -> Frame {
        let (x, y) = frame(normal);
        let mut own = Frame { point, axes: [x, y, normal], zenith: (0.0, 1.0), above: true };
        if let Basis::Horizon(up) = basis {
            own.above = normal.dot(up) >= 0.0;
            let up = if own.above { up } else { -up };
            let height = normal.dot(up).min(1.0);
            let across = up - normal * height;
            if let (true, Some(x)) = (across.length_squared() > 1e-24, unit(across)) {
                own.axes = [x, normal.cross(x), normal];
                own.zenith = (sqrt(across.length_squared()), height);
            }
        }
        own
    }

    /// A place in this frame, in the arithmetic of the outlines' ends.
    fn place(&self, corner: Vec3) -> Vec3 {
        let from = corner - self.point;
        let [x, y, z] = self.axes.map(|axis| product(axis, from));
        Vec3::new(x, y, z)
    }
}

plain_struct! {
    /// Outlines of a side of a facet.
    pub struct List {
        /// Twice the facet and the side, and one; 0: nothing.
        pub side: u32,
        /// Where its edges start, in blocks.
        pub blocks: u32,
        /// How many edges it has; or [`EDGES_TOO_MANY`].
        pub edges: u32,
        /// Where the facets over its pole start.
        pub poles: u32,
        /// How many facets are over its pole.
        pub over: u32,
    }
}

/// Edges and facets that matter to facets asked for lately; the same answers whether they are remembered or not.
#[derive(Debug)]
pub struct Candidates<'m> {
    pool: &'m mut [Block],
    poles: &'m mut [u32],
    lists: &'m mut [List],
    /// Blocks and poles in use.
    used: (usize, usize),
    active: &'m mut [Active],
    crossings: &'m mut [Crossing],
    sorted: &'m mut [Crossing],
    list: List,
    normal: Vec3,
}

impl<'m> Candidates<'m> {
    /// Adds the memory that it works in, with room for `kept` facets about which much stands, or some dozen times as many
    /// about which little does.
    pub fn need(need: Need, kept: usize) -> Need {
        let need =
            need.and::<Block>(kept * CANDIDATE_BLOCKS).and::<u32>(kept * POLES).and::<List>(kept * LISTS);
        need.and::<Active>(CANDIDATE_BLOCKS).and::<Crossing>(CROSSINGS).and::<Crossing>(CROSSINGS)
    }

    /// Takes that memory.
    pub fn new(arena: &mut Arena<'m>, kept: usize) -> Result<Candidates<'m>, Error> {
        Ok(Candidates {
            pool: arena.take(kept * CANDIDATE_BLOCKS)?,
            poles: arena.take(kept * POLES)?,
            lists: arena.take(kept * LISTS)?,
            used: (0, 0),
            active: arena.take(CANDIDATE_BLOCKS)?,
            crossings: arena.take(CROSSINGS)?,
            sorted: arena.take(CROSSINGS)?,
            list: List::default(),
            normal: Vec3::Z,
        })
    }

    /// None.
    pub fn none() -> Candidates<'m> {
        Candidates {
            pool: &mut [],
            poles: &mut [],
            lists: &mut [],
            used: (0, 0),
            active: &mut [],
            crossings: &mut [],
            sorted: &mut [],
            list: List::default(),
            normal: Vec3::Z,
        }
    }

    /// Finds what matters to the points of a facet's side. False where that is too much: rays cost less there.
    pub fn prepare(&mut self, scene: &Scene<'_>, bvh: &Bvh<'_>, (facet, side): (usize, usize)) -> bool {
        let (outlines, isa) = (bvh.outlines(), bvh.isa());
        // without the standard library meshes have no outlines
        if cfg!(not(feature = "std")) || self.lists.is_empty() || outlines.is_empty() {
            return false;
        }
        let name = (2 * facet + side + 1) as u32;
        self.normal = scene.side_normal(facet, side);
        let place = name as usize % self.lists.len().max(1);
        self.list = self.lists.at(place);
        if self.list.side != name {
            let full =
                self.used.0 + CANDIDATE_BLOCKS > self.pool.len() || self.used.1 + POLES > self.poles.len();
            self.list = self.find(scene, (bvh, isa), facet, name);
            if self.list.edges == EDGES_TOO_MANY && full {
                // make room, and once more
                self.lists.fill(List::default());
                self.used = (0, 0);
                self.list = self.find(scene, (bvh, isa), facet, name);
            }
            self.lists.set(place, self.list);
        }
        self.list.edges != EDGES_TOO_MANY
    }

    /// Finds them behind what is in use.
    #[inline(never)]
    fn find(&mut self, scene: &Scene<'_>, (bvh, isa): (&Bvh<'_>, Isa), facet: usize, name: u32) -> List {
        let (outlines, corners) = (bvh.outlines(), &scene.corners().at(facet));
        let normal = self.normal;
        let height = corners.iter().map(|c| product(normal, *c)).fold(f64::INFINITY, f64::min);
        let own = plane(&scene.corners().at((outlines.groups.at(facet) & !BOTH) as usize));
        let (blocks, poles) = self.used;
        let end = (blocks + CANDIDATE_BLOCKS).min(self.pool.len());
        let free = self.pool.part_mut(blocks..end);
        let (edges, fits) = run_wide(isa, Sort { outlines, corners, normal, own, height, out: free });
        let over = if fits { self.over_pole(scene, bvh, facet, corners, height) } else { None };
        let Some(over) = over else { return List { side: name, edges: EDGES_TOO_MANY, ..List::default() } };
        self.used = (blocks + edges.div_ceil(WIDTH), poles + over);
        List {
            side: name,
            blocks: blocks as u32,
            edges: edges as u32,
            poles: poles as u32,
            over: over as u32,
        }
    }

    /// Whether nothing rises above the facet that was prepared.
    pub fn is_clear(&self) -> bool {
        self.list.edges == 0 && self.list.over == 0
    }

    /// Finds the facets that the normal of some point of a facet may meet; how many.
    fn over_pole(
        &mut self,
        scene: &Scene<'_>,
        bvh: &Bvh<'_>,
        own: usize,
        corners: &[Vec3; 3],
        height: f64,
    ) -> Option<usize> {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let far = corners.iter().map(|c| (*c - middle).length_squared()).fold(0.0, f64::max);
        let outlines = bvh.outlines();
        let group = outlines.groups.at(own) & !BOTH;
        let end = (self.used.1 + POLES).min(self.poles.len());
        let places = self.poles.part_mut(self.used.1..end);
        let mut count = 0;
        let reach = sqrt(far) + OUTLINE_HEIGHT_SLACK;
        let (x, y) = frame(self.normal);
        let half = |normal: Vec3, least: f64| HalfSpace { normal, height: middle.dot(normal) - least };
        let prism =
            [half(x, reach), half(-x, reach), half(y, reach), half(-y, reach), half(self.normal, reach)];
        let mut fits = true;
        bvh.within(&prism, |facet| {
            let of = outlines.groups.at(facet as usize) & !BOTH;
            let heights = scene.corners().at(facet as usize).map(|c| product(self.normal, c) - height);
            let rises = of != group && heights.iter().any(|h| *h > OUTLINE_HEIGHT_SLACK);
            // leaves that share a packet show its facets twice
            if rises && !places.head(count).contains(&facet) {
                fits = count < places.len();
                places.set(count, facet);
                count += 1;
            }
            fits
        });
        fits.then_some(count)
    }

    /// The open sky over a point of the facet that was prepared; circles are added until the expected error is at most
    /// `goal`, as far as that goes. `None` where there is too much.
    pub fn open(
        &mut self,
        scene: &Scene<'_>,
        bvh: &Bvh<'_>,
        point: Vec3,
        basis: Basis,
        goal: f64,
    ) -> Option<OpenSky> {
        let (known, isa) = (bvh.outlines(), bvh.isa());
        if cfg!(not(feature = "std")) || self.list.side == 0 || self.list.edges == EDGES_TOO_MANY {
            return None;
        }
        let frame = Frame::new(point, self.normal, basis);
        let over = self.pole(scene, known, &frame);
        let whole = contour::whole(&frame, basis);
        let first = self.list.blocks as usize;
        let blocks = self.pool.part(first..first + (self.list.edges as usize).div_ceil(WIDTH));
        let (active, one) = sweep(isa, &frame, blocks, scene.sides() == 2, self.active);
        let lit = |values| OpenSky { values, above: frame.above, error: 0.0, inside: over.inside > 0 };
        if active == 0 {
            return Some(lit(if over.all == 0 { whole } else { [0.0; 4] }));
        }
        let outlines = self.active.head(active.div_ceil(WIDTH));
        let counted = run_wide(isa, Contour { frame: &frame, basis, active: outlines });
        let crossings = (&mut *self.crossings, &mut *self.sorted);
        let fronts = |k: usize| f64::from(over.counted) * whole[k] + counted[k];
        let contour = [0, 1, 2, 3].map(|k| whole[k] - fronts(k));
        let found = circles::look(isa, (&frame, basis), (outlines, one, contour), &over, goal, crossings)?;
        let mut values = found.values;
        if !found.is_open {
            for (k, value) in values.iter_mut().enumerate() {
                *value += contour[k];
            }
        }
        Some(OpenSky { error: found.error, ..lit(bounded(values, whole, frame.above)) })
    }

    /// The facets straight over a point.
    fn pole(&self, scene: &Scene<'_>, outlines: &Outlines<'_>, frame: &Frame) -> Over {
        let mut over = Over::default();
        let first = self.list.poles as usize;
        for &facet in self.poles.part(first..first + self.list.over as usize) {
            let facet = facet as usize;
            let corners = scene.corners().at(facet);
            let Some(turn) = winding(frame, &corners) else { continue };
            let of = outlines.groups.at(facet);
            let both = scene.sides() == 2 && of & BOTH != 0;
            let (normal, distance) = plane(&scene.corners().at((of & !BOTH) as usize));
            let front = product(normal, frame.point) - distance > 0.0;
            // a front that is run through clockwise, or a back the other way, is above; else it is below
            if front == turn {
                continue;
            }
            over.all += 1;
            over.counted += i32::from(front || both);
            over.inside += if of & BOTH != 0 {
                0
            } else if front {
                -1
            } else {
                1
            };
        }
        over
    }
}

/// Open share up to which the contour's sum is rounding: nothing is open.
const OPEN_SHARE_ROUNDING: f64 = 1e-6;

/// Open shares and heights within what is possible: a share is at most the whole one, and heights are at most shares on
/// either side of the horizon.
fn bounded([all, high, near, near_high]: [f64; 4], whole: [f64; 4], above: bool) -> [f64; 4] {
    let all = all.min(whole[0]);
    if all < OPEN_SHARE_ROUNDING {
        return [0.0; 4];
    }
    let near = near.min(whole[2]).max(0.0).min(all);
    let sign = if above { 1.0 } else { -1.0 };
    let near_high = sign * (sign * near_high).min(near).max(0.0);
    let far_high = -sign * (-sign * (high - near_high)).min(all - near).max(0.0);
    [all, near_high + far_high, near, near_high]
}

/// Facets straight over a point: all facets, those that count, and the backs less the fronts of closed bodies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Over {
    pub all: i32,
    pub counted: i32,
    pub inside: i32,
}

/// Whether a triangle runs about the pole counter-clockwise; `None` where it does not run about it. By the signs that tell
/// on which side of the pole outlines pass.
fn winding(frame: &Frame, corners: &[Vec3; 3]) -> Option<bool> {
    let places = corners.map(|c| frame.place(c));
    let side = |i: usize, j: usize| {
        let (a, b) = (places[i], places[j]);
        // from the lower end to the upper, as in outlines
        if precedes(corners[i], corners[j]) {
            a.x * b.y - a.y * b.x > 0.0
        } else {
            b.x * a.y - b.y * a.x <= 0.0
        }
    };
    let turn = side(0, 1);
    (turn == side(1, 2) && turn == side(2, 0)).then_some(turn)
}

/// Farthest that a facet lies from the plane that it shares with others (scene coordinates): ten times what facets that share
/// one are held to.
const SHARED_PLANE_SLACK: f64 = 1e-6;

/// Finds the edges that rise above the facet's plane and are outlines from some point of it.
struct Sort<'a> {
    outlines: &'a Outlines<'a>,
    corners: &'a [Vec3; 3],
    normal: Vec3,
    /// Normal and distance of the plane that it shares with others, which cover nothing over it.
    own: (Vec3, f64),
    height: f64,
    out: &'a mut [Block],
}

impl WideTask for Sort<'_> {
    type Out = (usize, bool);

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> (usize, bool) {
        let Sort { outlines, corners, normal, own, height, out } = self;
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = sqrt(corners.iter().map(|c| (*c - centre).length_squared()).fold(0.0, f64::max));
        let below = BelowLanes::new(lanes, &Below { centre, radius, normal, height });
        let rises = Rises {
            lanes,
            normal: spread(lanes, normal),
            corners: [spread(lanes, corners[0]), spread(lanes, corners[1]), spread(lanes, corners[2])],
            own: [own.0.x, own.0.y, own.0.z, own.1],
            least: lanes.all(height + OUTLINE_HEIGHT_SLACK),
        };
        let (mut count, mut mattering) = (0, u32::MAX);
        let groups = outlines.block_groups;
        let (all, run) =
            if groups.is_empty() { (1, outlines.blocks.len()) } else { (groups.len() * WIDTH, GROUP) };
        // loops rather than iterators, which are not inlined into code compiled for another instruction set
        for group in 0..all {
            if let (0, Some(bounds)) = (group % WIDTH, groups.get(group / WIDTH)) {
                mattering = below.may_matter(lanes, bounds);
            }
            if mattering >> (group % WIDTH) & 1 == 0 {
                continue;
            }
            for number in group * run..(group + 1) * run {
                let Some(block) = outlines.blocks.get(number) else { break };
                let (mut kept, own) = rises.of(block);
                let last = outlines.edges.saturating_sub(number * WIDTH);
                if last < WIDTH {
                    kept &= (1 << last) - 1;
                }
                while kept != 0 {
                    let lane = kept.trailing_zeros() as usize % WIDTH;
                    kept &= kept - 1;
                    let Some(to) = out.get_mut(count / WIDTH) else { return (count, false) };
                    for (to, from) in to.iter_mut().zip(block) {
                        to[count % WIDTH] = from[lane];
                    }
                    for (plane, own) in own.into_iter().enumerate() {
                        if own >> lane & 1 == 1 {
                            to[14 + plane][count % WIDTH] = 0.0;
                            to[16 + plane][count % WIDTH] = 0.0;
                        }
                    }
                    count += 1;
                }
            }
        }
        if let Some(rest) = out.get_mut(count / WIDTH) {
            for lane in count % WIDTH..WIDTH {
                rest.iter_mut().for_each(|row| row[lane] = 0.0);
            }
        }
        (count, true)
    }
}

/// A facet in every lane, above whose plane edges are to rise.
struct Rises<L: Lanes64> {
    lanes: L,
    normal: [L::F; 3],
    corners: [[L::F; 3]; 3],
    /// As [`Sort::own`], one number after the other.
    own: [f64; 4],
    /// Height above which an edge counts.
    least: L::F,
}

impl<L: Lanes64> Rises<L> {
    /// The edges of a block that rise above the plane and are outlines from some point of the facet, as bits; and those whose
    /// planes, the first and the other, are the facet's own.
    #[inline(always)]
    fn of(&self, block: &Block) -> (u32, [u32; 2]) {
        let (lanes, n) = (self.lanes, self.normal);
        let (doubt, zero, close) =
            (lanes.all(PLANE_HEIGHT_ROUNDING), lanes.all(0.0), lanes.all(SHARED_PLANE_SLACK));
        let row = |k: usize| lanes.of(&block[k]);
        let low = n[0] * row(0) + n[1] * row(1) + n[2] * row(2);
        let other = n[0] * row(3) + n[1] * row(4) + n[2] * row(5);
        let kept = L::F::bits(low.max(other).gt(self.least));
        if kept == 0 {
            return (0, [0; 2]);
        }
        let first = heights(zero, &self.corners, [row(6), row(7), row(8), row(9)]);
        let other = heights(zero, &self.corners, [row(10), row(11), row(12), row(13)]);
        let (low, top) = (zero - (zero - first.0).max(zero - other.0), first.1.max(other.1));
        let same = L::F::bits(low.gt(doubt)) | L::F::bits((zero - doubt).gt(top));
        let rim = !L::F::bits(row(15).abs().gt(zero));
        let near = |(low, top): (L::F, L::F)| L::F::bits(low.gt(zero - close)) & L::F::bits(close.gt(top));
        let mut own = [near(first) & kept, near(other) & kept];
        if own[0] | own[1] != 0 {
            // a plane that is the same only to rounding rises above itself here and there
            for (k, x) in self.own.into_iter().enumerate() {
                own[0] &= !L::F::bits((row(6 + k) - lanes.all(x)).abs().gt(zero));
                own[1] &= !L::F::bits((row(10 + k) - lanes.all(x)).abs().gt(zero));
            }
        }
        (kept & (!same | rim | own[0] | own[1]), own)
    }
}

/// The least and the greatest height of three corners above planes; `none` is 0.
#[inline(always)]
fn heights<F: Wide>(none: F, corners: &[[F; 3]; 3], [x, y, z, d]: [F; 4]) -> (F, F) {
    let [a, b, c] = corners;
    let a = a[0] * x + a[1] * y + a[2] * z - d;
    let b = b[0] * x + b[1] * y + b[2] * z - d;
    let c = c[0] * x + c[1] * y + c[2] * z - d;
    (none - (none - a).max(none - b).max(none - c), a.max(b).max(c))
}
