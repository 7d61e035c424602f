//! Executes the directives of a scene, with one method for each, and builds its description.

mod blocks;
mod entities;
mod includes;
mod objects;
mod options;
mod texture_names;
mod transforms;
mod versions;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use rtsl::{
    Diagnostic, Diagnostics, FileId, SourceMap, Span, diagnostic_codes as codes, most_similar,
};
use rtsl_math::Transform;
use rtsl_memory::{Amount, InputBudget};

use self::texture_names::NamedTextures;
use super::command_memory::{entity_kind, memory};
use super::current_transform::CurrentTransform;
use super::directive::{Keyword, directive};
use super::files::{FileSource, unreadable, with_slashes};
use super::limits::{RepeatedDirectives, read_text};
use super::parameter::ReferenceKind;
use super::parser::{Command, Parser, SpannedText};
use super::state::{Block, BlockKind, GraphicsState, MaterialChoice};
use super::upgrade::{Target, Upgrader, is_old_text};
use crate::spectrum::ColorSpace;
use crate::{Description, EntityId, EntityKind};

/// The greatest number of parameters, and of their values, that `Attribute` may set for following entities.
const MAX_ATTRIBUTES: usize = 64;
const MAX_ATTRIBUTE_VALUES: usize = 1024;

/// Reads the scene in the file `path`. Errors are added to `diagnostics`; the description then contains the parts that
/// were understood.
pub fn read_scene(
    path: &Path,
    files: &dyn FileSource,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Description {
    read_scene_within(path, files, &InputBudget::default(), map, diagnostics)
}

/// The same within a budget of memory.
pub fn read_scene_within(
    path: &Path,
    files: &dyn FileSource,
    budget: &InputBudget,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Description {
    let mut interpreter = Interpreter::new(path, files, budget, map, diagnostics);
    interpreter.read_main_file();
    interpreter.finish()
}

struct Interpreter<'a> {
    files: &'a dyn FileSource,
    budget: &'a InputBudget,
    map: &'a mut SourceMap,
    diagnostics: &'a mut Diagnostics,
    description: Description,
    state: GraphicsState,
    blocks: Vec<Block>,
    /// The greatest number of blocks open at a time.
    deepest_block: usize,
    /// The files being read, outermost first, and the place of each include.
    open_files: Vec<PathBuf>,
    main_file: &'a Path,
    known_files: BTreeMap<PathBuf, FileId>,
    coordinate_systems: BTreeMap<String, CurrentTransform>,
    named_materials: BTreeMap<String, EntityId>,
    named_textures: BTreeMap<String, NamedTextures>,
    objects: BTreeMap<String, usize>,
    /// The objects that have instances, which may be defined after them: a number and the first use, by name.
    instantiated: BTreeMap<String, (u32, Span)>,
    /// Uses of named materials, resolved when all are known: `(shape's list, index, name)`.
    material_uses: Vec<MaterialUse>,
    /// The number of open files that were read before, and the number of directives from such files.
    repeated_files: usize,
    repeated_directives: RepeatedDirectives,
    /// Messages that are reported once for the scene.
    said: BTreeSet<String>,
    upgrader: Upgrader,
    /// True if there are no shaders beside the scene, one of which could have the name of an old material.
    is_without_shaders: Option<bool>,
}

struct MaterialUse {
    /// The object definition that contains the shape; `None` for the world.
    object: Option<usize>,
    shape: usize,
    name: Rc<str>,
    span: Span,
}

impl<'a> Interpreter<'a> {
    fn new(
        path: &'a Path,
        files: &'a dyn FileSource,
        budget: &'a InputBudget,
        map: &'a mut SourceMap,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        Interpreter {
            files,
            budget,
            deepest_block: 0,
            map,
            diagnostics,
            description: Description::default(),
            state: GraphicsState::new(),
            blocks: Vec::new(),
            open_files: Vec::new(),
            main_file: path,
            known_files: BTreeMap::new(),
            coordinate_systems: BTreeMap::new(),
            named_materials: BTreeMap::new(),
            named_textures: BTreeMap::new(),
            objects: BTreeMap::new(),
            instantiated: BTreeMap::new(),
            material_uses: Vec::new(),
            repeated_files: 0,
            repeated_directives: RepeatedDirectives::default(),
            said: BTreeSet::new(),
            upgrader: Upgrader::new(Target::Rtsl),
            is_without_shaders: None,
        }
    }

    fn finish(mut self) -> Description {
        self.close_blocks(0);
        self.resolve_materials();
        self.separate_textures();
        self.resolve_instances();
        self.description
    }

    fn read_main_file(&mut self) {
        if let Some(last) = self.read_file(self.main_file.to_owned(), None) {
            self.run(last);
        }
    }

    /// Reads a file to its end. Returns its last command if it is still to be executed: parameters for it may follow in
    /// the file that includes this one.
    fn read_file(&mut self, path: PathBuf, included_at: Option<Span>) -> Option<Command> {
        let known = self.known_files.get(&path).copied();
        let file = known.or_else(|| self.load_file(&path, included_at))?;
        self.open_files.push(path);
        self.repeated_files += usize::from(known.is_some());
        // The source map shares the text while this file is read.
        let text = self.map.file(file).text.clone();
        let mut parser = Parser::within(self.budget, file, &text);
        let mut last = None;
        while let Some(command) = parser.next_command(self.diagnostics) {
            if self.repeated_files > 0 && !self.count_repeated_directive(command.span) {
                break;
            }
            if let Some(command) = self.after_includes(command, &mut parser) {
                if parser.is_at_end() && takes_parameters(&command) {
                    last = Some(command);
                } else {
                    self.run(command);
                }
            }
            if self.budget.is_exceeded() {
                break;
            }
        }
        self.repeated_files -= usize::from(known.is_some());
        self.open_files.pop();
        last
    }

    /// Returns the command to execute: the given one, or if that includes a file, the last one there with the
    /// parameters that follow here.
    fn after_includes(&mut self, command: Command, parser: &mut Parser<'_>) -> Option<Command> {
        if command.is_broken || command.keyword != Keyword::Include {
            return Some(command);
        }
        let last = match self.include(&command) {
            Ok(last) => last?,
            Err(diagnostic) => {
                self.diagnostics.push(*diagnostic);
                return None;
            }
        };
        parser.continue_command(last, self.diagnostics)
    }

    /// Executes a command, or the commands that it becomes if the scene is one of an earlier version.
    fn run(&mut self, command: Command) {
        self.note_age(&command);
        if command.is_broken || !self.upgrader.is_old() {
            self.run_current(command);
            return;
        }
        let commands = self.upgrader.upgrade(command);
        for note in self.upgrader.take_notes() {
            self.warn_once(note.message, note.span);
        }
        commands.into_iter().for_each(|command| self.run_current(command));
    }

    /// Executes a command and reports its error. Errors that follow from it are not reported.
    fn run_current(&mut self, mut command: Command) {
        let name = command.texts.first().map(|name| name.text.clone());
        let (keyword, span) = (command.keyword, command.span);
        if command.is_broken {
            self.note_failure(keyword, span, name);
            return;
        }
        self.keep_last_parameters(&mut command);
        if let Err(diagnostic) = self.hold(&command).and_then(|()| self.execute(command)) {
            self.diagnostics.push(*diagnostic);
            self.note_failure(keyword, span, name);
        }
    }

    /// Makes uses of what a command would have defined, or blocks that it would have opened, no further errors.
    fn note_failure(&mut self, keyword: Keyword, span: Span, name: Option<String>) {
        let failed = match (keyword, name) {
            (Keyword::MakeNamedMaterial, Some(name)) => (ReferenceKind::Material, name),
            (Keyword::Texture, Some(name)) => (ReferenceKind::Texture, name),
            (Keyword::Camera, _) => (ReferenceKind::Camera, String::new()),
            (Keyword::Material, _) => {
                self.state.material = MaterialChoice::Default;
                return;
            }
            (Keyword::ObjectBegin, _) => {
                self.begin_object(String::new(), span);
                return;
            }
            _ => return,
        };
        self.description.failed.insert(failed);
    }

    /// Keeps the last of parameters of the same name.
    fn keep_last_parameters(&mut self, command: &mut Command) {
        let mut places = BTreeMap::new();
        let mut repeated = BTreeSet::new();
        for (index, parameter) in command.parameters.iter().enumerate() {
            if let Some(earlier) = places.insert(parameter.name.as_str(), index) {
                repeated.insert(earlier);
                let message =
                    format!("parameter `{}` is given twice: the last one counts", parameter.name);
                self.diagnostics.push(
                    Diagnostic::new(codes::IGNORED_SETTING, message)
                        .at(command.parameters[earlier].declaration, "ignored")
                        .label(parameter.declaration, "given again here"),
                );
            }
        }
        let mut index = 0..;
        command.parameters.retain(|_| index.next().is_none_or(|index| !repeated.contains(&index)));
    }

    /// Reports a part of the format that has no effect, or another one than in pbrt, once for the scene.
    fn warn_once(&mut self, message: impl Into<String>, span: Span) {
        self.say_once(Diagnostic::new(codes::IGNORED_SETTING, message.into()), span);
    }

    /// Reports a warning once for the scene, at a place.
    fn say_once(&mut self, warning: Diagnostic, span: Span) {
        if self.said.insert(warning.message.clone()) {
            self.diagnostics.push(warning.at(span, ""));
        }
    }

    /// Reports once that a name of a file has backslashes.
    fn note_backslashes(&mut self, name: &str, span: Span) {
        if with_slashes(name) != name {
            let message = "backslashes in the names of files count as slashes";
            self.say_once(Diagnostic::new(codes::MENDED_FAULT, message), span);
        }
    }

    /// Holds the memory that a command will occupy.
    fn hold(&mut self, command: &Command) -> Executed {
        let defaults = entity_kind(command.keyword).and_then(|kind| self.state.defaults.get(&kind));
        let mut amount = memory(command, defaults.map_or(&[], |list| list.as_slice()));
        // Closed blocks leave room for others.
        let begins = matches!(command.keyword, Keyword::AttributeBegin | Keyword::TransformBegin);
        if begins && self.blocks.len() >= self.deepest_block {
            self.deepest_block = self.blocks.len() + 1;
            amount += Amount::of::<Block>(2);
        }
        let held = self.budget.hold(amount).map_err(|error| {
            let path = self.open_files.last().map_or(Path::new(""), PathBuf::as_path);
            let diagnostic = error.diagnostic(path.display());
            Box::new(diagnostic.at(command.span, "reading stops before this one"))
        })?;
        held.keep(amount);
        Ok(())
    }

    /// True if one more directive is within the limit; reports once that it is not.
    fn count_repeated_directive(&mut self, span: Span) -> bool {
        let counted = self.repeated_directives.count(self.budget, span);
        let is_within = counted.is_ok();
        self.diagnostics.extend(counted.err().flatten());
        is_within
    }

    fn load_file(&mut self, path: &Path, included_at: Option<Span>) -> Option<FileId> {
        match read_text(self.files, path, self.budget) {
            Ok(text) => {
                if is_old_text(&text) {
                    self.upgrade_from_here();
                }
                let file = self.map.add(path.display().to_string(), text);
                self.known_files.insert(path.to_owned(), file);
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

    fn execute(&mut self, command: Command) -> Executed {
        self.check_part(&command)?;
        match command.keyword {
            Keyword::Identity => self.state.transform.set(Transform::IDENTITY),
            Keyword::Translate => {
                self.concatenate(Some(Transform::translate(array(&command))), &command)?
            }
            Keyword::Scale => {
                self.concatenate(Some(Transform::scale(array(&command))), &command)?
            }
            Keyword::Rotate => self.rotate(&command)?,
            Keyword::LookAt => self.look_at(&command)?,
            Keyword::Transform => self.state.transform.set(self.matrix(&command)?),
            Keyword::ConcatTransform => {
                let matrix = self.matrix(&command)?;
                self.concatenate(Some(matrix), &command)?;
            }
            Keyword::CoordinateSystem => {
                let name = first_text(&command).text.clone();
                self.coordinate_systems.insert(name, self.state.transform);
            }
            Keyword::CoordSysTransform => self.use_coordinate_system(&command)?,
            Keyword::TransformTimes => self.transform_times(&command)?,
            Keyword::ActiveTransform => self.active_transform(&command)?,
            Keyword::MediumInterface | Keyword::MakeNamedMedium => self.warn_once(
                "participating media are not supported: the scene is rendered without them",
                command.span,
            ),
            Keyword::ColorSpace => self.color_space(&command)?,
            // The picture is the same with any other.
            Keyword::Accelerator => {}
            Keyword::Option => self.options(command)?,
            // Executed by the loop over the commands of a file.
            Keyword::Include => {}
            Keyword::Import => self.import(&command)?,
            Keyword::WorldBegin => self.world_begin(command.span),
            Keyword::AttributeBegin => self.begin(BlockKind::Attribute, command.span),
            Keyword::TransformBegin => self.begin(BlockKind::Transform, command.span),
            Keyword::AttributeEnd => self.end(BlockKind::Attribute, &command)?,
            Keyword::TransformEnd => self.end(BlockKind::Transform, &command)?,
            Keyword::ReverseOrientation => self.state.reverse_orientation ^= true,
            Keyword::Attribute => self.attribute(command)?,
            Keyword::ObjectBegin => self.object_begin(&command)?,
            Keyword::ObjectEnd => self.end(BlockKind::Object, &command)?,
            Keyword::ObjectInstance => self.object_instance(&command)?,
            Keyword::Camera => self.camera(command)?,
            Keyword::Film => {
                self.warn_of_second(self.description.film, &command);
                self.description.film = Some(self.add(EntityKind::Film, command));
            }
            Keyword::PixelFilter => {
                self.warn_of_second(self.description.filter, &command);
                self.description.filter = Some(self.add(EntityKind::Filter, command));
            }
            Keyword::Sampler => {
                self.warn_of_second(self.description.sampler, &command);
                self.description.sampler = Some(self.add(EntityKind::Sampler, command));
            }
            Keyword::Integrator => {
                self.warn_of_second(self.description.integrator, &command);
                self.description.integrator = Some(self.add(EntityKind::Integrator, command));
            }
            Keyword::Material => {
                let material = self.add(EntityKind::Material, command);
                self.state.material = MaterialChoice::Made(material);
            }
            Keyword::MakeNamedMaterial => self.make_named_material(command)?,
            Keyword::NamedMaterial => {
                let name = first_text(&command);
                self.state.material = MaterialChoice::Named(name.text.as_str().into(), name.span);
            }
            Keyword::Texture => self.texture(command)?,
            Keyword::LightSource => {
                let light = self.add(EntityKind::Light, command);
                self.description.lights.push(light);
            }
            Keyword::AreaLightSource => {
                self.state.area_light = Some(self.add(EntityKind::AreaLight, command));
            }
            Keyword::Shape => self.shape(command)?,
            // An upgrade replaces the directives of earlier versions.
            Keyword::Renderer
            | Keyword::SearchPath
            | Keyword::SurfaceIntegrator
            | Keyword::Volume
            | Keyword::VolumeIntegrator
            | Keyword::WorldEnd => {}
        }
        Ok(())
    }

    /// Checks the position of a directive: some must precede `WorldBegin`, others follow it, most may do either.
    fn check_part(&self, command: &Command) -> Executed {
        let only_before = matches!(
            command.keyword,
            Keyword::Camera
                | Keyword::Film
                | Keyword::Sampler
                | Keyword::Integrator
                | Keyword::PixelFilter
                | Keyword::Accelerator
                | Keyword::TransformTimes
                | Keyword::WorldBegin
        );
        let only_after = matches!(
            command.keyword,
            Keyword::Shape
                | Keyword::LightSource
                | Keyword::AreaLightSource
                | Keyword::ObjectBegin
                | Keyword::ObjectEnd
                | Keyword::ObjectInstance
        );
        let word = command.keyword.word();
        let message = match self.description.world_begin.is_some() {
            true if only_before => {
                format!("`{word}` appears after `WorldBegin`, expected before it")
            }
            false if only_after => {
                format!("`{word}` appears before `WorldBegin`, expected after it")
            }
            true | false => return Ok(()),
        };
        Err(Box::new(Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, "")))
    }

    fn color_space(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        let Some(space) = ColorSpace::named(&name.text) else {
            let message = format!("`ColorSpace`: `{}` is not supported", name.text);
            let diagnostic =
                Diagnostic::new(codes::UNSUPPORTED_DIRECTIVE, message).at(name.span, "");
            return Err(Box::new(match most_similar(&name.text, ColorSpace::names()) {
                Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                None => {
                    let known: Vec<&str> = ColorSpace::names().collect();
                    diagnostic.help(format!("known are {}", known.join(", ")))
                }
            }));
        };
        self.state.color_space = space;
        Ok(())
    }
}

/// True if a list of parameters belongs to a command, to which the including file can add.
fn takes_parameters(command: &Command) -> bool {
    directive(command.keyword.word()).is_some_and(|(_, operands)| operands.parameters)
}

/// Errors are boxed: they are large and rare.
type Executed = Result<(), Box<Diagnostic>>;

/// The numbers of a command, whose count the parser has checked.
fn array<const COUNT: usize>(command: &Command) -> [f64; COUNT] {
    std::array::from_fn(|index| command.numbers.get(index).copied().unwrap_or(0.0))
}

/// The first quoted string of a command whose directive has one.
fn first_text(command: &Command) -> &SpannedText {
    &command.texts[0]
}

fn unknown_name<'a>(
    what: &str,
    name: &SpannedText,
    known: impl IntoIterator<Item = &'a str>,
) -> Box<Diagnostic> {
    let message = format!("unknown {what} `{}`", name.text);
    let diagnostic = Diagnostic::new(codes::UNKNOWN_SCENE_NAME, message).at(name.span, "");
    Box::new(match most_similar(&name.text, known) {
        Some(near) => diagnostic.suggest("did you mean this?", name.span, format!("\"{near}\"")),
        None => diagnostic,
    })
}

fn defined_twice(what: &str, name: &SpannedText, earlier: Span) -> Box<Diagnostic> {
    let message = format!("{what} `{}` is defined twice", name.text);
    Box::new(
        Diagnostic::new(codes::DUPLICATE_NAME, message)
            .at(name.span, "again here")
            .label(earlier, "first here"),
    )
}
