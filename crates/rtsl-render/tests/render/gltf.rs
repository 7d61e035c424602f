//! Pictures of glTF files: the orientation of images, transforms of coordinates, colours of vertices, holes, and units.

use std::path::PathBuf;

use rtsl_render::request::render_scene_from;
use rtsl_render::{LoadOptions, RenderRequest};
use rtsl_scene::BATCH;
use rtsl_scene::reader::MemoryFiles;

type Files = MemoryFiles<Vec<u8>>;

/// Linear colours of the texels of an image: red, green; blue, white. White is half opaque.
const TEXELS: [[f32; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];

fn image() -> Vec<u8> {
    image_with_opacity([255, 255, 255, 127])
}

fn image_with_opacity(alpha: [u8; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("the header is valid");
    let texels = TEXELS.map(|texel| texel.map(|part| (255.0 * part) as u8));
    let data: Vec<u8> = texels
        .iter()
        .zip(alpha)
        .flat_map(|(texel, alpha)| [&texel[..], &[alpha]].concat())
        .collect();
    writer.write_image_data(&data).expect("so are the texels");
    drop(writer);
    bytes
}

/// A file with a square from -1 to 1 that an orthographic camera sees whole, of a material and with more members.
fn files(material: &str, attributes: &str, more: &str) -> Files {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]];
    let mut bytes: Vec<u8> = Vec::new();
    corners
        .iter()
        .for_each(|[x, y]| [*x, *y, 0.0].iter().for_each(|it| bytes.extend(it.to_le_bytes())));
    // Rows of images count from the top.
    for [x, y] in corners {
        [0.5 + 0.5 * x, 0.5 - 0.5 * y].iter().for_each(|it| bytes.extend(it.to_le_bytes()));
    }
    // Colours: black on the left, yellow on the right.
    for [x, _] in corners {
        let part = if x > 0.0 { 1.0_f32 } else { 0.0 };
        [part, part, 0.0].iter().for_each(|it| bytes.extend(it.to_le_bytes()));
    }
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|it| it.to_le_bytes()));
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}},
        "nodes": [{{"mesh": 0}}, {{"camera": 0, "translation": [0, 0, 4]}}, {{"extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}}],
        "cameras": [{{"type": "orthographic", "orthographic": {{"xmag": 1, "ymag": 1, "znear": 0, "zfar": 9}}}}],
        "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type": "directional", "intensity": 2}}]}}}},
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, {attributes}}}, "indices": 3, "material": 0}}]}}],
        "materials": [{material}], "images": [{{"uri": "image.png"}}],
        "textures": [{{"source": 0, "sampler": 0}}], "samplers": [{{"magFilter": 9728}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 32}},
            {{"buffer": 0, "byteOffset": 80, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 128, "byteLength": 12}}],
        "buffers": [{{"byteLength": 140, "uri": "square.bin"}}]{more}}}"#
    );
    let named = [("square.gltf", text.into_bytes()), ("square.bin", bytes), ("image.png", image())];
    MemoryFiles(named.into_iter().map(|(name, bytes)| (PathBuf::from(name), bytes)).collect())
}

/// The pixels of a picture of this width and height.
fn pixels(files: &Files, size: (usize, usize), samples: u32) -> Vec<[f32; 3]> {
    let request = RenderRequest {
        scene: "square.gltf".into(),
        load: LoadOptions::with_integrator(BATCH),
        size: Some(size),
        samples: Some(samples),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, files);
    let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    assert_eq!(result.warnings.to_text(false), "");
    result.image.pixels
}

fn check(pixels: &[[f32; 3]], expected: &[[f32; 3]], tolerance: f32) {
    assert_eq!(pixels.len(), expected.len());
    for (pixel, expected) in pixels.iter().zip(expected) {
        let is_near = (0..3).all(|part| (pixel[part] - expected[part]).abs() <= tolerance);
        assert!(is_near, "{pixels:?}");
    }
}

fn unlit(base: &str) -> String {
    format!(
        r#"{{"pbrMetallicRoughness": {{{base}}}, "extensions": {{"KHR_materials_unlit": {{}}}}}}"#
    )
}

const COORDINATES: &str = r#""TEXCOORD_0": 1"#;

#[test]
fn the_first_row_of_an_image_is_on_top() {
    let files = files(&unlit(r#""baseColorTexture": {"index": 0}"#), COORDINATES, "");
    check(&pixels(&files, (2, 2), 1), &TEXELS, 1e-4);
}

/// The transform of the extension turns coordinates so that u' = v and v' = 1 - u here.
#[test]
fn coordinates_are_turned_as_the_extension_says() {
    let transform = r#""baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform":
        {"rotation": 1.5707963267948966, "offset": [0, 1]}}}"#;
    let files = files(&unlit(transform), COORDINATES, "");
    let [red, green, blue, white] = TEXELS;
    check(&pixels(&files, (2, 2), 1), &[blue, red, white, green], 1e-4);
}

#[test]
fn colors_of_vertices_are_interpolated() {
    let files = files(&unlit(r#""baseColorFactor": [0.5, 1, 1, 1]"#), r#""COLOR_0": 2"#, "");
    let row = pixels(&files, (4, 1), 64);
    // The picture is wider than the square: half of each of two columns sees it.
    check(&row[1..3], &[[0.0625, 0.125, 0.0], [0.1875, 0.375, 0.0]], 0.01);
}

#[test]
fn masks_make_holes_and_blends_are_half_there() {
    let material = |mode: &str| {
        unlit(r#""baseColorTexture": {"index": 0}"#).replacen(
            '{',
            &format!(r#"{{"alphaMode": "{mode}", "#),
            1,
        )
    };
    let [red, green, blue, white] = TEXELS;
    let masked = files(&material("MASK"), COORDINATES, "");
    check(&pixels(&masked, (2, 2), 1), &[red, green, blue, [0.0; 3]], 1e-4);
    let opaque = files(&material("OPAQUE"), COORDINATES, "");
    check(&pixels(&opaque, (2, 2), 1), &[red, green, blue, white], 1e-4);
    let blended = files(&material("BLEND"), COORDINATES, "");
    check(&pixels(&blended, (2, 2), 1024), &[red, green, blue, [0.498; 3]], 0.06);
}

/// A matte white surface under 2 lux reflects 2 / pi.
#[test]
fn a_lux_gives_a_radiance_of_one_by_pi() {
    let matte = r#"{"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [1, 1, 0.5, 1]},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}"#;
    let radiance = 2.0 / std::f32::consts::PI;
    let pixels = pixels(&files(matte, COORDINATES, ""), (1, 1), 4);
    check(&pixels, &[[radiance, radiance, 0.5 * radiance]], 2e-3);
}

/// An image whose opacity is 1 everywhere has it all the same.
#[test]
fn opaque_images_with_opacity_are_opaque() {
    let material =
        unlit(r#""baseColorTexture": {"index": 0}"#).replacen('{', r#"{"alphaMode": "BLEND", "#, 1);
    let files = files(&material, COORDINATES, "").with("image.png", image_with_opacity([255; 4]));
    check(&pixels(&files, (2, 2), 4), &TEXELS, 1e-4);
}
