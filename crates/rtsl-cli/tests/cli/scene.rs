//! `rtsl scene`: the contents of scenes, and their conversion.

use expect_test::expect;
use rtsl_image::{Encoding, Picture};
use rtsl_memory::InputBudget;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

/// A scene of pbrt-v2 that includes a file, with something that pbrt-v4 does not have.
const OLD: &str = "LookAt 0 1 -5  0 0 0  0 1 0\n\
    Camera \"perspective\" \"float fov\" [40.0]\n\
    Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 8\n\
    Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 4\n\
    SurfaceIntegrator \"path\" \"integer maxdepth\" 3\n\
    WorldBegin\n\
    LightSource \"point\" \"color I\" [9 9 8] \"color scale\" [2 2 2] \"point from\" [1 4 -4]\n\
    Texture \"uv\" \"color\" \"uv\"\n\
    Material \"matte\" \"texture Kd\" \"uv\" \"float sigma\" 20\n\
    Include \"parts/ball.pbrt\"\n\
    ObjectBegin \"pair\"\n\
    Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n\
    Shape \"trianglemesh\" \"point P\" [0 0 1 1 0 1 0 1 1] \"integer indices\" [0 1 2]\n\
    ObjectEnd\n\
    ObjectInstance \"pair\"\n\
    Translate -2 0 0\n\
    ObjectInstance \"pair\"\n\
    AreaLightSource \"area\" \"color L\" [2 1 1]\n\
    Shape \"cone\" \"float height\" .5\n\
    WorldEnd\n";

fn folder() -> Folder {
    let folder = Folder::new("scene");
    std::fs::create_dir(folder.0.path().join("parts")).unwrap();
    folder.write("old.pbrt", OLD);
    folder.write("parts/ball.pbrt", "Shape \"sphere\" \"color Kd\" [.8 .1 .1]\n");
    folder
}

fn picture(folder: &Folder, scene: &str) -> Vec<u8> {
    let arguments = ["render", scene, "--backend", "interp", "-o", "picture.exr"];
    folder.run(&arguments).exits(DONE);
    std::fs::read(folder.0.path().join("picture.exr")).unwrap()
}

#[test]
fn a_converted_scene_has_the_picture_of_the_old_one() {
    let folder = folder();
    std::fs::create_dir(folder.0.path().join("v4")).unwrap();
    let converted = folder.run(&["scene", "convert", "old.pbrt", "-o", "new.pbrt"]).exits(DONE);
    let heads: Vec<String> = converted
        .errors()
        .lines()
        .filter(|it| it.starts_with("warning"))
        .map(str::to_owned)
        .collect();
    assert_eq!(
        heads,
        ["warning[W0601]: `sigma` of material `matte` has no effect: it is left out"]
    );
    folder.run(&["scene", "convert", "old.pbrt", "-o", "v4/one.pbrt", "--inline"]).exits(DONE);
    let text = |name: &str| std::fs::read_to_string(folder.0.path().join(name)).unwrap();
    assert!(text("new.pbrt").contains("Include \"parts/ball-v4.pbrt\"\n"), "{}", text("new.pbrt"));
    assert!(!text("v4/one.pbrt").contains("Include"));
    assert_eq!(text("old.pbrt"), OLD);
    let old = picture(&folder, "old.pbrt");
    assert!(old == picture(&folder, "new.pbrt"), "the pictures differ");
    assert!(old == picture(&folder, "v4/one.pbrt"), "the pictures differ");
    // A scene of pbrt-v4 stays as it is.
    let again =
        folder.run(&["scene", "convert", "new.pbrt", "-o", "again.pbrt", "--inline"]).exits(DONE);
    assert_eq!(again.errors(), "note: `new.pbrt` is in the format of pbrt-v4 already\n");
    assert_eq!(text("again.pbrt"), text("v4/one.pbrt"));
}

