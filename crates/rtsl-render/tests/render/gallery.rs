//! The gallery: scenes of `tests/gallery` with pictures of them by pbrt-v4, and the parameters of the format's page
//! that they have.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rtsl_image::{Encoding, Picture};
use rtsl_memory::InputBudget;
use rtsl_render::{Execution, RenderRequest, render_scene};
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{BATCH, EntityKind, LoadOptions, SceneSource};
use rtsl_testing::turns::is_long_run;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The scenes, by name.
fn scenes() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join("tests/gallery")).expect("there is a gallery");
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let mut scenes: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|it| it == "pbrt")).collect();
    scenes.sort();
    scenes
}

/// The samples per pixel, and the differences that their noise allows beyond those of [`Limits`].
struct Effort {
    samples: u32,
    mean_noise: f64,
    block_noise: f64,
}

impl Effort {
    fn new() -> Effort {
        match is_long_run() {
            true => Effort { samples: 2048, mean_noise: 0.002, block_noise: 0.02 },
            false => Effort { samples: 32, mean_noise: 0.015, block_noise: 0.12 },
        }
    }
}

/// The greatest relative differences from pbrt's picture: of the mean of a channel, and of the mean of a block of 8 by
/// 8 pixels.
#[derive(Clone, Copy)]
struct Limits {
    mean: f64,
    block: f64,
}

impl Limits {
    /// The limits of a scene: one per cent and five, unless a line of its text gives others with the reason, as in
    /// `# Differs by 0.02 in the mean and 0.1 in blocks: pbrt limits samples of four wavelengths.`
    fn of(scene: &Path) -> Limits {
        let text = std::fs::read_to_string(scene).expect("the scene is there");
        let Some(line) = text.lines().find_map(|line| line.strip_prefix("# Differs by ")) else {
            return Limits { mean: 0.01, block: 0.05 };
        };
        let numbers = line.split_whitespace().filter_map(|word| word.parse().ok());
        match numbers.collect::<Vec<f64>>()[..] {
            [mean, block, ..] => Limits { mean, block },
            _ => panic!("{}: two numbers are expected in `{line}`", scene.display()),
        }
    }
}

/// A picture in linear light, in rows from the top.
struct Pixels {
    width: usize,
    height: usize,
    colors: Vec<[f32; 3]>,
}

impl Pixels {
    fn read(path: &Path) -> Pixels {
        let bytes = std::fs::read(path)
            .unwrap_or_else(|error| panic!("no reference {}: {error}", path.display()));
        let picture = Picture::read(&bytes, Encoding::Linear, &InputBudget::new(None));
        let (picture, _) = picture.unwrap_or_else(|error| panic!("{}: {error:?}", path.display()));
        let colors = picture.colors().collect();
        Pixels { width: picture.width, height: picture.height, colors }
    }

    fn render(scene: &Path, samples: u32) -> Result<Pixels, String> {
        let request = RenderRequest {
            scene: scene.to_owned(),
            load: LoadOptions::with_integrator(BATCH),
            samples: Some(samples),
            execution: Execution::on_threads(1),
            ..RenderRequest::default()
        };
        let rendered = render_scene(&request).map_err(|messages| messages.to_text(false))?;
        let image = rendered.image;
        Ok(Pixels { width: image.width, height: image.height, colors: image.pixels })
    }

    fn mean(&self, channel: usize) -> f64 {
        let sum: f64 = self.colors.iter().map(|color| f64::from(color[channel])).sum();
        sum / self.colors.len() as f64
    }

    /// The means of whole blocks of 8 by 8 pixels.
    fn blocks(&self) -> Vec<f64> {
        const SIDE: usize = 8;
        let corners = (0..self.height / SIDE)
            .flat_map(|row| (0..self.width / SIDE).map(move |column| (row * SIDE, column * SIDE)));
        let block = |(top, left): (usize, usize)| {
            let rows = (top..top + SIDE).map(|row| row * self.width + left);
            let colors = rows.flat_map(|first| &self.colors[first..first + SIDE]);
            let sum: f64 = colors.flatten().map(|channel| f64::from(*channel)).sum();
            sum / (3 * SIDE * SIDE) as f64
        };
        corners.map(block).collect()
    }
}

/// The differences of a picture from its reference.
struct Difference {
    /// Our mean over theirs, by channel.
    means: [f64; 3],
    /// The greatest difference of a block, relative to the block's mean or to a quarter of the picture's, so that the
    /// noise of dark blocks counts less.
    block: f64,
}

impl Difference {
    fn between(ours: &Pixels, theirs: &Pixels) -> Difference {
        let means = [0, 1, 2].map(|channel| ours.mean(channel) / theirs.mean(channel));
        let floor = 0.25 * [0, 1, 2].map(|channel| theirs.mean(channel)).iter().sum::<f64>() / 3.0;
        let pairs = ours.blocks().into_iter().zip(theirs.blocks());
        let differences = pairs.map(|(ours, theirs)| (ours - theirs).abs() / theirs.max(floor));
        Difference { means, block: differences.fold(0.0, f64::max) }
    }

