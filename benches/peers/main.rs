//! Blik's side of the comparison with other programs: does what it is told on standard input, line by line, and answers
//! each line with one line of JSON. `benches/peers/run` starts it; see the page beside this file.

#[path = "../../tests/support/drawn/mod.rs"]
mod drawn;
mod generated;
#[path = "../../tests/support/judge/mod.rs"]
mod judge;
#[path = "../../tests/support/kernel.rs"]
mod kernel;
#[path = "../time_error/processor.rs"]
mod processor;
mod rays;
#[path = "../../tests/support/mod.rs"]
mod support;

use blik_kernel::camera::CameraInput;
use blik_kernel::form_factor::{Polygons, exchange_area};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Image, Lit, Rounds, Settings};
use blik_kernel::math::Vec3;
use blik_kernel::simd::Isa;
use blik_kernel::sky::{SkyInput, SkyModel};
use blik_kernel::sun::SunInput;
use processor::processor_seconds;
use serde_json::{Value, json};
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use support::{scene_file, scenes, twin};

/// Threads of both sides.
const THREADS: usize = 2;

type Answer = Result<Value, Box<dyn Error>>;

fn main() -> Result<(), Box<dyn Error>> {
    let host = Host::new(THREADS)?;
    let mut loaded = None;
    for line in std::io::stdin().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match (words.as_slice(), &loaded) {
            (["open", path], _) => {
                loaded = Some(Loaded::new(Path::new(path)));
                Ok(json!({}))
            }
            (["cold", tolerance, out], Some(scene)) => cold(&host, scene, tolerance.parse()?, Path::new(out)),
            (["again", tolerance, runs], Some(scene)) => {
                again(&host, scene, tolerance.parse()?, runs.parse()?)
            }
            (["rays", kind, folder], Some(scene)) => rays::measure(scene, kind, Path::new(folder)),
            (["kinds"], _) => Ok(json!(generated::KINDS.map(|(name, _)| name))),
            (["draw", kind, seed, folder], _) => draw(kind, seed.parse()?, Path::new(folder)),
            (["truth", goal, rays, out], Some(scene)) => {
                generated::truth(&scene.scene, &scene.camera, goal.parse()?, rays.parse()?, Path::new(out))
            }
            (["factors", quads, runs], _) => factors(quads.parse()?, runs.parse()?),
            _ => Err(format!("not understood: {line}").into()),
        };
        println!("{}", answer.unwrap_or_else(|error| json!({ "error": error.to_string() })));
    }
    Ok(())
}

/// Writes a generated scene of a kind; its name.
fn draw(kind: &str, seed: usize, folder: &Path) -> Answer {
    let name = format!("{kind}_{seed}");
    generated::write(&generated::Generated::named(kind, seed).ok_or("no such kind")?, folder, &name)?;
    Ok(json!({ "name": name }))
}

/// A scene file, read.
struct Loaded {
    scene: twin::Scene,
    view: scene_file::Camera,
    camera: CameraInput,
    soup: kernel::Soup,
    table: Vec<f32>,
    reference: Option<Vec<f64>>,
}

impl Loaded {
    fn new(path: &Path) -> Loaded {
        let (scene, view, extra) = scene_file::read_all(path);
        let table = scene.sky.as_ref().map_or(Vec::new(), kernel::table);
        let soup = kernel::Soup::indexed(&extra.mesh, &extra.materials, scene.two_sided);
        let (camera, reference) = (kernel::camera(&view), extra.reference_radiance);
        Loaded { soup, camera, view, scene, table, reference }
    }

    fn settings(&self, tolerance: f64) -> Settings {
        // of a uniform sky and of none no directions are asked for
        let uniform = |sky: &twin::Sky| matches!(sky.model, twin::Model::Uniform);
        let directional = self.scene.sky.as_ref().is_some_and(|sky| !uniform(sky));
        Settings { tolerance, directional, reference_radiance: self.reference.clone(), ..Settings::default() }
    }

    fn geometry<'m>(
        &self,
        host: &Host,
        settings: &Settings,
        memory: &'m mut GeometryMemory,
    ) -> Result<Geometry<'m>, Box<dyn Error>> {
        Ok(self.soup.with_input(|input| host.geometry(memory, input, settings))?)
    }

    fn light<'g>(&'g self, host: &Host, geometry: &'g Geometry<'g>) -> Result<Lit<'g>, Box<dyn Error>> {
        let sky = self.scene.sky.as_ref().map(|sky| kernel::sky_input(sky, &self.table));
        let sun = self.scene.sun.as_ref().map(kernel::sun_input);
        Ok(host.light(geometry, sky.as_ref(), sun.as_ref())?)
    }
}

/// Seconds of `work` and what it gives.
fn timed<R>(work: impl FnOnce() -> R) -> (f64, R) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

/// Median seconds of `runs` runs.
fn median(runs: usize, mut work: impl FnMut() -> Result<(), Box<dyn Error>>) -> Result<f64, Box<dyn Error>> {
    let mut seconds = Vec::new();
    for _ in 0..runs.max(1) {
        let (time, result) = timed(&mut work);
        result?;
        seconds.push(time);
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[seconds.len() / 2])
}

