//! A server for one request per line, answered with one line each: on all processors, in the order of the requests.
//!
//! Each thread has a separate session. A few lines per thread are read ahead; a program that waits for each answer
//! before the next request is not delayed.

use std::io::{self, BufRead, Write};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Mutex, PoisonError};
use std::thread;

use super::request::Answer;
use super::session::Session;
use crate::arguments::SearchPath;

/// The number of lines that are read ahead for each thread.
const AHEAD: usize = 2;

/// A request with the channel of its answer.
struct Job {
    line: Vec<u8>,
    answer: SyncSender<String>,
}

/// Answers the lines of `input` on `output` until the input ends.
///
/// # Errors
/// Those of reading and writing.
pub fn answer_lines(
    input: impl BufRead + Send,
    mut output: impl Write,
    search_path: &SearchPath,
) -> io::Result<()> {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let (jobs, open_jobs) = mpsc::sync_channel::<Job>(threads);
    let (ordered, answers) = mpsc::sync_channel::<Receiver<String>>(AHEAD * threads);
    let open_jobs = Mutex::new(open_jobs);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| answer_jobs(&open_jobs, search_path));
        }
        let reading = scope.spawn(move || read_jobs(input, &jobs, &ordered));
        let written = write_answers(&mut output, answers);
        let read = reading.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        written.and(read)
    })
}

/// Ends with the input, or when the answers are not received any more.
fn read_jobs(
    mut input: impl BufRead,
    jobs: &SyncSender<Job>,
    ordered: &SyncSender<Receiver<String>>,
) -> io::Result<()> {
    loop {
        let mut line = Vec::new();
        if input.read_until(b'\n', &mut line)? == 0 {
            return Ok(());
        }
        if line.trim_ascii().is_empty() {
            continue;
        }
        let (answer, answered) = mpsc::sync_channel(1);
        if ordered.send(answered).is_err() || jobs.send(Job { line, answer }).is_err() {
            return Ok(());
        }
    }
}

fn answer_jobs(jobs: &Mutex<Receiver<Job>>, search_path: &SearchPath) {
    let mut session = Session::new(search_path.clone());
    loop {
        let job = jobs.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok(Job { line, answer }) = job else { return };
        let answered = match str::from_utf8(&line) {
            Ok(text) => session.answer_line(text),
            Err(_) => Answer::refusal(None, "not UTF-8"),
        };
        // The receiver is gone if writing has failed.
        let _ = answer.send(answered.to_line());
    }
}

fn write_answers(output: &mut impl Write, answers: Receiver<Receiver<String>>) -> io::Result<()> {
    for answer in answers {
        let line = answer.recv().unwrap_or_else(|_| {
            Answer::refusal(None, "internal error: the request was not answered").to_line()
        });
        output.write_all(line.as_bytes())?;
        output.flush()?;
    }
    Ok(())
}
