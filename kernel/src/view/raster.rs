//! Which facet each ray of a regular grid meets first, by drawing the facets: the hits of [`Bvh::closest`], bit for bit.
//!
//! Facets are drawn into an item buffer with edge functions and depths that are linear on the grid (homogeneous, so that
//! nothing is clipped at the eye; M. Olano, T. Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates",
//! 1997). Their rounding errors are bounded: where a sample lies within the bound of an edge, or two depths within
//! theirs of each other, the sample is left to a ray. Everywhere else the drawing has found the one facet that the ray
//! meets first, and distance and place on it are those of [`crate::rays::ray`].
//!
//! Constants of this file are measured by `cargo test --test raster` (pixels against rays).

mod spans;

pub use spans::{Lines, Span};

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, fabs, floor, sqrt, unit};
use crate::rays::bvh::{Bvh, HalfSpace};
use crate::rays::ray::Ray;
use core::ops::Range;

/// In place of a facet: nothing is met.
pub const NO_FACET_DRAWN: u32 = u32::MAX;

/// In place of a facet: drawing cannot tell what is met, and a ray does.
pub const UNSURE: u32 = u32::MAX - 1;

/// Rays of a grid: parallel, or through the eye.
///
/// In the image plane, with x along `right` and y along `up` (lengths; tangents where rays pass through the eye),
/// sample k of row r is at x = first.0 + step.0 (k + [`Samples::shift`] of the row) and y = first.1 + step.1 r +
/// shear (x - first.0). It looks along `forward` from eye + x right + y up, or from the eye along forward + x right + y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples {
    /// Where rays start, or the middle of the plane in which they do; hits before it do not count.
    pub eye: Vec3,
    /// The direction of parallel rays; unit vectors at right angles with the next two.
    pub forward: Vec3,
    /// The image's x.
    pub right: Vec3,
    /// The image's y.
    pub up: Vec3,
    /// Whether rays are parallel.
    pub parallel: bool,
    /// Sample 0 of row 0.
    pub first: (f64, f64),
    /// From sample to sample, and from row to row; not 0.
    pub step: (f64, f64),
    /// Slope of the rows.
    pub shear: f64,
    /// Rows are shifted by the fractions of odd multiples of half of this; 0: not at all.
    pub turn: f64,
}

impl Samples {
    /// How far a row's samples are shifted, in samples, in [0, 1).
    #[inline]
    pub fn shift(&self, row: isize) -> f64 {
        if self.turn == 0.0 {
            return 0.0;
        }
        let turned = (row as f64 + 0.5) * self.turn;
        turned - floor(turned)
    }

    /// The ray of sample `column` of a row, from which it may stand a fraction apart, but for the row's shift.
    #[inline]
    pub fn ray(&self, row: isize, column: f64) -> Ray {
        let x = self.step.0 * column;
        let y = self.first.1 + self.step.1 * row as f64 + self.shear * x;
        let aside = self.right * (self.first.0 + x) + self.up * y;
        if self.parallel {
            return Ray::new(self.eye + aside, self.forward);
        }
        let direction = self.forward + aside;
        Ray::new(self.eye, unit(direction).unwrap_or(self.forward))
    }
}

/// An item buffer: some rows of samples, each with the facet that it meets.
#[derive(Debug)]
pub struct Items<'m> {
    /// Nearness of the facet met: minus its depth, or 1 over it.
    near: &'m mut [f64],
    /// The most that something could have of which it is not certain that it is there, or that it is hidden.
    doubt: &'m mut [f64],
    facets: &'m mut [u32],
    columns: usize,
    /// First column and row of those drawn last.
    first: (isize, isize),
    margin: Margin,
}

/// How far two nearnesses must be apart for the greater one to be the nearer for certain: a constant where nearness is
/// minus the depth, in proportion to its square where it is 1 over it.
#[derive(Clone, Copy, Debug, Default)]
struct Margin {
    constant: f64,
    square: f64,
}

impl Margin {
    #[inline(always)]
    fn of(self, near: f64) -> f64 {
        self.constant + self.square * near * near
    }
}

impl<'m> Items<'m> {
    /// Adds the memory of a buffer of `columns` times `rows` samples.
    pub const fn need(need: Need, columns: usize, rows: usize) -> Need {
        let size = columns.saturating_mul(rows);
        need.and::<f64>(size).and::<f64>(size).and::<u32>(size)
    }

