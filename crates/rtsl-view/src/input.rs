//! What people do, in words of our own: everything behind the window is tested without one.

/// Something happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The window has so many columns and rows.
    Resized {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The pointer stands here, in pixels from the top left.
    PointerMoved {
        /// From the left.
        x: f64,
        /// From the top.
        y: f64,
    },
    /// A button went down.
    ButtonPressed(Button),
    /// A button went up.
    ButtonReleased(Button),
    /// The wheel turned by so many notches, away from the user where positive.
    Scrolled(f64),
    /// A key went down, or repeats.
    KeyPressed(Key),
    /// A key went up.
    KeyReleased(Key),
    /// The keyboard speaks to another window now: no key is down.
    FocusLost,
    /// A file of the scene was saved.
    FilesChanged,
}

/// A button of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The first.
    Left,
    /// The wheel.
    Middle,
    /// The second.
    Right,
}

/// A key, by what it means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Key {
    /// A letter, lower case, a digit or a sign.
    Character(char),
    /// An arrow.
    ArrowLeft,
    /// An arrow.
    ArrowRight,
    /// An arrow.
    ArrowUp,
    /// An arrow.
    ArrowDown,
    /// Either of them.
    Shift,
    /// Tab.
    Tab,
    /// Escape.
    Escape,
    /// Home.
    Home,
    /// Takes a picture of the window.
    F12,
}
