//! Rows of the coupling by deterministic low-discrepancy chains.
//!
//! Each element side sends cosine-distributed rays from points spread over its area, as many from each of the four
//! triangles that its edges' middles cut off: what those three at the corners see makes the gradient. A ray's first
//! hit, and every diffuse facet that its mirror chain meets, is a target; where the chain leaves the object, the sky
//! is. The error of a row's entry F is about sqrt(F (1 - F)) n^-2/3 for n rays (the integrand jumps in four dimensions:
//! n^-5/8 at worst); the sum of targets, black backs and sky is 1 exactly, since each ray ends somewhere.
//!
//! What nothing hides ([`crate::coupling::plane_sides`]) is entered in closed form instead (`exact.rs`) where that
//! costs less: rays that meet it first go on from there alone, and both kinds of rays together stand for their kind's
//! share of the hemisphere, which is known.
//!
//! A part whose rays meet hardly anything but black backs is inside a body, where nothing sees it: the others stand for
//! what is seen. Where some of a row's rays meet backs, each ray that meets anything tells whether it starts inside a
//! body, and counts or not.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors) and `cargo bench --bench
//! counts` (instructions).

use super::exact::{self, Entries, Known, MIRROR_KINDS, mirror_kind};
use super::kept::Kept;
use super::mirror_path::{MIRRORS_MOST, STRAIGHT};
use super::row_builder::RowBuilder;
use super::{BLOCKED, ENCLOSED, OPEN, Record, Row, TRACED};
use crate::base::arena::{Arena, Need};
use crate::base::budget::ErrorBudget;
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, clamp, frame, pow};
use crate::base::qmc::{Sequence, cosine_direction, hash2, triangle};
use crate::base::quarter::{self, QUARTERS};
use crate::coupling::element::Elements;
use crate::coupling::plane_sides::{PlaneSides, ProvenVisible, Receiver};
use crate::coupling::subdivide::INSIDE;
use crate::rays::bvh::{Bvh, STREAM_RAYS};
use crate::rays::inside::inside;
use crate::rays::ray::{Hit, Ray};
use crate::rays::surface::{Mirror, Surface, opens_to_sky};
use crate::scene::Scene;
use core::f64::consts::SQRT_2;
use core::ops::Range;

/// Settings of rows, by the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowSettings {
    /// Rays of a row of a facet of mean area whose hemisphere is half filled; a power of two.
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

/// Parts of an element: its quarters.
const ELEMENT_PARTS: usize = QUARTERS;

/// Number of parts of an element's parts: the quarters' quarters.
const ROW_BINS: usize = ELEMENT_PARTS * ELEMENT_PARTS;

/// Most rays of one row: each part's sequence has 2^16 points.
pub const ROW_RAYS_MOST: u32 = (ELEMENT_PARTS as u32) << 16;

/// The gradients, in local coordinates, of the linear function through what the exposed parts see, by what each of
/// them sees: through three corners; along the line of two, and the same across it; none.
fn slopes(open: [bool; ELEMENT_PARTS]) -> [[f64; 2]; ELEMENT_PARTS] {
    // of the barycentric weights; from part to part at the corners they change by a half
    const WEIGHTS: [[f64; 2]; ELEMENT_PARTS] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]];
    let corners = open.iter().take(3).filter(|&&o| o).count();
    let sum = |k: usize| WEIGHTS.iter().zip(open).filter(|(_, o)| *o).map(|(w, _)| w.at(k)).sum::<f64>();
    let of = |part: usize, k: usize| match corners {
        3 => 2.0 * WEIGHTS[part][k],
        2 => 2.0 * WEIGHTS[part][k] - sum(k),
        _ => 0.0,
    };
    [0, 1, 2, 3].map(|part| if part < 3 && open[part] { [of(part, 0), of(part, 1)] } else { [0.0; 2] })
}

/// Weight of each exposed part in how far light departs from the linear function: the middle one beside the
/// corners' mean; where some are not exposed, half the difference between two; none where one is all.
fn departures(open: [bool; ELEMENT_PARTS]) -> [f64; ELEMENT_PARTS] {
    if open == [true; ELEMENT_PARTS] {
        return [-1.0 / 3.0, -1.0 / 3.0, -1.0 / 3.0, 1.0];
    }
    let mut sign = if open.iter().filter(|&&o| o).count() > 1 { 0.5 } else { 0.0 };
    open.map(|open| {
        let own = if open { sign } else { 0.0 };
        if open {
            sign = if sign > 0.0 { -0.5 } else { 0.0 };
        }
        own
    })
}

