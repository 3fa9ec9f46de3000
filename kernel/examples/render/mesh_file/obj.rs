//! Wavefront OBJ.
//!
//! A parser of its own: `tobj` drops the names of `usemtl` that no material library defines, and its errors
//! name no line. Read are `v`, `vn`, `f` and `usemtl`; a statement that would make other surfaces, or is unknown, is
//! passed over with a warning.

use std::path::Path;

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};
use crate::text_file;

/// Statements that say nothing of facets.
const OTHERS: [&str; 20] = [
    "vt",
    "vp",
    "g",
    "o",
    "s",
    "mg",
    "mtllib",
    "usemap",
    "maplib",
    "lod",
    "bevel",
    "c_interp",
    "d_interp",
    "shadow_obj",
    "trace_obj",
    "l",
    "p",
    "ctech",
    "stech",
    "usemtl",
];
/// Statements of free-form curves and surfaces, and calls of other files.
const SURFACES: [&str; 17] = [
    "surf", "cstype", "deg", "bmat", "step", "curv", "curv2", "parm", "trim", "hole", "scrv", "sp", "end",
    "con", "call", "csh", "res",
];
/// Statements whose argument is free text.
const NAMES: [&str; 7] = ["usemtl", "mtllib", "o", "g", "usemap", "maplib", "call"];

/// Reads an OBJ file's content.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let text = text_file::decode(bytes);
    let mut reader = Reader { path, builder: Builder::new(path, 1), material: None };
    for (line, statement) in statements(&text.content) {
        reader.statement(line, &statement)?;
        if !text.unicode && keyword(&statement).0 == "usemtl" && !statement.is_ascii() {
            let what = "not UTF-8: the material's name is read as Latin-1";
            reader.builder.warn("encoding", Place::Line(line), "", what);
        }
    }
    reader.builder.finish()
}

struct Reader<'a> {
    path: &'a Path,
    builder: Builder<'a>,
    material: Option<String>,
}

impl Reader<'_> {
    fn statement(&mut self, line: usize, statement: &str) -> Outcome<()> {
        let fail = |what: String| Failure::at_line(self.path, line, what);
        let place = Place::Line(line);
        let (keyword, rest) = keyword(statement);
        let mut tokens = rest.split('#').next().unwrap_or("").split_whitespace();
        match keyword.as_str() {
            "" => {}
            "v" => self.builder.vertex(place, "vertex", vector(&mut tokens).map_err(fail)?),
            "vn" => match vector(&mut tokens) {
                Ok(normal) => self.builder.normal(place, normal),
                // Of matter only where normals are asked for.
                Err(what) => {
                    self.builder.normal(place, [f64::NAN; 3]);
                    self.builder.normal_fault(place, "", format_args!("vertex normal: {what}"));
                }
            },
            "usemtl" => self.material = Some(self.name(line, rest)).filter(|name| !name.is_empty()),
            "mtllib" => self.builder.library(rest.trim()),
            // "fo" is an older word for "f".
            "f" | "fo" => {
                let counts = (self.builder.vertices(), self.builder.normals());
                let corners: Vec<(Corner, Option<String>)> =
                    tokens.map(|token| corner(token, counts)).collect::<Result<_, _>>().map_err(fail)?;
                for fault in corners.iter().filter_map(|(_, fault)| fault.as_ref()) {
                    self.builder.normal_fault(place, "face", fault);
                }
                let material = self.builder.material(self.material.as_deref().unwrap_or("default"));
                self.builder.polygon(place, corners.into_iter().map(|(corner, _)| corner), material);
            }
            word if OTHERS.contains(&word) => {}
            word if SURFACES.contains(&word) => {
                let what = format_args!("free-form geometry ({word}) is not supported: passed over");
                self.builder.warn("free form", place, "", what);
            }
            word => {
                let what = format_args!("unknown statement {word:?}: passed over");
                self.builder.warn("unknown statement", place, "", what);
            }
        }
        Ok(())
    }

    /// A material's name: it may hold spaces and '#', but a '#' between spaces begins a comment.
    fn name(&mut self, line: usize, rest: &str) -> String {
        let rest = rest.trim();
        let comment = rest.match_indices('#').map(|(at, _)| at).find(|at| {
            let space = |text: Option<char>| text.is_none_or(char::is_whitespace);
            space(rest[..*at].chars().next_back()) && space(rest[at + 1..].chars().next())
        });
        let Some(at) = comment else { return rest.to_owned() };
        let name = rest[..at].trim_end();
        let what = format_args!("what follows '#' is taken for a comment: the material is called {name:?}");
        self.builder.warn("comment in a name", Place::Line(line), "", what);
        name.to_owned()
    }
}

