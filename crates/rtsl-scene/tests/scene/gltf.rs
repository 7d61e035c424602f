//! glTF files as scenes: what becomes of nodes, meshes, materials, lights and cameras.

use std::path::{Path, PathBuf};

use base64::Engine;
use expect_test::{Expect, expect};
use rtsl_math::Transform;
use rtsl_scene::reader::{MemoryFiles, Values};
use rtsl_scene::{
    Description, Entity, EntityId, EntityKind, InstanceUse, LoadOptions, Loaded, SceneSource,
    load_scene,
};

pub type Files = MemoryFiles<Vec<u8>>;

/// The buffer of all tests: positions, normals and coordinates of a square, its indices, and more numbers.
fn buffer() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut floats = |numbers: &[f32]| bytes.extend(numbers.iter().flat_map(|it| it.to_le_bytes()));
    // 0: positions.
    floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    // 48: normals.
    floats(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    // 96: coordinates.
    floats(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    // 128: colours.
    floats(&[1., 0., 0., 1., 0., 1., 0., 0.5, 0., 0., 1., 1., 1., 1., 1., 1.]);
    // 192: weights of joints, and their indices at 256.
    floats(&[1., 0., 0., 0., 1., 0., 0., 0., 0.5, 0.5, 0., 0., 0., 1., 0., 0.]);
    bytes.extend([0_u8, 1, 0, 0].repeat(4));
    // 272: indices of two triangles.
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|it| it.to_le_bytes()));
    // 284: translations of three instances.
    let moves = [0_f32, 0., 0., 3., 0., 0., 0., 4., 0.];
    bytes.extend(moves.iter().flat_map(|it| it.to_le_bytes()));
    // 320: quantized positions.
    bytes.extend([0_u8, 0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 0, 0, 255, 0, 0]);
    bytes
}

/// A file with the accessors of the buffer and other members.
fn file(members: &str) -> String {
    let view = |offset: usize, length: usize| {
        format!(r#"{{"buffer": 0, "byteOffset": {offset}, "byteLength": {length}}}"#)
    };
    let accessor = |view: usize, component: u32, count: usize, ty: &str| {
        format!(
            r#"{{"bufferView": {view}, "componentType": {component}, "count": {count}, "type": "{ty}"}}"#
        )
    };
    let views = [
        view(0, 48),
        view(48, 48),
        view(96, 32),
        view(128, 64),
        view(192, 64),
        view(256, 16),
        view(272, 12),
        view(284, 36),
        r#"{"buffer": 0, "byteOffset": 320, "byteLength": 16, "byteStride": 4}"#.to_owned(),
    ];
    let quantized =
        accessor(8, 5121, 4, "VEC3").replace(r#""count""#, r#""normalized": true, "count""#);
    let accessors = [
        accessor(0, 5126, 4, "VEC3"),
        accessor(1, 5126, 4, "VEC3"),
        accessor(2, 5126, 4, "VEC2"),
        accessor(3, 5126, 4, "VEC4"),
        accessor(4, 5126, 4, "VEC4"),
        accessor(5, 5121, 4, "VEC4"),
        accessor(6, 5123, 6, "SCALAR"),
        accessor(7, 5126, 3, "VEC3"),
        quantized,
    ];
    let data = base64::engine::general_purpose::STANDARD.encode(buffer());
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "bufferViews": [{}], "accessors": [{}],
        "buffers": [{{"byteLength": 336, "uri": "data:application/octet-stream;base64,{data}"}}], {members}}}"#,
        views.join(","),
        accessors.join(",")
    )
}

const SQUARE: &str =
    r#"{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 6}"#;

fn files(members: &str) -> Files {
    MemoryFiles([(PathBuf::from("model.gltf"), file(members).into_bytes())].into())
}

pub fn options(camera: Option<&str>) -> LoadOptions {
    LoadOptions { camera: camera.map(str::to_owned), ..LoadOptions::default() }
}

/// Reads and loads a file without errors; also returns the warnings.
pub fn loaded(files: &Files) -> (Description, Loaded, String) {
    let mut source = SceneSource::read(Path::new("model.gltf"), files, &options(None));
    let description = source.description().clone();
    let loaded = source.load().unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let warnings = loaded.warnings.to_text(false);
    (description, loaded, warnings)
}

/// Reads a file, without its classes.
fn description(members: &str) -> Description {
    let files = files(members);
    let source = SceneSource::read(Path::new("model.gltf"), &files, &options(None));
    source.description().clone()
}

fn check_warnings(members: &str, expected: Expect) {
    expected.assert_eq(&loaded(&files(members)).2);
}

