//! The places where Open Image Denoise is searched: only `RTSL_OIDN` if it is set, or else the system's libraries.

use std::path::{Path, PathBuf};

/// A library to try.
pub struct Candidate {
    /// The file, or a name that the system looks up.
    pub path: PathBuf,
    /// True if the user named it.
    pub was_named: bool,
}

/// Returns the libraries to try, the best first.
pub fn candidates() -> Vec<Candidate> {
    match std::env::var_os("RTSL_OIDN").filter(|value| !value.is_empty()) {
        Some(value) => {
            let named = |path| Candidate { path, was_named: true };
            chosen(Path::new(&value)).into_iter().map(named).collect()
        }
        None => {
            let looked_up = |name: &&str| Candidate { path: PathBuf::from(name), was_named: false };
            names().iter().map(looked_up).collect()
        }
    }
}

/// Returns the file itself, or the libraries in the folder. Any other path is returned unchanged, so that it appears in
/// the error.
fn chosen(path: &Path) -> Vec<PathBuf> {
    let folders = ["", "lib", "lib64", "bin"];
    let files = folders
        .iter()
        .flat_map(|folder| names().iter().map(move |name| path.join(folder).join(name)));
    let found: Vec<PathBuf> = files.filter(|file| file.is_file()).collect();
    if path.is_dir() && !found.is_empty() { found } else { vec![path.to_owned()] }
}

/// File names of the library, the newest version first.
fn names() -> &'static [&'static str] {
    if cfg!(windows) {
        &["OpenImageDenoise.dll"]
    } else if cfg!(target_os = "macos") {
        &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib", "libOpenImageDenoise.1.dylib"]
    } else {
        &[
            "libOpenImageDenoise.so.2",
            "libOpenImageDenoise.so",
            "libOpenImageDenoise.so.1",
            "libOpenImageDenoise.so.0",
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_give_the_libraries_in_them_and_other_paths_themselves() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let lib = folder.join("lib");
        std::fs::create_dir_all(&lib).unwrap();
        assert_eq!(chosen(folder), [folder]);
        let file = lib.join(names()[0]);
        std::fs::write(&file, "a library").unwrap();
        assert_eq!(chosen(folder), [file.as_path()]);
        assert_eq!(chosen(&file), [file]);
    }
}
