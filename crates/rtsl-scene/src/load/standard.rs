//! Instances of classes that the renderer itself needs.

use std::sync::Arc;

use rtsl::{Diagnostic, Instance, Value, diagnostic_codes as codes};

use super::Loader;
use crate::classes::Found;
use crate::settings::Settings;
use crate::standard::{DEFAULT_MATERIAL, PATH_TRACER, WHITTED, path_tracer_arguments};

impl Loader<'_, '_> {
    /// Makes the path tracer of the standard library.
    pub(super) fn path_tracer(&mut self, settings: &Settings) -> Option<Arc<Instance>> {
        let found = self.classes.find_standard(PATH_TRACER);
        self.instance_of(PATH_TRACER, found, path_tracer_arguments(settings))
    }

    /// Makes the integrator of the standard library that shows what `shade` computes.
    pub(super) fn whitted(&mut self) -> Option<Arc<Instance>> {
        let found = self.classes.find_standard(WHITTED);
        self.instance_of(WHITTED, found, Vec::new())
    }

    /// Makes the material of shapes without one.
    pub(super) fn default_material(&mut self) -> Option<Arc<Instance>> {
        self.standard_instance(DEFAULT_MATERIAL, Vec::new())
    }

    /// Makes an instance of a class that the renderer itself needs.
    pub(super) fn standard_instance(
        &mut self,
        class: &str,
        arguments: Vec<(&str, Value)>,
    ) -> Option<Arc<Instance>> {
        let found = self.classes.find(class);
        self.instance_of(class, found, arguments)
    }

    fn instance_of(
        &mut self,
        class: &str,
        found: Found,
        arguments: Vec<(&str, Value)>,
    ) -> Option<Arc<Instance>> {
        match found {
            Found::Class(class) => match Instance::new(&class, arguments) {
                Ok(instance) => Some(instance),
                Err(problems) => {
                    self.diagnostics.extend(problems.into_vec());
                    None
                }
            },
            Found::Broken => None,
            Found::Nothing => {
                let message = format!("there is no class `{class}`, which the renderer needs");
                self.diagnostics.push(Diagnostic::new(codes::UNKNOWN_CLASS, message));
                None
            }
        }
    }
}
