//! Descriptions of classes.

use rtsl_abi::Layout;
use rtsl_abi::description::{
    ClassDescription, ElementDescription, Field, FieldKind, ParameterDescription,
};
use rtsl_ir::class::{AnnotationValue, Parameter, ParameterTarget, ParameterType};
use rtsl_ir::{Scalar, Variable, VariableKind};
use rtsl_link::ClassTree;
use rtsl_source::Diagnostic;

use crate::instance::environment::Environment;
use crate::instance::instance::parameter_name;
use crate::instance::parameters::{bound, flat};
use crate::program::program::Program;
use crate::type_name::type_name;

/// The construction of an instance by a host.
pub(super) struct Construction {
    /// The layout of the block during construction: the constructors' parameters follow the members, by their
    /// [names](parameter_name) among members.
    pub layout: Layout,
}

/// Describes a program's class, except its kernels and the constructor's symbol.
pub(super) fn describe(program: &Program) -> Result<(ClassDescription, Construction), Diagnostic> {
    let (class, layout) = (program.class(), program.layout());
    let mut describer = Describer {
        layout: layout.clone(),
        parameters: Vec::new(),
        fields: Vec::new(),
        initial: vec![0; layout.block_words as usize],
    };
    program.tree().for_each_node(&mut |tree, prefix| describer.node(tree, prefix))?;
    let Describer { mut layout, parameters, mut fields, mut initial } = describer;
    fields.sort_by_key(|field| field.offset);
    layout.block_words = layout.block_words.next_multiple_of(2);
    initial.resize(layout.block_words as usize, 0);
    let element = class.element().and_then(|element| {
        let number = |is_wanted: &dyn Fn(&ParameterDescription) -> bool| {
            parameters.iter().position(is_wanted).map(|index| index as u32)
        };
        Some(ElementDescription {
            parameter: number(&|it| it.name == element.parameter)?,
            // The first leaf of a buffer of structs is as long as the others.
            buffer: number(&|it| {
                let rest = it.name.strip_prefix(element.buffer);
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            })?,
            stride: element.stride,
        })
    });
    let scratch = program.scratch().iter().map(|variable| Field {
        offset: program.layout().scratch[&variable.name],
        ..field(variable, FieldKind::Scratch)
    });
    let description = ClassDescription {
        name: class.name.clone(),
        documentation: class.documentation.clone(),
        roles: class.roles.clone(),
        parameters,
        element,
        fields,
        block_words: program.layout().block_words,
        construct_words: layout.block_words,
        initial,
        scratch: scratch.collect(),
        scratch_arrays: layout.scratch_arrays,
        constructor: None,
        method_documentation: class.method_documentation.clone(),
        kernels: Vec::new(),
    };
    Ok((description, Construction { layout }))
}

struct Describer {
    layout: Layout,
    parameters: Vec<ParameterDescription>,
    fields: Vec<Field>,
    initial: Vec<u32>,
}

impl Describer {
    fn node(&mut self, tree: &ClassTree, prefix: &str) -> Result<(), Diagnostic> {
        let class = &tree.class;
        let mut values = Environment::default();
        values.run(&class.initializer)?;
        let buffers = class.buffers.iter().map(|variable| (variable, FieldKind::Buffer));
        for (variable, kind) in
            class.members.iter().map(|it| (it, FieldKind::Member)).chain(buffers)
        {
            let name = format!("{prefix}{}", variable.name);
            let offsets =
                if kind == FieldKind::Buffer { &self.layout.buffers } else { &self.layout.members };
            let offset = offsets[&name];
            if kind == FieldKind::Member {
                self.set_initial(offset, &values.words(variable));
            }
            self.fields.push(Field { name, offset, ..field(variable, kind) });
        }
        for parameter in &class.parameters {
            // A parameter that is bound to a texture needs no value.
            let is_bound = |(path, element): (String, Option<&ClassTree>)| {
                path == parameter.name && element.is_some()
            };
            let is_required = parameter.required && !tree.elements().any(is_bound);
            for leaf in Leaf::all(parameter) {
                self.parameter(parameter, &leaf, prefix, &values, is_required);
            }
        }
        Ok(())
    }

