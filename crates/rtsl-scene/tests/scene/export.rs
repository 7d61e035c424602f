//! glTF files as texts in the format of pbrt-v4.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use base64::Engine;
use expect_test::{Expect, expect};
use rtsl_image::{Encoding, Picture};
use rtsl_memory::InputBudget;
use rtsl_scene::export::{ExportError, ExportOptions, Exported, export_gltf};
use rtsl_scene::reader::MemoryFiles;

type Files = MemoryFiles<Vec<u8>>;

/// A file with two triangles of a material: a square from 0 to 1 with coordinates.
fn files(material: &str, more: &str) -> Files {
    let mut bytes: Vec<u8> = Vec::new();
    let mut floats = |numbers: &[f32]| bytes.extend(numbers.iter().flat_map(|it| it.to_le_bytes()));
    floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    floats(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|it| it.to_le_bytes()));
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}],
        "meshes": [{{"name": "square", "primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}}, "indices": 2,
            "material": 0}}]}}],
        "materials": [{material}], "images": [{{"uri": "map.png"}}], "textures": [{{"source": 0}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 32}},
            {{"buffer": 0, "byteOffset": 80, "byteLength": 12}}],
        "buffers": [{{"byteLength": 92, "uri": "data:application/octet-stream;base64,{data}"}}]{more}}}"#
    );
    Files::default().with("model.gltf", text).with("map.png", image())
}

/// Two texels: their codes.
const TEXELS: [[u8; 4]; 2] = [[255, 128, 64, 255], [0, 200, 255, 51]];

fn image() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("the header is valid");
    writer.write_image_data(TEXELS.as_flattened()).expect("so are the texels");
    drop(writer);
    bytes
}

type Written = BTreeMap<String, Vec<u8>>;

fn export(files: &Files) -> (Exported, Written) {
    let mut written = Written::new();
    let mut write = |name: &str, contents: &[u8]| {
        assert!(written.insert(name.to_owned(), contents.to_vec()).is_none(), "{name} twice");
        Ok(())
    };
    let options = ExportOptions { camera: None, input_memory: None, folder: "new_files" };
    let exported = export_gltf(Path::new("model.gltf"), files, &options, &mut write);
    (exported.expect("the file is valid"), written)
}

/// The directives of the world from the materials to the meshes.
fn check(material: &str, expected: Expect) -> (Exported, Written) {
    let (exported, written) = export(&files(material, ""));
    let text = &exported.text;
    let start = text.find("LightSource").expect("the studio");
    let world = text[start..].split_once("\n\n").expect("an empty line").1;
    expected.assert_eq(world);
    (exported, written)
}

/// The codes of an image that was written.
fn codes(written: &Written, name: &str) -> (usize, Vec<u8>) {
    let read = Picture::read(&written[name], Encoding::Linear, &InputBudget::default());
    let (picture, _) = read.expect("a picture");
    (picture.channels, picture.bytes().expect("8 bits").to_vec())
}

