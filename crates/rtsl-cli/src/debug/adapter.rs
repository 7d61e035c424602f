//! The debugger behind the Debug Adapter Protocol.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};

use rtsl_debug::{
    Breakpoint, BreakpointId, Granularity, Location, Pauses, Reason, Replay, Stopped,
};
use serde::de::DeserializeOwned;
use serde_json::{Value as Json, json};

use super::gate::{Gate, REFUSED};
use super::launch::LaunchArguments;
use super::protocol::{
    FunctionBreakpoint, InitializeArguments, InspectArguments, Outbox, Request,
    SetBreakpointsArguments, SetExceptionBreakpointsArguments, SetFunctionBreakpointsArguments,
    Source, SourceBreakpoint, StepArguments, read_message,
};
use super::session::Session;
use super::sources::name_at;
use super::target::{Recorded, record};

/// The only thread.
const THREAD: i64 = 1;

/// Serves a client until it disconnects, its input ends, or the gate does not let it in.
///
/// # Errors
/// Those of reading and writing, and if the input is no message of the protocol.
pub fn serve(mut input: impl BufRead, output: impl Write, gate: &mut Gate) -> io::Result<()> {
    let mut adapter = Adapter::new(output);
    while let Some(message) = read_message(&mut input)? {
        match serde_json::from_str::<Request>(&message) {
            Ok(request) if gate.admits(&request) => adapter.handle(&request)?,
            Ok(request) => return adapter.outbox.respond(&request, Err(REFUSED.to_owned())),
            // Responses to requests that the adapter does not make, or nothing of the protocol.
            Err(error) => adapter.outbox.output("console", &format!("no request: {error}\n"))?,
        }
        if adapter.is_over {
            break;
        }
    }
    Ok(())
}

/// A connection with a client.
struct Adapter<W> {
    outbox: Outbox<W>,
    client: InitializeArguments,
    launched: Option<LaunchArguments>,
    session: Option<Session>,
    pauses: Pauses,
    /// The breakpoints that the client has set, by the texts, so that a restarted session has them.
    wanted: BTreeMap<String, Vec<SourceBreakpoint>>,
    wanted_functions: Vec<FunctionBreakpoint>,
    is_over: bool,
}

impl<W: Write> Adapter<W> {
    fn new(output: W) -> Adapter<W> {
        Adapter {
            outbox: Outbox::new(output),
            client: InitializeArguments::default(),
            launched: None,
            session: None,
            pauses: Pauses::default(),
            wanted: BTreeMap::new(),
            wanted_functions: Vec::new(),
            is_over: false,
        }
    }

    fn handle(&mut self, request: &Request) -> io::Result<()> {
        match request.command.as_str() {
            "launch" => return self.launch(request),
            "restart" => return self.restart(request),
            "configurationDone" => return self.begin(request),
            "disconnect" | "terminate" => {
                self.outbox.respond(request, Ok(Json::Null))?;
                if request.command == "terminate" {
                    return self.outbox.event("terminated", json!({}));
                }
                self.is_over = true;
                return Ok(());
            }
            _ => {}
        }
        match self.movement(request) {
            None => {}
            Some(Ok(stopped)) => {
                self.outbox.respond(request, Ok(answer_of_movement(&request.command)))?;
                return self.tell_stop(stopped);
            }
            Some(Err(error)) => return self.outbox.respond(request, Err(error)),
        }
        let answer = self.answer(request);
        self.outbox.respond(request, answer)
    }

    // The start of sessions.

    fn launch(&mut self, request: &Request) -> io::Result<()> {
        let launched = LaunchArguments::read(&request.arguments);
        let launched = match launched {
            Ok(launched) => launched,
            Err(error) => return self.outbox.respond(request, Err(error)),
        };
        self.pauses = pauses_of(&launched.exceptions);
        self.launched = Some(launched);
        match self.record()? {
            Ok(()) => {
                self.outbox.respond(request, Ok(Json::Null))?;
                self.outbox.event("initialized", Json::Null)
            }
            Err(error) => {
                self.outbox.output("stderr", &format!("{}\n", error.trim_end()))?;
                self.outbox.respond(request, Err(error.trim_end().to_owned()))?;
                self.outbox.event("terminated", json!({}))
            }
        }
    }

