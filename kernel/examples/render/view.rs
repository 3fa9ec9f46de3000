//! What the camera sees, told by rays through pixel centres: fronts, backs, or nothing of the object.

use blik_kernel::Error;
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{Camera, CameraInput};
use blik_kernel::scene::Scene;
use serde::Serialize;

/// Pixel centres looked through: shares are known to a percent, in a few milliseconds.
const SAMPLES: usize = 1 << 14;

/// Counts of pixel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct View {
    /// Pixel centres looked through: all of a small image, a grid of a large one.
    pub samples: u64,
    /// Of these, those that show a facet's front, or either side where both carry the material.
    pub fronts: u64,
    /// Those that show a back, which is black.
    pub backs: u64,
    /// Those that show the background.
    pub background: u64,
}

impl View {
    /// Looks through the camera; where nothing is met, through every pixel.
    pub fn new(scene: &Scene, bvh: &Bvh, camera: &CameraInput) -> Result<Self, Error> {
        let camera = Camera::new(camera, scene)?;
        let pixels = camera.columns() * camera.rows();
        // A step that is no divisor of the rows' length spreads over the columns.
        let step = pixels.div_ceil(SAMPLES);
        let step = if step > 1 && camera.columns().is_multiple_of(step) { step + 1 } else { step };
        let view = View::through(scene, bvh, &camera, step);
        Ok(if view.background == view.samples && step > 1 {
            View::through(scene, bvh, &camera, 1)
        } else {
            view
        })
    }

    fn through(scene: &Scene, bvh: &Bvh, camera: &Camera, step: usize) -> Self {
        let mut view = View::default();
        for pixel in (0..camera.columns() * camera.rows()).step_by(step) {
            let (row, column) = (pixel / camera.columns(), pixel % camera.columns());
            let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
            view.samples += 1;
            match bvh.closest(&ray) {
                None => view.background += 1,
                Some(hit) => {
                    let front = scene.normals()[hit.facet as usize].dot(ray.direction) < 0.0;
                    let seen = if front || scene.sides() == 2 { &mut view.fronts } else { &mut view.backs };
                    *seen += 1;
                }
            }
        }
        view
    }

    /// Share of backs in what is seen of the object.
    pub fn share_of_backs(&self) -> f64 {
        self.backs as f64 / (self.fronts + self.backs).max(1) as f64
    }
}
