//! Parameters, bodies, lights and materials drawn from distributions: what generated scenes are made of.
//!
//! Apart from the support modules that every test takes: a program takes it with
//! `#[path = "../../tests/support/drawn/mod.rs"] mod drawn;`.
// Each binary uses a part.
#![allow(dead_code)]

mod draw;
pub mod light;
pub mod shapes;

pub use draw::Draw;