    /// Records again, for example after the client has changed a text.
    fn restart(&mut self, request: &Request) -> io::Result<()> {
        if let Some(arguments) = request.arguments.get("arguments") {
            match LaunchArguments::read(arguments) {
                Ok(launched) => self.launched = Some(launched),
                Err(error) => return self.outbox.respond(request, Err(error)),
            }
        }
        match self.record()? {
            Ok(()) => {}
            Err(error) => return self.outbox.respond(request, Err(error.trim_end().to_owned())),
        }
        for (name, breakpoints) in self.wanted.clone() {
            for breakpoint in self.set_breakpoints(&name, &breakpoints) {
                self.outbox.event(
                    "breakpoint",
                    json!({ "reason": "changed", "breakpoint": breakpoint }),
                )?;
            }
        }
        let functions = self.wanted_functions.clone();
        self.set_function_breakpoints(&functions);
        self.begin(request)
    }

    fn record(&mut self) -> io::Result<Result<(), String>> {
        let Some(launched) = &self.launched else {
            return Ok(Err("nothing is launched".to_owned()));
        };
        let (target, limits) = match (launched.target(), launched.limits()) {
            (Ok(target), Ok(limits)) => (target, limits),
            (Err(error), _) | (_, Err(error)) => return Ok(Err(error)),
        };
        let shows_progress = self.client.supports_progress_reporting;
        if shows_progress {
            let body = json!({ "progressId": "recording", "title": "Recording" });
            self.outbox.event("progressStart", body)?;
        }
        let recorded = record(&target.0, limits, &target.1);
        if shows_progress {
            self.outbox.event("progressEnd", json!({ "progressId": "recording" }))?;
        }
        let Recorded { mut replay, title, result, warnings } = match recorded {
            Ok(recorded) => recorded,
            Err(error) => return Ok(Err(error)),
        };
        self.outbox.output("console", &warnings)?;
        replay.set_pauses(self.pauses);
        self.session = Some(Session::new(replay, title, result));
        Ok(Ok(()))
    }

    /// Stops at the first statement, or runs to the first occasion.
    fn begin(&mut self, request: &Request) -> io::Result<()> {
        self.outbox.respond(request, Ok(Json::Null))?;
        let stops_on_entry = self.launched.as_ref().is_some_and(|it| it.stop_on_entry);
        let Some(session) = &mut self.session else { return Ok(()) };
        if stops_on_entry || request.command == "restart" {
            return self.tell("entry", None, &[]);
        }
        // The first statement can have a breakpoint itself.
        let stopped = session.replay.run_from_start();
        self.tell_stop(stopped)
    }

    // Movements.

    fn movement(&mut self, request: &Request) -> Option<Result<Stopped, String>> {
        let arguments: StepArguments = arguments(request).unwrap_or_default();
        // The protocol has statements where a client names nothing.
        let size = match arguments.granularity.as_deref() {
            Some("line") => Granularity::Line,
            _ => Granularity::Statement,
        };
        let movement: &dyn Fn(&mut Replay) -> Stopped = match request.command.as_str() {
            "next" => &|replay| replay.step_over(size),
            "stepIn" => &|replay| replay.step_in(size),
            "stepOut" => &Replay::step_out,
            "stepBack" => &|replay| replay.step_back(size),
            "continue" => &Replay::run,
            "reverseContinue" => &Replay::run_back,
            "restartFrame" => return Some(self.restart_frame(request)),
            // A movement is at its end at once.
            "pause" => &|replay| replay.jump(replay.position()),
            _ => return None,
        };
        Some(self.session().map(|session| movement(&mut session.replay)))
    }

    fn restart_frame(&mut self, request: &Request) -> Result<Stopped, String> {
        let arguments: InspectArguments = arguments(request)?;
        let session = self.session()?;
        let frame = session.frame(arguments.frame_id)?;
        Ok(session.replay.jump_to_start_of(&frame))
    }

