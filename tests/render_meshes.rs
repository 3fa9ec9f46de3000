//! Mesh files as exporters write them: each variant is read to its right area, with a warning where something is passed
//! over, or refused in one line that says what is not supported and where.
#![cfg(feature = "std")]

#[path = "../kernel/examples/render/failure.rs"]
#[allow(dead_code)]
mod failure;
#[path = "../kernel/examples/render/mesh_file/mod.rs"]
#[allow(dead_code)]
mod mesh_file;
#[path = "../kernel/examples/render/text_file.rs"]
mod text_file;

use glam::DVec3;
use mesh_file::Mesh;

/// Rounding of sums of products of small numbers that f32 and these decimals hold.
const ROUNDING: f64 = 1e-12;

fn read(name: &str, content: impl AsRef<[u8]>) -> Result<Mesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    mesh_file::read(&path).map_err(|failure| failure.to_string())
}

/// Sum of all facets' areas, each counted as positive: overlaps show.
fn area(mesh: &Mesh) -> f64 {
    let corner = |facet: &[u32; 3], i: usize| DVec3::from(mesh.vertices[facet[i] as usize]);
    let doubled = |f: &[u32; 3]| (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0)).length();
    mesh.facets.iter().map(|facet| doubled(facet) / 2.0).sum()
}

/// What a variant gives: read in silence, read with a warning of these words, or refused in these words.
enum Gives {
    Silence,
    Warning(&'static [&'static str]),
    Refusal(&'static [&'static str]),
}
use Gives::{Refusal, Silence, Warning};

/// Checks one variant of a mesh of area 2.
fn check(name: &str, content: impl AsRef<[u8]>, gives: &Gives) {
    let shown = String::from_utf8_lossy(content.as_ref()).into_owned();
    match (read(name, content), gives) {
        (Ok(mesh), Silence | Warning(_)) => {
            assert!((area(&mesh) - 2.0).abs() < ROUNDING, "area {}: {shown}", area(&mesh));
            let warnings: Vec<String> = mesh.warnings.lines().collect();
            match gives {
                Warning(words) => {
                    let told = |word: &&str| warnings.iter().any(|warning| warning.contains(*word));
                    assert!(words.iter().all(told), "{words:?} of {warnings:?}: {shown}");
                    assert!(warnings.iter().all(|warning| warning.contains(name)), "{warnings:?}");
                }
                _ => assert!(warnings.is_empty(), "{warnings:?}: {shown}"),
            }
        }
        (Err(failure), Refusal(words)) => {
            assert!(words.iter().all(|word| failure.contains(word)), "{words:?} of {failure}: {shown}");
            assert!(failure.contains(name) && failure.len() < 400, "{failure}");
        }
        (Ok(_), Refusal(words)) => panic!("read, for {words:?}: {shown}"),
        (Err(failure), _) => panic!("{failure}: {shown}"),
    }
}

fn check_all(name: &str, variants: &[(&str, Gives)]) {
    variants.iter().for_each(|(content, gives)| check(name, content, gives));
    println!("{name}: {} variants", variants.len());
}

const OBJ: &str = "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n";
const STL: &str = "solid part one\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 2 0 0\n  vertex 0 2 0\n \
                   endloop\nendfacet\nendsolid part one\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n0 2 0\n3 0 1 2\n";

#[test]
fn text_has_any_mark_and_any_line_end() {
    let gltf = gltf(&Gltf::default());
    let mut count = 0;
    for (name, text) in [("a.obj", OBJ), ("a.ply", PLY), ("a.stl", STL), ("a.gltf", gltf.as_str())] {
        for end in ["\n", "\r\n", "\r"] {
            let text = text.replace('\n', end);
            let wide: Vec<u16> = std::iter::once(0xfeff).chain(text.encode_utf16()).collect();
            let encodings = [
                text.clone().into_bytes(),
                format!("\u{feff}{text}").into_bytes(),
                wide.iter().flat_map(|unit| unit.to_le_bytes()).collect(),
                wide.iter().flat_map(|unit| unit.to_be_bytes()).collect(),
            ];
            for content in encodings {
                check(name, content, &Silence);
                count += 1;
            }
        }
    }
    println!("{count} variants");
}

