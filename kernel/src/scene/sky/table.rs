//! Skies given by samples, bilinear in elevation and azimuth.
//!
//! Constants of this file are measured by `cargo test --test table_suns` (suns of sky tables).

use super::{RADIANCE_LARGEST, SkyTable};
use crate::base::error::{Error, Field};
use crate::base::index::{Index, parts};
use crate::base::math::{FRAC_PI_2, PI, TAU, Vec3, acos, atan2, clamp, cos, fabs, floor, sin, sqrt, unit};
use crate::base::quadrature::rule;

/// A validated table in the frame (x toward azimuth 0, y, up).
#[derive(Clone, Copy, Debug)]
pub(super) struct Table<'a> {
    rows: usize,
    columns: usize,
    bands: usize,
    samples: &'a [f32],
    x: Vec3,
    y: Vec3,
    up: Vec3,
    /// The spot that was taken out as a sun.
    spot: Option<Spot>,
}

/// A bright spot of a table: of each sample of a window the part of the brightest one's spectrum that exceeds what stands
/// about it.
#[derive(Clone, Copy, Debug)]
struct Spot {
    first_row: usize,
    /// Number of rows.
    rows: usize,
    /// Wrapped.
    first_column: usize,
    /// Number of columns.
    columns: usize,
    /// Where the brightest sample begins.
    peak: usize,
    /// Share of its spectrum that is left.
    base: f64,
}

/// A sun that a table holds.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct SpotSun<'a> {
    /// Toward its middle.
    pub direction: Vec3,
    /// Of the disc, in radians.
    pub half_angle: f64,
    /// The brightest sample, one value or one of each band.
    pub samples: &'a [f32],
    /// Irradiance of a plane that faces it, over that sample's radiance.
    pub scale: f64,
}

/// Half the width of the window about a bright sample, in radians: a blurred sun and its glow.
const WINDOW: f64 = 0.05;

/// Least ratio of a sun's brightest sample to what stands about its window.
const BRIGHT: f64 = 20.0;

/// One elevation of the quadrature: the plane's cosine there is `constant + swing cos(azimuth - normal's)`,
/// positive within `arc` (cosine `cos_arc`) of the normal's azimuth.
#[derive(Clone, Copy, Default)]
struct Ring {
    constant: f64,
    swing: f64,
    /// Quadrature weight times the cosine of elevation, shared out to the upper and the lower row of samples.
    shares: [f64; 2],
    arc: f64,
    cos_arc: f64,
    sin_arc: f64,
}

/// Rings of one panel between two rows of samples: up to 16 points.
struct Rings {
    rings: [Ring; 16],
    count: usize,
}

/// From one column's centre to the next: azimuth from the normal's, and the cosines and sines of the ends.
#[derive(Clone, Copy)]
struct Cell {
    start: f64,
    size: f64,
    cos: [f64; 2],
    sin: [f64; 2],
}

impl<'a> Table<'a> {
    pub(super) fn new(input: &SkyTable<'a>, factors: &[f64], up: Vec3) -> Result<Table<'a>, Error> {
        let field = Field::SkyTable;
        for steps in [input.rows, input.columns] {
            if steps == 0 {
                return Err(Error::Range { field, band: 0, value: 0.0 });
            }
        }
        if input.bands != 1 && input.bands != factors.len() {
            return Err(Error::LightBandCount { field, expected: factors.len(), given: input.bands });
        }
        let expected = input.rows.saturating_mul(input.columns).saturating_mul(input.bands);
        if input.radiance.len() != expected {
            return Err(Error::Length { what: "sky table", expected, given: input.radiance.len() });
        }
        let factor = |band: usize| match input.bands {
            1 => factors.iter().fold(0.0, |largest: f64, factor| largest.max(*factor)),
            _ => factors.get(band).copied().unwrap_or(0.0),
        };
        for sample in parts(input.radiance, input.bands) {
            for (band, &value) in sample.iter().enumerate() {
                let value = f64::from(value);
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(Error::Range { field, band, value });
                }
                if value * factor(band) > RADIANCE_LARGEST {
                    return Err(Error::Range { field, band, value: value * factor(band) });
                }
            }
        }
        let x = azimuth_zero(input.azimuth_zero, up)?;
        Ok(Table {
            rows: input.rows,
            columns: input.columns,
            bands: input.bands,
            samples: input.radiance,
            x,
            y: up.cross(x),
            up,
            spot: None,
        })
    }

