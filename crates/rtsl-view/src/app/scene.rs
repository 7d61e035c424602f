//! The scene in the viewer: its parameters, files and integrators.

use rtsl_render::Messages;
use rtsl_render::session::Reloaded;
use rtsl_scene::EntityId;

use super::App;
use crate::parameters::Request;

impl App {
    pub(super) fn select(&mut self, entity: Option<EntityId>) {
        let controls = entity.map_or_else(Vec::new, |entity| self.session.controls(entity));
        self.parameters.select(entity, controls);
    }

    pub(super) fn obey(&mut self, request: Option<Request>) {
        match request {
            Some(Request::Select(entity)) => self.select(Some(entity)),
            Some(Request::Set { name, values }) => {
                let Some(entity) = self.parameters.selected() else { return };
                let done = self.session.set_control(entity, &name, &values);
                self.changes += u64::from(done.is_ok());
                let refusal = done.err().map(|messages| messages.to_text(false));
                let refusal = refusal.map(|reason| (reason, self.session.controls(entity)));
                self.parameters.answer(&name, refusal);
            }
            None => {}
        }
    }

    pub(super) fn reload(&mut self) {
        let reloaded = self.session.reload();
        self.adopt(reloaded);
    }

    pub(super) fn show_next_integrator(&mut self) {
        let names = self.session.integrators();
        let is_shown = |name: &String| name.eq_ignore_ascii_case(self.session.integrator());
        let next = names.iter().position(is_shown).map_or(0, |shown| (shown + 1) % names.len());
        let changed = self.session.set_integrator(&names[next]);
        self.adopt(changed);
    }

    /// Shows the result of reading the scene again.
    pub(super) fn adopt(&mut self, reloaded: Result<Reloaded, Messages>) {
        match reloaded {
            Ok(reloaded) => {
                let warnings = reloaded.warnings.to_text(false);
                self.message = (!warnings.is_empty()).then_some(warnings);
                if reloaded.changed {
                    self.changes += 1;
                    self.not_finite.clear();
                    self.costs.grow_old();
                    self.picked = None;
                    self.parameters.things = self.session.things();
                    let known = |entity: &EntityId| {
                        self.parameters.things.iter().any(|thing| thing.entity == *entity)
                    };
                    self.select(self.parameters.selected().filter(known));
                }
            }
            Err(messages) => self.message = Some(messages.to_text(false)),
        }
    }
}
