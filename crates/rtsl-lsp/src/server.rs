//! The loop over an editor's messages.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{
    Cancel, DidChangeTextDocument, DidChangeWatchedFiles, DidCloseTextDocument,
    DidOpenTextDocument, DidSaveTextDocument, Notification as _, WorkDoneProgressCancel,
};
use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentHighlightRequest,
    DocumentSymbolRequest, ExecuteCommand, FoldingRangeRequest, Formatting, GotoDefinition,
    HoverRequest, InlayHintRequest, PrepareRenameRequest, References, Rename, Request as _,
    SemanticTokensFullRequest, SignatureHelpRequest, WorkspaceSymbolRequest,
};
use lsp_types::{
    CancelParams, DidChangeTextDocumentParams, DidCloseTextDocumentParams,
    DidOpenTextDocumentParams, ExecuteCommandParams, InitializeParams, InitializeResult,
    NumberOrString, ServerInfo, Uri, WorkDoneProgressCancelParams,
};
use serde_json::{Value, json};

use crate::ServerOptions;
use crate::answer::{self, Answer, Ordered, Refusal};
use crate::capabilities::capabilities;
use crate::editor::Editor;
use crate::jobs::{Finished, Job, Jobs};
use crate::look::Looks;
use crate::place::{Encoding, path_of};
use crate::workspace::Workspace;

/// The reason of the end of a run that the editor has cancelled.
const CANCELLED: &str = "it was cancelled";

/// A fault of the connection.
pub type ServerError = Box<dyn std::error::Error + Send + Sync>;

/// A server with its editor.
pub struct Server<'c> {
    connection: &'c Connection,
    editor: Editor<'c>,
    workspace: Workspace,
    looks: Looks,
    jobs: Jobs,
    program: PathBuf,
}

/// Something that the server handles.
enum Event {
    Message(Message),
    Finished(Finished),
}

