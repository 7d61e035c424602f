//! A line on a terminal with the progress of a render; nothing if standard error is not a terminal.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use indicatif::{FormattedDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use rtsl_render::{Progress, TilesDone};

use crate::report::Reporter;

const STEP: &str = "{spinner} {msg}  {elapsed}";
const TILES: &str = "{bar:40} {percent:>3}%  {elapsed_precise}{msg}";

/// The interval of the line's animation.
const TURN: Duration = Duration::from_millis(100);

/// The progress line.
pub struct ProgressLine {
    bar: ProgressBar,
    /// The time of the first tile, and the tiles done by then.
    begun: OnceLock<(Instant, TilesDone)>,
}

impl ProgressLine {
    /// Creates a line on standard error.
    pub fn new(reporter: &Reporter) -> Self {
        let target = if reporter.shows_progress() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(None, target);
        ProgressLine { bar, begun: OnceLock::new() }
    }

    /// Shows the progress.
    pub fn show(&self, progress: Progress) {
        match progress {
            Progress::Rendering(tiles) => {
                let (begun, first) = self.begun.get_or_init(|| {
                    self.set_style(TILES);
                    self.bar.disable_steady_tick();
                    self.bar.reset_elapsed();
                    self.bar.set_length(tiles.of as u64);
                    self.bar.set_message("");
                    (Instant::now(), tiles)
                });
                let left =
                    tiles.time_left(first, begun.elapsed()).filter(|_| !self.bar.is_hidden());
                if let Some(left) = left {
                    self.bar.set_message(format!(", {} left", FormattedDuration(left)));
                }
                self.bar.set_position(tiles.done as u64);
            }
            Progress::Reading => self.begin("reading".to_owned()),
            Progress::Compiling { shaders } => {
                self.begin(format!("compiling {}", counted(shaders as u64, "shader")));
            }
            Progress::Building { primitives } => {
                let primitives = counted(primitives, "primitive");
                self.begin(format!("building the hierarchy over {primitives}"));
            }
        }
    }

    /// Removes the line.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Hides the bar while something else is written.
    pub fn suspend(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }

    fn begin(&self, step: String) {
        self.set_style(STEP);
        self.bar.set_message(step);
        self.bar.enable_steady_tick(TURN);
    }

    fn set_style(&self, template: &str) {
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style);
        }
    }
}

fn counted(count: u64, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
