//! Analyses of texts by a thread of its own, so that typing never waits.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

use rtsl::{FileLoader, Severity};
use rtsl_ide::{CompletionItem, Document, SemanticToken, advice, complete, hover, semantic_tokens};

/// The stack of the thread, as deep as that of a program.
const STACK_BYTES: usize = 16 << 20;

/// The analyses of texts, by a thread.
pub struct Analyst {
    requests: Sender<Request>,
    /// Nothing stands for a request that a later one has made idle.
    answers: Receiver<Option<Answer>>,
    /// The number of requests without an answer.
    pending: usize,
}

/// A question about a text.
#[derive(Clone, Debug)]
pub struct Request {
    /// The name of the text.
    pub name: String,
    /// The version of the text.
    pub version: u64,
    /// The text.
    pub text: String,
    /// The question.
    pub question: Question,
}

/// The questions about texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Its words and its errors.
    Findings,
    /// The description of the word at an offset.
    Hover(usize),
    /// The texts that fit an offset.
    Completions(usize),
}

/// An answer about a version of a text.
#[derive(Debug)]
pub struct Answer {
    /// The name of the text.
    pub name: String,
    /// The answer.
    pub found: Found,
}

/// The kinds of answers.
#[derive(Debug)]
pub enum Found {
    /// Words and errors.
    Findings(Findings),
    /// The description of the word at an offset, if it has one.
    Hover(usize, Option<String>),
    /// The texts that fit the place of these bytes.
    Completions(std::ops::Range<usize>, Vec<CompletionItem>),
}

/// The words and the errors of a text.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// The text.
    pub text: String,
    /// Its words.
    pub tokens: Vec<SemanticToken>,
    /// Its errors and warnings.
    pub problems: Vec<Problem>,
}

/// An error or a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Its bytes; nothing if it has no place in the text.
    pub start: usize,
    /// The end of its bytes.
    pub end: usize,
    /// The line, from 1.
    pub line: usize,
    /// True for an error.
    pub is_error: bool,
    /// The code.
    pub code: &'static str,
    /// The message.
    pub message: String,
    /// Labels, notes and advice, a line each.
    pub details: Vec<String>,
}

impl Analyst {
    /// Starts the thread. Includes come from `search_path`, too; `tell` is called after each answer.
    pub fn new(search_path: Vec<PathBuf>, tell: impl Fn() + Send + 'static) -> Analyst {
        let (requests, to_answer) = mpsc::channel();
        let (to_tell, answers) = mpsc::channel();
        let work = move || answer_all(&to_answer, &to_tell, &search_path, tell);
        // Without a thread the editor knows nothing of its texts, and edits them all the same.
        let _ = thread::Builder::new().stack_size(STACK_BYTES).spawn(work);
        Analyst { requests, answers, pending: 0 }
    }

    /// Asks a question.
    pub fn ask(&mut self, request: Request) {
        if self.requests.send(request).is_ok() {
            self.pending += 1;
        }
    }

    /// Returns the next answer, if there is one by now.
    pub fn answer(&mut self) -> Option<Answer> {
        loop {
            match self.answers.try_recv() {
                Ok(answer) => {
                    self.pending = self.pending.saturating_sub(1);
                    if answer.is_some() {
                        return answer;
                    }
                }
                Err(mpsc::TryRecvError::Empty) => return None,
                Err(mpsc::TryRecvError::Disconnected) => {
                    self.pending = 0;
                    return None;
                }
            }
        }
    }

    /// True while an answer is due.
    pub fn is_busy(&self) -> bool {
        self.pending > 0
    }
}

/// The document of the last text that was analysed.
struct Known {
    name: String,
    version: u64,
    document: Document,
}