/// Weight of each part of a cluster in how far light departs from its mean: half the difference between two pairs, whose
/// square is expected to be that of one.
const CLUSTER_DEPARTURES: [f64; ELEMENT_PARTS] = [0.5, -0.5, 0.5, -0.5];

/// Most entries in closed form of one row.
const ROW_CLOSED_FORMS_MOST: usize = 4096;

/// Number of entries in closed form up to which all are entered where nothing hides any: they are exact, and cost less
/// than the fewest rays.
const CLOSED_FORMS_CHEAP: usize = 1024;

/// Number of entries in closed form that cost as much as a ray. Measured by `cargo bench --bench counts`.
const CLOSED_FORMS_PER_RAY: f64 = 0.35;

/// Largest excess of a row's sum over the hemisphere, as a share of it, at which its entries in closed form are kept.
/// Above it they hide one another, whatever was proven.
const HEMISPHERE_EXCESS_MOST: f64 = 0.02;

/// Rays of the largest elements, over those of a facet of mean area.
const AREA_RAYS_FACTOR_MOST: f64 = 2.0;

/// Rays of the smallest elements, over those of a facet of mean area.
const AREA_RAYS_FACTOR_LEAST: f64 = 0.25;

/// Number of rays that meet their first facets together: few where the stack is small.
const ROW_RAYS_TOGETHER: usize = if cfg!(feature = "std") { STREAM_RAYS } else { 4 };

/// Fewest rays of a row.
const ROW_RAYS_FEWEST: u32 = 64;

/// Fewest rays from outside a body that tell of an element; with fewer, its neighbour stands for it.
const LEAST_EXPOSED: u32 = 32;

/// The power of two nearest to a number of rays.
fn whole(rays: f64) -> u32 {
    let most = (clamp(rays, f64::from(ROW_RAYS_FEWEST), f64::from(ROW_RAYS_MOST)) * SQRT_2) as u32;
    1 << most.checked_ilog2().unwrap_or(0)
}

impl RowSettings {
    /// The most rays of a row.
    pub fn most_rays(&self) -> u32 {
        whole(AREA_RAYS_FACTOR_MOST * f64::from(self.rays))
    }

    /// Settings with half the rays; `None` where a row has the fewest.
    pub fn fewer(self) -> Option<Self> {
        (self.rays > ROW_RAYS_FEWEST).then_some(RowSettings { rays: self.rays / 2, ..self })
    }

    /// Settings with at most as many rays as keep the first rays of `rows` rows within `budget`, but no fewer than the
    /// fewest.
    pub fn within(mut self, rows: usize, budget: u64) -> Self {
        while u64::from(self.most_rays()).saturating_mul(rows as u64) > budget {
            let Some(fewer) = self.fewer() else { break };
            self = fewer;
        }
        self
    }

    /// Settings for an error budget: a row's error, about 0.9 n^-2/3 at its worst, times the diffuse reflectance is
    /// kept at the solution's.
    pub fn new(
        scene: &Scene<'_>,
        budget: &ErrorBudget,
        max_bounces: Option<u32>,
        directional: bool,
        all: bool,
    ) -> Self {
        let diffuse = if all { scene.largest_diffuse().max(0.4) } else { scene.largest_diffuse() };
        let longest = super::mirror_path::MIRRORS_MOST as u32;
        RowSettings {
            rays: whole(pow(0.9 * diffuse / budget.solution, 1.5)),
            cutoff: budget.row_chains,
            mirrors: max_bounces.unwrap_or(longest).min(longest),
            directional,
            all,
        }
    }
}

/// The rows of a coupling that is to be made.
#[derive(Clone, Copy, Debug)]
pub struct CouplingRows<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its tree.
    pub bvh: &'a Bvh<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// Its facets' planes.
    pub plane_sides: &'a PlaneSides<'a>,
    /// How rows are computed.
    pub rows: RowSettings,
    /// Rows that are copied.
    pub kept: Option<Kept<'a>>,
}

