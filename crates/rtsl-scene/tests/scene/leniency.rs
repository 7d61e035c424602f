//! Texts that pbrt-v4 takes are taken, and one mistake gives one message.

use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};
use rtsl::{Diagnostics, SourceMap};
use rtsl_scene::reader::{MemoryFiles, Values, read_scene};
use rtsl_scene::{Description, LoadOptions, load_scene};

fn read(text: &str) -> (Description, String) {
    let path = PathBuf::from("scene.pbrt");
    let files = MemoryFiles([(path.clone(), text.to_owned())].into());
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    let description = read_scene(&path, &files, &mut map, &mut diagnostics);
    (description, rtsl::render::all_to_text(&map, diagnostics.iter(), false))
}

/// The first lines of messages.
fn heads(messages: &str) -> Vec<&str> {
    messages
        .lines()
        .filter(|line| line.starts_with("error") || line.starts_with("warning"))
        .collect()
}

fn check_heads(text: &str, expected: &[&str]) {
    let (_, messages) = read(text);
    assert_eq!(heads(&messages), expected, "{text}\n{messages}");
}

fn check_messages(text: &str, expected: Expect) {
    expected.assert_eq(&read(text).1);
}

#[test]
fn options_have_types_or_none() {
    for text in [
        "Option \"disablepixeljitter\" true",
        "Option \"bool disablepixeljitter\" true",
        "Option \"bool disable_PixelJitter\" [ \"true\" ]",
    ] {
        let (description, messages) = read(text);
        assert!(description.options.disable_pixel_jitter, "{text}");
        assert_eq!(messages, "");
    }
    assert_eq!(read("Option \"seed\" 7").0.options.seed, Some(7));
    for silent in ["\"rendercoordsys\" \"world\"", "\"pixelstats\" true", "\"forcediffuse\" false"]
    {
        check_heads(&format!("Option {silent}"), &[]);
    }
    check_heads(
        "Option \"forcediffuse\" true\nOption \"seed\" 1.5\nOption \"disablepixeljiter\" true\n",
        &[
            "warning[W0601]: option `forcediffuse` is not supported: surfaces keep their materials",
            "error[E0607]: option `seed` takes one whole number",
            "warning[W0601]: unknown option `disablepixeljiter`: it has no effect",
        ],
    );
}

