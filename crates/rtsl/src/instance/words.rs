//! The scalars of instances as words.

use std::collections::BTreeMap;
use std::sync::Arc;

/// Words by the name of their place: `center`, `s.a`.
pub(crate) type Leaves = BTreeMap<String, Words>;

/// The scalars of one place, as they lie in memory.
#[derive(Clone, Debug)]
pub(crate) enum Words {
    /// Made here.
    Owned(Vec<u32>),
    /// The host's, which other instances may share.
    Shared(Arc<[u32]>),
}

impl Words {
    pub(crate) fn as_slice(&self) -> &[u32] {
        match self {
            Words::Owned(words) => words,
            Words::Shared(words) => words,
        }
    }

    pub(crate) fn into_shared(self) -> Arc<[u32]> {
        match self {
            Words::Owned(words) => words.into(),
            Words::Shared(words) => words,
        }
    }
}
