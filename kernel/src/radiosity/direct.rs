//! Direct light of each element: irradiance by sky and sun before any diffuse reflection, straight and by way of
//! mirrors. It is the right-hand side of eq. (12).
//!
//! Nothing here traces sky rays: the coupling kept which part of each hemisphere is blocked and where mirror
//! chains escape. The sun needs rays: shadows, and beams that flat and glossy mirrors reflect.
//!
//! Constants of this file are measured by `cargo test --test sun` (shares in shadow) and `cargo bench --bench counts`
//! (instructions).

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy, pieces, span};
use crate::base::math::{PI, Vec3};
use crate::base::qmc::{Sequence, hash2, triangle};
use crate::base::simd::{self, Isa, LaneTask, Lanes};
use crate::coupling::element::Elements;
use crate::coupling::mirror_path::STRAIGHT;
use crate::coupling::{ABSENT, BLOCKED, Coupling, ENCLOSED, OPEN, RowView};
use crate::radiosity::straight::{self, Blocked, Straight};
use crate::rays::bvh::Bvh;
use crate::rays::ray::Ray;
use crate::rays::surface::Surface;
use crate::scene::sky::Sky;
use crate::scene::sun::Sun;
use crate::scene::{MAX_BANDS, Scene};
use core::ops::Range;

/// Shape of the tables that hold irradiances: for each unknown, each level and each of mean and two gradients,
/// one value per band. Level l counts light reflected at most l times; one level alone counts all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableShape {
    /// Levels: 1, or `max_bounces` + 1.
    pub levels: usize,
    /// Spectral bands.
    pub bands: usize,
}

impl TableShape {
    /// Values of one unknown.
    #[inline(always)]
    pub fn stride(self) -> usize {
        self.levels * 3 * self.bands
    }

    /// Where a level's values of an unknown stand in the table: mean, first gradient, second gradient.
    #[inline(always)]
    pub fn at(self, unknown: usize, level: usize) -> Range<usize> {
        let start = unknown * self.stride() + level * 3 * self.bands;
        start..start + 3 * self.bands
    }

    /// True when light of `depth` reflections counts on `level`.
    #[inline(always)]
    pub fn counts(self, depth: u32, level: usize) -> bool {
        self.levels == 1 || depth as usize <= level
    }
}

/// Irradiance by the sky on the sides of the elements in `range`, straight and by way of mirrors, written to
/// `out` (the part of the table that belongs to the range).
///
/// The unobstructed irradiance of the facet's plane, less what is blocked, plus what mirrors bring (where most is
/// blocked, the sum over what is open): facets that nothing blocks get it to `relative_error`, and in a uniform sky the
/// sum over targets and sky is exact.
///
/// # Errors
/// [`Error::Length`] for a table of the wrong size; [`Error::Mismatch`] where the sky is not uniform and the
/// coupling kept no directions.
#[expect(
    clippy::too_many_arguments,
    reason = "each is a stage's result or a range of it, as in the other stages"
)]
pub fn sky_rows(
    scene: &Scene<'_>,
    elements: &Elements<'_>,
    coupling: &Coupling<'_>,
    (sky, straight): (&Sky<'_>, &Straight<'_>),
    relative_error: f64,
    range: Range<usize>,
    shape: TableShape,
    out: &mut [f64],
) -> Result<(), Error> {
    let expected = span(&range) * shape.stride();
    if out.len() != expected {
        return Err(Error::Length { what: "irradiance table", expected, given: out.len() });
    }
    if !sky.is_uniform() && !coupling.is_directional() {
        return Err(Error::Mismatch { what: "coupling without directions" });
    }
    simd::run_lanes(
        Isa::detect(),
        SkyRows { scene, elements, coupling, sky, straight, relative_error, range, shape, out },
    );
    Ok(())
}

/// [`sky_rows`] at work.
struct SkyRows<'a, 'o> {
    scene: &'a Scene<'a>,
    elements: &'a Elements<'a>,
    coupling: &'a Coupling<'a>,
    sky: &'a Sky<'a>,
    straight: &'a Straight<'a>,
    relative_error: f64,
    range: Range<usize>,
    shape: TableShape,
    out: &'o mut [f64],
}

