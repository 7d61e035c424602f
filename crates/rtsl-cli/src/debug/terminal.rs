//! The debugger in a terminal.

use std::io::{self, Write};

use rtsl_debug::Granularity::{Line, Statement};
use rtsl_debug::{Frame, LineValues, Location, Reason, Replay, Scopes, Stopped};

use super::script::Commands;
use super::sources::{line_of, name_at};
use super::target::Recorded;

/// The number of lines that `list` shows before and after the current one.
const LISTED: u32 = 5;
/// The column of values beside lines that are not longer.
const VALUES_COLUMN: usize = 52;

const HELP: &str = "\
Forwards                                  Backwards
  s, step [N]      next line, into calls    rs, back-in [N]       line before, into calls
  n, next [N]      next line, over calls    rn, back [N]          line before, over calls
  f, finish        end of the function      rf, back-out          call of the function
  si, statement    next statement           rsi, statement-back   statement before
  c, continue      next breakpoint          rc, reverse-continue  breakpoint before
  end              last statement           start                 first statement

  goto N           statement N              origin NAME           statement that has set NAME

  b, break FILE:LINE [if CONDITION]   stop at a line; FILE may be left out
  b, break NAME [if CONDITION]        stop at the start of Class.method or of a function
  catch nan|print                     stop where a value that is not finite is made, or where a shader prints
  uncatch nan|print                   do not
  breakpoints, delete [ID]            show them; remove one, or all

  p, print EXPRESSION     value of an expression of the variables
  locals                  values of all variables
  w, where                calls around the statement
  up, down                select the caller; back
  l, list [LINE]          lines with the values that they have set
  notes                   remarks of the renderer, such as the nearest hits
  files                   texts that take part
  h, help; q, quit
";

/// A session.
pub struct Terminal<W> {
    replay: Replay,
    /// The index of the selected call, from the innermost.
    selected: usize,
    output: W,
    had_error: bool,
}

/// The end of a command.
enum Done {
    /// The session goes on.
    GoOn,
    /// The session ends.
    Quit,
}

impl<W: Write> Terminal<W> {
    /// Creates a session at the first statement.
    pub fn new(recorded: Recorded, output: W) -> Terminal<W> {
        Terminal { replay: recorded.replay, selected: 0, output, had_error: false }
    }

    /// Executes commands up to their end. Returns true if none was wrong.
    ///
    /// # Errors
    /// Those of reading and writing.
    pub fn run(&mut self, mut commands: Commands) -> io::Result<bool> {
        self.show_position()?;
        let mut last = String::new();
        while let Some(command) = commands.next(&mut self.output)? {
            // An empty line repeats the last command, as in gdb.
            let command = if command.is_empty() && commands.is_interactive() {
                last.clone()
            } else {
                command
            };
            if command.is_empty() || command.starts_with('#') {
                continue;
            }
            match self.execute(&command) {
                Ok(Ok(Done::GoOn)) => {}
                Ok(Ok(Done::Quit)) => break,
                Ok(Err(message)) => {
                    self.had_error = true;
                    writeln!(self.output, "error: {message}")?;
                }
                Err(error) => return Err(error),
            }
            last = command;
        }
        Ok(!self.had_error)
    }

    fn execute(&mut self, command: &str) -> io::Result<Result<Done, String>> {
        let (word, rest) = command.split_once(char::is_whitespace).unwrap_or((command, ""));
        let rest = rest.trim();
        let moved = match word {
            "s" | "step" => self.repeat(rest, |it| it.step_in(Line)),
            "n" | "next" => self.repeat(rest, |it| it.step_over(Line)),
            "f" | "fin" | "finish" => self.repeat(rest, Replay::step_out),
            "si" | "statement" => self.repeat(rest, |it| it.step_in(Statement)),
            "c" | "continue" => self.repeat(rest, Replay::run),
            "rs" | "back-in" | "reverse-step" => self.repeat(rest, |it| it.step_back_in(Line)),
            "rn" | "back" | "reverse-next" => self.repeat(rest, |it| it.step_back(Line)),
            "rf" | "back-out" | "reverse-finish" => self.repeat(rest, Replay::step_back_out),
            "rsi" | "statement-back" => self.repeat(rest, |it| it.step_back_in(Statement)),
            "rc" | "reverse-continue" => self.repeat(rest, Replay::run_back),
            "start" => Ok(self.replay.jump(0)),
            "end" => Ok(self.replay.jump(usize::MAX)),
            "goto" => number(rest).map(|position| self.replay.jump(position)),
            "origin" => self.origin(rest),
            _ => return self.inspect(word, rest),
        };
        Ok(match moved {
            Ok(stopped) => {
                self.selected = 0;
                self.show_stop(&stopped)?;
                Ok(Done::GoOn)
            }
            Err(message) => Err(message),
        })
    }

