//! A replay of a recorded sample: where it stands, and what is shown of it.

use rtsl::{TracedValue, type_name};
use rtsl_debug::Granularity::Line;
use rtsl_debug::{Frame, LineValues, Pauses, Reason, Replay, Scopes, Stopped};

use crate::editor::is_same_text;

/// A replay, with what is shown at its position, which is computed once per movement.
pub struct Debugging {
    replay: Replay,
    /// The calls around the position, the innermost first.
    pub frames: Vec<Frame>,
    /// The call whose variables are shown.
    pub selected: usize,
    /// The variables of the selected call.
    pub scopes: Scopes,
    /// The values beside the lines of the selected call.
    pub beside: LineValues,
    /// The reason for the end of the last movement, and the prints on its way.
    pub stopped: String,
}

/// A movement of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is what its name says")]
pub enum Move {
    In,
    Over,
    Out,
    Run,
    BackIn,
    Back,
    BackOut,
    RunBack,
    /// To a statement by its number.
    To(usize),
}

impl Move {
    /// The movements back and forth by buttons, with their keys.
    pub const BACK: [(Move, &'static str, &'static str); 4] = [
        (Move::RunBack, "<< run", "to a breakpoint (shift F5)"),
        (Move::BackOut, "< out", "to the call of this function"),
        (Move::Back, "< over", "over calls (shift F10)"),
        (Move::BackIn, "< in", "into calls (shift F11)"),
    ];
    /// Those forwards.
    pub const FORTH: [(Move, &'static str, &'static str); 4] = [
        (Move::In, "in >", "into calls (F11)"),
        (Move::Over, "over >", "over calls (F10)"),
        (Move::Out, "out >", "out of this function"),
        (Move::Run, "run >>", "to a breakpoint, or a value that is not finite (F5)"),
    ];

    /// Returns the movement of a key.
    pub fn of_key(key: egui::Key, is_shifted: bool) -> Option<Move> {
        Some(match (key, is_shifted) {
            (egui::Key::F5, false) => Move::Run,
            (egui::Key::F5, true) => Move::RunBack,
            (egui::Key::F10, false) => Move::Over,
            (egui::Key::F10, true) => Move::Back,
            (egui::Key::F11, false) => Move::In,
            (egui::Key::F11, true) => Move::BackIn,
            _ => return None,
        })
    }
}

impl Debugging {
    /// Begins at the first statement.
    pub fn new(mut replay: Replay) -> Debugging {
        replay.set_pauses(Pauses { not_finite: true, print: false });
        let scopes = Scopes::default();
        let mut debugging = Debugging {
            replay,
            frames: Vec::new(),
            selected: 0,
            scopes,
            beside: LineValues::new(),
            stopped: String::new(),
        };
        debugging.refresh();
        debugging
    }

    /// Returns the number of the statement, and the number of all.
    pub fn position(&self) -> (usize, usize) {
        (self.replay.position(), self.replay.len())
    }

    /// Returns the number of entries that are not in the recording because of its limit.
    pub fn dropped(&self) -> u64 {
        self.replay.dropped()
    }

    /// Returns the remark of the renderer before the position, such as the nearest hit of a ray.
    pub fn note(&self) -> Option<&str> {
        self.replay.notes().last()
    }

    /// Moves.
    pub fn go(&mut self, movement: Move) {
        let replay = &mut self.replay;
        let stopped = match movement {
            Move::In => replay.step_in(Line),
            Move::Over => replay.step_over(Line),
            Move::Out => replay.step_out(),
            Move::Run => replay.run(),
            Move::BackIn => replay.step_back_in(Line),
            Move::Back => replay.step_back(Line),
            Move::BackOut => replay.step_back_out(),
            Move::RunBack => replay.run_back(),
            Move::To(position) => replay.jump(position),
        };
        self.stopped = told(&stopped);
        self.refresh();
    }

    /// Evaluates an expression of the variables of the selected call.
    ///
    /// # Errors
    /// If the compiler refuses it.
    pub fn evaluate(&mut self, text: &str) -> Result<TracedValue, String> {
        let frame = self.frames.get(self.selected).ok_or("there is no call")?.clone();
        self.replay.evaluate(text, &frame)
    }

