//! Every stage against the number of facets, of mirrors and of bands; the whole run, a new light, a new view and a
//! light curve; and each kind of work that a scene may lack, absent and present.
//!
//! `cargo bench --bench stages`; `-- --quick` takes the small sizes alone, BLIK_BENCH_LARGE=1 adds 10^5 facets.

mod scale;
mod scene;
mod skips;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, criterion_main};
use std::time::Duration;

/// The group of a stage; every run of it takes about the same time.
fn group<'c>(c: &'c mut Criterion, stage: &str) -> BenchmarkGroup<'c, WallTime> {
    let mut group = c.benchmark_group(stage);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(500));
    group
}

/// Whether a first look is wanted.
fn quick() -> bool {
    std::env::args().any(|argument| argument == "--quick")
}

/// Pixels along each side of the images.
fn pixels() -> usize {
    if quick() { 32 } else { 128 }
}

fn stages() {
    let mut c = Criterion::default().configure_from_args();
    scale::facets(&mut c);
    scale::mirrors(&mut c);
    scale::bands(&mut c);
    scale::light_curve(&mut c);
    skips::pairs(&mut c);
    c.final_summary();
}

criterion_main!(stages);