    /// Takes a buffer of `columns` times `rows` samples from the arena.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] where the arena has less than [`Items::need`].
    pub fn new(arena: &mut Arena<'m>, columns: usize, rows: usize) -> Result<Items<'m>, Error> {
        let size = columns.saturating_mul(rows);
        let (near, doubt, facets) = (arena.take(size)?, arena.take(size)?, arena.take(size)?);
        Ok(Items { near, doubt, facets, columns, first: (0, 0), margin: Margin::default() })
    }

    /// Rows that it has room for.
    pub fn rows(&self) -> usize {
        self.facets.len() / self.columns.max(1)
    }

    /// The facet that a sample meets first, [`NO_FACET_DRAWN`] or [`UNSURE`]; the sample is one of those drawn last.
    #[inline]
    pub fn facet(&self, row: isize, column: isize) -> u32 {
        let at = (row - self.first.1) as usize * self.columns + (column - self.first.0) as usize;
        let (near, doubt, facet) = (self.near.at(at), self.doubt.at(at), self.facets.at(at));
        if doubt == f64::NEG_INFINITY {
            return facet;
        }
        if facet == NO_FACET_DRAWN || doubt >= near - 2.0 * self.margin.of(near) { UNSURE } else { facet }
    }

    /// What [`Items::facet`] finds first in a row from `column` on that is not certain to be nothing; `end` if it is
    /// nothing up to there.
    pub fn next(&self, row: isize, column: isize, end: isize) -> isize {
        let start = (row - self.first.1) as usize * self.columns;
        let places = start + (column - self.first.0) as usize..start + (end - self.first.0) as usize;
        let (facets, doubt) = (self.facets.part(places.clone()), self.doubt.part(places));
        let something = |(&facet, &doubt): (&u32, &f64)| facet != NO_FACET_DRAWN || doubt > f64::NEG_INFINITY;
        facets.iter().zip(doubt).position(something).map_or(end, |n| column + n as isize)
    }

    /// Draws all facets on the samples of the rows `rows`, as many as there is room for, from column `first` on.
    pub fn draw(&mut self, bvh: &Bvh<'_>, samples: &Samples, rows: Range<isize>, first: isize) {
        self.near.fill(f64::NEG_INFINITY);
        self.doubt.fill(f64::NEG_INFINITY);
        self.facets.fill(NO_FACET_DRAWN);
        self.first = (first, rows.start);
        let rows = rows.start..rows.end.min(rows.start + self.rows() as isize);
        let view = View::new(bvh, samples, (first, self.columns), rows);
        self.margin = view.margin;
        bvh.within(&view.region(), |facet| {
            if let Some((corners, normal)) = bvh.corners(facet) {
                self.draw_facet(&view, facet, corners, normal);
            }
            true
        });
    }

    fn draw_facet(&mut self, view: &View<'_>, facet: u32, corners: [Vec3; 3], normal: Vec3) {
        let Some(triangle) = Triangle::new(view, corners, normal) else { return };
        for row in triangle.rows.clone() {
            if triangle.certain {
                self.draw_row(view, &triangle, facet, row, triangle.sign);
            } else {
                self.doubt_row(view, &triangle, row, triangle.sign);
                if triangle.thin {
                    self.doubt_row(view, &triangle, row, -triangle.sign);
                }
            }
        }
    }

    /// A facet on one row.
    #[inline]
    fn draw_row(&mut self, view: &View<'_>, triangle: &Triangle, facet: u32, row: isize, sign: f64) {
        let Some(span) = triangle.span(view, row, sign) else { return };
        let (x, y) = view.place(span.all.start, row);
        let [slope, down, level] = triangle.near;
        let start = level + down * y + slope * x;
        let margin = self.margin;
        let at = (row - self.first.1) as usize * self.columns;
        let part = |columns: &Range<isize>| {
            let [start, end] = [columns.start, columns.end].map(|k| at + (k - self.first.0) as usize);
            start..end
        };
        let all = part(&span.all);
        let (near, doubt) = (self.near.part_mut(all.clone()), self.doubt.part_mut(all.clone()));
        let places = near.iter_mut().zip(doubt).zip(self.facets.part_mut(all));
        for (k, ((near, doubt), item)) in places.enumerate() {
            let own = start + slope * k as f64;
            let both = 2.0 * margin.of(own);
            if own < *near - both {
                continue;
            }
            let column = span.all.start + k as isize;
            if !span.inside.contains(&column) || own <= *near + both {
                // on an edge, or as near as another
                *doubt = doubt.max(own.max(*near));
                if !span.inside.contains(&column) {
                    continue;
                }
            }
            if own > *near {
                (*near, *item) = (own, facet);
            }
        }
    }

    /// Leaves all of a row that a facet may cover to rays.
    #[cold]
    fn doubt_row(&mut self, view: &View<'_>, triangle: &Triangle, row: isize, sign: f64) {
        let Some(span) = triangle.span(view, row, sign) else { return };
        let at = (row - self.first.1) as usize * self.columns;
        let [start, end] = [span.all.start, span.all.end].map(|k| at + (k - self.first.0) as usize);
        self.doubt.part_mut(start..end).fill(f64::INFINITY);
    }
}

/// Depths at cosines down to [`RASTER_COSINE_GRAZING`], those drawn and those of hits, are off by less than 2^-40 of
/// the farthest distance from the eye; depths closer than this part of it are not told apart.
const RASTER_DEPTH_ROUNDING: f64 = 1.0 / (1u64 << 34) as f64;

/// Least cosine of facets that are drawn; others are left to rays.
const RASTER_COSINE_GRAZING: f64 = 1.0 / (1u32 << 9) as f64;

/// Rounding of a corner's place on the grid, per unit of what it is computed from: a dozen operations.
const PLACE: f64 = 1.0 / (1u64 << 48) as f64;

/// Rounding of an edge function, per square of the sum of its corners' coordinates: eight operations.
const EDGE_FUNCTION_ROUNDING: f64 = 1.0 / (1u64 << 49) as f64;

/// What drawing some rows takes.
struct View<'a> {
    samples: &'a Samples,
    rows: Range<isize>,
    columns: Range<isize>,
    /// Numbers are small about the middle of what is drawn.
    middle: (f64, f64),
    /// Half the extent of what is drawn, in samples.
    size: f64,
    /// Rounding of a corner's place.
    place: f64,
    /// The most by which depths are off.
    depth: f64,
    margin: Margin,
}

