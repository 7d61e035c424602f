//! A recording that a client debugs, with what the client knows of it.

use std::collections::BTreeMap;
use std::path::Path;

use rtsl_debug::{BreakpointId, Frame, Reason, Replay, Stopped};
use serde_json::{Value as Json, json};

use super::handles::Handles;
use super::sources::path_of;

/// A recording that is debugged.
pub struct Session {
    /// The position and what moves it.
    pub replay: Replay,
    /// A few words for the recorded call or pixel.
    pub title: String,
    /// Its results, as lines.
    pub result: String,
    /// The variables that the client can ask for.
    pub handles: Handles,
    /// The texts that the client knows by numbers, from 1.
    pub texts: Vec<String>,
    /// The breakpoints of each text, by the client's names.
    pub of_text: BTreeMap<String, Vec<BreakpointId>>,
    /// The breakpoints at functions.
    pub of_functions: Vec<BreakpointId>,
    /// The end of the last movement.
    pub stopped: Option<Stopped>,
}

impl Session {
    /// Creates a session whose client knows nothing.
    pub fn new(replay: Replay, title: String, result: String) -> Session {
        Session {
            replay,
            title,
            result,
            handles: Handles::default(),
            texts: Vec::new(),
            of_text: BTreeMap::new(),
            of_functions: Vec::new(),
            stopped: None,
        }
    }

    /// Returns the call with a number; the innermost if none is given.
    pub fn frame(&self, id: Option<i64>) -> Result<Frame, String> {
        let mut frames = self.replay.frames();
        let index = usize::try_from(id.unwrap_or(1)).ok().and_then(|id| id.checked_sub(1));
        match index.filter(|index| *index < frames.len()) {
            Some(index) => Ok(frames.swap_remove(index)),
            None => Err("there is no such call".to_owned()),
        }
    }

    /// Returns a text as the protocol has it: with its file, or the number by which clients get it.
    pub fn source(&mut self, name: &str) -> Json {
        let short = Path::new(name).file_name().map_or(name.into(), |it| it.to_string_lossy());
        if let Some(path) = path_of(name) {
            return json!({ "name": short, "path": path });
        }
        let known = self.texts.iter().position(|known| known == name);
        let index = known.unwrap_or_else(|| {
            self.texts.push(name.to_owned());
            self.texts.len() - 1
        });
        json!({ "name": short, "path": name, "sourceReference": index + 1, "origin": "built in" })
    }

    /// Returns the content of a text by its number.
    pub fn text(&self, reference: Option<i64>) -> Result<Json, String> {
        let index = reference.and_then(|it| usize::try_from(it).ok()?.checked_sub(1));
        let name = index.and_then(|index| self.texts.get(index));
        let source = name.and_then(|name| self.replay.source(name));
        let source = source.ok_or("there is no such text")?;
        Ok(json!({ "content": source.text, "mimeType": "text/x-rtsl" }))
    }

    /// Returns what the debugger has stopped at, if it is an exception.
    pub fn exception(&self) -> Result<Json, String> {
        match self.stopped.as_ref().map(|stopped| &stopped.reason) {
            Some(Reason::NotFinite(found)) => Ok(json!({
                "exceptionId": "notFinite",
                "description": found.to_string(),
                "breakMode": "always",
            })),
            Some(Reason::Print(text)) => Ok(json!({
                "exceptionId": "print",
                "description": text,
                "breakMode": "always",
            })),
            _ => Err("the debugger has not stopped at an exception".to_owned()),
        }
    }
}
