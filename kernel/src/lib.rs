//! Photometric images of objects made of flat facets, each with a diffuse and a mirror reflectance.
//!
//! The method is that of Ivankin, Peteshchenkov and Pon'kin (2008): the diffuse radiance of all facets solves
//! one linear system (eq. 12) whose matrix, the coupling, runs from facet to facet straight and by way of
//! mirrors; a short specular chain per pixel (eq. 15) then gives the image.
//!
//! The kernel allocates nothing, starts no thread and keeps no state: every stage tells the bytes it needs and
//! works in memory that the caller hands over ([`arena`]), on a range of rows, so that any scheduler can split it;
//! however it is split, the bits are the same. With the feature `std` the module `host` does the asking and the
//! splitting.
//!
//! # The stages, in the direction of the data
//!
//! | stage | module | depends on | in → out |
//! |---|---|---|---|
//! | scene | [`scene`] | mesh, materials | caller's arrays → validated facets in scene coordinates |
//! | tree | [`bvh`] over [`ray`] | mesh | facets → first hit of any ray |
//! | planes | [`facing`] | mesh | facets → what may stand between two of them |
//! | elements | [`subdivide`], [`element`] | mesh, tolerance | facets → unknowns of the system |
//! | coupling | [`coupling`] ([`mirror`], [`lobe`], [`qmc`]) | mesh, materials, tolerance | unknowns → rows of extended form factors |
//! | light | [`light`] ([`sky`], [`sun`], [`beam`]) | light | coupling, sky, sun → irradiance before diffuse reflection |
//! | radiosity | [`radiosity`] | light | coupling, irradiance → diffuse radiance and irradiance of all elements |
//! | chain | [`chain`] | view | a ray → its radiance, the three terms of eq. (11); rays from a point where its element serves badly |
//! | image | [`image`] ([`camera`], [`raster`]) | view | rays → pixels |
//! | signature | [`signature`] ([`raster`]) | view | rays → radiant intensity, projected area, contrast |
//! | plane model | [`plane`], all stages in two dimensions | | circles and polylines → image |
//!
//! Under all of them: [`error`], [`math`], [`simd`], [`arena`]. Over them: [`policy`], what follows from the
//! tolerance. Beside them: [`form_factor`] and [`quadrature`],
//! exact form factors between points and polygons.
//!
//! # Where the paper's equations are
//!
//! | equation | what it says | where |
//! |---|---|---|
//! | (1) | radiance = all that arrives, weighed by the reflectance, recursively | `tests/support/twin`, the readable twin that judges the kernel |
//! | (2), (3) | diffuse facets alone: I = I0 + rho_d sum phi I | [`coupling`] and [`radiosity`] at rho_s = 0; phi in closed form: [`form_factor`] |
//! | (4) | the mirror direction | [`math::reflect`], [`mirror`] |
//! | (5) to (8) | mirrors alone: sky times the product of the mirrors | [`chain`] at rho_d = 0 |
//! | (9) | reflectance = diffuse + mirror | [`scene::MaterialInput`] |
//! | (10), (11) | radiance = diffuse + mirrored sky + mirrored diffuse | [`chain::Terms`] |
//! | (12) | the linear system for the diffuse radiance | matrix: [`coupling`]; right-hand side: [`light`]; solution: [`radiosity`] |
//! | (13) to (15) | the chain of a pixel | [`chain`], for all pixels: [`image`] |
//! | (16) | eps, the relative rms error of an image | estimated: `host::Report`; measured: `tests/support/metric.rs` |
//!
//! # Symbols
//!
//! | symbol | name here | unit |
//! |---|---|---|
//! | I, brightness | radiance | W m⁻² sr⁻¹ |
//! | I_Φ | [`sky::Sky::radiance`]; the sun's disc: [`sun::Sun::disc_radiance`] | W m⁻² sr⁻¹ |
//! | I^d | diffuse radiance: emission + rho_d E/pi | W m⁻² sr⁻¹ |
//! | E | irradiance, all that arrives at a side | W m⁻² |
//! | ρ^d, ρ^з | [`scene::MaterialInput::diffuse`], [`specular`](scene::MaterialInput::specular) | 1, one value per band |
//! | φ_ik | [`coupling::Record::weight`], the share of the cosine hemisphere | 1 |
//! | r_n, r^з | directions; unit vectors from the surface, rays toward it | 1 |
//! | T, a chain's facets | the loop of [`chain::Solved::radiance`] | |
//! | ε | tolerance asked for, error estimate given back | share of the reference radiance |
//!
//! Any consistent unit of radiance does: the kernel is linear in the light. Lengths are in the mesh's unit.
#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_code)]

pub mod accuracy;
pub mod arena;
pub mod bake;
pub mod beam;
pub mod bvh;
pub mod camera;
pub mod chain;
pub mod coupling;
pub mod element;
pub mod error;
pub mod facets;
pub mod facing;
pub mod form_factor;
#[cfg(feature = "std")]
pub mod host;
pub mod image;
mod index;
mod inside;
pub mod light;
pub mod lobe;
pub mod math;
pub mod mirror;
mod octahedron;
pub mod plane;
pub mod policy;
pub mod qmc;
pub mod quadrature;
pub mod quarter;
pub mod radiosity;
pub mod raster;
pub mod ray;
pub mod scene;
pub mod signature;
pub mod simd;
pub mod sky;
pub mod solver;
mod sort;
pub mod subdivide;
pub mod sun;
pub mod sun_image;

pub use error::{Error, Field};

/// The README's example, compiled and run as a test.
#[cfg(all(doctest, feature = "std"))]
#[doc = include_str!("../../README.md")]
struct Readme;