#[test]
fn a_plain_file_has_settings_a_studio_and_a_mesh() {
    let (exported, written) = export(&files(
        r#"{"name": "clay", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1], "metallicFactor": 0,
            "roughnessFactor": 0.5}}"#,
        r#", "scenes": [{"nodes": [0]}]"#,
    ));
    expect![[r##"
        # converted from model.gltf by rtsl
        Integrator "volpath"
            "integer maxdepth" [ 5 ]
        Sampler "zsobol"
            "integer pixelsamples" [ 64 ]
        Film "rgb"
            "integer xresolution" [ 1280 ]
            "integer yresolution" [ 720 ]
            "string filename" [ "new.exr" ]
        Transform [ 0.8762159086766471 -0.15939910459080675 -0.45479402682709774 0 0 0.9437151533160262 -0.3307592922378893 -0 -0.48191874977215593 -0.2898165538014668 -0.8268982305947231 0 -0.43810795433832356 -0.39215802436260977 2.414027637029533 1 ]
        Camera "perspective"
            "float fov" [ 35 ]

        WorldBegin

        LightSource "infinite"
            "string filename" [ "new_files/studio.pfm" ]
            "float scale" [ 1 ]

        MakeNamedMaterial "clay"
            "string type" [ "coateddiffuse" ]
            "float roughness" [ 0.25 ]
            "float eta" [ 1.5 ]
            "bool remaproughness" [ false ]
            "rgb reflectance" [ 0.5 0.25 0.125 ]
        AttributeBegin
            NamedMaterial "clay"
            Shape "plymesh"
                "string filename" [ "new_files/mesh.ply" ]
        AttributeEnd
    "##]].assert_eq(&exported.text);
    assert_eq!(exported.warnings.to_text(false), "");
    let names: Vec<&str> = written.keys().map(String::as_str).collect();
    assert_eq!(names, ["new_files/mesh.ply", "new_files/studio.pfm"]);
    let ply = &written["new_files/mesh.ply"];
    let header = header(4, "", 2);
    assert!(ply.starts_with(header.as_bytes()));
    assert_eq!(ply.len(), header.len() + 4 * 12 + 2 * 13);
}

fn header(vertices: usize, coordinates: &str, faces: usize) -> String {
    format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
        property float z\n{coordinates}element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

/// Channels, factors and cutoffs become images of their own; an image that needs nothing is copied.
#[test]
fn textures_are_copied_or_written_anew() {
    let material = r#"{"name": "tiles", "alphaMode": "MASK", "alphaCutoff": 0.5, "normalTexture": {"index": 0, "scale": 0.5},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}},
            "metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 0.5}}"#;
    let (exported, written) = check(
        material,
        expect![[r#"
        Texture "tiles metallicRoughness width" "float" "imagemap"
            "string filename" [ "new_files/map-2.png" ]
            "string encoding" [ "linear" ]
        Texture "tiles metallicRoughness part" "float" "imagemap"
            "string filename" [ "new_files/map-3.png" ]
            "string encoding" [ "linear" ]
        Texture "tiles baseColor" "spectrum" "imagemap"
            "string filename" [ "new_files/map-4.png" ]
            "float uscale" [ 2 ]
            "float vscale" [ 3 ]
            "float vdelta" [ -2 ]
        MakeNamedMaterial "tiles metal"
            "string type" [ "conductor" ]
            "texture roughness" [ "tiles metallicRoughness width" ]
            "bool remaproughness" [ false ]
            "texture reflectance" [ "tiles baseColor" ]
            "string normalmap" [ "new_files/map.png" ]
        MakeNamedMaterial "tiles"
            "string type" [ "coateddiffuse" ]
            "texture roughness" [ "tiles metallicRoughness width" ]
            "float eta" [ 1.5 ]
            "bool remaproughness" [ false ]
            "texture reflectance" [ "tiles baseColor" ]
            "string normalmap" [ "new_files/map.png" ]
        MakeNamedMaterial "tiles mixture"
            "string type" [ "mix" ]
            "string materials" [ "tiles" "tiles metal" ]
            "texture amount" [ "tiles metallicRoughness part" ]
        Texture "tiles alpha" "float" "imagemap"
            "string filename" [ "new_files/map-5.png" ]
            "string encoding" [ "linear" ]
            "float uscale" [ 2 ]
            "float vscale" [ 3 ]
            "float vdelta" [ -2 ]
        AttributeBegin
            NamedMaterial "tiles mixture"
            Shape "plymesh"
                "string filename" [ "new_files/mesh.ply" ]
                "texture alpha" [ "tiles alpha" ]
        AttributeEnd
    "#]],
    );
    assert_eq!(exported.warnings.to_text(false), "");
    let pictures: Vec<&String> = written.keys().filter(|name| name.ends_with("png")).collect();
    assert_eq!(pictures.len(), 5);
    let copy = pictures.iter().find(|name| written[name.as_str()] == image());
    let copy = copy.expect("the base colour as it is");
    let parts: Vec<_> =
        pictures.iter().filter(|name| *name != copy).map(|name| codes(&written, name)).collect();
    // The square of half of green; blue; opacity by the cutoff.
    let squared = TEXELS.map(|texel| {
        let part = f64::from(texel[1]) / 510.0;
        (255.0 * part * part).round() as u8
    });
    for expected in [squared, [64, 255], [255, 0]] {
        assert!(parts.contains(&(1, expected.to_vec())), "{expected:?} in {parts:?}");
    }
    let normals = &parts.iter().find(|it| it.0 == 3).expect("the normal map").1;
    let [x, y, z] = [0, 1, 2].map(|part| f64::from(normals[part]) / 127.5 - 1.0);
    assert!(((x * x + y * y + z * z).sqrt() - 1.0).abs() < 0.02, "{normals:?}");
    // Coordinates count from below.
    let ply = &written["new_files/mesh.ply"];
    let coordinates = "property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n";
    let header = header(6, coordinates, 2);
    assert!(ply.starts_with(header.as_bytes()));
    let second: Vec<f32> = ply[header.len() + 32..][..32]
        .chunks(4)
        .map(|it| f32::from_le_bytes(it.try_into().expect("four")))
        .collect();
    assert_eq!(second, [1., 0., 0., 0., 0., 1., 1., 0.]);
}

#[test]
fn materials_are_the_nearest_of_pbrt() {
    let extension = |name: &str, members: &str| {
        format!(
            r#"{{"name": "it", "pbrMetallicRoughness": {{"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 0}},
            "extensions": {{"{name}": {members}}}}}"#
        )
    };
    check(
        &extension("KHR_materials_transmission", r#"{"transmissionFactor": 1}"#),
        expect![[r#"
            MakeNamedMaterial "it clear"
                "string type" [ "thindielectric" ]
                "float eta" [ 1.5 ]
            AttributeBegin
                NamedMaterial "it clear"
                Shape "plymesh"
                    "string filename" [ "new_files/mesh.ply" ]
            AttributeEnd
        "#]],
    );
    check(
        &extension("KHR_materials_specular", r#"{"specularFactor": 0}"#),
        expect![[r#"
        MakeNamedMaterial "it"
            "string type" [ "diffuse" ]
            "rgb reflectance" [ 1 1 1 ]
        AttributeBegin
            NamedMaterial "it"
            Shape "plymesh"
                "string filename" [ "new_files/mesh.ply" ]
        AttributeEnd
    "#]],
    );
    check(
        &extension("KHR_materials_diffuse_transmission", r#"{"diffuseTransmissionFactor": 0.25}"#),
        expect![[r#"
            MakeNamedMaterial "it"
                "string type" [ "diffusetransmission" ]
                "rgb reflectance" [ 0.75 0.75 0.75 ]
                "rgb transmittance" [ 0.25 0.25 0.25 ]
            AttributeBegin
                NamedMaterial "it"
                Shape "plymesh"
                    "string filename" [ "new_files/mesh.ply" ]
            AttributeEnd
        "#]],
    );
    check(
        &extension("KHR_materials_unlit", "{}"),
        expect![[r#"
        MakeNamedMaterial "it"
            "string type" [ "diffuse" ]
            "rgb reflectance" [ 0 0 0 ]
        AttributeBegin
            AreaLightSource "diffuse"
                "bool twosided" [ true ]
                "rgb L" [ 1 1 1 ]
            NamedMaterial "it"
            Shape "plymesh"
                "string filename" [ "new_files/mesh.ply" ]
        AttributeEnd
    "#]],
    );
    let volume = r#"{"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 1, 1]},
        "KHR_materials_transmission": {"transmissionFactor": 0.5}, "KHR_materials_ior": {"ior": 1.4}"#;
    check(
        &extension("KHR_materials_volume", volume),
        expect![[r#"
        MakeNamedMedium "it medium"
            "string type" [ "homogeneous" ]
            "rgb sigma_a" [ 0.34657359027997264 -0 -0 ]
            "rgb sigma_s" [ 0 0 0 ]
        MakeNamedMaterial "it clear"
            "string type" [ "dielectric" ]
            "float eta" [ 1.4 ]
            "float roughness" [ 0 ]
            "bool remaproughness" [ false ]
        MakeNamedMaterial "it"
            "string type" [ "coateddiffuse" ]
            "float roughness" [ 0 ]
            "float eta" [ 1.4 ]
            "bool remaproughness" [ false ]
            "rgb reflectance" [ 1 1 1 ]
        MakeNamedMaterial "it mixture"
            "string type" [ "mix" ]
            "string materials" [ "it" "it clear" ]
            "float amount" [ 0.5 ]
        AttributeBegin
            NamedMaterial "it mixture"
            MediumInterface "it medium" ""
            Shape "plymesh"
                "string filename" [ "new_files/mesh.ply" ]
        AttributeEnd
    "#]],
    );
    check(
        &extension(
            "KHR_materials_clearcoat",
            r#"{"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.5}"#,
        ),
        expect![[r#"
            MakeNamedMaterial "it"
                "string type" [ "coateddiffuse" ]
                "float roughness" [ 0.25 ]
                "float eta" [ 1.5 ]
                "bool remaproughness" [ false ]
                "rgb reflectance" [ 1 1 1 ]
            AttributeBegin
                NamedMaterial "it"
                Shape "plymesh"
                    "string filename" [ "new_files/mesh.ply" ]
            AttributeEnd
        "#]],
    );
    check(
        r#"{"name": "brass", "doubleSided": true, "alphaMode": "BLEND", "emissiveFactor": [1, 0.5, 0],
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 0.5], "metallicFactor": 0.5, "roughnessFactor": 0.5},
            "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1},
                "KHR_materials_anisotropy": {"anisotropyStrength": 0.5}}}"#,
        expect![[r#"
            MakeNamedMaterial "brass metal"
                "string type" [ "coatedconductor" ]
                "float interface.roughness" [ 0 ]
                "float interface.eta" [ 1.5 ]
                "float conductor.uroughness" [ 0.4375 ]
                "float conductor.vroughness" [ 0.25 ]
                "bool remaproughness" [ false ]
                "rgb reflectance" [ 1 0.5 0.25 ]
            MakeNamedMaterial "brass"
                "string type" [ "coateddiffuse" ]
                "float roughness" [ 0 ]
                "float eta" [ 1.5 ]
                "bool remaproughness" [ false ]
                "rgb reflectance" [ 1 0.5 0.25 ]
            MakeNamedMaterial "brass mixture"
                "string type" [ "mix" ]
                "string materials" [ "brass" "brass metal" ]
                "float amount" [ 0.5 ]
            AttributeBegin
                AreaLightSource "diffuse"
                    "bool twosided" [ true ]
                    "rgb L" [ 1 0.5 0 ]
                NamedMaterial "brass mixture"
                Shape "plymesh"
                    "string filename" [ "new_files/mesh.ply" ]
                    "float alpha" [ 0.5 ]
            AttributeEnd
        "#]],
    );
}

#[test]
fn what_is_lost_is_said_once() {
    let material = r#"{"name": "cloth", "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": 0, "extensions":
            {"KHR_texture_transform": {"rotation": 1}}}},
        "extensions": {"KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]},
            "KHR_materials_iridescence": {"iridescenceFactor": 1},
            "KHR_materials_specular": {"specularColorFactor": [1, 0, 0]}}}"#;
    let (exported, _) = export(&files(material, ""));
    expect![[r#"
        warning[W0601]: a material has too many layers and textures: it is without those of `iridescence`
          ┌─ model.gltf#contents:4:1
          │
        4 │ materials[0] "cloth"
          │ ^^^^^^^^^^^^^^^^^^^^

        warning[W0601]: pbrt-v4 has nothing like sheen: left out
         = note: in `cloth`

        warning[W0601]: pbrt-v4 has nothing like the colour of specular reflection: left out
         = note: in `cloth`

        warning[W0601]: pbrt-v4 has nothing like the rotation of textures: left out
         = note: in `cloth baseColor`

    "#]].assert_eq(&exported.warnings.to_text(false));
}

#[test]
fn errors_end_a_conversion() {
    let options = ExportOptions { camera: Some("away"), input_memory: None, folder: "new_files" };
    let files = files(r#"{"name": "it"}"#, "");
    let mut count = 0;
    let mut write = |_: &str, _: &[u8]| {
        count += 1;
        Err(io::Error::other("the disk is full"))
    };
    let path = Path::new("model.gltf");
    let Err(ExportError::Input(messages)) = export_gltf(path, &files, &options, &mut write) else {
        panic!("the camera does not exist")
    };
    assert!(messages.to_text(false).contains("unknown camera `away`"));
    let options = ExportOptions { camera: None, ..options };
    let Err(ExportError::Output(error)) = export_gltf(path, &files, &options, &mut write) else {
        panic!("nothing can be written")
    };
    assert_eq!((error.to_string().as_str(), count), ("the disk is full", 1));
}