    /// The sample of a row and a column.
    fn sample(&self, row: usize, column: usize) -> &'a [f32] {
        let start = (row * self.columns + column) * self.bands;
        self.samples.get(start..start + self.bands).unwrap_or(&[])
    }

    /// By how much of the brightest sample a sample counts: the least over the bands, so that nothing is left below 0.
    fn ratio(&self, sample: &[f32], peak: &[f32]) -> f64 {
        let of = |(value, peak): (&f32, &f32)| match *peak > 0.0 {
            true => f64::from(*value) / f64::from(*peak),
            false => f64::INFINITY,
        };
        sample.iter().zip(peak).map(of).fold(f64::INFINITY, f64::min)
    }

    /// The part of the brightest sample's spectrum that was taken out at a row and a column.
    fn taken(&self, spot: &Spot, row: usize, column: usize) -> f64 {
        let across = (column + self.columns - spot.first_column) % self.columns.max(1);
        if !(spot.first_row..spot.first_row + spot.rows).contains(&row) || across >= spot.columns {
            return 0.0;
        }
        let peak = self.samples.get(spot.peak..spot.peak + self.bands).unwrap_or(&[]);
        let ratio = self.ratio(self.sample(row, column), peak);
        if ratio > spot.base && ratio.is_finite() { ratio - spot.base } else { 0.0 }
    }

    /// The direction of a row's and a column's middle.
    fn toward(&self, row: f64, column: f64) -> Vec3 {
        let (elevation, azimuth) =
            (FRAC_PI_2 - (row + 0.5) * PI / self.rows as f64, (column + 0.5) * TAU / self.columns as f64);
        let level = self.x * cos(azimuth) + self.y * sin(azimuth);
        level * cos(elevation) + self.up * sin(elevation)
    }

    /// Largest share of a spectrum in the samples on the rim of a window.
    fn rim(&self, window: &Spot, spectrum: &[f32]) -> f64 {
        let (top, bottom) = (window.first_row, window.first_row + window.rows - 1);
        let wide = window.columns + 2;
        let mut base: f64 = 0.0;
        for row in top.saturating_sub(1)..=(bottom + 1).min(self.rows - 1) {
            for across in 0..wide {
                let edge = row < top || row > bottom || across == 0 || across == wide - 1;
                let column = self.wrapped(window.first_column as isize + across as isize - 1);
                let ratio = self.ratio(self.sample(row, column), spectrum);
                base = base.max(if edge && ratio.is_finite() { ratio } else { 0.0 });
            }
        }
        base
    }

    /// Irradiance of a spot over its peak's radiance, its weighted middle, and the weighted squared distances from that.
    fn moments(&self, spot: &Spot) -> (f64, Vec3, f64) {
        let step = (PI / self.rows as f64, TAU / self.columns as f64);
        let (mut energy, mut middle, mut square) = (0.0, Vec3::ZERO, 0.0);
        for pass in 0..2 {
            let axis = unit(middle).unwrap_or(Vec3::Z);
            (energy, square) = (0.0, 0.0);
            let rows = spot.first_row..spot.first_row + spot.rows;
            for (row, across) in rows.flat_map(|row| (0..spot.columns).map(move |a| (row, a))) {
                let column = self.wrapped(spot.first_column as isize + across as isize);
                let height = FRAC_PI_2 - (row as f64 + 0.5) * step.0;
                let share = self.taken(spot, row, column) * step.0 * step.1 * cos(height);
                let toward = self.toward(row as f64, column as f64);
                energy += share;
                if pass == 0 {
                    middle += toward * share;
                } else {
                    square += share * (toward - axis).length_squared();
                }
            }
        }
        (energy, middle, square)
    }

    /// A column of the table, counted around.
    fn wrapped(&self, column: isize) -> usize {
        column.rem_euclid((self.columns as isize).max(1)) as usize
    }

    /// Takes the brightest spot out, where it is small and far brighter than what stands about it. `factors` are the bands'.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    pub(super) fn take_sun(&mut self, factors: &[f64]) -> Option<SpotSun<'a>> {
        let weight = |sample: &[f32]| {
            let factor = |band: usize| factors.get(band).copied().unwrap_or(1.0);
            sample.iter().enumerate().map(|(band, value)| f64::from(*value) * factor(band)).sum::<f64>()
        };
        let brightest = |(best, most): (usize, f64), (place, sample): (usize, &[f32])| {
            let own = weight(sample);
            if own > most { (place, own) } else { (best, most) }
        };
        let (place, most) = parts(self.samples, self.bands).enumerate().fold((0, 0.0), brightest);
        let (row, column) = (place / self.columns.max(1), place % self.columns.max(1));
        let step = (PI / self.rows as f64, TAU / self.columns as f64);
        let down = 1 + (WINDOW / step.0) as usize;
        // columns draw together toward the poles
        let level = cos(FRAC_PI_2 - (row as f64 + 0.5) * step.0);
        let aside = 1 + (WINDOW / (step.1 * level.max(step.0))) as usize;
        let (top, bottom) = (row.saturating_sub(down), (row + down).min(self.rows - 1));
        if most <= 0.0 || 2 * aside + 3 >= self.columns {
            return None;
        }
        let left = self.wrapped(column as isize - aside as isize);
        let peak = place * self.bands;
        let spectrum = self.samples.get(peak..peak + self.bands)?;
        let window = Spot {
            first_row: top,
            rows: bottom + 1 - top,
            first_column: left,
            columns: 2 * aside + 1,
            peak,
            base: 0.0,
        };
        let base = self.rim(&window, spectrum);
        if base * BRIGHT > 1.0 {
            return None;
        }
        let spot = Spot { base, ..window };
        let (energy, middle, square) = self.moments(&spot);
        // a bilinear hat of two steps spreads what a sample holds by a sixth of a step squared, each way
        let width = level * step.1;
        let spread = square / energy + (step.0 * step.0 + width * width) / 6.0;
        self.spot = Some(spot);
        Some(SpotSun {
            direction: unit(middle)?,
            half_angle: sqrt(2.0 * spread),
            samples: spectrum,
            scale: energy,
        })
    }

    /// A sample's value of one band less what was taken out there.
    #[inline]
    fn left(&self, row: usize, column: usize, band: usize) -> f64 {
        let value = self.sample(row, column).get(band).map_or(0.0, |value| f64::from(*value));
        let Some(spot) = &self.spot else { return value };
        let peak = self.samples.get(spot.peak + band).map_or(0.0, |value| f64::from(*value));
        (value - self.taken(spot, row, column) * peak).max(0.0)
    }

    /// Interpolated samples toward the unit vector `direction`, per band.
    pub(super) fn radiance(&self, direction: Vec3, out: &mut [f64]) {
        let (x, y, z) = (direction.dot(self.x), direction.dot(self.y), direction.dot(self.up));
        let zenith = atan2(sqrt(x * x + y * y), z);
        let down = clamp(zenith / PI * self.rows as f64 - 0.5, 0.0, (self.rows - 1) as f64);
        let along = atan2(y, x) / TAU * self.columns as f64 - 0.5;
        let (top, left) = (floor(down), floor(along));
        let (t, s) = (down - top, along - left);
        let top = top as usize;
        let left = (left as isize).rem_euclid((self.columns as isize).max(1)) as usize;
        let right = (left + 1) % self.columns.max(1);
        let below = (top + 1).min(self.rows - 1);
        let corners = [
            (top, left, (1.0 - t) * (1.0 - s)),
            (top, right, (1.0 - t) * s),
            (below, left, t * (1.0 - s)),
            (below, right, t * s),
        ];
        self.each_band(out, |sums| {
            for (row, column, weight) in corners {
                if self.spot.is_some() {
                    let values = sums.iter_mut().enumerate();
                    values.for_each(|(band, sum)| *sum += weight * self.left(row, column, band));
                    continue;
                }
                for (sum, &sample) in sums.iter_mut().zip(self.sample(row, column)) {
                    *sum += weight * f64::from(sample);
                }
            }
        });
    }

    /// Largest sample per band.
    pub(super) fn largest(&self, out: &mut [f64]) {
        self.each_band(out, |sums| {
            for place in 0..self.rows * self.columns {
                let (row, column) = (place / self.columns.max(1), place % self.columns.max(1));
                for (band, largest) in sums.iter_mut().enumerate() {
                    *largest = largest.max(self.left(row, column, band));
                }
            }
        });
    }

    /// Lets `add` sum into zeros, one per band of the table, and spreads a single band over all of `out`.
    fn each_band(&self, out: &mut [f64], mut add: impl FnMut(&mut [f64])) {
        if self.bands == 1 {
            let mut sum = [0.0];
            add(&mut sum);
            out.fill(sum[0]);
        } else {
            let count = self.bands.min(out.len());
            let sums = out.get_mut(..count).unwrap_or_default();
            sums.fill(0.0);
            add(sums);
        }
    }

    /// Irradiance of a plane that faces the unit vector `normal`, per band, for a factor of 1.
    ///
    /// Integrates the bilinear interpolant in azimuth exactly (it is linear there, times the plane's cosine),
    /// from end to end of the arc above the plane, and in elevation by Gauss-Legendre rules between rows, split
    /// where the plane's horizon turns. Error: for cells wholly above the plane below 1e-9 of their part (4
    /// points, 8 rows or more) or 1e-12 (16, where `relative_error` < 1e-4 or rows are fewer). On the plane's
    /// horizon the rule meets kinks where the horizon enters and leaves a cell and where it turns; of what a
    /// single bright sample gives a plane that faces it, the error so left is at most 2e-4 (4 points) or 1e-5
    /// (16), measured on 8 x 16 samples with all normals, and falls with the second power of the cells' size.
    /// Time in proportion to the number of samples, about 10 ns each.
    // not inlined: keeps its rings out of the stack frame of other skies
    #[inline(never)]
    pub(super) fn irradiance(&self, normal: Vec3, relative_error: f64, out: &mut [f64]) {
        let points = if relative_error >= 1e-4 && self.rows >= 8 { 4 } else { 16 };
        let (x, y) = (normal.dot(self.x), normal.dot(self.y));
        let (across, height) = (sqrt(x * x + y * y), normal.dot(self.up));
        let size = TAU / self.columns as f64;
        let moments = [(|x| 1.0 - x) as fn(f64) -> f64, |x| x].map(|hat| {
            let (nodes, weights) = rule(16);
            nodes.iter().zip(weights).fold([0.0; 2], |[c, s], (&x, &w)| {
                [c + size * w * hat(x) * cos(size * x), s + size * w * hat(x) * sin(size * x)]
            })
        });
        let mut start = 0.5 * size - atan2(y, x);
        start -= TAU * floor((start + PI) / TAU);
        let mut rings = Rings { rings: [Ring::default(); 16], count: 0 };
        // the plane's horizon lies between these elevations
        let turn = atan2(across, fabs(height));
        self.each_band(out, |sums| {
            for gap in 0..=self.rows {
                let rows = [gap.saturating_sub(1), gap.min(self.rows - 1)];
                let (top, bottom) = self.gap(gap);
                // one panel at a time: all rings of a gap would enlarge the stack frame
                let bounds = [top, turn.min(top).max(bottom), (-turn).min(top).max(bottom), bottom];
                for panel in bounds.windows(2) {
                    rings.fill((top, bottom), panel, across, height, points);
                    if rings.outer() > 0.0 {
                        self.add_gap(&rings, rows, start, size, &moments, sums);
                    }
                }
            }
        });
    }

    /// Elevations between which gap `gap` lies; 0: between the zenith and the first row; `rows`: between the last row and
    /// the nadir.
    fn gap(&self, gap: usize) -> (f64, f64) {
        let step = PI / self.rows as f64;
        let top = if gap == 0 { FRAC_PI_2 } else { FRAC_PI_2 - (gap as f64 - 0.5) * step };
        let bottom = if gap == self.rows { -FRAC_PI_2 } else { FRAC_PI_2 - (gap as f64 + 0.5) * step };
        (top, bottom)
    }

    /// Adds the part of the cells between two rows of samples in which rings are.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn add_gap(
        &self,
        rings: &Rings,
        rows: [usize; 2],
        first: f64,
        size: f64,
        moments: &[[f64; 2]; 2],
        sums: &mut [f64],
    ) {
        let (inner, outer) = (rings.inner(), rings.outer());
        let whole = rings.whole();
        let (turn_cos, turn_sin) = (cos(size), sin(size));
        let (mut angle, mut ahead) = (first, (cos(first), sin(first)));
        for column in 0..self.columns {
            let here = ahead;
            ahead = (here.0 * turn_cos - here.1 * turn_sin, here.1 * turn_cos + here.0 * turn_sin);
            let (start, end) = (angle, angle + size);
            angle = if end >= PI { end - TAU } else { end };
            // corner weights: upper left, upper right, lower left, lower right
            let weights = if inner >= PI || (start >= -inner && end <= inner) {
                let cosines = moments.map(|[c, s]| here.0 * c - here.1 * s);
                let corner = |row: [f64; 2], cosine: f64| row[0] * 0.5 * size + row[1] * cosine;
                let ([upper, lower], [left, right]) = (whole, cosines);
                [corner(upper, left), corner(upper, right), corner(lower, left), corner(lower, right)]
            } else if end <= -outer || (start >= outer && end <= TAU - outer) {
                continue;
            } else {
                rings.part(&Cell { start, size, cos: [here.0, ahead.0], sin: [here.1, ahead.1] })
            };
            let next = if column + 1 == self.columns { 0 } else { column + 1 };
            if let Some(spot) = &self.spot
                && rows.iter().any(|row| self.taken(spot, *row, column) + self.taken(spot, *row, next) > 0.0)
            {
                for (band, sum) in sums.iter_mut().enumerate() {
                    let of = |row: usize, column: usize| self.left(rows.at(row), column, band);
                    let corners = [of(0, column), of(0, next), of(1, column), of(1, next)];
                    *sum += weights.iter().zip(corners).map(|(weight, value)| weight * value).sum::<f64>();
                }
                continue;
            }
            let corner = |row: usize, column: usize| self.sample(rows.at(row), column);
            let upper = corner(0, column).iter().zip(corner(0, next));
            let samples = upper.zip(corner(1, column).iter().zip(corner(1, next)));
            for (sum, ((&a, &b), (&c, &d))) in sums.iter_mut().zip(samples) {
                *sum += weights[0] * f64::from(a)
                    + weights[1] * f64::from(b)
                    + weights[2] * f64::from(c)
                    + weights[3] * f64::from(d);
            }
        }
    }
}

