//! Rectangles of pixels.

/// A rectangle of pixels; the ends are outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    pub left: i32,
    pub top: i32,
    pub right: i32,
    pub bottom: i32,
}

impl Area {
    pub fn of(rect: egui::Rect, scale: f32) -> Area {
        let side = |position: f32| (position * scale).round().clamp(-1e6, 1e6) as i32;
        let (min, max) = (rect.min, rect.max);
        Area { left: side(min.x), top: side(min.y), right: side(max.x), bottom: side(max.y) }
    }

    pub fn intersection(self, other: Area) -> Area {
        Area {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }

    pub fn is_empty(self) -> bool {
        self.left >= self.right || self.top >= self.bottom
    }
}