#[test]
fn obj_comments_and_continuations() {
    check_all(
        "a.obj",
        &[
            // The first vertex is not part of the comment before it.
            ("# C:\\models\\\nv 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3\n", Silence),
            ("v 0 0 0 # C:\\\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3 # C:\\", Silence),
            ("#\\\nv 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3\n", Silence),
            ("   # tab and space \\  \n\tv 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3\n", Silence),
            ("mtllib C:\\models\\\nv 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3\n", Silence),
            ("g wing\\\nv 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\nf 1 2 3\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nusemtl C:\\paint\\\nf 1 2 3\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 \\\n2 \\\r\n3\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 \\\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 \\", Silence),
            ("v 0 0 \\\n0\nv 2 0 0\nv 0 2 0\nf 1/1\\\n 2/2 3/3 # end\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 \\\n# comment\nv 9 9 0\n", Silence),
            ("v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 \\\nv 9 9 0\n", Refusal(&["a.obj:4:", "\"v\""])),
            ("v 0 0 0#c\nv 2 0 0#c\nv 0 2 0\nf 1 2 3#c\n", Silence),
            ("#f 1 2 3\nv 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n#\n", Silence),
        ],
    );
}

#[test]
fn obj_statements() {
    let with = |more: &str| format!("v 0 0 0\nv 2 0 0\nv 0 2 0\nv 9 9 0\n{more}\n");
    let variants: &[(String, Gives)] = &[
        (with("f 1 2\nf 1 2 3"), Warning(&["a.obj:5:", "3 corners, got 2"])),
        (with("f\nf 1\nf 1 2 3"), Warning(&["a.obj:5:", "got 0", "2 like this"])),
        (with("f 1 2"), Refusal(&["a.obj", "no facet is left", "a.obj:5:", "3 corners"])),
        (with("f -4 -3 -2"), Silence),
        (with("f +1 +2 +3"), Silence),
        (with("f -5 -3 -2"), Refusal(&["a.obj:5:", "index -5 ", "-1 to -4"])),
        (with("f 1 2 5"), Refusal(&["a.obj:5:", "index 5 ", "1 to 4"])),
        (with("f 0 1 2"), Refusal(&["a.obj:5:", "index 0 ", "1 to 4"])),
        (with("f 1 2 4294967297"), Refusal(&["a.obj:5:", "index 4294967297 "])),
        (with("f 1 2 99999999999999999999"), Refusal(&["a.obj:5:", "index 99999999999999999999 "])),
        (with("f 1 2 -99999999999999999999"), Refusal(&["a.obj:5:", "index -99999999999999999999 "])),
        (with("f 1.0 2.0 3.0"), Refusal(&["a.obj:5:", "corner", "\"1.0\""])),
        (with("f 1,2,3"), Refusal(&["a.obj:5:", "corner", "\"1,2,3\""])),
        (with("f 1/ 2/ 3/"), Silence),
        (with("f 1// 2// 3//"), Silence),
        (with("f 1/9 2/9 3/9"), Silence),
        (with("f 1/1/1/1 2/1/1/1 3/1/1/1"), Refusal(&["a.obj:5:", "\"1/1/1/1\""])),
        (with("f /1 /2 /3"), Refusal(&["a.obj:5:", "\"/1\""])),
        // Normals are of no matter where none are asked for.
        (with("f 1//7 2//7 3//7"), Silence),
        (with("f 1//-7 2//-7 3//-7"), Silence),
        (with("vn nan nan nan\nf 1//1 2//1 3//1"), Silence),
        (with("vn 0 0\nf 1//1 2//1 3//1"), Silence),
        (with("F 1 2 3"), Silence),
        (with("fo 1 2 3"), Silence),
        (with("V 1 1 1\nVT 0 0\nUSEMTL paint\nF 1 2 3"), Silence),
        (with("vt nonsense\nvp 1\no a\ns off\nl 1 2\np 1\nf 1 2 3"), Silence),
        (with("f 1 2 3\nsurf 0 1 0 1 1 2 3 4\nend"), Warning(&["a.obj:6:", "free-form", "surf"])),
        (with("f 1 2 3\ncall other.obj"), Warning(&["a.obj:6:", "call"])),
        (with("f 1 2 3\nface 1 2 4"), Warning(&["a.obj:6:", "unknown statement \"face\""])),
        (with("f 1 2 3\n4"), Warning(&["a.obj:6:", "unknown statement \"4\""])),
        (with("v nan 0 0\nf 1 2 3"), Warning(&["a.obj:5:", "not finite", "no facet has it"])),
        (with("v nan 0 0\nf 1 2 5"), Refusal(&["a.obj:5:", "not finite"])),
        (with("v 1 2\nf 1 2 3"), Refusal(&["a.obj:5:", "three numbers"])),
        (with("v 1,5 2 0\nf 1 2 3"), Refusal(&["a.obj:5:", "\"1,5\""])),
        (with("v 1 1 0 1 0.5 0.5 0.5\nf 1 2 3"), Silence),
        (with("usemtl red # of the left wing\nf 1 2 3"), Warning(&["a.obj:5:", "\"red\""])),
        (with("usemtl Material #25\nf 1 2 3"), Silence),
        (with("usemtl\nf 1 2 3"), Silence),
        (with("f 5 6 7\nv 0 0 1\nv 2 0 1\nv 0 2 1"), Silence),
        (String::new(), Refusal(&["a.obj", "empty", "no facet among 0 vertices"])),
        (with("surf 0 1"), Refusal(&["a.obj", "no facet is left", "free-form"])),
    ];
    variants.iter().for_each(|(content, gives)| check("a.obj", content, gives));
    println!("{} variants", variants.len());
    // A name in Latin-1 is told, and is what that encoding says.
    let mut latin = with("usemtl Gr").into_bytes();
    latin.pop();
    latin.extend(b"\xfcn\nf 1 2 3\n");
    check("a.obj", &latin, &Warning(&["a.obj:5:", "Latin-1"]));
    assert_eq!(read("a.obj", latin).unwrap().material_names, ["Gr\u{fc}n"]);
}