impl LaneTask for SkyRows<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let SkyRows { scene, elements, coupling, sky, straight, relative_error, range, shape, out } = self;
        let bands = shape.bands.clamp(1, MAX_BANDS);
        let (mut unobstructed, mut sum) = ([0.0; MAX_BANDS], [0.0; MAX_BANDS]);
        let (unobstructed, sum) = (unobstructed.head_mut(bands), sum.head_mut(bands));
        let mut of = None;
        for ((unknown, row), values) in coupling.rows(range).zip(pieces(out, shape.stride())) {
            values.fill(0.0);
            if row.row.state == ABSENT {
                continue;
            }
            let known = straight.of(unknown, bands);
            if let Some((known, _)) = known {
                pieces(values, 3 * bands).for_each(|part| copy(part, known));
            } else if row.row.state != ENCLOSED {
                let own = elements.facet_of(unknown);
                if of != Some(own) {
                    straight::whole_sky((scene, elements), (sky, relative_error), unknown, &[], unobstructed);
                    of = Some(own);
                }
                pieces(values, 3 * bands).for_each(|part| copy(part, unobstructed));
            }
            let scale = known.map(|_| straight.scale(unknown, bands, &row.row));
            let blocked = straight.blocked(unknown, bands, &row);
            add_escapes(&row, (sky, scale, blocked), lanes, shape, sum, values);
            let means = pieces(values, 3 * bands).flat_map(|part| part.head_mut(bands));
            means.for_each(|e| *e = e.max(0.0));
        }
    }
}

/// Takes off what is blocked or adds what is open, where no `scale` says that it is known, and adds what escapes by way
/// of mirrors; `sum` has room for a value of each band.
#[inline(always)]
fn add_escapes<L: Lanes>(
    row: &RowView<'_>,
    (sky, scale, blocked): (&Sky<'_>, Option<f64>, Option<Blocked>),
    lanes: L,
    shape: TableShape,
    sum: &mut [f64],
    values: &mut [f64],
) {
    let bands = sum.len();
    for bundle in row.escapes {
        if scale.is_some() && matches!(bundle.path, BLOCKED | STRAIGHT) {
            continue;
        }
        sky.sum(lanes, bundle.packed, sum);
        let pi = PI * scale.unwrap_or(1.0);
        match bundle.path {
            BLOCKED => sum.iter_mut().for_each(|l| *l *= -PI),
            path => sum.iter_mut().zip(row.products(path)).for_each(|(l, product)| *l *= pi * product),
        }
        let depth = row.depth(bundle.path);
        let [mut a, mut b] = bundle.gradient.map(f64::from);
        if let Some(([whole, ..], short)) = blocked {
            // as much as it fills of what is blocked
            let share = bundle.weight / whole;
            (a, b) = (a + share * short[0], b + share * short[1]);
        }
        for (_, part) in
            pieces(values, 3 * bands).enumerate().filter(|(level, _)| shape.counts(depth, *level))
        {
            for (part, factor) in pieces(part, bands).zip([bundle.weight, a, b]) {
                part.iter_mut().zip(&*sum).for_each(|(to, l)| *to += l * factor);
            }
        }
    }
}

/// Points of an element at which the sun is tested first: where all agree, they are enough.
const SUN_POINTS_LEAST: u32 = 16;

/// Points of an element partly in shadow at which the sun is tested: its share is wrong by about 128^-3/4 = 2.6 %.
const SUN_POINTS_MOST: u32 = 128;

/// Rays toward the sun that are traced together: they wait on the stack, which is small where there is no standard library.
const SUN_BATCH: usize = if cfg!(feature = "std") { 32 } else { 8 };

/// Mean of cos(theta_sun) V over each element side of `range`: the share of the sun's normal irradiance that arrives
/// straight, 1; of an element partly inside a body, the mean over the rest of it. Returns the rays traced.
///
/// Rows that the coupling left out get 0. The error is 0 for elements in full light or shadow, and about 2.6 % of the cosine
/// at 128 points for others.
pub fn sun_rows(
    scene: &Scene<'_>,
    bvh: &Bvh<'_>,
    elements: &Elements<'_>,
    coupling: &Coupling<'_>,
    sun: &Sun<'_>,
    range: Range<usize>,
    out: &mut [f64],
) -> Result<u64, Error> {
    if out.len() != span(&range) {
        return Err(Error::Length { what: "sun table", expected: span(&range), given: out.len() });
    }
    let toward = [Ray::new(Vec3::ZERO, Vec3::Z); SUN_BATCH];
    let mut probe =
        SunProbe { scene, bvh, elements, sun, toward, shares: [0.0; SUN_BATCH], hidden: [false; SUN_BATCH] };
    let mut rays = 0;
    for ((unknown, row), value) in coupling.rows(range).zip(out) {
        let (facet, side) = elements.facet_of(unknown);
        let cluster = elements.is_cluster(unknown);
        let cosine = sun.cosine(scene.side_normal(facet, side));
        *value = 0.0;
        if row.row.state == ABSENT || (cosine <= 0.0 && !cluster) {
            continue;
        }
        if row.row.state == OPEN {
            *value = cosine;
            continue;
        }
        let lit = probe.lit(unknown);
        rays += u64::from(lit.count);
        // each of a cluster's facets has its own cosine
        let cosine = if cluster { lit.cosine } else { cosine };
        let visible_share = f64::from(row.row.visible_share);
        // inside a body: what falls there matters to nothing
        *value = if visible_share > 0.0 { cosine * (lit.share / visible_share).min(1.0) } else { 0.0 };
    }
    Ok(rays)
}

/// Share of the sun that an element sees.
struct Lit {
    /// Share of the sun's light that nothing hides, the mean over its points.
    share: f64,
    /// Mean of max(0, cos) of the sun over its points.
    cosine: f64,
    /// Points.
    count: u32,
}

/// Tests which share of the sun elements see, with room for the rays that are traced together.
struct SunProbe<'a> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    elements: &'a Elements<'a>,
    sun: &'a Sun<'a>,
    toward: [Ray; SUN_BATCH],
    /// Share of the disc that each ray stands for.
    shares: [f64; SUN_BATCH],
    hidden: [bool; SUN_BATCH],
}

