//! Stacks for chunks that wait.

use std::cell::RefCell;

use corosensei::stack::{DefaultStack, MIN_STACK_SIZE, STACK_ALIGNMENT, Stack, StackPointer};

/// Room for the largest frames that kernels have: local arrays are limited to a quarter of it by
/// `rtsl_packet::lower::MAX_SLOT_WORDS`. Pages that are not touched take no memory.
const STACK_BYTES: usize = 1 << 20;

/// Stacks start at different places of their pages, so many bytes apart: the first cache has few places for what
/// starts at the same.
const STAGGER_BYTES: usize = 448;

/// So many different places there are.
const PLACES: usize = 16;

/// A stack of a thread, kept for its next chunk.
pub(crate) struct ChunkStack {
    stack: DefaultStack,
    /// How far below the end of its memory it starts.
    stagger: usize,
}

#[derive(Default)]
struct Kept {
    stacks: Vec<ChunkStack>,
    /// How many were made.
    made: usize,
}

impl Kept {
    fn take(&mut self) -> Option<ChunkStack> {
        self.stacks.pop().or_else(|| {
            let stagger = self.made % PLACES * STAGGER_BYTES;
            self.made += 1;
            let stack = DefaultStack::new(STACK_BYTES).ok()?;
            Some(ChunkStack { stack, stagger })
        })
    }
}

thread_local! {
    /// Stacks not in use. As many are in use as chunks are suspended, at all depths of calls from hosts.
    static KEPT: RefCell<Kept> = RefCell::default();
}

impl ChunkStack {
    /// A stack not in use; `None` if the system has none to give, or the thread is ending.
    pub fn take() -> Option<ChunkStack> {
        let take = |kept: &RefCell<Kept>| kept.borrow_mut().take();
        KEPT.try_with(take).ok().flatten()
    }

    /// Keeps it for the next.
    pub fn keep(self) {
        // A thread that is ending has no next.
        let _ = KEPT.try_with(|kept| kept.borrow_mut().stacks.push(self));
    }
}

// What is left away of a stack keeps its start aligned, and leaves nearly all of it.
const _: () = assert!(STAGGER_BYTES.is_multiple_of(STACK_ALIGNMENT));
const _: () = assert!(STACK_BYTES - PLACES * STAGGER_BYTES >= MIN_STACK_SIZE);

// Safety: it is a part of a stack, with that stack's limit and the guard page before it. Its start is as far below the
// whole one's as the assertions allow, and the whole one belongs to it alone as long as it lives. The guard page stops
// code that uses its stack page by page; that no frame is so large that it reaches past the page is what kernels answer
// for, see `STACK_BYTES`.
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
