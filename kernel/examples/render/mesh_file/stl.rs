//! STL, binary and text.
//!
//! Parsers of their own: `stl_io` rounds decimals to f32, takes a binary file whose header begins with "solid" for text,
//! and reads no variants. STL lists bare corners: corners of equal coordinates become one vertex.

use std::collections::HashMap;
use std::path::Path;

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};
use crate::text_file;

/// Bytes of header and count of a binary file.
const HEAD: usize = 84;
/// Bytes of one triangle of a binary file: a normal, three corners, two bytes of attributes.
const TRIANGLE: usize = 50;

/// Reads an STL file's content.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let mut soup = Soup { builder: Builder::new(path, 0), index: HashMap::new() };
    let promised = bytes.get(80..HEAD).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let needed = promised.map(|n| HEAD + TRIANGLE * n);
    if needed != Some(bytes.len()) && is_text(bytes) {
        Text { path, soup: &mut soup, corners: None, facet: None, normal: None, filled: false }
            .read(&text_file::decode(bytes).content)?;
        return soup.builder.finish();
    }
    match (promised, needed) {
        (Some(0), Some(needed)) if bytes.len() > needed => {
            let what = format!("0 triangles announced, but {} bytes follow", bytes.len() - needed);
            return Err(Failure::at(path, what));
        }
        (Some(count), Some(needed)) if bytes.len() >= needed => {
            binary(&bytes[HEAD..needed], &mut soup);
            if bytes.len() > needed {
                let what = format!(
                    "{} bytes behind the last of {count} triangles: passed over",
                    bytes.len() - needed
                );
                soup.builder.warn_of_file("left over", what);
            }
        }
        (Some(_), Some(needed)) => {
            let what = format!("truncated: expected {needed} bytes, got {}", bytes.len());
            return Err(Failure::at(path, what));
        }
        _ => return Err(Failure::at(path, "not an STL file: expected text or 84 bytes or more")),
    }
    soup.builder.finish()
}

/// Whether these bytes are text of STL's words. A binary file's count and corners hold zero bytes.
fn is_text(bytes: &[u8]) -> bool {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return true;
    }
    let start = text_file::without_mark(bytes);
    let start = &start[..start.len().min(1 << 16)];
    let holds = |word: &[u8]| start.windows(word.len()).any(|part| part.eq_ignore_ascii_case(word));
    !start.contains(&0) && (holds(b"facet") || holds(b"solid"))
}

struct Soup<'a> {
    builder: Builder<'a>,
    index: HashMap<[u64; 3], i64>,
}

impl Soup<'_> {
    fn corner(&mut self, place: Place, position: [f64; 3]) -> Corner {
        // + 0.0 makes one of the two zeros.
        let key = position.map(|x| (x + 0.0).to_bits());
        let next = self.builder.vertices() as i64;
        let vertex = *self.index.entry(key).or_insert(next);
        if vertex == next {
            self.builder.vertex(place, "facet", position);
        }
        Corner { vertex, normal: None }
    }

    /// Adds a facet; `normal` is what the file says of it.
    fn facet(&mut self, place: Place, corners: &[(Place, [f64; 3])], normal: Option<[f64; 3]>) {
        if let (Some(normal), [a, b, c]) = (normal, corners) {
            let [a, b, c, normal] = [a.1, b.1, c.1, normal].map(glam::DVec3::from);
            let front = (b - a).cross(c - a);
            // Rounded normals of slivers may lean anywhere.
            if front.dot(normal) < -0.5 * front.length() * normal.length() {
                let what = "the facet's normal points to its back: the order of its corners counts";
                self.builder.warn("turned normal", place, "facet", what);
            }
        }
        let corners: Vec<Corner> = corners.iter().map(|(at, corner)| self.corner(*at, *corner)).collect();
        let material = self.builder.material("default");
        self.builder.polygon(place, corners, material);
    }
}

fn binary(triangles: &[u8], soup: &mut Soup) {
    for (index, triangle) in triangles.as_chunks::<TRIANGLE>().0.iter().enumerate() {
        let float = |i: usize| {
            let bytes = &triangle[4 * i..4 * i + 4];
            f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        };
        let [normal, a, b, c] = [0, 3, 6, 9].map(|at| [float(at), float(at + 1), float(at + 2)]);
        if triangle[48..] != [0, 0] {
            let what = "attributes (a colour, as some programs write it) are not applied";
            soup.builder.warn("attributes", Place::Item(index), "facet", what);
        }
        let place = Place::Item(index);
        soup.facet(place, &[(place, a), (place, b), (place, c)], Some(normal));
    }
}

