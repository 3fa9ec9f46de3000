//! Error asked for, estimated and true, against time, memory and rays, for every reference image.
//!
//! `cargo bench --bench time_error` prints a table (Markdown) and writes `time_error.csv` and a chart for each mesh
//! into `target/time_error`. Options after `--`: `--out FOLDER`; `--tolerances 2e-3,1e-3,...`; `--scenes PART`, those
//! whose names contain it; `--limit SECONDS`, no finer tolerance after a run that took longer (default 20);
//! `--threads N` (default 2). BLIK_REFERENCES=FOLDER adds the references of another folder.

#[path = "../../kernel/examples/study/chart.rs"]
#[allow(dead_code)]
mod chart;
#[path = "../../tests/support/kernel.rs"]
mod kernel;
mod processor;
#[path = "../../tests/support/mod.rs"]
mod support;

use blik_kernel::camera::CameraInput;
use blik_kernel::host::{GeometryMemory, Host, Report, Rounds, Settings};
use chart::{Figure, Series};
use processor::processor_seconds;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;
use support::references::{self, Reference};
use support::{metric, scene_file, twin};

/// Runs whose median is a time, unless one alone takes long.
const RUNS: usize = 3;

struct Options {
    out: PathBuf,
    tolerances: Vec<f64>,
    scenes: String,
    limit: f64,
    threads: usize,
}

impl Options {
    fn read() -> Result<Options, Box<dyn Error>> {
        let mut options = Options {
            out: PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target/time_error"),
            tolerances: vec![1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4],
            scenes: String::new(),
            limit: 20.0,
            threads: 2,
        };
        let mut arguments = lexopt::Parser::from_env();
        while let Some(argument) = arguments.next()? {
            use lexopt::prelude::*;
            match argument {
                Long("bench") => {} // cargo's own
                Long("out") => options.out = arguments.value()?.into(),
                Long("tolerances") => {
                    let list = arguments.value()?.string()?;
                    options.tolerances = list.split(',').map(str::parse).collect::<Result<_, _>>()?;
                }
                Long("scenes") => options.scenes = arguments.value()?.string()?,
                Long("limit") => options.limit = arguments.value()?.parse()?,
                Long("threads") => options.threads = arguments.value()?.parse()?,
                _ => return Err(argument.unexpected().into()),
            }
        }
        options.tolerances.sort_by(|a, b| b.total_cmp(a));
        Ok(options)
    }
}

