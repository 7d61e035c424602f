//! The scalars of instances as words.

use std::collections::BTreeMap;

use rtsl_memory::SharedWords;

/// Words by the names of their variables: `center`, `s.a`.
pub(crate) type Leaves = BTreeMap<String, Words>;

/// The scalars of one variable, as they are in memory.
#[derive(Clone, Debug)]
pub(crate) enum Words {
    /// Words of this instance.
    Owned(Vec<u32>),
    /// Words of the host, which other instances may share.
    Shared(SharedWords),
}

impl Words {
    pub(crate) fn as_slice(&self) -> &[u32] {
        match self {
            Words::Owned(words) => words,
            Words::Shared(words) => words,
        }
    }

    pub(crate) fn into_shared(self) -> SharedWords {
        match self {
            Words::Owned(words) => words.into(),
            Words::Shared(words) => words,
        }
    }
}
