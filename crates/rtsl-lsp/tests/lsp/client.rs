//! An editor: it sends messages to a server on another thread and waits for the answers.

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Duration;

use lsp_server::{Connection, Message, Notification, Request, RequestId, Response, ResponseError};
use rtsl_lsp::{ServerOptions, serve};
use serde_json::{Value, json};

/// The longest time that an answer may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A stand-in for the program `rtsl`.
const PROGRAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/lsp/program.sh");

/// An editor with a folder of its own.
pub struct Client {
    connection: Connection,
    server: Option<JoinHandle<()>>,
    folder: tempfile::TempDir,
    next: i32,
    version: i32,
}

impl Client {
    /// Starts a server for a folder with these files.
    pub fn new(files: &[(&str, &str)]) -> Client {
        Client::with_encoding(files, json!(null))
    }

    /// Starts a server for an editor that counts columns in one of these encodings.
    pub fn with_encoding(files: &[(&str, &str)], encodings: Value) -> Client {
        Client::with_abilities(files, json!({"general": {"positionEncodings": encodings}}))
    }

    /// Starts a server for an editor with these abilities.
    pub fn with_abilities(files: &[(&str, &str)], abilities: Value) -> Client {
        Client::with_start(files, |folder| {
            let root = format!("file://{}", folder.display());
            json!({
                "capabilities": abilities,
                "workspaceFolders": [{"uri": root, "name": "test"}],
            })
        })
    }

    /// Starts a server with the parameters of `initialize` that an editor sends for the folder.
    pub fn with_start(files: &[(&str, &str)], parameters: impl FnOnce(&Path) -> Value) -> Client {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        }
        let (connection, other) = Connection::memory();
        let root = folder.path().to_owned();
        let cache_folder = Some(root.join(".cache"));
        let program = PathBuf::from(PROGRAM);
        let server = std::thread::spawn(move || {
            let search_path = Box::new(move |_: &Path| vec![root.join("include")]);
            serve(&other, ServerOptions { search_path, cache_folder, program }).expect("it serves");
        });
        let mut client = Client { connection, server: Some(server), folder, next: 0, version: 0 };
        let parameters = parameters(client.folder.path());
        client.ask("initialize", parameters);
        client.tell("initialized", json!({}));
        client
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The URI of a file.
    pub fn uri(&self, name: &str) -> String {
        format!("file://{}", self.path(name).display())
    }

    /// The folder's name is different each time.
    pub fn without_folder(&self, value: &Value) -> String {
        let text = serde_json::to_string_pretty(value).expect("JSON");
        text.replace(&format!("{}", self.folder.path().display()), "FOLDER")
    }

    /// Sends a notification.
    pub fn tell(&self, method: &str, params: Value) {
        let notification = Notification { method: method.to_owned(), params };
        self.connection.sender.send(Message::Notification(notification)).expect("it is sent");
    }

    /// Opens a file with a text, and returns its diagnostics.
    pub fn open(&mut self, name: &str, text: &str) -> Value {
        let uri = self.uri(name);
        self.tell(
            "textDocument/didOpen",
            json!({"textDocument": {"uri": uri, "languageId": "rtsl", "version": 0, "text": text}}),
        );
        self.diagnostics(name)
    }

    /// Replaces a part of an open text, and returns its diagnostics.
    pub fn change(&mut self, name: &str, range: Value, text: &str) -> Value {
        self.version += 1;
        let change = match range {
            Value::Null => json!({"text": text}),
            range => json!({"range": range, "text": text}),
        };
        self.tell(
            "textDocument/didChange",
            json!({
                "textDocument": {"uri": self.uri(name), "version": self.version},
                "contentChanges": [change],
            }),
        );
        self.diagnostics(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a file");
    }

    /// Waits for the diagnostics of a file.
    pub fn diagnostics(&self, name: &str) -> Value {
        let uri = self.uri(name);
        loop {
            if let Message::Notification(notification) = self.receive()
                && notification.method == "textDocument/publishDiagnostics"
                && notification.params["uri"] == json!(uri)
            {
                return notification.params["diagnostics"].clone();
            }
        }
    }

    /// Sends a request and returns the result or the error.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        let number = self.send(method, params);
        self.answer_with_messages(number).0
    }

    /// Sends a request, and returns its number.
    pub fn send(&mut self, method: &str, params: Value) -> i32 {
        self.next += 1;
        let id = RequestId::from(self.next);
        let request = Request { id, method: method.to_owned(), params };
        self.connection.sender.send(Message::Request(request)).expect("it is sent");
        self.next
    }

    /// Waits for the answer to a request, and returns the messages before it, too: their methods and parameters.
    pub fn answer_with_messages(&self, number: i32) -> (Value, Vec<(String, Value)>) {
        let mut messages = Vec::new();
        loop {
            match self.receive() {
                Message::Response(Response { id, response_result }) => {
                    if id == RequestId::from(number) {
                        let error = |error: ResponseError| json!({"error": error.message});
                        return (response_result.unwrap_or_else(error), messages);
                    }
                }
                Message::Notification(it) => messages.push((it.method, it.params)),
                Message::Request(it) => messages.push((it.method, it.params)),
            }
        }
    }

    /// Asks about the first place of a text in a file that is open with `text`.
    pub fn ask_at(&mut self, method: &str, name: &str, text: &str, at: &str) -> Value {
        let position = position_of(text, at);
        let document = json!({"uri": self.uri(name)});
        self.ask(method, json!({"textDocument": document, "position": position}))
    }

    fn receive(&self) -> Message {
        self.connection.receiver.recv_timeout(PATIENCE).expect("the server answers")
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        self.ask("shutdown", json!(null));
        self.tell("exit", json!(null));
        self.server.take().expect("it runs").join().expect("it ends");
    }
}

/// The position of the first `|` of a pattern in a text that has the pattern without it.
pub fn position_of(text: &str, pattern: &str) -> Value {
    let place = pattern.find('|').unwrap_or(0);
    let start = text.find(&pattern.replacen('|', "", 1)).expect("the text has it") + place;
    let line = text[..start].matches('\n').count();
    let column = start - text[..start].rfind('\n').map_or(0, |at| at + 1);
    json!({"line": line, "character": column})
}
