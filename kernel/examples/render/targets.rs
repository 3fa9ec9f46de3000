//! Which files a run writes, and with what.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::cli::Options;
use crate::failure::{Failure, Outcome};
use crate::image_file::{self, Format, Raster, Tone};
use crate::outputs::Outputs;
use crate::pipeline::Rendered;
use crate::scene_file::Scene;
use crate::{facets_file, report_file};

/// Suffixes of `--components`: the terms of eq. 11 in the order of [`Rendered::components`].
const COMPONENTS: [&str; 3] = ["_diffuse.npy", "_mirror_sky.npy", "_mirror_diffuse.npy"];

/// The files of one image.
pub struct Targets {
    images: Vec<(PathBuf, Format)>,
    components: Vec<PathBuf>,
    facets: Option<PathBuf>,
    report: Option<PathBuf>,
    exposure: f64,
    /// Bands in a PNG.
    shown: Vec<usize>,
}

impl Targets {
    /// The files named by `options`, or PNG and EXR by the scene's stem where no image is named.
    pub fn of_scene(path: &Path, scene: &Scene, options: &Options) -> Outcome<Self> {
        let mut images = options.images.clone();
        if images.is_empty() {
            let stem = path.file_stem().unwrap_or_default();
            images = by_stem(&stem.to_string_lossy());
        }
        if let Some((image, _)) = images.iter().find(|(_, format)| *format == Format::Pfm)
            && !matches!(scene.bands, 1 | 3)
        {
            return Err(Failure::at(
                image,
                format_args!("a .pfm holds 1 or 3 bands, the scene has {}", scene.bands),
            ));
        }
        let component = |suffix| {
            let mut name = options.components.clone()?;
            name.push(suffix);
            Some(PathBuf::from(name))
        };
        Ok(Targets {
            images,
            components: COMPONENTS.into_iter().filter_map(component).collect(),
            facets: options.facets.clone(),
            report: options.report.clone(),
            exposure: options.exposure.unwrap_or(1.0),
            shown: shown(scene, options)?,
        })
    }

    /// PNG and EXR of the built-in finish called `name`.
    pub fn built_in(name: &str, scene: &Scene, options: &Options) -> Outcome<Self> {
        Ok(Targets {
            images: by_stem(name),
            components: Vec::new(),
            facets: None,
            report: None,
            exposure: options.exposure.unwrap_or(1.0),
            shown: shown(scene, options)?,
        })
    }

    /// All files.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let images = self.images.iter().map(|(path, _)| path);
        images.chain(&self.components).chain(&self.facets).chain(&self.report).map(PathBuf::as_path)
    }

    /// Writes all files under temporary names, the report last: it tells the seconds since `start`.
    pub fn write(&self, rendered: &mut Rendered, start: Instant, outputs: &mut Outputs) -> Outcome<()> {
        let before = Instant::now();
        let tone =
            Tone { exposure: self.exposure, white: &rendered.report.reference_radiance, shown: &self.shown };
        for (path, format) in &self.images {
            let raster = rendered.raster(&rendered.pixels);
            outputs.write(path, |to| match format {
                Format::Npy => image_file::npy(raster, to),
                Format::Exr => image_file::exr(raster, to),
                Format::Pfm => image_file::pfm(raster, to),
                Format::Png => image_file::png(raster, &tone, to),
            })?;
        }
        for (path, pixels) in self.components.iter().zip(rendered.components.iter().flatten()) {
            outputs.write(path, |to| image_file::npy(rendered.raster(pixels), to))?;
        }
        if let Some(path) = &self.facets {
            outputs.write(path, |to| facets_file::write(&rendered.facets, rendered.report.bands, to))?;
        }
        rendered.report.seconds.write = before.elapsed().as_secs_f64();
        rendered.report.seconds.total = start.elapsed().as_secs_f64();
        match &self.report {
            Some(path) => outputs.write(path, |to| report_file::write(&rendered.report, to)),
            None => Ok(()),
        }
    }
}

impl Rendered {
    /// `pixels` of this image's size.
    fn raster<'a>(&self, pixels: &'a [f32]) -> Raster<'a> {
        Raster { columns: self.columns, rows: self.rows, bands: self.report.bands, pixels }
    }
}

fn by_stem(stem: &str) -> Vec<(PathBuf, Format)> {
    let image = |ending, format| (PathBuf::from(format!("{stem}.{ending}")), format);
    vec![image("png", Format::Png), image("exr", Format::Exr)]
}

/// The bands of a PNG: as asked, else 0, 1 and 2 of three, else 0.
fn shown(scene: &Scene, options: &Options) -> Outcome<Vec<usize>> {
    let default = if scene.bands == 3 { vec![0, 1, 2] } else { vec![0] };
    let shown = options.bands.clone().unwrap_or(default);
    match shown.iter().find(|band| **band >= scene.bands) {
        Some(band) => {
            let last = scene.bands - 1;
            Err(Failure::new(format_args!("--bands: band {band} is out of range: expected 0 to {last}")))
        }
        None => Ok(shown),
    }
}
