//! What a session shows of its samples.

use std::time::Duration;

use crate::film::{HeatScale, SrgbEncoder};

/// What is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewMode {
    /// The image.
    #[default]
    Image,
    /// The time that a sample of a pixel takes, from dark (16 ns) to light (260 us), by powers of two.
    Time,
}

impl ViewMode {
    /// All of them, in the order of the keys that choose them.
    pub const ALL: [ViewMode; 2] = [ViewMode::Image, ViewMode::Time];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            ViewMode::Image => "image",
            ViewMode::Time => "time per pixel",
        }
    }
}

/// How samples become the pixels of a screen.
#[derive(Clone, Debug)]
pub struct Display {
    mode: ViewMode,
    /// What radiance is multiplied with.
    scale: f32,
    encoder: SrgbEncoder,
    heat: HeatScale,
}

impl Display {
    /// Shows `mode`, images multiplied by `scale`.
    pub fn new(mode: ViewMode, scale: f32) -> Self {
        Display { mode, scale, encoder: SrgbEncoder::new(), heat: HeatScale::new() }
    }

    /// What it shows.
    pub fn mode(&self) -> ViewMode {
        self.mode
    }

    /// The pixel for a colour, and for the time that a sample of it took: `0x00RRGGBB`.
    pub fn pixel(&self, color: [f32; 3], time: Duration) -> u32 {
        let channels = match self.mode {
            ViewMode::Image => color.map(|channel| self.encoder.encode(channel * self.scale)),
            ViewMode::Time => self.heat.color(time_on_scale(time)),
        };
        channels.into_iter().fold(0, |pixel, channel| pixel << 8 | u32::from(channel))
    }
}

/// A time on the scale of [`ViewMode::Time`], from 0 to 1: by powers of two, straight between them.
fn time_on_scale(time: Duration) -> f32 {
    const LEAST: u32 = 4;
    const STEPS: f32 = 14.0;
    let nanoseconds = time.as_nanos().clamp(1, 1 << 40);
    let power = nanoseconds.ilog2();
    let part = nanoseconds as f32 / (1_u64 << power) as f32 - 1.0;
    ((power as f32 + part - LEAST as f32) / STEPS).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_encoded_and_brightened() {
        let display = Display::new(ViewMode::Image, 2.0);
        assert_eq!(display.pixel([0.25, 0.0, 9.0], Duration::ZERO), 0x00BC_00FF);
    }

    #[test]
    fn more_time_is_hotter() {
        let display = Display::new(ViewMode::Time, 1.0);
        let pixel = |nanoseconds| display.pixel([0.0; 3], Duration::from_nanos(nanoseconds));
        assert_eq!(pixel(0), pixel(16));
        assert_eq!(pixel(1 << 18), pixel(1 << 30));
        assert_ne!(pixel(16), pixel(1 << 18));
        let scale: Vec<f32> = [16, 100, 1_000, 10_000, 100_000]
            .map(|time| time_on_scale(Duration::from_nanos(time)))
            .to_vec();
        assert!(scale.is_sorted(), "{scale:?}");
    }
}
