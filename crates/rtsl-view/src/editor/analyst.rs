//! What is known about a text, found by a thread of its own, so that typing never waits.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

use rtsl::{FileLoader, Severity};
use rtsl_ide::{CompletionItem, Document, SemanticToken, complete, hover, semantic_tokens};

/// The stack of the thread, as deep as that of a program.
const STACK_BYTES: usize = 16 << 20;

/// The analyses of texts, by a thread.
pub struct Analyst {
    requests: Sender<Request>,
    answers: Receiver<Answer>,
    /// The number of requests without an answer.
    pending: usize,
}

/// A question about a text.
#[derive(Clone, Debug)]
pub struct Request {
    /// The name of the text.
    pub name: String,
    /// The version of the text, which the answer tells.
    pub version: u64,
    /// The text.
    pub text: String,
    /// What is asked.
    pub question: Question,
}

/// What is asked about a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Its words and its errors.
    Findings,
    /// The description of the word at an offset.
    Hover(usize),
    /// What could be typed at an offset.
    Completions(usize),
}

/// An answer about a version of a text.
#[derive(Debug)]
pub struct Answer {
    /// The name of the text.
    pub name: String,
    /// What was found.
    pub found: Found,
}

/// What is found.
#[derive(Debug)]
pub enum Found {
    /// Words and errors.
    Findings(Findings),
    /// The description of the word at an offset, if it has one.
    Hover(usize, Option<String>),
    /// What could be typed in the place of these bytes.
    Completions(std::ops::Range<usize>, Vec<CompletionItem>),
}

/// The words and the errors of a text.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// The version of the text.
    pub version: u64,
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
        match self.answers.try_recv() {
            Ok(answer) => {
                self.pending = self.pending.saturating_sub(1);
                answer
            }
            Err(mpsc::TryRecvError::Empty) => None,
            Err(mpsc::TryRecvError::Disconnected) => {
                self.pending = 0;
                None
            }
        }
    }

    /// True while an answer is due.
    pub fn is_busy(&self) -> bool {
        self.pending > 0
    }
}

fn answer_all(
    requests: &Receiver<Request>,
    answers: &Sender<Option<Answer>>,
    search_path: &[PathBuf],
    tell: impl Fn(),
) {
    let mut known: Option<Known> = None;
    while let Ok(mut request) = requests.recv() {
        // Of questions about versions that follow each other, only the last is of interest.
        for later in requests.try_iter() {
            if later.question != Question::Findings || request.question != Question::Findings {
                let found = answer(&mut known, &request, search_path);
                let _ = answers.send(Some(found));
            } else {
                let _ = answers.send(None);
            }
            request = later;
        }
        let found = answer(&mut known, &request, search_path);
        if answers.send(Some(found)).is_err() {
            return;
        }
        tell();
    }
}
