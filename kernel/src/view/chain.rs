//! Eq. (15) along one ray: diffuse radiance of each facet that the specular chain meets, times the mirrors
//! before it, and the sky where the chain leaves the object.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors) and `cargo test --test gloss`
//! (errors of lobes).

mod fine_detail;
mod fronts;
mod gather;
mod occluders;
mod straight;
mod sunlight;

use fine_detail::{DetailCache, FINE_DETAIL_ERROR};
pub(crate) use fronts::Fronts;
pub(crate) use gather::{CAUTION, GATHERS, finds_thrown_sun};
use gather::{GatherPoint, Gathered, Onward};
pub(crate) use occluders::{OccluderCache, Occluders};
use straight::OpenAt;

use crate::base::arena::plain_table;
use crate::base::budget::ErrorBudget;
use crate::base::index::{Index, IndexMut, copy};
use crate::base::math::{FRAC_1_PI, clamp, floor, pow, sqrt};
use crate::base::qmc::{Sequence, hash2};
use crate::coupling::element::{Elements, Local};
use crate::coupling::mirror_path::MIRRORS_MOST;
use crate::coupling::row_builder::CLOSED_REMAINDER_MOST;
use crate::coupling::{Coupling, RowView};
use crate::radiosity::solution::Solution;
use crate::rays::bvh::Bvh;
use crate::rays::ray::{Hit, Ray};
use crate::rays::surface::{Mirror, Surface};
use crate::scene::light::Light;
use crate::scene::sun::Sun;
use crate::scene::{MAX_BANDS, Scene};
use crate::view::camera::Camera;
use crate::view::importance::Importance;
use core::ops::Deref;
use occluders::RayKind;

/// How far chains are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainSettings<'a> {
    /// The wanted errors and their shares.
    pub budget: &'a ErrorBudget,
    /// Light reflected more often does not count; `None`: by the budget alone.
    pub max_bounces: Option<u32>,
    /// Where an error above this many of the images' is expected of an element, rays from the point itself find what arrives
    /// there.
    pub gather: f64,
    /// Rays that final gathering may take for one image: where all pixels are expected to take fewer, all gather.
    pub rays: u64,
    /// Area of a pixel.
    pub pixel: PixelArea,
    /// Whether what the first mirror or narrow lobe shows of the sun and its images is left out: it is found apart.
    pub apart: bool,
}

/// Area of a pixel at a distance r from where its rays start: `start + growth r^2`, in scene coordinates squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelArea {
    /// Area where rays start: of a parallel camera the area everywhere.
    pub start: f64,
    /// Solid angle that a pixel fills, of a central camera.
    pub growth: f64,
}

impl PixelArea {
    /// Too large for any detail to be resolved.
    pub const INFINITE: PixelArea = PixelArea { start: f64::INFINITY, growth: 0.0 };

    /// Area at a distance.
    pub(super) fn at(&self, distance: f64) -> f64 {
        self.start + self.growth * distance * distance
    }
}

/// Axis ratio from which on a lobe is narrow: cells of a signature may miss its highlights.
pub const NARROW_LOBE_RATIO: f64 = 10.0;

/// [`ChainSettings::gather`] where all pixels of an image may gather and the solution is coarser than the image.
const GATHER_ALL: f64 = 0.3;

/// [`ChainSettings::gather`] where all pixels of an image may gather and the solution is as fine as the image.
const GATHER_MANY: f64 = 0.6;

/// Rays of final gathering where closed forms stand for what is seen, over those where rays alone do. Measured as 0.1 to 0.3
/// in rooms, stairs and fins.
const CLOSED_RAYS_SHARE: f64 = 0.25;

/// Most unknowns of a scene for which [`CLOSED_RAYS_SHARE`] holds: rows of more meet too many.
const CLOSED_UNKNOWNS_MOST: usize = 16384;

/// Rays of final gathering that an image may take in any case: some tenths of a second.
const IMAGE_RAYS_LEAST: f64 = 2e6;

impl ChainSettings<'_> {
    /// Settings for the images of a camera: where the rays suffice for all pixels that the object may fill, final
    /// gathering is used on all but the best elements. Clusters all have it: their
    /// means tell nothing of a point.
    pub(crate) fn of_image(self, camera: &Camera, solved: &Solved<'_>) -> Self {
        let ErrorBudget { solution, image, .. } = *self.budget;
        let (scene, reflected) = (solved.scene, solved.numbers.reflected);
        let all = camera.columns() * camera.rows();
        let spread = scene.largest_diffuse() * gather::spread(reflected);
        let each = gather::usual_rays(image / spread.max(f64::MIN_POSITIVE));
        let each = (solved.sampled_share(self.rays) * each).max(gather::GATHER_RAYS_FEWEST);
        let affords = |pixels: f64| pixels * each <= (self.rays as f64).max(IMAGE_RAYS_LEAST);
        // counting them takes a look at every facet
        let counts = GATHERS && solution > image && scene.facets() <= all;
        let clusters = solved.elements.is_cluster(0);
        let gather = if clusters || affords(all as f64) || counts && affords(camera.most_pixels(scene)) {
            if solution > image { GATHER_ALL } else { GATHER_MANY }
        } else {
            // most elements would need final gathering, and a finer solution costs less: only the worst do
            self.gather * (solution / image).max(1.0)
        };
        let area = camera.pixel_area();
        let pixel = if camera.is_parallel() {
            PixelArea { start: area, growth: 0.0 }
        } else {
            PixelArea { start: 0.0, growth: area }
        };
        ChainSettings { gather, pixel, ..self }
    }

    /// Settings for single points: final gathering on all but the best elements, and all light that a facet receives.
    pub(crate) fn of_points(self) -> Self {
        // the facet's own reflection is one more
        let max_bounces = self.max_bounces.map(|most| most.saturating_add(1));
        ChainSettings { gather: GATHER_ALL, max_bounces, ..self }
    }

    /// Settings for sums over many rays, in which errors of single elements count little: no final gathering.
    pub(crate) fn of_sums(self) -> Self {
        ChainSettings { gather: f64::INFINITY, apart: true, ..self }
    }
}

