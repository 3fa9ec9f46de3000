//! Expected errors of the diffuse solution, from differences between independent resolutions, under the given light.
//!
//! Every row of the coupling was traced in two halves, from four quarters of its element. The radiance that both halves
//! see differs by their rays' noise. The radiance that the middle quarter sees, beside the mean of the others, is what
//! the linear function over the element leaves out; the product of both halves' values for it is free of noise's bias.
//!
//! The halves' differences are propagated from element to element as light is: in rooms that reflect much, small errors
//! of all rows add up.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (true errors beside these estimates).

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, pieces, span};
use crate::base::math::{fabs, narrow};
use crate::base::simd::{self, Isa, LaneTask, Lanes};
use crate::coupling::mirror_path::STRAIGHT;
use crate::coupling::{BLOCKED, ENCLOSED, RowView};
use crate::radiosity::System;
use crate::radiosity::straight;
use crate::scene::sky::Sky;
use crate::scene::{MAX_BANDS, Scene};
use core::ops::Range;

/// Variance of a linear function through what three quarters see, over that of the mean of all four: 1 + 8/3 for
/// independent quarters.
const LINEAR_VARIANCE: f64 = 11.0 / 3.0;

/// Mean square departure from a linear function over that of the middle from the corners: 1.1 for a parabola, 1.6 for
/// quadratic functions at large, 1.8 beside walls, 2.4 for jumps.
const DEPARTURE_FACTOR: f64 = 2.0;

/// Radiance that a row's rays have not met, in rays: an object that none of n rays meets fills some 1/(2n) of the
/// hemisphere.
pub const ROW_UNSEEN_RAYS: f64 = 0.5;

/// Most products of [`propagate`]: in a room of albedo 0.85 they leave out a seventh.
const MOST_CARRIED: u32 = 12;

/// Largest share of the carried errors that products left out may have. Products end there, or at [`MOST_CARRIED`].
const LEFT_OUT: f64 = 5e-3;

/// How often [`propagate`] is called, and the products that it and [`rows`] make: each brings at most q of
/// what the one before did, q the largest diffuse reflectance and what mirrors add to it.
pub fn carried(scene: &Scene<'_>) -> u32 {
    let q = scene.largest_diffuse() / (1.0 - scene.largest_specular()).max(f64::MIN_POSITIVE);
    let (mut products, mut rest) = (1, q);
    while rest > LEFT_OUT && products < MOST_CARRIED {
        rest *= q;
        products += 1;
    }
    products
}

/// Error of one band that a row's own rays tell, relative to the reference radiance.
pub type Own = [f32; 2];

/// For the rows of `range`, one of each band: half the difference between the halves of the row's rays, irradiance over
/// pi; and the expected squared error of the linear function over the element. `radiance` is the solved diffuse
/// radiance of all unknowns.
///
/// # Errors
/// [`Error::Length`] for an output of another length.
pub fn differences(
    system: &System<'_>,
    radiance: &[f64],
    reference: &[f64],
    range: Range<usize>,
    out: &mut [Own],
) -> Result<(), Error> {
    let bands = system.shape.bands;
    check(out.len(), span(&range) * bands)?;
    simd::run_lanes(Isa::detect(), Differences { system, radiance, reference, range, out });
    Ok(())
}

/// Relative error of the irradiances of the whole sky whose variance over a cluster's facets counts.
const TURNED_SKY_ERROR: f64 = 1e-2;

/// [`differences`] at work.
struct Differences<'a, 'o> {
    system: &'a System<'a>,
    radiance: &'a [f64],
    reference: &'a [f64],
    range: Range<usize>,
    out: &'o mut [Own],
}

