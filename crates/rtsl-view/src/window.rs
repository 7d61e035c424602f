//! The window: passes events to the viewer and pixels to the screen.

use std::io::Write;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Duration, Instant};

use rtsl_image::{ImageError, write_pixels};
use rtsl_render::session::Session;
use softbuffer::{Context, Surface};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{
    ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy, OwnedDisplayHandle,
};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

use crate::app::{App, Start, Wish};
use crate::clipboard::Clipboard;
use crate::libraries;
use crate::watch::FileWatch;

/// The time for adding samples between events: the greatest delay of input.
const SLICE: Duration = Duration::from_millis(15);

/// The picture that F12 takes if no file is given.
const PICTURE: &str = "rtsl-view.png";

/// Options of the window.
#[derive(Clone, Debug, Default)]
pub struct ViewOptions {
    /// The window's title.
    pub title: String,
    /// Close after so many frames, or when all samples are taken, whichever is first.
    pub frames: Option<u64>,
    /// Write a picture of the window to this file before it closes, and when F12 is pressed.
    pub screenshot: Option<PathBuf>,
    /// The state of the window when it opens.
    pub start: Start,
}

/// An error of opening the window.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// No display.
    #[error("cannot open a window: {0}")]
    NoDisplay(String),
    /// A picture cannot be written.
    #[error(transparent)]
    Screenshot(#[from] ImageError),
}

/// Shows a session in a window until it is closed.
///
/// # Errors
/// If there is no display, or a picture cannot be written.
pub fn view(session: Session, options: ViewOptions) -> Result<(), ViewError> {
    if let Some(library) = libraries::missing() {
        return Err(ViewError::NoDisplay(format!("the library {library} cannot be loaded")));
    }
    let events = EventLoop::<Signal>::with_user_event().build().map_err(no_display)?;
    let context = Context::new(events.owned_display_handle()).map_err(no_display)?;
    let proxy = events.create_proxy();
    // If watching fails, the key for reading the files again still works. The event loop may have ended.
    let watch = FileWatch::new(move || _ = proxy.send_event(Signal::FilesChanged)).ok();
    let app = App::new(session, &options.start);
    tell_of_repaints(app.context(), events.create_proxy());
    let mut viewer = Viewer {
        app,
        options,
        clipboard: Clipboard::new(&events.owned_display_handle()),
        context,
        shown: None,
        watch,
        repaint_at: None,
        frames: 0,
        failure: None,
    };
    viewer.watch_files();
    events.run_app(&mut viewer).map_err(no_display)?;
    viewer.failure.map_or(Ok(()), Err)
}

/// Wakes the event loop when a thread of the viewer has something to show.
fn tell_of_repaints(context: &egui::Context, proxy: EventLoopProxy<Signal>) {
    context.set_request_repaint_callback(move |request| {
        // Delays are known from each frame.
        if request.delay == Duration::ZERO {
            // The event loop may have ended.
            let _ = proxy.send_event(Signal::Repaint);
        }
    });
}

fn no_display(error: impl std::fmt::Display) -> ViewError {
    let text = error.to_string();
    // Errors of the system contain the source line of the library that reports them.
    let told = text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    ViewError::NoDisplay(told.map_or(text.clone(), |(_, what)| what.to_owned()))
}

/// A message of another thread.
#[derive(Clone, Copy, Debug)]
enum Signal {
    /// Files of the scene were saved.
    FilesChanged,
    /// There is something to show.
    Repaint,
}

struct Viewer {
    app: App,
    options: ViewOptions,
    clipboard: Clipboard,
    context: Context<OwnedDisplayHandle>,
    /// The window; `None` before it is created.
    shown: Option<ShownWindow>,
    watch: Option<FileWatch>,
    /// The time of the next frame if nothing happens.
    repaint_at: Option<Instant>,
    /// The number of frames shown.
    frames: u64,
    failure: Option<ViewError>,
}

/// A window with its pixels, and its events as input of the controls.
struct ShownWindow {
    surface: Surface<OwnedDisplayHandle, Rc<Window>>,
    input: egui_winit::State,
}

impl ApplicationHandler<Signal> for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.shown.is_none()
            && let Err(error) = self.open(events)
        {
            self.failure = Some(error);
            events.exit();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, signal: Signal) {
        if let Signal::FilesChanged = signal {
            self.app.files_changed();
            self.watch_files();
        }
        self.redraw();
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if is_paste(&event)
            && let (Some(text), Some(shown)) = (self.clipboard.text(), &mut self.shown)
        {
            shown.input.set_clipboard_text(text);
        }
        match event {
            WindowEvent::CloseRequested if self.app.may_close() => events.exit(),
            WindowEvent::CloseRequested => self.redraw(),
            WindowEvent::RedrawRequested => self.show(events),
            other => {
                let Some(shown) = &mut self.shown else { return };
                if shown.input.on_window_event(shown.surface.window(), &other).repaint {
                    self.redraw();
                }
            }
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.repaint_at.is_some_and(|at| at <= Instant::now()) {
            self.repaint_at = None;
            self.redraw();
        }
        if self.app.is_busy() {
            events.set_control_flow(ControlFlow::Poll);
            self.app.advance(SLICE);
            self.redraw();
        } else {
            let flow = self.repaint_at.map_or(ControlFlow::Wait, ControlFlow::WaitUntil);
            events.set_control_flow(flow);
            self.app.rest();
        }
    }
}

