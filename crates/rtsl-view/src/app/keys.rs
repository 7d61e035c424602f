//! The keys of the viewer.

use egui::{Key, RawInput};
use rtsl_render::session::ViewMode;

use super::{App, Wish};
use crate::inspector::Move;
use crate::layout::{self, Side};

impl App {
    /// Handles the keys that are commands of the viewer, and removes them from the input, unless someone types.
    pub(super) fn take_keys(&mut self, input: &mut RawInput) {
        let is_typing = self.context.text_edit_focused();
        if is_typing || !input.focused {
            self.navigation.release_all();
        }
        let events = std::mem::take(&mut input.events);
        for event in events {
            match &event {
                egui::Event::ModifiersChanged(modifiers) => {
                    self.navigation.is_shifted = modifiers.shift;
                }
                egui::Event::WindowFocused(false) => self.navigation.release_all(),
                egui::Event::Key { key, pressed, repeat, modifiers, .. } => {
                    self.navigation.is_shifted = modifiers.shift;
                    let has_modifier = modifiers.command || modifiers.ctrl || modifiers.alt;
                    if *pressed && self.take_shortcut(*key, modifiers) {
                        continue;
                    }
                    let is_ours = !(is_typing || has_modifier);
                    if is_ours && self.take_key(*key, *pressed, *repeat) {
                        continue;
                    }
                }
                _ => {}
            }
            input.events.push(event);
        }
    }

    /// Handles a key that is a command even while someone types; false for others.
    pub(super) fn take_shortcut(&mut self, key: Key, modifiers: &egui::Modifiers) -> bool {
        if key == Key::F12 {
            self.wishes.push(Wish::Screenshot);
            return true;
        }
        if key == Key::S && modifiers.command && self.panes.editor {
            if self.editor.save() {
                self.reload();
            }
            return true;
        }
        let movement = Move::of_key(key, modifiers.shift);
        if let (Some(movement), Some(debugging)) = (movement, &mut self.inspector.debugging) {
            debugging.go(movement);
            self.show_position();
            return true;
        }
        false
    }

    /// Handles a key; false if it is no command.
    pub(super) fn take_key(&mut self, key: Key, is_pressed: bool, is_repeated: bool) -> bool {
        if layout::is_of_flight(key) {
            self.navigation.hold(key, is_pressed);
            return true;
        }
        let steps = match key {
            Key::ArrowLeft => Some([1.0, 0.0]),
            Key::ArrowRight => Some([-1.0, 0.0]),
            Key::ArrowUp => Some([0.0, 1.0]),
            Key::ArrowDown => Some([0.0, -1.0]),
            _ => None,
        };
        let notches = match key {
            Key::Plus | Key::Equals => Some(1.0),
            Key::Minus => Some(-1.0),
            _ => None,
        };
        match (steps, notches) {
            (Some(steps), _) if is_pressed => self.navigation.step(&mut self.session, steps),
            (_, Some(notches)) if is_pressed => self.navigation.dolly(&mut self.session, notches),
            (None, None) if is_pressed && !is_repeated => return self.command(key),
            (None, None) => return false,
            _ => {}
        }
        true
    }

    /// Executes the command of a key; false if it has none.
    pub(super) fn command(&mut self, key: Key) -> bool {
        match key {
            Key::O => self.panes.figures = !self.panes.figures,
            Key::H => self.panes.help = !self.panes.help,
            Key::R => self.reload(),
            Key::I => self.show_next_integrator(),
            Key::F => self.orbit_about_pointer(),
            Key::C => {
                let text = self.navigation.camera_text(&self.session);
                self.wishes.push(Wish::Print(text));
            }
            Key::Num1 | Key::Num2 | Key::Num3 | Key::Num4 | Key::Num5 => {
                let index = key as usize - Key::Num1 as usize;
                let mode = ViewMode::ALL.get(index);
                mode.into_iter().for_each(|mode| self.session.set_view_mode(*mode));
            }
            Key::Tab => {
                let side = self.panes.side.unwrap_or(self.last_side);
                self.panes.toggle(side);
            }
            Key::Home => self.session.set_camera(self.session.scene_camera()),
            Key::X => self.panes.editor = !self.panes.editor,
            Key::P => self.panes.toggle(Side::Inspector),
            Key::Escape => {
                self.message = None;
                self.panes.help = false;
                self.picked = None;
            }
            _ => return false,
        }
        true
    }
}
