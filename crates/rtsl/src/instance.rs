//! Instances: a class with its parameters set.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::PlaceKind;
use rtsl_ir::class::{Class, Parameter, ParameterTarget};
use rtsl_jit::{BoundBuffer, InstanceBlock};
use rtsl_packet::Layout;
use rtsl_source::Diagnostics;

use crate::environment::Environment;
use crate::errors;
use crate::parameters::{self, Argument, Leaves, Words};
use crate::tree::element_path;
use crate::value::Value;

/// Instances that an instance refers to, and those that these refer to, each counted as often as
/// it is reached: what a linked kernel may hold.
const TREE_LIMIT: u64 = 4096;
/// References behind references.
const DEPTH_LIMIT: u32 = 64;

/// An object of a scene: a class, values for its parameters, the instances that it refers to.
/// It does not change; a changed parameter is a new instance, made in microseconds, and kernels
/// stay as they are, since instances are data to them.
#[derive(Debug)]
pub struct Instance {
    class: Arc<Class>,
    /// In the order of the class's members.
    members: Vec<Vec<u32>>,
    /// In the order of the class's buffers.
    buffers: Vec<Arc<[u32]>>,
    /// In the order of the class's references: one element, or those of the array.
    references: Vec<Vec<Option<Arc<Instance>>>>,
    tree_size: u64,
    depth: u32,
}

impl Instance {
    /// Makes an instance: runs the member initialisers, sets the public members, runs the
    /// constructor.
    ///
    /// # Errors
    /// Every problem of the arguments: unknown names, wrong types, numbers out of range, missing
    /// parameters.
    pub fn new<'a>(
        class: &Arc<Class>,
        arguments: impl IntoIterator<Item = (&'a str, Value)>,
    ) -> Result<Arc<Instance>, Diagnostics> {
        let mut builder = Builder::new(class);
        for (name, value) in arguments {
            builder.argument(name, &value);
        }
        builder.check_required();
        builder.finish().map(Arc::new)
    }

    /// Its class.
    pub fn class(&self) -> &Arc<Class> {
        &self.class
    }

    /// What it refers to: for each of the class's references one element, or those of the array.
    pub fn references(&self) -> &[Vec<Option<Arc<Instance>>>] {
        &self.references
    }

    /// The instance that a reference, or an element of an array of references (`layers[2]`),
    /// names.
    pub fn reference(&self, path: &str) -> Option<&Arc<Instance>> {
        let elements = self.class.references.iter().zip(&self.references);
        let mut named = elements.flat_map(|(reference, elements)| {
            elements.iter().enumerate().map(|(index, it)| (element_path(reference, index), it))
        });
        named.find(|(name, _)| name == path).and_then(|(_, element)| element.as_ref())
    }

    /// The scalars of a member as bits, after the constructor; `None` for an unknown name.
    pub fn member(&self, name: &str) -> Option<&[u32]> {
        let index = self.class.members.iter().position(|place| place.name == name)?;
        Some(&self.members[index])
    }

    /// The instance's data, with that of all it refers to, as kernels read it.
    pub(crate) fn block(&self, layout: &Layout) -> InstanceBlock {
        let mut words = vec![0; layout.block_words as usize];
        let mut buffers = Vec::new();
        self.fill_block(layout, "", &mut words, &mut buffers);
        InstanceBlock::new(&words, buffers)
    }

    fn fill_block(
        &self,
        layout: &Layout,
        prefix: &str,
        words: &mut [u32],
        buffers: &mut Vec<BoundBuffer>,
    ) {
        for (place, member) in self.class.members.iter().zip(&self.members) {
            let start = layout.members[&format!("{prefix}{}", place.name)] as usize;
            words[start..start + member.len()].copy_from_slice(member);
        }
        for (place, words) in self.class.buffers.iter().zip(&self.buffers) {
            let offset = layout.buffers[&format!("{prefix}{}", place.name)];
            let element_words = place.len.max(1);
            buffers.push(BoundBuffer { offset, words: words.clone(), element_words });
        }
        for (reference, elements) in self.class.references.iter().zip(&self.references) {
            for (index, element) in elements.iter().enumerate() {
                if let Some(instance) = element {
                    let path = format!("{prefix}{}.", element_path(reference, index));
                    instance.fill_block(layout, &path, words, buffers);
                }
            }
        }
    }
}

