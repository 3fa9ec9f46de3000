//! Material libraries of OBJ files: `Kd`, `Ks` and `Ke` as values to start from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::Finish;
use crate::failure::{Failure, Warnings};
use crate::text_file;

/// Adds the materials of the libraries that a line `mtllib` of the file at `path` names.
pub fn read(path: &Path, names: &str, finishes: &mut BTreeMap<String, Finish>, warnings: &mut Warnings) {
    let folder = path.parent().unwrap_or(Path::new(""));
    for file in files(folder, names) {
        match std::fs::read(&file) {
            Ok(bytes) => library(&file, &bytes, finishes, warnings),
            Err(error) => warnings.append(Warnings::of(Failure::at(&file, error))),
        }
    }
}

/// The line is one name with spaces, or several names between spaces: the first if there is such a file.
fn files(folder: &Path, names: &str) -> Vec<PathBuf> {
    let place = |name: &str| folder.join(name.replace('\\', "/"));
    let whole = place(names);
    if whole.exists() { vec![whole] } else { names.split_whitespace().map(place).collect() }
}

fn library(path: &Path, bytes: &[u8], finishes: &mut BTreeMap<String, Finish>, warnings: &mut Warnings) {
    let text = text_file::decode(bytes);
    let mut current: Option<&mut Finish> = None;
    for (line, content) in text_file::lines(&text.content) {
        let content = content.trim();
        let (keyword, rest) = content.split_once(char::is_whitespace).unwrap_or((content, ""));
        let keyword = keyword.to_ascii_lowercase();
        if keyword == "newmtl" {
            current = Some(finishes.entry(rest.trim().to_owned()).insert_entry(Finish::default()).into_mut());
            continue;
        }
        let Some(finish) = current.as_deref_mut() else { continue };
        let slot = match keyword.as_str() {
            "kd" => &mut finish.diffuse,
            "ks" => &mut finish.specular,
            "ke" => &mut finish.emission,
            _ => continue,
        };
        match colour(rest) {
            Some(colour) => *slot = colour,
            None => warnings.add("colour", || {
                let what = format!("{content:.60?}: expected one number or three: taken as 0");
                Failure::at_line(path, line, what)
            }),
        }
    }
}

/// Red, green and blue; one number is all three.
fn colour(text: &str) -> Option<[f64; 3]> {
    let text = text.split('#').next().unwrap_or("");
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    let colour = match numbers?[..] {
        [grey] => [grey; 3],
        [r, g, b] => [r, g, b],
        _ => return None,
    };
    colour.iter().all(|x| x.is_finite() && *x >= 0.0).then_some(colour)
}
