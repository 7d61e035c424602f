//! Instances: a class with its parameters set.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use rtsl_abi::{BoundBuffer, InstanceBlock, Layout};
use rtsl_ir::class::{Class, Reference};
use rtsl_ir::{Function, OpKind, VariableKind};
use rtsl_link::AttributeTable;
use rtsl_link::attributes::reads_attributes;
use rtsl_link::class_tree::{ClassTree, element_path};
use rtsl_link::errors::unset_reference;
use rtsl_memory::SharedWords;
use rtsl_source::Diagnostic;
use rtsl_spec::{Method, StateVariable};

use super::environment::Environment;
use super::wording::Wording;
use super::words::Words;
use crate::errors;

/// An object of a scene: a class, values for its parameters, and the instances that it refers to. Instances are
/// immutable; a changed parameter is a new instance, made in microseconds, and no kernel is compiled, since instances
/// are data.
///
/// ```
/// use rtsl::{Compiler, Instance, Value};
///
/// let text = "class Layer : rt_Texture; public color tint; public rt_Texture below;
///     void lookup() { rt_TextureColor = tint * below.lookup(); }";
/// let unit = Compiler::default().compile("layer.rtsl", text).unit.expect("it compiles");
/// let class = unit.class("Layer")?;
/// let lower = Instance::new(class, [("tint", [0.2, 0.4, 0.8].into())])?;
/// // A reference is a value, too.
/// let upper = Instance::new(class, [("tint", 0.5.into()), ("below", Value::Instance(lower))])?;
/// assert_eq!(upper.member("tint"), Some(&[0.5_f32.to_bits(); 3][..]));
/// // All errors are reported at once: there is no `tind`, and so `tint` is missing.
/// let problems = Instance::new(class, [("tind", 1.0.into())]).unwrap_err();
/// assert_eq!(problems.iter().count(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Instance {
    pub(super) class: Arc<Class>,
    /// In the order of the class's members.
    pub(super) members: Vec<Vec<u32>>,
    /// In the order of the class's buffers.
    pub(super) buffers: Vec<SharedWords>,
    /// In the order of the class's references: one element, or those of the array.
    pub(super) references: Vec<Vec<Option<Arc<Instance>>>>,
    pub(super) tree_size: u64,
    pub(super) depth: u32,
    /// The state before the constructor ran, if the class has [elements](Instance::element_count).
    pub(super) unmade: Option<Box<Unmade>>,
    pub(super) outside_range: Vec<OutsideRange>,
    /// The attributes of the scene's objects, if the instance reads or gives them.
    pub(super) attributes: AttributeTable,
    pub(super) attached: Attached,
}

/// A value that a host gave, outside of the range that the annotations `min` and `max` of its parameter declare.
#[derive(Clone, Debug)]
pub struct OutsideRange {
    /// The name of the parameter.
    pub parameter: String,
    /// A warning about it, for users.
    pub warning: Diagnostic,
}

/// The instance with attributes that was made of an instance last.
#[derive(Debug, Default)]
pub(super) struct Attached(Mutex<Weak<Instance>>);

impl Clone for Attached {
    /// A copy of an instance has its own.
    fn clone(&self) -> Attached {
        Attached::default()
    }
}

/// An instance before its constructor ran.
#[derive(Clone, Debug)]
pub(super) struct Unmade {
    /// In the order of the class's members.
    members: Vec<Vec<u32>>,
    /// The constructor's parameters.
    parameters: Vec<(String, Vec<u32>)>,
}

impl Instance {
    /// The class.
    pub fn class(&self) -> &Arc<Class> {
        &self.class
    }

    /// Returns the class with the classes of the instances that it refers to.
    pub(crate) fn tree(&self) -> ClassTree {
        ClassTree {
            attributes: self.attributes.clone(),
            ..class_tree(&self.class, &self.references)
        }
    }