#[test]
fn the_last_of_repeated_parameters_counts() {
    let (description, _) = read("WorldBegin Shape \"a\" \"float r\" 1 \"float s\" 2 \"float r\" 3");
    let parameters = &description.entities[0].parameters;
    let values: Vec<_> = parameters.iter().map(|it| (it.name.as_str(), &it.values)).collect();
    let number = |value: f64| Values::Numbers(vec![value]);
    assert_eq!(values, [("s", &number(2.0)), ("r", &number(3.0))]);
    check_messages(
        "WorldBegin Shape \"a\" \"float r\" 1 \"float r\" 3",
        expect![[r#"
            warning[W0601]: parameter `r` is given twice: the last one counts
              ┌─ scene.pbrt:1:22
              │
            1 │ WorldBegin Shape "a" "float r" 1 "float r" 3
              │                      ^^^^^^^^^   --------- given again here
              │                      │            
              │                      ignored

        "#]],
    );
    let (description, messages) = read(
        "WorldBegin Attribute \"shape\" \"float r\" 1 Attribute \"shape\" \"float r\" 2 Shape \"a\"",
    );
    assert_eq!(description.entities[0].parameters.len(), 1);
    assert_eq!(description.entities[0].parameters[0].values, number(2.0));
    assert_eq!(messages, "");
}

#[test]
fn the_last_of_repeated_settings_counts() {
    let text =
        "Camera \"one\" Film \"one\" Sampler \"one\" Integrator \"one\" PixelFilter \"one\"\n";
    let (description, messages) = read(&format!("{text}{}", text.replace("one", "two")));
    let Description { camera, film, sampler, integrator, filter, entities, .. } = description;
    for id in [camera, film, sampler, integrator, filter] {
        assert_eq!(entities[id.unwrap().0].class, "two");
    }
    assert_eq!(heads(&messages).len(), 5, "{messages}");
    assert!(messages.contains("the scene has a second `Film`, which replaces the first"));
}

#[test]
fn objects_may_be_defined_after_their_instances() {
    let (description, messages) = read(
        "WorldBegin ObjectInstance \"b\" ObjectInstance \"a\"\n\
         ObjectBegin \"a\" Shape \"s\" ObjectEnd ObjectBegin \"b\" Shape \"s\" ObjectEnd\n",
    );
    let objects: Vec<u32> = description.instances.iter().map(|it| it.object).collect();
    assert_eq!((objects, messages.as_str()), (vec![1, 0], ""));
    check_heads(
        "WorldBegin ObjectInstance \"tree\" ObjectInstance \"tree\"",
        &["error[E0610]: unknown object `tree`"],
    );
    check_heads(
        "WorldBegin ObjectBegin \"a\" ObjectBegin \"b\" ObjectEnd ObjectInstance \"c\" ObjectEnd\n\
         ObjectBegin \"a\" Shape \"s\" ObjectEnd ObjectInstance \"a\"\n",
        &[
            "error[E0612]: an object is defined inside another object",
            "error[E0612]: an instance is placed inside the definition of an object",
            "error[E0611]: object `a` is defined twice",
        ],
    );
}

#[test]
fn media_are_said_once() {
    check_heads(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 1 1]\n\
         MediumInterface \"\" \"fog\"\nCamera \"perspective\"\nWorldBegin\n\
         Attribute \"medium\" \"float g\" 0.5\nMediumInterface \"fog\"\nShape \"sphere\"\n",
        &[
            "warning[W0601]: participating media are not supported: the scene is rendered without them",
        ],
    );
}

#[test]
fn accelerators_change_no_picture() {
    check_heads("Accelerator \"kdtree\" \"integer maxprims\" 4", &[]);
}

#[test]
fn colours_of_other_spaces_are_converted() {
    let color = |text: &str| {
        let (description, messages) = read(text);
        assert_eq!(messages, "");
        match &description.entities.last().unwrap().parameters[0].values {
            Values::Numbers(numbers) => numbers.clone(),
            values => panic!("{values:?}"),
        }
    };
    let light = "LightSource \"infinite\" \"rgb L\" [0.5 0.5 0.5]";
    let [red, _, blue] = color(&format!("WorldBegin ColorSpace \"aces2065-1\" {light}"))[..] else {
        panic!()
    };
    assert!(red > 0.51 && blue < 0.48, "{red} {blue}");
    let material = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]";
    for component in color(&format!("ColorSpace \"aces2065-1\" {material}")) {
        assert!((component - 0.5).abs() < 1e-9);
    }
    let red = "Material \"diffuse\" \"rgb reflectance\" [0.5 0 0]";
    let wide = color(&format!("WorldBegin ColorSpace \"rec2020\" {red}"));
    assert!(wide[0] > 0.8 && wide[1] == 0.0, "{wide:?}");
    // The space belongs to the graphics state.
    let blocks = "WorldBegin AttributeBegin ColorSpace \"rec2020\" AttributeEnd";
    assert_eq!(color(&format!("{blocks} {red}")), [0.5, 0.0, 0.0]);
    check_heads(
        "ColorSpace \"rec2021\"",
        &["error[E0614]: `ColorSpace`: `rec2021` is not supported"],
    );
}

