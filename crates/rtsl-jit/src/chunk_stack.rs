//! Stacks for suspended chunks.

use std::cell::RefCell;

use corosensei::stack::{DefaultStack, MIN_STACK_SIZE, STACK_ALIGNMENT, Stack, StackPointer};

use crate::limits::MAX_FRAME_BYTES;

/// The room beyond the frame for host functions called on a chunk's stack: random numbers, ambient light, the number of
/// lights. A caller's thread should leave as much to kernels.
const HOST_BYTES: usize = 2 * MAX_FRAME_BYTES;

/// The granularity of stack sizes, so that a stack fits more than one kernel. Untouched pages use no memory.
const FRAME_STEP_BYTES: usize = 64 << 10;

/// The distance between the start offsets of stacks within their pages: the L1 cache has few lines for addresses with
/// the same offset.
const STAGGER_BYTES: usize = 448;

/// The number of different start offsets.
const PLACES: usize = 16;

/// A stack of a thread, kept for its next chunk.
pub(crate) struct ChunkStack {
    stack: DefaultStack,
    /// The largest frame that fits.
    frame_bytes: usize,
    /// The distance of its start from the end of its memory.
    stagger: usize,
}

#[derive(Default)]
struct Kept {
    stacks: Vec<ChunkStack>,
    /// The number of stacks made.
    made: usize,
}

impl Kept {
    fn take(&mut self, frame_bytes: usize) -> Option<ChunkStack> {
        let fitting = self.stacks.iter().rposition(|it| it.frame_bytes >= frame_bytes);
        fitting.map(|index| self.stacks.swap_remove(index)).or_else(|| self.make(frame_bytes))
    }

    fn make(&mut self, frame_bytes: usize) -> Option<ChunkStack> {
        let frame_bytes = frame_bytes.checked_next_multiple_of(FRAME_STEP_BYTES)?;
        let stagger = self.made % PLACES * STAGGER_BYTES;
        self.made += 1;
        let bytes = frame_bytes.checked_add(HOST_BYTES + stagger)?;
        let stack = DefaultStack::new(bytes).ok()?;
        Some(ChunkStack { stack, frame_bytes, stagger })
    }
}

thread_local! {
    /// The free stacks. As many are in use as chunks are suspended, at all depths of calls from hosts.
    static KEPT: RefCell<Kept> = RefCell::default();
}

impl ChunkStack {
    /// Takes a free stack for a frame of this size; `None` if the system has no memory for one. Kept stacks are reused,
    /// so a thread that has returned a stack always gets one.
    pub fn take(frame_bytes: usize) -> Option<ChunkStack> {
        let take = |kept: &RefCell<Kept>| kept.borrow_mut().take(frame_bytes);
        // A thread that is ending keeps none.
        KEPT.try_with(take).unwrap_or_else(|_| Kept::default().make(frame_bytes))
    }

    /// Returns the stack to the free ones.
    pub fn keep(self) {
        // A thread that is ending has no further chunk.
        let _ = KEPT.try_with(|kept| kept.borrow_mut().stacks.push(self));
    }
}

// The omitted part of a stack keeps its start aligned, and leaves the room for the host.
const _: () = assert!(STAGGER_BYTES.is_multiple_of(STACK_ALIGNMENT));
const _: () = assert!(HOST_BYTES >= MIN_STACK_SIZE);

// Safety: it is a part of a stack, with that stack's limit and the guard page before it. Its start is as far below the
// whole one's as the assertions allow, and it owns the whole one as long as it lives. The guard page stops code that
// uses its stack page by page, as kernels do: their frames touch each of their pages, and are no larger than the size
// for which the stack was taken.
unsafe impl Stack for ChunkStack {
    fn base(&self) -> StackPointer {
        let base = self.stack.base();
        StackPointer::new(base.get() - self.stagger).unwrap_or(base)
    }

    fn limit(&self) -> StackPointer {
        self.stack.limit()
    }

    #[cfg(windows)]
    fn teb_fields(&self) -> corosensei::stack::StackTebFields {
        self.stack.teb_fields()
    }

    #[cfg(windows)]
    fn update_teb_fields(&mut self, stack_limit: usize, guaranteed_stack_bytes: usize) {
        self.stack.update_teb_fields(stack_limit, guaranteed_stack_bytes);
    }
}
