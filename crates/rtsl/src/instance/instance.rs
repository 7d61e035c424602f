//! Instances: a class with its parameters set.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_abi::{BoundBuffer, InstanceBlock, Layout};
use rtsl_ir::class::{Class, Parameter, ParameterTarget, Reference};
use rtsl_ir::{Function, OpKind, VariableKind};
use rtsl_source::{Diagnostic, Diagnostics};

use crate::errors;
use crate::instance::environment::Environment;
use crate::instance::parameters::{self, Argument, Leaves, Words};
use crate::instance::value::Value;
use crate::link::class_tree::{ClassTree, element_path};
use crate::link::linker::{link_function, unset_warning};
use crate::program::elements::parameter_name;

/// Instances that an instance refers to, and those that these refer to, each counted as often as
/// it is reached: what a linked kernel may hold.
const TREE_LIMIT: u64 = 4096;
/// References behind references.
const DEPTH_LIMIT: u32 = 64;

/// An object of a scene: a class, values for its parameters, the instances that it refers to.
/// It does not change; a changed parameter is a new instance, made in microseconds, and kernels
/// stay as they are, since instances are data to them.
///
/// ```
/// use rtsl::{Compiler, Instance, Value};
///
/// let text = "class Layer : rt_Texture; public color tint; public rt_Texture below;
///     void lookup() { rt_TextureColor = tint * below.lookup(); }";
/// let unit = Compiler::default().compile("layer.rtsl", text).unit.expect("it compiles");
/// let class = unit.class("Layer")?;
/// let lower = Instance::new(class, [("tint", [0.2, 0.4, 0.8].into())])?;
/// // A reference is a value as others are.
/// let upper = Instance::new(class, [("tint", 0.5.into()), ("below", Value::Instance(lower))])?;
/// assert_eq!(upper.member("tint"), Some(&[0.5_f32.to_bits(); 3][..]));
/// // All that is wrong is told at once: there is no `tind`, and so `tint` is missing.
/// let problems = Instance::new(class, [("tind", 1.0.into())]).unwrap_err();
/// assert_eq!(problems.iter().count(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
    /// What the constructor started from, where hosts make [elements](Instance::element_count).
    unmade: Option<Box<Unmade>>,
}

/// An instance before its constructor ran.
#[derive(Debug)]
struct Unmade {
    /// In the order of the class's members.
    members: Vec<Vec<u32>>,
    /// The constructor's parameters.
    parameters: Vec<(String, Vec<u32>)>,
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

    /// A warning for each reference that is not set, though a method of the class calls through it and none tests it.
    pub fn unset_reference_warnings(&self) -> Vec<Diagnostic> {
        let mut unset = Vec::new();
        for (reference, elements) in self.class.references.iter().zip(&self.references) {
            if !reference.tested && elements.iter().any(Option::is_none) && self.calls(reference) {
                let paths = elements.iter().enumerate().filter(|(_, element)| element.is_none());
                let warning = |(index, _)| {
                    unset_warning((self.class.name.clone(), element_path(reference, index)))
                };
                unset.extend(paths.map(warning));
            }
        }
        unset
    }

    /// Whether a method of the class calls through the reference.
    fn calls(&self, reference: &Reference) -> bool {
        let mut calls = false;
        for function in self.class.methods.values() {
            function.body.for_each_op(&mut |op| {
                calls |= matches!(&op.kind, OpKind::ReferenceCall(call) if call.member == reference.name);
            });
        }
        calls
    }

    /// The scalars of a member as bits, after the constructor; `None` for an unknown name.
    pub fn member(&self, name: &str) -> Option<&[u32]> {
        let index = self.class.members.iter().position(|variable| variable.name == name)?;
        Some(&self.members[index])
    }

    /// The scalars of a buffer, which other instances may share; `None` for an unknown name.
    pub fn buffer(&self, name: &str) -> Option<&Arc<[u32]>> {
        let index = self.class.buffers.iter().position(|variable| variable.name == name)?;
        Some(&self.buffers[index])
    }

