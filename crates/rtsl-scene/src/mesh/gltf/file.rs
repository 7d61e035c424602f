//! A glTF file: its JSON structure and its buffers.

use std::borrow::Cow;
use std::io;

use gltf::Glb;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Index, Root, Value};
use rtsl::encoding;
use rtsl_memory::{Amount, InputBudget};

use super::buffers::Buffers;
use super::draco::{DRACO, Decoded};
use crate::mesh::MeshError;

/// Returns the contents of the files that a glTF file refers to.
pub type ReadFile<'r> = &'r dyn Fn(&str) -> io::Result<Vec<u8>>;

/// A glTF file. Indices in its structure may be invalid.
pub struct GltfFile<'a> {
    /// The structure.
    pub root: Root,
    /// The contents of the buffers.
    pub buffers: Buffers<'a>,
    /// Primitives that were compressed.
    pub decoded: Decoded,
}

/// An upper bound of the memory of a file's structure: each element becomes a struct of limited size, each reference in
/// a list may be invalid and give a message, and texts, including buffers encoded in them, are copied.
pub fn structure_memory(bytes: &[u8]) -> Result<Amount, MeshError> {
    const THING: Amount = Amount(512);
    const MEMBER: Amount = Amount(128);
    let (json, _) = parts(bytes)?;
    let count = |wanted: u8| json.iter().filter(|byte| **byte == wanted).count();
    let texts = Amount(json.len() as u64).times(4);
    Ok(THING.times(count(b'{')) + MEMBER.times(count(b',')) + texts)
}

impl<'a> GltfFile<'a> {
    /// Parses the structure of a file and reads its buffers, whose compressed parts the budget must allow.
    ///
    /// # Errors
    /// If one of the files is invalid or cannot be read.
    pub fn open(
        bytes: &'a [u8],
        read: ReadFile<'_>,
        budget: &InputBudget,
    ) -> Result<Self, MeshError> {
        let (json, embedded) = parts(bytes)?;
        let mut root = structure(json)?;
        if !root.asset.version.starts_with('2') {
            return Err(MeshError::OtherFormat(other_version(&root.asset.version)));
        }
        let buffers = Buffers::read(&root, embedded, read, budget)?;
        let decoded = Decoded::decode(&mut root, &buffers, budget);
        Ok(GltfFile { root, buffers, decoded })
    }

    /// Returns an accessor.
    ///
    /// # Errors
    /// If it does not exist.
    pub fn accessor(&self, index: Index<Accessor>) -> Result<&Accessor, MeshError> {
        self.root.accessors.get(index.value()).ok_or_else(|| {
            let message = format!("it refers to accessor {}, which does not exist", index.value());
            MeshError::Malformed(message)
        })
    }

    /// Returns the root nodes of the default scene, or of the first if there is no default. Without scenes, all nodes
    /// that have no parent are roots.
    pub fn root_nodes(&self) -> Vec<Index<Node>> {
        let default = self.root.scene.and_then(|scene| self.root.scenes.get(scene.value()));
        if let Some(scene) = default.or_else(|| self.root.scenes.first()) {
            return scene.nodes.clone();
        }
        let mut is_root = vec![true; self.root.nodes.len()];
        for child in self.root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
            if let Some(is_root) = is_root.get_mut(child.value()) {
                *is_root = false;
            }
        }
        let roots = is_root.iter().enumerate().filter(|(_, is_root)| **is_root);
        roots.map(|(index, _)| Index::new(index as u32)).collect()
    }

    /// Checks that a primitive is not compressed in a way that could not be decoded.
    ///
    /// # Errors
    /// If it is.
    pub fn check_compression(&self, primitive: &Primitive) -> Result<(), MeshError> {
        match self.decoded.problem(&self.root, primitive) {
            Some(problem) => Err(MeshError::Compressed(format!("`{DRACO}`: {problem}"))),
            None => Ok(()),
        }
    }
}

/// Returns the accessor of a primitive's attribute.
pub fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    primitive.attributes.get(&Checked::Valid(semantic)).copied()
}

/// Returns a size as an index of memory, or the greatest.
pub fn size(number: USize64) -> usize {
    usize::try_from(number.0).unwrap_or(usize::MAX)
}

/// Returns the JSON text and the embedded buffer of a file.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    let (json, embedded) = if bytes.starts_with(b"glTF") { split(bytes)? } else { (bytes, None) };
    encoding::check_width(json).map_err(|problem| MeshError::Malformed(problem.to_owned()))?;
    Ok((encoding::without_mark(json), embedded))
}

/// Splits a binary file into its JSON text and its buffer.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    // The library subtracts the header's length from this length without a check.
    let length = bytes.get(8..12).map_or(0, |it| u32::from_le_bytes([it[0], it[1], it[2], it[3]]));
    if length < 12 {
        return Err(MeshError::Truncated("its header".to_owned()));
    }
    let parts = Glb::from_slice(bytes).map_err(|error| MeshError::Malformed(error.to_string()))?;
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

/// Parses the JSON text. If it does not have the form that the library expects, that may be for parts that are not
/// read.
fn structure(json: &[u8]) -> Result<Root, MeshError> {
    let error = match Root::from_slice(json) {
        Ok(root) => return Ok(root),
        Err(error) => error,
    };
    let value: Option<Value> = gltf::json::deserialize::from_slice(json).ok();
    let Some(mut value) = value.filter(Value::is_object) else { return Err(malformed(&error)) };
    let version = value["asset"]["version"].as_str();
    if let Some(version) = version.filter(|version| !version.starts_with('2')) {
        return Err(MeshError::OtherFormat(other_version(version)));
    }
    if let Some(members) = value.as_object_mut() {
        members.remove("animations");
        // Scenes may be empty.
        let scenes = members.get_mut("scenes").and_then(Value::as_array_mut);
        for scene in scenes.into_iter().flatten().filter_map(Value::as_object_mut) {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    gltf::json::deserialize::from_value(value).map_err(|_| malformed(&error))
}

fn malformed(error: &gltf::json::Error) -> MeshError {
    if error.is_eof() {
        return MeshError::Truncated("its JSON text".to_owned());
    }
    MeshError::OtherFormat(format!("it is not a glTF file: {error}"))
}

fn other_version(version: &str) -> String {
    let shown: String = version.chars().take(20).collect();
    format!("it is a glTF file of version {shown}, expected version 2")
}
