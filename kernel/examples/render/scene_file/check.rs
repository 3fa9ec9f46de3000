//! Checks of single values; every failure names the file and the key and says what was expected.

use std::path::Path;

use super::keys::Values;
use crate::failure::{Failure, Outcome};

/// What the checks need to know of the file.
pub struct Check<'a> {
    /// The scene file, for messages.
    pub path: &'a Path,
    /// Number of spectral bands.
    pub bands: usize,
}

impl Check<'_> {
    /// The failure of `key`.
    pub fn fail(&self, key: &str, expected: &str, got: impl std::fmt::Debug) -> Failure {
        Failure::at(self.path, format_args!("{key}: expected {expected}, got {got:?}"))
    }

    /// A key that is required where it stands.
    pub fn required<T>(&self, key: &str, value: Option<T>, why: &str) -> Outcome<T> {
        value.ok_or_else(|| Failure::at(self.path, format_args!("missing key `{key}`: {why}")))
    }

    /// A number for which `holds`.
    pub fn number(&self, key: &str, x: f64, expected: &str, holds: impl Fn(f64) -> bool) -> Outcome<f64> {
        if x.is_finite() && holds(x) { Ok(x) } else { Err(self.fail(key, expected, x)) }
    }

    /// A point: three finite numbers.
    pub fn point(&self, key: &str, p: [f64; 3]) -> Outcome<[f64; 3]> {
        if p.iter().all(|x| x.is_finite()) { Ok(p) } else { Err(self.fail(key, "three finite numbers", p)) }
    }

    /// A direction of any length: three finite numbers, not all zero.
    pub fn direction(&self, key: &str, d: [f64; 3]) -> Outcome<[f64; 3]> {
        if d.iter().all(|x| x.is_finite()) && d.iter().any(|x| *x != 0.0) {
            Ok(d)
        } else {
            Err(self.fail(key, "three finite numbers, not all zero", d))
        }
    }

    /// One value per band, all of them at least 0 and at most `largest` (which may be infinity).
    pub fn spectrum(
        &self,
        key: &str,
        values: Option<Values>,
        default: f64,
        largest: f64,
    ) -> Outcome<Vec<f64>> {
        let values = match values {
            None => vec![default; self.bands],
            Some(Values::Same(x)) => vec![x; self.bands],
            Some(Values::Each(values)) if values.len() == self.bands => values,
            Some(Values::Each(values)) => {
                let expected = format!("a number or an array of {} (one per band)", self.bands);
                return Err(self.fail(key, &expected, values));
            }
        };
        let expected = if largest.is_finite() {
            format!("0 to {}", largest.floor())
        } else {
            "a finite number from 0 up".into()
        };
        match values.iter().find(|x| !(x.is_finite() && **x >= 0.0 && **x <= largest)) {
            Some(x) => Err(self.fail(key, &expected, x)),
            None => Ok(values),
        }
    }
}
