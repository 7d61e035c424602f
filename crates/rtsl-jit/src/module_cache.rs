//! The modules last compiled, by what they were compiled from.
//!
//! Programs compile the same text again: a notebook runs a cell twice, an editor takes a change back, every scene of a
//! process uses some of the same materials. More than half of LLVM's time in tests of renders was for such texts. They
//! get the module that is there instead.

use std::collections::HashMap;
use std::sync::Arc;

use crate::module::Module;
use crate::module_key::ModuleKey;

/// The size of the code that is kept, in bytes: hundreds of kernels. By a simulation with the texts of the tests of
/// renders, eight times as much finds 7 % more of them.
const MAX_BYTES: usize = 16 << 20;

/// Modules of one LLVM library, compiled for this machine. Those least recently used are dropped first.
#[derive(Default)]
pub struct ModuleCache {
    kept: HashMap<ModuleKey, Kept>,
    /// The size of all modules.
    bytes: usize,
    /// The number of uses, as time.
    uses: u64,
}

struct Kept {
    module: Arc<Module>,
    last_use: u64,
}

impl ModuleCache {
    /// Returns the module of this key.
    pub fn get(&mut self, key: ModuleKey) -> Option<Arc<Module>> {
        let last_use = self.next_use();
        let kept = self.kept.get_mut(&key)?;
        kept.last_use = last_use;
        Some(kept.module.clone())
    }

    /// Keeps a module until others need its room. A module of this key that is there is replaced.
    pub fn insert(&mut self, key: ModuleKey, module: Arc<Module>) {
        self.remove(key);
        self.bytes += module.size();
        let last_use = self.next_use();
        self.kept.insert(key, Kept { module, last_use });
        while self.bytes > MAX_BYTES
            && let Some(key) = self.least_recently_used()
        {
            self.remove(key);
        }
    }

    fn remove(&mut self, key: ModuleKey) {
        if let Some(kept) = self.kept.remove(&key) {
            self.bytes -= kept.module.size();
        }
    }

    /// Found by a search through all: it takes microseconds, the compilation before it milliseconds.
    fn least_recently_used(&self) -> Option<ModuleKey> {
        self.kept.iter().min_by_key(|(_, kept)| kept.last_use).map(|(key, _)| *key)
    }

    fn next_use(&mut self) -> u64 {
        self.uses += 1;
        self.uses
    }
}
