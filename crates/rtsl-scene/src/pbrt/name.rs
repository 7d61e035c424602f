//! A name of pbrt, and the class of the standard library that implements it.

use rtsl::{Diagnostic, Value};
use rtsl_math::Transform;

use super::images::Images;
use super::translation::Translation;
use super::{cameras, lights, materials, shapes, textures};
use crate::description::{Entity, EntityKind};
use crate::reader::SceneFiles;

/// A pbrt name.
#[derive(Debug)]
pub struct PbrtName {
    kind: EntityKind,
    name: &'static str,
    /// The class that implements it.
    pub class: &'static str,
    /// Parameters with another name in the class: the format's name, the class's name.
    parameters: &'static [(&'static str, &'static str)],
    /// Parameters of the class that are parts of one of the format: the format's name, the class's name.
    parts: &'static [(&'static str, &'static str)],
    /// The format's default values of parameters, if the class has others.
    defaults: &'static [(&'static str, &'static [f64])],
    /// Parameters that have no effect, besides those of all entities of the kind.
    without_effect: &'static [&'static str],
    /// Parameters that only [`PbrtName::make`] reads.
    read_by_maker: &'static [&'static str],
    /// True if the format's shape is aligned with z and the class's with y.
    stands_along_z: bool,
    /// True if the class is only a substitute that looks different.
    replaced: bool,
    /// The way in which the class looks different, if little.
    simplified: Option<&'static str>,
    translate: Option<Translate>,
    make: Option<Make>,
    /// The reference to a texture `Image` that takes the values made for it.
    image: Option<&'static str>,
}

/// Chooses the implementation of an entity by its parameters; `None` for the one in the table of names.
pub type Choose = fn(&Entity) -> Option<&'static PbrtName>;

/// Translates parameters that differ from the class's by more than their names.
pub type Translate = fn(&mut Translation<'_>);

/// Makes values of the class from files that the entity names.
pub type Make =
    fn(&Entity, SceneFiles<'_>, &mut Images) -> Result<Vec<(String, Value)>, Box<Diagnostic>>;

/// The names of one kind of entity.
pub struct Names {
    pub kind: EntityKind,
    /// The names that classes implement.
    pub implemented: &'static [PbrtName],
    /// The names that no class implements, and that are left out.
    pub left_out: &'static [&'static str],
    /// Parameters of every entity of the kind that have no effect.
    pub without_effect: &'static [&'static str],
    pub choose: Choose,
}

static ALL: [&Names; 6] = [
    &cameras::NAMES,
    &shapes::NAMES,
    &materials::NAMES,
    &lights::AREA_LIGHTS,
    &lights::NAMES,
    &textures::NAMES,
];

fn names(kind: EntityKind) -> Option<&'static Names> {
    ALL.into_iter().find(|names| names.kind == kind)
}

/// The class's name of an entity's parameter.
pub fn class_name<'a>(entity: &Entity, name: &'a str) -> &'a str {
    PbrtName::of(entity).map_or(name, |standard| standard.parameter(name))
}