/// A solved scene: what the radiance along any ray follows from.
#[derive(Clone, Copy, Debug)]
pub struct Solved<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its facets' tree.
    pub bvh: &'a Bvh<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// The rows of its coupling.
    pub rows: KnownRows<'a>,
    /// The light.
    pub light: &'a Light<'a>,
    /// The record of its solution.
    pub solution: Solution<'a>,
    /// How far chains are followed.
    pub settings: ChainSettings<'a>,
}

/// The rows of a coupling, for final gathering: nothing where that is not available.
#[derive(Clone, Copy, Debug)]
pub struct KnownRows<'a>([Coupling<'a>; GATHERS as usize]);

impl<'a> KnownRows<'a> {
    /// The rows of a coupling.
    pub fn new(coupling: &Coupling<'a>) -> KnownRows<'a> {
        KnownRows([*coupling; GATHERS as usize])
    }

    /// The row of an unknown.
    fn of(&self, unknown: usize) -> Option<RowView<'a>> {
        self.0.first()?.rows(unknown..unknown + 1).next().map(|(_, row)| row)
    }
}

impl Solved<'_> {
    /// Expected squared error of an unknown's straight sky over pi, where outlines tell it, relative to the reference radiance.
    fn straight_variance(&self, unknown: usize) -> f64 {
        self.straight.of(unknown, self.shape.bands).map_or(0.0, |(_, variance)| variance)
    }

    /// Expected squared error of an unknown's irradiance over pi with its straight sky, relative to the reference radiance.
    fn expected_variance(&self, unknown: usize) -> f64 {
        f64::from(self.variance.at(unknown)) + self.straight_variance(unknown)
    }

    /// Rays of final gathering over those where nothing is known without them; `rays` are those of the coupling.
    fn sampled_share(&self, rays: u64) -> f64 {
        let closed = self.elements.unknowns() <= CLOSED_UNKNOWNS_MOST;
        let sky = self.light.sky.as_ref().is_none_or(|sky| sky.is_linear());
        match rays {
            _ if !closed || !sky => 1.0,
            // nothing is hidden
            0 => 0.0,
            // of mirrors closed forms tell nothing
            _ => clamp(2.0 * self.scene.largest_specular(), CLOSED_RAYS_SHARE, 1.0),
        }
    }
}

/// The record's fields, which every step of a chain reads.
impl<'a> Deref for Solved<'a> {
    type Target = Solution<'a>;

    fn deref(&self) -> &Solution<'a> {
        &self.solution
    }
}

plain_table! {
    /// The three terms of eq. (11) along a ray, one value per band each.
    pub struct Terms {
        /// Diffuse radiance of the first facet.
        pub diffuse: [f64; MAX_BANDS],
        /// Sky and sun by way of mirrors, or straight where the ray meets nothing.
        pub mirror_sky: [f64; MAX_BANDS],
        /// Diffuse radiance of other facets by way of mirrors.
        pub mirror_diffuse: [f64; MAX_BANDS],
    }
}

plain_table! {
    /// Scratch memory of a chain while it is followed, of any content: too large for small stacks.
    pub struct ChainScratch {
        /// Product of the reflectances along the chain, and along a ray of a lobe.
        pub throughput: [[f64; MAX_BANDS]; 2],
        /// Sums over a lobe's rays.
        pub sums: Terms,
        /// Sums of their squares.
        pub squares: [f64; MAX_BANDS],
        /// The sums before the latest ray.
        pub before: [f64; MAX_BANDS],
        /// Light of an image of the sun, and the product of the reflectances on the way to it.
        pub images: [[f64; MAX_BANDS]; 2],
        /// Sums of final gathering.
        pub gathered: Gathered,
    }
}

impl ChainScratch {
    /// All zero.
    pub const ZERO: ChainScratch = ChainScratch {
        throughput: [[0.0; MAX_BANDS]; 2],
        sums: Terms::ZERO,
        squares: [0.0; MAX_BANDS],
        before: [0.0; MAX_BANDS],
        images: [[0.0; MAX_BANDS]; 2],
        gathered: Gathered::ZERO,
    };
}

impl Terms {
    /// All zero.
    pub const ZERO: Terms =
        Terms { diffuse: [0.0; MAX_BANDS], mirror_sky: [0.0; MAX_BANDS], mirror_diffuse: [0.0; MAX_BANDS] };

    /// Sets the first `bands` values to zero.
    #[inline]
    pub fn clear(&mut self, bands: usize) {
        if bands == 1 {
            // three calls of memset otherwise
            (self.diffuse[0], self.mirror_sky[0], self.mirror_diffuse[0]) = (0.0, 0.0, 0.0);
            return;
        }
        self.diffuse.head_mut(bands).fill(0.0);
        self.mirror_sky.head_mut(bands).fill(0.0);
        self.mirror_diffuse.head_mut(bands).fill(0.0);
    }