fn check_errors(files: &Files, camera: Option<&str>, expected: Expect) {
    let mut source = SceneSource::read(Path::new("model.gltf"), files, &options(camera));
    let messages = source.load().expect_err("the file is wrong");
    expected.assert_eq(&messages.to_text(false));
}

fn entity(description: &Description, EntityId(index): EntityId) -> &Entity {
    &description.entities[index]
}

/// The entities of a kind, each as its class and parameters in one line.
fn listed(description: &Description, kind: EntityKind) -> String {
    let entities = description.entities.iter().filter(|it| it.kind == kind);
    let line = |entity: &Entity| {
        let mut line = entity.class.clone();
        for parameter in &entity.parameters {
            let values = match &parameter.values {
                Values::Numbers(numbers) => {
                    let rounded = numbers.iter().map(|it| (it * 1e4).round() / 1e4 + 0.0);
                    format!("{:?}", rounded.collect::<Vec<_>>())
                }
                Values::Booleans(values) => format!("{values:?}"),
                Values::Texts(texts) => texts.join(" "),
                Values::Buffer(numbers) => format!("<{}>", numbers.words().len()),
            };
            line += &format!(" {}={values}", parameter.name);
        }
        match &entity.name {
            Some(name) => format!("{name}: {line}\n"),
            None => line + "\n",
        }
    };
    entities.map(line).collect()
}

/// The floats of a shape's buffer.
pub fn buffer_of(description: &Description, shape: EntityId, name: &str) -> Vec<f32> {
    match entity(description, shape).parameter(name).map(|it| &it.values) {
        Some(Values::Buffer(numbers)) => {
            numbers.words().iter().map(|bits| f32::from_bits(*bits)).collect()
        }
        other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn nodes_place_their_meshes() {
    let members = format!(
        r#""scene": 1, "scenes": [{{"nodes": [0]}}, {{"nodes": [1]}}],
        "nodes": [{{"mesh": 0}}, {{"children": [2, 3, 4], "translation": [10, 0, 0]}},
            {{"mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, 0.70710678, 0.70710678]}},
            {{"mesh": 1, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]}},
            {{"mesh": 1, "extensions": {{"KHR_node_visibility": {{"visible": false}}}}}}],
        "meshes": [{{"primitives": [{SQUARE}]}},
            {{"primitives": [{{"attributes": {{"POSITION": 8}}, "mode": 5}}]}}]"#
    );
    let description = description(&members);
    let [turned, moved] = description.shapes[..] else {
        panic!("{} shapes", description.shapes.len())
    };
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|axis| (a[axis] - b[axis]).abs() < 1e-6);
    let transform = |shape| entity(&description, shape).transform;
    assert!(near(transform(turned.shape).point([1.0, 0.0, 0.0]), [10.0, 2.0, 0.0]));
    assert!(near(transform(moved.shape).point([1.0, 0.0, 0.0]), [11.0, 0.0, 5.0]));
    // Bytes are fractions of 255; a strip has two triangles.
    let positions = buffer_of(&description, moved.shape, "positions");
    assert_eq!(positions, [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    let list = listed(&description, EntityKind::Shape);
    assert_eq!(
        list,
        "TriangleMesh positions=<12> normals=<12> uvs=<0> indices=<6>\n\
         TriangleMesh positions=<12> normals=<0> uvs=<0> indices=<6>\n"
    );
}

#[test]
fn meshes_of_several_nodes_are_objects() {
    let members = format!(
        r#""nodes": [{{"mesh": 0}}, {{"mesh": 0, "translation": [0, 0, 1]}},
            {{"mesh": 0, "translation": [0, 0, 2],
                "extensions": {{"EXT_mesh_gpu_instancing": {{"attributes": {{"TRANSLATION": 7}}}}}}}}],
        "meshes": [{{"name": "tile", "primitives": [{SQUARE}]}}]"#
    );
    let description = description(&members);
    assert_eq!((description.shapes.len(), description.objects.len()), (0, 1));
    assert_eq!(description.objects[0].name, "tile");
    let place = |it: &InstanceUse| Transform::from(it.transform).point([0.0; 3]);
    let places: Vec<_> = description.instances.iter().map(place).collect();
    assert_eq!(places, [[0., 0., 0.], [0., 0., 1.], [0., 0., 2.], [3., 0., 2.], [0., 4., 2.]]);
}

#[test]
fn morph_targets_and_skins_are_at_rest() {
    // The first joint stays, the second moves by 5 along z; the target adds the normals to the positions.
    let members = r#""nodes": [{"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"name": "root", "children": [2]},
            {"translation": [0, 0, 5]}, {"mesh": 1, "weights": [0.25]}],
        "skins": [{"joints": [1, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "JOINTS_0": 5, "WEIGHTS_0": 4},
                "indices": 6}]},
            {"weights": [1], "primitives": [{"attributes": {"POSITION": 0}, "indices": 6,
                "targets": [{"POSITION": 1}]}]}]"#;
    let description = description(members);
    let [skinned, morphed] = description.shapes[..] else { panic!("two shapes") };
    // The transform of a skinned node does not count.
    assert_eq!(entity(&description, skinned.shape).transform, Transform::IDENTITY);
    let positions = buffer_of(&description, skinned.shape, "positions");
    assert_eq!(positions, [0., 0., 0., 1., 0., 0., 1., 1., 2.5, 0., 1., 5.]);
    let positions = buffer_of(&description, morphed.shape, "positions");
    assert_eq!(positions, [0., 0., 0.25, 1., 0., 0.25, 1., 1., 0.25, 0., 1., 0.25]);
}

