//! Rays and what they meet: the tree of facets, first hits, surfaces at hits and the rays that leave them.

pub mod bvh;
pub(crate) mod inside;
pub mod outline;
pub mod ray;
pub mod surface;
pub(crate) mod swept;
