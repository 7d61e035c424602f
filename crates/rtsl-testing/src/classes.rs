//! Classes without texts.

use rtsl_ir::Function;
use rtsl_ir::class::{Class, Reference, ReferenceCount};
use rtsl_spec::{Method, Role};

/// A class with one method, and with the references that are named `name[count]`.
pub fn class(name: &str, role: Role, method: Method, references: &[&str], text: &str) -> Class {
    let reference = |text: &&str| {
        let (name, count) = match text.split_once('[') {
            Some((name, count)) => {
                let count = count.trim_end_matches(']').parse();
                (name, count.map_or(ReferenceCount::Open, ReferenceCount::Array))
            }
            None => (*text, ReferenceCount::Single),
        };
        Reference { name: name.to_owned(), role: Role::Texture, count, tested: false }
    };
    Class {
        name: name.to_owned(),
        roles: vec![role],
        documentation: None,
        parameters: Vec::new(),
        members: Vec::new(),
        buffers: Vec::new(),
        scratch: Vec::new(),
        scratch_types: Vec::new(),
        outputs: Vec::new(),
        method_documentation: Default::default(),
        is_traced: false,
        differentiable: Default::default(),
        attributes: Vec::new(),
        references: references.iter().map(reference).collect(),
        initializer: Function::new(format!("{name}.initializer")),
        constructor: None,
        methods: [(method, text.parse().unwrap())].into(),
    }
}
