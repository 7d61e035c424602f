//! What a session shows of its samples.

use std::time::Duration;

use crate::film::SrgbEncoder;

/// What is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewMode {
    /// The image.
    #[default]
    Image,
    /// The time that a sample of a pixel takes, from blue (16 ns) over green and red to white (260 us).
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
}

impl Display {
    /// Shows `mode`, images multiplied by `scale`.
    pub fn new(mode: ViewMode, scale: f32) -> Self {
        Display { mode, scale, encoder: SrgbEncoder::new() }
    }

    /// What it shows.
    pub fn mode(&self) -> ViewMode {
        self.mode
    }

    /// The pixel for a colour, and for the time that a sample of it took: `0x00RRGGBB`.
    pub fn pixel(&self, color: [f32; 3], time: Duration) -> u32 {
        let channels = match self.mode {
            ViewMode::Image => color.map(|channel| self.encoder.encode(channel * self.scale)),
            ViewMode::Time => heat(time_on_scale(time)),
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

/// A colour for a number from 0 to 1: black, blue, green, yellow, red, white.
fn heat(x: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 6] = [
        [0.0, 0.0, 40.0],
        [20.0, 60.0, 200.0],
        [20.0, 170.0, 90.0],
        [240.0, 210.0, 40.0],
        [220.0, 50.0, 30.0],
        [255.0, 255.0, 255.0],
    ];
    let place = x.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let below = (place as usize).min(STOPS.len() - 2);
    let part = place - below as f32;
    [0, 1, 2].map(|channel: usize| {
        let (from, to) = (STOPS[below][channel], STOPS[below + 1][channel]);
        (from + (to - from) * part) as u8
    })
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
        assert_eq!(pixel(1 << 18), 0x00FF_FFFF);
        let scale: Vec<f32> = [16, 100, 1_000, 10_000, 100_000]
            .map(|time| time_on_scale(Duration::from_nanos(time)))
            .to_vec();
        assert!(scale.is_sorted(), "{scale:?}");
    }
}
