//! NumPy's arrays, through `npyz`.

use super::Picture;

/// Reads the content of a `.npy` file.
pub fn read(bytes: &[u8]) -> Result<Picture, String> {
    if !shape_fits(bytes) {
        return Err("expected a shape that fits the file's size".into());
    }
    // The crate may quote the whole head.
    let not_npy = |e: std::io::Error| format!("not an array of NumPy: {:.100}", e.to_string());
    let file = npyz::NpyFile::new(bytes).map_err(not_npy)?;
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
    Ok(Picture { rows, columns, bands, radiance, notes: Vec::new() })
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
