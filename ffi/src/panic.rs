//! What a panic does where there is no standard library: it calls the C library's `abort`.
//!
//! The linker takes this function only where a panic can be reached, so that `abort` among the undefined symbols
//! of the static library tells that one can.

unsafe extern "C" {
    safe fn abort() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    abort()
}
