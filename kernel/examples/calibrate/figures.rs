//! What one case showed, and the calibration's three figures over all of them.

use crate::judge::Score;

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Row {
    /// The case's number.
    pub case: usize,
    /// Its kind.
    pub family: &'static str,
    /// Light, sides, bands, view.
    pub summary: String,
    /// Kinds of pixels with their shares of eps^2 and of the pixels, if asked for.
    pub causes: Vec<(String, f64, f64)>,
    /// Facets.
    pub facets: usize,
    /// Pixels on the object.
    pub pixels: usize,
    /// Error asked for.
    pub tolerance: f64,
    /// True error of the image.
    pub image: Score,
    /// True error of some facets' irradiances over pi.
    pub irradiance: Score,
    /// Reported.
    pub estimate: f64,
    /// Reported.
    pub limited_by: &'static str,
    /// Blik's, from mesh to image: all, geometry, light and solution, image.
    pub seconds: [f64; 4],
    /// Elements.
    pub elements: usize,
    /// Samples of each half of the reference's pixels.
    pub samples: u32,
    /// Rays of the reference, millions.
    pub rays: f64,
}

/// Whether the bound holds for the true error or for one a standard error away.
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    /// True error <= estimate.
    pub covered: bool,
    /// Estimate <= max(10 x true error, 0.3 x tolerance).
    pub tight: bool,
    /// True error <= tolerance.
    pub met: bool,
}

impl Row {
    /// The three questions, with the true error within its standard error of the bound counted as met.
    pub fn verdict(&self) -> Verdict {
        Verdict {
            covered: self.image.low <= self.estimate,
            tight: self.estimate <= (10.0 * self.image.high).max(0.3 * self.tolerance),
            met: self.image.low <= self.tolerance,
        }
    }

    /// How far the worst of the first and third question is from a yes: above 1 it is a no.
    pub fn badness(&self) -> f64 {
        (self.image.low / self.tolerance).max(
            self.image.low / self.estimate.max(1e-12)
                * f64::from(u8::from(self.image.low > 0.3 * self.tolerance)),
        )
    }

    /// The head of the table.
    pub const HEAD: &str = "case,family,light and view,facets,pixels,tolerance,true eps,standard error,estimate,\
        limited by,covered,tight,met,facets eps,facets standard error,elements,seconds,geometry,light,image,\
        reference samples,reference Mrays";

    /// The row as comma-separated values.
    pub fn csv(&self) -> String {
        let v = self.verdict();
        let [seconds, geometry, light, image] = self.seconds;
        format!(
            "{},{},{},{},{},{:e},{:.3e},{:.1e},{:.3e},{},{},{},{},{:.3e},{:.1e},{},{seconds:.3},{geometry:.3},\
             {light:.3},{image:.3},{},{:.1}",
            self.case,
            self.family,
            self.summary,
            self.facets,
            self.pixels,
            self.tolerance,
            self.image.eps,
            self.image.error(),
            self.estimate,
            self.limited_by,
            u8::from(v.covered),
            u8::from(v.tight),
            u8::from(v.met),
            self.irradiance.eps,
            self.irradiance.error(),
            self.elements,
            self.samples,
            self.rays
        )
    }
}

/// One line of figures over some rows.
pub fn figures(name: &str, rows: &[&Row]) -> String {
    let share = |of: fn(&Verdict) -> bool| {
        100.0 * rows.iter().filter(|r| of(&r.verdict())).count() as f64 / rows.len().max(1) as f64
    };
    // the reference alone cannot say
    let unsure = rows.iter().filter(|r| r.image.error() > 0.3 * r.tolerance).count();
    let mut ratios: Vec<f64> = rows.iter().map(|r| r.image.eps / r.tolerance).collect();
    ratios.sort_by(f64::total_cmp);
    let at =
        |q: f64| ratios.get((q * ratios.len() as f64) as usize).or(ratios.last()).copied().unwrap_or(0.0);
    let seconds: f64 = rows.iter().map(|r| r.seconds[0]).sum();
    format!(
        "{name:24} {:4} {:7.1} {:7.1} {:7.1}   {:6.2} {:6.2} {:8.2}   {unsure:3}  {seconds:7.1}",
        rows.len(),
        share(|v| v.covered),
        share(|v| v.tight),
        share(|v| v.met),
        at(0.5),
        at(0.95),
        at(1.0)
    )
}

/// What the columns of [`figures`] are.
pub const FIGURES_HEAD: &str = "                         cases covered%  tight%    met%   eps/tolerance: median, 95%, worst   \
    unsure  seconds";
