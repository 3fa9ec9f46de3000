//! PLY, text and binary of both byte orders.
//!
//! A parser of its own: crates for it refuse blank lines, byte order marks and numbers in columns that nobody reads, and
//! their errors quote the whole line without its number.

mod body;
mod header;

use std::path::Path;

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};
use crate::text_file;
use body::{Body, Row};
use header::{Element, Header};

/// Names of the list of corners, all in use.
const CORNERS: [&str; 3] = ["vertex_indices", "vertex_index", "vertex_indexes"];
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
/// Elements without facets.
const OTHERS: [&str; 5] = ["edge", "camera", "material", "obj_info", "range_grid"];

/// Reads a PLY file's content. All facets are of material "default": the format has no names for them.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let decoded;
    let bytes = match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => {
            decoded = text_file::decode(bytes).content.into_owned().into_bytes();
            &decoded
        }
        _ => text_file::without_mark(bytes),
    };
    let header = Header::read(bytes).map_err(|(line, what)| Failure::at_line(path, line, what))?;
    let mut body = Body::new(&bytes[header.length..], &header);
    let mut reader = Reader { path, builder: Builder::new(path, 0), with_normals: false };
    for element in &header.elements {
        let rows = reader.element(element, &mut body);
        rows.map_err(|what| reader.builder.fail(body.place(), &element.name, what))?;
    }
    if let Some(what) = body.left_over() {
        reader.builder.warn_of_file("left over", what);
    }
    if !header.elements.iter().any(|element| element.name == "face" || element.name == "tristrips") {
        return Err(Failure::at(path, "expected an element face: this is a cloud of points"));
    }
    reader.builder.finish()
}

struct Reader<'a> {
    path: &'a Path,
    builder: Builder<'a>,
    with_normals: bool,
}

impl Reader<'_> {
    /// Reads the rows of one element. The error is a sentence without a place.
    fn element(&mut self, element: &Element, body: &mut Body) -> Result<(), String> {
        match element.name.as_str() {
            "vertex" => self.vertices(element, body),
            "face" => self.faces(element, body, false),
            "tristrips" => self.faces(element, body, true),
            name => {
                if !OTHERS.contains(&name) {
                    let what =
                        format_args!("{}: element {name} is unknown: passed over", self.path.display());
                    self.builder.warn_of_file("unknown element", what);
                }
                body.rows(element, &[], &mut self.builder, |_, _, _| {})
            }
        }
    }

    fn vertices(&mut self, element: &Element, body: &mut Body) -> Result<(), String> {
        let column = |name: &&str| element.scalar(name);
        let position: Vec<usize> = POSITION.iter().filter_map(column).collect();
        if position.len() < 3 {
            return Err(format!(
                "expected the properties x, y and z of element vertex, got {}",
                element.columns()
            ));
        }
        let normal: Vec<usize> = NORMAL.iter().filter_map(column).collect();
        self.with_normals = normal.len() == 3;
        let wanted: Vec<usize> = position.iter().chain(&normal).copied().collect();
        let with_normals = self.with_normals;
        body.rows(element, &wanted, &mut self.builder, |builder, place, row| {
            let vector = |columns: &[usize]| [0, 1, 2].map(|axis| row.scalar(columns[axis]));
            builder.vertex(place, "vertex", vector(&position));
            if with_normals {
                builder.normal(place, vector(&normal));
            }
        })
    }

    fn faces(&mut self, element: &Element, body: &mut Body, strips: bool) -> Result<(), String> {
        let Some(corners) = CORNERS.iter().find_map(|name| element.list(name)) else {
            if element.count == 0 {
                return Ok(());
            }
            return Err(format!(
                "expected the list property vertex_indices of element {}, got {}",
                element.name,
                element.columns()
            ));
        };
        if element.properties.iter().any(|property| property.name.starts_with("material")) {
            let what = "materials of the faces are not applied: all facets are of material \"default\"";
            self.builder.warn_of_file("materials", what);
        }
        let material = self.builder.material("default");
        let with_normals = self.with_normals;
        let corner = move |vertex: i64| Corner { vertex, normal: with_normals.then_some(vertex) };
        body.rows(element, &[corners], &mut self.builder, |builder, place, row: &Row| {
            if strips {
                for triangle in triangles(row.list()) {
                    builder.polygon(place, triangle.map(corner), material);
                }
            } else {
                builder.polygon(place, row.list().iter().copied().map(corner), material);
            }
        })
    }
}

/// The triangles of strips that are divided by -1; every second one runs the other way.
fn triangles(strips: &[i64]) -> impl Iterator<Item = [i64; 3]> {
    strips.split(|index| *index == -1).flat_map(|strip| {
        strip.windows(3).enumerate().map(|(i, abc)| match i % 2 {
            0 => [abc[0], abc[1], abc[2]],
            _ => [abc[1], abc[0], abc[2]],
        })
    })
}

/// How messages name a row.
fn place(line: Option<usize>, row: usize) -> Place {
    line.map_or(Place::Item(row), Place::Line)
}
