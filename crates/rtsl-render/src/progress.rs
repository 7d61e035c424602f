//! Progress reports of a render.

use std::time::Duration;

/// A step of a render, or the progress of its last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Reading the scene and its shaders.
    Reading,
    /// Compiling kernels.
    Compiling {
        /// The number of shaders; those that differ only in values are counted once.
        shaders: usize,
    },
    /// Computing bounds and building the hierarchy.
    Building {
        /// The number of shapes and elements.
        primitives: u64,
    },
    /// Rendering tiles.
    Rendering(TilesDone),
}

/// The progress of rendering, in tiles, each counted as often as it is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TilesDone {
    /// The number of tiles done.
    pub done: usize,
    /// The number of all tiles.
    pub of: usize,
    /// The number of tiles done without rendering: restored from a checkpoint, or below the noise target.
    pub skipped: usize,
}

impl TilesDone {
    /// Estimates the remaining time from the tiles rendered since `since`, which took `elapsed`. Returns `None` if none
    /// was rendered.
    pub fn time_left(&self, since: &TilesDone, elapsed: Duration) -> Option<Duration> {
        let rendered = self.rendered().checked_sub(since.rendered()).filter(|count| *count > 0)?;
        let left = self.of.saturating_sub(self.done);
        Duration::try_from_secs_f64(elapsed.as_secs_f64() * left as f64 / rendered as f64).ok()
    }

    fn rendered(&self) -> usize {
        self.done.saturating_sub(self.skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_counts_what_was_rendered() {
        let done = |done, skipped| TilesDone { done, of: 1000, skipped };
        let left = |now: TilesDone, since| {
            now.time_left(&since, Duration::from_secs(10)).map(|left| left.as_secs())
        };
        assert_eq!(left(done(101, 0), done(1, 0)), Some(89));
        // Resumed from a checkpoint that contained 400 tiles.
        assert_eq!(left(done(501, 400), done(401, 400)), Some(49));
        assert_eq!(left(done(501, 400), done(1, 0)), Some(49));
        assert_eq!(left(done(1000, 0), done(0, 0)), Some(0));
        assert_eq!(left(done(300, 300), done(1, 1)), None);
    }
}
