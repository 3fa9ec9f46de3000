//! Photometric images of objects made of flat facets, each with a diffuse and a mirror reflectance.
//!
//! The method is that of Ivankin, Peteshchenkov and Pon'kin (2008): the diffuse radiance of all facets solves
//! one linear system (eq. 12) whose matrix, the coupling, runs from facet to facet straight and by way of
//! mirrors; a short specular chain per pixel (eq. 15) then gives the image.
#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_code)]

pub mod arena;
pub mod beam;
pub mod bvh;
pub mod camera;
pub mod chain;
pub mod coupling;
pub mod element;
pub mod error;
pub mod form_factor;
#[cfg(feature = "std")]
pub mod host;
pub mod image;
pub mod light;
pub mod lobe;
pub mod math;
pub mod mirror;
pub mod qmc;
pub mod quadrature;
pub mod radiosity;
pub mod ray;
pub mod scene;
pub mod signature;
pub mod simd;
pub mod sky;
pub mod subdivide;
pub mod sun;

pub use error::{Error, Field};
