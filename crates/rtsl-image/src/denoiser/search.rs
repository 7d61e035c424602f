//! Where Open Image Denoise may lie: where `RTSL_OIDN` says, which silences every other place, or else where the system
//! looks for libraries.

use std::path::{Path, PathBuf};

/// A library to try.
pub struct Candidate {
    /// The file, or a name that the system looks up.
    pub path: PathBuf,
    /// The user named it.
    pub was_named: bool,
}

/// The libraries to try, the best first.
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

/// The file itself, or the libraries of the folder. A path that is neither is handed on, so that the error can say so.
fn chosen(path: &Path) -> Vec<PathBuf> {
    let folders = ["", "lib", "lib64", "bin"];
    let files = folders
        .iter()
        .flat_map(|folder| names().iter().map(move |name| path.join(folder).join(name)));
    let found: Vec<PathBuf> = files.filter(|file| file.is_file()).collect();
    if path.is_dir() && !found.is_empty() { found } else { vec![path.to_owned()] }
}

/// Names of the library, the newest first.
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
        let folder = std::env::temp_dir().join(format!("rtsl-oidn-{}", std::process::id()));
        let lib = folder.join("lib");
        std::fs::create_dir_all(&lib).unwrap();
        assert_eq!(chosen(&folder), [folder.as_path()]);
        let file = lib.join(names()[0]);
        std::fs::write(&file, "a library").unwrap();
        assert_eq!(chosen(&folder), [file.as_path()]);
        assert_eq!(chosen(&file), [file]);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
