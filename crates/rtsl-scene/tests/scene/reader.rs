//! The reader of scenes: accepted inputs, diagnostics of invalid ones, and robustness against any input.

use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};
use proptest::prelude::*;
use rtsl::{Diagnostics, SourceMap};
use rtsl_math::Transform;
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::Description;
use rtsl_scene::reader::{MemoryFiles, defines::apply_defines, read_scene, read_scene_within};

fn read(files: &[(&str, &str)]) -> (Description, SourceMap, Diagnostics) {
    let files =
        files.iter().map(|(path, text)| (PathBuf::from(path), (*text).to_owned())).collect();
    let mut map = SourceMap::new();
    let mut diagnostics = Diagnostics::new();
    let description =
        read_scene(Path::new("scene.pbrt"), &MemoryFiles(files), &mut map, &mut diagnostics);
    (description, map, diagnostics)
}

fn check_messages(files: &[(&str, &str)], expected: Expect) {
    let (_, map, diagnostics) = read(files);
    expected.assert_eq(&rtsl::render::all_to_text(&map, diagnostics.iter(), false));
}

#[test]
fn a_scene_is_understood() {
    let scene = r#"
LookAt 0 2 -8  0 0 0  0 1 0
Camera "Pinhole" "float fov" 40
Film "rgb" "integer xresolution" [ 64 ] "integer yresolution" [ 48 ]
WorldBegin
Texture "checks" "color" "Checker" "float size" 2
MakeNamedMaterial "floor" "string type" "Lambertian" "texture albedo" "checks"
LightSource "PointLight" "point3 position" [ 4 8 -4 ] "string name" "lamp"
AttributeBegin
  Translate 1 2 3
  NamedMaterial "floor"
  Shape "Torus" "float R" 2 "bool closed" true
AttributeEnd
Include "part.pbrt"
"#;
    let part = r#"ObjectBegin "pair" Shape "Sphere" Shape "Sphere" "uint n" 3 ObjectEnd
Scale 2 2 2 ObjectInstance "pair""#;
    let (description, map, diagnostics) = read(&[("scene.pbrt", scene), ("part.pbrt", part)]);
    assert_eq!(rtsl::render::all_to_text(&map, diagnostics.iter(), false), "");
    assert_eq!(description.shapes.len(), 1);
    assert_eq!(description.objects[0].shapes.len(), 2);
    let instance = Transform::from(description.instances[0].transform);
    assert_eq!(instance.point([1.0, 1.0, 1.0]), [2.0, 2.0, 2.0]);
    let torus = &description.entities[description.shapes[0].shape.0];
    assert_eq!(torus.transform.point([0.0; 3]), [1.0, 2.0, 3.0]);
    let floor = description.shapes[0].material.map(|material| &description.entities[material.0]);
    assert_eq!(floor.map(|floor| floor.class.as_str()), Some("Lambertian"));
    assert_eq!(description.entities[description.lights[0].0].name.as_deref(), Some("lamp"));
}