#[test]
fn what_cannot_be_converted_is_an_error() {
    let folder = folder();
    folder.write("model.glb", "glTF");
    folder.write("broken.pbrt", "Shape \"sphere\" \"float radius\" x\nWorldEnd\n");
    let convert =
        |scene: &str, output: &str| folder.run(&["scene", "convert", scene, "-o", output]);
    convert("model.glb", "new.pbrt").exits(INPUT_AT_FAULT);
    convert("old.pbrt", "./parts/../old.pbrt").fails_with("E0625");
    convert("old.pbrt", "parts/ball.pbrt").fails_with("E0625");
    convert("missing.pbrt", "new.pbrt").fails_with("E0601");
    convert("broken.pbrt", "new.pbrt").fails_with("E0602");
    convert("old.pbrt", "nowhere/new.pbrt").exits(WRONG_USAGE);
    convert("old.pbrt", "parts").exits(WRONG_USAGE);
    folder.run(&["scene"]).exits(WRONG_USAGE);
    let left = std::fs::read_dir(folder.0.path()).unwrap().count();
    assert_eq!(left, 4, "nothing was written");
}

#[test]
fn info_shows_what_is_in_a_scene() {
    let folder = folder();
    folder.run(&["scene", "info", "old.pbrt"]).exits(DONE).prints(expect![[r#"
        scene         old.pbrt, pbrt-v3 or earlier
        camera        perspective
        film          rgb, 12 by 8
        filter        default
        sampler       paddedsobol, 4 samples per pixel
        integrator    path, to a depth of 3
        shapes        4: 3 trianglemesh, 1 sphere
          objects     1
          instances   2
          triangles   1 538, 1 540 with instances; 45.4 KiB
        materials     2: 2 diffuse
        textures      1: 1 bilerp
        images        0, 0.0 KiB of texels
        lights        1: 1 point
        area lights   1: 1 diffuse
          shapes      1
        bounds        (-3.000000 -1.000000 -1.000000) to (1.000000 1.000000 1.000000)
        hierarchy     about 91.3 KiB for 1 541 items
        files         2, 0.8 KiB
          old.pbrt                         0.7 KiB
          parts/ball.pbrt                  0.0 KiB
        warnings      2
          W0604                            `old.pbrt` is in the format of an earlier version of pbrt: it is read as `pbrt --upgrade` would convert it
          W0601, line 9                    `sigma` of material `matte` has no effect: it is left out
    "#]]);
}

#[test]
fn info_is_json_for_scripts() {
    let folder = folder();
    folder.run(&["scene", "convert", "old.pbrt", "-o", "new.pbrt", "--inline"]).exits(DONE);
    let ran = folder.run(&["scene", "info", "new.pbrt", "--json", "-D", "film.xresolution=20"]);
    let ran = ran.exits(DONE);
    assert_eq!(ran.errors(), "");
    ran.prints(expect![[r#"
        {
          "scene": "new.pbrt",
          "format": "pbrt-v4",
          "camera": "perspective",
          "film": "rgb",
          "width": 20,
          "height": 8,
          "filter": "default",
          "sampler": "paddedsobol",
          "samplesPerPixel": 4,
          "integrator": "path",
          "maxDepth": 3,
          "shapes": {
            "classes": {
              "sphere": 1,
              "trianglemesh": 3
            },
            "objects": 1,
            "instances": 2,
            "triangles": 1538,
            "instancedTriangles": 1540,
            "meshBytes": 46464
          },
          "materials": {
            "diffuse": 2
          },
          "textures": {
            "bilerp": 1
          },
          "lights": {
            "point": 1
          },
          "areaLights": {
            "diffuse": 1
          },
          "emittingShapes": 1,
          "images": [],
          "bounds": [
            [
              -3.0000002,
              -1.0000001,
              -1.0000001
            ],
            [
              1.0000002,
              1.0000002,
              1.0000002
            ]
          ],
          "unboundedShapes": 0,
          "hierarchy": {
            "items": 1541,
            "bytes": 93484
          },
          "files": [
            {
              "path": "new.pbrt",
              "bytes": 130855
            }
          ],
          "warnings": []
        }
    "#]]);
}

#[test]
fn info_on_a_broken_scene_is_its_errors() {
    let folder = folder();
    folder.write(
        "broken.pbrt",
        "Camera \"perspective\"\nWorldBegin\nShape \"plymesh\" \"string filename\" \"a.ply\"\n",
    );
    let ran = folder.run(&["scene", "info", "broken.pbrt"]).exits(INPUT_AT_FAULT);
    assert_eq!(ran.output(), "");
    assert!(ran.errors().contains("error[E0601]: cannot read `a.ply`"), "{}", ran.errors());
    folder.run(&["scene", "info"]).exits(WRONG_USAGE);
}

#[test]
fn info_lists_images() {
    let folder = Folder::new("images");
    let image = rtsl_image::Image::new(4, 2).unwrap();
    let path = folder.0.path().join("a.png");
    let options = rtsl_image::ImageOptions::default();
    rtsl_image::write_image_with(&image, &[], &path, &options).unwrap();
    folder.write(
        "scene.pbrt",
        "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n\
         Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\"\n\
         Texture \"b\" \"spectrum\" \"imagemap\" \"string filename\" \"./a.png\"\n\
         Material \"diffuse\" \"texture reflectance\" \"a\"\nShape \"sphere\"\n\
         Material \"diffuse\" \"texture reflectance\" \"b\"\nShape \"sphere\"\n",
    );
    let ran = folder.run(&["scene", "info", "scene.pbrt"]).exits(DONE);
    let lines: Vec<String> = ran
        .output()
        .lines()
        .filter(|line| line.contains("a.png") || line.contains("images"))
        .map(str::to_owned)
        .collect();
    expect![[r#"
        images        1, 0.0 KiB of texels
          a.png                            4 by 2, 3 channels of 8 bits, 0.0 KiB
          a.png                            0.1 KiB"#]]
    .assert_eq(&lines.join("\n"));
}

#[test]
fn texels_in_files_give_the_same_picture() {
    let folder = Folder::new("paged");
    let mut image = rtsl_image::Image::new(64, 64).unwrap();
    for (index, pixel) in image.pixels.iter_mut().enumerate() {
        *pixel = [index as f32 / 4096.0, (index % 64) as f32 / 64.0, 0.5];
    }
    let options = rtsl_image::ImageOptions::default();
    rtsl_image::write_image_with(&image, &[], &folder.0.path().join("a.png"), &options).unwrap();
    folder.write(
        "scene.pbrt",
        "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\"\nFilm \"rgb\" \"integer xresolution\" 32 \
         \"integer yresolution\" 32\nWorldBegin\nLightSource \"infinite\"\n\
         Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\"\n\
         Material \"diffuse\" \"texture reflectance\" \"a\"\nShape \"sphere\"\n",
    );
    let render = |name: &str, more: &[&str]| {
        let arguments = [&["render", "scene.pbrt", "--spp", "4", "-o", name], more].concat();
        folder.run(&arguments).exits(DONE);
        std::fs::read(folder.0.path().join(name)).expect("the picture")
    };
    let limit = ["--texture-memory", "1KiB"];
    assert_eq!(render("memory.png", &[]), render("file.png", &limit));
    let ran = folder.run(&[&["scene", "info", "scene.pbrt"][..], &limit].concat()).exits(DONE);
    let output = ran.output();
    let line = output.lines().find(|line| line.contains("images")).unwrap_or_default();
    assert_eq!(line, "images        1, 21.3 KiB of texels, 21.3 KiB of them in temporary files");
}

#[test]
fn info_names_the_format_of_gltf_files() {
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/still-life.glb");
    let ran = Folder::new("scene").run(&["scene", "info", model]).exits(DONE);
    assert_eq!(ran.output().lines().next(), Some(&*format!("scene         {model}, glTF")));
}

/// A glTF file with a matte triangle, a point light and a camera.
const MODEL: &str = r#"{"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual"],
    "nodes": [{"mesh": 0, "scale": [2, 3, 1]}, {"camera": 0, "translation": [0.5, 0.25, 4]},
        {"translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "color": [1, 0.5, 0.25], "intensity": 200}]}},
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "aspectRatio": 1.5, "znear": 0.1}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.75, 1, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "new_files/mesh.bin"}]}"#;

/// The same radiance, but for the brightness of PNG pictures, which pbrt-v4 has in its sensor.
#[test]
fn a_converted_model_has_the_picture_of_its_file() {
    let folder = Folder::new("scene");
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|it| it.to_le_bytes()).collect();
    std::fs::create_dir(folder.0.path().join("new_files")).unwrap();
    folder.write("new_files/mesh.bin", &bytes);
    folder.write("model.gltf", MODEL);
    let ran = folder.run(&["scene", "convert", "model.gltf", "-o", "new.pbrt"]).exits(DONE);
    assert_eq!(ran.errors(), "");
    let pixels = |scene: &str| {
        let picture = ["--renderer", "batch", "--size", "12x8", "--backend", "interp"];
        let arguments = [&["render", scene, "-o", "picture.exr", "--spp", "16"], &picture[..]];
        folder.run(&arguments.concat()).exits(DONE);
        let bytes = std::fs::read(folder.0.path().join("picture.exr")).unwrap();
        let read = Picture::read(&bytes, Encoding::Linear, &InputBudget::default());
        read.expect("a picture").0.colors().collect::<Vec<_>>()
    };
    let (of_file, of_text) = (pixels("model.gltf"), pixels("new.pbrt"));
    let text = std::fs::read_to_string(folder.0.path().join("new.pbrt")).unwrap();
    let iso = text.split("\"float iso\" [ ").nth(1).and_then(|rest| rest.split(' ').next());
    let gain: f32 = iso.expect("bright lights lower it").parse::<f32>().unwrap() / 100.0;
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().sum::<f32>();
    assert!(sum(&of_file) > 1.0 && gain < 1.0);
    // Filters differ at edges alone: pixels that the surface fills, or nothing, agree.
    let near = |a: &[f32; 3], b: &[f32; 3]| {
        (0..3).all(|part| (a[part] * gain - b[part]).abs() <= 0.02 * b[part].max(0.01))
    };
    let agreeing = of_file.iter().zip(&of_text).filter(|(a, b)| near(a, b)).count();
    assert!(agreeing > 60, "{agreeing} of 96: {of_file:?} {of_text:?}");
    // A result would take the place of a file of the scene.
    folder.write("model.gltf", MODEL.replace("mesh.bin", "mesh.ply"));
    folder.write("new_files/mesh.ply", &bytes);
    folder.run(&["scene", "convert", "model.gltf", "-o", "new.pbrt"]).fails_with("E0625");
    assert_eq!(std::fs::read(folder.0.path().join("new_files/mesh.ply")).unwrap(), bytes);
}

#[test]
fn scenes_are_checked_without_being_rendered() {
    let folder = folder();
    folder.write("wrong.pbrt", "Camera \"Pinhole\"\nWorldBegin\nShape \"Spere\"\nMaterial \"Lambertian\" \"float kd\" \"x\"\n");
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/still-life.glb");
    let ran = folder.run(&["check", model]).exits(DONE);
    assert_eq!(
        ran.errors(),
        "note: the file has neither camera nor lights: all of the scene is shown in a studio\n"
    );
    let ran = folder.run(&["check", "old.pbrt", "wrong.pbrt"]).exits(INPUT_AT_FAULT);
    let errors = ran.errors();
    assert!(errors.contains("W0604") && errors.contains("E0609"), "{errors}");
    assert!(errors.ends_with(" in 2 files\n"), "{errors}");
    let ran = folder.run(&["check", "--json", "wrong.pbrt"]).exits(INPUT_AT_FAULT);
    let first = ran.output().lines().next().map(str::to_owned).unwrap_or_default();
    assert!(first.starts_with("{\"code\":\"E") && first.contains("wrong.pbrt"), "{first}");
    folder.run(&["check", "away.glb"]).exits(INPUT_AT_FAULT);
}