/// One scene at one tolerance.
struct Row {
    scene: String,
    asked: f64,
    estimate: f64,
    /// eps over the pixels in which the reference is right, the reference's standard error and eps_c, what is left without it.
    eps: f64,
    noise: f64,
    corrected: f64,
    /// Seconds from the arrays to the image, and for an image of the solved scene from elsewhere.
    cold: f64,
    /// Processor seconds of the former, all threads together.
    processor: f64,
    view: f64,
    rays: u64,
    bytes: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read()?;
    std::fs::create_dir_all(&options.out)?;
    let host = Host::new(options.threads)?;
    let mut table = csv::Writer::from_path(options.out.join("time_error.csv"))?;
    table.write_record([
        "scene",
        "tolerance",
        "estimate",
        "eps",
        "reference_standard_error",
        "eps_c",
        "seconds_cold",
        "processor_seconds_cold",
        "seconds_new_view",
        "rays",
        "bytes",
    ])?;
    println!(
        "| scene | asked | estimate | true eps_c | cold, s | of the processor | new view, s | Mray | MiB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut rows: Vec<Row> = Vec::new();
    for reference in references::all().iter().filter(|r| r.id.contains(&options.scenes)) {
        for &tolerance in &options.tolerances {
            let row = run(&host, reference, tolerance, options.limit)?;
            row.print();
            table.write_record(row.record())?;
            table.flush()?;
            let long = row.cold > options.limit;
            rows.push(row);
            if long {
                break;
            }
        }
    }
    draw(&rows, &options)
}

/// Runs one reference at one tolerance.
fn run(host: &Host, reference: &Reference, tolerance: f64, limit: f64) -> Result<Row, Box<dyn Error>> {
    let (scene, camera) = scene_file::read(&reference.scene);
    let sound = reference.sound(&scene, &camera);
    let settings = Settings {
        reference_radiance: Some(vec![1.0]),
        directional: !matches!(scene.sky.as_ref().map(|s| &s.model), Some(twin::Model::Uniform)),
        ..Settings::default()
    };
    let camera = kernel::camera(&camera);
    let soup = kernel::Soup::new(&scene);
    let mut processor = vec![];
    let (sky_table, mut cold, mut view) =
        (scene.sky.as_ref().map_or(Vec::new(), kernel::table), vec![], vec![]);
    let mut outcome = None;
    while cold.len() < RUNS && cold.last().is_none_or(|&s| s < 0.1 * limit) {
        let (before, start) = (processor_seconds(), Instant::now());
        let (mut memory, mut rounds) = (GeometryMemory::default(), Rounds::new(tolerance));
        loop {
            let settings = rounds.settings(settings.clone());
            let geometry = soup.with_input(|input| host.geometry(&mut memory, input, &settings))?;
            let sky = scene.sky.as_ref().map(|sky| kernel::sky_input(sky, &sky_table));
            let sun = scene.sun.as_ref().map(kernel::sun_input);
            let lit = host.light(&geometry, sky.as_ref(), sun.as_ref())?;
            let mut image = host.image(&lit, &camera, false)?;
            if rounds.again(&mut image.report) {
                continue;
            }
            cold.push(start.elapsed().as_secs_f64());
            processor.push(processor_seconds() - before);
            let start = Instant::now();
            std::hint::black_box(host.image(&lit, &turned(&camera), false)?);
            view.push(start.elapsed().as_secs_f64());
            outcome = Some(image);
            break;
        }
    }
    let image = outcome.expect("one run at least");
    let eps = metric::eps(&image.pixels, &reference.image().values, &sound, &[1.0])[0];
    let noise = reference.image_standard_error;
    let Report { error_estimate, rays, bytes, .. } = image.report;
    Ok(Row {
        scene: reference.id.clone(),
        asked: tolerance,
        estimate: error_estimate,
        eps,
        noise,
        corrected: metric::corrected(eps, noise),
        cold: median(cold),
        processor: median(processor),
        view: median(view),
        rays: rays.visibility + rays.sun + rays.chain + rays.primary,
        bytes: bytes.scene + bytes.bvh + bytes.coupling + bytes.light + bytes.image,
    })
}

/// The camera moved sideways by a tenth of its distance.
fn turned(camera: &CameraInput) -> CameraInput {
    let [e, t] = [camera.eye, camera.target].map(glam::DVec3::from);
    let across = (t - e).cross(camera.up.into()).normalize() * 0.1 * (t - e).length();
    CameraInput { eye: (e + across).to_array(), ..*camera }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

impl Row {
    /// What half of the noise hides is told as such.
    fn truth(&self) -> String {
        let resolved = self.corrected >= 0.5 * self.noise;
        if resolved { format!("{:.1e}", self.corrected) } else { format!("< {:.1e}", 0.5 * self.noise) }
    }

    fn print(&self) {
        let (rays, bytes) = (self.rays as f64 * 1e-6, self.bytes as f64 / 1048576.0);
        let Row { scene, asked, estimate, cold, processor, view, .. } = self;
        let truth = self.truth();
        println!(
            "| {scene} | {asked:.0e} | {estimate:.1e} | {truth} | {cold:.3} | {processor:.3} | {view:.4} | {rays:.2} | {bytes:.1} |"
        );
    }

    fn record(&self) -> Vec<String> {
        let small = [
            self.asked,
            self.estimate,
            self.eps,
            self.noise,
            self.corrected,
            self.cold,
            self.processor,
            self.view,
        ];
        let mut record = vec![self.scene.clone()];
        record.extend(small.iter().map(|x| format!("{x:.4e}")));
        record.extend([self.rays.to_string(), self.bytes.to_string()]);
        record
    }
}

/// A chart for each mesh: time against the true error where the reference shows it, else half its noise.
fn draw(rows: &[Row], options: &Options) -> Result<(), Box<dyn Error>> {
    let mut meshes: BTreeMap<&str, Vec<Series>> = BTreeMap::new();
    for rows in rows.chunk_by(|a, b| a.scene == b.scene) {
        let (mesh, rest) = rows[0].scene.split_once("_d").unwrap_or((&rows[0].scene, &rows[0].scene));
        let error = |row: &Row| row.corrected.max(0.5 * row.noise).max(1e-6);
        let name = rest.replace("_s", "/").replace('_', " ");
        let series = |kind: &str, seconds: fn(&Row) -> f64| Series {
            name: format!("{name} {kind}"),
            points: rows.iter().map(|row| (error(row), seconds(row))).collect(),
        };
        let all = meshes.entry(mesh).or_default();
        all.extend([series("cold", |r| r.cold), series("new view", |r| r.view)]);
    }
    for (mesh, series) in meshes {
        let figure = Figure {
            name: "time_error",
            title: "Time against error",
            x: "true error (half the reference's noise where it is less)",
            y: "seconds",
            log: (true, true),
            series,
        };
        figure.draw(&options.out.join(format!("{mesh}.svg")))?;
    }
    println!("\n{}", options.out.display());
    Ok(())
}
