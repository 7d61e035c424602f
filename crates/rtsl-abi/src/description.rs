//! What a compiled class tells hosts that have no compiler: its parameters, where its data lies, which kernels it has.
//!
//! The same description stands as data in object files, as declarations in C headers, as text for scripts, and tells
//! the writer of C++ how a class is laid out. A host makes an instance in four steps: it copies
//! [`initial`](ClassDescription::initial) to memory, sets parameters at their offsets, calls the constructor, if
//! there is one, and keeps the first [`block_words`](ClassDescription::block_words) words. Other values of parameters
//! are the same steps again.

use std::collections::BTreeMap;

use rtsl_ir::Scalar;
use rtsl_spec::{Method, Role};

use crate::{CallMode, offsets};

/// Classes that were compiled together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LibraryDescription {
    /// What all names of symbols begin with.
    pub prefix: String,
    /// The classes, in the order of the text.
    pub classes: Vec<ClassDescription>,
}

/// A class with those that its references are bound to.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassDescription {
    /// Its name, by which hosts find it.
    pub name: String,
    /// Its documentation comment.
    pub documentation: Option<String>,
    /// Its roles.
    pub roles: Vec<Role>,
    /// What hosts may set, leaf by leaf.
    pub parameters: Vec<ParameterDescription>,
    /// The parameter that counts objects, where there is one.
    pub element: Option<ElementDescription>,
    /// What stands in the block while an instance is made, in the order of its words: buffers, members, parameters
    /// of constructors.
    pub fields: Vec<Field>,
    /// Words of an instance's block, even.
    pub block_words: u32,
    /// Words of the block while an instance is made, even: the constructor's parameters stand behind.
    pub construct_words: u32,
    /// The block before anything is set: defaults, and zeros where there are none.
    pub initial: Vec<u32>,
    /// Scratch, by its arrays.
    pub scratch: Vec<Field>,
    /// The number of scratch arrays.
    pub scratch_arrays: u32,
    /// The symbol of the constructor, `uint32_t symbol(uint32_t *block)`, where there is one. It gives
    /// [`STATUS_BUDGET`](crate::offsets::STATUS_BUDGET) or 0.
    pub constructor: Option<String>,
    /// The comments just before its methods.
    pub method_documentation: BTreeMap<Method, String>,
    /// Its kernels.
    pub kernels: Vec<KernelDescription>,
}

/// What tells apart the many objects that hosts make of one instance, such as the triangles of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ElementDescription {
    /// Which parameter counts them, from 0.
    pub parameter: u32,
    /// Which parameter is the buffer whose length says how many there are.
    pub buffer: u32,
    /// Entries of the buffer for each object.
    pub stride: u32,
}

/// A run of scalars of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name: `center`, `s.a` for a field of a struct, `kd.scale` for a member of what the reference `kd` is bound to.
    pub name: String,
    /// What it is.
    pub kind: FieldKind,
    /// The type of each scalar; bools are words of 0 and 1.
    pub scalar: Scalar,
    /// How many scalars; of a buffer, in one element.
    pub len: u32,
    /// The first word; for scratch, the first array.
    pub offset: u32,
}

/// What a field is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FieldKind {
    /// Data of the instance.
    Member,
    /// A buffer's entry, [`BUFFER_WORDS`](crate::offsets::BUFFER_WORDS) words.
    Buffer,
    /// A parameter of a constructor.
    Parameter,
    /// Per ray.
    Scratch,
}

/// What hosts may set.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterDescription {
    /// Its name, as that of its field.
    pub name: String,
    /// Its type as RTSL writes it: `float`, `vec3`, `color`, `float[4]`, `vec3[]`.
    pub type_name: String,
    /// The type of each scalar.
    pub scalar: Scalar,
    /// How many scalars; of a buffer, in one element.
    pub len: u32,
    /// Its first word in the block.
    pub offset: u32,
    /// The host must set it.
    pub is_required: bool,
    /// A buffer.
    pub is_buffer: bool,
    /// Linear RGB.
    pub is_color: bool,
    /// The least number that is allowed.
    pub minimum: Option<f32>,
    /// The greatest.
    pub maximum: Option<f32>,
    /// A name for people.
    pub label: Option<String>,
    /// What it is, for people.
    pub documentation: Option<String>,
}

/// A kernel of a class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelDescription {
    /// The method.
    pub method: Method,
    /// What its lanes have in common.
    pub shape: CallMode,
    /// Rays at a time.
    pub width: u32,
    /// The symbol, `void symbol(RtslCall *call)`.
    pub symbol: String,
    /// The state components that it reads, ascending.
    pub reads: Vec<u32>,
    /// The state components that it sets, ascending.
    pub writes: Vec<u32>,
    /// Whether it reads scratch.
    pub reads_scratch: bool,
    /// Whether it sets scratch.
    pub writes_scratch: bool,
    /// Whether it leaves zeros in all that it sets, whatever it is called for.
    pub leaves_zeros: bool,
}

impl ClassDescription {
    /// The numbers of the element parameter and its buffer and the stride, as libraries have them:
    /// [`NO_OBJECT`](offsets::NO_OBJECT) twice and 0 where there is none.
    pub fn element_numbers(&self) -> (u32, u32, u32) {
        self.element.map_or((offsets::NO_OBJECT, offsets::NO_OBJECT, 0), |element| {
            (element.parameter, element.buffer, element.stride)
        })
    }
}

impl ParameterDescription {
    /// The `PARAMETER_` bits of [`offsets`].
    pub fn flags(&self) -> u32 {
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        bit(self.is_required, offsets::PARAMETER_REQUIRED)
            | bit(self.is_buffer, offsets::PARAMETER_BUFFER)
            | bit(self.is_color, offsets::PARAMETER_COLOR)
    }
}

impl KernelDescription {
    /// The `METHOD_` bits of [`offsets`].
    pub fn flags(&self) -> u32 {
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        bit(self.reads_scratch, offsets::METHOD_READS_SCRATCH)
            | bit(self.writes_scratch, offsets::METHOD_WRITES_SCRATCH)
            | bit(self.leaves_zeros, offsets::METHOD_LEAVES_ZEROS)
    }
}

impl LibraryDescription {
    /// The symbol of the library's own entry.
    pub fn symbol(&self) -> String {
        format!("{}_library", self.prefix)
    }

    /// The symbol of a class's entry.
    pub fn class_symbol(&self, class: &ClassDescription) -> String {
        format!("{}_{}", self.prefix, class.name)
    }
}
