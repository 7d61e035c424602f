//! Messages of the Debug Adapter Protocol: their framing, and the parts of them that the adapter reads.
//!
//! The specification is at <https://microsoft.github.io/debug-adapter-protocol/specification>.

use std::io::{self, BufRead, Write};

use serde::Deserialize;
use serde_json::{Value as Json, json};

/// The greatest length of a message, in bytes.
const MAX_MESSAGE: usize = 1 << 24;
/// The greatest length of a line of a message's head, in bytes.
const MAX_HEAD: u64 = 1 << 12;

/// A request.
#[derive(Clone, Debug, Deserialize)]
pub struct Request {
    /// Its number, which the response repeats.
    pub seq: i64,
    /// Its name.
    pub command: String,
    /// Its arguments.
    #[serde(default)]
    pub arguments: Json,
}

/// The arguments of `initialize`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct InitializeArguments {
    /// True if lines count from 1.
    pub lines_start_at1: bool,
    /// True if columns count from 1.
    pub columns_start_at1: bool,
    /// True if the client shows progress.
    pub supports_progress_reporting: bool,
}

impl Default for InitializeArguments {
    fn default() -> Self {
        InitializeArguments {
            lines_start_at1: true,
            columns_start_at1: true,
            supports_progress_reporting: false,
        }
    }
}

/// A text.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct Source {
    /// Its name.
    pub name: Option<String>,
    /// Its file.
    pub path: Option<String>,
    /// The number by which the client asks for it, if it is in no file.
    pub source_reference: Option<i64>,
}

/// The arguments of `setBreakpoints`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct SetBreakpointsArguments {
    /// The text.
    pub source: Source,
    /// All its breakpoints.
    pub breakpoints: Vec<SourceBreakpoint>,
}

/// A breakpoint at a line.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct SourceBreakpoint {
    /// The line.
    pub line: i64,
    /// The condition.
    pub condition: Option<String>,
}

/// The arguments of `setFunctionBreakpoints`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct SetFunctionBreakpointsArguments {
    /// All breakpoints at functions.
    pub breakpoints: Vec<FunctionBreakpoint>,
}

/// A breakpoint at a function.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct FunctionBreakpoint {
    /// `Class.method`, or the name of another function.
    pub name: String,
    /// The condition.
    pub condition: Option<String>,
}

/// The arguments of `setExceptionBreakpoints`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct SetExceptionBreakpointsArguments {
    /// The names of the filters.
    pub filters: Vec<String>,
}

/// The arguments of requests for calls, variables and values.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct InspectArguments {
    /// The call.
    pub frame_id: Option<i64>,
    /// The variables.
    pub variables_reference: i64,
    /// The first of several.
    pub start_frame: usize,
    /// The number of them; all if it is 0.
    pub levels: usize,
    /// The expression.
    pub expression: String,
    /// The occasion: `hover`, `watch`, `repl` and others.
    pub context: Option<String>,
    /// The text.
    pub source: Source,
    /// The number of the text.
    pub source_reference: Option<i64>,
    /// The first line.
    pub line: i64,
    /// The last line.
    pub end_line: Option<i64>,
}

/// The arguments of movements.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct StepArguments {
    /// `statement`, `line` or `instruction`.
    pub granularity: Option<String>,
}

/// Reads a message; none at the end of the input.
///
/// # Errors
/// If the input is no message, or can't be read.
pub fn read_message(input: &mut impl BufRead) -> io::Result<Option<String>> {
    let invalid = |message: &str| io::Error::new(io::ErrorKind::InvalidData, message.to_owned());
    let mut length: Option<usize> = None;
    loop {
        let mut line = String::new();
        if io::Read::take(&mut *input, MAX_HEAD).read_line(&mut line)? == 0 {
            return Ok(None);
        }
        let line = line.trim();
        if line.is_empty() {
            break;
        }
        let Some((name, value)) = line.split_once(':') else {
            return Err(invalid("a message begins with `Content-Length: N`"));
        };
        if name.eq_ignore_ascii_case("Content-Length") {
            length = value.trim().parse().ok();
        }
    }
    let length = length.ok_or_else(|| invalid("a message has no `Content-Length`"))?;
    if length > MAX_MESSAGE {
        return Err(invalid(&format!("a message has more than {MAX_MESSAGE} bytes")));
    }
    let mut message = vec![0; length];
    input.read_exact(&mut message)?;
    String::from_utf8(message).map(Some).map_err(|_| invalid("a message is not UTF-8"))
}

/// Writes responses and events.
pub struct Outbox<W> {
    output: W,
    seq: i64,
}

impl<W: Write> Outbox<W> {
    /// Creates an outbox that has sent nothing.
    pub fn new(output: W) -> Outbox<W> {
        Outbox { output, seq: 0 }
    }

    /// Answers a request.
    ///
    /// # Errors
    /// Those of writing.
    pub fn respond(&mut self, request: &Request, answer: Result<Json, String>) -> io::Result<()> {
        let mut message = json!({
            "type": "response",
            "request_seq": request.seq,
            "command": request.command,
            "success": answer.is_ok(),
        });
        match answer {
            Ok(Json::Null) => {}
            Ok(body) => message["body"] = body,
            Err(error) => {
                message["message"] = json!(error);
                message["body"] = json!({
                    "error": { "id": 1, "format": escaped(&error), "showUser": true }
                });
            }
        }
        self.send(message)
    }

    /// Sends an event.
    ///
    /// # Errors
    /// Those of writing.
    pub fn event(&mut self, event: &str, body: Json) -> io::Result<()> {
        self.send(json!({ "type": "event", "event": event, "body": body }))
    }

    /// Sends text for the client's console: `console`, `stdout`, `stderr` or `important`.
    ///
    /// # Errors
    /// Those of writing.
    pub fn output(&mut self, category: &str, text: &str) -> io::Result<()> {
        if text.is_empty() {
            return Ok(());
        }
        self.event("output", json!({ "category": category, "output": text }))
    }

    fn send(&mut self, mut message: Json) -> io::Result<()> {
        self.seq += 1;
        message["seq"] = json!(self.seq);
        let text = message.to_string();
        write!(self.output, "Content-Length: {}\r\n\r\n{text}", text.len())?;
        self.output.flush()
    }
}

/// Braces in the format of an error stand for variables.
fn escaped(text: &str) -> String {
    text.replace(['{', '}'], "")
}
