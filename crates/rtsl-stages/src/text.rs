//! The text form: a header with the slots, then each stage with its function.
//!
//! ```text
//! stages Path.radiance
//! slot 0: f32 throughput.x
//! slot 1: i32
//!
//! stage 0: start
//! function Path.radiance.0
//! ...
//!
//! stage 1: nearest_hit, surface answer, live 0 1
//! function Path.radiance.1
//! ...
//! ```
//!
//! A stage is opened by the event that resumes it, and its surface if it has one.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use rtsl_ir::{Function, Scalar, text};

use crate::{ResumedBy, Slot, SlotId, Stage, Stages, Surface};

impl Display for Stages {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        writeln!(out, "stages {}", self.name)?;
        for (index, Slot { scalar, name }) in self.slots.iter().enumerate() {
            let line = format!("slot {index}: {} {name}", scalar.name());
            writeln!(out, "{}", line.trim_end())?;
        }
        for (index, stage) in self.stages.iter().enumerate() {
            write!(out, "\nstage {index}: {stage}")?;
        }
        Ok(())
    }
}

impl Display for Stage {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        write!(out, "{}", self.resumed_by.name())?;
        if self.surface != Surface::None {
            write!(out, ", surface {}", self.surface.name())?;
        }
        if !self.live.is_empty() {
            write!(out, ", live")?;
            self.live.iter().try_for_each(|slot| write!(out, " {}", slot.0))?;
        }
        write!(out, "\n{}", self.function)
    }
}

/// The reason a text is no stages.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseError {
    /// A line of the header or of a stage's head is not as it must be.
    #[error("line {line}: expected {expected}")]
    Line {
        /// The line, from 1.
        line: usize,
        /// The text that must be there.
        expected: &'static str,
    },
    /// The function of a stage.
    #[error("stage {stage}: {error}")]
    Function {
        /// The index of the stage.
        stage: usize,
        /// The error, with a position from the start of the function.
        error: text::ParseError,
    },
}

impl FromStr for Stages {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Stages, ParseError> {
        let mut lines = text.lines().zip(1..).peekable();
        let error = |line, expected| ParseError::Line { line, expected };
        let first = lines.next().and_then(|(line, _)| line.strip_prefix("stages "));
        let name = first.ok_or(error(1, "`stages` and a name"))?.to_owned();
        let mut stages = Stages { name, slots: Vec::new(), stages: Vec::new() };
        while let Some((line, number)) = lines.next() {
            if let Some(slot) = line.strip_prefix("slot ") {
                let slot = slot_of(slot, stages.slots.len());
                stages.slots.push(slot.ok_or(error(number, "a slot like `slot 0: f32 name`"))?);
            } else if let Some(head) = line.strip_prefix("stage ") {
                let mut function = String::new();
                while let Some((line, _)) = lines.next_if(|(it, _)| !it.starts_with("stage ")) {
                    function.push_str(line);
                    function.push('\n');
                }
                let index = stages.stages.len();
                let function = function
                    .parse()
                    .map_err(|error| ParseError::Function { stage: index, error })?;
                let stage = stage_of(head, index, function);
                stages.stages.push(stage.ok_or(error(number, "a stage like `stage 0: start`"))?);
            } else if !line.is_empty() {
                return Err(error(number, "a slot or a stage"));
            }
        }
        Ok(stages)
    }
}

fn slot_of(text: &str, index: usize) -> Option<Slot> {
    let (found, slot) = text.split_once(": ")?;
    let (scalar, name) = slot.split_once(' ').unwrap_or((slot, ""));
    let scalar = Scalar::from_name(scalar)?;
    (found.parse() == Ok(index)).then(|| Slot { scalar, name: name.to_owned() })
}

fn stage_of(text: &str, index: usize, function: Function) -> Option<Stage> {
    let (found, head) = text.split_once(": ")?;
    let mut parts = head.split(", ");
    let resumed_by = ResumedBy::from_name(parts.next()?)?;
    let mut stage = Stage { function, resumed_by, surface: Surface::None, live: Vec::new() };
    for part in parts {
        match part.split_once(' ')? {
            ("surface", name) => stage.surface = Surface::from_name(name)?,
            ("live", slots) => {
                let slots = slots.split(' ').map(|slot| slot.parse().ok().map(SlotId));
                stage.live = slots.collect::<Option<_>>()?;
            }
            _ => return None,
        }
    }
    (found.parse() == Ok(index)).then_some(stage)
}
