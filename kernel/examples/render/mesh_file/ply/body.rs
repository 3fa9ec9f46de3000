//! The rows behind the header.

use super::header::{Element, Encoding, Header, Kind};
use super::place;
use crate::mesh_file::builder::{Builder, Place};

/// The wanted columns of one row.
pub struct Row {
    scalars: Vec<f64>,
    list: Vec<i64>,
}

impl Row {
    /// A single number.
    pub fn scalar(&self, column: usize) -> f64 {
        self.scalars[column]
    }

    /// The numbers of the wanted list.
    pub fn list(&self) -> &[i64] {
        &self.list
    }
}

/// The rest of the file while it is being read.
pub struct Body<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    line: usize,
    row: usize,
}

impl<'a> Body<'a> {
    /// The rows behind the header.
    pub fn new(rest: &'a [u8], header: &Header) -> Self {
        Body { rest, encoding: header.encoding, line: header.lines, row: 0 }
    }

    /// Where the last row stands.
    pub fn place(&self) -> Place {
        place((self.encoding == Encoding::Text).then_some(self.line), self.row)
    }

    /// Calls `each` for all rows of `element` with the `wanted` columns. The error is a sentence without a place.
    pub fn rows(
        &mut self,
        element: &Element,
        wanted: &[usize],
        builder: &mut Builder,
        mut each: impl FnMut(&mut Builder, Place, &Row),
    ) -> Result<(), String> {
        self.row = 0;
        let mut row = Row { scalars: vec![0.0; element.properties.len()], list: Vec::new() };
        if element.properties.is_empty() && wanted.is_empty() {
            // No bytes to read, however many rows it says there are.
            return Ok(());
        }
        for index in 0..element.count {
            self.row = index;
            let rest = match self.encoding {
                Encoding::Text => self.text(element, wanted, index, &mut row)?,
                _ => {
                    self.binary(element, wanted, &mut row)?;
                    0
                }
            };
            if rest > 0 {
                let what = format!("{rest} more values than element {} has: passed over", element.name);
                builder.warn("more values", self.place(), &element.name, what);
            }
            each(builder, self.place(), &row);
        }
        Ok(())
    }

    /// What stands behind the last row, if that is more than white space.
    pub fn left_over(&self) -> Option<String> {
        let more = self.rest.iter().filter(|b| !b.is_ascii_whitespace()).count();
        (more > 0).then(|| format!("{} bytes behind the last row: passed over", self.rest.len()))
    }

    /// One row in one line; returns how many values are left over.
    fn text(
        &mut self,
        element: &Element,
        wanted: &[usize],
        index: usize,
        row: &mut Row,
    ) -> Result<usize, String> {
        let line = loop {
            let rest = self.rest;
            if rest.is_empty() {
                let (count, name) = (element.count, &element.name);
                return Err(format!("truncated: expected {count} rows of element {name}, got {index}"));
            }
            self.line += 1;
            let end = rest.iter().position(|b| *b == b'\n' || *b == b'\r').unwrap_or(rest.len());
            let mark = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
            self.rest = &rest[(end + mark).min(rest.len())..];
            let line =
                std::str::from_utf8(&rest[..end]).map_err(|_| "expected numbers as text".to_string())?;
            if !line.trim().is_empty() {
                break line;
            }
        };
        let mut tokens = line.split_whitespace();
        let mut next = |name: &str| {
            tokens.next().ok_or_else(|| format!("expected a value of property {name}, the line has no more"))
        };
        for (column, property) in element.properties.iter().enumerate() {
            let name = &property.name;
            let number = |token: &str| format!("property {name}: expected a number, got {token:.60?}");
            let is_wanted = wanted.contains(&column);
            match property.list {
                None => {
                    let token = next(name)?;
                    if is_wanted {
                        row.scalars[column] = parse(token, property.kind).ok_or_else(|| number(token))?;
                    }
                }
                Some(_) => {
                    let token = next(name)?;
                    let count: usize = token.parse().map_err(|_| number(token))?;
                    if is_wanted {
                        row.list.clear();
                    }
                    for _ in 0..count {
                        let token = next(name)?;
                        if is_wanted {
                            row.list.push(whole(token).ok_or_else(|| number(token))?);
                        }
                    }
                }
            }
        }
        Ok(tokens.count())
    }

    fn binary(&mut self, element: &Element, wanted: &[usize], row: &mut Row) -> Result<(), String> {
        for (column, property) in element.properties.iter().enumerate() {
            let is_wanted = wanted.contains(&column);
            match property.list {
                None => {
                    let number = self.number(property.kind, element)?;
                    if is_wanted {
                        row.scalars[column] = number.float();
                    }
                }
                Some(count) => {
                    let count = usize::try_from(self.number(count, element)?.whole())
                        .map_err(|_| format!("property {}: expected a list of 0 or more", property.name))?;
                    let bytes = count.checked_mul(property.kind.size()).filter(|n| *n <= self.rest.len());
                    bytes.ok_or_else(|| self.truncated(element))?;
                    if is_wanted {
                        row.list.clear();
                    }
                    for _ in 0..count {
                        let number = self.number(property.kind, element)?;
                        if is_wanted {
                            row.list.push(number.whole());
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn truncated(&self, element: &Element) -> String {
        format!("truncated: expected {} rows of element {}, got {}", element.count, element.name, self.row)
    }

    fn number(&mut self, kind: Kind, element: &Element) -> Result<Number, String> {
        let size = kind.size();
        let bytes = self.rest.get(..size).ok_or_else(|| self.truncated(element))?;
        let mut wide = [0u8; 8];
        wide[..size].copy_from_slice(bytes);
        if self.encoding == Encoding::BigEndian {
            wide[..size].reverse();
        }
        self.rest = &self.rest[size..];
        let bits = u64::from_le_bytes(wide);
        // Moves the sign bit to the top and back.
        let unused = 64 - 8 * size as u32;
        Ok(match kind {
            Kind::Signed(_) => Number::Whole((bits << unused) as i64 >> unused),
            Kind::Unsigned(_) => Number::Whole(i64::try_from(bits).unwrap_or(i64::MAX)),
            Kind::Single => Number::Float(f32::from_bits(bits as u32).into()),
            Kind::Double => Number::Float(f64::from_bits(bits)),
        })
    }
}

enum Number {
    Whole(i64),
    Float(f64),
}

impl Number {
    fn float(self) -> f64 {
        match self {
            Number::Whole(x) => x as f64,
            Number::Float(x) => x,
        }
    }

    /// -2 (no index) for what is not whole.
    fn whole(self) -> i64 {
        match self {
            Number::Whole(x) => x,
            Number::Float(x) if x.fract() == 0.0 && x.abs() < 9e15 => x as i64,
            Number::Float(_) => -2,
        }
    }
}

/// A number of text, with the digits of its type; what printf makes of NaN and infinity (1.#QNAN, -nan(ind)) is NaN.
fn parse(token: &str, kind: Kind) -> Option<f64> {
    let number = match kind {
        Kind::Single => token.parse::<f32>().ok().map(f64::from),
        _ => token.parse().ok(),
    };
    let odd = ["nan", ".#ind", ".#inf"].iter().any(|word| token.to_ascii_lowercase().contains(word));
    number.or(odd.then_some(f64::NAN))
}

/// A whole number, which some writers give a fraction of 0.
fn whole(token: &str) -> Option<i64> {
    let float = || token.parse::<f64>().ok().filter(|x| x.fract() == 0.0 && x.abs() < 9e15).map(|x| x as i64);
    token.parse().ok().or_else(float)
}
