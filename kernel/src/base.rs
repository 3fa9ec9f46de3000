//! What all wings stand on: errors, caller memory, arithmetic and vectors, sequences and rules of integration.

pub mod arena;
pub mod budget;
pub mod error;
pub(crate) mod index;
pub mod math;
pub(crate) mod octahedron;
pub mod qmc;
pub mod quadrature;
pub mod quarter;
pub mod simd;
pub(crate) mod sort;
