//! Which light a point is lit by a sample of.

use super::LightEntry;

/// Chooses lights.
#[derive(Default)]
pub struct Selection {
    count: u32,
}

impl Selection {
    /// Among these.
    pub fn new(entries: &[LightEntry]) -> Self {
        Selection { count: entries.len() as u32 }
    }

    /// The light that a number in [0,1) chooses for a point, and with which probability.
    pub fn choose(&self, _point: [f32; 3], number: f32) -> (u32, f32) {
        let light = (number * self.count as f32) as u32;
        (light.min(self.count.saturating_sub(1)), 1.0 / self.count as f32)
    }

    /// The probability with which a light is chosen for a point.
    pub fn probability(&self, _light: u32, _point: [f32; 3]) -> f32 {
        1.0 / self.count as f32
    }
}
