//! Constants of the kernel and the C library: no name stands twice, and each says in a comment what it is. Comments call
//! things by their names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// A constant that is no member of a type: its name, its line, counted from 1, and whether a comment stands above it.
#[derive(Debug, PartialEq)]
struct Constant<'a> {
    name: &'a str,
    line: usize,
    explained: bool,
}

/// The name that a line of code defines as a constant.
fn defined(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let line = line.strip_prefix("pub").map_or(line, |rest| {
        let rest =
            rest.strip_prefix('(').map_or(rest, |rest| rest.split_once(')').map_or(rest, |(_, rest)| rest));
        rest.trim_start()
    });
    let (name, _) = line.strip_prefix("const ")?.split_once(':')?;
    let is_name = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
    (name != "_" && name.chars().all(is_name)).then_some(name)
}

/// The constants of a source file. Members of types (`Path::DEEPEST`) are told apart by their type and left out.
fn constants(source: &str) -> Vec<Constant<'_>> {
    let mut found = Vec::new();
    let (mut in_type, mut explained) = (false, false);
    for (number, line) in source.lines().enumerate() {
        let starts = |words: &[&str]| words.iter().any(|word| line.starts_with(word));
        in_type |=
            starts(&["impl", "unsafe impl", "trait ", "pub trait ", "pub(crate) trait ", "macro_rules!"]);
        in_type &= !line.starts_with('}');
        let member = in_type && line.starts_with("    ") && !line.starts_with("     ");
        if let Some(name) = defined(line).filter(|_| !member) {
            // within a function the lines around it say what it is
            let local = line.starts_with(' ');
            found.push(Constant { name, line: number + 1, explained: explained || local });
        }
        let code = line.trim_start();
        explained = code.starts_with("//") || explained && code.starts_with("#[");
    }
    found
}

/// All that is wrong with the constants of some files, given by name and text.
fn faults<'a>(sources: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<String> {
    let (mut places, mut faults) = (BTreeMap::<&str, String>::new(), Vec::new());
    for (file, source) in sources {
        for constant in constants(source) {
            let place = format!("{file}:{}", constant.line);
            if !constant.explained {
                faults.push(format!("{place}: no comment above {}", constant.name));
            }
            if let Some(before) = places.insert(constant.name, place.clone()) {
                faults.push(format!("{place}: {} is also defined in {before}", constant.name));
            }
        }
    }
    faults
}

/// Words in place of a number or a name, with which a comment cannot be read by itself.
const VAGUE: [&str; 3] = ["so many", "so much", "the same of"];

/// The lines of comments that hold one of [`VAGUE`].
fn vague(source: &str) -> Vec<(usize, &str)> {
    let comments =
        source.lines().enumerate().filter_map(|(number, line)| Some((number + 1, line.split_once("//")?.1)));
    let is_vague = |comment: &str| VAGUE.iter().any(|words| comment.to_lowercase().contains(words));
    comments.filter(|(_, comment)| is_vague(comment)).collect()
}

/// The sources of the kernel and the C library, by name and text.
fn sources() -> Vec<(String, String)> {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = above.map(Path::to_path_buf).find(|p| p.join("kernel/src").is_dir()).unwrap();
    let mut all = Vec::new();
    files(&root.join("kernel/src"), &mut all);
    files(&root.join("ffi/src"), &mut all);
    all.sort();
    let read = |path: &PathBuf| {
        (path.strip_prefix(&root).unwrap().display().to_string(), fs::read_to_string(path).unwrap())
    };
    all.iter().map(read).collect()
}

#[test]
fn no_name_stands_twice_and_each_has_a_comment() {
    let sources = sources();
    let count: usize = sources.iter().map(|(_, source)| constants(source).len()).sum();
    assert!(count > 350, "{count} constants in {} files", sources.len());
    let faults = faults(sources.iter().map(|(file, source)| (file.as_str(), source.as_str())));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Words in the names of constants that were tuned, or that bound an error.
const TUNED: [&str; 8] = ["MOST", "LEAST", "FEWEST", "FACTOR", "SHARE", "ERROR", "ROUNDING", "SLACK"];

/// Whether a file of the kernel defines a constant of [`TUNED`] and names no command that measures it, neither above the
/// constant nor on its front.
fn is_unmeasured(source: &str) -> bool {
    let tuned = constants(source).iter().any(|c| TUNED.iter().any(|word| c.name.contains(word)));
    tuned && !source.lines().any(|line| line.contains("//") && line.contains("cargo "))
}

#[test]
fn tuned_constants_name_the_command_that_measures_them() {
    // limits of what is accepted, not tuned
    let limits = ["kernel/src/scene/input.rs"];
    let sources = sources();
    let files = sources.iter().filter(|(file, _)| file.starts_with("kernel") && !limits.contains(&&**file));
    let faults: Vec<_> = files.filter(|(_, source)| is_unmeasured(source)).map(|(file, _)| file).collect();
    assert!(faults.is_empty(), "no command that measures the constants of {faults:?}");
    assert!(is_unmeasured("/// Most rays.\nconst RAYS_MOST: u32 = 1;\n"));
    assert!(!is_unmeasured("/// Most rays: `cargo bench`.\nconst RAYS_MOST: u32 = 1;\n"));
}

#[test]
fn comments_name_what_they_speak_of() {
    let mut faults = Vec::new();
    for (file, source) in &sources() {
        faults.extend(vague(source).into_iter().map(|(line, comment)| format!("{file}:{line}:{comment}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // the name is code; of the comments the first alone is vague
    assert_eq!(vague("let so_many = 1; // so many\n// rays\n").len(), 1);
}

#[test]
fn a_second_name_and_a_missing_comment_are_found() {
    let one = "/// Rays.\n#[cfg(feature = \"std\")]\npub(crate) const RAYS: usize = 1;\n";
    let other = "impl X {\n    pub const RAYS: X = X;\n}\n\nfn f() {\n    const RAYS: u32 = 2;\n}\nconst MOST: u8 = 1;\n";
    let found = faults([("a", one), ("b", other)].into_iter());
    assert_eq!(found, ["b:6: RAYS is also defined in a:3", "b:8: no comment above MOST"]);
    assert_eq!(constants(one), [Constant { name: "RAYS", line: 3, explained: true }]);
}
