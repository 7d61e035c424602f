//! The format's mesh shapes. They become instances of the library's classes `TriangleMesh` and `BilinearMesh`, whose
//! buffers are the mesh's arrays, or of `Parallelogram` if the mesh is a single one.

use std::cell::RefCell;
use std::path::Path;

use rtsl::{Diagnostic, Span, Value, diagnostic_codes as codes};
use rtsl_memory::{Held, InputBudget};

use super::name::PbrtName;
use super::parallelogram::Parallelogram;
use super::wording::unknown_parameter;
use crate::attributes::{GivenAttribute, WantedAttributes};
use crate::description::Entity;
use crate::mesh::{
    Mesh, MeshBuilder, MeshError, MeshWarning, read_gltf_within, read_ply_within, subdivide,
};
use crate::reader::{Input, Parameter, SceneFiles, Values, resolve};

/// A mesh shape.
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
    /// `loopsubdiv`: the triangles that control a subdivision surface.
    Subdivision,
}

/// A mesh as arguments of its class.
#[derive(Clone)]
pub struct MadeMesh {
    /// The arguments.
    pub values: Vec<(String, Value)>,
    /// The attributes that its file has.
    pub attributes: Vec<GivenAttribute>,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
}

impl MeshShape {
    /// The mesh shape with this name in the format.
    pub fn named(name: &str) -> Option<MeshShape> {
        match name {
            "trianglemesh" => Some(MeshShape::Triangles),
            "bilinearmesh" => Some(MeshShape::Quadrilaterals),
            "plymesh" => Some(MeshShape::Ply),
            "gltf" => Some(MeshShape::Gltf),
            "loopsubdiv" => Some(MeshShape::Subdivision),
            _ => None,
        }
    }

    /// The name of its file, if it has one.
    pub fn file(self, entity: &Entity) -> Option<&str> {
        match self {
            MeshShape::Ply | MeshShape::Gltf => entity.text("filename").map(|(name, _)| name),
            MeshShape::Triangles | MeshShape::Quadrilaterals | MeshShape::Subdivision => None,
        }
    }

    /// Checks the names of the parameters of a shape.
    ///
    /// # Errors
    /// If it has no parameter of such a name.
    pub fn check_names(
        self,
        entity: &Entity,
        wanted: &WantedAttributes,
    ) -> Result<(), Box<Diagnostic>> {
        let known = self.parameters();
        let standard = PbrtName::of(entity);
        let is_unknown = |parameter: &&Parameter| {
            let name = parameter.name.as_str();
            !known.contains(&name)
                && !WITHOUT_DIFFERENCE.contains(&name)
                && !wanted.has(name)
                && !standard.is_some_and(|standard| standard.has_no_effect(name))
        };
        let Some(parameter) = entity.parameters.iter().find(is_unknown) else { return Ok(()) };
        let subject = format!("{} `{}`", entity.kind.word(), entity.class);
        Err(unknown_parameter(&subject, parameter, known))
    }

    fn parameters(self) -> &'static [&'static str] {
        match self {
            MeshShape::Triangles | MeshShape::Quadrilaterals => {
                &["P", "N", "uv", "indices", "alpha"]
            }
            MeshShape::Ply | MeshShape::Gltf => &["filename", "alpha"],
            MeshShape::Subdivision => &["P", "indices", "levels", "scheme", "alpha"],
        }
    }

    /// The arguments of the class for `entity`, with those of the wanted attributes that its file has.
    pub fn arguments(
        self,
        entity: &Entity,
        files: SceneFiles<'_>,
        wanted: &WantedAttributes,
    ) -> Result<MadeMesh, Box<Diagnostic>> {
        if let Some(parallelogram) = Parallelogram::of(entity) {
            let (values, attributes) = (parallelogram.arguments(), Vec::new());
            return Ok(MadeMesh { values, attributes, warnings: Vec::new() });
        }
        self.check_names(entity, wanted)?;
        let mesh = match self {
            MeshShape::Triangles => triangles(entity, files.budget),
            MeshShape::Quadrilaterals => quadrilaterals(entity, files.budget),
            MeshShape::Ply => file(entity, files, |files, path| ply(files, path, wanted)),
            MeshShape::Gltf => file(entity, files, |files, path| gltf(files, path, wanted)),
            MeshShape::Subdivision => subdivision(entity, files.budget),
        }?;
        let Mesh { positions, normals, uvs, indices, attributes, warnings } = mesh;
        let buffers =
            [("positions", positions), ("normals", normals), ("uvs", uvs), ("indices", indices)];
        let values = buffers.map(|(name, numbers)| (name.to_owned(), Value::Numbers(numbers)));
        let name = entity.text("filename").map_or(entity.class.as_str(), |(name, _)| name);
        let warnings = warnings.iter().map(|warning| warning_of(*warning, name)).collect();
        Ok(MadeMesh { values: values.into(), attributes, warnings })
    }
}

/// The warning about a mesh, with the name of its file or of its shape.
fn warning_of(warning: MeshWarning, name: &str) -> Diagnostic {
    match warning {
        MeshWarning::Materials => Diagnostic::new(
            codes::IGNORED_SETTING,
            format!(
                "the materials of `{name}` have no effect on a shape: `rtsl render {name}` shows the file as a scene"
            ),
        ),
        MeshWarning::NotFinite(vertex) => Diagnostic::new(
            codes::MENDED_FAULT,
            format!(
                "vertex {vertex} of `{name}` has a coordinate that is not finite, and no face uses it: it is left out"
            ),
        ),
    }
}

