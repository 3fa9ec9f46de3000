//! Images: eq. (15) along the ray through each pixel's centre, and along more rays where the radiance changes from
//! pixel to pixel.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors of pixels) and `cargo bench
//! --bench counts` (instructions).

mod centres;
mod line_integral;
mod thin;

use crate::base::arena::{Arena, Need, plain_table};
use crate::base::budget::ErrorBudget;
use crate::base::error::{Error, Field};
use crate::base::index::{Index, IndexMut, copy, pieces};
use crate::base::math::{clamp, fabs, floor, narrow, pow, sqrt};
use crate::base::qmc::{Sequence, hash2};
use crate::coupling::element::Elements;
use crate::rays::bvh::AnswerBuffer;
use crate::rays::outline::Candidates;
use crate::rays::ray::{Hit, Line, Ray};
use crate::scene::{MAX_BANDS, Scene};
use crate::view::camera::{Camera, Sampling};
use crate::view::chain::{ChainScratch, Fronts, OccluderCache, Occluders, Path, RaySample, Solved, Terms};
use crate::view::raster::{Items, NO_FACET_DRAWN, UNSURE};
use centres::Centres;
use core::ops::Range;
use line_integral::{Fineness, Measure, integrate};

/// Counts of the work on a range of rows; ranges add up with [`Tally::add`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Pixels whose centre ray meets the object.
    pub object_pixels: u64,
    /// Rays through pixels.
    pub primary: u64,
    /// Rays of chains and toward the sun.
    pub chain: u64,
    /// Pixels sampled more than once.
    pub refined: u64,
    /// Sum over object pixels of the squared expected error from the diffuse solution.
    pub noise2: f64,
    /// Sum over object pixels of the squared expected error from sampling the pixel's area and lobes.
    pub sampling2: f64,
    /// Largest bound on what cut chains could still have brought.
    pub tail: f64,
}

impl Tally {
    /// Adds the tally of the next range.
    pub fn add(&mut self, next: &Tally) {
        // a caller may hand over any numbers
        let add = |to: &mut u64, more: u64| *to = to.saturating_add(more);
        add(&mut self.object_pixels, next.object_pixels);
        add(&mut self.primary, next.primary);
        add(&mut self.chain, next.chain);
        add(&mut self.refined, next.refined);
        self.noise2 += next.noise2;
        self.sampling2 += next.sampling2;
        self.tail = self.tail.max(next.tail);
    }

    /// Root mean square over the object's pixels of both errors, relative to the reference radiance.
    pub fn estimate(&self) -> f64 {
        if self.object_pixels == 0 {
            return 0.0;
        }
        sqrt(((self.noise2 + self.sampling2) / self.object_pixels as f64).max(0.0))
    }
}

/// Where a range of rows is written: (row, column, band), row by row.
#[derive(Debug)]
pub struct Target<'o> {
    /// Radiance.
    pub image: &'o mut [f32],
    /// The terms of eq. (11): diffuse, mirror-sky, mirror-diffuse; same shape, or empty.
    pub components: [&'o mut [f32]; 3],
}

/// Bytes of scratch memory for [`rows`]: three rows of pixel centres, what integrals over a pixel hold, and the facets
/// that some rows of centres meet.
pub fn scratch_bytes(camera: &Camera, scene: &Scene<'_>, elements: &Elements<'_>) -> Result<usize, Error> {
    let bands = scene.bands();
    let width = camera.columns() + 2;
    let need = Need::new().and::<f64>(Centres::size(camera.columns(), bands)).and::<f64>(work(bands));
    let need = need.and::<PixelScratch>(1).and::<Occluders>(OccluderCache::ROOM);
    let need = Candidates::need(Items::need(need, width, ROWS_DRAWN), CANDIDATE_FACETS_KEPT);
    Fronts::need(need, elements.unknowns(), bands).bytes()
}

/// Rows of one piece of an image of `rows` rows: few enough to balance threads, enough to be drawn together. It does
/// not depend on the number of threads, so that sums over pixels do not either.
pub fn piece(rows: usize) -> usize {
    rows.div_ceil(128).max(ROWS_DRAWN)
}

/// Number of facets whose outlines are kept, of those that many others stand about.
const CANDIDATE_FACETS_KEPT: usize = 8;

/// Number of rows that are drawn together.
const ROWS_DRAWN: usize = 8;

