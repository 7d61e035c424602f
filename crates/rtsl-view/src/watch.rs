//! A watch for changes of a scene's files.
//!
//! Folders are watched rather than files, because many editors write a new file and rename it. If the system cannot
//! report changes, the contents are polled twenty times a second.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use notify::event::{AccessKind, AccessMode};
use notify::{Config, EventKind, PollWatcher, RecommendedWatcher, RecursiveMode, Watcher};

/// Editors write in several steps: the time after the last one at which a file counts as complete.
const SETTLED_AFTER: Duration = Duration::from_millis(10);

const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Watches the folders of a scene's files.
pub struct FileWatch {
    watcher: Box<dyn Watcher>,
    folders: BTreeSet<PathBuf>,
}

impl FileWatch {
    /// Calls `changed` from another thread after shaders or other files of scenes were saved.
    pub fn new(changed: impl Fn() + Send + 'static) -> Result<Self, notify::Error> {
        let (sender, receiver) = mpsc::channel();
        let watcher: Box<dyn Watcher> =
            match RecommendedWatcher::new(teller(sender.clone()), Config::default()) {
                Ok(watcher) => Box::new(watcher),
                Err(_) => {
                    let config = Config::default().with_poll_interval(POLL_INTERVAL);
                    Box::new(PollWatcher::new(teller(sender), config)?)
                }
            };
        std::thread::spawn(move || tell_when_settled(&receiver, changed));
        Ok(FileWatch { watcher, folders: BTreeSet::new() })
    }

    /// Also watches the folders of these files. Folders that cannot be watched are ignored.
    pub fn add(&mut self, files: &[PathBuf]) {
        for file in files {
            let folder = match file.parent() {
                Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
                Some(_) | None => PathBuf::from("."),
            };
            if !self.folders.contains(&folder)
                && self.watcher.watch(&folder, RecursiveMode::NonRecursive).is_ok()
            {
                self.folders.insert(folder);
            }
        }
    }
}

fn teller(sender: Sender<()>) -> impl FnMut(notify::Result<notify::Event>) {
    move |event: notify::Result<notify::Event>| {
        let is_of_interest = event.is_ok_and(|event| {
            is_change(event.kind) && event.paths.iter().any(|path| is_of_scenes(path))
        });
        if is_of_interest {
            // The receiver is gone once the window is closed.
            let _ = sender.send(());
        }
    }
}

/// Reading a file is not a change; otherwise every reload would cause another.
fn is_change(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(access) => access == AccessKind::Close(AccessMode::Write),
        EventKind::Any
        | EventKind::Create(_)
        | EventKind::Modify(_)
        | EventKind::Remove(_)
        | EventKind::Other => true,
    }
}

fn is_of_scenes(path: &Path) -> bool {
    path.extension().is_some_and(|it| it == "rtsl" || it == "pbrt")
}

fn tell_when_settled(receiver: &Receiver<()>, changed: impl Fn()) {
    while receiver.recv().is_ok() {
        loop {
            match receiver.recv_timeout(SETTLED_AFTER) {
                Ok(()) => {}
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
        changed();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_shader_is_told_and_a_read_one_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let shader = folder.join("a.rtsl");
        std::fs::write(&shader, "one").unwrap();
        let (sender, receiver) = mpsc::channel();
        let mut watch = FileWatch::new(move || _ = sender.send(())).unwrap();
        watch.add(std::slice::from_ref(&shader));

        std::fs::read(&shader).unwrap();
        std::fs::write(folder.join("notes.txt"), "two").unwrap();
        assert!(receiver.recv_timeout(Duration::from_millis(200)).is_err());

        std::fs::write(&shader, "two").unwrap();
        receiver.recv_timeout(Duration::from_secs(10)).expect("written in place");

        std::fs::write(folder.join("new"), "three").unwrap();
        std::fs::rename(folder.join("new"), &shader).unwrap();
        receiver.recv_timeout(Duration::from_secs(10)).expect("replaced by a rename");
    }
}
