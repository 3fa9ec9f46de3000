//! What sampling the pixels' area brings of an image's error: the same solution, seen by many more rays.

use blik_kernel::Error;
use blik_kernel::camera::{Camera, CameraInput, Sampling};
use blik_kernel::chain::{RaySample, Terms};
use blik_kernel::host::Lit;
use blik_kernel::image::{self, Tally, Target};
use blik_kernel::qmc::{Sequence, hash2};
use std::fmt;

/// Errors of area sampling over the pixels on the object, relative to the reference radiance.
pub struct Sampled {
    /// Root mean square in the worst band.
    eps: f64,
    /// The part of it that is on pixels of one ray.
    kept: f64,
    /// The estimate.
    estimate: f64,
    /// Seconds of one thread, by area sampling.
    seconds: f64,
    /// What was done.
    tally: Tally,
}

impl fmt::Display for Sampled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Sampled { eps, kept, estimate, seconds, tally } = self;
        let Tally { object_pixels, refined, primary, chain, .. } = tally;
        write!(
            f,
            "{eps:.3e},{kept:.3e},{estimate:.3e},{object_pixels},{refined},{primary},{chain},{seconds:.4}"
        )
    }
}

/// Compares area sampling with the mean of `rays` rays through each pixel; nothing for centre sampling.
pub fn compare(lit: &Lit<'_>, input: &CameraInput, rays: u32) -> Result<Sampled, Error> {
    let solved = lit.solved();
    let camera = Camera::new(input, solved.scene)?;
    let bands = solved.shape.bands;
    let (rows, columns) = (camera.rows(), camera.columns());
    let mut scratch =
        blik_kernel::arena::Memory::new(image::scratch_bytes(&camera, solved.scene, solved.elements)?);
    let mut pixels = vec![0f32; rows * columns * bands];
    let mut target = Target { image: &mut pixels, components: [&mut [], &mut [], &mut []] };
    let start = std::time::Instant::now();
    let tally = image::rows(&solved, &camera, 0..rows, &mut target, scratch.bytes_mut())?;
    let seconds = start.elapsed().as_secs_f64();
    let rays = if input.sampling == Sampling::Area { rays } else { 1 };
    let mean = |pixel: usize| {
        let (row, column) = (pixel / columns, pixel % columns);
        let centre = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
        solved.bvh.closest(&centre)?;
        let mut terms = Terms::ZERO;
        let mut alone = Terms::ZERO;
        solved.radiance(&centre, RaySample::Probe(hash2(row as u32, column as u32)), &mut alone);
        let seed = hash2(pixel as u32, 0x0a2e_a000);
        let sequence = Sequence::new(seed);
        for index in 0..rays {
            let (x, y) = sequence.pair(index, 0);
            let ray = camera.ray(column as f64 + x, row as f64 + y);
            solved.radiance(&ray, RaySample::Stratum { seed, index }, &mut terms);
        }
        Some((0..bands).map(|b| (terms.sum(b) / f64::from(rays), alone.sum(b) as f32)).collect::<Vec<_>>())
    };
    let (mut squares, mut kept) = (vec![0.0; bands], vec![0.0; bands]);
    for pixel in 0..rows * columns {
        let Some(truth) = mean(pixel) else { continue };
        for (band, (mean, alone)) in truth.into_iter().enumerate() {
            let own = pixels[pixel * bands + band];
            let d = ((f64::from(own) - mean) / lit.reference()[band]).powi(2) / tally.object_pixels as f64;
            squares[band] += d;
            kept[band] += if own == alone { d } else { 0.0 };
        }
    }
    let worst = |squares: &[f64]| squares.iter().fold(0.0, |a: f64, &b| a.max(b)).sqrt();
    let estimate = (tally.sampling2 / tally.object_pixels.max(1) as f64).sqrt();
    Ok(Sampled { eps: worst(&squares), kept: worst(&kept), estimate, seconds, tally })
}
