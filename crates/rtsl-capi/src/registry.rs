//! Ids, and what they are of.

use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use rtsl::CompiledCallback;
use slotmap::{DefaultKey, Key, KeyData, SlotMap};

use crate::engine::EngineEntry;
use crate::error::{Error, RtslResult};
use crate::instance::InstanceEntry;
use crate::kernel::KernelEntry;
use crate::objects::ObjectsEntry;
use crate::unit::UnitEntry;

/// Things by their ids. An id is never given twice, so that one that was released is found to be wrong.
pub struct Registry<T> {
    things: LazyLock<RwLock<SlotMap<DefaultKey, Arc<T>>>>,
    /// What messages call such a thing.
    name: &'static str,
}

impl<T> Registry<T> {
    const fn new(name: &'static str) -> Registry<T> {
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

// The types themselves are written out, since the header is made of the text.
macro_rules! ids {
    ($($id:ident, $registry:ident: $entry:ty = $name:literal;)*) => {$(
        impl $id {
            /// What it is of.
            pub(crate) fn get(self) -> Result<Arc<$entry>, Error> {
                $registry.get(self.id)
            }

            pub(crate) fn give(entry: $entry) -> $id {
                $id { id: $registry.insert(entry) }
            }

            pub(crate) fn release(self) -> Result<(), Error> {
                $registry.remove(self.id)
            }
        }

        static $registry: Registry<$entry> = Registry::new($name);
    )*};
}

ids! {
    RtslUnitId, UNITS: UnitEntry = "unit";
    RtslEngineId, ENGINES: EngineEntry = "engine";
    RtslInstanceId, INSTANCES: InstanceEntry = "instance";
    RtslKernelId, KERNELS: KernelEntry = "kernel";
    RtslCallbackId, CALLBACKS: CompiledCallback = "callback";
    RtslObjectsId, OBJECTS: ObjectsEntry = "objects";
}