    fn parameter(
        &mut self,
        parameter: &Parameter,
        leaf: &Leaf,
        prefix: &str,
        values: &Environment,
        is_required: bool,
    ) {
        let name = format!("{prefix}{}", leaf.path);
        let offset = match parameter.target {
            ParameterTarget::Member if leaf.is_buffer => self.layout.buffers[&name],
            ParameterTarget::Member => self.layout.members[&name],
            ParameterTarget::Constructor => self.constructor_parameter(leaf, prefix, values),
        };
        let text = |key: &str| match parameter.annotation(key) {
            Some(AnnotationValue::Text(text)) => Some(text.clone()),
            Some(AnnotationValue::None | AnnotationValue::Constant(_)) | None => None,
        };
        let number = |key: &str| bound(&parameter.annotations, key).map(|number| number as f32);
        self.parameters.push(ParameterDescription {
            name,
            type_name: leaf.type_name.clone(),
            scalar: leaf.scalar,
            len: leaf.len,
            offset,
            is_required,
            is_buffer: leaf.is_buffer,
            is_color: leaf.is_color,
            minimum: number("min"),
            maximum: number("max"),
            label: text("label"),
            documentation: text("doc"),
            choices: parameter
                .choices()
                .into_iter()
                .map(|(it, value)| (it.to_owned(), value))
                .collect(),
        });
    }

    /// Lays out a parameter of a constructor.
    fn constructor_parameter(&mut self, leaf: &Leaf, prefix: &str, values: &Environment) -> u32 {
        let variable = Variable {
            kind: VariableKind::Parameter,
            name: leaf.path.clone(),
            scalar: leaf.scalar,
            len: leaf.len,
        };
        let offset = self.layout.block_words;
        self.layout.block_words += leaf.len;
        self.layout.members.insert(format!("{prefix}{}", parameter_name(&leaf.path)), offset);
        self.set_initial(offset, &values.words(&variable));
        let name = format!("{prefix}{}", leaf.path);
        self.fields.push(Field { name, offset, ..field(&variable, FieldKind::Parameter) });
        offset
    }

    fn set_initial(&mut self, offset: u32, words: &[u32]) {
        let end = offset as usize + words.len();
        self.initial.resize(self.initial.len().max(end), 0);
        self.initial[offset as usize..end].copy_from_slice(words);
    }
}

fn field(variable: &Variable, kind: FieldKind) -> Field {
    let Variable { kind: _, name, scalar, len } = variable.clone();
    Field { name, kind, scalar, len, offset: 0 }
}

/// A parameter, or a field of a parameter that is a struct.
struct Leaf {
    path: String,
    type_name: String,
    scalar: Scalar,
    len: u32,
    is_buffer: bool,
    is_color: bool,
}

impl Leaf {
    /// Returns the leaves of a parameter; none for references.
    fn all(parameter: &Parameter) -> Vec<Leaf> {
        let mut leaves = Vec::new();
        Leaf::add(&parameter.ty, &parameter.name, &mut leaves);
        leaves
    }

    fn add(ty: &ParameterType, path: &str, leaves: &mut Vec<Leaf>) {
        let first = leaves.len();
        match ty {
            ParameterType::Struct(_, fields) => {
                for (field, ty) in fields {
                    Leaf::add(ty, &format!("{path}.{field}"), leaves);
                }
            }
            ParameterType::Array(element, count) => {
                Leaf::add(element, path, leaves);
                for leaf in &mut leaves[first..] {
                    leaf.len *= count;
                    leaf.type_name = format!("{}[{count}]", leaf.type_name);
                }
            }
            ParameterType::Buffer(element) => {
                Leaf::add(element, path, leaves);
                for leaf in &mut leaves[first..] {
                    leaf.is_buffer = true;
                    leaf.type_name = format!("{}[]", leaf.type_name);
                }
            }
            ParameterType::Reference(_) => {}
            ParameterType::Textured(value) => {
                Leaf::add(value, path, leaves);
                for leaf in &mut leaves[first..] {
                    leaf.type_name = type_name(ty);
                }
            }
            ParameterType::Scalar(_)
            | ParameterType::Vector(..)
            | ParameterType::Matrix(..)
            | ParameterType::Color => {
                let Some((scalar, len)) = flat(ty) else { return };
                leaves.push(Leaf {
                    path: path.to_owned(),
                    type_name: type_name(ty),
                    scalar,
                    len,
                    is_buffer: false,
                    is_color: *ty == ParameterType::Color,
                });
            }
        }
    }
}
