//! Attributes of shapes: values that materials and textures of the scene read by name, and that are no parameters of
//! the shape's class.
//!
//! A shape gives one value of an attribute, or one for each of its vertices or faces. Its class is then one that
//! inherits the class of the shape, and has the attribute as a member, or interpolates it in
//! `computeTextureCoordinates`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::sync::Arc;

use rtsl::{
    Class, Diagnostic, Instance, Method, Numbers, ParameterType, Role, Scalar, Value,
    diagnostic_codes as codes,
};

use crate::reader::{Parameter, Values};
use crate::scene::Scene;

/// The functions by which a class interpolates between the vertices of a face: the indices of up to four vertices, and
/// their weights.
const CORNERS: &str = "attributeCorners";
const WEIGHTS: &str = "attributeWeights";

/// The attribute with the mean curvature, in the space of the shape: half the divergence of the unit normal. Shapes
/// have it if a shader reads it.
pub const CURVATURE: &str = "curvature";

/// Half the divergence of the unit normal at a hit. The method is inlined three times, and equal parts are merged.
const DIVERGENCE: &str =
    "0.5 * (gradient((computeNormal(), normalize(rt_GeometricNormal).x), rt_HitPoint).x
+ gradient((computeNormal(), normalize(rt_GeometricNormal).y), rt_HitPoint).y
+ gradient((computeNormal(), normalize(rt_GeometricNormal).z), rt_HitPoint).z)";

/// Gives the shapes and shaders of a scene the list of the attributes that they share.
///
/// # Errors
/// If the attributes do not fit each other.
pub fn share_attributes(scene: &mut Scene) -> Result<(), Diagnostic> {
    let alpha = scene.objects.iter().filter_map(|object| object.alpha.as_ref());
    let shapes = || scene.objects.iter().map(|object| &*object.primitive);
    let readers = scene.materials.iter().chain(alpha).map(|it| &**it).chain(shapes());
    let table = Instance::attributes(readers, shapes())?;
    if table.is_empty() {
        return Ok(());
    }
    let mut shared = BTreeMap::new();
    let mut share = |instance: &mut Arc<Instance>, is_shape: bool| {
        if is_shape || instance.reads_attributes() {
            let with = || instance.with_attributes(&table);
            let with = shared.entry(Arc::as_ptr(instance)).or_insert_with(with).clone();
            *instance = with;
        }
    };
    scene.materials.iter_mut().for_each(|material| share(material, false));
    for object in &mut scene.objects {
        share(&mut object.primitive, true);
        object.alpha.iter_mut().for_each(|alpha| share(alpha, false));
    }
    Ok(())
}

/// The attributes that shaders of a scene read: the numbers of scalars of their types, by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WantedAttributes {
    types: BTreeMap<String, BTreeSet<usize>>,
}

impl WantedAttributes {
    /// Adds those that instances of a class read.
    pub fn add(&mut self, class: &Class) {
        if !class.roles.iter().any(|role| matches!(role, Role::Material | Role::Texture)) {
            return;
        }
        for attribute in &class.attributes {
            let types = self.types.entry(attribute.name.clone()).or_default();
            types.insert(scalars_of(&attribute.ty));
        }
    }

    /// True if no shader reads an attribute.
    pub fn is_empty(&self) -> bool {
        self.types.is_empty()
    }

    /// True if a shader reads an attribute of this name.
    pub fn has(&self, name: &str) -> bool {
        self.types.contains_key(name)
    }

    /// The names, each with its numbers of scalars.
    pub fn types(&self) -> impl Iterator<Item = (&str, impl Iterator<Item = usize> + Clone)> {
        self.types.iter().map(|(name, sizes)| (name.as_str(), sizes.iter().copied()))
    }

    /// The names and the numbers of scalars.
    pub fn iter(&self) -> impl Iterator<Item = (&str, usize)> {
        self.types().flat_map(|(name, sizes)| sizes.map(move |size| (name, size)))
    }
}

fn scalars_of(ty: &ParameterType) -> usize {
    match ty {
        ParameterType::Vector(_, size) => usize::from(*size),
        ParameterType::Color => 3,
        _ => 1,
    }
}

/// The parts of a shape that have values of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Spread {
    /// One value for the whole shape.
    Shape,
    /// A value for each vertex.
    Vertices,
    /// A value for each face.
    Faces,
    /// A value for each hit, which the class computes.
    Hits,
}

/// An attribute that a shape gives.
#[derive(Clone, Debug)]
pub struct GivenAttribute {
    /// The name.
    pub name: String,
    /// The number of scalars of a value, 1 to 4.
    pub scalars: usize,
    /// The parts that have values.
    pub spread: Spread,
    /// The values.
    pub numbers: Numbers,
}

/// The numbers of vertices and faces of a shape; `None` for shapes without.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// The vertices.
    pub vertices: Option<usize>,
    /// The faces.
    pub faces: Option<usize>,
}

