//! Image files: `.npy`, `.exr`, `.pfm` and `.png`.

use std::io::{self, Seek, Write};
use std::path::Path;

/// Kind of an image file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    /// (rows, columns, bands) of little-endian f32.
    Npy,
    /// f32 channels B000, B001, ...; R, G, B for three bands.
    Exr,
    /// Portable float map, one or three bands.
    Pfm,
    /// 8-bit sRGB.
    Png,
}

impl Format {
    /// The format by the ending of `path`, in upper or lower case.
    pub fn of(path: &Path) -> Result<Self, String> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "npy" => Ok(Format::Npy),
            "exr" => Ok(Format::Exr),
            "pfm" => Ok(Format::Pfm),
            "png" => Ok(Format::Png),
            _ => Err(format!("{}: unknown kind of image: expected .png, .exr, .npy or .pfm", path.display())),
        }
    }
}

/// Radiances of an image.
#[derive(Clone, Copy)]
pub struct Raster<'a> {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows, from the top.
    pub rows: usize,
    /// Values of a pixel.
    pub bands: usize,
    /// (row, column, band).
    pub pixels: &'a [f32],
}

/// How radiance becomes the 8 bits of a PNG.
pub struct Tone<'a> {
    /// Factor of the linear values.
    pub exposure: f64,
    /// What becomes white at exposure 1, per band; 0: black.
    pub white: &'a [f64],
    /// One band (grey) or three (red, green, blue); in range.
    pub shown: &'a [usize],
}

/// Writes NumPy's format.
pub fn npy(raster: Raster, to: impl Write) -> io::Result<()> {
    use npyz::WriterBuilder;
    let shape = [raster.rows as u64, raster.columns as u64, raster.bands as u64];
    let kind = npyz::DType::new_scalar("<f4".parse().map_err(io::Error::other)?);
    let mut writer = npyz::WriteOptions::new().dtype(kind).shape(&shape).writer(to).begin_nd()?;
    writer.extend(raster.pixels)?;
    writer.finish()
}

/// Writes OpenEXR.
pub fn exr(raster: Raster, to: impl Write + Seek) -> io::Result<()> {
    use exr::prelude::*;
    let name = |band: usize| match raster.bands {
        3 => ["R", "G", "B"][band].to_string(),
        _ => format!("B{band:03}"),
    };
    let plane = |band: usize| raster.pixels.iter().skip(band).step_by(raster.bands).copied().collect();
    let channels =
        (0..raster.bands).map(|band| AnyChannel::new(name(band).as_str(), FlatSamples::F32(plane(band))));
    let layer = Layer::new(
        (raster.columns, raster.rows),
        LayerAttributes::default(),
        // Renderings hardly compress: run lengths save a sixth and take ten times as long.
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(channels.collect()),
    );
    Image::from_layer(layer).write().to_buffered(to).map_err(|e| match e {
        Error::Io(e) => e,
        other => io::Error::other(other.to_string()),
    })
}

/// Writes a portable float map; one or three bands.
pub fn pfm(raster: Raster, mut to: impl Write) -> io::Result<()> {
    let kind = if raster.bands == 3 { "PF" } else { "Pf" };
    // A negative scale means little-endian; rows run from the bottom up.
    write!(to, "{kind}\n{} {}\n-1.0\n", raster.columns, raster.rows)?;
    for row in raster.pixels.chunks(raster.columns * raster.bands).rev() {
        for value in row {
            to.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Writes an 8-bit PNG of one band in grey or three in colour.
pub fn png(raster: Raster, tone: &Tone, to: impl Write) -> io::Result<()> {
    let mut encoder = png::Encoder::new(to, raster.columns as u32, raster.rows as u32);
    encoder.set_color(if tone.shown.len() == 3 { png::ColorType::Rgb } else { png::ColorType::Grayscale });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let factors: Vec<(usize, f64)> = tone
        .shown
        .iter()
        .map(|band| (*band, tone.white[*band]))
        .map(|(band, white)| (band, if white > 0.0 { tone.exposure / white } else { 0.0 }))
        .collect();
    let bytes: Vec<u8> = raster
        .pixels
        .chunks(raster.bands)
        .flat_map(|pixel| factors.iter().map(|(band, factor)| srgb(f64::from(pixel[*band]) * factor)))
        .collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(())
}

/// The sRGB transfer function (IEC 61966-2-1) of a linear value clamped to 0..1, in 255 steps.
fn srgb(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}
