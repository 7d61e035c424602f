//! Meshes of glTF files that are compressed by Draco.

use std::path::Path;

use base64::Engine;
use rtsl_scene::SceneSource;

use crate::gltf::{Files, buffer_of, loaded, options, png};

/// Squares with texture coordinates and colours, compressed by Draco in sequence and along edges.
const DRACO: [&str; 2] = [
    "RFJBQ08CAgEAAAACBAEAAQIAAgMBAwAJAwAAAwkCAAECAgQBAgICAQABAQADAwEwARADADSCiAQAAAAA/wAAAAABAQADAwEgASADACCEhgIAAAAA\
     /wAAAAABAQAJAwEgFwEgAwDwgykQAPAPIBDwPwAAAAD/AAAAAAAAAAAAAAAAAAAAAACAPwgAAAAAAAAAAAAAgD8I",
    "RFJBQ08CAgEBAAAABAICAgAAAR//ARH/ARH/ARED/wAAAAAAAQAAAQAJAwAAAgEDCQIAAQIBAgIEAQIBAQEBAAMDATABEAMAKIKYAAAAAAD/AAAA\
     AAAAAAAAAAAAAAAAAACAPwgBAQEAAwMBIAEgAwDwg6YAAAAAAP8AAAAAAAAAAAAAAAAAgD8IAQEBAAkDASABEBMBEAMAcJApMQABAP8AAAAA/wAA\
     AA==",
];

/// A file with a square whose arrays are compressed.
fn compressed(bytes: &[u8], corners: usize) -> Files {
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    let length = bytes.len();
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["KHR_draco_mesh_compression"],
        "nodes": [{{"mesh": 0}}], "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}}],
        "textures": [{{"source": 0}}], "images": [{{"uri": "map%20one.png"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}}, "indices": 3,
            "material": 0, "extensions": {{"KHR_draco_mesh_compression": {{"bufferView": 0,
                "attributes": {{"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}}}}}}}}]}}],
        "accessors": [{{"componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"componentType": 5121, "count": 4, "type": "VEC4", "normalized": true}},
            {{"componentType": 5123, "count": {corners}, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": {length}}}],
        "buffers": [{{"byteLength": {length}, "uri": "data:application/octet-stream;base64,{data}"}}]}}"#
    );
    Files::default().with("model.gltf", text).with("map one.png", png())
}

fn of_draco(method: usize) -> Vec<u8> {
    base64::engine::general_purpose::STANDARD.decode(DRACO[method]).expect("valid")
}

#[test]
fn meshes_compressed_by_draco_are_decoded() {
    for method in [0, 1] {
        let (description, _, warnings) = loaded(&compressed(&of_draco(method), 6));
        assert_eq!(warnings, "");
        let shape = description.shapes[0].shape;
        let [positions, uvs, colors] =
            ["positions", "uvs", "colors"].map(|name| buffer_of(&description, shape, name));
        let mut vertices: Vec<_> = positions
            .chunks(3)
            .zip(uvs.chunks(2))
            .zip(colors.chunks(4))
            .map(|((position, uv), color)| (position.to_vec(), uv.to_vec(), color.to_vec()))
            .collect();
        vertices.sort_by(|a, b| a.0.partial_cmp(&b.0).expect("numbers"));
        let half = 127.0 / 255.0;
        let vertex = |x: f32, y: f32, color: [f32; 4]| (vec![x, y, 0.], vec![x, y], color.to_vec());
        let expected = [
            vertex(0., 0., [1., 0., 0., 1.]),
            vertex(0., 1., [1., 1., 1., 1.]),
            vertex(1., 0., [0., 1., 0., half]),
            vertex(1., 1., [0., 0., 1., 1.]),
        ];
        assert_eq!(vertices, expected, "{method}");
        let indices = buffer_of(&description, shape, "indices");
        assert_eq!(indices.len(), 6);
    }
}

#[test]
fn what_draco_cannot_decode_is_left_out() {
    let warning = |files: &Files| {
        let mut source = SceneSource::read(Path::new("model.gltf"), files, &options(None));
        let messages = source.load().expect_err("there is no surface").to_text(false);
        let line = messages.lines().find(|line| line.contains("primitive")).map(str::to_owned);
        line.unwrap_or(messages)
    };
    let start = "warning[W0601]: primitive 0 of a mesh is left out: `KHR_draco_mesh_compression`: ";
    let whole = of_draco(1);
    let cut = warning(&compressed(&whole[..60], 6));
    assert!(cut.starts_with(start), "{cut}");
    // The accessor promises one triangle.
    let many = warning(&compressed(&whole, 3));
    assert_eq!(
        many,
        format!(
            "{start}Decode limit exceeded: stream decodes 2 faces, over the caller's ceiling of 1"
        )
    );
    let mut files = compressed(&whole, 6);
    let text = String::from_utf8(files.0[Path::new("model.gltf")].clone()).expect("text");
    let text = text.replace(r#""COLOR_0": 2}}"#, r#""COLOR_0": 9}}"#);
    files.0.insert("model.gltf".into(), text.into_bytes());
    assert_eq!(warning(&files), format!("{start}its compressed data have no attribute 9"));
}