    /// Runs to the first breakpoint; stays at the first statement if none is reached.
    pub fn run_to_first(&mut self) {
        if self.replay.breakpoints().any(|breakpoint| breakpoint.is_reached) {
            let pauses = self.replay.pauses();
            // A value that is not finite is no place that someone has asked for.
            self.replay.set_pauses(Pauses::default());
            self.stopped = told(&self.replay.run_from_start());
            self.replay.set_pauses(pauses);
            self.refresh();
        }
    }

    /// Returns the statement and the call that are shown.
    pub fn shown(&self) -> (usize, usize) {
        (self.replay.position(), self.selected)
    }

    /// Shows the variables of another call.
    pub fn select(&mut self, index: usize) {
        self.selected = index.min(self.frames.len().saturating_sub(1));
        self.look();
    }

    /// Sets these breakpoints instead of the earlier ones: names of texts, and lines.
    pub fn set_breakpoints<'b>(&mut self, all: impl Iterator<Item = (&'b str, u32)>) {
        self.replay.retain_breakpoints(|_| false);
        for (name, line) in all {
            let texts = self.replay.texts().map(|text| text.source.name.clone());
            let known: Vec<String> = texts.filter(|text| is_same_text(text, name)).collect();
            for source in known {
                // A line after the last statement has none, and no run reaches it.
                let _ = self.replay.add_breakpoint(&source, line, None);
            }
        }
    }

    /// Returns the text, the line, and the whole text of the selected call.
    pub fn place(&self) -> Option<(&str, u32, &str)> {
        let frame = self.frames.get(self.selected)?;
        let (source, line) = (frame.source()?, frame.line()?);
        let text = self.replay.source(source).map_or("", |source| source.text.as_str());
        Some((source, line, text))
    }

    fn refresh(&mut self) {
        self.frames = self.replay.frames();
        self.selected = 0;
        self.look();
    }

    fn look(&mut self) {
        if let Some(frame) = self.frames.get(self.selected) {
            self.scopes = self.replay.scopes(frame);
            self.beside = self.replay.beside_lines(frame);
        }
    }
}

/// Returns the end of a movement in words.
fn told(stopped: &Stopped) -> String {
    let mut lines = stopped.prints.clone();
    lines.extend(match &stopped.reason {
        Reason::Step => None,
        Reason::Breakpoint(_, None) => Some("at a breakpoint".to_owned()),
        Reason::Breakpoint(_, Some(error)) => Some(format!("at a breakpoint: {error}")),
        Reason::NotFinite(found) => Some(found.to_string()),
        Reason::Print(text) => Some(format!("prints \"{text}\"")),
        Reason::Start => Some("at the start of the recording".to_owned()),
        Reason::End => Some("at the end of the recording".to_owned()),
    });
    lines.join("\n")
}

/// A list of variables with its title.
pub type ScopeList<'s> = (&'static str, Vec<(String, &'s TracedValue)>);

/// Returns the lists of variables of a call that are not empty.
pub fn lists(scopes: &Scopes) -> Vec<ScopeList<'_>> {
    let result = scopes.result.iter().map(|value| ("result".to_owned(), value));
    let results = scopes.results.iter().map(|(function, value)| {
        let name = match value.name() {
            "" => format!("{function}()"),
            name => format!("{function}(): {name}"),
        };
        (name, value)
    });
    let mut all = vec![
        ("Locals", named(&scopes.locals)),
        ("Results", result.chain(results).collect()),
        ("Members", named(&scopes.members)),
        ("State set", named(&scopes.state_set)),
        ("State read", named(&scopes.state_read)),
    ];
    all.retain(|(_, values)| !values.is_empty());
    all
}

fn named(values: &[TracedValue]) -> Vec<(String, &TracedValue)> {
    values.iter().map(|value| (value.name().to_owned(), value)).collect()
}

/// Returns the type of a value.
pub fn type_of(value: &TracedValue) -> String {
    type_name(value.ty())
}