    /// How many objects hosts make of this instance, where its class has an
    /// [element parameter](Class::element): as many as its buffer has whole strides.
    pub fn element_count(&self) -> Option<u32> {
        let element = self.class.element()?;
        let is_buffer = |name: &str| {
            let rest = name.strip_prefix(element.buffer);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let index = self.class.buffers.iter().position(|variable| is_buffer(&variable.name))?;
        let entry_words = self.class.buffers[index].len.max(1) as usize;
        let entries = self.buffers[index].len() / entry_words;
        // Element parameters are i32 or u32, and indices i32.
        Some((entries / element.stride as usize).min(i32::MAX as usize) as u32)
    }

    /// The instance's data, with that of all it refers to, as kernels read it.
    pub(crate) fn block(&self, layout: &Layout) -> InstanceBlock {
        let mut words = vec![0; layout.block_words as usize];
        let mut buffers = Vec::new();
        self.fill_block(layout, "", &mut words, &mut buffers);
        InstanceBlock::new(&words, buffers)
    }

    /// The same before the constructor ran, in a layout that has the constructor's parameters, too, by
    /// their [names there](parameter_name).
    pub(crate) fn unmade_block(&self, layout: &Layout) -> InstanceBlock {
        let mut words = vec![0; layout.block_words as usize];
        let mut buffers = Vec::new();
        self.fill_block(layout, "", &mut words, &mut buffers);
        let Some(Unmade { members, parameters }) = self.unmade.as_deref() else {
            return InstanceBlock::new(&words, buffers);
        };
        let mut fill = |name: &str, data: &[u32]| {
            if let Some(start) = layout.members.get(name).map(|word| *word as usize) {
                words[start..start + data.len()].copy_from_slice(data);
            }
        };
        for (variable, member) in self.class.members.iter().zip(members) {
            fill(&variable.name, member);
        }
        for (name, data) in parameters {
            fill(&parameter_name(name), data);
        }
        InstanceBlock::new(&words, buffers)
    }

    fn fill_block(
        &self,
        layout: &Layout,
        prefix: &str,
        words: &mut [u32],
        buffers: &mut Vec<BoundBuffer>,
    ) {
        for (variable, member) in self.class.members.iter().zip(&self.members) {
            let start = layout.members[&format!("{prefix}{}", variable.name)] as usize;
            words[start..start + member.len()].copy_from_slice(member);
        }
        for (variable, words) in self.class.buffers.iter().zip(&self.buffers) {
            let offset = layout.buffers[&format!("{prefix}{}", variable.name)];
            let element_words = variable.len.max(1);
            buffers.push(BoundBuffer { offset, words: words.clone(), element_words });
        }
        for_each_element(&self.class, &self.references, |path, instance| {
            instance.fill_block(layout, &format!("{prefix}{path}."), words, buffers);
        });
    }

    /// Lets a constructor that refers to this instance as `path` see its data.
    fn show(&self, path: &str, values: &mut Environment) {
        for (variable, words) in self.class.members.iter().zip(&self.members) {
            values.set(VariableKind::Member, &format!("{path}.{}", variable.name), words);
        }
        for (variable, words) in self.class.buffers.iter().zip(&self.buffers) {
            values.set_buffer(&format!("{path}.{}", variable.name), Words::Shared(words.clone()));
        }
        for_each_element(&self.class, &self.references, |inner, instance| {
            instance.show(&format!("{path}.{inner}"), values);
        });
    }
}

impl Unmade {
    fn new(class: &Class, constructor: &Function, values: &Environment) -> Unmade {
        let parameters =
            constructor.variables.iter().filter(|it| it.kind == VariableKind::Parameter);
        Unmade {
            members: class.members.iter().map(|variable| values.words(variable)).collect(),
            parameters: parameters.map(|it| (it.name.clone(), values.words(it))).collect(),
        }
    }
}

/// Calls `visit` with the path and the instance of each reference that is set.
fn for_each_element(
    class: &Class,
    references: &[Vec<Option<Arc<Instance>>>],
    mut visit: impl FnMut(&str, &Instance),
) {
    for (reference, elements) in class.references.iter().zip(references) {
        for (index, element) in elements.iter().enumerate() {
            if let Some(instance) = element {
                visit(&element_path(reference, index), instance);
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
        let references = self.take_references();
        let constructor = match self.link_constructor(&references) {
            Ok(constructor) => constructor,
            Err(problem) => {
                self.problems.push(problem);
                None
            }
        };
        if self.problems.has_errors() {
            return Err(self.problems);
        }
        let (mut values, unmade) = match self.run(constructor.as_deref(), &references) {
            Ok(made) => made,
            Err(problem) => {
                self.problems.push(problem);
                return Err(self.problems);
            }
        };
        let class = self.class;
        let members = class.members.iter().map(|variable| values.take(variable)).collect();
        let buffers = class.buffers.iter().map(|variable| {
            self.members.remove(&variable.name).map_or_else(|| Arc::from([]), Words::into_shared)
        });
        let buffers = buffers.collect();
        let class = class.clone();
        Ok(Instance { class, members, buffers, references, tree_size, depth, unmade })
    }

    /// Initialisers, then the host's values, then the constructor.
    fn run(
        &self,
        constructor: Option<&Function>,
        references: &[Vec<Option<Arc<Instance>>>],
    ) -> Result<(Environment, Option<Box<Unmade>>), Diagnostic> {
        let mut values = Environment::default();
        values.run(&self.class.initializer)?;
        for (name, words) in &self.members {
            if self.class.buffers.iter().any(|variable| variable.name == *name) {
                values.set_buffer(name, words.clone());
            } else {
                values.set(VariableKind::Member, name, words.as_slice());
            }
        }
        for (name, words) in &self.constructor_arguments {
            values.set(VariableKind::Parameter, name, words.as_slice());
        }
        let unmade = self
            .class
            .element()
            .and(constructor)
            .map(|constructor| Box::new(Unmade::new(self.class, constructor, &values)));
        if let Some(constructor) = constructor {
            let show = |path: &str, instance: &Instance| instance.show(path, &mut values);
            for_each_element(self.class, references, show);
            values.run(constructor)?;
        }
        Ok((values, unmade))
    }

    fn take_references(&mut self) -> Vec<Vec<Option<Arc<Instance>>>> {
        let references = self.class.references.iter().map(|reference| {
            let count = reference.count.map_or(1, |count| count as usize);
            match self.references.get(reference.name.as_str()) {
                Some(instances) => instances.iter().cloned().map(Some).collect(),
                None => vec![None; count],
            }
        });
        references.collect()
    }

    /// The constructor without references, if there is one and all is well so far.
    fn link_constructor(
        &self,
        references: &[Vec<Option<Arc<Instance>>>],
    ) -> Result<Option<Cow<'a, Function>>, Diagnostic> {
        let Some(constructor) = &self.class.constructor else { return Ok(None) };
        if references.is_empty() || self.problems.has_errors() {
            return Ok(Some(Cow::Borrowed(constructor)));
        }
        let tree = ClassTree::new(self.class, references);
        link_function(&tree, constructor).map(|linked| Some(Cow::Owned(linked.function)))
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
