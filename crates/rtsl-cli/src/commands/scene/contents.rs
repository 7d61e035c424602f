//! The contents of a scene.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rtsl::{Instance, Messages, diagnostic_codes as codes};
use rtsl_render::extent::SceneExtent;
use rtsl_scene::gltf::is_gltf;
use rtsl_scene::is_mesh_file;
use rtsl_scene::reader::RecordedFiles;
use rtsl_scene::{Description, Entity, EntityId, EntityKind, Loaded, SceneSource};
use serde::Serialize;

/// The contents of a scene, in the form of `--json`.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Contents {
    pub scene: String,
    /// `pbrt-v4`, `pbrt-v3 or earlier`, `glTF`, or `mesh`.
    pub format: &'static str,
    pub camera: String,
    pub film: String,
    pub width: usize,
    pub height: usize,
    pub filter: String,
    pub sampler: String,
    pub samples_per_pixel: u32,
    pub integrator: String,
    pub max_depth: u32,
    pub shapes: Shapes,
    pub materials: BTreeMap<String, usize>,
    pub textures: BTreeMap<String, usize>,
    pub lights: BTreeMap<String, usize>,
    pub area_lights: BTreeMap<String, usize>,
    /// The number of shapes with an area light, without repetition by instances.
    pub emitting_shapes: usize,
    pub images: Vec<Image>,
    pub bounds: Option<[[f32; 3]; 2]>,
    pub unbounded_shapes: usize,
    pub hierarchy: Hierarchy,
    pub files: Vec<File>,
    pub warnings: Vec<Warning>,
}

/// The shapes.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Shapes {
    /// The shapes by class, without repetition by instances.
    pub classes: BTreeMap<String, usize>,
    /// The number of objects that instances place, and of instances.
    pub objects: usize,
    pub instances: usize,
    /// The number of triangles, and of all that rays can meet.
    pub triangles: u64,
    pub instanced_triangles: u64,
    pub mesh_bytes: u64,
}

/// An image.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Image {
    /// The name in the scene.
    pub name: String,
    pub width: u32,
    pub height: u32,
    pub channels: u32,
    pub bits: u32,
    pub bytes: u64,
    /// True if the texels are in a temporary file.
    pub in_file: bool,
}

/// The hierarchies over the shapes.
#[derive(Debug, Serialize)]
pub struct Hierarchy {
    pub items: u64,
    /// An estimate of their memory.
    pub bytes: u64,
}

/// A file that the scene is read from.
#[derive(Debug, Serialize)]
pub struct File {
    pub path: String,
    pub bytes: u64,
}

/// A warning, such as one of a thing that is not supported.
#[derive(Debug, Serialize)]
pub struct Warning {
    pub code: &'static str,
    pub message: String,
    pub file: Option<String>,
    pub line: Option<u32>,
}

/// The class of meshes, with the buffers of its triangles.
const MESH: &str = "TriangleMesh";
const MESH_BUFFERS: [&str; 4] = ["positions", "normals", "uvs", "indices"];

/// The name of a setting that the scene does not give.
const DEFAULT: &str = "default";

impl Contents {
    pub fn new(
        path: &Path,
        source: &SceneSource<'_>,
        loaded: &Loaded,
        extent: &SceneExtent,
        files: &RecordedFiles<'_>,
    ) -> Self {
        let description = source.description();
        let settings = &loaded.scene.settings;
        let setting = |id: Option<EntityId>| {
            id.map_or(DEFAULT.to_owned(), |id| description.entities[id.0].class.clone())
        };
        let classes = |kind: EntityKind| {
            counted(description.entities.iter().filter(|it| it.kind == kind).map(shown_class))
        };
        let lights = description.lights.iter().map(|id| shown_class(&description.entities[id.0]));
        let is_old = loaded.warnings.iter().any(|(_, it)| it.code == codes::OLD_SCENE);
        let format = match is_gltf(path) {
            true => "glTF",
            false if is_mesh_file(path) => "mesh",
            false if is_old => "pbrt-v3 or earlier",
            false => "pbrt-v4",
        };
        Contents {
            scene: path.display().to_string(),
            format,
            camera: setting(description.camera),
            film: setting(description.film),
            width: settings.width,
            height: settings.height,
            filter: setting(description.filter),
            sampler: setting(description.sampler),
            samples_per_pixel: settings.sampler.samples_per_pixel(),
            integrator: setting(description.integrator),
            max_depth: settings.max_depth,
            shapes: shapes(description, loaded),
            materials: classes(EntityKind::Material),
            textures: classes(EntityKind::Texture),
            lights: counted(lights),
            area_lights: classes(EntityKind::AreaLight),
            emitting_shapes: loaded.scene.objects.iter().filter(|it| it.emitter.is_some()).count(),
            images: images(source, loaded),
            bounds: extent.bounds.map(|bounds| [bounds.min, bounds.max]),
            unbounded_shapes: extent.unbounded,
            hierarchy: Hierarchy { items: extent.items, bytes: extent.hierarchy.0 },
            files: read_files(path, files),
            warnings: warnings(&loaded.warnings),
        }
    }
}

