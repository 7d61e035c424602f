//! Attributes of hit objects: values that shapes give and that materials and textures read by name.
//!
//! A scene has one list of the attributes that its shaders read and its shapes give. Linking replaces a read by a load
//! of the attribute's place in the state variable [`ATTRIBUTES`], and makes the method `computeTextureCoordinates` of
//! shapes set all places. An attribute that no shape gives is its default value, as are all attributes for hosts that
//! have no list.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_ir::class::{Attribute, Class, ParameterTarget, ParameterType};
use rtsl_ir::{
    Constant, Function, Index, Op, OpKind, Output, Scalar, Value, Variable, VariableKind,
};
use rtsl_source::Diagnostic;
use rtsl_spec::{ATTRIBUTES, COLOR_COMPONENTS, MAX_ATTRIBUTE_SCALARS, Method, Role};

use crate::class_tree::ClassTree;
use crate::draft::{Draft, Linking};
use crate::errors;
use crate::linker::Linker;
use crate::loads::load_component;
use crate::site::Site;

/// The attributes of the objects of a scene that its shaders read, with their places in the state of a ray.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AttributeTable {
    places: Arc<[Place]>,
}

/// An attribute with its place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    name: String,
    /// The bits of the value of objects that do not have the attribute. Readers with different defaults have different
    /// places.
    default: Vec<u32>,
    /// The first scalar in the state variable.
    first: u32,
}

impl AttributeTable {
    /// Lists the attributes that classes of materials and textures among `readers` read and that any of `shapes` gives.
    ///
    /// # Errors
    /// If the attributes have more than [`MAX_ATTRIBUTE_SCALARS`] scalars in all.
    pub fn new<'a>(
        readers: impl IntoIterator<Item = &'a Class>,
        shapes: impl IntoIterator<Item = &'a Class>,
    ) -> Result<AttributeTable, Diagnostic> {
        let mut read: BTreeSet<(String, Vec<u32>)> = BTreeSet::new();
        for class in readers.into_iter().filter(|class| reads_attributes(class)) {
            read.extend(class.attributes.iter().map(|it| (it.name.clone(), default_bits(it))));
        }
        if read.is_empty() {
            return Ok(AttributeTable::default());
        }
        let mut classes: Vec<&Class> = shapes.into_iter().collect();
        classes.sort_by_key(|class| std::ptr::from_ref(*class));
        classes.dedup_by_key(|class| std::ptr::from_ref(*class));
        let mut first = 0;
        let mut places = Vec::new();
        for (name, default) in read {
            let count = default.len() as u32;
            if classes.iter().any(|class| source_of(class, &name, count).is_some()) {
                places.push(Place { name, default, first });
                first += count;
            }
        }
        if first > MAX_ATTRIBUTE_SCALARS {
            return Err(errors::too_many_attributes(first));
        }
        Ok(AttributeTable { places: places.into() })
    }

    /// True if there is no attribute.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Returns the names, in the order of their places.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.places.iter().map(|place| place.name.as_str())
    }

    /// Adds the table to the key of a class tree.
    pub(crate) fn add_to_key(&self, key: &mut Vec<usize>) {
        for Place { name, default, first } in self.places.iter() {
            key.extend([*first as usize, default.len(), name.len()]);
            key.extend(default.iter().map(|bits| *bits as usize));
            key.extend(name.bytes().map(usize::from));
        }
    }

    /// The place of an attribute; `None` if no shape gives it.
    fn place_of(&self, attribute: &Attribute) -> Option<&Place> {
        let default = default_bits(attribute);
        self.places.iter().find(|it| it.name == attribute.name && it.default == default)
    }
}

/// The use of attributes by the method that is being linked.
#[derive(Clone, Debug, Default)]
pub(crate) enum AttributeUse {
    /// None: reads give default values.
    #[default]
    Defaults,
    /// The method reads those of the hit object.
    Reads(AttributeTable),
    /// The method gives those of its object.
    Gives(AttributeTable),
}

impl AttributeUse {
    /// Returns the use by a method of the tree's root.
    pub fn of(tree: &ClassTree, method: Method) -> AttributeUse {
        let table = &tree.attributes;
        let has = |role: Role| tree.class.roles.contains(&role) && method.roles().contains(&role);
        if table.is_empty() {
            AttributeUse::Defaults
        } else if method == Method::ComputeTextureCoordinates {
            AttributeUse::Gives(table.clone())
        } else if has(Role::Material) || has(Role::Texture) {
            AttributeUse::Reads(table.clone())
        } else {
            AttributeUse::Defaults
        }
    }
}

/// Returns the function of a method of the tree's root. Shapes of scenes with attributes have
/// `computeTextureCoordinates`, if only to give them.
pub(crate) fn method_of(tree: &ClassTree, method: Method) -> Option<Cow<'_, Function>> {
    let class = &tree.class;
    match class.methods.get(&method) {
        Some(function) => Some(Cow::Borrowed(function)),
        None if method == Method::ComputeTextureCoordinates && gives_attributes(tree) => {
            Some(Cow::Owned(Function::new(format!("{}.{}", class.name, method.name()))))
        }
        None => None,
    }
}

/// Returns the methods of the tree's root.
pub fn methods_of(tree: &ClassTree) -> BTreeSet<Method> {
    let given = gives_attributes(tree).then_some(Method::ComputeTextureCoordinates);
    tree.class.methods.keys().copied().chain(given).collect()
}

