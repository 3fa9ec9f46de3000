//! Time against size: facets, mirrors, bands, views.

use crate::scene::{Case, EYE, OTHER_EYE, Values, bowl, image};
use crate::{group, pixels, quick};
use blik_kernel::arena::Memory;
use blik_kernel::bvh::Bvh;
use blik_kernel::host::{GeometryMemory, Host};
use blik_kernel::math::Vec3;
use blik_kernel::scene::Scene;
use blik_kernel::simd::Isa;
use blik_kernel::sky::SkyModel;
use criterion::{BenchmarkId, Criterion};
use std::hint::black_box;
use std::time::Duration;

/// Quads along a side of the bowl: about 10^2, 10^3, 10^4 and 10^5 facets.
fn sizes() -> &'static [usize] {
    let all = &[7, 22, 71, 224];
    match (quick(), std::env::var_os("BLIK_BENCH_LARGE").is_some()) {
        (true, _) => &all[..1],
        (false, false) => &all[..3],
        (false, true) => all,
    }
}

/// Quads along a side where it is not the size that is measured.
fn quads() -> usize {
    if quick() { 5 } else { 16 }
}

/// Adds up the seconds that `run` reports, over all runs.
fn reported(runs: u64, mut run: impl FnMut() -> f64) -> Duration {
    Duration::from_secs_f64((0..runs).map(|_| run()).sum())
}

/// All stages of one scene; `of` names it.
fn stages(c: &mut Criterion, of: &str, size: usize, case: &Case) {
    let host = Host::new(0).expect("threads");
    let id = BenchmarkId::from_parameter(size);
    let values = Values::new(case.bands);
    let name = |stage: &str| format!("{of}/{stage}");
    group(c, &name("geometry")).bench_function(id.clone(), |b| {
        b.iter(|| case.geometry(&host, &mut GeometryMemory::default()).elements().count());
    });
    let mut memory = GeometryMemory::default();
    let geometry = case.geometry(&host, &mut memory);
    let overcast = || values.light(&host, &geometry, SkyModel::Overcast, true);
    group(c, &name("light")).bench_function(id.clone(), |b| {
        b.iter_custom(|runs| reported(runs, || overcast().report().seconds.light));
    });
    group(c, &name("radiosity")).bench_function(id.clone(), |b| {
        b.iter_custom(|runs| reported(runs, || overcast().report().seconds.radiosity));
    });
    let lit = overcast();
    group(c, &name("new_view"))
        .bench_function(id.clone(), |b| b.iter(|| image(&host, &lit, OTHER_EYE, pixels())));
    group(c, &name("signature")).bench_function(id.clone(), |b| {
        b.iter(|| host.signature(&lit, Vec3::new(-1.0, -0.5, -2.0)).expect("a direction").0.projected_area);
    });
    group(c, &name("relight")).bench_function(id, |b| {
        b.iter(|| image(&host, &values.light(&host, &geometry, SkyModel::Gradient, true), EYE, pixels()));
    });
}

/// Bowls of one finish; the scene and both builders of the tree by themselves.
pub fn facets(c: &mut Criterion) {
    let host = Host::new(0).expect("threads");
    for &n in sizes() {
        let case = Case::new(bowl(n), 0.3, 0.1);
        let facets = case.mesh.facets.len();
        parts(c, &case);
        stages(c, "facets", facets, &case);
        group(c, "facets/cold").bench_function(BenchmarkId::from_parameter(facets), |b| {
            b.iter(|| case.cold(&host, SkyModel::Overcast, true, pixels()));
        });
    }
}

/// Builds a tree in the memory given.
type Builder = fn(&Scene<'_>, &mut [u8]) -> usize;

fn parts(c: &mut Criterion, case: &Case) {
    let facets = case.mesh.facets.len();
    let id = BenchmarkId::from_parameter(facets);
    case.with_input(|input| {
        let mut memory = Memory::new(Scene::bytes(input).expect("a sound scene"));
        group(c, "facets/scene").bench_function(id.clone(), |b| {
            b.iter(|| black_box(Scene::new(input, memory.bytes_mut())).map(|scene| scene.facets()));
        });
        let scene = Scene::new(input, memory.bytes_mut()).expect("a sound scene");
        let mut tree = Memory::new(Bvh::bytes(facets).expect("few facets"));
        let mut build = |name, build: Builder| {
            group(c, name).bench_function(id.clone(), |b| b.iter(|| build(&scene, tree.bytes_mut())));
        };
        build("facets/bvh_obvhs", |scene, memory| {
            let tree = Bvh::build_obvhs(scene.corners(), scene.areas(), Isa::detect(), memory);
            tree.expect("a tree").memory()
        });
        build("facets/bvh_compact", |scene, memory| {
            let tree = Bvh::build(scene.corners(), scene.areas(), Isa::detect(), memory);
            tree.expect("a tree").memory()
        });
    });
}

/// A bowl in which none, some and all of the facets are mirrors of 0.3 beside their diffuse 0.1.
pub fn mirrors(c: &mut Criterion) {
    let percents: &[u32] = if quick() { &[0, 100] } else { &[0, 10, 50, 100] };
    for &percent in percents {
        let case = Case::new(bowl(quads()), 0.4, 0.0).mixed(f64::from(percent) / 100.0, 0.1, 0.3);
        stages(c, "mirrors_percent", percent as usize, &case);
    }
}

/// Bands share the geometric work.
pub fn bands(c: &mut Criterion) {
    let all: &[usize] = if quick() { &[1, 16] } else { &[1, 3, 16, 64] };
    for &bands in all {
        stages(c, "bands", bands, &Case { bands, ..Case::new(bowl(quads()), 0.3, 0.1) });
    }
}

/// What a distant observer measures from 1,000 directions around the object (10 in a first look).
pub fn light_curve(c: &mut Criterion) {
    let (host, case) = (Host::new(0).expect("threads"), Case::new(bowl(22), 0.3, 0.1));
    let mut memory = GeometryMemory::default();
    let (geometry, values) = (case.geometry(&host, &mut memory), Values::new(1));
    let lit = values.light(&host, &geometry, SkyModel::Overcast, true);
    let views = if quick() { 10 } else { 1000 };
    let direction = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(views);
        Vec3::new(angle.cos(), angle.sin(), -0.7)
    };
    group(c, "light_curve").bench_function(BenchmarkId::from_parameter(views), |b| {
        b.iter(|| {
            let area = |i| host.signature(&lit, direction(i)).expect("a direction").0.projected_area;
            (0..views).map(area).sum::<f64>()
        });
    });
}