/// Most facets of a mesh that is drawn into the item buffer, for each pixel: rays cost less beyond.
const DRAWN_FACETS_PER_PIXEL: usize = 2;

/// Values of two nested integrals and the result.
fn work(bands: usize) -> usize {
    2 * line_integral::memory(3 * bands) + 3 * bands
}

/// Fewest scattered rays through a pixel: fewer tell too little of their own spread.
const SCATTER_RAYS_FEWEST: u32 = 8;

/// Most scattered rays through a pixel: a bound on the time of one pixel.
const SCATTER_RAYS_MOST: u32 = 1024;

/// Error of the mean of n scattered rays of the standard deviation s, over s n^-3/4: measured as 0.8 to 1.2 in
/// penumbrae, lobes and at edges for 4 to 256 rays (`cargo run --release --example calibrate`).
const SCATTER_ERROR_FACTOR: f64 = 1.2;

/// Factor on the error that integrals along lines tell: they do not see what lies between lines.
const LINE_ERROR_FACTOR: f64 = 1.5;

/// Share of the contrast with the neighbours that scattered rays may have missed where none of them shows it.
const PIXEL_UNSEEN_SHARE: f64 = 0.35;

/// Share of the contrast with a neighbour that counts as curvature: where radiance changes fast, detail between pixel
/// centres is likelier.
const CONTRAST_CURVATURE: f64 = 0.25;

/// Parts into which first lines divide a pixel, and first places a line.
///
/// Places are shifted from line to line. What reaches less far into a pixel than a part, and ends there, is missed.
const PIXEL_PARTS: usize = 4;

/// Parts of a pixel, as [`PIXEL_PARTS`], for wanted errors below [`FINE_PIXELS`].
const PIXEL_PARTS_FINE: usize = 8;

/// Wanted error of an image, relative to the reference radiance, below which pixels are divided into more parts.
const FINE_PIXELS: f64 = 1e-3;

/// Largest contrast in a pixel's neighbourhood, in wanted errors, for which scattered rays cost less than lines: the
/// changes in both directions, over three rows.
const SCATTER_CONTRAST_MOST: f64 = 60.0;

/// Narrowest distance of two lines, in pixels.
const LINES_NARROWEST: f64 = 1.0 / 64.0;

/// Narrowest distance of two places along a line, in pixels.
const PLACES_NARROWEST: f64 = 1.0 / 4096.0;

/// Rays of a pixel after which its lines are not halved any more.
const PIXEL_RAYS_ENOUGH: u64 = 2048;

/// Shift of the places along a line per distance of lines: its multiples by the powers of two up to 16, between which
/// lines are halved, fill the unit interval evenly (16 times it is the golden ratio).
const PLACE_SHIFT: f64 = 64.0 * 0.101_127_124_296_868_43;

/// Computes the pixels of the rows in `range`. Any split into ranges gives the same bits.
///
/// Centre sampling: the radiance along the centre's ray, exactly. Area sampling: a pixel whose centre and eight
/// neighbours vary linearly, to two tolerances, keeps its centre's value. Others are integrated along lines, by
/// rays that halve the places of jumps, until the row's root mean square error is half the tolerance; where lobes or
/// penumbrae are in a pixel, whose radiance is a mean of rays itself, or few rays do, by scattered rays instead.
///
/// # Errors
/// [`Error::Range`] for rows outside the image, [`Error::Length`] for outputs of another size.
pub fn rows(
    solved: &Solved<'_>,
    camera: &Camera,
    range: Range<usize>,
    target: &mut Target<'_>,
    scratch: &mut [u8],
) -> Result<Tally, Error> {
    let mut solved = *solved;
    prepare(&mut solved, camera);
    prepared_rows(&solved, camera, range, target, scratch)
}

/// Gives a solved scene the settings that the images of a camera need.
#[inline(never)]
pub fn prepare(solved: &mut Solved<'_>, camera: &Camera) {
    solved.settings = solved.settings.of_image(camera, solved);
}

