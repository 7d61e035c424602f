//! The loop over an editor's messages.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidChangeWatchedFiles, DidCloseTextDocument, DidOpenTextDocument,
    DidSaveTextDocument, Notification as _, PublishDiagnostics,
};
use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentHighlightRequest,
    DocumentSymbolRequest, FoldingRangeRequest, Formatting, GotoDefinition, HoverRequest,
    InlayHintRequest, PrepareRenameRequest, References, Rename, Request as _,
    SemanticTokensFullRequest, SignatureHelpRequest, WorkspaceSymbolRequest,
};
use lsp_types::{
    DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    InitializeParams, InitializeResult, PublishDiagnosticsParams, ServerInfo, Uri,
};

use crate::ServerOptions;
use crate::answer::{self, Answer, Refusal};
use crate::capabilities::capabilities;
use crate::place::{Encoding, path_of};
use crate::workspace::Workspace;

/// A fault of the connection.
pub type ServerError = Box<dyn std::error::Error + Send + Sync>;

/// A server with its editor.
pub struct Server<'c> {
    connection: &'c Connection,
    workspace: Workspace,
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
        let workspace = Workspace::new(options, folders(&parameters), encoding);
        Ok(Server { connection, workspace })
    }

    /// Answers messages until the editor ends the connection.
    pub fn run(mut self) -> Result<(), ServerError> {
        loop {
            let message = match self.connection.receiver.try_recv() {
                Ok(message) => message,
                Err(_) => {
                    self.publish_stale()?;
                    let Ok(message) = self.connection.receiver.recv() else { return Ok(()) };
                    message
                }
            };
            match message {
                Message::Request(request) => {
                    if self.connection.handle_shutdown(&request)? {
                        return Ok(());
                    }
                    let response = self.answer(request);
                    self.connection.sender.send(Message::Response(response))?;
                }
                Message::Notification(notification) => self.note(notification)?,
                Message::Response(_) => {}
            }
        }
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
            Err(refusal) => Response::new_err(id, refusal.code as i32, refusal.message),
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
            InlayHintRequest::METHOD => answer::with(params, |it| answer::hints(workspace, &it)),
            CodeLensRequest::METHOD => answer::with(params, |it| answer::lenses(workspace, &it)),
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
                self.workspace.close(&closed.text_document.uri);
                self.publish(&closed.text_document.uri, Vec::new(), None)?;
            }
            DidSaveTextDocument::METHOD | DidChangeWatchedFiles::METHOD => {
                self.workspace.forget_all();
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
            let version = self.workspace.version(&uri);
            self.publish(&uri, found.unwrap_or_default(), version)?;
        }
        Ok(())
    }

    fn publish(
        &self,
        uri: &Uri,
        diagnostics: Vec<lsp_types::Diagnostic>,
        version: Option<i32>,
    ) -> Result<(), ServerError> {
        let parameters = PublishDiagnosticsParams { uri: uri.clone(), diagnostics, version };
        let method = PublishDiagnostics::METHOD.to_owned();
        let notification = Notification { method, params: serde_json::to_value(parameters)? };
        self.connection.sender.send(Message::Notification(notification))?;
        Ok(())
    }
}

/// The folders of an editor.
#[allow(deprecated, reason = "editors of earlier versions of the protocol send the root alone")]
fn folders(parameters: &InitializeParams) -> Vec<PathBuf> {
    let named = parameters.workspace_folders.iter().flatten();
    let mut folders: Vec<PathBuf> = named.filter_map(|folder| path_of(&folder.uri)).collect();
    if folders.is_empty() {
        folders.extend(parameters.root_uri.as_ref().and_then(path_of));
    }
    folders
}
