//! Readers for `.npy` arrays and `.npz` archives of them.

use npyz::{Deserialize, NpyFile, Order};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// An array in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub struct Array<T> {
    /// Length of every dimension, outermost first.
    pub shape: Vec<usize>,
    /// The values, last dimension fastest.
    pub values: Vec<T>,
}

fn parse<T: Deserialize>(reader: impl Read, what: &str) -> Array<T> {
    let file = NpyFile::new(reader).unwrap_or_else(|e| panic!("{what}: {e}"));
    let shape: Vec<usize> = file.shape().iter().map(|&n| n as usize).collect();
    assert!(shape.len() < 2 || file.order() == Order::C, "{what}: column-major");
    let values = file.into_vec().unwrap_or_else(|e| panic!("{what}: {e}"));
    Array { shape, values }
}

/// Reads a `.npy` file of element type `T` (f32, f64, bool, ...; the file must hold exactly that). Panics with the
/// path otherwise.
pub fn read<T: Deserialize>(path: &Path) -> Array<T> {
    let what = path.display().to_string();
    let file = File::open(path).unwrap_or_else(|e| panic!("{what}: {e}"));
    parse(BufReader::new(file), &what)
}

/// Reads the array `name` of a `.npz` archive; panics as [`read`] does.
pub fn read_npz<T: Deserialize>(path: &Path, name: &str) -> Array<T> {
    let what = format!("{}:{name}", path.display());
    let file = File::open(path).unwrap_or_else(|e| panic!("{what}: {e}"));
    let mut archive = zip::ZipArchive::new(BufReader::new(file)).unwrap_or_else(|e| panic!("{what}: {e}"));
    let entry = archive.by_name(&format!("{name}.npy")).unwrap_or_else(|e| panic!("{what}: {e}"));
    parse(entry, &what)
}
