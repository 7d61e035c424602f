//! Renders that hosts advance part by part, and scenes that they make of instances.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::{Compiler, Engine, EngineOptions, Instance, Messages, Value, library};
use rtsl_image::Aov;
use rtsl_math::Transform;
use rtsl_render::Execution;
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{Part, PartialRender, RenderOptions, render};
use rtsl_scene::load_scene;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{ComposedShape, Composer, Composition, LoadOptions, PlacedLight, Scene, Settings};

const TEXT: &str = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\n\
    Film \"rgb\" \"integer xresolution\" 20 \"integer yresolution\" 20\n\
    Sampler \"independent\" \"integer pixelsamples\" 20\nWorldBegin\n\
    LightSource \"ConstantSky\"\nShape \"Sphere\"\n";

fn engine() -> Engine {
    Engine::new(EngineOptions::default()).expect("without LLVM there is the interpreter").0
}

fn prepared(scene: &Scene) -> RenderScene {
    let aovs = [Aov::Distance, Aov::Object, Aov::Nodes];
    RenderScene::new(scene, &engine(), &aovs, &mut Messages::default(), &|_| {})
        .unwrap_or_else(|it| panic!("{}", it.to_text(false)))
}

fn loaded() -> Scene {
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), TEXT.to_owned())].into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    loaded.unwrap_or_else(|it| panic!("{}", it.to_text(false))).scene
}

fn options() -> RenderOptions<'static> {
    RenderOptions { execution: Execution::on_threads(2), ..RenderOptions::default() }
}

fn begun(scene: &RenderScene, first: u32) -> PartialRender {
    PartialRender::new(scene, first, None).expect("there is memory")
}

#[test]
fn parts_give_the_bits_of_the_whole() {
    let scene = prepared(&loaded());
    let whole = render(&scene, options()).expect("no loop is endless").rendered;
    let mut partial = begun(&scene, 0);
    assert_eq!(partial.whole(&scene), Part { tiles: 0..9, samples: 0..20 });
    // Neither samples nor tiles are parted where wavefronts or rows end.
    for (tiles, samples) in [(4..9, 0..20), (0..4, 0..3), (0..4, 3..20)] {
        let part = Part { tiles, samples };
        assert_eq!(partial.render(&scene, &part, options()).ok(), Some(false));
    }
    let rendered = partial.rendered(&scene).expect("there is memory").rendered;
    assert_eq!(rendered.image, whole.image);
    assert_eq!(rendered.aovs, whole.aovs);
    assert_eq!(rendered.rays, whole.rays);
}

#[test]
fn sums_of_later_samples_are_added_in_order() {
    let scene = prepared(&loaded());
    let of_samples = |first: u32, end: u32| {
        let mut partial = begun(&scene, first);
        let part = Part { tiles: 0..9, samples: first..end };
        partial.render(&scene, &part, options()).expect("no loop is endless");
        partial
    };
    let later = of_samples(8, 20).sums(&scene, 0..9).expect("there is memory");
    let added = |sums: &[u8]| {
        let (mut all, mut later) = (of_samples(0, 8), begun(&scene, 8));
        later.restore(&scene, 0..9, sums).expect("the sums are of this scene");
        all.add(&later, 0..9).expect("the samples follow");
        (all.rendered(&scene).expect("there is memory"), all, later)
    };
    let (sum, mut all, last) = added(&later);
    assert_eq!(
        (sum.mean_samples, added(&later).0.rendered.image),
        (20.0, sum.rendered.image.clone())
    );
    let whole = render(&scene, options()).expect("no loop is endless").rendered;
    // Sums of sums are rounded otherwise than sums of samples, in binary64.
    let pairs = sum.rendered.image.pixels.iter().zip(&whole.image.pixels);
    for (one, other) in pairs.flat_map(|(one, other)| one.iter().zip(other)) {
        assert!((one - other).abs() <= 1e-6 * other, "{one} {other}");
    }
    assert_eq!(sum.rendered.aovs[1], whole.aovs[1]);
    let problem = |done: Result<(), Messages>| done.unwrap_err().to_text(false);
    assert!(problem(all.add(&last, 0..9)).contains("tile 0 has not all samples before sample 8"));
    assert!(problem(begun(&scene, 0).restore(&scene, 0..9, &later)).contains("first sample"));
    assert!(
        problem(begun(&scene, 8).restore(&scene, 0..9, &later[..99])).contains("cannot be used")
    );
}

