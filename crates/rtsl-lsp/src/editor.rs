//! The editor: its abilities, and the messages to it that are no answers.

use lsp_server::{Connection, Message, Notification, Request, RequestId};
use lsp_types::notification::{Notification as _, Progress, PublishDiagnostics};
use lsp_types::request::{InlayHintRefreshRequest, Request as _, WorkDoneProgressCreate};
use lsp_types::{
    ClientCapabilities, Diagnostic, ProgressParams, ProgressParamsValue, ProgressToken,
    PublishDiagnosticsParams, Uri, WorkDoneProgress, WorkDoneProgressBegin,
    WorkDoneProgressCreateParams, WorkDoneProgressEnd,
};
use serde::Serialize;

use crate::ServerError;

/// The editor at the other end of a connection.
pub struct Editor<'c> {
    connection: &'c Connection,
    /// True if it runs commands of the server and shows hints, so it can show the costs of lines.
    pub shows_costs: bool,
    shows_progress: bool,
    refreshes_hints: bool,
    /// The number of requests to it.
    requests: u32,
}

impl<'c> Editor<'c> {
    /// The editor with these abilities.
    pub fn new(connection: &'c Connection, abilities: &ClientCapabilities) -> Editor<'c> {
        let workspace = abilities.workspace.as_ref();
        let hints = abilities.text_document.as_ref().and_then(|it| it.inlay_hint.as_ref());
        let commands = workspace.and_then(|it| it.execute_command.as_ref());
        let refresh = workspace.and_then(|it| it.inlay_hint.as_ref());
        let window = abilities.window.as_ref();
        Editor {
            connection,
            shows_costs: hints.is_some() && commands.is_some(),
            shows_progress: window.and_then(|it| it.work_done_progress) == Some(true),
            refreshes_hints: refresh.and_then(|it| it.refresh_support) == Some(true),
            requests: 0,
        }
    }

    /// Sends an answer.
    pub fn send(&self, message: impl Into<Message>) -> Result<(), ServerError> {
        self.connection.sender.send(message.into())?;
        Ok(())
    }

    /// Publishes the diagnostics of a text.
    pub fn publish(
        &self,
        uri: &Uri,
        diagnostics: Vec<Diagnostic>,
        version: Option<i32>,
    ) -> Result<(), ServerError> {
        let parameters = PublishDiagnosticsParams { uri: uri.clone(), diagnostics, version };
        self.notify(PublishDiagnostics::METHOD, parameters)
    }

    /// Begins the progress of a run, and returns its token: that of the request, or a new one; `None` if the editor
    /// shows no progress.
    pub fn begin(
        &mut self,
        asked: Option<ProgressToken>,
        title: &str,
    ) -> Result<Option<ProgressToken>, ServerError> {
        let token = match asked {
            Some(token) => token,
            None if self.shows_progress => {
                let token = ProgressToken::String(format!("rtsl-run-{}", self.requests));
                let parameters = WorkDoneProgressCreateParams { token: token.clone() };
                self.request(WorkDoneProgressCreate::METHOD, parameters)?;
                token
            }
            None => return Ok(None),
        };
        let begin = WorkDoneProgress::Begin(WorkDoneProgressBegin {
            title: title.to_owned(),
            cancellable: Some(true),
            message: None,
            percentage: None,
        });
        self.progress(token.clone(), begin)?;
        Ok(Some(token))
    }

    /// Ends the progress of a run.
    pub fn end(&self, token: Option<ProgressToken>) -> Result<(), ServerError> {
        let end = WorkDoneProgress::End(WorkDoneProgressEnd { message: None });
        token.map_or(Ok(()), |token| self.progress(token, end))
    }

    /// Asks the editor to ask for all hints again.
    pub fn refresh_hints(&mut self) -> Result<(), ServerError> {
        match self.refreshes_hints {
            true => self.request(InlayHintRefreshRequest::METHOD, ()),
            false => Ok(()),
        }
    }

    fn progress(&self, token: ProgressToken, value: WorkDoneProgress) -> Result<(), ServerError> {
        let value = ProgressParamsValue::WorkDone(value);
        self.notify(Progress::METHOD, ProgressParams { token, value })
    }

    fn notify(&self, method: &str, parameters: impl Serialize) -> Result<(), ServerError> {
        let params = serde_json::to_value(parameters)?;
        self.send(Notification { method: method.to_owned(), params })
    }

    /// Sends a request whose answer nobody waits for.
    fn request(&mut self, method: &str, parameters: impl Serialize) -> Result<(), ServerError> {
        self.requests += 1;
        let id = RequestId::from(format!("rtsl-{}", self.requests));
        let params = serde_json::to_value(parameters)?;
        self.send(Request { id, method: method.to_owned(), params })
    }
}
