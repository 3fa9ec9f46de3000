//! The bodies of which the calibration's scenes are made. All stand about the origin; the material is 0.

use super::Draw;
use crate::support::scenes::{Mesh, cube_inside, cube_outside};
use glam::{DVec3, dvec3};
use std::f64::consts::TAU;

/// A closed box of 12 triangles about the origin.
pub fn cuboid(size: DVec3) -> Mesh {
    cube_outside().mapped(|v| (v - 0.5) * size)
}

/// A box seen from within, its floor at z = 0.
pub fn room(size: DVec3) -> Mesh {
    cube_inside().mapped(|v| (v - dvec3(0.5, 0.5, 0.0)) * size)
}

/// A horizontal rectangle at z = 0, front up, of n x n quads.
pub fn floor(width: f64, depth: f64, n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let (x, y) = (DVec3::X * width, DVec3::Y * depth);
    mesh.rectangle((x + y) / -2.0, x, y, n, 0);
    mesh
}

/// A room whose ceiling has a rectangular hole around its middle, (width, depth) `hole`; walls of n x n quads.
pub fn room_with_hole(size: DVec3, hole: [f64; 2], n: usize) -> Mesh {
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let o = dvec3(-size.x / 2.0, -size.y / 2.0, 0.0);
    let mut mesh = Mesh::default();
    mesh.rectangle(o, x, y, n, 0);
    mesh.rectangle(o, y, z, n, 0);
    mesh.rectangle(o + x, z, y, n, 0);
    mesh.rectangle(o, z, x, n, 0);
    mesh.rectangle(o + y, x, z, n, 0);
    let (side, end) = ((size.x - hole[0]) / 2.0, (size.y - hole[1]) / 2.0);
    let across = DVec3::X * hole[0];
    // fronts down: y before x
    mesh.rectangle(o + z, y, DVec3::X * side, n, 0);
    mesh.rectangle(o + z + x - DVec3::X * side, y, DVec3::X * side, n, 0);
    mesh.rectangle(o + z + DVec3::X * side, DVec3::Y * end, across, n, 0);
    mesh.rectangle(o + z + DVec3::X * side + y - DVec3::Y * end, DVec3::Y * end, across, n, 0);
    mesh
}

/// A body of revolution about z through (radius, z) from below to above, of k columns; rings of radius 0 are points.
pub fn revolved(profile: &[[f64; 2]], k: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |ring: usize, column: usize| (ring * k + column % k) as u32;
    for [radius, z] in profile {
        for column in 0..k {
            let (s, c) = (TAU * column as f64 / k as f64).sin_cos();
            mesh.vertices.push([radius * c, radius * s, *z]);
        }
    }
    for ring in 0..profile.len() - 1 {
        for column in 0..k {
            let [a, b] = [at(ring, column), at(ring, column + 1)];
            let [c, d] = [at(ring + 1, column + 1), at(ring + 1, column)];
            if profile[ring][0] > 0.0 {
                mesh.facets.push([a, b, c]);
            }
            if profile[ring + 1][0] > 0.0 {
                mesh.facets.push([a, c, d]);
            }
        }
    }
    mesh.materials = vec![0; mesh.facets.len()];
    mesh.welded()
}

/// A cylinder with caps, about z: strips as long as it is high, caps of triangles that meet in the middle.
pub fn cylinder(radius: f64, height: f64, k: usize) -> Mesh {
    let h = height / 2.0;
    revolved(&[[0.0, -h], [radius, -h], [radius, h], [0.0, h]], k)
}

