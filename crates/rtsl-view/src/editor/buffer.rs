//! A text that is edited, and its file.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl_image::atomic_write::replace_file;

use super::analyst::Findings;
use super::highlight::Highlighter;

/// The greatest size of a file that is opened, in bytes: larger ones take too long to be laid out while someone types.
const MAX_BYTES: u64 = 1 << 19;

/// A text with its file.
#[derive(Debug)]
pub struct Buffer {
    /// The name of the text in diagnostics and recordings.
    pub name: String,
    /// The text.
    pub text: String,
    /// The number of changes of the text.
    pub version: u64,
    /// The findings about the text, or about an earlier version of it.
    pub findings: Arc<Findings>,
    /// The colours of the text.
    pub highlighter: Highlighter,
    /// The content of the file that the text began with or was saved as; none for texts without a file.
    saved: Option<Saved>,
    /// The content of the file after another program has changed it.
    pub conflict: Option<Conflict>,
}

#[derive(Debug)]
struct Saved {
    path: PathBuf,
    text: String,
    /// True if its lines end as on Windows.
    has_returns: bool,
}

/// A change of the file by another program while the text had changes, too.
#[derive(Debug, PartialEq, Eq)]
pub enum Conflict {
    /// The file has this content.
    Changed(String),
    /// The file is gone.
    Removed,
}

/// An error of saving.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// Another program has changed the file.
    #[error("`{0}` has changed on the disk: load it, or keep this text, before saving")]
    Conflict(String),
    /// The file cannot be written.
    #[error("cannot write `{0}`: {1}")]
    Io(String, io::Error),
}

impl Buffer {
    /// Opens a file.
    ///
    /// # Errors
    /// If it cannot be read, is no text, or is too large.
    pub fn open(path: &Path) -> io::Result<Buffer> {
        let text = read(path)?;
        let has_returns = text.contains("\r\n");
        let text = text.replace("\r\n", "\n");
        let name = path.display().to_string();
        let saved = Saved { path: path.to_owned(), text: text.clone(), has_returns };
        Ok(Buffer { saved: Some(saved), ..Buffer::built_in(name, text) })
    }

    /// Returns a text without a file, which is not changed.
    pub fn built_in(name: String, text: String) -> Buffer {
        let (findings, highlighter) = (Arc::default(), Highlighter::default());
        Buffer { name, text, version: 0, findings, highlighter, saved: None, conflict: None }
    }

    /// Returns the name of the file without its folder.
    pub fn title(&self) -> &str {
        Path::new(&self.name).file_name().and_then(|name| name.to_str()).unwrap_or(&self.name)
    }

    /// True if the text can be changed.
    pub fn is_editable(&self) -> bool {
        self.saved.is_some()
    }

    /// True if the text differs from its file.
    pub fn is_unsaved(&self) -> bool {
        self.saved.as_ref().is_some_and(|saved| saved.text != self.text)
    }

    /// True if the text is one that the compiler knows: not a scene.
    pub fn is_shader(&self) -> bool {
        Path::new(&self.name).extension().is_some_and(|it| it == "rtsl")
    }

    /// Replaces the text.
    pub fn replace(&mut self, text: String) {
        self.text = text;
        self.version += 1;
    }

    /// Looks whether another program has changed the file: a text without changes follows it, another one is in
    /// conflict with it. Returns true if the text has changed.
    pub fn look_at_file(&mut self) -> bool {
        let is_unsaved = self.is_unsaved();
        let Some(saved) = &mut self.saved else { return false };
        match read(&saved.path) {
            Ok(text) => {
                saved.has_returns = text.contains("\r\n");
                let text = text.replace("\r\n", "\n");
                if text == saved.text {
                    self.conflict = None;
                } else if !is_unsaved || text == self.text {
                    saved.text.clone_from(&text);
                    self.conflict = None;
                    let is_new = text != self.text;
                    if is_new {
                        self.replace(text);
                    }
                    return is_new;
                } else {
                    self.conflict = Some(Conflict::Changed(text));
                }
            }
            // Editors replace files: one that is gone for a moment is no conflict while there is nothing to lose.
            Err(error) if error.kind() == io::ErrorKind::NotFound && is_unsaved => {
                self.conflict = Some(Conflict::Removed);
            }
            Err(_) => {}
        }
        false
    }

