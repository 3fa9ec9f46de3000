//! What is in a mesh file, as a scene file to start from.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

use glam::DVec3;

use crate::failure::Outcome;
use crate::mesh_file::{self, Finish, Mesh};
use crate::scene_file::table;

/// Values of a material that the file says nothing of.
const UNKNOWN: Finish = Finish { diffuse: [0.4; 3], specular: [0.0; 3], emission: [0.0; 3] };

/// The list of the mesh file at `path`: comments and keys of a scene file.
pub fn write(path: &Path) -> Outcome<String> {
    let mesh = mesh_file::read(path)?;
    let (finishes, mut warnings) = mesh_file::libraries(path, &mesh);
    let mut text = String::new();
    let all: Vec<String> = mesh.warnings.lines().chain(std::mem::take(&mut warnings).lines()).collect();
    // Writing to a string does not fail.
    let _ = list(path, &mesh, &finishes, &all, &mut text);
    Ok(text)
}

fn list(
    path: &Path,
    mesh: &Mesh,
    finishes: &std::collections::BTreeMap<String, Finish>,
    warnings: &[String],
    to: &mut String,
) -> std::fmt::Result {
    let (low, high) = mesh.bounds();
    let size: DVec3 = DVec3::from(high) - DVec3::from(low);
    writeln!(
        to,
        "# {}: {} facets, {} materials",
        path.display(),
        mesh.facets.len(),
        mesh.material_names.len()
    )?;
    writeln!(to, "# between {low:?} and {high:?}: {} x {} x {}", size.x, size.y, size.z)?;
    let degenerate = (0..mesh.facets.len()).filter(|i| area(mesh, *i) == 0.0).count();
    if degenerate > 0 {
        writeln!(to, "# {degenerate} facets without area")?;
    }
    surface(mesh, to)?;
    let normals = match (&mesh.normal_fault, mesh.has_normals()) {
        (Some(fault), _) => format!("vertex normals that smooth = true would refuse: {fault}"),
        (None, true) => "vertex normals: smooth = true can use them".into(),
        (None, false) => "no vertex normals".into(),
    };
    writeln!(to, "# {normals}")?;
    for name in &mesh.libraries {
        writeln!(to, "# material library {name}")?;
    }
    for warning in warnings {
        writeln!(to, "# warning: {warning}")?;
    }
    let of: Vec<&Finish> =
        mesh.material_names.iter().map(|name| finishes.get(name).unwrap_or(&UNKNOWN)).collect();
    let colour = |values: &[f64; 3]| values[1..].iter().any(|x| *x != values[0]);
    let bands =
        if of.iter().any(|f| [&f.diffuse, &f.specular, &f.emission].into_iter().any(colour)) { 3 } else { 1 };
    writeln!(to, "\nbands = {bands}\n\n[mesh]\nfile = {}", quoted(&absolute(path)))?;
    if !mesh.double_sided.is_empty() {
        writeln!(to, "two_sided = true    # as the file has it for some of its materials")?;
    }
    for (index, (name, finish)) in mesh.material_names.iter().zip(of).enumerate() {
        material(mesh, index, name, finish, bands, finishes.contains_key(name), to)?;
    }
    scene(low, size, to)
}

/// Edges and fronts, corners of equal coordinates taken as one.
fn surface(mesh: &Mesh, to: &mut String) -> std::fmt::Result {
    let surface = Surface::new(mesh);
    writeln!(
        to,
        "# open edges: {}; edges of more than two facets: {}; edges where fronts and backs meet: {}",
        surface.open, surface.crowded, surface.turned
    )?;
    for (name, bodies) in [("outward", &surface.outward), ("inward, as of a room", &surface.inward)] {
        if *bodies > 0 {
            writeln!(to, "# closed bodies whose fronts look {name}: {bodies}")?;
        }
    }
    if surface.sheets > 0 {
        writeln!(to, "# open sheets: {} (their backs are black without two_sided = true)", surface.sheets)?;
    }
    Ok(())
}

/// How facets hang together.
#[derive(Default)]
struct Surface {
    open: usize,
    crowded: usize,
    turned: usize,
    outward: usize,
    inward: usize,
    sheets: usize,
}

