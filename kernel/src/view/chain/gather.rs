//! Final gathering: the irradiance at a point by rays from it, where the linear function over its element is not
//! accurate enough. That is beside contacts, in corners that rows sample too coarsely, on elements as large as their
//! mesh.
//!
//! Rays are cosine-distributed and carry the solved radiances of the facets that they meet, straight or by way of
//! mirrors. They come in sets, each as large as all before, until the parts of them agree. The error of n rays whose
//! radiance has the standard deviation s is about s n^-3/4. Where facets hide little of the sky, its irradiance is the
//! exact one of the plane less the hidden part.
//!
//! Where a ray is short beside the element that it meets, the element's linear function is not accurate there either:
//! beside contact lines, where a body is pierced by another. The ray goes on diffusely from there, as a path, until it
//! is not.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors beside estimates).

use super::fronts::{Facing, Fronts};
use super::straight::KeptSkies;
use super::{DetailCache, Mode, OpenAt, Path, PathState, RaySample, SIGNS, Solved, Terms, held, sign};
use crate::base::arena::plain_table;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{PI, Vec3, clamp, fabs, frame, pow, sqrt};
use crate::base::qmc::{Sequence, cosine_direction, hash2};
use crate::coupling::element::Local;
use crate::radiosity::straight::BLOCKED_ROUNDING;
use crate::rays::ray::Ray;
use crate::rays::surface::Surface;
use crate::scene::{MAX_BANDS, Scene};

/// Whether final gathering is available: not where stack and memory are small.
pub(crate) const GATHERS: bool = cfg!(feature = "std");

/// Number of bands for which final gathering has room.
pub(super) const BANDS: usize = if GATHERS { MAX_BANDS } else { 0 };

/// Factor on the expected error of elements in estimates of images: the 95 % quantile of the true error over what rows'
/// halves and quarters tell. A few elements may carry an image's error.
///
/// Measured by `cargo run --release --example calibrate`.
pub(crate) const CAUTION: f64 = 1.9;

/// Fewest rays from a point whose straight sky is known: they find reflected light alone.
pub(super) const GATHER_RAYS_FEWEST: f64 = 32.0;

/// Fewest rays from a point that find the sky, too: fewer may all miss a small bright part of it.
const GATHER_SKY_RAYS_FEWEST: f64 = 128.0;

/// Most rays from a point: its sequence has 2^16 points.
const GATHER_RAYS_MOST: f64 = 65536.0;

/// Fewest rays from a point, as a factor on [`usual_rays`] at the standard deviation that is expected there.
const GATHER_RAYS_FACTOR_LEAST: f64 = 0.25;

/// Most rays from a point, as a factor on [`usual_rays`]: beyond, more rays bring less than finer elements would.
const GATHER_RAYS_FACTOR_MOST: f64 = 4.0;

/// Number of sets into which the rays from a point are divided; the differences between them tell the error of the
/// mean.
const GATHER_SETS: usize = 8;

/// Least share of the wanted error of a point that is left to rays: where elements leave more than all, only finer ones help.
const GATHER_GOAL_SHARE_LEAST: f64 = 0.8;

/// Largest axis ratio of lobes in a scene in whose reflected sunlight points still gather: what narrower lobes reflect
/// of the sun, few rays meet.
const GATHER_LOBE_RATIO_MOST: f64 = 20.0;

/// Factor on the squared error that the differences between the [`GATHER_SETS`] tell. They underestimate it where a
/// small bright or dark object is met by few rays. Measured by `cargo run --release --example calibrate`.
const GATHER_ERROR_FACTOR2: f64 = 3.4;

/// [`GATHER_ERROR_FACTOR2`] where the blocked share is not known: how often rays are blocked is then part of the differences.
const GATHER_SKY_ERROR_FACTOR2: f64 = 2.4;

/// Variance of the mean that independent sets would have by their differences, over that of the stratified sets: the
/// root of [`GATHER_SETS`] where errors go with n^-3/4.
///
/// Measured as 3.5 in stairs, fins and nested boxes of reflectance 0.5 to 0.8.
const GATHER_STRATIFIED: f64 = 2.83;

