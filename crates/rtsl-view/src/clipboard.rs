//! The clipboard of systems other than Wayland, which has its own way through the window.

use arboard::Clipboard as System;
use winit::raw_window_handle::{HasDisplayHandle, RawDisplayHandle};

/// The clipboard; nothing where there is none.
pub struct Clipboard(Option<System>);

impl Clipboard {
    /// Opens the clipboard of a display.
    pub fn new(display: &impl HasDisplayHandle) -> Clipboard {
        let is_wayland = display
            .display_handle()
            .is_ok_and(|handle| matches!(handle.as_raw(), RawDisplayHandle::Wayland(_)));
        Clipboard(if is_wayland { None } else { System::new().ok() })
    }

    /// Returns the text in the clipboard, if there is one.
    pub fn text(&mut self) -> Option<String> {
        self.0.as_mut()?.get_text().ok()
    }

    /// Puts a text into the clipboard.
    pub fn set_text(&mut self, text: &str) {
        if let Some(system) = &mut self.0 {
            // Another program may hold it for the moment.
            let _ = system.set_text(text);
        }
    }
}