impl LaneTask for Differences<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Differences { system, radiance, reference, range, out } = self;
        let bands = system.shape.bands.clamp(1, MAX_BANDS);
        // one by one: a pair of them would be made elsewhere on the stack and copied
        let mut half_differences = [[0.0; 4]; MAX_BANDS];
        let (mut light, mut means) = ([0.0; MAX_BANDS], [0.0; MAX_BANDS]);
        let (sums, light) = (half_differences.head_mut(bands), light.head_mut(bands));
        let means = means.head_mut(bands);
        for ((unknown, row), out) in system.coupling.rows(range).zip(pieces(out, bands)) {
            sums.fill([0.0; 4]);
            add_targets(&row, radiance, sums);
            let known = system.straight.knows(unknown);
            if let Some(sky) = &system.light.sky {
                add_sky(&row, (sky, known), lanes, light, sums);
            }
            // a cluster's mean has what its rays leave of the straight sky, too
            let cluster = known && system.elements.is_cluster(unknown);
            means.fill(0.0);
            if let Some(sky) = system.light.sky.as_ref().filter(|_| cluster) {
                means.iter_mut().zip(&*sums).for_each(|(mean, [first, second, ..])| *mean = first + second);
                add_straight(&row, sky, lanes, light, means);
            }
            if known {
                about_mean(system, unknown, &row, radiance, lanes, light, sums);
            }
            let function = if system.elements.is_cluster(unknown) { 1.0 } else { LINEAR_VARIANCE };
            // what facets of a cluster see of the sky differs, whatever is in its way
            let turned = match &system.light.sky {
                Some(sky) if !known && system.elements.is_cluster(unknown) => {
                    let of = (system.scene, system.elements);
                    straight::whole_sky(of, (sky, TURNED_SKY_ERROR), unknown, reference, light)
                }
                _ => 0.0,
            };
            for (((out, sums), mean), reference) in out.iter_mut().zip(&*sums).zip(&*means).zip(reference) {
                let scale = if *reference > 0.0 { 1.0 / reference } else { 0.0 };
                let sums = sums.map(|s| scale * s);
                let mean = if cluster { scale * mean } else { sums[0] + sums[1] };
                *out = [narrow(mean), narrow(square(sums, function) + turned)];
            }
        }
    }
}

/// Expected squared error at points of an element, by the differences of its rays' halves and quarters: `function` is the
/// variance of what stands for the light on it over that of its mean.
#[inline(always)]
pub(super) fn square([first, second, one, other]: [f64; 4], function: f64) -> f64 {
    let noise = function * (first * first + second * second);
    noise + DEPARTURE_FACTOR * (one * other).max(0.0)
}

/// How wrong the radiances of the rows of `range` are by their differences and by what others' errors (`from`, as this
/// gives them; empty: none) bring them: times pi, one value of each band, relative to the reference radiance.
///
/// # Errors
/// [`Error::Length`] for an output of another length.
pub fn propagate(
    system: &System<'_>,
    differences: &[Own],
    from: &[f32],
    range: Range<usize>,
    out: &mut [f32],
) -> Result<(), Error> {
    let bands = system.shape.bands.clamp(1, MAX_BANDS);
    check(out.len(), span(&range) * bands)?;
    let mut sums = [0.0; MAX_BANDS];
    let sums = sums.head_mut(bands);
    for ((unknown, row), out) in system.coupling.rows(range).zip(pieces(out, bands)) {
        if !from.is_empty() {
            row.gather(from, sums);
        }
        let diffuse = system.scene.diffuse(system.scene.material(system.elements.facet_of(unknown).0));
        let own = differences.part(unknown * bands..(unknown + 1) * bands);
        for (out, ((sum, [own, _]), rho)) in out.iter_mut().zip(sums.iter().zip(own).zip(diffuse)) {
            *out = narrow(rho * (f64::from(*own) + sum));
        }
    }
    Ok(())
}

/// Expected squared error of the irradiance over pi of each unknown in `range`, relative to the reference radiance, in
/// the band where it is largest: where noise is all there is, up to three times that. From the [`differences`] of all
/// unknowns and what [`propagate`] came to. An element inside a body has its stand-in's.
///
/// # Errors
/// [`Error::Length`] for an output of another length.
pub fn rows(
    system: &System<'_>,
    differences: &[Own],
    carried: &[f32],
    range: Range<usize>,
    out: &mut [f32],
) -> Result<(), Error> {
    let bands = system.shape.bands.clamp(1, MAX_BANDS);
    check(out.len(), span(&range))?;
    let mut sums = [0.0; MAX_BANDS];
    let sums = sums.head_mut(bands);
    let unseen = if is_dark(system) { 0.0 } else { ROW_UNSEEN_RAYS };
    for ((unknown, row), out) in system.coupling.rows(range).zip(out) {
        let near = system.substitute_row(unknown, &row);
        let known = near.and_then(|near| system.coupling.rows(near..near + 1).next());
        let (unknown, row) = known.unwrap_or((unknown, row));
        row.gather(carried, sums);
        let own = differences.part(unknown * bands..(unknown + 1) * bands);
        let rays = f64::from(row.row.rays);
        let unseen = if rays > 0.0 { (unseen / rays) * (unseen / rays) } else { 0.0 };
        let square = |(&[_, own], &carried): (&Own, &f64)| unseen + f64::from(own) + carried * carried;
        *out = narrow(own.iter().zip(&*sums).map(square).fold(0.0, f64::max));
    }
    Ok(())
}

