//! The texts of a recording: on the disk, or built in.

use std::path::{Path, PathBuf};

use rtsl::library;
use rtsl_debug::Replay;

/// Returns the path of a text, absolute; none if it is in no file. A file that has the name of a text of the standard
/// library by chance is another, unless it has the same text.
pub fn path_of(name: &str) -> Option<PathBuf> {
    let path = std::fs::canonicalize(name).ok().filter(|path| path.is_file())?;
    let is_same = |built_in: &str| std::fs::read_to_string(&path).is_ok_and(|it| it == built_in);
    let is_other = library::file(name).is_some_and(|file| !is_same(file.text));
    (!is_other).then_some(path)
}

/// Returns the name of the text that a path denotes: of a file, or of a text that is built in.
pub fn name_at(replay: &Replay, path: &str) -> Option<String> {
    let names = || replay.texts().map(|text| text.source.name.as_str());
    if let Some(name) = names().find(|name| *name == path) {
        return Some(name.to_owned());
    }
    let wanted = std::fs::canonicalize(path).ok();
    let is_same = |name: &&str| wanted.is_some() && path_of(name) == wanted;
    if let Some(name) = names().find(is_same) {
        return Some(name.to_owned());
    }
    // A file's name alone, if it is that of one text.
    let mut ends = names().filter(|name| Path::new(name).ends_with(path));
    let only = ends.next()?;
    ends.next().is_none().then(|| only.to_owned())
}

/// Returns a line of a text, from 1; empty if it has no such line.
pub fn line_of(replay: &Replay, name: &str, line: u32) -> String {
    let text = replay.source(name).map_or("", |source| source.text.as_str());
    let line = text.lines().nth(line.saturating_sub(1) as usize).unwrap_or_default();
    line.replace('\t', "    ")
}
