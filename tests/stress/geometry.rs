//! Meshes as simulators hand them over: slivers, duplicates, cracks, contacts, thin sheets, and all sizes in one scene.

use crate::support::scenes::{self, Mesh};
use crate::support::twin::Rng;
use glam::{DVec3, dvec3};

/// A mesh of materials 0 to 2, and whether both of its sides carry them.
pub type Shape = (Mesh, bool);

/// Makes the mesh of a severity from 1 (mild) on.
pub type Maker = fn(usize, &mut Rng) -> Shape;

/// The families: name, what the severity s stands for, how many there are, the mesh.
pub const FAMILIES: [(&str, &str, usize, Maker); 13] = [
    ("needles", "width 1e-s", 12, needles),
    ("slivers", "off an edge by 1e-s", 12, slivers),
    ("degenerate and duplicate facets", "s of each", 6, degenerate),
    ("coplanar overlaps", "lifted by 1e-s", 12, overlap),
    ("T-junctions", "s to s + 1 facets", 6, junctions),
    ("cracks", "width 1e-s", 10, cracks),
    ("interpenetration", "s bodies", 8, interpenetration),
    ("non-manifold edges", "s + 2 sheets", 6, star),
    ("inconsistent winding", "each s-th facet", 6, winding),
    ("thin sheets", "gap 1e-s", 12, sheets),
    ("contact at edges and corners", "gap 1e-s", 12, touching),
    ("gaps between large facets", "gap 1e-s", 8, gaps),
    ("sizes in one scene", "1 to 1e-s", 6, sizes),
];

fn small(severity: usize) -> f64 {
    10f64.powi(-(severity as i32))
}

fn block(size: DVec3, at: DVec3, turn: f64, material: u32) -> Mesh {
    let body = scenes::cube_outside().mapped(|v| (v - dvec3(0.5, 0.5, 0.0)) * size);
    body.rotated([0.0, 0.0, 1.0], turn).translated(at.to_array()).of_material(material)
}

/// A floor of n x n squares.
fn floor(n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-1.5, -1.5, 0.0), DVec3::X * 3.0, DVec3::Y * 3.0, n, 0);
    mesh
}

/// Two blocks that stand beside each other.
fn blocks(rng: &mut Rng) -> Mesh {
    let first = block(dvec3(0.7, 0.5, 0.9), dvec3(-0.4, 0.3, 0.0), rng.unit(), 1);
    first.joined(&block(dvec3(0.4, 0.8, 0.4), dvec3(0.5, -0.3, 0.0), rng.unit(), 2))
}

fn needles(s: usize, rng: &mut Rng) -> Shape {
    let (width, middle) = (small(s), rng.unit() - 0.5);
    let mut mesh = Mesh::default();
    for (low, high) in [(-1.5, middle), (middle, middle + width), (middle + width, 1.5)] {
        mesh.rectangle(dvec3(low, -1.5, 0.0), DVec3::X * (high - low), DVec3::Y * 3.0, 2, 0);
    }
    (mesh.joined(&blocks(rng)), false)
}

/// Every facet cut into three at a point so near to one of its edges.
fn slivers(s: usize, rng: &mut Rng) -> Shape {
    let whole = floor(1).joined(&blocks(rng));
    let mut mesh = Mesh { vertices: whole.vertices.clone(), ..Mesh::default() };
    for (f, &[a, b, c]) in whole.facets.iter().enumerate() {
        let [p, q, r] = whole.corners(f);
        let new = mesh.vertices.len() as u32;
        mesh.vertices.push((p * 0.4 + q * (0.6 - small(s)) + r * small(s)).to_array());
        mesh.facets.extend([[a, b, new], [b, c, new], [c, a, new]]);
        mesh.materials.extend([whole.materials[f]; 3]);
    }
    (mesh, false)
}

fn degenerate(s: usize, rng: &mut Rng) -> Shape {
    let mut mesh = floor(2).joined(&blocks(rng));
    let count = mesh.facets.len();
    for k in 0..s {
        let from = (rng.bits() as usize) % count;
        let [a, b, c] = mesh.facets[from];
        // a point, a line, a line through three different points, and the facet again
        mesh.facets.extend([[a, a, a], [a, b, a], [a, b, b]]);
        let middle = (mesh.corners(from)[0] + mesh.corners(from)[1]) * 0.5;
        mesh.vertices.push(middle.to_array());
        mesh.facets.push([a, mesh.vertices.len() as u32 - 1, b]);
        mesh.facets.push(if k % 2 == 0 { [a, b, c] } else { [b, c, a] });
        mesh.materials.extend([mesh.materials[from]; 5]);
    }
    (mesh, false)
}

fn overlap(s: usize, rng: &mut Rng) -> Shape {
    let patch = floor(1).scaled(0.6).rotated([0.0, 0.0, 1.0], rng.unit());
    // the last ones in the same plane exactly
    let lift = if s > 10 { 0.0 } else { small(s) };
    (floor(2).joined(&patch.translated([0.1, 0.2, lift])).joined(&blocks(rng)), false)
}