    /// Adds the first `bands` values of `next`.
    pub fn add(&mut self, next: &Terms, bands: usize) {
        let pairs = [
            (&mut self.diffuse, &next.diffuse),
            (&mut self.mirror_sky, &next.mirror_sky),
            (&mut self.mirror_diffuse, &next.mirror_diffuse),
        ];
        for (to, from) in pairs {
            to.iter_mut().zip(from).take(bands).for_each(|(to, from)| *to += from);
        }
    }

    /// Radiance in one band.
    #[inline]
    pub fn sum(&self, band: usize) -> f64 {
        self.diffuse.at(band) + self.mirror_sky.at(band) + self.mirror_diffuse.at(band)
    }
}

/// Record of a ray besides its radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Path {
    /// True where the first ray met the object.
    pub object: bool,
    /// Rays traced beyond the first.
    pub rays: u32,
    /// Most that chains cut before their end could still have brought, relative to the reference radiance.
    pub tail: f64,
    /// Expected squared error from the diffuse solution, relative to the reference radiance.
    pub variance: f64,
    /// Sums of the expected errors of the elements met, each with one of its signs (`sign`).
    pub signed: [f64; SIGNS],
    /// Expected error from sampling lobes, relative to the reference radiance.
    pub noise: f64,
    /// Light that n rays like this one miss of highlights that are seen in lobes, times n: the geometric mean of the brightest
    /// that the ray has met and of how bright it is at its middle, relative to the reference radiance.
    pub glare: f64,
    /// Radiance that the sun's disc brings on the mean to who meets it by chance alone, where mirrors show it that were not asked
    /// where: its irradiance over all directions, relative to the reference radiance.
    pub chance: f64,
    /// True where a lobe or a penumbra was met, whose radiance is a mean of rays.
    pub sampled: bool,
}

impl Path {
    /// Notes an element's expected squared error, of which the ray brings a share, and where asked its sums with signs.
    #[inline]
    fn note_error(&mut self, unknown: usize, weight: f64, variance: f64, counts_signs: bool) {
        self.variance += weight * weight * variance;
        if counts_signs {
            let error = weight * sqrt(variance);
            self.signed.iter_mut().enumerate().for_each(|(set, sum)| *sum += sign(unknown, set) * error);
        }
    }
}

/// Which ray of an image it is, so that lobes and penumbrae of different rays are sampled apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RaySample {
    /// A ray that stands for itself: lobes and penumbrae are integrated.
    Integrate(u32),
    /// A ray that stands for itself unless it meets lobes or penumbrae ([`Path::sampled`]): then it is one of many
    /// that are wanted.
    Probe(u32),
    /// Ray number `index` of those that `seed` names and whose mean counts: one point of the sun's disc and one ray of
    /// each lobe. Coordinates 2 to 5 of the sequence `seed` choose them; 0 and 1 are for the place in the pixel.
    Stratum {
        /// Names the rays.
        seed: u32,
        /// This ray among them.
        index: u32,
    },
}

impl RaySample {
    /// A number for the sequences of one ray.
    fn seed(self) -> u32 {
        match self {
            RaySample::Integrate(seed) | RaySample::Probe(seed) => seed,
            RaySample::Stratum { seed, index } => hash2(seed, index + 1),
        }
    }

    /// Turns by which the rays of a lobe's set are rotated, so that sets that count together differ.
    fn turn(self, set: u32) -> f64 {
        let index = match self {
            RaySample::Integrate(_) | RaySample::Probe(_) => 0,
            RaySample::Stratum { index, .. } => index,
        };
        let (turn, _) = Sequence::new(0x10be).pair(hash2(index, set) & 0xffff, 0);
        if index == 0 && set == 0 { 0.0 } else { turn }
    }

    /// The point of the unit square that chooses the ray of lobe number `lobe` of a chain, the first to branch being
    /// number 1.
    ///
    /// Rays that count together are spread over the square: at the first lobe by the sequence that chooses their other
    /// points, too; at the second by multiples of powers of the plastic number, which together with the first lobe's
    /// sunflower fill four dimensions more evenly than nets whose count is no power of two; beyond at random.
    fn lobe_point(self, lobe: u32) -> (f64, f64) {
        let (seed, index) = match self {
            RaySample::Integrate(seed) | RaySample::Probe(seed) => (seed, 0),
            RaySample::Stratum { seed, index } => (seed, index),
        };
        if lobe == 1 {
            return Sequence::new(seed).pair(index & 0xffff, 4);
        }
        let sequence = Sequence::new(hash2(seed, lobe));
        if lobe != 2 {
            return sequence.pair(hash2(index, lobe) & 0xffff, 0);
        }
        let (a, b) = sequence.pair(0, 0);
        let (x, y) = (a + f64::from(index) * PLASTIC.0, b + f64::from(index) * PLASTIC.1);
        (x - floor(x), y - floor(y))
    }
}

/// How a ray is followed: which sample it is, and the occluders of facets that are known.
struct Mode<'w, 'm> {
    sample: RaySample,
    occluders: &'w mut OccluderCache<'m>,
    /// Whether the first lobe ends it where the ray stands for itself.
    branches: bool,
    /// Where it is noted what the ray's radiance depends on.
    importance: Option<&'w mut Importance<'m>>,
}

/// A chain on its way.
struct PathState<'w> {
    ray: Ray,
    /// Product of the mirror reflectances so far, per band.
    throughput: &'w mut [f64; MAX_BANDS],
    /// Mirrors met.
    mirrors: u32,
    /// Lobes among them.
    lobes: u32,
    /// True where sunlight that the ray may bring is evaluated directly at the last lobe.
    lobe: bool,
    /// True where that is so behind flat mirrors, too.
    imaged: bool,
    /// Length of the way up to its ray.
    far: f64,
    /// True where the sun's disc does not count.
    sunless: bool,
    /// For the sun's images.
    images: &'w mut [[f64; MAX_BANDS]; 2],
    /// For rays from a point; none where it is such a ray itself.
    gathered: Option<&'w mut Gathered>,
    /// Length of its latest ray.
    step: f64,
    /// For rays from a point: where they go on diffusely.
    onward: Option<Onward<'w>>,
}

