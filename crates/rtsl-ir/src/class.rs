//! Compiled classes: their interface to hosts, and one function for each method.

use std::collections::BTreeMap;

use rtsl_spec::{Method, Role};

use crate::{Constant, Function, Scalar, Variable};

/// A class, checked and lowered, not yet linked with the instances it refers to.
#[derive(Clone, Debug)]
pub struct Class {
    /// Its name, by which hosts find it.
    pub name: String,
    /// Its roles, in the order of [`Role::ALL`].
    pub roles: Vec<Role>,
    /// Its documentation comment.
    pub documentation: Option<String>,
    /// What hosts may set, constructor parameters first.
    pub parameters: Vec<Parameter>,
    /// The instance's data: public and private members, leaf by leaf; no buffers, no references.
    pub members: Vec<Variable>,
    /// Its buffers, leaf by leaf.
    pub buffers: Vec<Variable>,
    /// Its scratch, leaf by leaf.
    pub scratch: Vec<Variable>,
    /// Its scratch members as they are declared, in order: for hosts that show or set them.
    pub scratch_types: Vec<(String, ParameterType)>,
    /// Its references.
    pub references: Vec<Reference>,
    /// Gives every member its initial value and every constructor parameter its default
    /// (zero where it has none); reads nothing.
    pub initializer: Function,
    /// Reads parameters and members, gives members.
    pub constructor: Option<Function>,
    /// The methods it has, those implied by others included.
    pub methods: BTreeMap<Method, Function>,
    /// The comments just before methods of its own.
    pub method_documentation: BTreeMap<Method, String>,
}

/// The annotation that marks the element parameter, and names its buffer.
pub const ELEMENT: &str = "element";
/// The annotation beside it: how many entries of the buffer belong to one object.
pub const STRIDE: &str = "stride";

/// What tells apart the many objects that hosts make of one instance, such as the triangles of a
/// mesh: a parameter counts `stride` entries of a buffer at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Element<'a> {
    /// The parameter: 0 for the first object.
    pub parameter: &'a str,
    /// The buffer.
    pub buffer: &'a str,
    /// Entries of the buffer for each object, at least 1.
    pub stride: u32,
}

impl Class {
    /// The class's element parameter, if it has one.
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
    /// The value of an annotation.
    pub fn annotation(&self, key: &str) -> Option<&AnnotationValue> {
        let annotation = self.annotations.iter().find(|annotation| annotation.key == key);
        annotation.map(|annotation| &annotation.value)
    }
}

/// What a host may set when it makes an instance.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// The name.
    pub name: String,
    /// The type.
    pub ty: ParameterType,
    /// Where the value goes: to the place(s) of this name of a constructor parameter or a member.
    pub target: ParameterTarget,
    /// The host must set it.
    pub required: bool,
    /// `[[...]]`, in order.
    pub annotations: Vec<Annotation>,
}

/// Where a parameter's value goes.
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
    /// A struct: its name, its fields in order.
    Struct(String, Vec<(String, ParameterType)>),
    /// A fixed-size array.
    Array(Box<ParameterType>, u32),
    /// An unsized array.
    Buffer(Box<ParameterType>),
    /// A reference to an instance with this role.
    Reference(Role),
}

/// A reference member.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// Its name.
    pub name: String,
    /// The role that the referenced instance must have.
    pub role: Role,
    /// For an array of references its size.
    pub count: Option<u32>,
    /// The class tests it with `isSet`, so that leaving it unset is meant.
    pub tested: bool,
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
    /// Nothing: a flag.
    None,
    /// Text.
    Text(String),
    /// A scalar.
    Constant(Constant),
}
