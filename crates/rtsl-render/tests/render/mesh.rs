//! Mesh shapes: their description in scenes, their conversion, and their images.

use std::path::Path;

use expect_test::{Expect, expect};
use rtsl_image::Image;
use rtsl_memory::SharedWords;
use rtsl_render::request::render_scene_from;
use rtsl_render::{Messages, RenderRequest};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{INTERACTIVE, LoadOptions, Scene, load_scene};

type Files = MemoryFiles<Vec<u8>>;

/// A scene with a camera and the text `world`.
fn with_world(world: &str) -> Files {
    let head = "LookAt 3 2 -4  0 0 0  0 1 0 Camera \"Pinhole\" \"float fov\" 40\n\
        Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 18\n\
        Sampler \"independent\" \"integer pixelsamples\" 1\nWorldBegin\n\
        LightSource \"PointLight\" \"point3 position\" [4 8 -4] \"rgb intensity\" [90 90 90]\n";
    Files::default().with("scene.pbrt", format!("{head}{world}"))
}

fn mesh_file(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes");
    std::fs::read(folder.join(name)).expect("the file is there")
}

fn load(files: &Files) -> Result<Scene, Messages> {
    load_scene(Path::new("scene.pbrt"), files, &LoadOptions::default()).map(|loaded| loaded.scene)
}