#[test]
fn ply_columns_of_any_type_and_any_order() {
    let types = [
        ("char", "int8"),
        ("uchar", "uint8"),
        ("short", "int16"),
        ("ushort", "uint16"),
        ("int", "int32"),
        ("uint", "uint32"),
        ("float", "float32"),
        ("double", "float64"),
    ];
    let bytes = |kind: &str, x: f64, big: bool| -> Vec<u8> {
        let mut bytes = match kind {
            "char" | "int8" => vec![x as i8 as u8],
            "uchar" | "uint8" => vec![x as u8],
            "short" | "int16" => (x as i16).to_le_bytes().to_vec(),
            "ushort" | "uint16" => (x as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (x as i32).to_le_bytes().to_vec(),
            "uint" | "uint32" => (x as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (x as f32).to_le_bytes().to_vec(),
            _ => x.to_le_bytes().to_vec(),
        };
        if big {
            bytes.reverse();
        }
        bytes
    };
    let mut count = 0;
    let corners = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]];
    for (coordinate, index) in types.iter().flat_map(|(old, new)| [(old, "int"), (new, "uint16")]) {
        for list in ["uchar", "uint8", "int", "ushort"] {
            for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
                for end in ["\n", "\r\n", "\r"] {
                    // Coordinates stand last, between columns and elements that nobody reads.
                    let head = format!(
                        "ply\nformat {encoding} 1.0\ncomment end_header is not here\nobj_info any\nelement pad 1\n\
                         property list {list} double more\nproperty uchar one\nelement vertex 3\n\
                         property list {list} short neighbours\nproperty float quality\nproperty {coordinate} z\n\
                         property {coordinate} y\nproperty {coordinate} x\nelement face 1\nproperty uchar flags\n\
                         property list {list} {index} vertex_index\nproperty list {list} float texcoord\nend_header\n"
                    )
                    .replace('\n', end);
                    let big = encoding == "binary_big_endian";
                    // Each row: lists and numbers of these types.
                    let mut rows: Vec<Vec<(&str, f64)>> =
                        vec![vec![(list, 2.0), ("double", 0.5), ("double", 1.5), ("uchar", 7.0)]];
                    for [x, y] in corners {
                        let front = [(list, 1.0), ("short", -5.0), ("float", 0.25)];
                        let place = [(*coordinate, 0.0), (*coordinate, y), (*coordinate, x)];
                        rows.push(front.into_iter().chain(place).collect());
                    }
                    let face = [("uchar", 1.0), (list, 3.0), (index, 0.0), (index, 1.0), (index, 2.0)];
                    rows.push(face.into_iter().chain([(list, 1.0), ("float", 0.5)]).collect());
                    let mut content = head.into_bytes();
                    for row in rows {
                        if encoding == "ascii" {
                            let row: Vec<String> = row.iter().map(|(_, x)| x.to_string()).collect();
                            content.extend((row.join(" ") + end).bytes());
                        } else {
                            row.iter().for_each(|(kind, x)| content.extend(bytes(kind, *x, big)));
                        }
                    }
                    check("a.ply", content, &Warning(&["element pad is unknown"]));
                    count += 1;
                }
            }
        }
    }
    println!("{count} variants");
}

