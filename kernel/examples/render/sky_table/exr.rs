//! OpenEXR, through the crate of that name.

use std::io::Cursor;

use exr::meta::attribute::EnvironmentMap;
use exr::prelude::*;

use super::{MOST_VALUES, Picture, channels};

/// Reads the content of a `.exr` file: the first layer, on the whole of its display window.
pub fn read(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let layers = image.layer_data;
    let layer = layers.first().ok_or("expected a layer")?;
    let mut notes = Vec::new();
    if layers.len() > 1 {
        let name = |layer: &Layer<_>| {
            layer.attributes.layer_name.as_ref().map_or("without a name".into(), |name| format!("{name:?}"))
        };
        notes.push(format!("the first of {} parts ({}) is read", layers.len(), name(layer)));
    }
    let list = &layer.channel_data.list;
    let names: Vec<String> = list.iter().map(|channel| channel.name.to_string()).collect();
    let bands = channels::order(&names)?;
    notes.extend(bands.note);
    let planes: Vec<Vec<f32>> =
        bands.order.iter().map(|i| list[*i].sample_data.values_as_f32().collect()).collect();
    let size = layer.size;
    if planes.iter().any(|plane| plane.len() != size.0 * size.1) {
        return Err("expected channels without subsampling".into());
    }
    let window = placed(&image.attributes, &layer.attributes, size, &mut notes)?;
    let (rows, columns) = (window.display.1, window.display.0);
    let count = planes.len();
    rows.checked_mul(columns)
        .and_then(|n| n.checked_mul(count))
        .filter(|n| *n <= MOST_VALUES)
        .ok_or_else(|| format!("a display window of {columns} x {rows} pixels is too large"))?;
    let mut radiance = vec![0.0; rows * columns * count];
    for (row, column) in (0..size.1).flat_map(|row| (0..size.0).map(move |column| (row, column))) {
        let place = |at: usize, offset: i64, most: usize| {
            usize::try_from(at as i64 + offset).ok().filter(|at| *at < most)
        };
        let (Some(r), Some(c)) = (place(row, window.offset.1, rows), place(column, window.offset.0, columns))
        else {
            continue;
        };
        for (band, plane) in planes.iter().enumerate() {
            radiance[(r * columns + c) * count + band] = plane[row * size.0 + column];
        }
    }
    Ok(Picture { rows, columns, bands: count, radiance, notes })
}

/// Where the stored pixels lie in the picture.
struct Window {
    /// Columns and rows of the picture.
    display: (usize, usize),
    /// Column and row of the first stored pixel.
    offset: (i64, i64),
}

/// The display window is the sphere, and where nothing is stored it is black.
fn placed(
    image: &ImageAttributes,
    layer: &LayerAttributes,
    size: Vec2<usize>,
    notes: &mut Vec<String>,
) -> std::result::Result<Window, String> {
    let (display, data) = (image.display_window, layer.layer_position);
    let offset = (
        i64::from(data.0) - i64::from(display.position.0),
        i64::from(data.1) - i64::from(display.position.1),
    );
    let window = Window { display: (display.size.0, display.size.1), offset };
    let same = offset == (0, 0) && size == display.size;
    let latlong = match layer.environment_map {
        Some(EnvironmentMap::Cube) => {
            return Err("a cube map is not supported: expected a picture of longitude and latitude".into());
        }
        found => found.is_some(),
    };
    if same {
        return Ok(window);
    }
    let windows = format!(
        "data window of {} x {} pixels at ({}, {}), display window of {} x {} at ({}, {})",
        size.0,
        size.1,
        data.0,
        data.1,
        display.size.0,
        display.size.1,
        display.position.0,
        display.position.1
    );
    if latlong {
        // The format's own text has the sphere end where the data end, programs that write it where the display does.
        return Err(format!("{windows}: expected one window of an environment map"));
    }
    notes.push(format!("{windows}: what is not stored is black, what is outside is cut off"));
    Ok(window)
}
