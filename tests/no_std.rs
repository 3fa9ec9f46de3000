//! The library without the standard library: no panic can be reached and nothing is taken from elsewhere but the four
//! functions that every compiler takes for granted; its single-object archive shows `blik_*` alone.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn succeeds(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{command:?}:\n{text}{}", String::from_utf8_lossy(&output.stderr));
    text
}

/// `libblik.a` as ffi/README.md says to build it: link-time optimisation over everything makes one object of ours.
fn archive() -> &'static Path {
    static ARCHIVE: OnceLock<PathBuf> = OnceLock::new();
    ARCHIVE.get_or_init(|| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.current_dir(root()).args(["rustc", "-p", "blik-ffi", "--lib", "--crate-type", "staticlib"]);
        cargo.args(["--no-default-features", "--features", "panic-handler", "--profile", "embedded"]);
        succeeds(&mut cargo);
        // this test's program is target/PROFILE/deps/NAME
        let target = std::env::current_exe().unwrap().ancestors().nth(3).unwrap().to_path_buf();
        target.join("embedded/libblik.a")
    })
}

/// Symbols of an object or archive with one of the types of `nm`.
fn symbols(file: &Path, types: &str) -> BTreeSet<String> {
    let text = succeeds(Command::new("nm").arg(file));
    let fields = text.lines().map(|l| l.split_whitespace().rev());
    let pairs = fields.filter_map(|mut f| Some((f.next()?, f.next()?)));
    pairs.filter(|(_, t)| types.contains(t) && t.len() == 1).map(|(name, _)| name.to_string()).collect()
}

/// Makes the archive of one object.
fn single_object(folder: &Path) -> PathBuf {
    let result = folder.join("libblik_nostd.a");
    succeeds(Command::new(root().join("ffi/single_object.sh")).arg(archive()).arg(&result));
    result
}

/// The panic handler calls `abort`: a panic that can be reached would make that a symbol that is missing.
#[test]
fn no_panic_can_be_reached_and_its_own_functions_alone_show() {
    let folder = tempfile::tempdir().unwrap();
    let object = single_object(folder.path());
    let granted = ["memcpy", "memmove", "memset", "memcmp"].map(String::from).into();
    let missing = symbols(&object, "Uw");
    assert!(missing.is_subset(&granted), "{missing:?}");
    let shown = symbols(&object, "TWVDBRC");
    let own: BTreeSet<String> =
        symbols(archive(), "T").into_iter().filter(|s| s.starts_with("blik_")).collect();
    assert_eq!(shown, own);
    assert!(shown.len() > 40, "{shown:?}");
}

#[test]
fn a_c_program_links_with_the_single_object_alone() {
    let folder = tempfile::tempdir().unwrap();
    let object = single_object(folder.path());
    let program = folder.path().join("program");
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-DBLIK_NO_STD", "-I"]);
    compiler.arg(root().join("include")).arg(root().join("tests/c/interface.c")).arg(&object);
    succeeds(compiler.args(["-lm", "-o"]).arg(&program));
    assert_eq!(succeeds(&mut Command::new(&program)), "ok\n");
}