    fn tell_stop(&mut self, stopped: Stopped) -> io::Result<()> {
        for print in &stopped.prints {
            self.outbox.output("stdout", &format!("{print}\n"))?;
        }
        let Some(session) = &mut self.session else { return Ok(()) };
        session.stopped = Some(stopped.clone());
        let (dropped, result) = (session.replay.dropped(), session.result.clone());
        match stopped.reason {
            Reason::Step => self.tell("step", None, &[]),
            Reason::Start => self.tell("step", Some("the start of the recording"), &[]),
            Reason::End => {
                self.outbox.output("console", &result)?;
                let text = match dropped {
                    0 => "the end of the recording".to_owned(),
                    _ => format!("the end of the recording, which lacks {dropped} further entries"),
                };
                self.tell("step", Some(&text), &[])
            }
            Reason::Breakpoint(id, error) => {
                if let Some(error) = error {
                    let text = format!("the condition of the breakpoint fails: {error}\n");
                    self.outbox.output("important", &text)?;
                }
                self.tell("breakpoint", None, &[id])
            }
            Reason::NotFinite(found) => self.tell("exception", Some(&found.to_string()), &[]),
            Reason::Print(text) => {
                self.tell("exception", Some(&format!("this statement prints: {text}")), &[])
            }
        }
    }

    fn tell(&mut self, reason: &str, text: Option<&str>, hit: &[BreakpointId]) -> io::Result<()> {
        if let Some(session) = &mut self.session {
            session.handles.clear();
        }
        let hit: Vec<u32> = hit.iter().map(|id| id.0).collect();
        let mut body = json!({
            "reason": reason,
            "threadId": THREAD,
            "allThreadsStopped": true,
            "hitBreakpointIds": hit,
        });
        if let Some(text) = text {
            body["description"] = json!(text);
            body["text"] = json!(text);
        }
        self.outbox.event("stopped", body)
    }

    // Answers.

    fn answer(&mut self, request: &Request) -> Result<Json, String> {
        match request.command.as_str() {
            "initialize" => {
                self.client = arguments(request)?;
                Ok(capabilities())
            }
            "setBreakpoints" => {
                let arguments: SetBreakpointsArguments = arguments(request)?;
                let SetBreakpointsArguments { source, breakpoints } = arguments;
                let name = self.named(&source);
                let set = self.set_breakpoints(&name, &breakpoints);
                self.wanted.insert(name, breakpoints);
                Ok(json!({ "breakpoints": set }))
            }
            "setFunctionBreakpoints" => {
                let arguments: SetFunctionBreakpointsArguments = arguments(request)?;
                let set = self.set_function_breakpoints(&arguments.breakpoints);
                self.wanted_functions = arguments.breakpoints;
                Ok(json!({ "breakpoints": set }))
            }
            "setExceptionBreakpoints" => {
                let arguments: SetExceptionBreakpointsArguments = arguments(request)?;
                self.pauses = pauses_of(&arguments.filters);
                if let Some(session) = &mut self.session {
                    session.replay.set_pauses(self.pauses);
                }
                Ok(Json::Null)
            }
            "threads" => {
                let title = self.session.as_ref().map_or("nothing", |it| it.title.as_str());
                Ok(json!({ "threads": [{ "id": THREAD, "name": title }] }))
            }
            "stackTrace" => self.stack_trace(&arguments(request)?),
            "scopes" => {
                let session = self.session()?;
                let arguments: InspectArguments = arguments(request)?;
                let frame = session.frame(arguments.frame_id)?;
                let scopes = session.replay.scopes(&frame);
                let facts = [("recording".to_owned(), session.title.clone())];
                Ok(session.handles.scopes(&session.replay, scopes, &facts))
            }
            "variables" => {
                let arguments: InspectArguments = arguments(request)?;
                self.session()?.handles.variables(arguments.variables_reference)
            }
            "evaluate" => {
                let session = self.session()?;
                let arguments: InspectArguments = arguments(request)?;
                let frame = session.frame(arguments.frame_id)?;
                let value = session.replay.evaluate(&arguments.expression, &frame)?;
                Ok(session.handles.value(Some(&arguments.expression), &value, "result"))
            }
            "source" => {
                let arguments: InspectArguments = arguments(request)?;
                let reference = arguments.source.source_reference.or(arguments.source_reference);
                self.session()?.text(reference)
            }
            "loadedSources" => {
                let session = self.session()?;
                let names = session.replay.texts().map(|text| text.source.name.clone());
                let names: Vec<String> = names.collect();
                let sources: Vec<Json> = names.iter().map(|name| session.source(name)).collect();
                Ok(json!({ "sources": sources }))
            }
            "breakpointLocations" => {
                let arguments: InspectArguments = arguments(request)?;
                Ok(json!({ "breakpoints": self.locations(&arguments) }))
            }
            "exceptionInfo" => self.session()?.exception(),
            other => Err(format!("the debugger has no `{other}`")),
        }
    }

