//! Scenes after motion give the same images with refitted trees and with rebuilt ones.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use rtsl::{Engine, EngineOptions, Messages};
use rtsl_image::Image;
use rtsl_render::Execution;
use rtsl_render::compiled::SceneBuilder;
use rtsl_render::compiled::{RenderScene, RenderSceneBuilder};
use rtsl_render::schedule::{RenderOptions, render};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, Scene, load_scene};

const HEAD: &str = r#"
LookAt 5 5 -12  5 5 0  0 1 0
Camera "Pinhole" "float fov" 60
Film "rgb" "integer xresolution" 40 "integer yresolution" 30
Sampler "stratified" "integer pixelsamples" 1
WorldBegin
LightSource "PointLight" "point3 position" [-4 20 -20] "rgb intensity" [900 900 900]
AttributeBegin Translate 0 -1 0 Shape "Plane" AttributeEnd
ObjectBegin "pair" Shape "Sphere" "float radius" 0.2 Translate 0.5 0 0 Shape "disk" "float radius" 0.3 ObjectEnd
"#;

/// A cube of spheres and instances, each translated by `shift` of its index.
fn scene(shift: impl Fn(u32) -> [f32; 3], radius: f32) -> Scene {
    let mut text = HEAD.to_owned();
    for index in 0..200 {
        let [x, y, z] = shift(index);
        let (x, y) = ((index % 10) as f32 + x, (index / 10 % 10) as f32 + y);
        let z = (index / 100) as f32 * 3.0 + z;
        let shape = match index % 5 {
            0 => "ObjectInstance \"pair\"".to_owned(),
            _ => format!("Shape \"Sphere\" \"float radius\" {radius}"),
        };
        writeln!(text, "AttributeBegin Translate {x} {y} {z} {shape} AttributeEnd").unwrap();
    }
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).scene
}

fn picture(scene: &RenderScene) -> Image {
    let options = RenderOptions { execution: Execution::on_threads(2), ..RenderOptions::default() };
    render(scene, options).unwrap_or_else(|it| panic!("{}", it.to_text(false))).rendered.image
}

/// The order of the items in the scene's tree.
fn order(scene: &RenderScene) -> Vec<u32> {
    let tree = &scene.compiled.geometry.groups[0].tree;
    tree.leaves.iter().flat_map(|leaf| leaf.items()).copied().collect()
}

/// Compiles the second scene as a successor of the first: with refitted trees, and with rebuilt ones.
fn follow(first: &Scene, second: &Scene) -> [RenderScene; 3] {
    let engine = Engine::new(EngineOptions::default()).unwrap().0;
    let mut messages = Messages::default();
    let mut build = |scene: &Scene, builder: SceneBuilder<'_>| {
        RenderSceneBuilder::new(builder).build(scene, &mut messages).unwrap()
    };
    let first = build(first, SceneBuilder::new(&engine));
    let moved = build(second, SceneBuilder::new(&engine).moved_shapes(&first.compiled));
    let built = build(second, SceneBuilder::new(&engine));
    [first, moved, built]
}

#[test]
fn a_tree_that_follows_finds_what_a_new_one_finds() {
    let wave = |index: u32| [(index % 7) as f32 * 0.04, (index % 3) as f32 * 0.1, 0.2];
    let [first, moved, built] = follow(&scene(|_| [0.0; 3], 0.3), &scene(wave, 0.35));
    assert_eq!(order(&moved), order(&first));
    assert_ne!(order(&moved), order(&built), "what was built anew would not tell");
    assert_eq!(picture(&moved), picture(&built));
    assert_ne!(picture(&moved), picture(&first));
}

#[test]
fn a_tree_that_does_not_serve_any_more_is_built_anew() {
    let scattered = |index: u32| {
        let place = |factor: u32| (index * factor % 200) as f32 / 20.0;
        [place(77), place(113), place(131)]
    };
    let [first, moved, built] = follow(&scene(|_| [0.0; 3], 0.3), &scene(scattered, 0.3));
    assert_eq!(order(&moved), order(&built));
    assert_ne!(order(&moved), order(&first));
    assert_eq!(picture(&moved), picture(&built));
}

#[test]
fn other_items_have_trees_of_their_own() {
    let mut fewer = scene(|_| [0.0; 3], 0.3);
    fewer.world.pop();
    let [_, moved, built] = follow(&scene(|_| [0.0; 3], 0.3), &fewer);
    assert_eq!(order(&moved), order(&built));
}
