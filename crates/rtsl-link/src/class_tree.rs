//! The classes of an instance and of those it refers to, which determine the code of its kernels.

use std::sync::Arc;

use rtsl_abi::Layout;
use rtsl_ir::Variable;
use rtsl_ir::class::{Class, Reference, ReferenceCount};

use crate::attributes::AttributeTable;

/// A class with the classes of the instances that it refers to. Instances with equal trees share their kernels and
/// differ in data.
#[derive(Clone, Debug)]
pub struct ClassTree {
    /// The class.
    pub class: Arc<Class>,
    /// For each reference of the class, its elements: one, or those of the array.
    pub references: Vec<Vec<Option<ClassTree>>>,
    /// The attributes of the scene's objects, if the instance reads or gives them.
    pub attributes: AttributeTable,
}

impl ClassTree {
    /// Returns a key that is equal for trees of the same classes, as long as these classes are alive.
    pub fn key(&self) -> Vec<usize> {
        let mut key = Vec::new();
        self.add_to_key(&mut key);
        self.attributes.add_to_key(&mut key);
        key
    }

    fn add_to_key(&self, key: &mut Vec<usize>) {
        key.push(Arc::as_ptr(&self.class) as usize);
        for (reference, elements) in self.class.references.iter().zip(&self.references) {
            if reference.count == ReferenceCount::Open {
                key.push(elements.len());
            }
            for element in elements {
                match element {
                    Some(tree) => tree.add_to_key(key),
                    None => key.push(0),
                }
            }
        }
    }

    /// Returns all variables of the tree in the order of the blocks. Their names begin with the path to the instance.
    pub fn variables(&self) -> TreeVariables {
        let mut variables = TreeVariables::default();
        self.add_places("", &mut variables);
        variables
    }

    fn add_places(&self, prefix: &str, variables: &mut TreeVariables) {
        let renamed = |variable: &Variable| Variable {
            name: format!("{prefix}{}", variable.name),
            ..variable.clone()
        };
        variables.members.extend(self.class.members.iter().map(renamed));
        variables.buffers.extend(self.class.buffers.iter().map(renamed));
        variables.scratch.extend(self.class.scratch.iter().map(renamed));
        for (path, element) in self.elements() {
            if let Some(tree) = element {
                tree.add_places(&format!("{prefix}{path}."), variables);
            }
        }
    }

    /// Visits every class of the tree, children first, with the path to it and a dot (`kd.`; an empty path for the
    /// root).
    pub fn for_each_node<E>(
        &self,
        visit: &mut impl FnMut(&ClassTree, &str) -> Result<(), E>,
    ) -> Result<(), E> {
        self.visit_nodes("", visit)
    }

    fn visit_nodes<E>(
        &self,
        prefix: &str,
        visit: &mut impl FnMut(&ClassTree, &str) -> Result<(), E>,
    ) -> Result<(), E> {
        for (path, element) in self.elements() {
            if let Some(tree) = element {
                tree.visit_nodes(&format!("{prefix}{path}."), visit)?;
            }
        }
        visit(self, prefix)
    }

    /// Returns the references and the elements of arrays of references, with their paths: `kd`, `layers[2]`.
    pub fn elements(&self) -> impl Iterator<Item = (String, Option<&ClassTree>)> {
        let references = self.class.references.iter().zip(&self.references);
        references.flat_map(|(reference, elements)| {
            elements
                .iter()
                .enumerate()
                .map(|(index, element)| (element_path(reference, index), element.as_ref()))
        })
    }
}

/// Returns the path of an element: `kd`, or `layers[2]` for an array.
pub fn element_path(reference: &Reference, index: usize) -> String {
    match reference.count {
        ReferenceCount::Single => reference.name.clone(),
        ReferenceCount::Array(_) | ReferenceCount::Open => format!("{}[{index}]", reference.name),
    }
}

/// The variables of a tree, the root's first.
#[derive(Clone, Debug, Default)]
pub struct TreeVariables {
    /// The members.
    pub members: Vec<Variable>,
    /// The buffers.
    pub buffers: Vec<Variable>,
    /// The scratch.
    pub scratch: Vec<Variable>,
}

impl TreeVariables {
    /// Returns the layout of their data.
    pub fn layout(&self) -> Layout {
        Layout::new(&self.members, &self.buffers, &self.scratch)
    }
}
