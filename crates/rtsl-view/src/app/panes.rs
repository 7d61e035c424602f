//! The panes of the viewer.

use egui::{CentralPanel, Panel, Ui};

use super::{App, Wish};
use crate::editor::{Done, Notes};
use crate::inspector::{Debugging, Inspected, Job, Request as Inspection};
use crate::layout::{self, Side};
use crate::not_finite::Request as NotFiniteRequest;
use crate::{costs, toolbar};

impl App {
    pub(super) fn show(&mut self, ui: &mut Ui) {
        self.show_toolbar(ui);
        if self.panes.editor {
            let pane = Panel::left("editor").default_size(layout::EDITOR).min_size(240.0);
            pane.resizable(true).show(ui, |ui| {
                ui.set_width(ui.available_width());
                self.show_editor(ui);
            });
        }
        if let Some(side) = self.panes.side {
            self.last_side = side;
            let pane = Panel::right("side").default_size(layout::SIDE).min_size(220.0);
            pane.resizable(true).show(ui, |ui| {
                // Panes have the width that someone gives them, whatever they show.
                ui.set_width(ui.available_width());
                self.show_side(ui, side);
            });
        }
        CentralPanel::no_frame().show(ui, |ui| self.show_picture(ui));
        if self.asks_to_close {
            self.show_question(ui);
        }
    }

    pub(super) fn show_editor(&mut self, ui: &mut Ui) {
        self.editor.open_all(&self.session.source_files());
        let place = self.inspector.debugging.as_ref().and_then(Debugging::place);
        let notes = Notes {
            position: place.map(|(text, line, _)| (text, line)),
            values: self.inspector.debugging.as_ref().map(|debugging| &debugging.beside),
            costs: self.costs.measured(),
        };
        match self.editor.show(ui, &notes) {
            Some(Done::Saved) => self.reload(),
            Some(Done::Breakpoints) => {
                if let Some(debugging) = &mut self.inspector.debugging {
                    debugging.set_breakpoints(self.editor.breakpoints());
                }
            }
            None => {}
        }
    }

    /// Asks whether unsaved texts may be lost.
    pub(super) fn show_question(&mut self, ui: &Ui) {
        let titles = self.editor.unsaved().join(", ");
        egui::Modal::new(egui::Id::unique("unsaved")).show(ui.ctx(), |ui| {
            ui.heading("Close without saving?");
            ui.label(format!("Not saved: {titles}"));
            ui.horizontal(|ui| {
                if ui.button("Save all and close").clicked() {
                    self.asks_to_close = false;
                    if self.editor.save_all() {
                        self.wishes.push(Wish::Close);
                    }
                }
                if ui.button("Close without saving").clicked() {
                    self.wishes.push(Wish::Close);
                }
                if ui.button("Go on").clicked() {
                    self.asks_to_close = false;
                }
            });
        });
    }

    pub(super) fn show_toolbar(&mut self, ui: &mut Ui) {
        let bar = Panel::top("toolbar").exact_size(layout::TOOLBAR).show_separator_line(false);
        let chosen = bar.show(ui, |ui| toolbar::show(ui, &mut self.panes, &self.session)).inner;
        match chosen {
            Some(toolbar::Choice::Mode(mode)) => self.session.set_view_mode(mode),
            Some(toolbar::Choice::Integrator(name)) => {
                let changed = self.session.set_integrator(&name);
                self.adopt(changed);
            }
            Some(toolbar::Choice::Reload) => self.reload(),
            None => {}
        }
    }

    pub(super) fn show_side(&mut self, ui: &mut Ui, side: Side) {
        match side {
            Side::Parameters => {
                let request = self.parameters.show(ui);
                self.obey(request);
            }
            Side::Inspector => self.show_inspector(ui),
            Side::Costs => {
                let mode = self.session.view_mode();
                match self.costs.show(ui, mode) {
                    Some(costs::Request::Show(mode)) => self.session.set_view_mode(mode),
                    Some(costs::Request::Measure) => {
                        self.costs.measure(&self.context, self.session.probe());
                    }
                    Some(costs::Request::Open(name)) => self.show_dearest_line(&name),
                    None => {}
                }
            }
            Side::NotFinite => {
                let (running, is_done) = (self.jobs.is_busy(), !self.session.is_busy());
                match self.not_finite.show(ui, self.session.film(), running, is_done) {
                    Some(NotFiniteRequest::Find(job)) => self.evaluate(job),
                    Some(NotFiniteRequest::GoTo(place)) => self.go_to(&place),
                    Some(NotFiniteRequest::Inspect(pixel)) => {
                        self.panes.side = Some(Side::Inspector);
                        self.inspector.set_sample(pixel.sample);
                        self.inspect(pixel.x, pixel.y);
                    }
                    None => {}
                }
            }
        }
    }

    pub(super) fn show_inspector(&mut self, ui: &mut Ui) {
        if self.inspector.needs_facts() && !self.jobs.is_busy() {
            self.evaluate(Job::Facts(self.inspector.probed()));
        }
        let before = self.inspector.debugging.as_ref().map(Debugging::shown);
        let (state, samples) = (self.state(), self.session.status().samples_wanted);
        match self.inspector.show(ui, &state, samples, self.jobs.is_busy()) {
            Some(Inspection::Evaluate(job)) => self.evaluate(job),
            Some(Inspection::GoTo(place)) => self.go_to(&place),
            Some(Inspection::Again) => {
                if let Some(&Inspected { x, y, .. }) = self.inspector.pixel() {
                    self.inspect(x, y);
                }
            }
            None => {}
        }
        if before != self.inspector.debugging.as_ref().map(Debugging::shown) {
            self.show_position();
        }
    }
}
