//! The buffers of a glTF file, which are in the file, in the JSON text or in separate files.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;

use base64::Engine;
use gltf::json::buffer::{Buffer, View};
use gltf::json::{Index, Root, Value};
use rtsl_memory::{Amount, Held, InputBudget, OverBudget};

use super::file::{ReadFile, size};
use super::meshopt::Compression;
use crate::mesh::MeshError;

/// The names of the extension that compresses buffer views. Its buffers may be without contents.
pub const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// The contents of all buffers.
pub struct Buffers<'a> {
    contents: Vec<Cow<'a, [u8]>>,
    /// The contents of buffer views that were compressed, or the error, by their indices.
    decoded: BTreeMap<usize, Result<Vec<u8>, &'static str>>,
    /// The memory of those.
    _held: Held,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers of a document.
    pub fn read(
        root: &Root,
        embedded: Option<&'a [u8]>,
        read: ReadFile<'_>,
        budget: &InputBudget,
    ) -> Result<Self, MeshError> {
        // Not all files mark the buffers that are compressed elsewhere.
        let is_compressed = root.extensions_used.iter().any(|it| MESHOPT.contains(&it.as_str()));
        let buffers = root.buffers.iter().map(|buffer| match &buffer.uri {
            Some(uri) => contents(uri, read).map(Cow::Owned),
            None if is_fallback(buffer) => Ok(Cow::Borrowed(&[][..])),
            None if embedded.is_none() && is_compressed => Ok(Cow::Borrowed(&[][..])),
            None => embedded.map(Cow::Borrowed).ok_or_else(|| {
                MeshError::Malformed("it refers to a binary part that it does not have".to_owned())
            }),
        });
        let contents = buffers.collect::<Result<Vec<_>, _>>()?;
        let compressed = compressed_views(root);
        let sizes = compressed.iter().map(|(_, it)| it.as_ref().map_or(0, CompressedView::size));
        let amount = sizes.map(|size| Amount(size as u64)).sum();
        let held = budget.hold(amount)?;
        let decode = |view: CompressedView| {
            let data = contents
                .get(view.buffer)
                .and_then(|bytes| bytes.get(view.offset..view.offset.checked_add(view.length)?));
            view.compression.decode(data.ok_or("its compressed data end outside their buffer")?)
        };
        let decoded =
            compressed.into_iter().map(|(index, view)| (index, view.and_then(decode))).collect();
        Ok(Buffers { contents, decoded, _held: held })
    }

    /// Returns the bytes of a buffer view, decompressed.
    ///
    /// # Errors
    /// If there are none.
    pub fn view(&self, root: &Root, index: Index<View>) -> Result<&[u8], &'static str> {
        match self.decoded.get(&index.value()) {
            Some(Ok(bytes)) => return Ok(bytes),
            Some(Err(problem)) => return Err(problem),
            None => {}
        }
        let view = root.buffer_views.get(index.value()).ok_or("refers to no buffer view")?;
        let (start, length) = (view.byte_offset.map_or(0, size), size(view.byte_length));
        let bytes = self.contents.get(view.buffer.value());
        let bytes = bytes.and_then(|bytes| bytes.get(start..start.checked_add(length)?));
        bytes.ok_or("ends outside its buffer")
    }
}

/// A buffer view that is compressed, and the place of its data.
struct CompressedView {
    buffer: usize,
    offset: usize,
    length: usize,
    compression: Compression,
}

impl CompressedView {
    /// The bytes that it may decompress to.
    fn size(&self) -> usize {
        let most = self.length.saturating_mul(MAX_RATIO);
        self.compression.stride.saturating_mul(self.compression.count).min(most)
    }
}

/// The greatest number of bytes that a byte decompresses to: one is the header of 64 in attributes.
const MAX_RATIO: usize = 64;

/// The compressed views of a file, by their indices.
fn compressed_views(root: &Root) -> Vec<(usize, Result<CompressedView, &'static str>)> {
    let views = root.buffer_views.iter().enumerate();
    let compressed = views.filter_map(|(index, view)| {
        let others = &view.extensions.as_ref()?.others;
        let extension = MESHOPT.iter().find_map(|name| others.get(*name))?;
        Some((index, compressed_view(extension)))
    });
    compressed.collect()
}

fn compressed_view(extension: &Value) -> Result<CompressedView, &'static str> {
    let number = |name: &str| extension[name].as_u64().and_then(|it| usize::try_from(it).ok());
    let members = (number("buffer"), number("byteLength"), number("byteStride"), number("count"));
    let (Some(buffer), Some(length), Some(stride), Some(count)) = members else {
        return Err("has a compression without buffer, length, stride or count");
    };
    let mode = extension["mode"].as_str().unwrap_or("");
    let filter = extension["filter"].as_str().unwrap_or("NONE");
    let compression = Compression::new(stride, count, mode, filter)?;
    Ok(CompressedView { buffer, offset: number("byteOffset").unwrap_or(0), length, compression })
}

/// True if a buffer has the place of one that is compressed elsewhere.
fn is_fallback(buffer: &Buffer) -> bool {
    let others = buffer.extensions.as_ref().map(|it| &it.others);
    let extension = others.and_then(|others| MESHOPT.iter().find_map(|name| others.get(*name)));
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