impl<'a> View<'a> {
    fn new(
        bvh: &Bvh<'_>,
        samples: &'a Samples,
        (first, count): (isize, usize),
        rows: Range<isize>,
    ) -> View<'a> {
        let columns = first..first + count as isize;
        let (low, high) = bvh.bounds();
        let far = (low - samples.eye).abs().max((high - samples.eye).abs());
        let far = far.x + far.y + far.z;
        let (x, y) = samples.first;
        let tangent = if samples.parallel { fabs(x) + fabs(y) } else { (fabs(x) + fabs(y)) * far };
        let (across, down) = (fabs(samples.step.0), fabs(samples.step.1));
        let place = PLACE * (far + tangent) * (1.0 + fabs(samples.shear)) * (1.0 / across + 1.0 / down);
        let depth = RASTER_DEPTH_ROUNDING * (far + tangent);
        let margin = if samples.parallel {
            Margin { constant: depth, square: 0.0 }
        } else {
            Margin { constant: 0.0, square: depth }
        };
        let middle = |range: &Range<isize>| 0.5 * (range.start + range.end) as f64;
        let middle = (middle(&columns), middle(&rows));
        let size = 2.0 + 0.5 * (count as f64 + (rows.end - rows.start) as f64);
        View { samples, rows, columns, middle, size, place, depth, margin }
    }

    /// What is seen on the rows and columns, and a little more.
    fn region(&self) -> [HalfSpace; 5] {
        let s = self.samples;
        let along = |axis: Vec3, origin: f64, step: f64, at: f64, side: f64| {
            // axis.m - (origin + step at) w has the sign of `side` times the step's
            let side = if step < 0.0 { -side } else { side };
            let offset = origin + step * at;
            let normal = if s.parallel { axis } else { axis - s.forward * offset };
            let height = if s.parallel { normal.dot(s.eye) + offset } else { normal.dot(s.eye) };
            let length = sqrt(normal.dot(normal));
            HalfSpace { normal: normal * (side / length), height: height * (side / length) }
        };
        let up = s.up - s.right * s.shear;
        let level = s.first.1 - s.shear * s.first.0;
        let (top, bottom) = (self.rows.start as f64 - 0.5, self.rows.end as f64 - 0.5);
        let (left, right) = (self.columns.start as f64 - 0.5, self.columns.end as f64 + 0.5);
        [
            along(up, level, s.step.1, top, 1.0),
            along(up, level, s.step.1, bottom, -1.0),
            along(s.right, s.first.0, s.step.0, left, 1.0),
            along(s.right, s.first.0, s.step.0, right, -1.0),
            HalfSpace { normal: s.forward, height: s.forward.dot(s.eye) },
        ]
    }

    /// Where a sample is, about the middle.
    #[inline]
    fn place(&self, column: isize, row: isize) -> (f64, f64) {
        (column as f64 + self.samples.shift(row) - self.middle.0, row as f64 - self.middle.1)
    }

    /// A corner's homogeneous place about the middle, and its depth.
    #[inline]
    fn project(&self, corner: Vec3) -> (Vec3, f64) {
        let s = self.samples;
        let moved = corner - s.eye;
        let depth = moved.dot(s.forward);
        let w = if s.parallel { 1.0 } else { depth };
        let x = moved.dot(s.right) - s.first.0 * w;
        let y = moved.dot(s.up) - s.first.1 * w - s.shear * x;
        (Vec3::new(x / s.step.0 - self.middle.0 * w, y / s.step.1 - self.middle.1 * w, w), depth)
    }
}

