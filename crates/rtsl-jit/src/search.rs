//! The search for libLLVM.
//!
//! The order: `RTSL_LLVM`, which excludes all other locations; the libraries that the host suggests; those of Rust
//! toolchains and of the system, the newest first. The search only inspects paths and folders; `rustc` is run as the
//! last resort, since that alone takes longer than loading LLVM.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// The libraries that the host suggests.
static SUGGESTED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Sets the libraries that the host suggests, the best first.
pub fn suggest(paths: Vec<PathBuf>) {
    *SUGGESTED.lock().unwrap_or_else(PoisonError::into_inner) = paths;
}

fn suggested_libraries() -> Vec<PathBuf> {
    SUGGESTED.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// The candidate libraries, lazily and in order.
pub enum Candidates {
    /// The files named by the user.
    Chosen(Vec<PathBuf>),
    /// The files found in the search.
    Found(Box<dyn Iterator<Item = PathBuf>>),
}

/// Returns the candidate libraries, the best first.
pub fn candidates() -> Candidates {
    match std::env::var_os("RTSL_LLVM").filter(|value| !value.is_empty()) {
        Some(value) => Candidates::Chosen(chosen(Path::new(&value))),
        None => {
            let locations: [fn() -> Vec<PathBuf>; 3] =
                [suggested_libraries, installed, asked_toolchain_libraries];
            Candidates::Found(Box::new(locations.into_iter().flat_map(|location| location())))
        }
    }
}

/// Returns every library of toolchains and of the system, the newest first. Of equal versions those of toolchains,
/// which were optimised by profiles: a first tile takes 0.17 s by LLVM 22 of a toolchain, and 0.26 by Debian's LLVM 19.
pub fn installed() -> Vec<PathBuf> {
    let mut paths = toolchain_libraries();
    paths.extend(libraries_in(system_folders()));
    paths.sort_by_key(|path| std::cmp::Reverse(major_by_name(path)));
    let mut seen = Vec::new();
    paths.retain(|path| {
        let new = !seen.contains(path);
        seen.push(path.clone());
        new
    });
    paths
}

/// Returns the libraries that `RTSL_LLVM` names: the file itself, or the libraries of the folder and its `lib`
/// subfolder. A path that is neither is returned unchanged, so that the error can report it.
fn chosen(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        let found = libraries_in([path.to_owned(), path.join("lib")]);
        if !found.is_empty() {
            return found;
        }
    }
    vec![path.to_owned()]
}

fn system_folders() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    for variable in ["LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"] {
        if let Some(value) = std::env::var_os(variable) {
            folders
                .extend(std::env::split_paths(&value).filter(|path| !path.as_os_str().is_empty()));
        }
    }
    if cfg!(windows) {
        if let Some(value) = std::env::var_os("PATH") {
            folders.extend(std::env::split_paths(&value));
        }
        folders.push("C:\\Program Files\\LLVM\\bin".into());
        return folders;
    }
    let multiarch = format!("/usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    for folder in [
        multiarch.as_str(),
        "/usr/lib64",
        "/usr/lib",
        "/usr/local/lib",
        "/opt/homebrew/opt/llvm/lib",
        "/usr/local/opt/llvm/lib",
    ] {
        folders.push(folder.into());
    }
    for parent in ["/usr/lib", "/usr/lib64"] {
        let versioned = entries(Path::new(parent)).into_iter().filter(|path| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("llvm"))
        });
        folders.extend(versioned.map(|path| path.join("lib")));
    }
    folders
}

fn toolchain_libraries() -> Vec<PathBuf> {
    let mut sysroots = Vec::new();
    if let Some(rustup) = rustup_home() {
        let toolchains = rustup.join("toolchains");
        if let Some(name) = std::env::var_os("RUSTUP_TOOLCHAIN") {
            sysroots.push(toolchains.join(name));
        }
        sysroots.push(PathBuf::from(env!("RTSL_BUILD_SYSROOT")));
        sysroots.extend(entries(&toolchains));
    } else {
        sysroots.push(PathBuf::from(env!("RTSL_BUILD_SYSROOT")));
    }
    sysroots.retain(|sysroot| !sysroot.as_os_str().is_empty());
    sysroots.into_iter().flat_map(|sysroot| sysroot_libraries(&sysroot)).collect()
}