/// [`rows`] of a scene that [`prepare`] made ready for the camera.
// without a copy of the scene, which burdens small stacks
#[inline]
pub fn prepared_rows(
    solved: &Solved<'_>,
    camera: &Camera,
    range: Range<usize>,
    target: &mut Target<'_>,
    scratch: &mut [u8],
) -> Result<Tally, Error> {
    if range.start > range.end || range.end > camera.rows() {
        return Err(Error::Range { field: Field::Rows, band: 0, value: range.end as f64 });
    }
    check(target, range.len() * camera.columns() * solved.shape.bands)?;
    // in one place of the stack: it is large
    let mut painter = Painter::new(solved, camera, range.end, scratch);
    let painter = painter.as_mut().map_err(|error| *error)?;
    if camera.is_parallel() {
        painter.look_beside();
    }
    match camera.sampling() {
        Sampling::Centre => painter.centres(range, target),
        Sampling::Area => painter.areas(range, target),
    }
    Ok(painter.tally)
}

/// Refuses outputs that do not have `expected` values.
fn check(target: &Target<'_>, expected: usize) -> Result<(), Error> {
    if target.image.len() != expected {
        return Err(Error::Length { what: "image", expected, given: target.image.len() });
    }
    for component in target.components.iter().filter(|component| !component.is_empty()) {
        if component.len() != expected {
            return Err(Error::Length { what: "image component", expected, given: component.len() });
        }
    }
    Ok(())
}

/// Rays toward the sun that follow a pixel's ray, on the mean.
const SUN_RAYS: f64 = 8.0;

/// Distance of a pixel's rays from its edges, in pixels: a ray on the very edge may see what lies beyond it.
const PIXEL_MARGIN: f64 = 1e-6;

plain_table! {
    /// A ray's terms and what following it takes, and the sums over scattered rays.
    pub struct PixelScratch {
        /// Of the latest ray.
        pub terms: Terms,
        /// While it is followed.
        pub work: ChainScratch,
        /// Sums over rays.
        pub sums: Terms,
        /// Sums of squares.
        pub squares: [f64; MAX_BANDS],
        /// Radiance that parallel rays see beside the object.
        pub background: Terms,
    }
}

/// First hits of rays through pixel centres.
struct Primary<'m> {
    items: Items<'m>,
    /// Whether facets are drawn, rather than rays traced.
    draws: bool,
    /// Rows in the item buffer.
    drawn: Range<isize>,
    /// Rows from here on are not needed.
    last: isize,
    /// Of parallel rays.
    line: Option<Line>,
}

impl Primary<'_> {
    /// Makes the item buffer hold a row.
    fn draw(&mut self, solved: &Solved<'_>, camera: &Camera, row: isize) {
        if self.draws && !self.drawn.contains(&row) {
            self.drawn = row..self.last.min(row + ROWS_DRAWN as isize).max(row + 1);
            self.items.draw(solved.bvh, &camera.samples(), self.drawn.clone(), -1);
        }
    }

    /// The facet that a pixel's centre shows, as [`Items::facet`] tells.
    #[inline]
    fn facet(&self, row: isize, column: isize) -> u32 {
        if self.draws { self.items.facet(row, column) } else { UNSURE }
    }
}

struct Painter<'a, 's> {
    solved: &'a Solved<'a>,
    camera: &'a Camera,
    centre_rows: Centres<'s>,
    work: &'s mut [f64],
    pixel: &'s mut PixelScratch,
    /// Whether the latest pixel's centre shows the background, rather than [`PixelScratch::terms`].
    beside: bool,
    primary: Primary<'s>,
    occluders: OccluderCache<'s>,
    tally: Tally,
}

/// How the centres of a pixel and of its eight neighbours differ.
struct Neighbourhood {
    /// Whether lobes or penumbrae are in one of them.
    sampled: bool,
    /// Sum of the steps along the three rows, relative to the reference radiance.
    along: f64,
    /// Sum of the steps down the three columns.
    down: f64,
}

