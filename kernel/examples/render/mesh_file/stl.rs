//! STL, binary and text.
//!
//! Binary files through `stl_io`; text by a parser of its own, since `stl_io` rounds decimals to f32 and
//! takes a binary file whose header begins with "solid" for text. STL lists bare corners: corners of equal
//! coordinates become one vertex.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};

/// Bytes of header and count of a binary file.
const HEAD: usize = 84;
/// Bytes of one triangle of a binary file.
const TRIANGLE: usize = 50;

/// Reads an STL file's content.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let mut soup = Soup { builder: Builder::new(path, 0), index: HashMap::new() };
    let promised = bytes.get(80..HEAD).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let needed = promised.map(|n| HEAD + TRIANGLE * n);
    if needed == Some(bytes.len()) || !begins_solid(bytes) {
        match needed {
            Some(needed) if bytes.len() >= needed => binary(path, bytes, &mut soup)?,
            Some(needed) => {
                let what = format!("truncated: expected {needed} bytes, got {}", bytes.len());
                return Err(Failure::at(path, what));
            }
            None => return Err(Failure::at(path, "not an STL file: expected text or 84 bytes or more")),
        }
    } else {
        text(path, &String::from_utf8_lossy(bytes), &mut soup)?;
    }
    soup.builder.finish()
}

fn begins_solid(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

struct Soup<'a> {
    builder: Builder<'a>,
    index: HashMap<[u64; 3], i64>,
}

impl Soup<'_> {
    fn corner(&mut self, place: Place, position: [f64; 3]) -> Outcome<Corner> {
        // + 0.0 makes one of the two zeros.
        let key = position.map(|x| (x + 0.0).to_bits());
        let next = self.builder.vertices() as i64;
        let vertex = *self.index.entry(key).or_insert(next);
        if vertex == next {
            self.builder.vertex(place, position)?;
        }
        Ok(Corner { vertex, normal: None })
    }

    fn triangle(&mut self, place: Place, corners: Vec<Corner>) -> Outcome<()> {
        let material = self.builder.material("default");
        self.builder.polygon(place, corners, material)
    }
}

fn binary(path: &Path, bytes: &[u8], soup: &mut Soup) -> Outcome<()> {
    // The header is free text: blanked, so that it is not mistaken for a text file's.
    let mut bytes = bytes.to_vec();
    bytes[..80].fill(0);
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(|e| Failure::at(path, e))?;
    for (index, triangle) in triangles.enumerate() {
        let triangle = triangle.map_err(|e| Failure::at(path, format_args!("facet {index}: {e}")))?;
        let corners = triangle
            .vertices
            .map(|v| soup.corner(Place::Item(index), v.0.map(f64::from)))
            .into_iter()
            .collect::<Outcome<_>>()?;
        soup.triangle(Place::Item(index), corners)?;
    }
    Ok(())
}

fn text(path: &Path, text: &str, soup: &mut Soup) -> Outcome<()> {
    let mut corners: Option<Vec<Corner>> = None;
    for (index, content) in text.lines().enumerate() {
        let line = index + 1;
        let fail = |expected: &str| Failure::at_line(path, line, format_args!("{expected}, got {content:?}"));
        let mut tokens = content.split_whitespace();
        let Some(keyword) = tokens.next() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "solid" | "facet" | "endloop" | "endsolid" => {}
            "outer" => corners = Some(Vec::new()),
            "vertex" => {
                let numbers: Vec<f64> = tokens.filter_map(|token| token.parse().ok()).collect();
                let position = numbers.try_into().map_err(|_| fail("expected vertex with three numbers"))?;
                let corner = soup.corner(Place::Line(line), position)?;
                corners.as_mut().ok_or_else(|| fail("expected outer loop before a vertex"))?.push(corner);
            }
            "endfacet" => match corners.take() {
                Some(corners) if corners.len() == 3 => soup.triangle(Place::Line(line), corners)?,
                _ => return Err(fail("expected three vertices before")),
            },
            _ => {
                return Err(fail("expected solid, facet, outer loop, vertex, endloop, endfacet or endsolid"));
            }
        }
    }
    match corners {
        None => Ok(()),
        Some(_) => Err(Failure::at(path, "truncated: expected endfacet before the end of the file")),
    }
}
