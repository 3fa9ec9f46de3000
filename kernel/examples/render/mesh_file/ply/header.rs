//! The header: which elements follow, with which properties.

/// How the rows are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Signed(usize),
    Unsigned(usize),
    Single,
    Double,
}

impl Kind {
    /// All names in use; those of 8 bytes and "half" are no part of the format.
    fn of(name: &str) -> Result<Self, String> {
        Ok(match name {
            "char" | "int8" => Kind::Signed(1),
            "uchar" | "uint8" => Kind::Unsigned(1),
            "short" | "int16" => Kind::Signed(2),
            "ushort" | "uint16" => Kind::Unsigned(2),
            "int" | "int32" => Kind::Signed(4),
            "uint" | "uint32" => Kind::Unsigned(4),
            "int64" => Kind::Signed(8),
            "uint64" => Kind::Unsigned(8),
            "float" | "float32" => Kind::Single,
            "double" | "float64" => Kind::Double,
            _ => {
                return Err(format!(
                    "unknown type {name:?}: expected char, uchar, short, ushort, int, uint, float, double or one as in uint8"
                ));
            }
        })
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Kind::Signed(size) | Kind::Unsigned(size) => size,
            Kind::Single => 4,
            Kind::Double => 8,
        }
    }
}

/// One column of an element: a number, or a list behind its count.
pub struct Property {
    pub name: String,
    /// Type of the count.
    pub list: Option<Kind>,
    pub kind: Kind,
}

/// Rows of the same columns.
pub struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

impl Element {
    /// The column of single numbers called `name`.
    pub fn scalar(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.list.is_none() && p.name == name)
    }

    /// The column of lists called `name`.
    pub fn list(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.list.is_some() && p.name == name)
    }

    /// The names of all columns, for messages.
    pub fn columns(&self) -> String {
        let names: Vec<&str> = self.properties.iter().map(|p| p.name.as_str()).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    }
}

/// All that stands before the rows.
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Bytes up to the first row.
    pub length: usize,
    /// Lines up to the first row.
    pub lines: usize,
}

impl Header {
    /// Reads the header. The error is the line, from 1, and a sentence.
    pub fn read(bytes: &[u8]) -> Result<Self, (usize, String)> {
        let mut lines = Lines { bytes, at: 0, number: 0, carriage_return: false };
        let first = lines.next().unwrap_or_default();
        if !first.trim().eq_ignore_ascii_case("ply") {
            return Err((1, "not a PLY file: expected \"ply\" in the first line".into()));
        }
        let mut encoding = None;
        let mut elements = Vec::new();
        loop {
            let Some(line) = lines.next() else {
                return Err((lines.number.max(1), "truncated: expected end_header".into()));
            };
            let end = statement(&line, &mut encoding, &mut elements).map_err(|what| (lines.number, what))?;
            if end {
                break;
            }
        }
        let expected = "expected format ascii, binary_little_endian or binary_big_endian before end_header";
        let encoding = encoding.ok_or((lines.number, expected.to_string()))?;
        Ok(Header { encoding, elements, length: lines.at, lines: lines.number })
    }
}

/// Reads one line; true at the header's end.
fn statement(
    line: &str,
    encoding: &mut Option<Encoding>,
    elements: &mut Vec<Element>,
) -> Result<bool, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let unknown =
        || format!("expected format, comment, element, property or end_header, got {:.60?}", line.trim());
    let Some((keyword, rest)) = words.split_first() else { return Ok(false) };
    match (keyword.to_ascii_lowercase().as_str(), rest) {
        ("comment" | "obj_info", _) => {}
        ("end_header", _) => return Ok(true),
        ("format", [name, ..]) => {
            *encoding = Some(match name.to_ascii_lowercase().as_str() {
                "ascii" => Encoding::Text,
                "binary_little_endian" => Encoding::LittleEndian,
                "binary_big_endian" => Encoding::BigEndian,
                _ => {
                    let expected = "expected ascii, binary_little_endian or binary_big_endian";
                    return Err(format!("unknown format {name:?}: {expected}"));
                }
            });
        }
        ("element", [name, count]) => {
            let expected = || format!("element {name}: expected a number of rows, got {count:?}");
            let count = count.parse().map_err(|_| expected())?;
            elements.push(Element { name: name.to_ascii_lowercase(), count, properties: Vec::new() });
        }
        ("property", rest) => {
            let element = elements.last_mut().ok_or("expected an element before its properties")?;
            let (list, kind, name) = match rest {
                ["list", count, kind, name] => (Some(Kind::of(count)?), Kind::of(kind)?, name),
                [kind, name] => (None, Kind::of(kind)?, name),
                _ => return Err(unknown()),
            };
            if matches!(list, Some(Kind::Single | Kind::Double)) {
                return Err(format!("property {name}: expected a list counted in whole numbers"));
            }
            element.properties.push(Property { name: name.to_ascii_lowercase(), list, kind });
        }
        _ => return Err(unknown()),
    }
    Ok(false)
}

/// Lines of bytes. What ends the first one ends all: a byte 10 behind a lone carriage return may belong to a row.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
    carriage_return: bool,
}

impl Lines<'_> {
    fn next(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        self.number += 1;
        let end = rest.iter().position(|b| *b == b'\n' || *b == b'\r').unwrap_or(rest.len());
        let pair = rest[end..].starts_with(b"\r\n");
        if self.number == 1 {
            self.carriage_return = rest[end..].starts_with(b"\r") && !pair;
        }
        let mark = if pair && !self.carriage_return { 2 } else { 1 };
        self.at += (end + mark).min(rest.len());
        Some(String::from_utf8_lossy(&rest[..end]).into_owned())
    }
}