/// A facet on the grid.
struct Triangle {
    /// Edge functions: x, y and constant coefficients.
    edges: [[f64; 3]; 3],
    /// 1 over their x coefficients; infinity for those that hardly depend on x.
    inverse: [f64; 3],
    /// What they are off by at most.
    error: f64,
    /// Their sign inside.
    sign: f64,
    /// Nearness: x, y and constant coefficients.
    near: [f64; 3],
    rows: Range<isize>,
    /// About the middle.
    columns: (f64, f64),
    /// Whether nearness and sides are certain.
    certain: bool,
    /// Whether the sign is not.
    thin: bool,
}

/// Columns of a row that a facet covers.
struct Covered {
    /// All that it may cover.
    all: Range<isize>,
    /// Those that it covers for certain.
    inside: Range<isize>,
}

impl Triangle {
    #[inline]
    fn new(view: &View<'_>, corners: [Vec3; 3], normal: Vec3) -> Option<Triangle> {
        let [(a, p), (b, q), (c, r)] = corners.map(|corner| view.project(corner));
        let shallow = p.min(q).min(r);
        if p.max(q).max(r) < -view.depth {
            return None; // behind
        }
        let parallel = view.samples.parallel;
        let before = shallow > view.depth;
        let (rows, columns) = if parallel || before { bounds(view, [a, b, c])? } else { everything(view) };
        let reach = |v: Vec3| fabs(v.x) + fabs(v.y) + view.size * fabs(v.z);
        let most = reach(a).max(reach(b)).max(reach(c));
        let error = EDGE_FUNCTION_ROUNDING * most * most + 4.0 * view.place * most;
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(edges[0]);
        let inverse = edges.map(|e| if fabs(e.x) * view.size > error { 1.0 / e.x } else { f64::INFINITY });
        let thin = fabs(volume) <= 8.0 * error;
        let samples = view.samples;
        let first = corners[0] - samples.eye;
        let height = normal.dot(first);
        let [ahead, across, up] = [samples.forward, samples.right, samples.up].map(|axis| normal.dot(axis));
        // minus the depth, or 1 over it, by the facet's plane
        let base = samples.first.0 * across + samples.first.1 * up;
        let (share, base) =
            if parallel { (1.0 / ahead, base - height) } else { (1.0 / height, base + ahead) };
        let (slope, down) =
            ((across + samples.shear * up) * samples.step.0 * share, up * samples.step.1 * share);
        let near = [slope, down, base * share + slope * view.middle.0 + down * view.middle.1];
        let farthest = corners.map(|corner| (corner - samples.eye).length_squared());
        let farthest = farthest[0].max(farthest[1]).max(farthest[2]);
        let (sine, length) = if parallel { (ahead, 1.0) } else { (height, farthest) };
        let steep =
            sine * sine >= RASTER_COSINE_GRAZING * RASTER_COSINE_GRAZING * normal.length_squared() * length;
        let certain = !thin && steep && (before || !parallel);
        Some(Triangle {
            edges: edges.map(|e| e.to_array()),
            inverse,
            error,
            sign: if volume < 0.0 { -1.0 } else { 1.0 },
            near,
            rows,
            columns,
            certain,
            thin,
        })
    }

