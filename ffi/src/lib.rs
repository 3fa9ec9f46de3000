//! The C interface of Blik: checks arguments, calls the kernel, maps the status.
//!
//! `include/blik.h` is generated from this crate by cbindgen (`ffi/cbindgen.toml`, `tests/header.rs`).
#![cfg_attr(not(feature = "std"), no_std)]

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

/// Version of the library that is linked, as `major * 10000 + minor * 100 + patch`; `BLIK_VERSION` is that of
/// the header. May be called by any number of threads at once.
#[unsafe(no_mangle)]
pub extern "C" fn blik_version() -> u32 {
    BLIK_VERSION
}
