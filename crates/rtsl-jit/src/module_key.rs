//! The identity of compiled modules.

use std::path::Path;

use crate::error::LlvmVersion;
use crate::opt_level::OptLevel;
use crate::passes::{Work, spellings};
use crate::target::Target;

/// The number of ways in which this crate has had texts compiled: options of code generation that are not in
/// [`spellings`], or the form of stored code. To be increased with each change of these.
const GENERATION: u32 = 1;

/// A digest of a compiler: the library and the machine for which it compiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompilerKey([u8; blake3::OUT_LEN]);

/// A digest of the text of a module and of the way to compile it. Texts come from shaders, which are untrusted, so it
/// is one for which nobody finds two texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ModuleKey([u8; blake3::OUT_LEN]);

impl CompilerKey {
    /// Returns the key of an LLVM library. Two builds of one version may generate different code, so the file counts,
    /// too: by its place, size and time, since reading its 200 MB takes longer than most compilations.
    pub fn new(library: &Path, version: LlvmVersion, host: &Target) -> CompilerKey {
        let file = library.metadata();
        let changed = file.as_ref().ok().and_then(|file| file.modified().ok());
        let parts = [
            env!("CARGO_PKG_VERSION").to_owned(),
            GENERATION.to_string(),
            version.to_string(),
            library.display().to_string(),
            format!("{:?} {changed:?}", file.map(|file| file.len()).ok()),
            host.triple().to_owned(),
            host.cpu().to_owned(),
            host.features().to_owned(),
        ];
        CompilerKey(digest(parts.iter().map(String::as_bytes)))
    }
}

impl ModuleKey {
    /// Returns the key of a text.
    pub fn new(compiler: CompilerKey, text: &str, level: OptLevel, work: Work) -> ModuleKey {
        let ways = format!("{level:?} {}", spellings(level, work));
        ModuleKey(digest([&compiler.0[..], ways.as_bytes(), text.as_bytes()].into_iter()))
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8; blake3::OUT_LEN] {
        &self.0
    }
}

/// Returns the digest of texts, each with its length, so that their borders count.
fn digest<'a>(texts: impl Iterator<Item = &'a [u8]>) -> [u8; blake3::OUT_LEN] {
    let mut hasher = blake3::Hasher::new();
    for text in texts {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text);
    }
    *hasher.finalize().as_bytes()
}
