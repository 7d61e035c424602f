//! The viewer: converts input to pixels. It does not depend on a window.

mod inspection;
mod keys;
mod panes;
mod picture;
mod scene;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui::{Context, Pos2, RawInput};
use rtsl_render::session::{Picked, Session, Thing, ViewMode};

use crate::costs::Costs;
use crate::editor::Editor;
use crate::inspector::{Inspector, Job, Jobs};
use crate::layout::{Panes, Place, Side};
use crate::navigation::Navigation;
use crate::not_finite::NotFinite;
use crate::parameters::Parameters;
use crate::raster::Raster;
use crate::theme;

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
    costs: Costs,
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

/// The state of the window when it opens.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// The pane at the right; parameters beside large pictures if `None`.
    pub side: Option<Side>,
    /// The part of the scene whose parameters are shown, by its title or class.
    pub select: Option<String>,
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
            costs: Costs::default(),
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
        if let Some(name) = &start.select {
            let is_named = |thing: &&Thing| thing.title == *name || thing.class == *name;
            let found = self.parameters.things.iter().find(is_named).map(|thing| thing.entity);
            match found {
                Some(entity) => self.select(Some(entity)),
                None => self.message = Some(format!("the scene has no part `{name}`")),
            }
        }
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
        self.jobs.is_busy() || self.costs.is_busy() || self.editor.is_busy()
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
}

#[cfg(test)]
mod editor_tests;
#[cfg(test)]
mod inspector_tests;
#[cfg(test)]
mod tests;
