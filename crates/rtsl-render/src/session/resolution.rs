//! The resolution of frames while a scene changes.

use std::time::Duration;

/// The time limit of a whole frame, for 25 frames a second: longer frames are rendered at lower resolution.
const FRAME_TARGET: Duration = Duration::from_millis(40);

/// The greatest reduction of columns and rows.
const MAX_REDUCTION: usize = 4;

/// The resolution of frames, by the measured speed of the last one.
#[derive(Clone, Copy, Debug)]
pub struct Resolution {
    /// The factor by which the last frame's columns and rows were reduced.
    reduction: usize,
    /// The time of a pixel of the last frame; `None` before the first one.
    pixel_time: Option<Duration>,
}

impl Resolution {
    /// Without any frame.
    pub const UNKNOWN: Resolution = Resolution { reduction: 1, pixel_time: None };

    /// Returns the factor by which columns and rows of the next frame are reduced. It changes only if the time differs
    /// clearly, so that the picture does not flicker.
    pub fn reduction(&self, (width, height): (usize, usize)) -> usize {
        let Some(pixel_time) = self.pixel_time else { return MAX_REDUCTION };
        let time = |reduction: usize| {
            let pixels = width.div_ceil(reduction) * height.div_ceil(reduction);
            pixel_time.mul_f64(pixels as f64)
        };
        let now = self.reduction;
        let is_too_fine = now < MAX_REDUCTION && time(now) > FRAME_TARGET.mul_f64(1.25);
        let is_too_coarse = now > 1 && time(now - 1) <= FRAME_TARGET;
        if !is_too_fine && !is_too_coarse {
            return now;
        }
        (1..MAX_REDUCTION).find(|it| time(*it) <= FRAME_TARGET).unwrap_or(MAX_REDUCTION)
    }

    /// Takes over the time of a frame of this size.
    pub fn note(&mut self, reduction: usize, (width, height): (usize, usize), time: Duration) {
        let pixel_time = Some(time.div_f64((width * height) as f64));
        *self = Resolution { reduction, pixel_time };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (1200, 800);

    /// The reduction after frames whose pixels take so many nanoseconds, one after another.
    fn after(frames: &[f64]) -> usize {
        let mut resolution = Resolution::UNKNOWN;
        for nanoseconds in frames {
            let reduction = resolution.reduction(SIZE);
            let size = (SIZE.0 / reduction, SIZE.1 / reduction);
            let time = nanoseconds * (size.0 * size.1) as f64 * 1e-9;
            resolution.note(reduction, size, Duration::from_secs_f64(time));
        }
        resolution.reduction(SIZE)
    }

    #[test]
    fn frames_are_as_fine_as_their_speed_allows() {
        assert_eq!(after(&[]), MAX_REDUCTION);
        assert_eq!(after(&[30.0]), 1);
        assert_eq!(after(&[100.0]), 2);
        assert_eq!(after(&[300.0]), 3);
        assert_eq!(after(&[5000.0]), MAX_REDUCTION, "never coarser, however slow");
    }

    #[test]
    fn small_differences_change_nothing() {
        assert_eq!(after(&[100.0, 160.0]), 2);
        assert_eq!(after(&[160.0, 160.0]), 2);
        assert_eq!(after(&[100.0, 220.0]), 3);
        assert_eq!(after(&[160.0, 30.0]), 1);
    }
}