/// Parameters that make no difference to the radiance: numbers of faces for `ptex`, an image by which pbrt samples a
/// light, the length of displaced edges.
const WITHOUT_DIFFERENCE: [&str; 3] = ["faceIndices", "emissionfilename", "edgelength"];

/// Holds the memory of the arrays made of the numbers in a scene's text.
fn hold(entity: &Entity, budget: &InputBudget) -> Result<Held, Box<Diagnostic>> {
    let numbers = ["P", "N", "uv", "indices"].map(|name| find(entity, name));
    let count = numbers.into_iter().flatten().map(|parameter| parameter.values.len()).sum();
    budget.hold(MeshBuilder::default().memory(count)).map_err(|error| {
        Box::new(error.diagnostic(&entity.class).at(entity.class_span, "this shape"))
    })
}

/// The shape's vertices, without indices.
fn vertices(entity: &Entity) -> Result<MeshBuilder, Box<Diagnostic>> {
    Ok(MeshBuilder {
        positions: floats(entity, "P")?,
        normals: floats(entity, "N")?,
        uvs: floats(entity, "uv")?,
        indices: Vec::new(),
    })
}

fn triangles(entity: &Entity, budget: &InputBudget) -> Result<Mesh, Box<Diagnostic>> {
    let held = hold(entity, budget)?;
    let mut builder = vertices(entity)?;
    builder.indices = indices(entity, &[0, 1, 2])?;
    let mesh = builder.finish().map_err(|error| unusable(entity, entity.class_span, &error))?;
    held.keep(mesh.memory());
    Ok(mesh)
}

fn quadrilaterals(entity: &Entity, budget: &InputBudget) -> Result<Mesh, Box<Diagnostic>> {
    let held = hold(entity, budget)?;
    let mut builder = vertices(entity)?;
    builder.indices = indices(entity, &[0, 1, 2, 3])?;
    let mesh = builder.finish_quadrilaterals();
    let mesh = mesh.map_err(|error| unusable(entity, entity.class_span, &error))?;
    held.keep(mesh.memory());
    Ok(mesh)
}

fn subdivision(entity: &Entity, budget: &InputBudget) -> Result<Mesh, Box<Diagnostic>> {
    let held = hold(entity, budget)?;
    let control = MeshBuilder { indices: indices(entity, &[0, 1, 2])?, ..vertices(entity)? };
    let levels = match find(entity, "levels") {
        Some(parameter) => match numbers(parameter)? {
            [levels] if *levels >= 0.0 && levels.fract() == 0.0 => *levels as u32,
            _ => return Err(wrong(parameter, "a whole number from 0")),
        },
        None => 3,
    };
    let mesh = subdivide(control, levels, budget)
        .map_err(|error| unusable(entity, entity.class_span, &error))?;
    drop(held);
    Ok(mesh)
}

fn ply(files: SceneFiles<'_>, path: &Path, wanted: &WantedAttributes) -> Result<Mesh, MeshError> {
    read_ply_within(files.open(path)?, files.budget, wanted)
}

/// Files that a glTF file refers to are relative to it. All of them are held in memory until the mesh is complete.
fn gltf(files: SceneFiles<'_>, path: &Path, wanted: &WantedAttributes) -> Result<Mesh, MeshError> {
    let file = files.read(path)?;
    let buffers = RefCell::new(Vec::new());
    let read = |name: &str| {
        let Input { bytes, held } = files.read(&resolve(path, name))?;
        buffers.borrow_mut().push(held);
        Ok(bytes)
    };
    read_gltf_within(&file.bytes, &read, files.budget, wanted)
}

fn file(
    entity: &Entity,
    files: SceneFiles<'_>,
    read: impl Fn(SceneFiles<'_>, &Path) -> Result<Mesh, MeshError>,
) -> Result<Mesh, Box<Diagnostic>> {
    let parameter = find(entity, "filename").ok_or_else(|| {
        let message = format!("`{}` names no file", entity.class);
        let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
        diagnostic.at(entity.class_span, "expected for example `\"string filename\" \"mesh.ply\"`")
    })?;
    let Values::Texts(texts) = &parameter.values else { return Err(wrong(parameter, "a string")) };
    let [name] = texts.as_slice() else { return Err(wrong(parameter, "one string")) };
    let path = files.path(name);
    let span = parameter.values_span;
    read(files, &path).map_err(|error| match error {
        MeshError::OverBudget(error) => {
            Box::new(error.diagnostic(path.display()).at(span, "named here"))
        }
        MeshError::Unreadable(_) => {
            let message = format!("cannot read `{}`: {error}", path.display());
            let diagnostic = Diagnostic::new(codes::UNREADABLE_FILE, message);
            Box::new(diagnostic.at(span, "named here").help(error.remedy()))
        }
        error => unusable(entity, span, &error),
    })
}

fn find<'a>(entity: &'a Entity, name: &str) -> Option<&'a Parameter> {
    entity.parameter(name)
}

/// The bits of a parameter's floats; none if it is not given.
fn floats(entity: &Entity, name: &str) -> Result<Vec<u32>, Box<Diagnostic>> {
    let Some(parameter) = find(entity, name) else { return Ok(Vec::new()) };
    let numbers = numbers(parameter)?;
    let each = if name == "uv" { 2 } else { 3 };
    if !numbers.len().is_multiple_of(each) {
        return Err(wrong(parameter, &format!("{each} numbers for each vertex")));
    }
    Ok(numbers.iter().map(|number| (*number as f32).to_bits()).collect())
}

/// The indices of a shape, which may be omitted for a single face.
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
        Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => {
            Err(wrong(parameter, "numbers"))
        }
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
