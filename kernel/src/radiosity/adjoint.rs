//! The transposed system: how a weighted sum of what unknowns receive changes with what each of them sends and reflects.
//!
//! The forward system solves I = emission + rho_d/pi E with E = E_0 + pi K I (eq. 12), gathers means and gradients over the
//! elements, and once more with what slopes add ([`System::gradient_source`]). Each of these steps is taken back here, the last
//! one first, by the transposed products of the same entries: lambda = w + (rho_d K)^T lambda. Cut-offs at 0 of
//! irradiances, which slopes alone can reach, are taken for none.

use super::System;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{FRAC_1_PI, PI, fabs, sqrt};
use crate::coupling::RowView;
use crate::scene::MAX_BANDS;

/// One band of a row at work: sums over what its targets send, as [`System::gather`] makes them.
#[derive(Clone, Copy, Default)]
struct Gathered {
    /// Irradiance by all targets.
    seen: f64,
    /// Gradients, those of the direct light included.
    gradient: [f64; 2],
    /// Mean square.
    square: f64,
}

/// How a sum changes with them.
#[derive(Clone, Copy, Default)]
struct GatheredWeight {
    seen: f64,
    gradient: [f64; 2],
    square: f64,
}

/// Takes back the damping of gradients: by how much a sum changes with the raw gradients and their mean square, from
/// how it changes with the damped ones.
fn damp_back([a, b]: [f64; 2], square: f64, rays: u32, [of_a, of_b]: [f64; 2]) -> ([f64; 2], f64) {
    if rays == 0 {
        return ([of_a, of_b], 0.0);
    }
    let n = f64::from(rays);
    let share = 1.0 / (n * sqrt(n));
    let signal = (a * a + b * b - a * b) / 18.0;
    let noise = share * square;
    if signal <= noise {
        return ([0.0; 2], 0.0);
    }
    let keep = 1.0 - noise / signal;
    // derivative by the factor `keep`
    let of_keep = of_a * a + of_b * b;
    let slope = noise / (signal * signal) / 18.0;
    let own = [of_a * keep + of_keep * slope * (2.0 * a - b), of_b * keep + of_keep * slope * (2.0 * b - a)];
    (own, -of_keep * share / signal)
}

