//! The viewer: converts input to pixels. It does not depend on a window.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui::{CentralPanel, Context, Key, Panel, PointerButton, Pos2, RawInput, Rect, Sense, Ui};
use rtsl_render::Messages;
use rtsl_render::session::{Picked, Reloaded, Session, ViewMode};
use rtsl_scene::EntityId;

use crate::costs::{self, LineCosts};
use crate::editor::{Done, Editor, Notes};
use crate::inspector::{
    Debugging, Inspected, Inspector, Job, Jobs, Move, ReportPlace, Request as Inspection, State,
};
use crate::layout::{self, Panes, Place, Side};
use crate::navigation::Navigation;
use crate::not_finite::{NotFinite, Request as NotFiniteRequest};
use crate::parameters::{Parameters, Request};
use crate::raster::Raster;
use crate::{status, theme, toolbar};

/// The number of points that a touchpad scrolls for a notch.
const POINTS_PER_NOTCH: f32 = 40.0;

/// The viewer, without its window.
pub struct App {
    session: Session,
    context: Context,
    raster: Raster,
    /// The columns and rows of the window.
    size: (usize, usize),
    /// The picture in the window, in pixels, and the number of them per point.
    place: Place,
    scale: f32,
    panes: Panes,
    /// The pane at the right that is shown when it opens.
    last_side: Side,
    navigation: Navigation,
    parameters: Parameters,
    editor: Editor,
    inspector: Inspector,
    jobs: Jobs,
    not_finite: NotFinite,
    /// The costs of lines, if they were measured.
    costs: Option<LineCosts>,
    /// The number of changes of the scene.
    changes: u64,
    /// True while the window asks whether unsaved texts may be lost.
    asks_to_close: bool,
    pointer: Option<Pos2>,
    picked: Option<Picked>,
    /// Diagnostics, until they are closed or out of date.
    message: Option<String>,
    /// The smoothed time between frames.
    frame_time: Duration,
    last_frame: Option<Instant>,
    wishes: Vec<Wish>,
}

/// What is shown when the window opens.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// The pane at the right; parameters beside large pictures if `None`.
    pub side: Option<Side>,
    /// A file and a line in the editor. A replay runs to the line.
    pub edit: Option<(PathBuf, Option<usize>)>,
    /// The column and the row of a pixel that is inspected, and the sample that is replayed.
    pub inspect: Option<([usize; 2], u32)>,
    /// The quantity that is displayed.
    pub mode: ViewMode,
}

/// A request that only the window can fulfil.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Write a line to standard output.
    Print(String),
    /// Write a picture of the window.
    Screenshot,
    /// Close the window.
    Close,
}

/// The part of a frame that the window takes care of.
pub struct Shown {
    /// The pointer's shape, texts for the clipboard, and the like.
    pub platform: egui::PlatformOutput,
    /// The time after which the next frame is due although nothing happens.
    pub repaint_after: Duration,
}

impl App {
    /// Creates a viewer of a session.
    pub fn new(session: Session, start: &Start) -> Self {
        let context = Context::default();
        theme::apply(&context);
        let size = session.film().size();
        let mut app = App {
            editor: Editor::new(&context, session.search_path().to_vec()),
            inspector: Inspector::default(),
            jobs: Jobs::default(),
            not_finite: NotFinite::default(),
            costs: costs::measure(&session),
            changes: 0,
            asks_to_close: false,
            context,
            raster: Raster::default(),
            size,
            place: Place::default(),
            scale: 1.0,
            panes: Panes::at_start(size.0),
            last_side: Side::Parameters,
            navigation: Navigation::new(&session),
            parameters: Parameters::new(session.things()),
            pointer: None,
            picked: None,
            message: None,
            frame_time: Duration::ZERO,
            last_frame: None,
            wishes: Vec::new(),
            session,
        };
        let first = app.parameters.things.iter().map(|thing| thing.entity);
        let first = first.into_iter().find(|it| !app.session.controls(*it).is_empty());
        app.select(first);
        app.start(start);
        app
    }