#[test]
fn ply_text() {
    let edited = |from: &str, to: &str| {
        assert!(PLY.contains(from), "{from}");
        PLY.replacen(from, to, 1)
    };
    let normals = "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n";
    let with_normals = |normal: &str| {
        let head = edited("property float z\n", normals);
        head.replacen("\n0 0 0\n2 0 0\n0 2 0\n", &format!("\n0 0 0 {normal}\n2 0 0 0 0 1\n0 2 0 0 0 1\n"), 1)
    };
    let variants: &[(String, Gives)] = &[
        (edited("end_header\n", "end_header\n\n"), Silence),
        (edited("end_header\n", "end_header \n \n\n"), Silence),
        (edited("2 0 0\n", "\n2 0 0\n\n"), Silence),
        (edited("3 0 1 2\n", "\n\n3 0 1 2"), Silence),
        (edited("3 0 1 2\n", "3 0 1 2\n\n \n"), Silence),
        (edited("2 0 0\n", "  2\t0   0  \n"), Silence),
        (edited("ply\n", "PLY\n\n"), Silence),
        (
            edited("element vertex", "ELEMENT Vertex")
                .replace("float x", "FLOAT X")
                .replace("FLOAT", "float"),
            Silence,
        ),
        (edited("3 0 1 2\n", "3 0.0 1.0 2.0\n"), Silence),
        (edited("3 0 1 2\n", "3 0 1.5 2\n"), Refusal(&["a.ply:13:", "\"1.5\""])),
        (edited("3 0 1 2\n", "3 0 1\n"), Refusal(&["a.ply:13:", "vertex_indices", "no more"])),
        (edited("3 0 1 2\n", "3 0 1 2 9\n"), Warning(&["a.ply:13:", "1 more values"])),
        (edited("3 0 1 2\n", "3 0 1 2\n3 0 1 2\n"), Warning(&["a.ply", "bytes behind the last row"])),
        (edited("3 0 1 2\n", ""), Refusal(&["a.ply", "truncated", "1 rows of element face, got 0"])),
        (edited("3 0 1 2\n", "3 0 1 -1\n"), Refusal(&["a.ply:13:", "index -1 ", "0 to 2"])),
        (edited("3 0 1 2\n", "3 0 1 3\n"), Refusal(&["a.ply:13:", "index 3 ", "0 to 2"])),
        (edited("3 0 1 2\n", "-3 0 1 2\n"), Refusal(&["a.ply:13:", "\"-3\""])),
        (
            edited("face 1", "face 2").replace("3 0 1 2\n", "2 0 1\n3 0 1 2\n"),
            Warning(&["a.ply:13:", "got 2"]),
        ),
        (edited("3 0 1 2\n", "2 0 1\n"), Refusal(&["a.ply", "no facet is left", "got 2"])),
        (
            edited("face 1", "face 0").replace("3 0 1 2\n", ""),
            Refusal(&["a.ply", "no facet among 3 vertices"]),
        ),
        (
            edited("vertex 3", "vertex 4").replace("3 0 1 2\n", "nan nan 0\n3 0 1 2\n"),
            Warning(&["a.ply:13:", "not finite"]),
        ),
        (edited("2 0 0\n", "2 nan 0\n"), Refusal(&["a.ply:11:", "not finite"])),
        (edited("2 0 0\n", "2 zero 0\n"), Refusal(&["a.ply:11:", "property y", "\"zero\""])),
        (edited("2 0 0\n", "2 0\n"), Refusal(&["a.ply:11:", "property z"])),
        (with_normals("nan nan nan"), Silence),
        (with_normals("0 0 0"), Silence),
        (with_normals("-nan(ind) 1.#QNAN inf"), Silence),
        (edited("vertex_indices", "corner_list"), Refusal(&["a.ply", "vertex_indices", "got corner_list"])),
        (edited("vertex_indices", "vertex_indexes"), Silence),
        (edited("property float z", "property float w"), Refusal(&["a.ply", "x, y and z", "got x, y, w"])),
        (edited("property float z", "property half z"), Refusal(&["a.ply:6:", "\"half\"", "float"])),
        (edited("ascii", "gzip"), Refusal(&["a.ply:2:", "\"gzip\"", "binary_little_endian"])),
        (edited("format ascii 1.0\n", ""), Refusal(&["a.ply:8:", "expected format"])),
        (edited("end_header\n", ""), Refusal(&["a.ply:9:", "got \"0 0 0\""])),
        (edited("element vertex 3", "element vertex three"), Refusal(&["a.ply:3:", "\"three\""])),
        (edited("property list uchar", "property list float"), Refusal(&["a.ply:8:", "whole numbers"])),
        (
            edited(
                "list uchar int vertex_indices",
                "list uchar int vertex_indices\nproperty int material_index",
            )
            .replace("3 0 1 2", "3 0 1 2 5"),
            Warning(&["a.ply", "materials", "not applied"]),
        ),
        (
            edited("element face 1\nproperty list uchar int vertex_indices\n", "").replace("3 0 1 2\n", ""),
            Refusal(&["a.ply", "cloud of points"]),
        ),
        // A strip of one triangle, a strip of two, and a break between.
        (
            edited("face 1", "tristrips 1")
                .replace("uchar int", "int int")
                .replace("3 0 1 2", "8 0 1 2 -1 0 0 0 0"),
            Silence,
        ),
        ("not a ply".into(), Refusal(&["a.ply:1:", "not a PLY file"])),
        (String::new(), Refusal(&["a.ply:1:", "not a PLY file"])),
    ];
    variants.iter().for_each(|(content, gives)| check("a.ply", content, gives));
    println!("{} variants", variants.len());
    // Faces before the vertices that they name.
    let (head, body) = ("ply\nformat ascii 1.0\n", "3 0 1 2\n0 0 0\n2 0 0\n0 2 0\n");
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    check("a.ply", format!("{head}{face}{vertex}end_header\n{body}"), &Silence);
}

