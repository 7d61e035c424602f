//! Attributes of shapes, and maps to their spaces, as all integrators and backends see them.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions, Messages};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE, LoadOptions};

/// Pixels of half a unit, each with a sample at its centre.
const HEAD: &str = r#"
LookAt 0 0 -5  0 0 0  0 1 0
Camera "Orthographic" "float scale" 2
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
Sampler "stratified" "integer xsamples" 1 "integer ysamples" 1 "bool jitter" false
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
WorldBegin
Material "Glow"
"#;

const CLASSES: &str = "
class Glow : rt_Material;
attribute float heat = 0.25;
attribute color Cd = color(0.5);
attribute vec2 wind = vec2(1.0, 2.0);
void emission() { rt_EmissionColor = color(heat, wind.x + wind.y, 0.0) + Cd; }

class Local : rt_Material;
void emission() {
    vec3 p = pointToObject(rt_HitPoint);
    rt_EmissionColor = color(0.25 * abs(p.x), 0.25 * length(pointToWorld(p) - rt_HitPoint), rt_InstanceNumber + 1.0);
}

// Convex parts are red, hollow ones green.
class Bent : rt_Material;
attribute float curvature = 7.0;
void emission() { rt_EmissionColor = color(max(curvature, 0.0), max(-curvature, 0.0), 0.0); }

class Shown : rt_Material;
public rt_Texture glow;
void emission() { rt_EmissionColor = glow.lookup(); }

// A ball whose normals are those of hits.
class Found : rt_Primitive;
void intersect() {
    float b = dot(rt_RayOrigin, rt_RayDirection), d = dot(rt_RayDirection, rt_RayDirection);
    hit((-b - sqrt(b * b - d * (dot(rt_RayOrigin, rt_RayOrigin) - 9.0))) / d);
}

// A wall that says how it is bent.
class Told : rt_Primitive;
attribute float curvature;
void intersect() { hit(-rt_RayOrigin.z / rt_RayDirection.z); }
void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
void computeTextureCoordinates() { curvature = 2.0; }

// Scratch is what `intersect` leaves, whatever later methods write.
class Kept : rt_Primitive;
attribute float heat;
scratch float left;
void intersect() { if (hit(-rt_RayOrigin.z / rt_RayDirection.z)) left = 3.0; }
void computeNormal() { left += 1.0; rt_GeometricNormal = vec3(0.0, 0.0, left); }
void computeTextureCoordinates() { heat = left; left = 20.0; rt_TextureUV = vec2(left); }
void computeDerivatives() { rt_dPdu = vec3(left); }

// A wall that gives an attribute by its method.
class Wall : rt_Primitive;
attribute float heat;
void intersect() { hit(-rt_RayOrigin.z / rt_RayDirection.z); }
void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
void computeTextureCoordinates() { heat = abs(rt_HitPoint.y); }
";

/// A square from -2 to 2 whose vertices and faces have numbers.
const PLY: &str = "ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
property double wind_x
property double wind_y
element face 2
property list uchar int vertex_indices
property float heat
end_header
-2 -2 0 255 0 255 0 0
2 -2 0 255 0 255 4 0
2 2 0 255 0 255 4 8
-2 2 0 255 0 255 0 8
3 0 1 2 10
3 0 2 3 20
";

const SQUARE: &str = "\"point3 P\" [-2 -2 0 2 -2 0 2 2 0 -2 2 0] \"integer indices\" [0 1 2 0 2 3]";

fn try_render(world: &str, how: RenderRequest<'_>) -> Result<RenderResult, Messages> {
    let files = [
        ("scene.pbrt", format!("{HEAD}{world}")),
        ("own.rtsl", CLASSES.to_owned()),
        ("square.ply", PLY.to_owned()),
        ("square.gltf", GLTF.to_owned()),
    ];
    let files = files.map(|(name, text)| (PathBuf::from(name), text));
    let request = RenderRequest { scene: Path::new("scene.pbrt").into(), ..how };
    render_scene_from(&request, &MemoryFiles(files.into()))
}

fn on(backend: Backend, width: u32, renderer: &str) -> RenderRequest<'static> {
    let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    let load = LoadOptions::with_integrator(renderer);
    RenderRequest { engine, load, execution: Execution::on_threads(2), ..Default::default() }
}

/// The pixels of a world, which are the same for both renderers, on all backends.
fn pixels(world: &str) -> Vec<[f32; 3]> {
    let renders = [
        on(Backend::Interpreter, 1, BATCH),
        on(Backend::Jit, 4, BATCH),
        on(Backend::Jit, 16, BATCH),
        on(Backend::Jit, 8, INTERACTIVE),
    ];
    let pixels = renders.map(|how| {
        let result = try_render(world, how);
        let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        result.image.pixels
    });
    let bits = |pixels: &[[f32; 3]]| -> Vec<u32> {
        pixels.iter().flatten().map(|value| value.to_bits()).collect()
    };
    assert!(pixels.iter().all(|other| bits(other) == bits(&pixels[0])));
    pixels.into_iter().next().unwrap_or_default()
}

