//! Materials of MaterialX documents: `Material "materialx" "string file" "marble.mtlx"`.
//!
//! The document's material becomes a class of the description, and its images become textures, which the class refers
//! to. `"string material"` chooses one of several materials.

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rtsl::{
    Diagnostic, Diagnostics, Refused, SourceMap, Span, diagnostic_codes as codes, encoding,
};
use rtsl_image::has_opacity;
use rtsl_materialx::{Document, ImageUse, Loaded, Material, TileNumbers, translate};
use rtsl_math::Transform;
use rtsl_memory::InputBudget;

use crate::description::{DescribedClass, Description, Entity, EntityKind};
use crate::pbrt::CONVENTION;
use crate::reader::{
    Fence, FileSource, Input, Parameter, ParameterType, ReferenceKind, Values, file_start, resolve,
    unreadable, with_slashes,
};

/// The type of such materials.
const TYPE: &str = "materialx";

/// The parameters that they have besides those of the class.
const FILE: &str = "file";
const MATERIAL: &str = "material";

/// The greatest number of tiles of an image.
const MAX_TILES: usize = 64;

/// Reads a MaterialX document, with those that it includes: beside the including document, or beside the first. Those
/// lie in the folder of the first, or within the fence.
///
/// # Errors
/// If it cannot be read, or is no document.
pub fn read_document(
    path: &Path,
    fence: Option<&Fence<'_>>,
    files: &dyn FileSource,
    budget: &InputBudget,
    map: &mut SourceMap,
) -> Result<Document, Box<Diagnostic>> {
    let input = Input::read(files, path, budget);
    let text = input
        .map_err(|error| unreadable(path, &error).message)
        .and_then(|input| text_of(path, input))
        .map_err(|reason| Box::new(Diagnostic::new(codes::UNREADABLE_FILE, reason)))?;
    let mut folders = vec![path.parent().unwrap_or(Path::new("")).to_owned()];
    folders.extend(fence.iter().flat_map(|fence| fence.folders()).cloned());
    let mut load = |href: &str, including: &str| {
        let (beside, of_first) = (resolve(Path::new(including), href), resolve(path, href));
        let mut reason = "it lies outside the folder of the document";
        for found in [beside, of_first] {
            let error = match Input::read_within(files, &found, &folders, budget) {
                Ok(input) => {
                    let text = text_of(&found, input)?;
                    return Ok(Loaded { name: found.display().to_string(), text });
                }
                Err(error) => error,
            };
            match (Refused::of(&error), error.kind()) {
                (Some(Refused::Outside), _) => {}
                (Some(Refused::NotRegular), _) | (None, ErrorKind::NotFound) => {
                    reason = "there is no such file";
                }
                (None, _) => return Err(unreadable(&found, &error).message),
            }
        }
        Err(reason.to_owned())
    };
    Document::read(&path.display().to_string(), &text, &mut load, map)
}

fn text_of(path: &Path, input: Input) -> Result<String, String> {
    encoding::utf8(input.bytes)
        .map_err(|problem| format!("cannot read `{}`: {problem}", path.display()))
}

/// Replaces the materials of MaterialX documents in a description by classes.
pub fn add_materials(
    description: &mut Description,
    scene: &Path,
    search_path: &[PathBuf],
    files: &dyn FileSource,
    budget: &InputBudget,
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) {
    let is_material = |entity: &Entity| entity.kind == EntityKind::Material && entity.class == TYPE;
    let indices: Vec<usize> = (0..description.entities.len())
        .filter(|it| is_material(&description.entities[*it]))
        .collect();
    if indices.is_empty() {
        return;
    }
    let mut adder = Adder {
        description,
        scene,
        search_path,
        files,
        budget,
        map,
        diagnostics,
        documents: BTreeMap::new(),
        images: BTreeMap::new(),
        warned: BTreeSet::new(),
    };
    for index in indices {
        if let Err(diagnostic) = adder.add(index) {
            adder.diagnostics.push(*diagnostic);
            adder.mark_broken(index);
        }
    }
}

struct Adder<'a> {
    description: &'a mut Description,
    scene: &'a Path,
    /// The folders that the user named.
    search_path: &'a [PathBuf],
    files: &'a dyn FileSource,
    budget: &'a InputBudget,
    map: &'a mut SourceMap,
    diagnostics: &'a mut Diagnostics,
    /// Documents by path; `None` for those with errors, which were reported.
    documents: BTreeMap<PathBuf, Option<Document>>,
    /// The names of the textures of images.
    images: BTreeMap<(String, bool, bool, bool), Option<String>>,
    warned: BTreeSet<String>,
}