impl<'c> Server<'c> {
    /// Greets the editor.
    pub fn start(
        connection: &'c Connection,
        options: ServerOptions,
    ) -> Result<Server<'c>, ServerError> {
        let (id, parameters) = connection.initialize_start()?;
        let parameters: InitializeParams = serde_json::from_value(parameters)?;
        let general = parameters.capabilities.general.as_ref();
        let offered = general.and_then(|general| general.position_encodings.as_deref());
        let encoding = Encoding::chosen(offered);
        let result = InitializeResult {
            capabilities: capabilities(encoding.kind()),
            server_info: Some(ServerInfo {
                name: "rtsl".to_owned(),
                version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            }),
        };
        connection.initialize_finish(id, serde_json::to_value(result)?)?;
        let editor = Editor::new(connection, &parameters.capabilities);
        let program = options.program.clone();
        let workspace = Workspace::new(options, folders(&parameters), encoding);
        let (looks, jobs) = (Looks::default(), Jobs::new());
        Ok(Server { connection, editor, workspace, looks, jobs, program })
    }

    /// Answers messages until the editor ends the connection.
    pub fn run(mut self) -> Result<(), ServerError> {
        while let Some(event) = self.next()? {
            match event {
                Event::Message(Message::Request(request)) => {
                    if self.connection.handle_shutdown(&request)? {
                        return Ok(());
                    }
                    if request.method == ExecuteCommand::METHOD {
                        self.execute(request)?;
                    } else {
                        let response = self.answer(request);
                        self.editor.send(response)?;
                    }
                }
                Event::Message(Message::Notification(notification)) => self.note(notification)?,
                Event::Message(Message::Response(_)) => {}
                Event::Finished(finished) => self.finish(finished)?,
            }
        }
        Ok(())
    }

    /// Waits for a message or the end of a run; `None` if the editor has ended the connection. Diagnostics are
    /// published when no message waits.
    fn next(&mut self) -> Result<Option<Event>, ServerError> {
        if let Ok(message) = self.connection.receiver.try_recv() {
            return Ok(Some(Event::Message(message)));
        }
        self.publish_stale()?;
        Ok(crossbeam_channel::select! {
            recv(self.connection.receiver) -> message => message.ok().map(Event::Message),
            recv(self.jobs.finished) -> finished => finished.ok().map(Event::Finished),
        })
    }

    /// Starts a run for a command, or answers at once if it needs none.
    fn execute(&mut self, request: Request) -> Result<(), ServerError> {
        let Request { id, params, .. } = request;
        let ordered = match serde_json::from_value::<ExecuteCommandParams>(params) {
            Ok(asked) => {
                let token = asked.work_done_progress_params.work_done_token.clone();
                answer::ordered(&self.workspace, asked).map(|ordered| (ordered, token))
            }
            Err(error) => Err(Refusal::new(ErrorCode::InvalidParams, error.to_string())),
        };
        match ordered {
            Ok((Ordered::Run(order), token)) => {
                if let Some(earlier) = self.jobs.take(|job| job.kind == order.kind) {
                    self.cancel(earlier, "a later command took its place")?;
                }
                let token = self.editor.begin(token, &order.title)?;
                self.jobs.start(&self.program, id, order, token);
                Ok(())
            }
            Ok((Ordered::Clear, _)) => {
                self.change_looks(|looks, _| looks.clear())?;
                self.editor.send(Response::new_ok(id, Value::Null))
            }
            Err(refusal) => self.editor.send(refusal.response(id)),
        }
    }

    /// Ends a run without a result.
    fn cancel(&mut self, job: Job, reason: &str) -> Result<(), ServerError> {
        let refusal = Refusal::new(ErrorCode::RequestCanceled, format!("{}: {reason}", job.title));
        self.editor.send(refusal.response(job.id.clone()))?;
        self.editor.end(job.token.clone())
    }

    /// Shows the result of a run, and answers its request. Runs that were cancelled have an answer.
    fn finish(&mut self, Finished { id, result }: Finished) -> Result<(), ServerError> {
        let Some(job) = self.jobs.take(|job| job.id == id) else { return Ok(()) };
        let response = match result {
            Ok((mut look, messages)) => {
                let mut answer = std::mem::take(&mut look.summary);
                let files = self.change_looks(|looks, workspace| {
                    looks.show(job.kind, look, &job.texts, workspace)
                })?;
                answer.insert("title".to_owned(), json!(job.title));
                answer.insert("messages".to_owned(), json!(messages));
                answer.insert("files".to_owned(), files);
                Response::new_ok(id, answer)
            }
            Err(reason) => {
                let message = format!("{}: {reason}", job.title);
                Refusal::new(ErrorCode::RequestFailed, message).response(id)
            }
        };
        self.editor.end(job.token.clone())?;
        self.editor.send(response)
    }

    /// Changes the looks, and brings the editor's hints and diagnostics up to date.
    fn change_looks<R>(
        &mut self,
        change: impl FnOnce(&mut Looks, &Workspace) -> R,
    ) -> Result<R, ServerError> {
        let before = self.looks.faulty(&self.workspace);
        let result = change(&mut self.looks, &self.workspace);
        self.publish_faults(before)?;
        self.publish_faults(self.looks.faulty(&self.workspace))?;
        self.editor.refresh_hints()?;
        Ok(result)
    }

    /// Publishes the diagnostics of texts with faults; those of open texts later, with others.
    fn publish_faults(&mut self, faulty: Vec<Uri>) -> Result<(), ServerError> {
        for uri in faulty {
            if !self.workspace.refresh(&uri) {
                let faults = answer::faults(&self.workspace, &self.looks, &uri);
                self.editor.publish(&uri, faults, None)?;
            }
        }
        Ok(())
    }

    /// Answers a request. A fault of an analysis is an error of its request, and the server goes on.
    fn answer(&mut self, request: Request) -> Response {
        let id = request.id.clone();
        let answered = catch_unwind(AssertUnwindSafe(|| self.dispatch(request)));
        let result = answered.unwrap_or_else(|_| {
            Err(Refusal::new(
                ErrorCode::InternalError,
                "the analysis failed; please report the text",
            ))
        });
        match result {
            Ok(value) => Response::new_ok(id, value),
            Err(refusal) => refusal.response(id),
        }
    }

    fn dispatch(&mut self, request: Request) -> Answer {
        let Request { method, params, .. } = request;
        let workspace = &mut self.workspace;
        match method.as_str() {
            HoverRequest::METHOD => answer::with(params, |it| answer::hover(workspace, &it)),
            Completion::METHOD => answer::with(params, |it| answer::completion(workspace, &it)),
            SignatureHelpRequest::METHOD => {
                answer::with(params, |it| answer::signature_help(workspace, &it))
            }
            GotoDefinition::METHOD => answer::with(params, |it| answer::definition(workspace, &it)),
            References::METHOD => answer::with(params, |it| answer::references(workspace, &it)),
            DocumentHighlightRequest::METHOD => {
                answer::with(params, |it| answer::highlights(workspace, &it))
            }
            PrepareRenameRequest::METHOD => {
                answer::with(params, |it| answer::prepare_rename(workspace, &it))
            }
            Rename::METHOD => answer::with(params, |it| answer::rename(workspace, &it)),
            DocumentSymbolRequest::METHOD => {
                answer::with(params, |it| answer::symbols(workspace, &it))
            }
            WorkspaceSymbolRequest::METHOD => {
                answer::with(params, |it| answer::workspace_symbols(workspace, &it))
            }
            FoldingRangeRequest::METHOD => answer::with(params, |it| answer::folds(workspace, &it)),
            SemanticTokensFullRequest::METHOD => {
                answer::with(params, |it| answer::semantic_tokens(workspace, &it))
            }
            InlayHintRequest::METHOD => {
                answer::with(params, |it| answer::hints(workspace, &self.looks, &it))
            }
            CodeLensRequest::METHOD => {
                let shows_costs = self.editor.shows_costs;
                answer::with(params, |it| answer::lenses(workspace, shows_costs, &it))
            }
            CodeActionRequest::METHOD => answer::with(params, |it| answer::actions(workspace, &it)),
            Formatting::METHOD => answer::with(params, |it| answer::formatting(workspace, &it)),
            _ => {
                let message = format!("the server has no `{method}`");
                Err(Refusal::new(ErrorCode::MethodNotFound, message))
            }
        }
    }

    fn note(&mut self, notification: Notification) -> Result<(), ServerError> {
        let Notification { method, params } = notification;
        match method.as_str() {
            DidOpenTextDocument::METHOD => {
                let Ok(opened) = serde_json::from_value::<DidOpenTextDocumentParams>(params) else {
                    return Ok(());
                };
                let opened = opened.text_document;
                self.workspace.open(&opened.uri, opened.text, opened.version);
            }
            DidChangeTextDocument::METHOD => {
                let Ok(changed) = serde_json::from_value::<DidChangeTextDocumentParams>(params)
                else {
                    return Ok(());
                };
                let document = changed.text_document;
                self.workspace.change(&document.uri, document.version, changed.content_changes);
            }
            DidCloseTextDocument::METHOD => {
                let Ok(closed) = serde_json::from_value::<DidCloseTextDocumentParams>(params)
                else {
                    return Ok(());
                };
                let uri = closed.text_document.uri;
                self.workspace.close(&uri);
                let faults = answer::faults(&self.workspace, &self.looks, &uri);
                self.editor.publish(&uri, faults, None)?;
            }
            DidSaveTextDocument::METHOD | DidChangeWatchedFiles::METHOD => {
                self.workspace.forget_all();
                self.publish_faults(self.looks.faulty(&self.workspace))?;
            }
            Cancel::METHOD => {
                let Ok(cancelled) = serde_json::from_value::<CancelParams>(params) else {
                    return Ok(());
                };
                let id = match cancelled.id {
                    NumberOrString::Number(number) => RequestId::from(number),
                    NumberOrString::String(text) => RequestId::from(text),
                };
                if let Some(job) = self.jobs.take(|job| job.id == id) {
                    self.cancel(job, CANCELLED)?;
                }
            }
            WorkDoneProgressCancel::METHOD => {
                let Ok(cancelled) = serde_json::from_value::<WorkDoneProgressCancelParams>(params)
                else {
                    return Ok(());
                };
                if let Some(job) = self.jobs.take(|job| job.token == Some(cancelled.token.clone()))
                {
                    self.cancel(job, CANCELLED)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Publishes the diagnostics of the texts that have changed.
    fn publish_stale(&mut self) -> Result<(), ServerError> {
        for uri in self.workspace.take_stale() {
            let workspace = &mut self.workspace;
            let found = catch_unwind(AssertUnwindSafe(|| answer::diagnostics(workspace, &uri)));
            let mut found = found.unwrap_or_default();
            found.extend(answer::faults(&self.workspace, &self.looks, &uri));
            let version = self.workspace.version(&uri);
            self.editor.publish(&uri, found, version)?;
        }
        Ok(())
    }
}

/// The folders of an editor.
#[allow(deprecated, reason = "editors of earlier versions of the protocol send the root alone")]
fn folders(parameters: &InitializeParams) -> Vec<PathBuf> {
    let named = parameters.workspace_folders.iter().flatten();
    let mut folders: Vec<PathBuf> = named.filter_map(|folder| path_of(&folder.uri)).collect();
    if folders.is_empty() {
        let uri = parameters.root_uri.as_ref().and_then(path_of);
        // Helix names a folder without a `.git` in this way alone.
        folders.extend(uri.or_else(|| parameters.root_path.as_ref().map(PathBuf::from)));
    }
    folders
}