impl GivenAttribute {
    /// Returns the attribute that a parameter of a shape gives.
    ///
    /// # Errors
    /// If the number of its values fits neither the shape nor its parts.
    pub fn of(
        parameter: &Parameter,
        wanted: &WantedAttributes,
        counts: Counts,
    ) -> Result<GivenAttribute, Box<Diagnostic>> {
        let numbers = match &parameter.values {
            Values::Numbers(values) => {
                let bits: Vec<u32> = values.iter().map(|value| (*value as f32).to_bits()).collect();
                Numbers::from_words(Scalar::F32, bits)
            }
            Values::Buffer(numbers) if numbers.scalar() == Scalar::F32 => numbers.clone(),
            Values::Buffer(_) | Values::Booleans(_) | Values::Texts(_) => {
                let found = parameter.values.description();
                let message = format!("`{}` is an attribute, found {found}", parameter.name);
                return Err(wrong(parameter, message).into());
            }
        };
        let len = numbers.words().len();
        let sizes = wanted.types.get(&parameter.name).into_iter().flatten().copied();
        let fits = |count: Option<usize>, size: usize| {
            count.is_some_and(|count| Some(len) == count.checked_mul(size))
        };
        let spread = sizes.clone().find_map(|size| {
            let spread = if len == size {
                Spread::Shape
            } else if fits(counts.vertices, size) {
                Spread::Vertices
            } else if fits(counts.faces, size) {
                Spread::Faces
            } else {
                return None;
            };
            Some((size, spread))
        });
        if let Some((scalars, spread)) = spread {
            return Ok(GivenAttribute { name: parameter.name.clone(), scalars, spread, numbers });
        }
        let sizes: Vec<String> = sizes.map(|size| size.to_string()).collect();
        let mut message = format!(
            "the attribute `{}` has {} numbers for the shape",
            parameter.name,
            sizes.join(" or ")
        );
        for (count, part) in [(counts.vertices, "vertices"), (counts.faces, "faces")] {
            if let Some(count) = count {
                let _ = write!(message, ", or for each of its {count} {part}");
            }
        }
        let _ = write!(message, ", found {len}");
        Err(wrong(parameter, message).into())
    }

    /// Returns the argument of the derived class at this index among the given attributes; `None` if it needs none.
    pub fn argument(&self, index: usize) -> Option<(String, Value)> {
        let name = match self.spread {
            Spread::Shape => self.name.clone(),
            Spread::Vertices | Spread::Faces => buffer(index),
            Spread::Hits => return None,
        };
        Some((name, Value::Numbers(self.numbers.clone())))
    }
}

fn wrong(parameter: &Parameter, message: String) -> Diagnostic {
    Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, "")
}

fn buffer(index: usize) -> String {
    format!("attributeValues{index}")
}

/// Returns the text of a class of the same name as `base`, a class of the module `base`, with these attributes.
///
/// # Errors
/// If the class cannot have them: it has a member of that name, or no vertices.
pub fn derived_text(base: &Class, given: &[GivenAttribute]) -> Result<String, Diagnostic> {
    let name = &base.name;
    let mut members = String::new();
    let mut body = String::new();
    for (index, GivenAttribute { name: attribute, scalars, spread, .. }) in given.iter().enumerate()
    {
        let ty = ["float", "vec2", "vec3", "vec4"][scalars - 1];
        if has_member(base, attribute) {
            let message = format!("`{name}` has a member `{attribute}`, which is no attribute");
            return Err(Diagnostic::new(codes::WRONG_VALUE, message)
                .help("give the attribute another name in the shader"));
        }
        if *spread == Spread::Shape {
            let _ = writeln!(members, "public {ty} {attribute};");
            continue;
        }
        if *spread == Spread::Hits {
            let _ = writeln!(members, "attribute {ty} {attribute};");
            let _ = writeln!(body, "{attribute} = {DIVERGENCE};");
            continue;
        }
        let values = buffer(index);
        let _ = writeln!(members, "attribute {ty} {attribute};\npublic {ty} {values}[];");
        if let (Spread::Faces, Some(element)) = (spread, base.element()) {
            let _ = writeln!(body, "{attribute} = {values}[{}];", element.parameter);
            continue;
        }
        let terms = ["x", "y", "z", "w"].map(|it| format!("weights.{it} * {values}[corners.{it}]"));
        let _ = writeln!(body, "{attribute} = {};", terms.join(" + "));
    }
    if given.iter().any(|it| it.spread == Spread::Vertices) {
        body = format!("ivec4 corners = {CORNERS}();\nvec4 weights = {WEIGHTS}();\n{body}");
    }
    if base.methods.contains_key(&Method::ComputeTextureCoordinates) {
        body = format!("super.computeTextureCoordinates();\n{body}");
    }
    let method = if given.iter().all(|it| it.spread == Spread::Shape) {
        String::new()
    } else {
        format!("void computeTextureCoordinates() {{\n{body}}}\n")
    };
    Ok(format!("import base;\nclass {name} : base.{name} {{\n{members}{method}}};\n"))
}

/// True if instances of the class have data of this name.
pub fn has_member(class: &Class, name: &str) -> bool {
    let variables = class.members.iter().chain(&class.buffers).chain(&class.scratch);
    let leaf = |variable: &rtsl::Variable| variable.name.split('.').next() == Some(name);
    let mut variables = variables.filter(|variable| leaf(variable));
    variables.next().is_some() || class.references.iter().any(|it| it.name == name)
}

/// Returns the text of the class of textures that show an attribute.
pub fn texture_text(attribute: &str, default: &[f64]) -> String {
    match default {
        [red, green, blue] => format!(
            "class Attribute : rt_Texture {{ attribute color {attribute} = color({red:?}, {green:?}, {blue:?}); \
             void lookup() {{ rt_TextureColor = {attribute}; }} }};"
        ),
        _ => format!(
            "class Attribute : rt_Texture {{ attribute float {attribute} = {:?}; \
             void lookup() {{ rt_FloatTextureValue = {attribute}; }} }};",
            default.first().copied().unwrap_or(0.0)
        ),
    }
}
