//! Signatures: the radiant intensity and the projected area of the whole object for a distant observer, without an
//! image.
//!
//! Rays through cells tell all but what the first mirror or narrow lobe shows of the sun, which is found facet by facet
//! (`glints`) and may be far smaller than a cell.
//!
//! Constants of this file are measured by `cargo test --test signature -- --nocapture` (errors beside estimates).

mod glints;

use crate::base::arena::{Arena, Need, plain_table};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::math::{Vec3, frame, sqrt, unit};
use crate::base::qmc::Sequence;
use crate::rays::bvh::AnswerBuffer;
use crate::rays::ray::{Hit, Ray};
use crate::scene::MAX_BANDS;
use crate::view::camera::Camera;
use crate::view::chain::{ChainScratch, OccluderCache, Occluders, Path, RaySample, Solved, Terms};
use crate::view::importance::Importance;
use crate::view::raster::{Lines, Samples, Span};
use core::ops::Range;
use glints::Glints;

/// Rays that look at the object's whole projection along one direction, on a square grid of cells.
#[derive(Clone, Copy, Debug)]
pub struct View {
    samples: Samples,
    cells: usize,
    cell_area: f64,
    /// Rows that look for glints.
    glints: usize,
}

/// Shift of the cells from row to row, in cells: the golden ratio less 1, whose multiples fill a cell evenly.
const CELL_ROW_SHIFT: f64 = 0.618_033_988_749_894_9;

impl View {
    /// The view along `forward` (toward the object), on `cells` x `cells` cells.
    ///
    /// Each cell has one ray. Those of a row stand a cell apart on a line that rises by one cell, and rows are shifted
    /// against each other, so that an outline along either axis of the grid cuts cells everywhere between their edges.
    pub fn new(solved: &Solved<'_>, forward: Vec3, cells: usize) -> Result<View, Error> {
        let forward =
            unit(forward).ok_or(Error::Direction { field: crate::base::error::Field::Direction })?;
        let (right, up) = frame(forward);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in solved.scene.corners().iter().flatten() {
            let p = Vec3::new(corner.dot(right), corner.dot(up), corner.dot(forward));
            (low, high) = (low.min(p), high.max(p));
        }
        let size = high - low;
        let cells = cells.max(1);
        let step = 1.0 / cells as f64;
        let samples = Samples {
            eye: forward * (low.z - 1.0),
            forward,
            right,
            up,
            parallel: true,
            first: (low.x, low.y),
            step: (size.x * step, size.y * step),
            shear: if size.x > 0.0 { size.y * step / size.x } else { 0.0 },
            turn: CELL_ROW_SHIFT,
        };
        let wanted = glints::are_wanted(solved);
        let glints = if wanted { solved.scene.facets().div_ceil(glints::GLINT_FACETS) } else { 0 };
        Ok(View { samples, cells, cell_area: size.x * size.y * step * step, glints })
    }

    /// The view of a camera's middle: along its viewing direction.
    pub fn of_camera(solved: &Solved<'_>, camera: &Camera, cells: usize) -> Result<View, Error> {
        View::new(solved, camera.forward(), cells)
    }

    /// Rows to be computed: those of cells, and those of facets that may show glints.
    pub fn rows(&self) -> usize {
        self.cells + self.glints
    }
}

plain_table! {
    /// Sums over a row of cells, or over several.
    pub struct Sums {
        /// Projected area, in the caller's square units.
        pub area: f64,
        /// Radiant intensity in W/sr, one value per band.
        pub intensity: [f64; MAX_BANDS],
        /// The intensity by every fourth row of cells.
        pub parts: [[f64; MAX_BANDS]; SIGNATURE_SETS],
        /// Rows of each part.
        pub counts: [f64; SIGNATURE_SETS],
        /// Sum of the squares of errors of glints that are in part hidden or in shadow, (W/sr)^2.
        pub doubt2: [f64; MAX_BANDS],
        /// Sum over the projected area of the errors expected of the diffuse solution, of lobes and of chains that were cut,
        /// relative to the reference radiance.
        pub alike: f64,
        /// Sum of [`Path::chance`], weighed as the radiances.
        pub chance: f64,
        /// Rays traced.
        pub rays: u64,
    }
}

/// Number of sets of rows whose differences tell a signature's error: every fourth row each.
const SIGNATURE_SETS: usize = 4;

impl Sums {
    /// Nothing yet.
    pub const ZERO: Sums = Sums {
        area: 0.0,
        intensity: [0.0; MAX_BANDS],
        parts: [[0.0; MAX_BANDS]; SIGNATURE_SETS],
        counts: [0.0; SIGNATURE_SETS],
        doubt2: [0.0; MAX_BANDS],
        alike: 0.0,
        chance: 0.0,
        rays: 0,
    };