    fn stack_trace(&mut self, arguments: &InspectArguments) -> Result<Json, String> {
        let (line_base, column_base) = (self.line_base(), i64::from(self.client.columns_start_at1));
        let session = self.session()?;
        let frames = session.replay.frames();
        let total = frames.len();
        let levels = if arguments.levels == 0 { total } else { arguments.levels };
        let mut shown = Vec::new();
        for (index, frame) in frames.iter().enumerate().skip(arguments.start_frame).take(levels) {
            let name = match &frame.reference {
                Some(reference) => format!("{} of {reference}", frame.name),
                None => frame.name.to_string(),
            };
            let mut json = json!({
                "id": index + 1,
                "name": name,
                "line": 0,
                "column": 0,
                "canRestart": true,
            });
            match &frame.place {
                Some(place) => {
                    let (line, column) = position(&place.source.text, place.start);
                    let (end_line, end_column) = position(&place.source.text, place.end);
                    json["source"] = session.source(&place.source.name);
                    json["line"] = json!(line + line_base);
                    json["column"] = json!(column + column_base);
                    json["endLine"] = json!(end_line + line_base);
                    json["endColumn"] = json!(end_column + column_base);
                }
                None => json["presentationHint"] = json!("subtle"),
            }
            shown.push(json);
        }
        Ok(json!({ "stackFrames": shown, "totalFrames": total }))
    }

    // Breakpoints.

    /// Replaces the breakpoints of a text.
    fn set_breakpoints(&mut self, name: &str, breakpoints: &[SourceBreakpoint]) -> Vec<Json> {
        let base = self.line_base();
        let Some(session) = &mut self.session else { return Vec::new() };
        let old = session.of_text.remove(name).unwrap_or_default();
        session.replay.retain_breakpoints(|it| !old.contains(&it.id));
        let text = name_at(&session.replay, name);
        let mut ids = Vec::new();
        let mut answers = Vec::new();
        for SourceBreakpoint { line, condition } in breakpoints {
            let wanted = u32::try_from(line.saturating_sub(base).saturating_add(1)).unwrap_or(1);
            let condition = condition.clone().filter(|it| !it.trim().is_empty());
            let set = match &text {
                Some(text) => session.replay.add_breakpoint(text, wanted, condition),
                None => Err("no statement of this file takes part in the recording".to_owned()),
            };
            answers.push(match set {
                Ok(breakpoint) => {
                    ids.push(breakpoint.id);
                    answer_of_breakpoint(breakpoint, base)
                }
                Err(message) => json!({ "verified": false, "line": line, "message": message }),
            });
        }
        session.of_text.insert(name.to_owned(), ids);
        answers
    }

    fn set_function_breakpoints(&mut self, breakpoints: &[FunctionBreakpoint]) -> Vec<Json> {
        let base = self.line_base();
        let Some(session) = &mut self.session else { return Vec::new() };
        let old = std::mem::take(&mut session.of_functions);
        session.replay.retain_breakpoints(|it| !old.contains(&it.id));
        let mut answers = Vec::new();
        for FunctionBreakpoint { name, condition } in breakpoints {
            let condition = condition.clone().filter(|it| !it.trim().is_empty());
            let breakpoint = session.replay.add_function_breakpoint(name.trim(), condition);
            session.of_functions.push(breakpoint.id);
            answers.push(answer_of_breakpoint(breakpoint, base));
        }
        answers
    }