impl Surface {
    fn new(mesh: &Mesh) -> Self {
        let mut places: HashMap<[u64; 3], u32> = HashMap::new();
        // + 0.0 makes one of the two zeros.
        let key = |v: [f64; 3]| v.map(|x| (x + 0.0).to_bits());
        let place: Vec<u32> = mesh
            .vertices
            .iter()
            .map(|v| {
                let next = places.len() as u32;
                *places.entry(key(*v)).or_insert(next)
            })
            .collect();
        let mut edges: HashMap<[u32; 2], Vec<(u32, bool)>> = HashMap::new();
        for (index, facet) in mesh.facets.iter().enumerate().filter(|(i, _)| area(mesh, *i) > 0.0) {
            let corners = facet.map(|i| place[i as usize]);
            for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])) {
                edges.entry([a.min(b), a.max(b)]).or_default().push((index as u32, a < b));
            }
        }
        let mut surface = Surface::default();
        let mut bodies = Bodies((0..mesh.facets.len() as u32).collect());
        let mut leaky = vec![false; mesh.facets.len()];
        for users in edges.values() {
            surface.open += usize::from(users.len() == 1);
            surface.crowded += usize::from(users.len() > 2);
            let forth = users.iter().filter(|(_, forward)| *forward).count();
            let closed = 2 * forth == users.len();
            surface.turned += usize::from(users.len() == 2 && !closed);
            for (facet, _) in users {
                bodies.join(users[0].0, *facet);
                leaky[*facet as usize] |= !closed;
            }
        }
        surface.count(mesh, &mut bodies, &leaky);
        surface
    }

    /// Tells closed bodies, by the sign of their volumes, from sheets.
    fn count(&mut self, mesh: &Mesh, bodies: &mut Bodies, leaky: &[bool]) {
        let origin = DVec3::from(mesh.vertices[mesh.facets[0][0] as usize]);
        let mut volumes: HashMap<u32, (f64, bool)> = HashMap::new();
        for (index, facet) in mesh.facets.iter().enumerate().filter(|(i, _)| area(mesh, *i) > 0.0) {
            let [a, b, c] = facet.map(|i| DVec3::from(mesh.vertices[i as usize]) - origin);
            let body = volumes.entry(bodies.root(index as u32)).or_default();
            body.0 += a.cross(b).dot(c);
            body.1 |= leaky[index];
        }
        for (volume, open) in volumes.into_values() {
            match (open, volume > 0.0) {
                (true, _) => self.sheets += 1,
                (false, true) => self.outward += 1,
                (false, false) => self.inward += 1,
            }
        }
    }
}

/// Facets that hang together: each points to another of its body, the last to itself.
struct Bodies(Vec<u32>);

impl Bodies {
    fn root(&mut self, mut facet: u32) -> u32 {
        while self.0[facet as usize] != facet {
            let next = self.0[self.0[facet as usize] as usize];
            self.0[facet as usize] = next;
            facet = next;
        }
        facet
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

fn area(mesh: &Mesh, facet: usize) -> f64 {
    let [a, b, c] = mesh.facets[facet].map(|i| DVec3::from(mesh.vertices[i as usize]));
    (b - a).cross(c - a).length() / 2.0
}

fn material(
    mesh: &Mesh,
    index: usize,
    name: &str,
    finish: &Finish,
    bands: usize,
    known: bool,
    to: &mut String,
) -> std::fmt::Result {
    let facets: Vec<usize> =
        (0..mesh.facets.len()).filter(|i| mesh.facet_materials[*i] as usize == index).collect();
    let total: f64 = facets.iter().map(|i| area(mesh, *i)).sum();
    writeln!(
        to,
        "\n# {} facets, area {total}{}",
        facets.len(),
        if known { "" } else { "; the file says no more" }
    )?;
    writeln!(to, "[{}]", table(name))?;
    // Drawing programs let the sum exceed 1.
    let sums: Vec<f64> = finish.diffuse.iter().zip(finish.specular).map(|(d, s)| (d + s).max(1.0)).collect();
    let shared = |values: &[f64; 3]| [0, 1, 2].map(|i| values[i] / sums[i]);
    if sums.iter().any(|sum| *sum > 1.0) {
        writeln!(to, "# scaled, so that diffuse + specular is at most 1")?;
    }
    writeln!(to, "diffuse = {}", spectrum(shared(&finish.diffuse), bands))?;
    for (key, values) in [("specular", shared(&finish.specular)), ("emission", finish.emission)] {
        if values != [0.0; 3] {
            writeln!(to, "{key} = {}", spectrum(values, bands))?;
        }
    }
    Ok(())
}

/// One number for all bands, or one for each.
fn spectrum(values: [f64; 3], bands: usize) -> String {
    // Rounded down, so that sums of two stay within 1.
    let [r, g, b] = values.map(|x| (x * 1e6).floor() / 1e6);
    if bands == 1 || (r == g && g == b) { r.to_string() } else { format!("[{r}, {g}, {b}]") }
}

/// A sky and a camera that sees all of the mesh.
fn scene(low: [f64; 3], size: DVec3, to: &mut String) -> std::fmt::Result {
    let centre = DVec3::from(low) + size / 2.0;
    let length = size.length().max(f64::MIN_POSITIVE);
    let eye = centre + length * DVec3::new(1.0, -1.0, 0.6);
    writeln!(to, "\n[sky]\nmodel = \"uniform\"\n\n[camera]\nkind = \"orthographic\"")?;
    writeln!(to, "eye = {:?}\ntarget = {:?}\nup = [0, 0, 1]", eye.to_array(), centre.to_array())?;
    writeln!(to, "height = {length:?}\nresolution = [512, 512]")
}

/// The path from anywhere, for the scene file may be put anywhere.
fn absolute(path: &Path) -> String {
    let real = std::fs::canonicalize(path).unwrap_or(path.to_owned());
    real.display().to_string()
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