    /// Ends a conflict: takes the text of the file, or keeps this one, which the next save writes.
    pub fn resolve(&mut self, takes_file: bool) {
        let Some(conflict) = self.conflict.take() else { return };
        let on_disk = match conflict {
            Conflict::Changed(text) => text,
            Conflict::Removed => String::new(),
        };
        if let Some(saved) = &mut self.saved {
            saved.text.clone_from(&on_disk);
        }
        if takes_file {
            self.replace(on_disk);
        }
    }

    /// Writes the text to its file.
    ///
    /// # Errors
    /// If another program has changed the file, or it cannot be written.
    pub fn save(&mut self) -> Result<(), SaveError> {
        self.look_at_file();
        let Some(saved) = &mut self.saved else { return Ok(()) };
        if self.conflict.is_some() {
            return Err(SaveError::Conflict(saved.path.display().to_string()));
        }
        let content = match saved.has_returns {
            true => self.text.replace('\n', "\r\n"),
            false => self.text.clone(),
        };
        replace_file(&saved.path, |output| output.write_all(content.as_bytes()))
            .map_err(|error| SaveError::Io(saved.path.display().to_string(), error))?;
        saved.text.clone_from(&self.text);
        Ok(())
    }
}

fn read(path: &Path) -> io::Result<String> {
    let mut file = rtsl::open_regular_file(path)?;
    let length = file.metadata()?.len();
    if length > MAX_BYTES {
        let message = format!("it has {length} bytes; the editor opens at most {MAX_BYTES}");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    let mut text = String::new();
    file.read_to_string(&mut text)?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn file(text: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rtsl");
        fs::write(&path, text).unwrap();
        (folder, path)
    }

    #[test]
    fn texts_are_saved_with_their_ends_of_lines() {
        let (folder, path) = file("one\r\ntwo\r\n");
        let mut buffer = Buffer::open(&path).unwrap();
        assert_eq!((buffer.text.as_str(), buffer.is_unsaved()), ("one\ntwo\n", false));
        buffer.replace("one\nthree\n".to_owned());
        assert!(buffer.is_unsaved());
        buffer.save().unwrap();
        assert!(!buffer.is_unsaved());
        assert_eq!(fs::read_to_string(&path).unwrap(), "one\r\nthree\r\n");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
    }

    #[test]
    fn a_text_without_changes_follows_its_file() {
        let (_folder, path) = file("one");
        let mut buffer = Buffer::open(&path).unwrap();
        fs::write(&path, "two").unwrap();
        assert!(buffer.look_at_file());
        assert_eq!((buffer.text.as_str(), buffer.is_unsaved()), ("two", false));
        assert!(!buffer.look_at_file());
    }

    #[test]
    fn no_text_is_lost_in_a_conflict() {
        let (_folder, path) = file("one");
        let mut buffer = Buffer::open(&path).unwrap();
        buffer.replace("mine".to_owned());
        fs::write(&path, "theirs").unwrap();
        assert!(!buffer.look_at_file());
        assert_eq!(buffer.text, "mine");
        assert!(matches!(buffer.save(), Err(SaveError::Conflict(_))));
        assert_eq!(fs::read_to_string(&path).unwrap(), "theirs");
        buffer.resolve(false);
        assert!(buffer.is_unsaved());
        buffer.save().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine");

        buffer.replace("mine again".to_owned());
        fs::write(&path, "theirs again").unwrap();
        buffer.look_at_file();
        buffer.resolve(true);
        assert_eq!((buffer.text.as_str(), buffer.is_unsaved()), ("theirs again", false));
    }

    #[test]
    fn files_that_are_no_texts_are_not_opened() {
        let (_folder, path) = file("");
        fs::write(&path, [0xFF, 0xFE]).unwrap();
        assert!(Buffer::open(&path).is_err());
    }
}
