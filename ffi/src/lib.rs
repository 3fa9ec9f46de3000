//! The C interface of Blik: checks arguments, calls the kernel, maps the status.
#![cfg_attr(not(feature = "std"), no_std)]

/// Version of the library as `major * 10000 + minor * 100 + patch`.
#[unsafe(no_mangle)]
pub extern "C" fn blik_version() -> u32 {
    100
}
