//! A satellite of 808 facets whose panels track the sun, at 1e-2 in three bands: seconds of an epoch, its coupling kept from that
//! of the first, and of its stages.
//!
//! `cargo bench --bench poses` takes 1,000 epochs; `--quick` 50.

mod support;

use blik_kernel::host::{Geometry, GeometryMemory, Host, Settings};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::scene::pose::{Parts, Pose};
use blik_kernel::scene::{MaterialInput, SceneInput};
use blik_kernel::sun::SunInput;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use support::{Mesh, processor_seconds};

fn main() {
    let epochs = if std::env::args().any(|argument| argument == "--quick") { 50 } else { 1000 };
    let mut mesh = Mesh::default();
    mesh.cuboid([-1.0; 3], [1.0; 3], [6; 3], 0);
    let body = mesh.facets.len();
    for low in [-5.0, 1.5] {
        mesh.cuboid([-0.9, low, -0.025], [0.9, low + 3.5, 0.025], [3, 11, 1], 1);
    }
    let material = |diffuse, specular| MaterialInput { diffuse, specular, emission: &[0.0; 3], gloss: None };
    let materials =
        [material(&[0.5, 0.4, 0.3], &[0.1, 0.2, 0.2]), material(&[0.1, 0.1, 0.2], &[0.3, 0.2, 0.1])];
    let input = SceneInput {
        vertices: &mesh.vertices,
        facets: &mesh.facets,
        facet_materials: &mesh.materials,
        normals: &[],
        facet_normals: &[],
        materials: &materials,
        two_sided: false,
        bands: 3,
    };
    // each panel is a part of its own: its box is as flat as it is
    let panel = (mesh.facets.len() - body) / 2;
    let part = |facet: usize| if facet < body { 0 } else { 1 + ((facet - body) / panel) as u32 };
    let parts: Vec<u32> = (0..mesh.facets.len()).map(part).collect();
    let (host, mut memory) = (Host::new(THREADS).unwrap(), GeometryMemory::default());
    let settings = Settings { tolerance: 1e-2, ..Settings::default() };
    let kept = host.geometry(&mut memory, &input, &settings).unwrap();
    let (start, processor, next) = (Instant::now(), processor_seconds(), AtomicUsize::new(0));
    // each epoch on one thread
    let all: Vec<Epochs> = std::thread::scope(|scope| {
        let work = || {
            let (host, mut done) = (Host::new(1).unwrap(), Epochs::default());
            loop {
                let epoch = next.fetch_add(1, Ordering::Relaxed);
                if epoch >= epochs {
                    return done;
                }
                done.add(&host, &kept, (&input, &parts), TAU * epoch as f64 / epochs as f64);
            }
        };
        let threads: Vec<_> = (0..THREADS).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let (wall, processor) = (start.elapsed().as_secs_f64(), processor_seconds() - processor);
    let mean = |of: fn(&Epochs) -> f64| all.iter().map(of).sum::<f64>() / epochs as f64;
    let seconds = [0, 1, 2, 3, 4, 5].map(|k| all.iter().map(|e| e.seconds[k]).sum::<f64>() / epochs as f64);
    println!(
        "{} facets: {:.1} ms an epoch on {THREADS} threads, {:.1} ms of processor; {:.0} rows kept, {:.0} redone by {:.0} rays",
        mesh.facets.len(),
        1e3 * wall / epochs as f64,
        1e3 * processor / epochs as f64,
        mean(|e| e.kept as f64),
        mean(|e| e.redone as f64),
        mean(|e| e.rays as f64),
    );
    // the bar: 30 s for 1,000 epochs on two cores
    assert!(processor <= 0.03 * (THREADS * epochs) as f64, "{processor} s for {epochs} epochs");
    println!("ms: scene, tree, coupling, light, radiosity, signature {:.2?}", seconds.map(|s| 1e3 * s));
}

/// Threads of the bench: of two cores.
const THREADS: usize = 2;

/// Sums over epochs.
#[derive(Default)]
struct Epochs {
    /// Seconds of scene, tree, coupling, light, radiosity and signature.
    seconds: [f64; 6],
    kept: u64,
    redone: u64,
    rays: u64,
}

impl Epochs {
    /// One epoch: panels turned by an angle, toward the sun.
    fn add(
        &mut self,
        host: &Host,
        kept: &Geometry<'_>,
        (input, parts): (&SceneInput<'_>, &[u32]),
        turn: f64,
    ) {
        let axle = Pose::about([0.0; 3], [0.0, 1.0, 0.0], turn);
        let parts = Parts { facets: parts, poses: &[Pose::REST, axle, axle] };
        let mut memory = GeometryMemory::default();
        let geometry = host.pose(kept, &mut memory, input, &parts).unwrap();
        let direction = [turn.sin(), 0.2, turn.cos()];
        let sun = SunInput { direction, irradiance: &[3.0; 3], half_angle_deg: 0.2665 };
        let light = LightInput { sun: Some(sun), ..LightInput::default() };
        let lit = host.light_of(&geometry, &light).unwrap();
        let clock = Instant::now();
        host.signature(&lit, Vec3::new(0.3, -0.5, -0.8)).unwrap();
        let s = &lit.report().seconds;
        let own = [s.scene, s.bvh, s.coupling, s.light, s.radiosity, clock.elapsed().as_secs_f64()];
        self.seconds.iter_mut().zip(own).for_each(|(sum, x)| *sum += x);
        let report = geometry.report();
        self.kept += report.rows.kept;
        self.redone += report.rows.redone;
        self.rays += report.rays.visibility;
    }
}