/// Largest ratio of the root of an element's area to the length of the ray that meets it, at which its linear function
/// is used; above it the ray goes on diffusely.
const ONWARD_SIZE_MOST: f64 = 1.0;

/// Expected error of an element's radiance from which on rays go on from it, in wanted errors of the image's irradiance over
/// pi. Measured by `cargo run --release --example calibrate`.
const ONWARD_ERROR_LEAST: f64 = 1.0;

/// Most times that a ray goes on diffusely: in a corner half of the light does each time.
const MOST_ONWARD: u32 = 8;

/// Squared error that the errors of the elements met leave in the mean of the rays, over the square of the mean of
/// their expected errors with signs of their own. A part of each error is what a linear function leaves out, which
/// cancels within an element. Measured by `cargo run --release --example calibrate`.
const CARRIED_MIXED: f64 = 0.7;

/// Squared error that the errors of the elements met leave in the mean of the rays, over the square of the mean of
/// their expected errors with one sign: linear functions over coarse elements leave out alike in a cavity.
///
/// Measured as 0.7 in nested boxes of 378 elements, 0.2 to 0.4 in fins and stairs.
const CARRIED_COHERENT: f64 = 0.4;

/// Number of elements of one pixel whose corrections are kept.
pub(super) const PIXEL_ELEMENTS_KEPT: usize = if GATHERS { 8 } else { 0 };

plain_table! {
    /// Memory of final gathering, of any content; [`Gathered::start`] and [`Gathered::forget`] come first.
    pub struct Gathered {
        /// Terms of the latest ray.
        pub terms: [Terms; GATHERS as usize],
        /// Product of the reflectances along the latest ray, one value per band.
        pub throughput: [[f64; MAX_BANDS]; GATHERS as usize],
        /// Product of the reflectances from where it goes on diffusely.
        pub onward: [[f64; MAX_BANDS]; GATHERS as usize],
        /// Radiance of the sky in its direction.
        pub sky: [f64; BANDS],
        /// Sums over the rays of each set: their radiance less that of the sky that they would see were nothing in
        /// their way.
        pub beyond: [[f64; BANDS]; GATHER_SETS],
        /// Sums over the rays of each set: radiance of the sky that they would see were nothing in their way.
        pub open: [[f64; BANDS]; GATHER_SETS],
        /// By how much the elements that were gathered on differ from their linear functions.
        pub corrections: [[f64; BANDS]; PIXEL_ELEMENTS_KEPT],
        /// Expected squared errors of the irradiance over pi that are left.
        pub errors: [f64; PIXEL_ELEMENTS_KEPT],
        /// The unknowns.
        pub unknowns: [u64; PIXEL_ELEMENTS_KEPT],
        /// Sums of the expected errors of what the rays met, with each set of signs.
        pub carried: [f64; SIGNS],
        /// Sums over the rays of each set: 1 where a ray met something, less the elements with closed forms that it crossed.
        pub counts: [f64; GATHER_SETS],
        /// What that is on the mean, which is known without rays: the blocked share less what those elements would fill.
        pub balance: f64,
        /// Whether it is known.
        pub balanced: u64,
        /// Radiance of what rays meet, summed over them; and where none does, what the element expects of it.
        pub met: [f64; BANDS],
        pub usual: [f64; BANDS],
        /// What the elements that face the point bring it, irradiance over pi, where closed forms are used
        /// ([`Gathered::closed`]).
        pub known: [f64; BANDS],
        /// Whether they are: then rays find the difference.
        pub closed: u64,
        /// Rays that met something.
        pub hits: u64,
        /// How many there are.
        pub count: u64,
        /// The straight sky at points of elements.
        pub skies: KeptSkies,
        /// Surroundings of the latest element; none at first.
        pub details: DetailCache,
    }
}

