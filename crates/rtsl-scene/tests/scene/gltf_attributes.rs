//! Attributes of glTF files, of shapes and of scenes.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use base64::Engine;
use rtsl::Instance;
use rtsl_scene::reader::{FileSource, MemoryFiles};
use rtsl_scene::{LoadOptions, Loaded, SceneSource};

/// A material of the name of that of glTF files, which reads these attributes.
fn material(attributes: &str) -> String {
    format!(
        "class GltfPbr : rt_Material;\n\
         public texture color baseColor = color(1.0);\npublic float metallic = 1.0;\npublic float roughness = 1.0;\n\
         {attributes}\n"
    )
}

/// A triangle with attributes of all kinds, seen by two nodes, and a second primitive with positions only.
fn model() -> String {
    let mut bytes = Vec::new();
    let mut floats = |numbers: &[f32]| bytes.extend(numbers.iter().flat_map(|it| it.to_le_bytes()));
    floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]); // 0: positions
    floats(&[1., 2., 3.]); // 36: heights
    floats(&[0., 0.25, 1., 0.25, 0., 0.75]); // 48: coordinates
    floats(&[1., 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., -1.]); // 72: tangents
    bytes.extend([255_u8, 0, 51, 0, 0, 255, 0, 0, 0, 0, 255, 0]); // 120: colours
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let views = [(0, 36), (36, 12), (48, 24), (72, 48), (120, 12)].map(|(offset, length)| {
        format!(r#"{{"buffer": 0, "byteOffset": {offset}, "byteLength": {length}}}"#)
    });
    let accessors =
        [(5126, "VEC3"), (5126, "SCALAR"), (5126, "VEC2"), (5126, "VEC4"), (5121, "VEC3")];
    let accessors = accessors.iter().enumerate().map(|(view, (component, ty))| {
        let normalized = *component == 5121;
        format!(
            r#"{{"bufferView": {view}, "componentType": {component}, "count": 3, "type": "{ty}", "normalized": {normalized}}}"#
        )
    });
    let accessors = accessors.collect::<Vec<_>>().join(",");
    let views = views.join(",").replace(
        r#""byteOffset": 120, "byteLength": 12"#,
        r#""byteOffset": 120, "byteLength": 12, "byteStride": 4"#,
    );
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}, {{"mesh": 0, "scale": [-2, 1, 1]}}],
        "meshes": [{{"primitives": [
            {{"attributes": {{"POSITION": 0, "_HEIGHT": 1, "_Wind": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 2,
                "TANGENT": 3, "COLOR_0": 4}}}},
            {{"attributes": {{"POSITION": 0}}}}]}}],
        "bufferViews": [{views}], "accessors": [{accessors}],
        "buffers": [{{"byteLength": {}, "uri": "data:application/octet-stream;base64,{data}"}}]}}"#,
        bytes.len()
    )
}

const SCENE: &str = r#"
Camera "perspective"
WorldBegin
Material "GltfPbr"
Shape "gltf" "string filename" "model.gltf"
"#;

fn files(model: &str, attributes: &str) -> MemoryFiles {
    let files = [
        ("model.gltf", model.to_owned()),
        ("scene.pbrt", SCENE.to_owned()),
        ("own.rtsl", material(attributes)),
    ];
    MemoryFiles(files.map(|(name, text)| (PathBuf::from(name), text)).into())
}

fn load(name: &str, model: &str, attributes: &str) -> Result<Loaded, String> {
    let files = files(model, attributes);
    let mut source = SceneSource::read(Path::new(name), &files, &LoadOptions::default());
    source.load().map_err(|messages| messages.to_text(false))
}

fn loaded(name: &str, attributes: &str) -> Loaded {
    load(name, &model(), attributes).unwrap_or_else(|messages| panic!("{messages}"))
}

/// The numbers of an attribute of the vertices, by its index among those of a shape.
fn values(instance: &Instance, index: usize) -> Vec<f32> {
    let words = instance.buffer(&format!("attributeValues{index}"));
    words.map_or(Vec::new(), |it| it.iter().map(|bits| f32::from_bits(*bits)).collect())
}

/// The names of the attributes of a shape.
fn names(instance: &Instance) -> Vec<&str> {
    instance.class().attributes.iter().map(|it| it.name.as_str()).collect()
}

#[test]
fn shapes_of_files_have_attributes() {
    let scene = loaded(
        "scene.pbrt",
        "attribute float height = 0.5; void emission() { rt_EmissionColor = color(height); }",
    )
    .scene;
    let shape = &scene.objects[0].primitive;
    assert_eq!(names(shape), ["height"]);
    // The last node comes first. The second primitive has no heights.
    assert_eq!(values(shape, 0), [1., 2., 3., 0., 0., 0., 1., 2., 3., 0., 0., 0.]);
}

const ALL: &str = "attribute float HEIGHT; attribute float wind; attribute color Cd; \
    attribute vec2 uv0; attribute vec2 st; attribute vec4 tangent; attribute float missing;\
    void emission() { rt_EmissionColor = HEIGHT * wind * Cd * uv0.x * st.x * tangent.x * missing; }";