impl Rings {
    /// The rings of a panel, two elevations in a gap from `top` to `bottom`, for a normal of the given horizontal length
    /// and height.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn fill(&mut self, (top, bottom): (f64, f64), panel: &[f64], across: f64, height: f64, points: usize) {
        self.count = 0;
        let &[from, to] = panel else { return };
        if from <= to {
            return;
        }
        let (nodes, weights) = rule(points);
        for ((x, weight), ring) in nodes.iter().zip(weights).zip(&mut self.rings) {
            let elevation = from + (to - from) * x;
            let below = (top - elevation) / (top - bottom);
            let cosine = cos(elevation);
            let weight = (from - to) * weight * cosine;
            let shares = [weight * (1.0 - below), weight * below];
            *ring = Ring::new(height * sin(elevation), across * cosine, shares);
            self.count += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = &Ring> {
        self.rings.iter().take(self.count)
    }

    /// Within this of the normal's azimuth every ring is above the plane.
    fn inner(&self) -> f64 {
        self.iter().fold(PI, |least, ring| least.min(ring.arc))
    }

    /// Beyond this no ring is.
    fn outer(&self) -> f64 {
        self.iter().fold(0.0, |most, ring| most.max(ring.arc))
    }

    /// Sums over the rings of constant and swing, for the upper and the lower row.
    fn whole(&self) -> [[f64; 2]; 2] {
        [0, 1].map(|row: usize| {
            self.iter().fold([0.0; 2], |[constant, swing], ring| {
                let share = ring.shares.at(row);
                [constant + share * ring.constant, swing + share * ring.swing]
            })
        })
    }

    /// Corner weights of a cell that the plane's horizon may cross. The arc above the plane appears around
    /// azimuth 0 and again a turn later, where a cell may end.
    fn part(&self, cell: &Cell) -> [f64; 4] {
        let mut weights = [0.0; 4];
        for ring in self.iter() {
            for turn in [0.0, TAU] {
                let [left, right] = ring.hats(cell, turn);
                weights[0] += ring.shares[0] * left;
                weights[1] += ring.shares[0] * right;
                weights[2] += ring.shares[1] * left;
                weights[3] += ring.shares[1] * right;
            }
        }
        weights
    }
}

impl Ring {
    fn new(constant: f64, swing: f64, shares: [f64; 2]) -> Ring {
        let (arc, cos_arc) = if constant >= swing {
            (PI, -1.0)
        } else if constant <= -swing {
            (0.0, 1.0)
        } else {
            let cosine = -constant / swing;
            (acos(cosine), cosine)
        };
        let sin_arc = sqrt((1.0 - cos_arc) * (1.0 + cos_arc));
        Ring { constant, swing, shares, arc, cos_arc, sin_arc }
    }