impl Gathered {
    /// All zero.
    pub const ZERO: Gathered = Gathered {
        terms: [Terms::ZERO; GATHERS as usize],
        throughput: [[0.0; MAX_BANDS]; GATHERS as usize],
        onward: [[0.0; MAX_BANDS]; GATHERS as usize],
        sky: [0.0; BANDS],
        beyond: [[0.0; BANDS]; GATHER_SETS],
        open: [[0.0; BANDS]; GATHER_SETS],
        corrections: [[0.0; BANDS]; PIXEL_ELEMENTS_KEPT],
        errors: [0.0; PIXEL_ELEMENTS_KEPT],
        unknowns: [0; PIXEL_ELEMENTS_KEPT],
        carried: [0.0; SIGNS],
        counts: [0.0; GATHER_SETS],
        balance: 0.0,
        balanced: 0,
        met: [0.0; BANDS],
        usual: [0.0; BANDS],
        known: [0.0; BANDS],
        closed: 0,
        hits: 0,
        count: 0,
        skies: KeptSkies::ZERO,
        details: DetailCache::ZERO,
    };

    /// Another image begins.
    pub(crate) fn start(&mut self) {
        self.details = DetailCache::ZERO;
    }

    /// Another pixel begins.
    #[inline]
    pub fn forget(&mut self) {
        self.count = 0;
        self.skies.count = 0;
    }

    /// Whether final gathering was used on no element of the pixel yet.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Where the correction of an unknown stands.
    fn find(&self, unknown: usize) -> Option<usize> {
        find(&self.unknowns, self.count, unknown)
    }

    /// Factor on the squared error that differences tell.
    fn factor2(&self) -> f64 {
        if self.balanced > 0 { GATHER_ERROR_FACTOR2 } else { GATHER_SKY_ERROR_FACTOR2 }
    }

    /// Mean radiance of what rays meet: what they miss or meet too often of the blocked share has it, too.
    fn level(&self, band: usize) -> f64 {
        match (self.balanced, self.hits) {
            (0, _) => 0.0,
            (_, 0) => self.usual.at(band),
            (_, hits) => self.met.at(band) / hits as f64,
        }
    }

    /// Mean of one band over all of `rays` rays, with the exact sky or with theirs, and the square of its expected error.
    fn mean(&self, band: usize, rays: u32, exact: bool) -> (f64, f64) {
        let each = f64::from(rays) / GATHER_SETS as f64;
        let (open, level) = (if exact { 0.0 } else { 1.0 }, self.level(band));
        let of = |part: usize| {
            let [beyond, open_sky] =
                [&self.beyond, &self.open].map(|sums| sums.get(part).map_or(0.0, |p| p.at(band)));
            (beyond + open * open_sky - level * self.counts.at(part)) / each
        };
        let mean = (0..GATHER_SETS).map(of).sum::<f64>() / GATHER_SETS as f64;
        let squares = (0..GATHER_SETS).map(|part| (of(part) - mean) * (of(part) - mean)).sum::<f64>();
        let variance = squares / (GATHER_STRATIFIED * (GATHER_SETS * (GATHER_SETS - 1)) as f64);
        (mean + level * self.balance + self.known.at(band), variance)
    }

    /// The square of the expected error of all bands, relative to the reference, the largest.
    fn error(&self, reference: &[f64], rays: u32, exact: bool) -> f64 {
        let bands = reference.iter().enumerate().filter(|(_, r)| **r > 0.0);
        bands.map(|(band, r)| self.mean(band, rays, exact).1 / (r * r)).fold(0.0, f64::max)
    }

    /// Two parts each become one, and make room for two new ones.
    fn halve(&mut self) {
        for sums in [&mut self.beyond, &mut self.open] {
            for part in 0..GATHER_SETS {
                let [a, b] =
                    [2 * part, 2 * part + 1].map(|from| sums.get(from).copied().unwrap_or([0.0; BANDS]));
                let to = sums.get_mut(part).into_iter().flatten();
                to.zip(a.iter().zip(&b)).for_each(|(to, (a, b))| *to = a + b);
            }
        }
        for part in 0..GATHER_SETS {
            let [a, b] = [2 * part, 2 * part + 1].map(|from| self.counts.get(from).copied().unwrap_or(0.0));
            self.counts.set(part, a + b);
        }
    }
}

