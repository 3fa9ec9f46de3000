//! The judge's answer to a case, kept in a file for the next run.

use super::case::Case;
use crate::judge::{Halves, Judge};
use blik_kernel::arena::Memory;
use std::io;
use std::path::Path;

/// Changes with the judge's samples: files of another version are computed anew.
const VERSION: u64 = 2;

/// Samples of either half of a side's irradiance, and the number of sides.
const SIDES: (u32, usize) = (4096, 24);

/// How good a reference is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Standard error of eps_c against a perfect image, in tolerances.
    pub error: f64,
    /// Rays after which it is good enough.
    pub rays: u64,
}

/// Image and irradiances, each in two independent halves.
#[derive(Debug, PartialEq)]
pub struct Reference {
    /// The image.
    pub image: Halves,
    /// Some sides of diffuse facets: facet and whether it is the front.
    pub sides: Vec<(usize, bool)>,
    /// Their irradiances, (side, band).
    pub irradiance: [Vec<f64>; 2],
}

/// The reference from its file in `folder`, or computed and written there.
pub fn of(case: &Case, goal: Goal, folder: &Path) -> io::Result<Reference> {
    let name = format!("{:03}-{}-{:016x}.ref", case.index, case.family, key(case, goal));
    let path = folder.join(name);
    if let Some(known) = std::fs::read(&path).ok().as_deref().and_then(parse) {
        return Ok(known);
    }
    let reference = compute(case, goal);
    std::fs::create_dir_all(folder)?;
    // a run that is broken off leaves no half of a file under this name
    let unfinished = path.with_extension("new");
    std::fs::write(&unfinished, bytes(&reference))?;
    std::fs::rename(&unfinished, &path)?;
    Ok(reference)
}

/// FNV-1a of everything on which the reference depends.
fn key(case: &Case, goal: Goal) -> u64 {
    // the tolerance is in the goal, so that one set serves any kernel settings
    let Case { mesh, materials, two_sided, sky, sun, camera, tolerance, .. } = case;
    let text = format!(
        "{VERSION} {mesh:?} {materials:?} {two_sided} {sky:?} {sun:?} {camera:?} {tolerance} {goal:?}"
    );
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

fn compute(case: &Case, goal: Goal) -> Reference {
    let mut memory = Memory::default();
    let scene = case.scene();
    let judge = Judge::new(&scene, &mut memory);
    let seed = 2 * case.index as u32;
    let image = judge.image(&case.camera, goal.error * case.tolerance, goal.rays, seed);
    let fronts = if case.two_sided { 2 } else { 1 };
    let diffuse: Vec<(usize, bool)> = (0..fronts * scene.areas.len())
        .map(|s| (s / fronts, s % fronts == 0))
        .filter(|&(f, _)| scene.areas[f] > 0.0 && scene.materials[f].diffuse.iter().any(|&d| d > 0.0))
        .collect();
    let step = diffuse.len().div_ceil(SIDES.1).max(1);
    let sides: Vec<_> = diffuse.into_iter().step_by(step).collect();
    let irradiance = judge.irradiances(&sides, SIDES.0, seed + 1);
    Reference { image, sides, irradiance }
}

/// All numbers as little-endian f64: five counts, then the arrays.
fn bytes(reference: &Reference) -> Vec<u8> {
    let Reference { image, sides, irradiance } = reference;
    let counts = [
        f64::from(image.samples),
        image.rays as f64,
        image.hit.len() as f64,
        image.values[0].len() as f64,
        sides.len() as f64,
        irradiance[0].len() as f64,
    ];
    let hit = image.hit.iter().map(|&h| f64::from(u8::from(h)));
    let sides = sides.iter().flat_map(|&(f, front)| [f as f64, f64::from(u8::from(front))]);
    let arrays = image.values.iter().chain(irradiance).flatten().copied();
    counts.into_iter().chain(hit).chain(sides).chain(arrays).flat_map(f64::to_le_bytes).collect()
}

fn parse(bytes: &[u8]) -> Option<Reference> {
    let mut numbers = bytes.as_chunks::<8>().0.iter().map(|&c| f64::from_le_bytes(c));
    let mut take = |n: usize| -> Option<Vec<f64>> {
        let taken: Vec<f64> = numbers.by_ref().take(n).collect();
        (taken.len() == n).then_some(taken)
    };
    let counts = take(6)?;
    let [pixels, values, sides, received] = [2, 3, 4, 5].map(|k: usize| counts[k] as usize);
    let hit = take(pixels)?.iter().map(|&h| h != 0.0).collect();
    let sides =
        take(2 * sides)?.as_chunks::<2>().0.iter().map(|&[f, front]| (f as usize, front != 0.0)).collect();
    let values = [take(values)?, take(values)?];
    let irradiance = [take(received)?, take(received)?];
    let image = Halves { samples: counts[0] as u32, rays: counts[1] as u64, hit, values };
    Some(Reference { image, sides, irradiance })
}