#[test]
fn one_mistake_gives_one_message() {
    check_heads(
        "WorldBegin\nMakeNamedMaterial \"m\" \"strng type\" \"diffuse\"\n\
         NamedMaterial \"m\" Shape \"a\" NamedMaterial \"m\" Shape \"b\"\n\
         NamedMaterial \"n\" Shape \"a\" Shape \"b\"\nShape \"c\" \"float\" 1 [ 2\nShape \"d\"\n",
        &[
            "error[E0606]: unknown parameter type `strng`",
            "error[E0606]: `float` does not declare a parameter, expected a type and a name",
            "error[E0610]: unknown material `n`",
        ],
    );
    check_heads(
        "WorldBegin ObjectBegin Shape \"a\" ObjectEnd Shape \"b\"",
        &["error[E0602]: found a word, expected a quoted name after `ObjectBegin`"],
    );
}

fn load(text: &str) -> String {
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text.to_owned())].into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    match loaded {
        Ok(loaded) => loaded.warnings.to_text(false),
        Err(messages) => messages.to_text(false),
    }
}

#[test]
fn one_mistake_gives_one_message_when_loading() {
    let use_ = "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"\n";
    let broken = load(&format!(
        "Camera \"perspective\"\nWorldBegin\nTexture \"t\" \"spectrum\" \"scale\" \"flot scale\" 1\n{use_}{use_}"
    ));
    assert_eq!(heads(&broken), ["error[E0606]: unknown parameter type `flot`"], "{broken}");
    let unknown = load(&format!("Camera \"perspective\"\nWorldBegin\n{use_}{use_}"));
    assert_eq!(heads(&unknown), ["error[E0610]: unknown texture `t`"], "{unknown}");
    let camera = load("Camera \"perspective\" \"fov\" 40\nWorldBegin\nShape \"sphere\"\n");
    assert_eq!(heads(&camera).len(), 1, "{camera}");
}

/// References by the parameters of the format find the texture of their type, wherever it is defined; those of other
/// parameters find the first.
#[test]
fn references_find_the_texture_of_their_type() {
    let (description, messages) = read(
        "WorldBegin Material \"conductor\" \"texture eta\" \"t\" \"texture roughness\" \"t\" \"texture mine\" \"t\"
        Texture \"t\" \"float\" \"constant\" Texture \"t\" \"spectrum\" \"constant\"
        Texture \"t (spectrum)\" \"float\" \"constant\"
        Texture \"u\" \"float\" \"mix\" \"texture tex1\" \"t\" \"texture amount\" \"t\"
        Texture \"v\" \"spectrum\" \"mix\" \"texture tex1\" \"t\" \"texture amount\" \"t\"
        Shape \"sphere\" \"texture alpha\" \"t\"",
    );
    let references = description.entities.iter().flat_map(|entity| &entity.parameters);
    let references: Vec<_> = references.map(|it| (it.name.as_str(), it.values.clone())).collect();
    let text = |name: &str| Values::Texts(vec![name.to_owned()]);
    let colours = "t (spectrum)'";
    let expected = [
        ("eta", text(colours)),
        ("roughness", text("t")),
        ("mine", text("t")),
        ("tex1", text("t")),
        ("amount", text("t")),
        ("tex1", text(colours)),
        ("amount", text("t")),
        ("alpha", text("t")),
    ];
    assert_eq!((&*references, messages.as_str()), (expected.as_slice(), ""));
    let names = description.entities.iter().filter_map(|entity| entity.name.as_deref());
    let names: Vec<&str> = names.collect();
    assert_eq!(names, ["t", colours, "t (spectrum)", "u", "v"]);
}

#[test]
fn textures_for_numbers_and_for_colours_may_share_a_name() {
    let both = "Texture \"t\" \"float\" \"constant\"\nTexture \"t\" \"spectrum\" \"constant\"\n";
    check_heads(both, &[]);
    check_heads(
        &both.replace("spectrum", "float"),
        &["error[E0611]: texture `t` is defined twice"],
    );
}

#[test]
fn commas_between_numbers_are_blanks() {
    let (description, messages) = read(
        "LookAt 0, 0, -5,  0, 0, 0,  0, 1, 0\nCamera \"perspective\" \"float fov\" [ 40, ]\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [ 1, 0.5,.25 ]",
    );
    assert_eq!(messages, "");
    let values = &description.entities[1].parameters[0].values;
    assert_eq!(*values, Values::Numbers(vec![1.0, 0.5, 0.25]));
}

