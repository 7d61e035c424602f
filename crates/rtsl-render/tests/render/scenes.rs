//! The scenes of the repository give the images that they gave before, to the bit; and the same
//! bits for every width, number of threads and backend.
//!
//! References are 8-bit PNG files in `tests/images`; `UPDATE_EXPECT=1` writes them.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions};
use rtsl_image::{Image, ImageOptions, write_image};
use rtsl_render::{Execution, LoadOptions, RenderRequest, RenderResult, render_scene};
use rtsl_scene::{BATCH, INTERACTIVE};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn scenes() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join("scenes")).expect("there are scenes");
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut scenes: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|ending| ending == "pbrt")).collect();
    scenes.sort();
    scenes
}

fn render(
    scene: &Path,
    size: (usize, usize),
    samples: u32,
    engine: EngineOptions,
    threads: usize,
) -> RenderResult {
    let request = RenderRequest {
        scene: scene.to_owned(),
        size: Some(size),
        samples: Some(samples),
        execution: Execution::on_threads(threads),
        engine,
        ..RenderRequest::default()
    };
    rendered(&request)
}

fn rendered(request: &RenderRequest<'_>) -> RenderResult {
    render_scene(request).unwrap_or_else(|messages| {
        panic!("{}:\n{}", request.scene.display(), messages.to_text(false))
    })
}

fn read_png(path: &Path) -> Option<Vec<u8>> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).ok()?));
    let mut reader = decoder.read_info().ok()?;
    let mut bytes = vec![0; reader.output_buffer_size()?];
    reader.next_frame(&mut bytes).ok()?;
    Some(bytes)
}

#[test]
fn scenes_look_as_they_did() {
    let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images");
    let bless = std::env::var_os("UPDATE_EXPECT").is_some();
    let mut different = Vec::new();
    for scene in scenes() {
        let result = render(&scene, (96, 60), 4, EngineOptions::default(), 2);
        assert_eq!(result.statistics.dropped_samples, 0, "{}", scene.display());
        let name = scene.file_stem().unwrap_or_default();
        let path = images.join(name).with_extension("png");
        if read_png(&path) == result.image.to_srgb(0.0).ok() {
            continue;
        }
        if bless {
            std::fs::create_dir_all(&images).expect("the folder can be made");
            write_image(&result.image, &path, &ImageOptions::default())
                .expect("the reference can be written");
        } else {
            let actual = std::env::temp_dir().join(name).with_extension("actual.png");
            write_image(&result.image, &actual, &ImageOptions::default())
                .expect("the image can be written");
            different.push(format!("{} (now {})", path.display(), actual.display()));
        }
    }
    assert!(different.is_empty(), "these images changed:\n{}", different.join("\n"));
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// A combination of settings, none of which may change a bit.
#[derive(Clone, Copy, Debug)]
struct Way {
    backend: Backend,
    width: u32,
    threads: usize,
}

impl Way {
    const fn compiled(width: u32, threads: usize) -> Way {
        Way { backend: Backend::Auto, width, threads }
    }
}

const INTERPRETED: Way = Way { backend: Backend::Interpreter, width: 1, threads: 2 };

/// The number of samples of a pixel in a wavefront: those of one tile fill several shading batches.
const SAMPLES_OF_WAVE: u32 = 16;

/// Renders a scene with all these settings, and reports those that give other bits than the first.
fn compare(
    scene: &Path,
    renderer: &str,
    size: (usize, usize),
    samples: u32,
    ways: &[Way],
) -> Vec<String> {
    let image = |way: &Way| {
        let engine =
            EngineOptions { backend: way.backend, width: Some(way.width), ..Default::default() };
        let request = RenderRequest {
            scene: scene.to_owned(),
            load: LoadOptions::with_integrator(renderer),
            size: Some(size),
            samples: Some(samples),
            execution: Execution::on_threads(way.threads),
            engine,
            ..RenderRequest::default()
        };
        let result = rendered(&request);
        assert_eq!(result.statistics.dropped_samples, 0, "{}", scene.display());
        bits(&result.image)
    };
    let Some((first, others)) = ways.split_first() else { return Vec::new() };
    let expected = image(first);
    let differing = others.iter().filter(|way| image(way) != expected);
    let name = renderer;
    differing.map(|way| format!("{}, {name}: {way:?} and {first:?}", scene.display())).collect()
}

#[test]
fn images_of_the_interactive_renderer_are_the_same_for_every_width_thread_count_and_backend() {
    compare_scenes(INTERACTIVE, 0, (16, 11), 1);
}

/// Wavefronts fill shading batches.
#[test]
fn images_of_the_batch_renderer_are_the_same_for_every_width_thread_count_and_backend() {
    compare_scenes(BATCH, 1, (16, 8), SAMPLES_OF_WAVE);
}

/// Many more threads than there are processors: each is stopped wherever it is, and most find no tile left.
#[test]
fn images_are_the_same_on_64_threads() {
    let scene = root().join("scenes/meshes.pbrt");
    let ways = [Way::compiled(8, 1), Way::compiled(8, 64)];
    for renderer in [INTERACTIVE, BATCH] {
        let different = compare(&scene, renderer, (72, 40), SAMPLES_OF_WAVE, &ways);
        assert!(different.is_empty(), "{different:?}");
    }
}

/// Compares a few settings for every second scene, from the first or second on, all of them over these scenes, because
/// compiling kernels is slow in debug builds.
fn compare_scenes(renderer: &str, first: usize, size: (usize, usize), samples: u32) {
    let mut different = Vec::new();
    let widths = [1, 4, 8, 16].into_iter().cycle();
    let scenes = scenes();
    for (scene, width) in scenes.iter().skip(first).step_by(2).zip(widths) {
        let ways = [INTERPRETED, Way::compiled(width, 3)];
        different.extend(compare(scene, renderer, size, samples, &ways));
    }
    // All settings for the scene with the most features.
    let all = [
        INTERPRETED,
        Way::compiled(1, 1),
        Way::compiled(4, 2),
        Way::compiled(8, 1),
        Way::compiled(16, 3),
    ];
    let scene = root().join("scenes/three-spheres.pbrt");
    different.extend(compare(&scene, renderer, size, samples, &all));
    assert!(different.is_empty(), "these differ:\n{}", different.join("\n"));
}

#[test]
#[ignore = "takes minutes: every scene, renderer, width, backend and number of threads, at a size that fills many chunks"]
fn every_scene_has_the_same_bits_in_every_way() {
    let mut ways = vec![INTERPRETED];
    for width in [1, 4, 8, 16] {
        ways.extend([1, 2, 5].map(|threads| Way::compiled(width, threads)));
    }
    let mut different = Vec::new();
    for scene in scenes() {
        for renderer in [INTERACTIVE, BATCH] {
            different.extend(compare(&scene, renderer, (96, 72), SAMPLES_OF_WAVE, &ways));
        }
    }
    assert!(different.is_empty(), "these differ:\n{}", different.join("\n"));
}
