//! The names and parameters of the format, and what stands for them: text in, instances out.

use std::path::{Path, PathBuf};

use rtsl_render::Messages;
use rtsl_render::reader::MemoryFiles;
use rtsl_render::scene::{LoadOptions, Loaded, load_scene};

fn load(world: &str) -> Result<Loaded, Messages> {
    let text = format!("Camera \"perspective\"\nWorldBegin\n{world}");
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default())
}

fn loaded(world: &str) -> Loaded {
    load(world).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

#[test]
fn a_texture_or_a_number_cuts_a_shape_out() {
    let shapes = "Texture \"holes\" \"float\" \"Checker\"\n\
        Shape \"sphere\" \"texture alpha\" \"holes\"\nShape \"Plane\" \"float alpha\" 0.25\n\
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 1\nShape \"disk\"\n";
    let loaded = loaded(shapes);
    let alphas = loaded.scene.objects.iter().map(|object| object.alpha.as_ref());
    let classes: Vec<Option<&str>> =
        alphas.map(|alpha| alpha.map(|it| it.class().name.as_str())).collect();
    assert_eq!(classes, [Some("Checker"), Some("Constant"), None, None]);
    let warnings = loaded.warnings.to_text(false);
    assert_eq!(warnings.matches("warning[W0601]").count(), 1, "said once: {warnings}");
}

#[test]
fn what_cuts_a_shape_out_has_to_be_a_texture() {
    let message = |shape: &str| load(shape).unwrap_err().to_text(false);
    let unknown = message("Shape \"Sphere\" \"texture alpha\" \"holes\"\n");
    assert!(unknown.contains("unknown texture `holes`"), "{unknown}");
    let wrong = message("Shape \"Sphere\" \"bool alpha\" true\n");
    assert!(wrong.contains("`alpha` refers to a texture"), "{wrong}");
}
