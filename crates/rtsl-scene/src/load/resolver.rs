//! References in the arguments of an instance.

use std::sync::Arc;

use rtsl::{Class, Diagnostic, Instance, Value, diagnostic_codes as codes};

use super::{CONSTANT_COLOR, EntityId, Loader};
use crate::arguments::Resolve;
use crate::reader::ReferenceKind;
use crate::scene::CONSTANT_TEXTURE;

/// Resolves references for the arguments of one instance.
pub(super) struct Resolver<'l, 'a, 'f> {
    loader: &'l mut Loader<'a, 'f>,
    /// True if an error was reported where it occurred.
    pub(super) reported: bool,
    /// The entities referred to.
    pub(super) named: Vec<(EntityId, Arc<Instance>)>,
    /// The classes of constants.
    pub(super) standard: Vec<Arc<Class>>,
}

impl<'l, 'a, 'f> Resolver<'l, 'a, 'f> {
    pub(super) fn new(loader: &'l mut Loader<'a, 'f>) -> Self {
        Resolver { loader, reported: false, named: Vec::new(), standard: Vec::new() }
    }

    fn report(
        &mut self,
        instance: Option<Arc<Instance>>,
    ) -> Result<Arc<Instance>, Box<Diagnostic>> {
        self.reported |= instance.is_none();
        instance.ok_or_else(|| Box::new(Diagnostic::new(codes::UNKNOWN_SCENE_NAME, "")))
    }
}

impl Resolve for Resolver<'_, '_, '_> {
    fn named(&mut self, kind: ReferenceKind, name: &str) -> Result<Arc<Instance>, Box<Diagnostic>> {
        let key = (kind, name.to_owned());
        let Some(id) = self.loader.names.get(&key).copied() else {
            let loader = &mut *self.loader;
            if loader.description.failed.contains(&key) || !loader.unknown.insert(key) {
                return self.report(None);
            }
            return Err(loader.unknown_name(kind, name));
        };
        let instance = self.loader.instance(id);
        self.named.extend(instance.clone().map(|instance| (id, instance)));
        self.report(instance)
    }

    fn constant_texture(&mut self, color: [f32; 3]) -> Result<Arc<Instance>, Box<Diagnostic>> {
        let value = Value::from(color);
        let instance =
            self.loader.standard_instance(CONSTANT_TEXTURE, vec![(CONSTANT_COLOR, value)]);
        self.standard.extend(instance.as_ref().map(|instance| instance.class().clone()));
        self.report(instance)
    }
}
