//! A figure: named series of points, as a chart and as a table.

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;
use std::error::Error;
use std::path::Path;

/// Points of one curve.
pub struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

/// Series over common axes.
pub struct Figure {
    /// Of the files.
    pub name: &'static str,
    pub title: &'static str,
    pub x: &'static str,
    pub y: &'static str,
    /// Whether the axes are logarithmic.
    pub log: (bool, bool),
    pub series: Vec<Series>,
}

const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 90, 160),
    RGBColor(200, 60, 20),
    RGBColor(20, 130, 60),
    RGBColor(130, 60, 160),
    RGBColor(210, 140, 0),
    RGBColor(0, 150, 170),
    RGBColor(120, 80, 40),
    RGBColor(90, 90, 90),
];

/// Points below are exact but for rounding: a logarithmic axis leaves them out, the table has them.
const FLOOR: f64 = 1e-9;

/// One axis: how values become positions, its range and its ticks.
#[derive(Clone)]
struct Axis {
    log: bool,
    range: std::ops::Range<f64>,
    ticks: Vec<f64>,
}

impl Axis {
    fn new(log: bool, values: impl Iterator<Item = f64>) -> Axis {
        let at = |v: f64| if log { v.max(FLOOR).log10() } else { v };
        let (low, high) = values.map(at).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        if log {
            // ticks at 1, 2 and 5 times the powers of ten where few decades are shown
            let steps: &[f64] = if high - low < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let decades = low.floor() as i32..=high.ceil() as i32;
            let all = decades.flat_map(|d| steps.iter().map(move |s| f64::from(d) + s.log10()));
            let range = low - 0.05 * (high - low)..high + 0.05 * (high - low);
            let ticks = all.filter(|t| range.contains(t)).collect();
            return Axis { log, range, ticks };
        }
        let low = if low > 0.0 && low < 0.5 * high { 0.0 } else { low };
        let rough = (high - low) / 5.0;
        let power = 10f64.powf(rough.log10().floor());
        let step =
            [1.0, 2.0, 5.0, 10.0].map(|s| s * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let ticks = (0..12).map(|i| (low / step).ceil() * step + f64::from(i) * step);
        Axis { log, range: low..high * 1.03, ticks: ticks.filter(|t| *t <= high * 1.03).collect() }
    }

    fn at(&self, v: f64) -> f64 {
        if self.log { v.max(FLOOR).log10() } else { v }
    }

    fn label(&self, position: f64) -> String {
        if !self.log {
            return format!("{}", (position * 1e6).round() / 1e6);
        }
        let value = 10f64.powf(position);
        if (0.01..1000.0).contains(&value) {
            format!("{}", (value * 1e4).round() / 1e4)
        } else {
            format!("{value:.0e}")
        }
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.range.clone()
    }
}

impl Figure {
    /// Writes `NAME.svg` and `NAME.csv` into `folder`.
    pub fn write(&self, folder: &Path) -> Result<(), Box<dyn Error>> {
        let path = folder.join(self.name);
        let mut table = csv::Writer::from_path(path.with_extension("csv"))?;
        table.write_record(["series", self.x, self.y])?;
        for series in &self.series {
            for (x, y) in &series.points {
                table.write_record([series.name.as_str(), &format!("{x:.5}"), &format!("{y:.4e}")])?;
            }
        }
        table.flush()?;
        self.draw(&path.with_extension("svg"))
    }

    /// Writes the chart alone.
    pub fn draw(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        let shown = |p: &&(f64, f64)| !(self.log.1 && p.1 < FLOOR);
        let points = || self.series.iter().flat_map(|s| &s.points).filter(shown);
        let x = Axis::new(self.log.0, points().map(|p| p.0));
        let y = Axis::new(self.log.1, points().map(|p| p.1));
        let root = SVGBackend::new(path, (860, 520)).into_drawing_area();
        root.fill(&WHITE)?;
        let (main, legend) = root.split_horizontally(620);
        let mut chart = ChartBuilder::on(&main)
            .caption(self.title, ("sans-serif", 21))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(66)
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc(self.x)
            .y_desc(self.y)
            .x_label_formatter(&|v| x.label(*v))
            .y_label_formatter(&|v| y.label(*v))
            .label_style(("sans-serif", 16))
            .draw()?;
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let line = series.points.iter().filter(shown).map(|&(a, b)| (x.at(a), y.at(b)));
            chart.draw_series(LineSeries::new(line.clone(), colour.stroke_width(2)))?;
            if series.points.len() <= 16 {
                chart.draw_series(line.map(|p| Circle::new(p, 3, colour.filled())))?;
            }
            let row = 46 + 24 * i as i32;
            legend.draw(&PathElement::new(vec![(4, row), (26, row)], colour.stroke_width(3)))?;
            legend.draw(&Text::new(series.name.clone(), (32, row - 7), ("sans-serif", 16)))?;
        }
        root.present()?;
        Ok(())
    }
}
