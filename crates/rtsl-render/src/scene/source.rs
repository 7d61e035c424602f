//! A scene with the files that it comes from: loaded once, or again and again while shaders and
//! parameters change.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rtsl::{Compiler, CompilerOptions, Diagnostics, SourceMap};

use crate::messages::Messages;
use crate::reader::{
    FileSource, Parameter, ParameterType, SceneFiles, Values, defines, read_scene,
};

use super::classes::Classes;
use super::description::{Description, Entity, EntityId};
use super::load::{Loader, Made, Origins};
use super::scene::Scene;
use super::settings::Settings;
use super::standard_names::StandardName;

/// What the command line adds to a scene.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// Folders for `#include` besides the scene's.
    pub search_path: Vec<PathBuf>,
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
}

impl<'f> SceneSource<'f> {
    /// Reads the scene in the file `path`. What is wrong with its text, loading says.
    pub fn read(path: &Path, files: &'f dyn FileSource, options: &LoadOptions) -> Self {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut source = SceneSource {
            path: path.to_owned(),
            files,
            options: options.clone(),
            map: SourceMap::new(),
            description: Description::default(),
            settings: Settings::default(),
            diagnostics: Diagnostics::new(),
            read_time: Duration::ZERO,
            classes: Classes::new(Compiler::default(), files, folder),
            made: Vec::new(),
        };
        source.read_again();
        source
    }

    /// Reads the scene's text again. Changed parameters are forgotten.
    pub fn read_again(&mut self) {
        let start = Instant::now();
        self.map = SourceMap::new();
        self.diagnostics = Diagnostics::new();
        let Self { path, files, map, diagnostics, .. } = self;
        let mut description = read_scene(path, *files, map, diagnostics);
        defines::apply_defines(&mut description, &self.options.defines, map, diagnostics);
        self.settings = Settings::read(&description, diagnostics);
        self.description = description;
        self.read_time = start.elapsed();
        self.made = Vec::new();
        self.classes.set_compiler(Compiler::new(self.compiler_options()));
        self.classes.refresh();
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
        let mut loader = Loader::new(
            SceneFiles { scene: &self.path, files: self.files },
            &self.description,
            &mut self.classes,
            &self.made,
            &mut diagnostics,
        );
        let scene = loader.scene(self.settings.clone());
        let made = loader.into_made();
        let mut messages = self.classes.messages().clone();
        messages.push(self.map.clone(), diagnostics);
        match scene {
            Some((scene, origins)) if !messages.has_errors() => {
                self.made = made;
                Ok(Loaded {
                    scene,
                    origins,
                    warnings: messages,
                    read_time: self.read_time,
                    compile_time: start.elapsed(),
                })
            }
            Some(_) | None => Err(messages),
        }
    }

    /// What the scene's text says, with the parameters that were set since.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Sets a parameter of an entity, by the name that the class gives it; the next load makes the
    /// entity and all that refers to it anew. Returns what stood before.
    pub fn set_parameter(&mut self, id: EntityId, name: &str, values: Values) -> Option<Parameter> {
        let parameter = given(&self.description.entities[id.0], name, values);
        self.replace_parameter(id, name, Some(parameter))
    }

    /// Puts a parameter in the place of what stands, which is returned.
    pub fn replace_parameter(
        &mut self,
        EntityId(index): EntityId,
        name: &str,
        parameter: Option<Parameter>,
    ) -> Option<Parameter> {
        let entity = &mut self.description.entities[index];
        let standard = StandardName::find(entity.kind, &entity.class);
        let named =
            |it: &Parameter| standard.map_or(&*it.name, |its| its.parameter(&it.name)) == name;
        let place = entity.parameters.iter().position(named);
        let earlier = place.map(|place| entity.parameters.remove(place));
        entity.parameters.extend(parameter);
        if let Some(made) = self.made.get_mut(index) {
            *made = None;
        }
        earlier
    }

    /// The files that the scene was read from, shaders included.
    pub fn source_files(&self) -> Vec<PathBuf> {
        let own = self.map.files().map(|(_, file)| PathBuf::from(&file.name));
        own.filter(|path| path.is_file()).chain(self.classes.source_files()).collect()
    }

    fn compiler_options(&self) -> CompilerOptions {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let search_path = std::iter::once(folder.to_owned());
        CompilerOptions {
            loop_budget: Some(self.settings.loop_budget),
            search_path: search_path.chain(self.options.search_path.clone()).collect(),
        }
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
