//! Machine code that is kept from one process to the next.
//!
//! Most of the time to a first picture is LLVM's, which compiles the same texts each time that a program runs. With a
//! cache, what was compiled once is read from a folder of the user's.
//!
//! Code in that folder runs with the rights of the user, so it must be what this user's compilations wrote: the folder
//! and its files belong to the user, and nobody else may write them or replace a folder above them
//! ([`PrivateFolder`]). Files are written beside their places and renamed, and read only with the digest of their key
//! and content, so that a damaged or exchanged one counts as missing. Whatever fails, code is compiled as without a
//! cache.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

use crate::error::CodeCacheError;
use crate::made_code::MadeCode;
use crate::module_key::ModuleKey;
use crate::private_folder::PrivateFolder;

/// The size of all files, in bytes: the kernels of some hundred scenes.
const MAX_BYTES: u64 = 512 << 20;
/// The size that is left once files had to go.
const KEPT_BYTES: u64 = MAX_BYTES / 4 * 3;
/// The size of the largest file. The largest module of the public scenes that were tried has half a MB.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// A folder of compiled code.
#[derive(Debug)]
pub struct CodeCache {
    folder: PrivateFolder,
    /// The bytes written since the size of all files was last looked at, or more than any limit at first.
    written: AtomicU64,
}

/// A file of the folder.
#[derive(Debug)]
pub struct StoredFile {
    /// Its path.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// The time at which it was last written or marked.
    pub used: SystemTime,
}

/// The content of a cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CodeCacheSize {
    /// The number of modules.
    pub modules: usize,
    /// Their size in bytes.
    pub bytes: u64,
}

impl CodeCache {
    /// Returns the folder of this user's cache: that of the environment variable `RTSL_CACHE`, of which an empty value
    /// means none, or else `rtsl/kernels` in the folder for caches (`XDG_CACHE_HOME`, or `.cache` in the home folder).
    pub fn folder_of_user() -> Option<PathBuf> {
        folder_by(|name| std::env::var_os(name))
    }

    /// Opens a folder, which is created if it is missing, for the use of this user only.
    ///
    /// # Errors
    /// If it can't be created, belongs to another user, or if others may write in it or replace it; always on a system
    /// without machine code.
    pub fn open(path: &Path) -> Result<CodeCache, CodeCacheError> {
        let folder = PrivateFolder::open(path)?;
        Ok(CodeCache { folder, written: AtomicU64::new(MAX_BYTES) })
    }

    /// The folder, without links.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the number and size of the modules.
    pub fn size(&self) -> CodeCacheSize {
        let mut size = CodeCacheSize::default();
        for file in self.folder.files() {
            size.modules += 1;
            size.bytes += file.bytes;
        }
        size
    }

    /// Returns the code of a module, if it is there.
    pub(crate) fn get(&self, key: ModuleKey) -> Option<MadeCode> {
        let _span = tracing::debug_span!("read_code").entered();
        let bytes = self.folder.read(&name_of(key), MAX_FILE_BYTES)?;
        MadeCode::from_bytes(&bytes, key)
    }

    /// Keeps code until other code needs its room.
    pub(crate) fn insert(&self, key: ModuleKey, code: &MadeCode) {
        let bytes = code.to_bytes(key);
        let size = bytes.len() as u64;
        if size > MAX_FILE_BYTES || self.folder.write(&name_of(key), &bytes).is_err() {
            return;
        }
        // Looked at by the first insertion of each process, and then after a fraction of the limit each.
        if self.written.fetch_add(size, Ordering::Relaxed) + size > MAX_BYTES / 16 {
            self.written.store(0, Ordering::Relaxed);
            self.make_room(MAX_BYTES, KEPT_BYTES);
        }
    }

    /// Removes the files that were not used for the longest time if all together exceed `max_bytes`, until `kept_bytes`
    /// are left.
    fn make_room(&self, max_bytes: u64, kept_bytes: u64) {
        let mut files = self.folder.files();
        let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
        if bytes <= max_bytes {
            return;
        }
        files.sort_by_key(|file| file.used);
        for file in files {
            if bytes <= kept_bytes {
                break;
            }
            // Another process may have removed it.
            let _ = std::fs::remove_file(&file.path);
            bytes -= file.bytes;
        }
    }
}

/// Returns the name of a module's file.
fn name_of(key: ModuleKey) -> String {
    blake3::Hash::from_bytes(*key.bytes()).to_hex().to_string()
}

/// Returns the folder of a user with these environment variables.
fn folder_by(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(folder) = variable("RTSL_CACHE") {
        return (!folder.is_empty()).then(|| folder.into());
    }
    let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let caches = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")));
    Some(caches?.join("rtsl").join("kernels"))
}

#[cfg(all(test, unix))]
mod tests {
    use std::collections::BTreeMap;
    use std::time::Duration;

    use super::*;
    use crate::llvm::Llvm;
    use crate::opt_level::OptLevel;
    use crate::passes::Work;

    const TEXT: &str = "define float @f(float %a) {\n%b = fadd float %a, %a\nret float %b\n}";

    fn cache() -> (tempfile::TempDir, CodeCache) {
        let folder = tempfile::tempdir().unwrap();
        let cache = CodeCache::open(&folder.path().join("kernels")).unwrap();
        (folder, cache)
    }

