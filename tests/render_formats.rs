//! The mesh readers of the `render` program: order, materials, normals and precision, to the bit.
#![cfg(feature = "std")]

#[path = "../kernel/examples/render/failure.rs"]
#[allow(dead_code)]
mod failure;
#[path = "../kernel/examples/render/mesh_file/mod.rs"]
#[allow(dead_code)]
mod mesh_file;
#[path = "../kernel/examples/render/text_file.rs"]
mod text_file;

use base64::Engine;
use mesh_file::{Mesh, NO_NORMAL};

fn read(name: &str, content: impl AsRef<[u8]>) -> Result<Mesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    mesh_file::read(&path).map_err(|failure| failure.to_string())
}

fn mesh(name: &str, content: impl AsRef<[u8]>) -> Mesh {
    read(name, content).unwrap_or_else(|failure| panic!("{failure}"))
}

fn fails(name: &str, content: impl AsRef<[u8]>, words: &[&str]) {
    let failure = read(name, content).err().expect("an error");
    for word in words {
        assert!(failure.contains(word), "{word:?} is missing: {failure}");
    }
}

/// Twice the signed area about +z.
fn area(mesh: &Mesh) -> f64 {
    let [x, y] = [0, 1].map(|axis| move |v: [f64; 3]| v[axis]);
    mesh.facets
        .iter()
        .map(|f| f.map(|i| mesh.vertices[i as usize]))
        .map(|[a, b, c]| (x(b) - x(a)) * (y(c) - y(a)) - (x(c) - x(a)) * (y(b) - y(a)))
        .sum()
}

const OBJ: &str = "\
# comment
mtllib missing.mtl
o first
v 0.12345678901234567 0 1e-300 1.0
v 1 0 0 # a remark
v 1 1 0\r
v 0 1 0
vn 0 0 1
vn 0 0 2
vt 0 0
l 1 2
f 1 2 3
usemtl steel blue
f 1/1/1 \\
  2/1/2 3/1/1
usemtl steel
g group
f -4//1 -3//2 -2//1
usemtl steel blue
s off
f 1/1 2/1 3/1 4/1";

#[test]
fn obj_keeps_order_materials_normals_and_digits() {
    let mesh = mesh("a.OBJ", OBJ);
    assert_eq!(mesh.vertices[0], [0.12345678901234567, 0.0, 1e-300]);
    assert_eq!(mesh.facets, [[0, 1, 2], [0, 1, 2], [0, 1, 2], [0, 1, 2], [0, 2, 3]]);
    let names: Vec<&str> =
        mesh.facet_materials.iter().map(|i| mesh.material_names[*i as usize].as_str()).collect();
    assert_eq!(names, ["default", "steel blue", "steel", "steel blue", "steel blue"]);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]);
    let none = [NO_NORMAL; 3];
    assert_eq!(mesh.facet_normals, [none, [0, 1, 0], [0, 1, 0], none, none]);
    assert!(mesh.has_normals());
}

