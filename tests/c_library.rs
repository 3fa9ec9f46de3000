//! The library from C and C++: programs compile as every standard without a warning, link at the first try, and run;
//! its symbols are what the header declares; its layouts are those of the stored baseline.
//!
//! After a change of the interface that is meant: `UPDATE_ABI=1 cargo test --test c_library` writes the baseline anew.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The name that the shared library gives itself: its file's name with what a change of the interface changes.
const SONAME: &str = "libblik.so.0.1";

/// The folder of `libblik.a` and `libblik.so`, built once.
fn library() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let output = Command::new(env!("CARGO"))
            .current_dir(root())
            .args(["rustc", "-p", "blik-ffi", "--lib", "--crate-type", "staticlib,cdylib"])
            .args(["--features", "std"])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        // this test's program is target/PROFILE/deps/NAME
        let folder = std::env::current_exe().unwrap().ancestors().nth(3).unwrap().join("debug");
        #[cfg(unix)]
        {
            // programs look for the name that the library gives itself
            let _ = std::fs::remove_file(folder.join(SONAME));
            std::os::unix::fs::symlink("libblik.so", folder.join(SONAME)).unwrap();
        }
        folder
    })
}

/// True where the compiler is there and knows the standard.
fn knows(compiler: &str, standard: &str) -> bool {
    let language = if standard.contains("++") { "c++" } else { "c" };
    let output = Command::new(compiler)
        .args([&format!("-std={standard}"), "-x", language, "-E", "/dev/null"])
        .output();
    match output {
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        output => output.unwrap().status.success(),
    }
}