fn scene(files: &Files) -> Scene {
    load(files).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn check_messages(files: &Files, expected: Expect) {
    let messages = load(files).expect_err("the scene is wrong");
    expected.assert_eq(&messages.to_text(false));
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

fn picture(files: &Files) -> Vec<[u32; 3]> {
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        load: LoadOptions::with_integrator(INTERACTIVE),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, files);
    let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    bits(&result.image)
}

const SQUARE: &str = "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] \
    \"integer indices\" [0 1 2  0 2 3] \"normal N\" [0 0 -1  0 0 -1  0 0 -1  0 0 -1] \
    \"point2 uv\" [0 0  1 0  1 1  0 1]\n";

#[test]
fn a_mesh_is_one_object_with_elements() {
    let scene = scene(&with_world(SQUARE));
    let [object] = scene.objects.as_slice() else { panic!("{} objects", scene.objects.len()) };
    assert_eq!(object.elements, Some(2));
    assert_eq!(object.primitive.buffer("indices").unwrap()[..], [0, 1, 2, 0, 2, 3]);
    let uvs = object.primitive.buffer("uvs").unwrap().iter().map(|bits| f32::from_bits(*bits));
    assert_eq!(uvs.collect::<Vec<_>>(), [0., 0., 1., 0., 1., 1., 0., 1.]);
}

#[test]
fn one_mesh_in_five_formats_is_the_same() {
    let files = [
        ("plymesh", "cube_text.ply"),
        ("plymesh", "cube_little_endian.ply"),
        ("plymesh", "cube_big_endian.ply"),
        ("gltf", "cube.gltf"),
        ("gltf", "cube.glb"),
    ];
    let objects = files.map(|(shape, name)| {
        let world = format!("Shape \"{shape}\" \"string filename\" \"meshes/../{name}\"");
        scene(&with_world(&world).with(name, mesh_file(name))).objects.remove(0)
    });
    for object in &objects {
        assert_eq!(object.elements, Some(12));
        for name in ["positions", "normals", "uvs", "indices"] {
            let buffer = |of: &rtsl_scene::SceneObject| of.primitive.buffer(name).cloned();
            let (first, this): (Option<SharedWords>, _) = (buffer(&objects[0]), buffer(object));
            assert!(first.is_some_and(|buffer| !buffer.is_empty()) && buffer(&objects[0]) == this);
        }
    }
}

#[test]
fn a_triangle_takes_no_more_than_its_share_of_the_buffers() {
    let knot = mesh_file("../../../../scenes/knot.ply");
    let files = with_world("Shape \"plymesh\" \"string filename\" \"knot.ply\"");
    let object = scene(&files.with("knot.ply", knot)).objects.remove(0);
    let buffers = ["positions", "normals", "uvs", "indices"];
    let words = buffers.map(|name| object.primitive.buffer(name).map_or(0, |words| words.len()));
    let bytes = 4 * words.iter().sum::<usize>();
    let triangles = object.elements.expect("it is a mesh") as usize;
    assert!(bytes <= 36 * triangles, "{bytes} bytes for {triangles} triangles");
}

/// A rough sheet of 8 by 8 squares, of which each mesh has so many rows, with normals and coordinates at its corners.
fn sheet(rows: usize) -> String {
    let place = |index: usize| index as f32 / 4.0 - 1.0;
    let height = |x: usize, y: usize| ((7 * x + 5 * y) % 11) as f32 / 40.0;
    let meshes = (0..8).step_by(rows).map(|first| {
        let corners = || (first..=first + rows).flat_map(|y| (0..=8).map(move |x| (x, y)));
        let list = |corner: &dyn Fn(usize, usize) -> String| -> String {
            corners().map(|(x, y)| corner(x, y)).collect()
        };
        let points = list(&|x, y| format!("{} {} {} ", place(x), height(x, y), place(y)));
        let normals = list(&|x, y| format!("{} 1 {} ", height(y, x) - 0.1, height(x, x) - 0.1));
        let uvs = list(&|x, y| format!("{} {} ", place(x), place(y)));
        let squares = (0..rows).flat_map(|y| (0..8).map(move |x| 9 * y + x));
        let indices = squares
            .map(|at| format!("{} {} {}  {} {} {} ", at, at + 1, at + 10, at, at + 10, at + 9));
        format!(
            "Shape \"trianglemesh\" \"point3 P\" [{points}] \"normal N\" [{normals}] \
             \"point2 uv\" [{uvs}] \"integer indices\" [{}]\n",
            indices.collect::<String>()
        )
    });
    "Texture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" 3 \"float vscale\" 3\n\
     Material \"diffuse\" \"texture reflectance\" \"checks\"\n"
        .to_owned()
        + &meshes.collect::<String>()
}

/// Meshes are in leaves together, where a ray that hits one has to find its own normals and coordinates.
#[test]
fn a_mesh_in_parts_is_the_same_picture() {
    let ball = "Translate 0 0.6 0 Material \"diffuse\" Shape \"sphere\" \"float radius\" 0.3\n";
    for placed in ["", "Translate 0.1 0.2 0.3\n"] {
        let of_rows = |rows: usize| {
            let files = with_world(&format!("{placed}{}{ball}", sheet(rows)));
            let whitted = picture(&files);
            let request = RenderRequest {
                scene: "scene.pbrt".into(),
                load: LoadOptions::with_integrator("Path"),
                samples: Some(4),
                ..RenderRequest::default()
            };
            let paths = render_scene_from(&request, &files);
            let paths = paths.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
            (whitted, bits(&paths.image))
        };
        let whole = of_rows(8);
        assert!(whole.0.iter().any(|pixel| *pixel != whole.0[0]));
        for rows in [1, 2, 4] {
            assert!(of_rows(rows) == whole, "{rows} rows, {placed}");
        }
    }
}

/// The corners of the square with a texture that shows its coordinates, in single triangles.
fn single_triangles() -> String {
    let triangle = |corners: [[i32; 2]; 3]| {
        let corner = |name: &str, [x, y]: [i32; 2]| {
            let (u, v) = ((x + 1) / 2, (y + 1) / 2);
            let upper = name.to_uppercase();
            format!(
                "\"point3 {name}\" [{x} {y} 0] \"point2 uv{upper}\" [{u} {v}] \
                 \"normal normal{upper}\" [0 0 -1] "
            )
        };
        let [a, b, c] = corners;
        format!("Shape \"Triangle\" {}{}{}\n", corner("a", a), corner("b", b), corner("c", c))
    };
    triangle([[-1, -1], [1, -1], [1, 1]]) + &triangle([[-1, -1], [1, 1], [-1, 1]])
}

const CHECKED: &str = "Texture \"tiles\" \"spectrum\" \"Checker\" \"float scale\" 3\n\
    Material \"Lambertian\" \"texture kd\" \"tiles\"\n";

#[test]
fn a_mesh_looks_like_its_triangles() {
    let mesh = picture(&with_world(&format!("{CHECKED}{SQUARE}")));
    let single = picture(&with_world(&format!("{CHECKED}{}", single_triangles())));
    assert!(mesh.iter().any(|pixel| *pixel != mesh[0]), "there is something to see");
    assert!(mesh == single);
}

#[test]
fn what_has_no_effect_on_a_mesh_is_left_out() {
    for shape in ["trianglemesh", "bilinearmesh"] {
        let indices = if shape == "trianglemesh" { "0 1 2" } else { "0 1 2 3" };
        let with = |parameter: &str| {
            with_world(&format!(
                "Shape \"{shape}\" \"point3 P\" [0 0 0  1 0 0  0 1 0  1 1 0.5]
                \"integer indices\" [{indices}] {parameter}"
            ))
        };
        assert_eq!(picture(&with("\"float shadowalpha\" 0.5")), picture(&with("")));
        assert!(load(&with("\"float shadowbeta\" 0.5")).is_err());
    }
}

#[test]
fn a_flat_patch_looks_like_two_triangles() {
    let text = "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] \
        \"normal N\" [0 0 -1  0 0 -1  0 0 -1  0 0 -1]";
    let patch = picture(&with_world(&format!("{CHECKED}{text}")));
    let triangles = picture(&with_world(&format!("{CHECKED}{SQUARE}")));
    let close = |a: &[u32; 3], b: &[u32; 3]| {
        let difference = |channel: usize| f32::from_bits(a[channel]) - f32::from_bits(b[channel]);
        (0..3).all(|channel| difference(channel).abs() < 1e-3)
    };
    let different = patch.iter().zip(&triangles).filter(|(a, b)| !close(a, b)).count();
    // Rounding may move a ray to the next tile of the texture, or off the edge.
    assert!(different <= 2, "{different} pixels differ");
}

/// A floor lit by the text `lamp`.
fn lit_floor(lamp: &str) -> Files {
    let text = "LookAt 0 1 -4  0 0 0  0 1 0 Camera \"Pinhole\" \"float fov\" 40\n\
        Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
        Sampler \"stratified\" \"integer pixelsamples\" 64\n\
        WorldBegin\nShape \"Plane\"\nAreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\n\
        Translate 0 3 0 Rotate 90 1 0 0\n";
    Files::default().with("scene.pbrt", format!("{text}{lamp}"))
}

#[test]
fn patches_and_small_meshes_light_what_is_around_them() {
    let brightness = |lamp: &str| {
        let pixels = picture(&lit_floor(lamp));
        pixels.iter().flatten().map(|bits| f32::from_bits(*bits)).sum::<f32>()
    };
    assert_eq!(brightness(""), 0.0);
    let patch = "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]";
    let bent = "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 1e-4]";
    assert_eq!(scene(&lit_floor(bent)).objects[1].elements, None);
    let as_bent = brightness(bent);
    let triangles =
        SQUARE.replace("[0 0 -1  0 0 -1  0 0 -1  0 0 -1]", "[0 0 1  0 0 1  0 0 1  0 0 1]");
    let (patch, triangles) = (brightness(patch), brightness(&triangles));
    assert!(patch > 1.0);
    assert!((triangles / patch - 1.0).abs() < 0.02, "{triangles} and {patch}");
    assert!((as_bent / patch - 1.0).abs() < 0.02, "{as_bent} and {patch}");
}

#[test]
fn meshes_within_objects_are_placed() {
    let placed = format!(
        "ObjectBegin \"pair\"\n{CHECKED}{SQUARE}ObjectEnd\n\
        ObjectInstance \"pair\"\n"
    );
    let placed = picture(&with_world(&placed));
    assert!(placed == picture(&with_world(&format!("{CHECKED}{SQUARE}"))));
}

#[test]
fn degenerate_triangles_are_never_hit() {
    // A point, a line along no axis, and a triangle that repeats a corner.
    let degenerate = "Shape \"trianglemesh\" \"point3 P\" [0.1 0.2 0.3  0.7 0.9 1.1  1.3 1.6 1.9] \
        \"integer indices\" [0 0 0  0 1 2  0 1 0  1 1 2]\n";
    let with = picture(&with_world(&format!("{SQUARE}{degenerate}")));
    assert!(with == picture(&with_world(SQUARE)));
}

#[test]
fn tiny_and_huge_meshes_are_seen() {
    let square = |size: &str, scale: &str| {
        format!(
            "Scale {scale} {scale} {scale}\nShape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3] \
             \"point3 P\" [-{size} -{size} 0  {size} -{size} 0  {size} {size} 0  -{size} {size} 0]"
        )
    };
    let seen = |size: &str, scale: &str| {
        let pixels = picture(&with_world(&square(size, scale)));
        pixels.iter().filter(|pixel| **pixel != [0; 3]).count()
    };
    let usual = seen("1", "1");
    assert!(usual > 20);
    assert_eq!(seen("1e-9", "1e9"), usual);
    assert_eq!(seen("1e9", "1e-9"), usual);
}

#[test]
fn what_is_wrong_with_a_mesh_is_said() {
    let shape = "Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0] \"integer indices\" [0 1 3]\n\
        Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0] \"point2 uv\" [0 0]\n\
        Shape \"bilinearmesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0]\n\
        Shape \"trianglemesh\" \"point3 p\" [0 0 0  1 0 0  0 1 0]\n\
        Shape \"plymesh\"\n\
        Shape \"plymesh\" \"string filename\" [\"cut.ply\"]\n\
        Shape \"plymesh\" \"string filename\" \"scene.pbrt\"\n\
        Shape \"plymesh\" \"float filename\" 3\n\
        Shape \"gltf\" \"string filename\" \"cut.ply\"\n";
    let mut cut = mesh_file("cube_little_endian.ply");
    cut.truncate(500);
    check_messages(
        &with_world(shape).with("cut.ply", cut),
        expect![[r#"
            error[E0620]: this `trianglemesh` cannot be used: a face has the corner 3, but there are 3 vertices
              ┌─ scene.pbrt:6:7
              │
            6 │ Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0] "integer indices" [0 1 3]
              │       ^^^^^^^^^^^^^^
              │
              = help: indices count vertices from 0

            error[E0620]: this `trianglemesh` cannot be used: it has 3 vertices, but 1 texture coordinates
              ┌─ scene.pbrt:7:7
              │
            7 │ Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0] "point2 uv" [0 0]
              │       ^^^^^^^^^^^^^^
              │
              = help: give one for each vertex, or none at all

            error[E0620]: this `bilinearmesh` cannot be used: a face has the corner 3, but there are 3 vertices
              ┌─ scene.pbrt:8:7
              │
            8 │ Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0]
              │       ^^^^^^^^^^^^^^
              │
              = help: indices count vertices from 0

            error[E0608]: shape `trianglemesh` has no parameter `p`
              ┌─ scene.pbrt:9:22
              │
            9 │ Shape "trianglemesh" "point3 p" [0 0 0  1 0 0  0 1 0]
              │                      ^^^^^^^^^^
              │
              = help: did you mean `P`?

            error[E0501]: `plymesh` names no file
               ┌─ scene.pbrt:10:7
               │
            10 │ Shape "plymesh"
               │       ^^^^^^^^^ expected for example `"string filename" "mesh.ply"`

            error[E0620]: this `plymesh` cannot be used: the file ends within a number
               ┌─ scene.pbrt:11:35
               │
            11 │ Shape "plymesh" "string filename" ["cut.ply"]
               │                                   ^^^^^^^^^^^
               │
               = help: it was cut off: copy or export it again

            error[E0620]: this `plymesh` cannot be used: it is not a PLY file
               ┌─ scene.pbrt:12:35
               │
            12 │ Shape "plymesh" "string filename" "scene.pbrt"
               │                                   ^^^^^^^^^^^^
               │
               = help: convert it, or correct its name

            error[E0607]: `filename` takes a string, found 1 numbers
               ┌─ scene.pbrt:13:34
               │
            13 │ Shape "plymesh" "float filename" 3
               │                                  ^

            error[E0620]: this `gltf` cannot be used: it is not a glTF file: expected value at line 1 column 1
               ┌─ scene.pbrt:14:32
               │
            14 │ Shape "gltf" "string filename" "cut.ply"
               │                                ^^^^^^^^^
               │
               = help: convert it, or correct its name

        "#]],
    );
}
