//! Materials that are too large for a kernel are errors, instead of materials that lack a method.

use std::path::PathBuf;

use rtsl_render::RenderRequest;
use rtsl_render::request::render_scene_from;
use rtsl_scene::reader::MemoryFiles;

/// A mixture of mixtures, each of which calls the methods of the next one several times.
const SCENE: &str = "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n\
    MakeNamedMaterial \"a\" \"string type\" \"OpenPbr\"\n\
    MakeNamedMaterial \"b\" \"string type\" \"StandardSurface\"\n\
    MakeNamedMaterial \"ab\" \"string type\" \"Mix\" \"material first\" \"a\" \"material second\" \"b\"\n\
    MakeNamedMaterial \"all\" \"string type\" \"Mix\" \"material first\" \"ab\" \"material second\" \"ab\"\n\
    NamedMaterial \"all\"\nShape \"sphere\"\n";

#[test]
fn a_material_that_is_too_large_is_an_error() {
    let files: MemoryFiles<Vec<u8>> =
        MemoryFiles::default().with("scene.pbrt", SCENE.as_bytes().to_vec());
    let request = RenderRequest {
        scene: PathBuf::from("scene.pbrt"),
        size: Some((4, 4)),
        samples: Some(1),
        ..RenderRequest::default()
    };
    let Err(messages) = render_scene_from(&request, &files) else { panic!("it is too large") };
    let text = messages.to_text(false);
    assert!(text.contains("E0509") && text.contains("Mix."), "{text}");
}