/// Gathers arguments and what is wrong with them.
struct Builder<'a> {
    class: &'a Arc<Class>,
    given: Vec<&'a str>,
    constructor_arguments: Leaves,
    members: Leaves,
    references: BTreeMap<&'a str, Vec<Arc<Instance>>>,
    problems: Diagnostics,
}

impl<'a> Builder<'a> {
    fn new(class: &'a Arc<Class>) -> Self {
        Builder {
            class,
            given: Vec::new(),
            constructor_arguments: Leaves::new(),
            members: Leaves::new(),
            references: BTreeMap::new(),
            problems: Diagnostics::new(),
        }
    }

    fn argument(&mut self, name: &str, value: &Value) {
        let class = self.class;
        let Some(parameter) = class.parameters.iter().find(|it| it.name == name) else {
            self.problems.push(errors::unknown_parameter(class, name));
            return;
        };
        self.given.push(&parameter.name);
        match parameters::argument(parameter, value) {
            Err(mismatch) => self.problems.push(errors::mismatch(class, parameter, mismatch)),
            Ok(Argument::References(instances)) => {
                self.references.insert(&parameter.name, instances);
            }
            Ok(Argument::Data(leaves)) => match parameter.target {
                ParameterTarget::Constructor => self.constructor_arguments.extend(leaves),
                ParameterTarget::Member => self.members.extend(leaves),
            },
        }
    }

    fn check_required(&mut self) {
        let missing: Vec<&Parameter> = self
            .class
            .parameters
            .iter()
            .filter(|it| it.required && !self.given.contains(&it.name.as_str()))
            .collect();
        if !missing.is_empty() {
            self.problems.push(errors::missing_parameters(self.class, &missing));
        }
    }

    fn finish(mut self) -> Result<Instance, Diagnostics> {
        let (tree_size, depth) = self.measure_tree();
        if self.problems.has_errors() {
            return Err(self.problems);
        }
        let class = self.class;
        let mut values = Environment::default();
        values.run(&class.initializer);
        for (name, words) in &self.members {
            values.set(PlaceKind::Member, name, words.as_slice());
            values.set(PlaceKind::Buffer, name, words.as_slice());
        }
        for (name, words) in &self.constructor_arguments {
            values.set(PlaceKind::Parameter, name, words.as_slice());
        }
        if let Some(constructor) = &class.constructor {
            values.run(constructor);
        }
        let members = class.members.iter().map(|place| values.take(place));
        let buffers = class.buffers.iter().map(|place| {
            self.members.remove(&place.name).map_or_else(|| Arc::from([]), Words::into_shared)
        });
        let references = class.references.iter().map(|reference| {
            let count = reference.count.map_or(1, |count| count as usize);
            match self.references.remove(reference.name.as_str()) {
                Some(instances) => instances.into_iter().map(Some).collect(),
                None => vec![None; count],
            }
        });
        Ok(Instance {
            class: class.clone(),
            members: members.collect(),
            buffers: buffers.collect(),
            references: references.collect(),
            tree_size,
            depth,
        })
    }

    fn measure_tree(&mut self) -> (u64, u32) {
        let referenced = || self.references.values().flatten();
        let size = referenced().fold(1_u64, |sum, it| sum.saturating_add(it.tree_size));
        let depth = 1 + referenced().map(|it| it.depth).max().unwrap_or(0);
        if size > TREE_LIMIT || depth > DEPTH_LIMIT {
            self.problems.push(errors::too_many_references(self.class));
        }
        (size, depth)
    }
}
