//! The prelude, parsed and checked once per process.

use std::sync::LazyLock;

use rtsl_source::{Diagnostics, SourceMap};
use rtsl_syntax::{NoIncludes, ast};

use crate::check::{self, check_prelude};

/// A text that is built into the program.
#[derive(Clone, Copy, Debug)]
pub struct TextFile {
    /// Its name, as diagnostics show it: `prelude/noise.rtsl`.
    pub path: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The files of the prelude, sorted by name.
pub const FILES: &[TextFile] = include!(concat!(env!("OUT_DIR"), "/prelude_files.rs"));

/// The renderer's texts, which are checked on the prelude but no part of it, sorted by name.
pub const RENDERER: &[TextFile] = include!(concat!(env!("OUT_DIR"), "/renderer_files.rs"));

/// The checked prelude and the map of its files. The map of every compilation starts with them, so that spans may refer
/// to the prelude.
pub struct CheckedPrelude {
    /// Its files.
    pub sources: SourceMap,
    /// Its declarations.
    pub checked: check::Prelude,
    /// The errors of the prelude: none, as a test ensures.
    pub diagnostics: Diagnostics,
}

/// Returns the prelude; the first call checks it.
pub fn prelude() -> &'static CheckedPrelude {
    static CHECKED: LazyLock<CheckedPrelude> = LazyLock::new(|| {
        let _span = tracing::debug_span!("prelude").entered();
        let mut sources = SourceMap::new();
        let mut diagnostics = Diagnostics::new();
        let units = parse_texts(FILES, &mut sources, &mut diagnostics);
        let checked = check_prelude(&units, &mut diagnostics);
        CheckedPrelude { sources, checked, diagnostics }
    });
    &CHECKED
}

/// Parses texts, which are added to `sources`.
pub fn parse_texts(
    files: &[TextFile],
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Vec<ast::TranslationUnit> {
    let mut parse = |file: &TextFile| {
        let id = sources.add(file.path, file.text);
        rtsl_syntax::parse(sources, id, &mut NoIncludes, diagnostics)
    };
    files.iter().map(&mut parse).collect()
}
