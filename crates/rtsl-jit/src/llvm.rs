//! A loaded LLVM library.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use libloading::Library;

use crate::code_cache::CodeCache;
use crate::ending;
use crate::error::{JitError, LlvmError, LlvmVersion};
use crate::ffi::{self, Api};
use crate::library;
use crate::library_pages::LibraryPages;
use crate::limits::OLDEST_MAJOR;
use crate::module_cache::ModuleCache;
use crate::module_key::CompilerKey;
use crate::passes::Passes;
use crate::search::{self, Candidates};
use crate::target::Target;
use crate::worker;

/// An LLVM library in this process. It remains loaded until the process ends, since LLVM's globals do not support
/// unloading.
pub struct Llvm {
    pub(crate) api: Api,
    pages: LibraryPages,
    version: LlvmVersion,
    path: PathBuf,
    host: Target,
    pub(crate) passes: Passes,
    pub(crate) key: CompilerKey,
    modules: Mutex<ModuleCache>,
}

static LOADED: OnceLock<Result<Arc<Llvm>, LlvmError>> = OnceLock::new();

/// The cache of this process, if it has one.
static CODE_CACHE: OnceLock<CodeCache> = OnceLock::new();

impl Llvm {
    /// Returns the LLVM of this process: the first call searches and loads, later ones return the same result.
    ///
    /// The environment variable `RTSL_LLVM`, a library's file or its folder, overrides the search; if its library is
    /// unsuitable this is an error.
    pub fn load() -> Result<Arc<Llvm>, LlvmError> {
        let load = || {
            let _span = tracing::debug_span!("load_llvm").entered();
            search_and_open()
        };
        LOADED.get_or_init(load).clone()
    }

    /// Names libraries that the search tries before those of the system, the best first, such as one that a host is
    /// installed with. `RTSL_LLVM` still overrides them. They have no effect after the first [`Llvm::load`].
    pub fn suggest(paths: Vec<PathBuf>) {
        search::suggest(paths);
    }

    /// Keeps compiled code in a cache and takes what it has. Without one, each process compiles what it needs. Only the
    /// first cache of a process has an effect.
    pub fn keep_code_in(cache: CodeCache) {
        let _ = CODE_CACHE.set(cache);
    }

    /// Returns the cache of this process.
    pub fn code_cache() -> Option<&'static CodeCache> {
        CODE_CACHE.get()
    }

    /// Releases memory held only for further compilations: the library's code, if one is loaded. The next compilation
    /// takes some milliseconds longer.
    pub fn release_memory() {
        if let Some(Ok(llvm)) = LOADED.get() {
            llvm.pages.release();
        }
    }

    /// Drops the modules that are kept in case their texts are compiled again; those in use live on. For measurements
    /// of compilation.
    ///
    /// # Errors
    /// As for compilations: in a child process whose parent was at work, and while the process is ending.
    pub fn forget_modules(&self) -> Result<(), JitError> {
        self.with_modules(|modules| *modules = ModuleCache::default())
    }

    /// Calls `body` with the modules that are kept. Their lock is held as part of work with LLVM, so that a child
    /// process in which it would never be released is refused all work.
    pub(crate) fn with_modules<T>(
        &self,
        body: impl FnOnce(&mut ModuleCache) -> T,
    ) -> Result<T, JitError> {
        let _under_way = ending::begin_work()?;
        Ok(body(&mut self.modules.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    /// Returns the libraries that the search finds, the first choice first, including unsuitable ones.
    pub fn installed() -> Vec<PathBuf> {
        search::installed()
    }

    /// Returns the version that the library reports.
    pub fn version(&self) -> LlvmVersion {
        self.version
    }

    /// Returns the path of the library.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the target of this machine.
    pub fn host(&self) -> &Target {
        &self.host
    }

    fn open(path: &Path) -> Result<Llvm, String> {
        check_named_version(path)?;
        let library = library::open(path)?;
        let version = supported_version(&library)?;
        let api = Api::resolve(&library)
            .map_err(|name| format!("LLVM {version} lacks the function {name}"))?;
        ffi::initialize_targets(&library);
        worker::install_fatal_error_handler(&api);
        ending::note_loaded();
        let host = host_target(&api);
        let pages = LibraryPages::of_code_at(api.LLVMContextCreate as *const ());
        // Pages read only during loading, such as tables of relocations and constructors of globals, are not needed
        // again: without this the first compilation ends with 52 MB of the library in memory, with it 36 MB (LLVM 19).
        pages.release();
        let key = CompilerKey::new(path, version, &host);
        let (path, passes, modules) = (path.to_owned(), Passes::default(), Mutex::default());
        Ok(Llvm { api, pages, version, path, host, passes, key, modules })
    }
}

impl std::fmt::Debug for Llvm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LLVM {} at {}", self.version, self.path.display())
    }
}

fn search_and_open() -> Result<Arc<Llvm>, LlvmError> {
    let (paths, chosen_by_user): (Box<dyn Iterator<Item = PathBuf>>, bool) =
        match search::candidates() {
            Candidates::Chosen(paths) => (Box::new(paths.into_iter()), true),
            Candidates::Found(paths) => (paths, false),
        };
    let mut tried = Vec::new();
    for path in paths {
        if tried.iter().any(|(other, _)| *other == path) {
            continue;
        }
        match Llvm::open(&path) {
            Ok(llvm) => return Ok(Arc::new(llvm)),
            Err(reason) => tried.push((path, reason)),
        }
    }
    Err(LlvmError { tried, chosen_by_user })
}

/// Rejects a file by the version in its name, such as `libLLVM-14.so`, before loading it.
fn check_named_version(path: &Path) -> Result<(), String> {
    if !path.exists() {
        return Err("there is no such file".to_owned());
    }
    if path.is_dir() {
        return Err("this folder contains no LLVM library".to_owned());
    }
    match search::major_by_name(path) {
        Some(major) if major < OLDEST_MAJOR => Err(too_old(&major.to_string())),
        _ => Ok(()),
    }
}

fn supported_version(library: &Library) -> Result<LlvmVersion, String> {
    match ffi::version(library) {
        None => Err("not LLVM, or older than 16".to_owned()),
        Some((major, minor, patch)) => {
            let version = LlvmVersion { major, minor, patch };
            if major < OLDEST_MAJOR { Err(too_old(&version.to_string())) } else { Ok(version) }
        }
    }
}

fn too_old(version: &str) -> String {
    format!("version {version} is too old, LLVM {OLDEST_MAJOR} or newer is required")
}

fn host_target(api: &Api) -> Target {
    // Safety: these functions take no arguments and return messages that the caller frees.
    let (cpu, features) = unsafe {
        (
            api.take_message((api.LLVMGetHostCPUName)()),
            api.take_message((api.LLVMGetHostCPUFeatures)()),
        )
    };
    Target { triple: Target::host_triple().to_owned(), cpu, features, is_host: true }
}
