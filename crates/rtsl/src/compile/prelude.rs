//! The prelude, parsed and checked once per process.

use std::sync::LazyLock;

use rtsl_source::{Diagnostics, SourceMap};
use rtsl_syntax::NoIncludes;

use super::library_file::PRELUDE;

/// The checked prelude and the map of its files. The map of every compilation starts with them, so that spans may refer
/// to the prelude.
pub(crate) struct Prelude {
    pub sources: SourceMap,
    pub checked: rtsl_sema::check::Prelude,
    /// The errors of the prelude: none, as a test ensures.
    pub diagnostics: Diagnostics,
}

/// Returns the number of the prelude's files, which are the first of every compilation.
pub(crate) fn prelude_files() -> usize {
    PRELUDE.len()
}

/// Returns the prelude; the first call checks it.
pub(crate) fn prelude() -> &'static Prelude {
    static CHECKED: LazyLock<Prelude> = LazyLock::new(|| {
        let _span = tracing::debug_span!("prelude").entered();
        let mut sources = SourceMap::new();
        let mut diagnostics = Diagnostics::new();
        let mut units = Vec::new();
        for file in PRELUDE {
            let id = sources.add(file.path, file.text);
            units.push(rtsl_syntax::parse(&mut sources, id, &mut NoIncludes, &mut diagnostics));
        }
        let checked = rtsl_sema::check::check_prelude(&units, &mut diagnostics);
        Prelude { sources, checked, diagnostics }
    });
    &CHECKED
}
