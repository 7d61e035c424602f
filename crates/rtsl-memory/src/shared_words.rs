//! Words that many holders share, in memory or in a temporary file.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::ops::Deref;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use memmap2::Mmap;

/// Words that never change. Clones share them.
///
/// Words in a file take memory only for the pages that are read, and the system evicts these pages when memory is
/// short.
#[derive(Clone)]
pub struct SharedWords(Storage);

#[derive(Clone)]
enum Storage {
    Memory(Arc<[u32]>),
    File(Arc<Mmap>),
}

impl SharedWords {
    /// Copies words to a new file in [`temporary_folder`]. The file has no name that others could open, and ends with
    /// the last clone, or with the process.
    ///
    /// # Errors
    /// If the file cannot be made, or the disk is full.
    pub fn in_file(words: &[u32]) -> io::Result<SharedWords> {
        if words.is_empty() {
            return Ok(SharedWords::default());
        }
        let mut file = nameless_file()?;
        // Safety: each word is four bytes, and all bytes are initialised.
        let (_, bytes, _) = unsafe { words.align_to::<u8>() };
        file.write_all(bytes)?;
        // Safety: no one else can open the file, and this process only reads it from now on.
        let pages = unsafe { Mmap::map(&file) }?;
        Ok(SharedWords(Storage::File(Arc::new(pages))))
    }

    /// True if the words are in a file.
    pub fn is_in_file(&self) -> bool {
        matches!(self.0, Storage::File(_))
    }
}

/// The folder of temporary files: `TMPDIR`, or else `/var/tmp` where it exists, since `/tmp` is often a part of memory.
pub fn temporary_folder() -> PathBuf {
    let on_disk = PathBuf::from("/var/tmp");
    match std::env::var_os("TMPDIR") {
        None if on_disk.is_dir() => on_disk,
        _ => std::env::temp_dir(),
    }
}

/// Makes a file in [`temporary_folder`] and removes its name.
fn nameless_file() -> io::Result<File> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = temporary_folder().join(format!("rtsl-{}-{count}", std::process::id()));
        match options.open(&path) {
            // An earlier process with this number was killed before it could remove the name.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
            Ok(file) => return fs::remove_file(&path).map(|()| file),
        }
    }
}

impl Deref for SharedWords {
    type Target = [u32];

    #[inline]
    fn deref(&self) -> &[u32] {
        match &self.0 {
            Storage::Memory(words) => words,
            // Safety: a mapping begins at a page, so that its words are aligned, and any bits are words.
            Storage::File(pages) => unsafe { pages.align_to::<u32>().1 },
        }
    }
}

impl Default for SharedWords {
    fn default() -> SharedWords {
        SharedWords(Storage::Memory(Arc::default()))
    }
}

impl From<Arc<[u32]>> for SharedWords {
    fn from(words: Arc<[u32]>) -> SharedWords {
        SharedWords(Storage::Memory(words))
    }
}

impl From<Vec<u32>> for SharedWords {
    fn from(words: Vec<u32>) -> SharedWords {
        SharedWords(Storage::Memory(words.into()))
    }
}

impl FromIterator<u32> for SharedWords {
    fn from_iter<I: IntoIterator<Item = u32>>(words: I) -> SharedWords {
        SharedWords(Storage::Memory(words.into_iter().collect()))
    }
}

impl fmt::Debug for SharedWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.deref().fmt(f)
    }
}

impl PartialEq for SharedWords {
    fn eq(&self, other: &SharedWords) -> bool {
        self.deref() == other.deref()
    }
}

impl Eq for SharedWords {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_words() {
        let words: SharedWords = (0..10_000_u32).map(|it| it.wrapping_mul(0x9e37_79b9)).collect();
        let paged = SharedWords::in_file(&words).expect("the folder is writable");
        assert!(paged.is_in_file() && !words.is_in_file());
        assert_eq!(paged, words);
        let copy = paged.clone();
        drop(paged);
        assert_eq!(
            (copy.len(), copy[9_999], copy.as_ptr().addr() % 4096),
            (10_000, words[9_999], 0)
        );
    }

    #[test]
    fn no_words_need_no_file() {
        let none = SharedWords::in_file(&[]).expect("nothing is written");
        assert!(none.is_empty() && !none.is_in_file());
    }
}