/// Computes the rows of `range`, or as many of them as `memory` holds, and returns how many; the caller hands
/// the rest to another block. At least one row, or [`Error::BufferTooSmall`].
///
/// The numbers of a row depend neither on the range nor on the memory.
pub fn fill(of: &CouplingRows<'_>, range: Range<usize>, memory: &mut [u8]) -> Result<usize, Error> {
    let (CouplingRows { scene, bvh, elements, plane_sides, rows: settings, kept }, given) =
        (of, memory.len());
    // the set of what is clear stands behind the block
    let words = if plane_sides.is_empty() || settings.directional { 0 } else { ProvenVisible::words(scene) };
    let room = if words > 0 { Need::new().and::<u64>(words).bytes()? } else { 0 };
    let short = |needed: usize| Error::BufferTooSmall { needed: needed.saturating_add(room), given };
    let (memory, behind) = memory.split_at_mut_checked(given.saturating_sub(room)).ok_or(short(0))?;
    let builder = match RowBuilder::new(&range, scene.bands(), settings.directional, memory) {
        Err(Error::BufferTooSmall { needed, .. }) => return Err(short(needed)),
        builder => builder?,
    };
    let proven = if words > 0 { Arena::new(behind, room)?.take::<u64>(words)? } else { &mut [] };
    let wanted = range.len();
    let mean_area = scene.areas().iter().sum::<f64>().max(f64::MIN_POSITIVE) / elements.roots() as f64;
    let mut tracer = Tracer { scene, bvh, elements, plane_sides, settings, mean_area, builder, proven };
    for unknown in range {
        let row = kept.as_ref().and_then(|kept| Some((kept.row(unknown)?, kept)));
        let done = match row {
            Some((row, kept)) => tracer.builder.copy_row(&row, (kept, kept.pose(unknown)), scene),
            None => tracer.row(unknown),
        };
        if done.is_none() {
            tracer.builder.drop_row();
            break;
        }
    }
    match tracer.builder.end() {
        0 if wanted > 0 => Err(Error::BufferTooSmall { needed: given.saturating_mul(2), given }),
        done => Ok(done),
    }
}

struct Tracer<'a, 'm> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    elements: &'a Elements<'a>,
    plane_sides: &'a PlaneSides<'a>,
    settings: &'a RowSettings,
    mean_area: f64,
    builder: RowBuilder<'m>,
    /// Memory of [`ProvenVisible`].
    proven: &'m mut [u64],
}

/// The rays of a row: where they start, and where to.
pub(super) struct RowRays {
    element: usize,
    facet: usize,
    side: usize,
    /// Whether the element is a cluster, whose facets have normals of their own.
    cluster: bool,
    frame: (Vec3, Vec3),
    sequences: [Sequence; ELEMENT_PARTS],
}

impl RowRays {
    /// Those of an unknown.
    pub(super) fn new(scene: &Scene<'_>, elements: &Elements<'_>, unknown: usize) -> RowRays {
        let (facet, side) = elements.facet_of(unknown);
        RowRays {
            element: unknown / scene.sides().max(1),
            facet,
            side,
            cluster: elements.is_cluster(unknown),
            frame: frame(scene.side_normal(facet, side)),
            sequences: [0, 1, 2, 3].map(|part| Sequence::new(hash2(unknown as u32, 0x0b11_7000 + part))),
        }
    }

    /// Ray `number`, and the part of a part from which it starts.
    #[inline]
    pub(super) fn ray(&self, scene: &Scene<'_>, elements: &Elements<'_>, number: u32) -> (Ray, usize) {
        let (part, index) = (number as usize % ELEMENT_PARTS, number / ELEMENT_PARTS as u32);
        let sequence = &self.sequences[part];
        let (p, q) = sequence.pair(index, 2);
        let (a, b) = triangle(p, q);
        let bin = part * ELEMENT_PARTS + quarter::into(a, b).0;
        let (a, b) = quarter::out_of(part, (a, b));
        let (p, q) = sequence.pair(index, 0);
        let (dx, dy, dz) = cosine_direction(p, q);
        let (facet, u, v) = elements.place(self.element, a, b);
        let origin = Surface::new(scene, facet, self.side, u, v);
        let axes = if self.cluster { frame(origin.normal) } else { self.frame };
        (origin.spawn_ray(axes.0 * dx + axes.1 * dy + origin.normal * dz), bin)
    }
}

/// Counts of a row's rays so far.
#[derive(Default)]
struct Tally {
    rays: u32,
    chain_rays: u32,
    /// Rays that met what is not entered in closed form; rays of each part that met what is, and mirrors among it.
    blocked: u32,
    clear: [u32; ELEMENT_PARTS],
    mirrored: [[u32; MIRROR_KINDS]; ELEMENT_PARTS],
    truncated_weight: f64,
    /// Entries in closed form.
    known: Known,
    /// Rays of each part's parts, and how many of them met a black back first.
    bins: [u32; ROW_BINS],
    backs: [u32; ROW_BINS],
    /// Whether rays of a part's part are told apart by where they start, and how many started inside a body.
    apart: [bool; ROW_BINS],
    inside: [u32; ROW_BINS],
}

