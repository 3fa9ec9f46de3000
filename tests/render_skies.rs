//! Sky tables as programs write them: channels by their names, windows, orientations and packings; each variant is read
//! to its values, or refused in a line that names what is not supported.
#![cfg(feature = "std")]

#[path = "../kernel/examples/render/failure.rs"]
#[allow(dead_code)]
mod failure;
#[path = "../kernel/examples/render/scene_file/mod.rs"]
#[allow(dead_code)]
mod scene_file;
#[path = "../kernel/examples/render/sky_table/mod.rs"]
#[allow(dead_code)]
mod sky_table;
#[path = "../kernel/examples/render/text_file.rs"]
#[allow(dead_code)]
mod text_file;

use scene_file::Columns;
use sky_table::Table;

fn read(name: &str, content: &[u8], bands: usize, columns: Option<Columns>) -> Result<Table, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    sky_table::read(&path, bands, columns).map_err(|failure| failure.to_string())
}

/// The columns as the file has them.
const AS_STORED: Option<Columns> = Some(Columns::CounterClockwise);

/// An uncompressed EXR, written by hand after the format's own text: channels by name, one value for each pixel of the data
/// window (xmin, ymin, xmax, ymax); `more` are further attributes.
fn exr(
    channels: &[(&str, Vec<f32>)],
    data: [i32; 4],
    display: [i32; 4],
    more: &[(&str, &str, &[u8])],
) -> Vec<u8> {
    let mut sorted: Vec<&(&str, Vec<f32>)> = channels.iter().collect();
    sorted.sort_by_key(|(name, _)| *name);
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        let mut bytes = format!("{name}\0{kind}\0").into_bytes();
        bytes.extend((value.len() as i32).to_le_bytes());
        bytes.extend(value);
        bytes
    };
    let window = |window: [i32; 4]| window.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let mut list = Vec::new();
    for (name, _) in &sorted {
        list.extend(format!("{name}\0").into_bytes());
        [2i32, 0, 1, 1].iter().for_each(|x| list.extend(x.to_le_bytes()));
    }
    list.push(0);
    let mut bytes = 20000630u32.to_le_bytes().to_vec();
    bytes.extend(2u32.to_le_bytes());
    bytes.extend(attribute("channels", "chlist", &list));
    bytes.extend(attribute("compression", "compression", &[0]));
    bytes.extend(attribute("dataWindow", "box2i", &window(data)));
    bytes.extend(attribute("displayWindow", "box2i", &window(display)));
    bytes.extend(attribute("lineOrder", "lineOrder", &[0]));
    bytes.extend(attribute("pixelAspectRatio", "float", &1f32.to_le_bytes()));
    bytes.extend(attribute("screenWindowCenter", "v2f", &[0; 8]));
    bytes.extend(attribute("screenWindowWidth", "float", &1f32.to_le_bytes()));
    more.iter().for_each(|(name, kind, value)| bytes.extend(attribute(name, kind, value)));
    bytes.push(0);
    let (columns, rows) = ((data[2] - data[0] + 1) as usize, (data[3] - data[1] + 1) as usize);
    let line = 8 + 4 * columns * sorted.len();
    let start = bytes.len() + 8 * rows;
    (0..rows).for_each(|row| bytes.extend(((start + row * line) as u64).to_le_bytes()));
    for row in 0..rows {
        bytes.extend((data[1] + row as i32).to_le_bytes());
        bytes.extend(((line - 8) as i32).to_le_bytes());
        for (_, values) in &sorted {
            values[row * columns..][..columns].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
    }
    bytes
}

/// A picture of 2 x 1 pixels whose channels hold their places in `names`, from 1.
fn named(names: &[&str]) -> Vec<u8> {
    let channels: Vec<(&str, Vec<f32>)> =
        names.iter().enumerate().map(|(i, name)| (*name, vec![i as f32 + 1.0; 2])).collect();
    exr(&channels, [0, 0, 1, 0], [0, 0, 1, 0], &[])
}