impl<'a, 's> Painter<'a, 's> {
    /// In scratch memory of [`scratch_bytes`]; rows from `end` on are not wanted.
    // apart on small machines: does not burden the stack of rays
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn new(
        solved: &'a Solved<'a>,
        camera: &'a Camera,
        end: usize,
        scratch: &'s mut [u8],
    ) -> Result<Painter<'a, 's>, Error> {
        let bands = solved.shape.bands;
        let elements = solved.elements;
        let mut arena = Arena::new(scratch, scratch_bytes(camera, solved.scene, elements)?)?;
        let area = camera.sampling() == Sampling::Area;
        let size = if area { Centres::size(camera.columns(), bands) } else { 0 };
        let centre_rows = Centres::new(arena.take::<f64>(size)?, camera.columns(), bands);
        let work = arena.take::<f64>(work(bands))?;
        let pixel = arena.take::<PixelScratch>(1)?.first_mut();
        let pixel = pixel.ok_or(Error::BufferTooSmall { needed: 1, given: 0 })?;
        pixel.work.gathered.start();
        let lists = arena.take::<Occluders>(OccluderCache::ROOM)?;
        let items = Items::new(&mut arena, camera.columns() + 2, ROWS_DRAWN)?;
        let candidates = Candidates::new(&mut arena, CANDIDATE_FACETS_KEPT)?;
        let fronts = Fronts::new(&mut arena, elements.unknowns(), bands)?;
        let own = solved.bvh.is_own();
        let few = solved.scene.facets() / DRAWN_FACETS_PER_PIXEL <= camera.columns() * camera.rows();
        let last = end as isize + isize::from(area);
        let occluders = if own {
            OccluderCache::new(lists, camera.is_parallel(), camera.pixel_area(), SUN_RAYS)
        } else {
            OccluderCache::none()
        };
        Ok(Painter {
            solved,
            camera,
            centre_rows,
            work,
            pixel,
            beside: false,
            primary: Primary { items, draws: own && few, drawn: 0..0, last, line: None },
            occluders: occluders.with(candidates, fronts),
            tally: Tally::default(),
        })
    }

    /// Finds the common parts of parallel rays: their line, and what they see beside the object.
    #[inline(never)]
    fn look_beside(&mut self) {
        let ray = self.camera.ray(0.0, 0.0);
        self.primary.line = Line::new(&ray);
        let PixelScratch { terms, work, background, .. } = &mut *self.pixel;
        work.gathered.forget();
        self.solved.radiance_with((&ray, None), RaySample::Integrate(0), terms, work, &mut self.occluders);
        *background = *terms;
    }

    #[inline(never)]
    fn centres(&mut self, range: Range<usize>, target: &mut Target<'_>) {
        let columns = self.camera.columns();
        for (i, row) in range.enumerate() {
            self.line(row as isize, 0..columns as isize, |this, pixels, path| {
                this.count_pixel(path.object, [path.variance, path.noise * path.noise], path.tail);
                let terms = this.terms();
                let first = i * columns + pixels.start as usize;
                put(target, this.solved.shape.bands, first..first + pixels.len(), 1.0, |term, band| {
                    [&terms.diffuse, &terms.mirror_sky, &terms.mirror_diffuse].map(|t| t.at(band)).at(term)
                });
            });
        }
    }

    #[inline(never)]
    fn areas(&mut self, range: Range<usize>, target: &mut Target<'_>) {
        let columns = self.camera.columns() as isize;
        let (first, last) = (range.start as isize, range.end as isize);
        if first < last {
            self.line(first - 1, -1..columns + 1, |this, own, path| this.keep(first - 1, own, path));
            self.line(first, -1..columns + 1, |this, own, path| this.keep(first, own, path));
        }
        for row in first..last {
            self.line(row + 1, -1..columns + 1, |this, own, path| this.keep(row + 1, own, path));
            let goal = self.goal(row, columns);
            self.find_thin(row, columns);
            let index = |j: isize| (row - first) as usize * columns as usize + j as usize;
            let mut beside = false;
            for j in 0..columns {
                let at = self.centre_rows.place(row, j);
                let centres = &self.centre_rows;
                let errors = [centres.variance(at), centres.noise(at)];
                let (object, tail) = (centres.is_object(at), centres.tail(at));
                self.count_pixel(object, errors, tail);
                if self.is_flat(at) && !beside {
                    self.write(target, index(j), at);
                    continue;
                }
                beside = self.settle(target, index(j), (row, j), goal);
                let (mut more, mut back) = (beside, j - 1);
                while more && back >= 0 && self.is_flat(self.centre_rows.place(row, back)) {
                    more = self.settle(target, index(back), (row, back), goal);
                    back -= 1;
                }
            }
            for j in 0..columns {
                let at = self.centre_rows.place(row, j);
                if self.is_flat(at) {
                    self.err(at, 0.2 * self.centre_rows.unevenness(at));
                }
            }
        }
    }

