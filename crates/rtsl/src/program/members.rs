//! Members that no class declares, with their data.

use rtsl_abi::{InstanceBlock, Layout};

/// Members with their data.
#[derive(Default)]
pub(super) struct Members {
    layout: Layout,
    words: Vec<u32>,
}

impl Members {
    /// Adds a member of as many scalars as there are words.
    pub fn add(&mut self, name: &str, words: impl IntoIterator<Item = u32>) {
        self.layout.members.insert(name.to_owned(), self.words.len() as u32);
        self.words.extend(words);
    }

    /// Returns the layout of the members, and a block with their data.
    pub fn finish(self) -> (Layout, InstanceBlock) {
        let Members { mut layout, words } = self;
        layout.block_words = (words.len() as u32).next_multiple_of(2);
        (layout, InstanceBlock::new(&words, Vec::new()))
    }
}
