//! Rays per second on one thread, on rays that are written out for the other program to trace.

use crate::{Answer, Loaded, median};
use blik_kernel::arena::Memory;
use blik_kernel::bvh::Bvh;
use blik_kernel::math::Vec3;
use blik_kernel::ray::Ray;
use blik_kernel::scene::Scene;
use blik_kernel::simd::Isa;
use serde_json::json;
use std::path::Path;

/// Rays of a measurement.
const RAYS: usize = 1 << 20;

/// Runs whose median counts.
const RUNS: usize = 5;

/// Traces rays of `kind`, "primary" (pixel centres, row by row) or "hemisphere" (from facets' centroids, facet by
/// facet, cosine-distributed), and writes mesh and rays as raw arrays into `folder`.
pub fn measure(loaded: &Loaded, kind: &str, folder: &Path) -> Answer {
    let corners = &loaded.scene.corners;
    let rays: Vec<[[f32; 3]; 2]> = if kind == "primary" { primary(loaded) } else { hemisphere(corners) };
    let floats =
        |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let vertices = &mut corners.iter().flatten().flat_map(|c| c.to_array().map(|x| x as f32));
    std::fs::write(folder.join("vertices.f32"), floats(vertices))?;
    std::fs::write(folder.join("rays.f32"), floats(&mut rays.iter().flatten().flatten().copied()))?;
    loaded.soup.with_input(|input| {
        let mut memory = Memory::new(Scene::bytes(input)?);
        let scene = Scene::new(input, memory.bytes_mut())?;
        let mut tree = Memory::new(Bvh::bytes(scene.facets())?);
        let build = |tree: &mut Memory| {
            let corners = scene.corners();
            Bvh::build_obvhs(corners, scene.areas(), Isa::detect(), tree.bytes_mut()).map(|_| ())
        };
        let seconds = median(3, || Ok(build(&mut tree)?))?;
        let bvh = Bvh::build_obvhs(scene.corners(), scene.areas(), Isa::detect(), tree.bytes_mut())?;
        let own = |[o, d]: &[[f32; 3]; 2]| {
            let [o, d] = [o, d].map(|v| Vec3::from_array(v.map(f64::from)));
            Ray::new(scene.to_scene(o), d.normalize())
        };
        let rays: Vec<Ray> = rays.iter().map(own).collect();
        let (mut hits, mut blocked) = (0, 0);
        let closest = median(RUNS, || {
            hits = rays.iter().filter(|ray| bvh.closest(ray).is_some()).count();
            Ok(())
        })?;
        let any = median(RUNS, || {
            blocked = rays.iter().filter(|ray| bvh.occluded(ray)).count();
            Ok(())
        })?;
        let rate = |seconds: f64| rays.len() as f64 * 1e-6 / seconds;
        Ok(json!({ "build": seconds, "closest": rate(closest), "any": rate(any), "hits": hits, "blocked": blocked }))
    })
}

/// The camera's rays, as often as it takes.
fn primary(loaded: &Loaded) -> Vec<[[f32; 3]; 2]> {
    let camera = &loaded.view;
    let [columns, rows] = camera.resolution;
    let all = (0..columns * rows).map(|i| {
        let (o, d) = camera.ray(i / columns, i % columns);
        [o, d].map(|v| v.to_array().map(|x| x as f32))
    });
    let once: Vec<_> = all.collect();
    once.iter().copied().cycle().take(RAYS).collect()
}

/// Rays from the centroids of facets, a ten-thousandth of the scene's size off them.
fn hemisphere(corners: &[[glam::DVec3; 3]]) -> Vec<[[f32; 3]; 2]> {
    let extent = corners.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs().max_element()));
    let each = RAYS.div_ceil(corners.len());
    let of = |(facet, [a, b, c]): (usize, &[glam::DVec3; 3])| {
        let normal = (*b - *a).cross(*c - *a).normalize_or_zero();
        let origin = (*a + *b + *c) / 3.0 + normal * (1e-4 * extent);
        (0..each).map(move |i| {
            // a spiral over the sphere about the normal's tip: a cosine distribution
            let n = (facet * each + i) as f64;
            let (z, angle) = (1.0 - 2.0 * ((n * 0.618_033_988_75) % 1.0), 2.399_963_2 * n);
            let r = (1.0 - z * z).sqrt();
            let direction = (normal + glam::DVec3::new(r * angle.cos(), r * angle.sin(), z)).normalize();
            [origin, direction].map(|v| v.to_array().map(|x| x as f32))
        })
    };
    corners
        .iter()
        .enumerate()
        .filter(|(_, c)| (c[1] - c[0]).cross(c[2] - c[0]).length() > 0.0)
        .flat_map(of)
        .collect()
}
