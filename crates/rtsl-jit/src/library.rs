//! Opens a shared library, together with dependencies in neighbouring folders.
//!
//! Some packages of LLVM bring the C++ library that they were built with in a separate folder. The system's loader
//! finds it by a path inside libLLVM, which is valid only if the package was installed as intended; if it was unpacked
//! otherwise, the link `libc++.so.1` to the file `libc++.so.1.0` is missing, too. A library that the loader misses is
//! therefore looked for near the one that needs it and opened first.

use std::fs;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};

use libloading::Library;

/// Opens the library, and before it the neighbouring libraries that the loader does not find. It stays open: closing
/// runs destructors that others may need.
pub fn open(path: &Path) -> Result<ManuallyDrop<Library>, String> {
    open_with_neighbours(path, &mut Vec::new())
}

/// Opens the library; `missed` are the names looked for so far, each once, which ensures termination.
fn open_with_neighbours(
    path: &Path,
    missed: &mut Vec<String>,
) -> Result<ManuallyDrop<Library>, String> {
    loop {
        // Safety: opening runs constructors of the library's globals, which do not access ours.
        let message = match unsafe { Library::new(path) } {
            Ok(library) => return Ok(ManuallyDrop::new(library)),
            Err(error) => plain(&error),
        };
        let Some(name) = missing_library(&message) else { return Err(message) };
        if missed.iter().any(|other| other == name) {
            return Err(message);
        }
        missed.push(name.to_owned());
        let Some(neighbour) = neighbour(path, name) else { return Err(message) };
        open_with_neighbours(&neighbour, missed)
            .map_err(|reason| format!("{message}; {}: {reason}", neighbour.display()))?;
    }
}

/// Returns the loader's message on one line.
fn plain(error: &libloading::Error) -> String {
    let text = match std::error::Error::source(error) {
        Some(source) => source.to_string(),
        None => error.to_string(),
    };
    text.replace('\n', " ")
}

/// Returns the name of the missing library in a loader's message (of glibc, of musl).
fn missing_library(message: &str) -> Option<&str> {
    let message = message.strip_prefix("Error loading shared library ").unwrap_or(message);
    let (name, reason) = message.split_once(':')?;
    let is_name = name.contains(".so") && !name.contains(['/', ' ']);
    (is_name && reason.contains("No such file")).then_some(name)
}

/// Returns the file of this name, possibly with further version digits, in the library's folder or a subfolder.
fn neighbour(library: &Path, name: &str) -> Option<PathBuf> {
    let library = library.canonicalize().ok()?;
    let home = library.parent()?.to_owned();
    let mut folders = vec![home.clone()];
    folders.extend(sorted_entries(&home).into_iter().filter(|path| path.is_dir()));
    let is_it = |path: &PathBuf| {
        let file = path.file_name().and_then(|file| file.to_str());
        let rest = file.and_then(|file| file.strip_prefix(name));
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.')) && path.is_file()
    };
    folders.iter().flat_map(|folder| sorted_entries(folder)).find(is_it)
}

fn sorted_entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_the_missing_library() {
        for (message, name) in [
            (
                "libc++.so.1: cannot open shared object file: No such file or directory",
                Some("libc++.so.1"),
            ),
            (
                "Error loading shared library libc++.so.1: No such file or directory (needed by libLLVM.so)",
                Some("libc++.so.1"),
            ),
            ("/lib/libLLVM.so: cannot open shared object file: No such file or directory", None),
            ("/lib/libLLVM.so: invalid ELF header", None),
            ("libz.so.1: undefined symbol: zlibVersion", None),
            ("", None),
        ] {
            assert_eq!(missing_library(message), name, "{message}");
        }
    }

    #[test]
    fn neighbours_lie_in_the_folder_or_one_below() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let below = folder.join("x86_64-unknown-linux-gnu");
        fs::create_dir_all(&below).unwrap();
        let library = folder.join("libLLVM.so.23.1");
        for file in [&library, &below.join("libc++.so.1.0"), &folder.join("libunwind.so.1")] {
            fs::write(file, "").unwrap();
        }
        let home = folder.canonicalize().unwrap();
        let found = |name| {
            neighbour(&library, name).map(|path| path.strip_prefix(&home).unwrap().to_owned())
        };
        assert_eq!(found("libc++.so.1"), Some("x86_64-unknown-linux-gnu/libc++.so.1.0".into()));
        assert_eq!(found("libunwind.so.1"), Some("libunwind.so.1".into()));
        assert_eq!(found("libc++.so"), Some("x86_64-unknown-linux-gnu/libc++.so.1.0".into()));
        assert_eq!(found("libc++.so.10"), None);
        assert_eq!(found("libz.so.1"), None);
    }
}
