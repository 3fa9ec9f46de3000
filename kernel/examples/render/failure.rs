//! The one kind of failure: a line for the user that names the file, line or key, and what was expected.

use std::fmt;
use std::path::Path;

/// A sentence for standard error; never more than one line.
#[derive(Debug)]
pub struct Failure(String);

/// What anything that can fail returns.
pub type Outcome<T> = Result<T, Failure>;

impl Failure {
    /// `what` went wrong with the file at `path`.
    pub fn at(path: &Path, what: impl fmt::Display) -> Self {
        Failure::new(format_args!("{}: {what}", path.display()))
    }

    /// `what` went wrong at a line (counted from 1) of the file at `path`.
    pub fn at_line(path: &Path, line: usize, what: impl fmt::Display) -> Self {
        Failure::new(format_args!("{}:{line}: {what}", path.display()))
    }

    /// `what` went wrong, where no file is to blame.
    pub fn new(what: impl fmt::Display) -> Self {
        // Libraries' messages may span lines.
        Failure(what.to_string().lines().map(str::trim).collect::<Vec<_>>().join(" "))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
