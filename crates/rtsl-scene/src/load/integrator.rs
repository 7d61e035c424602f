//! Integrators written in RTSL.

use std::borrow::Cow;
use std::sync::Arc;

use rtsl::{Class, Diagnostic, Instance, diagnostic_codes as codes};

use super::{EntityId, Loader};
use crate::arguments::{Resolve, argument};
use crate::classes::{Classes, Found};
use crate::description::{Entity, EntityKind};
use crate::pbrt::NamedEntity;
use crate::reader::{Parameter, ReferenceKind};
use crate::settings::{is_named_integrator, taken_over, unknown_integrator};

impl Loader<'_, '_> {
    /// Makes the instance of an integrator written in RTSL; `None` if it is one by a name of the format.
    ///
    /// # Errors
    /// If there is none of this name, or it cannot be made, which was reported.
    pub(super) fn integrator(&mut self, id: EntityId) -> Result<Option<Arc<Instance>>, ()> {
        let entity = &self.description.entities[id.0];
        if is_named_integrator(entity) {
            return Ok(None);
        }
        if matches!(self.classes.find(&entity.class), Found::Nothing) {
            let classes: Vec<&str> = Classes::standard_integrators().collect();
            self.diagnostics.push(unknown_integrator(entity, &classes));
            return Err(());
        }
        self.instance(id).map(Some).ok_or(())
    }

    /// The parameters that an integrator takes over from the scene's own, in whose place it is.
    pub(super) fn taken_over(&self, entity: &Entity, class: &Class) -> Vec<Parameter> {
        let own = self.description.own_integrator.filter(|_| entity.kind == EntityKind::Integrator);
        let own = own.map(|EntityId(index)| &self.description.entities[index]);
        let own = own.filter(|own| !std::ptr::eq(*own, entity));
        let of = NamedEntity { entity, class, standard: None };
        let is_free = |it: &Parameter| {
            let is_taken = || argument(of, Cow::Borrowed(it), &mut NoReferences).is_ok();
            entity.parameter(&it.name).is_none() && is_taken()
        };
        own.into_iter().flat_map(taken_over).filter(is_free).collect()
    }
}

/// Resolves no references, for parameters that are values.
struct NoReferences;

impl Resolve for NoReferences {
    fn named(&mut self, _: ReferenceKind, _: &str) -> Result<Arc<Instance>, Box<Diagnostic>> {
        Err(Box::new(Diagnostic::new(codes::UNKNOWN_SCENE_NAME, "")))
    }

    fn constant_texture(&mut self, _: [f32; 3]) -> Result<Arc<Instance>, Box<Diagnostic>> {
        Err(Box::new(Diagnostic::new(codes::UNKNOWN_SCENE_NAME, "")))
    }
}