/// The files of a folder, whose scene names others as on Windows.
#[test]
fn backslashes_in_names_of_files_are_slashes() {
    let scene = "Camera \"perspective\"\nWorldBegin\nInclude \"parts\\top.pbrt\"\n\
                 Include \"..\\scenes\\new\\base.pbrt\"\n";
    let mesh = "Shape \"plymesh\" \"string filename\" \"parts\\mesh.ply\"\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 0 1 0 0 0 1 0 3 0 1 2\n";
    let files = MemoryFiles::<String>::default()
        .with("scenes/scene.pbrt", scene)
        .with("scenes/parts/top.pbrt", mesh)
        .with("scenes/new/base.pbrt", "Shape \"sphere\"\n")
        .with("scenes/parts/mesh.ply", ply);
    let path = Path::new("scenes/scene.pbrt");
    let loaded = load_scene(path, &files, &LoadOptions::default()).expect("it has no errors");
    assert_eq!(loaded.scene.objects.len(), 2);
    let warnings = loaded.warnings.to_text(false);
    let expected = ["warning[W0606]: backslashes in the names of files count as slashes"];
    assert_eq!(heads(&warnings), expected, "{warnings}");
}

#[test]
fn faults_without_effect_are_said_once() {
    let text = "Camera \"perspective\"\nWorldBegin\nAttributeBegin\nScale 1 0 1\n\
                Shape \"sphere\"\nShape \"sphere\"\nAttributeEnd\nShape \"sphere\"\n";
    let warnings = load(text);
    let expected = ["warning[W0606]: shapes that their transform flattens are left out"];
    assert_eq!(heads(&warnings), expected, "{warnings}");
    let flat = "ObjectBegin \"a\" Shape \"sphere\" ObjectEnd Scale 0 0 0 ObjectInstance \"a\"";
    check_heads(&format!("WorldBegin {flat} {flat}").replacen("\"a\"", "\"b\"", 2), &expected);
    check_heads(
        "Scale 0 1 1 Camera \"perspective\"",
        &["error[E0613]: the current transform has no inverse: it flattens what it places"],
    );
}

/// Files with marks before their texts are read, and those in UTF-16 are named.
#[test]
fn encodings_of_texts() {
    let scene = "Camera \"perspective\"\nWorldBegin\nInclude \"part.pbrt\"\n";
    let part = "Shape \"sphere\"\nLightSource \"infinite\" \"spectrum L\" \"white.spd\"\n";
    let marked = |text: &str| format!("\u{feff}{text}").into_bytes();
    let wide = |text: &str| -> Vec<u8> {
        format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect()
    };
    let load = |part: Vec<u8>, spectrum: Vec<u8>| {
        let files = MemoryFiles::<Vec<u8>>::default()
            .with("scene.pbrt", marked(scene))
            .with("part.pbrt", part)
            .with("white.spd", spectrum);
        let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
        loaded.map_or_else(|errors| errors.to_text(false), |it| it.warnings.to_text(false))
    };
    let spectrum = "400 1\n700 1\n# caf\u{e9}\n";
    assert_eq!(load(marked(part), marked(spectrum)), "");
    expect![[r#"
        error[E0601]: cannot read `part.pbrt`: it is in UTF-16: save it as UTF-8
          ┌─ scene.pbrt:3:9
          │
        3 │ Include "part.pbrt"
          │         ^^^^^^^^^^^ named here

    "#]]
    .assert_eq(&load(wide(part), marked(spectrum)));
    expect![[r#"
        error[E0607]: `L` is not a spectrum: it is in UTF-16: save it as UTF-8
          ┌─ part.pbrt:2:37
          │
        2 │ LightSource "infinite" "spectrum L" "white.spd"
          │                                     ^^^^^^^^^^^

    "#]]
    .assert_eq(&load(marked(part), wide(spectrum)));
}
