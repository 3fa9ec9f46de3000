//! Hostile scenes: nothing breaks, nothing lies. The measured errors are kept in tests/stress.md.

#[path = "support/case.rs"]
mod case;
#[path = "stress/furnace.rs"]
mod furnace;
mod support;
