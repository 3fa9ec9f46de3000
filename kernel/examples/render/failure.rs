//! Messages for the user: a failure ends the program, a warning does not. Both name the file, line or key, and what was
//! expected.

use std::fmt;
use std::path::Path;

/// A sentence for standard error; never more than one line.
#[derive(Clone, Debug)]
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

/// Warnings in the order of their first occurrence. A kind that occurs again is counted, not repeated.
#[derive(Debug, Default)]
pub struct Warnings(Vec<Warning>);

#[derive(Debug)]
struct Warning {
    kind: &'static str,
    first: Failure,
    count: usize,
}

impl Warnings {
    /// Adds an occurrence of `kind`; `message` is called for the first.
    pub fn add(&mut self, kind: &'static str, message: impl FnOnce() -> Failure) {
        match self.0.iter_mut().find(|warning| warning.kind == kind) {
            Some(warning) => warning.count += 1,
            None => self.0.push(Warning { kind, first: message(), count: 1 }),
        }
    }

    /// One warning.
    pub fn of(message: Failure) -> Self {
        Warnings(vec![Warning { kind: "", first: message, count: 1 }])
    }

    /// Appends those of another reader.
    pub fn append(&mut self, other: Warnings) {
        self.0.extend(other.0);
    }

    /// One line for each kind.
    pub fn lines(&self) -> impl Iterator<Item = String> {
        self.0.iter().map(|warning| match warning.count {
            1 => warning.first.to_string(),
            n => format!("{} ({n} like this, the first is named)", warning.first),
        })
    }
}