#[test]
fn convex_polygons_are_fans_and_others_are_clipped() {
    let polygon = |points: &[[f64; 2]], offset: f64| {
        let mut text = String::new();
        points.iter().for_each(|[x, y]| text += &format!("v {} {} {}\n", x + offset, y + offset, 0.0));
        text += "f";
        (1..=points.len()).for_each(|i| text += &format!(" {i}"));
        mesh("a.obj", text)
    };
    let hexagon = [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]];
    // A corner on a straight edge is not a notch.
    assert_eq!(polygon(&hexagon, 0.0).facets, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
    let arrow = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
    let comb = [
        [0.0, 0.0],
        [5.0, 0.0],
        [5.0, 3.0],
        [4.0, 3.0],
        [4.0, 1.0],
        [3.0, 3.0],
        [2.0, 1.0],
        [1.0, 3.0],
        [0.0, 2.0],
    ];
    let shoelace = |p: &[[f64; 2]]| -> f64 {
        (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
    };
    for points in [&arrow[..], &comb] {
        // The second is far from the origin, where f32 would have no digits left.
        for offset in [0.0, 1e7] {
            let mesh = polygon(points, offset);
            assert_eq!(mesh.facets.len(), points.len() - 2);
            for facet in &mesh.facets {
                let one = Mesh { vertices: mesh.vertices.clone(), facets: vec![*facet], ..Mesh::default() };
                assert!(area(&one) > 0.0, "{facet:?} lies outside");
            }
            // Products of numbers of size 1e7, rounded at 2^-53.
            assert!((area(&mesh) - shoelace(points)).abs() < 1e-6);
        }
    }
    // The sense of rotation stays, also seen from below.
    let mut turned = arrow;
    turned.reverse();
    assert!((area(&polygon(&turned, 0.0)) + shoelace(&arrow)).abs() < 1e-12);
}

#[test]
fn a_polygon_without_area_keeps_its_facets() {
    let mesh = mesh("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4\nf 1 1 2\nf 1 3 2 4\n");
    assert_eq!(mesh.facets.len(), 5);
}

#[test]
fn ply_is_read_in_all_encodings() {
    let head = |format: &str, coordinate: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty {coordinate} x\n\
             property {coordinate} y\nproperty {coordinate} z\nproperty uchar red\nelement edge 1\n\
             property int vertex1\nproperty int vertex2\nelement face 2\n\
             property list uchar uint vertex_index\nend_header\n"
        )
    };
    let points = [[6378137.123456789, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
    let mut text = head("ascii", "double");
    points.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z} 7\n"));
    text += "0 1\n3 0 1 2\n4 0 1 2 3\n";
    let binary = |big: bool| {
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut bytes = head(format, "double").into_bytes();
        let f64_bytes = |x: f64| if big { x.to_be_bytes() } else { x.to_le_bytes() };
        let u32_bytes = |x: u32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
        for point in points {
            point.iter().for_each(|x| bytes.extend(f64_bytes(*x)));
            bytes.push(7);
        }
        [0, 1].iter().for_each(|i| bytes.extend(u32_bytes(*i)));
        for face in [&[0, 1, 2][..], &[0, 1, 2, 3]] {
            bytes.push(face.len() as u8);
            face.iter().for_each(|i| bytes.extend(u32_bytes(*i)));
        }
        bytes
    };
    for content in [text.clone().into_bytes(), binary(false), binary(true)] {
        let mesh = mesh("a.ply", &content);
        assert_eq!(mesh.vertices, points);
        assert_eq!(mesh.facets, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
        assert_eq!((mesh.material_names.len(), mesh.has_normals()), (1, false));
        fails("a.ply", &content[..content.len() - 6], &["a.ply"]);
    }
    // What is declared as float has the digits of a float.
    let single = text.replace("double", "float");
    assert_eq!(mesh("a.ply", single).vertices[3], [0.0, 1.0, f64::from(0.1f32)]);
    fails("a.ply", text.replace("3 0 1 2\n", "3 0 1 4\n"), &["a.ply:20:", "vertex index 4", "0 to 3"]);
    fails("a.ply", text.replace("1 1 0 7", "nan 1 0 7"), &["a.ply:17:", "NaN", "not finite"]);
    fails("a.ply", text.replace("1 1 0 7", "one 1 0 7"), &["a.ply:17:", "property x", "\"one\""]);
    // A colour is of no matter.
    assert_eq!(mesh("a.ply", text.replace("1 1 0 7", "1 1 0 red")).facets.len(), 3);
    let mut nan = binary(false);
    let third = nan.windows(10).position(|word| word == b"end_header").unwrap() + 11 + 2 * 25;
    nan[third..third + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    fails("a.ply", nan, &["vertex 2", "not finite"]);
    fails("a.ply", text.replace("vertex_index", "corners"), &["vertex_indices"]);
    fails("a.ply", text.replace("double z", "double w"), &["x, y and z"]);
    fails("a.ply", "solid", &["a.ply"]);
}

#[test]
fn ply_normals_belong_to_the_vertices() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty short y\nproperty double z\n\
                property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
                property list int int vertex_indices\nend_header\n0 0 0 0 0 1\n1 0 0 0 1 0\n0 1 0 1 0 0\n3 0 1 2\n";
    let mesh = mesh("a.ply", text);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    assert_eq!((mesh.facet_normals[0], mesh.has_normals()), ([0, 1, 2], true));
}

const STL: &str = "\
solid two triangles
  facet normal 0 0 1
    outer loop
      vertex 0 0 -0.0
      vertex 1.1 0 0
      vertex 0 1 0
    endloop
  endfacet
  FACET NORMAL 0 0 1
    OUTER LOOP
      VERTEX 1.1 0 0
      VERTEX 6378137.123456789 1 0
      VERTEX 0 1 0
    ENDLOOP
  ENDFACET
endsolid
";

#[test]
fn stl_text_keeps_its_digits() {
    let mesh = mesh("a.stl", STL);
    let far = [6378137.123456789, 1.0, 0.0];
    assert_eq!(mesh.vertices, [[0.0, 0.0, 0.0], [1.1, 0.0, 0.0], [0.0, 1.0, 0.0], far]);
    assert_eq!(mesh.facets, [[0, 1, 2], [1, 3, 2]]);
    assert!(!mesh.has_normals());
    fails("a.stl", STL.replace("1.1", "nan"), &["a.stl:5:", "not finite"]);
    fails("a.stl", STL.replace("1.1", "one"), &["a.stl:5:", "three numbers", "\"vertex one 0 0\""]);
    fails("a.stl", STL.replacen("      vertex 0 1 0\n", "", 1), &["a.stl:7:", "three vertices"]);
    fails("a.stl", STL.split_once("  endfacet").unwrap().0, &["truncated"]);
    fails("a.stl", "solid nothing\nendsolid\n", &["empty"]);
}

#[test]
fn stl_binary_is_known_by_its_size() {
    let triangles: [[f32; 9]; 2] = [[0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0, 0.0], [1.0; 9]];
    // Many exporters begin the free header with the word that text files begin with.
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(2u32.to_le_bytes());
    for triangle in triangles {
        [0.0f32; 3].iter().chain(&triangle).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    let mesh = mesh("a.stl", &bytes);
    assert_eq!(mesh.vertices, [[0.0; 3], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]]);
    // A degenerate facet keeps its index.
    assert_eq!(mesh.facets, [[0, 1, 2], [3, 3, 3]]);
    bytes[..5].copy_from_slice(b"plain");
    fails("a.stl", &bytes[..150], &["truncated", "184"]);
    bytes[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    fails("a.stl", &bytes, &["not finite"]);
    fails("a.stl", "no", &["not an STL file"]);
}

/// Positions of a triangle, its normals, and the indices 0 1 2 in 16 bits.
fn gltf_buffer() -> Vec<u8> {
    let positions = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0];
    let normals = [0.0f32, 0.0, 1.0].repeat(3);
    let mut buffer: Vec<u8> = positions.iter().chain(&normals).flat_map(|x| x.to_le_bytes()).collect();
    [0u16, 1, 2].iter().for_each(|i| buffer.extend(i.to_le_bytes()));
    buffer
}

fn gltf_json(uri: &str, nodes: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{nodes}],
        "meshes": [{{"primitives": [
            {{"attributes": {{"POSITION": 0, "NORMAL": 1}}, "indices": 2, "material": 0}},
            {{"attributes": {{"POSITION": 0}}, "mode": 5}},
            {{"attributes": {{"POSITION": 0}}, "mode": 1}}]}}],
        "materials": [{{"name": "gold"}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 0]}},
            {{"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"}},
            {{"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"}}],
        "bufferViews": [
            {{"buffer": 0, "byteOffset": 0, "byteLength": 36}},
            {{"buffer": 0, "byteOffset": 36, "byteLength": 36}},
            {{"buffer": 0, "byteOffset": 72, "byteLength": 6}}],
        "buffers": [{{{uri}"byteLength": 78}}]}}"#
    )
}

