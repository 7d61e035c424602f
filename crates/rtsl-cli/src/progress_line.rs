//! One line on a terminal that says what a render is at; none where standard error is no terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rtsl_render::Progress;

use crate::report::Reporter;

const STEP: &str = "{spinner} {msg}  {elapsed}";
const TILES: &str = "{bar:40} {percent:>3}%  {elapsed}, {eta} left";

/// The line's signs turn so often.
const TURN: Duration = Duration::from_millis(100);

/// The line.
pub struct ProgressLine {
    bar: ProgressBar,
}

impl ProgressLine {
    /// A line on standard error.
    pub fn new(reporter: &Reporter) -> Self {
        let target = if reporter.shows_progress() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        ProgressLine { bar: ProgressBar::with_draw_target(None, target) }
    }

    /// Says what the render is at.
    pub fn show(&self, progress: Progress) {
        match progress {
            Progress::Rendering { done, of } => {
                if self.bar.length() != Some(of as u64) {
                    self.set_style(TILES);
                    self.bar.disable_steady_tick();
                    self.bar.reset_elapsed();
                    self.bar.set_length(of as u64);
                }
                self.bar.set_position(done as u64);
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

    /// Takes the line away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
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
