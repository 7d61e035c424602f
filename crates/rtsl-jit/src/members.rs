//! Members of many objects as the leaf shape reads them.

use std::sync::Arc;

use rtsl_packet::abi::LANE_PADDING;

use crate::instance::{BufferEntries, InstanceBlock};
use crate::lanes::LaneBlock;

/// Instances of one class, by number, as a structure of arrays: for each word of the class's layout
/// an array with that word of every instance. So a vector of objects in a row is one load, wherever
/// the row starts. The block keeps the instances, and with them their buffers, alive.
pub struct MemberBlock {
    /// An array for each word. Padding past the last object makes up for any start of the last vector.
    words: LaneBlock,
    instances: Vec<Arc<InstanceBlock>>,
    /// What all instances have.
    entries: BufferEntries,
}

impl MemberBlock {
    /// The instances, numbered from 0.
    pub fn new(instances: Vec<Arc<InstanceBlock>>) -> MemberBlock {
        let arrays = instances.iter().map(|it| it.words().len()).min().unwrap_or(0);
        let mut words = LaneBlock::new(arrays, instances.len() + LANE_PADDING as usize);
        for array in 0..arrays {
            let values = instances.iter().map(|instance| instance.words()[array]);
            words.words_mut(array).iter_mut().zip(values).for_each(|(word, value)| *word = value);
        }
        let entries = BufferEntries::common(instances.iter().map(|block| &**block));
        MemberBlock { words, instances, entries }
    }

    /// The instances.
    #[inline]
    pub fn instances(&self) -> &[Arc<InstanceBlock>] {
        &self.instances
    }

    /// Words of the smallest instance.
    #[inline]
    pub(crate) fn least_words(&self) -> usize {
        self.words.components()
    }

    #[inline]
    pub(crate) fn entries(&self) -> &BufferEntries {
        &self.entries
    }

    /// The table of arrays, which kernels only read, up to the padding's end.
    #[inline]
    pub(crate) fn table(&self) -> *const *mut u32 {
        self.words.table()
    }
}

impl std::fmt::Debug for MemberBlock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "MemberBlock({} instances)", self.instances.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_one_kind_stand_in_a_row() {
        let instance = |first: u32| Arc::new(InstanceBlock::new(&[first, first + 1], Vec::new()));
        let block = MemberBlock::new((0..20).map(|number| instance(10 * number)).collect());
        assert_eq!(
            block.words.words(1)[..20],
            std::array::from_fn::<u32, 20, _>(|it| 10 * it as u32 + 1)
        );
        assert!(block.words.lanes() >= 20 + LANE_PADDING as usize);
        assert_eq!(MemberBlock::new(Vec::new()).least_words(), 0);
    }
}
