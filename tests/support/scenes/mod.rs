//! Meshes of known geometry: bodies, enclosures, plates and mirrors, in f64, with exact corner coordinates.

mod mesh;

pub use mesh::{Mesh, read_obj};

use glam::DVec3;

/// The unit cube [0, 1]^3 of 12 triangles, fronts outward. Facets 2 k, 2 k + 1 are face k; faces in the order
/// floor (z = 0), ceiling, x = 0, x = 1, y = 0, y = 1. Material 0.
pub fn cube_outside() -> Mesh {
    cube_inside().flipped()
}

/// The same cube seen from within: fronts inward. Face k has material 0; see [`Mesh::with_materials`].
pub fn cube_inside() -> Mesh {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, x, y, 1, 0); // floor, front +z
    mesh.rectangle(z, y, x, 1, 0); // ceiling, front -z
    mesh.rectangle(DVec3::ZERO, y, z, 1, 0); // x = 0, front +x
    mesh.rectangle(x, z, y, 1, 0); // x = 1, front -x
    mesh.rectangle(DVec3::ZERO, z, x, 1, 0); // y = 0, front +y
    mesh.rectangle(y, x, z, 1, 0); // y = 1, front -y
    mesh.welded()
}

/// A box without lid, seen from within: floor [0, width] x [0, depth] at z = 0 of material 0, four walls of
/// `height` of material 1, every rectangle of n x n quads. Facet order: floor, x = 0, x = width, y = 0, y = depth.
pub fn box_open(width: f64, depth: f64, height: f64, n: usize) -> Mesh {
    let (x, y, z) = (DVec3::X * width, DVec3::Y * depth, DVec3::Z * height);
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, x, y, n, 0);
    mesh.rectangle(DVec3::ZERO, y, z, n, 1);
    mesh.rectangle(x, z, y, n, 1);
    mesh.rectangle(DVec3::ZERO, z, x, n, 1);
    mesh.rectangle(y, x, z, n, 1);
    mesh.welded()
}

/// The light pipe of the cases `M-PIPE3D`: unit floor (material 0, facets 0 and 1), four unit walls (material 1,
/// mirrors there), open top.
pub fn light_pipe() -> Mesh {
    box_open(1.0, 1.0, 1.0, 1)
}

/// Two plates that face each other at distance 1 (materials 0 at z = 0 and 1 at z = 1), closed at the sides by four
/// walls of material 2. With perfect mirrors there the plates are infinite: the cases `S-PLATES`.
pub fn plates_in_pipe() -> Mesh {
    cube_inside().with_materials(&[0, 0, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2])
}

/// A sphere of radius 1 about the origin: an icosahedron divided `n` times, 20 * 4^n facets, fronts outward,
/// vertices on the sphere. For a cavity take `.flipped()`.
pub fn sphere(n: u32) -> Mesh {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut mesh = Mesh {
        vertices: vec![
            [-1.0, g, 0.0],
            [1.0, g, 0.0],
            [-1.0, -g, 0.0],
            [1.0, -g, 0.0],
            [0.0, -1.0, g],
            [0.0, 1.0, g],
            [0.0, -1.0, -g],
            [0.0, 1.0, -g],
            [g, 0.0, -1.0],
            [g, 0.0, 1.0],
            [-g, 0.0, -1.0],
            [-g, 0.0, 1.0],
        ],
        facets: vec![
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ],
        materials: vec![0; 20],
    };
    for level in 0..=n {
        if level > 0 {
            mesh = mesh.subdivided(1);
        }
        mesh.vertices.iter_mut().for_each(|v| *v = DVec3::from(*v).normalize().to_array());
    }
    mesh
}

/// Two unit squares that share the edge x = z = 0, y in [0, 1], with `angle` (radians, in (0, pi)) between them, as
/// in the cases `FF-C16` and `M-WEDGE3D`: facets 0, 1 lie in z = 0 (material 0, front +z), facets 2, 3 face them
/// (material 1).
pub fn wedge(angle: f64) -> Mesh {
    let up = DVec3::new(angle.cos(), 0.0, angle.sin());
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 1, 0);
    mesh.rectangle(DVec3::ZERO, DVec3::Y, up, 1, 1);
    mesh.welded()
}

/// Two facing unit squares at z = 0 (facets 0, 1, front up, material 0) and z = `gap` (facets 2, 3, front down,
/// material 1), as in the cases `FF-C11-1x1`.
pub fn parallel_squares(gap: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 1, 0);
    mesh.rectangle(DVec3::Z * gap, DVec3::Y, DVec3::X, 1, 1);
    mesh
}

/// Unit squares at z = 0 and z = 1 as in [`parallel_squares`] and between them, at height `t`, the rectangle
/// [x0, x1] x [y0, y1] (facets 4, 5, front up, material 2, meant black; its one-sided back is so by itself), as in the
/// cases `FF-OBST`.
pub fn squares_with_blocker(t: f64, [x0, x1, y0, y1]: [f64; 4]) -> Mesh {
    let mut mesh = parallel_squares(1.0);
    mesh.rectangle(DVec3::new(x0, y0, t), DVec3::X * (x1 - x0), DVec3::Y * (y1 - y0), 1, 2);
    mesh
}

/// Two facing vertical unit squares at x = 0 (facets 0, 1) and x = 1 (facets 2, 3), material 0, standing on a unit
/// floor at z = 0 (facets 4, 5, material 1, a mirror), as in the cases `M-2PLATES`.
pub fn two_plates_on_mirror() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, 1, 0);
    mesh.rectangle(DVec3::X, DVec3::Z, DVec3::Y, 1, 0);
    mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 1, 1);
    mesh.welded()
}

/// A vertical unit square at x = 0 (facets 0, 1, material 0) on a unit mirror floor (facets 2, 3, material 1), as in
/// the case `N-CAUSTIC`.
pub fn wall_on_mirror() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, 1, 0);
    mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 1, 1);
    mesh.welded()
}

/// Three unit squares in the coordinate planes that face the octant x, y, z > 0, each of n x n quads: z = 0
/// (material 0), x = 0 (material 1), y = 0 (material 2). For n = 8 the facets of `corner.obj`, in its order.
pub fn corner(n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, n, 0);
    mesh.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, n, 1);
    mesh.rectangle(DVec3::ZERO, DVec3::Z, DVec3::X, n, 2);
    mesh
}

/// One unit square, facets 0 and 1, whose normal is tilted by `tilt` radians from +z toward +x.
pub fn tilted_square(tilt: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, DVec3::new(tilt.cos(), 0.0, -tilt.sin()), DVec3::Y, 1, 0);
    mesh
}
