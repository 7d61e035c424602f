//! Conversion of scenes of earlier versions of pbrt to texts in the format of pbrt-v4.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use rtsl::{Diagnostic, Diagnostics, FileId, Messages, SourceMap, Span, diagnostic_codes as codes};
use rtsl_memory::{Amount, InputBudget};

use super::directive::{Keyword, directive};
use super::fence::Fence;
use super::files::{FileSource, resolve, unreadable, with_slashes};
use super::limits::{MAX_INCLUDE_DEPTH, RepeatedDirectives, included_path, read_text};
use super::parameter::{Parameter, ParameterType, Values};
use super::parser::{Command, Parser};
use super::recorded_files::Digest;
use super::upgrade::{Target, Upgrader, is_old_text};
use super::writer::Writer;

/// A converted scene.
#[derive(Debug)]
pub struct Conversion {
    /// The files to write, the main one last.
    pub files: Vec<(PathBuf, String)>,
    /// The files from which they were made, the main one first.
    pub sources: Vec<PathBuf>,
    /// True if the scene is one of an earlier version.
    pub was_old: bool,
    /// Warnings.
    pub warnings: Messages,
}

/// Options of a conversion.
#[derive(Clone, Copy, Debug, Default)]
pub struct ConversionOptions {
    /// Write one file, with the contents of those that the scene includes.
    pub inline: bool,
    /// The memory budget for the files; that of [`InputBudget::new`] if `None`.
    pub input_memory: Option<Amount>,
}

/// Converts the scene in the file `input` to a text for the file `output`, and those that it includes to texts for
/// files beside that. Nothing is written.
///
/// # Errors
/// All errors of the texts, with the warnings among them.
pub fn convert_scene(
    input: &Path,
    output: &Path,
    files: &dyn FileSource,
    options: &ConversionOptions,
) -> Result<Conversion, Messages> {
    let budget = InputBudget::new(options.input_memory);
    let mut converter = Converter {
        files,
        budget: &budget,
        map: SourceMap::new(),
        diagnostics: Diagnostics::new(),
        upgrader: Upgrader::new(Target::Pbrt),
        input,
        output,
        inline: options.inline,
        open: Vec::new(),
        known: BTreeMap::new(),
        included: BTreeMap::new(),
        sources: Vec::new(),
        converted: Vec::new(),
        places: BTreeMap::new(),
        counts: BTreeMap::new(),
        repeated_files: 0,
        repeated_directives: RepeatedDirectives::default(),
    };
    converter.convert_main();
    converter.finish()
}

struct Converter<'a> {
    files: &'a dyn FileSource,
    budget: &'a InputBudget,
    map: SourceMap,
    diagnostics: Diagnostics,
    upgrader: Upgrader,
    input: &'a Path,
    output: &'a Path,
    inline: bool,
    /// The files being read, outermost first.
    open: Vec<PathBuf>,
    known: BTreeMap<PathBuf, FileId>,
    /// The places at which texts name further ones.
    included: BTreeMap<PathBuf, Span>,
    sources: Vec<PathBuf>,
    converted: Vec<(PathBuf, String)>,
    /// The paths of texts for included files, by their path without a number.
    places: BTreeMap<(PathBuf, Digest), PathBuf>,
    counts: BTreeMap<PathBuf, usize>,
    repeated_files: usize,
    repeated_directives: RepeatedDirectives,
}

/// Parameters that name files.
pub const FILE_PARAMETERS: [&str; 6] =
    ["filename", "lensfile", "normalmap", "emissionfilename", "bsdffile", "imagefilename"];

