//! Many lights against one coupling: 1,000 suns on a satellite of 516 facets at 1e-2, signatures included, and derivatives of a
//! signature by all its reflectances, in processor seconds.
//!
//! `cargo bench --bench lights` tells them for panels that are diffuse, ideal mirrors in part, and glossy; `--quick` takes 100 suns.

mod support;

use blik_kernel::host::{GeometryMemory, Host, Settings, Wanted};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::scene::{Gloss, MaterialInput, SceneInput};
use blik_kernel::sun::SunInput;
use std::f64::consts::TAU;
use support::{Mesh, processor_seconds};

fn main() {
    let suns = if std::env::args().any(|argument| argument == "--quick") { 100 } else { 1000 };
    let mut mesh = Mesh::default();
    mesh.cuboid([-1.0; 3], [1.0; 3], [5; 3], 0);
    for low in [-5.0, 1.5] {
        mesh.cuboid([-0.9, low, 0.2], [0.9, low + 3.5, 0.25], [3, 6, 1], 1);
    }
    for (name, diffuse, specular, gloss) in
        [("diffuse", 0.4, 0.0, None), ("mirrors", 0.1, 0.5, None), ("gloss", 0.1, 0.3, Some(10.0))]
    {
        let gloss = gloss.map(|axis_ratio| Gloss { axis_ratio, rays: None });
        let material =
            |diffuse, specular, gloss| MaterialInput { diffuse, specular, emission: &[0.0], gloss };
        let (diffuse, specular) = ([diffuse], [specular]);
        let materials = [material(&[0.5], &[0.0], None), material(&diffuse, &specular, gloss)];
        let input = SceneInput {
            vertices: &mesh.vertices,
            facets: &mesh.facets,
            facet_materials: &mesh.materials,
            normals: &[],
            facet_normals: &[],
            materials: &materials,
            two_sided: false,
            bands: 1,
        };
        run(name, &input, suns);
    }
}

fn run(name: &str, input: &SceneInput<'_>, suns: usize) {
    let (host, mut memory) = (Host::new(2).unwrap(), GeometryMemory::default());
    let settings = Settings { tolerance: 1e-2, ..Settings::default() };
    let geometry = host.geometry(&mut memory, input, &settings).unwrap();
    let light = |number: usize| {
        // evenly over the sphere: by the golden angle
        let (height, turn) = (1.0 - (2 * number + 1) as f64 / suns as f64, 0.381_966 * TAU * number as f64);
        let radius = (1.0 - height * height).sqrt();
        let direction = [radius * turn.cos(), radius * turn.sin(), height];
        let sun = SunInput { direction, irradiance: &[3.0], half_angle_deg: 0.2665 };
        LightInput { sun: Some(sun), ..LightInput::default() }
    };
    let lights: Vec<LightInput<'_>> = (0..suns).map(light).collect();
    let views = [Vec3::new(0.3, -0.5, -0.8)];
    let start = processor_seconds();
    host.lights(&geometry, &lights, Wanted { facets: true, views: &views }).unwrap();
    let all = processor_seconds() - start;
    let some = &lights[..suns / 10];
    let start = processor_seconds();
    for light in some {
        let lit = host.light_of(&geometry, light).unwrap();
        host.signatures(&lit, &views).unwrap();
    }
    let plain = processor_seconds() - start;
    let start = processor_seconds();
    for light in some {
        host.explain(&geometry, light, &views).unwrap();
    }
    let explained = processor_seconds() - start;
    println!(
        "{name}: {} facets, {suns} suns with signatures {all:.2} s; derivatives by all facets cost {:.2} of a light and its signature",
        input.facets.len(),
        (explained - plain) / plain,
    );
}