/// Where an unknown stands among the first `count` that are kept of a pixel.
pub(super) fn find(unknowns: &[u64; PIXEL_ELEMENTS_KEPT], count: u64, unknown: usize) -> Option<usize> {
    unknowns.iter().take(count as usize).position(|own| *own == unknown as u64)
}

/// Rays that settle what arrives at a point to an irradiance over pi of `tolerance` where half of a hemisphere is bright.
pub(super) fn usual_rays(tolerance: f64) -> f64 {
    pow(0.8 / tolerance, 4.0 / 3.0)
}

/// Least standard deviation of a ray that is expected, over that where half of a hemisphere is bright.
const RAY_SPREAD_LEAST: f64 = 1e-3;

/// Largest standard deviation of a ray that is expected, over that where half of a hemisphere is bright.
const RAY_SPREAD_MOST: f64 = 1.0;

/// Factor on the standard deviation of the radiance met where the sun shines, over that under the sky alone: places in
/// its light are few and bright. Measured by `cargo run --release --example calibrate`.
const SUNLIT_SPREAD: f64 = 2.5;

/// Least ratio of the standard deviation of the radiance met to its mean that is expected, on the scale of
/// [`RAY_SPREAD_MOST`].
const LEAST_VARIED: f64 = 0.3;

/// Largest radiance that what is met is expected to have on the mean, relative to the reference radiance: the sun's disc,
/// lamps and highlights are far brighter, and fill little.
const USUAL_MOST: f64 = 2.0;

/// Radiance that is expected of what an element has not met, over the largest that is.
const NOTHING_KNOWN: f64 = 0.15;

/// Standard deviation of the radiance met over its mean, on the scale of [`RAY_SPREAD_MOST`].
const RADIANCE_VARIED: f64 = 0.8;

/// Standard deviation of a ray over that where half of a hemisphere is bright, for this irradiance over pi of what is
/// met: of three tenths of the hemisphere.
pub(super) fn spread(reflected: f64) -> f64 {
    clamp(3.0 * reflected, RAY_SPREAD_LEAST, RAY_SPREAD_MOST)
}

/// Where a ray from a point goes on diffusely.
pub(super) struct Onward<'w> {
    /// Product of the reflectances up to there.
    throughput: &'w mut [f64; MAX_BANDS],
    /// The next ray, once it is known.
    ray: Option<Ray>,
    /// Reflections before it.
    bounces: u32,
    /// How often it went on before.
    depth: u32,
    /// Expected error of an element's radiance up to which its linear function serves, relative to the reference radiance.
    most: f64,
}

/// A point at which the irradiance is gathered.
pub(super) struct GatherPoint<'a> {
    pub surface: &'a Surface,
    pub unknown: usize,
    /// Irradiance of its element, mean and gradients, and where on it the point is.
    pub values: &'a [f64],
    pub local: Local,
    /// Weight of the point in the image.
    pub weight: f64,
    /// Reflections between it and the eye.
    pub bounces: u32,
    /// The straight sky, where it is known: then rays find the rest alone.
    pub open: Option<&'a OpenAt<'a>>,
}

/// Whether rays from points find the sunlight that mirrors reflect beside its images.
pub(crate) fn finds_thrown_sun(scene: &Scene<'_>) -> bool {
    let mut materials = 0..scene.materials();
    scene.largest_specular() == 0.0
        || !scene.is_smooth()
            && materials.all(|m| scene.gloss(m).is_none_or(|ratio| ratio <= GATHER_LOBE_RATIO_MOST))
}

