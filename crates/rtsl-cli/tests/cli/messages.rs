//! Messages about command lines that new users write.

use expect_test::{Expect, expect};

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

const SCENE: &str =
    "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n";

/// Checks what a command prints to standard error, without what clap adds to it.
fn says(arguments: &[&str], code: i32, expected: Expect) {
    let folder = Folder::new("messages");
    folder.write("scene.pbrt", SCENE);
    folder.write("velvet.rtsl", "class Velvet : rt_Material;\nvoid BSDF() { }\n");
    folder.write("beam.rtsl", "class Beam : rt_Integrator;\nvoid radiance() { }\n");
    folder.write("functions.rtsl", "float half(float x) { return 0.5 * x; }\n");
    let errors = folder.run(arguments).exits(code).errors();
    let own = errors.split("\n\nUsage").next().unwrap_or(&errors);
    let own = own.split("\n\nFor more information").next().unwrap_or(own);
    expected.assert_eq(&format!("{}\n", own.trim_end()));
}

fn render(more: &[&str], code: i32, expected: Expect) {
    says(&[&["render", "scene.pbrt", "-o", "a.png"], more].concat(), code, expected);
}

#[test]
fn sizes_outside_of_the_limits_name_them() {
    for size in ["0x10", "10x0", "65537x1", "99999999999999999999x1"] {
        let folder = Folder::new("size");
        let ran = folder.run(&["render", "scene.pbrt", "-o", "a.png", "--size", size]);
        let errors = ran.exits(WRONG_USAGE).errors();
        assert!(errors.contains("a picture has 1 to 65536 columns and rows"), "{errors}");
    }
    render(
        &["--size", "10"],
        WRONG_USAGE,
        expect![[r#"
            error: invalid value '10' for '--size <WxH>': expected columns and rows, such as 1024x768
        "#]],
    );
}

#[test]
fn dashes_of_print_are_told_from_options() {
    for (written, option) in
        [("–spp", "--spp"), ("—spp", "--spp"), ("−o", "-o"), ("–-spp=4", "--spp=4")]
    {
        let folder = Folder::new("dash");
        let errors =
            folder.run(&["render", "scene.pbrt", written, "4"]).exits(WRONG_USAGE).errors();
        let expected =
            format!("error: `{written}` begins with a dash of print: write `{option}`\n");
        assert!(errors.starts_with(&expected), "{errors}");
    }
    let folder = Folder::new("dash");
    folder.write(
        "–name.rtsl",
        "class A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = 1.0; }\n",
    );
    folder.run(&["check", "–name.rtsl"]).exits(DONE);
}

#[test]
fn options_of_pixels_say_so() {
    render(
        &["--json"],
        WRONG_USAGE,
        expect![[r#"
            error: `--json` is for one pixel: give `--pixel X,Y` in place of `--output`, or write the statistics of a picture as JSON by `--stats FILE`
            help: `rtsl help` lists the commands and topics
        "#]],
    );
    render(
        &["--trace=lines"],
        WRONG_USAGE,
        expect![[r#"
            error: `--trace` is for one pixel: give `--pixel X,Y` in place of `--output`
            help: `rtsl help` lists the commands and topics
        "#]],
    );
}

#[test]
fn names_of_integrators_may_be_abbreviated_by_mistake() {
    for name in ["Norm", "norm", "Normal"] {
        let folder = Folder::new("integrator");
        folder.write("scene.pbrt", SCENE);
        let arguments = ["render", "scene.pbrt", "-o", "a.png", "--integrator", name];
        let errors = folder.run(&arguments).exits(INPUT_AT_FAULT).errors();
        assert!(errors.contains("help: did you mean `Normals`?"), "{errors}");
        assert!(errors.contains("note: known are path, volpath"), "{errors}");
    }
}

#[test]
fn shaders_are_no_scenes() {
    for role in ["Camera", "Primitive", "Texture", "Light", "Material"] {
        let folder = Folder::new("shader");
        folder.write("a.rtsl", format!("class A : rt_{role};\n"));
        let errors =
            folder.run(&["render", "a.rtsl", "-o", "a.png"]).exits(INPUT_AT_FAULT).errors();
        // The message shows a scene that can be loaded.
        let scene = errors.split("such as `").nth(1).and_then(|it| it.split("`\n").next());
        folder.write("scene.pbrt", scene.unwrap());
        folder.run(&["check", "scene.pbrt"]).exits(DONE);
    }
    says(
        &["render", "velvet.rtsl", "-o", "a.png"],
        INPUT_AT_FAULT,
        expect![[r#"
        error[E0602]: `velvet.rtsl` is a shader, not a scene
         = help: name `Velvet` in a scene beside it, such as `Camera "perspective" WorldBegin LightSource "infinite" Material "Velvet" Translate 0 0 3 Shape "sphere"`
         = help: the extension for VS Code shows previews of classes
    "#]],
    );
    says(
        &["scene", "info", "beam.rtsl"],
        INPUT_AT_FAULT,
        expect![[r#"
        error[E0602]: `beam.rtsl` is a shader, not a scene
         = help: name it for a scene beside it: `rtsl render SCENE --integrator Beam`
    "#]],
    );
    says(
        &["scene", "info", "functions.rtsl"],
        INPUT_AT_FAULT,
        expect![[r#"
        error[E0602]: `functions.rtsl` is a shader, not a scene
         = help: scenes name the classes of shaders
    "#]],
    );
}