fn junctions(s: usize, rng: &mut Rng) -> Shape {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-1.5, -1.5, 0.0), DVec3::X * 1.5, DVec3::Y * 3.0, s, 0);
    mesh.rectangle(dvec3(0.0, -1.5, 0.0), DVec3::X * 1.5, DVec3::Y * 3.0, s + 1, 0);
    let turn = rng.unit();
    (mesh.joined(&blocks(rng)).rotated([0.3, 0.2, 1.0], 0.1 * turn), false)
}

/// An open box whose walls stand off one another.
fn cracks(s: usize, rng: &mut Rng) -> Shape {
    let (x, y, z, w) = (DVec3::X, DVec3::Y, DVec3::Z, small(s));
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-0.5, -0.5, 0.0), x, y, 1, 0);
    mesh.rectangle(dvec3(-0.5 - w, -0.5, w), y, z, 1, 1);
    mesh.rectangle(dvec3(0.5 + w, -0.5, w), z, y, 1, 1);
    mesh.rectangle(dvec3(-0.5, -0.5 - w, w), z, x, 1, 2);
    mesh.rectangle(dvec3(-0.5, 0.5 + w, w), x, z, 1, 1);
    (mesh.rotated([0.0, 0.1, 1.0], 0.3 * rng.unit()), false)
}

fn interpenetration(s: usize, rng: &mut Rng) -> Shape {
    let mut mesh = floor(2);
    for k in 0..s {
        let at = dvec3(rng.unit() - 0.5, rng.unit() - 0.5, 0.6 * rng.unit() - 0.3);
        let axis = [rng.unit() - 0.5, rng.unit() - 0.5, 0.3];
        let body = block(dvec3(0.8, 0.5, 0.6), DVec3::ZERO, 0.0, k as u32 % 3);
        mesh = mesh.joined(&body.rotated(axis, 3.0 * rng.unit()).translated(at.to_array()));
    }
    (mesh, false)
}

fn star(s: usize, rng: &mut Rng) -> Shape {
    let mut mesh = floor(2);
    for k in 0..s + 2 {
        let angle = 6.0 * (k as f64 + 0.5 * rng.unit()) / (s as f64 + 2.0);
        let along = dvec3(angle.cos(), angle.sin(), 0.0);
        mesh.rectangle(DVec3::ZERO, along, DVec3::Z * 0.8, 1, k as u32 % 3);
    }
    (mesh, true)
}

fn winding(s: usize, rng: &mut Rng) -> Shape {
    let mut mesh = floor(2).joined(&blocks(rng));
    mesh.facets.iter_mut().step_by(s).for_each(|f| f.swap(1, 2));
    (mesh, true)
}

/// A slab of two sheets back to back, above the floor.
fn sheets(s: usize, rng: &mut Rng) -> Shape {
    let mut slab = Mesh::default();
    slab.rectangle(dvec3(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y, 1, 1);
    slab.rectangle(dvec3(-0.5, -0.5, -small(s)), DVec3::Y, DVec3::X, 1, 2);
    let slab = slab.rotated([1.0, 0.4, 0.0], 0.5 + 0.5 * rng.unit()).translated([0.0, 0.0, 0.7]);
    (floor(2).joined(&slab), s.is_multiple_of(2))
}

/// Blocks that meet at an edge and at a corner, or nearly.
fn touching(s: usize, rng: &mut Rng) -> Shape {
    let gap = if s > 10 { 0.0 } else { small(s) };
    let size = DVec3::splat(0.6);
    let mut mesh = block(size, dvec3(-0.3 - gap, -0.3 - gap, 0.0), 0.0, 1);
    mesh = mesh.joined(&block(size, dvec3(0.3, 0.3, 0.0), 0.0, 2));
    mesh = mesh.joined(&block(size, dvec3(-0.3 - gap, 0.3, 0.6 + gap), 0.0, 1));
    (floor(2).joined(&mesh.rotated([0.0, 0.0, 1.0], rng.unit())), false)
}

/// Plates that face each other, close, on the floor's middle.
fn gaps(s: usize, rng: &mut Rng) -> Shape {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-0.6, 0.0, 0.0), DVec3::X * 1.2, DVec3::Z * 0.8, 1, 1);
    mesh.rectangle(dvec3(-0.6, -small(s), 0.0), DVec3::X * 1.2, DVec3::Z * 0.8, 1, 2);
    (floor(2).joined(&mesh.rotated([0.0, 0.0, 1.0], rng.unit())), true)
}

fn sizes(s: usize, rng: &mut Rng) -> Shape {
    let tiny = blocks(rng).scaled(small(s));
    (floor(2).joined(&tiny).joined(&block(dvec3(0.5, 0.5, 0.5), dvec3(-0.8, -0.6, 0.0), 0.4, 1)), false)
}