/// True if methods of a class may read attributes.
pub fn reads_attributes(class: &Class) -> bool {
    let reads = |role: &Role| matches!(role, Role::Material | Role::Texture);
    !class.attributes.is_empty() && class.roles.iter().any(reads)
}

fn gives_attributes(tree: &ClassTree) -> bool {
    !tree.attributes.is_empty() && tree.class.roles.contains(&Role::Primitive)
}

fn default_bits(attribute: &Attribute) -> Vec<u32> {
    match attribute.default.as_slice() {
        [] => vec![0; scalars_of(&attribute.ty) as usize],
        default => default.iter().map(|value| value.to_bits()).collect(),
    }
}

/// The number of scalars of the type of an attribute; 0 for other types.
fn scalars_of(ty: &ParameterType) -> u32 {
    match ty {
        ParameterType::Scalar(Scalar::F32) => 1,
        ParameterType::Vector(Scalar::F32, size) => u32::from(*size),
        ParameterType::Color => COLOR_COMPONENTS,
        _ => 0,
    }
}

/// The source of an attribute of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// The method `computeTextureCoordinates` sets it.
    Method,
    /// A public member.
    Member,
}

fn source_of(shapes: &Class, name: &str, scalars: u32) -> Option<Source> {
    let is_given = shapes.methods.get(&Method::ComputeTextureCoordinates).is_some_and(|method| {
        method.outputs.iter().any(|output| {
            let variable = method.variable(output.variable);
            variable.kind == VariableKind::Member && variable.name == name
        })
    });
    let has_type = |ty: &ParameterType| scalars_of(ty) == scalars;
    if is_given && shapes.attributes.iter().any(|it| it.name == name && has_type(&it.ty)) {
        return Some(Source::Method);
    }
    let is_public = shapes.parameters.iter().any(|parameter| {
        parameter.name == name
            && parameter.target == ParameterTarget::Member
            && has_type(&parameter.ty)
    });
    is_public.then_some(Source::Member)
}

/// Loads a scalar of an attribute; `None` if the variable is a member of the instance.
pub(crate) fn load_attribute<L: Linker>(
    linker: &mut L,
    site: &Site<'_>,
    variable: &Variable,
    index: Index,
    to: &mut Vec<Op>,
) -> Linking<Option<Value>> {
    let Some(attribute) = attribute_of(site, variable) else { return Ok(None) };
    let first = match &linker.attributes {
        AttributeUse::Reads(table) => table.place_of(attribute).map(|place| place.first),
        AttributeUse::Defaults | AttributeUse::Gives(_) => None,
    };
    let default = default_bits(attribute);
    let load = |linker: &mut L, to: &mut Vec<Op>, component: u32| match first {
        Some(first) => {
            let variable = linker.intern_variable(attributes_variable());
            let kind = OpKind::Load(variable, Index::Constant(first + component));
            Ok(linker.emit(to, kind, &[Scalar::F32], false)?.get(0))
        }
        None => linker.constant(to, Constant::from_bits(Scalar::F32, default[component as usize])),
    };
    load_component(linker, index, variable.len, Scalar::F32, load, to).map(Some)
}

impl Draft {
    /// Makes the linked method of a shape set all attributes of the scene. `given` has those that the class sets.
    pub(crate) fn give_attributes(
        &mut self,
        class: &Class,
        given: &[(String, u32, Value)],
    ) -> Linking<()> {
        let AttributeUse::Gives(table) = self.attributes.clone() else { return Ok(()) };
        let mut body = std::mem::take(&mut self.out.body);
        let state = self.intern_variable(attributes_variable());
        for Place { name, default, first } in table.places.iter() {
            let count = default.len() as u32;
            let source = source_of(class, name, count);
            for (component, default) in (0..count).zip(default) {
                let of_class = given.iter().find(|(of, at, _)| of == name && *at == component);
                let value = match (source, of_class) {
                    (Some(Source::Method), Some((.., value))) => *value,
                    (Some(Source::Member), _) => {
                        let (kind, scalar) = (VariableKind::Member, Scalar::F32);
                        let member = Variable { kind, name: name.clone(), scalar, len: count };
                        let member = self.intern_variable(member);
                        let kind = OpKind::Load(member, Index::Constant(component));
                        self.emit(&mut body.ops, kind, &[scalar], false)?.get(0)
                    }
                    _ => {
                        let default = Constant::from_bits(Scalar::F32, *default);
                        self.constant(&mut body.ops, default)?
                    }
                };
                body.yields.push(value);
                self.out.outputs.push(Output { variable: state, component: first + component });
            }
        }
        self.out.body = body;
        Ok(())
    }
}

/// The attribute that a variable of a method is; `None` for members of the instance.
pub(crate) fn attribute_of<'a>(site: &Site<'a>, variable: &Variable) -> Option<&'a Attribute> {
    let is_member = variable.kind == VariableKind::Member;
    let mut attributes = site.tree?.class.attributes.iter().filter(|_| is_member);
    attributes.find(|attribute| attribute.name == variable.name)
}

fn attributes_variable() -> Variable {
    Variable {
        kind: VariableKind::State,
        name: ATTRIBUTES.to_owned(),
        scalar: Scalar::F32,
        len: MAX_ATTRIBUTE_SCALARS,
    }
}
