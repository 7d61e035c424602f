//! What a render is at, for people who wait.

use std::time::Duration;

/// A step of a render, or a part of its last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// It reads the scene and the shaders that this names.
    Reading,
    /// It makes kernels.
    Compiling {
        /// How many shaders there are, those that differ only in values counted once.
        shaders: usize,
    },
    /// It bounds shapes and builds the hierarchy over them.
    Building {
        /// How many shapes and elements there are.
        primitives: u64,
    },
    /// It renders tiles.
    Rendering(TilesDone),
}

/// How far a render is with its tiles, each counted as often as it is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TilesDone {
    /// How many are done.
    pub done: usize,
    /// How many there are.
    pub of: usize,
    /// How many of those that are done took no time: a checkpoint had them, or their noise was low enough.
    pub skipped: usize,
}

impl TilesDone {
    /// How long those that are left will take, if they are like those that were rendered `since`, which took
    /// `elapsed`. `None` where none was.
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
        // Going on from a checkpoint: 400 were there.
        assert_eq!(left(done(501, 400), done(401, 400)), Some(49));
        assert_eq!(left(done(501, 400), done(1, 0)), Some(49));
        assert_eq!(left(done(1000, 0), done(0, 0)), Some(0));
        assert_eq!(left(done(300, 300), done(1, 1)), None);
    }
}