impl Viewer {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), ViewError> {
        let monitor = events.primary_monitor().or_else(|| events.available_monitors().next());
        let scale = monitor.as_ref().map_or(1.0, |monitor| monitor.scale_factor());
        let wanted = self.app.window_size(scale as f32) * scale as f32;
        let mut size = PhysicalSize::new(wanted.x.round() as u32, wanted.y.round() as u32);
        if let Some(room) = monitor.map(|monitor| monitor.size()).filter(|room| room.width > 0) {
            size = PhysicalSize::new(size.width.min(room.width), size.height.min(room.height));
        }
        let attributes = Window::default_attributes();
        let attributes = attributes.with_title(&self.options.title).with_inner_size(size);
        let window = Rc::new(events.create_window(attributes).map_err(no_display)?);
        let context = self.app.context().clone();
        let scale = Some(window.scale_factor() as f32);
        let viewport = egui::ViewportId::ROOT;
        let input = egui_winit::State::new(context, viewport, &window, scale, None, None);
        let surface = Surface::new(&self.context, window).map_err(no_display)?;
        self.shown = Some(ShownWindow { surface, input });
        Ok(())
    }

    fn redraw(&self) {
        if let Some(shown) = &self.shown {
            shown.surface.window().request_redraw();
        }
    }

    /// Handles the input since the last frame, paints the window and presents it.
    fn show(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.present() {
            self.failure = Some(error);
            events.exit();
            return;
        }
        self.grant_wishes(events);
        self.frames += 1;
        let is_done = !self.app.is_busy() && !self.app.is_waiting() && self.repaint_at.is_none();
        if self.options.frames.is_some_and(|frames| self.frames >= frames || is_done) {
            if self.options.screenshot.is_some() {
                self.take_screenshot(events);
            }
            events.exit();
        }
    }

    fn present(&mut self) -> Result<(), ViewError> {
        let Some(ShownWindow { surface, input }) = &mut self.shown else { return Ok(()) };
        let window = surface.window().clone();
        let size = window.inner_size();
        let (Some(columns), Some(rows)) =
            (NonZeroU32::new(size.width), NonZeroU32::new(size.height))
        else {
            return Ok(());
        };
        let raw = input.take_egui_input(&window);
        let frame = self.app.frame(raw, (size.width as usize, size.height as usize));
        for command in &frame.platform.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                self.clipboard.set_text(text);
            }
        }
        input.handle_platform_output(&window, frame.platform);
        self.repaint_at = Instant::now().checked_add(frame.repaint_after);
        surface.resize(columns, rows).map_err(no_display)?;
        let mut buffer = surface.buffer_mut().map_err(no_display)?;
        self.app.paint(&mut buffer);
        buffer.present().map_err(no_display)
    }

    fn grant_wishes(&mut self, events: &ActiveEventLoop) {
        for wish in self.app.take_wishes() {
            match wish {
                // Errors are ignored, because the standard output may be closed.
                Wish::Print(line) => _ = writeln!(std::io::stdout(), "{line}"),
                Wish::Screenshot => self.take_screenshot(events),
                Wish::Close => events.exit(),
            }
        }
    }

    fn take_screenshot(&mut self, events: &ActiveEventLoop) {
        let (width, height) = self.app.size();
        let mut pixels = vec![0; width * height];
        self.app.paint(&mut pixels);
        let path = self.options.screenshot.clone().unwrap_or_else(|| PathBuf::from(PICTURE));
        if let Err(error) = write_pixels(&pixels, width, &path) {
            self.failure = Some(error.into());
            events.exit();
        }
    }

    fn watch_files(&mut self) {
        if let Some(watch) = &mut self.watch {
            watch.add(&self.app.session().source_files());
        }
    }
}

/// True for the keys that paste.
fn is_paste(event: &WindowEvent) -> bool {
    let WindowEvent::KeyboardInput { event, .. } = event else { return false };
    let is_key = match &event.logical_key {
        Key::Character(text) => text.eq_ignore_ascii_case("v"),
        Key::Named(key) => matches!(key, NamedKey::Paste | NamedKey::Insert),
        _ => false,
    };
    is_key && event.state == ElementState::Pressed
}
