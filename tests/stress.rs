//! Hostile scenes: nothing breaks, nothing lies. What was measured stands in tests/stress.md.

#[path = "stress/bits.rs"]
mod bits;
#[path = "stress/budget.rs"]
mod budget;
#[path = "support/case.rs"]
mod case;
#[path = "stress/docs.rs"]
mod docs;
#[path = "stress/furnace.rs"]
mod furnace;
#[path = "stress/geometry.rs"]
mod geometry;
#[path = "stress/hostile.rs"]
mod hostile;
#[path = "support/judge/mod.rs"]
mod judge;
#[path = "support/kernel.rs"]
mod kernel;
#[path = "stress/measure.rs"]
mod measure;
#[path = "stress/position.rs"]
mod position;
#[path = "stress/properties.rs"]
mod properties;
#[path = "stress/radiometry.rs"]
mod radiometry;
#[path = "stress/rays.rs"]
mod rays;
mod support;