impl SunProbe<'_> {
    /// How much of the sun an unknown sees, by its points.
    fn lit(&mut self, unknown: usize) -> Lit {
        let sequence = Sequence::new(hash2(unknown as u32, 0x0500_0000));
        let (mut lit, mut all, mut count, mut goal) = (0.0, 0.0, 0, SUN_POINTS_LEAST);
        while count < goal {
            let batch = (goal - count).min(SUN_BATCH as u32);
            let kept = self.aim(unknown, &sequence, count..count + batch);
            self.bvh.occluded_many(self.toward.head(kept), self.hidden.head_mut(kept));
            for (share, hidden) in self.shares.head(kept).iter().zip(&self.hidden) {
                all += share;
                lit += if *hidden { 0.0 } else { *share };
            }
            count += batch;
            if count == SUN_POINTS_LEAST && lit != 0.0 && lit != all {
                goal = SUN_POINTS_MOST;
            }
        }
        let share = if all > 0.0 { lit / all } else { 0.0 };
        Lit { share, cosine: all / f64::from(count.max(1)), count }
    }

    /// Rays from points of an unknown toward the sun, those of `numbers` that leave it; returns how many.
    fn aim(&mut self, unknown: usize, sequence: &Sequence, numbers: Range<u32>) -> usize {
        let SunProbe { scene, elements, sun, toward, shares, .. } = self;
        let (_, side) = elements.facet_of(unknown);
        let mut kept = 0;
        for n in numbers {
            let (p, q) = sequence.pair(n, 0);
            let (a, b) = triangle(p, q);
            let (facet, u, v) = elements.place(unknown / scene.sides().max(1), a, b);
            let (s, t) = sequence.pair(n, 2);
            let from = Surface::new(scene, facet, side, u, v);
            let ray = from.spawn_ray(sun.sample(s, t));
            let share = sun.share(ray.direction, from.normal);
            if share > 0.0 {
                toward.set(kept, ray);
                shares.set(kept, share);
                kept += 1;
            }
        }
        kept
    }
}

/// Adds irradiances (`bands` values an unknown) to the means in a table of one level.
pub fn add(irradiance: &[f64], shape: TableShape, table: &mut [f64]) {
    for (unknown, to) in pieces(table, shape.stride()).enumerate() {
        let from = irradiance.part(unknown * shape.bands..(unknown + 1) * shape.bands);
        to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
    }
}