    /// Back to nothing.
    fn clear(&mut self) {
        (self.area, self.alike, self.chance) = (0.0, 0.0, 0.0);
        self.intensity.fill(0.0);
        self.parts.iter_mut().for_each(|part| part.fill(0.0));
        self.counts.fill(0.0);
        self.doubt2.fill(0.0);
        self.rays = 0;
    }

    /// Notes that what there is so far is a row of cells.
    fn end_row(&mut self, row: usize) {
        if let (Some(part), Some(count)) =
            (self.parts.get_mut(row % SIGNATURE_SETS), self.counts.get_mut(row % SIGNATURE_SETS))
        {
            part.iter_mut().zip(&self.intensity).for_each(|(part, value)| *part = *value);
            *count = 1.0;
        }
    }

    /// Adds the next row.
    pub fn add(&mut self, next: &Sums) {
        self.area += next.area;
        let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
        add(&mut self.intensity, &next.intensity);
        self.parts.iter_mut().zip(&next.parts).for_each(|(to, from)| add(to, from));
        add(&mut self.counts, &next.counts);
        add(&mut self.doubt2, &next.doubt2);
        self.alike += next.alike;
        self.chance += next.chance;
        self.rays += next.rays;
    }

    /// What a band's intensity by rows of cells is expected to be wrong by: parts of it, each as if it were all, differ the
    /// less the more even the object is.
    fn unevenness(&self, band: usize) -> f64 {
        let rows = self.counts.iter().sum::<f64>();
        let whole = |part: usize| match self.counts.at(part) {
            0.0 => None,
            count => Some(self.parts.get(part).map_or(0.0, |values| values.at(band)) * rows / count),
        };
        let parts = || (0..SIGNATURE_SETS).filter_map(whole);
        let n = parts().count().max(2) as f64;
        let mean = parts().sum::<f64>() / n;
        let squares = parts().map(|value| (value - mean) * (value - mean)).sum::<f64>();
        sqrt(squares / (n * (n - 1.0)))
    }
}

/// Number of rows that are drawn together; small machines have little memory.
const SIGNATURE_ROWS_TOGETHER: usize = if cfg!(feature = "std") { 8 } else { 1 };

/// Most facets of a mesh whose ends are found for each cell: rays cost less beyond.
const DRAWN_FACETS_PER_CELL: usize = 2;

/// Largest gap between facets on a row, in cells, at which they touch.
const SPAN_GAP: f64 = 1e-9;

/// Bytes of scratch memory for [`rows`] and [`whole`].
pub fn scratch_bytes() -> Result<usize, Error> {
    let need = Need::new()
        .and::<Sums>(2)
        .and::<Terms>(1)
        .and::<ChainScratch>(1)
        .and::<Occluders>(OccluderCache::ROOM);
    Lines::need(need, SIGNATURE_ROWS_TOGETHER).bytes()
}

/// The sums over each row of cells in `range`. Any split into ranges gives the same bits.
///
/// On the line through a row the facets that it shows and their ends are found exactly, so that the error of the outline
/// is that of a sum over n lines; what they show is taken from rays up to a cell apart.
///
/// # Errors
/// [`Error::Length`] for `out` of another length, [`Error::BufferTooSmall`] for less than [`scratch_bytes`].
pub fn rows(
    solved: &Solved<'_>,
    view: &View,
    range: Range<usize>,
    scratch: &mut [u8],
    out: &mut [Sums],
) -> Result<(), Error> {
    if out.len() != range.len() {
        return Err(Error::Length { what: "signature rows", expected: range.len(), given: out.len() });
    }
    let mut out = out.iter_mut();
    each_row(solved, view, range, scratch, None, |_, sums| {
        if let Some(out) = out.next() {
            *out = *sums;
        }
    })?;
    Ok(())
}

/// The sums over all cells: those of all [`rows`], added in their order. They stand in the scratch memory.
pub fn whole<'s>(solved: &Solved<'_>, view: &View, scratch: &'s mut [u8]) -> Result<&'s Sums, Error> {
    each_row(solved, view, 0..view.rows(), scratch, None, |all, sums| all.add(sums))
}

/// The same bits, and what the radiant intensity is made of and depends on, added to `importance`, which is all zero before.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub fn explained<'s>(
    solved: &Solved<'_>,
    view: &View,
    scratch: &'s mut [u8],
    importance: &mut Importance<'_>,
) -> Result<&'s Sums, Error> {
    each_row(solved, view, 0..view.rows(), scratch, Some(importance), |all, sums| all.add(sums))
}

