//! The panes of the window around the picture.

use egui::{Key, Rect};

/// The panes that are open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Panes {
    /// The editor at the left.
    pub editor: bool,
    /// The pane at the right.
    pub side: Option<Side>,
    /// The figures over the picture.
    pub figures: bool,
    /// The list of keys.
    pub help: bool,
}

/// The panes that share the right of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The parameters of the scene.
    Parameters,
    /// A pixel, and a replay of a sample of it.
    Inspector,
    /// The costs of shaders.
    Costs,
    /// The samples that are not finite.
    NotFinite,
}

impl Side {
    /// All of them, in their order in the toolbar.
    pub const ALL: [Side; 4] = [Side::Parameters, Side::Inspector, Side::Costs, Side::NotFinite];

    /// Returns the name of the pane.
    pub fn name(self) -> &'static str {
        match self {
            Side::Parameters => "Parameters",
            Side::Inspector => "Inspector",
            Side::Costs => "Costs",
            Side::NotFinite => "Not finite",
        }
    }
}

/// The height of the toolbar, in points.
pub const TOOLBAR: f32 = 30.0;
/// The width of the pane at the right at the start.
pub const SIDE: f32 = 340.0;
/// The width of the editor at the start.
pub const EDITOR: f32 = 560.0;

impl Panes {
    /// Returns the panes at the start, for a picture of this width: parameters beside large pictures.
    pub fn at_start(width: usize) -> Panes {
        const WIDE_ENOUGH: usize = 900;
        let side = (width >= WIDE_ENOUGH).then_some(Side::Parameters);
        Panes { editor: false, side, figures: true, help: false }
    }

    /// Returns the points that open panes take beside and above the picture at the start.
    pub fn room(&self) -> egui::Vec2 {
        let editor = if self.editor { EDITOR } else { 0.0 };
        let side = if self.side.is_some() { SIDE } else { 0.0 };
        egui::vec2(editor + side, TOOLBAR)
    }

    /// Opens a pane at the right, or closes it if it is open.
    pub fn toggle(&mut self, side: Side) {
        self.side = if self.side == Some(side) { None } else { Some(side) };
    }
}

/// The rectangle of the picture in pixels of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Pixels from the left.
    pub left: usize,
    /// Pixels from the top.
    pub top: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Place {
    /// Returns the pixels of a rectangle of points, of which each has `scale` pixels, in a window of this size.
    pub fn of(rect: Rect, scale: f32, (columns, rows): (usize, usize)) -> Place {
        let side =
            |position: f32, end: usize| ((position * scale).round().max(0.0) as usize).min(end);
        let (left, top) = (side(rect.left(), columns), side(rect.top(), rows));
        let width = side(rect.right(), columns).saturating_sub(left);
        let height = side(rect.bottom(), rows).saturating_sub(top);
        Place { left, top, width, height }
    }
}

/// True for the keys of flights.
pub fn is_of_flight(key: Key) -> bool {
    matches!(key, Key::W | Key::S | Key::A | Key::D | Key::E | Key::Q)
}
