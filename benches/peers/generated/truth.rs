//! The truth of a scene's image by the judge's path tracing, in two independent halves.

use super::file::npy;
use crate::judge::{Judge, mix};
use crate::support::twin::Scene;
use blik_kernel::arena::Memory;
use blik_kernel::camera::CameraInput;
use serde_json::{Value, json};
use std::path::Path;

/// Pixels of which the truth is known, about. With the rays given, the standard error of eps_c^2 goes with the root of
/// their number; that many show an rms error that sits in a tenth of the pixels to 4 %.
const KNOWN: f64 = 1500.0;

/// Picks the pixels.
const SEED: u32 = 5;

/// Writes both halves (half, row, column, band; NaN where a pixel is not known or its centre ray meets nothing), sampled
/// until the standard error of eps_c falls below `goal` or the next doubling takes more than `rays`.
pub fn truth(
    scene: &Scene,
    camera: &CameraInput,
    goal: f64,
    rays: u64,
    out: &Path,
) -> Result<Value, Box<dyn std::error::Error>> {
    let mut memory = Memory::default();
    let judge = Judge::new(scene, &mut memory);
    // picked at random: a lattice would meet the kernel's own
    let hits = judge.hits(camera).into_iter().filter(|&h| h).count();
    let share = KNOWN / hits.max(1) as f64 * f64::from(u32::MAX);
    let taken = |pixel: usize| f64::from(mix(SEED, pixel as u32)) < share;
    let image = judge.image_of(camera, taken, goal, rays, 1);
    let bands = image.values[0].len() / image.hit.len();
    let masked = |half: usize| {
        let value = move |(i, &v): (usize, &f64)| (i / bands, v as f32);
        image.values[half].iter().enumerate().map(value)
    };
    let values = masked(0).chain(masked(1)).map(|(pixel, v)| if image.hit[pixel] { v } else { f32::NAN });
    npy(out, &[2, camera.rows as u64, camera.columns as u64, bands as u64], values)?;
    Ok(json!({ "samples": image.samples, "rays": image.rays }))
}