    /// Where a row enters the facet and where it leaves it, about the middle.
    #[inline]
    fn ends(&self, view: &View<'_>, row: isize) -> Option<(f64, f64)> {
        let (_, y) = view.place(0, row);
        let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
        for (&[x, down, level], &inverse) in self.edges.iter().zip(&self.inverse) {
            let rest = down * y + level;
            if inverse.is_infinite() {
                if rest * self.sign < 0.0 {
                    return None;
                }
            } else if x * self.sign > 0.0 {
                start = start.max(-rest * inverse);
            } else {
                end = end.min(-rest * inverse);
            }
        }
        (start < end && end - start < f64::INFINITY).then_some((start, end))
    }

    /// What the facet covers of a row.
    #[inline]
    fn span(&self, view: &View<'_>, row: isize, sign: f64) -> Option<Covered> {
        let (origin, y) = view.place(0, row);
        let (mut outer, mut inner) = (self.columns, (f64::NEG_INFINITY, f64::INFINITY));
        for (&[x, down, level], &inverse) in self.edges.iter().zip(&self.inverse) {
            let rest = down * y + level;
            if inverse.is_infinite() {
                // at most the error by its x
                if rest * sign < -2.0 * self.error {
                    return None;
                }
                inner.0 = if rest * sign < 2.0 * self.error { f64::INFINITY } else { inner.0 };
                continue;
            }
            // places within the view are rounded to some 2^-37
            let (at, off) = (-rest * inverse, self.error * fabs(inverse) + ROUNDED);
            if x * sign > 0.0 {
                (outer.0, inner.0) = (outer.0.max(at - off), inner.0.max(at + off));
            } else {
                (outer.1, inner.1) = (outer.1.min(at + off), inner.1.min(at - off));
            }
        }
        let all = whole(outer.0 - origin, outer.1 - origin, &view.columns);
        let inside = whole(inner.0 - origin, inner.1 - origin, &all);
        (!all.is_empty()).then_some(Covered { all, inside })
    }
}

/// Slack of places on the grid: far above the rounding of places up to 2^17, far below 1.
const ROUNDED: f64 = 1.0 / (1u64 << 30) as f64;

/// Whole numbers from `low` to `high` among `range`.
#[inline]
fn whole(low: f64, high: f64, range: &Range<isize>) -> Range<isize> {
    let (start, end) = (range.start as f64, range.end as f64);
    let low = if low > start { low } else { start };
    let high = if high < end - 1.0 { high } else { end - 1.0 };
    if low > high {
        return range.start..range.start;
    }
    // rounded away from 0 or toward it, as the sign has it
    let (near, far) = (low as isize, high as isize);
    near + isize::from((near as f64) < low)..far + 1 - isize::from(far as f64 > high)
}

/// Rows and columns that corners before the eye span, if any.
#[inline]
fn bounds(view: &View<'_>, corners: [Vec3; 3]) -> Option<(Range<isize>, (f64, f64))> {
    let (mut low, mut high) = ((f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY));
    let mut pad: f64 = 0.0;
    for v in corners {
        let share = 1.0 / v.z;
        let (x, y) = (v.x * share, v.y * share);
        (low, high) = ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)));
        pad = pad.max(view.place * share * (2.0 + fabs(x) + fabs(y)));
    }
    let pad = pad + ROUNDED;
    let rows = whole(low.1 - pad + view.middle.1, high.1 + pad + view.middle.1, &view.rows);
    let columns = (low.0 - pad, high.0 + pad);
    let seen = columns.1 >= view.columns.start as f64 - view.middle.0
        && columns.0 <= view.columns.end as f64 - view.middle.0;
    (seen && !rows.is_empty()).then_some((rows, columns))
}

/// All that is drawn.
#[cold]
fn everything(view: &View<'_>) -> (Range<isize>, (f64, f64)) {
    (view.rows.clone(), (-2.0 * view.size, 2.0 * view.size))
}
