//! The parts of a glTF file: its JSON structure and its buffers, which are in the file, in the JSON text or in separate
//! files.

use std::borrow::Cow;
use std::io;

use base64::Engine;
use gltf::buffer::{Source, View};
use gltf::{Document, Glb};
use rtsl_memory::{Amount, OverBudget};

use crate::mesh::MeshError;

/// An upper bound of the memory of a file's structure: each element becomes a struct of limited size, each reference in
/// a list may be invalid and give a message, and texts, including buffers encoded in them, are copied.
pub fn structure_memory(bytes: &[u8]) -> Result<Amount, MeshError> {
    const THING: Amount = Amount(512);
    const MESSAGE: Amount = Amount(128);
    let (json, _) = parts(bytes)?;
    let count = |wanted: u8| json.iter().filter(|byte| **byte == wanted).count();
    let texts = Amount(json.len() as u64).times(4);
    Ok(THING.times(count(b'{')) + MESSAGE.times(count(b',')) + texts)
}

/// Returns the JSON text and the embedded buffer of a file.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    if bytes.starts_with(b"glTF") { split(bytes) } else { Ok((bytes, None)) }
}

/// Parses the structure of a file; also returns its embedded buffer.
pub fn open(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), MeshError> {
    let (json, embedded) = parts(bytes)?;
    let root = gltf::json::Root::from_slice(json)
        .map_err(|error| MeshError::Malformed(format!("it is not a glTF file: {error}")))?;
    check_attributes(&root)?;
    let document =
        Document::from_json(root).map_err(|error| MeshError::Malformed(describe(error)))?;
    Ok((document, embedded))
}

/// Checks that all attributes refer to existing accessors: the library looks at those of positions before it checks
/// this.
fn check_attributes(root: &gltf::json::Root) -> Result<(), MeshError> {
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut accessors = primitives.flat_map(|primitive| primitive.attributes.values());
    match accessors.find(|index| index.value() >= root.accessors.len()) {
        Some(index) => Err(MeshError::Malformed(format!(
            "it refers to accessor {}, which does not exist",
            index.value()
        ))),
        None => Ok(()),
    }
}

/// Splits a binary file into its JSON text and its buffer.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    // The library subtracts the header's length from this length without a check.
    let length = bytes.get(8..12).map_or(0, |it| u32::from_le_bytes([it[0], it[1], it[2], it[3]]));
    if length < 12 {
        return Err(MeshError::Truncated("its header".to_owned()));
    }
    let parts = Glb::from_slice(bytes).map_err(|error| MeshError::Malformed(describe(error)))?;
    let json = borrowed(parts.json).unwrap_or_default();
    Ok((json, parts.bin.and_then(borrowed)))
}

/// The borrowed bytes of a part.
fn borrowed(part: Cow<'_, [u8]>) -> Option<&[u8]> {
    match part {
        Cow::Borrowed(part) => Some(part),
        Cow::Owned(_) => None,
    }
}

/// The text of the first error.
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
    /// Reads all buffers of a document.
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

    /// Returns the bytes of a buffer view.
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
