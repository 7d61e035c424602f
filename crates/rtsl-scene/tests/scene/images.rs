//! Images of scenes: decoded once, and in temporary files beyond the memory that textures may take.

use std::path::Path;
use std::sync::Arc;

use expect_test::expect;
use rtsl::Instance;
use rtsl_memory::{Amount, SharedWords};
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{LoadOptions, SceneSource};

fn write_png(path: &Path, side: u32, grey: u8) {
    let file = std::fs::File::create(path).expect("the folder is writable");
    let mut encoder = png::Encoder::new(file, side, side);
    encoder.set_color(png::ColorType::Rgb);
    let bytes = vec![grey; (3 * side * side) as usize];
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&bytes).expect("the texels");
}

/// Loads a scene with a sphere for each of these images; returns the texture of each, and the messages.
fn textures(names: &[&str], limit: Option<u64>) -> (Vec<Arc<Instance>>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    write_png(&folder.path().join("large.png"), 64, 100);
    write_png(&folder.path().join("small.png"), 16, 200);
    std::fs::copy(folder.path().join("large.png"), folder.path().join("copy.png")).expect("copied");
    let mut scene = "Camera \"perspective\"\nWorldBegin\n".to_owned();
    for (index, name) in names.iter().enumerate() {
        scene += &format!(
            "Texture \"t{index}\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\n\
             Material \"diffuse\" \"texture reflectance\" \"t{index}\"\nShape \"sphere\"\n"
        );
    }
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, scene).expect("the scene");
    let options = LoadOptions { texture_memory: limit.map(Amount), ..LoadOptions::default() };
    let loaded = SceneSource::read(&path, &DiskFiles, &options).load();
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let textures = loaded
        .scene
        .materials
        .iter()
        .map(|material| material.reference("kd").expect("it has a texture").clone());
    (textures.collect(), loaded.warnings.to_text(false))
}

fn sides(textures: &[Arc<Instance>]) -> Vec<u32> {
    textures.iter().map(|texture| texture.member("size").expect("of an image")[0]).collect()
}

#[test]
fn images_with_the_same_contents_share_their_texels() {
    let (textures, messages) = textures(&["large.png", "copy.png", "large.png", "small.png"], None);
    assert_eq!(messages, "");
    assert_eq!(sides(&textures), [64, 64, 64, 16]);
    let texels: Vec<*const u32> =
        textures.iter().map(|it| it.buffer("words").expect("of an image").as_ptr()).collect();
    assert!(texels[0] == texels[1] && texels[1] == texels[2] && texels[2] != texels[3]);
}

#[test]
fn images_beyond_the_limit_are_in_files() {
    let names = ["large.png", "small.png", "large.png"];
    let in_files = |limit: Option<u64>| {
        let (textures, messages) = textures(&names, limit);
        assert_eq!(messages, "");
        assert_eq!(sides(&textures), [64, 16, 64]);
        let words: Vec<&SharedWords> =
            textures.iter().map(|it| it.buffer("words").expect("of an image")).collect();
        assert_eq!(words[0].as_ptr(), words[2].as_ptr());
        (words[0].is_in_file(), words[1].is_in_file(), words.into_iter().cloned().collect())
    };
    // The levels of 64 by 64 texels take 21,844 bytes, those of 16 by 16 take 1,364.
    let (large, small, expected): (bool, bool, Vec<SharedWords>) = in_files(None);
    assert!(!large && !small);
    for (limit, places) in [
        (0, (true, true)),
        (2_000, (true, false)),
        (21_844, (false, true)),
        (23_208, (false, false)),
    ] {
        let (large, small, words) = in_files(Some(limit));
        assert_eq!((large, small), places, "with {limit} bytes");
        assert_eq!(words, expected);
    }
}

#[test]
fn portals_are_rectangles() {
    let messages = |portal: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.pbrt");
        let light = format!("LightSource \"infinite\" \"point3 portal\" [{portal}]");
        let scene = format!("Camera \"perspective\"\nWorldBegin\n{light}\nShape \"sphere\"\n");
        std::fs::write(&path, scene).expect("the scene");
        let mut source = SceneSource::read(&path, &DiskFiles, &LoadOptions::default());
        match source.load() {
            Ok(loaded) => loaded.scene.lights[0].light.class().name.clone(),
            Err(messages) => messages.to_text(false),
        }
    };
    assert_eq!(messages("0 0 0  1 0 0  1 2 0  0 2 0"), "PortalSky");
    for (portal, problem) in [
        ("0 0 0  1 0 0  1 1 0", "error[E0607]: `portal` takes four points"),
        ("0 0 0  1 0 0  1 1 0  0 2 0", "error[E0607]: `portal` is not a rectangle"),
        ("0 0 0  1 0 0  2 1 0  1 1 0", "error[E0607]: `portal` is not a rectangle"),
        ("0 0 0  0 0 0  0 0 0  0 0 0", "error[E0607]: `portal` is not a rectangle"),
    ] {
        let text = messages(portal);
        assert!(text.contains(problem), "{portal}: {text}");
    }
}