impl Solved<'_> {
    /// By which number what is found at a point serves others of its pixel: its element's, or its facet's in a cluster, whose
    /// facets see another sky each.
    #[inline]
    pub(super) fn pixel_key(&self, surface: &Surface, unknown: usize) -> usize {
        if self.elements.is_cluster(unknown) {
            self.elements.unknowns() + surface.facet * self.scene.sides() + surface.side
        } else {
            unknown
        }
    }

    /// Whether what is expected of an unknown's error is too much, and rays from a point find all light that its irradiance
    /// holds: not the sunlight that narrow lobes and curved mirrors reflect, nor flat ones where there are too many.
    #[inline]
    pub(super) fn wants_rays(&self, surface: &Surface, weight: f64, variance: f64) -> bool {
        let most = self.settings.gather * self.settings.budget.image;
        self.gathers()
            && weight * weight * variance > most * most
            && (self.light.sun.is_none() || finds_thrown_sun(self.scene) && self.knows_images(surface))
    }

    /// Whether any point may want rays.
    #[inline]
    pub(crate) fn gathers(&self) -> bool {
        GATHERS
    }

    pub(super) fn knows_images(&self, surface: &Surface) -> bool {
        let side = self.elements.kept_side(surface.facet, surface.side);
        self.images.are_known(side)
    }

    /// By how much the irradiance at a point differs from its element's, one value a band, and the expected squared error
    /// that is left of irradiance over pi. What the sun brings straight or by way of flat mirrors is no part of it. Points
    /// of one element in one pixel have the same correction.
    #[inline(never)]
    pub(super) fn gather<'g>(
        &self,
        gather_point: &GatherPoint<'_>,
        images: &mut [[f64; MAX_BANDS]; 2],
        gathered: &'g mut Gathered,
        mode: &mut Mode<'_, '_>,
        path: &mut Path,
    ) -> Option<(&'g [f64], f64)> {
        let key = self.pixel_key(gather_point.surface, gather_point.unknown);
        let place = match gathered.find(key) {
            Some(place) => place,
            None => {
                let place = gathered.count as usize;
                if place >= PIXEL_ELEMENTS_KEPT {
                    return None;
                }
                let (exact, rays) = self.trace(gather_point, images, gathered, mode, path)?;
                let error = self.store_correction(gather_point, gathered, place, exact, rays);
                gathered.errors.set(place, error);
                gathered.unknowns.set(place, key as u64);
                gathered.count = place as u64 + 1;
                place
            }
        };
        Some((gathered.corrections.get(place)?, gathered.errors.at(place)))
    }

    /// Traces rays from a point until their parts agree; whether the exact sky serves better than theirs, and their number.
    fn trace(
        &self,
        gather_point: &GatherPoint<'_>,
        images: &mut [[f64; MAX_BANDS]; 2],
        gathered: &mut Gathered,
        mode: &mut Mode<'_, '_>,
        path: &mut Path,
    ) -> Option<(bool, u32)> {
        // by where on its facet the point is, to some digits: a mesh that is moved keeps its rays
        let Surface { facet, side, u, v, .. } = *gather_point.surface;
        let [u, v] = [u, v].map(|x| (x * 65536.0) as u32);
        let seed = hash2((facet * 2 + side) as u32, hash2(u, v));
        let sequence = Sequence::new(seed);
        let axes = frame(gather_point.surface.normal);
        let tolerance = self.settings.budget.image / gather_point.weight;
        let fewest = if gather_point.open.is_some() { GATHER_RAYS_FEWEST } else { GATHER_SKY_RAYS_FEWEST };
        let least = |facing: Option<&Facing>| {
            let rays = usual_rays(tolerance / self.spread_at(gather_point, facing));
            clamp(GATHER_RAYS_FACTOR_LEAST * rays, fewest, GATHER_RAYS_MOST)
        };
        let facing = self.facing(gather_point, least(None), &mut mode.occluders.fronts);
        self.expect(gather_point, facing.as_ref(), gathered);
        let goal = self.goal(tolerance, facing.as_ref()) / gathered.factor2();
        let least = least(facing.as_ref());
        let most = clamp(GATHER_RAYS_FACTOR_MOST * usual_rays(tolerance), fewest, GATHER_RAYS_MOST) as u32;
        gathered.beyond.iter_mut().chain(&mut gathered.open).for_each(|sums| sums.fill(0.0));
        gathered.sky.fill(0.0);
        gathered.carried = [0.0; SIGNS];
        gathered.hits = 0;
        // fewer may all miss what little is bright, and agree
        let (mut done, mut rays) = (0, (least as u32).next_power_of_two());
        loop {
            for index in done..rays {
                let (p, q) = sequence.pair(index, 0);
                let (a, b, c) = cosine_direction(p, q);
                let direction = axes.0 * a + axes.1 * b + gather_point.surface.normal * c;
                let part = (u64::from(index) * GATHER_SETS as u64 / u64::from(rays)) as usize;
                let sample = RaySample::Stratum { seed, index };
                let occluders = &mut *mode.occluders;
                let mut mode = Mode { sample, occluders, branches: false, importance: None };
                self.add_direction((gather_point, direction), part, images, gathered, &mut mode, path)?;
            }
            let [exact, plain] = [true, false].map(|exact| gathered.error(self.reference, rays, exact));
            if exact.min(plain) <= goal || 2 * rays > most {
                if let Some(facing) = &facing {
                    let signed = gathered.carried.iter_mut().zip(facing.signed);
                    signed.for_each(|(sum, error)| *sum += f64::from(rays) * error);
                }
                return Some((exact <= plain, rays));
            }
            gathered.halve();
            (done, rays) = (rays, 2 * rays);
        }
    }

    /// Expected squared error that rays may leave at a point of this wanted error: what the elements that it sees do not.
    fn goal(&self, tolerance: f64, facing: Option<&Facing>) -> f64 {
        let all = self.settings.budget.gathering_rays * tolerance;
        let least = GATHER_GOAL_SHARE_LEAST * all;
        (all * all - facing.map_or(0.0, |facing| carried(facing.signed))).max(least * least)
    }

    /// What all elements bring the point by closed forms, where that costs less than `rays` rays.
    fn facing(&self, gather_point: &GatherPoint<'_>, rays: f64, fronts: &mut Fronts<'_>) -> Option<Facing> {
        let elements = fronts.of(self, gather_point.unknown, rays)?;
        let Surface { point, normal, .. } = *gather_point.surface;
        Some(elements.facing(self.bvh.isa(), (point, normal), self.shape.bands))
    }

    /// Mean radiance of what is met, by the element's linear function.
    fn usual(&self, gather_point: &GatherPoint<'_>, band: usize) -> f64 {
        let GatherPoint { values, local, open, .. } = *gather_point;
        let brightest = self.numbers.brightest.min(USUAL_MOST) * self.reference.at(band);
        let filled = open.map_or(1.0, |open| open.ratio * open.by_element);
        if filled < BLOCKED_ROUNDING {
            return NOTHING_KNOWN * brightest;
        }
        brightest.min(held(values, self.shape.bands, local, open, band) / (PI * filled))
    }

    /// Notes what is known without rays: what elements with closed forms bring, and by how much more or less of the
    /// hemisphere is blocked than they would fill.
    fn expect(&self, gather_point: &GatherPoint<'_>, facing: Option<&Facing>, gathered: &mut Gathered) {
        gathered.closed = u64::from(facing.is_some());
        gathered.balanced = u64::from(gather_point.open.is_some());
        let blocked = gather_point.open.map_or(0.0, |open| 1.0 - open.share);
        gathered.balance = blocked - facing.map_or(0.0, |facing| facing.share);
        gathered.known = facing.map_or([0.0; BANDS], |facing| facing.light);
        for band in 0..self.shape.bands {
            gathered.usual.set(band, self.usual(gather_point, band));
        }
        (gathered.counts, gathered.met) = ([0.0; GATHER_SETS], [0.0; BANDS]);
    }

    /// Standard deviation of a ray from a point over that where half of a hemisphere is bright: where the straight sky is
    /// known, of what is met, which the element tells about, whether it is met or not.
    fn spread_at(&self, gather_point: &GatherPoint<'_>, facing: Option<&Facing>) -> f64 {
        let blocked = match (gather_point.open, facing) {
            (Some(open), _) => 1.0 - open.share,
            // without a sky nothing arrives but from what is met
            (None, Some(_)) if self.light.sky.is_none() => 1.0,
            _ => return RAY_SPREAD_MOST,
        };
        let of = |(band, reference): (usize, &f64)| {
            if *reference > 0.0 { self.usual(gather_point, band) / reference } else { 0.0 }
        };
        let met = self.reference.iter().enumerate().map(of).fold(0.0, f64::max);
        let met = if self.light.sun.is_some() { SUNLIT_SPREAD * met } else { met };
        let chance = match facing {
            Some(facing) => RADIANCE_VARIED * sqrt(fabs(facing.share - blocked)),
            None => (2.0 * sqrt((blocked * (1.0 - blocked)).max(0.0))).min(RADIANCE_VARIED * sqrt(blocked)),
        };
        clamp(met * chance.max(LEAST_VARIED * blocked), RAY_SPREAD_LEAST, RAY_SPREAD_MOST)
    }

    /// One more ray from a point.
    fn add_direction(
        &self,
        (gather_point, direction): (&GatherPoint<'_>, Vec3),
        part: usize,
        images: &mut [[f64; MAX_BANDS]; 2],
        gathered: &mut Gathered,
        mode: &mut Mode<'_, '_>,
        path: &mut Path,
    ) -> Option<()> {
        let bands = self.shape.bands;
        let ray = gather_point.surface.spawn_ray(direction);
        path.rays += 1;
        let Gathered {
            terms, throughput, onward, sky, beyond, open, carried, hits, counts, met, closed, ..
        } = gathered;
        let (terms, throughput, onward_throughput) =
            (terms.first_mut()?, throughput.first_mut()?, onward.first_mut()?);
        let (beyond, open, count) = (beyond.get_mut(part)?, open.get_mut(part)?, counts.get_mut(part)?);
        let fronts = mode.occluders.fronts.latest().filter(|_| *closed > 0);
        let mut hit = if let Some(fronts) = fronts {
            self.bvh.crossings(&ray, |hit| {
                let Some((unknown, values)) = fronts.crossed(self, hit) else { return };
                beyond.iter_mut().zip(values).take(bands).for_each(|(sum, light)| *sum -= light);
                *count -= 1.0;
                let signed = carried.iter_mut().enumerate();
                signed.for_each(|(set, sum)| *sum -= sign(unknown, set) * values.at(bands));
            })
        } else {
            self.bvh.closest(&ray)
        };
        if let (None, Some(light)) = (gather_point.open, &self.light.sky) {
            light.radiance(direction, sky.head_mut(bands));
            open.iter_mut().zip(&*sky).take(bands).for_each(|(sum, l)| *sum += l);
        }
        if hit.is_none() {
            return Some(());
        }
        *hits += 1;
        *count += 1.0;
        terms.clear(bands);
        throughput.head_mut(bands).fill(1.0);
        let most = ONWARD_ERROR_LEAST * self.settings.budget.image / gather_point.weight;
        let mut state = PathState {
            ray,
            throughput,
            mirrors: gather_point.bounces + 1,
            lobes: 0,
            lobe: false,
            imaged: false,
            far: 0.0,
            sunless: true,
            images,
            gathered: None,
            step: 0.0,
            onward: Some(Onward { throughput: onward_throughput, ray: None, bounces: 0, depth: 0, most }),
        };
        let mut inner = Path::default();
        loop {
            self.follow(&mut state, &mut hit, mode, terms, &mut inner);
            let Some(onward) = state.onward.as_mut() else { break };
            let Some(ray) = onward.ray.take() else { break };
            core::mem::swap(&mut state.throughput, &mut onward.throughput);
            (state.ray, state.mirrors, state.lobes, state.lobe) = (ray, onward.bounces, 0, false);
            onward.depth += 1;
            inner.rays += 1;
            hit = self.bvh.closest(&ray);
        }
        path.rays += inner.rays;
        carried.iter_mut().zip(inner.signed).for_each(|(sum, error)| *sum += error);
        for (band, (sum, sky)) in beyond.iter_mut().zip(&*sky).enumerate().take(bands) {
            let radiance = terms.sum(band);
            met.iter_mut().skip(band).take(1).for_each(|met| *met += radiance);
            *sum += radiance - *sky;
        }
        Some(())
    }

    /// Whether a ray from a point goes on diffusely from the surface that it has met, as it is short beside the element
    /// there: then the next ray is noted.
    pub(super) fn goes_on(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        unknown: usize,
        sample: RaySample,
    ) -> bool {
        let (Some(onward), RaySample::Stratum { seed, index }) = (&mut state.onward, sample) else {
            return false;
        };
        let area = self.elements.area(self.scene, unknown);
        let diffuse = self.scene.diffuse(surface.material);
        let largest =
            diffuse.iter().zip(state.throughput.iter()).fold(0.0, |a: f64, (rho, t)| a.max(rho * t));
        if largest * sqrt(self.expected_variance(unknown)) <= onward.most {
            return false;
        }
        if onward.ray.is_some()
            || onward.depth >= MOST_ONWARD
            || state.step * state.step > ONWARD_SIZE_MOST * ONWARD_SIZE_MOST * area
        {
            return false;
        }
        // the first along with the ray's own direction, coordinates 0 and 1; lobes have taken these
        let (u, v) = if onward.depth == 0 && state.lobes == 0 {
            Sequence::new(seed).pair(index, 4)
        } else {
            Sequence::new(hash2(seed, 0x0d1f_f000 + onward.depth))
                .pair(hash2(index, onward.depth) & 0xffff, 0)
        };
        let (x, y) = frame(surface.normal);
        let (a, b, c) = cosine_direction(u, v);
        onward.ray = Some(surface.spawn_ray(x * a + y * b + surface.normal * c));
        onward.bounces = state.mirrors + 1;
        let own = onward.throughput.iter_mut().zip(state.throughput.iter()).zip(diffuse);
        own.for_each(|((next, throughput), rho)| *next = throughput * rho);
        true
    }

    /// Notes the correction that rays from a point tell, and returns the expected squared error that is left.
    fn store_correction(
        &self,
        gather_point: &GatherPoint<'_>,
        gathered: &mut Gathered,
        place: usize,
        exact: bool,
        rays: u32,
    ) -> f64 {
        let bands = self.shape.bands.min(BANDS);
        gathered.sky.fill(0.0);
        if let (true, None, Some(sky)) = (exact, gather_point.open, &self.light.sky) {
            sky.irradiance(
                gather_point.surface.normal,
                self.settings.budget.sky,
                gathered.sky.head_mut(bands),
            );
        }
        for band in 0..bands {
            let (mean, _) = gathered.mean(band, rays, exact);
            let irradiance = PI * mean + gathered.sky.at(band);
            if let Some(corrections) = gathered.corrections.get_mut(place) {
                corrections.set(
                    band,
                    irradiance
                        - held(gather_point.values, bands, gather_point.local, gather_point.open, band),
                );
            }
        }
        let carried = carried(gathered.carried.map(|sum| sum / f64::from(rays)));
        (gathered.factor2() * gathered.error(self.reference, rays, exact) + carried) / (CAUTION * CAUTION)
    }
}

/// Expected squared error by the elements that a point sees, from the means of their expected errors with each set of signs.
fn carried(means: [f64; SIGNS]) -> f64 {
    let [apart @ .., alike] = means.map(|mean| mean * mean);
    CARRIED_MIXED * apart.iter().sum::<f64>() / apart.len() as f64 + CARRIED_COHERENT * alike
}
