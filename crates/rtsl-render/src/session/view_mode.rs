//! View modes of a session.

use std::time::Duration;

use rtsl_image::{HeatScale, SrgbEncoder, logarithm};

/// The quantity that is displayed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewMode {
    /// The image.
    #[default]
    Image,
    /// The time of a sample of a pixel, from dark (16 ns) to light (260 us), on a logarithmic scale.
    Time,
    /// The number of nodes and leaves of the hierarchy that a camera ray visits, from dark (1) to light (1024), on a
    /// logarithmic scale.
    Nodes,
    /// The fraction of SIMD lanes that are active in calls, from dark (none) to light (all).
    Lanes,
    /// The pixels with samples that are not finite, over a dark image.
    NotFinite,
}

impl ViewMode {
    /// All view modes, in the order of the keys that select them.
    pub const ALL: [ViewMode; 5] =
        [ViewMode::Image, ViewMode::Time, ViewMode::Nodes, ViewMode::Lanes, ViewMode::NotFinite];

    /// Returns the display name.
    pub fn name(self) -> &'static str {
        match self {
            ViewMode::Image => "image",
            ViewMode::Time => "time per pixel",
            ViewMode::Nodes => "nodes per ray",
            ViewMode::Lanes => "lanes used",
            ViewMode::NotFinite => "not finite",
        }
    }

    /// True if the quantity is only counted on demand.
    pub fn is_counted(self) -> bool {
        match self {
            ViewMode::Image | ViewMode::Time | ViewMode::NotFinite => false,
            ViewMode::Nodes | ViewMode::Lanes => true,
        }
    }
}

/// A pixel's inputs to the view.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelFacts {
    /// The mean of its samples.
    pub color: [f32; 3],
    /// The time per sample.
    pub time: Duration,
    /// The number of nodes and leaves that its camera ray visits.
    pub visited: f32,
    /// The fraction of lanes that are active.
    pub lanes: f32,
    /// True if a sample is not finite.
    pub dropped: bool,
}

/// The mapping of samples to displayed pixels.
#[derive(Clone, Debug)]
pub struct Display {
    mode: ViewMode,
    /// The factor of radiance.
    scale: f32,
    encoder: SrgbEncoder,
    heat: HeatScale,
}

impl Display {
    /// Displays `mode`, with images multiplied by `scale`.
    pub fn new(mode: ViewMode, scale: f32) -> Self {
        Display { mode, scale, encoder: SrgbEncoder::new(), heat: HeatScale::new() }
    }

    /// Returns the view mode.
    pub fn mode(&self) -> ViewMode {
        self.mode
    }

    /// Returns the factor of radiance.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Returns the displayed pixel: `0x00RRGGBB`.
    pub fn pixel(&self, facts: &PixelFacts) -> u32 {
        let channels = match self.mode {
            ViewMode::Image => facts.color.map(|channel| self.encoder.encode(channel * self.scale)),
            ViewMode::Time => {
                self.heat.color(on_scale(facts.time.as_nanos() as f32, MIN_TIME, TIME_STEPS))
            }
            ViewMode::Nodes => self.heat.color(on_scale(facts.visited, 0.0, NODE_STEPS)),
            ViewMode::Lanes => self.heat.color(facts.lanes),
            ViewMode::NotFinite if facts.dropped => NOT_FINITE,
            ViewMode::NotFinite => {
                let [red, green, blue] = facts.color.map(|channel| channel * self.scale);
                let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
                [self.encoder.encode(DIMMED * luminance); 3]
            }
        };
        channels.into_iter().fold(0, |pixel, channel| pixel << 8 | u32::from(channel))
    }
}

/// The scale of [`ViewMode::Time`]: the power of two at its start, in nanoseconds, and the number of powers that it
/// covers.
const MIN_TIME: f32 = 4.0;
const TIME_STEPS: f32 = 14.0;

/// The mark of pixels with samples that are not finite, and the factor of the others' luminance.
const NOT_FINITE: [u8; 3] = [255, 0, 255];
const DIMMED: f32 = 0.2;

/// The number of powers of two that the scale of [`ViewMode::Nodes`] covers.
const NODE_STEPS: f32 = 10.0;

/// Maps a number to a logarithmic scale from 0 to 1.
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