/// Conversion of the records of a row's rays into its entries.
struct RowEnding {
    /// Scale of the entries in closed form.
    known_scale: f64,
    /// [`Tally::kinds`] of each part.
    kinds: [[f64; 1 + MIRROR_KINDS]; ELEMENT_PARTS],
    /// Rays of each part's parts, and of each part, that count.
    exposed: [u32; ROW_BINS],
    counts: [u32; ELEMENT_PARTS],
    /// Whether all rays count.
    all_exposed: bool,
    /// Weight of a ray.
    mean: f64,
    /// Rays of each part's part of the first half.
    first_half: f32,
    /// Mirror path of the escapes that are not kept.
    dropped: u16,
    /// [`slopes`] and [`departures`] of the parts.
    slopes: [[f64; 2]; ELEMENT_PARTS],
    departures: [f64; ELEMENT_PARTS],
}

impl RowEnding {
    /// The entry of one record; `None` where it does not count.
    #[inline]
    fn finish(&self, mut record: Record) -> Option<Record> {
        if let Some(record) = exact::finished(&record, self.known_scale) {
            return Some(record);
        }
        let (kind, bin) = (record.gradient[0] as usize / ROW_BINS, record.gradient[0] as usize % ROW_BINS);
        let part = bin / ELEMENT_PARTS;
        let scale = self.kinds.get(part).map_or(1.0, |kinds| kinds.at(kind));
        record.weight *= scale;
        record.moment = record.moment.map(|m| m * scale as f32);
        if self.exposed[bin] == 0 || (record.is_escape() && record.path() == self.dropped) {
            return None;
        }
        let own = record.weight / f64::from(self.counts[part]);
        let gradient =
            if self.all_exposed { self.slopes[part].map(|slope| (slope * own) as f32) } else { [0.0; 2] };
        let first = record.gradient[1] < self.first_half;
        let difference = if first { self.mean * record.weight } else { -self.mean * record.weight };
        let departure = 2.0 * self.departures[part] * own;
        let split =
            |value: f64, to_first: bool| if to_first { [value as f32, 0.0] } else { [0.0, value as f32] };
        let ([a, b], [c, d]) = (split(difference, part < 2), split(departure, first));
        let moment = record.moment.map(|m| self.mean as f32 * m);
        Some(Record {
            weight: self.mean * record.weight,
            gradient,
            half_differences: [a, b, c, d],
            moment,
            ..record
        })
    }
}

impl Tally {
    /// Where some rays of the row met black backs: the parts of the parts of which not all did.
    fn mixed(&self) -> [bool; ROW_BINS] {
        let some = self.backs.iter().any(|b| *b > 0);
        core::array::from_fn(|bin| some && self.backs.at(bin) < self.bins.at(bin))
    }

    /// By what a part's rays that first met what is not known, or escaped, count, and by what those that first met known
    /// mirrors do: together as much as is not known, and as those mirrors fill.
    fn kinds(&self, part: usize) -> [f64; 1 + MIRROR_KINDS] {
        let mut kinds = [1.0; 1 + MIRROR_KINDS];
        if self.known.share() == 0.0 {
            return kinds;
        }
        let rays: u32 = (0..ELEMENT_PARTS).map(|bin| self.bins.at(part * ELEMENT_PARTS + bin)).sum();
        let of = |share: f64, of: u32| {
            if of > 0 { share.max(0.0) * f64::from(rays) / f64::from(of) } else { 0.0 }
        };
        let others = of(1.0 - self.known.shares.at(part), rays.saturating_sub(self.clear.at(part)));
        let known = self.known.mirrored.get(part).into_iter().flatten();
        let mirrors = known.zip(self.mirrored.get(part).into_iter().flatten()).map(|(s, r)| of(*s, *r));
        kinds.iter_mut().zip(core::iter::once(others).chain(mirrors)).for_each(|(to, from)| *to = from);
        kinds
    }

    /// Rays of each part's part that did not start inside a body; all where hardly one did not, and then true.
    fn exposed(&self) -> ([u32; ROW_BINS], bool) {
        let mut exposed = [0; ROW_BINS];
        for part in 0..ELEMENT_PARTS {
            let of = |counts: &[u32; ROW_BINS], bin: usize| counts.at(part * ELEMENT_PARTS + bin);
            let sum = |counts: &[u32; ROW_BINS]| (0..ELEMENT_PARTS).map(|bin| of(counts, bin)).sum::<u32>();
            let inside = |backs: u32, rays: u32| f64::from(backs) >= INSIDE * f64::from(rays);
            for bin in 0..ELEMENT_PARTS {
                let (backs, rays) = match of(&self.bins, bin) {
                    few if few < ROW_RAYS_FEWEST / ELEMENT_PARTS as u32 => {
                        (sum(&self.backs), sum(&self.bins))
                    }
                    rays => (of(&self.backs, bin), rays),
                };
                let at = part * ELEMENT_PARTS + bin;
                let seen = match (self.apart[at], inside(backs, rays)) {
                    (true, _) => self.bins.at(at).saturating_sub(self.inside.at(at)),
                    (false, true) => 0,
                    (false, false) => self.bins.at(at),
                };
                exposed.set(at, seen);
            }
        }
        if exposed.iter().sum::<u32>() < LEAST_EXPOSED { (self.bins, true) } else { (exposed, false) }
    }
}