/// Whether there is no light at all.
fn is_dark(system: &System<'_>) -> bool {
    system.light.sky.is_none() && system.light.sun.is_none() && !system.light.emits(system.scene)
}

fn check(given: usize, expected: usize) -> Result<(), Error> {
    if given == expected { Ok(()) } else { Err(Error::Length { what: "errors", expected, given }) }
}

/// Difference of a row's blocked share from that of its targets that are met first, up to which each of its rays that meet
/// anything has one.
const ONE_EACH: f64 = 1e-6;

/// Takes the mean of what is met off a row's checks, where outlines tell how much is met: its entries are multiplied so
/// that they fill it, and their halves differ by what differs from the mean alone.
// apart on small machines: does not burden the stack of skies
#[cfg_attr(target_pointer_width = "32", inline(never))]
#[cfg_attr(not(target_pointer_width = "32"), inline(always))]
fn about_mean<L: Lanes>(
    system: &System<'_>,
    unknown: usize,
    row: &RowView<'_>,
    radiance: &[f64],
    lanes: L,
    light: &mut [f64],
    sums: &mut [[f64; 4]],
) {
    let bands = sums.len();
    let (mut met, mut half_differences) = (0.0, [0.0; 4]);
    for record in row.targets.iter().filter(|record| record.path() == STRAIGHT) {
        met += record.weight;
        half_differences.iter_mut().zip(record.half_differences).for_each(|(sum, c)| *sum += f64::from(c));
    }
    if met <= 0.0 || fabs(met - row.row.blocked) > ONE_EACH {
        return;
    }
    let mut means = [0.0; MAX_BANDS];
    row.gather(radiance, means.head_mut(bands));
    if let Some(sky) = &system.light.sky {
        for bundle in row.escapes.into_iter().filter(|bundle| !matches!(bundle.path, BLOCKED | STRAIGHT)) {
            sky.sum(lanes, bundle.packed, light);
            let seen = light.iter().zip(row.products(bundle.path));
            means.iter_mut().zip(seen).for_each(|(mean, (l, p))| *mean += bundle.weight * l * p);
        }
    }
    let scale = system.straight.scale(unknown, bands, &row.row);
    for (sums, mean) in sums.iter_mut().zip(&means) {
        sums.iter_mut().zip(half_differences).for_each(|(sum, c)| *sum = scale * (*sum - mean / met * c));
    }
}

/// Adds a row's checks, each times the light it stands for, by band.
#[inline(always)]
pub(super) fn add(sums: &mut [[f64; 4]], half_differences: [f32; 4], lights: impl Iterator<Item = f64>) {
    for (sum, light) in sums.iter_mut().zip(lights) {
        sum.iter_mut().zip(half_differences).for_each(|(s, c)| *s += light * f64::from(c));
    }
}

#[inline(always)]
fn add_targets(row: &RowView<'_>, radiance: &[f64], sums: &mut [[f64; 4]]) {
    let bands = sums.len();
    for record in row.targets {
        let start = record.unknown() * bands;
        let seen = radiance.part(start..start + bands);
        add(sums, record.half_differences, seen.iter().zip(row.products(record.path())).map(|(l, p)| l * p));
    }
}

/// Adds half the difference between the halves of a row's rays of what they see of the sky straight.
#[inline(always)]
fn add_straight<L: Lanes>(row: &RowView<'_>, sky: &Sky<'_>, lanes: L, light: &mut [f64], sums: &mut [f64]) {
    for (bundle, sign) in row.straight_sky() {
        sky.sum(lanes, bundle.packed, light);
        let [first, second, ..] = bundle.half_differences.map(f64::from);
        sums.iter_mut().zip(&*light).for_each(|(sum, l)| *sum += sign * (first + second) * l);
    }
}

/// `light` has room for a value of each band; what is seen straight may be `known`.
#[inline(always)]
fn add_sky<L: Lanes>(
    row: &RowView<'_>,
    (sky, known): (&Sky<'_>, bool),
    lanes: L,
    light: &mut [f64],
    sums: &mut [[f64; 4]],
) {
    for bundle in row.escapes {
        if known && matches!(bundle.path, BLOCKED | STRAIGHT) {
            continue;
        }
        sky.sum(lanes, bundle.packed, light);
        match bundle.path {
            BLOCKED if row.row.state != ENCLOSED => light.iter_mut().for_each(|l| *l = -*l),
            path => light.iter_mut().zip(row.products(path)).for_each(|(l, product)| *l *= product),
        }
        add(sums, bundle.half_differences, light.iter().copied());
    }
}
