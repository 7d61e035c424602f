//! A scene with its source files: loaded once, or repeatedly while shaders and parameters change.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rtsl::{
    Compiler, CompilerOptions, Diagnostic, Diagnostics, Instance, Messages, SourceMap, Span,
    diagnostic_codes as codes,
};
use rtsl_memory::{Amount, InputBudget};

use super::classes::Classes;
use super::description::{Description, Entity, EntityId, EntityKind};
use super::gltf::{FileAttributes, is_gltf, read_gltf_scene};
use super::load::{Earlier, Kept, Loader, Made, Origins};
use super::materialx::add_materials;
use super::mesh_scene::{is_mesh_file, read_mesh_scene};
use super::not_scene::shader_instead_of_scene;
use super::pbrt::{PbrtName, add_missing_camera, class_name, share_film_size};
use super::presence::Presences;
use super::scene::Scene;
use super::settings::{INTERACTIVE, Settings, class_of_integrator};
use super::standard::PATH_TRACER;
use super::studio::{add_studio, has_studio};
use crate::reader::{
    Fence, FileSource, FilesRef, Input, Parameter, ParameterType, SceneFiles, Values, defines,
    is_compressed, read_scene_within,
};

/// Options of loading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Definitions `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// Folders for `#include` besides the scene's.
    pub search_path: Vec<PathBuf>,
    /// The camera of a glTF file, by its name or index; its first one if `None`.
    pub camera: Option<String>,
    /// True if a studio lights the scene besides its own lights.
    pub studio: bool,
    /// The integrator in place of the scene's, by a name of the format or a renderer, or a class. It takes over the
    /// parameters of the scene's that it has, too.
    pub integrator: Option<String>,
    /// The memory budget for the scene's files; that of [`InputBudget::new`] if `None`.
    pub input_memory: Option<Amount>,
    /// The memory of textures from images; an eighth of the budget if `None`. Further ones are in temporary files.
    pub texture_memory: Option<Amount>,
    /// True if classes are compiled for engines with a trace.
    pub traced: bool,
}

impl LoadOptions {
    /// Options with an integrator in place of the scene's.
    pub fn with_integrator(name: &str) -> LoadOptions {
        LoadOptions { integrator: Some(name.to_owned()), ..LoadOptions::default() }
    }
}

/// A loaded scene.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// The entities from which its parts were made.
    pub origins: Origins,
    /// Warnings.
    pub warnings: Messages,
    /// The time for reading files.
    pub read_time: Duration,
    /// The time for finding and checking the classes.
    pub compile_time: Duration,
}

/// Loads the scene in the file `path`.
///
/// ```
/// use std::path::{Path, PathBuf};
///
/// use rtsl_scene::reader::MemoryFiles;
/// use rtsl_scene::{LoadOptions, load_scene};
///
/// let text = "Camera \"Pinhole\"\nWorldBegin\nShape \"Sphere\" \"float radius\" 2\n";
/// let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text.to_owned())].into());
/// let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
/// let scene = loaded.expect("the scene has no errors").scene;
/// assert_eq!(scene.objects[0].primitive.class().name, "Sphere");
/// ```
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

/// The text of a scene, and the instances made from it so far.
///
/// ```
/// use std::path::{Path, PathBuf};
///
/// use rtsl_scene::reader::{MemoryFiles, Values};
/// use rtsl_scene::{EntityId, LoadOptions, SceneSource};
///
/// let text = "Camera \"Pinhole\"\nWorldBegin\nShape \"Sphere\" \"float radius\" 2\n";
/// let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text.to_owned())].into());
/// let mut source = SceneSource::read(Path::new("scene.pbrt"), &files, &LoadOptions::default());
/// let before = source.load().expect("the scene has no errors").scene;
/// let sphere = source.description().entities.iter().position(|it| it.class == "Sphere");
/// source.set_parameter(EntityId(sphere.unwrap()), "radius", Values::Numbers(vec![3.0]));
/// let after = source.load().expect("the radius is a float").scene;
/// assert!(std::sync::Arc::ptr_eq(&before.camera, &after.camera));
/// assert!(!std::sync::Arc::ptr_eq(&before.objects[0].primitive, &after.objects[0].primitive));
/// ```
///
/// [`SceneSource::load`] may be called repeatedly. An instance is the same object as after the previous load if its
/// parameters, its class and everything that it refers to did not change; renderers use this to see what they can keep.
pub struct SceneSource<'f> {
    path: PathBuf,
    files: FilesRef<'f>,
    options: LoadOptions,
    map: SourceMap,
    description: Description,
    settings: Settings,
    /// The messages of reading.
    diagnostics: Diagnostics,
    read_time: Duration,
    classes: Classes<'f>,
    /// The instances of the last load, by entity.
    made: Vec<Option<Made>>,
    /// The attributes of the last load that a glTF file gives its shapes.
    attributes: Arc<FileAttributes>,
    /// The alpha textures of its materials with holes.
    presences: Presences,
    /// The budget that is left for files after the scene's text.
    budget: InputBudget,
    /// Entities with a parameter that was set since the last load.
    changed: BTreeSet<EntityId>,
    /// The digest of a scene that is no text.
    contents: Option<blake3::Hash>,
}