impl Tracer<'_, '_> {
    /// Adds the row of one unknown; `None` where the memory is full.
    fn row(&mut self, unknown: usize) -> Option<()> {
        let (facet, side) = self.elements.facet_of(unknown);
        let material = self.scene.material(facet);
        let black = self.scene.diffuse(material).iter().all(|&d| d == 0.0);
        if self.scene.areas().at(facet) == 0.0 || (black && !self.settings.all) {
            self.builder.end_row(Row::default(), Some, Record::join);
            return Some(());
        }
        let normal = self.scene.side_normal(facet, side);
        let cluster = self.elements.is_cluster(unknown);
        if !cluster && opens_to_sky(self.scene, self.bvh, facet, normal) {
            self.builder.end_row(
                Row { state: OPEN, visible_share: 1.0, ..Row::default() },
                Some,
                Record::join,
            );
            return Some(());
        }
        let start = RowRays::new(self.scene, self.elements, unknown);
        let most = self.most_rays(self.elements.area(self.scene, unknown));
        let mut tally = Tally::default();
        let proven = core::mem::take(&mut self.proven);
        let closed = self.closed(&start, normal, most, proven, &mut tally);
        self.proven = proven;
        if !closed? {
            self.sampled(&start, most, &mut tally)?;
        }
        self.end_row(&tally, cluster);
        Some(())
    }

    /// The row by rays alone.
    #[inline(never)]
    fn sampled(&mut self, start: &RowRays, most: u32, tally: &mut Tally) -> Option<()> {
        self.rays(start, (ROW_RAYS_FEWEST.max(most / 16), most), [false; ROW_BINS], None, tally)?;
        let mixed = tally.mixed();
        if self.scene.sides() == 1 && mixed.contains(&true) {
            self.builder.drop_row();
            self.rays(start, (ROW_RAYS_FEWEST.max(most / 16), most), mixed, None, tally)?;
        }
        Some(())
    }

    /// The row with entries in closed form to what nothing hides, and rays for the rest; false where rays alone cost
    /// less, or where parts of the element may lie inside a body.
    // not inlined, as the next: neither enlarges the stack frame of the other
    #[inline(never)]
    fn closed(
        &mut self,
        start: &RowRays,
        normal: Vec3,
        most: u32,
        proven: &mut [u64],
        tally: &mut Tally,
    ) -> Option<bool> {
        if self.settings.directional {
            // what is hidden of a sky that varies has to be known by direction: rays tell that, and the rest with it
            return Some(false);
        }
        let corners = self.elements.corners(self.scene, start.element);
        let receiver = Receiver { facet: start.facet, side: start.side, normal, corners };
        let count = |facet: usize, side: usize| self.elements.unknowns_of(facet, side).count();
        let limit = (2 * most as usize).clamp(CLOSED_FORMS_CHEAP, ROW_CLOSED_FORMS_MOST);
        let possible = ProvenVisible::possible(self.scene, self.plane_sides, &receiver, count);
        if possible == 0 || possible > limit {
            return Some(false);
        }
        let mut clear = ProvenVisible::new(proven);
        clear.all = false;
        if possible <= CLOSED_FORMS_CHEAP {
            clear.all = true;
            clear.prove(self.scene, self.plane_sides, &receiver, limit, count);
        }
        // what is all known needs no rays, and is exact
        if !clear.all {
            if !self.is_worth(start, possible, most, tally)? {
                return Some(false);
            }
            clear.clear();
            clear.prove(self.scene, self.plane_sides, &receiver, limit, count);
        }
        *tally = Tally::default();
        if !clear.all || self.scene.largest_specular() > 0.0 {
            self.rays(start, (ROW_RAYS_FEWEST, most), [false; ROW_BINS], Some(&clear), tally)?;
            if tally.backs.iter().any(|b| *b > 0) {
                self.builder.drop_row();
                return Some(false);
            }
        }
        if clear.elements == 0 {
            self.builder.drop_row();
            return Some(false);
        }
        self.enter(&receiver, &clear, most, tally)
    }

