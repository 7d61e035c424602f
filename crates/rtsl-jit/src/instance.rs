//! The data of instances as kernels read it.

use std::sync::Arc;

use rtsl_packet::abi::BUFFER_WORDS;

/// The data of one instance in the layout of its class: members, and entries for the
/// buffers, which the block keeps alive.
pub struct InstanceBlock {
    /// Two words each, because entries of buffers hold 64-bit addresses.
    words: Vec<[u32; 2]>,
    buffers: Vec<BoundBuffer>,
}

/// A buffer bound at a place in a block.
#[derive(Clone, Debug)]
pub struct BoundBuffer {
    /// The first word of its entry in the block, even.
    pub offset: u32,
    /// Its scalars, element by element.
    pub words: Arc<[u32]>,
    /// Scalars of one element, at least 1.
    pub element_words: u32,
}

impl BoundBuffer {
    /// The number of whole elements.
    pub fn elements(&self) -> u32 {
        let elements = self.words.len() as u64 / u64::from(self.element_words.max(1));
        // Indices are i32, so no more could be reached.
        u32::try_from(elements).unwrap_or(u32::MAX).min(i32::MAX as u32)
    }
}

impl InstanceBlock {
    /// A block of `members`, the entries of buffers left out (zero), rounded up to an even number
    /// of words, with `buffers` bound.
    ///
    /// # Panics
    /// If a buffer's entry is at an odd offset or outside the block.
    pub fn new(members: &[u32], buffers: Vec<BoundBuffer>) -> InstanceBlock {
        let pairs = members.chunks(2).map(|pair| [pair[0], pair.get(1).copied().unwrap_or(0)]);
        let mut block = InstanceBlock { words: pairs.collect(), buffers };
        let words = block.words.as_flattened_mut();
        for buffer in &block.buffers {
            let offset = buffer.offset as usize;
            assert!(offset.is_multiple_of(2), "a buffer's entry is 8-byte aligned");
            let entry = &mut words[offset..offset + BUFFER_WORDS as usize];
            let address = (buffer.words.as_ptr() as u64).to_ne_bytes();
            let (low, high) = address.split_at(4);
            entry[0] = u32::from_ne_bytes(low.try_into().expect("4 bytes"));
            entry[1] = u32::from_ne_bytes(high.try_into().expect("4 bytes"));
            entry[2] = buffer.elements();
        }
        block
    }

    /// The members, with the entries of buffers as kernels see them.
    pub fn words(&self) -> &[u32] {
        self.words.as_flattened()
    }

    /// The buffers.
    pub fn buffers(&self) -> &[BoundBuffer] {
        &self.buffers
    }

    pub(crate) fn pointer(&self) -> *const u8 {
        self.words.as_ptr().cast()
    }
}

impl std::fmt::Debug for InstanceBlock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "InstanceBlock({} words, {} buffers)", self.words().len(), self.buffers.len())
    }
}

/// Instances of one class, by number: what the stream shape takes.
#[derive(Default)]
pub struct InstanceTable {
    blocks: Vec<Arc<InstanceBlock>>,
    pointers: Vec<*const u8>,
    /// The size of the smallest block.
    least_words: usize,
}

impl InstanceTable {
    /// The instances `blocks`, numbered from 0.
    pub fn new(blocks: Vec<Arc<InstanceBlock>>) -> InstanceTable {
        let pointers = blocks.iter().map(|block| block.pointer()).collect();
        let least_words = blocks.iter().map(|block| block.words().len()).min().unwrap_or(0);
        InstanceTable { blocks, pointers, least_words }
    }

    /// The instances.
    pub fn blocks(&self) -> &[Arc<InstanceBlock>] {
        &self.blocks
    }

    pub(crate) fn least_words(&self) -> usize {
        self.least_words
    }

    pub(crate) fn pointers(&self) -> *const *const u8 {
        self.pointers.as_ptr()
    }
}

// Safety: the pointers are to blocks that the table keeps alive and nobody writes to.
unsafe impl Send for InstanceTable {}
// Safety: as above.
unsafe impl Sync for InstanceTable {}