impl PbrtName {
    /// The implementation of an entity's class, if it is a pbrt name.
    pub fn of(entity: &Entity) -> Option<&'static PbrtName> {
        let names = names(entity.kind)?;
        (names.choose)(entity)
            .or_else(|| names.implemented.iter().find(|it| it.name == entity.class))
    }

    /// True if a parameter of the format has no effect here.
    pub fn has_no_effect(&self, name: &str) -> bool {
        let of_all = names(self.kind).map_or(&[][..], |names| names.without_effect);
        self.replaced || of_all.contains(&name) || self.without_effect.contains(&name)
    }

    /// True if a parameter is read by [`PbrtName::make`] alone, and not passed on to the class.
    pub fn is_read_by_maker(&self, name: &str) -> bool {
        self.read_by_maker.contains(&name)
    }

    /// True if the class is only a substitute.
    pub fn is_replaced(&self) -> bool {
        self.replaced
    }

    /// Returns what the class leaves out, for a warning.
    pub fn simplification(&self) -> Option<&'static str> {
        self.simplified
    }

    /// True if entities of this name are ignored because no class implements them.
    pub fn is_left_out(entity: &Entity) -> bool {
        names(entity.kind).is_some_and(|names| names.left_out.contains(&entity.class.as_str()))
    }

    /// Returns the class's name of the parameter `name`.
    pub fn parameter<'a>(&self, name: &'a str) -> &'a str {
        let renamed = self.parameters.iter().find(|(theirs, _)| *theirs == name);
        renamed.map_or(name, |(_, ours)| ours)
    }

    /// Returns the parameters with another name in the class: the format's name, the class's name.
    pub fn renamed_parameters(&self) -> Vec<(&'static str, &'static str)> {
        [self.parameters, self.parts].concat()
    }

    /// Returns parameters of the class that have these values if the scene gives none.
    pub fn defaults(&self) -> impl Iterator<Item = (&'static str, &'static [f64])> {
        self.defaults.iter().copied()
    }

    /// Translates parameters that differ from the class's by more than their names.
    pub fn translate(&self, translation: &mut Translation<'_>) {
        if let Some(translate) = self.translate {
            translate(translation);
        }
    }

    /// Makes the values of the class that come from files; none if it takes none.
    ///
    /// # Errors
    /// If a file is missing, cannot be read or would take too much memory.
    pub fn make(
        &self,
        entity: &Entity,
        files: SceneFiles<'_>,
        images: &mut Images,
    ) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
        self.make.map_or(Ok(Vec::new()), |make| make(entity, files, images))
    }

    /// Returns the name of the class's texture that is made of the image of [`PbrtName::make`].
    pub fn image(&self) -> Option<&'static str> {
        self.image
    }

    /// True if values come from files.
    pub fn has_files(&self) -> bool {
        self.make.is_some()
    }

    /// Returns the transform from the class's space to that of the format's shape. It includes a reflection, so that
    /// both have the same texture coordinates.
    pub fn placement(&self) -> Transform {
        const ALONG_Z: [f64; 16] =
            [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        if self.stands_along_z { Transform::from_columns(&ALONG_Z) } else { Transform::IDENTITY }
    }
}

/// Tables of names are made of these.
impl PbrtName {
    pub const fn new(kind: EntityKind, name: &'static str, class: &'static str) -> Self {
        PbrtName {
            kind,
            name,
            class,
            parameters: &[],
            parts: &[],
            defaults: &[],
            without_effect: &[],
            read_by_maker: &[],
            stands_along_z: false,
            replaced: false,
            simplified: None,
            translate: None,
            make: None,
            image: None,
        }
    }

    /// A name whose class is a substitute that looks different.
    pub const fn replacing(kind: EntityKind, name: &'static str, class: &'static str) -> Self {
        PbrtName { replaced: true, ..PbrtName::new(kind, name, class) }
    }

    /// A warning tells `simplified`: what the class leaves out.
    pub const fn simplifying(self, simplified: &'static str) -> Self {
        PbrtName { simplified: Some(simplified), ..self }
    }

    pub const fn renaming(self, parameters: &'static [(&'static str, &'static str)]) -> Self {
        PbrtName { parameters, ..self }
    }

    /// The translation makes several parameters of one of the format.
    pub const fn splitting(self, parts: &'static [(&'static str, &'static str)]) -> Self {
        PbrtName { parts, ..self }
    }

    pub const fn with_defaults(self, defaults: &'static [(&'static str, &'static [f64])]) -> Self {
        PbrtName { defaults, ..self }
    }

    pub const fn without(self, without_effect: &'static [&'static str]) -> Self {
        PbrtName { without_effect, ..self }
    }

    pub const fn translated_by(self, translate: Translate) -> Self {
        PbrtName { translate: Some(translate), ..self }
    }

    /// Values come from `make`, which reads these parameters.
    pub const fn made_by(self, make: Make, read: &'static [&'static str]) -> Self {
        PbrtName { make: Some(make), read_by_maker: read, ..self }
    }

    /// The values that the class `Image` has are those of a texture that the class takes by this name.
    pub const fn with_image(self, reference: &'static str) -> Self {
        PbrtName { image: Some(reference), ..self }
    }

    pub const fn along_z(self) -> Self {
        PbrtName { stands_along_z: true, ..self }
    }
}