    /// Enters what nothing hides from a receiver in closed form; false, and no row, where that is not sound.
    #[inline]
    fn enter(
        &mut self,
        receiver: &Receiver,
        clear: &ProvenVisible<'_>,
        most: u32,
        tally: &mut Tally,
    ) -> Option<bool> {
        let all = [true; ELEMENT_PARTS];
        let entries = Entries {
            scene: self.scene,
            elements: self.elements,
            builder: &mut self.builder,
            isa: self.bvh.isa(),
            rays: most,
            slopes: slopes(all),
            departures: departures(all),
        };
        entries.add(receiver, self.plane_sides, clear, &mut tally.known)?;
        let sound = tally.known.share() > 0.0 && tally.known.share() <= 1.0 + HEMISPHERE_EXCESS_MOST;
        if !sound {
            self.builder.drop_row();
        }
        Some(sound)
    }

    /// Whether `entries` entries in closed form cost less than the rays that they spare, as far as the first few rays
    /// tell.
    fn is_worth(&mut self, start: &RowRays, entries: usize, most: u32, tally: &mut Tally) -> Option<bool> {
        if entries <= ROW_RAYS_FEWEST as usize {
            return Some(true);
        }
        while tally.rays < ROW_RAYS_FEWEST {
            let count = (ROW_RAYS_FEWEST - tally.rays).min(ROW_RAYS_TOGETHER as u32);
            self.batch(start, tally, count, None)?;
        }
        self.builder.drop_row();
        let wanted = enough(most, tally.rays, f64::from(tally.blocked));
        Some(f64::from(wanted) * CLOSED_FORMS_PER_RAY >= entries as f64)
    }

    /// As many rays as are needed, from the first number up to the second; those that start inside a body in parts named
    /// by `apart` leave no record, nor do the first hits on what is `clear`.
    fn rays(
        &mut self,
        start: &RowRays,
        (fewest, most): (u32, u32),
        apart: [bool; ROW_BINS],
        clear: Option<&ProvenVisible<'_>>,
        tally: &mut Tally,
    ) -> Option<()> {
        *tally = Tally { apart, ..Tally::default() };
        let rho = self.scene.largest_specular();
        let mut goal = fewest.min(most);
        while tally.rays < goal {
            let count = (goal - tally.rays).min(ROW_RAYS_TOGETHER as u32);
            self.batch(start, tally, count, clear)?;
            if tally.rays == goal {
                // what a mirror shows counts with its reflectance
                goal = enough(
                    most,
                    goal,
                    f64::from(tally.blocked) + rho * f64::from(tally.mirrored.iter().flatten().sum::<u32>()),
                );
            }
        }
        Some(())
    }

    /// Rays of an element of area a. The image's mean square error is the sum of a n^-4/3 over all elements; for a
    /// given number of rays it is least where n goes with a^3/7.
    fn most_rays(&self, area: f64) -> u32 {
        let factor =
            clamp(pow(area / self.mean_area, 3.0 / 7.0), AREA_RAYS_FACTOR_LEAST, AREA_RAYS_FACTOR_MOST);
        whole(factor * f64::from(self.settings.rays))
    }

    /// Turns what the parts saw into the row.
    #[inline(never)]
    fn end_row(&mut self, tally: &Tally, cluster: bool) {
        let (exposed, hidden) = tally.exposed();
        let closed = tally.known.share() > 0.0;
        let rays_of =
            |part: usize| (0..ELEMENT_PARTS).map(|bin| exposed.at(part * ELEMENT_PARTS + bin)).sum::<u32>();
        let counts = [0, 1, 2, 3].map(rays_of);
        let seen = counts.iter().sum::<u32>();
        let share = 1.0 / f64::from(tally.rays.max(1));
        // the lesser part of the hemisphere is kept
        let counted = tally.rays - tally.inside.iter().sum::<u32>();
        let enclosed = self.settings.directional
            && !hidden
            && !closed
            && 2 * (tally.blocked + seen).saturating_sub(counted) > seen;
        let dropped = if enclosed { BLOCKED } else { STRAIGHT };
        let stats = Row {
            state: if enclosed { ENCLOSED } else { TRACED },
            rays: tally.rays,
            chain_rays: tally.chain_rays,
            visible_share: match (closed, hidden) {
                (true, _) => 1.0,
                (false, true) => 0.0,
                (false, false) => (f64::from(seen) * share) as f32,
            },
            truncated_weight: tally.truncated_weight * share,
            ..Row::default()
        };
        let open = counts.map(|count| count > 0);
        let (slopes, departures) = if cluster {
            (
                [[0.0; 2]; ELEMENT_PARTS],
                if open == [true; ELEMENT_PARTS] { CLUSTER_DEPARTURES } else { departures(open) },
            )
        } else {
            (slopes(open), departures(open))
        };
        let ending = RowEnding {
            known_scale: tally.known.scale,
            kinds: [0, 1, 2, 3].map(|part| tally.kinds(part)),
            exposed,
            counts,
            all_exposed: seen == tally.rays,
            mean: 1.0 / f64::from(seen.max(1)),
            first_half: (tally.rays / (2 * ELEMENT_PARTS as u32)) as f32,
            dropped,
            slopes,
            departures,
        };
        let finish = |record: Record| ending.finish(record);
        self.builder.end_row(stats, finish, Record::join);
    }