fn rustup_home() -> Option<PathBuf> {
    std::env::var_os("RUSTUP_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::home_dir().map(|home| home.join(".rustup")))
}

fn asked_toolchain_libraries() -> Vec<PathBuf> {
    let output = Command::new("rustc").args(["--print", "sysroot"]).output();
    match output {
        Ok(output) if output.status.success() => {
            sysroot_libraries(Path::new(String::from_utf8_lossy(&output.stdout).trim()))
        }
        _ => Vec::new(),
    }
}

fn sysroot_libraries(sysroot: &Path) -> Vec<PathBuf> {
    libraries_in([sysroot.join("lib"), sysroot.join("bin")])
}

/// Returns the LLVM libraries of the folders, the newest first by their names; a link and its target count once.
fn libraries_in(folders: impl IntoIterator<Item = PathBuf>) -> Vec<PathBuf> {
    let mut seen = Vec::new();
    let mut found: Vec<PathBuf> = Vec::new();
    for path in folders.into_iter().flat_map(|folder| entries(&folder)) {
        let is_library =
            path.file_name().and_then(|name| name.to_str()).is_some_and(is_library_name);
        let Ok(real) = path.canonicalize() else { continue };
        if is_library && is_binary(&real) && !seen.contains(&real) {
            seen.push(real);
            found.push(path);
        }
    }
    found.sort_by_key(|path| std::cmp::Reverse(major_by_name(path)));
    found
}

fn is_library_name(name: &str) -> bool {
    let extension = name.contains(".so") || name.ends_with(".dylib") || name.ends_with(".dll");
    extension
        && (name.starts_with("libLLVM") || name == "LLVM-C.dll" || name == "LLVM.dll")
        && !name.starts_with("libLLVM-C")
}

/// True if the first bytes are those of a library, since a linker script may have the same name.
fn is_binary(path: &Path) -> bool {
    use std::io::Read;
    let mut start = [0; 4];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && !start.iter().all(|byte| byte.is_ascii_graphic())
}

/// Returns the major version in a library's name: 19 for `libLLVM.so.19.1` and `libLLVM-19.so`.
pub fn major_by_name(path: &Path) -> Option<u32> {
    let name = path.file_name()?.to_str()?;
    let digits = name.find(|character: char| character.is_ascii_digit())?;
    let rest = &name[digits..];
    let end = rest.find(|character: char| !character.is_ascii_digit()).unwrap_or(rest.len());
    // The 1 in Debian's `libLLVM.so.1` is an ABI version, not that of LLVM.
    rest[..end].parse().ok().filter(|major| *major > 1)
}

/// Returns the entries of a folder, sorted, so that the choice is deterministic.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .collect();
    paths.sort();
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_give_versions() {
        for (name, major) in [
            ("libLLVM.so.19.1", Some(19)),
            ("libLLVM-15.so.1", Some(15)),
            ("libLLVM-14.0.6.so.1", Some(14)),
            ("libLLVM.so.22.1-rust-1.95.0-stable", Some(22)),
            ("libLLVM.so.1", None),
            ("libLLVM.dylib", None),
        ] {
            assert_eq!(major_by_name(Path::new(name)), major, "{name}");
            assert!(is_library_name(name), "{name}");
        }
        for name in ["libLLVMSupport.a", "libLTO.so", "libLLVM", "libLLVM-C.so.19"] {
            assert!(!is_library_name(name), "{name}");
        }
    }

    #[test]
    fn a_linker_script_is_no_library() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("libLLVM-22.so"), "INPUT(libLLVM.so.22.1)").unwrap();
        std::fs::write(folder.join("libLLVM.so.19.1"), b"\x7fELF....").unwrap();
        let found = libraries_in([folder.to_owned()]);
        assert_eq!(found, [folder.join("libLLVM.so.19.1")]);
    }
}
