//! Which kinds of pixels carry a case's error.

use super::blik::Outcome;
use super::case::Case;
use super::reference::Reference;
use crate::judge::Judge;
use blik_kernel::arena::Memory;
use std::collections::BTreeMap;

/// Shares of eps_c squared by the difficulty of the pixels, largest first, each with its share of the pixels.
pub fn of(case: &Case, reference: &Reference, outcome: &Outcome) -> Vec<(String, f64, f64)> {
    let mut memory = Memory::default();
    let scene = case.scene();
    let judge = Judge::new(&scene, &mut memory);
    let [a, b] = &reference.image.values;
    let bands = outcome.reference.len();
    let mut sums: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    for pixel in (0..reference.image.hit.len()).filter(|&p| reference.image.hit[p]) {
        let square: f64 = (0..bands)
            .map(|band| {
                let at = pixel * bands + band;
                (outcome.pixels[at] - a[at]) * (outcome.pixels[at] - b[at]) / outcome.reference[band].powi(2)
            })
            .sum();
        let (cause, mirrored) = judge.cause(&case.camera, pixel, &outcome.shares);
        let name =
            if mirrored && cause != "mirror to sky" { format!("{cause} in a mirror") } else { cause.into() };
        let sum = sums.entry(name).or_default();
        (sum.0, sum.1) = (sum.0 + square, sum.1 + 1.0);
    }
    let (all, pixels) = sums.values().fold((0.0, 0.0), |t, s| (t.0 + s.0, t.1 + s.1));
    let mut shares: Vec<_> = sums.into_iter().map(|(name, (s, n))| (name, s / all, n / pixels)).collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares
}
