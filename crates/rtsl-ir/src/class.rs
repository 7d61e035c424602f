//! Compiled classes: their interface to hosts, and one function for each method.

use std::collections::BTreeMap;

use rtsl_spec::{Method, Role};

use crate::{Constant, Function, Scalar, Variable};

/// A checked and lowered class, not yet linked with the instances it refers to.
#[derive(Clone, Debug)]
pub struct Class {
    /// The name by which hosts find it.
    pub name: String,
    /// The roles, in the order of [`Role::ALL`].
    pub roles: Vec<Role>,
    /// The documentation comment.
    pub documentation: Option<String>,
    /// The parameters that hosts may set, constructor parameters first.
    pub parameters: Vec<Parameter>,
    /// The instance's data: public and private members, leaf by leaf, without buffers and references.
    pub members: Vec<Variable>,
    /// The buffers, leaf by leaf.
    pub buffers: Vec<Variable>,
    /// The scratch variables, leaf by leaf.
    pub scratch: Vec<Variable>,
    /// The scratch members as declared, in order, for hosts that show or set them.
    pub scratch_types: Vec<(String, ParameterType)>,
    /// The scratch members that hosts may keep beside the results of a method, such as AOVs, as declared, in order.
    pub outputs: Vec<(String, ParameterType)>,
    /// The attributes of hit objects that the methods read or give. In the methods these are variables of the kind
    /// `Member`, and linking replaces them.
    pub attributes: Vec<Attribute>,
    /// The references.
    pub references: Vec<Reference>,
    /// Stores the initial value of every member and the default of every constructor parameter (zero where it has
    /// none); reads nothing.
    pub initializer: Function,
    /// Reads parameters and members, and stores members.
    pub constructor: Option<Function>,
    /// The methods of the class, including those implied by others.
    pub methods: BTreeMap<Method, Function>,
    /// The methods again, for callers that take derivatives: with the derivatives of functions whose operations do not
    /// show them. Methods without such functions are not here.
    pub differentiable: BTreeMap<Method, Function>,
    /// The comments that precede the methods defined in the class itself.
    pub method_documentation: BTreeMap<Method, String>,
    /// True if the functions report events and have the places of values.
    pub is_traced: bool,
}

pub use rtsl_spec::{ELEMENT, STRIDE};

/// The annotation with the choices of a parameter whose type is an enumeration: `Linear = 0, Smooth = 1`.
pub const CHOICES: &str = "choices";

/// The parameter that distinguishes the objects that hosts make of one instance, such as the triangles of a mesh: it
/// counts `stride` entries of a buffer at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Element<'a> {
    /// The name of the parameter, which is 0 for the first object.
    pub parameter: &'a str,
    /// The buffer.
    pub buffer: &'a str,
    /// The number of entries of the buffer per object, at least 1.
    pub stride: u32,
}

impl Class {
    /// Returns the role in which the class has the method; `None` if it is of no role that has it.
    pub fn role_of(&self, method: Method) -> Option<Role> {
        self.roles.iter().copied().find(|role| method.roles().contains(role))
    }

    /// Returns the class's element parameter, if it has one.
    pub fn element(&self) -> Option<Element<'_>> {
        self.parameters.iter().find_map(|parameter| {
            let AnnotationValue::Text(buffer) = parameter.annotation(ELEMENT)? else { return None };
            let stride = match parameter.annotation(STRIDE) {
                Some(AnnotationValue::Constant(stride)) => stride.bits().max(1),
                Some(AnnotationValue::None | AnnotationValue::Text(_)) | None => 1,
            };
            Some(Element { parameter: &parameter.name, buffer, stride })
        })
    }
}

impl Parameter {
    /// Returns the value of an annotation.
    pub fn annotation(&self, key: &str) -> Option<&AnnotationValue> {
        let annotation = self.annotations.iter().find(|annotation| annotation.key == key);
        annotation.map(|annotation| &annotation.value)
    }

    /// Returns the names and values of its choices, if its type is an enumeration.
    pub fn choices(&self) -> Vec<(&str, i32)> {
        let Some(AnnotationValue::Text(choices)) = self.annotation(CHOICES) else {
            return Vec::new();
        };
        let each = choices.split(", ").filter_map(|choice| {
            let (name, value) = choice.split_once(" = ")?;
            Some((name, value.parse().ok()?))
        });
        each.collect()
    }
}

/// A parameter that a host may set when it makes an instance.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// The name.
    pub name: String,
    /// The type.
    pub ty: ParameterType,
    /// The destination of the value: the variables of this name of a constructor parameter or a member.
    pub target: ParameterTarget,
    /// True if the host must set it.
    pub required: bool,
    /// The annotations in `[[...]]`, in order.
    pub annotations: Vec<Annotation>,
}

/// The destination of a parameter's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterTarget {
    /// A parameter of the constructor.
    Constructor,
    /// A public member: data, buffer or reference.
    Member,
}

/// A type of the language, as hosts see it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ParameterType {
    /// A scalar.
    Scalar(Scalar),
    /// A vector with 2 to 4 components.
    Vector(Scalar, u8),
    /// A matrix of f32, columns then rows.
    Matrix(u8, u8),
    /// A colour, set from linear RGB.
    Color,
    /// A struct: its name and its fields, in order.
    Struct(String, Vec<(String, ParameterType)>),
    /// An array of fixed size.
    Array(Box<ParameterType>, u32),
    /// An array of run-time size.
    Buffer(Box<ParameterType>),
    /// A reference to an instance with this role.
    Reference(Role),
    /// A float, a colour or a vector with 3 components, or a texture that gives it at each hit.
    Textured(Box<ParameterType>),
}

impl ParameterType {
    /// Returns the type of the values that the parameter takes: for a textured one, that of its texture's values.
    pub fn value_type(&self) -> &ParameterType {
        match self {
            ParameterType::Textured(value) => value,
            other => other,
        }
    }
}

/// A value of the objects of a scene, which shaders ask for by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// The name.
    pub name: String,
    /// The type: a float, a vector of floats, or a colour.
    pub ty: ParameterType,
    /// The value for objects that do not have the attribute; empty for zeros.
    pub default: Vec<f32>,
}

/// A reference member, or the texture of a parameter that may be one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// The name.
    pub name: String,
    /// The role that the referenced instance must have.
    pub role: Role,
    /// The number of instances that it refers to.
    pub count: ReferenceCount,
    /// True if the class tests it with `isSet`, so that leaving it unset is intended.
    pub tested: bool,
}

/// The number of instances that a reference member refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceCount {
    /// A single reference.
    Single,
    /// An array of this size.
    Array(u32),
    /// An array whose size is that of the host's value.
    Open,
}

impl ReferenceCount {
    /// Returns the number of elements without a value of the host; each is unset.
    pub fn unset(self) -> usize {
        match self {
            ReferenceCount::Single => 1,
            ReferenceCount::Array(count) => count as usize,
            ReferenceCount::Open => 0,
        }
    }
}

/// One `key value` of an annotation.
#[derive(Clone, Debug, PartialEq)]
pub struct Annotation {
    /// The key.
    pub key: String,
    /// The value.
    pub value: AnnotationValue,
}

/// The value of an annotation.
#[derive(Clone, Debug, PartialEq)]
pub enum AnnotationValue {
    /// No value: a flag.
    None,
    /// Text.
    Text(String),
    /// A scalar.
    Constant(Constant),
}
