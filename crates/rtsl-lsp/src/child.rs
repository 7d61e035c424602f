//! Runs of the program in processes of their own, which can be ended at any time.

use std::ffi::OsString;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The longest run.
const MAX_TIME: Duration = Duration::from_secs(600);
/// The greatest number of bytes of a result.
const MAX_RESULT: u64 = 64 << 20;
/// The greatest number of bytes of messages; further ones are dropped.
const MAX_MESSAGES: u64 = 64 << 10;
/// The time between two checks of whether a process has ended or is to end.
const PERIOD: Duration = Duration::from_millis(10);

/// The output of a run that has succeeded.
#[derive(Debug)]
pub struct Output {
    /// Standard output.
    pub result: Vec<u8>,
    /// Standard error: warnings.
    pub messages: String,
}

/// The reason why a run has no result, as a text for people.
#[derive(Debug)]
pub struct RunError(pub String);

/// Runs a program with these arguments, until it ends or `is_cancelled` is set.
///
/// # Errors
/// If the program cannot be started, fails, takes too long, writes too much, or is cancelled.
pub fn run(
    program: &Path,
    arguments: &[OsString],
    is_cancelled: &AtomicBool,
) -> Result<Output, RunError> {
    let mut command = Command::new(program);
    command.args(arguments).env("NO_COLOR", "1");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| {
        let program = program.display();
        RunError(format!("`{program}` does not start: {error}; restart the language server"))
    })?;
    let result = child.stdout.take().map(|stream| read(stream, MAX_RESULT + 1));
    let messages = child.stderr.take().map(|mut stream| {
        std::thread::spawn(move || {
            let kept = start_of(&mut stream, MAX_MESSAGES);
            // A full pipe would stop the process.
            let _ = std::io::copy(&mut stream, &mut std::io::sink());
            kept
        })
    });
    let status = wait(&mut child, is_cancelled)?;
    let (result, messages) = (joined(result), joined(messages));
    let messages = String::from_utf8_lossy(&messages).trim_end().to_owned();
    if result.len() as u64 > MAX_RESULT {
        let limit = MAX_RESULT >> 20;
        return Err(RunError(format!("the result has more than {limit} MiB; ask for one sample")));
    }
    match status.success() {
        true => Ok(Output { result, messages }),
        false if messages.is_empty() => Err(RunError(format!("the program failed: {status}"))),
        false => Err(RunError(messages)),
    }
}

/// Waits for the end of a process, and ends it when it is cancelled or takes too long.
fn wait(child: &mut Child, is_cancelled: &AtomicBool) -> Result<ExitStatus, RunError> {
    let start = Instant::now();
    loop {
        let reason = match child.try_wait() {
            Ok(Some(status)) => return Ok(status),
            Ok(None) if is_cancelled.load(Ordering::Relaxed) => "it was cancelled".to_owned(),
            Ok(None) if start.elapsed() > MAX_TIME => {
                format!("it was ended after {} minutes", MAX_TIME.as_secs() / 60)
            }
            Ok(None) => {
                std::thread::sleep(PERIOD);
                continue;
            }
            Err(error) => error.to_string(),
        };
        // A process that has ended in the meantime needs no end.
        let _ = child.kill();
        let _ = child.wait();
        return Err(RunError(reason));
    }
}

/// Reads the start of a stream on another thread. The process cannot write the rest.
fn read(mut stream: impl Read + Send + 'static, limit: u64) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || start_of(&mut stream, limit))
}

fn start_of(stream: &mut impl Read, limit: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    // What was read before a fault counts; the exit status tells of faults.
    let _ = stream.take(limit).read_to_end(&mut bytes);
    bytes
}

fn joined(thread: Option<JoinHandle<Vec<u8>>>) -> Vec<u8> {
    thread.and_then(|thread| thread.join().ok()).unwrap_or_default()
}