    /// Lists the attributes that `readers`, or instances that they refer to, read and that any of `shapes` gives.
    ///
    /// ```
    /// use rtsl::{Compiler, Instance};
    ///
    /// let text = "class Dust : rt_Texture { attribute float dust = 0.1; void lookup() { rt_FloatTextureValue = dust; } };
    ///     class Ball : rt_Primitive { public float dust = 0.5; void intersect() { hit(-rt_RayOrigin.z); }
    ///         void computeNormal() { rt_GeometricNormal = rt_HitPoint; } };";
    /// let unit = Compiler::default().compile("dust.rtsl", text).unit.expect("it compiles");
    /// let instance = |class| Instance::new(unit.class(class).unwrap(), []).unwrap();
    /// let (texture, ball) = (instance("Dust"), instance("Ball"));
    /// let table = Instance::attributes([&*texture], [&*ball])?;
    /// assert_eq!(table.names().collect::<Vec<_>>(), ["dust"]);
    /// // Programs of these instances pass the attribute.
    /// let (texture, ball) = (texture.with_attributes(&table), ball.with_attributes(&table));
    /// # Ok::<(), rtsl::Diagnostic>(())
    /// ```
    ///
    /// # Errors
    /// If the attributes have more than [`MAX_ATTRIBUTE_SCALARS`](crate::MAX_ATTRIBUTE_SCALARS) scalars in all.
    pub fn attributes<'a>(
        readers: impl IntoIterator<Item = &'a Instance>,
        shapes: impl IntoIterator<Item = &'a Instance>,
    ) -> Result<AttributeTable, Diagnostic> {
        let mut classes = Vec::new();
        readers.into_iter().for_each(|instance| instance.add_classes(&mut classes));
        AttributeTable::new(classes, shapes.into_iter().map(|shape| &*shape.class))
    }

    /// Adds the class of the instance, and those of the instances that it refers to.
    fn add_classes<'a>(&'a self, classes: &mut Vec<&'a Class>) {
        classes.push(&self.class);
        let references = self.references.iter().flatten().flatten();
        references.for_each(|instance| instance.add_classes(classes));
    }

    /// Returns the instance as part of a scene whose objects have these attributes: the methods of materials and
    /// textures read them, and shapes give them. Its program differs from that of the instance without them. As long
    /// as somebody has the result, the same attributes give it again.
    #[must_use]
    pub fn with_attributes(&self, attributes: &AttributeTable) -> Arc<Instance> {
        let mut attached = self.attached.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = attached.upgrade().filter(|it| it.attributes == *attributes);
        known.unwrap_or_else(|| {
            let with = Arc::new(Instance { attributes: attributes.clone(), ..self.clone() });
            *attached = Arc::downgrade(&with);
            with
        })
    }

    /// True if a method of the instance, or of one that it refers to, reads an attribute.
    pub fn reads_attributes(&self) -> bool {
        reads_attributes(&self.class)
            || self.references.iter().flatten().flatten().any(|it| it.reads_attributes())
    }

    /// The instances that it refers to: for each of the class's references one element, or those of the array.
    pub fn references(&self) -> &[Vec<Option<Arc<Instance>>>] {
        &self.references
    }

    /// Returns the instance of a reference, or of an element of an array of references (`layers[2]`).
    pub fn reference(&self, path: &str) -> Option<&Arc<Instance>> {
        let elements = self.class.references.iter().zip(&self.references);
        let mut named = elements.flat_map(|(reference, elements)| {
            elements.iter().enumerate().map(|(index, it)| (element_path(reference, index), it))
        });
        named.find(|(name, _)| name == path).and_then(|(_, element)| element.as_ref())
    }

    /// Returns the values outside of the ranges of their parameters. They are taken as they are; hosts tell users of them.
    pub fn outside_range(&self) -> &[OutsideRange] {
        &self.outside_range
    }

    /// Returns a warning for each unset reference that a method of the class calls through and none tests, in the words
    /// of a file format or of the class.
    pub fn unset_reference_warnings(&self, wording: Option<&Wording>) -> Vec<Diagnostic> {
        let mut unset = Vec::new();
        for (reference, elements) in self.class.references.iter().zip(&self.references) {
            if !reference.tested && elements.iter().any(Option::is_none) && self.calls(reference) {
                let paths = elements.iter().enumerate().filter(|(_, element)| element.is_none());
                let warning = |(index, _)| {
                    let path = element_path(reference, index);
                    match wording {
                        Some(wording) => errors::unset_reference_of_format(wording, &path),
                        None => unset_reference(&self.class.name, &path),
                    }
                };
                unset.extend(paths.map(warning));
            }
        }
        unset
    }

    /// True if a call of the method, of this instance or of one that it refers to, gives another shader a value of the
    /// state variable as an argument.
    pub fn passes_state(&self, method: Method, variable: &StateVariable) -> bool {
        let mut passes = false;
        if let Some(function) = self.class.methods.get(&method) {
            function.body.for_each_op(&mut |op| {
                if let OpKind::ReferenceCall(call) = &op.kind {
                    passes |= call.overrides.iter().any(|(it, _)| it.variable == variable.index);
                }
            });
        }
        let mut below = self.references.iter().flatten().flatten();
        passes || below.any(|instance| instance.passes_state(method, variable))
    }

    /// True if a method of the class calls through the reference.
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
    pub fn buffer(&self, name: &str) -> Option<&SharedWords> {
        let index = self.class.buffers.iter().position(|variable| variable.name == name)?;
        Some(&self.buffers[index])
    }

    /// Returns the number of objects that hosts make of this instance if its class has an
    /// [element parameter](Class::element): the number of whole strides of its buffer.
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

    /// Returns the data of the instance and of all it refers to, as kernels read it.
    pub(crate) fn block(&self, layout: &Layout) -> InstanceBlock {
        let mut words = vec![0; layout.block_words as usize];
        let mut buffers = Vec::new();
        self.fill_block(layout, "", &mut words, &mut buffers);
        InstanceBlock::new(&words, buffers)
    }

    /// Returns the data before the constructor ran, in a layout that also has the constructor's parameters, by their
    /// [names among members](parameter_name).
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

    /// Adds the data of this instance, to which a constructor refers as `path`.
    pub(super) fn show(&self, path: &str, values: &mut Environment) {
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
    pub fn new(class: &Class, constructor: &Function, values: &Environment) -> Unmade {
        let parameters =
            constructor.variables.iter().filter(|it| it.kind == VariableKind::Parameter);
        Unmade {
            members: class.members.iter().map(|variable| values.words(variable)).collect(),
            parameters: parameters.map(|it| (it.name.clone(), values.words(it))).collect(),
        }
    }
}

/// Returns a class whose references are set to these instances, with the classes of the instances.
pub(super) fn class_tree(
    class: &Arc<Class>,
    references: &[Vec<Option<Arc<Instance>>>],
) -> ClassTree {
    let each = |elements: &Vec<Option<Arc<Instance>>>| {
        elements.iter().map(|element| element.as_deref().map(Instance::tree)).collect()
    };
    ClassTree {
        class: class.clone(),
        references: references.iter().map(each).collect(),
        attributes: AttributeTable::default(),
    }
}

/// Returns the name of a constructor's parameter among the members, none of which has such a name.
pub(crate) fn parameter_name(name: &str) -> String {
    format!("rt_Parameter.{name}")
}

/// Calls `visit` with the path and the instance of each reference that is set.
pub(super) fn for_each_element(
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
