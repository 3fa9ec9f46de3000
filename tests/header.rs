//! `include/blik.h` is what cbindgen makes of `ffi/src`, carries the manifest's version, and compiles alone as C
//! and C++ without a warning.
//!
//! After a change of the interface: `UPDATE_HEADER=1 cargo test --test header` writes the file anew.

use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The checked-in header, written anew first where that is asked for: once, whichever test comes first.
fn kept() -> &'static str {
    static KEPT: OnceLock<String> = OnceLock::new();
    KEPT.get_or_init(|| {
        let path = root().join("include/blik.h");
        if std::env::var_os("UPDATE_HEADER").is_some() {
            std::fs::write(&path, generated()).unwrap();
        }
        std::fs::read_to_string(&path).unwrap()
    })
}

/// The header as cbindgen makes it now.
fn generated() -> String {
    let ffi = root().join("ffi");
    let config = cbindgen::Config::from_file(ffi.join("cbindgen.toml")).unwrap();
    let bindings =
        cbindgen::Builder::new().with_config(config).with_src(ffi.join("src/lib.rs")).generate().unwrap();
    let mut text = Vec::new();
    bindings.write(&mut text);
    String::from_utf8(text).unwrap()
}

#[test]
fn the_header_is_in_step_with_its_source() {
    assert!(
        kept() == generated(),
        "include/blik.h is not what ffi/src says: run `UPDATE_HEADER=1 cargo test --test header`"
    );
}

#[test]
fn header_library_and_manifest_have_one_version() {
    let text = kept();
    let define = |name: &str| {
        let start = format!("#define {name} ");
        let line =
            text.lines().find_map(|line| line.strip_prefix(&start)).unwrap_or_else(|| panic!("no {name}"));
        line.parse::<u32>().unwrap_or_else(|_| panic!("{name} is {line}"))
    };
    let parts = ["MAJOR", "MINOR", "PATCH"].map(|part| define(&format!("BLIK_VERSION_{part}")));
    assert_eq!(parts.map(|part| part.to_string()).join("."), env!("CARGO_PKG_VERSION"));
    let [major, minor, patch] = parts;
    assert_eq!(blik::blik_version(), major * 10000 + minor * 100 + patch);
    assert_eq!(blik::BLIK_VERSION, blik::blik_version());
}

/// Compiles a file that holds nothing but the header and one use of it, with the compiler that the environment
/// variable names, else with the usual one. False where there is no such compiler.
fn compiles(variable: &str, usual: &str, standard: &str, extension: &str) -> bool {
    kept();
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("alone").with_extension(extension);
    let text = "#include <blik.h>\n#include <blik.h>\n\
        int main(void) { return blik_version() == BLIK_VERSION ? 0 : 1; }\n";
    std::fs::write(&source, text).unwrap();
    let compiler = std::env::var_os(variable).unwrap_or_else(|| usual.into());
    let output = Command::new(&compiler)
        .arg(format!("-std={standard}"))
        .args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-c"])
        .arg("-I")
        .arg(root().join("include"))
        .arg(&source)
        .arg("-o")
        .arg(source.with_extension("o"))
        .output();
    let output = match output {
        Err(error) if error.kind() == ErrorKind::NotFound => return false,
        output => output.unwrap_or_else(|e| panic!("{}: {e}", compiler.display())),
    };
    assert!(output.status.success(), "{standard}:\n{}", String::from_utf8_lossy(&output.stderr));
    true
}

#[test]
fn the_header_alone_is_c99() {
    assert!(compiles("CC", "cc", "c99", "c"), "no C compiler");
}

#[test]
fn the_header_alone_is_cpp11() {
    // The project needs a C compiler (Rust links with it), but no C++ compiler; `.ci/run` brings one.
    if !compiles("CXX", "c++", "c++11", "cpp") {
        eprintln!("no C++ compiler: not checked");
    }
}
