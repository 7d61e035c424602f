//! The places to which paths lead, and at which open files lie.

use std::fs::File;
use std::path::{Component, Path, PathBuf};

/// True if a path leads to a place within one of the folders, whether anything is there or not. `real` returns the
/// place to which a path leads, such as [`real_place`].
pub fn lies_within<'a>(
    path: &Path,
    folders: impl IntoIterator<Item = &'a PathBuf>,
    real: impl Fn(&Path) -> Option<PathBuf>,
) -> bool {
    let Some(place) = real(path) else { return false };
    folders.into_iter().any(|folder| real(folder).is_some_and(|folder| place.starts_with(folder)))
}

/// Returns the place to which a path leads, without links, whether anything is there or not; `None` for a link to
/// nothing.
pub fn real_place(path: &Path) -> Option<PathBuf> {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    if let Ok(real) = path.canonicalize() {
        return Some(real);
    }
    if path.is_symlink() {
        return None;
    }
    // Nothing is there, so the rest of the path has no links.
    let folder = real_place(path.parent()?)?;
    Some(without_detours(&match path.components().next_back()? {
        Component::Normal(name) => folder.join(name),
        Component::ParentDir => folder.join(".."),
        _ => folder,
    }))
}

/// Removes `.`, and `..` after a folder's name.
pub fn without_detours(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        let after_name = matches!(plain.components().next_back(), Some(Component::Normal(_)));
        match component {
            Component::CurDir => {}
            Component::ParentDir if after_name => {
                plain.pop();
            }
            other => plain.push(other),
        }
    }
    plain
}

/// Returns the place at which an open file lies, in the form of [`real_place`]; `path` is that by which it was opened.
pub(crate) fn place_of_open(file: &File, path: &Path) -> Option<PathBuf> {
    // Where the system cannot tell, as in a sandbox without `/proc`, the path must lead to the same file still.
    system_place(file).or_else(|| same_place(file, path))
}

#[cfg(target_os = "linux")]
fn system_place(file: &File) -> Option<PathBuf> {
    use std::os::fd::AsRawFd;

    std::fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd())).ok()
}

#[cfg(target_vendor = "apple")]
fn system_place(file: &File) -> Option<PathBuf> {
    use std::os::fd::AsRawFd;
    use std::os::unix::ffi::OsStringExt;

    let mut name = vec![0_u8; libc::PATH_MAX as usize];
    // SAFETY: `F_GETPATH` writes at most `PATH_MAX` bytes, the last of which is 0.
    let result = unsafe { libc::fcntl(file.as_raw_fd(), libc::F_GETPATH, name.as_mut_ptr()) };
    let length = name.iter().position(|byte| *byte == 0).filter(|_| result != -1)?;
    name.truncate(length);
    Some(std::ffi::OsString::from_vec(name).into())
}

#[cfg(windows)]
fn system_place(file: &File) -> Option<PathBuf> {
    use std::os::windows::ffi::OsStringExt;
    use std::os::windows::io::AsRawHandle;
    use windows_sys::Win32::Storage::FileSystem::{
        FILE_NAME_NORMALIZED, GetFinalPathNameByHandleW, VOLUME_NAME_DOS,
    };

    /// The greatest length of a path, in units of 16 bits.
    const LONGEST: usize = 1 << 15;
    // The form in which `canonicalize` gives places.
    const FORM: u32 = FILE_NAME_NORMALIZED | VOLUME_NAME_DOS;
    let mut name = vec![0_u16; LONGEST];
    // SAFETY: the handle is open, and as many units may be written as there are.
    let length = unsafe {
        GetFinalPathNameByHandleW(file.as_raw_handle(), name.as_mut_ptr(), LONGEST as u32, FORM)
    };
    let name = name.get(..length as usize).filter(|name| !name.is_empty())?;
    Some(std::ffi::OsString::from_wide(name).into())
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple", windows)))]
fn system_place(_: &File) -> Option<PathBuf> {
    None
}

/// Returns the place to which the path leads, if the open file still lies there.
#[cfg(unix)]
fn same_place(file: &File, path: &Path) -> Option<PathBuf> {
    use std::os::unix::fs::MetadataExt;

    let place = path.canonicalize().ok()?;
    let (open, there) = (file.metadata().ok()?, std::fs::symlink_metadata(&place).ok()?);
    ((open.dev(), open.ino()) == (there.dev(), there.ino())).then_some(place)
}

#[cfg(not(unix))]
fn same_place(_: &File, _: &Path) -> Option<PathBuf> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn open_files_lie_where_they_were_opened_whatever_the_path_leads_to_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().canonicalize().unwrap().join(name);
        std::fs::write(path("there"), "text").unwrap();
        std::fs::write(path("other"), "text").unwrap();
        symlink("there", path("link")).unwrap();
        let file = File::open(path("link")).unwrap();
        let places =
            |file: &File| (place_of_open(file, &path("link")), same_place(file, &path("link")));
        assert_eq!(places(&file), (Some(path("there")), Some(path("there"))));
        std::fs::remove_file(path("link")).unwrap();
        symlink("other", path("link")).unwrap();
        let told = system_place(&file).map(|_| path("there"));
        assert_eq!(places(&file), (told, None));
    }
}
