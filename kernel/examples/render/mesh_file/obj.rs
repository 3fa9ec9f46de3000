//! Wavefront OBJ.
//!
//! A parser of its own: `tobj` drops the names of `usemtl` that no material library defines, and its errors
//! name no line. Read are `v`, `vn`, `f` and `usemtl`; all other statements say nothing of facets.

use std::path::Path;

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};

/// Reads an OBJ file's content.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let text = String::from_utf8_lossy(bytes);
    let mut builder = Builder::new(path, 1);
    let mut material: Option<String> = None;
    for (line, statement) in statements(&text) {
        let fail = |what: String| Failure::at_line(path, line, what);
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((&statement, ""));
        let rest_without_comment = rest.split('#').next().unwrap_or("");
        let mut tokens = rest_without_comment.split_whitespace();
        match keyword {
            "v" => builder.vertex(Place::Line(line), vector(&mut tokens).map_err(fail)?)?,
            "vn" => builder.normal(Place::Line(line), vector(&mut tokens).map_err(fail)?)?,
            // A name may hold spaces and '#'.
            "usemtl" => material = Some(rest.trim().to_owned()).filter(|name| !name.is_empty()),
            "f" => {
                let counts = (builder.vertices(), builder.normals());
                let corners: Vec<Corner> =
                    tokens.map(|token| corner(token, counts)).collect::<Result<_, _>>().map_err(fail)?;
                let material = builder.material(material.as_deref().unwrap_or("default"));
                builder.polygon(Place::Line(line), corners, material)?;
            }
            _ => {}
        }
    }
    builder.finish()
}

/// The statements with the number of their first line; a line that ends in `\` goes on in the next.
fn statements(text: &str) -> impl Iterator<Item = (usize, String)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (index, first) = lines.next()?;
        let mut statement = first.trim().to_owned();
        while statement.ends_with('\\') {
            statement.pop();
            let Some((_, next)) = lines.next() else { break };
            statement.push(' ');
            statement.push_str(next.trim());
        }
        Some((index + 1, statement))
    })
}

/// Three numbers; a fourth (weight) and more (colour) are left alone.
fn vector<'a>(tokens: &mut impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let mut vector = [0.0; 3];
    for x in &mut vector {
        let token = tokens.next().ok_or("expected three numbers, got fewer")?;
        *x = token.parse().map_err(|_| format!("expected a number, got {token:?}"))?;
    }
    Ok(vector)
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or from -1 backwards.
fn corner(token: &str, (vertices, normals): (usize, usize)) -> Result<Corner, String> {
    let index = |text: &str, count: usize| match text.parse::<i64>() {
        Ok(i) if i < 0 => Ok(count as i64 + i),
        Ok(i) => Ok(i - 1),
        Err(_) => Err(format!("expected a corner as in 1, 1/2, 1//3 or 1/2/3, got {token:?}")),
    };
    let mut parts = token.split('/');
    let vertex = index(parts.next().unwrap_or(""), vertices)?;
    let normal = parts.nth(1).filter(|text| !text.is_empty());
    Ok(Corner { vertex, normal: normal.map(|text| index(text, normals)).transpose()? })
}
