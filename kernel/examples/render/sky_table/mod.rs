//! Sky tables: `.npy`, `.exr`, `.hdr` or `.pfm` of rows x columns (x bands).

mod channels;
mod exr;
mod hdr;
mod npy;
mod pfm;

use std::path::Path;

use crate::failure::{Failure, Outcome, Warnings};
use crate::scene_file::Columns;

/// A sky's radiance on the whole sphere: row 0 at the zenith, column 0 at the azimuth's origin.
pub struct Table {
    /// Rows, from the zenith down.
    pub rows: usize,
    /// Columns, counter-clockwise seen from the zenith.
    pub columns: usize,
    /// 1, or the scene's number of bands.
    pub bands: usize,
    /// (row, column, band), finite and not negative.
    pub radiance: Vec<f32>,
    /// What was passed over or not applied.
    pub warnings: Warnings,
}

/// A file's numbers (row, column, band) in its own order of columns, and what was not applied.
struct Picture {
    rows: usize,
    columns: usize,
    bands: usize,
    radiance: Vec<f32>,
    notes: Vec<String>,
}

/// Most values of a table: a picture of 32768 x 16384 in colour.
const MOST_VALUES: usize = 3 << 29;

/// Reads the table at `path` for a scene of `bands` bands; `columns` is the sense in which they run where the scene tells,
/// else a picture's run clockwise, as it is seen from inside, and an array's counter-clockwise.
pub fn read(path: &Path, bands: usize, columns: Option<Columns>) -> Outcome<Table> {
    let bytes = std::fs::read(path).map_err(|e| Failure::at(path, e))?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let (picture, sense) = match ending.as_str() {
        "npy" => (npy::read(&bytes), Columns::CounterClockwise),
        "exr" => (exr::read(&bytes), Columns::Clockwise),
        "hdr" | "pic" => (hdr::read(&bytes), Columns::Clockwise),
        "pfm" => (pfm::read(&bytes), Columns::Clockwise),
        _ => {
            let what = "unknown kind of sky table: expected .npy, .exr, .hdr or .pfm";
            return Err(Failure::at(path, what));
        }
    };
    let picture = picture.map_err(|e| Failure::at(path, e))?;
    check(path, &picture, bands)?;
    let Picture { rows, columns: width, bands, mut radiance, notes } = picture;
    if columns.unwrap_or(sense) == Columns::Clockwise {
        // Column c lies as far from the origin on the other side as column width - 1 - c on this.
        radiance.chunks_exact_mut(width * bands).for_each(|row| {
            (0..width / 2).for_each(|c| {
                (0..bands).for_each(|b| row.swap(c * bands + b, (width - 1 - c) * bands + b));
            });
        });
    }
    let mut warnings = Warnings::default();
    // Each is of its own kind.
    notes.iter().for_each(|note| warnings.append(Warnings::of(Failure::at(path, note))));
    Ok(Table { rows, columns: width, bands, radiance, warnings })
}

fn check(path: &Path, picture: &Picture, bands: usize) -> Outcome<()> {
    let Picture { rows, columns, .. } = *picture;
    if rows == 0 || columns == 0 || !(picture.bands == 1 || picture.bands == bands) {
        let shape = format!("{rows} x {columns} x {}", picture.bands);
        let expected = if bands == 1 { "1".into() } else { format!("1 or {bands}") };
        let what =
            format!("sky table of the wrong size: expected rows x columns x {expected} (bands), got {shape}");
        return Err(Failure::at(path, what));
    }
    match picture.radiance.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
        None => Ok(()),
        Some(i) => {
            let (pixel, band) = (i / picture.bands, i % picture.bands);
            let place = format!("row {}, column {}, band {band}", pixel / columns, pixel % columns);
            let what = format!("{place}: expected a finite radiance from 0 up, got {}", picture.radiance[i]);
            Err(Failure::at(path, what))
        }
    }
}