/// Irradiance of a point by its parts.
struct Arriving<'a> {
    /// Mean and gradients over its element, in `bands` bands.
    values: &'a [f64],
    bands: usize,
    /// Where it is on the element.
    local: Local,
    /// The straight sky at the point itself, in place of the element's.
    open: Option<&'a OpenAt<'a>>,
    /// Irradiance that final gathering adds, one value per band.
    correction: &'a [f64],
    /// Mean over the element by images of the sun, one value per band.
    reflected_irradiance: &'a [f64],
    /// The sun, where it shines on the point, and the share of its irradiance.
    sun: Option<&'a Sun<'a>>,
    sunlit: f64,
}

impl Arriving<'_> {
    /// The sum of all in one band.
    #[inline]
    fn irradiance(&self, band: usize) -> f64 {
        let mut irradiance = held(self.values, self.bands, self.local, self.open, band);
        irradiance = (irradiance + self.correction.at(band)).max(0.0);
        irradiance +=
            self.open.map_or(0.0, |open| open.irradiance.at(band)) + self.reflected_irradiance.at(band);
        if let Some(sun) = self.sun {
            irradiance += self.sunlit * sun.irradiance(band);
        }
        irradiance
    }
}

/// 1/p and 1/p^2 of the plastic number p, the root of p^3 = p + 1.
const PLASTIC: (f64, f64) = (0.754_877_666_246_692_8, 0.569_840_290_998_053_3);

/// Factor of the error of a lobe's mean radiance: sqrt((LOBE_ERROR s n^-LOBE_POWER)^2 + (LOBE_BETWEEN rho/n)^2) for n rays
/// whose radiances have the standard deviation s, at the reflectance rho.
///
/// With the other two 1 to 1.8 times the true error for 1 to 1000 rays in the study of two cylinders: `cargo test --test
/// gloss` measures it.
const LOBE_ERROR: f64 = 1.2;

/// Power of 1/n in the same error: the rays of a lobe are stratified, but its radiance may jump. See [`LOBE_ERROR`].
const LOBE_POWER: f64 = 0.6;

/// Factor of the part of that error that lies between the rays and is told by none of them. See [`LOBE_ERROR`].
const LOBE_BETWEEN: f64 = 0.09;

/// Number of rays in a lobe's first set, times the wanted error over the lobe's reflectance: what lies between the rays
/// ([`LOBE_BETWEEN`]) is then a small part of the wanted error.
const FIRST_RAYS: f64 = 0.24;

/// Fewest rays of one lobe: their standard deviation decides on the rest.
const FEWEST_LOBE_RAYS: u32 = 4;

/// Most rays of one lobe: a bound on the time of one pixel.
const MOST_LOBE_RAYS: f64 = 1024.0;

/// The rays of one lobe so far: sums over them.
struct LobeSamples<'w> {
    terms: &'w mut Terms,
    path: Path,
    /// Sum of the squared radiances of each band.
    squares: &'w mut [f64; MAX_BANDS],
    before: &'w mut [f64; MAX_BANDS],
    /// Product of the reflectances along the latest ray.
    throughput: &'w mut [f64; MAX_BANDS],
    count: u32,
}

impl LobeSamples<'_> {
    /// Standard deviation of a ray's radiance over the reference radiance, the largest of all bands.
    fn spread(&self, reference: &[f64]) -> f64 {
        let n = f64::from(self.count.max(1));
        let mut largest: f64 = 0.0;
        for (band, (&square, &reference)) in self.squares.iter().zip(reference).enumerate() {
            let mean = self.terms.sum(band) / n;
            let variance = square / n - mean * mean;
            // below: rounding of equal rays
            if reference > 0.0 && variance > 1e-12 * mean * mean {
                largest = largest.max(sqrt(variance) / reference);
            }
        }
        largest
    }

    /// Expected error of the mean over the reference radiance; `throughput` is what a radiance of 1 brings.
    #[inline(never)]
    fn error(&self, reference: &[f64], throughput: f64) -> f64 {
        let n = f64::from(self.count.max(1));
        let (seen, between) =
            (LOBE_ERROR * self.spread(reference) * pow(n, -LOBE_POWER), LOBE_BETWEEN * throughput / n);
        let glare = self.path.glare / n;
        sqrt(seen * seen + between * between + glare * glare)
    }

    /// Adds the mean of all rays.
    #[inline(never)]
    fn mean_into(&self, terms: &mut Terms, path: &mut Path, bands: usize) {
        let share = 1.0 / f64::from(self.count.max(1));
        for band in 0..bands.min(MAX_BANDS) {
            terms.diffuse[band] += share * self.terms.diffuse[band];
            terms.mirror_sky[band] += share * self.terms.mirror_sky[band];
            terms.mirror_diffuse[band] += share * self.terms.mirror_diffuse[band];
        }
        path.rays += self.path.rays;
        path.tail += share * self.path.tail;
        path.noise += share * self.path.noise;
        // rays of a lobe meet the same elements: their errors are taken as one
        path.variance += share * self.path.variance;
        path.signed.iter_mut().zip(self.path.signed).for_each(|(to, from)| *to += share * from);
    }
}

