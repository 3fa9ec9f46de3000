//! The short summary on standard output.

use std::io::{self, Write};
use std::path::Path;

use crate::pipeline::Job;
use crate::report_file::Report;
use crate::view::View;

/// Says what was computed, how long each stage took and how well it is known.
pub fn write(title: &str, pixels: (usize, usize), report: &Report, to: &mut impl Write) -> io::Result<()> {
    let (columns, rows) = pixels;
    let (facets, bands) = (report.facets, report.bands);
    writeln!(
        to,
        "{title}: {columns} x {rows} pixels, {facets} facet{}, {bands} band{}",
        plural(facets),
        plural(bands)
    )?;
    if report.degenerate_facets > 0 {
        writeln!(to, "  {} degenerate, without effect", report.degenerate_facets)?;
    }
    backs(&report.view, to)?;
    let s = &report.seconds;
    let stages = [
        ("read", s.read),
        ("scene", s.scene),
        ("bvh", s.bvh),
        ("coupling", s.coupling),
        ("light", s.light),
        ("radiosity", s.radiosity),
        ("image", s.image),
        ("write", s.write),
        ("total", s.total),
    ];
    let stages: Vec<String> = stages.iter().map(|(name, seconds)| format!("{name} {seconds:.3}")).collect();
    writeln!(to, "  seconds: {}", stages.join(", "))?;
    let met = if report.tolerance_met { "met" } else { "not met" };
    writeln!(
        to,
        "  error estimate {:.1e}, tolerance {:.1e} {met}, limited by {}",
        report.error_estimate, report.tolerance, report.limited_by
    )
}

/// Says what was found in a scene and all that it names.
pub fn check(path: &Path, job: &Job, view: &View, to: &mut impl Write) -> io::Result<()> {
    let (scene, mesh) = (job.scene, job.mesh);
    let camera = &scene.camera;
    let (facets, materials, bands) = (mesh.facets.len(), mesh.material_names.len(), scene.bands);
    writeln!(
        to,
        "{}: good: {} x {} pixels, {facets} facet{}, {materials} material{}, {bands} band{}",
        path.display(),
        camera.columns,
        camera.rows,
        plural(facets),
        plural(materials),
        plural(bands)
    )?;
    let (low, high) = mesh.bounds();
    writeln!(to, "  {} lies between {low:?} and {high:?}", scene.mesh.display())?;
    let light = [
        scene.sky.as_ref().map(|sky| format!("sky {}", sky.model.name())),
        scene.sun.as_ref().map(|_| "sun".to_string()),
    ];
    let light: Vec<String> = light.into_iter().flatten().collect();
    writeln!(
        to,
        "  light: {}",
        if light.is_empty() { "none but emission".into() } else { light.join(", ") }
    )?;
    writeln!(
        to,
        "  of {} pixel centres, {} show the object and {} the background",
        view.samples,
        view.fronts + view.backs,
        view.background
    )?;
    backs(view, to)
}

fn plural(n: usize) -> &'static str {
    if n == 1 { "" } else { "s" }
}

/// Says how many backs are seen, where there are any.
fn backs(view: &View, to: &mut impl Write) -> io::Result<()> {
    match view.backs {
        0 => Ok(()),
        backs => {
            let share = 100.0 * view.share_of_backs();
            writeln!(
                to,
                "  backs, which are black: {backs} of {} pixel centres, {share:.1} % of the object",
                view.samples
            )
        }
    }
}

/// Says where the files are.
pub fn files<'a>(paths: impl IntoIterator<Item = &'a Path>, to: &mut impl Write) -> io::Result<()> {
    let paths: Vec<String> = paths.into_iter().map(|path| path.display().to_string()).collect();
    writeln!(to, "written: {}", paths.join(", "))
}
