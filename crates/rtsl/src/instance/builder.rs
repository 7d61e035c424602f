//! The construction of instances from a host's values.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::class::{Class, Parameter, ParameterTarget};
use rtsl_ir::{Function, VariableKind};
use rtsl_link::{AttributeTable, link_function};
use rtsl_source::{Diagnostic, Diagnostics};

use super::environment::Environment;
use super::instance::{Attached, Instance, OutsideRange, Unmade, class_tree, for_each_element};
use super::parameters;
use super::parameters::Argument;
use super::value::Value;
use super::wording::Wording;
use super::words::{Leaves, Words};
use crate::errors;

/// The greatest number of instances that an instance reaches through references, each counted as often as it is
/// reached: a linked kernel may contain the code of all.
const TREE_LIMIT: u64 = 4096;
/// The greatest depth of references.
const DEPTH_LIMIT: u32 = 64;

impl Instance {
    /// Makes an instance: runs the member initialisers, sets the public members, runs the
    /// constructor.
    ///
    /// # Errors
    /// Every problem of the arguments: unknown names, wrong types, values without a meaning, missing
    /// parameters.
    pub fn new<'a>(
        class: &Arc<Class>,
        arguments: impl IntoIterator<Item = (&'a str, Value)>,
    ) -> Result<Arc<Instance>, Diagnostics> {
        Instance::with_wording(class, arguments, None)
    }

    /// Makes an instance like [`Instance::new`], with these words in messages.
    ///
    /// # Errors
    /// Those of [`Instance::new`].
    pub fn with_wording<'a>(
        class: &Arc<Class>,
        arguments: impl IntoIterator<Item = (&'a str, Value)>,
        wording: Option<Wording>,
    ) -> Result<Arc<Instance>, Diagnostics> {
        let wording = wording.unwrap_or_else(|| Wording::of(class));
        let mut builder = Builder::new(class, &wording);
        for (name, value) in arguments {
            builder.argument(name, &value);
        }
        builder.check_required();
        builder.finish().map(Arc::new)
    }
}

/// Collects arguments and their errors.
struct Builder<'a> {
    class: &'a Arc<Class>,
    wording: &'a Wording,
    given: Vec<&'a str>,
    constructor_arguments: Leaves,
    members: Leaves,
    references: BTreeMap<&'a str, Vec<Arc<Instance>>>,
    outside_range: Vec<OutsideRange>,
    problems: Diagnostics,
}

impl<'a> Builder<'a> {
    fn new(class: &'a Arc<Class>, wording: &'a Wording) -> Self {
        Builder {
            class,
            wording,
            given: Vec::new(),
            constructor_arguments: Leaves::new(),
            members: Leaves::new(),
            references: BTreeMap::new(),
            outside_range: Vec::new(),
            problems: Diagnostics::new(),
        }
    }

    fn argument(&mut self, name: &str, value: &Value) {
        let class = self.class;
        let Some(parameter) = class.parameters.iter().find(|it| it.name == name) else {
            self.problems.push(errors::unknown_parameter(class, name, self.wording));
            return;
        };
        self.given.push(&parameter.name);
        match parameters::argument(parameter, value) {
            Err(mismatch) => {
                self.problems.push(errors::mismatch(self.wording, parameter, mismatch));
            }
            Ok(Argument::References(instances)) => {
                // A textured parameter has the value or the texture that is given last.
                self.members.remove(&parameter.name);
                self.references.insert(&parameter.name, instances);
            }
            Ok(Argument::Data(leaves, outside)) => {
                self.outside_range.extend(outside.map(|reason| OutsideRange {
                    parameter: parameter.name.clone(),
                    warning: errors::outside_range(self.wording, parameter, &reason),
                }));
                match parameter.target {
                    ParameterTarget::Constructor => self.constructor_arguments.extend(leaves),
                    ParameterTarget::Member => {
                        self.references.remove(parameter.name.as_str());
                        self.members.extend(leaves);
                    }
                }
            }
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
            self.problems.push(errors::missing_parameters(self.wording, &missing));
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
            self.members.remove(&variable.name).map(Words::into_shared).unwrap_or_default()
        });
        let buffers = buffers.collect();
        let class = class.clone();
        let attributes = AttributeTable::default();
        let attached = Attached::default();
        Ok(Instance {
            class,
            members,
            buffers,
            references,
            tree_size,
            depth,
            unmade,
            outside_range: self.outside_range,
            attributes,
            attached,
        })
    }

    /// Runs the initialisers, sets the host's values, and runs the constructor.
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
            match self.references.get(reference.name.as_str()) {
                Some(instances) => instances.iter().cloned().map(Some).collect(),
                None => vec![None; reference.count.unset()],
            }
        });
        references.collect()
    }

    /// Links the constructor, if there is one and no error so far.
    fn link_constructor(
        &self,
        references: &[Vec<Option<Arc<Instance>>>],
    ) -> Result<Option<Cow<'a, Function>>, Diagnostic> {
        let Some(constructor) = &self.class.constructor else { return Ok(None) };
        if references.is_empty() || self.problems.has_errors() {
            return Ok(Some(Cow::Borrowed(constructor)));
        }
        let tree = class_tree(self.class, references);
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
