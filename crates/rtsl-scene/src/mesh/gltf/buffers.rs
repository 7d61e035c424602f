//! The parts of a glTF file: its structure, and its buffers, which lie in the file, in its text or
//! in files beside it.

use std::borrow::Cow;
use std::io;

use base64::Engine;
use gltf::buffer::{Source, View};
use gltf::{Document, Glb};
use rtsl_memory::{Amount, OverBudget};

use crate::mesh::MeshError;

/// What the structure of a file takes in memory, at most: things of it are structs of up to so many bytes; each
/// number of a list may refer to nothing, which is a message; and texts, with buffers in them, are copied.
pub fn structure_memory(bytes: &[u8]) -> Result<Amount, MeshError> {
    const THING: Amount = Amount(512);
    const MESSAGE: Amount = Amount(128);
    let (json, _) = parts(bytes)?;
    let count = |wanted: u8| json.iter().filter(|byte| **byte == wanted).count();
    let texts = Amount(json.len() as u64).times(4);
    Ok(THING.times(count(b'{')) + MESSAGE.times(count(b',')) + texts)
}

/// The text of a file's structure, and the buffer that lies in the file.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    if bytes.starts_with(b"glTF") { split(bytes) } else { Ok((bytes, None)) }
}

/// The structure of a file, and the buffer that lies in it.
pub fn open(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), MeshError> {
    let (json, embedded) = parts(bytes)?;
    let root = gltf::json::Root::from_slice(json)
        .map_err(|error| MeshError::Malformed(format!("it is no glTF file: {error}")))?;
    check_attributes(&root)?;
    let document =
        Document::from_json(root).map_err(|error| MeshError::Malformed(describe(error)))?;
    Ok((document, embedded))
}

/// Whether all attributes lead to accessors: the library's checks look at those of positions before
/// they check that.
fn check_attributes(root: &gltf::json::Root) -> Result<(), MeshError> {
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut accessors = primitives.flat_map(|primitive| primitive.attributes.values());
    match accessors.find(|index| index.value() >= root.accessors.len()) {
        Some(index) => Err(MeshError::Malformed(format!(
            "it refers to accessor {}, which is none",
            index.value()
        ))),
        None => Ok(()),
    }
}

/// The two parts of a binary file.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    // A length below that of the header is subtracted from without a check.
    let length = bytes.get(8..12).map_or(0, |it| u32::from_le_bytes([it[0], it[1], it[2], it[3]]));
    if length < 12 {
        return Err(MeshError::Truncated("its header".to_owned()));
    }
    let parts = Glb::from_slice(bytes).map_err(|error| MeshError::Malformed(describe(error)))?;
    let json = borrowed(parts.json).unwrap_or_default();
    Ok((json, parts.bin.and_then(borrowed)))
}

/// What lies in the bytes that were split.
fn borrowed(part: Cow<'_, [u8]>) -> Option<&[u8]> {
    match part {
        Cow::Borrowed(part) => Some(part),
        Cow::Owned(_) => None,
    }
}

/// The first of the things that are wrong.
fn describe(error: gltf::Error) -> String {
    match error {
        gltf::Error::Validation(errors) => match errors.first() {
            Some((path, error)) => format!("at `{path}`: {error}"),
            None => "its structure is wrong".to_owned(),
        },
        error => error.to_string(),
    }
}

/// The contents of all buffers.
pub struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

impl<'a> Buffers<'a> {
    /// Reads the buffers of a document.
    pub fn read(
        document: &Document,
        embedded: Option<&'a [u8]>,
        read: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, MeshError> {
        let buffers = document.buffers().map(|buffer| match buffer.source() {
            Source::Bin => embedded.map(Cow::Borrowed).ok_or_else(|| {
                MeshError::Malformed("it refers to a binary part that it does not have".to_owned())
            }),
            Source::Uri(uri) => contents(uri, read).map(Cow::Owned),
        });
        buffers.collect::<Result<_, _>>().map(Buffers)
    }

    /// The bytes of a view.
    pub fn view(&self, view: &View<'_>) -> Option<&[u8]> {
        let end = view.offset().checked_add(view.length())?;
        self.0.get(view.buffer().index())?.get(view.offset()..end)
    }
}

fn contents(uri: &str, read: &dyn Fn(&str) -> io::Result<Vec<u8>>) -> Result<Vec<u8>, MeshError> {
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