fn data_uri() -> String {
    let encoded = base64::engine::general_purpose::STANDARD.encode(gltf_buffer());
    format!("\"uri\": \"data:application/octet-stream;base64,{encoded}\", ")
}

#[test]
fn gltf_applies_the_transforms_of_all_ancestors() {
    // Half a turn about z, doubled along x, and moved by what f32 cannot hold; then mirrored by the parent.
    let nodes = r#"{"children": [1], "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
        {"mesh": 0, "translation": [6378137.123456789, 0, 0], "rotation": [0, 0, 1, 0], "scale": [2, 1, 1]}"#;
    let mesh = mesh("a.gltf", gltf_json(&data_uri(), nodes));
    let x = -6378137.123456789;
    assert_eq!(mesh.vertices[..3], [[x, 0.0, 0.0], [x + 2.0, 0.0, 0.0], [x, -2.0, 0.0]]);
    // The mirroring turns the winding round, so that the front stays the front.
    assert_eq!(mesh.facets, [[0, 2, 1], [3, 5, 4]]);
    assert_eq!(mesh.material_names, ["gold", "default"]);
    assert_eq!(mesh.facet_materials, [0, 1]);
    assert_eq!(mesh.facet_normals, [[0, 2, 1], [NO_NORMAL; 3]]);
    for normal in &mesh.normals {
        assert!(normal[0] == 0.0 && normal[1] == 0.0 && normal[2] > 0.0, "{normal:?}");
    }
}

