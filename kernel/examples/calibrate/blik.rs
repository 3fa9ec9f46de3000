//! What Blik makes of a case.

use super::case::Case;
use super::pixels::{self, Sampled};
use crate::kernel;
use crate::support::twin::Model;
use blik_kernel::Error;
use blik_kernel::host::{GeometryMemory, Host, Report, Rounds, Settings};
use blik_kernel::scene::{Gloss, MaterialInput, SceneInput};
use blik_kernel::sun::SunInput;
use std::time::Instant;

/// An image, what was reported of it, and what the facets' sides receive.
pub struct Outcome {
    /// Radiance, (row, column, band).
    pub pixels: Vec<f64>,
    /// Reference radiance per band.
    pub reference: Vec<f64>,
    /// Irradiance, (facet, side, band).
    pub irradiance: Vec<f64>,
    /// Share of each facet's area that its elements have.
    pub shares: Vec<f64>,
    /// The report.
    pub report: Report,
    /// From mesh to image.
    pub seconds: f64,
    /// What sampling the pixels' area alone brings, if asked for.
    pub sampled: Option<Sampled>,
}

/// Geometry, light and image of a case at `tolerance`, its pixels compared with `rays` rays through each.
pub fn run(case: &Case, tolerance: f64, rays: u32) -> Result<Outcome, Error> {
    let host = Host::new(0)?;
    let materials: Vec<MaterialInput<'_>> = case
        .materials
        .iter()
        .map(|m| MaterialInput {
            diffuse: &m.diffuse,
            specular: &m.specular,
            emission: &m.emission,
            gloss: m.gloss.map(|axis_ratio| Gloss { axis_ratio, rays: None }),
        })
        .collect();
    let input = SceneInput {
        vertices: &case.mesh.vertices,
        facets: &case.mesh.facets,
        facet_materials: &case.mesh.materials,
        normals: &[],
        facet_normals: &[],
        materials: &materials,
        two_sided: case.two_sided,
        bands: case.materials[0].diffuse.len(),
    };
    let table = case.sky.as_ref().map_or(Vec::new(), kernel::table);
    let sky = case.sky.as_ref().map(|sky| kernel::sky_input(sky, &table));
    let sun = case.sun.as_ref().map(|sun| SunInput {
        direction: sun.direction.to_array(),
        irradiance: &sun.irradiance,
        half_angle_deg: sun.half_angle.to_degrees(),
    });
    let start = Instant::now();
    let mut rounds = Rounds::new(tolerance);
    let mut memory = GeometryMemory::default();
    loop {
        let directional = case.sky.as_ref().is_some_and(|sky| !matches!(sky.model, Model::Uniform));
        let settings = rounds.settings(Settings { directional, ..Settings::default() });
        let geometry = host.geometry(&mut memory, &input, &settings)?;
        let lit = host.light(&geometry, sky.as_ref(), sun.as_ref())?;
        if let Some(look) = host.look(&lit, &case.camera)?
            && rounds.at_once(&look)
        {
            continue;
        }
        let mut image = host.image(&lit, &case.camera, false)?;
        if rounds.again(&mut image.report) {
            continue;
        }
        let seconds = start.elapsed().as_secs_f64();
        return Ok(Outcome {
            pixels: image.pixels.iter().map(|&p| f64::from(p)).collect(),
            reference: lit.reference().to_vec(),
            irradiance: kernel::irradiances(&lit),
            shares: (0..case.mesh.facets.len())
                .map(|f| {
                    geometry
                        .elements()
                        .unknowns_of(f, 0)
                        .map(|u| geometry.elements().share(u))
                        .fold(1.0, f64::min)
                })
                .collect(),
            report: image.report,
            seconds,
            sampled: (rays > 0).then(|| pixels::compare(&lit, &case.camera, rays)).transpose()?,
        });
    }
}