impl Solved<'_> {
    /// Radiance against `ray`, added to `terms` (cleared by the caller).
    pub fn radiance(&self, ray: &Ray, sample: RaySample, terms: &mut Terms) -> Path {
        self.radiance_at((ray, self.bvh.closest(ray)), sample, terms, &mut { ChainScratch::ZERO })
    }

    /// As [`Solved::radiance`], of a ray that is known to meet `hit` first, in the caller's memory.
    pub fn radiance_at(
        &self,
        seen: (&Ray, Option<Hit>),
        sample: RaySample,
        terms: &mut Terms,
        work: &mut ChainScratch,
    ) -> Path {
        self.radiance_with(seen, sample, terms, work, &mut OccluderCache::none())
    }

    /// As [`Solved::radiance_at`], with a cache of occluders: fewer rays, and the same bits.
    pub(crate) fn radiance_with(
        &self,
        seen: (&Ray, Option<Hit>),
        sample: RaySample,
        terms: &mut Terms,
        work: &mut ChainScratch,
        occluders: &mut OccluderCache<'_>,
    ) -> Path {
        self.radiance_noted(seen, sample, terms, work, (occluders, None))
    }

    /// The same, and notes what the radiance depends on: of rays that are each one of many ([`RaySample::Stratum`]).
    pub(crate) fn radiance_noted<'m>(
        &self,
        (ray, mut hit): (&Ray, Option<Hit>),
        sample: RaySample,
        terms: &mut Terms,
        work: &mut ChainScratch,
        (occluders, importance): (&mut OccluderCache<'m>, Option<&mut Importance<'m>>),
    ) -> Path {
        let mut path = Path::default();
        let ChainScratch { throughput: [throughput, next], sums, squares, before, images, gathered } = work;
        throughput.head_mut(self.shape.bands).fill(1.0);
        let (sunless, gathered) = (false, Some(gathered));
        let mut state = PathState {
            ray: *ray,
            throughput,
            mirrors: 0,
            lobes: 0,
            lobe: false,
            imaged: false,
            far: 0.0,
            sunless,
            images,
            gathered,
            step: 0.0,
            onward: None,
        };
        let mode = &mut Mode { sample, occluders, branches: true, importance };
        if self.follow(&mut state, &mut hit, mode, terms, &mut path)
            && let Some(lobe) = &hit
        {
            let mut samples = LobeSamples {
                terms: sums,
                path: Path::default(),
                squares,
                before,
                throughput: next,
                count: 0,
            };
            self.branch(&mut state, lobe, mode, terms, &mut path, &mut samples);
        }
        path
    }

    /// Follows a chain whose ray meets `hit` first to its end; or, where it may branch and the ray stands for itself, to
    /// the first lobe: true, and `hit` is there. All other lobes take one ray.
    fn follow(
        &self,
        state: &mut PathState<'_>,
        hit: &mut Option<Hit>,
        mode: &mut Mode<'_, '_>,
        terms: &mut Terms,
        path: &mut Path,
    ) -> bool {
        loop {
            let Some(met) = hit else {
                self.escape(state, terms);
                path.chance = path.chance.max(self.chance(state));
                return false;
            };
            path.object |= state.mirrors == 0;
            state.far += met.t;
            state.step = met.t;
            // where they stand: copies burden small stacks
            let surface = &Surface::of_hit(self.scene, met);
            let Some(surface) = surface else { return false };
            self.add_diffuse(state, surface, mode, terms, path);
            let mirror = &surface.mirror(self.scene);
            let Some(mirror) = mirror else { return false };
            if !self.advance(state, surface, terms, path) {
                return false;
            }
            // where sunlight is found apart, the first mirror's is
            let apart = self.settings.apart && state.mirrors == 1;
            state.lobe = mirror.lobe.is_some()
                || state.lobe && state.imaged && surface.flat_mirror(self.scene).is_some();
            *hit = match &mirror.lobe {
                None => {
                    if apart {
                        let imaged = !self.images.slots.is_empty() && self.knows_images(surface);
                        (state.lobe, state.imaged) = (true, imaged);
                    }
                    self.advance_mirror(state, surface, mode, path)
                }
                Some(lobe) => {
                    if !(apart && lobe.ratio() >= NARROW_LOBE_RATIO) {
                        self.add_sun_gloss(state, surface, mirror, mode, terms, path);
                    }
                    if !self.advance_lobe(state, surface, mirror, mode, path) {
                        return true;
                    }
                    path.rays += 1;
                    self.bvh.closest(&state.ray)
                }
            };
        }
    }

    /// Counts one more mirror: multiplies the throughput by its reflectance. False where the chain ends, at the largest
    /// number of reflections or where it is too dim; what it could still bring is then in the path's tail.
    #[inline]
    fn advance(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        terms: &mut Terms,
        path: &mut Path,
    ) -> bool {
        if self.settings.max_bounces.is_some_and(|most| state.mirrors >= most) {
            return false;
        }
        // eq. (15): prod rho_s over the mirrors so far
        let specular = self.scene.specular(surface.material);
        let mut largest = 0.0;
        for (throughput, rho) in state.throughput.head_mut(self.shape.bands).iter_mut().zip(specular) {
            *throughput *= rho;
            largest = f64::max(largest, *throughput);
        }
        if largest * self.numbers.brightest < self.settings.budget.chains
            || state.mirrors as usize >= MIRRORS_MOST
        {
            path.tail += largest * self.numbers.brightest;
            self.close(state, terms);
            return false;
        }
        state.mirrors += 1;
        true
    }

    /// Reflects the ray at an ideal mirror and finds what it meets: among the facets that are known to stand in its way,
    /// where they are known, as for parallel rays.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    fn advance_mirror(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        mode: &mut Mode<'_, '_>,
        path: &mut Path,
    ) -> Option<Hit> {
        let direction = surface.mirrored(self.scene, state.ray.direction);
        state.ray = surface.spawn_ray(direction);
        if state.mirrors == 1
            && !state.sunless
            && mode.occluders.is_parallel()
            && !self.scene.is_smooth()
            && let Some(known) = mode.occluders.before(self, surface, RayKind::Mirror, (direction, 0.0))
        {
            path.rays += u32::from(!known.is_empty());
            return self.bvh.closest_among(&state.ray, known);
        }
        path.rays += 1;
        self.bvh.closest(&state.ray)
    }

    /// Chooses the ray of a lobe. False where the chain branches there instead: at its first lobe, where the ray stands for
    /// itself or the material says how many rays it takes.
    #[inline]
    fn advance_lobe(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        mirror: &Mirror,
        mode: &Mode<'_, '_>,
        path: &mut Path,
    ) -> bool {
        state.imaged = self.knows_images(surface);
        state.lobes += 1;
        let asked = self.scene.gloss_rays(surface.material).is_some();
        path.sampled |= !asked;
        if state.lobes == 1 && mode.branches && (asked || matches!(mode.sample, RaySample::Integrate(_))) {
            return false;
        }
        let (u, v) = mode.sample.lobe_point(state.lobes);
        self.turn(state, surface, mirror, u, v);
        true
    }

    /// The rest of a chain that is not followed any more: it is taken to go on as it went so far, S + t S + t^2 S ... =
    /// S/(1 - t) with the product t of its mirrors. Where all facets shine alike that is exact; it adds no more than
    /// the part that the bound on the tail allows for. Lobes, which lose light at grazing angles, are left as they are.
    #[cold]
    fn close(&self, state: &PathState, terms: &mut Terms) {
        if state.lobes > 0 {
            return;
        }
        for (band, &throughput) in state.throughput.head(self.shape.bands).iter().enumerate() {
            if throughput <= CLOSED_REMAINDER_MOST {
                let all = terms.mirror_diffuse.at(band) + terms.sum(band) * throughput / (1.0 - throughput);
                terms.mirror_diffuse.set(band, all);
            }
        }
    }

    /// One ray of a lobe, weighed with the lobe's albedo.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn turn(&self, state: &mut PathState<'_>, surface: &Surface, mirror: &Mirror, u: f64, v: f64) {
        let (direction, share) = surface.sample_reflection(self.scene, mirror, state.ray.direction, u, v);
        state.throughput.head_mut(self.shape.bands).iter_mut().for_each(|t| *t *= share);
        state.ray = surface.spawn_ray(direction);
    }

    /// Equal-energy rays of the visible lobe: as many as its material asks for; or a first set by the tolerance and,
    /// where its rays disagree, a second.
    #[inline(never)]
    fn branch<'w>(
        &self,
        state: &mut PathState<'w>,
        hit: &Hit,
        mode: &mut Mode<'_, '_>,
        terms: &mut Terms,
        path: &mut Path,
        samples: &mut LobeSamples<'w>,
    ) {
        let Some(surface) = &Surface::of_hit(self.scene, hit) else { return };
        let Some(lobe) = surface.mirror(self.scene).and_then(|mirror| mirror.lobe) else { return };
        let bands = self.shape.bands;
        let mirrored = surface.mirrored(self.scene, state.ray.direction);
        let albedo = lobe.albedo(mirrored.dot(surface.normal));
        state.throughput.head_mut(bands).iter_mut().for_each(|t| *t *= albedo);
        let largest = state.throughput.head(bands).iter().fold(0.0, |a: f64, &b| a.max(b));

        let asked = self.scene.gloss_rays(surface.material);
        let mut goal = asked.unwrap_or_else(|| self.first_rays(largest));
        samples.terms.clear(bands);
        samples.squares.head_mut(bands).fill(0.0);
        for set in 0..2 {
            let n = goal.saturating_sub(samples.count);
            let turn = mode.sample.turn(set);
            for i in 0..n {
                let direction = lobe.ray(i as usize, n as usize, turn, mirrored, surface.normal);
                state.ray = surface.spawn_ray(direction);
                self.add_ray(state, mode, samples);
            }
            if asked.is_none() {
                goal = self.all_rays(samples.spread(self.reference), samples.path.glare);
            }
        }
        path.noise += samples.error(self.reference, largest);
        samples.mean_into(terms, path, bands);
    }

    /// Rays of a lobe's first set, for a lobe whose light counts `throughput`: what they may miss between them is small
    /// against the tolerance.
    fn first_rays(&self, throughput: f64) -> u32 {
        let wanted = FIRST_RAYS * throughput / self.settings.budget.image;
        (wanted.min(MOST_LOBE_RAYS) as u32).max(FEWEST_LOBE_RAYS)
    }

    /// Rays of both sets, by the standard deviation of the first one's and their glare.
    fn all_rays(&self, spread: f64, glare: f64) -> u32 {
        let goal = self.settings.budget.lobes;
        let wanted = pow(LOBE_ERROR * spread / goal, 1.0 / LOBE_POWER).max(glare / goal);
        wanted.min(MOST_LOBE_RAYS) as u32
    }

    /// One more ray of the lobe that `state` has met, its ray, to its end. Its state is lent to the ray, as the stack has room for
    /// one alone, and given back but for its own ray.
    fn add_ray<'w>(&self, state: &mut PathState<'w>, mode: &mut Mode<'_, '_>, samples: &mut LobeSamples<'w>) {
        let bands = self.shape.bands;
        samples.before.iter_mut().enumerate().take(bands).for_each(|(b, x)| *x = samples.terms.sum(b));
        copy(samples.throughput.head_mut(bands), state.throughput.head(bands));
        samples.path.rays += 1;
        let sample = RaySample::Stratum { seed: mode.sample.seed(), index: samples.count };
        let importance = mode.importance.as_deref_mut();
        let mut mode = Mode { sample, occluders: &mut *mode.occluders, branches: false, importance };
        let mut hit = self.bvh.closest(&state.ray);
        let PathState { mirrors, lobes, far, imaged, .. } = *state;
        let gathered = state.gathered.take();
        state.lobe = true;
        core::mem::swap(&mut state.throughput, &mut samples.throughput);
        self.follow(state, &mut hit, &mut mode, samples.terms, &mut samples.path);
        core::mem::swap(&mut state.throughput, &mut samples.throughput);
        (state.mirrors, state.lobes, state.far, state.imaged, state.gathered) =
            (mirrors, lobes, far, imaged, gathered);
        for (b, (square, before)) in
            samples.squares.iter_mut().zip(samples.before.iter()).enumerate().take(bands)
        {
            let value = samples.terms.sum(b) - before;
            *square += value * value;
        }
        samples.count += 1;
    }

    /// See [`Path::chance`].
    #[inline]
    fn chance(&self, state: &PathState<'_>) -> f64 {
        match &self.light.sun {
            Some(sun) if !sun.is_point() && state.mirrors > 0 && !state.lobe && !state.sunless => {
                0.25 * FRAC_1_PI * self.gloss_at_stake(state.throughput, sun)
            }
            _ => 0.0,
        }
    }

    /// The chain leaves the object: sky, and the sun's disc. Not inlined: keeps its radiances out of the stack frame of
    /// the chain.
    #[inline(never)]
    fn escape(&self, state: &PathState<'_>, terms: &mut Terms) {
        let bands = self.shape.bands;
        if let Some(sky) = &self.light.sky {
            let mut radiance = [0.0; MAX_BANDS];
            sky.radiance(state.ray.direction, radiance.head_mut(bands));
            let own = radiance.iter().zip(state.throughput.iter()).take(bands);
            terms.mirror_sky.iter_mut().zip(own).for_each(|(to, (l, throughput))| *to += throughput * l);
        }
        if let Some(sun) = &self.light.sun
            && !sun.is_point()
            && !state.lobe
            && !state.sunless
            && sun.contains(state.ray.direction)
        {
            let own = terms.mirror_sky.iter_mut().zip(state.throughput.iter()).take(bands);
            own.enumerate().for_each(|(band, (to, throughput))| *to += throughput * sun.disc_radiance(band));
        }
    }

    /// Adds the diffuse radiance of a facet toward the chain, times the throughput: emission, and what arrives at the point.
    // apart on small machines: does not burden the stack of highlights
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    fn add_diffuse(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        mode: &mut Mode<'_, '_>,
        terms: &mut Terms,
        path: &mut Path,
    ) {
        let bands = self.shape.bands;
        let to = if state.mirrors == 0 { &mut terms.diffuse } else { &mut terms.mirror_diffuse };
        self.add_emission(state, surface, mode, to);
        let Some(level) = self.level(state.mirrors) else { return };
        let diffuse = self.scene.diffuse(surface.material);
        if diffuse.iter().all(|&d| d == 0.0) {
            return;
        }
        let (unknown, local) = self.elements.locate(surface.facet, surface.side, surface.u, surface.v);
        let sunlit = self.sun_cosine(state, surface, mode, path);
        let goes_on = self.goes_on(state, surface, unknown, mode.sample);
        let reflected_irradiance: &[f64] = if state.onward.is_some() && !goes_on {
            // rays from a point are many, and each meets another place: the mean over the element serves
            let side = self.elements.kept_side(surface.facet, surface.side);
            self.images.mean(self.shape, side, unknown, level)
        } else {
            if !self.images.slots.is_empty() {
                self.add_images(state, surface, mode, to, path);
            }
            &[]
        };
        let sun = self.light.sun.as_ref().filter(|_| sunlit > 0.0);
        if goes_on {
            return self.add_sunlit(state, surface, sun.map(|sun| (sun, sunlit)), to);
        }
        let weight = state.throughput.iter().zip(diffuse).fold(0.0, |most, (t, rho)| f64::max(most, t * rho));
        let values = self.irradiance.part(self.shape.at(unknown, level));
        let point =
            GatherPoint { surface, unknown, values, local, weight, bounces: state.mirrors, open: None };
        // a ray from a point, or of a lobe
        let counts_signs = state.gathered.is_none();
        let gathered = state.gathered.as_deref_mut();
        let mut open = None;
        let (correction, variance) =
            self.beyond_element(&point, state.far, (gathered, state.images), mode, path, &mut open);
        let open = open.as_ref();
        let arriving = Arriving { values, bands, local, open, correction, reflected_irradiance, sun, sunlit };
        for (band, ((to, throughput), rho)) in
            to.iter_mut().zip(state.throughput.iter()).zip(diffuse).enumerate()
        {
            // eq. (15): I_d prod rho_s, with the reflected part of eq. (12), I_d = rho_d E/pi
            let share = throughput * rho;
            *to += share * FRAC_1_PI * arriving.irradiance(band);
        }
        if let Some(importance) = mode.importance.as_deref_mut() {
            let at = (unknown, local, open.map_or(1.0, |open| open.ratio));
            importance.reflect(surface, at, (diffuse, state.throughput.head(bands)), &*to);
        }
        path.note_error(unknown, weight, variance, counts_signs);
    }

    /// Adds a facet's own diffuse radiance toward the chain, times the throughput.
    #[inline]
    fn add_emission(
        &self,
        state: &PathState<'_>,
        surface: &Surface,
        mode: &mut Mode<'_, '_>,
        to: &mut [f64; MAX_BANDS],
    ) {
        let emission = self.light.emission(self.scene, surface.facet, surface.side);
        let emitted = to.iter_mut().zip(state.throughput.iter()).zip(emission);
        emitted.for_each(|((to, throughput), own)| *to += throughput * own);
        if let Some(importance) = mode.importance.as_deref_mut() {
            importance.meet(surface, state.throughput.head(self.shape.bands), &*to);
        }
    }

    /// Adds the sunlight that arrives straight and is reflected diffusely, of which a share is not hidden.
    #[inline]
    fn add_sunlit(
        &self,
        state: &PathState<'_>,
        surface: &Surface,
        sun: Option<(&Sun<'_>, f64)>,
        to: &mut [f64; MAX_BANDS],
    ) {
        let Some((sun, sunlit)) = sun else { return };
        let diffuse = self.scene.diffuse(surface.material);
        let own = to.iter_mut().zip(state.throughput.iter()).zip(diffuse);
        own.enumerate().for_each(|(band, ((to, throughput), rho))| {
            *to += throughput * rho * FRAC_1_PI * sunlit * sun.irradiance(band);
        });
    }

    /// The level of the irradiance table that counts for a facet behind `mirrors` mirrors; `None` where its reflection
    /// is one too many.
    #[inline]
    fn level(&self, mirrors: u32) -> Option<usize> {
        let level = match self.settings.max_bounces {
            Some(most) if mirrors >= most => return None,
            Some(most) if self.shape.levels > 1 => (most - mirrors - 1) as usize,
            _ => 0,
        };
        Some(level.min(self.shape.levels.saturating_sub(1)))
    }

    /// Irradiance at a point beyond its element's linear function: `open`, the straight sky, where the element's leaves
    /// too much of it; irradiance that final gathering adds, one value per band, where the element's expected error is too
    /// large; and the expected squared error of irradiance over pi, relative to the reference radiance.
    #[inline]
    fn beyond_element<'g, 's>(
        &'s self,
        point: &GatherPoint<'_>,
        far: f64,
        (mut gathered, images): (Option<&'g mut Gathered>, &mut [[f64; MAX_BANDS]; 2]),
        mode: &mut Mode<'_, '_>,
        path: &mut Path,
        // written where it stands: it is large
        open: &mut Option<OpenAt<'s>>,
    ) -> (&'g [f64], f64) {
        let GatherPoint { surface, unknown, local, weight, .. } = *point;
        let mut variance = f64::from(self.variance.at(unknown));
        if let Some(gathered) = gathered.as_deref_mut()
            && self.has_fine_detail_nearby(surface, unknown, far, &mut gathered.details)
        {
            variance = variance.max(FINE_DETAIL_ERROR * FINE_DETAIL_ERROR);
        }
        let by_element = self.straight_variance(unknown);
        let by_element = by_element + self.turned_sky(surface, unknown);
        if let Some(kept) = gathered.as_deref_mut()
            && (self.wants_rays(surface, weight, variance) || self.wants_look(weight, by_element))
        {
            *open = self.open_in_pixel(surface, unknown, local, &mut kept.skies, mode.occluders);
        }
        let mut doubtful = open.as_ref().is_some_and(|open| open.doubtful);
        variance += if open.is_some() { 0.0 } else { by_element };
        let mut correction: &[f64] = &[];
        if self.wants_rays(surface, weight, if doubtful { f64::INFINITY } else { variance })
            && let Some(gathered) = gathered
        {
            let point = GatherPoint { open: open.as_ref(), ..*point };
            if let Some((near, left)) = self.gather(&point, images, gathered, mode, path) {
                (correction, variance, doubtful) = (near, left, false);
            }
        }
        if doubtful {
            *open = None;
            variance += by_element;
        }
        (correction, variance + open.as_ref().map_or(0.0, |open| open.variance))
    }
}

/// Number of sets of signs of the elements' errors; in the last, all have one sign.
pub(crate) const SIGNS: usize = 5;

/// The sign of an unknown's error in one of the sets: errors of different elements are independent, so that squares of sums
/// with such signs are what their sum's square is expected to be.
#[inline(always)]
fn sign(unknown: usize, set: usize) -> f64 {
    // the upper bits of a product with the golden ratio are as good as random
    let bits = (unknown as u32).wrapping_mul(0x9e37_79b9);
    let odd = (bits ^ (bits >> 15)).wrapping_mul(0x85eb_ca6b) >> (24 + set) & 1 == 1;
    if odd && set + 1 < SIGNS { -1.0 } else { 1.0 }
}

/// Irradiance of one band by an element's mean and gradients (`values`) at a point in its local coordinates, less what they
/// hold of the straight sky where that is known at the point.
#[inline(always)]
fn held(values: &[f64], bands: usize, local: Local, open: Option<&OpenAt<'_>>, band: usize) -> f64 {
    let all = linear(values, bands, local, band);
    match open {
        Some(open) => open.ratio * (all - linear(open.held, bands, local, band)).max(0.0),
        None => all.max(0.0),
    }
}

/// A linear function of one band by its mean and gradients.
#[inline(always)]
fn linear(values: &[f64], bands: usize, (a, b): Local, band: usize) -> f64 {
    values.at(band) + a * values.at(bands + band) + b * values.at(2 * bands + band)
}
