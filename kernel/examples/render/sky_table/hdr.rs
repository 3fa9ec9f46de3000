//! Radiance pictures (`.hdr`, `.pic`): colours of four bytes, a common exponent the last of them.
//!
//! A reader of its own: the crates for it take one orientation of the eight, and leave the exposure alone.

use super::{MOST_VALUES, Picture};

/// Reads the content of a `.hdr` file.
pub fn read(bytes: &[u8]) -> Result<Picture, String> {
    let mut lines = Lines(bytes);
    let first = lines.next()?;
    if !first.starts_with("#?") {
        return Err("not a Radiance picture: expected \"#?RADIANCE\" in the first line".into());
    }
    let (mut factors, mut notes) = ([1.0f64; 3], Vec::new());
    loop {
        let line = lines.next()?;
        let Some((key, value)) = line.split_once('=') else {
            if line.trim().is_empty() {
                break;
            }
            continue;
        };
        let numbers = || value.split_whitespace().map(|x| x.parse::<f64>().ok()).collect::<Option<Vec<_>>>();
        match key.trim() {
            "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                return Err(format!("FORMAT={} is not supported: expected 32-bit_rle_rgbe", value.trim()));
            }
            "EXPOSURE" | "COLORCORR" => {
                let factor = match numbers().as_deref() {
                    Some([x]) => Some([*x; 3]),
                    Some([r, g, b]) => Some([*r, *g, *b]),
                    _ => None,
                };
                let factor = factor.filter(|f| f.iter().all(|x| x.is_finite() && *x > 0.0));
                let factor = factor.ok_or_else(|| format!("{line}: expected numbers above 0"))?;
                factors.iter_mut().zip(factor).for_each(|(all, one)| *all *= one);
                if factor != [1.0; 3] {
                    notes.push(format!("{}: radiances are divided by it", line.trim()));
                }
            }
            _ => {}
        }
    }
    let size = lines.next()?;
    let raster = Raster::of(&size).ok_or_else(|| {
        format!("expected a size as in \"-Y 512 +X 1024\" behind the empty line, got {size:.60?}")
    })?;
    // Run lengths pack a line of 32767 pixels into some two thousand bytes.
    let count = raster.lines.checked_mul(raster.pixels).filter(|n| *n <= MOST_VALUES / 3);
    let count = count.filter(|n| *n / 64 <= bytes.len());
    count.ok_or_else(|| format!("{size:?}: expected a size that fits the file's"))?;
    let mut decoder = Decoder { rest: lines.0 };
    let mut radiance = vec![0.0; raster.lines * raster.pixels * 3];
    let mut line = vec![[0u8; 4]; raster.pixels];
    for index in 0..raster.lines {
        decoder
            .line(&mut line)
            .ok_or_else(|| format!("truncated or damaged in line {index} of the picture"))?;
        for (pixel, [r, g, b, e]) in line.iter().enumerate() {
            let at = raster.place(index, pixel) * 3;
            // 2^(e - 136), which is no f32 for the smallest exponents.
            let unit = f64::from(i32::from(*e) - 136).exp2();
            for (band, mantissa) in [r, g, b].into_iter().enumerate() {
                let value = if *e == 0 { 0.0 } else { f64::from(*mantissa) * unit / factors[band] };
                radiance[at + band] = value as f32;
            }
        }
    }
    let (rows, columns) = raster.shape();
    Ok(Picture { rows, columns, bands: 3, radiance, notes })
}

struct Lines<'a>(&'a [u8]);

impl Lines<'_> {
    fn next(&mut self) -> Result<String, String> {
        let end = self.0.iter().take(1 << 16).position(|b| *b == b'\n');
        let end = end.ok_or("not a Radiance picture: the header does not end")?;
        let line = String::from_utf8_lossy(crate::text_file::without_mark(&self.0[..end])).into_owned();
        self.0 = &self.0[end + 1..];
        Ok(line.trim_end_matches('\r').to_owned())
    }
}

/// Lines as the file has them: rows or columns, in either direction.
struct Raster {
    lines: usize,
    pixels: usize,
    /// Lines are columns.
    upright: bool,
    /// Rows run up; columns run to the left.
    up: bool,
    left: bool,
}

impl Raster {
    fn of(size: &str) -> Option<Self> {
        let words: Vec<&str> = size.split_whitespace().collect();
        let [first, lines, second, pixels] = words[..] else { return None };
        let upright = first.ends_with('X');
        let (y, x) = if upright { (second, first) } else { (first, second) };
        let (up, left) = (y == "+Y", x == "-X");
        if !["-Y", "+Y"].contains(&y) || !["-X", "+X"].contains(&x) {
            return None;
        }
        Some(Raster { lines: lines.parse().ok()?, pixels: pixels.parse().ok()?, upright, up, left })
    }

    /// Rows and columns.
    fn shape(&self) -> (usize, usize) {
        if self.upright { (self.pixels, self.lines) } else { (self.lines, self.pixels) }
    }

    /// Where a pixel of a line lies, counted by rows from the top, then by columns from the left.
    fn place(&self, line: usize, pixel: usize) -> usize {
        let (rows, columns) = self.shape();
        let (row, column) = if self.upright { (pixel, line) } else { (line, pixel) };
        let row = if self.up { rows - 1 - row } else { row };
        row * columns + if self.left { columns - 1 - column } else { column }
    }
}

struct Decoder<'a> {
    rest: &'a [u8],
}

impl Decoder<'_> {
    fn take(&mut self, count: usize) -> Option<&[u8]> {
        let taken;
        (taken, self.rest) = self.rest.split_at_checked(count)?;
        Some(taken)
    }

    /// One line, of any of the three ways to store it.
    fn line(&mut self, line: &mut [[u8; 4]]) -> Option<()> {
        let width = line.len();
        let packed = match self.rest {
            [2, 2, high, low, ..] => *high < 128 && usize::from(*high) << 8 | usize::from(*low) == width,
            _ => false,
        };
        if packed && (8..0x8000).contains(&width) { self.packed(line) } else { self.plain(line) }
    }

    /// Each of the four bytes by itself, in runs and copies.
    fn packed(&mut self, line: &mut [[u8; 4]]) -> Option<()> {
        self.take(4)?;
        for part in 0..4 {
            let mut at = 0;
            while at < line.len() {
                let code = usize::from(self.take(1)?[0]);
                let (count, run) = if code > 128 { (code - 128, true) } else { (code, false) };
                let bytes = self.take(if run { 1 } else { count })?;
                let pixels = line.get_mut(at..at + count).filter(|_| count > 0)?;
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    pixel[part] = if run { bytes[0] } else { bytes[i] };
                }
                at += count;
            }
        }
        Some(())
    }

    /// Pixel by pixel; 1 1 1 n repeats the one before n times, and a second such pixel 256 n times.
    fn plain(&mut self, line: &mut [[u8; 4]]) -> Option<()> {
        let (mut at, mut shift) = (0, 0);
        while at < line.len() {
            let pixel: [u8; 4] = self.take(4)?.try_into().ok()?;
            if pixel[..3] == [1, 1, 1] {
                let count = usize::from(pixel[3]).checked_shl(shift)?;
                let before = *line.get(at.checked_sub(1)?)?;
                line.get_mut(at..at + count)?.fill(before);
                at += count;
                shift += 8;
                if shift > 24 {
                    return None;
                }
            } else {
                line[at] = pixel;
                at += 1;
                shift = 0;
            }
        }
        Some(())
    }
}
