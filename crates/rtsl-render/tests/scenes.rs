//! The scenes of the repository give the images that they gave before, to the bit; and the same
//! bits for every width, number of threads and backend.
//!
//! References are 8-bit PNG files in `tests/images`; `UPDATE_EXPECT=1` writes them.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions};
use rtsl_render::film::{Image, ImageOptions, write_image};
use rtsl_render::{RenderRequest, RenderResult, render_scene};

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
        threads: Some(threads),
        engine,
        ..RenderRequest::default()
    };
    render_scene(&request)
        .unwrap_or_else(|messages| panic!("{}:\n{}", scene.display(), messages.to_text(false)))
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
        if read_png(&path) == Some(result.image.to_srgb(0.0)) {
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

#[test]
fn images_are_the_same_for_every_width_thread_count_and_backend() {
    for scene in scenes() {
        let image = |backend: Backend, width: u32, threads: usize| {
            let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
            bits(&render(&scene, (16, 11), 1, engine, threads).image)
        };
        let reference = image(Backend::Interpreter, 1, 2);
        // Every width for the scene that has most in it; kernels take their time in debug builds.
        let all = scene.ends_with("three-spheres.pbrt");
        let runs: &[(u32, usize)] =
            if all { &[(1, 1), (4, 2), (8, 1), (16, 2)] } else { &[(8, 2)] };
        for (width, threads) in runs.iter().copied() {
            let same = image(Backend::Auto, width, threads) == reference;
            assert!(same, "{}: width {width}, {threads} threads", scene.display());
        }
    }
}
