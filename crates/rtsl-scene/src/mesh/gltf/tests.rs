use std::io;

use base64::Engine;

use super::*;

/// Two triangles over four vertices, as bytes: positions, normals, texture coordinates of 16 bits, and
/// indices of 16 bits.
fn buffer() -> Vec<u8> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0_f32]];
    let mut bytes = Vec::new();
    for [x, y] in corners {
        bytes.extend([x, y, 0.0].iter().flat_map(|number| number.to_le_bytes()));
    }
    for _ in corners {
        bytes.extend([0.0, 0.0, 1.0_f32].iter().flat_map(|number| number.to_le_bytes()));
    }
    for [x, y] in corners {
        bytes.extend([x, y].iter().flat_map(|part| ((part * 65535.0) as u16).to_le_bytes()));
    }
    bytes.extend([0, 1, 2, 0, 2, 3_u16].iter().flat_map(|index| index.to_le_bytes()));
    bytes
}

/// The structure of a file whose buffer is at `uri`.
fn json(uri: &str) -> String {
    let length = buffer().len();
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"children": [1, 2], "translation": [10, 0, 0]}}, {{"mesh": 0}},
            {{"mesh": 0, "scale": [-1, 2, 1], "rotation": [0, 0, 1, 0]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}},
            "indices": 3}}, {{"attributes": {{"POSITION": 0}}, "mode": 1}},
            {{"attributes": {{"POSITION": 0}}, "mode": 6}}]}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}},
            {{"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC2"}},
            {{"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 96, "byteStride": 12}},
            {{"buffer": 0, "byteOffset": 96, "byteLength": 16}},
            {{"buffer": 0, "byteOffset": 112, "byteLength": 12}}],
        "buffers": [{{"byteLength": {length}{uri}}}]}}"#
    )
}

fn no_files(_path: &str) -> io::Result<Vec<u8>> {
    Err(io::ErrorKind::NotFound.into())
}

