//! From a scene file to its photometric image.
//!
//! ```sh
//! cargo run --release --example render -- [SCENE.toml] [--out FILE]...
//! ```
//!
//! With no scene it renders the built-in aircraft. Exit status: 0 done, 2 wrong usage, 1 anything else; then no
//! output file has changed.

mod aircraft;
mod built_in;
mod cli;
mod doubts;
mod facets_file;
mod failure;
mod image_file;
mod list;
mod load;
mod materials;
mod mesh_file;
mod outputs;
mod pipeline;
mod progress;
mod report_file;
mod scene_file;
mod sky_table;
mod summary;
mod targets;
mod text_file;
mod view;

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use cli::{Command, Options};
use failure::{Outcome, Warnings};
use outputs::Outputs;
use pipeline::{Job, Rendered};
use progress::Progress;
use scene_file::Scene;
use targets::Targets;

fn main() -> ExitCode {
    let command = match cli::parse(std::env::args_os().skip(1)) {
        Ok(command) => command,
        Err(what) => {
            // One line: see `Failure`.
            eprintln!("error: {} (render --help tells the usage)", failure::Failure::new(what));
            return ExitCode::from(2);
        }
    };
    let done = match command {
        Command::Help => {
            say(cli::HELP);
            Ok(())
        }
        Command::Version => {
            say(concat!("render ", env!("CARGO_PKG_VERSION"), "\n"));
            Ok(())
        }
        Command::Manual => {
            say(scene_file::MANUAL);
            Ok(())
        }
        Command::List(path) => list::write(&path).map(|text| say(&text)),
        Command::Check(path) => check_scene(&path),
        Command::Render(options) => match &options.scene {
            Some(path) => render_scene(path, &options),
            None => render_built_in(&options),
        },
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// Prints; a reader that has gone away is no failure.
fn say(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn render_scene(path: &Path, options: &Options) -> Outcome<()> {
    let start = Instant::now();
    let progress = Progress::start();
    let scene = load::scene(path)?;
    let targets = Targets::of_scene(path, &scene, options)?;
    load::check_targets(path, &scene, targets.paths())?;
    let mut loaded = load::files(path, scene)?;
    let mut warnings = std::mem::take(&mut loaded.warnings);
    let mut job = loaded.job(path)?;
    job.threads = options.threads.unwrap_or(0);
    (job.facets, job.components) = (options.facets.is_some(), options.components.is_some());
    let read = start.elapsed().as_secs_f64();
    let mut rendered = pipeline::run(&job, &progress)?;
    warnings.append(doubts::of(&job, &rendered.report.view));
    warnings.append(doubts::of_image(&job, &rendered.report.view, &rendered.pixels));
    rendered.report.seconds.read = read;
    rendered.report.warnings = warnings.lines().collect();
    let mut outputs = Outputs::default();
    progress.stage("writing");
    targets.write(&mut rendered, start, &mut outputs)?;
    outputs.commit()?;
    drop(progress);
    warn(&warnings);
    report(&[(path.display().to_string(), &loaded.scene, &rendered)], targets.paths());
    Ok(())
}

/// Reads all that the scene file names and renders nothing.
fn check_scene(path: &Path) -> Outcome<()> {
    let mut loaded = load::files(path, load::scene(path)?)?;
    let mut warnings = std::mem::take(&mut loaded.warnings);
    let job = loaded.job(path)?;
    let view = pipeline::check(&job)?;
    warnings.append(doubts::of(&job, &view));
    warn(&warnings);
    let mut text = Vec::new();
    // Writing to memory does not fail.
    let _ = summary::check(path, &job, &view, &mut text);
    say(&String::from_utf8_lossy(&text));
    Ok(())
}

fn warn(warnings: &Warnings) {
    warnings.lines().for_each(|line| eprintln!("warning: {line}"));
}

fn render_built_in(options: &Options) -> Outcome<()> {
    let mesh = built_in::mesh();
    let finishes = built_in::finishes();
    let targets: Vec<Targets> = finishes
        .iter()
        .map(|(name, scene)| Targets::built_in(name, scene, options))
        .collect::<Outcome<_>>()?;
    outputs::check(targets.iter().flat_map(Targets::paths), [])?;
    let progress = Progress::start();
    let mut outputs = Outputs::default();
    let mut done = Vec::new();
    for ((name, scene), targets) in finishes.iter().zip(&targets) {
        let start = Instant::now();
        let path = Path::new(name);
        let job = Job {
            path,
            materials: materials::assign(path, scene, &mesh)?,
            table: None,
            scene,
            mesh: &mesh,
            threads: options.threads.unwrap_or(0),
            facets: false,
            components: false,
        };
        let mut rendered = pipeline::run(&job, &progress)?;
        targets.write(&mut rendered, start, &mut outputs)?;
        done.push((name.to_string(), scene, rendered));
    }
    outputs.commit()?;
    drop(progress);
    let done: Vec<_> = done.iter().map(|(name, scene, rendered)| (name.clone(), *scene, rendered)).collect();
    report(&done, targets.iter().flat_map(Targets::paths));
    Ok(())
}

/// The summary on standard output, and a warning where a tolerance was not met.
fn report<'a>(done: &[(String, &Scene, &Rendered)], files: impl Iterator<Item = &'a Path>) {
    let mut text = Vec::new();
    for (title, scene, rendered) in done {
        let (report, camera) = (&rendered.report, &scene.camera);
        // Writing to memory does not fail.
        let _ = summary::write(title, (camera.columns, camera.rows), report, &mut text);
        if !report.tolerance_met {
            let (estimate, tolerance) = (report.error_estimate, report.tolerance);
            eprintln!(
                "warning: {title}: error estimate {estimate:.1e} exceeds the tolerance {tolerance:.1e}"
            );
        }
    }
    let _ = summary::files(files, &mut text);
    say(&String::from_utf8_lossy(&text));
}