    /// The next `count` rays of a row, which meet their first facets together, and their mirror chains.
    fn batch(
        &mut self,
        start: &RowRays,
        tally: &mut Tally,
        count: u32,
        clear: Option<&ProvenVisible<'_>>,
    ) -> Option<()> {
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::Z); ROW_RAYS_TOGETHER];
        let mut bins = [0; ROW_RAYS_TOGETHER];
        let mut hits = [None; ROW_RAYS_TOGETHER];
        let (rays, hits) = (rays.head_mut(count as usize), hits.head_mut(count as usize));
        for ((number, ray), bin) in (tally.rays..).zip(&mut *rays).zip(&mut bins) {
            (*ray, *bin) = start.ray(self.scene, self.elements, number);
        }
        self.bvh.closest_many(rays, hits);
        for ((ray, &hit), &bin) in rays.iter().zip(&*hits).zip(&bins) {
            self.follow(start, tally, (*ray, hit), bin, clear)?;
            tally.rays += 1;
        }
        Some(())
    }

    /// Adds what ray number `tally.rays` of a row finds: its first hit, which is given, and its mirror chain. `None` where
    /// the memory is full.
    #[inline]
    fn follow(
        &mut self,
        start: &RowRays,
        tally: &mut Tally,
        (ray, met): (Ray, Option<Hit>),
        bin: usize,
        clear: Option<&ProvenVisible<'_>>,
    ) -> Option<()> {
        let index = tally.rays / ELEMENT_PARTS as u32;
        *tally.bins.get_mut(bin)? += 1;
        // stands for the gradient until the row ends
        let mark = [bin as f32, index as f32];
        let Some(hit) = met else {
            return self.builder.push(Record::escape(self.kept(ray.direction), STRAIGHT, 1.0, mark));
        };
        let records = self.builder.used();
        match self.first_hit(start, tally, (&ray, &hit), mark, clear)? {
            Some(arrival) => self.follow_mirrors(start, tally, ray, arrival, records),
            None => Some(()),
        }
    }

    /// Counts the first hit of a ray, and adds the facet where it is not proven visible and entered in closed form. The
    /// inner `None` where the ray ends there: inside a body, or on a black back.
    #[inline]
    fn first_hit(
        &mut self,
        start: &RowRays,
        tally: &mut Tally,
        (ray, hit): (&Ray, &Hit),
        mut mark: [f32; 2],
        clear: Option<&ProvenVisible<'_>>,
    ) -> Option<Option<Arrival>> {
        let (bin, part) = (mark[0] as usize % ROW_BINS, tally.rays as usize % ELEMENT_PARTS);
        let surface = Surface::of_hit(self.scene, hit);
        tally.backs[bin] += u32::from(surface.is_none());
        if tally.apart[bin] && inside(self.bvh, ray, self.scene.side_normal(ray.skip as usize, start.side)) {
            tally.inside[bin] += 1;
            return Some(None);
        }
        let sides = self.scene.sides();
        let known = clear.zip(surface.as_ref()).is_some_and(|(c, s)| c.has(s.facet, s.side, sides));
        if known {
            if let Some(clear) = tally.clear.get_mut(part) {
                *clear += 1;
            }
            let kind = surface.as_ref().and_then(|s| mirror_kind(self.scene.mirror(s.material)));
            if let Some(kind) = kind
                && let Some(rays) = tally.mirrored.get_mut(part).and_then(|all| all.get_mut(kind))
            {
                *rays += 1;
                mark[0] += ((1 + kind) * ROW_BINS) as f32;
            }
        } else {
            tally.blocked += 1;
            self.builder.push(Record::escape(self.kept(ray.direction), BLOCKED, 1.0, mark))?;
        }
        let Some(surface) = surface else { return Some(None) };
        if !known {
            self.add_target(&surface, STRAIGHT, 1.0, mark)?;
        }
        Some(Some(Arrival { surface, mark }))
    }

    /// Follows a ray from mirror to mirror, from its first hit on; `records`: records before those of the ray.
    ///
    /// Eq. (12): each facet m that the chain meets couples to the row by phi prod rho_s, and so does the sky at its end.
    #[inline]
    fn follow_mirrors(
        &mut self,
        start: &RowRays,
        tally: &mut Tally,
        mut ray: Ray,
        arrival: Arrival,
        records: usize,
    ) -> Option<()> {
        let Arrival { mut surface, mark } = arrival;
        let (part, index) = (tally.rays as usize % ELEMENT_PARTS, tally.rays / ELEMENT_PARTS as u32);
        let sequence = &start.sequences[part];
        let (mut path, mut weight) = (STRAIGHT, 1.0);
        loop {
            let depth = self.builder.paths.get(path).depth;
            let Some((next, mirror)) = self.next_mirror(&surface, (path, depth), weight, records, tally)?
            else {
                return Some(());
            };
            let (s, t) = lobe_point(sequence, index, depth);
            let (direction, share) = surface.sample_reflection(self.scene, &mirror, ray.direction, s, t);
            (path, weight) = (next, weight * share);
            ray = surface.spawn_ray(direction);
            tally.chain_rays += 1;
            let Some(hit) = self.bvh.closest(&ray) else {
                return self.builder.push(Record::escape(self.kept(direction), path, weight, mark));
            };
            let Some(next) = Surface::of_hit(self.scene, &hit) else { return Some(()) };
            surface = next;
            self.add_target(&surface, path, weight, mark)?;
        }
    }

    /// The path with the mirror at `surface` added. The inner `None` where the chain ends: there is no mirror, or what
    /// is left of the light is below the cutoff or beyond the largest number of mirrors; that rest is counted, and
    /// added as if the chain went on as it went so far.
    #[inline]
    fn next_mirror(
        &mut self,
        surface: &Surface,
        (path, depth): (u16, u32),
        weight: f64,
        records: usize,
        tally: &mut Tally,
    ) -> Option<Option<(u16, Mirror)>> {
        let Some(mirror) = surface.mirror(self.scene) else { return Some(None) };
        if depth >= self.settings.mirrors {
            let rho = self.scene.specular(surface.material).iter().fold(0.0, |a, &b| f64::max(a, b));
            let rest = weight * self.builder.paths.largest(path) * rho;
            tally.truncated_weight += rest;
            if depth as usize >= MIRRORS_MOST {
                self.builder.close(records, rest);
            }
            return Some(None);
        }
        let next = match self.builder.extend_path(path, mirror.class, self.scene) {
            Ok(next) => next,
            Err(true) => {
                tally.truncated_weight += weight * self.builder.paths.largest(path);
                return Some(None);
            }
            Err(false) => return None,
        };
        let rest = weight * self.builder.paths.largest(next);
        if rest < self.settings.cutoff {
            tally.truncated_weight += rest;
            self.builder.close(records, rest);
            return Some(None);
        }
        Some(Some((next, mirror)))
    }

    /// Adds a facet that emits or reflects diffusely, seen along a path.
    #[inline]
    fn add_target(&mut self, surface: &Surface, path: u16, weight: f64, mark: [f32; 2]) -> Option<()> {
        if !self.scene.glows(surface.material) {
            return Some(());
        }
        let target = self.elements.locate(surface.facet, surface.side, surface.u, surface.v);
        self.builder.push(Record::target(target, path, weight, mark))
    }

    fn kept(&self, direction: Vec3) -> Option<Vec3> {
        self.settings.directional.then_some(direction)
    }
}

