//! Sky tables: `.npy`, `.exr` or `.pfm` of rows x columns (x bands).

use std::path::Path;

use crate::failure::{Failure, Outcome};

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
}

/// Reads the table at `path` for a scene of `bands` bands.
pub fn read(path: &Path, bands: usize) -> Outcome<Table> {
    let bytes = std::fs::read(path).map_err(|e| Failure::at(path, e))?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let table = match ending.as_str() {
        "npy" => npy(&bytes),
        "exr" => exr(&bytes),
        "pfm" => pfm(&bytes),
        _ => Err("unknown kind of sky table: expected .npy, .exr or .pfm".into()),
    };
    let table = table.map_err(|e| Failure::at(path, e))?;
    let Table { rows, columns, .. } = table;
    if rows == 0 || columns == 0 || !(table.bands == 1 || table.bands == bands) {
        let shape = format!("{rows} x {columns} x {}", table.bands);
        let expected = if bands == 1 { "1".into() } else { format!("1 or {bands}") };
        let what = format!("sky table of the wrong size: expected rows x columns x {expected}, got {shape}");
        return Err(Failure::at(path, what));
    }
    match table.radiance.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
        None => Ok(table),
        Some(i) => {
            let (pixel, band) = (i / table.bands, i % table.bands);
            let place = format!("row {}, column {}, band {band}", pixel / columns, pixel % columns);
            let what = format!("{place}: expected a finite radiance from 0 up, got {}", table.radiance[i]);
            Err(Failure::at(path, what))
        }
    }
}

/// The crate multiplies a file's shape without a look at its size, wherever in the head it finds one: all numbers of the
/// head together, the bytes of a value among them, are to be no more than the file's bytes.
fn shape_fits(bytes: &[u8]) -> bool {
    let length = match bytes {
        [_, _, _, _, _, _, 1, _, a, b, ..] => usize::from(u16::from_le_bytes([*a, *b])),
        [_, _, _, _, _, _, _, _, a, b, c, d, ..] => u32::from_le_bytes([*a, *b, *c, *d]) as usize,
        _ => 0,
    };
    let start = bytes.len().min(10);
    let head = String::from_utf8_lossy(&bytes[start..bytes.len().min(start.saturating_add(length))]);
    let mut numbers = head.split(|c: char| !c.is_ascii_digit()).filter(|n| !n.is_empty());
    let all = numbers.try_fold(1usize, |all, n| all.checked_mul(n.parse::<usize>().ok()?.max(1)));
    all.is_some_and(|all| all <= bytes.len())
}

fn npy(bytes: &[u8]) -> Result<Table, String> {
    if !shape_fits(bytes) {
        return Err("expected a shape that fits the file's size".into());
    }
    let file = npyz::NpyFile::new(bytes).map_err(|e| e.to_string())?;
    let shape: Vec<usize> = file.shape().iter().map(|n| *n as usize).collect();
    let (rows, columns, bands) = match shape[..] {
        [rows, columns] => (rows, columns, 1),
        [rows, columns, bands] => (rows, columns, bands),
        _ => {
            return Err(format!(
                "sky table of the wrong size: expected rows x columns (x bands), got {shape:?}"
            ));
        }
    };
    let fortran = file.order() == npyz::Order::Fortran;
    let stored: Vec<f32> = match file.try_data::<f32>() {
        Ok(data) => data.collect::<Result<_, _>>(),
        Err(file) => file
            .data::<f64>()
            .map_err(|_| "expected f4 or f8 values".to_string())?
            .map(|x| x.map(|x| x as f32))
            .collect(),
    }
    .map_err(|e| e.to_string())?;
    let radiance = if fortran {
        let index = |i: usize| {
            let (row, column, band) = (i / (columns * bands), i / bands % columns, i % bands);
            row + rows * (column + columns * band)
        };
        (0..stored.len()).map(|i| stored[index(i)]).collect()
    } else {
        stored
    };
    Ok(Table { rows, columns, bands, radiance })
}

/// All channels of the first layer in the order of their names, but red, green, blue for R, G and B; a lone
/// alpha channel beside others is left out.
fn exr(bytes: &[u8]) -> Result<Table, String> {
    use exr::prelude::*;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let layer = image.layer_data;
    let mut channels: Vec<_> = layer.channel_data.list.iter().collect();
    if channels.len() > 1 {
        channels.retain(|channel| !channel.name.eq("A"));
    }
    let rank = |name: &str| ["R", "G", "B"].iter().position(|colour| *colour == name);
    if channels.iter().all(|channel| rank(&channel.name.to_string()).is_some()) {
        channels.sort_by_key(|channel| rank(&channel.name.to_string()));
    }
    let planes: Vec<Vec<f32>> =
        channels.iter().map(|channel| channel.sample_data.values_as_f32().collect()).collect();
    let (columns, rows) = (layer.size.0, layer.size.1);
    if planes.iter().any(|plane| plane.len() != columns * rows) {
        return Err("expected channels without subsampling".into());
    }
    let radiance = (0..columns * rows).flat_map(|i| planes.iter().map(move |plane| plane[i])).collect();
    Ok(Table { rows, columns, bands: planes.len(), radiance })
}

/// Portable float map: rows stored from the bottom up; the scale's sign tells the byte order.
fn pfm(bytes: &[u8]) -> Result<Table, String> {
    let expected = || "not a PFM file: expected PF or Pf, columns, rows, scale and as many f32".to_string();
    let mut rest = bytes;
    let mut token = || {
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace)?;
        let word = std::str::from_utf8(&rest[start..start + length]).ok()?;
        // One white space ends the header.
        rest = &rest[start + length + 1..];
        Some(word)
    };
    let header = (|| {
        let bands = match token()? {
            "PF" => 3,
            "Pf" => 1,
            _ => return None,
        };
        let (columns, rows): (usize, usize) = (token()?.parse().ok()?, token()?.parse().ok()?);
        let scale: f64 = token()?.parse().ok()?;
        Some((bands, columns, rows, scale))
    })();
    let (bands, columns, rows, scale) = header.ok_or_else(expected)?;
    let row = columns.checked_mul(bands * 4).ok_or_else(expected)?;
    if row.checked_mul(rows) != Some(rest.len()) {
        return Err(format!(
            "sky table of the wrong size: {columns} x {rows} announced, got {} bytes",
            rest.len()
        ));
    }
    let value = |b: &[u8; 4]| if scale < 0.0 { f32::from_le_bytes(*b) } else { f32::from_be_bytes(*b) };
    let radiance = if row == 0 {
        Vec::new()
    } else {
        rest.chunks(row).rev().flat_map(|r| r.as_chunks().0).map(value).collect()
    };
    Ok(Table { rows, columns, bands, radiance })
}