/// A trough or bowl of flat facets over [-1, 1]^2, open upward: z = bend x^2 (+ bend y^2), n x n quads or n x 1.
pub fn dish(bend: f64, n: usize, bowl: bool) -> Mesh {
    let mut mesh = Mesh::default();
    if bowl {
        mesh.rectangle(dvec3(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, n, 0);
        return mesh.mapped(|v| dvec3(v.x, v.y, bend * (v.x * v.x + v.y * v.y)));
    }
    for i in 0..n {
        let [x0, x1] = [i, i + 1].map(|k| 2.0 * k as f64 / n as f64 - 1.0);
        let low = dvec3(x0, -1.0, bend * x0 * x0);
        mesh.rectangle(low, dvec3(x1 - x0, 0.0, bend * (x1 * x1 - x0 * x0)), DVec3::Y * 2.0, 1, 0);
    }
    mesh.welded()
}

/// Hills over [-1, 1]^2, front up.
pub fn terrain(draw: &mut Draw, n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, n, 0);
    let waves: Vec<(DVec3, f64)> = (0..4)
        .map(|_| {
            let wave = draw.direction(0.0, 0.0) * draw.real(2.0, 6.0);
            (dvec3(wave.x, wave.y, draw.real(0.0, TAU)), draw.real(0.03, 0.12))
        })
        .collect();
    let height = |v: DVec3| waves.iter().map(|(w, a)| a * (w.x * v.x + w.y * v.y + w.z).sin()).sum();
    mesh.mapped(|v| dvec3(v.x, v.y, height(v)))
}

/// Something like an aircraft about 2 long, nose along +x: a lofted body and flat boxes for wings and fins that are
/// pushed through it. Materials: 0 body, 1 wings.
pub fn craft(draw: &mut Draw) -> Mesh {
    let rings = draw.whole(5, 10);
    let (width, height) = (draw.real(0.12, 0.25), draw.real(0.1, 0.2));
    let nose = draw.real(0.6, 1.4);
    let mut profile = vec![[0.0, -1.0]];
    for i in 1..rings {
        let t = i as f64 / rings as f64;
        profile.push([(std::f64::consts::PI * t.powf(nose)).sin().powf(0.6).max(0.05), 2.0 * t - 1.0]);
    }
    profile.push([0.0, 1.0]);
    let columns = draw.whole(6, 14);
    // the axis z of revolution becomes x
    let body = revolved(&profile, columns).mapped(|v| dvec3(v.z, width * v.x, height * v.y));
    let span = draw.real(0.5, 1.0);
    let sweep = draw.real(0.0, 0.6);
    let chord = draw.real(0.2, 0.5);
    let at = draw.real(-0.3, 0.2);
    let taper = draw.real(0.3, 1.0);
    let wing = |side: f64, fin: bool| {
        let plate = cuboid(dvec3(1.0, 1.0, 1.0)).mapped(|v| {
            let out = v.y + 0.5;
            let c = chord * (1.0 - (1.0 - taper) * out) * if fin { 0.6 } else { 1.0 };
            let root = if fin { -0.75 } else { at };
            let x = root - sweep * out * span + c * v.x;
            let thin = 0.03 * v.z;
            if fin { dvec3(x, thin, 0.5 * span * out) } else { dvec3(x, side * span * out, thin) }
        });
        // a reflected box is inside out
        if side < 0.0 || fin { plate.flipped() } else { plate }.of_material(1)
    };
    let craft = body.joined(&wing(1.0, false)).joined(&wing(-1.0, false)).joined(&wing(1.0, true));
    if draw.chance(0.3) { craft.subdivided(1) } else { craft }
}

/// A thin sheet of two triangles, or one triangle, somewhere within 1 of the origin.
pub fn sheet(draw: &mut Draw) -> Mesh {
    let mut mesh = Mesh::default();
    let (a, b) = (draw.direction(-90.0, 90.0), draw.direction(-90.0, 90.0));
    let side = draw.scale(0.3, 1.0);
    let across = (b - a * a.dot(b)).normalize() * draw.scale(0.3, 1.0);
    mesh.rectangle(draw.point(-0.7, 0.7) - (a * side + across) / 2.0, a * side, across, 1, 0);
    if draw.chance(0.3) {
        mesh.facets.truncate(1);
        mesh.materials.truncate(1);
    }
    mesh
}