/// The first hit of a ray, from which mirrors may send it on.
struct Arrival {
    surface: Surface,
    /// What stands for the gradient of the ray's records until the row ends: the bin, and the kind of mirror where the facet
    /// is proven visible; the ray's number in its part.
    mark: [f32; 2],
}

/// Rays that a row needs when `blocked` of its first `rays` met something: the error goes with the square root of
/// the variance and with n^-3/4. The variance of the blocked share p is p (1 - p); where half the rays or more meet
/// facets, it is which facets they meet that counts, and the variance is taken at its largest, 1/4.
fn enough(most: u32, rays: u32, blocked: f64) -> u32 {
    // one ray more may have met something
    let p = ((blocked + 1.0) / (f64::from(rays) + 1.0)).min(0.5);
    let wanted = pow(4.0 * p * (1.0 - p), 2.0 / 3.0) * f64::from(most);
    let mut goal = rays;
    while f64::from(goal) < wanted && goal < most {
        goal *= 2;
    }
    goal
}

/// The pair of coordinates that chooses the ray of the lobe number `depth` of a chain: the sequence's own pair
/// for the first, rotated by an irrational step for later ones.
#[inline(always)]
pub fn lobe_point(sequence: &Sequence, index: u32, depth: u32) -> (f64, f64) {
    let (s, t) = sequence.pair(index, 4);
    let turn = |x: f64, step: f64| {
        let y = x + step * f64::from(depth);
        y - crate::base::math::floor(y)
    };
    (turn(s, 0.754_877_666_246_693), turn(t, 0.569_840_290_998_053))
}
