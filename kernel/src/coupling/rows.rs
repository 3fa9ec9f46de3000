//! Rows of the coupling by deterministic low-discrepancy chains.
//!
//! Each element side sends cosine-distributed rays from points spread over its area. A ray's first hit, and
//! every diffuse facet that its mirror chain meets, is a target; where the chain leaves the object, the sky is.
//! The error of a row's entry F is about sqrt(F (1 - F)) n^-2/3 for n rays (the integrand jumps in four
//! dimensions: n^-5/8 at worst); the sum of targets, black backs and
//! sky is 1 exactly, since each ray ends somewhere.

use super::sink::Sink;
use super::word::EMPTY;
use super::{BLOCKED, OPEN, Record, Row, TRACED};
use crate::bvh::Bvh;
use crate::element::{Elements, Local};
use crate::error::Error;
use crate::math::{Vec3, fabs, frame, pow};
use crate::mirror::{Surface, opens_to_sky};
use crate::qmc::{Sequence, cosine_direction, hash, hash2, triangle};
use crate::scene::Scene;
use core::ops::Range;

/// What rows follow from the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowSettings {
    /// Rays of a row whose hemisphere is half filled; a power of two.
    pub rays: u32,
    /// Chains end where the product of their mirrors falls below this.
    pub cutoff: f64,
    /// Chains meet at most this many mirrors.
    pub mirrors: u32,
    /// Keep the directions of escapes, so that another sky needs no rays.
    pub directional: bool,
    /// Compute rows of sides that reflect nothing diffusely, too.
    pub all: bool,
}

/// The most rays of one row: the sequence has 2^16 points.
pub const MOST_RAYS: u32 = 1 << 16;

impl RowSettings {
    /// Settings for a tolerance: a row's error, about 0.6 n^-2/3 at its worst, times the diffuse reflectance is
    /// kept at the tolerance.
    pub fn new(
        scene: &Scene<'_>,
        tolerance: f64,
        max_bounces: Option<u32>,
        directional: bool,
        all: bool,
    ) -> Self {
        let diffuse = if all { scene.largest_diffuse().max(0.4) } else { scene.largest_diffuse() };
        let wanted = pow(0.6 * diffuse / tolerance, 1.5);
        let rays =
            if wanted < 64.0 { 64 } else { (wanted.min(f64::from(MOST_RAYS)) as u32).next_power_of_two() };
        let longest = super::word::LONGEST as u32;
        RowSettings {
            rays: rays.min(MOST_RAYS),
            cutoff: 1e-3 * tolerance,
            mirrors: max_bounces.unwrap_or(longest).min(longest),
            directional,
            all,
        }
    }
}

/// Computes the rows of `range`, or as many of them as `memory` holds, and returns how many; the caller hands
/// the rest to another block. At least one row, or [`Error::BufferTooSmall`].
///
/// The numbers of a row depend neither on the range nor on the memory.
pub fn fill(
    scene: &Scene<'_>,
    bvh: &Bvh<'_>,
    elements: &Elements<'_>,
    settings: &RowSettings,
    range: Range<usize>,
    memory: &mut [u8],
) -> Result<usize, Error> {
    let given = memory.len();
    let sink = Sink::new(&range, scene.bands(), settings.directional, memory)?;
    let wanted = range.len();
    let mut tracer = Tracer { scene, bvh, elements, settings, sink };
    for unknown in range {
        if tracer.row(unknown).is_none() {
            tracer.sink.drop_row();
            break;
        }
    }
    match tracer.sink.end() {
        0 if wanted > 0 => Err(Error::BufferTooSmall { needed: given.saturating_mul(2), given }),
        done => Ok(done),
    }
}

struct Tracer<'a, 'm> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    elements: &'a Elements<'a>,
    settings: &'a RowSettings,
    sink: Sink<'m>,
}

/// Where the rays of a row start.
struct Start {
    element: usize,
    facet: usize,
    side: usize,
    frame: (Vec3, Vec3),
    sequence: Sequence,
}

/// What the rays of a row have found so far.
#[derive(Default)]
struct Tally {
    rays: u32,
    chain_rays: u32,
    blocked: u32,
    blocked_first_half: u32,
    /// Sum over the first hits of a number in [0, 1) that each facet has: tells rows apart that are all blocked.
    marks: f64,
    marks_first_half: f64,
    lost: f64,
}

impl Tracer<'_, '_> {
    /// Adds the row of one unknown; `None` where the memory is full.
    fn row(&mut self, unknown: usize) -> Option<()> {
        let (facet, side) = self.elements.facet_of(unknown);
        let material = self.scene.material(facet);
        let black = self.scene.diffuse(material).iter().all(|&d| d == 0.0);
        if self.scene.areas()[facet] == 0.0 || (black && !self.settings.all) {
            self.sink.end_row(0.0, Row::default());
            return Some(());
        }
        let normal = self.scene.side_normal(facet, side);
        if opens_to_sky(self.scene, self.bvh, facet, normal) {
            self.sink.end_row(0.0, Row { state: OPEN, ..Row::default() });
            return Some(());
        }
        let start = Start {
            element: unknown / self.scene.sides(),
            facet,
            side,
            frame: frame(normal),
            sequence: Sequence::new(hash2(unknown as u32, 0x0b11_7000)),
        };
        // a small element varies little: its rays spread over two dimensions instead of four
        let whole = self.elements.share(facet) == 1.0;
        let most = if whole { self.settings.rays } else { (self.settings.rays / 4).max(64) };
        let mut tally = Tally::default();
        let mut goal = (most / 16).max(64).min(most);
        while tally.rays < goal {
            if 2 * tally.rays == goal {
                tally.blocked_first_half = tally.blocked;
                tally.marks_first_half = tally.marks;
            }
            self.ray(&start, &mut tally)?;
            tally.rays += 1;
            if tally.rays == goal {
                goal = enough(most, goal, tally.blocked);
            }
        }
        let share = 1.0 / f64::from(tally.rays);
        let halves = f64::from(tally.blocked) - 2.0 * f64::from(tally.blocked_first_half);
        let marks = tally.marks - 2.0 * tally.marks_first_half;
        self.sink.end_row(
            share,
            Row {
                state: TRACED,
                rays: tally.rays,
                chain_rays: tally.chain_rays,
                lost: tally.lost * share,
                spread: fabs(halves).max(fabs(marks)) * share,
                ..Row::default()
            },
        );
        Some(())
    }