#[test]
fn exr_channels_are_bands_by_their_names() {
    // In the order of the bands; how many are bands; whether the rest is told.
    let read_as: &[(&[&str], usize, bool)] = &[
        (&["R", "G", "B"], 3, false),
        (&["r", "g", "b"], 3, false),
        (&["Red", "Green", "Blue"], 3, false),
        (&["RED", "GREEN", "BLUE"], 3, false),
        (&["View.R", "View.G", "View.B"], 3, false),
        (&["left.view.r", "left.view.g", "left.view.b"], 3, false),
        (&["LeR", "LeG", "LeB"], 3, false),
        (&["Le.red", "Le.green", "Le.blue"], 3, false),
        (&["R_out", "G_out", "B_out"], 3, false),
        (&["sky_r", "sky_g", "sky_b"], 3, false),
        (&["R.sky", "G.sky", "B.sky"], 3, false),
        (&["X", "Y", "Z"], 3, false),
        (&["R", "G", "B", "A"], 3, false),
        (&["View.R", "View.G", "View.B", "View.A"], 3, false),
        (&["red", "green", "blue", "alpha"], 3, false),
        (&["R", "G", "B", "Z"], 3, true),
        (&["R", "G", "B", "albedo.R", "albedo.G", "albedo.B"], 3, true),
        (&["R", "G", "B", "N.X", "N.Y", "N.Z"], 3, true),
        (&["Y"], 1, false),
        (&["R"], 1, false),
        (&["sky.radiance"], 1, false),
        (&["Y", "A"], 1, false),
        (&["A"], 1, false),
        (&["B000", "B001"], 2, false),
        (
            &["band1", "band2", "band3", "band4", "band5", "band6", "band7", "band8", "band9", "band10"],
            10,
            false,
        ),
        (&["Band1", "band2", "BAND3"], 3, false),
        (&["950nm", "1000nm", "1050nm"], 3, false),
        (&["400.5nm", "450.25nm", "1000nm"], 3, false),
        (&["S0.400,000nm", "S0.950,500nm", "S0.1000,000nm"], 3, false),
        (&["l.7", "l.8", "l.9", "l.10", "l.11"], 5, false),
        (&["sky.8.L", "sky.9.L", "sky.10.L"], 3, false),
        (&["2", "10"], 2, false),
        (&["w9_sky", "w10_sky"], 2, false),
        (&["B0", "B1", "A"], 2, false),
        (&["B0", "B1", "left.B0", "left.B1"], 2, true),
    ];
    for (names, bands, told) in read_as {
        let table = read("a.exr", &named(names), *bands, None)
            .unwrap_or_else(|failure| panic!("{names:?}: {failure}"));
        let wanted: Vec<f32> = (1..=*bands).map(|i| i as f32).collect();
        assert_eq!(table.radiance, wanted.repeat(2), "{names:?}");
        let warnings: Vec<String> = table.warnings.lines().collect();
        assert_eq!(warnings.len(), usize::from(*told), "{names:?}: {warnings:?}");
        assert!(!told || warnings[0].contains(names[names.len() - 1]), "{warnings:?}");
    }
    let refused: &[(&[&str], usize)] = &[
        (&["Y", "RY", "BY"], 3),
        (&["left.R", "left.G", "left.B", "right.R", "right.G", "right.B"], 3),
        (&["red", "G", "b"], 3),
        (&["nir", "swir"], 2),
        (&["blue", "green", "nir", "red"], 4),
        (&["visible", "infrared", "thermal"], 3),
        (&["a1b1", "a2b2"], 2),
        (&["w1.5", "w2.25"], 2),
        (&["500nm", "0.6um"], 2),
        (&["S0.400nm", "S1.500nm"], 2),
        (&["Y", "Z"], 2),
        (&["left.Y", "right.Y"], 2),
    ];
    for (names, bands) in refused {
        let failure = read("a.exr", &named(names), *bands, None).err().expect("a refusal");
        // All channels, or that there are but three colours among them.
        let named = names.iter().all(|name| failure.contains(name)) || failure.contains("1 x 2 x 3");
        assert!(named && failure.contains("a.exr"), "{names:?}: {failure}");
    }
    println!("{} variants", read_as.len() + refused.len());
}

