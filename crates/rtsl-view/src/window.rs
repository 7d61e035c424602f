//! The window: passes events to the viewer and pixels to the screen.

use std::io::Write;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

use rtsl_image::{ImageError, write_pixels};
use rtsl_render::session::Session;
use softbuffer::{Context, Surface};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, OwnedDisplayHandle};
use winit::keyboard::{Key as WindowKey, NamedKey};
use winit::window::{Window, WindowId};

use crate::app::{App, Wish};
use crate::input::{Button, Event, Key};
use crate::libraries;
use crate::watch::FileWatch;

/// The time for adding samples between events: the greatest delay of input.
const SLICE: Duration = Duration::from_millis(15);

/// The number of pixels that a touchpad scrolls for a notch.
const PIXELS_PER_NOTCH: f64 = 40.0;

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
    let events = EventLoop::<FilesChanged>::with_user_event().build().map_err(no_display)?;
    let context = Context::new(events.owned_display_handle()).map_err(no_display)?;
    let proxy = events.create_proxy();
    // If watching fails, the key for reading the files again still works. The event loop may have ended.
    let watch = FileWatch::new(move || _ = proxy.send_event(FilesChanged)).ok();
    let size = session.film().size();
    let mut viewer = Viewer {
        app: App::new(session),
        options,
        size,
        context,
        surface: None,
        watch,
        frames: 0,
        failure: None,
    };
    viewer.watch_files();
    events.run_app(&mut viewer).map_err(no_display)?;
    viewer.failure.map_or(Ok(()), Err)
}

fn no_display(error: impl std::fmt::Display) -> ViewError {
    let text = error.to_string();
    // Errors of the system contain the source line of the library that reports them.
    let told = text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    ViewError::NoDisplay(told.map_or(text.clone(), |(_, what)| what.to_owned()))
}

/// Sent from the thread that watches the scene's files.
#[derive(Clone, Copy, Debug)]
struct FilesChanged;

struct Viewer {
    app: App,
    options: ViewOptions,
    /// The initial columns and rows.
    size: (usize, usize),
    context: Context<OwnedDisplayHandle>,
    /// The window's pixels; `None` before the window is created.
    surface: Option<Surface<OwnedDisplayHandle, Rc<Window>>>,
    watch: Option<FileWatch>,
    /// The number of frames shown.
    frames: u64,
    failure: Option<ViewError>,
}

impl ApplicationHandler<FilesChanged> for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.surface.is_none()
            && let Err(error) = self.open(events)
        {
            self.failure = Some(error);
            events.exit();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, FilesChanged: FilesChanged) {
        self.app.handle(Event::FilesChanged);
        self.watch_files();
        self.redraw();
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::RedrawRequested => self.show(events),
            other => {
                if let Some(event) = translate(&other) {
                    self.app.handle(event);
                    self.grant_wishes(events);
                    self.redraw();
                }
            }
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.app.is_busy() {
            events.set_control_flow(ControlFlow::Poll);
            self.app.advance(SLICE);
            self.redraw();
        } else {
            events.set_control_flow(ControlFlow::Wait);
            self.app.rest();
        }
    }
}

impl Viewer {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), ViewError> {
        let size = PhysicalSize::new(self.size.0 as u32, self.size.1 as u32);
        let attributes = Window::default_attributes();
        let attributes = attributes.with_title(&self.options.title).with_inner_size(size);
        let window = Rc::new(events.create_window(attributes).map_err(no_display)?);
        let size = window.inner_size();
        self.app.handle(resized(size));
        self.surface = Some(Surface::new(&self.context, window).map_err(no_display)?);
        Ok(())
    }

    fn redraw(&self) {
        if let Some(surface) = &self.surface {
            surface.window().request_redraw();
        }
    }

    /// Paints the window and presents it.
    fn show(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.present() {
            self.failure = Some(error);
            events.exit();
            return;
        }
        self.frames += 1;
        let is_last =
            self.options.frames.is_some_and(|frames| self.frames >= frames || !self.app.is_busy());
        if is_last {
            if self.options.screenshot.is_some() {
                self.take_screenshot(events);
            }
            events.exit();
        }
    }

    fn present(&mut self) -> Result<(), ViewError> {
        let (width, height) = self.app.session().film().size();
        let side = |side: usize| NonZeroU32::new(side as u32);
        let (Some(surface), Some(columns), Some(rows)) =
            (&mut self.surface, side(width), side(height))
        else {
            return Ok(());
        };
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
            }
        }
    }

    fn take_screenshot(&mut self, events: &ActiveEventLoop) {
        let (width, height) = self.app.session().film().size();
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

/// Translates an event of the window to one of the viewer, if there is one.
fn translate(event: &WindowEvent) -> Option<Event> {
    match event {
        WindowEvent::Resized(size) => Some(resized(*size)),
        WindowEvent::CursorMoved { position, .. } => {
            Some(Event::PointerMoved { x: position.x, y: position.y })
        }
        WindowEvent::MouseInput { state, button, .. } => {
            let button = match button {
                MouseButton::Left => Button::Left,
                MouseButton::Middle => Button::Middle,
                MouseButton::Right => Button::Right,
                MouseButton::Back | MouseButton::Forward | MouseButton::Other(_) => return None,
            };
            Some(match state {
                ElementState::Pressed => Event::ButtonPressed(button),
                ElementState::Released => Event::ButtonReleased(button),
            })
        }
        WindowEvent::MouseWheel { delta, .. } => Some(Event::Scrolled(match delta {
            MouseScrollDelta::LineDelta(_, lines) => f64::from(*lines),
            MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
        })),
        WindowEvent::KeyboardInput { event, .. } => {
            let key = key(&event.logical_key).filter(|key| !event.repeat || is_step(*key))?;
            Some(match event.state {
                ElementState::Pressed => Event::KeyPressed(key),
                ElementState::Released => Event::KeyReleased(key),
            })
        }
        WindowEvent::Focused(false) => Some(Event::FocusLost),
        _ => None,
    }
}

fn resized(size: PhysicalSize<u32>) -> Event {
    Event::Resized { width: size.width as usize, height: size.height as usize }
}

/// True for keys that repeat while they are held; other keys toggle things.
fn is_step(key: Key) -> bool {
    match key {
        Key::ArrowLeft | Key::ArrowRight | Key::ArrowUp | Key::ArrowDown => true,
        Key::Character(sign) => matches!(sign, '+' | '=' | '-'),
        Key::Shift | Key::Tab | Key::Escape | Key::Home | Key::F12 => false,
    }
}

fn key(key: &WindowKey) -> Option<Key> {
    match key {
        WindowKey::Character(text) => {
            let letter = text.chars().next()?;
            Some(Key::Character(letter.to_lowercase().next().unwrap_or(letter)))
        }
        WindowKey::Named(NamedKey::ArrowLeft) => Some(Key::ArrowLeft),
        WindowKey::Named(NamedKey::ArrowRight) => Some(Key::ArrowRight),
        WindowKey::Named(NamedKey::ArrowUp) => Some(Key::ArrowUp),
        WindowKey::Named(NamedKey::ArrowDown) => Some(Key::ArrowDown),
        WindowKey::Named(NamedKey::Shift) => Some(Key::Shift),
        WindowKey::Named(NamedKey::Tab) => Some(Key::Tab),
        WindowKey::Named(NamedKey::Escape) => Some(Key::Escape),
        WindowKey::Named(NamedKey::Home) => Some(Key::Home),
        WindowKey::Named(NamedKey::F12) => Some(Key::F12),
        _ => None,
    }
}
