//! The format's shapes that are meshes. They become instances of the library's classes `TriangleMesh`
//! and `BilinearMesh`, whose buffers are the mesh's arrays; or of `Parallelogram`, where that is all they are.

use std::path::Path;

use rtsl::{Diagnostic, Span, Value, diagnostic_codes as codes, most_similar};

use crate::mesh::{Mesh, MeshBuilder, MeshError, read_gltf, read_ply};
use crate::reader::{FileSource, Parameter, SceneFiles, Values, resolve};

use super::description::Entity;
use super::parallelogram::Parallelogram;
use super::standard_names::StandardName;

/// A shape that is a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshShape {
    /// `trianglemesh`: vertices and triangles in the scene's text.
    Triangles,
    /// `bilinearmesh`: vertices and quadrilaterals in the scene's text.
    Quadrilaterals,
    /// `plymesh`: a PLY file.
    Ply,
    /// `gltf`: a glTF file.
    Gltf,
}

impl MeshShape {
    /// The shape that the format calls so.
    pub fn named(name: &str) -> Option<MeshShape> {
        match name {
            "trianglemesh" => Some(MeshShape::Triangles),
            "bilinearmesh" => Some(MeshShape::Quadrilaterals),
            "plymesh" => Some(MeshShape::Ply),
            "gltf" => Some(MeshShape::Gltf),
            _ => None,
        }
    }

    fn parameters(self) -> &'static [&'static str] {
        match self {
            MeshShape::Triangles | MeshShape::Quadrilaterals => {
                &["P", "N", "uv", "indices", "alpha"]
            }
            MeshShape::Ply | MeshShape::Gltf => &["filename", "alpha"],
        }
    }

    /// The arguments that the class takes for `entity`.
    pub fn arguments(
        self,
        entity: &Entity,
        files: SceneFiles<'_>,
    ) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
        if let Some(parallelogram) = Parallelogram::of(entity) {
            return Ok(parallelogram.arguments());
        }
        check_names(entity, self.parameters())?;
        let mesh = match self {
            MeshShape::Triangles => triangles(entity),
            MeshShape::Quadrilaterals => quadrilaterals(entity),
            MeshShape::Ply => file(entity, files, ply),
            MeshShape::Gltf => file(entity, files, gltf),
        }?;
        let Mesh { positions, normals, uvs, indices } = mesh;
        let buffers =
            [("positions", positions), ("normals", normals), ("uvs", uvs), ("indices", indices)];
        Ok(buffers.map(|(name, numbers)| (name.to_owned(), Value::Numbers(numbers))).into())
    }
}

fn check_names(entity: &Entity, known: &[&str]) -> Result<(), Box<Diagnostic>> {
    let standard = StandardName::of(entity);
    let is_unknown = |parameter: &&Parameter| {
        let name = parameter.name.as_str();
        !known.contains(&name) && !standard.is_some_and(|standard| standard.has_no_effect(name))
    };
    let Some(parameter) = entity.parameters.iter().find(is_unknown) else { return Ok(()) };
    let name = &parameter.name;
    let message = format!("`{}` has no parameter `{name}`", entity.class);
    let diagnostic =
        Diagnostic::new(codes::UNKNOWN_PARAMETER, message).at(parameter.declaration, "");
    Err(Box::new(match most_similar(name, known.iter().copied()) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None => diagnostic.note(format!("it has {}", known.join(", "))),
    }))
}

/// The shape's vertices, without any indices.
fn vertices(entity: &Entity) -> Result<MeshBuilder, Box<Diagnostic>> {
    Ok(MeshBuilder {
        positions: floats(entity, "P")?,
        normals: floats(entity, "N")?,
        uvs: floats(entity, "uv")?,
        indices: Vec::new(),
    })
}

fn triangles(entity: &Entity) -> Result<Mesh, Box<Diagnostic>> {
    let mut builder = vertices(entity)?;
    builder.indices = indices(entity, &[0, 1, 2])?;
    builder.finish().map_err(|error| unusable(entity, entity.class_span, &error))
}

