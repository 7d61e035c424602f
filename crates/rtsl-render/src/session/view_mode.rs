//! What a session shows of its samples.

use std::time::Duration;

use rtsl_image::{HeatScale, SrgbEncoder, logarithm};

/// What is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewMode {
    /// The image.
    #[default]
    Image,
    /// The time that a sample of a pixel takes, from dark (16 ns) to light (260 us), by powers of two.
    Time,
    /// The nodes and blocks of the hierarchy that a camera ray visits, from dark (1) to light (1024), by
    /// powers of two.
    Nodes,
    /// The part of SIMD lanes that took part in calls, from dark (none) to light (all).
    Lanes,
}

impl ViewMode {
    /// All of them, in the order of the keys that choose them.
    pub const ALL: [ViewMode; 4] =
        [ViewMode::Image, ViewMode::Time, ViewMode::Nodes, ViewMode::Lanes];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            ViewMode::Image => "image",
            ViewMode::Time => "time per pixel",
            ViewMode::Nodes => "nodes per ray",
            ViewMode::Lanes => "lanes used",
        }
    }

    /// Whether it shows what is counted only while somebody wants to know.
    pub fn is_counted(self) -> bool {
        match self {
            ViewMode::Image | ViewMode::Time => false,
            ViewMode::Nodes | ViewMode::Lanes => true,
        }
    }
}

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelFacts {
    /// The mean of its samples.
    pub color: [f32; 3],
    /// The time that one of them took.
    pub time: Duration,
    /// The nodes and blocks that its camera ray visits.
    pub visited: f32,
    /// The part of lanes that took part.
    pub lanes: f32,
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

    /// What radiance is multiplied with.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// What stands for a pixel: `0x00RRGGBB`.
    pub fn pixel(&self, facts: &PixelFacts) -> u32 {
        let channels = match self.mode {
            ViewMode::Image => facts.color.map(|channel| self.encoder.encode(channel * self.scale)),
            ViewMode::Time => {
                self.heat.color(on_scale(facts.time.as_nanos() as f32, MIN_TIME, TIME_STEPS))
            }
            ViewMode::Nodes => self.heat.color(on_scale(facts.visited, 0.0, NODE_STEPS)),
            ViewMode::Lanes => self.heat.color(facts.lanes),
        };
        channels.into_iter().fold(0, |pixel, channel| pixel << 8 | u32::from(channel))
    }
}

/// The scale of [`ViewMode::Time`]: the power of two, in nanoseconds, that it begins with, and how many
/// powers it spans.
const MIN_TIME: f32 = 4.0;
const TIME_STEPS: f32 = 14.0;

/// The powers of two that the scale of [`ViewMode::Nodes`] spans.
const NODE_STEPS: f32 = 10.0;

/// A number on a scale of powers of two, from 0 to 1.
fn on_scale(number: f32, least: f32, steps: f32) -> f32 {
    ((logarithm(number) - least) / steps).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_encoded_and_brightened() {
        let display = Display::new(ViewMode::Image, 2.0);
        let facts = PixelFacts { color: [0.25, 0.0, 9.0], ..PixelFacts::default() };
        assert_eq!(display.pixel(&facts), 0x00BC_00FF);
    }

    #[test]
    fn more_time_is_hotter() {
        let display = Display::new(ViewMode::Time, 1.0);
        let pixel = |nanoseconds| {
            let time = Duration::from_nanos(nanoseconds);
            display.pixel(&PixelFacts { time, ..PixelFacts::default() })
        };
        assert_eq!(pixel(0), pixel(16));
        assert_eq!(pixel(1 << 18), pixel(1 << 30));
        assert_ne!(pixel(16), pixel(1 << 18));
        let scale = [16.0, 100.0, 1e3, 1e4, 1e5].map(|it| on_scale(it, MIN_TIME, TIME_STEPS));
        assert!(scale.is_sorted(), "{scale:?}");
    }
}
