//! A scene with the files that it comes from: loaded once, or again and again while shaders and
//! parameters change.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rtsl::{Compiler, CompilerOptions, Diagnostics, Instance, Messages, SourceMap};
use rtsl_memory::{Amount, InputBudget};

use super::classes::Classes;
use super::description::{Description, Entity, EntityId};
use super::load::{Earlier, Loader, Made, Origins};
use super::scene::Scene;
use super::settings::Settings;
use super::standard_names::StandardName;
use crate::reader::{
    FileSource, Parameter, ParameterType, SceneFiles, Values, defines, read_scene_within,
};

/// What the command line adds to a scene.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// Folders for `#include` besides the scene's.
    pub search_path: Vec<PathBuf>,
    /// The memory that the scene's files may take; that of [`InputBudget::new`] where `None`.
    pub input_memory: Option<Amount>,
}

/// A scene that was loaded.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What of its description its parts come from.
    pub origins: Origins,
    /// Warnings.
    pub warnings: Messages,
    /// The time that reading took.
    pub read_time: Duration,
    /// The time for finding and checking the classes.
    pub compile_time: Duration,
}

/// Loads the scene in the file `path`.
///
/// # Errors
/// All errors of the scene and its shaders, with the warnings among them.
pub fn load_scene(
    path: &Path,
    files: &dyn FileSource,
    options: &LoadOptions,
) -> Result<Loaded, Messages> {
    SceneSource::read(path, files, options).load()
}

/// A scene's text as it was read, and what was made of it so far.
///
/// [`SceneSource::load`] may be called any number of times. What did not change since the last time,
/// neither its parameters nor its class nor anything that it refers to, is the same object again, by which
/// renderers see what they can keep.
pub struct SceneSource<'f> {
    path: PathBuf,
    files: &'f dyn FileSource,
    options: LoadOptions,
    map: SourceMap,
    description: Description,
    settings: Settings,
    /// What reading said.
    diagnostics: Diagnostics,
    read_time: Duration,
    classes: Classes<'f>,
    /// The instances of the last load, by entity.
    made: Vec<Option<Made>>,
    /// What the texts have left of the memory for files.
    budget: InputBudget,
    /// Entities of which a parameter was set since.
    changed: BTreeSet<EntityId>,
}

impl<'f> SceneSource<'f> {
    /// Reads the scene in the file `path`. What is wrong with its text, loading says.
    pub fn read(path: &Path, files: &'f dyn FileSource, options: &LoadOptions) -> Self {
        let folder = path.parent().unwrap_or(Path::new(""));
        let classes = Classes::new(Compiler::default(), files, folder);
        Self::read_with(path, files, options, classes)
    }

    /// Reads the scene's text again, without the parameters that were set since. Classes whose text did
    /// not change stay the same.
    pub fn read_again(&self) -> Self {
        Self::read_with(&self.path, self.files, &self.options, self.classes.clone())
    }

    fn read_with(
        path: &Path,
        files: &'f dyn FileSource,
        options: &LoadOptions,
        mut classes: Classes<'f>,
    ) -> Self {
        let start = Instant::now();
        let mut map = SourceMap::new();
        let mut diagnostics = Diagnostics::new();
        let budget = InputBudget::new(options.input_memory);
        let mut description = read_scene_within(path, files, &budget, &mut map, &mut diagnostics);
        defines::apply_defines(&mut description, &options.defines, &mut map, &mut diagnostics);
        let settings = Settings::read(&description, &mut diagnostics);
        let folder = path.parent().unwrap_or(Path::new(""));
        let search_path = std::iter::once(folder.to_owned());
        classes.refresh();
        classes.set_compiler(Compiler::new(CompilerOptions {
            loop_budget: Some(settings.loop_budget),
            search_path: search_path.chain(options.search_path.clone()).collect(),
        }));
        SceneSource {
            path: path.to_owned(),
            files,
            options: options.clone(),
            map,
            description,
            settings,
            diagnostics,
            read_time: start.elapsed(),
            classes,
            made: Vec::new(),
            budget,
            changed: BTreeSet::new(),
        }
    }

    /// Whether a file of the scene's own text differs from what was read.
    pub fn text_changed(&self) -> bool {
        let files = self.map.files().map(|(_, file)| file);
        let changed = |path: &Path, text: &str| match self.files.size(path) {
            Ok(size) if size != text.len() as u64 => true,
            Ok(_) => self.files.read(path).is_ok_and(|now| now != text.as_bytes()),
            // What stands in no file, such as the command line, can't change.
            Err(_) => false,
        };
        files.into_iter().any(|file| changed(Path::new(&file.name), &file.text))
    }

