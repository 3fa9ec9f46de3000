//! Solves eq. (12) for the diffuse radiance of all elements, all bands together.
//!
//! I = emission + rho_d/pi E and E = E_0 + pi sum K I, by Jacobi's iteration, whose rows are independent, so
//! that any split gives the same bits, and whose error after a sweep is bounded by the change of that sweep. Where
//! that would take many sweeps, [`crate::radiosity::solver`] makes the most of few.
//!
//! Constants of this file are measured by `cargo test --test closure` (rounding).

pub mod accuracy;
pub mod adjoint;
pub mod beam;
pub mod direct;
pub mod limits;
pub mod solution;
pub mod solver;
pub mod straight;
pub mod sun_image;

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy, pieces, span};
use crate::base::math::{FRAC_1_PI, PI, fabs, sqrt};
use crate::coupling::element::Elements;
use crate::coupling::{Coupling, RowView, TRACED};
use crate::radiosity::direct::TableShape;
use crate::radiosity::straight::Straight;
use crate::scene::light::Light;
use crate::scene::{MAX_BANDS, Scene};
use core::ops::Range;

/// Everything that stays fixed while the system is solved.
#[derive(Clone, Copy, Debug)]
pub struct System<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// Its coupling.
    pub coupling: &'a Coupling<'a>,
    /// The light.
    pub light: &'a Light<'a>,
    /// Irradiance by sky and beams, [`TableShape::stride`] values an unknown.
    pub direct: &'a [f64],
    /// Mean of cos V of the sun, one value an unknown.
    pub sun: &'a [f64],
    /// The part of `direct` that outlines tell.
    pub straight: Straight<'a>,
    /// Shape of `direct`.
    pub shape: TableShape,
}