impl Adder<'_> {
    fn add(&mut self, index: usize) -> Result<(), Box<Diagnostic>> {
        let entity = &self.description.entities[index];
        let span = entity.class_span;
        let Some((file, parameter)) = entity.text(FILE) else {
            let message = format!("`{TYPE}` names no document");
            let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
            return Err(Box::new(diagnostic.at(span, "expected `\"string file\"`")));
        };
        let (file, named) = (file.to_owned(), parameter.values_span);
        let only = entity.text(MATERIAL).map(|(name, _)| name.to_owned());
        let path = resolve(self.scene, &file);
        let Some(document) = self.document(&path, named)? else {
            self.mark_broken(index);
            return Ok(());
        };
        let mut translation = translate(&document, &file, only.as_deref());
        if translation.materials.len() > 1 {
            return Err(several(&translation.materials, &file, named));
        }
        self.add_warnings(translation.warnings);
        match translation.materials.pop() {
            Some(material) if translation.errors.is_empty() => {
                self.replace(index, material, &file);
            }
            _ => {
                translation.errors.into_iter().for_each(|error| self.diagnostics.push(error));
                self.mark_broken(index);
            }
        }
        Ok(())
    }

    /// The document in a file; `None` if it has errors, which were reported.
    fn document(&mut self, path: &Path, named: Span) -> Result<Option<Document>, Box<Diagnostic>> {
        if let Some(known) = self.documents.get(path) {
            return Ok(known.clone());
        }
        self.description.included.entry(path.to_owned()).or_insert(named);
        let fence = Fence::new(self.scene, self.files, self.search_path);
        let read = read_document(path, Some(&fence), self.files, self.budget, self.map);
        self.documents.insert(path.to_owned(), read.as_ref().ok().cloned());
        match read {
            Ok(document) => Ok(Some(document)),
            Err(diagnostic) if diagnostic.primary.is_none() => {
                Err(Box::new(diagnostic.at(named, "named here")))
            }
            Err(diagnostic) => Err(diagnostic),
        }
    }

    fn add_warnings(&mut self, warnings: Vec<Diagnostic>) {
        for warning in warnings {
            if self.warned.insert(warning.message.clone()) {
                self.diagnostics.push(warning);
            }
        }
    }

    /// Entities without a class are not reported again.
    fn mark_broken(&mut self, index: usize) {
        let entity = &mut self.description.entities[index];
        entity.parameters.clear();
        let described = DescribedClass { class: String::new(), text: String::new() };
        self.description.classes.insert(entity.class.clone(), described);
    }

    fn replace(&mut self, index: usize, material: Material, file: &str) {
        let span = self.description.entities[index].class_span;
        let whole = material.name.clone();
        let (class, parameters) = self.describe(material, file, &whole, span);
        let entity = &mut self.description.entities[index];
        entity.class = class;
        entity.parameters.retain(|it| it.name != FILE && it.name != MATERIAL);
        entity.parameters.extend(parameters);
    }

    /// Adds the class of a material, and those that it refers to. Returns its name in the description, and parameters.
    /// Classes of different materials of a document may have one name.
    fn describe(
        &mut self,
        material: Material,
        file: &str,
        whole: &str,
        span: Span,
    ) -> (String, Vec<Parameter>) {
        let key = format!("{file}#{whole}#{}", material.class);
        let mut parameters = Vec::new();
        for image in &material.images {
            self.add_image(image, file, span, &mut parameters);
        }
        let text = material.file_text();
        for part in material.parts {
            let name = self.add_part(part.material, file, whole, span);
            let reference = ParameterType::Reference(ReferenceKind::Material);
            parameters.push(given(reference, &part.member, Values::Texts(vec![name]), span));
        }
        let described = DescribedClass { class: material.class, text };
        self.description.classes.insert(key.clone(), described);
        (key, parameters)
    }

    /// Adds a material that another refers to, and returns its name. Names of the text have no such number.
    fn add_part(&mut self, material: Material, file: &str, whole: &str, span: Span) -> String {
        let (class, parameters) = self.describe(material, file, whole, span);
        let name = format!("{class} {}", self.description.entities.len());
        self.push_entity(EntityKind::Material, class, &name, span, parameters);
        name
    }

    fn add_image(
        &mut self,
        image: &ImageUse,
        file: &str,
        span: Span,
        parameters: &mut Vec<Parameter>,
    ) {
        let own = with_slashes(&image.file);
        if own != image.file {
            let message = "backslashes in the names of files count as slashes";
            let warning = Diagnostic::new(codes::MENDED_FAULT, message);
            self.add_warnings(vec![warning.at(image.span, "")]);
        }
        let name = Path::new(file).parent().unwrap_or(Path::new("")).join(&*own);
        let name = name.display().to_string();
        let files = match image.tiles {
            Some(numbers) => self.tiles(image, numbers, &name),
            None => vec![(0, name)],
        };
        let mut found = Vec::new();
        for (number, name) in files {
            let path = resolve(self.scene, &name);
            let texture = self.texture(image, name, &path, span);
            found.extend(texture.map(|texture| (number, texture, path)));
        }
        if found.is_empty() {
            return;
        }
        if image.has_opacity {
            let opacity = found.iter().all(|(_, _, path)| {
                file_start(self.files, path).is_ok_and(|it| has_opacity(&it).unwrap_or(false))
            });
            let member = format!("{}HasOpacity", image.member);
            let values = Values::Booleans(vec![opacity]);
            parameters.push(given(ParameterType::Given, &member, values, span));
        }
        let texture = match image.tiles {
            Some(_) => self.add_tiles(found, span),
            None => found.swap_remove(0).1,
        };
        let reference = ParameterType::Reference(ReferenceKind::Texture);
        parameters.push(given(reference, &image.member, Values::Texts(vec![texture]), span));
    }

    /// Adds the texture of an image in tiles, and returns its name.
    fn add_tiles(&mut self, tiles: Vec<(u32, String, PathBuf)>, span: Span) -> String {
        let numbers = tiles.iter().map(|(number, _, _)| f64::from(*number)).collect();
        let images = tiles.into_iter().map(|(_, texture, _)| texture).collect();
        let reference = ParameterType::Reference(ReferenceKind::Texture);
        let parameters = vec![
            given(reference, "images", Values::Texts(images), span),
            given(ParameterType::Given, "numbers", Values::Numbers(numbers), span),
        ];
        let name = format!("tiles {}", self.description.entities.len());
        self.push_entity(EntityKind::Texture, "ImageTiles".to_owned(), &name, span, parameters);
        name
    }

    /// The files of an image in tiles, by their numbers. A name with the mark is that of the scene.
    fn tiles(&mut self, image: &ImageUse, form: TileNumbers, name: &str) -> Vec<(u32, String)> {
        let Some((before, after)) = name.split_once(form.mark()) else { return Vec::new() };
        let (folder, start) = before.rsplit_once('/').unwrap_or(("", before));
        let files = self.files.list(&resolve(self.scene, folder)).unwrap_or_default();
        let number = |path: &PathBuf| {
            let file = path.file_name()?.to_str()?;
            let text = file.strip_prefix(start)?.strip_suffix(after)?;
            Some((form.number(text)?, format!("{before}{text}{after}")))
        };
        let mut tiles: Vec<(u32, String)> = files.iter().filter_map(number).collect();
        tiles.sort();
        let mut warn = |message: String| {
            let warning = Diagnostic::new(codes::MATERIALX_IGNORED, message);
            self.add_warnings(vec![warning.at(image.span, "named here")]);
        };
        if tiles.is_empty() {
            warn(format!("`{name}` is left out: there are no such files"));
        }
        if tiles.len() > MAX_TILES {
            warn(format!("`{name}` has {} files: the first {MAX_TILES} are read", tiles.len()));
            tiles.truncate(MAX_TILES);
        }
        tiles
    }

    /// The name of the texture of an image, which is made at its first use; `None` if there is no such file.
    fn texture(
        &mut self,
        image: &ImageUse,
        name: String,
        path: &Path,
        span: Span,
    ) -> Option<String> {
        let key = (name.clone(), image.is_srgb, image.is_repeated, image.is_nearest);
        if let Some(known) = self.images.get(&key) {
            return known.clone();
        }
        let texture = match self.files.size(path) {
            Ok(_) => Some(self.add_texture(image, name, span)),
            Err(error) => {
                let message = format!("`{}` is left out: {error}", path.display());
                let warning = Diagnostic::new(codes::MATERIALX_IGNORED, message);
                self.add_warnings(vec![warning.at(image.span, "named here")]);
                None
            }
        };
        self.images.insert(key, texture.clone());
        texture
    }

    fn add_texture(&mut self, image: &ImageUse, name: String, span: Span) -> String {
        let texture = format!("{name} {}", self.images.len());
        // The edge of a tile is not that of the other side.
        let is_repeated = image.is_repeated && image.tiles.is_none();
        let text = |parameter: &str, value: &str| {
            let values = Values::Texts(vec![value.to_owned()]);
            given(ParameterType::Text, parameter, values, span)
        };
        let parameters = vec![
            text("filename", &name),
            text("encoding", if image.is_srgb { "sRGB" } else { "linear" }),
            text("wrap", if is_repeated { "repeat" } else { "clamp" }),
            text("filter", if image.is_nearest { "point" } else { "bilinear" }),
            text(CONVENTION, "gltf"),
        ];
        let class = "imagemap".to_owned();
        self.push_entity(EntityKind::Texture, class, &texture, span, parameters);
        texture
    }

    fn push_entity(
        &mut self,
        kind: EntityKind,
        class: String,
        name: &str,
        class_span: Span,
        parameters: Vec<Parameter>,
    ) {
        self.description.entities.push(Entity {
            kind,
            class,
            class_span,
            name: Some(name.to_owned()),
            parameters,
            transform: Transform::IDENTITY,
            end_transform: None,
        });
    }
}

fn given(kind: ParameterType, name: &str, values: Values, span: Span) -> Parameter {
    Parameter { kind, name: name.to_owned(), declaration: span, values, values_span: span }
}

fn several(materials: &[Material], file: &str, span: Span) -> Box<Diagnostic> {
    const SHOWN: usize = 8;
    let names: Vec<&str> = materials.iter().take(SHOWN).map(|it| it.name.as_str()).collect();
    let more = if materials.len() > SHOWN { " and others" } else { "" };
    let message = format!("`{file}` has several materials");
    let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
    Box::new(
        diagnostic
            .at(span, "named here")
            .help(format!("choose one by `\"string {MATERIAL}\"`: `{}`{more}", names.join("`, `"))),
    )
}