/// A binary STL of one triangle.
fn binary_stl(header: &[u8], count: u32, attributes: [u8; 2], tail: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    let triangle = [0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0];
    triangle.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes.extend(attributes);
    bytes.extend(tail);
    bytes
}

#[test]
fn stl_binary() {
    for header in [
        &b"solid part"[..],
        b"solid facet normal",
        b"",
        b"COLOR=\xff\x00\x00\xff",
        b"solid\0\0\0",
        b"endsolid",
    ] {
        check("a.stl", binary_stl(header, 1, [0, 0], b""), &Silence);
        check("a.stl", binary_stl(header, 1, [0, 0], b"\r\n"), &Warning(&["2 bytes behind"]));
        check("a.stl", binary_stl(header, 1, [0, 0], &[7; 50]), &Warning(&["50 bytes behind"]));
        check("a.stl", binary_stl(header, 1, [0x1f, 0x80], b""), &Warning(&["facet 0", "colour"]));
        check("a.stl", binary_stl(header, 2, [0, 0], b""), &Refusal(&["truncated", "184 bytes, got 134"]));
        check("a.stl", binary_stl(header, u32::MAX, [0, 0], b""), &Refusal(&["truncated"]));
        check("a.stl", binary_stl(header, 0, [0, 0], b""), &Refusal(&["0 triangles announced", "50 bytes"]));
        let mut turned = binary_stl(header, 1, [0, 0], b"");
        turned[84 + 11] = 0xbf;
        check("a.stl", &turned, &Warning(&["facet 0", "normal points to its back"]));
        let mut nan = binary_stl(header, 1, [0, 0], b"");
        nan[84..96].fill(0xff);
        check("a.stl", &nan, &Silence);
        nan[96..100].fill(0xff);
        check("a.stl", &nan, &Refusal(&["facet 0", "not finite"]));
    }
    println!("60 variants");
}

#[test]
fn stl_text() {
    let edited = |from: &str, to: &str| {
        assert!(STL.contains(from), "{from}");
        STL.replacen(from, to, 1)
    };
    let half = STL.replace("vertex 2", "vertex 1");
    let variants: &[(String, Gives)] = &[
        (edited("endloop", "end loop"), Silence),
        (edited("endfacet", "end facet"), Silence),
        (edited("endsolid", "end solid"), Silence),
        (STL.to_uppercase(), Silence),
        (edited("solid part one", "solid"), Silence),
        (edited("endsolid part one\n", ""), Silence),
        (edited("endsolid part one\n", "endsolid"), Silence),
        (STL.replace('\n', " "), Silence),
        (STL.replace('\n', "\n\n"), Silence),
        (STL.replace('\n', "\r\r\n"), Silence),
        (edited("solid part one\n", ""), Silence),
        (format!("\n\n  {STL}"), Silence),
        (half.clone() + &half, Silence),
        (edited("normal 0 0 1", "normal nan nan nan"), Silence),
        (edited("normal 0 0 1", "normal -nan(ind) 0 0"), Silence),
        (edited("normal 0 0 1", "normal 0 0 0"), Silence),
        (edited("facet normal 0 0 1", "facet"), Silence),
        (edited("normal 0 0 1", "normal 0 0 -1"), Warning(&["normal points to its back"])),
        (edited("solid part one\n", "solid part one\n# exported\n"), Warning(&["a.stl:2:", "# exported"])),
        (edited(" outer", " color 1 0 0\n outer"), Warning(&["a.stl:3:", "color 1 0 0"])),
        (edited("vertex 2 0 0", "vertex 2 0 0 0.5"), Warning(&["a.stl:5:", "0.5"])),
        (edited("endfacet\n", ""), Refusal(&["a.stl:2:", "truncated", "endfacet"])),
        (edited(" outer loop\n", ""), Warning(&["a.stl:3:", "outer loop"])),
        (edited("  vertex 0 0 0\n", ""), Refusal(&["a.stl:7:", "three vertices", "got 2"])),
        (edited("  vertex 0 2 0\n endloop\nendfacet", ""), Refusal(&["a.stl", "truncated"])),
        (edited("vertex 2 0 0", "vertex 2,0 0 0"), Refusal(&["a.stl:5:", "three numbers", "2,0"])),
        (edited("vertex 2 0 0", "vertx 2 0 0"), Refusal(&["a.stl:8:", "three vertices", "got 2"])),
        (edited("vertex 2 0 0", "vertex 2 0"), Refusal(&["a.stl:5:", "three numbers"])),
        (edited("vertex 2 0 0", "vertex inf 0 0"), Refusal(&["a.stl:5:", "not finite"])),
        (
            edited("facet normal 0 0 1\n", "facet normal 0 0 1\nendfacet\n"),
            Refusal(&["a.stl:3:", "three vertices"]),
        ),
        (edited("vertex 0 2 0", "vertex 1 1 0\n vertex 0 2 0"), Warning(&["4 vertices"])),
        ("solid nothing\nendsolid nothing\n".into(), Refusal(&["a.stl", "empty", "no facet among 0"])),
        ("no".into(), Refusal(&["not an STL file"])),
    ];
    variants.iter().for_each(|(content, gives)| check("a.stl", content, gives));
    println!("{} variants", variants.len());
}