#[test]
fn several_errors_are_reported_in_one_run() {
    let scene = "Trnslate 1 2 3\nTranslate 1 2\nWorldBegin\nShape \"Sphere\" \"flaot radius\" 2\n\
        Shape \"Sphere\" \"float radius\" [1 2e999]\nNamedMaterial \"gold\"\nShape \"S\"\n\
        AttributeBegin\n";
    check_messages(
        &[("scene.pbrt", scene)],
        expect![[r#"
            error[E0604]: unknown directive `Trnslate`
              ┌─ scene.pbrt:1:1
              │
            1 │ Trnslate 1 2 3
              │ ^^^^^^^^ not a directive of the scene format
              │
              = help: did you mean this?: `Translate`

            error[E0602]: found a word, expected 3 numbers after `Translate`, of which this is number 3
              ┌─ scene.pbrt:3:1
              │
            2 │ Translate 1 2
              │ --------- for this
            3 │ WorldBegin
              │ ^^^^^^^^^^

            error[E0606]: unknown parameter type `flaot`
              ┌─ scene.pbrt:4:16
              │
            4 │ Shape "Sphere" "flaot radius" 2
              │                ^^^^^^^^^^^^^^ not a type that a parameter can have
              │
              = help: did you mean `float`?

            error[E0603]: found a number that is not finite or not well-formed, expected more numbers or `]`
              ┌─ scene.pbrt:5:34
              │
            5 │ Shape "Sphere" "float radius" [1 2e999]
              │                --------------    ^^^^^
              │                │                  
              │                for this

            error[E0612]: `AttributeBegin` without its `AttributeEnd`
              ┌─ scene.pbrt:8:1
              │
            8 │ AttributeBegin
              │ ^^^^^^^^^^^^^^ this block is never closed

            error[E0610]: unknown material `gold`
              ┌─ scene.pbrt:6:15
              │
            6 │ NamedMaterial "gold"
              │               ^^^^^^

        "#]],
    );
}

#[test]
fn a_cycle_of_includes_is_an_error() {
    check_messages(
        &[("scene.pbrt", "Include \"a/b.pbrt\""), ("a/b.pbrt", "Include \"../scene.pbrt\"")],
        expect![[r#"
            error[E0605]: `scene.pbrt` includes itself
              ┌─ a/b.pbrt:1:9
              │
            1 │ Include "../scene.pbrt"
              │         ^^^^^^^^^^^^^^^ included again here
              │
              = note: open files: scene.pbrt -> a/b.pbrt

        "#]],
    );
}

#[test]
fn files_that_include_one_another_twice_end() {
    let names: Vec<String> = (0..40).map(|index| format!("{index}.pbrt")).collect();
    let text = |index: usize| format!("Include \"{index}.pbrt\"\n").repeat(2);
    let texts: Vec<String> = (1..=40).map(text).collect();
    let mut files: Vec<(&str, &str)> =
        names.iter().map(String::as_str).zip(texts.iter().map(String::as_str)).collect();
    files.push(("40.pbrt", "Identity\n"));
    files.push(("scene.pbrt", "Include \"0.pbrt\""));
    let files = files.iter().map(|(path, text)| (PathBuf::from(path), (*text).to_owned()));
    let (files, budget) = (MemoryFiles(files.collect()), InputBudget::new(Some(Amount(4 << 20))));
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    read_scene_within(Path::new("scene.pbrt"), &files, &budget, &mut map, &mut diagnostics);
    let message = "files included more than once give more than 65536 directives";
    assert!(diagnostics.iter().any(|it| it.code.as_str() == "E0615" && it.message == message));
}

#[test]
fn a_line_of_two_megabytes_is_read() {
    let numbers = "0.25 ".repeat(400_000);
    let text = format!("WorldBegin Shape \"Mesh\" \"point3 P\" [ {numbers}0 0 ]");
    let (description, _, diagnostics) = read(&[("scene.pbrt", &text)]);
    assert!(!diagnostics.has_errors());
    assert_eq!(description.entities[0].parameters[0].values.len(), 400_002);
}

#[test]
fn definitions_set_parameters_by_name() {
    let scene = "Camera \"Pinhole\" \"float fov\" 40\nWorldBegin\n\
        LightSource \"Point\" \"string name\" \"lamp\"";
    let (mut description, mut map, mut diagnostics) = read(&[("scene.pbrt", scene)]);
    let defines = ["camera.fov=30", "lamp.color=1,2,3", "lmap.color=1", "lamp"].map(str::to_owned);
    apply_defines(&mut description, &defines, &mut map, &mut diagnostics);
    expect![[r#"
        error[E0618]: nothing in the scene is named `lmap`
          ┌─ <command line>:1:1
          │
        1 │ lmap.color=1
          │ ^^^^^^^^^^^^
          │
          = help: did you mean `lamp`?

        error[E0618]: `lamp` is not of the form `name.parameter=value`
          ┌─ <command line>:1:1
          │
        1 │ lamp
          │ ^^^^

    "#]]
    .assert_eq(&rtsl::render::all_to_text(&map, diagnostics.iter(), false));
    let parameters = description.entities.iter().flat_map(|entity| &entity.parameters);
    let values: Vec<String> =
        parameters.map(|parameter| format!("{} {:?}", parameter.name, parameter.values)).collect();
    assert_eq!(values, ["fov Numbers([30.0])", "color Numbers([1.0, 2.0, 3.0])"]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_text_brings_the_reader_down(text in "\\PC{0,200}") {
        read(&[("scene.pbrt", &text)]);
    }

    #[test]
    fn no_sequence_of_words_brings_the_reader_down(
        words in prop::collection::vec(prop::sample::select(WORDS), 0..60)
    ) {
        read(&[("scene.pbrt", &words.join(" "))]);
    }
}

const WORDS: &[&str] = &[
    "WorldBegin",
    "AttributeBegin",
    "AttributeEnd",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Shape",
    "Material",
    "MakeNamedMaterial",
    "NamedMaterial",
    "Texture",
    "LightSource",
    "AreaLightSource",
    "Attribute",
    "Include",
    "Camera",
    "Film",
    "Sampler",
    "TransformBegin",
    "TransformEnd",
    "Translate",
    "Rotate",
    "Scale",
    "LookAt",
    "Transform",
    "ConcatTransform",
    "ActiveTransform",
    "CoordinateSystem",
    "CoordSysTransform",
    "ColorSpace",
    "Option",
    "MediumInterface",
    "ReverseOrientation",
    "\"a\"",
    "\"shape\"",
    "\"scene.pbrt\"",
    "\"string type\"",
    "\"string name\"",
    "\"float x\"",
    "\"integer n\"",
    "\"bool b\"",
    "\"rgb c\"",
    "\"texture t\"",
    "[",
    "]",
    "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
    "1 2 3",
    "0 0 0",
    "-1",
    "1e30",
    "1e999",
    "true",
    "\"",
    "#",
    "\n",
    "All",
];