    /// Samples a pixel; whether it shows what its centre does not, so that those to its left and right may, too: a strip
    /// passes between the centres of many pixels.
    fn settle(
        &mut self,
        target: &mut Target<'_>,
        index: usize,
        (row, column): (isize, isize),
        goal: f64,
    ) -> bool {
        let at = self.centre_rows.place(row, column);
        let error = self.refine(target, index, row, column, goal);
        self.err(at, error);
        // flat no more
        self.centre_rows.set_unevenness(at, f64::INFINITY);
        let bands = self.solved.shape.bands;
        let values = target.image.part(index * bands..(index + 1) * bands);
        let terms = self.centre_rows.terms(at);
        self.solved.reference.iter().zip(values).enumerate().any(|(band, (reference, value))| {
            let centre = [0, 1, 2].map(|term| terms.at(term * bands + band)).iter().sum::<f64>();
            fabs(f64::from(*value) - f64::from(narrow(centre)))
                > self.solved.settings.budget.flat_pixel * reference
        })
    }

    /// Finds the unevenness about all pixels of a row, and the error that each of its uneven ones may have for the
    /// row's root mean square to be a small part of the tolerance.
    #[inline(never)]
    fn goal(&mut self, row: isize, columns: isize) -> f64 {
        let ErrorBudget { pixels, worst_pixel, .. } = *self.solved.settings.budget;
        let (mut object, mut uneven) = (0.0, 0.0);
        for j in 0..columns {
            let value = self.unevenness(row, j);
            let at = self.centre_rows.place(row, j);
            self.centre_rows.set_unevenness(at, value);
            if self.centre_rows.is_object(at) {
                object += 1.0;
                uneven += f64::from(u8::from(!self.is_flat(at)));
            }
        }
        if uneven > 0.0 { (pixels * sqrt(object / uneven)).min(worst_pixel) } else { worst_pixel }
    }

    /// Whether a pixel keeps its centre's value.
    fn is_flat(&self, at: usize) -> bool {
        let most = self.solved.settings.budget.flat_pixel;
        !self.centre_rows.is_sampled(at) && self.centre_rows.unevenness(at) <= most
    }

    /// Counts the error of an object pixel's area sampling.
    fn err(&mut self, at: usize, error: f64) {
        if self.centre_rows.is_object(at) {
            self.tally.sampling2 += error * error;
        }
    }

    /// Computes the centres of a row: `each` takes the terms ([`Painter::terms`]) of each range of pixels, of one pixel
    /// or of many that show the background.
    #[inline(never)]
    fn line(
        &mut self,
        row: isize,
        columns: Range<isize>,
        mut each: impl FnMut(&mut Self, Range<isize>, &Path),
    ) {
        self.primary.draw(self.solved, self.camera, row);
        self.tally.primary += columns.len() as u64;
        let mut ahead = AnswerBuffer::default();
        let skips = self.primary.draws && self.camera.is_parallel();
        let mut j = columns.start;
        while j < columns.end {
            if skips {
                let next = self.primary.items.next(row, j, columns.end);
                if next > j {
                    self.beside = true;
                    each(self, j..next, &Path::default());
                    j = next;
                    continue;
                }
            }
            let facet = self.primary.facet(row, j);
            let ray = self.centre(row, j);
            let hit = self.first_hit(&mut ahead, &ray, facet, (row, j), &columns);
            self.beside = false;
            let path = self.follow(&ray, hit, row, j);
            each(self, j..j + 1, &path);
            j += 1;
        }
    }

    /// The terms of the latest pixel's centre.
    #[inline]
    fn terms(&self) -> &Terms {
        if self.beside { &self.pixel.background } else { &self.pixel.terms }
    }

    /// The ray through a pixel's centre.
    #[inline]
    fn centre(&self, row: isize, column: isize) -> Ray {
        self.camera.ray(column as f64 + 0.5, row as f64 + 0.5)
    }

    /// First hit of the ray through a pixel's centre, `facet` for all that is known.
    #[inline]
    fn first_hit(
        &self,
        ahead: &mut AnswerBuffer,
        ray: &Ray,
        facet: u32,
        (row, column): (isize, isize),
        columns: &Range<isize>,
    ) -> Option<Hit> {
        if facet == NO_FACET_DRAWN {
            return None;
        }
        if facet != UNSURE
            && let Some(line) = self.primary.line.or_else(|| Line::new(ray))
            && let Some(hit) = self.solved.bvh.meet(&line, ray, facet)
        {
            return Some(hit);
        }
        let number = |j: isize| (j - columns.start) as u32;
        let any =
            |n: u32| if n == number(column) { *ray } else { self.centre(row, columns.start + n as isize) };
        self.solved.bvh.closest_of(ahead, number(column), number(columns.end), any)
    }