    fn start(&mut self, start: &Start) {
        self.session.set_view_mode(start.mode);
        self.panes.side = start.side.or(self.panes.side);
        if let Some((path, line)) = &start.edit {
            self.panes.editor = true;
            let name = path.display().to_string();
            self.editor.go_to(&name, *line, None);
            if let (Some(line), Some(_)) = (line, start.inspect) {
                self.editor.set_breakpoint(&name, *line as u32);
            }
        }
        if let Some(([x, y], sample)) = start.inspect {
            self.panes.editor = true;
            self.panes.side = Some(Side::Inspector);
            self.inspector.set_sample(sample);
            self.inspect(x, y);
            let job = Job::Steps(self.inspector.probed());
            self.evaluate(job);
        }
    }

    /// Returns the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the context of the controls.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Returns the size of a window in points whose picture has the size of the session's film at this scale.
    pub fn window_size(&self, scale: f32) -> egui::Vec2 {
        let (width, height) = self.session.film().size();
        egui::vec2(width as f32, height as f32) / scale + self.panes.room()
    }

    /// Returns the columns and rows of the window.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Returns the message being shown.
    pub fn message(&self) -> Option<&str> {
        self.message.as_deref()
    }

    /// Returns the last pick.
    pub fn picked(&self) -> Option<&Picked> {
        self.picked.as_ref()
    }

    /// Takes the wishes since the last call.
    pub fn take_wishes(&mut self) -> Vec<Wish> {
        std::mem::take(&mut self.wishes)
    }

    /// Notes that files of the scene were saved.
    pub fn files_changed(&mut self) {
        self.editor.look_at_files();
        self.reload();
    }

    /// Handles the wish to close the window. Returns false if there are unsaved texts: someone is asked first.
    pub fn may_close(&mut self) -> bool {
        self.asks_to_close = !self.editor.unsaved().is_empty();
        self.panes.editor |= self.asks_to_close;
        !self.asks_to_close
    }

    /// True while a thread finds something out that will be shown.
    pub fn is_waiting(&self) -> bool {
        self.jobs.is_busy() || self.editor.is_busy()
    }

    /// True if [`App::advance`] has work to do.
    pub fn is_busy(&self) -> bool {
        self.session.is_busy() || self.navigation.is_flying()
    }

    /// Renders for about `budget`, after moving the camera for the time of the last frame.
    pub fn advance(&mut self, budget: Duration) {
        let now = Instant::now();
        let since = self.last_frame.map_or(Duration::ZERO, |last| now - last);
        // After a rest, the time since the last frame is not a frame time.
        let since = since.min(Duration::from_millis(250));
        self.last_frame = Some(now);
        self.frame_time = self.frame_time.mul_f64(0.8) + since.mul_f64(0.2);
        self.navigation.fly(&mut self.session, since);
        self.session.advance(budget);
        if let Some(problem) = self.session.status().problem {
            self.message = Some(problem);
        }
    }

    /// Notes that the viewer rests: the next frame time does not start at the last frame.
    pub fn rest(&mut self) {
        self.last_frame = None;
    }

    /// Handles input and lays out the window, of so many columns and rows.
    pub fn frame(&mut self, mut input: RawInput, (width, height): (usize, usize)) -> Shown {
        if width > 0 && height > 0 {
            self.size = (width, height);
        }
        self.take_keys(&mut input);
        self.take_outcomes();
        let context = self.context.clone();
        let output = context.run_ui(input, |ui| self.show(ui));
        self.scale = output.pixels_per_point;
        let primitives = context.tessellate(output.shapes, self.scale);
        self.raster.draw(self.size, primitives, output.textures_delta, self.scale);
        let viewport = output.viewport_output.get(&egui::ViewportId::ROOT);
        let repaint_after = viewport.map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        Shown { platform: output.platform_output, repaint_after }
    }

