//! `include/*.h` are what cbindgen and `ffi/header` make of `ffi/src`, carry the manifest's version, and compile alone as
//! C and C++ without a warning.
//!
//! After a change of the interface: `UPDATE_HEADER=1 cargo test --test header` writes the files anew.

#[path = "support/header.rs"]
mod generator;

use generator::{HEADERS, generated};
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The checked-in headers, written anew first where that is asked for: once, whichever test comes first.
fn kept() -> &'static [String] {
    static KEPT: OnceLock<Vec<String>> = OnceLock::new();
    KEPT.get_or_init(|| {
        if std::env::var_os("UPDATE_HEADER").is_some() {
            for (name, text) in generated(root()) {
                std::fs::write(root().join("include").join(name), text).unwrap();
            }
        }
        HEADERS.map(|name| std::fs::read_to_string(root().join("include").join(name)).unwrap()).to_vec()
    })
}

#[test]
fn the_headers_are_in_step_with_their_source() {
    for ((name, text), kept) in generated(root()).iter().zip(kept()) {
        assert!(
            kept == text,
            "include/{name} is not what ffi/src says: run `UPDATE_HEADER=1 cargo test --test header`"
        );
    }
}

/// A reader of blik.h comes to its first function soon, and to its end.
#[test]
fn the_header_is_a_manual_of_bounded_length() {
    let text = &kept()[0];
    let overview = text.lines().position(|line| line.trim() == "*/").unwrap();
    let first = text.lines().position(|line| line.starts_with("BLIK_API")).unwrap();
    assert!(text.lines().count() <= 1300, "{} lines", text.lines().count());
    assert!(first - overview <= 300, "the first function stands in line {first}");
}

#[test]
fn header_library_and_manifest_have_one_version() {
    let text = &kept()[0];
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

/// Warnings that the headers and the tests in C and C++ are free of.
const WARNINGS: [&str; 8] =
    ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion", "-Wshadow", "-Wundef", "-Wcast-align"];

/// Compiles a file that holds nothing but a header, twice, and one use of it. False where there is no such compiler or
/// it does not know the standard.
fn compiles(compiler: &str, standard: &str, header: &str) -> bool {
    kept();
    let folder = tempfile::tempdir().unwrap();
    let extension = if standard.contains("++") { "cpp" } else { "c" };
    let source = folder.path().join("alone").with_extension(extension);
    let text = format!(
        "#include <{header}>\n#include <{header}>\n\
        int main(void) {{ return blik_version() == BLIK_VERSION ? 0 : 1; }}\n"
    );
    std::fs::write(&source, text).unwrap();
    let known = Command::new(compiler)
        .args([&*format!("-std={standard}"), "-x", if extension == "c" { "c" } else { "c++" }])
        .args(["-E", "/dev/null"])
        .output();
    match known {
        Err(error) if error.kind() == ErrorKind::NotFound => return false,
        known if !known.as_ref().unwrap().status.success() => return false,
        _ => {}
    }
    let mut command = Command::new(compiler);
    command.arg(format!("-std={standard}")).args(WARNINGS).arg("-c");
    if extension == "c" {
        command.arg("-Wstrict-prototypes");
    }
    command.arg("-I").arg(root().join("include")).arg(&source).arg("-o").arg(source.with_extension("o"));
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{compiler} -std={standard}, {header}:\n{errors}");
    true
}

/// Compiles the headers by all compilers there are, as each of the standards; some must be there.
fn compiles_as(compilers: &[&str], standards: &[&str]) -> usize {
    let pairs = compilers.iter().flat_map(|c| standards.iter().map(move |s| (c, s)));
    let done = pairs.filter(|(compiler, standard)| {
        let done = HEADERS.iter().all(|header| compiles(compiler, standard, header));
        if !done {
            eprintln!("no {compiler} -std={standard}: not checked");
        }
        done
    });
    done.count()
}

#[test]
fn each_header_alone_is_c99_to_c23() {
    let done = compiles_as(&["cc", "gcc", "clang"], &["c99", "c11", "c17", "c2x"]);
    // Rust links with a C compiler: one is there
    assert!(done >= 3, "no C compiler");
}

#[test]
fn each_header_alone_is_cpp11_to_cpp23() {
    compiles_as(&["c++", "g++", "clang++"], &["c++11", "c++14", "c++17", "c++20", "c++2b"]);
}