    /// Ray number `tally.rays` of a row and its mirror chain.
    #[inline]
    fn ray(&mut self, start: &Start, tally: &mut Tally) -> Option<()> {
        let (index, sequence) = (tally.rays, &start.sequence);
        let (p, q) = sequence.pair(index, 0);
        let (dx, dy, dz) = cosine_direction(p, q);
        let (p, q) = sequence.pair(index, 2);
        let (a, b) = triangle(p, q);
        let (u, v) = self.elements.in_facet(start.element, a, b);
        let origin = Surface::new(self.scene, start.facet, start.side, u, v);
        let first = start.frame.0 * dx + start.frame.1 * dy + origin.normal * dz;
        let local = (a - 1.0 / 3.0, b - 1.0 / 3.0);
        let mut ray = origin.leave(first);
        let (mut word, mut weight) = (EMPTY, 1.0);
        loop {
            let hit = self.bvh.closest(&ray);
            tally.chain_rays += u32::from(word != EMPTY);
            let Some(hit) = hit else {
                if word != EMPTY {
                    self.sink.push(Record::escape(
                        self.kept(ray.direction),
                        word,
                        weight,
                        scaled(local, weight),
                    ))?;
                }
                return Some(());
            };
            if word == EMPTY {
                tally.blocked += 1;
                tally.marks += mark(hit.facet);
                self.sink.push(Record::escape(self.kept(first), BLOCKED, 1.0, local))?;
            }
            let Some(surface) = Surface::of_hit(self.scene, &hit) else { return Some(()) };
            let (target, _) = self.elements.locate(surface.facet, surface.side, hit.u, hit.v);
            if self.glows(surface.material) {
                self.sink.push(Record::target(target, word, weight, scaled(local, weight)))?;
            }
            let Some(mirror) = surface.mirror(self.scene) else { return Some(()) };
            let depth = self.sink.words.get(word).depth;
            if depth >= self.settings.mirrors {
                tally.lost += weight * self.sink.words.largest(word);
                return Some(());
            }
            let next = match self.sink.spell(word, mirror.class, self.scene) {
                Ok(next) => next,
                Err(true) => {
                    tally.lost += weight * self.sink.words.largest(word);
                    return Some(());
                }
                Err(false) => return None,
            };
            if self.sink.words.largest(next) * weight < self.settings.cutoff {
                tally.lost += weight * self.sink.words.largest(next);
                return Some(());
            }
            let (s, t) = lobe_point(sequence, index, depth);
            let (direction, share) = surface.go_on(self.scene, &mirror, ray.direction, s, t);
            word = next;
            weight *= share;
            ray = surface.leave(direction);
        }
    }

    fn kept(&self, direction: Vec3) -> Option<Vec3> {
        self.settings.directional.then_some(direction)
    }

    /// True where a material sends out diffuse light.
    #[inline]
    fn glows(&self, material: usize) -> bool {
        self.scene.diffuse(material).iter().chain(self.scene.emission(material)).any(|&x| x > 0.0)
    }
}

/// Rays that a row needs when `blocked` of its first `rays` met something: the error goes with the square root of
/// the variance and with n^-2/3. The variance of the blocked share p is p (1 - p); where half the rays or more meet
/// facets, it is which facets they meet that counts, and the variance is taken at its largest, 1/4.
fn enough(most: u32, rays: u32, blocked: u32) -> u32 {
    // one ray more may have met something
    let p = ((f64::from(blocked) + 1.0) / (f64::from(rays) + 1.0)).min(0.5);
    let wanted = pow(4.0 * p * (1.0 - p), 0.75) * f64::from(most);
    let mut goal = rays;
    while f64::from(goal) < wanted && goal < most {
        goal *= 2;
    }
    goal
}

/// A number in [0, 1) that each facet has.
#[inline(always)]
fn mark(facet: u32) -> f64 {
    f64::from(hash(facet)) * (1.0 / 4_294_967_296.0)
}

#[inline(always)]
fn scaled(local: Local, by: f64) -> Local {
    (local.0 * by, local.1 * by)
}

/// The pair of coordinates that chooses the ray of the lobe number `depth` of a chain: the sequence's own pair
/// for the first, rotated by an irrational step for later ones.
#[inline(always)]
pub fn lobe_point(sequence: &Sequence, index: u32, depth: u32) -> (f64, f64) {
    let (s, t) = sequence.pair(index, 4);
    let turn = |x: f64, step: f64| {
        let y = x + step * f64::from(depth);
        y - crate::math::floor(y)
    };
    (turn(s, 0.754_877_666_246_693), turn(t, 0.569_840_290_998_053))
}
