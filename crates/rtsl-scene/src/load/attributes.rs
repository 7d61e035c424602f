//! Attributes of the shapes of a scene.

use std::sync::Arc;

use rtsl::{Class, Diagnostic, Numbers, Value, diagnostic_codes as codes};

use super::{Arguments, Loader};
use crate::attributes::{
    CURVATURE, Counts, GivenAttribute, WantedAttributes, derived_text, share_attributes,
    texture_text,
};
use crate::classes::Found;
use crate::curvature::curvature_of;
use crate::description::{Entity, EntityId, EntityKind};
use crate::gltf::{FileAttributes, is_gltf};
use crate::pbrt::PbrtName;
use crate::reader::{Parameter, SceneFiles, Values};
use crate::scene::Scene;

/// The name of textures that show an attribute.
const ATTRIBUTE_TEXTURE: &str = "Attribute";
/// Their parameters: the name of the attribute, and its value where shapes have none.
const PARAMETERS: [&str; 2] = ["attribute", "default"];

impl Loader<'_, '_> {
    /// Lists the attributes that shaders of the scene read.
    pub(super) fn find_wanted_attributes(&mut self) {
        let mut wanted = WantedAttributes::default();
        for entity in &self.description.entities {
            let class = match entity.kind {
                EntityKind::Texture if self.is_attribute_texture(entity) => {
                    self.attribute_texture(entity).ok()
                }
                EntityKind::Texture
                | EntityKind::Material
                | EntityKind::AreaLight
                | EntityKind::Shape => {
                    let name = PbrtName::of(entity).map_or(entity.class.as_str(), |it| it.class);
                    self.classes.find(name).class()
                }
                _ => None,
            };
            class.iter().for_each(|class| wanted.add(class));
        }
        self.wanted = Arc::new(wanted);
    }

    /// Reads the attributes that a glTF file gives the shapes of its scene, unless they are those of an earlier load.
    pub(super) fn read_file_attributes(&mut self) {
        let SceneFiles { scene, files, budget, .. } = self.files;
        if self.file_attributes.wanted != self.wanted {
            let is_read = is_gltf(scene) && !self.wanted.is_empty();
            let (wanted, description) = (&self.wanted, self.description);
            self.file_attributes = Arc::new(match is_read {
                true => FileAttributes::read(scene, files, budget, wanted, description),
                false => FileAttributes { wanted: wanted.clone(), ..FileAttributes::default() },
            });
        }
        let amount = self.file_attributes.memory();
        match budget.hold(amount) {
            Ok(held) => held.keep(amount),
            Err(error) => self.diagnostics.push(error.diagnostic(scene.display())),
        }
        for problem in &self.file_attributes.problems {
            self.diagnostics.push(Diagnostic::new(codes::IGNORED_SETTING, problem.clone()));
        }
    }

    /// True if a parameter of a shape may be an attribute.
    pub(super) fn is_attribute(&self, entity: &Entity, name: &str) -> bool {
        match entity.kind {
            EntityKind::Shape => self.wanted.has(name),
            EntityKind::Texture => PARAMETERS.contains(&name) && entity.class == ATTRIBUTE_TEXTURE,
            _ => false,
        }
    }

    /// True for a texture that shows an attribute, unless a class beside the scene has the name.
    pub(super) fn is_attribute_texture(&mut self, entity: &Entity) -> bool {
        entity.kind == EntityKind::Texture
            && entity.class == ATTRIBUTE_TEXTURE
            && matches!(self.classes.find(ATTRIBUTE_TEXTURE), Found::Nothing)
    }

    /// Returns the class of such a texture.
    ///
    /// # Errors
    /// If its parameters name no attribute.
    pub(super) fn attribute_texture(
        &mut self,
        entity: &Entity,
    ) -> Result<Arc<Class>, Box<Diagnostic>> {
        let is_name = |name: &str| {
            let mut letters = name.chars();
            letters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
                && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
        };
        let Some((name, parameter)) = entity.text(PARAMETERS[0]) else {
            let message = "the texture names no attribute";
            let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
            let expected = "expected for example `\"string attribute\" \"height\"`";
            return Err(diagnostic.at(entity.class_span, expected).into());
        };
        let default = match entity.parameter(PARAMETERS[1]).map(|it| &it.values) {
            Some(Values::Numbers(numbers)) => numbers.as_slice(),
            _ => &[],
        };
        let class = match is_name(name) {
            true => self.classes.of_text(&texture_text(name, default), ATTRIBUTE_TEXTURE, None),
            false => None,
        };
        class.ok_or_else(|| {
            let message = format!("`{name}` is no name of an attribute");
            let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
            diagnostic.at(parameter.values_span, "expected a name that shaders can declare").into()
        })
    }