/// A file with its buffer embedded in the text.
fn text() -> String {
    let data = base64::engine::general_purpose::STANDARD.encode(buffer());
    json(&format!(r#", "uri": "data:application/octet-stream;base64,{data}""#))
}

fn binary() -> Vec<u8> {
    let bin = Some(buffer().into());
    let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
    let file = gltf::Glb { header, json: json("").into_bytes().into(), bin };
    file.to_vec().expect("it can be written")
}

fn floats(numbers: &rtsl::Numbers) -> Vec<f32> {
    numbers.words().iter().map(|bits| f32::from_bits(*bits)).collect()
}

#[test]
fn triangles_are_placed_by_their_nodes() {
    let external = json(r#", "uri": "knot%20one.bin""#).into_bytes();
    let file = |path: &str| if path == "knot one.bin" { Ok(buffer()) } else { no_files(path) };
    for (bytes, read) in [
        (text().into_bytes(), &no_files as &dyn Fn(&str) -> io::Result<Vec<u8>>),
        (binary(), &no_files),
        (external, &file),
    ] {
        let mesh = read_gltf(&bytes, read).unwrap();
        assert_eq!((mesh.vertices(), mesh.triangles()), (16, 8));
        // The last node comes first: turned by half a turn, it mirrors y, and so the order of corners.
        let positions = floats(&mesh.positions);
        assert_eq!(positions[..12], [10., 0., 0., 11., 0., 0., 11., -2., 0., 10., -2., 0.]);
        assert_eq!(positions[24..36], [10., 0., 0., 11., 0., 0., 11., 1., 0., 10., 1., 0.]);
        assert_eq!(mesh.indices.words()[..6], [0, 2, 1, 0, 3, 2]);
        assert_eq!(mesh.indices.words()[12..18], [8, 9, 10, 8, 10, 11]);
        // The fan has no normals and no texture coordinates.
        assert_eq!(floats(&mesh.normals)[..6], [0., 0., 1., 0., 0., 1.]);
        assert_eq!(floats(&mesh.normals)[12..24], [0.; 12]);
        assert_eq!(floats(&mesh.uvs)[..8], [0., 0., 1., 0., 1., 1., 0., 1.]);
        assert_eq!(floats(&mesh.uvs)[8..16], [0.; 8]);
        assert_eq!(mesh.indices.words()[6..12], [4, 6, 5, 4, 7, 6]);
    }
}

fn problem(bytes: &[u8]) -> String {
    read_gltf(bytes, &no_files).expect_err("it is wrong").to_string()
}

#[test]
fn what_is_wrong_is_said() {
    let text = text();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        problem(text.replacen(from, to, 1).as_bytes())
    };
    assert_eq!(problem(b"solid"), "it is not a glTF file: expected value at line 1 column 1");
    assert_eq!(problem(b"glTF\x02\0\0\0\x05\0\0\0"), "the file ends within its header");
    assert_eq!(
        with(r#""children": [1, 2]"#, r#""children": [1, 0]"#),
        "node 0 has two parents or contains itself"
    );
    assert_eq!(
        with(r#""indices": 3"#, r#""indices": 9"#),
        "it refers to accessor 9, which does not exist"
    );
    assert_eq!(
        with(r#""POSITION": 0"#, r#""POSITION": 4"#),
        "it refers to accessor 4, which does not exist"
    );
    assert_eq!(with(r#""count": 6"#, r#""count": 7"#), "accessor 3 ends outside its buffer");
    assert_eq!(with(r#""count": 6"#, r#""count": 0"#), "accessor 3 ends outside its buffer");
    assert_eq!(with(r#""mesh": 0}"#, r#""mesh": 3}"#), "it refers to mesh 3, which does not exist");
    assert_eq!(
        with(r#""children": [1, 2]"#, r#""children": [1, 9]"#),
        "it refers to node 9, which does not exist"
    );
    assert_eq!(
        with(r#""version": "2.0""#, r#""version": "1.1""#),
        "it is a glTF file of version 1.1, expected version 2"
    );
    assert_eq!(
        with(r#""count": 4, "type": "VEC2""#, r#""count": 3, "type": "VEC2""#),
        "it has 4 vertices, but 3 of another attribute"
    );
    assert_eq!(
        with(r#""byteStride": 12"#, r#""byteStride": 8"#),
        "accessor 0 has groups that overlap"
    );
    assert_eq!(
        with("base64,", "base64,!"),
        "a buffer in its text is damaged: Invalid symbol 33, offset 0."
    );
    assert_eq!(
        problem(json(r#", "uri": "away.bin""#).as_bytes()),
        "cannot read `away.bin`, which it refers to: entity not found"
    );
    assert_eq!(
        problem(json(r#", "uri": "https://a/b.bin""#).as_bytes()),
        "it refers to `https://a/b.bin`, expected a file"
    );
    assert_eq!(problem(json("").as_bytes()), "it refers to a binary part that it does not have");
    let many = with(
        r#""count": 4, "type": "VEC3", "min""#,
        r#""count": 4294967295, "type": "VEC3", "min""#,
    );
    assert_eq!(many, "it has more than 134217728 vertices");
    let compressed = text
        .replace(
            r#""indices": 3}"#,
            r#""indices": 3, "extensions": {"KHR_draco_mesh_compression": {}}}"#,
        )
        .replace(r#"{"bufferView": 0, "componentType""#, r#"{"componentType""#);
    assert_eq!(
        problem(compressed.as_bytes()),
        "`KHR_draco_mesh_compression`: it names no compressed buffer view"
    );
}

#[test]
fn numbers_may_be_replaced_one_by_one() {
    // The second corner is where the third is, and the fourth accessor has zeros but for one normal.
    let sparse = text().replace(
        r#""count": 4, "type": "VEC3"}"#,
        r#""count": 4, "type": "VEC3", "sparse": {"count": 1,
            "indices": {"bufferView": 2, "byteOffset": 2, "componentType": 5123},
            "values": {"bufferView": 0, "byteOffset": 24}}}"#,
    );
    let mesh = read_gltf(sparse.as_bytes(), &no_files).expect("it is valid");
    // The normal of vertex 1 is the position of vertex 2, turned by the node.
    assert_eq!(floats(&mesh.normals)[24..30], [0., 0., 1., 1., 1., 0.]);
    let unordered = sparse.replace(r#""sparse": {"count": 1"#, r#""sparse": {"count": 3"#);
    assert_eq!(
        problem(unordered.as_bytes()),
        "accessor 1 has sparse indices that are out of order"
    );
}

#[test]
fn every_file_that_was_cut_off_is_refused() {
    let file = binary();
    for length in 0..file.len() {
        assert!(read_gltf(&file[..length], &no_files).is_err(), "{length} bytes");
    }
}