    fn inspect(&mut self, word: &str, rest: &str) -> io::Result<Result<Done, String>> {
        let shown = match word {
            "b" | "break" => self.set_breakpoint(rest),
            "catch" | "uncatch" => self.set_pause(rest, word == "catch"),
            "breakpoints" => Ok(self.breakpoints()),
            "delete" => self.delete(rest),
            "p" | "print" => self.print(rest),
            "locals" => Ok(self.locals()),
            "w" | "where" | "bt" => Ok(self.calls()),
            "up" => self.select(self.selected.checked_add(1)),
            "down" => self.select(self.selected.checked_sub(1)),
            "l" | "list" => self.list(rest),
            "notes" => Ok(self.replay.notes().map(|note| format!("{note}\n")).collect()),
            "files" => Ok(self.files()),
            "h" | "help" => Ok(HELP.to_owned()),
            "q" | "quit" => return Ok(Ok(Done::Quit)),
            _ => Err(format!("there is no command `{word}`; `help` lists them")),
        };
        Ok(match shown {
            Ok(text) => {
                write!(self.output, "{text}")?;
                Ok(Done::GoOn)
            }
            Err(message) => Err(message),
        })
    }

    // Movements.

    fn repeat(
        &mut self,
        count: &str,
        movement: impl Fn(&mut Replay) -> Stopped,
    ) -> Result<Stopped, String> {
        let count = if count.is_empty() { 1 } else { number(count)?.max(1) };
        let mut stopped = movement(&mut self.replay);
        for _ in 1..count {
            if stopped.reason != Reason::Step {
                break;
            }
            let Stopped { reason, prints } = movement(&mut self.replay);
            stopped.prints.extend(prints);
            stopped.reason = reason;
        }
        Ok(stopped)
    }

    fn origin(&mut self, name: &str) -> Result<Stopped, String> {
        if name.is_empty() {
            return Err("`origin NAME` needs a variable".to_owned());
        }
        let frame = self.frame();
        self.replay.jump_to_origin(name, &frame)
    }

    fn show_stop(&mut self, stopped: &Stopped) -> io::Result<()> {
        for print in &stopped.prints {
            writeln!(self.output, "{print}")?;
        }
        match &stopped.reason {
            Reason::Step => {}
            Reason::Start => writeln!(self.output, "the start of the recording")?,
            Reason::End => {
                let cut = match self.replay.dropped() {
                    0 => String::new(),
                    dropped => format!(", which lacks {dropped} further entries"),
                };
                writeln!(self.output, "the end of the recording{cut}")?;
            }
            Reason::Breakpoint(id, None) => writeln!(self.output, "breakpoint {}", id.0)?,
            Reason::Breakpoint(id, Some(error)) => {
                writeln!(self.output, "breakpoint {}, whose condition fails: {error}", id.0)?;
            }
            Reason::NotFinite(found) => {
                writeln!(self.output, "{found}")?;
            }
            Reason::Print(_) => writeln!(self.output, "this statement prints")?,
        }
        self.show_position()
    }

    /// Shows the line that has run before in the same call, and the current one.
    fn show_position(&mut self) -> io::Result<()> {
        let frame = self.frame();
        let position = self.replay.position();
        writeln!(self.output, "{}, statement {position} of {}", called(&frame), self.replay.len())?;
        let text = match (frame.source(), frame.line()) {
            (Some(source), Some(line)) => {
                let beside = self.replay.beside_lines(&frame);
                let before = self.replay.previous_line().filter(|before| *before != line);
                let lines = before.into_iter().chain([line]);
                lines.map(|at| self.line(source, at, line, &beside)).collect()
            }
            _ => String::new(),
        };
        write!(self.output, "{text}")
    }

    /// Formats a line with the values that it has set, or of the variables that the current one names.
    fn line(&self, source: &str, line: u32, current: u32, beside: &LineValues) -> String {
        let text = line_of(&self.replay, source, line);
        let beside = beside.get(&line).map_or("", String::as_str);
        let mark = if line == current { "->" } else { "  " };
        let line = format!("{mark} {line:4}  {text:VALUES_COLUMN$}  {beside}");
        line.trim_end().to_owned() + "\n"
    }

    // Breakpoints.

    fn set_breakpoint(&mut self, text: &str) -> Result<String, String> {
        let (place, condition) = match text.split_once(" if ") {
            Some((place, condition)) => (place.trim(), Some(condition.trim().to_owned())),
            None => (text, None),
        };
        let line = |text: &str| text.trim().parse::<u32>().ok();
        let (file, line) = match place.rsplit_once(':') {
            Some((file, at)) => (Some(file), line(at)),
            None => (None, line(place)),
        };
        let breakpoint = match (file, line) {
            (None, None) if place.is_empty() => {
                return Err("`break` needs FILE:LINE, or the name of a function".to_owned());
            }
            (None, None) => self.replay.add_function_breakpoint(place, condition),
            (Some(_), None) => return Err(format!("`{place}` has no number of a line")),
            (file, Some(line)) => {
                let current = || self.frame().source().map(str::to_owned);
                let name = match file {
                    Some(file) => name_at(&self.replay, file),
                    None => current(),
                };
                let missing = || {
                    let file = file.unwrap_or_default();
                    format!("no text `{file}` takes part; `files` lists those that do")
                };
                self.replay.add_breakpoint(&name.ok_or_else(missing)?, line, condition)?
            }
        };
        let note = match breakpoint.is_reached {
            true => "",
            false => ", which the recording does not reach",
        };
        Ok(format!("breakpoint {} at {}{note}\n", breakpoint.id.0, shown(&breakpoint.location)))
    }

