//! Warnings about entities that load nevertheless.

use rtsl::{Class, Diagnostic, Instance, OutsideRange, Span, diagnostic_codes as codes};

use super::Loader;
use crate::classes::Found;
use crate::description::{Entity, EntityKind};
use crate::pbrt::{NamedEntity, PbrtName, class_name, without_effect};
use crate::reader::Parameter;

impl Loader<'_, '_> {
    /// Warns once about each parameter of a pbrt name that has no effect.
    pub(super) fn check_format(&mut self, entity: &Entity, class: &Class) {
        let Some(standard) = self.pbrt_name(entity) else { return };
        let (kind, name) = (entity.kind.word(), &entity.class);
        if standard.is_replaced() {
            let message =
                format!("{kind} `{name}` is not supported: `{}` takes its place", class.name);
            self.say_once(message, entity.class_span);
            return;
        }
        if let Some(simplification) = standard.simplification() {
            let message = format!("{kind} `{name}` is simplified: {simplification}");
            self.say_once(message, entity.class_span);
        }
        for (parameter, why) in without_effect(entity, standard, class) {
            let message = format!("`{}` of {kind} `{name}` has no effect: {why}", parameter.name);
            self.say_once(message, parameter.declaration);
        }
    }

    /// True if no class implements the entity's pbrt name; warns once about each name.
    pub(super) fn is_left_out(&mut self, entity: &Entity) -> bool {
        let left_out = PbrtName::is_left_out(entity)
            && matches!(self.classes.find(&entity.class), Found::Nothing);
        if left_out && entity.kind != EntityKind::Material {
            let (kind, name) = (entity.kind.word(), &entity.class);
            let message = format!("{kind} `{name}` is not supported: it is left out");
            self.say_once(message, entity.class_span);
        }
        left_out
    }

    /// Warns about values outside of their ranges, once for each parameter of a class, and about references that the
    /// instance calls through and that are not set, once for each of a class.
    pub(super) fn warn_of_values(&mut self, entity: &Entity, instance: &Instance) {
        for OutsideRange { parameter, warning } in instance.outside_range() {
            if self.said.insert(format!("{}.{parameter} is outside", instance.class().name)) {
                let own = |it: &&Parameter| class_name(entity, &it.name) == parameter;
                let given = entity.parameters.iter().find(own);
                let span = given.map_or(entity.class_span, |given| given.values_span);
                self.diagnostics.push(warning.clone().at(span, ""));
            }
        }
        let standard = self.pbrt_name(entity);
        let wording = NamedEntity { entity, class: instance.class(), standard }.wording();
        for warning in instance.unset_reference_warnings(wording.as_ref()) {
            self.warn_once(warning.at(entity.class_span, ""));
        }
    }

    pub(super) fn say_once(&mut self, message: String, span: Span) {
        self.warn_once(Diagnostic::new(codes::IGNORED_SETTING, message).at(span, ""));
    }

    /// Reports a warning, unless one with its message was reported.
    pub(super) fn warn_once(&mut self, warning: Diagnostic) {
        if self.said.insert(warning.message.clone()) {
            self.diagnostics.push(warning);
        }
    }
}
