//! What an observer sees of a solved scene: chains of rays, images, signatures, values of facets, and their error.

pub mod camera;
pub mod chain;
pub mod estimate;
pub mod facets;
pub mod image;
pub mod importance;
pub mod raster;
pub mod signature;