#[test]
fn all_attributes_have_their_names() {
    let scene = loaded("scene.pbrt", ALL).scene;
    let shape = &scene.objects[0].primitive;
    let names = ["Cd", "HEIGHT", "st", "tangent", "uv0", "wind"];
    let mut found = self::names(shape);
    found.sort_unstable();
    assert_eq!(found, names);
    let of = |name: &str| values(shape, names.iter().position(|it| *it == name).unwrap());
    assert_eq!(of("HEIGHT")[..3], [1., 2., 3.]);
    assert_eq!(of("wind")[..3], [1., 2., 3.]);
    assert_eq!(of("Cd")[..9], [1., 0., 0.2, 0., 1., 0., 0., 0., 1.]);
    // Vertices without colours are white.
    assert_eq!(of("Cd")[9..18], [1.; 9]);
    assert_eq!(of("uv0")[..6], [0., 0.25, 1., 0.25, 0., 0.75]);
    assert_eq!(of("st")[..2], [0., 0.25]);
    // The node of the first vertices mirrors them.
    assert_eq!(of("tangent")[..8], [-2., 0., 0., -1., -2., 0., 0., -1.]);
    assert_eq!(of("tangent")[24..28], [1., 0., 0., 1.]);
}

#[test]
fn colors_have_an_opacity_if_asked_for() {
    let reader = "attribute vec4 Cd; void emission() { rt_EmissionColor = color(Cd.w * Cd.xyz); }";
    let scene = loaded("scene.pbrt", reader).scene;
    assert_eq!(values(&scene.objects[0].primitive, 0)[..8], [1., 0., 0.2, 1., 0., 1., 0., 1.]);
}

#[test]
fn scenes_of_files_have_attributes() {
    let scene = loaded("model.gltf", ALL).scene;
    // The mesh of two nodes is an object of two shapes.
    let shapes: Vec<_> = scene.objects.iter().map(|object| &object.primitive).collect();
    assert_eq!(shapes.len(), 2);
    assert_eq!(names(shapes[0]).len(), 6);
    assert_eq!(names(shapes[1]).len(), 0);
    assert_eq!(values(shapes[0], 1), [1., 2., 3.]);
    // Upwards, as texture coordinates.
    assert_eq!(values(shapes[0], 4), [0., 0.75, 1., 0.75, 0., 0.25]);
    assert_eq!(values(shapes[0], 3)[8..], [1., 0., 0., -1.]);
}

#[test]
fn shapes_without_readers_are_as_before() {
    let nothing = "void emission() { rt_EmissionColor = baseColor; }";
    for name in ["model.gltf", "scene.pbrt"] {
        let loaded = loaded(name, nothing);
        for object in &loaded.scene.objects {
            assert!(names(&object.primitive).is_empty(), "{name}");
        }
    }
    // Even if attributes are damaged.
    let damaged = model().replace(r#""_HEIGHT": 1"#, r#""_HEIGHT": 99"#);
    let loaded = load("model.gltf", &damaged, nothing);
    assert!(loaded.is_ok_and(|it| !it.warnings.to_text(false).contains("attribute")));
}

/// Files that change between loads.
struct Changing(Mutex<MemoryFiles>);

impl FileSource for Changing {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.0.lock().unwrap().read(path)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        self.0.lock().unwrap().list(folder)
    }
}

#[test]
fn shaders_that_change_find_their_attributes() {
    let files = files(&model(), "void emission() { rt_EmissionColor = baseColor; }");
    let files = Changing(Mutex::new(files));
    let mut source = SceneSource::read(Path::new("model.gltf"), &files, &LoadOptions::default());
    let first = source.load().unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    let again = source.load().unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    let primitives = [&first, &again].map(|it| it.scene.objects[0].primitive.clone());
    assert!(Arc::ptr_eq(&primitives[0], &primitives[1]));
    let reader = "attribute float height; void emission() { rt_EmissionColor = color(height); }";
    let texts = [reader, "void emission() { rt_EmissionColor = baseColor; }"];
    for (text, expected) in texts.into_iter().zip([&["height"][..], &[]]) {
        files.0.lock().unwrap().0.insert("own.rtsl".into(), material(text));
        source.refresh_shaders();
        let changed = source.load().unwrap_or_else(|it| panic!("{}", it.to_text(false)));
        assert_eq!(names(&changed.scene.objects[0].primitive), expected);
    }
}

#[test]
fn attributes_of_other_types_are_said() {
    let reader = "attribute vec2 height; void emission() { rt_EmissionColor = color(height.x); }";
    let error = load("scene.pbrt", &model(), reader).expect_err("the type is wrong");
    let expected = "its attribute `_HEIGHT` has 1 numbers for a vertex, but `height` has 2";
    assert!(error.contains(expected), "{error}");
    assert!(
        error.contains("declare the attribute in the shader with a type of as many"),
        "{error}"
    );
    let loaded = load("model.gltf", &model(), reader).expect("the rest is shown");
    let warnings = loaded.warnings.to_text(false);
    assert!(warnings.contains(expected), "{warnings}");
    let damaged = model().replace(r#""_HEIGHT": 1"#, r#""_HEIGHT": 99"#);
    let reader = "attribute float height; void emission() { rt_EmissionColor = color(height); }";
    let loaded = load("model.gltf", &damaged, reader).expect("the rest is shown");
    let warnings = loaded.warnings.to_text(false);
    assert!(warnings.contains("accessor 99, which does not exist"), "{warnings}");
    let error = load("scene.pbrt", &damaged, reader).expect_err("the accessor is missing");
    assert!(error.contains("accessor 99, which does not exist"), "{error}");
}
