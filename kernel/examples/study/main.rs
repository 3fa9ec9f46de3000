//! Reruns the paper's validation and writes its figures: SVG, PNG and CSV.
//!
//! ```sh
//! cargo run --release --example study -- [FOLDER]
//! ```
//!
//! FOLDER is created where it is missing; default `study`. The page beside this file puts what comes out beside what
//! the paper says. All but figure 1 runs on one thread in about a minute and a half.

#![allow(dead_code)] // of the render program's modules it takes the scene and the pipeline

#[path = "../../../tests/support/case.rs"]
mod case;
mod chart;
#[path = "../../../tests/support/cylinders.rs"]
mod cylinders;
mod diffuse;
mod figure1;
mod gloss;
#[path = "../../../tests/support/plane_kernel.rs"]
mod plane_kernel;
#[path = "../../../tests/support/plane_reference/mod.rs"]
mod plane_reference;
mod space;
#[path = "../../../tests/support/mod.rs"]
mod support;

#[path = "../render/aircraft.rs"]
mod aircraft;
#[path = "../render/built_in.rs"]
mod built_in;
#[path = "../render/facets_file.rs"]
mod facets_file;
#[path = "../render/failure.rs"]
mod failure;
#[path = "../render/image_file.rs"]
mod image_file;
#[path = "../render/materials.rs"]
mod materials;
#[path = "../render/mesh_file/mod.rs"]
mod mesh_file;
#[path = "../render/pipeline.rs"]
mod pipeline;
#[path = "../render/progress.rs"]
mod progress;
#[path = "../render/report_file.rs"]
mod report_file;
#[path = "../render/scene_file/mod.rs"]
mod scene_file;
#[path = "../render/sky_table/mod.rs"]
mod sky_table;
#[allow(dead_code)]
#[path = "../render/text_file.rs"]
mod text_file;
#[allow(dead_code)]
#[path = "../render/view.rs"]
mod view;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "study".into()));
    if arguments.next().is_some() || folder.to_string_lossy().starts_with('-') {
        eprintln!("error: usage: study [FOLDER]");
        return ExitCode::from(2);
    }
    match run(&folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(folder: &std::path::Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    figure1::write(folder)?;
    let (truths, sun) = (gloss::Truths::new(), gloss::SunTruths::new());
    for figure in [
        gloss::figure2(&truths),
        gloss::figure3(&sun),
        gloss::cones(&sun),
        gloss::figure5(&truths),
        gloss::rays(&truths),
        gloss::coupled(&truths),
        diffuse::bounces(),
    ]
    .into_iter()
    .chain(space::rays())
    .chain(diffuse::convergence())
    {
        figure.write(folder)?;
        println!("{}", folder.join(figure.name).with_extension("svg").display());
    }
    Ok(())
}