impl<'f> SceneSource<'f> {
    /// Reads the scene in the file `path`. Errors in its text are reported by loading.
    pub fn read(path: &Path, files: &'f dyn FileSource, options: &LoadOptions) -> Self {
        Self::read_from(path, FilesRef::Borrowed(files), options)
    }

    /// Reads the scene in the file `path` among files that it may keep.
    pub fn read_from(path: &Path, files: FilesRef<'f>, options: &LoadOptions) -> Self {
        let folder = path.parent().unwrap_or(Path::new(""));
        let classes = Classes::new(Compiler::default(), files.clone(), folder);
        Self::read_with(path, files, options, classes)
    }

    /// Reads the scene's text again, without the parameters that were set since. Classes whose text did not change stay
    /// the same.
    pub fn read_again(&self) -> Self {
        Self::read_with(&self.path, self.files.clone(), &self.options, self.classes.clone())
    }

    fn read_with(
        path: &Path,
        files: FilesRef<'f>,
        options: &LoadOptions,
        mut classes: Classes<'f>,
    ) -> Self {
        let _span = tracing::debug_span!("read_scene", file = %path.display()).entered();
        let start = Instant::now();
        let mut map = SourceMap::new();
        let mut diagnostics = Diagnostics::new();
        let budget = InputBudget::new(options.input_memory);
        let mut description = read(path, &*files, options, &budget, &mut map, &mut diagnostics);
        if options.studio {
            let option = "--studio";
            let span = Span::new(map.add(option, option), 0, option.len() as u32);
            add_studio(&mut description, path, 1.0, span, &budget);
        }
        add_missing_camera(&mut description, &mut diagnostics);
        description.own_integrator = description.integrator;
        let is_text = !is_gltf(path) && !is_mesh_file(path);
        let contents = if is_text { None } else { digest(path, &*files, options) };
        if let Some(integrator) = &options.integrator {
            defines::set_integrator(&mut description, integrator, &mut map);
        }
        defines::apply_defines(&mut description, &options.defines, &mut map, &mut diagnostics);
        share_film_size(&mut description);
        let settings = Settings::read(&description, &mut diagnostics);
        let folder = path.parent().unwrap_or(Path::new(""));
        let search_path = std::iter::once(folder.to_owned());
        classes.refresh();
        classes.set_compiler(Compiler::new(CompilerOptions {
            loop_budget: Some(settings.loop_budget),
            search_path: search_path.chain(options.search_path.clone()).collect(),
            traced: options.traced,
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
            attributes: Arc::default(),
            presences: Presences::default(),
            budget,
            changed: BTreeSet::new(),
            contents,
        }
    }

    /// Returns the scene as it is, with the parameters that were set, for engines with a trace: the next load compiles
    /// its classes with prints and places.
    #[must_use]
    pub fn traced(&self) -> Self {
        let mut classes = self.classes.clone();
        classes.refresh();
        classes.set_traced();
        SceneSource {
            path: self.path.clone(),
            files: self.files.clone(),
            options: LoadOptions { traced: true, ..self.options.clone() },
            map: self.map.clone(),
            description: self.description.clone(),
            settings: self.settings.clone(),
            diagnostics: self.diagnostics.clone(),
            read_time: self.read_time,
            classes,
            made: Vec::new(),
            attributes: Arc::default(),
            presences: Presences::default(),
            budget: self.budget.clone(),
            changed: BTreeSet::new(),
            contents: self.contents,
        }
    }

    /// True if a shader file of the scene may print. Comments may have the word, too.
    pub fn has_prints(&self) -> bool {
        self.classes.has_prints()
    }

    /// True if a file of the scene's text differs from the text that was read.
    pub fn text_changed(&self) -> bool {
        let files = self.map.files().map(|(_, file)| file);
        let changed = |path: &Path, text: &str| match self.files.size(path) {
            Ok(size) if size != text.len() as u64 && !is_compressed(&*self.files, path) => true,
            Ok(_) => {
                let now =
                    Input::read(&*self.files, path, &InputBudget::new(self.options.input_memory));
                now.is_ok_and(|now| now.bytes != text.as_bytes())
            }
            // Sources without a file, such as the command line, cannot change.
            Err(_) => false,
        };
        let is_other = self.contents.is_some()
            && digest(&self.path, &*self.files, &self.options)
                .is_some_and(|now| Some(now) != self.contents);
        is_other || files.into_iter().any(|file| changed(Path::new(&file.name), &file.text))
    }

    /// Discards the shader files, so that the next load reads them again.
    pub fn refresh_shaders(&mut self) {
        self.classes.refresh();
    }

    /// Returns the names of integrators that the scene can have: the interactive renderer, the scene's own, and those of
    /// the standard library.
    pub fn integrators(&self) -> Vec<String> {
        let own = self.description.own_integrator;
        let own = own.map(|EntityId(index)| &self.description.entities[index]);
        let own = own.filter(|own| class_of_integrator(own) == PATH_TRACER);
        let is_other = |name: &&str| own.is_none_or(|own| !own.class.eq_ignore_ascii_case(name));
        let standard = Classes::standard_integrators().filter(is_other).map(str::to_owned);
        let own = own.map(|own| own.class.clone());
        [INTERACTIVE.to_owned()].into_iter().chain(own).chain(standard).collect()
    }

    /// Returns the integrator that was selected in place of the scene's own, if any was.
    pub fn selected_integrator(&self) -> Option<&str> {
        self.options.integrator.as_deref()
    }

    /// Selects an integrator by a name of the format or a class; `None` selects the scene's own. The next load makes it.
    /// It takes over the parameters of the scene's own that it has, too. Parameters that were set stay.
    pub fn select_integrator(&mut self, name: Option<&str>) {
        self.options.integrator = name.map(str::to_owned);
        let entities = &self.description.entities;
        let has_name = |EntityId(index): &EntityId| {
            let entity = &entities[*index];
            entity.kind == EntityKind::Integrator && Some(entity.class.as_str()) == name
        };
        let own = self.description.own_integrator;
        let own = own.filter(|own| name.is_none() || has_name(own));
        let known = own.or_else(|| (0..entities.len()).map(EntityId).find(has_name));
        self.description.integrator = known;
        // The parameters that it takes over may have changed.
        self.changed.extend(known.filter(|known| own != Some(*known)));
        if let (None, Some(name)) = (known, name) {
            defines::set_integrator(&mut self.description, name, &mut self.map);
        }
        // The messages of reading were those of the first integrator.
        self.settings = Settings::read(&self.description, &mut Diagnostics::new());
    }

    /// Makes the scene.
    ///
    /// # Errors
    /// All errors of the scene and its shaders, with the warnings among them. Instances of the previous load are kept
    /// for the next one.
    pub fn load(&mut self) -> Result<Loaded, Messages> {
        let _span = tracing::debug_span!("load_scene").entered();
        let start = Instant::now();
        let mut diagnostics = self.diagnostics.clone();
        let earlier = Earlier {
            made: &self.made,
            changed: &self.changed,
            attributes: &self.attributes,
            presences: &self.presences,
        };
        // The files of the previous load do not count, because this load reads them again.
        let budget = self.budget.branch();
        self.classes.set_budget(&budget);
        self.classes.set_described(&self.description.classes);
        let mut loader = Loader::new(
            SceneFiles {
                scene: &self.path,
                files: &*self.files,
                embedded: &self.description.embedded,
                budget: &budget,
                texture_memory: self.options.texture_memory,
            },
            &self.description,
            &mut self.classes,
            earlier,
            &mut diagnostics,
        );
        let scene = loader.scene(self.settings.clone());
        let Kept { made, attributes, presences } = loader.into_kept();
        let mut messages = self.classes.messages().clone();
        let fence = Fence::new(&self.path, &*self.files, &self.options.search_path);
        let included = &self.description.included;
        let diagnostics = fence.redacted(diagnostics, &self.map, included);
        if !diagnostics.is_empty() {
            messages.push(self.map.clone(), diagnostics);
        }
        match scene {
            Some((scene, origins)) if !messages.has_errors() => {
                self.made = made;
                self.attributes = attributes;
                self.presences = presences;
                self.changed.clear();
                self.classes.accept_refresh();
                self.description.notes.iter().for_each(|note| messages.note(note));
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

    /// Returns the instance of an entity from the last load.
    pub fn instance(&self, EntityId(index): EntityId) -> Option<&Arc<Instance>> {
        self.made.get(index)?.as_ref().map(|made| &made.instance)
    }

    /// Returns the name of an entity, or its kind and line.
    pub fn title(&self, id: EntityId) -> String {
        let entity = &self.description.entities[id.0];
        match (&entity.name, entity.kind) {
            (Some(name), _) => name.clone(),
            (None, EntityKind::Camera | EntityKind::Integrator) => entity.kind.word().to_owned(),
            (None, kind) => format!("{} on line {}", kind.word(), self.line_of(id)),
        }
    }

    /// Returns the line of an entity in the scene's text.
    pub fn line_of(&self, EntityId(index): EntityId) -> u32 {
        let span = self.description.entities[index].class_span;
        self.map.position(span.file, span.start).line
    }

    /// Returns the description of the scene, with the parameters that were set since.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Returns the values given for a parameter of an entity, by the class's name of the parameter.
    pub fn given_values(&self, EntityId(index): EntityId, name: &str) -> Option<Values> {
        let entity = &self.description.entities[index];
        let given = entity.parameters.iter().find(|it| class_name(entity, &it.name) == name);
        given.map(|parameter| parameter.values.clone()).or_else(|| {
            let mut defaults = PbrtName::of(entity)?.defaults();
            let (_, numbers) = defaults.find(|(other, _)| *other == name)?;
            Some(Values::Numbers(numbers.to_vec()))
        })
    }

    /// Sets a parameter of an entity, by the class's name of the parameter. The next load remakes the entity and
    /// everything that refers to it. Returns the previous parameter.
    pub fn set_parameter(&mut self, id: EntityId, name: &str, values: Values) -> Option<Parameter> {
        self.changed.insert(id);
        let parameter = given(&self.description.entities[id.0], name, values);
        self.replace_parameter(id, name, Some(parameter))
    }

    /// Restores the previous parameter after [`SceneSource::set_parameter`], if no load has used the new one.
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

    /// Returns the files from which the scene was read, including shaders.
    pub fn source_files(&self) -> Vec<PathBuf> {
        let own = self.map.files().map(|(_, file)| PathBuf::from(&file.name));
        own.filter(|path| path.is_file()).chain(self.classes.source_files()).collect()
    }
}

/// Reads the description in a file of any format.
fn read(
    path: &Path,
    files: &dyn FileSource,
    options: &LoadOptions,
    budget: &InputBudget,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Description {
    let camera = options.camera.as_deref();
    if is_gltf(path) {
        let mut description = read_gltf_scene(path, camera, files, budget, map, diagnostics);
        if !options.studio && !has_studio(&description, path) && description.camera.is_some() {
            let note = "the lights of the file alone light the scene: `--studio` adds a studio";
            description.notes.push(note.to_owned());
        }
        return description;
    }
    if let Some(error) = shader_instead_of_scene(path, files, budget) {
        diagnostics.push(error);
        return Description::default();
    }
    if let Some(camera) = camera {
        let message = format!("unknown camera `{camera}`: only glTF files have several");
        diagnostics.push(Diagnostic::new(codes::UNKNOWN_SCENE_NAME, message));
    }
    if is_mesh_file(path) {
        return read_mesh_scene(path, files, budget, map, diagnostics);
    }
    let mut description = read_scene_within(path, files, budget, map, diagnostics);
    let search_path = &options.search_path;
    add_materials(&mut description, path, search_path, files, budget, map, diagnostics);
    description
}

/// The digest of a file, if it can be read.
fn digest(path: &Path, files: &dyn FileSource, options: &LoadOptions) -> Option<blake3::Hash> {
    let input = Input::read(files, path, &InputBudget::new(options.input_memory)).ok()?;
    Some(blake3::hash(&input.bytes))
}

/// A parameter of `entity` in the form of a definition from the command line.
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
