//! Images of the judge: every pixel twice, with as many samples as an error asks for.

use super::score::variance;
use super::{Judge, Sampler, mix, path};
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::ray::Ray;
use glam::DVec3;
use std::sync::Mutex;

/// Samples of a pixel's half: the fewest, so that rare light shows in the noise, and the most that the sampler has.
const SAMPLES: (u32, u32) = (128, 65_536);

/// A reference image in two independent halves.
#[derive(Clone, Debug, PartialEq)]
pub struct Halves {
    /// Samples of each half of a pixel.
    pub samples: u32,
    /// Rays traced.
    pub rays: u64,
    /// Whether the ray through the pixel's centre meets the object.
    pub hit: Vec<bool>,
    /// Radiance, (row, column, band), by either half.
    pub values: [Vec<f64>; 2],
}

/// Runs `work` on blocks of `size` values on all cores, given the block's number.
pub fn in_parallel<T: Send>(values: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    let queue = Mutex::new(values.chunks_mut(size).enumerate());
    let next = || queue.lock().expect("no worker panics").next();
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, |n| n.get()) {
            scope.spawn(|| {
                while let Some((index, block)) = next() {
                    work(index, block);
                }
            });
        }
    });
}

/// A camera's axes, as the scene file defines them.
struct Lens {
    eye: DVec3,
    forward: DVec3,
    /// The steps of one pixel to the right and down.
    step: [DVec3; 2],
    parallel: bool,
    middle: [f64; 2],
}

impl Lens {
    fn new(camera: &CameraInput) -> Lens {
        let eye = DVec3::from(camera.eye);
        let forward = (DVec3::from(camera.target) - eye).normalize();
        let right = forward.cross(DVec3::from(camera.up)).normalize();
        let (height, parallel) = match camera.projection {
            Projection::Orthographic { height } => (height, true),
            Projection::Perspective { fov_deg } => (2.0 * (fov_deg.to_radians() / 2.0).tan(), false),
        };
        let pixel = height / camera.rows as f64;
        Lens {
            eye,
            forward,
            step: [right * pixel, -right.cross(forward) * pixel],
            parallel,
            middle: [camera.columns as f64 / 2.0, camera.rows as f64 / 2.0],
        }
    }

    fn ray(&self, column: f64, row: f64) -> Ray {
        let aside = self.step[0] * (column - self.middle[0]) + self.step[1] * (row - self.middle[1]);
        if self.parallel {
            Ray::new(self.eye + aside, self.forward)
        } else {
            Ray::new(self.eye, (self.forward + aside).normalize())
        }
    }
}

/// The ray through a point of a camera's image, in pixels from the upper left corner.
pub fn ray(camera: &CameraInput, column: f64, row: f64) -> Ray {
    Lens::new(camera).ray(column, row)
}

#[derive(Clone, Copy, Default)]
struct Pixel {
    sums: [[f64; 3]; 2],
    rays: u64,
}

impl Judge<'_> {
    /// Whether the ray through each pixel's centre meets the object.
    pub fn hits(&self, camera: &CameraInput) -> Vec<bool> {
        let (lens, columns) = (Lens::new(camera), camera.columns);
        let centre = |p: usize| lens.ray((p % columns) as f64 + 0.5, (p / columns) as f64 + 0.5);
        (0..columns * camera.rows).map(|p| self.bvh.closest(&centre(p)).is_some()).collect()
    }

    /// The image of a camera, with samples doubled until the standard error of eps_c against a perfect image falls
    /// below `goal` (relative to the reference radiance), or the next doubling would take more than `most_rays`.
    pub fn image(&self, camera: &CameraInput, goal: f64, most_rays: u64, seed: u32) -> Halves {
        self.image_of(camera, |_| true, goal, most_rays, seed)
    }

    /// As above, of the pixels that `taken` picks alone: the others count as if they met nothing.
    pub fn image_of(
        &self,
        camera: &CameraInput,
        taken: impl Fn(usize) -> bool,
        goal: f64,
        most_rays: u64,
        seed: u32,
    ) -> Halves {
        let lens = Lens::new(camera);
        let (columns, bands) = (camera.columns, self.bands);
        let reference = self.reference();
        let mut pixels = vec![Pixel::default(); columns * camera.rows];
        let hit: Vec<bool> = self.hits(camera).into_iter().enumerate().map(|(p, h)| h && taken(p)).collect();
        let counted = hit.iter().filter(|&&h| h).count().max(1) as f64;
        let (mut done, mut samples) = (0, SAMPLES.0);
        loop {
            in_parallel(&mut pixels, 1, |index, pixel| {
                if hit[index] {
                    self.sample(&lens, camera.sampling, (index, columns), seed, done..samples, &mut pixel[0]);
                }
            });
            done = samples;
            let half = |half: usize| -> Vec<f64> {
                let of = |p: &Pixel| p.sums[half].map(|s| s / f64::from(done));
                pixels.iter().flat_map(|p| of(p)[..bands].to_vec()).collect()
            };
            let values = [half(0), half(1)];
            let rays = pixels.iter().map(|p| p.rays).sum();
            let error = (variance([&values[0], &values[1]], &hit, &reference) / counted.sqrt()).sqrt();
            if error <= goal || 2 * rays > most_rays || samples == SAMPLES.1 {
                return Halves { samples, rays, hit, values };
            }
            samples *= 2;
        }
    }

    /// Adds samples of a pixel to both of its halves.
    fn sample(
        &self,
        lens: &Lens,
        sampling: Sampling,
        (index, columns): (usize, usize),
        seed: u32,
        range: std::ops::Range<u32>,
        pixel: &mut Pixel,
    ) {
        let (column, row) = ((index % columns) as f64, (index / columns) as f64);
        for (half, sum) in pixel.sums.iter_mut().enumerate() {
            let seed = mix(mix(seed, index as u32), half as u32);
            for index in range.clone() {
                let mut path = path(Sampler { seed, index });
                let [u, v, x, y] = path.sampler.four(0);
                let [x, y] = if sampling == Sampling::Area { [x, y] } else { [0.5; 2] };
                self.look(&mut path, lens.ray(column + x, row + y), [u, v]);
                pixel.rays += path.rays;
                sum.iter_mut().zip(path.sum).for_each(|(s, x)| *s += x);
            }
        }
    }
}
