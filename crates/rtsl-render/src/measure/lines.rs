//! The cost of the lines of a scene's shaders, for the rays of a picture.
//!
//! The interpreter of packet code runs the same kernels as a render, for some tiles of the picture. It counts the
//! operations of each line, with an estimate of the time for which they keep the execution units of a machine busy.

use rtsl::{Engine, EngineOptions, LineCosts, Messages, TextCosts};
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{Scene, SceneSource};

use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;
use crate::request::{LoadedScene, Prepared, RenderRequest};
use crate::schedule::render_threads::RenderThreads;
use crate::schedule::tile::{Tile, tiles_of};
use crate::schedule::tile_samples::TileSamples;

/// The greatest number of tiles that are rendered.
const TILES: usize = 48;

/// The number of tiles whose paths are traced together.
const TILES_TOGETHER: usize = 8;

/// The cost of the lines of a scene's shaders.
#[derive(Clone, Debug)]
pub struct SceneLines {
    /// The texts, the dearest first. The last one, without a name, has the work whose line is not known, if there is
    /// any.
    pub texts: Vec<TextCosts>,
    /// The number of paths, which are samples of pixels.
    pub paths: u64,
    /// Rays at a time.
    pub width: u32,
    /// Warnings of the scene.
    pub warnings: Messages,
}

impl SceneLines {
    /// Returns the title of a text: its name, or that of the work around shaders, such as rays, spaces, lights and
    /// random numbers.
    pub fn title(text: &TextCosts) -> &str {
        if text.name.is_empty() { "(renderer)" } else { &text.name }
    }

    /// Returns the estimated time of all lines, in thousandths of a cycle.
    pub fn millicycles(&self) -> u64 {
        self.texts.iter().map(TextCosts::millicycles).sum()
    }
}

/// Measures the lines of a scene on the disk. The progress of the request is ignored. The engine takes 8 rays at a time
/// if it has no width.
///
/// # Errors
/// Any error of the scene, its shaders, or the machine.
pub fn measure_lines(request: &RenderRequest<'_>) -> Result<SceneLines, Messages> {
    let costs = LineCosts::default();
    let engine = engine_of(&request.engine, &costs);
    let request = RenderRequest { engine, ..request.clone() };
    let mut loaded = LoadedScene::new(&request, &DiskFiles)?;
    loaded.choose_renderer();
    let Prepared { scene, warnings, .. } = Prepared::new(&request, loaded)?;
    let threads = RenderThreads::new(request.execution.threads)?;
    Ok(SceneLines { warnings, ..lines_of_scene(&scene, &costs, &threads)? })
}

/// Measures the lines of a scene whose classes are [traced](rtsl::CompilerOptions::traced), on an engine with this
/// record.
///
/// # Errors
/// As for [`measure_lines`].
pub fn measure_lines_of(
    scene: &Scene,
    engine: &Engine,
    costs: &LineCosts,
    threads: Option<usize>,
) -> Result<SceneLines, Messages> {
    let mut warnings = Messages::default();
    let scene = RenderScene::new(scene, engine, &[], &mut warnings, &|_| {})?;
    Ok(SceneLines { warnings, ..lines_of_scene(&scene, costs, &RenderThreads::new(threads)?)? })
}

/// Measures the lines of the scene of a source. `prepare` makes the scene what a picture of it shows.
///
/// # Errors
/// As for [`measure_lines`].
pub(crate) fn lines_of(
    source: &mut SceneSource<'_>,
    engine: EngineOptions,
    threads: Option<usize>,
    prepare: impl FnOnce(&mut Scene),
) -> Result<SceneLines, Messages> {
    let costs = LineCosts::default();
    let mut scene = source.load()?.scene;
    prepare(&mut scene);
    let (engine, _) = Engine::new(engine_of(&engine, &costs)).map_err(Messages::one)?;
    measure_lines_of(&scene, &engine, &costs, threads)
}

fn engine_of(options: &EngineOptions, costs: &LineCosts) -> EngineOptions {
    EngineOptions { costs: Some(costs.clone()), trace: None, ..options.clone() }
}

/// Renders a sample of the pixels of some tiles.
fn lines_of_scene(
    scene: &RenderScene,
    costs: &LineCosts,
    threads: &RenderThreads,
) -> Result<SceneLines, Messages> {
    let (width, height) = (scene.compiled.settings.width, scene.compiled.settings.height);
    let tiles = spread(&tiles_of(width, height));
    let groups: Vec<&[Tile]> = tiles.chunks(TILES_TOGETHER).collect();
    let errors = RuntimeErrors::default();
    // What the preparation of the scene has run, such as bounds, is no work of the picture.
    drop(costs.take());
    threads.for_each_tile(
        0..groups.len(),
        || ThreadMemory::new(scene),
        || !errors.any(),
        |memory, index| {
            let samples = |tile: &Tile| TileSamples { tile: *tile, first: 0, count: 1 };
            let samples: Vec<TileSamples> = groups[index].iter().map(samples).collect();
            PathTracer::new(scene, &errors).trace_samples(memory, &samples, None);
        },
    );
    if errors.any() {
        return Err(exhausted_budgets(&scene.compiled, &errors));
    }
    let mut texts = costs.take();
    texts.sort_by_key(|text| (text.source.is_none(), std::cmp::Reverse(text.millicycles())));
    let paths = tiles.iter().map(|tile| u64::from(tile.lanes(width, height).count_ones())).sum();
    let width = scene.compiled.width;
    Ok(SceneLines { texts, paths, width, warnings: Messages::default() })
}

/// Returns tiles from all over a picture: all of them if they are few.
fn spread(tiles: &[Tile]) -> Vec<Tile> {
    let count = tiles.len().min(TILES);
    // Multiples of the golden ratio, which fill the picture evenly whatever the length of its rows.
    let place = |index: usize| (index as f64 * 0.618_033_988_749_895).fract();
    match count == tiles.len() {
        true => tiles.to_vec(),
        false => {
            let places = (0..count).map(|index| (place(index) * tiles.len() as f64) as usize);
            let mut places: Vec<usize> = places.collect();
            places.sort_unstable();
            places.dedup();
            places.into_iter().map(|place| tiles[place]).collect()
        }
    }
}
