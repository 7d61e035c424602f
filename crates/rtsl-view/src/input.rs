//! Input events, independent of the window library, so that everything behind the window can be tested without one.

/// An input event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The window was resized.
    Resized {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The pointer moved to this position, in pixels from the top left.
    PointerMoved {
        /// Pixels from the left.
        x: f64,
        /// Pixels from the top.
        y: f64,
    },
    /// A button was pressed.
    ButtonPressed(Button),
    /// A button was released.
    ButtonReleased(Button),
    /// The wheel turned by so many notches, positive away from the user.
    Scrolled(f64),
    /// A key was pressed, or repeats.
    KeyPressed(Key),
    /// A key was released.
    KeyReleased(Key),
    /// The window lost the keyboard focus: no key is down.
    FocusLost,
    /// A file of the scene was saved.
    FilesChanged,
}

/// A button of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The primary button.
    Left,
    /// The wheel.
    Middle,
    /// The secondary button.
    Right,
}

/// A key, by its meaning.
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
    /// Either Shift key.
    Shift,
    /// Tab.
    Tab,
    /// Escape.
    Escape,
    /// Home.
    Home,
    /// F12, which takes a picture of the window.
    F12,
}