fn shown_class(entity: &Entity) -> String {
    if entity.class.is_empty() { "none".to_owned() } else { entity.class.clone() }
}

fn counted(names: impl Iterator<Item = String>) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_default() += 1);
    counts
}

fn shapes(description: &Description, loaded: &Loaded) -> Shapes {
    let scene = &loaded.scene;
    let in_objects = description.objects.iter().flat_map(|it| &it.shapes);
    let all = description.shapes.iter().chain(in_objects);
    let classes = counted(all.map(|it| shown_class(&description.entities[it.shape.0])));
    let triangles = |indices: &[u32]| -> u64 {
        let objects = indices.iter().map(|index| &scene.objects[*index as usize]);
        let meshes = objects.filter(|object| object.primitive.class().name == MESH);
        meshes.map(|object| u64::from(object.elements.unwrap_or(1))).sum()
    };
    let world = triangles(&scene.world);
    let groups: Vec<u64> = scene.groups.iter().map(|group| triangles(group)).collect();
    let placed: u64 = scene.instances.iter().map(|it| groups[it.group as usize]).sum();
    let mut known = BTreeSet::new();
    let buffers = scene
        .objects
        .iter()
        .flat_map(|object| MESH_BUFFERS.iter().filter_map(|name| object.primitive.buffer(name)));
    let own = buffers.filter(|buffer| known.insert(buffer.as_ptr().addr()));
    Shapes {
        classes,
        objects: scene.groups.len(),
        instances: scene.instances.len(),
        triangles: world + groups.iter().sum::<u64>(),
        instanced_triangles: world + placed,
        mesh_bytes: own.map(|buffer| size_of_val(&**buffer) as u64).sum(),
    }
}

/// Parameters that name the files of images.
const FILES: [&str; 2] = ["filename", "normalmap"];

/// The images, each once.
fn images(source: &SceneSource<'_>, loaded: &Loaded) -> Vec<Image> {
    let mut found = BTreeMap::new();
    let description = source.description();
    for (index, entity) in description.entities.iter().enumerate() {
        let name = FILES.iter().find_map(|name| entity.text(name)).map(|(name, _)| name);
        let (Some(name), Some(instance)) = (name, source.instance(EntityId(index))) else {
            continue;
        };
        add_images(instance, name, &mut found);
    }
    // Maps of normals, which are not the entity's own instance.
    for (material, origin) in loaded.scene.materials.iter().zip(&loaded.origins.materials) {
        let entity = origin.map(|EntityId(index)| &description.entities[index]);
        let name = entity.and_then(|entity| entity.text("normalmap"));
        add_images(material, name.map_or("", |(name, _)| name), &mut found);
    }
    let mut images: Vec<Image> = found.into_values().collect();
    images.sort_by(|one, other| one.name.cmp(&other.name));
    images
}

/// Adds the images of an instance and of those that it refers to, by the addresses of their texels.
fn add_images(instance: &Instance, name: &str, found: &mut BTreeMap<usize, Image>) {
    let number = |member: &str, index: usize| {
        instance.member(member).and_then(|words| words.get(index)).copied().unwrap_or(0)
    };
    if let Some(words) = instance.buffer("words").filter(|words| !words.is_empty()) {
        found.entry(words.as_ptr().addr()).or_insert_with(|| Image {
            name: name.to_owned(),
            width: number("size", 0),
            height: number("size", 1),
            channels: number("channels", 0),
            bits: number("depth", 0),
            bytes: size_of_val(&**words) as u64,
            in_file: words.is_in_file(),
        });
    }
    for reference in instance.references().iter().flatten().flatten() {
        add_images(reference, name, found);
    }
}

fn read_files(path: &Path, files: &RecordedFiles<'_>) -> Vec<File> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let size = |name: &str| std::fs::metadata(folder.join(name)).map_or(0, |it| it.len());
    let names = files.digests(path).into_iter().map(|(name, _)| name);
    names.map(|path| File { bytes: size(&path), path }).collect()
}

fn warnings(messages: &Messages) -> Vec<Warning> {
    let warning = |(sources, diagnostic): (&rtsl::SourceMap, &rtsl::Diagnostic)| {
        let span = diagnostic.primary.as_ref().map(|label| label.span);
        Warning {
            code: diagnostic.code.as_str(),
            message: diagnostic.message.clone(),
            file: span.map(|span| sources.file(span.file).name.clone()),
            line: span.map(|span| sources.position(span.file, span.start).line),
        }
    };
    messages.iter().map(warning).collect()
}