    /// A module with its key, as LLVM makes it; `number` makes another text of it.
    fn code(number: u32) -> (ModuleKey, MadeCode) {
        let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
        let text = format!("; {number}\n{TEXT}");
        let object = llvm.object(&text, llvm.host(), OptLevel::O2).unwrap();
        let mut frames = crate::frames::Frames::default();
        frames.add("f", 8);
        frames.add("f.rest", 4000);
        let key = ModuleKey::new(llvm.key, &text, OptLevel::O2, Work::Packets);
        (key, MadeCode { object, frames })
    }

    #[test]
    fn code_is_found_by_its_key_alone() {
        let (_folder, cache) = cache();
        let (key, made) = code(0);
        assert_eq!(cache.get(key), None);
        cache.insert(key, &made);
        assert_eq!(cache.get(key).as_ref(), Some(&made));
        assert_eq!(cache.get(key).unwrap().load().unwrap().frame("f"), 4008 + (4 << 10));
        assert_eq!(cache.get(code(1).0), None);
        let again = CodeCache::open(cache.path()).unwrap();
        assert_eq!(again.get(key).as_ref(), Some(&made));
        assert_eq!(again.size().modules, 1);
    }

    #[test]
    fn keys_know_level_work_and_compiler() {
        let llvm = Llvm::load().unwrap();
        let key = |level, work| ModuleKey::new(llvm.key, TEXT, level, work);
        let other =
            crate::module_key::CompilerKey::new(Path::new("/other"), llvm.version(), llvm.host());
        let keys = [
            key(OptLevel::O0, Work::Packets),
            key(OptLevel::O2, Work::Packets),
            key(OptLevel::O2, Work::OneRay),
            key(OptLevel::O3, Work::Packets),
            ModuleKey::new(other, TEXT, OptLevel::O2, Work::Packets),
        ];
        for (index, key) in keys.iter().enumerate() {
            assert!(!keys[..index].contains(key), "{index}");
        }
    }

    #[test]
    fn damaged_and_exchanged_files_count_as_missing() {
        let (_folder, cache) = cache();
        let ((key, made), (other, _)) = (code(0), code(1));
        cache.insert(key, &made);
        let path = cache.path().join(name_of(key));
        let bytes = std::fs::read(&path).unwrap();
        for at in (0..bytes.len()).step_by(7) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            cache.folder.write(&name_of(key), &damaged).unwrap();
            assert_eq!(cache.get(key), None, "byte {at}");
            cache.folder.write(&name_of(key), &bytes[..at]).unwrap();
            assert_eq!(cache.get(key), None, "{at} bytes");
        }
        // The file of another module.
        cache.folder.write(&name_of(other), &bytes).unwrap();
        assert_eq!(cache.get(other), None);
        cache.folder.write(&name_of(key), &bytes).unwrap();
        assert_eq!(cache.get(key), Some(made));
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let (_folder, cache) = cache();
        let codes: Vec<_> = (0..4).map(code).collect();
        for (age, (key, made)) in (0..).zip(&codes) {
            cache.insert(*key, made);
            let used = SystemTime::now() - Duration::from_secs(3600 * 24 * (4 - age));
            let file = std::fs::File::open(cache.path().join(name_of(*key))).unwrap();
            file.set_modified(used).unwrap();
        }
        assert!(cache.get(codes[0].0).is_some(), "which marks it");
        let one = cache.size().bytes / 4;
        cache.make_room(4 * one, one);
        assert_eq!(cache.size().modules, 4);
        cache.make_room(4 * one - 1, 2 * one);
        let left: Vec<bool> = codes.iter().map(|(key, _)| cache.get(*key).is_some()).collect();
        assert_eq!(left, [true, false, false, true]);
    }

    #[test]
    fn unfinished_files_go_once_they_are_old() {
        let (_folder, cache) = cache();
        let path = |name: &str| cache.path().join(name);
        for name in ["unfinished-1-0", "unfinished-2-0"] {
            std::fs::write(path(name), "half").unwrap();
        }
        let old = SystemTime::now() - Duration::from_secs(3700);
        std::fs::File::open(path("unfinished-1-0")).unwrap().set_modified(old).unwrap();
        assert_eq!(cache.size(), CodeCacheSize::default());
        assert!(!path("unfinished-1-0").exists() && path("unfinished-2-0").exists());
    }

    #[test]
    fn threads_write_and_read_one_module() {
        let (_folder, cache) = cache();
        let (key, made) = code(0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..100 {
                        cache.insert(key, &made);
                        assert_eq!(cache.get(key).as_ref(), Some(&made));
                    }
                });
            }
        });
        assert_eq!(cache.size().modules, 1);
    }

    #[test]
    fn the_environment_names_the_folder() {
        let folder = |variables: &[(&str, &str)]| {
            let variables: BTreeMap<&str, &str> = variables.iter().copied().collect();
            folder_by(|name| variables.get(name).map(OsString::from))
        };
        let (home, caches) = (("HOME", "/home/u"), ("XDG_CACHE_HOME", "/caches"));
        assert_eq!(folder(&[home]), Some("/home/u/.cache/rtsl/kernels".into()));
        assert_eq!(folder(&[home, caches]), Some("/caches/rtsl/kernels".into()));
        assert_eq!(
            folder(&[home, ("XDG_CACHE_HOME", "")]),
            Some("/home/u/.cache/rtsl/kernels".into())
        );
        assert_eq!(folder(&[home, ("RTSL_CACHE", "here")]), Some("here".into()));
        assert_eq!(folder(&[home, ("RTSL_CACHE", "")]), None);
        assert_eq!(folder(&[("HOME", "relative")]), None);
    }
}