    /// Follows the ray of a pixel's centre; its terms are left in [`PixelScratch::terms`].
    #[inline]
    fn follow(&mut self, ray: &Ray, hit: Option<Hit>, row: isize, column: isize) -> Path {
        let seed = hash2(row as u32, column as u32);
        let sample = match self.camera.sampling() {
            Sampling::Centre => RaySample::Integrate(seed),
            Sampling::Area => RaySample::Probe(seed),
        };
        let PixelScratch { terms, work, .. } = &mut *self.pixel;
        work.gathered.forget();
        terms.clear(self.solved.shape.bands);
        let path = self.solved.radiance_with((ray, hit), sample, terms, work, &mut self.occluders);
        self.tally.chain += u64::from(path.rays);
        path
    }

    /// Stores the latest terms as those of the centres of pixels in [`Painter::centre_rows`].
    fn keep(&mut self, row: isize, pixels: Range<isize>, path: &Path) {
        let PixelScratch { terms, background, .. } = &*self.pixel;
        self.centre_rows.store(row, pixels, if self.beside { background } else { terms }, path);
    }

    /// Counts an object pixel and its expected errors.
    fn count_pixel(&mut self, object: bool, [solution, lobes]: [f64; 2], tail: f64) {
        if object {
            self.tally.object_pixels += 1;
            self.tally.noise2 += solution;
            self.tally.sampling2 += lobes;
            self.tally.tail = self.tally.tail.max(tail);
        }
    }

    /// Writes a pixel's centre.
    fn write(&self, target: &mut Target<'_>, index: usize, at: usize) {
        let bands = self.solved.shape.bands;
        let terms = self.centre_rows.terms(at);
        put(target, bands, index..index + 1, 1.0, |term, band| terms.at(term * bands + band));
    }

    /// Largest difference between a pixel's centre and the mean of two opposite neighbours, relative to the reference
    /// radiance.
    fn unevenness(&self, row: isize, column: isize) -> f64 {
        let measure = self.measure();
        let centre = |i: isize, j: isize| self.centre_rows.terms(self.centre_rows.place(row + i, column + j));
        let mut largest: f64 = 0.0;
        for (i, j) in [(0, 1), (1, 0), (1, 1), (1, -1)] {
            let [before, here, after] = [centre(-i, -j), centre(0, 0), centre(i, j)];
            let contrast = measure.step(before, here).max(measure.step(here, after));
            largest = largest.max(measure.bend(before, here, after)).max(CONTRAST_CURVATURE * contrast);
        }
        largest
    }

