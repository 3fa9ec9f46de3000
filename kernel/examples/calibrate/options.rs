//! The command line.

use super::case::Case;
use super::families::FAMILIES;
use super::reference::Goal;
use lexopt::prelude::*;
use std::path::PathBuf;

/// What was asked for.
pub struct Options {
    filter: Option<String>,
    every: usize,
    /// Where the table goes.
    pub csv: PathBuf,
    /// Where references are kept.
    pub references: PathBuf,
    /// How good references are.
    pub goal: Goal,
    /// Blik's tolerance, where it is not the case's.
    pub tolerance: Option<f64>,
    /// Where images go.
    pub dump: Option<PathBuf>,
    /// Pixels of each case that the twin computes, too.
    pub twin: usize,
    /// Rays through each pixel of area sampling to compare its value with.
    pub pixels: u32,
    /// Sort each case's error by what is difficult about its pixels.
    pub causes: bool,
    /// Only name the cases.
    pub list: bool,
}

impl Options {
    /// Reads the command line.
    pub fn of_command_line() -> Result<Options, String> {
        let folder = PathBuf::from(std::env::var_os("CARGO_TARGET_DIR").unwrap_or("target".into()))
            .join("calibration");
        let mut options = Options {
            filter: None,
            every: 1,
            csv: folder.join("table.csv"),
            references: folder,
            goal: Goal { error: 0.15, rays: 20_000_000 },
            tolerance: None,
            dump: None,
            twin: 0,
            pixels: 0,
            causes: false,
            list: false,
        };
        options.read().map_err(|e| e.to_string())?;
        Ok(options)
    }

    fn read(&mut self) -> Result<(), lexopt::Error> {
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("filter") => self.filter = Some(parser.value()?.string()?.to_lowercase()),
                Long("every") => self.every = parser.value()?.parse::<usize>()?.max(1),
                Long("csv") => self.csv = parser.value()?.into(),
                Long("references") => self.references = parser.value()?.into(),
                Long("goal") => self.goal.error = parser.value()?.parse()?,
                Long("mrays") => self.goal.rays = 1_000_000 * parser.value()?.parse::<u64>()?,
                Long("tolerance") => self.tolerance = Some(parser.value()?.parse()?),
                Long("dump") => self.dump = Some(parser.value()?.into()),
                Long("twin") => self.twin = parser.value()?.parse()?,
                Long("pixels") => self.pixels = parser.value()?.parse()?,
                Long("causes") => self.causes = true,
                Long("list") => self.list = true,
                other => return Err(other.unexpected()),
            }
        }
        Ok(())
    }

    /// Whether a case of this number belongs to the subset.
    pub fn takes(&self, index: usize) -> bool {
        // of kind k the cases start at another one, so that a subset has all kinds of light
        (index / FAMILIES.len() + index % FAMILIES.len()).is_multiple_of(self.every)
    }

    /// Whether the filter lets a case pass.
    pub fn wants(&self, case: &Case) -> bool {
        self.filter.as_ref().is_none_or(|text| {
            text.parse::<usize>().map_or_else(
                |_| case.family.contains(text.as_str()) || case.summary().contains(text.as_str()),
                |number| case.index == number,
            )
        })
    }
}
