//! The plane model: the same photometry in two dimensions, on circles and polylines (infinite cylinders and
//! prisms seen along their cross-section), as the paper validates its method.
//!
//! It is where the truth is known to 1e-7, so that every rule of the method can be judged. The stages are those
//! of the three-dimensional kernel, with the same contract: caller memory, ranges of rows and samples, no state.
//!
//! | stage | module | in → out |
//! |---|---|---|
//! | scene | [`scene`] | circles, polylines, materials → primitives and unknowns |
//! | visibility | [`view`] | a point → what it sees, as spans between silhouettes |
//! | chains | [`trace`] | a ray → what it meets by way of mirrors and [`lobe`]s |
//! | coupling | [`rows`] | eq. (12): rows of extended form factors |
//! | light | [`light`], [`direct`] | sky and sun; what they bring every unknown, also by way of mirrors |
//! | solution | [`solve`] | eq. (12) solved, with [`crate::radiosity`]'s bounds |
//! | image | [`image`] | eq. (15) along each ray |
//!
//! In flatland the cosine law's weight is cos/2, whose integral over the half circle is 1, and a row's share of
//! a span is half the difference of the sines. One spectral band: more bands are more runs. Lengths are in any
//! unit, radiance in any; E, the sun's normal irradiance, is radiance times angle.

pub mod direct;
mod fork;
#[cfg(feature = "std")]
pub mod host;
pub mod image;
pub mod light;
pub mod lobe;
mod nodes;
pub(crate) mod path;
pub mod rows;
pub mod scene;
pub mod scratch;
pub mod settings;
pub mod solve;
pub mod stencil;
pub mod trace;
pub mod view;

pub use glam::DVec2 as Vec2;

use crate::base::math::sqrt;

/// The third component of the vector product: positive where `b` is counter-clockwise of `a`.
#[inline(always)]
pub fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// `v` turned by 90 degrees counter-clockwise.
#[inline(always)]
pub fn turned(v: Vec2) -> Vec2 {
    Vec2::new(-v.y, v.x)
}

/// Length of `v`.
#[inline(always)]
pub fn length(v: Vec2) -> f64 {
    sqrt(v.dot(v))
}

/// The direction whose angle to the unit vector `n` has the sine `s` (counter-clockwise positive) and a cosine
/// that is not negative.
#[inline(always)]
pub fn toward(n: Vec2, s: f64) -> Vec2 {
    n * sqrt(((1.0 - s) * (1.0 + s)).max(0.0)) + turned(n) * s
}

/// A ray's direction `d` after an ideal mirror of unit normal `n`.
#[inline(always)]
pub fn reflect(d: Vec2, n: Vec2) -> Vec2 {
    d - n * (2.0 * d.dot(n))
}
