//! Calibration: true errors against reported ones on scenes that nobody tuned for.
//!
//! `cargo run --release --example calibrate -- [options]` draws scenes, lights, views and tolerances from
//! distributions (the same in every run), lets Blik render each, measures the error against the judge's path tracing
//! and counts how often the report tells the truth.
//!
//! * `--filter TEXT`: only cases whose kind or light contains it, or whose number it is
//! * `--every K`: only every K-th case of each kind
//! * `--csv FILE`: the table, by default `target/calibration/table.csv`
//! * `--references FOLDER`: where the judge's answers are kept, by default `target/calibration`
//! * `--goal X`: standard error of eps_c wanted, in tolerances, by default 0.15
//! * `--mrays N`: millions of rays after which a reference is good enough, by default 20
//! * `--tolerance X`: another tolerance for Blik in all cases (references stay as they are)
//! * `--dump FOLDER`: images of Blik and both halves as .npy
//! * `--twin N`: N pixels of each case by the readable twin, too (slow; where pixels are single rays)
//! * `--causes`: sorts each case's error by what is difficult about its pixels, and the failed cases by their largest
//!   part
//! * `--pixels N`: the error that sampling the pixels' area brings alone, against the mean of N rays through each
//! * `--list`: names the cases and ends

#[path = "../../../tests/support/drawn/mod.rs"]
mod drawn;
#[path = "../../../tests/support/judge/mod.rs"]
mod judge;
#[path = "../../../tests/support/kernel.rs"]
mod kernel;
#[path = "../../../tests/support/mod.rs"]
mod support;

mod blik;
mod case;
mod causes;
mod families;
mod figures;
mod options;
mod pixels;
mod reference;
mod setting;
mod verify;

