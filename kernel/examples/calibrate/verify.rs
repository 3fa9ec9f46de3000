//! The judge held to the readable twin on the calibration's own scenes.

use super::case::Case;
use super::reference::Reference;
use crate::judge::{Judge, ray};
use crate::support::twin::{self, Effort};
use blik_kernel::arena::Memory;
use blik_kernel::camera::Sampling;

/// rms difference between judge and twin at some `pixels` of a case relative to the reference radiance, noise taken
/// out, and the noise of both. `None` where the twin has no answer in reasonable time: means over pixels, mirrors in many planes
/// in the sun.
pub fn against_twin(case: &Case, reference: &Reference, pixels: usize) -> Option<(f64, f64)> {
    let mut memory = Memory::default();
    let mut scene = case.scene();
    let judge = Judge::new(&scene, &mut memory);
    if case.camera.sampling == Sampling::Area || (case.sun.is_some() && !judge.follows_all_mirrors()) {
        return None;
    }
    if let Some(sun) = scene.sun.take() {
        scene = scene.sun(sun);
    }
    let scale = judge.reference();
    let image = &reference.image;
    let hit: Vec<usize> = (0..image.hit.len()).filter(|&p| image.hit[p]).collect();
    let chosen: Vec<usize> = hit.iter().copied().step_by(hit.len().div_ceil(pixels).max(1)).collect();
    let (mut squares, mut noise) = (0.0, 0.0);
    for &pixel in &chosen {
        let (row, column) = (pixel / case.camera.columns, pixel % case.camera.columns);
        let ray = ray(&case.camera, column as f64 + 0.5, row as f64 + 0.5);
        let effort = Effort { seed: pixel as u64, threshold: 1e-4, randomisations: 16, ..Effort::rays(256) };
        let truth = twin::radiance(&scene, ray.origin, ray.direction, effort);
        for band in 0..scale.len() {
            let at = pixel * scale.len() + band;
            let [a, b] = [0, 1].map(|h| image.values[h][at]);
            let standard = truth.standard_error[band] / scale[band];
            squares +=
                (a - truth.mean[band]) * (b - truth.mean[band]) / scale[band].powi(2) - standard.powi(2);
            noise += standard.powi(2) + ((a - b) / (2.0 * scale[band])).powi(2);
        }
    }
    let count = (chosen.len() * scale.len()) as f64;
    Some(((squares / count).max(0.0).sqrt(), (noise / count).sqrt()))
}
