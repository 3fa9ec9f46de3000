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

/// The files that a page names in backticks, each with the items named in brackets behind it.
fn places(page: &str) -> Vec<(String, Vec<String>)> {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for cell in page.lines().filter(|line| line.starts_with('|')).flat_map(|line| line.split('|')) {
        // the odd parts stand in backticks
        let mut inside = false;
        for (number, part) in cell.split('`').enumerate() {
            if number % 2 == 0 {
                inside = part.trim_end().ends_with('(') || inside && !part.contains(')');
            } else if part.ends_with(".rs") {
                found.push((part.to_string(), Vec::new()));
                inside = false;
            } else if inside && let Some((_, items)) = found.last_mut() {
                items.push(part.rsplit("::").next().unwrap().to_string());
            }
        }
    }
    found
}

#[test]
fn the_readme_names_files_and_items_that_are_there() {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = above.map(Path::to_path_buf).find(|p| p.join("kernel/src").is_dir()).unwrap();
    let mut faults = Vec::new();
    let mut items_checked = 0;
    for page in ["kernel/README.md", ".github/CONTRIBUTING.md"] {
        let text = fs::read_to_string(root.join(page)).unwrap();
        let places = places(&text);
        assert!(places.len() > 20, "{page}: {} files", places.len());
        for (file, items) in places {
            // a wing's own table names files below the wing
            let wings = ORDER.iter().map(|wing| root.join("kernel/src").join(wing));
            let folders = ["", "kernel/src", "kernel/src/scene"].map(|folder| root.join(folder));
            let mut folders = folders.into_iter().chain(wings);
            let found = folders.find_map(|folder| Some(folder.join(&file)).filter(|path| path.is_file()));
            let Some(path) = found else {
                let parts = ["kernel/src", "kernel/examples"].map(|f| root.join(f));
                let mut all = Vec::new();
                parts.iter().for_each(|folder| files(folder, &mut all));
                if !all.iter().any(|path| path.ends_with(&file)) {
                    faults.push(format!("{page}: no file {file}"));
                }
                continue;
            };
            let source = fs::read_to_string(path).unwrap();
            for item in items {
                items_checked += 1;
                let defined =
                    ["fn ", "struct ", "enum ", "trait ", "const "].map(|kind| format!("{kind}{item}"));
                // words of code stand for themselves
                let is_there = item.contains(' ') && source.contains(&item);
                if !is_there && !defined.iter().any(|d| source.contains(d)) {
                    faults.push(format!("{page}: {file} has no {item}"));
                }
            }
        }
    }
    assert!(faults.is_empty() && items_checked > 8, "{items_checked} items\n{}", faults.join("\n"));
    let row = "| a | `x.rs` (`One`, `Two::three`) | `y.rs` |";
    let both = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
    assert_eq!(places(row), [("x.rs".to_string(), both(&["One", "three"])), ("y.rs".to_string(), vec![])]);
}
