//! The document and the bytes of its buffers: of the binary file itself, in the text, or of files beside it.

use std::path::Path;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::document::{Buffer, Document};
use crate::failure::{Failure, Outcome};
use crate::text_file;

/// A glTF file's parts.
pub struct Container {
    pub document: Document,
    pub buffers: Vec<Vec<u8>>,
}

/// Reads a .gltf or .glb file's content; the first bytes tell which it is.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Container> {
    let fail = |what: &dyn std::fmt::Display| Failure::at(path, what);
    let (json, binary) = match bytes.starts_with(b"glTF") {
        true => chunks(bytes).map_err(|what| fail(&what))?,
        false => (bytes, None),
    };
    let text = text_file::decode(json);
    let text = text.content.trim_end_matches(['\0', ' ', '\n', '\r', '\t']);
    let document: Document = serde_json::from_str(text).map_err(|e| {
        let message = e.to_string();
        let what = message.rsplit_once(" at line ").map_or(message.as_str(), |(what, _)| what);
        Failure::at_line(path, e.line(), format_args!("not a glTF document: {what}"))
    })?;
    if !document.asset.version.starts_with("2.") {
        let version = &document.asset.version;
        return Err(fail(&format_args!("glTF version {version} is not supported: expected 2.0")));
    }
    let mut buffers = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let content = content(path, buffer, if index == 0 { binary } else { None });
        let content = content.map_err(|what| fail(&format_args!("buffers[{index}]: {what}")))?;
        if content.len() < buffer.byte_length {
            let (expected, got) = (buffer.byte_length, content.len());
            return Err(fail(&format_args!("buffers[{index}]: expected {expected} bytes, got {got}")));
        }
        buffers.push(content);
    }
    Ok(Container { document, buffers })
}

/// The JSON and the binary chunk of a binary file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let number = |at: usize| -> Result<usize, String> {
        let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
        word.map(|word| u32::from_le_bytes(word) as usize)
            .ok_or_else(|| format!("truncated: expected more than {} bytes", bytes.len()))
    };
    if number(4)? != 2 {
        return Err(format!("binary glTF of version {} is not supported: expected 2", number(4)?));
    }
    let length = number(8)?;
    if length < 12 || length > bytes.len() {
        return Err(format!(
            "the head tells a length of {length} bytes: expected 12 to {}, the file's size",
            bytes.len()
        ));
    }
    let (mut at, mut json, mut binary) = (12, None, None);
    while at + 8 <= length {
        let (size, kind) = (number(at)?, &bytes[at + 4..at + 8]);
        let chunk = bytes[..length].get(at + 8..at + 8 + size);
        let chunk =
            chunk.ok_or_else(|| format!("truncated: a chunk of {size} bytes reaches beyond the end"))?;
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        // Chunks begin at multiples of four.
        at = (at + 8 + size).next_multiple_of(4);
    }
    Ok((json.ok_or("expected a JSON chunk")?, binary))
}

fn content(path: &Path, buffer: &Buffer, binary: Option<&[u8]>) -> Result<Vec<u8>, String> {
    let Some(uri) = &buffer.uri else {
        return Ok(binary.ok_or("no uri, and no binary chunk")?.to_vec());
    };
    let plain = |text: &str| percent_encoding::percent_decode_str(text).collect::<Vec<u8>>();
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, data) = data.split_once(',').ok_or("expected a comma in the data URI")?;
        if !kind.ends_with(";base64") {
            return Ok(plain(data));
        }
        let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
        let data: Vec<u8> = plain(data).into_iter().filter(|b| !b.is_ascii_whitespace()).collect();
        return GeneralPurpose::new(&STANDARD, config).decode(data).map_err(|e| e.to_string());
    }
    if uri.contains("://") {
        return Err(format!("{uri}: expected a file beside this one, or data in it"));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    // Some exporters forget the encoding: a file of the name as it stands counts, too.
    let decoded = folder.join(&*String::from_utf8_lossy(&plain(uri)));
    let raw = folder.join(uri);
    let beside = if !decoded.exists() && raw.exists() { raw } else { decoded };
    std::fs::read(&beside).map_err(|e| format!("{}: {e}", beside.display()))
}