/// The centre of a pixel of the square; x grows to the left, as the camera looks along z.
fn centre(pixel: usize) -> [f32; 2] {
    let (column, row) = (pixel % 8, pixel / 8);
    [0.5 * column as f32 - 1.75, 1.75 - 0.5 * row as f32]
}

fn check(world: &str, expected: impl Fn([f32; 2]) -> [f32; 3]) {
    let pixels = pixels(world);
    let mirrored = |[x, y]: [f32; 2]| if pixels_are_mirrored() { [-x, y] } else { [x, y] };
    for (pixel, found) in pixels.iter().enumerate() {
        let at = mirrored(centre(pixel));
        let expected = expected(at);
        for channel in 0..3 {
            let difference = (found[channel] - expected[channel]).abs();
            assert!(
                difference < 1e-4 * expected[channel].max(1.0),
                "{at:?}: {found:?} {expected:?} of {world}"
            );
        }
    }
}

/// pbrt's cameras look along z with x to the left of the world.
fn pixels_are_mirrored() -> bool {
    false
}

#[test]
fn shapes_have_values_or_the_defaults() {
    check("Shape \"disk\" \"float radius\" 9", |_| [0.75, 3.5, 0.5]);
    check("Shape \"disk\" \"float radius\" 9 \"float heat\" 2 \"rgb Cd\" [0 0.25 1]", |_| {
        [2.0, 3.25, 1.0]
    });
    check("Attribute \"shape\" \"float heat\" 2 Shape \"disk\" \"float radius\" 9", |_| {
        [2.5, 3.5, 0.5]
    });
    check("Shape \"Wall\"", |[_, y]| [y.abs() + 0.5, 3.5, 0.5]);
    check("Shape \"Kept\"", |_| [3.5, 3.5, 0.5]);
}

#[test]
fn vertices_and_faces_have_values() {
    let world = |more: &str| format!("Shape \"trianglemesh\" {SQUARE} {more}");
    check(&world("\"float heat\" [0 4 4 0]"), |[x, _]| [x + 2.0 + 0.5, 3.5, 0.5]);
    check(&world("\"vector2 wind\" [0 0 4 0 4 8 0 8]"), |[x, y]| {
        [0.75, (x + 2.0) + 2.0 * (y + 2.0) + 0.5, 0.5]
    });
    let world = format!("Shape \"trianglemesh\" {SQUARE} \"float heat\" [3 3]");
    check(&world, |_| [3.5, 3.5, 0.5]);
    let patch = "\"point3 P\" [-2 -2 0 2 -2 0 -2 2 0 2 2 0.001] \"integer indices\" [0 1 2 3]";
    check(&format!("Shape \"bilinearmesh\" {patch} \"float heat\" [0 4 4 8]"), |[x, y]| {
        [(x + 2.0) + (y + 2.0) + 0.5, 3.5, 0.5]
    });
}

#[test]
fn shapes_have_curvatures() {
    let bent = |shape: &str| format!("Material \"Bent\" {shape}");
    let third = 1.0 / 3.0;
    for ball in [
        "Shape \"Sphere\" \"float radius\" 3",
        "Shape \"Superquadric\" \"vector3 radii\" [3 3 3] \"float profile\" 1 \"float section\" 1",
        "Shape \"SdfUnion\" \"point3 centers\" [0 0 0] \"float radii\" [3]",
        "Shape \"RoundCone\" \"point3 start\" [0 0 0] \"point3 end\" [0 0 1] \"float startRadius\" 3 \"float endRadius\" 1",
    ] {
        check(&bent(ball), |_| [third, 0.0, 0.0]);
    }
    check(&bent("Shape \"Cylinder\" \"float radius\" 3"), |[_, y]| {
        if y.abs() < 1.0 { [0.5 * third, 0.0, 0.0] } else { [0.0; 3] }
    });
    // The axis of the torus is that of the camera; its hole has a radius of 1.5.
    let torus = "Rotate 90 1 0 0 Shape \"Torus\" \"float majorRadius\" 5 \"float minorRadius\" 3.5";
    check(&bent(torus), |[x, y]| {
        let way = (x * x + y * y).sqrt();
        let mean = (2.0 * way - 5.0) / (7.0 * way);
        if way < 1.5 { [0.0; 3] } else { [mean.max(0.0), (-mean).max(0.0), 0.0] }
    });
    check(&bent("Shape \"Told\""), |_| [2.0, 0.0, 0.0]);
    check(&bent("Shape \"disk\" \"float radius\" 9 \"float curvature\" -1"), |_| [0.0, 1.0, 0.0]);
    check(&bent(&format!("Shape \"trianglemesh\" {SQUARE}")), |_| [0.0; 3]);
    // Normals that hits tell are no function of the class, so the default counts.
    check(&bent("Shape \"Found\""), |_| [7.0, 0.0, 0.0]);
}

