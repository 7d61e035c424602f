//! The description of a compiled class for hosts without a compiler: its parameters, data layout and kernels.
//!
//! The description is stored as data in object files, and printed as declarations in C headers and as text for scripts;
//! the writer of C++ also takes the layout of a class from it. A host makes an instance in four steps: it copies
//! [`initial`](ClassDescription::initial) to memory, sets parameters at their offsets, calls the constructor, if there
//! is one, and keeps the first [`block_words`](ClassDescription::block_words) words. To change parameters it repeats
//! these steps.

use std::collections::BTreeMap;

use rtsl_ir::Scalar;
use rtsl_spec::{Method, Role};

use crate::{CallMode, offsets};

/// Classes that were compiled together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LibraryDescription {
    /// The prefix of all symbols.
    pub prefix: String,
    /// The classes, in the order of the source.
    pub classes: Vec<ClassDescription>,
}

/// A class with those to which its references are bound.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassDescription {
    /// The name by which hosts find it.
    pub name: String,
    /// The documentation comment.
    pub documentation: Option<String>,
    /// The roles.
    pub roles: Vec<Role>,
    /// The parameters that hosts may set, leaf by leaf.
    pub parameters: Vec<ParameterDescription>,
    /// The parameter that counts objects, if there is one.
    pub element: Option<ElementDescription>,
    /// The content of the block while an instance is made, in the order of its words: buffers, members, parameters of
    /// constructors.
    pub fields: Vec<Field>,
    /// The number of words of an instance's block, even.
    pub block_words: u32,
    /// The number of words of the block while an instance is made, even: the constructor's parameters follow the
    /// instance.
    pub construct_words: u32,
    /// The block before parameters are set: defaults, and zeros without a default.
    pub initial: Vec<u32>,
    /// The scratch fields, by their arrays.
    pub scratch: Vec<Field>,
    /// The number of scratch arrays.
    pub scratch_arrays: u32,
    /// The symbol of the constructor, `uint32_t symbol(uint32_t *block)`, if there is one. It returns
    /// [`STATUS_BUDGET`](crate::offsets::STATUS_BUDGET) or 0.
    pub constructor: Option<String>,
    /// The comments that precede its methods.
    pub method_documentation: BTreeMap<Method, String>,
    /// The kernels.
    pub kernels: Vec<KernelDescription>,
}

/// The parameter that distinguishes the objects that hosts make of one instance, such as the triangles of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ElementDescription {
    /// The index of the parameter that counts them, from 0.
    pub parameter: u32,
    /// The index of the buffer parameter whose length gives the number of objects.
    pub buffer: u32,
    /// The number of entries of the buffer per object.
    pub stride: u32,
}

/// A run of scalars of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// The name: `center`, `s.a` for a field of a struct, `kd.scale` for a member of the class to which the reference
    /// `kd` is bound.
    pub name: String,
    /// The kind of data.
    pub kind: FieldKind,
    /// The type of each scalar; bools are words of 0 and 1.
    pub scalar: Scalar,
    /// The number of scalars; for a buffer, per element.
    pub len: u32,
    /// The first word; for scratch, the first array.
    pub offset: u32,
}

/// The kinds of data of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FieldKind {
    /// Data of the instance.
    Member,
    /// A buffer's entry, [`BUFFER_WORDS`](crate::offsets::BUFFER_WORDS) words.
    Buffer,
    /// A parameter of a constructor.
    Parameter,
    /// Scratch, per ray.
    Scratch,
}

/// A parameter that hosts may set.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterDescription {
    /// The name, equal to that of its field.
    pub name: String,
    /// The type in RTSL syntax: `float`, `vec3`, `color`, `float[4]`, `vec3[]`.
    pub type_name: String,
    /// The type of each scalar.
    pub scalar: Scalar,
    /// The number of scalars; for a buffer, per element.
    pub len: u32,
    /// The index of its first word in the block.
    pub offset: u32,
    /// True if the host must set it.
    pub is_required: bool,
    /// True for a buffer.
    pub is_buffer: bool,
    /// True for a colour, which is linear RGB.
    pub is_color: bool,
    /// The least permitted value.
    pub minimum: Option<f32>,
    /// The greatest permitted value.
    pub maximum: Option<f32>,
    /// A display name.
    pub label: Option<String>,
    /// A description for users.
    pub documentation: Option<String>,
    /// The names and numbers of the choices, if the type is an enumeration.
    pub choices: Vec<(String, i32)>,
}

/// A kernel of a class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelDescription {
    /// The method.
    pub method: Method,
    /// The call mode.
    pub mode: CallMode,
    /// The width: the number of rays per chunk.
    pub width: u32,
    /// The symbol, `void symbol(RtslCall *call)`.
    pub symbol: String,
    /// The state components that it reads, ascending.
    pub reads: Vec<u32>,
    /// The state components that it stores, ascending.
    pub writes: Vec<u32>,
    /// True if it reads scratch.
    pub reads_scratch: bool,
    /// True if it stores scratch.
    pub writes_scratch: bool,
    /// True if it stores zeros only, for any input.
    pub leaves_zeros: bool,
}

impl ClassDescription {
    /// Returns the indices of the element parameter and its buffer and the stride, in the encoding of libraries:
    /// [`NO_OBJECT`](offsets::NO_OBJECT) twice and 0 if there is none.
    pub fn element_numbers(&self) -> (u32, u32, u32) {
        self.element.map_or((offsets::NO_OBJECT, offsets::NO_OBJECT, 0), |element| {
            (element.parameter, element.buffer, element.stride)
        })
    }
}

impl ParameterDescription {
    /// Returns the `PARAMETER_` bits of [`offsets`].
    pub fn flags(&self) -> u32 {
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        bit(self.is_required, offsets::PARAMETER_REQUIRED)
            | bit(self.is_buffer, offsets::PARAMETER_BUFFER)
            | bit(self.is_color, offsets::PARAMETER_COLOR)
    }
}

impl KernelDescription {
    /// Returns the `METHOD_` bits of [`offsets`].
    pub fn flags(&self) -> u32 {
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        bit(self.reads_scratch, offsets::METHOD_READS_SCRATCH)
            | bit(self.writes_scratch, offsets::METHOD_WRITES_SCRATCH)
            | bit(self.leaves_zeros, offsets::METHOD_LEAVES_ZEROS)
    }
}

impl LibraryDescription {
    /// Returns the symbol of the library's entry.
    pub fn symbol(&self) -> String {
        format!("{}_library", self.prefix)
    }

    /// Returns the symbol of a class's entry.
    pub fn class_symbol(&self, class: &ClassDescription) -> String {
        format!("{}_{}", self.prefix, class.name)
    }
}
