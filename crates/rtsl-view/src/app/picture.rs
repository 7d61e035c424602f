//! The picture in the middle of the viewer: gestures, and what is shown over it.

use egui::{PointerButton, Rect, Sense, Ui};

use super::{App, Wish};
use crate::inspector::Inspected;
use crate::layout::{Place, Side};
use crate::status;

/// The number of points that a touchpad scrolls for a notch.
const POINTS_PER_NOTCH: f32 = 40.0;

impl App {
    pub(super) fn show_picture(&mut self, ui: &mut Ui) {
        let rect = ui.max_rect();
        let scale = ui.ctx().pixels_per_point();
        let place = Place::of(rect, scale, self.size);
        self.place = place;
        // An empty place is that of a hidden window.
        self.session.resize(place.width, place.height);
        let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
        self.handle_gestures(ui, &response);
        self.mark_pixel(ui, rect);
        self.show_overlays(ui, rect);
    }

    /// Marks the pixel that is inspected.
    pub(super) fn mark_pixel(&self, ui: &Ui, rect: Rect) {
        let Some(pixel) = self.inspector.pixel() else { return };
        if self.panes.side != Some(Side::Inspector) || pixel.state != self.state() {
            return;
        }
        let scale = ui.ctx().pixels_per_point();
        let at = rect.min + egui::vec2(pixel.x as f32 + 0.5, pixel.y as f32 + 0.5) / scale;
        let painter = ui.painter_at(rect);
        painter.circle_stroke(at, 5.0, egui::Stroke::new(2.5, egui::Color32::BLACK));
        painter.circle_stroke(at, 5.0, egui::Stroke::new(1.0, egui::Color32::WHITE));
    }

    pub(super) fn handle_gestures(&mut self, ui: &Ui, response: &egui::Response) {
        let scale = f64::from(ui.ctx().pixels_per_point());
        let (delta, pointer) =
            ui.input(|input| (input.pointer.delta(), input.pointer.latest_pos()));
        self.pointer = pointer;
        let by = [f64::from(delta.x) * scale, f64::from(delta.y) * scale];
        for button in [PointerButton::Primary, PointerButton::Middle, PointerButton::Secondary] {
            if !response.dragged_by(button) {
                continue;
            }
            // A drag is known as one only after some points.
            let by = match response.drag_started_by(button) {
                true => response
                    .total_drag_delta()
                    .map_or(by, |way| [f64::from(way.x) * scale, f64::from(way.y) * scale]),
                false => by,
            };
            if by != [0.0; 2] {
                self.navigation.drag(&mut self.session, button, by);
            }
        }
        if response.clicked() {
            ui.memory_mut(|memory| memory.stop_text_input());
            self.pick();
        }
        if response.contains_pointer() {
            let notches = ui.input(notches);
            if notches != 0.0 {
                self.navigation.dolly(&mut self.session, f64::from(notches));
            }
        }
    }

    pub(super) fn show_overlays(&mut self, ui: &Ui, rect: Rect) {
        if self.panes.figures {
            let (status, mode) = (self.session.status(), self.session.view_mode());
            let picked = self.picked.as_ref();
            status::show_figures(ui, rect, &status, mode, self.frame_time, picked);
        }
        if let Some(message) = &self.message
            && status::show_message(ui, rect, message)
        {
            self.message = None;
        }
        if self.panes.help {
            status::show_help(ui, rect);
        }
    }

    /// The pixel of the picture under the pointer.
    pub(super) fn pixel_at_pointer(&self) -> Option<(usize, usize)> {
        let position = self.pointer? * self.scale;
        let x = position.x - self.place.left as f32;
        let y = position.y - self.place.top as f32;
        let (width, height) = self.session.film().size();
        let is_inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        is_inside.then_some((x as usize, y as usize))
    }

    pub(super) fn pick(&mut self) {
        let Some((x, y)) = self.pixel_at_pointer() else { return };
        if self.panes.side == Some(Side::Inspector) {
            // The pane shows what is printed, and it is printed when the sample is evaluated.
            self.inspect(x, y);
        } else {
            self.print_pixel(x, y);
            self.picked = self.session.pick(x, y);
            self.inspector.forget();
            let (picked, state) = (self.picked.clone(), self.state());
            // The inspector evaluates it when it is opened.
            self.inspector.look_at(Inspected { x, y, picked, state });
        }
        if let Some(picked) = &self.picked {
            let entity = picked.material.unwrap_or(picked.shape);
            self.select(Some(entity));
        }
    }

    /// Prints what shaders print for a pixel.
    pub(super) fn print_pixel(&mut self, x: usize, y: usize) {
        match self.session.prints(x, y) {
            Ok(lines) if lines.is_empty() => {}
            Ok(lines) => {
                self.wishes.push(Wish::Print(format!("pixel {x},{y}:")));
                self.wishes.extend(lines.into_iter().map(Wish::Print));
            }
            Err(problem) => self.message = Some(problem.to_text(false)),
        }
    }

    pub(super) fn orbit_about_pointer(&mut self) {
        let picked = self.pixel_at_pointer().and_then(|(x, y)| self.session.pick(x, y));
        if let Some(picked) = picked {
            self.navigation.pivot = picked.position;
        }
    }
}

/// The notches by which the wheel has turned, positive away from the user.
fn notches(input: &egui::InputState) -> f32 {
    let of_event = |event: &egui::Event| match event {
        egui::Event::MouseWheel { unit, delta, .. } => match unit {
            egui::MouseWheelUnit::Point => delta.y / POINTS_PER_NOTCH,
            egui::MouseWheelUnit::Line | egui::MouseWheelUnit::Page => delta.y,
        },
        _ => 0.0,
    };
    input.events.iter().map(of_event).sum()
}