    fn set_pause(&mut self, name: &str, is_on: bool) -> Result<String, String> {
        let mut pauses = self.replay.pauses();
        match name {
            "nan" => pauses.not_finite = is_on,
            "print" => pauses.print = is_on,
            _ => return Err("expected `nan` or `print`".to_owned()),
        }
        self.replay.set_pauses(pauses);
        Ok(String::new())
    }

    fn breakpoints(&self) -> String {
        let all = self.replay.breakpoints().map(|it| {
            let condition = it.condition.as_ref().map_or(String::new(), |it| format!(" if {it}"));
            format!("{}  {}{condition}\n", it.id.0, shown(&it.location))
        });
        all.collect()
    }

    fn delete(&mut self, id: &str) -> Result<String, String> {
        if id.is_empty() {
            self.replay.retain_breakpoints(|_| false);
            return Ok(String::new());
        }
        let (id, before) = (number(id)?, self.replay.breakpoints().count());
        self.replay.retain_breakpoints(|it| it.id.0 as usize != id);
        match self.replay.breakpoints().count() < before {
            true => Ok(String::new()),
            false => Err(format!("there is no breakpoint {id}")),
        }
    }

    // Values.

    fn print(&mut self, text: &str) -> Result<String, String> {
        let frame = self.frame();
        let value = self.replay.evaluate(text, &frame)?;
        Ok(format!("{text} = {value}\n"))
    }

    fn locals(&self) -> String {
        let scopes = self.replay.scopes(&self.frame());
        let Scopes { locals, members, state_read, state_set, result, results } = scopes;
        let mut text = String::new();
        let mut list = |title: &str, values: Vec<(String, String)>| {
            if !values.is_empty() {
                text += &format!("{title}\n");
            }
            for (name, value) in values {
                text += &format!("  {name} = {value}\n");
            }
        };
        let named = |values: Vec<rtsl::TracedValue>| {
            values.iter().map(|value| (value.name().to_owned(), value.to_string())).collect()
        };
        list("locals", named(locals));
        list("members", named(members));
        list("state read", named(state_read));
        list("state set", named(state_set));
        let results = results.into_iter().map(|(function, value)| {
            let name = match value.name() {
                "" => function,
                name => format!("{function}: {name}"),
            };
            (name, value.to_string())
        });
        let result = result.map(|value| ("result".to_owned(), value.to_string()));
        list("returned", result.into_iter().collect());
        list("results of calls", results.collect());
        text
    }

    fn calls(&self) -> String {
        let frames = self.replay.frames();
        let frames = frames.iter().enumerate().map(|(index, frame)| {
            let mark = if index == self.selected { "->" } else { "  " };
            format!("{mark} {index}  {}\n", called(frame))
        });
        frames.collect()
    }

    fn select(&mut self, index: Option<usize>) -> Result<String, String> {
        let index = index.filter(|index| *index < self.replay.frames().len());
        self.selected = index.ok_or("there is no further call")?;
        let frame = self.frame();
        let line = match (frame.source(), frame.line()) {
            (Some(source), Some(line)) => {
                self.line(source, line, line, &self.replay.beside_lines(&frame))
            }
            _ => String::new(),
        };
        Ok(format!("{}\n{line}", called(&frame)))
    }

    fn list(&self, line: &str) -> Result<String, String> {
        let frame = self.frame();
        let (Some(source), Some(current)) = (frame.source(), frame.line()) else {
            return Err("this function has no text".to_owned());
        };
        let middle = if line.is_empty() { current } else { number(line)? as u32 };
        let count = self.replay.source(source).map_or(0, |source| source.text.lines().count());
        let last = middle.saturating_add(LISTED).min(count as u32);
        let beside = self.replay.beside_lines(&frame);
        let lines = middle.saturating_sub(LISTED).max(1)..=last;
        Ok(lines.map(|line| self.line(source, line, current, &beside)).collect())
    }

    fn files(&self) -> String {
        let texts = self.replay.texts();
        texts.map(|text| format!("{}\n", text.source.name)).collect()
    }

    fn frame(&self) -> Frame {
        let mut frames = self.replay.frames();
        let selected = self.selected.min(frames.len() - 1);
        frames.swap_remove(selected)
    }
}

/// Formats a call with its place.
fn called(frame: &Frame) -> String {
    let mut text = frame.name.to_string();
    if let Some(reference) = &frame.reference {
        text += &format!(" of `{reference}`");
    }
    if let (Some(source), Some(line)) = (frame.source(), frame.line()) {
        text += &format!(" at {source}:{line}");
    }
    text
}

fn shown(location: &Location) -> String {
    match location {
        Location::Line { source, line } => format!("{source}:{line}"),
        Location::Function(name) => name.clone(),
    }
}

fn number(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("`{text}` is no number"))
}
