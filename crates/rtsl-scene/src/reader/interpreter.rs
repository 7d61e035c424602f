//! Executes the directives of a scene, with one method for each, and builds its description.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use rtsl::{
    Diagnostic, Diagnostics, FileId, SourceMap, Span, diagnostic_codes as codes, most_similar,
};
use rtsl_math::Transform;
use rtsl_memory::{Amount, InputBudget};

use super::command_memory::{entity_kind, memory};
use super::current_transform::{ActiveTimes, CurrentTransform};
use super::directive::Keyword;
use super::files::{FileSource, Input, SceneFiles, resolve, unreadable};
use super::parameter::{COLOR, Parameter, ParameterType, Values};
use super::parser::{Command, Parser, SpannedText};
use super::spectra;
use super::state::{Block, BlockKind, GraphicsState, MaterialChoice};
use crate::{Description, Entity, EntityId, EntityKind, InstanceUse, ObjectDefinition, ShapeUse};

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

    // Transforms.

    fn concatenate(&mut self, transform: Option<Transform>, command: &Command) -> Executed {
        let Some(transform) = transform else {
            let message = format!(
                "`{}` is given vectors without a direction, expected a frame",
                command.keyword.word()
            );
            return Err(Box::new(
                Diagnostic::new(codes::BAD_TRANSFORM, message).at(command.span, ""),
            ));
        };
        self.state.transform.concatenate(transform);
        Ok(())
    }

    fn rotate(&mut self, command: &Command) -> Executed {
        let [degrees, x, y, z] = array(command);
        self.concatenate(Transform::rotate(degrees, [x, y, z]), command)
    }

    fn look_at(&mut self, command: &Command) -> Executed {
        let n: [f64; 9] = array(command);
        let transform =
            Transform::look_at([n[0], n[1], n[2]], [n[3], n[4], n[5]], [n[6], n[7], n[8]]);
        self.concatenate(transform, command)
    }

    fn matrix(&self, command: &Command) -> Result<Transform, Box<Diagnostic>> {
        let matrix = Transform::from_columns(&array(command));
        if matrix.is_affine() {
            return Ok(matrix);
        }
        let message = "the matrix is not affine: every fourth number must be 0, the last 1";
        Err(Box::new(Diagnostic::new(codes::BAD_TRANSFORM, message).at(command.span, "")))
    }

    fn use_coordinate_system(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        match self.coordinate_systems.get(&name.text) {
            Some(transform) => {
                self.state.transform.set_all(*transform);
                Ok(())
            }
            None => {
                let names = self.coordinate_systems.keys().map(String::as_str);
                Err(unknown_name("coordinate system", name, names))
            }
        }
    }

    fn active_transform(&mut self, command: &Command) -> Executed {
        self.state.transform.active = match first_text(command).text.as_str() {
            "All" => ActiveTimes::All,
            "StartTime" => ActiveTimes::Start,
            "EndTime" => ActiveTimes::End,
            _ => {
                let message = "expected `StartTime`, `EndTime` or `All`";
                let diagnostic = Diagnostic::new(codes::SCENE_SYNTAX, message);
                return Err(Box::new(diagnostic.at(first_text(command).span, "")));
            }
        };
        Ok(())
    }

    fn transform_times(&mut self, command: &Command) -> Executed {
        let [start, end] = array(command);
        if start < end {
            self.description.transform_times = [start, end];
            return Ok(());
        }
        let message = format!("the motion starts at {start} and ends at {end}, not after it");
        Err(Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(command.span, "")))
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

    // Files and blocks.

    fn include(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        let from = self.open_files.last().cloned().unwrap_or_default();
        let path = resolve(&from, &name.text);
        let cycle = self.open_files.contains(&path);
        if cycle || self.open_files.len() >= MAX_INCLUDE_DEPTH {
            let message = if cycle {
                format!("`{}` includes itself", path.display())
            } else {
                format!("files include one another more than {MAX_INCLUDE_DEPTH} deep")
            };
            let chain: Vec<String> =
                self.open_files.iter().map(|path| path.display().to_string()).collect();
            return Err(Box::new(
                Diagnostic::new(codes::INCLUDE_CYCLE, message)
                    .at(name.span, "included again here")
                    .note(format!("open files: {}", chain.join(" -> "))),
            ));
        }
        self.read_file(path, Some(name.span));
        Ok(())
    }

    fn world_begin(&mut self) {
        self.in_world = true;
        self.state.transform = CurrentTransform::IDENTITY;
        self.coordinate_systems.insert("world".to_owned(), CurrentTransform::IDENTITY);
    }

    fn begin(&mut self, kind: BlockKind, command: &Command) {
        let saved = self.state.clone();
        self.blocks.push(Block { kind, span: command.span, saved });
    }

    fn end(&mut self, kind: BlockKind, command: &Command) -> Executed {
        let misplaced = |message: String| {
            Box::new(Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""))
        };
        match self.blocks.pop_if(|block| block.kind == kind) {
            Some(block) if kind == BlockKind::Transform => {
                self.state.transform = block.saved.transform;
                Ok(())
            }
            Some(block) => {
                self.state = block.saved;
                Ok(())
            }
            None => Err(match self.blocks.last() {
                None => misplaced(format!("`{}` without its `{}`", kind.end(), kind.begin())),
                Some(open) => {
                    let message = format!("found `{}`, expected `{}`", kind.end(), open.kind.end());
                    Box::new(misplaced(message).label(open.span, "this block is open"))
                }
            }),
        }
    }

    fn attribute(&mut self, mut command: Command) -> Executed {
        let target = first_text(&command);
        let kind = match target.text.as_str() {
            "shape" => EntityKind::Shape,
            "light" => EntityKind::Light,
            "material" => EntityKind::Material,
            "texture" => EntityKind::Texture,
            _ => {
                let known = ["shape", "light", "material", "texture"];
                return Err(unknown_name("target of `Attribute`", target, known));
            }
        };
        self.convert_spectra(kind, &mut command.parameters);
        let list = Rc::make_mut(self.state.defaults.entry(kind).or_default());
        list.extend(command.parameters);
        let values: usize = list.iter().map(|parameter| parameter.values.len()).sum();
        if list.len() <= MAX_ATTRIBUTES && values <= MAX_ATTRIBUTE_VALUES {
            return Ok(());
        }
        list.clear();
        let message = format!(
            "`Attribute` gives more than {MAX_ATTRIBUTES} parameters or {MAX_ATTRIBUTE_VALUES} values"
        );
        Err(Box::new(Diagnostic::new(codes::SCENE_LIMIT, message).at(command.span, "")))
    }

    // Objects.

    fn open_object(&self) -> Option<usize> {
        let inside = self.blocks.iter().any(|block| block.kind == BlockKind::Object);
        inside.then(|| self.description.objects.len() - 1)
    }

    fn object_begin(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        if self.open_object().is_some() {
            let message = "an object is defined inside another object";
            return Err(Box::new(
                Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""),
            ));
        }
        if let Some(earlier) = self.objects.get(&name.text) {
            let earlier = self.description.objects[*earlier].span;
            return Err(defined_twice("object", name, earlier));
        }
        self.objects.insert(name.text.clone(), self.description.objects.len());
        self.description.objects.push(ObjectDefinition {
            name: name.text.clone(),
            span: name.span,
            shapes: Vec::new(),
        });
        self.begin(BlockKind::Object, command);
        Ok(())
    }

    fn object_instance(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        if self.open_object().is_some() {
            let message = "an instance is placed inside the definition of an object";
            return Err(Box::new(
                Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""),
            ));
        }
        let Some(object) = self.objects.get(&name.text) else {
            let names = self.objects.keys().map(String::as_str);
            return Err(unknown_name("object", name, names));
        };
        self.check_regular(command)?;
        self.description.instances.push(InstanceUse {
            object: *object,
            span: command.span,
            transform: self.state.transform.start(),
            end_transform: self.state.transform.end(),
        });
        Ok(())
    }

    fn shape(&mut self, command: Command) -> Executed {
        self.check_regular(&command)?;
        let object = self.open_object();
        let shape = self.add(EntityKind::Shape, command);
        let list = match object {
            Some(object) => &mut self.description.objects[object].shapes,
            None => &mut self.description.shapes,
        };
        let material = match &self.state.material {
            MaterialChoice::Default => None,
            MaterialChoice::Made(material) => Some(*material),
            MaterialChoice::Named(name, span) => {
                let use_ =
                    MaterialUse { object, shape: list.len(), name: name.clone(), span: *span };
                self.material_uses.push(use_);
                None
            }
        };
        list.push(ShapeUse {
            shape,
            material,
            area_light: self.state.area_light,
            reverse_orientation: self.state.reverse_orientation,
        });
        Ok(())
    }

    fn check_regular(&self, command: &Command) -> Executed {
        if self.state.transform.inverse().is_some() {
            return Ok(());
        }
        let transform = &self.state.transform;
        let flattens = [Some(transform.start()), transform.end()].into_iter().flatten();
        let message = match flattens.map(Transform::inverse).any(|inverse| inverse.is_none()) {
            true => "the current transform has no inverse: it flattens what it places",
            false => "the current transform moves from one side of a mirror to the other",
        };
        Err(Box::new(Diagnostic::new(codes::BAD_TRANSFORM, message).at(command.span, "")))
    }

    // Entities.

    fn camera(&mut self, command: Command) -> Executed {
        self.check_unique(self.description.camera, &command)?;
        self.check_regular(&command)?;
        if let Some(inverse) = self.state.transform.inverse() {
            self.coordinate_systems.insert("camera".to_owned(), inverse);
        }
        self.description.camera = Some(self.add(EntityKind::Camera, command));
        Ok(())
    }

    fn check_unique(&self, earlier: Option<EntityId>, command: &Command) -> Executed {
        let Some(earlier) = earlier else { return Ok(()) };
        let word = command.keyword.word();
        let message = format!("the scene has a second `{word}`");
        Err(Box::new(
            Diagnostic::new(codes::DUPLICATE_NAME, message)
                .at(command.span, "again here")
                .label(self.description.entities[earlier.0].class_span, "first here"),
        ))
    }

    fn make_named_material(&mut self, mut command: Command) -> Executed {
        let name = first_text(&command).clone();
        if let Some(earlier) = self.named_materials.get(&name.text) {
            let earlier = self.description.entities[earlier.0].class_span;
            return Err(defined_twice("material", &name, earlier));
        }
        // The class is the value of a parameter here: "string type" "Lambertian".
        let position = command.parameters.iter().position(|parameter| parameter.name == "type");
        let class = position.map(|position| command.parameters.remove(position));
        let class = match class.map(|class| (class.kind, class.values, class.values_span)) {
            Some((ParameterType::Text, Values::Texts(texts), span)) if texts.len() == 1 => {
                SpannedText { text: texts.into_iter().next().unwrap_or_default(), span }
            }
            _ => {
                let message = format!("material `{}` has no class", name.text);
                return Err(Box::new(
                    Diagnostic::new(codes::UNKNOWN_CLASS, message)
                        .at(name.span, "")
                        .help("give it as \"string type\" \"Lambertian\""),
                ));
            }
        };
        command.texts[0] = class;
        let material = self.add(EntityKind::Material, command);
        self.description.entities[material.0].name = Some(name.text.clone());
        self.named_materials.insert(name.text, material);
        Ok(())
    }

    fn texture(&mut self, mut command: Command) -> Executed {
        let name = command.texts[0].clone();
        let kind = &command.texts[1];
        if !["float", "spectrum", "color", "rgb"].contains(&kind.text.as_str()) {
            return Err(unknown_name(
                "type of texture",
                kind,
                ["float", "spectrum", "color", "rgb"],
            ));
        }
        if let Some(earlier) = self.named_textures.get(&name.text) {
            let earlier = self.description.entities[earlier.0].class_span;
            return Err(defined_twice("texture", &name, earlier));
        }
        command.texts.swap(0, 2);
        let texture = self.add(EntityKind::Texture, command);
        self.description.entities[texture.0].name = Some(name.text.clone());
        self.named_textures.insert(name.text, texture);
        Ok(())
    }

    /// Adds an entity whose class is the command's first quoted string.
    fn add(&mut self, kind: EntityKind, command: Command) -> EntityId {
        let mut parameters = command.parameters;
        self.convert_spectra(kind, &mut parameters);
        if let Some(defaults) = self.state.defaults.get(&kind) {
            let given: BTreeSet<String> =
                parameters.iter().map(|parameter| parameter.name.clone()).collect();
            let missing = defaults.iter().filter(|default| !given.contains(&default.name));
            parameters.extend(missing.cloned());
        }
        let name = parameters
            .iter()
            .position(|parameter| parameter.name == "name" && parameter.kind == ParameterType::Text)
            .map(|position| parameters.remove(position));
        let name = name.and_then(|name| match name.values {
            Values::Texts(texts) => texts.into_iter().next(),
            Values::Numbers(_) | Values::Booleans(_) => None,
        });
        let mut texts = command.texts;
        let class = texts.swap_remove(0);
        self.description.entities.push(Entity {
            kind,
            class: class.text,
            class_span: class.span,
            name,
            parameters,
            transform: self.state.transform.start(),
            end_transform: self.state.transform.end(),
        });
        EntityId(self.description.entities.len() - 1)
    }

    /// Converts spectra to colours; an invalid one is reported and becomes grey.
    fn convert_spectra(&mut self, kind: EntityKind, parameters: &mut [Parameter]) {
        let emits = matches!(kind, EntityKind::Light | EntityKind::AreaLight);
        // Paths are relative to the folder of the main scene file, also in included files.
        let scene = self.open_files.first().map_or(Path::new(""), PathBuf::as_path);
        for parameter in parameters {
            let files = SceneFiles { scene, files: self.files, budget: self.budget };
            if let Err(diagnostic) = spectra::convert(parameter, emits, files) {
                parameter.kind = COLOR;
                parameter.values = Values::Numbers(vec![0.5]);
                self.diagnostics.push(*diagnostic);
            }
        }
    }

    fn resolve_materials(&mut self) {
        for use_ in std::mem::take(&mut self.material_uses) {
            let Some(material) = self.named_materials.get(&*use_.name) else {
                let name = SpannedText { text: use_.name.to_string(), span: use_.span };
                let names = self.named_materials.keys().map(String::as_str);
                self.diagnostics.push(*unknown_name("material", &name, names));
                continue;
            };
            let list = match use_.object {
                Some(object) => &mut self.description.objects[object].shapes,
                None => &mut self.description.shapes,
            };
            list[use_.shape].material = Some(*material);
        }
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
