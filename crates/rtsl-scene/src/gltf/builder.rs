//! A description under construction from a glTF file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rtsl::{Diagnostic, Diagnostics, Numbers, Span, diagnostic_codes as codes};
use rtsl_math::Transform;
use rtsl_memory::InputBudget;

use super::attributes::FileAttributes;
use super::materials::{Finish, FinishKey};
use super::outline::{Kind, Outline};
use super::textures::{ImageFile, ImageKey};
use crate::description::{Description, Entity, EntityId, EntityKind};
use crate::mesh::gltf::GltfFile;
use crate::reader::{FileSource, Parameter, ParameterType, ReferenceKind, Values};

/// A description under construction.
pub struct Builder<'a> {
    pub file: GltfFile<'a>,
    /// The path of the file.
    pub path: &'a Path,
    pub files: &'a dyn FileSource,
    pub budget: &'a InputBudget,
    pub outline: Outline,
    pub diagnostics: &'a mut Diagnostics,
    pub description: Description,
    /// Messages that were given, each once.
    pub said: BTreeSet<String>,
    /// Images by index, or the reasons for which they cannot be read.
    pub images: BTreeMap<usize, Result<ImageFile, String>>,
    /// The names of entities of images.
    pub image_entities: BTreeMap<ImageKey, String>,
    /// The materials that were made.
    pub finishes: BTreeMap<FinishKey, Finish>,
    /// The shapes that have a place.
    pub placed: BTreeSet<EntityId>,
    /// True if a material gives off more light than a white surface in daylight: screens and signs are no lamps.
    pub has_lamps: bool,
    /// The attributes of shapes that shaders read.
    pub attributes: FileAttributes,
    /// The names of entities that are in use.
    pub names: BTreeSet<(EntityKind, String)>,
}

/// The parameters of an entity.
pub struct Parameters {
    span: Span,
    list: Vec<Parameter>,
}

impl Builder<'_> {
    /// Starts the parameters of an entity at a place.
    pub fn parameters(&self, kind: Kind, index: usize) -> Parameters {
        Parameters { span: self.outline.span(kind, index), list: Vec::new() }
    }

    /// Adds an entity. A name that another one has is completed by a number.
    pub fn add(
        &mut self,
        kind: EntityKind,
        class: &str,
        name: Option<&str>,
        parameters: Parameters,
        transform: Transform,
    ) -> EntityId {
        let name = name.map(|name| self.unique(kind, name));
        self.description.entities.push(Entity {
            kind,
            class: class.to_owned(),
            class_span: parameters.span,
            name,
            parameters: parameters.list,
            transform,
            end_transform: None,
        });
        EntityId(self.description.entities.len() - 1)
    }

    /// Returns the name of an entity that was added with one.
    pub fn name_of(&self, EntityId(index): EntityId) -> String {
        self.description.entities[index].name.clone().unwrap_or_default()
    }

    fn unique(&mut self, kind: EntityKind, name: &str) -> String {
        let mut unique = name.to_owned();
        let mut number = 1;
        while !self.names.insert((kind, unique.clone())) {
            number += 1;
            unique = format!("{name} {number}");
        }
        unique
    }

    /// Warns, once for each text.
    pub fn warn(&mut self, message: String, span: Span) {
        if self.said.insert(message.clone()) {
            self.diagnostics.push(Diagnostic::new(codes::IGNORED_SETTING, message).at(span, ""));
        }
    }
}

impl Parameters {
    fn push(mut self, kind: ParameterType, name: &str, values: Values) -> Self {
        let span = self.span;
        let name = name.to_owned();
        self.list.push(Parameter { kind, name, declaration: span, values, values_span: span });
        self
    }

    pub fn numbers(self, name: &str, values: &[f64]) -> Self {
        self.push(ParameterType::Given, name, Values::Numbers(values.to_vec()))
    }

    pub fn boolean(self, name: &str, value: bool) -> Self {
        self.push(ParameterType::Given, name, Values::Booleans(vec![value]))
    }

    pub fn text(self, name: &str, value: &str) -> Self {
        self.push(ParameterType::Text, name, Values::Texts(vec![value.to_owned()]))
    }

    pub fn reference(self, kind: ReferenceKind, name: &str, value: &str) -> Self {
        let values = Values::Texts(vec![value.to_owned()]);
        self.push(ParameterType::Reference(kind), name, values)
    }

    pub fn buffer(self, name: &str, numbers: Numbers) -> Self {
        self.push(ParameterType::Given, name, Values::Buffer(numbers))
    }
}
