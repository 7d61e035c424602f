//! Tiles of an image, shared out among threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::{ThreadPool, ThreadPoolBuilder};
use rtsl::{Diagnostic, diagnostic_codes as codes};

use crate::messages::Messages;
use crate::statistics::RayCounts;

use super::camera::{TILE, Tile};
use super::compiled::CompiledScene;
use super::workspace::Workspace;

/// Each level of `trace` takes some of the host's stack, in debug builds most.
const STACK_BYTES: usize = 128 << 20;

/// More threads than this are more than any machine has use for.
const MOST_THREADS: usize = 1024;

/// The tiles of an image, row by row from the top.
pub fn tiles_of(width: usize, height: usize) -> Vec<Tile> {
    let rows = (0..height).step_by(TILE);
    rows.flat_map(|y| (0..width).step_by(TILE).map(move |x| Tile { x, y })).collect()
}

/// Threads that render tiles.
pub struct RenderThreads {
    pool: ThreadPool,
}

impl RenderThreads {
    /// So many threads; as many as there are processors where `None`.
    ///
    /// # Errors
    /// If they can't be had.
    pub fn new(threads: Option<usize>) -> Result<Self, Messages> {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = threads.unwrap_or(processors).clamp(1, MOST_THREADS);
        let pool = ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES).build();
        let pool = pool.map_err(|error| {
            let message = format!("cannot start {threads} threads: {error}");
            Messages::one(Diagnostic::new(codes::SCENE_LIMIT, message))
        })?;
        Ok(RenderThreads { pool })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Calls `render` for the tiles `first..count`, in this order, each with the memory of its thread,
    /// as long as `proceed` holds. Returns the first tile that was not begun, and the rays that were
    /// traced.
    pub fn for_each_tile(
        &self,
        scene: &CompiledScene,
        (first, count): (usize, usize),
        proceed: impl Fn() -> bool + Sync,
        render: impl Fn(&mut Workspace, usize) + Sync,
    ) -> (usize, RayCounts) {
        let next = AtomicUsize::new(first);
        let work = || {
            let mut workspace = Workspace::new(scene);
            while next.load(Ordering::Relaxed) < count && proceed() {
                let tile = next.fetch_add(1, Ordering::Relaxed);
                if tile >= count {
                    break;
                }
                render(&mut workspace, tile);
            }
            workspace.rays
        };
        let rays = self.pool.broadcast(|_| work());
        let mut sum = RayCounts::default();
        rays.into_iter().for_each(|rays| sum += rays);
        (next.into_inner().min(count), sum)
    }
}