impl System<'_> {
    /// Largest of rho_d times a row's sum, over the rows of `range` and the bands: the contraction q of a sweep.
    pub fn contraction(&self, range: Range<usize>) -> f64 {
        let mut largest = 0.0;
        let mut sums = [0.0; MAX_BANDS];
        let sums = sums.head_mut(self.shape.bands);
        for (unknown, row) in self.coupling.rows(range) {
            let diffuse = self.scene.diffuse(self.material(unknown));
            row.sums(sums);
            let scale = self.scale(unknown, &row);
            for (sum, rho) in sums.iter().zip(diffuse) {
                largest = f64::max(largest, scale * sum * rho);
            }
        }
        largest
    }

    /// Radiance before any reflection of the sides of `range`: their emission.
    pub fn start(&self, range: Range<usize>, radiance: &mut [f64]) {
        for (unknown, out) in range.zip(pieces(radiance, self.shape.bands)) {
            out.iter_mut().enumerate().for_each(|(band, out)| *out = self.emission(unknown, band));
        }
    }

    /// One sweep over the rows of `range`: from the radiances of all unknowns (`from`) those of the range
    /// (`to`). Returns the largest change relative to `reference`, one value per band.
    pub fn sweep(&self, range: Range<usize>, from: &[f64], to: &mut [f64], reference: &[f64]) -> f64 {
        self.relaxed_sweep(range, from, to, reference, 1.0)
    }

    /// A sweep that goes `relaxation` times the way from what `to` holds to what a plain sweep of `from` makes.
    /// Returns the largest change that the plain sweep makes of `from`, changes within [`STEP_ROUNDING`] apart.
    pub fn relaxed_sweep(
        &self,
        range: Range<usize>,
        from: &[f64],
        to: &mut [f64],
        reference: &[f64],
        relaxation: f64,
    ) -> f64 {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        let mut change: f64 = 0.0;
        let mut sums = [0.0; MAX_BANDS];
        let sums = sums.head_mut(bands);
        for ((unknown, row), out) in self.coupling.rows(range).zip(pieces(to, bands)) {
            let material = self.material(unknown);
            let diffuse = self.scene.diffuse(material);
            row.gather(from, sums);
            let direct = self.direct.part(self.shape.at(unknown, 0));
            let scale = PI * self.scale(unknown, &row);
            for (band, (out, &bounced)) in out.iter_mut().zip(&*sums).enumerate() {
                let mut irradiance = direct.at(band) + scale * bounced;
                if let Some(sun) = &self.light.sun {
                    irradiance += self.sun.at(unknown) * sun.irradiance(band);
                }
                // eq. (12): I = I_0 + rho_d/pi E, E = E_0 + pi sum phi I; what gradients add to E_0 may be negative, where
                // next to nothing arrives
                let new = self.emission(unknown, band) + diffuse.at(band) * FRAC_1_PI * irradiance.max(0.0);
                let old = from.at(unknown * bands + band);
                let reference = reference.at(band);
                let step = fabs(new - old);
                if reference > 0.0 && step > STEP_ROUNDING * new {
                    change = change.max(step / reference);
                }
                *out = relax(*out, new, relaxation);
            }
        }
        change
    }

    /// Share that the rows of `range` absorb or let out of a radiance of 1 from everywhere, for
    /// [`crate::radiosity::solver::History`].
    pub fn row_deficits(&self, range: Range<usize>, out: &mut [f64]) {
        let bands = self.shape.bands;
        for ((unknown, row), out) in self.coupling.rows(range).zip(pieces(out, bands)) {
            row.sums(out);
            let diffuse = self.scene.diffuse(self.material(unknown));
            let scale = self.scale(unknown, &row);
            out.iter_mut().zip(diffuse).for_each(|(out, rho)| *out = 1.0 - scale * rho * *out);
        }
    }

    /// Area over rho_d, in scene units, of the value `at` a table of one value per unknown and band: what makes fluxes of
    /// radiances for [`crate::radiosity::solver::History`]; 0 where nothing is reflected.
    pub fn weight(&self, at: usize) -> f64 {
        let bands = self.shape.bands.max(1);
        let (unknown, band) = (at / bands, at % bands);
        let facet = self.elements.facet_of(unknown).0;
        let rho = self.scene.diffuse(self.scene.material(facet)).at(band);
        let area = self.elements.area(self.scene, unknown);
        if rho > 0.0 { area / rho } else { 0.0 }
    }

    /// [`System::relaxed_sweep`] of the system whose source is 1 everywhere; returns the largest increase.
    pub fn unit_sweep(&self, range: Range<usize>, from: &[f64], to: &mut [f64], relaxation: f64) -> f64 {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        let mut increase: f64 = 0.0;
        let mut sums = [0.0; MAX_BANDS];
        let sums = sums.head_mut(bands);
        for ((unknown, row), out) in self.coupling.rows(range).zip(pieces(to, bands)) {
            let diffuse = self.scene.diffuse(self.material(unknown));
            row.gather(from, sums);
            let scale = self.scale(unknown, &row);
            for (band, (out, &bounced)) in out.iter_mut().zip(&*sums).enumerate() {
                let new = 1.0 + scale * diffuse.at(band) * bounced;
                increase = increase.max(new - from.at(unknown * bands + band));
                *out = relax(*out, new, relaxation);
            }
        }
        increase
    }

    /// Irradiance of the rows of `range`, without the sun's direct part, as mean and gradients over each
    /// element, on one level: direct light plus what all unknowns send (`radiance(level)`), written to `out`
    /// (the part of the table that belongs to the range). Gradients below their noise are damped.
    pub fn gather<'x>(
        &self,
        range: Range<usize>,
        level: usize,
        radiance: impl Fn(usize) -> &'x [f64],
        out: &mut [f64],
    ) -> Result<(), Error> {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        let stride = self.shape.stride().max(1);
        let expected = span(&range) * stride;
        if out.len() != expected {
            return Err(Error::Length { what: "irradiance table", expected, given: out.len() });
        }
        let part = self.shape.at(0, level);
        let mut sky = [0.0; MAX_BANDS];
        self.light.largest_radiance(sky.head_mut(bands));
        let mut squares = [0.0; MAX_BANDS];
        let square = squares.head_mut(bands);
        for ((unknown, row), values) in self.coupling.rows(range).zip(pieces(out, stride)) {
            let values = values.part_mut(part.clone());
            copy(values, self.direct.part(self.shape.at(unknown, level)));
            let mut parts = pieces(values, bands);
            let (Some(mean), Some(first), Some(second)) = (parts.next(), parts.next(), parts.next()) else {
                continue;
            };
            let scale = PI * self.scale(unknown, &row);
            let blocked = row.row.blocked;
            let share = if blocked > 0.5 { 1.0 - blocked } else { blocked };
            // the sky's part, where rays tell it
            let share = if self.straight.knows(unknown) { 0.0 } else { share };
            square.iter_mut().zip(&sky).for_each(|(square, l)| *square = (PI * l) * (PI * l) * share);
            if let ([mean], [first], [second], [square]) =
                (&mut *mean, &mut *first, &mut *second, &mut *square)
                && self.shape.levels == 1
            {
                let seen = radiance(0);
                for record in row.targets {
                    let product = row.products(record.path()).at(0);
                    let l = scale * product * seen.at(record.unknown());
                    *mean += l * record.weight;
                    *first += l * f64::from(record.gradient[0]);
                    *second += l * f64::from(record.gradient[1]);
                    *square += l * l * record.weight;
                }
            } else {
                let sums = [&mut *mean, &mut *first, &mut *second, &mut *square];
                self.add_targets((&row, scale), level, &radiance, sums);
            }
            let known = self.straight.blocked(unknown, bands, &row);
            if let Some((blocked, short)) = known {
                let direct = self.direct.part(self.shape.at(unknown, level));
                let sums = [&mut *mean, &mut *first, &mut *second, &mut *square];
                sharpen(direct, sums, (blocked, short), row.row.rays);
            } else {
                damp(first, second, square, row.row.rays);
            }
            mean.iter_mut().for_each(|mean| *mean = mean.max(0.0));
        }
        Ok(())
    }

    /// Adds to mean, gradients and mean square of a row's irradiance what its targets send, times `scale`.
    fn add_targets<'x>(
        &self,
        (row, scale): (&RowView<'_>, f64),
        level: usize,
        radiance: &impl Fn(usize) -> &'x [f64],
        [mean, first, second, square]: [&mut [f64]; 4],
    ) {
        let bands = self.shape.bands;
        for record in row.targets {
            let depth = row.depth(record.path());
            if !self.shape.counts(depth, level) {
                continue;
            }
            let from = if self.shape.levels == 1 { 0 } else { level - depth as usize };
            let start = record.unknown() * bands;
            let seen = radiance(from).part(start..start.wrapping_add(bands));
            let g = record.gradient.map(f64::from);
            let sums = mean.iter_mut().zip(first.iter_mut().zip(second.iter_mut())).zip(&mut *square);
            let terms = row.products(record.path()).iter().zip(seen);
            for (((mean, (first, second)), square), (product, seen)) in sums.zip(terms) {
                let l = scale * product * seen;
                *mean += l * record.weight;
                *first += l * g[0];
                *second += l * g[1];
                *square += l * l * record.weight;
            }
        }
    }

    /// What the rows of `range` miss where they take an element's radiance for the same all over it: irradiance by the
    /// slopes of what all unknowns send, written to `out`, one value per band. `irradiance` is the gathered table.
    pub fn gradient_source(&self, range: Range<usize>, irradiance: &[f64], out: &mut [f64]) {
        let bands = self.shape.bands;
        for ((unknown, row), out) in self.coupling.rows(range).zip(pieces(out, bands)) {
            out.fill(0.0);
            let scale = self.scale(unknown, &row);
            for record in row.targets {
                let seen = irradiance.part(self.shape.at(record.unknown(), 0));
                let diffuse = self.scene.diffuse(self.material(record.unknown()));
                let (first, second) = (seen.part(bands..2 * bands), seen.part(2 * bands..3 * bands));
                let slopes = first.iter().zip(second).zip(diffuse).zip(row.products(record.path()));
                for (out, (((a, b), rho), product)) in out.iter_mut().zip(slopes) {
                    let [at, bt] = record.moment.map(f64::from);
                    *out += scale * product * rho * (a * at + b * bt);
                }
            }
        }
    }

    /// Gives elements that lie inside a body, as far as their rays can tell, the irradiance of a neighbour, in the
    /// gathered table: a sliver of them may show at the body's edge.
    pub fn fill_absent_rows(&self, table: &mut [f64]) {
        for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
            let Some(near) = self.substitute_row(unknown, &row) else { continue };
            for level in 0..self.shape.levels {
                let (to, from) = (self.shape.at(unknown, level), self.shape.at(near, level));
                for (band, (to, from)) in to.zip(from).enumerate() {
                    // the neighbour's mean; its slopes end at its edge
                    let value = if band < self.shape.bands { table.at(from) } else { 0.0 };
                    table.set(to, value);
                }
            }
        }
    }

    /// As [`System::fill_absent_rows`], in the table of the straight sky.
    pub fn fill_absent_straight(&self, values: &mut [f64], variance: &mut [f32]) {
        let stride = straight::stride(self.shape.bands);
        if values.is_empty() {
            return;
        }
        for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
            let Some(near) = self.substitute_row(unknown, &row) else { continue };
            variance.set(unknown, variance.at(near));
            for band in 0..stride {
                let value = if band < self.shape.bands || band + 3 == stride {
                    values.at(near * stride + band)
                } else {
                    0.0
                };
                values.set(unknown * stride + band, value);
            }
        }
    }

    /// The neighbour whose irradiance an element inside a body takes.
    pub fn substitute_row(&self, unknown: usize, row: &RowView<'_>) -> Option<usize> {
        let hidden = row.row.state >= TRACED && row.row.visible_share == 0.0;
        let visible_share = |near: &usize| self.coupling.row(*near).visible_share > 0.0;
        if hidden { self.elements.neighbours(unknown).find(visible_share) } else { None }
    }

    /// In those of the bands `dark`, as bits, in which anything that reflects diffusely is lit: sets `radiance` to the mean
    /// over its area of the irradiance over pi, from the gathered table. Where a lamp alone gives light, an error is one of
    /// what it lights. Where no row has met a lamp, it is what all of the lamps' light would give if it fell there.
    pub fn lit_radiance(&self, dark: u64, irradiance: &[f64], radiance: &mut [f64]) {
        for (band, radiance) in radiance.iter_mut().enumerate().filter(|(band, _)| dark >> band & 1 == 1) {
            let (mut sum, mut all, mut sent) = (0.0, 0.0, 0.0);
            for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
                let facet = self.elements.facet_of(unknown).0;
                let area = self.elements.area(self.scene, unknown);
                sent += area * self.emission(unknown, band);
                if self.scene.diffuse(self.scene.material(facet)).at(band) > 0.0 {
                    let area = area * f64::from(row.row.visible_share);
                    sum += area * irradiance.at(self.shape.at(unknown, self.shape.levels - 1).start + band);
                    all += area;
                }
            }
            if sum > 0.0 {
                *radiance = sum / all * FRAC_1_PI;
            } else if all > 0.0 {
                *radiance = radiance.min(sent / all);
            }
        }
    }

    /// Diffuse radiance that the irradiance on one level makes, for the rows of `range`.
    pub fn reflect(&self, range: Range<usize>, level: usize, irradiance: &[f64], out: &mut [f64]) {
        for (unknown, out) in range.zip(pieces(out, self.shape.bands)) {
            let material = self.material(unknown);
            let diffuse = self.scene.diffuse(material);
            let mean = irradiance.part(self.shape.at(unknown, level));
            for (band, out) in out.iter_mut().enumerate() {
                let sun = self.light.sun.as_ref().map_or(0.0, |s| self.sun.at(unknown) * s.irradiance(band));
                *out = self.emission(unknown, band) + diffuse.at(band) * FRAC_1_PI * (mean.at(band) + sun);
            }
        }
    }

    /// Factor on the entries of a row.
    #[inline]
    fn scale(&self, unknown: usize, row: &RowView<'_>) -> f64 {
        self.straight.scale(unknown, self.shape.bands, &row.row)
    }

    fn material(&self, unknown: usize) -> usize {
        self.scene.material(self.elements.facet_of(unknown).0)
    }

    /// Own diffuse radiance in a band, mean over the element.
    #[inline]
    fn emission(&self, unknown: usize, band: usize) -> f64 {
        let (facet, side) = self.elements.facet_of(unknown);
        if !self.elements.is_cluster(unknown) || self.light.emission.is_empty() {
            return self.light.emission(self.scene, facet, side).at(band);
        }
        let of = |facet: &u32| {
            let facet = *facet as usize;
            self.light.emission(self.scene, facet, side).at(band) * self.scene.areas().at(facet)
        };
        let area = self.elements.area(self.scene, unknown);
        if area > 0.0 { self.elements.facets_of(unknown).iter().map(of).sum::<f64>() / area } else { 0.0 }
    }
}