/// Calls `each` with what it made of the rows before, at first nothing, and the sums over row after row.
fn each_row<'s>(
    solved: &Solved<'_>,
    view: &View,
    range: Range<usize>,
    scratch: &'s mut [u8],
    importance: Option<&mut Importance<'_>>,
    mut each: impl FnMut(&mut Sums, &Sums),
) -> Result<&'s Sums, Error> {
    let given = scratch.len();
    let needed = scratch_bytes()?;
    let mut arena = Arena::new(scratch, needed)?;
    let short = Error::BufferTooSmall { needed, given };
    let [all, sums] = arena.take::<Sums>(2)? else { return Err(short) };
    let terms = arena.take::<Terms>(1)?.first_mut().ok_or(short)?;
    let work = arena.take::<ChainScratch>(1)?.first_mut().ok_or(short)?;
    let lists = arena.take::<Occluders>(OccluderCache::ROOM)?;
    let mut lines = Lines::new(&mut arena, SIGNATURE_ROWS_TOGETHER)?;
    let own = solved.bvh.is_own();
    let occluders =
        if own { OccluderCache::new(lists, true, view.cell_area, 1.0) } else { OccluderCache::none() };
    let area = view.cell_area / (solved.scene.scale() * solved.scene.scale());
    let solved = &Solved { settings: solved.settings.of_sums(), ..*solved };
    let importance = importance.map(Importance::lend);
    let mut tracer = Tracer { solved, view, area, terms, work, occluders, importance };
    let flat = view.cell_area == 0.0;
    let samples = !own || flat || solved.scene.facets() / DRAWN_FACETS_PER_CELL > view.cells * view.cells;
    let (mut next, end) = (range.start, range.end);
    for row in range {
        sums.clear();
        if row >= view.cells {
            tracer.glints(row - view.cells, sums);
            each(all, sums);
            continue;
        }
        if row == next && !samples {
            next = end.min(view.cells).min(row + SIGNATURE_ROWS_TOGETHER);
            lines.find(solved.bvh, &view.samples, view.cells, row as isize..next as isize);
        }
        match lines.of(row as isize) {
            Some(spans) if !samples => tracer.spans(row, spans, sums),
            _ => tracer.sample(row, sums),
        }
        sums.end_row(row);
        each(all, sums);
    }
    Ok(all)
}

struct Tracer<'a> {
    solved: &'a Solved<'a>,
    view: &'a View,
    /// Of a cell, in the caller's square units.
    area: f64,
    terms: &'a mut Terms,
    work: &'a mut ChainScratch,
    occluders: OccluderCache<'a>,
    importance: Option<Importance<'a>>,
}

