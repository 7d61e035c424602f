//! Runs of the program for requests, each on a thread of its own while the server answers other messages.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender};
use lsp_server::RequestId;
use lsp_types::ProgressToken;

use crate::answer::Order;
use crate::child::{self, RunError};
use crate::look::{Look, LookKind, costs, pixel};

/// The jobs that run: one of each kind.
#[derive(Debug)]
pub struct Jobs {
    running: Vec<Job>,
    sender: Sender<Finished>,
    /// The jobs that have ended, in this order.
    pub finished: Receiver<Finished>,
}

/// A run for a request.
#[derive(Debug)]
pub struct Job {
    /// The request.
    pub id: RequestId,
    /// The kind of its look.
    pub kind: LookKind,
    /// The name of the run, for people.
    pub title: String,
    /// The open texts when it started.
    pub texts: BTreeMap<PathBuf, String>,
    /// The token of the progress that the editor shows.
    pub token: Option<ProgressToken>,
    is_cancelled: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The end of a run.
#[derive(Debug)]
pub struct Finished {
    /// The request.
    pub id: RequestId,
    /// The notes with the messages of the program, or the reason why there are none.
    pub result: Result<(Look, String), String>,
}

impl Jobs {
    /// No jobs.
    pub fn new() -> Jobs {
        let (sender, finished) = crossbeam_channel::unbounded();
        Jobs { running: Vec::new(), sender, finished }
    }

    /// Starts a run.
    pub fn start(
        &mut self,
        program: &Path,
        id: RequestId,
        order: Order,
        token: Option<ProgressToken>,
    ) {
        let Order { kind, title, arguments, texts } = order;
        let is_cancelled = Arc::new(AtomicBool::new(false));
        let (sender, program) = (self.sender.clone(), program.to_owned());
        let (asked, flag) = (id.clone(), is_cancelled.clone());
        let thread = std::thread::spawn(move || {
            let run = child::run(&program, &arguments, &flag).map_err(|RunError(reason)| reason);
            let read = match kind {
                LookKind::Costs => costs,
                LookKind::Pixel => pixel,
            };
            let result = run.and_then(|output| Ok((read(&output.result)?, output.messages)));
            // The server has ended if nobody receives.
            let _ = sender.send(Finished { id: asked, result });
        });
        let thread = Some(thread);
        self.running.push(Job { id, kind, title, texts, token, is_cancelled, thread });
    }

    /// Takes the job that meets a condition. Dropping it ends the run.
    pub fn take(&mut self, is_wanted: impl Fn(&Job) -> bool) -> Option<Job> {
        let at = self.running.iter().position(is_wanted)?;
        Some(self.running.swap_remove(at))
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
        // The process has ended when the thread has.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
