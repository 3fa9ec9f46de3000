//! Gives the shared library its soname, whose numbers are those that a change of the interface changes.

use std::env::var;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let number = |part| var(format!("CARGO_PKG_VERSION_{part}")).unwrap();
    // while the major version is 0, a minor version may change the interface
    let version = match (number("MAJOR"), number("MINOR")) {
        (major, minor) if major == "0" => format!("{major}.{minor}"),
        (major, _) => major,
    };
    if var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo::rustc-link-arg=-Wl,-soname,libblik.so.{version}");
    }
}
