//! The stages are driven in one place, and what they may be given (budgets of rays and of memory, a progress function) the
//! owning layer gives them.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::Error;
use blik_kernel::host::{GeometryMemory, Host, Settings};
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, outcome, within};
use std::path::Path;
use std::sync::{Arc, Mutex};
use support::scenes;
use support::twin::Material;

fn scene() -> Case {
    let materials = [(0.6, 0.2), (0.2, 0.0), (0.1, 0.6)].map(|(d, s)| Material::spectral(&[d], &[s]));
    let sun = SunOf::new([0.5, 0.75, 1.0], &[2.0], 0.2665);
    Case::new(scenes::corner(3), &materials).sky(SkyOf::new(SkyModel::Overcast, &[1.0], &[0.2])).sun(sun)
}

/// Pixels, rays of visibility, bytes of the coupling and the error estimate.
fn run(settings: &Settings, threads: usize) -> Result<(Vec<u32>, u64, usize, f64), Error> {
    let (case, camera) = (scene(), orthographic([3.0, 2.0, 2.5], [0.4, 0.5, 0.25], 2.0, 16));
    let (host, mut memory) = (Host::new(threads)?, GeometryMemory::default());
    case.with_input(|input| {
        let geometry = host.geometry(&mut memory, input, settings)?;
        let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(SunOf::input));
        let lit = host.light(&geometry, sky.as_ref(), sun.as_ref())?;
        let outcome = outcome(&host, &lit, &camera);
        let report = &outcome.image.report;
        Ok((outcome.pixel_bits(), report.rays.visibility, report.bytes.coupling, report.error_estimate))
    })
}

#[test]
fn memory_that_is_enough_changes_no_bit_and_less_takes_fewer_rays() {
    let settings = within(5e-3);
    let free = run(&settings, 2).unwrap();
    for threads in [1, 3] {
        // lanes fill their shares of it unevenly, and what did not fit follows
        for room in [16, 2] {
            let budget = Settings { memory_budget: Some(room * free.2 + (4 << 20)), ..settings.clone() };
            let roomy = run(&budget, threads).unwrap();
            // blocks of other rows have other heads: bytes may differ
            assert!(roomy.0 == free.0 && roomy.1 == free.1, "{threads} threads, {room} times the bytes");
        }
        let tight = Settings { memory_budget: Some(free.2 / 2), ..settings.clone() };
        let less = run(&tight, threads).unwrap();
        assert!(less.1 < free.1 && less.2 <= free.2 / 2 + 65536, "{:?} of {:?}", less.2, free.2);
        assert!(less.3 > free.3, "fewer rays are less sure: {} and {}", less.3, free.3);
        let none = Settings { memory_budget: Some(4096), ..settings.clone() };
        let refused = run(&none, threads).unwrap_err();
        assert!(
            matches!(refused, Error::BufferTooSmall { needed, given: 4096 } if needed > 4096),
            "{refused}"
        );
    }
}

#[test]
fn a_budget_of_rays_is_kept() {
    let settings = within(5e-3);
    let free = run(&settings, 2).unwrap();
    let less = run(&Settings { ray_budget: Some(free.1 / 8), ..settings.clone() }, 2).unwrap();
    // the budget is of the rows' first rays: probes and chains come on top
    assert!(less.1 < free.1 * 2 / 3 && less.3 > free.3, "{} rays of {}", less.1, free.1);
    assert!(run(&Settings { ray_budget: Some(u64::MAX), ..settings }, 2).unwrap() == free);
}

#[test]
fn progress_rises_and_stops_a_call() {
    let case = scene();
    let told = Arc::new(Mutex::new(Vec::new()));
    let (sink, mut memory) = (Arc::clone(&told), GeometryMemory::default());
    let host = Host::new(1).unwrap().with_progress(move |done| {
        sink.lock().unwrap().push(done);
        true
    });
    case.with_input(|input| host.geometry(&mut memory, input, &within(1e-2)).map(|_| ())).unwrap();
    let told = told.lock().unwrap();
    assert!(told.len() > 4 && told.is_sorted(), "{told:?}");
    assert!(told.first().unwrap() < &0.2 && told.last().unwrap() > &0.99, "{told:?}");
    let mut left = told.len() / 2;
    let host = Host::new(2).unwrap().with_progress(move |_| {
        left = left.saturating_sub(1);
        left > 0
    });
    let stopped = case.with_input(|input| host.geometry(&mut memory, input, &within(1e-2)).map(|_| ()));
    assert_eq!(stopped.unwrap_err(), Error::Cancelled);
}

/// Lines of a folder's Rust files that call a sweep of the linear system, but for the tests that stand in them.
fn sweeps(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sweeps(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            const CALLS: [&str; 4] = [".sweep(", ".relaxed_sweep(", ".unit_sweep(", "Solver::new("];
            let calls = |line: &&str| CALLS.iter().any(|call| line.contains(call));
            let code = text.split("mod tests {").next().unwrap();
            found.extend(code.lines().filter(calls).map(|_| path.display().to_string()));
        }
    }
    found.dedup();
    found
}

#[test]
fn one_place_outside_its_wing_sweeps() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["kernel/src", "kernel/examples", "ffi/src", "tests/support", "benches"]
        .map(|folder| root.join(folder));
    let mut found: Vec<String> = folders.iter().flat_map(|folder| sweeps(folder)).collect();
    found.retain(|path| !path.contains("/radiosity") && !path.contains("/plane/"));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].ends_with("stages/solve.rs"), "{found:?}");
}
