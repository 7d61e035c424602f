//! The data of instances in the form that kernels read.

use rtsl_memory::SharedWords;

use crate::ObjectForm;
use crate::offsets::BUFFER_WORDS;

/// The data of one instance in the layout of its class: members, and entries for the
/// buffers, which the block keeps alive.
#[derive(Clone, Default)]
pub struct InstanceBlock {
    /// Pairs of words, because entries of buffers hold 64-bit addresses.
    words: Vec<[u32; 2]>,
    buffers: Vec<BoundBuffer>,
    entries: BufferEntries,
}

/// A buffer bound to an entry in a block.
#[derive(Clone, Debug)]
pub struct BoundBuffer {
    /// The first word of its entry in the block, even.
    pub offset: u32,
    /// Its scalars, element by element.
    pub words: SharedWords,
    /// The number of scalars of one element, at least 1.
    pub element_words: u32,
}

/// The entry of a buffer, and the size of its elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferEntry {
    /// The first word of its entry in the block.
    pub offset: u32,
    /// The number of scalars of one element.
    pub element_words: u32,
}

/// The buffer entries of a block, or those common to several objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct BufferEntries(Vec<BufferEntry>);

impl BufferEntries {
    /// Returns the entries in objects of the form, by words of the objects.
    pub fn in_objects(&self, form: &ObjectForm) -> BufferEntries {
        let entries = self.0.iter().filter_map(|entry| {
            let offset = form.position(entry.offset, BUFFER_WORDS)?;
            Some(BufferEntry { offset, ..*entry })
        });
        BufferEntries(entries.collect())
    }

    pub fn retain_common(&mut self, others: &BufferEntries) {
        self.0.retain(|entry| others.contains(entry));
    }

    #[inline]
    pub fn contains(&self, entry: &BufferEntry) -> bool {
        self.0.contains(entry)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl BoundBuffer {
    /// Returns the number of whole elements.
    pub fn elements(&self) -> u32 {
        let elements = self.words.len() as u64 / u64::from(self.element_words.max(1));
        // Indices are i32, so further elements could not be accessed.
        u32::try_from(elements).unwrap_or(u32::MAX).min(i32::MAX as u32)
    }
}

impl InstanceBlock {
    /// Returns a copy in which these words, none of which is of an entry of a buffer, have other values.
    pub(crate) fn with_words(&self, words: impl Iterator<Item = (u32, u32)>) -> InstanceBlock {
        let mut copy = self.clone();
        for (word, value) in words {
            copy.words[word as usize / 2][word as usize % 2] = value;
        }
        copy
    }

    /// Returns a block of `members`, with zeros in the entries of buffers, rounded up to an even number of words, with
    /// `buffers` bound.
    ///
    /// # Panics
    /// If a buffer's entry is at an odd offset, outside the block, or overlaps another.
    pub fn new(members: &[u32], buffers: Vec<BoundBuffer>) -> InstanceBlock {
        let pairs = members.chunks(2).map(|pair| [pair[0], pair.get(1).copied().unwrap_or(0)]);
        let mut offsets: Vec<u32> = buffers.iter().map(|buffer| buffer.offset).collect();
        offsets.sort_unstable();
        let apart = offsets.windows(2).all(|pair| pair[1] - pair[0] >= BUFFER_WORDS);
        assert!(apart, "entries of buffers lap over");
        let entries = buffers.iter().map(|buffer| BufferEntry {
            offset: buffer.offset,
            element_words: buffer.element_words,
        });
        let entries = BufferEntries(entries.collect());
        let mut block = InstanceBlock { words: pairs.collect(), buffers, entries };
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

    /// Returns the members, with the entries of buffers as kernels read them.
    #[inline]
    pub fn words(&self) -> &[u32] {
        self.words.as_flattened()
    }

    /// Returns the buffers.
    pub fn buffers(&self) -> &[BoundBuffer] {
        &self.buffers
    }

    #[inline]
    pub(crate) fn entries(&self) -> &BufferEntries {
        &self.entries
    }

    /// Returns the address of the first byte of the block.
    #[inline]
    pub fn pointer(&self) -> *const u8 {
        self.words.as_ptr().cast()
    }
}

impl std::fmt::Debug for InstanceBlock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "InstanceBlock({} words, {} buffers)", self.words().len(), self.buffers.len())
    }
}
