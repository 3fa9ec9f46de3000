//! The kernel's wings use one another in one direction: a file names its own wing and earlier ones alone.

use std::fs;
use std::path::{Path, PathBuf};

/// The wings in the direction of the data. The plane model uses base, scene and radiosity, and nothing uses it.
const ORDER: [&str; 13] = [
    "base",
    "scene",
    "form_factor",
    "rays",
    "coupling",
    "radiosity",
    "plane",
    "view",
    "settings",
    "rounds",
    "stages",
    "bake",
    "host",
];

/// Wings that no other may name although they stand before it.
const APART: [&str; 1] = ["plane"];

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

/// The wings that a line of code names after `crate::`, comments included.
fn named(line: &str) -> impl Iterator<Item = &str> {
    line.split("crate::").skip(1).map(|rest| {
        let end = rest.find(|c: char| !c.is_ascii_lowercase() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    })
}

/// What is wrong with a line of a file of `wing`, if anything.
fn fault(wing: &str, line: &str) -> Option<String> {
    let place = |w: &str| ORDER.iter().position(|o| *o == w);
    let own = place(wing)?;
    named(line).find_map(|other| match place(other) {
        None => Some(format!("{other} is no wing")),
        Some(at) if at > own => Some(format!("{wing} names {other}, a later wing")),
        Some(_) if APART.contains(&other) && other != wing => Some(format!("{wing} names {other}")),
        Some(_) => None,
    })
}

#[test]
fn files_name_earlier_wings_alone() {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let source = above.map(|p| p.join("kernel/src")).find(|p| p.is_dir()).unwrap();
    let mut all = Vec::new();
    files(&source, &mut all);
    assert!(all.len() > 80, "{} files", all.len());
    let mut faults = Vec::new();
    for path in &all {
        let inside = path.strip_prefix(&source).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_str().unwrap();
        let wing = first.trim_end_matches(".rs");
        if wing == "lib" {
            continue;
        }
        assert!(ORDER.contains(&wing), "{} is in no wing", inside.display());
        for (number, line) in fs::read_to_string(path).unwrap().lines().enumerate() {
            if let Some(fault) = fault(wing, line) {
                faults.push(format!("{}:{}: {fault}", inside.display(), number + 1));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_later_wing_is_found() {
    assert!(fault("rays", "use crate::view::image;").is_some());
    assert!(fault("view", "use crate::plane::scene;").is_some());
    assert!(fault("view", "use crate::rays::bvh::Bvh; use crate::nowhere::X;").is_some());
    assert!(fault("view", "use crate::rays::bvh::Bvh;").is_none());
}
