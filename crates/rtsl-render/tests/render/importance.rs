//! Rays whose contribution is below the scene's cutoff are not traced.

use std::path::{Path, PathBuf};

use rtsl::{Backend, Engine, EngineOptions, Messages};
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{RenderOptions, render};
use rtsl_render::{Execution, Rendered};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, Scene, load_scene};

const PIXELS: u64 = 24 * 16;
const DEPTH: u64 = 8;

/// From within a mirror all around; its factors are powers of two.
fn load(cutoff: &str, world: &str) -> Result<Scene, Messages> {
    let text = format!(
        "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16
        Sampler \"stratified\" \"integer xsamples\" 1 \"integer ysamples\" 1
        Integrator \"interactive\" \"integer maxdepth\" {DEPTH} \"float cutoff\" {cutoff}
        Camera \"Pinhole\"
        WorldBegin
        Material \"Mirror\" \"rgb kr\" [0.5 0.25 0.5]
        Shape \"Sphere\" \"float radius\" 4 \"point3 center\" [0.5 0.25 1]
        {world}"
    );
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default()).map(|it| it.scene)
}

/// Something to see, a smaller mirror, and one that passes light on.
const LAMP: &str = "
    Shape \"Sphere\" \"float radius\" 0.5 \"point3 center\" [1 0 3]
    Material \"SchlickDielectric\"
    Shape \"Sphere\" \"float radius\" 0.5 \"point3 center\" [-0.5 0 3]
    MakeNamedMaterial \"glow\" \"string type\" \"Emissive\"
    NamedMaterial \"glow\"
    Shape \"Sphere\" \"float radius\" 1 \"point3 center\" [0 1 -2]";

fn compiled(cutoff: f32, world: &str, backend: Backend, width: u32) -> RenderScene {
    let scene = load(&cutoff.to_string(), world);
    let scene = scene.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the backend is there");
    RenderScene::new(&scene, &engine, &[], &mut Messages::default(), &|_| {})
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn rendered(scene: &RenderScene, threads: usize) -> Rendered {
    let execution = Execution::on_threads(threads);
    let options = RenderOptions { execution, ..RenderOptions::default() };
    let rendered = render(scene, options);
    rendered.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).rendered
}

fn bits(rendered: &Rendered) -> Vec<u32> {
    rendered.image.pixels.iter().flatten().map(|channel| channel.to_bits()).collect()
}

#[test]
fn mirrors_end_where_too_little_would_arrive() {
    // The third reflection has the importance 0.125, which is not less.
    for (cutoff, reflections) in [(0.0, DEPTH), (0.125, 3), (0.126, 2), (1.0, 0)] {
        let scene = compiled(cutoff, "", Backend::Auto, 8);
        let rays = rendered(&scene, 1).rays;
        assert_eq!((rays.camera, rays.traced), (PIXELS, PIXELS * reflections), "{cutoff}");
    }
}

#[test]
fn the_same_rays_end_everywhere() {
    let reference = rendered(&compiled(0.03, LAMP, Backend::Interpreter, 1), 1);
    let all = rendered(&compiled(0.0, LAMP, Backend::Auto, 8), 2);
    assert!(reference.rays.traced < all.rays.traced, "some rays are not important");
    assert_ne!(bits(&reference), bits(&all));
    assert!(reference.image.pixels.iter().flatten().any(|channel| *channel > 0.0));
    for (width, threads) in [(1, 1), (4, 2), (8, 3), (16, 1)] {
        let scene = compiled(0.03, LAMP, Backend::Auto, width);
        let general = rendered(&scene, threads);
        assert_eq!(general.rays, reference.rays, "width {width}");
        assert_eq!(bits(&general), bits(&reference), "width {width}, {threads} threads");
        scene.wait_for_optimised();
        let optimised = rendered(&scene, threads);
        assert_eq!(optimised.rays, reference.rays, "width {width}, optimised");
        assert_eq!(bits(&optimised), bits(&reference), "width {width}, optimised");
    }
}

#[test]
fn a_cutoff_is_a_share() {
    for cutoff in ["-0.5", "1.5"] {
        let Err(messages) = load(cutoff, "") else { panic!("{cutoff} is taken") };
        let messages = messages.to_text(false);
        let expected = format!("error[E0615]: `cutoff` must lie between 0 and 1, found {cutoff}");
        assert!(messages.contains(&expected), "{messages}");
    }
}
