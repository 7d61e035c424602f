//! Messages about pbrt's entities have pbrt's names.

use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

fn check(world: &str, expected: Expect) {
    let text = format!("Camera \"perspective\" WorldBegin\n{world}\nShape \"disk\"\n");
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    let messages = match load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default()) {
        Ok(loaded) => loaded.warnings,
        Err(messages) => messages,
    };
    expected.assert_eq(&messages.to_text(false));
}

#[test]
fn unknown_parameters() {
    check(
        "Material \"diffuse\" \"rgb Reflectance\" [.5 .5 .5]\nShape \"sphere\" \"bool foo\" true",
        expect![[r#""#]],
    );
    check("Material \"Lambertian\" \"rgb Reflectance\" [.5 .5 .5]", expect![[r#""#]]);
    check("LightSource \"spot\" \"float cone\" 3", expect![[r#""#]]);
    check("Shape \"trianglemesh\" \"point3 p\" [0 0 0]", expect![[r#""#]]);
}

#[test]
fn wrong_values() {
    check(
        "Material \"diffuse\" \"string reflectance\" \"red\"\nLightSource \"spot\" \"bool I\" true",
        expect![[r#""#]],
    );
    check("Material \"mix\" \"float materials\" 3", expect![[r#""#]]);
    check("Material \"coateddiffuse\" \"float uroughness\" -3", expect![[r#""#]]);
    check("Texture \"t\" \"spectrum\" \"mix\" \"string tex1\" [\"a\" \"b\"]", expect![[r#""#]]);
}