#[test]
fn curvatures_are_shown_in_the_units_of_the_world() {
    let world =
        "Texture \"bent\" \"spectrum\" \"Curvature\" \"float radius\" 1.5 \"rgb raised\" [1 0 0]
        Material \"Shown\" \"texture glow\" \"bent\"
        Scale 2 2 2 Shape \"Sphere\" \"float radius\" 1.5";
    check(world, |_| [0.75, 0.25, 0.25]);
}

#[test]
fn files_have_attributes() {
    check("Shape \"plymesh\" \"string filename\" \"square.ply\"", |[x, y]| {
        let heat = if y < x { 10.0 } else { 20.0 };
        let wind = (x + 2.0) + 2.0 * (y + 2.0);
        // Pixels on the diagonal may see either triangle.
        if x == y {
            return pixel_on_diagonal(wind);
        }
        [heat + 1.0, wind, 1.0]
    });
}

/// Both triangles hold the diagonal; the first is found.
fn pixel_on_diagonal(wind: f32) -> [f32; 3] {
    [11.0, wind, 1.0]
}

/// The square with a height at each vertex: the bytes of positions, heights and indices.
const GLTF: &str = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_HEAT": 1}, "indices": 2}]}],
    "accessors": [{"bufferView": 0, "componentType": 5120, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5121, "count": 4, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 12}, {"buffer": 0, "byteOffset": 12, "byteLength": 4},
        {"buffer": 0, "byteOffset": 16, "byteLength": 6}],
    "buffers": [{"byteLength": 22, "uri": "data:application/octet-stream;base64,/v4AAv4AAgIA/gIAAAQEAAABAgACAw=="}]}"#;

#[test]
fn gltf_files_have_attributes() {
    check("Shape \"gltf\" \"string filename\" \"square.gltf\"", |[x, _]| [x + 2.0 + 0.5, 3.5, 0.5]);
}

#[test]
fn instances_and_large_meshes_have_attributes() {
    let world = format!(
        "ObjectBegin \"a\" Shape \"trianglemesh\" {SQUARE} \"float heat\" [0 4 4 0] ObjectEnd\n\
         Scale 1 2 1 ObjectInstance \"a\""
    );
    check(&world, |[x, _]| [x + 2.0 + 0.5, 3.5, 0.5]);
}

#[test]
fn points_are_mapped_to_the_space_of_the_object() {
    check("Material \"Local\" Scale 4 4 4 Shape \"Wall\"", |[x, _]| [x.abs() / 16.0, 0.0, 0.0]);
    let world = "Material \"Local\" ObjectBegin \"a\" Scale 2 1 1 Shape \"Wall\" ObjectEnd\n\
                 Scale 2 1 1 ObjectInstance \"a\"";
    check(world, |[x, _]| [x.abs() / 16.0, 0.0, 1.0]);
}

#[test]
fn wrong_attributes_are_errors() {
    let report = |world: &str| {
        let failed = try_render(world, RenderRequest::default());
        failed.err().map_or(String::new(), |messages| messages.to_text(false))
    };
    let found = report(&format!("Shape \"trianglemesh\" {SQUARE} \"float heat\" [1 2 3]"));
    assert!(
        found.contains("for each of its 4 vertices, or for each of its 2 faces, found 3"),
        "{found}"
    );
    let found = report("Shape \"sphere\" \"float heat\" [1 2]");
    assert!(found.contains("has 1 numbers for the shape, found 2"), "{found}");
    let found = report("Shape \"sphere\" \"string heat\" \"hot\"");
    assert!(found.contains("`heat` is an attribute, found strings"), "{found}");
    let found = report("Shape \"sphere\" \"float hat\" 1");
    assert!(found.contains("no parameter `hat`"), "{found}");
    let found = report("Texture \"a\" \"float\" \"Attribute\" Shape \"sphere\"");
    assert!(found.contains("the texture names no attribute"), "{found}");
    let found = report(
        "Texture \"a\" \"float\" \"Attribute\" \"string attribute\" \"a b\" Shape \"sphere\"",
    );
    assert!(found.contains("`a b` is no name of an attribute"), "{found}");
}