    fn is_within(&self, limits: Limits, effort: &Effort) -> bool {
        let mean = limits.mean + effort.mean_noise;
        self.means.iter().all(|ratio| (ratio - 1.0).abs() <= mean)
            && self.block <= limits.block + effort.block_noise
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.means;
        write!(f, "means {red:.4} {green:.4} {blue:.4}, blocks within {:.3}", self.block)
    }
}

/// Renders a scene and compares it with its reference; returns the line of the report, and true if it agrees.
fn compare(scene: &Path, effort: &Effort) -> (String, bool) {
    let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let ours = match Pixels::render(scene, effort.samples) {
        Ok(pixels) => pixels,
        Err(messages) => return (format!("{name}: {messages}"), false),
    };
    let theirs = Pixels::read(&scene.with_extension("exr"));
    if (ours.width, ours.height) != (theirs.width, theirs.height) {
        return (format!("{name}: the picture has another size than its reference"), false);
    }
    let difference = Difference::between(&ours, &theirs);
    (format!("{name}: {difference}"), difference.is_within(Limits::of(scene), effort))
}

#[test]
fn pictures_are_those_of_pbrt() {
    let (scenes, effort) = (scenes(), Effort::new());
    assert!(scenes.len() > 50, "the gallery has {} scenes", scenes.len());
    let next = AtomicUsize::new(0);
    let lines = Mutex::new(Vec::new());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(scene) = scenes.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let line = compare(scene, &effort);
                    lines.lock().expect("no thread panics while it adds a line").push(line);
                }
            });
        }
    });
    let mut lines = lines.into_inner().expect("all threads have ended");
    lines.sort();
    lines.iter().for_each(|(line, _)| println!("{line}"));
    let wrong: Vec<&str> =
        lines.iter().filter(|(_, agrees)| !agrees).map(|(line, _)| line.as_str()).collect();
    assert!(wrong.is_empty(), "these differ from pbrt's pictures:\n{}", wrong.join("\n"));
}

/// Entities of the page, or parameters of them, that no scene of the gallery has, with the reason.
const WITHOUT_SCENE: [(&str, &str); 13] = [
    (
        "Sampler pmj02bn",
        "its tables are not part of every build of pbrt; samples do not change means",
    ),
    ("Integrator path regularize", "tests of materials compare its effect with pbrt's rule"),
    ("Integrator simplevolpath", "pbrt renders no surfaces by it"),
    ("Integrator randomwalk", "the picture is that of paths"),
    ("Integrator lightpath", "the picture is that of paths"),
    ("Integrator mlt", "the picture is that of paths"),
    ("Integrator sppm", "the picture is that of paths"),
    ("Integrator ambientocclusion", "pbrt's picture has no lights"),
    ("Integrator function", "pbrt makes no picture of the scene"),
    ("Material measured", "there is no file of measurements that may be committed"),
    ("Material subsurface", "another material takes its place"),
    ("Texture ptex", "another texture takes its place"),
    ("Integrator bdpt", "further parameters only show how pbrt works"),
];

/// Returns the kinds, names and parameters of the format's page that are read, as `Shape sphere radius`.
fn page_rows() -> BTreeSet<String> {
    let page = root().join("docs/src/reference/scenes/format.md");
    let page = std::fs::read_to_string(page).expect("there is a page");
    let mut entity = String::new();
    let mut rows = BTreeSet::new();
    for line in page.lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            entity = heading.replace('`', "");
        }
        let mut columns = line.split('|').map(str::trim).skip(1);
        let (Some(declaration), Some(here)) = (columns.next(), columns.nth(1)) else { continue };
        let name = declaration.trim_matches('`').split_whitespace().next_back();
        if let Some(name) = name.filter(|_| declaration.starts_with('`') && here.contains("read")) {
            rows.insert(format!("{entity} {name}"));
        }
    }
    rows
}

/// Returns the kinds, names and parameters of all scenes of the gallery.
fn gallery_rows() -> BTreeSet<String> {
    let mut rows = BTreeSet::new();
    for scene in scenes() {
        let source = SceneSource::read(&scene, &DiskFiles, &LoadOptions::default());
        for entity in &source.description().entities {
            let kind = match entity.kind {
                EntityKind::Camera => "Camera",
                EntityKind::Film => "Film",
                EntityKind::Filter => "PixelFilter",
                EntityKind::Sampler => "Sampler",
                EntityKind::Integrator => "Integrator",
                EntityKind::Texture => "Texture",
                EntityKind::Material => "Material",
                EntityKind::AreaLight => "AreaLightSource",
                EntityKind::Light => "LightSource",
                EntityKind::Shape => "Shape",
            };
            let parameters = entity.parameters.iter();
            let names = parameters.map(|it| format!("{kind} {} {}", entity.class, it.name));
            rows.extend(names);
        }
    }
    rows
}

#[test]
fn every_parameter_that_is_read_has_a_picture() {
    let (page, gallery) = (page_rows(), gallery_rows());
    assert!(page.len() > 200, "the page has {} rows", page.len());
    let is_exempt = |row: &str| {
        WITHOUT_SCENE.iter().any(|(entity, _)| {
            row.strip_prefix(entity).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
        })
    };
    let missing: Vec<&String> =
        page.iter().filter(|row| !gallery.contains(*row) && !is_exempt(row)).collect();
    assert!(missing.is_empty(), "no scene of the gallery has\n{missing:#?}");
}
