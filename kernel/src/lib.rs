//! Photometric images of objects made of flat facets, each with a diffuse and a mirror reflectance.
//!
//! The method is that of Ivankin, Peteshchenkov and Pon'kin (2008): the diffuse radiance of all facets solves
//! one linear system (eq. 12) whose matrix, the coupling, runs from facet to facet straight and by way of
//! mirrors; a short specular chain per pixel (eq. 15) then gives the image.
//!
//! The kernel allocates nothing, starts no thread and keeps no state: every stage tells the bytes it needs and
//! works in memory that the caller hands over ([`base::arena`]), on a range of rows, so that any scheduler can split it;
//! however it is split, the bits are the same. With the feature `std` the module `host` does the asking and the
//! splitting.
//!
//! # The wings, in the direction of the data
//!
//! A file names only its own wing and those above it in this table (`tests/wings.rs`).
//!
//! | wing | what it holds | in → out |
//! |---|---|---|
//! | [`base`] | errors, caller memory, vectors, SIMD, sequences, quadrature | |
//! | [`mod@scene`] | facets, materials and lobes; sky, sun and reference radiance | caller's arrays → validated facets in scene coordinates |
//! | [`form_factor`] | exact form factors between points and polygons | |
//! | [`rays`] | the tree, first hits, surfaces at hits | facets → first hit of any ray |
//! | [`coupling`] | planes, elements, rows of extended form factors | mesh, materials, tolerance → rows |
//! | [`radiosity`] | direct light, beams of the sun, the solver, expected errors | rows, light → diffuse radiance and irradiance of all elements |
//! | [`view`] | chains, images, signatures, facets' values, error estimates | a ray → its radiance, the three terms of eq. (11) |
//! | [`settings`] | what stages follow from the tolerance | |
//! | [`rounds`] | finer solutions of an image until it is as good as asked | |
//! | [`bake`] | a scene, its coupling and solution as one block of bytes | |
//! | `host` | the owning layer: memory and threads (feature `std`) | |
//!
//! Beside them stands [`plane`], all stages in two dimensions.
//!
//! # Where the paper's equations are
//!
//! | equation | what it says | where |
//! |---|---|---|
//! | (1) | radiance = all that arrives, weighed by the reflectance, recursively | `tests/support/twin`, the readable twin that judges the kernel |
//! | (2), (3) | diffuse facets alone: I = I0 + rho_d sum phi I | [`coupling`] and [`radiosity`] at rho_s = 0; phi in closed form: [`form_factor`] |
//! | (4) | the mirror direction | [`base::math::reflect`], [`rays::surface`] |
//! | (5) to (8) | mirrors alone: sky times the product of the mirrors | [`view::chain`] at rho_d = 0 |
//! | (9) | reflectance = diffuse + mirror | [`scene::MaterialInput`] |
//! | (10), (11) | radiance = diffuse + mirrored sky + mirrored diffuse | [`view::chain::Terms`] |
//! | (12) | the linear system for the diffuse radiance | matrix: [`coupling`]; right-hand side: [`radiosity::direct`]; solution: [`radiosity`] |
//! | (13) to (15) | the chain of a pixel | [`view::chain`], for all pixels: [`view::image`] |
//! | (16) | eps, the relative rms error of an image | estimated: `host::Report`; measured: `tests/support/metric.rs` |
//!
//! # Words
//!
//! | word here | meaning |
//! |---|---|
//! | element | a facet, or one of the triangles that it is refined into, over which reflected light varies linearly |
//! | unknown | one side of an element |
//! | row | the extended form factors of one unknown: what it sees, straight and by way of mirrors |
//! | record | one entry of a row: target, weight, mirror path |
//! | mirror path | the mirror classes on the way from one facet to another, in any order |
//! | escape, bundle | an entry of a row that ends in the sky; many of them, four bytes each |
//! | throughput | product of the reflectances along a path |
//! | straight sky | the sky that a point sees without a mirror between |
//! | occluder | a facet that may stand in the way of rays from another |
//! | final gathering | rays from a point that is looked at, in place of its element's linear function |
//! | item buffer | the facet that each pixel's centre shows, drawn instead of traced |
//! | image of the sun | a direction in which flat mirrors show the sun to a facet |
//! | black back | the back of a one-sided facet: opaque, of radiance 0 |
//!
//! # Symbols
//!
//! | symbol | name here | unit |
//! |---|---|---|
//! | I, brightness | radiance | W m⁻² sr⁻¹ |
//! | I_Φ | [`scene::sky::Sky::radiance`]; the sun's disc: [`scene::sun::Sun::disc_radiance`] | W m⁻² sr⁻¹ |
//! | I^d | diffuse radiance: emission + rho_d E/pi | W m⁻² sr⁻¹ |
//! | E | irradiance, all that arrives at a side | W m⁻² |
//! | ρ^d, ρ^з | [`scene::MaterialInput::diffuse`], [`specular`](scene::MaterialInput::specular) | 1, one value per band |
//! | φ_ik | [`coupling::Record::weight`], the share of the cosine hemisphere | 1 |
//! | r_n, r^з | directions; unit vectors from the surface, rays toward it | 1 |
//! | T, a chain's facets | the loop of [`view::chain::Solved::radiance`] | |
//! | ε | tolerance asked for, error estimate given back | share of the reference radiance |
//!
//! Any consistent unit of radiance does: the kernel is linear in the light. Lengths are in the mesh's unit.
#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_code)]

pub mod bake;
pub mod base;
pub mod coupling;
pub mod form_factor;
#[cfg(feature = "std")]
pub mod host;
pub mod plane;
pub mod radiosity;
pub mod rays;
pub mod rounds;
pub mod scene;
pub mod settings;
pub mod stages;
pub mod view;

pub use base::error::{Error, Field};
pub use base::{arena, error, math, qmc, quadrature, quarter, simd};
pub use coupling::{element, plane_sides, subdivide};
pub use radiosity::{accuracy, beam, solver, sun_image};
pub use rays::surface as mirror;
pub use rays::{bvh, ray};
pub use scene::{lobe, sky, sun};
pub use view::{camera, chain, facets, image, importance, raster, signature};

/// Light and its direct part under one name, as callers of version 0.1 know them.
pub mod light {
    pub use crate::radiosity::direct::*;
    pub use crate::scene::light::*;
}

/// Functions of the tolerance under one name, as callers of version 0.1 know it.
pub mod policy {
    pub use crate::radiosity::limits::*;
    pub use crate::rounds::*;
    pub use crate::settings::*;
    pub use crate::view::estimate::*;
}

/// The README's example, compiled and run as a test.
#[cfg(all(doctest, feature = "std"))]
#[doc = include_str!("../../README.md")]
struct Readme;