/// A glTF file of one triangle, piece by piece.
struct Gltf {
    positions: Vec<u8>,
    /// Keys of the accessor of the positions.
    accessor: String,
    stride: usize,
    indices: Option<(u32, Vec<u8>)>,
    /// Keys of the primitive and the node, the whole file, and the materials.
    primitive: String,
    node: String,
    file: String,
}

impl Default for Gltf {
    fn default() -> Self {
        let positions = [0.0f32, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0];
        Gltf {
            positions: positions.iter().flat_map(|x| x.to_le_bytes()).collect(),
            accessor: "\"componentType\": 5126".into(),
            stride: 12,
            indices: Some((5123, [0u16, 1, 2].iter().flat_map(|i| i.to_le_bytes()).collect())),
            primitive: String::new(),
            node: String::new(),
            file: String::new(),
        }
    }
}

fn gltf(of: &Gltf) -> String {
    use base64::Engine;
    let mut buffer = of.positions.clone();
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let start = buffer.len();
    let mut accessors = format!("{{\"bufferView\": 0, \"count\": 3, \"type\": \"VEC3\", {}}}", of.accessor);
    let mut views =
        format!("{{\"buffer\": 0, \"byteLength\": {}, \"byteStride\": {}}}", of.positions.len(), of.stride);
    let mut keys = of.primitive.clone();
    if let Some((kind, indices)) = &of.indices {
        keys += ", \"indices\": 1";
        accessors += &format!(
            ",\n {{\"bufferView\": 1, \"count\": 3, \"type\": \"SCALAR\", \"componentType\": {kind}}}"
        );
        views += &format!(", {{\"buffer\": 0, \"byteOffset\": {start}, \"byteLength\": {}}}", indices.len());
        buffer.extend(indices);
    }
    let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
    format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, {}\n\"scene\": 0,\n\"scenes\": [{{\"nodes\": [0]}}],\n\
         \"nodes\": [{{\"mesh\": 0{}}}],\n\
         \"meshes\": [{{\"primitives\": [{{\"attributes\": {{\"POSITION\": 0}}{keys}}}]}}],\n\
         \"accessors\": [{accessors}],\n\"bufferViews\": [{views}],\n\
         \"buffers\": [{{\"byteLength\": {}, \"uri\": \"data:application/octet-stream;base64,{data}\"}}]}}\n",
        of.file,
        of.node,
        buffer.len()
    )
}

#[test]
fn gltf_numbers_of_any_type() {
    let mut count = 0;
    let indices: [Option<(u32, Vec<u8>)>; 4] = [
        None,
        Some((5121, vec![0, 1, 2])),
        Gltf::default().indices,
        Some((5125, [0u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()).collect())),
    ];
    // Code, size, largest value of a fraction; 8 and 16 bits as KHR_mesh_quantization has them.
    for (code, size, most) in [(5120, 1, 127i32), (5121, 1, 255), (5122, 2, 32767), (5123, 2, 65535)] {
        for (normalized, stride) in [(false, 8), (true, 8), (false, 12), (true, 3 * size)] {
            for indices in &indices {
                let corner = if normalized { most } else { 2 };
                let mut positions = vec![0u8; 3 * stride];
                for (vertex, axis) in [(1, 0), (2, 1)] {
                    let at = vertex * stride + axis * size;
                    positions[at..at + size].copy_from_slice(&corner.to_le_bytes()[..size]);
                }
                // A fraction of 1 is scaled by the node.
                let node = if normalized { ", \"scale\": [2, 2, 2]" } else { "" };
                let required = "\"extensionsRequired\": [\"KHR_mesh_quantization\"],";
                let of = Gltf {
                    positions,
                    stride,
                    accessor: format!("\"componentType\": {code}, \"normalized\": {normalized}"),
                    node: node.into(),
                    file: required.into(),
                    indices: indices.clone(),
                    ..Gltf::default()
                };
                check("a.gltf", gltf(&of), &Silence);
                count += 1;
            }
        }
    }
    println!("{count} variants");
}

