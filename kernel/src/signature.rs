//! What a distant observer measures of the whole object, without an image: radiant intensity, projected area.

use crate::bvh::Ahead;
use crate::camera::Camera;
use crate::chain::{Sample, Solved, Terms, Work};
use crate::error::Error;
use crate::index::Index;
use crate::math::{Vec3, frame, unit};
use crate::qmc::{Sequence, hash2};
use crate::ray::Ray;
use crate::scene::MAX_BANDS;
use core::ops::Range;

/// Rays that look at the object's whole projection along one direction, on a square grid of cells.
#[derive(Clone, Copy, Debug)]
pub struct View {
    corner: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    cells: usize,
    cell_area: f64,
}

impl View {
    /// The view along `forward` (toward the object), on `cells` x `cells` cells.
    pub fn new(solved: &Solved<'_>, forward: Vec3, cells: usize) -> Result<View, Error> {
        let forward = unit(forward).ok_or(Error::Direction { field: crate::error::Field::Direction })?;
        let (right, up) = frame(forward);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in solved.scene.corners().iter().flatten() {
            let p = Vec3::new(corner.dot(right), corner.dot(up), corner.dot(forward));
            (low, high) = (low.min(p), high.max(p));
        }
        let size = high - low;
        let cells = cells.max(1);
        let step = 1.0 / cells as f64;
        Ok(View {
            corner: right * low.x + up * low.y + forward * (low.z - 1.0),
            right: right * (size.x * step),
            up: up * (size.y * step),
            forward,
            cells,
            cell_area: size.x * size.y * step * step,
        })
    }

    /// The view of a camera's middle: along its viewing direction.
    pub fn of_camera(solved: &Solved<'_>, camera: &Camera, cells: usize) -> Result<View, Error> {
        View::new(solved, camera.forward(), cells)
    }

    /// Cells along each side: rows to be computed.
    pub fn rows(&self) -> usize {
        self.cells
    }
}

/// Sums over a row of cells, or over several.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    /// Projected area, in the caller's square units.
    pub area: f64,
    /// Radiant intensity in W/sr, one value per band.
    pub intensity: [f64; MAX_BANDS],
    /// Rays traced.
    pub rays: u64,
}

impl Sums {
    /// Nothing yet.
    pub const ZERO: Sums = Sums { area: 0.0, intensity: [0.0; MAX_BANDS], rays: 0 };

    /// Adds the next row.
    pub fn add(&mut self, next: &Sums) {
        self.area += next.area;
        self.intensity.iter_mut().zip(&next.intensity).for_each(|(a, b)| *a += b);
        self.rays += next.rays;
    }
}

/// The sums over each row of cells in `range`: one ray in each cell, spread over the cells by a low-discrepancy
/// sequence. Error of the sums over all n^2 cells: about n^-3/2 of the value for the outline, less inside.
pub fn rows(solved: &Solved<'_>, view: &View, range: Range<usize>, out: &mut [Sums]) -> Result<(), Error> {
    rows_in(solved, view, range, (&mut { Terms::ZERO }, &mut { Work::ZERO }), out)
}

/// The same in the caller's memory, of any content.
pub fn rows_in(
    solved: &Solved<'_>,
    view: &View,
    range: Range<usize>,
    (terms, work): (&mut Terms, &mut Work),
    out: &mut [Sums],
) -> Result<(), Error> {
    if out.len() != range.len() {
        return Err(Error::Length { what: "signature rows", expected: range.len(), given: out.len() });
    }
    let bands = solved.shape.bands;
    let scale = solved.scene.scale();
    let area = view.cell_area / (scale * scale);
    for (row, sums) in range.zip(out) {
        *sums = Sums::ZERO;
        let sequence = Sequence::new(hash2(row as u32, 0x5160_0000));
        let mut ahead = Ahead::default();
        let cell = |column: u32| {
            let (x, y) = sequence.pair(column & 0xffff, 0);
            let origin = view.corner + view.right * (f64::from(column) + x) + view.up * (row as f64 + y);
            Ray::new(origin, view.forward)
        };
        let cells = view.cells as u32;
        for column in 0..cells {
            let ray = cell(column);
            let any = |n| if n == column { ray } else { cell(n) };
            let hit = solved.bvh.closest_of(&mut ahead, column, cells, any);
            terms.clear(bands);
            let path = solved.radiance_at(
                (&ray, hit),
                Sample::OneOf { seed: row as u32, index: column },
                terms,
                work,
            );
            sums.rays += 1 + u64::from(path.rays);
            if path.object {
                sums.area += area;
                for (band, i) in sums.intensity.iter_mut().take(bands).enumerate() {
                    *i += terms.sum(band) * area;
                }
            }
        }
    }
    Ok(())
}

/// What the sums say of one band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signature {
    /// Radiant intensity toward the observer in W/sr.
    pub intensity: f64,
    /// Mean radiance of the object; 0 where nothing of it is seen.
    pub mean_radiance: f64,
    /// (mean radiance - background) / background; `None` where the background is 0.
    pub contrast: Option<f64>,
}

impl Signature {
    /// The signature in `band` against a background radiance.
    pub fn new(sums: &Sums, band: usize, background: f64) -> Signature {
        let intensity = sums.intensity.at(band);
        let mean_radiance = if sums.area > 0.0 { intensity / sums.area } else { 0.0 };
        let contrast = (background > 0.0).then(|| (mean_radiance - background) / background);
        Signature { intensity, mean_radiance, contrast }
    }
}
