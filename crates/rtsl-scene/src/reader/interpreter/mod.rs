//! Executes the directives of a scene, with one method for each, and builds its description.

mod blocks;
mod entities;
mod includes;
mod objects;
mod transforms;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use rtsl::{
    Diagnostic, Diagnostics, FileId, SourceMap, Span, diagnostic_codes as codes, most_similar,
};
use rtsl_math::Transform;
use rtsl_memory::{Amount, InputBudget};

use super::command_memory::{entity_kind, memory};
use super::current_transform::CurrentTransform;
use super::directive::Keyword;
use super::files::{FileSource, Input, unreadable};
use super::parser::{Command, Parser, SpannedText};
use super::state::{Block, BlockKind, GraphicsState, MaterialChoice};
use crate::{Description, EntityId, EntityKind};

/// The greatest depth of nested includes.
const MAX_INCLUDE_DEPTH: usize = 64;

/// The greatest number of directives from files that were included before: files that include one another twice would
/// otherwise expand without bound.
const MAX_REPEATED_DIRECTIVES: usize = 1_000_000;

/// The greatest number of parameters, and of their values, that `Attribute` may set for following entities.
const MAX_ATTRIBUTES: usize = 64;
const MAX_ATTRIBUTE_VALUES: usize = 1024;

/// The memory of a file's text, as a multiple of its length: the text itself and the index of its lines.
const TEXT_EXPANSION: usize = 5;

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
    let mut interpreter = Interpreter::new(files, budget, map, diagnostics);
    interpreter.read_file(path.to_owned(), None);
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
    in_world: bool,
    /// The files being read, outermost first, and the place of each include.
    open_files: Vec<PathBuf>,
    known_files: BTreeMap<PathBuf, FileId>,
    coordinate_systems: BTreeMap<String, CurrentTransform>,
    named_materials: BTreeMap<String, EntityId>,
    named_textures: BTreeMap<String, EntityId>,
    objects: BTreeMap<String, usize>,
    /// Uses of named materials, resolved when all are known: `(shape's list, index, name)`.
    material_uses: Vec<MaterialUse>,
    /// The number of open files that were read before, and the number of directives from such files.
    repeated_files: usize,
    repeated_directives: usize,
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
            in_world: false,
            open_files: Vec::new(),
            known_files: BTreeMap::new(),
            coordinate_systems: BTreeMap::new(),
            named_materials: BTreeMap::new(),
            named_textures: BTreeMap::new(),
            objects: BTreeMap::new(),
            material_uses: Vec::new(),
            repeated_files: 0,
            repeated_directives: 0,
        }
    }

    fn finish(mut self) -> Description {
        for block in std::mem::take(&mut self.blocks) {
            self.diagnostics.push(
                Diagnostic::new(
                    codes::MISPLACED_DIRECTIVE,
                    format!("`{}` without its `{}`", block.kind.begin(), block.kind.end()),
                )
                .at(block.span, "this block is never closed"),
            );
        }
        self.resolve_materials();
        self.description
    }

    fn read_file(&mut self, path: PathBuf, included_at: Option<Span>) {
        let known = self.known_files.get(&path).copied();
        let Some(file) = known.or_else(|| self.load_file(&path, included_at)) else { return };
        self.open_files.push(path);
        self.repeated_files += usize::from(known.is_some());
        // The source map shares the text while this file is read.
        let text = self.map.file(file).text.clone();
        let mut parser = Parser::within(self.budget, file, &text);
        while let Some(command) = parser.next_command(self.diagnostics) {
            if self.repeated_files > 0 && !self.count_repeated_directive(command.span) {
                break;
            }
            if let Err(diagnostic) = self.hold(&command).and_then(|()| self.execute(command)) {
                self.diagnostics.push(*diagnostic);
            }
            if self.budget.is_exceeded() {
                break;
            }
        }
        self.repeated_files -= usize::from(known.is_some());
        self.open_files.pop();
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
        self.repeated_directives += 1;
        if self.repeated_directives == MAX_REPEATED_DIRECTIVES + 1 {
            let message = format!(
                "files included more than once give more than {MAX_REPEATED_DIRECTIVES} directives"
            );
            self.diagnostics.push(
                Diagnostic::new(codes::SCENE_LIMIT, message)
                    .at(span, "reading stops before this one")
                    .help("place repeated parts with `ObjectInstance`"),
            );
        }
        self.repeated_directives <= MAX_REPEATED_DIRECTIVES
    }

    fn load_file(&mut self, path: &Path, included_at: Option<Span>) -> Option<FileId> {
        let text =
            Input::read(self.files, path, self.budget).and_then(|Input { bytes, mut held }| {
                let amount = Amount(bytes.len() as u64).times(TEXT_EXPANSION);
                held.grow_to(amount)?;
                held.keep(amount);
                String::from_utf8(bytes).map_err(|_| std::io::Error::other("it is not UTF-8"))
            });
        match text {
            Ok(text) => {
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
            Keyword::MediumInterface | Keyword::MakeNamedMedium => {
                return Err(unsupported(&command, "participating media"));
            }
            Keyword::ColorSpace => self.color_space(&command)?,
            Keyword::Accelerator | Keyword::Option => self.ignore(&command),
            Keyword::Include => self.include(&command)?,
            Keyword::Import => self.include(&command)?,
            Keyword::WorldBegin => self.world_begin(),
            Keyword::AttributeBegin => self.begin(BlockKind::Attribute, &command),
            Keyword::TransformBegin => self.begin(BlockKind::Transform, &command),
            Keyword::AttributeEnd => self.end(BlockKind::Attribute, &command)?,
            Keyword::TransformEnd => self.end(BlockKind::Transform, &command)?,
            Keyword::ReverseOrientation => self.state.reverse_orientation ^= true,
            Keyword::Attribute => self.attribute(command)?,
            Keyword::ObjectBegin => self.object_begin(&command)?,
            Keyword::ObjectEnd => self.end(BlockKind::Object, &command)?,
            Keyword::ObjectInstance => self.object_instance(&command)?,
            Keyword::Camera => self.camera(command)?,
            Keyword::Film => {
                self.check_unique(self.description.film, &command)?;
                self.description.film = Some(self.add(EntityKind::Film, command));
            }
            Keyword::PixelFilter => {
                self.check_unique(self.description.filter, &command)?;
                self.description.filter = Some(self.add(EntityKind::Filter, command));
            }
            Keyword::Sampler => {
                self.check_unique(self.description.sampler, &command)?;
                self.description.sampler = Some(self.add(EntityKind::Sampler, command));
            }
            Keyword::Integrator => {
                self.check_unique(self.description.integrator, &command)?;
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
        let message = match self.in_world {
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
        if name.text.eq_ignore_ascii_case("srgb") {
            return Ok(());
        }
        Err(unsupported(command, "any colour space but `srgb`"))
    }

    fn ignore(&mut self, command: &Command) {
        let message = format!("`{}` has no effect on this renderer", command.keyword.word());
        self.diagnostics
            .push(Diagnostic::new(codes::IGNORED_SETTING, message).at(command.span, ""));
    }
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

fn unsupported(command: &Command, what: &str) -> Box<Diagnostic> {
    let message = format!("`{}`: {what} is not supported", command.keyword.word());
    Box::new(Diagnostic::new(codes::UNSUPPORTED_DIRECTIVE, message).at(command.span, ""))
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