impl Converter<'_> {
    fn convert_main(&mut self) {
        let mut writer = Writer::new();
        if let Some(last) = self.read(self.input.to_owned(), None, &mut writer) {
            self.write(last, &mut writer);
        }
        self.converted.push((self.output.to_owned(), writer.finish()));
    }

    fn finish(mut self) -> Result<Conversion, Messages> {
        let was_old = self.upgrader.is_old();
        for note in self.upgrader.take_notes() {
            self.diagnostics
                .push(Diagnostic::new(codes::IGNORED_SETTING, note.message).at(note.span, ""));
        }
        let mut messages = Messages::default();
        let fence = Fence::alone(self.input, self.files);
        let diagnostics = fence.redacted(self.diagnostics, &self.map, &self.included);
        if !diagnostics.is_empty() {
            messages.push(self.map, diagnostics);
        }
        match messages.has_errors() {
            true => Err(messages),
            false => Ok(Conversion {
                files: self.converted,
                sources: self.sources,
                was_old,
                warnings: messages,
            }),
        }
    }

    /// Converts a file to its end. Returns its last command if parameters for it may follow in the including file.
    fn read(
        &mut self,
        path: PathBuf,
        included_at: Option<Span>,
        writer: &mut Writer,
    ) -> Option<Command> {
        let known = self.known.get(&path).copied();
        let file = known.or_else(|| self.load(&path, included_at))?;
        self.open.push(path);
        self.repeated_files += usize::from(known.is_some());
        // The source map owns the text while others are added to it.
        let text = self.map.file(file).text.clone();
        let mut parser = Parser::within(self.budget, file, &text);
        let mut last = None;
        while let Some(command) = parser.next_command(&mut self.diagnostics) {
            if self.repeated_files > 0 && !self.count_repeated_directive(command.span) {
                break;
            }
            if let Some(command) = self.after_includes(command, &mut parser, writer) {
                let takes_parameters = directive(command.keyword.word())
                    .is_some_and(|(_, operands)| operands.parameters);
                if parser.is_at_end() && takes_parameters {
                    last = Some(command);
                } else {
                    self.write(command, writer);
                }
            }
            if self.budget.is_exceeded() {
                break;
            }
        }
        self.repeated_files -= usize::from(known.is_some());
        self.open.pop();
        last
    }

    fn load(&mut self, path: &Path, included_at: Option<Span>) -> Option<FileId> {
        match read_text(self.files, path, self.budget) {
            Ok(text) => {
                if is_old_text(&text) {
                    self.upgrader.set_old();
                }
                let file = self.map.add(path.display().to_string(), text);
                self.known.insert(path.to_owned(), file);
                self.sources.push(path.to_owned());
                Some(file)
            }
            Err(error) => {
                let diagnostic = unreadable(path, &error);
                self.diagnostics.push(match included_at {
                    Some(span) => diagnostic.at(span, "named here"),
                    None => diagnostic,
                });
                None
            }
        }
    }

    /// Returns the command to write: the given one, or the last one of a file that it includes.
    fn after_includes(
        &mut self,
        command: Command,
        parser: &mut Parser<'_>,
        writer: &mut Writer,
    ) -> Option<Command> {
        let is_include = matches!(command.keyword, Keyword::Include | Keyword::Import);
        if command.is_broken || !is_include {
            return Some(command);
        }
        let path = self.included_path(&command.texts[0].text);
        let span = command.texts[0].span;
        if self.open.contains(&path) || self.open.len() >= MAX_INCLUDE_DEPTH {
            let message = format!("`{}` is included in itself, or too deep", path.display());
            self.diagnostics.push(Diagnostic::new(codes::INCLUDE_CYCLE, message).at(span, ""));
            return None;
        }
        self.included.entry(path.clone()).or_insert(span);
        let is_open = parser.is_at_parameter();
        if is_open || (self.inline && command.keyword == Keyword::Include) {
            let last = self.read(path, Some(span), writer)?;
            return parser.continue_command(last, &mut self.diagnostics);
        }
        let mut own = Writer::new();
        if let Some(last) = self.read(path.clone(), Some(span), &mut own) {
            self.write(last, &mut own);
        }
        let output = self.place(&path, own.finish());
        writer.include(command.keyword, &relative(self.output, &output));
        None
    }

    /// The path of an included file, as a reader of the scene finds it.
    fn included_path(&self, name: &str) -> PathBuf {
        let exists = |path: &Path| self.known.contains_key(path) || self.files.size(path).is_ok();
        included_path(name, self.input, self.open.last(), exists)
    }

    /// Records the text for a file that is included, and returns its path: the same as before if it was converted to the
    /// same text already.
    fn place(&mut self, source: &Path, text: String) -> PathBuf {
        let folder = self.input.parent().unwrap_or(Path::new(""));
        let name = Path::new(source.file_name().unwrap_or_default());
        let own = source.strip_prefix(folder).ok().filter(|it| it.is_relative()).unwrap_or(name);
        let path = resolve(self.output, &own.to_string_lossy());
        let stem = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let stem = stem.trim_end_matches(".gz").trim_end_matches(".pbrt").to_owned();
        let base = path.with_file_name(format!("{stem}-v4"));
        let key = (base.clone(), Digest::of(text.as_bytes()));
        if let Some(known) = self.places.get(&key) {
            return known.clone();
        }
        let place = loop {
            let count = self.counts.entry(base.clone()).or_default();
            *count += 1;
            let number = if *count == 1 { String::new() } else { format!("-{count}") };
            let place = path.with_file_name(format!("{stem}-v4{number}.pbrt"));
            if place != self.output {
                break place;
            }
        };
        self.places.insert(key, place.clone());
        self.converted.push((place.clone(), text));
        place
    }

    /// Writes what a command becomes.
    fn write(&mut self, command: Command, writer: &mut Writer) {
        if command.is_broken {
            return;
        }
        if Upgrader::is_old_name(&command) {
            self.upgrader.set_old();
        }
        let span = command.span;
        let commands = match self.upgrader.is_old() {
            true => self.upgrader.upgrade(command),
            false => vec![command],
        };
        let length = writer.len();
        for mut command in commands {
            self.move_files(&mut command);
            writer.command(&command, &self.map);
        }
        self.hold(writer.len() - length, span);
    }

    /// Holds the memory of text that was written.
    fn hold(&mut self, length: usize, span: Span) {
        let amount = Amount(length as u64);
        match self.budget.hold(amount) {
            Ok(held) => held.keep(amount),
            Err(error) => {
                let diagnostic = error.diagnostic(self.output.display());
                self.diagnostics.push(diagnostic.at(span, "writing stops after this one"));
            }
        }
    }

    /// Gives files the names that they have from the folder of the converted scene.
    fn move_files(&self, command: &mut Command) {
        let folder = |path: &Path| path.parent().map(Path::to_owned);
        if command.keyword == Keyword::Film {
            return;
        }
        let is_beside = folder(self.input) == folder(self.output);
        let is_file = |it: &Parameter, name: &str| match it.kind {
            ParameterType::Text => FILE_PARAMETERS.contains(&it.name.as_str()),
            ParameterType::Spectrum => self.files.size(&resolve(self.input, name)).is_ok(),
            _ => false,
        };
        for parameter in &mut command.parameters {
            let Some(name) = parameter.first_text() else { continue };
            if !is_file(parameter, name) {
                continue;
            }
            let name = with_slashes(name);
            let moved = match is_beside || Path::new(&*name).is_absolute() {
                true => name.into_owned(),
                false => relative(self.output, &resolve(self.input, &name)),
            };
            parameter.values = Values::Texts(vec![moved]);
        }
    }

    /// True if one more directive is within the limit; reports once that it is not.
    fn count_repeated_directive(&mut self, span: Span) -> bool {
        let counted = self.repeated_directives.count(self.budget, span);
        let is_within = counted.is_ok();
        self.diagnostics.extend(counted.err().flatten());
        is_within
    }
}

