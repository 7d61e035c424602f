//! Progress reports of a render.

use std::path::PathBuf;
use std::sync::Mutex;

use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, Progress, RenderRequest, TilesDone};
use rtsl_scene::INTERACTIVE;
use rtsl_scene::reader::MemoryFiles;

#[test]
fn steps_are_told_in_order() {
    let scene = "Camera \"Pinhole\" Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 8\n\
        WorldBegin Shape \"Sphere\" Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]\n\
        \"integer indices\" [0 1 2 2 1 3]";
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), scene.to_owned())].into());
    let told = Mutex::new(Vec::new());
    let listener = |progress: Progress| told.lock().unwrap().push(progress);
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        execution: Execution::on_threads(1),
        progress: Some(&listener),
        load: LoadOptions::with_integrator(INTERACTIVE),
        ..RenderRequest::default()
    };
    let rendered = render_scene_from(&request, &files);
    rendered.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let expected = [
        Progress::Reading,
        // The camera, the sphere, the mesh and the material.
        Progress::Compiling { shaders: 4 },
        Progress::Building { primitives: 3 },
        Progress::Rendering(TilesDone { done: 1, of: 2, skipped: 0 }),
        Progress::Rendering(TilesDone { done: 2, of: 2, skipped: 0 }),
    ];
    assert_eq!(told.into_inner().unwrap(), expected);
}
