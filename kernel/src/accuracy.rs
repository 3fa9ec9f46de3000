//! How wrong the diffuse solution is expected to be: from differences between independent resolutions, under the light
//! that there is.
//!
//! Every row of the coupling was traced in two halves, from four quarters of its element. What both halves see of the
//! solved radiances differs by their rays' noise; what the middle quarter sees beside the mean of the others is what
//! the linear function over the element leaves out, and the product of both halves' values for it is free of noise's
//! bias.
//!
//! The halves' differences go on from element to element as light does: in rooms that reflect much, small errors of
//! all rows add up.

use crate::coupling::{BLOCKED, ENCLOSED, RowView};
use crate::error::Error;
use crate::index::{Index, IndexMut, pieces, span};
use crate::light::Light;
use crate::radiosity::System;
use crate::scene::MAX_BANDS;
use crate::simd::Isa;
use core::ops::Range;

/// Variance of a linear function through what three quarters see, over that of the mean of all four: of independent
/// quarters 1 + 8/3.
const LINEAR: f64 = 11.0 / 3.0;

/// Mean square departure from a linear function over that of the middle from the corners: 1.1 for a parabola, 1.6 for
/// quadratic functions at large, 1.8 beside walls, 2.4 for jumps.
const DEPARTURE: f64 = 2.0;

/// How often [`carry`] is called: in a room of albedo 0.85 a seventh is left out.
pub const CARRIED: usize = 12;

/// Half the difference between the halves of each row's rays, for the rows of `range`: irradiance over pi, one value
/// per band. `radiance` is the solved diffuse radiance of all unknowns.
///
/// # Errors
/// [`Error::Length`] for an output of another length.
pub fn differences(
    system: &System<'_>,
    radiance: &[f64],
    range: Range<usize>,
    out: &mut [f64],
) -> Result<(), Error> {
    let bands = system.shape.bands;
    check(out.len(), span(&range) * bands)?;
    let mut checks = Checks::ZERO;
    for ((_, row), out) in system.coupling.rows(range).zip(pieces(out, bands)) {
        let sums = checks.of(&row, system.light, radiance, bands);
        out.iter_mut().zip(sums).for_each(|(o, [first, second, ..])| *o = first + second);
    }
    Ok(())
}

/// What the rows of `range` get of the other rows' differences, and of what those got before (`from`).
///
/// # Errors
/// [`Error::Length`] for an output of another length.
pub fn carry(
    system: &System<'_>,
    differences: &[f64],
    from: &[f64],
    range: Range<usize>,
    out: &mut [f64],
) -> Result<(), Error> {
    let bands = system.shape.bands;
    check(out.len(), span(&range) * bands)?;
    for ((_, row), out) in system.coupling.rows(range).zip(pieces(out, bands)) {
        out.fill(0.0);
        for record in row.targets {
            let at = record.unknown() * bands;
            let part = |values: &[f64], band: usize| values.at(at + band);
            let facet = system.elements.facet_of(record.unknown()).0;
            let diffuse = system.scene.diffuse(system.scene.material(facet));
            let terms = diffuse.iter().zip(row.products(record.word())).enumerate();
            for (out, (band, (rho, product))) in out.iter_mut().zip(terms) {
                *out += record.weight * rho * product * (part(differences, band) + part(from, band));
            }
        }
    }
    Ok(())
}

/// Expected squared error of the irradiance over pi of each unknown in `range`, relative to `reference`, in the band
/// where it is largest: where noise is all there is, up to three times that. `radiance` is the solved diffuse radiance
/// of all unknowns, `carried` what [`carry`] came to. An element inside a body has its stand-in's.
///
/// # Errors
/// [`Error::Length`] for an output of another length.
pub fn rows(
    system: &System<'_>,
    radiance: &[f64],
    carried: &[f64],
    reference: &[f64],
    range: Range<usize>,
    out: &mut [f32],
) -> Result<(), Error> {
    check(out.len(), span(&range))?;
    let bands = system.shape.bands;
    let mut checks = Checks::ZERO;
    for ((unknown, row), out) in system.coupling.rows(range).zip(out) {
        let near = system.stand_in(unknown, &row);
        let known = near.and_then(|near| system.coupling.rows(near..near + 1).next());
        let (unknown, row) = known.unwrap_or((unknown, row));
        let sums = checks.of(&row, system.light, radiance, bands);
        let carried = carried.get(unknown * bands..).unwrap_or(&[]);
        let mut largest: f64 = 0.0;
        for (([first, second, one, other], carried), reference) in sums.iter().zip(carried).zip(reference) {
            if *reference > 0.0 {
                let noise = LINEAR * (first * first + second * second) + carried * carried;
                largest =
                    f64::max(largest, (noise + DEPARTURE * (one * other).max(0.0)) / (reference * reference));
            }
        }
        *out = largest.min(f64::from(f32::MAX)) as f32;
    }
    Ok(())
}

fn check(given: usize, expected: usize) -> Result<(), Error> {
    if given == expected { Ok(()) } else { Err(Error::Length { what: "errors", expected, given }) }
}

/// A row's checks, each times the light it stands for, summed, by band.
struct Checks([[f64; 4]; MAX_BANDS]);

impl Checks {
    const ZERO: Checks = Checks([[0.0; 4]; MAX_BANDS]);

    /// Those of a row: in place, as they are large.
    #[inline(always)]
    fn of(&mut self, row: &RowView<'_>, light: &Light<'_>, radiance: &[f64], bands: usize) -> &[[f64; 4]] {
        let sums = self.0.head_mut(bands);
        sums.fill([0.0; 4]);
        add_targets(row, radiance, sums);
        add_sky(row, light, sums);
        sums
    }
}

fn add(sums: &mut [[f64; 4]], checks: [f32; 4], lights: impl Iterator<Item = f64>) {
    for (sum, light) in sums.iter_mut().zip(lights) {
        sum.iter_mut().zip(checks).for_each(|(s, c)| *s += light * f64::from(c));
    }
}

fn add_targets(row: &RowView<'_>, radiance: &[f64], sums: &mut [[f64; 4]]) {
    let bands = sums.len();
    for record in row.targets {
        let start = record.unknown() * bands;
        let seen = radiance.part(start..start + bands);
        add(sums, record.checks, seen.iter().zip(row.products(record.word())).map(|(l, p)| l * p));
    }
}

fn add_sky(row: &RowView<'_>, light: &Light<'_>, sums: &mut [[f64; 4]]) {
    let Some(sky) = &light.sky else { return };
    let isa = Isa::detect();
    let mut radiance = [0.0; MAX_BANDS];
    let radiance = radiance.head_mut(sums.len());
    for bundle in row.escapes {
        sky.sum(bundle.packed, isa, radiance);
        match bundle.word {
            BLOCKED if row.row.state != ENCLOSED => radiance.iter_mut().for_each(|l| *l = -*l),
            word => radiance.iter_mut().zip(row.products(word)).for_each(|(l, product)| *l *= product),
        }
        add(sums, bundle.checks, radiance.iter().copied());
    }
}