/// A file with one square of a material.
fn with_material(primitive: &str, material: &str, more: &str) -> String {
    format!(
        r#""nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{primitive}]}}], "materials": [{material}]{more}"#
    )
}

fn square_of_material() -> String {
    SQUARE.replace(r#""indices": 6"#, r#""indices": 6, "material": 0"#)
}

#[test]
fn a_plain_material_is_one_class() {
    let material = r#"{"name": "clay", "pbrMetallicRoughness":
        {"baseColorFactor": [0.5, 0.25, 0.125, 1], "metallicFactor": 0, "roughnessFactor": 0.75}}"#;
    let description = description(&with_material(&square_of_material(), material, ""));
    expect![[r#"
        clay: GltfPbr baseColor=[0.5, 0.25, 0.125] metallic=[0.0] roughness=[0.75]
    "#]]
    .assert_eq(&listed(&description, EntityKind::Material));
    assert_eq!(listed(&description, EntityKind::Texture), "");
}

/// A PNG of one texel, with opacity.
pub fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("the header is valid");
    writer.write_image_data(&[255, 128, 0, 64]).expect("so is the texel");
    drop(writer);
    bytes
}

fn with_image(members: &str) -> Files {
    let mut files = files(members);
    files.0.insert("map one.png".into(), png());
    files
}

const TEXTURES: &str = r#", "images": [{"uri": "map%20one.png"}], "textures": [{"source": 0}, {"source": 0, "sampler": 0}],
    "samplers": [{"wrapS": 33071, "wrapT": 10497, "magFilter": 9728}]"#;

#[test]
fn textures_have_channels_transforms_and_samplers() {
    let material = r#"{"name": "tiles", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "normalTexture": {"index": 0, "scale": 2, "texCoord": 0},
        "emissiveFactor": [0.5, 0.5, 0.5], "emissiveTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": {"index": 1,
            "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 4], "rotation": 1.5707963267948966}}},
            "metallicRoughnessTexture": {"index": 0, "texCoord": 1}}}"#;
    let primitive =
        square_of_material().replace(r#""TEXCOORD_0": 2"#, r#""TEXCOORD_0": 2, "TEXCOORD_1": 2"#);
    let (description, _, warnings) =
        loaded(&with_image(&with_material(&primitive, material, TEXTURES)));
    assert_eq!(warnings, "");
    expect![[r#"
        image 0: imagemap filename=map one.png encoding=linear convention=gltf wrap=clamp filter=point
        tiles alpha: GltfOpacity image=image 0 toS=[0.0, -4.0, 4.5] toT=[2.0, 0.0, 1.0] wrap=[1.0, 3.0] hasOpacity=[true] factor=[1.0, 1.0, 1.0, 0.5] cutoff=[0.25]
        image 0 2: imagemap filename=map one.png encoding=sRGB convention=gltf wrap=repeat filter=bilinear
        tiles emission: GltfTexture image=image 0 2 factor=[0.5, 0.5, 0.5, 1.0]
        image 0 3: imagemap filename=map one.png encoding=sRGB convention=gltf wrap=clamp filter=point
        tiles baseColor: GltfTexture image=image 0 3 toS=[0.0, -4.0, 4.5] toT=[2.0, 0.0, 1.0] wrap=[1.0, 3.0] factor=[1.0, 1.0, 1.0, 0.5]
        image 0 4: imagemap filename=map one.png encoding=linear convention=gltf wrap=repeat filter=bilinear
        tiles metallicRoughness: GltfTexture image=image 0 4 set=[1.0]
        tiles normals: GltfTexture image=image 0 4
    "#]]
    .assert_eq(&listed(&description, EntityKind::Texture));
    expect![[r#"
        tiles: GltfPbr baseColor=tiles baseColor metallic=[1.0] roughness=[1.0] metallicRoughness=tiles metallicRoughness
        tiles normals: NormalMap base=tiles normals=tiles normals scale=[2.0] alongV=[true]
    "#]]
    .assert_eq(&listed(&description, EntityKind::Material));
    expect![[r#"
        tiles light: Emissive twoSided=[true] image=tiles emission
    "#]]
    .assert_eq(&listed(&description, EntityKind::AreaLight));
    // Tangents need vertices for each corner.
    expect![[r#"
        GltfMesh positions=<18> normals=<18> uvs=<12> indices=<6> tangents=<24> uvs1=<12> colors=<0> alpha=tiles alpha
    "#]]
    .assert_eq(&listed(&description, EntityKind::Shape));
    let tangents = buffer_of(&description, description.shapes[0].shape, "tangents");
    assert_eq!(tangents, [1.0, 0.0, 0.0, 1.0].repeat(6));
}

#[test]
fn extensions_become_layers_and_parameters() {
    let material = r#"{"name": "all", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]},
        "extensions": {
            "KHR_materials_ior": {"ior": 1.25}, "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0]},
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 1, 1]},
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 1},
            "KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceIor": 1.75, "iridescenceThicknessMaximum": 500},
            "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.25},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25}}}"#;
    let (description, _, warnings) =
        loaded(&files(&with_material(&square_of_material(), material, "")));
    assert_eq!(warnings, "");
    expect![[r#"
        all: GltfPbr baseColor=[1.0, 1.0, 1.0] metallic=[1.0] roughness=[1.0] specular=[0.5] specularColor=[1.0, 0.5, 0.0] transmission=[0.75] diffuseTransmission=[0.25] diffuseTransmissionColor=[1.0, 1.0, 1.0] iridescence=[1.0] iridescenceThickness=[500.0] ior=[1.25] attenuationColor=[0.5, 1.0, 1.0] attenuationDistance=[2.0] anisotropy=[0.5] anisotropyRotation=[1.0] iridescenceIor=[1.75] thin=[false]
        all coat: GltfCoat base=all scale=[1.0] coat=[0.5] roughness=[0.25]
    "#]]
    .assert_eq(&listed(&description, EntityKind::Material));
    let [square] = description.shapes[..] else { panic!("one shape") };
    assert_eq!(entity(&description, square.shape).number("alpha"), Some(0.5));
    let material = square.material.map(|it| entity(&description, it));
    assert_eq!(material.and_then(|it| it.name.as_deref()), Some("all coat"));
}

#[test]
fn textures_beyond_the_limit_of_kernels_are_left_out() {
    let map = r#"{"index": 0}"#;
    let material = format!(
        r#"{{"pbrMetallicRoughness": {{"baseColorTexture": {map}, "metallicRoughnessTexture": {map}}},
        "normalTexture": {map}, "extensions": {{
            "KHR_materials_specular": {{"specularTexture": {map}, "specularColorTexture": {map}}},
            "KHR_materials_transmission": {{"transmissionFactor": 1, "transmissionTexture": {map}}},
            "KHR_materials_clearcoat": {{"clearcoatFactor": 1, "clearcoatTexture": {map},
                "clearcoatRoughnessTexture": {map}, "clearcoatNormalTexture": {map}}}}}}}"#
    );
    let files = with_image(&with_material(&square_of_material(), &material, TEXTURES));
    expect![[r#"
        warning[W0601]: a material has too many layers and textures: it is without those of `specular`, `specularColor`, `normals`, `roughness`, `coat`
          ┌─ model.gltf#contents:4:1
          │
        4 │ materials[0]
          │ ^^^^^^^^^^^^

    "#]]
    .assert_eq(&loaded(&files).2);
}

#[test]
fn glossy_and_unlit_materials_have_their_look() {
    let glossy = r#"{"name": "glossy", "extensions": {"KHR_materials_pbrSpecularGlossiness":
        {"diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": [0.25, 0.25, 0.25], "glossinessFactor": 0.75}}},
        {"name": "flat", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0, 0, 1]}, "extensions": {"KHR_materials_unlit": {}}},
        {"name": "velvet", "extensions": {"KHR_materials_sheen": {"sheenColorFactor": [0, 0, 1], "sheenRoughnessFactor": 0.5}}}"#;
    let velvet = square_of_material().replace(r#""material": 0"#, r#""material": 2"#);
    let flat = square_of_material().replace(r#""material": 0"#, r#""material": 1"#);
    let description = description(&with_material(
        &format!("{}, {flat}, {velvet}", square_of_material()),
        glossy,
        "",
    ));
    expect![[r#"
        glossy: GltfPbr baseColor=[0.5, 0.5, 0.5] metallic=[0.0] specularColor=[0.25, 0.25, 0.25] roughness=[0.25] ior=[0.0]
        flat: Emissive twoSided=[true] radiance=[0.5, 0.0, 0.0]
        velvet: GltfPbr baseColor=[1.0, 1.0, 1.0] metallic=[1.0] roughness=[1.0]
        velvet sheen: GltfSheen base=velvet sheen=[0.0, 0.0, 1.0] roughness=[0.5]
    "#]]
    .assert_eq(&listed(&description, EntityKind::Material));
}

#[test]
fn colors_of_vertices_scale_the_base_color() {
    let primitive = square_of_material().replace(r#""TEXCOORD_0": 2"#, r#""COLOR_0": 3"#);
    let material =
        r#"{"name": "painted", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1]}}"#;
    let description = description(&with_material(&primitive, material, ""));
    expect![[r#"
        painted baseColor: GltfTexture factor=[0.5, 1.0, 1.0, 1.0] colors=[1.0]
    "#]]
    .assert_eq(&listed(&description, EntityKind::Texture));
    let colors = buffer_of(&description, description.shapes[0].shape, "colors");
    assert_eq!(colors[4..8], [0.0, 1.0, 0.0, 0.5]);
}

#[test]
fn images_in_the_file_are_files_in_memory() {
    let data = base64::engine::general_purpose::STANDARD.encode(png());
    let more = format!(
        r#", "images": [{{"uri": "data:image/png;base64,{data}"}}], "textures": [{{"source": 0}}]"#
    );
    let material = r#"{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}"#;
    let (description, _, warnings) =
        loaded(&files(&with_material(&square_of_material(), material, &more)));
    assert_eq!(warnings, "");
    assert!(description.embedded.contains_key(Path::new("model.gltf#images[0]")));
}

#[test]
fn lights_are_where_their_nodes_are() {
    let members = format!(
        r#""extensions": {{"KHR_lights_punctual": {{"lights": [
            {{"type": "directional", "intensity": 3, "name": "sun"}}, {{"type": "point", "color": [1, 0.5, 0], "intensity": 20}},
            {{"type": "spot", "spot": {{"innerConeAngle": 0.5, "outerConeAngle": 0.75}}}}]}}}},
        "nodes": [{{"mesh": 0}}, {{"rotation": [-0.70710678, 0, 0, 0.70710678], "scale": [3, 3, 3],
                "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}},
            {{"name": "lamp", "translation": [1, 2, 3], "extensions": {{"KHR_lights_punctual": {{"light": 1}}}}}},
            {{"translation": [1, 2, 3], "extensions": {{"KHR_lights_punctual": {{"light": 2}}}}}}],
        "meshes": [{{"primitives": [{SQUARE}]}}]"#
    );
    expect![[r#"
        sun: DirectionalLight strength=[3.0] direction=[0.0, -1.0, 0.0] irradiance=[1.0, 1.0, 1.0]
        lamp: PointLight strength=[20.0] position=[1.0, 2.0, 3.0] intensity=[1.0, 0.5, 0.0]
        light 2: SpotLight strength=[1.0] position=[1.0, 2.0, 3.0] target=[1.0, 2.0, 2.0] coneAngle=[42.9718] softness=[14.3239] intensity=[1.0, 1.0, 1.0]
    "#]]
    .assert_eq(&listed(&description(&members), EntityKind::Light));
}

#[test]
fn a_scene_without_lights_stands_in_a_studio() {
    let members = format!(r#""nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{SQUARE}]}}]"#);
    let description = description(&members);
    expect![[r#"
        studio: infinite filename=model.gltf#studio
    "#]]
    .assert_eq(&listed(&description, EntityKind::Light));
    let camera = entity(&description, description.camera.expect("there is one"));
    // All of it is in front of the camera and within its angle.
    let half = 0.5 * camera.number("fov").expect("given");
    let (sine, cosine) = rtsl_math::sine_and_cosine_of_degrees(half);
    let tangent = sine / cosine;
    for corner in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]] {
        let [x, y, z] = camera.transform.point(corner);
        assert!(z > 0.0 && x.abs() < tangent * z && y.abs() < tangent * z);
    }
}

const CAMERAS: &str = r#""cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}},
    {"type": "orthographic", "name": "plan", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 10}}]"#;

#[test]
fn cameras_are_chosen_by_name_or_index() {
    let members = format!(
        r#""nodes": [{{"mesh": 0}}, {{"camera": 0, "translation": [0, 0, 5]}}, {{"camera": 1}}],
        "meshes": [{{"primitives": [{SQUARE}]}}], {CAMERAS}"#
    );
    let files = files(&members);
    let with = |camera: Option<&str>| {
        let source = SceneSource::read(Path::new("model.gltf"), &files, &options(camera));
        let description = source.description();
        listed(description, EntityKind::Camera) + &listed(description, EntityKind::Film)
    };
    let first = "camera: Pinhole fov=[28.6479]\nrgb xresolution=[1440.0] yresolution=[720.0]\n";
    let second = "camera: Orthographic scale=[2.0]\nrgb xresolution=[1080.0] yresolution=[720.0]\n";
    assert_eq!((with(None).as_str(), with(Some("0")).as_str()), (first, first));
    assert_eq!((with(Some("1")).as_str(), with(Some("plan")).as_str()), (second, second));
    check_errors(
        &files,
        Some("plane"),
        expect![[r#"
        error[E0610]: unknown camera `plane`
         = help: did you mean `plan`?

    "#]],
    );
}

#[test]
fn what_cannot_be_shown_is_said_once() {
    let compressed = r#"{"attributes": {"POSITION": 9}, "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0}}}"#;
    let members = format!(
        r#""extensionsRequired": ["KHR_draco_mesh_compression", "KHR_mesh_quantization", "KHR_texture_transform"],
        "nodes": [{{"mesh": 0, "children": [1]}}, {{"mesh": 0, "children": [0]}}, {{"mesh": 7}}, {{"mesh": 1}}],
        "scenes": [{{"nodes": [0, 2, 3]}}],
        "meshes": [{{"primitives": [{SQUARE}]}}, {{"name": "ball", "primitives": [{compressed},
            {{"attributes": {{"POSITION": 0}}, "mode": 0}}, {{"attributes": {{"POSITION": 0, "NORMAL": 7}}}}]}}]"#
    );
    let members = format!(r#"{members}, "materials": []"#);
    let mut text = file(&members);
    text = text.replacen(r#""accessors": ["#, r#""accessors": [ "#, 1);
    let quantized = r#""normalized": true"#;
    let place = text.find(quantized).expect("it is there");
    let end = place + text[place..].find('}').expect("it ends") + 1;
    text.insert_str(end, r#",{"componentType": 5126, "count": 4, "type": "VEC3"}"#);
    let files = MemoryFiles([(PathBuf::from("model.gltf"), text.into_bytes())].into());
    let (_, _, warnings) = loaded(&files);
    expect![[r#"
        warning[W0601]: node 0 has two parents or contains itself: only one counts
          ┌─ model.gltf#contents:2:1
          │
        2 │ nodes[0]
          │ ^^^^^^^^

        warning[W0601]: mesh 7 does not exist: its node is empty
          ┌─ model.gltf#contents:4:1
          │
        4 │ nodes[2]
          │ ^^^^^^^^

        warning[W0601]: primitive 0 of a mesh is left out: `KHR_draco_mesh_compression`: it names no compressed buffer view
          ┌─ model.gltf#contents:7:1
          │
        7 │ meshes[1] "ball"
          │ ^^^^^^^^^^^^^^^^

        warning[W0601]: primitive 2 of a mesh is left out: it has 4 vertices, but 3 of another attribute
          ┌─ model.gltf#contents:7:1
          │
        7 │ meshes[1] "ball"
          │ ^^^^^^^^^^^^^^^^

    "#]].assert_eq(&warnings);
}

#[test]
fn textures_without_an_image_that_can_be_read_are_left_out() {
    let material = r#"{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}},
        "occlusionTexture": {"index": 0}, "emissiveTexture": {"index": 5}, "emissiveFactor": [1, 1, 1],
        "extensions": {"KHR_materials_dispersion": {"dispersion": 1}}}"#;
    let more = r#", "images": [{"uri": "away.png"}, {"bufferView": 0}], "textures": [{"source": 0},
        {"extensions": {"KHR_texture_basisu": {"source": 1}}}]"#;
    check_warnings(
        &with_material(&square_of_material(), material, more),
        expect![[r#"
            warning[W0601]: `KHR_materials_dispersion` is not supported: materials are as without it
              ┌─ model.gltf#contents:4:1
              │
            4 │ materials[0]
              │ ^^^^^^^^^^^^

            warning[W0601]: texture 5 does not exist: it is left out
              ┌─ model.gltf#contents:1:1
              │
            1 │ glTF 2.0
              │ ^^^^^^^^

            warning[W0601]: image 0 is left out: cannot read `away.png`: entity not found
              ┌─ model.gltf#contents:5:1
              │
            5 │ textures[0]
              │ ^^^^^^^^^^^

            warning[W0601]: image 1 is left out: it is not a PNG, a JPEG, a WebP or a KTX 2.0 file
              ┌─ model.gltf#contents:6:1
              │
            6 │ textures[1]
              │ ^^^^^^^^^^^

        "#]],
    );
}

#[test]
fn files_that_show_nothing_are_refused() {
    let none =
        |text: &str| MemoryFiles([(PathBuf::from("model.gltf"), text.as_bytes().to_vec())].into());
    check_errors(
        &none("solid"),
        None,
        expect![[r#"
        error[E0620]: `model.gltf` cannot be used: it is not a glTF file: expected value at line 1 column 1
         = help: convert it, or correct its name

    "#]],
    );
    check_errors(
        &none(r#"{"asset": {"version": "1.0"}, "nodes": {}}"#),
        None,
        expect![[r#"
        error[E0620]: `model.gltf` cannot be used: it is a glTF file of version 1.0, expected version 2
         = help: convert it, or correct its name

    "#]],
    );
    check_errors(
        &none(r#"{"asset": {"version": "2.0"}}"#),
        None,
        expect![[r#"
        error[E0620]: `model.gltf` shows no surface
          ┌─ model.gltf#contents:1:1
          │
        1 │ glTF 2.0
          │ ^^^^^^^^
          │
          = note: its scene has no mesh with triangles

    "#]],
    );
    check_errors(
        &Files::default(),
        None,
        expect![[r#"
        error[E0601]: cannot read `model.gltf`: entity not found

    "#]],
    );
}

#[test]
fn a_shape_from_a_file_with_materials_says_how_to_see_them() {
    let mut files = files(&with_material(&square_of_material(), r#"{"name": "clay"}"#, ""));
    let scene =
        "Camera \"Pinhole\"\nWorldBegin\nShape \"gltf\" \"string filename\" \"model.gltf\"\n";
    files.0.insert("scene.pbrt".into(), scene.as_bytes().to_vec());
    let mut source = SceneSource::read(Path::new("scene.pbrt"), &files, &options(None));
    let loaded = source.load().unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    expect![[r#"
        warning[W0601]: the materials of `model.gltf` have no effect on a shape: `rtsl render model.gltf` shows the file as a scene
          ┌─ scene.pbrt:3:7
          │
        3 │ Shape "gltf" "string filename" "model.gltf"
          │       ^^^^^^

    "#]].assert_eq(&loaded.warnings.to_text(false));
}

#[test]
fn lights_of_other_extensions_are_said_to_be_left_out() {
    let members = format!(
        r#""extensionsUsed": ["EXT_lights_image_based"], "extensionsRequired": ["EXT_lights_image_based"],
        "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{SQUARE}]}}]"#
    );
    check_warnings(
        &members,
        expect![[r#"
        warning[W0601]: `EXT_lights_image_based` is not supported: its lights are left out
          ┌─ model.gltf#contents:1:1
          │
        1 │ glTF 2.0
          │ ^^^^^^^^

    "#]],
    );
}

/// A note tells what the reader added.
#[test]
fn what_a_file_lacks_is_noted() {
    let notes = |members: &str| {
        let (description, loaded, _) = loaded(&files(members));
        assert_eq!(description.notes, loaded.warnings.notes().collect::<Vec<_>>());
        description.notes
    };
    let camera = r#"{"camera": 0, "translation": [0, 0, 5]}"#;
    let light = r#"{"extensions": {"KHR_lights_punctual": {"light": 0}}}"#;
    let scene = |more: &str| {
        format!(
            r#""nodes": [{{"mesh": 0}}{more}], "meshes": [{{"primitives": [{SQUARE}]}}], {CAMERAS},
            "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type": "point"}}]}}}}"#
        )
    };
    let own = "the lights of the file alone light the scene: `--studio` adds a studio";
    assert_eq!(notes(&scene(&format!(", {camera}, {light}"))), [own]);
    let dark = ["the file has no lights: a studio lights the scene"];
    assert_eq!(notes(&scene(&format!(", {camera}"))), dark);
    let unseen = ["the file has no camera: one that shows all of the scene takes its place", own];
    assert_eq!(notes(&scene(&format!(", {light}"))), unseen);
    let neither = ["the file has neither camera nor lights: all of the scene is shown in a studio"];
    assert_eq!(notes(&scene("")), neither);
}

/// Texts of other encodings, and vertices that are not finite and that no triangle uses.
#[test]
fn faults_of_files_that_are_read_nevertheless() {
    let text =
        file(&format!(r#""nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{SQUARE}]}}]"#));
    let files = |bytes: Vec<u8>| Files::default().with("model.gltf", bytes);
    let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
    assert_eq!(loaded(&files(marked)).2, "");
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    check_errors(
        &files(wide),
        None,
        expect![[r#"
            error[E0620]: `model.gltf` cannot be used: it is in UTF-16: save it as UTF-8
             = help: it is damaged, or its exporter has a fault: export it again

        "#]],
    );
    let mut numbers: Vec<f32> = vec![0., 0., 0., 1., 0., 0., 1., 1., 0., f32::NAN, 1., 0.];
    let with = |numbers: &[f32], corners: [u8; 3]| {
        let floats = numbers.iter().flat_map(|number| number.to_le_bytes());
        let bytes: Vec<u8> = floats.chain(corners).collect();
        let data = base64::engine::general_purpose::STANDARD.encode(bytes);
        files(
            format!(
                r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}],
                "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
                "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
                    {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}}],
                "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 3}}],
                "buffers": [{{"byteLength": 51, "uri": "data:application/octet-stream;base64,{data}"}}]}}"#
            )
            .into_bytes(),
        )
    };
    expect![[r#"
        warning[W0601]: vertex 3 of a mesh has a coordinate that is not finite, and no triangle uses it: it is left out
          ┌─ model.gltf#contents:3:1
          │
        3 │ meshes[0]
          │ ^^^^^^^^^

    "#]].assert_eq(&loaded(&with(&numbers, [0, 1, 2])).2);
    check_errors(
        &with(&numbers, [1, 2, 3]),
        None,
        expect![[r#"
        warning[W0601]: primitive 0 of a mesh is left out: vertex 3 has a coordinate that is not finite
          ┌─ model.gltf#contents:3:1
          │
        3 │ meshes[0]
          │ ^^^^^^^^^

        error[E0620]: `model.gltf` shows no surface
          ┌─ model.gltf#contents:1:1
          │
        1 │ glTF 2.0
          │ ^^^^^^^^

    "#]],
    );
    numbers[9] = 0.0;
    assert_eq!(loaded(&with(&numbers, [1, 2, 3])).2, "");
}

/// A studio can be added to the lights of any scene, and is there once.
#[test]
fn the_studio_is_added_on_demand() {
    let options = LoadOptions { studio: true, ..LoadOptions::default() };
    let lights = |path: &str, files: &Files| {
        let loaded = load_scene(Path::new(path), files, &options).expect("it has no errors");
        let notes: Vec<String> = loaded.warnings.notes().map(str::to_owned).collect();
        assert!(!notes.iter().any(|note| note.contains("--studio")), "{notes:?}");
        let names = loaded.scene.lights.iter().map(|it| it.light.class().name.clone());
        names.collect::<Vec<_>>()
    };
    let nodes = r#"{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}"#;
    let file = |nodes: &str| {
        files(&format!(
            r#""nodes": [{nodes}], "meshes": [{{"primitives": [{SQUARE}]}}],
            "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type": "point"}}]}}}}"#
        ))
    };
    assert_eq!(lights("model.gltf", &file(nodes)), ["PointLight", "ImageSky"]);
    assert_eq!(lights("model.gltf", &file(r#"{"mesh": 0}"#)), ["ImageSky"]);
    let text = "Camera \"Pinhole\"\nWorldBegin\nLightSource \"point\"\nShape \"Sphere\"\n";
    let text = Files::default().with("scene.pbrt", text);
    assert_eq!(lights("scene.pbrt", &text), ["PointLight", "ImageSky"]);
}

/// Primitives that share arrays keep the vertices that they use.
#[test]
fn primitives_keep_their_own_vertices() {
    let floats = (0..27).flat_map(|number| (number as f32).to_le_bytes());
    let bytes: Vec<u8> = floats.chain([8, 2, 5, 0]).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0, "weights": [1]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "targets": [{{"POSITION": 0}}]}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 108}}, {{"buffer": 0, "byteOffset": 108, "byteLength": 3}}],
        "buffers": [{{"byteLength": 112, "uri": "data:application/octet-stream;base64,{data}"}}]}}"#
    );
    let (description, _, _) = loaded(&Files::default().with("model.gltf", text));
    let shape = description.shapes[0].shape;
    // The target has the same arrays, which doubles them.
    let expected = [12., 14., 16., 30., 32., 34., 48., 50., 52.];
    assert_eq!(buffer_of(&description, shape, "positions"), expected);
    let indices = buffer_of(&description, shape, "indices").into_iter().map(f32::to_bits);
    assert_eq!(indices.collect::<Vec<_>>(), [2, 0, 1]);
}

#[test]
fn points_and_lines_are_small_bodies() {
    let shape = |mode: u32| {
        let members = format!(
            r#""nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "COLOR_0": 3}}, "mode": {mode}}}]}}]"#
        );
        let (description, loaded, warnings) = loaded(&files(&members));
        assert_eq!((warnings.as_str(), loaded.warnings.notes().count()), ("", 2));
        let shape = description.shapes[0].shape;
        let count = |name: &str| buffer_of(&description, shape, name).len();
        (count("positions") / 3, count("colors") / 4, count("indices") / 3)
    };
    // Points, lines, loops and strips of four vertices.
    assert_eq!([0, 1, 2, 3].map(shape), [(16, 16, 16), (12, 12, 12), (24, 24, 24), (18, 18, 18)]);
}
