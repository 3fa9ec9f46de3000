//! The C interface of Blik: checks arguments, calls the kernel, maps the status.
//!
//! `include/blik.h` is generated from this crate by cbindgen (`ffi/cbindgen.toml`, `tests/header.rs`) and is the
//! manual.
#![cfg_attr(not(feature = "std"), no_std)]
// the names of C
#![allow(non_camel_case_types)]

mod bake;
mod coupling;
mod explain;
mod form_factor;
mod intersector;
mod lights;
mod memory;
mod mesh;
mod plane;
mod report;
mod run;
mod scene;
mod solution;
mod status;
mod text;
mod types;
mod update;
mod view;

pub use bake::*;
pub use coupling::*;
pub use explain::*;
pub use form_factor::*;
pub use intersector::{blik_any_facets, blik_first_facets, blik_intersector, blik_scene_set_intersector};
pub use lights::*;
pub use plane::*;
pub use report::*;
#[cfg(feature = "std")]
pub use run::blik_run_on_threads;
pub use run::{blik_parallel, blik_progress, blik_run, blik_task};
pub use scene::*;
pub use solution::*;
pub use status::*;
pub use text::*;
pub use types::*;
pub use update::*;
pub use view::*;

#[cfg(all(feature = "panic-handler", not(feature = "std"), not(test)))]
mod panic;

/// Major version of the library that this header belongs to.
pub const BLIK_VERSION_MAJOR: u32 = 0;

/// Minor version of the library that this header belongs to. While the major version is 0, a new minor version
/// may change the interface.
pub const BLIK_VERSION_MINOR: u32 = 1;

/// Patch version of the library that this header belongs to.
pub const BLIK_VERSION_PATCH: u32 = 0;

/// Version of the library that this header belongs to, as `major * 10000 + minor * 100 + patch`.
pub const BLIK_VERSION: u32 = BLIK_VERSION_MAJOR * 10000 + BLIK_VERSION_MINOR * 100 + BLIK_VERSION_PATCH;

/// Version of the library that is linked, as `major * 10000 + minor * 100 + patch`; `BLIK_VERSION` is that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn blik_version() -> u32 {
    BLIK_VERSION
}

/// Runs the body of a function: no panic gets out, and the error goes to the caller.
fn call(error: *mut blik_error, body: impl FnOnce() -> Result<(), blik_error>) -> i32 {
    match caught(body) {
        Ok(()) => BLIK_OK,
        Err(what) => {
            if !error.is_null() && error.is_aligned() {
                // SAFETY: every function's caller promises a valid pointer or null.
                unsafe { error.write(what) };
            }
            what.status
        }
    }
}

/// Runs `body`; a panic becomes [`BLIK_ERROR_INTERNAL`] (without the standard library none can happen).
fn caught(body: impl FnOnce() -> Result<(), blik_error>) -> Result<(), blik_error> {
    #[cfg(feature = "std")]
    {
        let body = std::panic::AssertUnwindSafe(body);
        std::panic::catch_unwind(body).unwrap_or(Err(blik_error::of(BLIK_ERROR_INTERNAL)))
    }
    #[cfg(not(feature = "std"))]
    body()
}