/// The first word in lower case, and what follows it.
fn keyword(statement: &str) -> (String, &str) {
    let end = statement.find(|c: char| c.is_whitespace() || c == '#').unwrap_or(statement.len());
    (statement[..end].to_ascii_lowercase(), &statement[end..])
}

/// The statements with the number of their first line; a line that ends in `\` goes on in the next, unless it is a comment,
/// or a name with a statement behind it.
fn statements(text: &str) -> impl Iterator<Item = (usize, String)> {
    let mut lines = text_file::lines(text).peekable();
    std::iter::from_fn(move || {
        let (line, first) = lines.next()?;
        let mut statement = first.trim().to_owned();
        let of_names = NAMES.contains(&keyword(&statement).0.as_str());
        while statement.ends_with('\\') && (of_names || !statement.contains('#')) {
            let goes_on = lines.peek().is_some_and(|(_, next)| !of_names || !is_statement(next));
            if !goes_on {
                break;
            }
            statement.pop();
            statement.push(' ');
            statement.extend(lines.next().map(|(_, next)| next.trim()));
        }
        if !of_names && statement.ends_with('\\') && !statement.contains('#') {
            // The file ends here.
            statement.pop();
        }
        Some((line, statement))
    })
}

/// Whether a line begins a statement of its own.
fn is_statement(line: &str) -> bool {
    let (word, _) = keyword(line.trim());
    word.is_empty()
        || ["v", "vn", "f", "fo"].iter().chain(&OTHERS).chain(&SURFACES).any(|known| word == *known)
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

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or from -1 backwards; and what is wrong with the normal.
fn corner(token: &str, (vertices, normals): (usize, usize)) -> Result<(Corner, Option<String>), String> {
    let parts: Vec<&str> = token.split('/').collect();
    let whole = |text: &str| {
        let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
        !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
    };
    let normal = parts.get(2).filter(|text| !text.is_empty());
    if parts.len() > 3 || !whole(parts[0]) || normal.is_some_and(|text| !whole(text)) {
        return Err(format!("expected a corner as in 1, 1/2, 1//3 or 1/2/3, got {token:?}"));
    }
    let vertex = index("vertex", parts[0], vertices)?;
    // Normals are of matter only where they are asked for.
    let (normal, fault) = match normal.map(|text| index("normal", text, normals)) {
        None => (None, None),
        Some(Ok(index)) => (Some(index), None),
        Some(Err(what)) => (None, Some(what)),
    };
    Ok((Corner { vertex, normal }, fault))
}

/// Counted from 0; one beyond the items so far may be given later.
fn index(what: &str, text: &str, count: usize) -> Result<i64, String> {
    // Fewer than 2^32 are read.
    let index = match text.parse::<i64>().ok().filter(|i| i.abs() < 1 << 40) {
        Some(i) if i < 0 => Some(count as i64 + i).filter(|i| *i >= 0),
        Some(i) => Some(i - 1),
        None => None,
    };
    index.ok_or_else(|| {
        let range = match count {
            0 => "none is given before it".into(),
            n => format!("expected 1 to {n}, or -1 to -{n}"),
        };
        format!("{what} index {text} is out of range: {range}")
    })
}
