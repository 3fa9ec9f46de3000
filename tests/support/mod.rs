//! What the integration tests and benches share: scenes, the brute-force twin, reference values and readers.
//!
//! A test binary takes it with `mod support;`, a bench with `#[path = "../tests/support/mod.rs"] mod support;`.
//! Nothing here uses kernel code, so that it can judge it.
// Each binary uses a part.
#![allow(dead_code, unused_imports)]

pub mod cases;
pub mod metric;
pub mod npy;
pub mod random;
pub mod references;
pub mod scene_file;
pub mod scenes;
pub mod twin;

use std::path::PathBuf;

/// A file below `tests/data`, wherever the test was started.
pub fn data(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(path)
}
