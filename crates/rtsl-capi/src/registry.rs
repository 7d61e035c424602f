//! Ids, and what they are of.

use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use slotmap::{DefaultKey, Key, KeyData, SlotMap};

use crate::error::{Error, RtslResult};

/// Things by their ids. An id is never given twice, so that one that was released is found to be wrong.
pub struct Registry<T> {
    things: LazyLock<RwLock<SlotMap<DefaultKey, Arc<T>>>>,
    /// What messages call such a thing.
    name: &'static str,
}

impl<T> Registry<T> {
    pub const fn new(name: &'static str) -> Registry<T> {
        Registry { things: LazyLock::new(RwLock::default), name }
    }

    pub fn insert(&self, thing: T) -> u64 {
        let mut things = self.things.write().unwrap_or_else(PoisonError::into_inner);
        things.insert(Arc::new(thing)).data().as_ffi()
    }

    pub fn get(&self, id: u64) -> Result<Arc<T>, Error> {
        let things = self.things.read().unwrap_or_else(PoisonError::into_inner);
        things.get(key(id)).cloned().ok_or_else(|| self.unknown(id))
    }

    pub fn remove(&self, id: u64) -> Result<(), Error> {
        let mut things = self.things.write().unwrap_or_else(PoisonError::into_inner);
        let removed = things.remove(key(id));
        drop(things);
        removed.map(drop).ok_or_else(|| self.unknown(id))
    }

    fn unknown(&self, id: u64) -> Error {
        let name = self.name;
        let problem = format!("{id:#x} is the id of no {name}: it was never given, or is released");
        Error::new(RtslResult::Id, problem)
    }
}

fn key(id: u64) -> DefaultKey {
    KeyData::from_ffi(id).into()
}

/// The classes of a text. 0 is the id of nothing; so for all ids.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RtslUnitId {
    /// The number.
    pub id: u64,
}

/// What makes kernels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RtslEngineId {
    /// The number.
    pub id: u64,
}

/// A class with its parameters.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RtslInstanceId {
    /// The number.
    pub id: u64,
}

/// A method, ready to be called.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RtslKernelId {
    /// The number.
    pub id: u64,
}

/// A function for packets of a host's own.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RtslCallbackId {
    /// The number.
    pub id: u64,
}

/// Many instances of one class by number.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RtslObjectsId {
    /// The number.
    pub id: u64,
}

/// Keeps the things of an id in a registry: `id!(RtslUnitId, UnitEntry, "unit")`, beside the type of the things. The ids
/// are written out above, since the header is made of the text.
macro_rules! id {
    ($id:ident, $entry:ty, $name:literal) => {
        impl $id {
            /// What it is of.
            pub(crate) fn get(self) -> Result<std::sync::Arc<$entry>, $crate::error::Error> {
                Self::registry().get(self.id)
            }

            pub(crate) fn give(entry: $entry) -> $id {
                $id { id: Self::registry().insert(entry) }
            }

            pub(crate) fn release(self) -> Result<(), $crate::error::Error> {
                Self::registry().remove(self.id)
            }

            fn registry() -> &'static $crate::registry::Registry<$entry> {
                static REGISTRY: $crate::registry::Registry<$entry> =
                    $crate::registry::Registry::new($name);
                &REGISTRY
            }
        }
    };
}

pub(crate) use id;
