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
        expect![[r#"
            error[E0608]: shape `sphere` has no parameter `foo`
              ┌─ scene.pbrt:3:16
              │
            3 │ Shape "sphere" "bool foo" true
              │                ^^^^^^^^^^
              │
              = note: it has radius, zmin, zmax, phimax, alpha

            error[E0608]: material `diffuse` has no parameter `Reflectance`
              ┌─ scene.pbrt:2:20
              │
            2 │ Material "diffuse" "rgb Reflectance" [.5 .5 .5]
              │                    ^^^^^^^^^^^^^^^^^
              │
              = help: did you mean `reflectance`?

        "#]],
    );
    check(
        "Material \"Lambertian\" \"rgb Reflectance\" [.5 .5 .5]",
        expect![[r#"
        error[E0608]: `Lambertian` has no parameter `Reflectance`
          ┌─ scene.pbrt:2:23
          │
        2 │ Material "Lambertian" "rgb Reflectance" [.5 .5 .5]
          │                       ^^^^^^^^^^^^^^^^^
          │
          = note: it has kd

    "#]],
    );
    check(
        "LightSource \"spot\" \"float cone\" 3",
        expect![[r#"
        error[E0608]: light `spot` has no parameter `cone`
          ┌─ scene.pbrt:2:20
          │
        2 │ LightSource "spot" "float cone" 3
          │                    ^^^^^^^^^^^^
          │
          = note: it has I, from, to, coneangle, conedeltaangle, power, scale

    "#]],
    );
    check(
        "Shape \"trianglemesh\" \"point3 p\" [0 0 0]",
        expect![[r#"
        error[E0608]: shape `trianglemesh` has no parameter `p`
          ┌─ scene.pbrt:2:22
          │
        2 │ Shape "trianglemesh" "point3 p" [0 0 0]
          │                      ^^^^^^^^^^
          │
          = help: did you mean `P`?

    "#]],
    );
}

#[test]
fn wrong_values() {
    check(
        "Material \"diffuse\" \"string reflectance\" \"red\"\nLightSource \"spot\" \"bool I\" true",
        expect![[r#"
            error[E0610]: unknown texture `red`
              ┌─ scene.pbrt:2:41
              │
            2 │ Material "diffuse" "string reflectance" "red"
              │                                         ^^^^^

            error[E0607]: `I` is of type `color`, found truth values
              ┌─ scene.pbrt:3:29
              │
            3 │ LightSource "spot" "bool I" true
              │                    -------- ^^^^
              │                    │         
              │                    declared here

        "#]],
    );
    check(
        "Material \"mix\" \"float materials\" 3",
        expect![[r#"
        error[E0607]: `materials` of material `mix` cannot be numbers
          ┌─ scene.pbrt:2:34
          │
        2 │ Material "mix" "float materials" 3
          │                                  ^

    "#]],
    );
    check("Material \"coateddiffuse\" \"float uroughness\" -3", expect![[r#""#]]);
    check(
        "Texture \"t\" \"spectrum\" \"mix\" \"string tex1\" [\"a\" \"b\"]",
        expect![[r#"
        error[E0607]: `tex1` takes 1 names, found 2
          ┌─ scene.pbrt:2:44
          │
        2 │ Texture "t" "spectrum" "mix" "string tex1" ["a" "b"]
          │                              ------------- ^^^^^^^^^
          │                              │              
          │                              declared here

    "#]],
    );
}

#[test]
fn warnings_about_values() {
    check(
        "Material \"mix\" \"float amount\" 3\nShape \"sphere\"\nMaterial \"coateddiffuse\" \"float uroughness\" 30\nShape \"sphere\"",
        expect![[r#"
            warning[W0501]: the reference `materials` of material `mix` is used but not set
              ┌─ scene.pbrt:2:10
              │
            2 │ Material "mix" "float amount" 3
              │          ^^^^^
              │
              = note: a call through it gives the defaults of its role: black, zero
              = help: set `materials`

            warning[W0502]: the parameter `uroughness` of material `coateddiffuse` is outside of its range: 30 is not at most 1
              ┌─ scene.pbrt:4:45
              │
            4 │ Material "coateddiffuse" "float uroughness" 30
              │                                             ^^

        "#]],
    );
    check(
        "Material \"Mix\" \"float amount\" 0.5\nShape \"sphere\"",
        expect![[r#"
        warning[W0501]: the reference `first` of `Mix` is used but not set
          ┌─ scene.pbrt:2:10
          │
        2 │ Material "Mix" "float amount" 0.5
          │          ^^^^^
          │
          = note: a call through it gives the defaults of its role: black, zero
          = help: set `first`, or test it with `isSet(first)`

        warning[W0501]: the reference `second` of `Mix` is used but not set
          ┌─ scene.pbrt:2:10
          │
        2 │ Material "Mix" "float amount" 0.5
          │          ^^^^^
          │
          = note: a call through it gives the defaults of its role: black, zero
          = help: set `second`, or test it with `isSet(second)`

    "#]],
    );
}
