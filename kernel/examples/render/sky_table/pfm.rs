//! Portable float maps: rows stored from the bottom up; the scale's sign tells the byte order.

use super::Picture;

const EXPECTED: &str = "not a PFM file: expected PF or Pf, columns, rows, scale and as many f32";

/// Reads the content of a `.pfm` file.
pub fn read(bytes: &[u8]) -> Result<Picture, String> {
    let header = header(bytes).ok_or(EXPECTED)?;
    let Header { bands, columns, rows, scale, .. } = header;
    let row = columns.checked_mul(bands * 4).ok_or(EXPECTED)?;
    let size = row.checked_mul(rows).ok_or(EXPECTED)?;
    let mut rest = &bytes[header.length..];
    if rest.len() == size + 1 && rest[0] == b'\n' && bytes[header.length - 1] == b'\r' {
        // The header's lines end in two bytes.
        rest = &rest[1..];
    }
    if rest.len() < size {
        return Err(format!(
            "sky table of the wrong size: {columns} x {rows} announced, got {} bytes",
            rest.len()
        ));
    }
    let mut notes = Vec::new();
    if rest.len() > size {
        notes.push(format!("{} bytes behind the last row: passed over", rest.len() - size));
    }
    if scale.abs() != 1.0 {
        notes
            .push(format!("the scale {scale} is not applied: only its sign, the order of the bytes, counts"));
    }
    let value = |b: &[u8; 4]| if scale < 0.0 { f32::from_le_bytes(*b) } else { f32::from_be_bytes(*b) };
    let radiance = match row {
        0 => Vec::new(),
        _ => rest[..size].chunks(row).rev().flat_map(|r| r.as_chunks().0).map(value).collect(),
    };
    Ok(Picture { rows, columns, bands, radiance, notes })
}

struct Header {
    bands: usize,
    columns: usize,
    rows: usize,
    scale: f64,
    /// Bytes of the header.
    length: usize,
}

fn header(bytes: &[u8]) -> Option<Header> {
    let mut at = 0;
    let mut token = || {
        loop {
            at += bytes[at..].iter().position(|b| !b.is_ascii_whitespace())?;
            let length = bytes[at..].iter().position(u8::is_ascii_whitespace)?;
            let word = std::str::from_utf8(&bytes[at..at + length]).ok()?;
            if word.starts_with('#') {
                at += bytes[at..].iter().position(|b| *b == b'\n' || *b == b'\r')?;
                continue;
            }
            // One white space ends the header.
            at += length + 1;
            return Some(word);
        }
    };
    let bands = match token()? {
        "PF" => 3,
        "Pf" => 1,
        _ => return None,
    };
    let (columns, rows) = (token()?.parse().ok()?, token()?.parse().ok()?);
    let scale: f64 = token()?.parse().ok().filter(|scale: &f64| scale.is_finite() && *scale != 0.0)?;
    Some(Header { bands, columns, rows, scale, length: at })
}