/// From the arrays to the image, with everything; writes the pixels (f32, little-endian).
fn cold(host: &Host, scene: &Loaded, tolerance: f64, out: &Path) -> Answer {
    let before = processor_seconds();
    let (seconds, image) = timed(|| -> Result<Image, Box<dyn Error>> {
        let (mut memory, mut rounds) = (GeometryMemory::default(), Rounds::new(tolerance));
        loop {
            let settings = rounds.settings(scene.settings(tolerance));
            let geometry = scene.geometry(host, &settings, &mut memory)?;
            let lit = scene.light(host, &geometry)?;
            if let Some(look) = host.look(&lit, &scene.camera)?
                && rounds.at_once(&look)
            {
                continue;
            }
            let mut image = host.image(&lit, &scene.camera, false)?;
            if !rounds.again(&mut image.report) {
                return Ok(image);
            }
        }
    });
    let (image, processor) = (image?, processor_seconds() - before);
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_le_bytes()).collect();
    std::fs::write(out, bytes)?;
    let (report, b) = (&image.report, image.report.bytes);
    Ok(json!({
        "seconds": seconds, "processor": processor,
        "estimate": report.error_estimate, "met": report.tolerance_met,
        "bytes": b.scene + b.bvh + b.coupling + b.light + b.image,
        "rounds": report.rounds, "elements": report.elements, "geometry_seconds": report.seconds.coupling,
        "light_seconds": report.seconds.light + report.seconds.radiosity, "image_seconds": report.seconds.image,
        "row_rays": report.rays.visibility, "image_rays": report.rays.chain,
    }))
}

/// What a solved scene costs again: an image from elsewhere, larger ones, new light, a light curve.
fn again(host: &Host, scene: &Loaded, tolerance: f64, runs: usize) -> Answer {
    let (mut memory, mut directed) = (GeometryMemory::default(), GeometryMemory::default());
    let plain = scene.geometry(host, &scene.settings(tolerance), &mut memory)?;
    let lit = scene.light(host, &plain)?;
    let [e, t] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
    let across = (t - e).cross(scene.camera.up.into()).normalize() * 0.1 * (t - e).length();
    let turned = CameraInput { eye: (e + across).to_array(), ..scene.camera };
    let large = CameraInput { columns: 512, rows: 512, ..turned };
    let view =
        |camera: &CameraInput| median(runs, || host.image(&lit, camera, false).map(drop).map_err(Into::into));
    let direction = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / 1000.0;
        Vec3::new(angle.cos(), angle.sin(), -0.7)
    };
    let directions: Vec<Vec3> = (0..1000).map(direction).collect();
    let curve = || host.signatures(&lit, &directions).map(drop).map_err(Into::into);
    let all = Settings { all_irradiances: true, directional: true, ..scene.settings(tolerance) };
    let geometry = scene.geometry(host, &all, &mut directed)?;
    let sky = |model| SkyInput { model, radiance: &[1.0], ground: &[0.1], up: [0.0, 0.0, 1.0] };
    let sun = SunInput { direction: [0.5, 0.8, 0.9], irradiance: &[2.0], half_angle_deg: 0.2665 };
    let relit = |model, sun| {
        median(runs, || host.light(&geometry, Some(&sky(model)), sun).map(drop).map_err(Into::into))
    };
    Ok(json!({
        "new_view": view(&turned)?, "new_view_512": view(&large)?, "light_curve": median(1, curve)?,
        "new_sky": relit(SkyModel::Overcast, None)?, "new_sun": relit(SkyModel::Overcast, Some(&sun))?,
        "stored_bytes": geometry.report().bytes.coupling,
    }))
}

/// Copies what is above a square matrix's diagonal below it, in tiles that the cache holds.
fn mirror(matrix: &mut [f64], size: usize) {
    const TILE: usize = 32;
    for top in (0..size).step_by(TILE) {
        for left in (0..=top).step_by(TILE) {
            for i in top..(top + TILE).min(size) {
                for j in left..(left + TILE).min(i) {
                    matrix[i * size + j] = matrix[j * size + i];
                }
            }
        }
    }
}

/// Form factors of all pairs of a corner's quads on one thread; the worst row against the same quad's factors to the
/// whole walls.
fn factors(quads: usize, runs: usize) -> Answer {
    let n = ((quads / 3) as f64).sqrt().round() as usize;
    let mesh = scenes::corner(n);
    let quad = |q: usize| -> [Vec3; 4] {
        let [[a, b, c], [_, _, d]] = [mesh.facets[2 * q], mesh.facets[2 * q + 1]];
        [a, b, c, d].map(|v| Vec3::from(mesh.vertices[v as usize]))
    };
    let quads: Vec<[Vec3; 4]> = (0..mesh.facets.len() / 2).map(quad).collect();
    let (count, wall) = (quads.len(), n * n);
    let mut sums = vec![0.0; count];
    let before = processor_seconds();
    let seconds = median(runs, || {
        let mut memory = vec![0; Polygons::bytes(&quads)?];
        let polygons = Polygons::new(Isa::detect(), &quads, &mut memory)?;
        let mut factors = vec![0.0; count * count];
        for (i, row) in factors.chunks_exact_mut(count).enumerate() {
            let row = &mut row[i + 1..];
            polygons.exchange_areas(i, i + 1..count, row)?;
            // all areas are the same, 1/n^2
            row.iter_mut().for_each(|area| *area *= wall as f64);
        }
        mirror(&mut factors, count);
        for (sum, row) in sums.iter_mut().zip(factors.chunks_exact(count)) {
            *sum = row.iter().sum();
        }
        Ok(())
    })?;
    let processor = (processor_seconds() - before) / runs.max(1) as f64;
    let whole = scenes::corner(1);
    let walls: Vec<[Vec3; 3]> =
        (0..6).map(|f| whole.corners(f).map(|c| Vec3::from_array(c.to_array()))).collect();
    let truth = |q: &[Vec3; 4]| walls.iter().map(|w| exchange_area(q, w)).sum::<f64>() * wall as f64;
    let defect = quads.iter().zip(&sums).map(|(q, sum)| (sum - truth(q)).abs()).fold(0.0, f64::max);
    Ok(json!({ "seconds": seconds, "processor": processor, "row_defect": defect, "row_sums": sums }))
}
