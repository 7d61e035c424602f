//! The kernels of a program: all kernels for any instance, and the most recently used of those for known members.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use crate::codegen::kernel::Kernel;
use crate::codegen::variant::Variant;

/// A kernel, once it is made.
pub(crate) type KernelCell = OnceLock<Result<Arc<Kernel>, Diagnostic>>;

/// Kernels by method and variant.
#[derive(Debug, Default)]
pub(crate) struct KernelCache {
    kernels: Mutex<Kernels>,
}

type Key = (Method, Variant);

#[derive(Debug, Default)]
struct Kernels {
    for_any: BTreeMap<Key, Arc<KernelCell>>,
    /// In the order of their last use.
    for_known: VecDeque<(Key, Arc<KernelCell>)>,
}

impl KernelCache {
    /// The number of kernels for known members that are kept: a slider in a user interface makes many values.
    pub const KNOWN_LIMIT: usize = 64;

    /// Returns the cell of a kernel, a new one if the cache has none.
    pub fn cell(&self, method: Method, variant: &Variant) -> Arc<KernelCell> {
        let key = (method, variant.clone());
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if variant.known.is_empty() {
            return kernels.for_any.entry(key).or_default().clone();
        }
        let known = &mut kernels.for_known;
        let at = known.iter().position(|(other, _)| *other == key);
        let entry = at.and_then(|at| known.remove(at)).unwrap_or_else(|| (key, Arc::default()));
        let cell = entry.1.clone();
        known.push_back(entry);
        if known.len() > KernelCache::KNOWN_LIMIT {
            known.pop_front();
        }
        cell
    }
}