    /// Returns the class of a shape with the attributes that it gives, and adds their values to the arguments; `None`
    /// if an error was reported.
    pub(super) fn with_attributes(
        &mut self,
        id: EntityId,
        class: &Arc<Class>,
        arguments: &mut Arguments,
    ) -> Option<Arc<Class>> {
        let entity = &self.description.entities[id.0];
        if entity.kind != EntityKind::Shape || self.wanted.is_empty() {
            return Some(class.clone());
        }
        let counts = counts_of(class, &arguments.values);
        let mut given = std::mem::take(&mut arguments.attributes);
        given.extend(self.file_attributes.of.get(&id).into_iter().flatten().cloned());
        for parameter in &entity.parameters {
            let is_own = class.parameters.iter().any(|own| own.name == parameter.name);
            if is_own || !self.wanted.has(&parameter.name) || has(&given, parameter) {
                continue;
            }
            match GivenAttribute::of(parameter, &self.wanted, counts) {
                Ok(attribute) => given.push(attribute),
                Err(diagnostic) => {
                    self.diagnostics.push(*diagnostic);
                    return None;
                }
            }
        }
        if !given.iter().any(|attribute| attribute.name == CURVATURE)
            && let Some(curvature) = curvature_of(&self.wanted, class, &arguments.values)
        {
            given.push(curvature);
            match self.derived(class, &given) {
                Ok(Some(derived)) => return Some(with_values(derived, &given, arguments)),
                // Normals that are found by further hits have no derivatives.
                Ok(None) | Err(_) => given.truncate(given.len() - 1),
            }
        }
        if given.is_empty() {
            return Some(class.clone());
        }
        let problem = match self.derived(class, &given) {
            Ok(Some(derived)) => return Some(with_values(derived, &given, arguments)),
            Ok(None) => {
                let message = format!("`{}` has no attributes of vertices", class.name);
                Diagnostic::new(codes::WRONG_VALUE, message).help(
                    "a class of meshes has them by the functions `ivec4 attributeCorners()` and `vec4 attributeWeights()`",
                )
            }
            Err(problem) => problem,
        };
        self.diagnostics.push(problem.at(entity.class_span, ""));
        None
    }

    /// Returns the class of a shape with attributes; `None` if its text has errors.
    fn derived(
        &mut self,
        class: &Arc<Class>,
        given: &[GivenAttribute],
    ) -> Result<Option<Arc<Class>>, Diagnostic> {
        let text = derived_text(class, given)?;
        Ok(self.classes.of_text(&text, &class.name, Some(class)))
    }

    /// Gives the shapes and shaders of a scene the list of the attributes that they share.
    pub(super) fn share_attributes(&mut self, scene: &mut Scene) -> Option<()> {
        if self.wanted.is_empty() {
            return Some(());
        }
        match share_attributes(scene) {
            Ok(()) => Some(()),
            Err(problem) => {
                self.diagnostics.push(problem);
                None
            }
        }
    }
}

/// Adds the values of attributes to the arguments of a class with them.
fn with_values(
    class: Arc<Class>,
    given: &[GivenAttribute],
    arguments: &mut Arguments,
) -> Arc<Class> {
    let values = given.iter().enumerate().filter_map(|(index, it)| it.argument(index));
    arguments.values.extend(values);
    class
}

fn has(given: &[GivenAttribute], parameter: &Parameter) -> bool {
    given.iter().any(|attribute| attribute.name == parameter.name)
}

/// The numbers of vertices and faces of a shape with these arguments. A class of meshes has positions of vertices, and
/// elements.
fn counts_of(class: &Class, values: &[(String, Value)]) -> Counts {
    let numbers = |name: &str| {
        values.iter().find_map(|(given, value)| match value {
            Value::Numbers(numbers) if given == name => Some(Numbers::words(numbers).len()),
            _ => None,
        })
    };
    let faces = class.element().and_then(|element| {
        let buffer = class.buffers.iter().find(|it| it.name == element.buffer)?;
        Some(numbers(element.buffer)? / buffer.len.max(1) as usize / element.stride as usize)
    });
    Counts { vertices: numbers("positions").map(|count| count / 3), faces }
}