/// Two processes take turns with the tiles of two chains, and a third has the sums of both.
#[test]
fn tasks_that_follow_each_other_give_the_bits_of_the_whole() {
    let scene = prepared(&loaded());
    let target = Some(0.05);
    let begin = || PartialRender::new(&scene, 0, target).expect("there is memory");
    let noisy = RenderOptions { noise_target: target, ..options() };
    let whole = render(&scene, noisy).expect("no loop is endless").rendered;
    let (mut head, mut workers) = (begin(), [begin(), begin()]);
    for (chain, tiles) in [0..4, 4..9].into_iter().enumerate() {
        let mut sums: Option<Vec<u8>> = None;
        for (turn, samples) in [0..16, 16..20].into_iter().enumerate() {
            let worker = &mut workers[(chain + turn) % 2];
            // A task that was begun before and counts for nothing.
            let part = Part { tiles: tiles.clone(), samples };
            worker.clear(tiles.clone()).expect("the picture has these tiles");
            worker.render(&scene, &part, options()).expect("no loop is endless");
            worker.take_counts();
            worker.clear(tiles.clone()).expect("the picture has these tiles");
            if let Some(sums) = &sums {
                worker.restore(&scene, tiles.clone(), sums).expect("the sums are of these tiles");
            }
            worker.render(&scene, &part, options()).expect("no loop is endless");
            let made = worker.sums(&scene, tiles.clone()).expect("there is memory");
            head.restore(&scene, tiles.clone(), &made).expect("the sums are of these tiles");
            head.add_counts(&worker.take_counts());
            sums = Some(made);
        }
        assert_eq!(head.taken(&scene, tiles).ok(), Some(None));
    }
    let rendered = head.rendered(&scene).expect("there is memory").rendered;
    assert_eq!(rendered.image, whole.image);
    assert_eq!(rendered.aovs, whole.aovs);
    assert_eq!(rendered.rays, whole.rays);
    let of_others = workers[0].sums(&scene, 0..4).expect("there is memory");
    let problem = head.restore(&scene, 1..5, &of_others).unwrap_err().to_text(false);
    assert!(problem.contains("the checkpoint has tiles 0..4, the render tiles 1..5"), "{problem}");
    assert!(head.clear(3..10).is_err() && head.taken(&scene, 3..10).is_err());
}

fn instance(class: &str, arguments: Vec<(&str, Value)>) -> Arc<Instance> {
    let unit = library::unit_of_class(&Compiler::default(), class).expect("the library has it");
    Instance::new(unit.class(class).expect("its file has it"), arguments).expect("they are right")
}

#[test]
fn scenes_of_instances_are_those_of_texts() {
    let of_text = loaded();
    let settings = Settings { integrator: None, ..of_text.settings.clone() };
    let composition = Composition {
        base: None,
        settings,
        integrator: None,
        camera: Some((instance("Pinhole", Vec::new()), of_text.camera_to_world)),
        shapes: vec![ComposedShape {
            primitive: instance("Sphere", Vec::new()),
            material: None,
            emitter: None,
            alpha: None,
            transform: Transform::IDENTITY,
            reverse_orientation: false,
        }],
        lights: vec![PlacedLight {
            light: instance("ConstantSky", Vec::new()),
            transform: Transform::IDENTITY,
        }],
        ambient: [0.0; 3],
    };
    let mut composer = Composer::default();
    let composed = composer.compose(composition.clone());
    let composed = composed.unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    let image = |scene: &Scene| {
        render(&prepared(scene), options()).expect("no loop is endless").rendered.image
    };
    assert_eq!(image(&composed), image(&of_text));
    // The same parts make a scene of which a renderer keeps everything.
    let again = composer.compose(composition.clone()).expect("nothing has changed");
    assert!(again.has_same_shapes(&composed) && again.has_same_shading(&composed));
    let added = Composition { base: Some(of_text), camera: None, ..composition.clone() };
    assert_eq!(composer.compose(added).expect("parts are added").objects.len(), 2);
    let blind = Composition { camera: None, ..composition };
    let problem = composer.compose(blind).unwrap_err().to_text(false);
    assert!(problem.contains("no camera"), "{problem}");
}
