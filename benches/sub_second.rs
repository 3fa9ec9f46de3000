//! From mesh to image within half a second: the built-in aircraft, 512 x 512 pixels, in memory, both finishes.
//!
//! The bar is the time that the paper states for its diffuse-mirror variants at eps <= 2e-3, 0.5 s; what runs here
//! is what the `render` program runs, files left out. `cargo bench --bench sub_second` fails where a finish's quickest run
//! takes longer: what else the machine does can only add to a run. With `--quick` it only tells the times.

#![allow(dead_code)] // of the program's modules it takes the scene and the pipeline

#[path = "../kernel/examples/render/aircraft.rs"]
mod aircraft;
#[path = "../kernel/examples/render/built_in.rs"]
mod built_in;
#[path = "../kernel/examples/render/facets_file.rs"]
mod facets_file;
#[path = "../kernel/examples/render/failure.rs"]
mod failure;
#[path = "../kernel/examples/render/materials.rs"]
mod materials;
#[path = "../kernel/examples/render/mesh_file/mod.rs"]
mod mesh_file;
#[path = "../kernel/examples/render/pipeline.rs"]
mod pipeline;
#[path = "../kernel/examples/render/progress.rs"]
mod progress;
#[path = "../kernel/examples/render/report_file.rs"]
mod report_file;
#[path = "../kernel/examples/render/scene_file/mod.rs"]
mod scene_file;
#[path = "../kernel/examples/render/sky_table/mod.rs"]
mod sky_table;
#[allow(dead_code)]
#[path = "../kernel/examples/render/text_file.rs"]
mod text_file;
#[allow(dead_code)]
#[path = "../kernel/examples/render/view.rs"]
mod view;

use pipeline::{Job, Rendered};
use scene_file::Scene;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// Seconds that the paper states.
const BAR: f64 = 0.5;

/// Runs of each finish, of which the median counts.
const RUNS: usize = 5;

fn main() -> ExitCode {
    let mut within = true;
    let mesh = built_in::mesh();
    for (name, scene) in built_in::finishes() {
        let mut runs: Vec<(f64, Rendered)> = (0..RUNS).map(|_| run(name, &scene, &mesh)).collect();
        runs.sort_by(|a, b| a.0.total_cmp(&b.0));
        within &= runs[0].0 <= BAR && runs[0].1.report.tolerance_met;
        let (seconds, rendered) = &runs[RUNS / 2];
        print(name, *seconds, rendered);
    }
    // a machine that does other work besides tells too little of seconds to refuse a change
    if within || std::env::args().any(|argument| argument == "--quick") {
        return ExitCode::SUCCESS;
    }
    println!(
        "the bar is {BAR} s at the tolerance asked for: no run of a finish was within it, or its estimate was not"
    );
    ExitCode::FAILURE
}

fn run(name: &str, scene: &Scene, mesh: &mesh_file::Mesh) -> (f64, Rendered) {
    let path = Path::new(name);
    let start = Instant::now();
    let materials = materials::assign(path, scene, mesh).unwrap_or_else(|e| panic!("{e}"));
    let job = Job { path, scene, mesh, materials, table: None, threads: 0, facets: false, components: false };
    let rendered = pipeline::run(&job, &progress::Progress::start()).unwrap_or_else(|e| panic!("{e}"));
    (start.elapsed().as_secs_f64(), rendered)
}

fn print(name: &str, seconds: f64, rendered: &Rendered) {
    let (report, verdict) = (&rendered.report, if seconds <= BAR { "within" } else { "above" });
    let s = &report.seconds;
    println!(
        "{name}: {seconds:.3} s, median of {RUNS}, {verdict} the bar of {BAR} s \
         ({} facets, {} x {} pixels, {} threads)",
        report.facets,
        rendered.columns,
        rendered.rows,
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    println!(
        "  scene {:.3}, bvh {:.3}, coupling {:.3}, light {:.3}, radiosity {:.3}, image {:.3}; \
         error estimate {:.1e}, tolerance {:.1e}",
        s.scene, s.bvh, s.coupling, s.light, s.radiosity, s.image, report.error_estimate, report.tolerance
    );
}
