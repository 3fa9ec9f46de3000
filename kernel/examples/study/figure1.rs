//! Figure 1: the built-in aircraft with both finishes, by the pieces of the `render` program.

use crate::image_file::{Raster, Tone, png};
use crate::pipeline::{Job, run};
use crate::progress::Progress;
use crate::{built_in, materials};
use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Writes `figure1_aircraft_diffuse.png` and `figure1_aircraft_mirror.png`.
pub fn write(folder: &Path) -> Result<(), Box<dyn Error>> {
    let mesh = built_in::mesh();
    for (name, scene) in built_in::finishes() {
        let path = Path::new(name);
        let assigned = materials::assign(path, &scene, &mesh).map_err(|e| e.to_string())?;
        let job = Job {
            path,
            scene: &scene,
            mesh: &mesh,
            materials: assigned,
            table: None,
            threads: 0,
            facets: false,
            components: false,
        };
        let rendered = run(&job, &Progress::start()).map_err(|e| e.to_string())?;
        let raster =
            Raster { columns: rendered.columns, rows: rendered.rows, bands: 1, pixels: &rendered.pixels };
        let tone = Tone { exposure: 1.0, white: &rendered.report.reference_radiance, shown: &[0] };
        let file = folder.join(format!("figure1_{name}.png"));
        png(raster, &tone, BufWriter::new(File::create(&file)?))?;
        println!("{}", file.display());
    }
    Ok(())
}