impl System<'_> {
    /// One band's sums over the targets of a row, of which `radiance` holds what all unknowns send.
    fn sums_of(
        &self,
        unknown: usize,
        row: &RowView<'_>,
        band: usize,
        radiance: &[f64],
        sky: f64,
    ) -> Gathered {
        let bands = self.shape.bands;
        let scale = PI * self.scale(unknown, row);
        let direct = self.direct.part(self.shape.at(unknown, 0));
        let blocked = row.row.blocked;
        let share = if blocked > 0.5 { 1.0 - blocked } else { blocked };
        let share = if self.straight.knows(unknown) { 0.0 } else { share };
        let gradient = [direct.at(bands + band), direct.at(2 * bands + band)];
        let mut sums = Gathered { seen: 0.0, gradient, square: (PI * sky) * (PI * sky) * share };
        for record in row.targets {
            let l =
                scale * row.products(record.path()).at(band) * radiance.at(record.unknown() * bands + band);
            sums.seen += l * record.weight;
            sums.gradient[0] += l * f64::from(record.gradient[0]);
            sums.gradient[1] += l * f64::from(record.gradient[1]);
            sums.square += l * l * record.weight;
        }
        sums
    }

    /// Takes back what [`System::gather`] makes of a row's sums: `weight` is by how much a sum changes with the mean and the
    /// gradients of the table.
    fn gathered_back(
        &self,
        unknown: usize,
        row: &RowView<'_>,
        band: usize,
        sums: &Gathered,
        [mean, a, b]: [f64; 3],
    ) -> GatheredWeight {
        let bands = self.shape.bands;
        let Some((blocked, short)) = self.straight.blocked(unknown, bands, row) else {
            let (gradient, square) = damp_back(sums.gradient, sums.square, row.row.rays, [a, b]);
            return GatheredWeight { seen: mean, gradient, square };
        };
        let direct = self.direct.part(self.shape.at(unknown, 0));
        let l = sums.seen / blocked[0];
        let beyond = [blocked[1] - short[0], blocked[2] - short[1]];
        let rest = |k: usize| sums.gradient.at(k) - direct.at((k + 1) * bands + band) - l * beyond.at(k);
        let spread = sums.square - l * sums.seen;
        let (gradient, square) = damp_back([rest(0), rest(1)], spread.max(0.0), row.row.rays, [a, b]);
        let square = if spread > 0.0 { square } else { 0.0 };
        let of_l = a * blocked[1] + b * blocked[2] - gradient[0] * beyond[0] - gradient[1] * beyond[1];
        let seen = mean + of_l / blocked[0] - square * 2.0 * l;
        GatheredWeight { seen, gradient, square }
    }

    /// How a sum changes with the radiance of each unknown, added to `out`, one value a band: from how it changes with the
    /// gathered table (`weights`, of its shape), of which `radiance` was the source. `irradiance` receives what arrives at
    /// each unknown with all that the radiances bring, the sun's direct part included, one value a band.
    pub fn gather_transposed(
        &self,
        radiance: &[f64],
        weights: &[f64],
        out: &mut [f64],
        irradiance: &mut [f64],
    ) {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        let mut sky = [0.0; MAX_BANDS];
        self.light.largest_radiance(sky.head_mut(bands));
        for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
            let table = weights.part(self.shape.at(unknown, 0));
            let scale = PI * self.scale(unknown, &row);
            for band in 0..bands {
                let sums = self.sums_of(unknown, &row, band, radiance, sky.at(band));
                let sun = self.light.sun.as_ref().map_or(0.0, |s| self.sun.at(unknown) * s.irradiance(band));
                let direct = self.direct.at(self.shape.at(unknown, 0).start + band);
                irradiance.set(unknown * bands + band, direct + sums.seen + sun);
                let own = [table.at(band), table.at(bands + band), table.at(2 * bands + band)];
                if own == [0.0; 3] {
                    continue;
                }
                let weight = self.gathered_back(unknown, &row, band, &sums, own);
                for record in row.targets {
                    let at = record.unknown() * bands + band;
                    let factor = scale * row.products(record.path()).at(band);
                    let of_l = weight.seen * record.weight
                        + weight.gradient[0] * f64::from(record.gradient[0])
                        + weight.gradient[1] * f64::from(record.gradient[1])
                        + 2.0 * weight.square * factor * radiance.at(at) * record.weight;
                    out.set(at, out.at(at) + factor * of_l);
                }
            }
        }
    }

    /// One sweep of lambda = w + (rho_d K)^T lambda: `to` from `from`, in the order of the rows. Returns the sum of the
    /// changes and of the new values, each the largest over the bands relative to that of the other.
    pub fn sweep_transposed(&self, source: &[f64], from: &[f64], to: &mut [f64]) -> f64 {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        to.iter_mut().zip(source).for_each(|(to, own)| *to = *own);
        for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
            let own = from.part(unknown * bands..(unknown + 1) * bands);
            let diffuse = self.scene.diffuse(self.material(unknown));
            if own.iter().zip(diffuse).all(|(lambda, rho)| lambda * rho == 0.0) {
                continue;
            }
            let scale = self.scale(unknown, &row);
            for record in row.targets {
                let start = record.unknown() * bands;
                let to = to.part_mut(start..start + bands);
                let terms = own.iter().zip(diffuse).zip(row.products(record.path()));
                for (to, ((lambda, rho), product)) in to.iter_mut().zip(terms) {
                    *to += scale * record.weight * rho * product * lambda;
                }
            }
        }
        let mut largest = 0.0;
        for band in 0..bands {
            let (mut change, mut all) = (0.0, 0.0);
            for (new, old) in to.iter().zip(from).skip(band).step_by(bands) {
                change += fabs(new - old);
                all += fabs(*new);
            }
            largest = if all > 0.0 { f64::max(largest, change / all) } else { largest };
        }
        largest
    }

    /// Takes [`System::gradient_source`] back: from how a sum changes with what slopes bring each unknown (`missed`, one value
    /// a band), how it changes with the gradients of the `table` that they came from, added to `weights` of the same shape,
    /// and with the facets' diffuse reflectances, added to `diffuse`.
    pub fn slopes_transposed(&self, missed: &[f64], table: &[f64], weights: &mut [f64], diffuse: &mut [f64]) {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
            let own = missed.part(unknown * bands..(unknown + 1) * bands);
            if own.iter().all(|weight| *weight == 0.0) {
                continue;
            }
            let scale = self.scale(unknown, &row);
            for record in row.targets {
                let [at, bt] = record.moment.map(f64::from);
                let start = self.shape.at(record.unknown(), 0).start;
                let facet = self.elements.facet_of(record.unknown()).0;
                let rho = self.scene.diffuse(self.scene.material(facet));
                for (band, weight) in own.iter().enumerate() {
                    let factor = weight * scale * row.products(record.path()).at(band);
                    let (a, b) = (start + bands + band, start + 2 * bands + band);
                    weights.set(a, weights.at(a) + factor * rho.at(band) * at);
                    weights.set(b, weights.at(b) + factor * rho.at(band) * bt);
                    let of_rho = factor * (table.at(a) * at + table.at(b) * bt);
                    let place = facet * bands + band;
                    diffuse.set(place, diffuse.at(place) + of_rho);
                }
            }
        }
    }

    /// Takes back that elements inside bodies have the irradiance of a neighbour ([`System::fill_absent_rows`]).
    pub fn absent_rows_transposed(&self, weights: &mut [f64]) {
        let bands = self.shape.bands;
        for (unknown, row) in self.coupling.rows(0..self.coupling.unknowns()) {
            let Some(near) = self.substitute_row(unknown, &row) else { continue };
            for (band, (from, to)) in self.shape.at(unknown, 0).zip(self.shape.at(near, 0)).enumerate() {
                // the neighbour's mean alone
                let own = if band < bands { weights.at(from) } else { 0.0 };
                weights.set(from, 0.0);
                weights.set(to, weights.at(to) + own);
            }
        }
    }

    /// Adds to the derivatives by facets' diffuse reflectances and by the emission of their sides what `lambda`, by how much
    /// a sum changes with the radiance of each unknown, says where `irradiance` arrives.
    pub fn add_derivatives(
        &self,
        lambda: &[f64],
        irradiance: &[f64],
        diffuse: &mut [f64],
        emission: &mut [f64],
    ) {
        let bands = self.shape.bands.clamp(1, MAX_BANDS);
        for unknown in 0..self.coupling.unknowns() {
            let side = self.elements.facet_of(unknown).1;
            let rho = self.scene.diffuse(self.material(unknown));
            let area = self.elements.area(self.scene, unknown);
            // facets of a cluster take part by their areas
            let cluster = self.elements.is_cluster(unknown);
            for (facet, band) in self
                .elements
                .facets_of(unknown)
                .iter()
                .flat_map(|facet| (0..bands).map(move |band| (*facet as usize, band)))
            {
                let share = if cluster && area > 0.0 { self.scene.areas().at(facet) / area } else { 1.0 };
                let weight = share * lambda.at(unknown * bands + band);
                let place = (facet * self.scene.sides() + side) * bands + band;
                emission.set(place, emission.at(place) + weight);
                if rho.at(band) > 0.0 {
                    let at = facet * bands + band;
                    let arrives = weight * FRAC_1_PI * irradiance.at(unknown * bands + band);
                    diffuse.set(at, diffuse.at(at) + arrives);
                }
            }
        }
    }
}
