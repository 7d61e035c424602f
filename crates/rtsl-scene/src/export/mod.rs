//! Scenes of glTF files as texts in the format of pbrt-v4, with meshes and images in files beside them.
//!
//! Materials become the nearest of those that pbrt-v4 has. Images are copied where it applies them as glTF does, and
//! written anew where it has no operation for what glTF makes of them: factors, channels, cutoffs. What has no
//! counterpart is left out, and a warning names it once with the materials that have it.

mod materials;
mod meshes;
mod scene;
mod text;
mod textures;
mod values;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

use rtsl::{Diagnostic, Diagnostics, Messages, SourceMap, diagnostic_codes as codes};
use rtsl_memory::{Amount, InputBudget};

use crate::description::{Description, EntityId};
use crate::gltf::read_gltf_scene;
use crate::reader::FileSource;
use materials::Finish;
use meshes::MeshKey;
use text::Text;
use textures::Images;
use values::Names;

/// Options of a conversion.
pub struct ExportOptions<'o> {
    /// The camera, by its name or index; the first one if `None`.
    pub camera: Option<&'o str>,
    /// The memory budget for the files; that of [`InputBudget::new`] if `None`.
    pub input_memory: Option<Amount>,
    /// The name of the folder of meshes and images, relative to that of the text.
    pub folder: &'o str,
}

/// A converted scene.
#[derive(Debug)]
pub struct Exported {
    /// The text.
    pub text: String,
    /// Warnings.
    pub warnings: Messages,
}

/// An error of a conversion.
#[derive(Debug)]
pub enum ExportError {
    /// Errors of the file, with the warnings among them.
    Input(Messages),
    /// A result could not be written.
    Output(io::Error),
}

/// Writes a file with its name, which is relative to the folder of the text.
pub type WriteFile<'w> = dyn FnMut(&str, &[u8]) -> io::Result<()> + 'w;

/// Converts the glTF file `path` to a text in the format of pbrt-v4. Its meshes and images are written by `write`.
///
/// # Errors
/// All errors of the file, or the error of writing.
pub fn export_gltf(
    path: &Path,
    files: &dyn FileSource,
    options: &ExportOptions<'_>,
    write: &mut WriteFile<'_>,
) -> Result<Exported, ExportError> {
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    let budget = InputBudget::new(options.input_memory);
    let description =
        read_gltf_scene(path, options.camera, files, &budget, &mut map, &mut diagnostics);
    let mut messages = Messages::default();
    if diagnostics.has_errors() {
        messages.push(map, diagnostics);
        return Err(ExportError::Input(messages));
    }
    let mut exporter = Exporter::new(&description, path, files, options, write);
    exporter.scene();
    let (text, lost, error) = exporter.finish();
    if let Some(error) = error {
        return Err(ExportError::Output(error));
    }
    diagnostics.extend(lost);
    if !diagnostics.is_empty() {
        messages.push(map, diagnostics);
    }
    Ok(Exported { text, warnings: messages })
}

/// A conversion under way.
struct Exporter<'d, 'w> {
    description: &'d Description,
    names: Names<'d>,
    path: &'d Path,
    files: &'d dyn FileSource,
    input_memory: Option<Amount>,
    folder: &'d str,
    write: &'w mut WriteFile<'w>,
    text: Text,
    images: Images,
    finishes: BTreeMap<EntityId, Finish>,
    /// The files of meshes by their arrays.
    meshes: BTreeMap<MeshKey, String>,
    /// The names of objects.
    objects: Vec<String>,
    used_names: BTreeSet<String>,
    used_files: BTreeSet<String>,
    /// The features without counterpart, each with the materials that have it.
    lost: BTreeMap<&'static str, Vec<String>>,
    warnings: Vec<Diagnostic>,
    /// The first error of writing, after which nothing is written.
    error: Option<io::Error>,
}

impl<'d, 'w> Exporter<'d, 'w> {
    fn new(
        description: &'d Description,
        path: &'d Path,
        files: &'d dyn FileSource,
        options: &ExportOptions<'d>,
        write: &'w mut WriteFile<'w>,
    ) -> Self {
        Exporter {
            description,
            names: Names::of(description),
            path,
            files,
            input_memory: options.input_memory,
            folder: options.folder,
            write,
            text: Text::default(),
            images: Images::default(),
            finishes: BTreeMap::new(),
            meshes: BTreeMap::new(),
            objects: Vec::new(),
            used_names: BTreeSet::new(),
            used_files: BTreeSet::new(),
            lost: BTreeMap::new(),
            warnings: Vec::new(),
            error: None,
        }
    }

    /// The text, the warnings, and the error of writing.
    fn finish(self) -> (String, Vec<Diagnostic>, Option<io::Error>) {
        let lost = self.lost.into_iter().map(|(what, owners)| {
            let message = format!("pbrt-v4 has nothing like {what}: left out");
            let mut shown: Vec<String> =
                owners.iter().take(3).map(|owner| format!("`{owner}`")).collect();
            if owners.len() > shown.len() {
                shown.push(format!("{} more", owners.len() - shown.len()));
            }
            Diagnostic::new(codes::IGNORED_SETTING, message)
                .note(format!("in {}", shown.join(", ")))
        });
        let warnings = self.warnings.into_iter().chain(lost).collect();
        (self.text.finish(), warnings, self.error)
    }

    /// Notes that something of a material or a texture is lost.
    fn lose(&mut self, what: &'static str, owner: &str) {
        let owners = self.lost.entry(what).or_default();
        if !owners.iter().any(|it| it == owner) {
            owners.push(owner.to_owned());
        }
    }

    fn warn(&mut self, message: String) {
        self.warnings.push(Diagnostic::new(codes::IGNORED_SETTING, message));
    }

    /// A name that nothing else has.
    fn unique(&mut self, name: &str) -> String {
        let mut unique = name.to_owned();
        let mut number = 1;
        while !self.used_names.insert(unique.clone()) {
            number += 1;
            unique = format!("{name} {number}");
        }
        unique
    }

    /// A name of a file that no other has, in letters that every system allows.
    fn unique_file(&mut self, stem: &str, extension: &str) -> String {
        let plain = |letter: char| {
            if letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_') { letter } else { '_' }
        };
        let stem: String = stem.chars().map(plain).take(60).collect();
        let stem = if stem.is_empty() { "file".to_owned() } else { stem };
        let mut name = format!("{stem}.{extension}");
        let mut number = 1;
        // Some systems do not distinguish cases.
        while !self.used_files.insert(name.to_ascii_lowercase()) {
            number += 1;
            name = format!("{stem}-{number}.{extension}");
        }
        name
    }

    /// Writes a file into the folder and returns its name for the text.
    fn write(&mut self, name: &str, contents: &[u8]) -> String {
        let path = format!("{}/{name}", self.folder);
        if self.error.is_none() {
            self.error = (self.write)(&path, contents).err();
        }
        path
    }
}
