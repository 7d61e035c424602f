//! Checkpoints of every kind, with changed sections under checksums that are right: they are restored or refused, and a
//! render goes on from what is restored.

use std::path::{Path, PathBuf};

use rtsl::{Engine, EngineOptions, Messages};
use rtsl_image::Aov;
use rtsl_render::Execution;
use rtsl_render::checkpoint::{Checkpoint, Numbers, Section};
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{Part, PartialRender, RenderOptions};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

use super::fuzz::cases;
use super::fuzz::mutation::Random;

const SCENE: &str = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\n\
    Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 8\n\
    Sampler \"independent\" \"integer pixelsamples\" 48\nWorldBegin\n\
    LightSource \"ConstantSky\"\nShape \"Sphere\"\n";

const TILES: std::ops::Range<usize> = 0..2;

fn scene(aovs: &[Aov]) -> RenderScene {
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), SCENE.to_owned())].into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    let engine = Engine::new(EngineOptions::default()).expect("the interpreter is always there").0;
    RenderScene::new(&loaded.scene, &engine, aovs, &mut Messages::default(), &|_| {})
        .unwrap_or_else(|it| panic!("{}", it.to_text(false)))
}

fn begun(scene: &RenderScene, first: u32, noise: Option<f32>) -> PartialRender {
    PartialRender::new(scene, first, noise).expect("there is memory")
}

fn go_on(render: &mut PartialRender, scene: &RenderScene, samples: std::ops::Range<u32>) {
    let options = RenderOptions { execution: Execution::on_threads(1), ..RenderOptions::default() };
    let part = Part { tiles: TILES, samples };
    render.render(scene, &part, options).expect("no loop is endless");
}

/// Numbers that are odd for any section.
const ODD: [f64; 10] = [
    0.0,
    -1.0,
    1.0,
    1e10,
    4_294_967_295.0,
    1.8e19,
    1e300,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];

fn change(random: &mut Random, sections: &mut Vec<Section<'static>>) {
    let (at, other) = (random.below(sections.len()), random.below(sections.len()));
    let odd = ODD[random.below(ODD.len())];
    match random.below(8) {
        0 => drop(sections.remove(at)),
        1 => sections.insert(other, sections[at].clone()),
        2 => sections.swap(at, other),
        3 => sections[at].name = sections[other].name.clone(),
        4 => sections[at].name = format!("output {odd}").into(),
        5 => {
            sections[at].numbers = match &sections[at].numbers {
                Numbers::F64(it) => Numbers::U32(it.iter().map(|it| *it as u32).collect()),
                Numbers::F32(it) => Numbers::F64(it.iter().map(|it| f64::from(*it)).collect()),
                Numbers::U32(it) => Numbers::F32(it.iter().map(|it| *it as f32).collect()),
            }
        }
        kind => {
            // One number, or all of them; or some that are missing.
            let truncated = kind == 6 && random.below(4) == 0;
            let which = random.below(3);
            fn set<T: Copy>(list: &mut Vec<T>, odd: T, which: usize, truncated: bool) {
                let length = list.len();
                match which {
                    _ if truncated => list.truncate(length / 2),
                    0 => list.fill(odd),
                    1 => list.first_mut().into_iter().for_each(|it| *it = odd),
                    _ => list.last_mut().into_iter().for_each(|it| *it = odd),
                }
            }
            match &mut sections[at].numbers {
                Numbers::F64(it) => set(it.to_mut(), odd, which, truncated),
                Numbers::F32(it) => set(it.to_mut(), odd as f32, which, truncated),
                Numbers::U32(it) => set(it.to_mut(), odd as u32, which, truncated),
            }
        }
    }
}

#[test]
fn any_checkpoint_is_restored_or_refused() {
    let all = [Aov::Distance, Aov::Object, Aov::Nodes, Aov::Albedo, Aov::Normal, Aov::Variance];
    let (plain, with_aovs) = (scene(&[]), scene(&all));
    // The scenes of the renders, their first samples, and their noises.
    let kinds = [
        (&plain, 0, None),
        (&with_aovs, 0, Some(0.01)),
        (&with_aovs, 16, None),
        (&plain, 16, None),
    ];
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for (scene, first, noise) in kinds {
        let mut seed = begun(scene, first, noise);
        go_on(&mut seed, scene, first..first + 16);
        let seed = seed.sums(scene, TILES).expect("there is memory");
        let (mut restored, mut refused) = (0, 0);
        for _ in 0..cases(60) {
            let Checkpoint { fingerprint, mut sections } =
                Checkpoint::from_bytes(&seed).expect("it was just written");
            for _ in 0..1 + random.below(2) {
                if !sections.is_empty() {
                    change(&mut random, &mut sections);
                }
            }
            let mut bytes = Vec::new();
            Checkpoint { fingerprint, sections }.write_to(&mut bytes).expect("memory takes all");
            let mut render = begun(scene, first, noise);
            match render.restore(scene, TILES, &bytes) {
                Ok(()) => {
                    restored += 1;
                    go_on(&mut render, scene, first + 16..first + 32);
                    render.rendered(scene).expect("there is memory");
                    render.sums(scene, TILES).expect("there is memory");
                }
                Err(error) => {
                    refused += 1;
                    assert!(error.to_text(false).contains("E0621"), "{}", error.to_text(false));
                }
            }
        }
        assert!(restored > 5 && refused > 5, "{restored} restored, {refused} refused");
    }
}