fn quadrilaterals(entity: &Entity) -> Result<Mesh, Box<Diagnostic>> {
    let mut builder = vertices(entity)?;
    builder.indices = indices(entity, &[0, 1, 2, 3])?;
    let mesh = builder.finish_quadrilaterals();
    mesh.map_err(|error| unusable(entity, entity.class_span, &error))
}

/// Reads the file at a path.
type ReadFile = fn(&dyn FileSource, &Path) -> Result<Mesh, MeshError>;

fn ply(files: &dyn FileSource, path: &Path) -> Result<Mesh, MeshError> {
    read_ply(files.open(path)?)
}

/// The files that a glTF file names lie beside it.
fn gltf(files: &dyn FileSource, path: &Path) -> Result<Mesh, MeshError> {
    read_gltf(&files.read(path)?, &|name| files.read(&resolve(path, name)))
}

fn file(entity: &Entity, files: SceneFiles<'_>, read: ReadFile) -> Result<Mesh, Box<Diagnostic>> {
    let parameter = find(entity, "filename").ok_or_else(|| {
        let message = format!("`{}` names no file", entity.class);
        let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
        diagnostic.at(entity.class_span, "expected for example `\"string filename\" \"mesh.ply\"`")
    })?;
    let Values::Texts(texts) = &parameter.values else { return Err(wrong(parameter, "a string")) };
    let [name] = texts.as_slice() else { return Err(wrong(parameter, "one string")) };
    let path = files.path(name);
    let span = parameter.values_span;
    read(files.files, &path).map_err(|error| match error {
        MeshError::Unreadable(_) => {
            let message = format!("cannot read `{}`: {error}", path.display());
            let diagnostic = Diagnostic::new(codes::UNREADABLE_FILE, message);
            Box::new(diagnostic.at(span, "named here").help(error.remedy()))
        }
        error => unusable(entity, span, &error),
    })
}

fn find<'a>(entity: &'a Entity, name: &str) -> Option<&'a Parameter> {
    entity.parameters.iter().find(|parameter| parameter.name == name)
}

/// The bits of the floats of a parameter; none where it is not given.
fn floats(entity: &Entity, name: &str) -> Result<Vec<u32>, Box<Diagnostic>> {
    let Some(parameter) = find(entity, name) else { return Ok(Vec::new()) };
    let numbers = numbers(parameter)?;
    let each = if name == "uv" { 2 } else { 3 };
    if !numbers.len().is_multiple_of(each) {
        return Err(wrong(parameter, &format!("{each} numbers for each vertex")));
    }
    Ok(numbers.iter().map(|number| (*number as f32).to_bits()).collect())
}

/// The indices of a shape, which may leave out those of a single face.
fn indices(entity: &Entity, single: &[u32]) -> Result<Vec<u32>, Box<Diagnostic>> {
    let Some(parameter) = find(entity, "indices") else { return Ok(single.to_vec()) };
    let bits = |number: &f64| {
        let whole = *number as i32;
        (f64::from(whole) == *number).then_some(whole.cast_unsigned())
    };
    let indices: Option<Vec<u32>> = numbers(parameter)?.iter().map(bits).collect();
    indices.ok_or_else(|| wrong(parameter, "whole numbers"))
}

fn numbers(parameter: &Parameter) -> Result<&[f64], Box<Diagnostic>> {
    match &parameter.values {
        Values::Numbers(numbers) => Ok(numbers),
        Values::Booleans(_) | Values::Texts(_) => Err(wrong(parameter, "numbers")),
    }
}

fn wrong(parameter: &Parameter, expected: &str) -> Box<Diagnostic> {
    let message = format!(
        "`{}` takes {expected}, found {} {}",
        parameter.name,
        parameter.values.len(),
        parameter.values.description()
    );
    Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""))
}

fn unusable(entity: &Entity, span: Span, error: &MeshError) -> Box<Diagnostic> {
    let message = format!("this `{}` cannot be used: {error}", entity.class);
    Box::new(Diagnostic::new(codes::BAD_MESH, message).at(span, "").help(error.remedy()))
}