/// Steps of so small a share of a radiance are rounding, which no sweep undoes: a few roundings of each of a row's
/// records, which come to sqrt(n).
pub const STEP_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The step from the old value to the new one, times the relaxation; `new` itself where that is 1.
#[inline(always)]
fn relax(old: f64, new: f64, relaxation: f64) -> f64 {
    if relaxation == 1.0 { new } else { relaxation * (new - old) + old }
}

/// Scales gradients down by the part of their square that noise explains (James and Stein's estimate): the
/// mean square of a linear function with these gradients over the element is `signal`; independent rays would
/// bring 2 s^2/n of it (s^2 the mean square of a ray's light, n rays), a scrambled net sqrt(n) times less, and
/// half of that serves best: gradients left out cost as much as noise let in.
fn damp(first: &mut [f64], second: &mut [f64], square: &[f64], rays: u32) {
    if rays == 0 {
        return;
    }
    let n = f64::from(rays);
    let share = 1.0 / (n * sqrt(n));
    for ((first, second), &square) in first.iter_mut().zip(second).zip(square) {
        let (a, b) = (*first, *second);
        let signal = (a * a + b * b - a * b) / 18.0;
        let noise = share * square;
        let keep = if signal > noise { 1.0 - noise / signal } else { 0.0 };
        *first = a * keep;
        *second = b * keep;
    }
}

