//! A generated scene as files: NAME.toml, NAME.obj and, for a sky table, NAME_sky.npy.

use super::Generated;
use crate::judge::Judge;
use crate::support::scenes::Mesh;
use crate::support::twin::{Material, Model, Sky, Sun};
use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Projection};
use glam::DVec3;
use npyz::WriterBuilder;
use std::fmt::Write;
use std::io;
use std::path::Path;

/// Writes the files of `generated` into `folder`.
pub fn write(generated: &Generated, folder: &Path, name: &str) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join(format!("{name}.obj")), obj(&generated.mesh))?;
    let mut text = String::new();
    let Generated { materials, two_sided, sky, sun, camera, .. } = generated;
    let mut memory = Memory::default();
    let reference = Judge::new(&generated.scene(), &mut memory).reference();
    let bands = reference.len();
    let mut line = |words: std::fmt::Arguments<'_>| {
        text.write_fmt(words).expect("text grows");
        text.push('\n');
    };
    line(format_args!("tolerance = 2e-3\nbands = {bands}\nreference_radiance = {reference:?}"));
    line(format_args!("[mesh]\nfile = \"{name}.obj\"\ntwo_sided = {two_sided}"));
    for (index, Material { diffuse, specular, emission, gloss }) in materials.iter().enumerate() {
        line(format_args!("[material.m{index}]\ndiffuse = {diffuse:?}\nspecular = {specular:?}"));
        line(format_args!("emission = {emission:?}"));
        if let Some(axis_ratio) = gloss {
            line(format_args!("gloss = {{ axis_ratio = {axis_ratio:?} }}"));
        }
    }
    if let Some(sky) = sky {
        let entries = model(&sky.model, folder, name, bands)?;
        let Sky { radiance, ground, up, .. } = sky;
        line(format_args!("[sky]\n{entries}\nradiance = {radiance:?}\nground = {ground:?}"));
        line(format_args!("up = {:?}", up.to_array()));
    }
    if let Some(Sun { direction, irradiance, half_angle }) = sun {
        line(format_args!("[sun]\ndirection = {:?}", direction.to_array()));
        line(format_args!("irradiance = {irradiance:?}\nhalf_angle_deg = {:?}", half_angle.to_degrees()));
    }
    line(format_args!("{}", camera_entries(camera)));
    std::fs::write(folder.join(format!("{name}.toml")), text)
}

/// The sky's model; a table goes to a file of its own.
fn model(model: &Model, folder: &Path, name: &str, bands: usize) -> io::Result<String> {
    let plain = |word: &str| Ok(format!("model = \"{word}\""));
    let vector = |v: &DVec3| format!("{:?}", v.to_array());
    match model {
        Model::Uniform => plain("uniform"),
        Model::Hemisphere => plain("hemisphere"),
        Model::Overcast => plain("overcast"),
        Model::Gradient => plain("gradient"),
        Model::Cie { kind, sun } => {
            Ok(format!("model = \"cie\"\ntype = {kind}\nsun_direction = {}", vector(sun)))
        }
        Model::Table { rows, columns, values, azimuth_zero } => {
            let table = format!("{name}_sky.npy");
            let shape = [*rows as u64, *columns as u64, bands as u64];
            let values = values.iter().map(|&v| v as f32);
            npy(&folder.join(&table), &shape, values)?;
            Ok(format!("model = \"table\"\nfile = \"{table}\"\nazimuth_zero = {}", vector(azimuth_zero)))
        }
    }
}

fn camera_entries(camera: &CameraInput) -> String {
    let CameraInput { eye, target, up, columns, rows, .. } = camera;
    let projection = match camera.projection {
        Projection::Orthographic { height } => format!("kind = \"orthographic\"\nheight = {height:?}"),
        Projection::Perspective { fov_deg } => format!("kind = \"perspective\"\nfov_deg = {fov_deg:?}"),
    };
    format!(
        "[camera]\n{projection}\neye = {eye:?}\ntarget = {target:?}\nup = {up:?}\n\
         resolution = [{columns}, {rows}]\nsampling = \"centre\""
    )
}

fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for [x, y, z] in &mesh.vertices {
        writeln!(text, "v {x:?} {y:?} {z:?}").expect("text grows");
    }
    let mut last = None;
    for (facet, material) in mesh.facets.iter().zip(&mesh.materials) {
        if last.replace(material) != Some(material) {
            writeln!(text, "usemtl m{material}").expect("text grows");
        }
        let [a, b, c] = facet.map(|v| v + 1);
        writeln!(text, "f {a} {b} {c}").expect("text grows");
    }
    text
}

/// Writes an array of single-precision numbers.
pub fn npy(path: &Path, shape: &[u64], values: impl Iterator<Item = f32>) -> io::Result<()> {
    let file = io::BufWriter::new(std::fs::File::create(path)?);
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(file).begin_nd()?;
    writer.extend(values)?;
    writer.finish()
}