/// Writes an image of four floats a side, of which four are no light.
fn write_pfm(path: &Path) {
    let mut numbers = [0.25_f32; 48];
    (numbers[3], numbers[10], numbers[20], numbers[47]) =
        (-5.0, f32::INFINITY, f32::NAN, f32::NEG_INFINITY);
    let bytes = numbers.iter().flat_map(|number| number.to_le_bytes());
    std::fs::write(path, [b"PF\n4 4\n-1.0\n".to_vec(), bytes.collect()].concat()).expect("written");
}

/// Loads a scene with an image that has numbers which are no light. Returns all numbers of the buffers of lights,
/// materials and what they refer to, and the messages without the folder.
fn numbers_of(world: &str) -> (Vec<f32>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    write_pfm(&folder.path().join("sun.pfm"));
    let path = folder.path().join("scene.pbrt");
    let text = format!("Camera \"perspective\"\nWorldBegin\n{world}\n");
    std::fs::write(&path, text).expect("the scene");
    let loaded = SceneSource::read(&path, &DiskFiles, &LoadOptions::default()).load();
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let folder = format!("{}/", folder.path().display());
    let messages = loaded.warnings.to_text(false).replace(&folder, "");
    let scene = loaded.scene;
    let lights = scene.lights.iter().map(|placed| placed.light.clone());
    let mut open: Vec<Arc<Instance>> = lights.chain(scene.materials).collect();
    let mut numbers = Vec::new();
    while let Some(instance) = open.pop() {
        for name in ["words", "texels", "rows", "columns", "sums"] {
            let words = instance.buffer(name).map(|words| words.iter().copied());
            numbers.extend(words.into_iter().flatten().map(f32::from_bits));
        }
        open.extend(instance.references().iter().flatten().flatten().cloned());
    }
    (numbers, messages)
}

#[test]
fn texels_of_lights_are_light() {
    let file = "\"string filename\" \"sun.pfm\"";
    let texture = format!("Texture \"sun\" \"spectrum\" \"imagemap\" {file}\n");
    let portal = "\"point3 portal\" [-1 -1 2 1 -1 2 1 1 2 -1 1 2]";
    for world in [
        format!("LightSource \"infinite\" {file}"),
        format!("LightSource \"infinite\" {file} \"float illuminance\" 3"),
        format!("LightSource \"infinite\" {file} {portal}"),
        format!("LightSource \"goniometric\" {file} \"float power\" 3"),
        format!("LightSource \"projection\" {file} \"float power\" 3"),
        format!("AreaLightSource \"diffuse\" {file} \"float power\" 3\nShape \"sphere\""),
        // Several uses are reported once.
        format!("LightSource \"infinite\" {file}\nLightSource \"projection\" {file}"),
        format!("{texture}LightSource \"GoboLight\" \"texture image\" \"sun\""),
        format!(
            "{texture}Texture \"half\" \"spectrum\" \"scale\" \"texture tex\" \"sun\" \"float scale\" 0.5
            AreaLightSource \"Emissive\" \"texture image\" \"half\"\nShape \"sphere\""
        ),
    ] {
        let (numbers, messages) = numbers_of(&world);
        let found = "`sun.pfm` has numbers that are no light: 2 negative, 1 infinite, 1 NaN\n";
        assert!(messages.starts_with(&format!("warning[W0503]: {found}")), "{messages}");
        assert_eq!(messages.matches("warning").count(), 1, "{messages}");
        assert!(numbers.iter().any(|it| *it > 0.0), "{world}");
        assert!(numbers.iter().all(|it| it.is_finite() && *it >= 0.0), "{world}: {numbers:?}");
    }
}

#[test]
fn other_textures_keep_their_numbers() {
    let texture = "Texture \"sun\" \"spectrum\" \"imagemap\" \"string filename\" \"sun.pfm\"\n";
    let material = "Material \"diffuse\" \"texture reflectance\" \"sun\"\nShape \"sphere\"";
    let (numbers, messages) = numbers_of(&format!("{texture}{material}"));
    assert_eq!(messages, "");
    assert!(numbers.contains(&-5.0) && numbers.iter().all(|it| it.is_finite()), "{numbers:?}");
}

#[test]
fn the_file_of_a_light_is_named() {
    let (_, messages) = numbers_of("LightSource \"infinite\" \"string filename\" \"sun.pfm\"");
    expect![[r#"
        warning[W0503]: `sun.pfm` has numbers that are no light: 2 negative, 1 infinite, 1 NaN
          ┌─ scene.pbrt:3:42
          │
        3 │ LightSource "infinite" "string filename" "sun.pfm"
          │                                          ^^^^^^^^^ named here
          │
          = note: negative numbers and NaN count as 0
          = note: infinite numbers count as 65504

    "#]]
    .assert_eq(&messages);
}
