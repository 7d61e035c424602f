//! The buffers of a glTF file, which are in the file, in the JSON text or in separate files.

use std::borrow::Cow;
use std::io;

use base64::Engine;
use gltf::json::buffer::{Buffer, View};
use gltf::json::{Index, Root};
use rtsl_memory::OverBudget;

use super::file::{ReadFile, size};
use crate::mesh::MeshError;

/// The extension that compresses buffer views. Its buffers may be without contents.
pub const MESHOPT: &str = "EXT_meshopt_compression";

/// The contents of all buffers.
pub struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

impl<'a> Buffers<'a> {
    /// Reads all buffers of a document.
    pub fn read(
        root: &Root,
        embedded: Option<&'a [u8]>,
        read: ReadFile<'_>,
    ) -> Result<Self, MeshError> {
        let buffers = root.buffers.iter().map(|buffer| match &buffer.uri {
            Some(uri) => contents(uri, read).map(Cow::Owned),
            None if is_fallback(buffer) => Ok(Cow::Borrowed(&[][..])),
            None => embedded.map(Cow::Borrowed).ok_or_else(|| {
                MeshError::Malformed("it refers to a binary part that it does not have".to_owned())
            }),
        });
        buffers.collect::<Result<_, _>>().map(Buffers)
    }

    /// Returns the bytes of a buffer view.
    pub fn view(&self, view: &View) -> Option<&[u8]> {
        self.range(view.buffer, view.byte_offset.map_or(0, size), size(view.byte_length))
    }

    /// Returns a range of the bytes of a buffer.
    pub fn range(&self, buffer: Index<Buffer>, start: usize, length: usize) -> Option<&[u8]> {
        self.0.get(buffer.value())?.get(start..start.checked_add(length)?)
    }
}

/// True if a buffer has the place of one that is compressed elsewhere.
fn is_fallback(buffer: &Buffer) -> bool {
    let extension = buffer.extensions.as_ref().and_then(|it| it.others.get(MESHOPT));
    extension.is_some_and(|it| it["fallback"].as_bool() == Some(true))
}

/// Returns the contents at a URI.
///
/// # Errors
/// If there are none.
pub fn contents(uri: &str, read: ReadFile<'_>) -> Result<Vec<u8>, MeshError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data.split_once(";base64,").unwrap_or_default();
        let bytes = base64::engine::general_purpose::STANDARD.decode(text);
        return bytes.map_err(|error| {
            MeshError::Malformed(format!("a buffer in its text is damaged: {error}"))
        });
    }
    if uri.contains("://") {
        return Err(MeshError::Malformed(format!("it refers to `{uri}`, expected a file")));
    }
    let path = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
    read(&path).map_err(|error| {
        if let Some(over) = OverBudget::of(&error) {
            return MeshError::OverBudget(*over);
        }
        let message = format!("cannot read `{path}`, which it refers to: {error}");
        MeshError::Unreadable(io::Error::new(error.kind(), message))
    })
}