    /// How values are compared.
    fn measure(&self) -> Measure<'a> {
        Measure { bands: self.solved.shape.bands, reference: self.solved.reference }
    }

    /// Uses final gathering about a pixel's middle first, so that its elements are gathered there, rather than where
    /// lines or scattered rays first meet them.
    #[inline(never)]
    fn gather_about_middle(&mut self, row: isize, column: isize) {
        self.pixel.work.gathered.forget();
        for (x, y) in [(0.5, 0.5), (0.25, 0.25), (0.75, 0.75), (0.25, 0.75), (0.75, 0.25)] {
            let ray = self.camera.ray(column as f64 + x, row as f64 + y);
            let hit = self.solved.bvh.closest(&ray);
            let sample = RaySample::Probe(hash2(row as u32, column as u32));
            let PixelScratch { terms, work, .. } = &mut *self.pixel;
            terms.clear(self.solved.shape.bands);
            let path = self.solved.radiance_with((&ray, hit), sample, terms, work, &mut self.occluders);
            self.tally.primary += 1;
            self.tally.chain += u64::from(path.rays);
            if work.gathered.is_empty() {
                return;
            }
        }
    }

    /// The mean over a pixel's square to about the error `goal`; returns the error expected.
    fn refine(&mut self, target: &mut Target<'_>, index: usize, row: isize, column: isize, goal: f64) -> f64 {
        self.tally.refined += 1;
        if self.solved.gathers() {
            self.gather_about_middle(row, column);
        }
        let Neighbourhood { sampled, along, down } = self.neighbourhood(row, column);
        let contrast = along.max(down);
        let steep = contrast > SCATTER_CONTRAST_MOST * goal;
        // scattered rays are few, and may all miss what is thin
        let thin = !steep && self.is_thin(row, column);
        if !sampled
            && (steep || thin)
            && let Some(error) = self.lines_across(target, index, (row, column), along >= down, goal)
        {
            return error;
        }
        let contrast = if thin { 1.0 } else { contrast };
        self.scatter(target, index, (row, column), contrast, goal)
    }

    /// How the centres about a pixel differ.
    // apart on small machines: does not burden the stack of the pixel's rays
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn neighbourhood(&self, row: isize, column: isize) -> Neighbourhood {
        let mut sampled = false;
        let measure = self.measure();
        let (mut along, mut down) = (0.0, 0.0);
        for i in -1..=1 {
            let centre =
                |i: isize, j: isize| self.centre_rows.terms(self.centre_rows.place(row + i, column + j));
            for j in -1..=1 {
                sampled |= self.centre_rows.is_sampled(self.centre_rows.place(row + i, column + j));
            }
            along += measure.step(centre(i, -1), centre(i, 0)) + measure.step(centre(i, 0), centre(i, 1));
            down += measure.step(centre(-1, i), centre(0, i)) + measure.step(centre(0, i), centre(1, i));
        }
        Neighbourhood { sampled, along, down }
    }

    /// The mean over a pixel's square along lines in the direction in which its neighbourhood changes most; `None` where
    /// lobes or penumbrae are in it.
    fn lines_across(
        &mut self,
        target: &mut Target<'_>,
        index: usize,
        (row, column): (isize, isize),
        along: bool,
        goal: f64,
    ) -> Option<f64> {
        let (solved, camera, measure) = (self.solved, self.camera, self.measure());
        let stride = measure.stride();
        let Painter { work, pixel, occluders, tally, .. } = self;
        let (terms, chain) = (&mut pixel.terms, &mut pixel.work);
        let (outer, rest) = work.split_at_mut_checked(line_integral::memory(stride))?;
        let (inner, out) = rest.split_at_mut_checked(line_integral::memory(stride))?;
        let seed = hash2(row as u32, column as u32);
        let (turn, _) = Sequence::new(seed).pair(0, 0);
        let before = tally.primary;
        let goal = solved.settings.budget.lines * goal;
        let parts = if solved.settings.budget.image < FINE_PIXELS { PIXEL_PARTS_FINE } else { PIXEL_PARTS };
        let mut line = |y: f64, out: &mut [f64]| {
            let shift = turn + PLACE_SHIFT * y;
            let shift = (shift - floor(shift) - 0.5) / parts as f64;
            let narrowest = if tally.primary - before > PIXEL_RAYS_ENOUGH { 1.0 } else { PLACES_NARROWEST };
            integrate(&measure, &Fineness { parts, shift, goal, narrowest }, inner, out, &mut |x, slot| {
                // a ray on the very edge may see what lies beyond it
                let [x, y] = [x, y].map(|x| clamp(x, PIXEL_MARGIN, 1.0 - PIXEL_MARGIN));
                let (x, y) = if along { (x, y) } else { (y, x) };
                let ray = camera.ray(column as f64 + x, row as f64 + y);
                terms.clear(measure.bands);
                let hit = solved.bvh.closest(&ray);
                let path = solved.radiance_with((&ray, hit), RaySample::Probe(seed), terms, chain, occluders);
                tally.primary += 1;
                tally.chain += u64::from(path.rays);
                let (diffuse, rest) = slot.split_at_mut_checked(measure.bands)?;
                let (sky, mirrored) = rest.split_at_mut_checked(measure.bands)?;
                copy(diffuse, &terms.diffuse);
                copy(sky, &terms.mirror_sky);
                copy(mirrored, &terms.mirror_diffuse);
                (!path.sampled).then_some(0.0)
            })
        };
        let fineness = Fineness { parts, shift: 0.0, goal, narrowest: LINES_NARROWEST };
        let error2 = integrate(&measure, &fineness, outer, out, &mut line)?;
        let out = self.work.part(2 * line_integral::memory(stride)..self.work.len());
        put(target, measure.bands, index..index + 1, 1.0, |term, band| out.at(term * measure.bands + band));
        Some(LINE_ERROR_FACTOR * sqrt(error2))
    }

    /// The mean over a pixel's square of scattered rays, as many as their contrast asks for.
    #[inline(never)]
    fn scatter(
        &mut self,
        target: &mut Target<'_>,
        index: usize,
        (row, column): (isize, isize),
        contrast: f64,
        wanted: f64,
    ) -> f64 {
        let bands = self.solved.shape.bands;
        let seed = hash2(row as u32, column as u32);
        let sequence = Sequence::new(seed);
        self.pixel.sums.clear(bands);
        self.pixel.squares.head_mut(bands).fill(0.0);
        let (mut n, mut goal) = (0u32, SCATTER_RAYS_FEWEST);
        let (mut error, mut glare, mut ahead) = (0.0, 0.0f64, AnswerBuffer::default());
        while n < goal {
            let camera = &self.camera;
            let any = |n: u32| {
                let (x, y) = sequence.pair(n, 0);
                camera.ray(column as f64 + x, row as f64 + y)
            };
            let ray = any(n);
            let hit = self.solved.bvh.closest_of(&mut ahead, n, goal, |m| if m == n { ray } else { any(m) });
            glare = glare.max(self.add_ray(&ray, hit, RaySample::Stratum { seed, index: n }));
            n += 1;
            if n == goal {
                let share = 1.0 / f64::from(n);
                // what n rays have not seen of the neighbours' contrast lies in some 1/sqrt(n) of the pixel
                let spread = self.spread(share).max(PIXEL_UNSEEN_SHARE * contrast * sqrt(share));
                error = (SCATTER_ERROR_FACTOR * spread * pow(share, 0.75)).max(glare * share);
                if error > wanted && goal < SCATTER_RAYS_MOST {
                    goal *= 2;
                }
            }
        }
        let sums = &self.pixel.sums;
        let all = [&sums.diffuse, &sums.mirror_sky, &sums.mirror_diffuse];
        put(target, bands, index..index + 1, 1.0 / f64::from(n), |term, band| {
            all.get(term).map_or(0.0, |values| values.at(band))
        });
        error
    }

    /// Adds one scattered ray to the sums of its pixel; returns its glare.
    fn add_ray(&mut self, ray: &Ray, hit: Option<Hit>, sample: RaySample) -> f64 {
        let bands = self.solved.shape.bands;
        let PixelScratch { terms, work, sums, squares, .. } = &mut *self.pixel;
        terms.clear(bands);
        let path = self.solved.radiance_with((ray, hit), sample, terms, work, &mut self.occluders);
        self.tally.primary += 1;
        self.tally.chain += u64::from(path.rays);
        sums.add(terms, bands);
        for (band, square) in squares.iter_mut().enumerate().take(bands) {
            *square += terms.sum(band) * terms.sum(band);
        }
        path.glare
    }

    /// Standard deviation of the scattered rays' radiance over the reference radiance, the largest of all bands; `share` is
    /// that of one ray.
    fn spread(&self, share: f64) -> f64 {
        let mut spread: f64 = 0.0;
        for (band, (square, reference)) in self.pixel.squares.iter().zip(self.solved.reference).enumerate() {
            let mean = share * self.pixel.sums.sum(band);
            let variance = share * square - mean * mean;
            // below: rounding of equal rays
            if variance > 1e-12 * mean * mean {
                spread = spread.max(sqrt(variance) / reference);
            }
        }
        spread
    }
}

/// Writes the terms of pixels, `of` term and band, times `share`.
#[inline]
fn put(
    target: &mut Target<'_>,
    bands: usize,
    pixels: Range<usize>,
    share: f64,
    of: impl Fn(usize, usize) -> f64,
) {
    let values = pixels.start * bands..pixels.end * bands;
    let fill = |out: &mut [f32], band: usize, value: f32| {
        let out = out.part_mut(values.clone());
        if bands == 1 {
            out.fill(value);
        } else {
            pieces(out, bands).for_each(|pixel| pixel.set(band, value));
        }
    };
    for band in 0..bands {
        let terms = [0, 1, 2].map(|term| of(term, band));
        fill(target.image, band, narrow((terms[0] + terms[1] + terms[2]) * share));
        for (component, term) in target.components.iter_mut().zip(terms).filter(|(o, _)| !o.is_empty()) {
            fill(component, band, narrow(term * share));
        }
    }
}
