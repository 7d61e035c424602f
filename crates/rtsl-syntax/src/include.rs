//! The loader that finds the files of `#include`. The caller implements it, since this crate reads
//! no files.

use std::collections::BTreeMap;

/// Finds the files that `#include` names.
pub trait IncludeLoader {
    /// Returns the file that `path` names in a file called `including`. Loaders search beside that
    /// file first, then on the search path.
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError>;
}

/// A file that a loader found.
#[derive(Clone, Debug)]
pub struct IncludedFile {
    /// The name that diagnostics show. Two files with one name are treated as one file.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// The reason why a loader returned no file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IncludeError {
    /// The file was not found in these places.
    NotFound(Vec<String>),
    /// The path leads out of the folders that programs may include from.
    Escapes,
    /// The file exists but cannot be read, for this reason.
    Unreadable(String),
}

/// A loader without files, for text that does not come from a file.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoIncludes;

impl IncludeLoader for NoIncludes {
    fn load(&mut self, _path: &str, _including: &str) -> Result<IncludedFile, IncludeError> {
        Err(IncludeError::NotFound(Vec::new()))
    }
}

/// A loader of files held in memory, by name. Paths are relative to the including file's folder,
/// then to the root.
#[derive(Clone, Debug, Default)]
pub struct MemoryLoader {
    /// The texts by name.
    pub files: BTreeMap<String, String>,
}

impl IncludeLoader for MemoryLoader {
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        let folder = including.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut searched = Vec::new();
        for base in [folder, ""] {
            let name = join_path(base, path).ok_or(IncludeError::Escapes)?;
            if let Some(text) = self.files.get(&name) {
                return Ok(IncludedFile { name, text: text.clone() });
            }
            if !searched.contains(&name) {
                searched.push(name);
            }
        }
        Err(IncludeError::NotFound(searched))
    }
}

/// Resolves `path` relative to `folder`; both are relative to a root and written with `/`, and the
/// result has no `.` or `..`. Returns `None` if the path leads out of the root or is absolute.
pub fn join_path(folder: &str, path: &str) -> Option<String> {
    if path.starts_with('/') || path.contains(['\\', ':', '\0']) {
        return None;
    }
    let mut parts = Vec::new();
    for part in folder.split('/').chain(path.split('/')) {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_inside_the_root() {
        assert_eq!(join_path("a/b", "../c.rtsl").as_deref(), Some("a/c.rtsl"));
        assert_eq!(join_path("", "./c.rtsl").as_deref(), Some("c.rtsl"));
        assert_eq!(join_path("a", "../../c.rtsl"), None);
        assert_eq!(join_path("a", "/etc/passwd"), None);
        assert_eq!(join_path("a", "c:\\x"), None);
    }
}