impl Tracer<'_> {
    /// Adds the glints of a row of facets.
    #[inline(never)]
    fn glints(&mut self, row: usize, sums: &mut Sums) {
        let Tracer { solved, view, work, importance, .. } = self;
        let whole = self.area * (view.cells * view.cells) as f64;
        let (products, shown) = (&mut work.images, &mut work.before);
        let importance = importance.as_mut();
        Glints { solved, forward: view.samples.forward, whole, products, shown, importance }.row(row, sums);
    }

    /// Adds one ray in each cell of a row.
    #[cold]
    fn sample(&mut self, row: usize, sums: &mut Sums) {
        let (solved, samples) = (self.solved, &self.view.samples);
        let (mut ahead, end) = (AnswerBuffer::default(), self.view.cells as u32);
        let shift = samples.shift(row as isize);
        let ray_of = |column: u32| samples.ray(row as isize, f64::from(column) + shift);
        for column in 0..end {
            let ray = ray_of(column);
            let any = |n| if n == column { ray } else { ray_of(n) };
            let hit = solved.bvh.closest_of(&mut ahead, column, end, any);
            let cells = if hit.is_some() { 1.0 } else { 0.0 };
            let path = self.follow(&ray, hit, (row, column), cells, sums);
            self.add(cells, hit, &path, sums);
        }
    }

    /// Adds what a row shows, piece by piece without gaps: rays a cell apart or less stand for equal parts of each.
    // not inlined: keeps it out of the stack frame of the search for facets on a line, and that out of its own
    #[inline(never)]
    fn spans(&mut self, row: usize, mut spans: impl Iterator<Item = Span> + Clone, sums: &mut Sums) {
        // another place within the parts of each row: facets may be as regular as the cells
        let (place, _) = Sequence::new(0x5160).pair(row as u32, 0);
        let mut next = spans.next();
        while let Some(first) = next {
            let piece = spans.clone();
            let mut end = first.end;
            next = spans.next();
            while let Some(span) = next
                && span.start <= end + SPAN_GAP
            {
                end = span.end;
                next = spans.next();
            }
            self.piece((row, place), first, piece, end, sums);
        }
    }

    /// Adds a piece of a row from the start of the span `first`, which others follow, to `end`.
    fn piece(
        &mut self,
        (row, place): (usize, f64),
        first: Span,
        mut others: impl Iterator<Item = Span>,
        end: f64,
        sums: &mut Sums,
    ) {
        let length = end - first.start;
        let parts = ceiling(length);
        let share = length / f64::from(parts);
        let mut span = first;
        for part in 0..parts {
            let at = first.start + share * (f64::from(part) + place);
            while span.end <= at
                && let Some(next) = others.next()
            {
                span = next;
            }
            let ray = self.view.samples.ray(row as isize, at);
            let solved = self.solved;
            let hit = solved.bvh.closest_among(&ray, &[span.facet()]).or_else(|| solved.bvh.closest(&ray));
            let path = self.follow(&ray, hit, (row, at as u32), share, sums);
            self.add(share, hit, &path, sums);
        }
    }

    /// Finds the terms of a ray.
    #[inline]
    fn follow(
        &mut self,
        ray: &Ray,
        hit: Option<Hit>,
        (row, index): (usize, u32),
        cells: f64,
        sums: &mut Sums,
    ) -> Path {
        self.terms.clear(self.solved.shape.bands);
        sums.rays += 1;
        if hit.is_none() {
            return Path::default();
        }
        let sample = RaySample::Stratum { seed: row as u32, index };
        let mut importance = self.importance.as_mut();
        if let Some(importance) = importance.as_deref_mut() {
            importance.weigh(cells * self.area);
        }
        let (seen, noted) = ((ray, hit), (&mut self.occluders, importance));
        let path = self.solved.radiance_noted(seen, sample, self.terms, self.work, noted);
        sums.rays += u64::from(path.rays);
        path
    }

    /// Adds the latest terms for `cells` cells.
    #[inline]
    fn add(&mut self, cells: f64, hit: Option<Hit>, path: &Path, sums: &mut Sums) {
        let area = cells * self.area;
        sums.alike += area * (sqrt(path.variance) + path.tail);
        sums.chance += area * path.chance;
        sums.area += area;
        for (band, i) in sums.intensity.iter_mut().take(self.solved.shape.bands).enumerate() {
            *i += self.terms.sum(band) * area;
        }
        if let Some((importance, hit)) = self.importance.as_mut().zip(hit) {
            importance.add_ray(hit.facet as usize, self.terms);
        }
    }
}

/// The whole number at or above a positive one, at least 1.
fn ceiling(x: f64) -> u32 {
    let whole = x as u32;
    whole + u32::from(f64::from(whole) < x || whole == 0)
}

/// What the sums say of one band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signature {
    /// Radiant intensity toward the observer in W/sr.
    pub intensity: f64,
    /// Mean radiance of the object; 0 where nothing of it is seen.
    pub mean_radiance: f64,
    /// (mean radiance - background) / background; `None` where the background is 0.
    pub contrast: Option<f64>,
    /// What the intensity is expected to be wrong by, W/sr; glints that may lie between cells are not among it.
    pub error: f64,
    /// Glints that may lie between cells, or be met by chance and count too much: what they bring on the mean, W/sr. Those
    /// that more than one curved mirror shows are not looked for.
    pub unresolved: f64,
}

/// Factor on the error of a signature's rows that the differences between its sets tell: four times as many rows are
/// more than twice as even.
const CELL_ROWS_ERROR_FACTOR: f64 = 1.05;

/// Share of the errors of elements, lobes and chains that adds up over a view: those of different places are partly
/// independent.
const ERRORS_ALIKE_SHARE: f64 = 0.5;

impl Signature {
    /// The signature in `band`, of which `reference` is the reference radiance, against a background radiance.
    pub fn new(sums: &Sums, band: usize, reference: f64, background: f64) -> Signature {
        let intensity = sums.intensity.at(band);
        let mean_radiance = if sums.area > 0.0 { intensity / sums.area } else { 0.0 };
        let contrast = (background > 0.0).then(|| (mean_radiance - background) / background);
        let (rows, alike) =
            (CELL_ROWS_ERROR_FACTOR * sums.unevenness(band), ERRORS_ALIKE_SHARE * reference * sums.alike);
        let error = sqrt(rows * rows + sums.doubt2.at(band) + alike * alike);
        Signature { intensity, mean_radiance, contrast, error, unresolved: reference * sums.chance }
    }
}
