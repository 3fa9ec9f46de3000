//! A satellite of 808 facets whose panels track the sun, at 1e-2 in three bands: seconds of an epoch, its coupling kept from that
//! of the first, and of its stages.
//!
//! `cargo bench --bench poses` takes 1,000 epochs; `--quick` 50.

use blik_kernel::host::{GeometryMemory, Host, Settings};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::scene::pose::{Parts, Pose};
use blik_kernel::scene::{MaterialInput, SceneInput};
use blik_kernel::sun::SunInput;
use std::f64::consts::TAU;
use std::time::Instant;

/// A mesh that grows by rectangles of quads, each of two facets.
#[derive(Default)]
struct Mesh {
    vertices: Vec<[f64; 3]>,
    facets: Vec<[u32; 3]>,
    materials: Vec<u32>,
}

impl Mesh {
    /// A rectangle from `origin` along the axes `first` and `second`; its front is on their right-handed side.
    fn rectangle(
        &mut self,
        origin: [f64; 3],
        (first, length, columns): (usize, f64, u32),
        (second, width, rows): (usize, f64, u32),
        material: u32,
    ) {
        let start = self.vertices.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let mut vertex = origin;
                vertex[first] += length * f64::from(column) / f64::from(columns);
                vertex[second] += width * f64::from(row) / f64::from(rows);
                self.vertices.push(vertex);
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [row, row + 1].map(|row| start + row * (columns + 1) + column);
                self.facets.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
                self.materials.extend([material; 2]);
            }
        }
    }

    /// A box between two corners, fronts outward; `top` is the material of its upper side.
    fn cuboid(&mut self, low: [f64; 3], high: [f64; 3], quads: [u32; 3], top: u32) {
        for axis in 0..3 {
            let [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
            let edge = |axis: usize| (axis, high[axis] - low[axis], quads[axis]);
            let mut upper = low;
            upper[axis] = high[axis];
            self.rectangle(upper, edge(first), edge(second), if axis == 2 { top } else { 0 });
            self.rectangle(low, edge(second), edge(first), 0);
        }
    }
}

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
    let parts: Vec<u32> = (0..mesh.facets.len()).map(|facet| u32::from(facet >= body)).collect();
    let (host, mut memory) = (Host::new(2).unwrap(), GeometryMemory::default());
    let settings = Settings { tolerance: 1e-2, ..Settings::default() };
    let kept = host.geometry(&mut memory, &input, &settings).unwrap();
    let mut seconds = [0.0; 6];
    let start = Instant::now();
    let mut memory = GeometryMemory::default();
    for epoch in 0..epochs {
        let turn = TAU * epoch as f64 / epochs as f64;
        let poses = [Pose::REST, Pose::about([0.0; 3], [0.0, 1.0, 0.0], turn)];
        let parts = Parts { facets: &parts, poses: &poses };
        let geometry = host.pose(&kept, &mut memory, &input, &parts).unwrap();
        let direction = [turn.sin(), 0.2, turn.cos()];
        let sun = SunInput { direction, irradiance: &[3.0; 3], half_angle_deg: 0.2665 };
        let light = LightInput { sun: Some(sun), ..LightInput::default() };
        let lit = host.light_of(&geometry, &light).unwrap();
        let clock = Instant::now();
        let (signature, _) = host.signature(&lit, Vec3::new(0.3, -0.5, -0.8)).unwrap();
        let s = &lit.report().seconds;
        let own = [s.scene, s.bvh, s.coupling, s.light, s.radiosity, clock.elapsed().as_secs_f64()];
        seconds.iter_mut().zip(own).for_each(|(sum, x)| *sum += x / epochs as f64);
        if epoch % (epochs / 5) == 0 {
            let r = geometry.report();
            println!(
                "epoch {epoch}: {:?} rays {}; {:?} W/sr +- {:?}",
                r.rows, r.rays.visibility, signature.radiant_intensity, signature.error
            );
        }
    }
    let epoch = start.elapsed().as_secs_f64() / epochs as f64;
    println!(
        "{} facets: {epoch:.4} s an epoch; scene, tree, coupling, light, radiosity, signature {seconds:.4?}",
        mesh.facets.len()
    );
}