#[test]
fn exr_windows_keep_their_places() {
    let ones = |n: usize| vec![("Y", vec![1.0; n])];
    // Data window, display window, and where the picture of the display window is bright.
    let cases: &[([i32; 4], [i32; 4], &[usize])] = &[
        ([0, 0, 3, 1], [0, 0, 3, 1], &[0, 1, 2, 3, 4, 5, 6, 7]),
        ([5, -7, 8, -6], [5, -7, 8, -6], &[0, 1, 2, 3, 4, 5, 6, 7]),
        ([0, 0, 3, 1], [0, 0, 3, 3], &[0, 1, 2, 3, 4, 5, 6, 7]),
        ([0, 2, 3, 3], [0, 0, 3, 3], &[8, 9, 10, 11, 12, 13, 14, 15]),
        ([1, 1, 2, 2], [0, 0, 3, 3], &[5, 6, 9, 10]),
        ([101, 11, 102, 12], [100, 10, 103, 13], &[5, 6, 9, 10]),
        ([-1, -1, 4, 4], [0, 0, 3, 3], &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]),
        ([-2, 0, 1, 0], [0, 0, 3, 3], &[0, 1]),
        ([10, 10, 11, 11], [0, 0, 3, 3], &[]),
    ];
    for (data, display, bright) in cases {
        let count = ((data[2] - data[0] + 1) * (data[3] - data[1] + 1)) as usize;
        let table = read("a.exr", &exr(&ones(count), *data, *display, &[]), 1, AS_STORED).unwrap();
        let found: Vec<usize> = (0..table.radiance.len()).filter(|i| table.radiance[*i] == 1.0).collect();
        assert_eq!(found, *bright, "{data:?} in {display:?}");
        assert_eq!(table.rows as i32, display[3] - display[1] + 1);
        assert_eq!(table.warnings.lines().count(), usize::from(data != display), "{data:?} in {display:?}");
    }
    let latlong = |data, display, value| exr(&ones(8), data, display, &[("envmap", "envmap", value)]);
    let whole = [0, 0, 3, 1];
    assert!(read("a.exr", &latlong(whole, whole, &[0]), 1, None).is_ok());
    for (content, word) in [
        (latlong(whole, [0, 0, 3, 3], &[0]), "data window of 4 x 2"),
        (latlong(whole, whole, &[1]), "cube map"),
        (exr(&ones(8), whole, [0, 0, 1 << 20, 1 << 20], &[]), "too large"),
    ] {
        let failure = read("a.exr", &content, 1, None).err().unwrap();
        assert!(failure.contains(word), "{failure}");
    }
    println!("{} variants", cases.len() + 4);
}