/// A text file's parser. Words count, not lines, but for names, which end with their line.
struct Text<'a, 'b> {
    path: &'a Path,
    soup: &'a mut Soup<'b>,
    /// The corners of an open loop.
    corners: Option<Vec<(Place, [f64; 3])>>,
    /// The line of an open facet.
    facet: Option<usize>,
    normal: Option<[f64; 3]>,
    /// Whether the open facet has had its corners.
    filled: bool,
}

impl Text<'_, '_> {
    fn read(&mut self, text: &str) -> Outcome<()> {
        for (line, content) in text_file::lines(text) {
            let words: Vec<&str> = content.split_whitespace().collect();
            let mut at = 0;
            while at < words.len() {
                at += self.word(line, &words[at..])?;
            }
        }
        match self.facet {
            None => Ok(()),
            Some(line) => {
                let what = "truncated: expected endfacet before the end of the file";
                Err(Failure::at_line(self.path, line, what))
            }
        }
    }

    /// Takes what begins with the first of `words`, which are the rest of a line; returns how many that were.
    fn word(&mut self, line: usize, words: &[&str]) -> Outcome<usize> {
        let lower = |i: usize| words.get(i).map(|word| word.to_ascii_lowercase()).unwrap_or_default();
        let (first, second) = (lower(0), lower(1));
        // "end loop" is read like "endloop".
        let (word, length) = match (first.as_str(), second.as_str()) {
            ("end", "loop" | "facet" | "solid") => (format!("end{second}"), 2),
            ("outer", "loop") | ("facet", "normal") => (first, 2),
            _ => (first, 1),
        };
        match word.as_str() {
            "solid" | "endsolid" => {
                // The name is free text, but for a file in one line.
                let facet = |pair: &[&str]| {
                    pair[0].eq_ignore_ascii_case("facet") && pair[1].eq_ignore_ascii_case("normal")
                };
                return Ok(words.windows(2).position(facet).unwrap_or(words.len()));
            }
            "facet" => {
                if let Some(open) = self.facet {
                    self.warn(
                        line,
                        "open facet",
                        format_args!("expected endfacet of the facet in line {open}"),
                    );
                }
                self.end(line)?;
                (self.facet, self.filled) = (Some(line), false);
                let given = words[length..].iter().take(3).map(|word| word.parse().ok());
                // Normals that are no numbers say nothing.
                let normal: Option<Vec<f64>> = given.collect();
                self.normal = normal.and_then(|normal| normal.try_into().ok());
                let rest = words[length..].iter().take(3);
                let is_normal =
                    |word: &&&str| !["outer", "vertex"].contains(&word.to_ascii_lowercase().as_str());
                return Ok(length + rest.take_while(is_normal).count());
            }
            "outer" => self.corners = Some(Vec::new()),
            "vertex" => {
                let numbers: Option<Vec<f64>> =
                    words[1..].iter().take(3).map(|word| word.parse().ok()).collect();
                let position = numbers.and_then(|numbers| numbers.try_into().ok());
                let position = position.ok_or_else(|| {
                    let got = words.join(" ");
                    Failure::at_line(
                        self.path,
                        line,
                        format_args!("expected vertex with three numbers, got {got:.80?}"),
                    )
                })?;
                if self.corners.is_none() {
                    self.warn(line, "no loop", "expected outer loop before a vertex");
                }
                self.facet.get_or_insert(line);
                self.corners.get_or_insert_default().push((Place::Line(line), position));
                return Ok(4);
            }
            // One that is too short waits for endfacet.
            "endloop" => {
                if self.corners.as_ref().is_some_and(|corners| corners.len() >= 3) {
                    self.end(line)?;
                    self.filled = true;
                }
            }
            "endfacet" => {
                if self.facet.take().is_some() && !self.filled {
                    self.corners.get_or_insert_default();
                }
                self.end(line)?;
                self.filled = false;
            }
            _ => {
                let got = words.join(" ");
                let expected = "expected solid, facet, outer loop, vertex, endloop, endfacet or endsolid";
                self.warn(line, "unknown", format_args!("{expected}, got {got:.80?}: passed over"));
                return Ok(words.len());
            }
        }
        Ok(length)
    }

    /// Takes the corners of the loop, which ends here.
    fn end(&mut self, line: usize) -> Outcome<()> {
        let Some(corners) = self.corners.take() else { return Ok(()) };
        if corners.len() < 3 {
            let what = format!("expected three vertices before, got {}", corners.len());
            return Err(Failure::at_line(self.path, line, what));
        }
        if corners.len() > 3 {
            let what = format!("a facet of {} vertices: read as a polygon", corners.len());
            self.warn(line, "polygon", what);
        }
        let normal = self.normal;
        self.soup.facet(Place::Line(line), &corners, normal);
        Ok(())
    }

    fn warn(&mut self, line: usize, kind: &'static str, what: impl std::fmt::Display) {
        self.soup.builder.warn(kind, Place::Line(line), "", what);
    }
}
