//! Numbers in buffers: of any component type, with strides, quantised, and sparse.

use super::container::Container;
use super::document::Accessor;

/// Extensions by which a buffer view holds other bytes than its accessors' numbers.
const COMPRESSED: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Most elements of an accessor without bytes, all zero: they take memory that the file's size does not explain.
const MOST_WITHOUT_BYTES: usize = 1 << 16;

/// Type of one component.
#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Result<Self, String> {
        Ok(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return Err(format!("componentType {code}: expected 5120 to 5123, 5125 or 5126")),
        })
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The number that begins `bytes`, as glTF 2.0 (section 3.11) and KHR_mesh_quantization turn whole numbers into
    /// fractions.
    fn number(self, bytes: &[u8], normalized: bool) -> f64 {
        let (x, most) = match self {
            Component::I8 => (f64::from(bytes[0] as i8), 127.0),
            Component::U8 => (f64::from(bytes[0]), 255.0),
            Component::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            Component::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Component::U32 => {
                (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX))
            }
            Component::F32 => {
                return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
            }
        };
        if normalized { (x / most).max(-1.0) } else { x }
    }
}

/// The elements of accessor `index`, which are to be `N` numbers each. The error is a sentence without the file's name.
pub fn read<const N: usize>(
    container: &Container,
    index: usize,
    shape: &str,
) -> Result<Vec<[f64; N]>, String> {
    let accessors = &container.document.accessors;
    let accessor = accessors.get(index).ok_or_else(|| format!("accessor {index} of {}", accessors.len()))?;
    elements(container, accessor, shape).map_err(|what| format!("accessors[{index}]: {what}"))
}

fn elements<const N: usize>(
    container: &Container,
    accessor: &Accessor,
    shape: &str,
) -> Result<Vec<[f64; N]>, String> {
    let component = Component::of(accessor.component_type)?;
    if accessor.shape != shape {
        return Err(format!("expected type {shape}, got {:?}", accessor.shape));
    }
    if accessor.count == 0 {
        return Err("expected at least one element".into());
    }
    let size = N * component.size();
    let element = |bytes: &[u8]| {
        std::array::from_fn(|i| component.number(&bytes[i * component.size()..], accessor.normalized))
    };
    let mut elements = match accessor.buffer_view {
        None if accessor.count > MOST_WITHOUT_BYTES => {
            return Err(format!("{} elements without a bufferView", accessor.count));
        }
        None => vec![[0.0; N]; accessor.count],
        Some(view) => {
            let items = items(container, view, accessor.byte_offset, accessor.count, size)?;
            items.map(element).collect()
        }
    };
    if let Some(sparse) = &accessor.sparse {
        let (kind, at) = (Component::of(sparse.indices.component_type)?, &sparse.indices);
        if !matches!(kind, Component::U8 | Component::U16 | Component::U32) {
            return Err("sparse indices: expected whole numbers from 0 up".into());
        }
        let indices = items(container, at.buffer_view, at.byte_offset, sparse.count, kind.size())?;
        let values =
            items(container, sparse.values.buffer_view, sparse.values.byte_offset, sparse.count, size)?;
        for (index, value) in indices.zip(values) {
            let index = kind.number(index, false) as usize;
            let slot = elements.get_mut(index);
            *slot.ok_or_else(|| format!("sparse index {index} is out of range"))? = element(value);
        }
    }
    Ok(elements)
}

/// `count` items of `size` bytes of a buffer view.
fn items(
    container: &Container,
    view: usize,
    offset: usize,
    count: usize,
    size: usize,
) -> Result<impl Iterator<Item = &[u8]>, String> {
    let views = &container.document.buffer_views;
    let of = views.get(view).ok_or_else(|| format!("bufferView {view} of {}", views.len()))?;
    if let Some(name) = COMPRESSED.iter().find(|name| of.extensions.contains_key(**name)) {
        return Err(format!("bufferViews[{view}] is compressed by {name}, which is not supported"));
    }
    let buffer =
        container.buffers.get(of.buffer).ok_or_else(|| format!("bufferViews[{view}]: no such buffer"))?;
    let length = container.document.buffers[of.buffer].byte_length;
    let beyond = || format!("reaches beyond its buffer (bufferViews[{view}])");
    let end = of.byte_offset.checked_add(of.byte_length).filter(|end| *end <= length).ok_or_else(beyond)?;
    let bytes = buffer.get(of.byte_offset..end).and_then(|bytes| bytes.get(offset..)).ok_or_else(beyond)?;
    let stride = of.byte_stride.unwrap_or(size);
    if stride < size {
        return Err(format!("bufferViews[{view}]: expected a byteStride of {size} or more, got {stride}"));
    }
    let needed = count.checked_sub(1).and_then(|last| last.checked_mul(stride)?.checked_add(size));
    if count > 0 && needed.is_none_or(|needed| needed > bytes.len()) {
        return Err(beyond());
    }
    Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
}