#[test]
fn gltf_extensions_and_what_is_not_applied() {
    let file = |keys: &str| gltf(&Gltf { file: keys.into(), ..Gltf::default() });
    let node = |keys: &str| gltf(&Gltf { node: keys.into(), ..Gltf::default() });
    let primitive = |keys: &str| gltf(&Gltf { primitive: keys.into(), ..Gltf::default() });
    let both = |file: &str, primitive: &str| {
        gltf(&Gltf { file: file.into(), primitive: primitive.into(), ..Gltf::default() })
    };
    for harmless in [
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "EXT_texture_avif",
        "MSFT_texture_dds",
        "KHR_materials_unlit",
        "KHR_materials_transmission",
        "KHR_materials_variants",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_lights_punctual",
        "EXT_lights_image_based",
        "KHR_xmp_json_ld",
        "EXT_mesh_features",
        "EXT_structural_metadata",
        "EXT_mesh_gpu_instancing",
    ] {
        check("a.gltf", file(&format!("\"extensionsRequired\": [\"{harmless}\"],")), &Silence);
        check("a.gltf", file(&format!("\"extensionsUsed\": [\"{harmless}\"],")), &Silence);
    }
    let materials = |list: &str| format!("\"materials\": [{list}],");
    let variants: &[(String, Gives)] = &[
        (
            file("\"extensionsRequired\": [\"VENDOR_bent_space\"],"),
            Warning(&["VENDOR_bent_space", "unknown"]),
        ),
        (file("\"extensionsUsed\": [\"VENDOR_bent_space\"],"), Silence),
        (file("\"animations\": [{\"channels\": []}],"), Warning(&["animations are not applied"])),
        (file("\"skins\": [{\"joints\": [0]}],"), Silence),
        (node(", \"skin\": 0"), Warning(&["skin is not applied"])),
        (node(", \"weights\": [0.5]"), Silence),
        (primitive(", \"targets\": [{\"POSITION\": 0}]"), Silence),
        (
            gltf(&Gltf {
                node: ", \"weights\": [0.5]".into(),
                primitive: ", \"targets\": [{\"POSITION\": 0}]".into(),
                ..Gltf::default()
            }),
            Warning(&["morph targets are not applied"]),
        ),
        (node(", \"extensions\": {\"KHR_node_visibility\": {\"visible\": true}}"), Silence),
        (
            node(", \"extensions\": {\"KHR_node_visibility\": {\"visible\": false}}"),
            Refusal(&["no facet is left", "not visible"]),
        ),
        (both(&materials("{}"), ", \"material\": 0"), Silence),
        (
            both(&materials("{}, {}"), ", \"material\": 0"),
            Warning(&["materials[0] has no name", "material_0"]),
        ),
        (
            both(&materials("{\"name\": \"a\"}, {\"name\": \"a\"}"), ", \"material\": 0"),
            Warning(&["materials[0] and [1]", "\"a\""]),
        ),
        (
            both(&materials("{\"name\": \"a\"}"), ", \"material\": 7"),
            Refusal(&["meshes[0], primitive 0", "material 7"]),
        ),
        (primitive(", \"extensions\": {\"KHR_draco_mesh_compression\": {\"bufferView\": 0}}"), Silence),
        (
            primitive(", \"extensions\": {\"KHR_draco_mesh_compression\": {\"bufferView\": 0}}")
                .replace("{\"bufferView\": 0, \"count\"", "{\"count\""),
            Refusal(&["KHR_draco_mesh_compression is not supported"]),
        ),
        (
            primitive(", \"extensions\": {\"KHR_draco_mesh_compression\": {\"bufferView\": 0}}")
                .replace("\"POSITION\": 0", ""),
            Refusal(&["KHR_draco_mesh_compression is not supported"]),
        ),
        (
            gltf(&Gltf::default())
                .replace("\"byteStride\": 12", "\"extensions\": {\"EXT_meshopt_compression\": {}}"),
            Refusal(&["accessors[0]", "EXT_meshopt_compression", "not supported"]),
        ),
        (gltf(&Gltf::default()).replace("\"2.0\"", "\"1.0\""), Refusal(&["version 1.0", "2.0"])),
        (gltf(&Gltf::default()).replace("\"2.0\"", "\"2.1\""), Silence),
        (gltf(&Gltf::default()).replace("\"scene\": 0,\n", ""), Silence),
        (
            gltf(&Gltf::default()).replace("\"scene\": 0,\n\"scenes\": [{\"nodes\": [0]}],", ""),
            Warning(&["no scene"]),
        ),
        (
            gltf(&Gltf::default()).replace("[{\"nodes\": [0]}]", "[{\"nodes\": [0]}, {\"nodes\": []}]"),
            Warning(&["scene 0 of 2"]),
        ),
        (gltf(&Gltf::default()).replace("\"scene\": 0", "\"scene\": 3"), Refusal(&["scene 3"])),
        (
            gltf(&Gltf::default()).replace("\"type\": \"VEC3\"", "\"type\": \"VEC2\""),
            Refusal(&["POSITION", "VEC3", "VEC2"]),
        ),
        (gltf(&Gltf::default()).replace("5126", "5130"), Refusal(&["accessors[0]", "5130"])),
        (
            gltf(&Gltf::default()).replace("\"byteStride\": 12", "\"byteStride\": 4"),
            Refusal(&["byteStride", "12"]),
        ),
        (gltf(&Gltf::default()).replace("\"mesh\": 0", "\"mesh\": 2"), Refusal(&["nodes[0]", "mesh 2"])),
        (primitive(", \"mode\": 5"), Silence),
        (primitive(", \"mode\": 6"), Silence),
        (primitive(", \"mode\": 9"), Refusal(&["mode 9"])),
        (primitive(", \"mode\": 1"), Refusal(&["no facet among 0 vertices"])),
        (
            gltf(&Gltf { indices: Some((5121, vec![0, 1, 3])), ..Gltf::default() }),
            Refusal(&["index 3 (number 2)", "0 to 2"]),
        ),
        (
            gltf(&Gltf::default()).replace("data:application/octet-stream;base64,", "http://host/"),
            Refusal(&["buffers[0]", "http://host/"]),
        ),
        ("{\"asset\": ".into(), Refusal(&["a.gltf:1:", "not a glTF document"])),
        ("[]".into(), Refusal(&["a.gltf:1:", "not a glTF document"])),
    ];
    variants.iter().for_each(|(content, gives)| check("a.gltf", content, gives));
    println!("{} variants", variants.len() + 30);
    let sheet = both(&materials("{\"name\": \"sheet\", \"doubleSided\": true}"), ", \"material\": 0");
    assert_eq!(read("a.gltf", sheet).unwrap().double_sided, [0]);
}