/// Corrects the gradients of what a row sees (`sums` less `direct`) by those of what is known to be blocked: what is met has
/// the same gradients as that, but for how its radiances differ from their mean. What is left of noise is damped.
fn sharpen(
    direct: &[f64],
    [mean, first, second, square]: [&mut [f64]; 4],
    (blocked, short): ([f64; 3], [f64; 2]),
    rays: u32,
) {
    let bands = mean.len();
    for band in 0..bands {
        // over the mean radiance of what is met
        let seen = mean.at(band) - direct.at(band);
        let l = seen / blocked[0];
        let mut parts = [0.0; 2];
        for (k, (gradient, part)) in [&mut *first, &mut *second].into_iter().zip(&mut parts).enumerate() {
            let own = direct.at((k + 1) * bands + band);
            // exact for one radiance everywhere
            *part = own + l * blocked.at(k + 1);
            let rest = gradient.at(band) - own - l * (blocked.at(k + 1) - short.at(k));
            gradient.set(band, rest);
        }
        let spread = [(square.at(band) - l * seen).max(0.0)];
        let [mut a, mut b] = [[first.at(band)], [second.at(band)]];
        damp(&mut a, &mut b, &spread, rays);
        first.set(band, a[0] + parts[0]);
        second.set(band, b[0] + parts[1]);
    }
}

/// Sweeps that bring the error below `goal` from a start whose error is at most 1, at contraction `q`.
pub fn sweeps(q: f64, goal: f64) -> u32 {
    if q <= 0.0 || goal >= 1.0 {
        return 1;
    }
    if q >= 1.0 {
        return u32::MAX;
    }
    (libm::ceil(crate::base::math::log(goal) / crate::base::math::log(q)) + 1.0).min(1e9) as u32
}

/// Bound on the error of all radiances after a sweep that changed them by at most `change`, at contraction `q`.
pub fn bound(change: f64, q: f64) -> f64 {
    if change == 0.0 {
        0.0
    } else if q < 1.0 {
        change * q / (1.0 - q)
    } else {
        f64::INFINITY
    }
}
