//! glTF 2.0 files as scenes: the same [`Description`] that the reader of pbrt's format makes.
//!
//! Meshes become shapes whose buffers are in memory, materials layers of the classes `GltfPbr`, `GltfSheen`,
//! `NormalMap` and `GltfCoat`, textures the class `GltfTexture` over images, which may be bytes in the file. A file
//! without a camera is shown from the front, the right and above; one without lights stands in a studio.
//!
//! Files are untrusted: whatever is invalid is left out with a warning, and memory is reserved in the budget before it
//! is allocated. Messages point to a list of the file's objects, because the file itself may be binary.

mod attributes;
mod builder;
mod cameras;
mod extension;
mod hierarchy;
mod lights;
mod materials;
mod outline;
mod shapes;
mod strokes;
mod surface;
mod tangents;
mod textures;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use gltf::json::Root;
use rtsl::{Diagnostic, Diagnostics, SourceMap, diagnostic_codes as codes};
use rtsl_memory::InputBudget;

use crate::description::Description;
use crate::mesh::MeshError;
use crate::mesh::gltf::{GltfFile, structure_memory};
use crate::reader::{FileSource, Input, resolve, unreadable};
use crate::studio::add_studio;
pub use attributes::FileAttributes;
use builder::Builder;
use extension::Extension;
use hierarchy::Hierarchy;
use outline::{Kind, Outline};

/// True if the name of a file is that of a glTF file.
pub fn is_gltf(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|it| it.eq_ignore_ascii_case("glb") || it.eq_ignore_ascii_case("gltf"))
}

/// Reads the scene of a glTF file, shown by the camera of this name or index, if one is given.
///
/// Errors and warnings go to `diagnostics`; what can be read is in the description nevertheless.
pub fn read_gltf_scene(
    path: &Path,
    camera: Option<&str>,
    files: &dyn FileSource,
    budget: &InputBudget,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Description {
    let read = |builder: &mut Builder<'_>| builder.scene(camera);
    let read = with_builder(path, files, budget, map, diagnostics, read);
    read.map_or_else(Description::default, |(description, _)| description)
}

/// Opens a file for a builder and returns what that made; `None` if the file cannot be read, which is reported.
fn with_builder(
    path: &Path,
    files: &dyn FileSource,
    budget: &InputBudget,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
    build: impl FnOnce(&mut Builder<'_>),
) -> Option<(Description, FileAttributes)> {
    let read = || {
        let Input { bytes, held } = Input::read(files, path, budget)?;
        let of_structure = budget.hold(structure_memory(&bytes)?)?;
        Ok::<_, MeshError>((bytes, held, of_structure))
    };
    let (bytes, _held, _of_structure) = match read() {
        Ok(read) => read,
        Err(error) => {
            diagnostics.push(unusable(path, error));
            return None;
        }
    };
    let buffers = RefCell::new(Vec::new());
    let read = |name: &str| {
        let Input { bytes, held } = Input::read(files, &resolve(path, name), budget)?;
        buffers.borrow_mut().push(held);
        Ok(bytes)
    };
    let file = match GltfFile::open(&bytes, &read, budget) {
        Ok(file) => file,
        Err(error) => {
            diagnostics.push(unusable(path, error));
            return None;
        }
    };
    let lights = names_of_lights(&file.root);
    let outline = Outline::new(&path.display().to_string(), &file.root, &lights, map);
    let mut builder = Builder {
        file,
        path,
        files,
        budget,
        outline,
        diagnostics,
        description: Description::default(),
        said: BTreeSet::new(),
        images: BTreeMap::new(),
        image_entities: BTreeMap::new(),
        finishes: BTreeMap::new(),
        placed: BTreeSet::new(),
        has_lamps: false,
        attributes: FileAttributes::default(),
        names: BTreeSet::new(),
    };
    build(&mut builder);
    Some((builder.description, builder.attributes))
}

impl Builder<'_> {
    fn scene(&mut self, camera: Option<&str>) {
        self.warn_of_required_extensions();
        let hierarchy = Hierarchy::new(&self.file);
        for node in &hierarchy.repeated {
            let message =
                format!("node {node} has two parents or contains itself: only one counts");
            self.warn(message, self.outline.span(Kind::Node, *node));
        }
        let bounds = self.add_shapes(&hierarchy);
        if bounds.is_empty() {
            let message = format!("`{}` shows no surface", self.path.display());
            let mut diagnostic = Diagnostic::new(codes::BAD_MESH, message);
            if self.said.is_empty() {
                diagnostic = diagnostic.note("its scene has no mesh with triangles");
            }
            self.diagnostics.push(diagnostic.at(self.outline.whole(), ""));
        }
        self.add_lights(&hierarchy);
        let has_lights = !self.description.lights.is_empty();
        if !has_lights {
            // Scenes with lamps have a part of its light.
            let scale = if self.has_lamps { 0.25 } else { 1.0 };
            add_studio(&mut self.description, self.path, scale, self.outline.whole(), self.budget);
        }
        let has_camera = self.add_camera(&hierarchy, &bounds, camera);
        let note = match (has_camera, has_lights) {
            (true, true) => return,
            (true, false) => "the file has no lights: a studio lights the scene",
            (false, true) => {
                "the file has no camera: one that shows all of the scene takes its place"
            }
            (false, false) => {
                "the file has neither camera nor lights: all of the scene is shown in a studio"
            }
        };
        self.description.notes.push(note.to_owned());
    }

    /// Warns of extensions without which the file's author does not want it shown.
    fn warn_of_required_extensions(&mut self) {
        let required = self.file.root.extensions_required.clone();
        let is_new =
            |name: &&String| !is_supported(name) && !lights::OTHERS.contains(&name.as_str());
        for name in required.iter().filter(is_new) {
            let message = format!("the file requires `{name}`, which is not supported");
            self.warn(message, self.outline.whole());
        }
    }
}

/// True for extensions that are read, or have no effect on pictures.
fn is_supported(name: &str) -> bool {
    const OTHERS: [&str; 4] =
        [lights::PUNCTUAL, "KHR_texture_transform", "KHR_animation_pointer", "KHR_xmp_json_ld"];
    OTHERS.contains(&name)
        || materials::SUPPORTED.contains(&name)
        || shapes::SUPPORTED.contains(&name)
        || textures::SUPPORTED.contains(&name)
}

fn names_of_lights(root: &Root) -> Vec<Option<&str>> {
    let punctual = root.extensions.as_ref().and_then(|it| it.others.get(lights::PUNCTUAL));
    let lights = punctual.map(|it| Extension(it).list("lights"));
    lights.into_iter().flatten().map(|light| light.text("name")).collect()
}

fn unusable(path: &Path, error: MeshError) -> Diagnostic {
    match error {
        MeshError::OverBudget(error) => error.diagnostic(path.display()),
        MeshError::Unreadable(error) => unreadable(path, &error),
        error => {
            let message = format!("`{}` cannot be used: {error}", path.display());
            Diagnostic::new(codes::BAD_MESH, message).help(error.remedy())
        }
    }
}
