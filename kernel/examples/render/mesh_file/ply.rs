//! PLY, text and binary of both byte orders, through `ply-rs-bw`.

use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult};

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};

/// A row of `vertex`: coordinates and normal.
struct Vertex {
    position: [f64; 3],
    normal: [f64; 3],
}

/// A row of `face`.
struct Face(Vec<i64>);

/// A row of anything else.
struct Ignored;

/// Names of the list of corners, both in use.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex { position: [0.0; 3], normal: [0.0; 3] }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let slot = POSITION.iter().position(|x| *x == name).map(|i| &mut self.position[i]);
        let slot = slot.or(NORMAL.iter().position(|x| *x == name).map(|i| &mut self.normal[i]));
        match (slot, scalar(value)) {
            (Some(slot), Some(value)) => {
                *slot = value;
                PropertyAccessResult::Set
            }
            _ => PropertyAccessResult::Ignored,
        }
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Face(Vec::new())
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        match indices(value).filter(|_| CORNERS.contains(&name)) {
            Some(indices) => {
                self.0 = indices;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }
}

impl PropertyAccess for Ignored {
    fn new() -> Self {
        Ignored
    }

    fn set_property(&mut self, _: &str, _: Property) -> PropertyAccessResult {
        PropertyAccessResult::Ignored
    }
}

fn scalar(value: Property) -> Option<f64> {
    match value {
        Property::Char(x) => Some(x.into()),
        Property::UChar(x) => Some(x.into()),
        Property::Short(x) => Some(x.into()),
        Property::UShort(x) => Some(x.into()),
        Property::Int(x) => Some(x.into()),
        Property::UInt(x) => Some(x.into()),
        Property::Float(x) => Some(x.into()),
        Property::Double(x) => Some(x),
        _ => None,
    }
}

fn indices(value: Property) -> Option<Vec<i64>> {
    fn wide<T: Into<i64>>(list: Vec<T>) -> Option<Vec<i64>> {
        Some(list.into_iter().map(Into::into).collect())
    }
    match value {
        Property::ListChar(list) => wide(list),
        Property::ListUChar(list) => wide(list),
        Property::ListShort(list) => wide(list),
        Property::ListUShort(list) => wide(list),
        Property::ListInt(list) => wide(list),
        Property::ListUInt(list) => wide(list),
        _ => None,
    }
}

/// Reads a PLY file's content. All facets are of material "default": the format has no names for them.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let fail = |e: &dyn std::fmt::Display| Failure::at(path, e);
    let mut reader = Reader::new(bytes);
    let header = Parser::<Ignored>::new().read_header(&mut reader).map_err(|e| fail(&e))?;
    let has =
        |element: &ElementDef, names: &[&str]| names.iter().all(|n| element.properties.contains_key(*n));
    let mut builder = Builder::new(path, 0);
    let material = builder.material("default");
    let mut with_normals = false;
    let mut faces = None;
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                if !has(element, &POSITION) {
                    return Err(fail(&"expected the properties x, y and z of element vertex"));
                }
                with_normals = has(element, &NORMAL);
                let rows = Parser::<Vertex>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|e| fail(&e))?;
                for (index, row) in rows.iter().enumerate() {
                    builder.vertex(Place::Item(index), row.position)?;
                    if with_normals {
                        builder.normal(Place::Item(index), row.normal)?;
                    }
                }
            }
            "face" => {
                if !CORNERS.iter().any(|corners| has(element, &[corners])) {
                    return Err(fail(&"expected the list property vertex_indices of element face"));
                }
                let rows = Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header);
                faces = Some(rows.map_err(|e| fail(&e))?);
            }
            // no bytes to read, however many it says there are
            _ if element.properties.is_empty() && header.encoding != Encoding::Ascii => {}
            _ => {
                let rows = Parser::<Ignored>::new().read_payload_for_element(&mut reader, element, &header);
                rows.map_err(|e| fail(&e))?;
            }
        }
    }
    let faces = faces.ok_or_else(|| fail(&"expected an element face"))?;
    for (index, Face(corners)) in faces.into_iter().enumerate() {
        let corner = |vertex| Corner { vertex, normal: with_normals.then_some(vertex) };
        builder.polygon(Place::Item(index), corners.into_iter().map(corner), material)?;
    }
    builder.finish()
}