#[test]
fn gltf_instances_are_placed() {
    // The positions of the triangle serve as places and scales of three instances; the second and third are twice as large
    // along one axis, and 0 along the others.
    let place = |attributes: &str| {
        let keys = format!(
            ", \"extensions\": {{\"EXT_mesh_gpu_instancing\": {{\"attributes\": {{{attributes}}}}}}}"
        );
        read("a.gltf", gltf(&Gltf { node: keys, ..Gltf::default() }))
    };
    let moved = place("\"TRANSLATION\": 0").unwrap();
    assert_eq!((moved.facets.len(), area(&moved)), (3, 6.0));
    assert_eq!(moved.vertices[3], [2.0, 0.0, 0.0]);
    assert_eq!(moved.vertices[7], [2.0, 2.0, 0.0]);
    let scaled = place("\"SCALE\": 0").unwrap();
    assert_eq!((scaled.facets.len(), area(&scaled)), (3, 0.0));
    assert_eq!(place("").unwrap().facets.len(), 1);
    assert!(place("\"TRANSLATION\": 9").err().unwrap().contains("EXT_mesh_gpu_instancing: accessor 9"));
    assert!(place("\"ROTATION\": 0").err().unwrap().contains("VEC4"));
}

#[test]
fn gltf_sparse_accessors_replace_elements() {
    // The first view holds the positions; the sparse values are the third position, put in the second's place.
    let of = Gltf {
        accessor: "\"componentType\": 5126, \"sparse\": {\"count\": 1, \"indices\": {\"bufferView\": 1, \"byteOffset\": 2, \
                   \"componentType\": 5123}, \"values\": {\"bufferView\": 0, \"byteOffset\": 24}}"
            .into(),
        ..Gltf::default()
    };
    let mesh = read("a.gltf", gltf(&of)).unwrap();
    assert_eq!(mesh.vertices, [[0.0; 3], [0.0, 2.0, 0.0], [0.0, 2.0, 0.0]]);
}
