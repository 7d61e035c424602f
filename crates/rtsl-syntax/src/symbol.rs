//! Interned spellings.

use std::collections::HashMap;
use std::sync::Arc;

use crate::word::{Word, classify};

/// An interned spelling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Symbol(u32);

/// All spellings of a translation unit, each stored once.
#[derive(Default)]
pub(crate) struct Interner {
    symbols: HashMap<Arc<str>, Symbol>,
    entries: Vec<(Arc<str>, Word)>,
}

impl Interner {
    /// The symbol of `text`, which is added if it is new.
    pub fn intern(&mut self, text: &str) -> Symbol {
        if let Some(symbol) = self.symbols.get(text) {
            return *symbol;
        }
        let symbol = Symbol(self.entries.len() as u32);
        let shared: Arc<str> = text.into();
        self.entries.push((shared.clone(), classify(text)));
        self.symbols.insert(shared, symbol);
        symbol
    }

    /// The text of `symbol`.
    pub fn text(&self, symbol: Symbol) -> &str {
        &self.entries[symbol.0 as usize].0
    }

    /// The kind of word that `symbol` is.
    pub fn word(&self, symbol: Symbol) -> Word {
        self.entries[symbol.0 as usize].1
    }
}