    /// Forgets the shaders' files, so that the next load reads them again.
    pub fn refresh_shaders(&mut self) {
        self.classes.refresh();
    }

    /// Makes the scene.
    ///
    /// # Errors
    /// All errors of the scene and its shaders, with the warnings among them. What was made before is
    /// kept for the next load.
    pub fn load(&mut self) -> Result<Loaded, Messages> {
        let start = Instant::now();
        let mut diagnostics = self.diagnostics.clone();
        let earlier = Earlier { made: &self.made, changed: &self.changed };
        // What an earlier load read is as good as gone where this one reads it again.
        let budget = self.budget.branch();
        self.classes.set_budget(&budget);
        let mut loader = Loader::new(
            SceneFiles { scene: &self.path, files: self.files, budget: &budget },
            &self.description,
            &mut self.classes,
            earlier,
            &mut diagnostics,
        );
        let scene = loader.scene(self.settings.clone());
        let made = loader.into_made();
        let mut messages = self.classes.messages().clone();
        if !diagnostics.is_empty() {
            messages.push(self.map.clone(), diagnostics);
        }
        match scene {
            Some((scene, origins)) if !messages.has_errors() => {
                self.made = made;
                self.changed.clear();
                self.classes.accept_refresh();
                Ok(Loaded {
                    scene,
                    origins,
                    warnings: messages,
                    read_time: self.read_time,
                    compile_time: start.elapsed(),
                })
            }
            Some(_) | None => {
                self.classes.undo_refresh();
                Err(messages)
            }
        }
    }

    /// The instance of an entity, as the last load made it.
    pub fn instance(&self, EntityId(index): EntityId) -> Option<&Arc<Instance>> {
        self.made.get(index)?.as_ref().map(|made| &made.instance)
    }

    /// The line of the scene's text in which an entity stands.
    pub fn line_of(&self, EntityId(index): EntityId) -> u32 {
        let span = self.description.entities[index].class_span;
        self.map.position(span.file, span.start).line
    }

    /// What the scene's text says, with the parameters that were set since.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// What a parameter of an entity is given, by the name that the class gives it.
    pub fn given_values(&self, EntityId(index): EntityId, name: &str) -> Option<Values> {
        let entity = &self.description.entities[index];
        let given = entity.parameters.iter().find(|it| class_name(entity, &it.name) == name);
        given.map(|parameter| parameter.values.clone()).or_else(|| {
            let mut defaults = StandardName::of(entity)?.defaults();
            let (_, numbers) = defaults.find(|(other, _)| *other == name)?;
            Some(Values::Numbers(numbers.to_vec()))
        })
    }

    /// Sets a parameter of an entity, by the name that the class gives it; the next load makes the
    /// entity and all that refers to it anew. Returns what stood before.
    pub fn set_parameter(&mut self, id: EntityId, name: &str, values: Values) -> Option<Parameter> {
        self.changed.insert(id);
        let parameter = given(&self.description.entities[id.0], name, values);
        self.replace_parameter(id, name, Some(parameter))
    }

    /// Goes back to what stood before a parameter was set, if no load made use of it.
    pub fn restore_parameter(&mut self, id: EntityId, name: &str, earlier: Option<Parameter>) {
        self.changed.remove(&id);
        self.replace_parameter(id, name, earlier);
    }

    fn replace_parameter(
        &mut self,
        EntityId(index): EntityId,
        name: &str,
        parameter: Option<Parameter>,
    ) -> Option<Parameter> {
        let entity = &mut self.description.entities[index];
        let place = entity.parameters.iter().position(|it| class_name(entity, &it.name) == name);
        let earlier = place.map(|place| entity.parameters.remove(place));
        entity.parameters.extend(parameter);
        earlier
    }

    /// The files that the scene was read from, shaders included.
    pub fn source_files(&self) -> Vec<PathBuf> {
        let own = self.map.files().map(|(_, file)| PathBuf::from(&file.name));
        own.filter(|path| path.is_file()).chain(self.classes.source_files()).collect()
    }
}

/// A parameter of `entity`, as the command line would give it.
fn given(entity: &Entity, name: &str, values: Values) -> Parameter {
    let span = entity.class_span;
    Parameter {
        kind: ParameterType::Given,
        name: name.to_owned(),
        declaration: span,
        values,
        values_span: span,
    }
}

/// What the class of an entity calls one of its parameters.
fn class_name<'a>(entity: &Entity, name: &'a str) -> &'a str {
    StandardName::of(entity).map_or(name, |standard| standard.parameter(name))
}