    /// The lines of a text with statements.
    fn locations(&self, arguments: &InspectArguments) -> Vec<Json> {
        let (base, name) = (self.line_base(), self.named(&arguments.source));
        let Some(session) = &self.session else { return Vec::new() };
        let text = name_at(&session.replay, &name);
        let lines = session.replay.texts().find(|it| Some(&it.source.name) == text.as_ref());
        let end = arguments.end_line.unwrap_or(arguments.line);
        let lines = lines.map_or(&[][..], |text| &text.lines);
        let lines = lines.iter().map(|line| i64::from(*line) - 1 + base);
        let lines = lines.filter(|line| (arguments.line..=end).contains(line));
        lines.map(|line| json!({ "line": line })).collect()
    }

    /// The name by which a client means a text: its file, or what is built in.
    fn named(&self, source: &Source) -> String {
        let by_number = source.source_reference.and_then(|reference| {
            self.session.as_ref()?.texts.get(usize::try_from(reference).ok()?.checked_sub(1)?)
        });
        let given = source.path.as_ref().or(source.name.as_ref());
        by_number.or(given).cloned().unwrap_or_default()
    }

    fn line_base(&self) -> i64 {
        i64::from(self.client.lines_start_at1)
    }

    fn session(&mut self) -> Result<&mut Session, String> {
        self.session.as_mut().ok_or_else(|| "nothing is launched".to_owned())
    }
}

fn capabilities() -> Json {
    json!({
        "supportsConfigurationDoneRequest": true,
        "supportsFunctionBreakpoints": true,
        "supportsConditionalBreakpoints": true,
        "supportsEvaluateForHovers": true,
        "supportsStepBack": true,
        "supportsRestartFrame": true,
        "supportsRestartRequest": true,
        "supportsSteppingGranularity": true,
        "supportsExceptionInfoRequest": true,
        "supportsLoadedSourcesRequest": true,
        "supportsBreakpointLocationsRequest": true,
        "supportsTerminateRequest": true,
        "exceptionBreakpointFilters": [
            {
                "filter": "notFinite",
                "label": "NaN and infinities",
                "description": "Statements that make a value that is not finite and that leaves its method",
                "default": false,
            },
            {
                "filter": "print",
                "label": "Prints",
                "description": "Statements that print",
                "default": false,
            },
        ],
    })
}

fn arguments<T: DeserializeOwned + Default>(request: &Request) -> Result<T, String> {
    if request.arguments.is_null() {
        return Ok(T::default());
    }
    let read = serde_json::from_value(request.arguments.clone());
    read.map_err(|error| format!("`{}`: {error}", request.command))
}

fn pauses_of(filters: &[String]) -> Pauses {
    let has = |name: &str| filters.iter().any(|filter| filter == name);
    Pauses { not_finite: has("notFinite"), print: has("print") }
}

fn answer_of_movement(command: &str) -> Json {
    match command {
        "continue" => json!({ "allThreadsContinued": true }),
        _ => Json::Null,
    }
}

fn answer_of_breakpoint(breakpoint: &Breakpoint, base: i64) -> Json {
    let mut answer = json!({ "id": breakpoint.id.0, "verified": true });
    if let Location::Line { line, .. } = &breakpoint.location {
        answer["line"] = json!(i64::from(*line) - 1 + base);
    }
    if !breakpoint.is_reached {
        answer["message"] = json!("the recording does not reach it");
        // A function that has not run may not exist.
        answer["verified"] = json!(matches!(breakpoint.location, Location::Line { .. }));
    }
    answer
}

/// The line and the column of an offset, both from 0; columns count UTF-16 units.
fn position(text: &str, offset: u32) -> (i64, i64) {
    let before = text.get(..offset as usize).unwrap_or(text);
    let line = before.matches('\n').count();
    let start = before.rfind('\n').map_or(0, |it| it + 1);
    (line as i64, before[start..].encode_utf16().count() as i64)
}