/// How a program is linked.
#[derive(Clone, Copy, PartialEq)]
enum Link {
    Static,
    Shared,
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// Compiles, links and runs a program; what it printed.
fn run(compiler: &str, standard: &str, source: &Path, link: Link, arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let mut command = Command::new(compiler);
    command.arg(format!("-std={standard}")).args(["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    command.args(["-Wconversion", "-Wshadow", "-Wundef", "-Wcast-align"]);
    command.arg("-I").arg(root().join("include")).arg(source).arg("-o").arg(&program);
    match link {
        Link::Static => command.arg(library().join("libblik.a")).args(["-lpthread", "-ldl", "-lm"]),
        Link::Shared => command.arg("-L").arg(library()).args(["-lblik", "-lpthread", "-lm"]),
    };
    let output = command.output().unwrap();
    assert!(output.status.success(), "{compiler} -std={standard}:\n{}", text(&output));
    let output = Command::new(&program).args(arguments).env("LD_LIBRARY_PATH", library()).output().unwrap();
    assert!(output.status.success(), "{compiler} -std={standard}: {}", text(&output));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn c_programs_run_as_every_standard() {
    let source = root().join("tests/c/interface.c");
    for compiler in ["cc", "clang"] {
        for standard in ["c99", "c11", "c17", "c2x"].iter().filter(|s| knows(compiler, s)) {
            let link = if *standard == "c11" { Link::Shared } else { Link::Static };
            assert_eq!(run(compiler, standard, &source, link, &[]), "ok\n");
        }
    }
}

#[test]
fn cpp_programs_run_as_every_standard() {
    let run_all = |program: &str| {
        let source = root().join("tests/c").join(program);
        for compiler in ["c++", "clang++"] {
            for standard in ["c++17", "c++20", "c++2b"].iter().filter(|s| knows(compiler, s)) {
                let link = if *standard == "c++20" { Link::Shared } else { Link::Static };
                assert_eq!(run(compiler, standard, &source, link, &[]), "ok\n");
            }
        }
    };
    // two at once: they are the last of these tests to end
    for pair in [["interface.cpp", "owners.cpp"], ["arrays.cpp", "callbacks.cpp"]] {
        std::thread::scope(|scope| {
            let running = pair.map(|program| scope.spawn(move || run_all(program)));
            running.into_iter().for_each(|thread| thread.join().unwrap());
        });
    }
}

/// A program of a header that knew fewer members than the library does.
#[test]
fn programs_of_older_headers_keep_their_memory() {
    let source = root().join("tests/c/older.c");
    for link in [Link::Static, Link::Shared] {
        assert_eq!(run("cc", "c11", &source, link, &[]), "ok\n");
    }
}

/// What the compiler is to refuse, and the words that it is to say: the declarations around it are well without it.
const REFUSED: [(&str, &str); 12] = [
    ("blik::coupling bad{blik::scene{mesh}};", "delete"),
    ("blik::coupling bad(make());", "delete"),
    ("blik::solution bad{blik::coupling{scene}, light};", "delete"),
    ("const blik::scene &bad = blik::loaded(block).scene(); (void)bad;", "delete"),
    ("const blik::solution *bad = blik::loaded(block).solution(); (void)bad;", "delete"),
    ("blik::loaded bad{std::vector<unsigned char>(9)};", "delete"),
    ("blik_run bad = blik::progress([](double) { return true; }).on(); (void)bad;", "delete"),
    ("blik_light bad = blik::light(blik::sky()).get(); (void)bad;", "delete"),
    ("blik::mesh bad(columns<-1, 3>(), indices);", "column-major"),
    ("blik::mesh bad(columns<-1, -1>(), indices);", "column-major"),
    ("blik::mesh bad(columns<3, 3>(), indices);", "as many rows as columns"),
    ("blik::mesh bad(std::vector<four>(3), indices);", "no number and no struct"),
];

/// Temporaries whose address would be kept, matrices whose order is not the entries', and structs of other numbers do not
/// compile.
#[test]
fn what_would_dangle_or_be_read_wrongly_does_not_compile() {
    if !knows("c++", "c++17") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let compile = |line: &str| {
        let file = folder.path().join("refused.cpp");
        let text = format!(
            "#include <blik.hpp>\n#include <vector>\nstruct four {{ double a, b, c, d; }};\n\
             template <int R, int C> struct columns {{ using Scalar = double;\n\
             enum {{ RowsAtCompileTime = R, ColsAtCompileTime = C, IsRowMajor = 0 }};\n\
             long rows() const {{ return 3; }} long cols() const {{ return 3; }} long size() const {{ return 9; }}\n\
             long innerStride() const {{ return 1; }} long outerStride() const {{ return 3; }}\n\
             const double *data() const {{ return nullptr; }} }};\n\
             inline void test(const blik::mesh &mesh, const blik::scene &scene, const blik::block &block,\n\
             const blik::light &light, const std::vector<int> &indices, blik::scene (*make)()) {{\n\
             (void)mesh, (void)scene, (void)block, (void)light, (void)indices, (void)make;\n{line}\n}}\n"
        );
        std::fs::write(&file, text).unwrap();
        let mut command = Command::new("c++");
        command.args(["-std=c++17", "-fsyntax-only", "-I"]).arg(root().join("include")).arg(&file);
        command.output().unwrap()
    };
    let well = compile("blik::mesh good(columns<3, -1>(), indices);");
    assert!(well.status.success(), "{}", text(&well));
    for (line, words) in REFUSED {
        let output = compile(line);
        assert!(!output.status.success(), "compiles: {line}");
        assert!(text(&output).contains(words), "{line}:\n{}", text(&output));
    }
}

/// A struct of the caller as its inline function of the header set it, as Rust shows it.
fn shown<T: std::fmt::Debug + Copy>(bytes: &[u8]) -> String {
    assert_eq!(bytes.len(), size_of::<T>());
    // SAFETY: numbers, null pointers and null functions: any bytes of C's struct are one of Rust's.
    format!("{:?}", unsafe { bytes.as_ptr().cast::<T>().read_unaligned() })
}

/// The header's defaults are the library's.
#[test]
fn inline_functions_set_the_librarys_defaults() {
    type Shown = fn(&[u8]) -> String;
    macro_rules! structs {
        ($($name:ident $(($argument:literal))?),*) => {
            [$((
                stringify!($name),
                concat!("" $(, ", ", $argument)?),
                size_of::<blik::$name>(),
                shown::<blik::$name> as Shown,
                format!("{:?}", blik::$name::default()),
            )),*]
        };
    }
    // a report or info has its size alone set, and is not here
    let all = structs![
        blik_run,
        blik_mesh,
        blik_ray,
        blik_intersector,
        blik_settings,
        blik_sky,
        blik_sun,
        blik_light,
        blik_camera,
        blik_tally,
        blik_rounds("2e-3"),
        blik_plane_material,
        blik_plane_body,
        blik_plane_bodies,
        blik_plane_settings,
        blik_plane_sky,
        blik_plane_sun,
        blik_plane_light
    ];
    let mut source = String::from("#include <blik_plane.h>\n#include <stdio.h>\nint main(void) {\n");
    for (name, argument, ..) in &all {
        source += &format!(
            "    {{ static {name} value; {name}_init(&value{argument}); fwrite(&value, sizeof value, 1, stdout); }}\n"
        );
    }
    source += "    return 0;\n}\n";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("defaults.c");
    std::fs::write(&file, source).unwrap();
    let program = folder.path().join("defaults");
    let mut command = Command::new("cc");
    command.arg("-I").arg(root().join("include")).arg(&file).arg("-o").arg(&program);
    let compiled = command.output().unwrap();
    assert!(compiled.status.success(), "{}", text(&compiled));
    let bytes = Command::new(&program).output().unwrap().stdout;
    let mut rest = &bytes[..];
    for (name, _, size, shown, expected) in &all {
        let (own, after) = rest.split_at(*size);
        assert_eq!(shown(own), *expected, "{name}");
        rest = after;
    }
    assert!(rest.is_empty());
    // and none is left out that sets more than its size
    let counted = header().matches("static inline void blik_").count()
        - header().matches("Sets struct_size of").count();
    assert_eq!(counted, all.len());
}

#[test]
fn the_smallest_program_in_c_has_at_most_fifty_lines_and_runs() {
    let source = root().join("ffi/examples/minimal.c");
    assert!(std::fs::read_to_string(&source).unwrap().lines().count() <= 50);
    let printed = run("cc", "c99", &source, Link::Static, &[]);
    let lines: Vec<&str> = printed.lines().collect();
    assert!(lines.len() == 24 && lines.iter().all(|line| line.len() == 48), "{printed}");
    // the sky around, and a floor that is darker
    assert!(lines[0].contains('@') && lines[14].contains('='), "{printed}");
}

#[test]
fn the_readme_shows_a_program_of_at_most_forty_lines_that_runs() {
    let source = root().join("ffi/examples/minimal.cpp");
    let program = std::fs::read_to_string(&source).unwrap();
    assert!(program.lines().count() <= 40);
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.contains(&format!("```cpp\n{program}```")), "README.md shows another program");
    if knows("c++", "c++17") {
        let printed = run("c++", "c++17", &source, Link::Static, &[]);
        assert!(printed.lines().count() == 25 && printed.contains("error estimate"), "{printed}");
    }
}

#[test]
fn the_examples_do_what_they_say() {
    let examples = root().join("ffi/examples");
    if knows("c++", "c++17") {
        let table = run("c++", "c++17", &examples.join("light_curve.cpp"), Link::Shared, &["3"]);
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines.len() == 4 && lines[0].starts_with("seconds,roll_deg,"), "{table}");
        for line in &lines[1..] {
            let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            // about 12 square metres of wings and body, seen obliquely, under a sky of radiance 1 and a sun of pi
            assert!(values.len() == 6 && values[3] > 0.05 && values[3] < 20.0, "{line}");
            assert!(values[4] > 2.0 && values[4] < 8.0, "{line}");
        }
    }
    if knows("c++", "c++17") {
        let printed = run("c++", "c++17", &examples.join("memory.cpp"), Link::Static, &["0.1"]);
        assert!(printed.starts_with("1058 facets at 0.1, bytes a facet: scene "), "{printed}");
    }
    let folder = tempfile::tempdir().unwrap();
    let pictures = ["1", "3"].map(|threads| {
        let file = folder.path().join(threads);
        let arguments = [file.to_str().unwrap(), threads];
        let printed = run("cc", "c99", &examples.join("threaded.c"), Link::Shared, &arguments);
        assert!(printed.contains("pixels of the craft"), "{printed}");
        std::fs::read(file).unwrap()
    });
    assert_eq!(pictures[0].len(), 15 + 320 * 240);
    assert!(pictures[0] == pictures[1], "the picture depends on the number of threads");
}

/// All headers, one after the other.
fn header() -> String {
    let read = |name| std::fs::read_to_string(root().join("include").join(name)).unwrap();
    ["blik.h", "blik_form_factor.h", "blik_lights.h", "blik_plane.h", "blik_update.h"].map(read).concat()
}

/// The header without comments, its white space single blanks.
fn bare() -> String {
    let mut text = header();
    while let Some(start) = text.find("/*") {
        let end = text[start..].find("*/").unwrap() + start + 2;
        text.replace_range(start..end, " ");
    }
    let lines = text.lines().filter(|l| !l.trim_start().starts_with('#'));
    let lines = lines.map(|l| l.split("//").next().unwrap());
    lines.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

/// Prototypes of all functions of the library.
fn prototypes() -> Vec<String> {
    bare().split(';').filter_map(|s| s.split("BLIK_API ").nth(1)).map(|s| s.trim().to_string()).collect()
}

fn name(prototype: &str) -> String {
    let head = prototype.split('(').next().unwrap();
    head.rsplit([' ', '*']).next().unwrap().to_string()
}

/// Symbols that a program can link with.
fn symbols(arguments: &[&str], file: &str) -> BTreeSet<String> {
    let output = Command::new("nm").args(arguments).arg(library().join(file)).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().filter_map(|l| l.split_whitespace().nth(2)).map(String::from).collect()
}

#[test]
fn the_shared_library_has_a_soname() {
    let output = Command::new("readelf").arg("-d").arg(library().join("libblik.so")).output().unwrap();
    assert!(text(&output).contains(&format!("soname: [{SONAME}]")), "{}", text(&output));
    let [major, minor] = [env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR")];
    assert_eq!(SONAME, format!("libblik.so.{major}.{minor}"));
}

#[test]
fn symbols_are_what_the_header_declares() {
    let declared: BTreeSet<String> = prototypes().iter().map(|p| name(p)).collect();
    assert!(declared.len() > 30, "{declared:?}");
    assert_eq!(symbols(&["-D", "--defined-only"], "libblik.so"), declared);
    let archive: BTreeSet<String> = symbols(&["--defined-only", "-g"], "libblik.a");
    let own: BTreeSet<String> = archive.into_iter().filter(|s| s.starts_with("blik_")).collect();
    assert_eq!(own, declared);
}

/// Names and members of all structs.
fn structs() -> Vec<(String, Vec<String>)> {
    let bare = bare();
    let mut all = Vec::new();
    for part in bare.split("typedef struct ").skip(1) {
        let (Some(open), Some(close)) = (part.find('{'), part.find('}')) else { continue };
        if part.find(';').is_some_and(|end| end < open) {
            continue; // an opaque one
        }
        let members = part[open + 1..close].split(';').map(str::trim).filter(|m| !m.is_empty());
        let member = |m: &str| m.split('[').next().unwrap().rsplit([' ', '*']).next().unwrap().to_string();
        all.push((part[..open].trim().to_string(), members.map(member).collect()));
    }
    all
}

/// Sizes and offsets as the C compiler has them, constants and prototypes as the header has them.
fn interface() -> String {
    let mut source = String::from(
        "#include <blik_form_factor.h>\n#include <blik_lights.h>\n#include <blik_plane.h>\n#include <blik_update.h>\n\
        #include <stdio.h>\n\
        int main(void) {\n",
    );
    for (name, members) in structs() {
        source += &format!("    printf(\"struct {name}: %zu\\n\", sizeof({name}));\n");
        for member in members {
            let width = format!("sizeof((({name} *)0)->{member})");
            source += &format!(
                "    printf(\"    {member}: %zu + %zu\\n\", offsetof({name}, {member}), {width});\n"
            );
        }
    }
    source += "    return 0;\n}\n";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("layout.c");
    std::fs::write(&file, source).unwrap();
    let program = folder.path().join("layout");
    let mut command = Command::new("cc");
    command.arg("-I").arg(root().join("include")).arg(&file).arg("-o").arg(&program);
    let compiled = command.output().unwrap();
    assert!(compiled.status.success(), "{}", text(&compiled));
    let mut all = String::from_utf8(Command::new(&program).output().unwrap().stdout).unwrap();
    let header = header();
    let constants = header.lines().filter(|l| l.starts_with("#define BLIK_") && l.split(' ').count() == 3);
    constants.filter(|l| !l.contains("VERSION")).for_each(|l| all += &format!("{l}\n"));
    let choices = header.lines().filter(|l| l.starts_with("    BLIK_") && l.contains(" = "));
    choices.for_each(|l| all += &format!("{}\n", l.split(',').next().unwrap().trim()));
    prototypes().iter().for_each(|p| all += &format!("{p}\n"));
    all
}

/// Layouts are those of 64-bit machines; members added to a struct, other numbers, another prototype: all show.
#[cfg(target_arch = "x86_64")]
#[test]
fn the_interface_is_that_of_the_baseline() {
    let path = root().join("tests/data/abi/x86_64.txt");
    let now = interface();
    if std::env::var_os("UPDATE_ABI").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    let (now, kept): (BTreeSet<&str>, BTreeSet<&str>) = (now.lines().collect(), kept.lines().collect());
    let gone: Vec<_> = kept.difference(&now).collect();
    let new: Vec<_> = now.difference(&kept).collect();
    assert!(gone.is_empty(), "the interface changed in a way that breaks programs; gone:\n{gone:#?}");
    assert!(new.is_empty(), "UPDATE_ABI=1 cargo test --test c_library notes what is new:\n{new:#?}");
}
