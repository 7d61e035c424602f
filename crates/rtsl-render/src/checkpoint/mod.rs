//! Checkpoints: the state of a render in a file from which it can be resumed, with the same bits as without the
//! interruption.
//!
//! A checkpoint contains a [`Fingerprint`] of all inputs of the image and sections of numbers, which only the renderer
//! interprets. The file is replaced atomically, so that an interruption at any moment leaves the previous one. Damaged
//! files are rejected with the reason. Writing replaces only checkpoints of the same render.

mod container;
mod error;
mod fingerprint;

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;

use rtsl_image::atomic_write::Replacement;
use rtsl_memory::open_regular_file;

pub use error::{CheckpointError, Damage, Occupant};
pub use fingerprint::{Difference, Fingerprint, FingerprintValue};

/// The state of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint<'a> {
    /// The inputs of the image.
    pub fingerprint: Fingerprint,
    /// The numbers of the renderer.
    pub sections: Vec<Section<'a>>,
}

/// A named array of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Section<'a> {
    /// The name.
    pub name: Cow<'a, str>,
    /// The numbers.
    pub numbers: Numbers<'a>,
}

/// An array of numbers of one type. All bits are preserved, including those of NaN.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers<'a> {
    /// binary64
    F64(Cow<'a, [f64]>),
    /// binary32
    F32(Cow<'a, [f32]>),
    /// Whole numbers.
    U32(Cow<'a, [u32]>),
}

impl<'a> Section<'a> {
    /// A section of numbers in binary64.
    pub fn f64(name: &'a str, numbers: &'a [f64]) -> Self {
        Section { name: name.into(), numbers: Numbers::F64(numbers.into()) }
    }

    /// A section of numbers in binary32.
    pub fn f32(name: &'a str, numbers: &'a [f32]) -> Self {
        Section { name: name.into(), numbers: Numbers::F32(numbers.into()) }
    }

    /// A section of whole numbers.
    pub fn u32(name: &'a str, numbers: &'a [u32]) -> Self {
        Section { name: name.into(), numbers: Numbers::U32(numbers.into()) }
    }
}

impl Checkpoint<'_> {
    /// Writes the checkpoint, replacing an earlier one of the same render.
    ///
    /// # Errors
    /// If the file cannot be written, or the path is occupied by another file, which then stays unchanged.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let replacement = begin_replacement(path, &self.fingerprint)?;
        let written = replacement.finish(|file| {
            let mut buffered = BufWriter::new(file);
            self.write_to(&mut buffered)?;
            buffered.flush()
        });
        written.map_err(|error| unwritable(path, &error))
    }

    /// Checks that a checkpoint with this fingerprint can be written to a path.
    ///
    /// # Errors
    /// As for [`Checkpoint::write`].
    pub fn check_place(path: &Path, fingerprint: &Fingerprint) -> Result<(), CheckpointError> {
        begin_replacement(path, fingerprint).map(drop)
    }

    /// Writes the bytes of the checkpoint.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn write_to(&self, writer: &mut dyn Write) -> std::io::Result<()> {
        container::write(self, writer)
    }

    /// Returns the binary64 numbers of a section.
    pub fn f64(&self, name: &str) -> Option<&[f64]> {
        match self.numbers(name)? {
            Numbers::F64(numbers) => Some(numbers),
            Numbers::F32(_) | Numbers::U32(_) => None,
        }
    }

    /// Returns the binary32 numbers of a section.
    pub fn f32(&self, name: &str) -> Option<&[f32]> {
        match self.numbers(name)? {
            Numbers::F32(numbers) => Some(numbers),
            Numbers::F64(_) | Numbers::U32(_) => None,
        }
    }

    /// Returns the integers of a section.
    pub fn u32(&self, name: &str) -> Option<&[u32]> {
        match self.numbers(name)? {
            Numbers::U32(numbers) => Some(numbers),
            Numbers::F64(_) | Numbers::F32(_) => None,
        }
    }

    fn numbers(&self, name: &str) -> Option<&Numbers<'_>> {
        self.sections.iter().find(|section| section.name == name).map(|section| &section.numbers)
    }
}

impl Checkpoint<'static> {
    /// Reads a checkpoint of any render.
    ///
    /// # Errors
    /// If the file cannot be read, is not a checkpoint, or is damaged.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        Self::read_open(path, open_regular_file(path))
    }

    fn read_open(path: &Path, file: std::io::Result<File>) -> Result<Self, CheckpointError> {
        let unreadable = |error: std::io::Error| CheckpointError::Unreadable {
            path: path.to_owned(),
            reason: error.to_string(),
        };
        let mut file = file.map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        container::read(&mut file, length)
            .map_err(|damage| CheckpointError::Damaged { path: path.to_owned(), damage })
    }

    /// Reads a checkpoint of the render with the fingerprint `expected`.
    ///
    /// # Errors
    /// As for [`Checkpoint::read`], and if it belongs to another render.
    pub fn read_for(path: &Path, expected: &Fingerprint) -> Result<Self, CheckpointError> {
        Self::read(path)?.of_render(path, expected)
    }

    /// Reads the checkpoint of that render; `None` if there is no file.
    ///
    /// # Errors
    /// As for [`Checkpoint::read_for`].
    pub fn find_for(path: &Path, expected: &Fingerprint) -> Result<Option<Self>, CheckpointError> {
        match open_regular_file(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            file => Self::read_open(path, file)?.of_render(path, expected).map(Some),
        }
    }

    fn of_render(self, path: &Path, expected: &Fingerprint) -> Result<Self, CheckpointError> {
        match self.fingerprint.difference(expected) {
            None => Ok(self),
            Some(difference) => Err(CheckpointError::Foreign { path: path.to_owned(), difference }),
        }
    }

    /// Reads a checkpoint from memory.
    ///
    /// # Errors
    /// If the bytes are not a checkpoint, or are damaged.
    pub fn from_bytes(mut bytes: &[u8]) -> Result<Self, Damage> {
        let length = bytes.len() as u64;
        container::read(&mut bytes, length)
    }
}

fn unwritable(path: &Path, error: &std::io::Error) -> CheckpointError {
    CheckpointError::Unwritable { path: path.to_owned(), reason: error.to_string() }
}

/// Begins to replace the checkpoint of the render with this fingerprint. The existing file is checked under the lock of
/// the replacement, so that no other render can write between the check and the end.
fn begin_replacement(
    path: &Path,
    fingerprint: &Fingerprint,
) -> Result<Replacement, CheckpointError> {
    let replacement = Replacement::begin(path).map_err(|error| unwritable(path, &error))?;
    match occupant(replacement.place(), fingerprint).map_err(|error| unwritable(path, &error))? {
        None => Ok(replacement),
        Some(occupant) => Err(CheckpointError::Occupied { path: path.to_owned(), occupant }),
    }
}

/// Returns the content of a path that is not a checkpoint of the render. An empty file counts as nothing, because tools
/// create empty files to reserve names.
fn occupant(place: &Path, fingerprint: &Fingerprint) -> std::io::Result<Option<Occupant>> {
    let file = match open_regular_file(place) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let length = file.metadata()?.len();
    if length == 0 {
        return Ok(None);
    }
    Ok(match container::read_fingerprint(&mut BufReader::new(file), length) {
        Ok(found) => found.difference(fingerprint).map(Occupant::OtherRender),
        Err(damage) => Some(Occupant::Unknown(damage)),
    })
}