fn answer_all(
    requests: &Receiver<Request>,
    answers: &Sender<Option<Answer>>,
    search_path: &[PathBuf],
    tell: impl Fn(),
) {
    let mut known = None;
    while let Ok(first) = requests.recv() {
        let waiting: Vec<Request> = std::iter::once(first).chain(requests.try_iter()).collect();
        for (index, request) in waiting.iter().enumerate() {
            let is_idle = |later: &Request| later.is_instead_of(request);
            let is_needed = !waiting[index + 1..].iter().any(is_idle);
            let found = is_needed.then(|| request.answer(&mut known, search_path));
            if answers.send(found).is_err() {
                return;
            }
        }
        tell();
    }
}

impl Request {
    /// True if an earlier request needs no answer because of this one: one of the same kind about the same text.
    fn is_instead_of(&self, earlier: &Request) -> bool {
        let kind = |question: &Question| std::mem::discriminant(question);
        kind(&self.question) == kind(&earlier.question) && self.name == earlier.name
    }

    fn answer(&self, known: &mut Option<Known>, search_path: &[PathBuf]) -> Answer {
        let found = match self.question {
            Question::Findings => Found::Findings(self.findings(self.document(known, search_path))),
            Question::Hover(offset) => {
                let described = hover(self.document(known, search_path), offset as u32);
                Found::Hover(offset, described.map(|hover| hover.text))
            }
            Question::Completions(offset) => {
                let found = complete(&self.name, &self.text, offset, &mut self.loader(search_path));
                Found::Completions(found.range, found.items)
            }
        };
        Answer { name: self.name.clone(), found }
    }

    fn loader(&self, search_path: &[PathBuf]) -> FileLoader {
        let path = Path::new(&self.name);
        match path.is_file() {
            true => FileLoader::beside(path, search_path),
            false => FileLoader::new(search_path),
        }
    }

    fn document<'k>(&self, known: &'k mut Option<Known>, search_path: &[PathBuf]) -> &'k Document {
        let is_same = |known: &Known| known.name == self.name && known.version == self.version;
        // An include may have changed, so that findings are always new.
        let is_known = self.question != Question::Findings && known.as_ref().is_some_and(is_same);
        let earlier = known.take().filter(|_| is_known);
        let new = || Known {
            name: self.name.clone(),
            version: self.version,
            document: Document::new(&self.name, &self.text, &mut self.loader(search_path)),
        };
        &known.insert(earlier.unwrap_or_else(new)).document
    }

    fn findings(&self, document: &Document) -> Findings {
        let found = document.analysis.diagnostics.iter();
        let problems = found.map(|diagnostic| problem(document, diagnostic)).collect();
        let tokens = semantic_tokens(document);
        Findings { text: self.text.clone(), tokens, problems }
    }
}

fn problem(document: &Document, found: &rtsl::Diagnostic) -> Problem {
    let sources = &document.analysis.sources;
    let place = found.primary.as_ref().map(|label| label.span);
    let own = place.filter(|span| span.file == document.file());
    let (start, end) = own.map_or((0, 0), |span| (span.start as usize, span.end as usize));
    let mut message = found.message.clone();
    if let Some(elsewhere) = place.filter(|span| span.file != document.file()) {
        message = format!("in `{}`: {message}", sources.file(elsewhere.file).name);
    }
    let labels = found.primary.iter().chain(&found.labels).map(|label| label.message.clone());
    let notes = found.notes.iter().map(|note| format!("note: {note}"));
    let help = found.help.iter().map(|help| format!("help: {help}"));
    // Labels that repeat the message say nothing.
    let labels =
        labels.filter(|label| !label.is_empty() && !found.message.contains(label.as_str()));
    let edits = found.suggestions.iter().map(|edit| format!("help: {}", advice(edit)));
    let details = labels.chain(notes).chain(help).chain(edits).collect();
    Problem {
        start,
        end,
        line: document.text()[..start.min(document.text().len())].matches('\n').count() + 1,
        is_error: found.severity == Severity::Error,
        code: found.code.as_str(),
        message,
        details,
    }
}