/// The path of a file from the folder of another one.
fn relative(from: &Path, path: &Path) -> String {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let (from, path) = (absolute(from), absolute(path));
    let folder: Vec<Component<'_>> = from.parent().unwrap_or(Path::new("")).components().collect();
    let target: Vec<Component<'_>> = path.components().collect();
    let shared = folder.iter().zip(&target).take_while(|(one, other)| one == other).count();
    // Paths on two drives have nothing in common.
    if shared == 0 {
        return path.display().to_string();
    }
    let up = std::iter::repeat_n(Component::ParentDir, folder.len() - shared);
    let parts: Vec<String> = up
        .chain(target[shared..].iter().copied())
        .map(|part| part.as_os_str().to_string_lossy().into_owned())
        .collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_paths_from_the_folder_of_the_output() {
        let relative = |from: &str, path: &str| relative(Path::new(from), Path::new(path));
        assert_eq!(relative("/a/b/out.pbrt", "/a/b/x.ply"), "x.ply");
        assert_eq!(relative("/a/b/out.pbrt", "/a/c/x.ply"), "../c/x.ply");
        assert_eq!(relative("out.pbrt", "models/x.ply"), "models/x.ply");
        assert_eq!(relative("v4/out.pbrt", "models/x.ply"), "../models/x.ply");
    }
}
