//! The brute-force twin: what the kernel computes, by the shortest readable way, sharing no code with it.
//!
//! * [`radiance`] and [`facet_irradiance`] solve the radiance equation (eq. 1) by random walks of unlimited length,
//!   continuous over the facets; errors are standard errors over independent randomisations.
//! * [`Dense`] holds the linear system of eq. 12, one radiance per facet, form factors counted by rays (through
//!   mirrors of any depth), and solves it by Gauss elimination.
//!
//! Not here: interpolated normals.

mod bvh;
mod dense;
mod light;
mod scene;
mod sequence;
mod walk;

pub use dense::{Dense, solve_linear};
pub use light::{Model, Sky, Sun, lobe, lobe_sample};
pub use scene::{Material, Meeting, Scene};
pub use sequence::{Estimate, Kronecker, Rng, estimate};
pub use walk::{Effort, facet_irradiance, radiance};

use glam::{DVec3, dvec3};

/// A ray: origin, unit direction and the facet that it leaves, which it cannot hit.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// The facet that it leaves, if any.
    pub leaving: Option<u32>,
}

/// The mirror direction of a travelling direction `d` at a plane of unit normal `n`, whichever side it faces.
pub fn reflect(d: DVec3, n: DVec3) -> DVec3 {
    d - 2.0 * d.dot(n) * n
}

/// The direction of (u, v) in [0, 1)^2, cosine-distributed about the unit normal `n`.
pub fn cosine_direction(n: DVec3, u: f64, v: f64) -> DVec3 {
    let (radius, angle) = (u.sqrt(), std::f64::consts::TAU * v);
    in_frame(n, dvec3(radius * angle.cos(), radius * angle.sin(), (1.0 - u).sqrt()))
}

/// The vector of local coordinates `p` in a right-handed frame whose third axis is the unit vector `n`.
pub fn in_frame(n: DVec3, p: DVec3) -> DVec3 {
    // the coordinate axis farthest from n
    let helper = if n.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    let x = helper.cross(n).normalize();
    (x * p.x + n.cross(x) * p.y + n * p.z).normalize()
}