    /// Integrals over the part of the cell within `arc` of azimuth `turn`, of the cosine times the two linear
    /// weights that are 1 at the cell's start and at its end.
    fn hats(&self, cell: &Cell, turn: f64) -> [f64; 2] {
        let (mut from, mut to) = ((cell.start, cell.cos[0], cell.sin[0]), (0.0, cell.cos[1], cell.sin[1]));
        to.0 = cell.start + cell.size;
        if turn - self.arc > from.0 {
            from = (turn - self.arc, self.cos_arc, -self.sin_arc);
        }
        if turn + self.arc < to.0 {
            to = (turn + self.arc, self.cos_arc, self.sin_arc);
        }
        if from.0 >= to.0 {
            return [0.0; 2];
        }
        let (a, b) = (from.0 - cell.start, to.0 - cell.start);
        let plain = self.constant * (b - a) + self.swing * (to.2 - from.2);
        let first =
            0.5 * self.constant * (b * b - a * a) + self.swing * (b * to.2 - a * from.2 + to.1 - from.1);
        let right = first / cell.size;
        [plain - right, right]
    }
}

/// Unit vector of azimuth 0, perpendicular to `up`.
fn azimuth_zero(given: Option<[f64; 3]>, up: Vec3) -> Result<Vec3, Error> {
    // off the vertical by more than 1e-9, so that the projection has seven digits or more
    let project = |v: Vec3| unit(v - up * v.dot(up)).filter(|_| v.cross(up).length_squared() > 1e-18);
    match given {
        Some(given) => unit(Vec3::from_array(given)).and_then(project),
        None => project(Vec3::X).or_else(|| project(Vec3::Y)),
    }
    .ok_or(Error::Direction { field: Field::SkyAzimuthZero })
}