    /// Paints the last frame: `pixels` has its columns and rows.
    pub fn paint(&self, pixels: &mut [u32]) {
        let (width, height) = self.size;
        if pixels.len() < width * height {
            return;
        }
        pixels.fill(0);
        let Place { left, top, .. } = self.place;
        let film = self.session.film();
        let (columns, rows) = film.size();
        if left + columns <= width && top + rows <= height {
            film.copy_to(&mut pixels[top * width + left..], width);
        } else {
            // The session could not take over the size of the window.
            let mut picture = vec![0; columns * rows];
            film.copy_to(&mut picture, columns);
            let copied = columns.min(width.saturating_sub(left));
            for row in 0..rows.min(height.saturating_sub(top)) {
                let to = (top + row) * width + left;
                let from = &picture[row * columns..][..copied];
                pixels[to..to + copied].copy_from_slice(from);
            }
        }
        self.raster.show_over(pixels);
    }

    // Keys.

    /// Handles the keys that are commands of the viewer, and removes them from the input, unless someone types.
    fn take_keys(&mut self, input: &mut RawInput) {
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
    fn take_shortcut(&mut self, key: Key, modifiers: &egui::Modifiers) -> bool {
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
    fn take_key(&mut self, key: Key, is_pressed: bool, is_repeated: bool) -> bool {
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
    fn command(&mut self, key: Key) -> bool {
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

    // The window.

    fn show(&mut self, ui: &mut Ui) {
        self.show_toolbar(ui);
        if self.panes.editor {
            let pane = Panel::left("editor").default_size(layout::EDITOR).min_size(240.0);
            pane.resizable(true).show(ui, |ui| self.show_editor(ui));
        }
        if let Some(side) = self.panes.side {
            self.last_side = side;
            let pane = Panel::right("side").default_size(layout::SIDE).min_size(220.0);
            pane.resizable(true).show(ui, |ui| self.show_side(ui, side));
        }
        CentralPanel::no_frame().show(ui, |ui| self.show_picture(ui));
        if self.asks_to_close {
            self.show_question(ui);
        }
    }

    fn show_editor(&mut self, ui: &mut Ui) {
        self.editor.open_all(&self.session.source_files());
        let place = self.inspector.debugging.as_ref().and_then(Debugging::place);
        let notes = Notes {
            position: place.map(|(text, line, _)| (text, line)),
            values: self.inspector.debugging.as_ref().map(|debugging| &debugging.beside),
            costs: self.costs.as_ref(),
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
    fn show_question(&mut self, ui: &Ui) {
        let titles = self.editor.unsaved().join(", ");
        egui::Modal::new(egui::Id::unique("unsaved")).show(ui.ctx(), |ui| {
            ui.heading("Unsaved texts");
            ui.label(format!("{titles} differ from their files."));
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

    fn show_toolbar(&mut self, ui: &mut Ui) {
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

    fn show_side(&mut self, ui: &mut Ui, side: Side) {
        match side {
            Side::Parameters => {
                let request = self.parameters.show(ui);
                self.obey(request);
            }
            Side::Inspector => self.show_inspector(ui),
            Side::Costs => {
                let mode = self.session.view_mode();
                if let Some(mode) = costs::show(ui, self.costs.as_ref(), mode) {
                    self.session.set_view_mode(mode);
                }
            }
            Side::NotFinite => {
                let running = self.jobs.is_busy();
                match self.not_finite.show(ui, self.session.film(), running) {
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

    fn show_inspector(&mut self, ui: &mut Ui) {
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

    fn show_picture(&mut self, ui: &mut Ui) {
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
    fn mark_pixel(&self, ui: &Ui, rect: Rect) {
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

    fn handle_gestures(&mut self, ui: &Ui, response: &egui::Response) {
        let scale = f64::from(ui.ctx().pixels_per_point());
        let (delta, pointer) = ui.input(|input| (input.pointer.delta(), input.pointer.latest_pos()));
        self.pointer = pointer;
        let by = [f64::from(delta.x) * scale, f64::from(delta.y) * scale];
        for button in [PointerButton::Primary, PointerButton::Middle, PointerButton::Secondary] {
            if !response.dragged_by(button) {
                continue;
            }
            // A drag is known as one only after some points.
            let by = match response.drag_started_by(button) {
                true => response.total_drag_delta().map_or(by, |way| {
                    [f64::from(way.x) * scale, f64::from(way.y) * scale]
                }),
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

    fn show_overlays(&mut self, ui: &Ui, rect: Rect) {
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

    // The picture.

    /// The pixel of the picture under the pointer.
    fn pixel_at_pointer(&self) -> Option<(usize, usize)> {
        let position = self.pointer? * self.scale;
        let x = position.x - self.place.left as f32;
        let y = position.y - self.place.top as f32;
        let (width, height) = self.session.film().size();
        let is_inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        is_inside.then_some((x as usize, y as usize))
    }

    fn pick(&mut self) {
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

    // The inspector.

    /// The state of the picture.
    fn state(&self) -> State {
        let (size, camera) = (self.session.film().size(), self.session.camera());
        State { size, camera, changes: self.changes }
    }

    fn inspect(&mut self, x: usize, y: usize) {
        self.picked = self.session.pick(x, y);
        let (picked, state) = (self.picked.clone(), self.state());
        let job = self.inspector.look_at(Inspected { x, y, picked, state });
        self.evaluate(job);
    }

    fn evaluate(&mut self, job: Job) {
        self.jobs.start(&self.context, self.session.probe(), job);
    }

    /// Takes what threads have found out.
    fn take_outcomes(&mut self) {
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
    fn begin_replay(&mut self) {
        let Some(debugging) = &mut self.inspector.debugging else { return };
        debugging.set_breakpoints(self.editor.breakpoints());
        debugging.run_to_first();
        self.panes.editor = true;
        self.show_position();
    }

    /// Shows the line of the replay in the editor.
    fn show_position(&mut self) {
        let place = self.inspector.debugging.as_ref().and_then(Debugging::place);
        if let Some((name, line, text)) = place {
            self.editor.go_to(name, Some(line as usize), Some(text));
        }
    }

    fn go_to(&mut self, place: &ReportPlace) {
        self.panes.editor = true;
        self.editor.go_to(&place.text, Some(place.line), Some(&place.content));
    }

    /// Prints what shaders print for a pixel.
    fn print_pixel(&mut self, x: usize, y: usize) {
        match self.session.prints(x, y) {
            Ok(lines) if lines.is_empty() => {}
            Ok(lines) => {
                self.wishes.push(Wish::Print(format!("pixel {x},{y}:")));
                self.wishes.extend(lines.into_iter().map(Wish::Print));
            }
            Err(problem) => self.message = Some(problem.to_text(false)),
        }
    }

    fn orbit_about_pointer(&mut self) {
        let picked = self.pixel_at_pointer().and_then(|(x, y)| self.session.pick(x, y));
        if let Some(picked) = picked {
            self.navigation.pivot = picked.position;
        }
    }

    // The scene.

    fn select(&mut self, entity: Option<EntityId>) {
        let controls = entity.map_or_else(Vec::new, |entity| self.session.controls(entity));
        self.parameters.select(entity, controls);
    }

    fn obey(&mut self, request: Option<Request>) {
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

    fn reload(&mut self) {
        let reloaded = self.session.reload();
        self.adopt(reloaded);
    }

    fn show_next_integrator(&mut self) {
        let names = self.session.integrators();
        let is_shown = |name: &String| name.eq_ignore_ascii_case(self.session.integrator());
        let next = names.iter().position(is_shown).map_or(0, |shown| (shown + 1) % names.len());
        let changed = self.session.set_integrator(&names[next]);
        self.adopt(changed);
    }

    /// Shows the result of reading the scene again.
    fn adopt(&mut self, reloaded: Result<Reloaded, Messages>) {
        match reloaded {
            Ok(reloaded) => {
                let warnings = reloaded.warnings.to_text(false);
                self.message = (!warnings.is_empty()).then_some(warnings);
                if reloaded.changed {
                    self.changes += 1;
                    self.not_finite.clear();
                    self.costs = costs::measure(&self.session);
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

#[cfg(test)]
#[path = "app_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "editor_tests.rs"]
mod editor_tests;

#[cfg(test)]
#[path = "inspector_tests.rs"]
mod inspector_tests;
