//! Property tests that try the same cases in every run.

use proptest::test_runner::{Config, RngSeed};

/// `cases` cases from a fixed seed: a run that fails fails again, and nothing is left behind in a file.
pub fn repeatable(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(2008), failure_persistence: None, ..Config::default() }
}
