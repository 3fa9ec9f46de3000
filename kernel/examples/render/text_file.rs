//! Text as editors and exporters store it: with or without a byte order mark, with any line end.

use std::borrow::Cow;

/// A file's text and whether its bytes were in the encoding they claim.
pub struct Text<'a> {
    /// The content without its byte order mark.
    pub content: Cow<'a, str>,
    /// False: not UTF-8, and taken for Latin-1.
    pub unicode: bool,
}

/// UTF-8, or UTF-16 by its byte order mark; anything else is taken for Latin-1, in which every byte is a character.
pub fn decode(bytes: &[u8]) -> Text<'_> {
    let wide = |rest: &[u8], from: fn([u8; 2]) -> u16| {
        let units = rest.as_chunks().0.iter().map(|pair| from(*pair));
        let content = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
        Text { content: Cow::Owned(content.collect()), unicode: true }
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => wide(rest, u16::from_be_bytes),
        _ => {
            let bytes = without_mark(bytes);
            match std::str::from_utf8(bytes) {
                Ok(content) => Text { content: Cow::Borrowed(content), unicode: true },
                Err(_) => Text {
                    content: Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect()),
                    unicode: false,
                },
            }
        }
    }
}

/// The bytes behind a UTF-8 byte order mark.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The lines with their numbers from 1; a line ends with `\n`, `\r\n` or a lone `\r`.
pub fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = Some(text);
    let lines = std::iter::from_fn(move || {
        let text = rest.filter(|text| !text.is_empty())?;
        let Some(end) = text.find(['\n', '\r']) else {
            rest = None;
            return Some(text);
        };
        let after = &text[end..];
        rest = Some(after.strip_prefix("\r\n").unwrap_or(&after[1..]));
        Some(&text[..end])
    });
    lines.enumerate().map(|(index, line)| (index + 1, line))
}
