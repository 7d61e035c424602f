//! Threads that share the tiles of an image.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rtsl::{Diagnostic, Messages, diagnostic_codes as codes};
use rtsl_memory::{Amount, Pool};

/// The stack of a thread: each level of `trace` uses some of it, most in debug builds.
const STACK_BYTES: usize = 128 << 20;

/// The greatest number of threads: more have no use on any machine.
const MAX_THREADS: usize = 1024;

/// Threads that render tiles.
pub struct RenderThreads {
    count: usize,
    pool: Pool,
}

impl RenderThreads {
    /// Starts threads: as many as there are processors if `None`.
    ///
    /// # Errors
    /// If they cannot be started.
    pub fn new(threads: Option<usize>) -> Result<Self, Messages> {
        let count = wanted(threads);
        let pool = Pool::new(count, Some(STACK_BYTES));
        pool.start().map_err(|error| {
            let message = format!("cannot start {count} threads: {error}");
            Messages::one(Diagnostic::new(codes::SCENE_LIMIT, message))
        })?;
        Ok(RenderThreads { count, pool })
    }

    /// Returns the address space of the stacks of so many threads.
    pub fn stacks(threads: Option<usize>) -> Amount {
        Amount(STACK_BYTES as u64).times(wanted(threads))
    }

    /// Returns the number of threads.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Calls `render` for tiles, in their order, each with the memory of its thread, which `memory` creates, as long as
    /// `proceed` returns true. Returns the first tile that was not started, and the memories.
    pub fn for_each_tile<M: Send>(
        &self,
        tiles: Range<usize>,
        memory: impl Fn() -> M + Sync,
        proceed: impl Fn() -> bool + Sync,
        render: impl Fn(&mut M, usize) + Sync,
    ) -> (usize, Vec<M>) {
        let next = AtomicUsize::new(tiles.start);
        let work = || {
            let mut memory = memory();
            while next.load(Ordering::Relaxed) < tiles.end && proceed() {
                let tile = next.fetch_add(1, Ordering::Relaxed);
                if tile >= tiles.end {
                    break;
                }
                render(&mut memory, tile);
            }
            memory
        };
        let memories = self.pool.broadcast(work);
        (next.into_inner().min(tiles.end), memories)
    }
}

/// The number of threads to start.
fn wanted(threads: Option<usize>) -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    threads.unwrap_or(processors).clamp(1, MAX_THREADS)
}
