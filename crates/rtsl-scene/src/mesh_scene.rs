//! Files of meshes as scenes: the mesh in a studio, before a camera that shows all of it.

use std::path::Path;

use rtsl::{Diagnostic, Diagnostics, Numbers, SourceMap, Span, diagnostic_codes as codes};
use rtsl_math::Transform;
use rtsl_memory::InputBudget;

use crate::attributes::WantedAttributes;
use crate::bounds::Bounds;
use crate::description::{Description, Entity, EntityId, EntityKind, ShapeUse};
use crate::framing::{FIELD_OF_VIEW, frame};
use crate::mesh::{
    Mesh, MeshError, MeshWarning, read_obj_within, read_ply_within, read_stl_within,
};
use crate::reader::{
    EmbeddedFiles, FileSource, Parameter, ParameterType, SceneFiles, Values, unreadable,
};
use crate::studio::add_studio;

/// True if the name of a file is that of a mesh.
pub fn is_mesh_file(path: &Path) -> bool {
    format_of(path).is_some()
}

/// A format of meshes, by the ending of its files.
#[derive(Clone, Copy)]
enum Format {
    Obj,
    Ply,
    Stl,
}

fn format_of(path: &Path) -> Option<Format> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "obj" => Some(Format::Obj),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}

/// Reads the scene of a mesh's file.
///
/// Errors and warnings go to `diagnostics`.
pub fn read_mesh_scene(
    path: &Path,
    files: &dyn FileSource,
    budget: &InputBudget,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Description {
    let mut description = Description::default();
    let mesh = match read(path, files, budget) {
        Ok(mesh) => mesh,
        Err(error) => {
            diagnostics.push(unusable(path, &error));
            return description;
        }
    };
    // The name is none of a file, which would be compared with this text.
    let text = format!("{} triangles, {} vertices", mesh.triangles(), mesh.vertices());
    let length = text.len() as u32;
    let span = Span::new(map.add(format!("{}#contents", path.display()), text), 0, length);
    for warning in &mesh.warnings {
        let warning = match warning {
            MeshWarning::Materials => {
                Diagnostic::new(codes::IGNORED_SETTING, "materials are left out")
            }
            MeshWarning::NotFinite(vertex) => Diagnostic::new(
                codes::MENDED_FAULT,
                format!(
                    "vertex {vertex} has a coordinate that is not finite, and no face uses it: it is left out"
                ),
            ),
        };
        diagnostics.push(warning.at(span, ""));
    }
    let (points, _) = mesh.positions.words().as_chunks::<3>();
    let point = |point: &[u32; 3]| point.map(|bits| f64::from(f32::from_bits(bits)));
    let bounds: Bounds = points.iter().map(point).collect();
    let Mesh { positions, normals, uvs, indices, .. } = mesh;
    let arrays =
        [("positions", positions), ("normals", normals), ("uvs", uvs), ("indices", indices)];
    let arrays = arrays.map(|(name, numbers): (&str, Numbers)| (name, Values::Buffer(numbers)));
    let shape = add(&mut description, EntityKind::Shape, "TriangleMesh", arrays.into(), span);
    description.shapes.push(ShapeUse {
        shape,
        material: None,
        area_light: None,
        reverse_orientation: false,
    });
    let field = vec![("fov", Values::Numbers(vec![FIELD_OF_VIEW]))];
    let camera = add(&mut description, EntityKind::Camera, "Pinhole", field, span);
    description.entities[camera.0].transform = frame(&bounds);
    description.camera = Some(camera);
    add_studio(&mut description, path, 1.0, span, budget);
    description.notes.push("the file is a mesh: all of it is shown in a studio".to_owned());
    description
}

fn read(path: &Path, files: &dyn FileSource, budget: &InputBudget) -> Result<Mesh, MeshError> {
    let embedded = EmbeddedFiles::new();
    let files =
        SceneFiles { scene: path, files, embedded: &embedded, budget, texture_memory: None };
    match format_of(path) {
        Some(Format::Obj) => read_obj_within(files.open(path)?, budget),
        Some(Format::Stl) => read_stl_within(&files.read(path)?.bytes, budget),
        Some(Format::Ply) | None => {
            read_ply_within(files.open(path)?, budget, &WantedAttributes::default())
        }
    }
}

/// Adds an entity with the name of its kind.
fn add(
    description: &mut Description,
    kind: EntityKind,
    class: &str,
    parameters: Vec<(&str, Values)>,
    span: Span,
) -> EntityId {
    let parameters = parameters.into_iter().map(|(name, values)| Parameter {
        kind: ParameterType::Given,
        name: name.to_owned(),
        declaration: span,
        values,
        values_span: span,
    });
    description.entities.push(Entity {
        kind,
        class: class.to_owned(),
        class_span: span,
        name: Some(kind.word().to_owned()),
        parameters: parameters.collect(),
        transform: Transform::IDENTITY,
        end_transform: None,
    });
    EntityId(description.entities.len() - 1)
}

fn unusable(path: &Path, error: &MeshError) -> Diagnostic {
    match error {
        MeshError::OverBudget(error) => error.diagnostic(path.display()),
        MeshError::Unreadable(error) => unreadable(path, error),
        error => {
            let message = format!("`{}` cannot be used: {error}", path.display());
            Diagnostic::new(codes::BAD_MESH, message).help(error.remedy())
        }
    }
}