use case::{CASES, Case};
use figures::{FIGURES_HEAD, Row, figures};
use judge::score;
use options::Options;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Options::of_command_line().and_then(|options| calibrate(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn calibrate(options: &Options) -> Result<(), String> {
    let cases: Vec<Case> = (0..CASES).filter(|&i| options.takes(i)).map(Case::new).collect();
    let cases: Vec<Case> = cases.into_iter().filter(|c| options.wants(c)).collect();
    if options.list {
        for case in &cases {
            println!(
                "{:3} {:16} {:6.0e} {:5} facets; {}",
                case.index,
                case.family,
                case.tolerance,
                case.mesh.facets.len(),
                case.summary()
            );
        }
        return Ok(());
    }
    let broken = |e: std::io::Error| e.to_string();
    if let Some(folder) = options.csv.parent() {
        std::fs::create_dir_all(folder).map_err(broken)?;
    }
    let mut table = std::fs::File::create(&options.csv).map_err(broken)?;
    writeln!(table, "{}", Row::HEAD).map_err(broken)?;
    let (mut rows, mut refused) = (Vec::new(), Vec::new());
    let start = std::time::Instant::now();
    for case in &cases {
        match measure(case, options)? {
            Ok(row) => {
                writeln!(table, "{}", row.csv()).map_err(broken)?;
                eprintln!("{:6.1} s  {}", start.elapsed().as_secs_f64(), row.csv());
                row.causes.iter().take(4).for_each(|(name, part, pixels)| {
                    eprintln!(
                        "{:12}{:3.0} % of eps^2 on {:3.0} % of the pixels: {name}",
                        "",
                        100.0 * part,
                        100.0 * pixels
                    );
                });
                rows.push(row);
            }
            Err(error) => {
                eprintln!("case {} ({}): {error}", case.index, case.family);
                refused.push(case.index);
            }
        }
    }
    summarise(&rows);
    if !refused.is_empty() {
        println!("refused: {refused:?}");
    }
    println!("table: {}", options.csv.display());
    Ok(())
}

/// A case's row; the inner error is Blik's.
fn measure(case: &Case, options: &Options) -> Result<Result<Row, blik_kernel::Error>, String> {
    let reference = reference::of(case, options.goal, &options.references).map_err(|e| e.to_string())?;
    if options.twin > 0
        && let Some((difference, noise)) = verify::against_twin(case, &reference, options.twin)
    {
        eprintln!("case {}: judge and twin differ by {difference:.1e}, noise {noise:.1e}", case.index);
    }
    let tolerance = options.tolerance.unwrap_or(case.tolerance);
    let outcome = match blik::run(case, tolerance, options.pixels) {
        Ok(outcome) => outcome,
        Err(error) => return Ok(Err(error)),
    };
    let halves = [0, 1].map(|h| &reference.image.values[h][..]);
    if let Some(sampled) = &outcome.sampled {
        eprintln!("sampling,{},{},{tolerance:e},{sampled}", case.index, case.family);
    }
    let image = score(&outcome.pixels, halves, &reference.image.hit, &outcome.reference);
    let bands = outcome.reference.len();
    let sides = if case.two_sided { 2 } else { 1 };
    let received: Vec<f64> = reference
        .sides
        .iter()
        .flat_map(|&(facet, front)| {
            let at = (facet * sides + usize::from(!front)) * bands;
            outcome.irradiance[at..at + bands].to_vec()
        })
        .collect();
    // irradiance over pi is what a white facet would send
    let per_pi: Vec<f64> = outcome.reference.iter().map(|r| std::f64::consts::PI * r).collect();
    let halves = [0, 1].map(|h| &reference.irradiance[h][..]);
    let irradiance = score(&received, halves, &vec![true; reference.sides.len()], &per_pi);
    let causes = if options.causes { causes::of(case, &reference, &outcome) } else { Vec::new() };
    if let Some(folder) = &options.dump {
        dump(case, &outcome.pixels, &reference, folder).map_err(|e| e.to_string())?;
    }
    let s = outcome.report.seconds;
    Ok(Ok(Row {
        case: case.index,
        family: case.family,
        summary: case.summary(),
        causes,
        facets: case.mesh.facets.len(),
        pixels: reference.image.hit.iter().filter(|&&h| h).count(),
        tolerance,
        image,
        irradiance,
        estimate: outcome.report.error_estimate,
        limited_by: outcome.report.limited_by,
        seconds: [outcome.seconds, s.scene + s.bvh + s.coupling, s.light + s.radiosity, s.image],
        elements: outcome.report.elements,
        samples: reference.image.samples,
        rays: reference.image.rays as f64 / 1e6,
    }))
}

fn dump(case: &Case, pixels: &[f64], reference: &reference::Reference, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let shape = [case.camera.rows, case.camera.columns, case.materials[0].diffuse.len()];
    let hit: Vec<f64> = reference.image.hit.iter().map(|&h| f64::from(u8::from(h))).collect();
    let [a, b] = &reference.image.values;
    for (name, values, bands) in
        [("blik", pixels, shape[2]), ("a", a, shape[2]), ("b", b, shape[2]), ("hit", &hit, 1)]
    {
        let mut file = std::fs::File::create(folder.join(format!("{:03}-{name}.npy", case.index)))?;
        let head = format!(
            "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}, {bands}), }}",
            shape[0], shape[1]
        );
        // the format wants magic, version, length and text in a multiple of 64 bytes
        let text = format!("{head:<117}\n");
        file.write_all(b"\x93NUMPY\x01\x00")?;
        file.write_all(&(text.len() as u16).to_le_bytes())?;
        file.write_all(text.as_bytes())?;
        file.write_all(&values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?;
    }
    Ok(())
}

fn summarise(rows: &[Row]) {
    println!("{FIGURES_HEAD}");
    let some = |name: &str, of: &dyn Fn(&Row) -> bool| {
        let some: Vec<&Row> = rows.iter().filter(|r| of(r)).collect();
        if !some.is_empty() {
            println!("{}", figures(name, &some));
        }
    };
    some("all", &|_| true);
    for tolerance in [1e-2, 2e-3, 5e-4] {
        some(&format!("tolerance {tolerance:e}"), &|r| r.tolerance == tolerance);
    }
    for (family, _) in families::FAMILIES {
        some(family, &|r| r.family == family);
    }
    let mut worst: Vec<&Row> = rows.iter().filter(|r| r.badness() > 1.0).collect();
    worst.sort_by(|a, b| b.badness().total_cmp(&a.badness()));
    if rows.iter().any(|r| !r.causes.is_empty()) {
        println!("cases that miss their tolerance, by the kind of pixels that carries most of the error");
        let missed = || rows.iter().filter(|r| !r.verdict().met);
        let mut names: Vec<&str> = missed().filter_map(|r| r.causes.first()).map(|c| c.0.as_str()).collect();
        names.sort_unstable();
        for group in names.chunk_by(|a, b| a == b) {
            let of: Vec<&Row> =
                missed().filter(|r| r.causes.first().is_some_and(|c| c.0 == group[0])).collect();
            println!("{}", figures(group[0], &of));
        }
    }
    println!("worst: true error beyond tolerance or estimate");
    for row in worst.iter().take(40) {
        println!(
            "{:3} {:16} {:6.0e} true {:.2e} +- {:.0e}, estimate {:.2e} ({}), {} facets; {}",
            row.case,
            row.family,
            row.tolerance,
            row.image.eps,
            row.image.error(),
            row.estimate,
            row.limited_by,
            row.facets,
            row.summary
        );
    }
}
