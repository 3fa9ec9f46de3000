//! The short summary on standard output.

use std::io::{self, Write};
use std::path::Path;

use crate::report_file::Report;

/// Says what was computed, how long each stage took and how well it is known.
pub fn write(title: &str, pixels: (usize, usize), report: &Report, to: &mut impl Write) -> io::Result<()> {
    let plural = |n: usize| if n == 1 { "" } else { "s" };
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

/// Says where the files are.
pub fn files<'a>(paths: impl IntoIterator<Item = &'a Path>, to: &mut impl Write) -> io::Result<()> {
    let paths: Vec<String> = paths.into_iter().map(|path| path.display().to_string()).collect();
    writeln!(to, "written: {}", paths.join(", "))
}