#[test]
fn gltf_buffers_may_lie_beside_or_inside() {
    let folder = tempfile::tempdir().unwrap();
    let nodes = r#"{"mesh": 0}"#;
    let json = gltf_json("\"uri\": \"a%20b.bin\", ", nodes);
    std::fs::write(folder.path().join("a.gltf"), json).unwrap();
    let failure = mesh_file::read(&folder.path().join("a.gltf")).err().unwrap().to_string();
    assert!(failure.contains("buffers[0]") && failure.contains("a b.bin"), "{failure}");
    std::fs::write(folder.path().join("a b.bin"), gltf_buffer()).unwrap();
    let beside = mesh_file::read(&folder.path().join("a.gltf")).unwrap();
    let mut json = gltf_json("", nodes).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut buffer = gltf_buffer();
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut glb = b"glTF".to_vec();
    let chunk = |length: usize| (length as u32).to_le_bytes();
    glb.extend(2u32.to_le_bytes());
    glb.extend(chunk(12 + 8 + json.len() + 8 + buffer.len()));
    glb.extend(chunk(json.len()).iter().chain(b"JSON").chain(&json));
    glb.extend(chunk(buffer.len()).iter().chain(b"BIN\0").chain(&buffer));
    let inside = mesh("a.glb", &glb);
    assert_eq!(beside.vertices, inside.vertices);
    assert_eq!(beside.facets, inside.facets);
    fails("a.glb", &glb[..100], &["a.glb"]);
}

#[test]
fn broken_gltf_is_refused() {
    let good = gltf_json(&data_uri(), r#"{"mesh": 0}"#);
    for (from, to, word) in [
        ("\"byteLength\": 78", "\"byteLength\": 79", "79 bytes"),
        ("\"byteOffset\": 72", "\"byteOffset\": 90", "beyond its buffer"),
        ("\"byteLength\": 6}", "\"byteLength\": 4}", "beyond its buffer"),
        ("\"count\": 3, \"type\": \"SCALAR\"", "\"count\": 2, \"type\": \"SCALAR\"", "multiple of 3"),
        ("\"componentType\": 5123", "\"componentType\": 5126", "accessors[2]"),
        ("\"nodes\": [0]}]", "\"nodes\": [7]}]", "a.gltf"),
        ("\"scenes\": [{\"nodes\": [0]}]", "\"scenes\": []", "a.gltf"),
        ("{\"mesh\": 0}", "{\"mesh\": 0, \"translation\": [1e999, 0, 0]}", "a.gltf"),
        ("{\"mesh\": 0}", "{\"children\": [0]}", "ancestor"),
        ("{\"mesh\": 0}", "{\"name\": \"nothing\"}", "empty"),
        ("{\"mesh\": 0}", "{\"mesh\": 0, \"rotation\": [0, 0, 0, 0]}", "nodes[0]"),
    ] {
        assert!(good.contains(from), "{from}");
        fails("a.gltf", good.replacen(from, to, 1), &[word]);
    }
}