#[test]
fn columns_run_as_in_the_picture_or_as_the_key_says() {
    let values = [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
    let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let pfm = [b"Pf\n4 2\n-1\n", &bytes[16..], &bytes[..16]].concat();
    let picture = exr(&[("Y", values.to_vec())], [0, 0, 3, 1], [0, 0, 3, 1], &[]);
    let mut npy = Vec::new();
    {
        use npyz::WriterBuilder;
        let options = npyz::WriteOptions::new().default_dtype().shape(&[2, 4]);
        let mut writer = options.writer(&mut npy).begin_nd().unwrap();
        writer.extend(values).unwrap();
        writer.finish().unwrap();
    }
    // Seen from the zenith counter-clockwise: a picture's columns the other way round.
    let turned = [4.0, 3.0, 2.0, 1.0, 8.0, 7.0, 6.0, 5.0];
    for (name, content, default) in
        [("a.pfm", &pfm, &turned), ("a.exr", &picture, &turned), ("a.npy", &npy, &values)]
    {
        let with = |columns| read(name, content, 1, columns).unwrap().radiance;
        assert_eq!(with(None), default, "{name}");
        assert_eq!(with(Some(Columns::Clockwise)), turned, "{name}");
        assert_eq!(with(Some(Columns::CounterClockwise)), values, "{name}");
    }
    // All bands of a column go with it.
    let rgb: Vec<u8> = (1..=6).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let table = read("a.pfm", &[b"PF\n2 1\n-1\n", &rgb[..]].concat(), 3, None).unwrap();
    assert_eq!(table.radiance, [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
}

#[test]
fn pfm_headers() {
    let data: Vec<u8> = [1.0f32, 2.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let read = |header: &str, tail: &[u8]| {
        let table = read("a.pfm", &[header.as_bytes(), &data, tail].concat(), 1, AS_STORED)?;
        assert_eq!(table.radiance, [1.0, 2.0], "{header:?}");
        Ok::<usize, String>(table.warnings.lines().count())
    };
    for header in [
        "Pf\n2 1\n-1\n",
        "Pf\n2 1\n-1.0 ",
        "Pf 2 1 -1\n",
        "Pf\r\n2 1\r\n-1.0\r\n",
        "Pf\r2 1\r-1\r",
        "Pf\n# made\n2 1\n-1\n",
    ] {
        assert_eq!(read(header, b""), Ok(0), "{header:?}");
    }
    assert_eq!(read("Pf\n2 1\n-1\n", b"\n\n"), Ok(1));
    assert_eq!(read("Pf\n2 1\n-2.5\n", b""), Ok(1));
    for (header, word) in [
        ("Pf\n2 2\n-1\n", "wrong size"),
        ("Pf\n2 1\n0\n", "not a PFM"),
        ("Pf\n2 1\nnan\n", "not a PFM"),
        ("P6\n2 1\n-1\n", "not a PFM"),
        ("Pf\n-2 1\n-1\n", "not a PFM"),
        ("Pf\n9999999999999 9999999999999\n-1\n", "not a PFM"),
    ] {
        assert!(read(header, b"").unwrap_err().contains(word), "{header:?}");
    }
    println!("14 variants");
}

/// A Radiance picture of the pixels (by rows from the top, columns from the left) in one of the three packings.
fn hdr(header: &str, size: &str, lines: &[Vec<[u8; 4]>], packing: usize) -> Vec<u8> {
    let mut bytes = format!("{header}\n\n{size}\n").into_bytes();
    for line in lines {
        match packing {
            // Each of the four bytes in runs and copies.
            2 => {
                bytes.extend([2, 2, (line.len() >> 8) as u8, line.len() as u8]);
                for part in 0..4 {
                    let values: Vec<u8> = line.iter().map(|pixel| pixel[part]).collect();
                    let mut at = 0;
                    while at < values.len() {
                        let run = values[at..].iter().take(127).take_while(|x| **x == values[at]).count();
                        if run > 2 {
                            bytes.extend([128 + run as u8, values[at]]);
                            at += run;
                        } else {
                            bytes.extend([1, values[at]]);
                            at += 1;
                        }
                    }
                }
            }
            // Repeats of whole pixels.
            1 => {
                let mut at = 0;
                while at < line.len() {
                    let run = line[at..].iter().take_while(|pixel| **pixel == line[at]).count();
                    bytes.extend(line[at]);
                    let (low, high) = ((run - 1) & 255, (run - 1) >> 8);
                    if run > 1 {
                        bytes.extend([1, 1, 1, low as u8]);
                    }
                    if high > 0 {
                        bytes.extend([1, 1, 1, high as u8]);
                    }
                    at += run;
                }
            }
            _ => line.iter().for_each(|pixel| bytes.extend(pixel)),
        }
    }
    bytes
}

#[test]
fn radiance_pictures_of_all_orientations_and_packings() {
    let (rows, columns) = (9usize, 600usize);
    // Long runs, and values that differ.
    let pixel = |row: usize, column: usize| -> [u8; 4] {
        if column < 500 { [128, 64, 32, 129 + row as u8] } else { [column as u8, row as u8 + 2, 200, 128] }
    };
    let value = |row: usize, column: usize, band: usize| {
        let of = pixel(row, column);
        f32::from(of[band]) * (f32::from(of[3]) - 136.0).exp2()
    };
    let mut count = 0;
    for (y, x) in [("-Y", "+X"), ("-Y", "-X"), ("+Y", "+X"), ("+Y", "-X")] {
        for upright in [false, true] {
            for packing in 0..3 {
                let row = |i: usize| if y == "-Y" { i } else { rows - 1 - i };
                let column = |i: usize| if x == "+X" { i } else { columns - 1 - i };
                let (size, lines): (String, Vec<Vec<[u8; 4]>>) = if upright {
                    let line = |i: usize| (0..rows).map(|j| pixel(row(j), column(i))).collect();
                    (format!("{x} {columns} {y} {rows}"), (0..columns).map(line).collect())
                } else {
                    let line = |i: usize| (0..columns).map(|j| pixel(row(i), column(j))).collect();
                    (format!("{y} {rows} {x} {columns}"), (0..rows).map(line).collect())
                };
                let header = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe";
                let table = read("a.hdr", &hdr(header, &size, &lines, packing), 3, AS_STORED).unwrap();
                assert_eq!((table.rows, table.columns), (rows, columns), "{size}, packing {packing}");
                for i in 0..rows * columns * 3 {
                    let wanted = value(i / 3 / columns, i / 3 % columns, i % 3);
                    assert_eq!(table.radiance[i], wanted, "{size}, packing {packing}, {i}");
                }
                count += 1;
            }
        }
    }
    println!("{count} variants");
}

#[test]
fn radiance_headers() {
    let line = vec![vec![[128, 64, 32, 129], [0, 0, 0, 0]]];
    let of = |header: &str| read("a.hdr", &hdr(header, "-Y 1 +X 2", &line, 0), 3, AS_STORED);
    let plain = [1.0f32, 0.5, 0.25, 0.0, 0.0, 0.0];
    for header in [
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe",
        "#?RGBE",
        "#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r",
        "#?RADIANCE\nGAMMA=1\nVIEW= -vta",
    ] {
        let table = of(header).unwrap();
        assert_eq!(table.radiance, plain, "{header:?}");
        assert_eq!(table.warnings.lines().count(), 0);
    }
    // Factors that have been applied are taken off, all of them.
    let exposed = of("#?RADIANCE\nEXPOSURE=2\nEXPOSURE= 0.25").unwrap();
    assert_eq!(exposed.radiance, plain.map(|x| x * 2.0));
    assert_eq!(exposed.warnings.lines().count(), 2);
    let coloured = of("#?RADIANCE\nCOLORCORR= 1 0.5 0.25").unwrap();
    assert_eq!(coloured.radiance[..3], [1.0, 1.0, 1.0]);
    for (header, word) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_xyze", "32-bit_rle_xyze"),
        ("#?RADIANCE\nEXPOSURE=0", "EXPOSURE=0"),
        ("BM", "not a Radiance picture"),
    ] {
        assert!(of(header).err().unwrap().contains(word), "{header:?}");
    }
    let good = hdr("#?RADIANCE", "-Y 1 +X 2", &line, 0);
    assert!(read("a.hdr", &good[..good.len() - 1], 3, None).err().unwrap().contains("truncated"));
    for size in ["-Y 1 +X 0", "-Y 99999999 +X 99999999", "1 2", "-Y 1 -Y 2"] {
        let failure = read("a.hdr", &hdr("#?RADIANCE", size, &line, 0), 3, None).err().unwrap();
        assert!(failure.contains("size"), "{failure}");
    }
    println!("14 variants");
}
