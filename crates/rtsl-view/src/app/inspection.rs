//! Samples of pixels in the viewer: they are evaluated by threads, and replayed in the editor.

use super::{App, Wish};
use crate::inspector::{Debugging, Inspected, Job, ReportPlace, State};

impl App {
    /// The state of the picture.
    pub(super) fn state(&self) -> State {
        let (size, camera) = (self.session.film().size(), self.session.camera());
        State { size, camera, changes: self.changes }
    }

    pub(super) fn inspect(&mut self, x: usize, y: usize) {
        self.picked = self.session.pick(x, y);
        let (picked, state) = (self.picked.clone(), self.state());
        let job = self.inspector.look_at(Inspected { x, y, picked, state });
        self.evaluate(job);
    }

    pub(super) fn evaluate(&mut self, job: Job) {
        self.jobs.start(&self.context, self.session.probe(), job);
    }

    /// Takes what threads have found out.
    pub(super) fn take_outcomes(&mut self) {
        self.costs.take();
        while let Some((job, outcome)) = self.jobs.take(&self.context) {
            match &job {
                Job::Causes(_) => self.not_finite.take(outcome),
                Job::Facts(pixel) => {
                    let lines = self.inspector.take(&job, outcome);
                    if !lines.is_empty() {
                        self.wishes.push(Wish::Print(format!("pixel {},{}:", pixel.x, pixel.y)));
                        self.wishes.extend(lines.into_iter().map(Wish::Print));
                    }
                }
                Job::Steps(_) => {
                    self.inspector.take(&job, outcome);
                    self.begin_replay();
                }
            }
        }
    }

    /// Shows the start of a replay, or its first breakpoint.
    pub(super) fn begin_replay(&mut self) {
        let Some(debugging) = &mut self.inspector.debugging else { return };
        debugging.set_breakpoints(self.editor.breakpoints());
        debugging.run_to_first();
        self.panes.editor = true;
        self.show_position();
    }

    /// Shows the line of the replay in the editor.
    pub(super) fn show_position(&mut self) {
        let place = self.inspector.debugging.as_ref().and_then(Debugging::place);
        if let Some((name, line, text)) = place {
            self.editor.go_to(name, Some(line as usize), Some(text));
        }
    }

    /// Shows the most expensive line of a text in the editor.
    pub(super) fn show_dearest_line(&mut self, name: &str) {
        let Some((content, line)) = self.costs.measured().and_then(|costs| costs.dearest(name))
        else {
            return;
        };
        self.panes.editor = true;
        self.editor.go_to(name, Some(line as usize), Some(content));
    }

    pub(super) fn go_to(&mut self, place: &ReportPlace) {
        self.panes.editor = true;
        self.editor.go_to(&place.text, Some(place.line), Some(&place.content));
    }
}
