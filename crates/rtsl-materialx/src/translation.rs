//! Translation of a document's materials, and of its outputs, to classes.

use std::collections::BTreeSet;

use rtsl_source::{Diagnostic, Span, deep_stack, diagnostic_codes as codes, most_similar};

use crate::class::{self, Header};
use crate::document::{Document, ElementId, Fault};
use crate::graph::{Graph, ROOT};
use crate::places::identifier;
use crate::shader::{self, Kind, Shader};
use crate::surface::Setting;
use crate::types::Type;
use crate::{closure, hair, limits, mixture, surface};

/// An image that a class refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageUse {
    /// The member of the class.
    pub member: String,
    /// The file, relative to that of the document.
    pub file: String,
    /// If its name stands for several files, the form of their numbers. Each covers a unit square of coordinates: 1001
    /// the first, the next one that to the right, and the one ten higher that above.
    pub tiles: Option<TileNumbers>,
    /// True if its values are in sRGB.
    pub is_srgb: bool,
    /// True if it repeats beyond its edges; else they continue.
    pub is_repeated: bool,
    /// True if it is not interpolated.
    pub is_nearest: bool,
    /// True if its opacity is read. The class then has a member with the ending `HasOpacity`.
    pub has_opacity: bool,
    /// The place where the document names it.
    pub span: Span,
}

/// The form of the numbers of tiles in the names of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileNumbers {
    /// `1001`, `1002` and so on.
    Udim,
    /// `u1_v1`, `u2_v1` and so on.
    UvTile,
}

impl TileNumbers {
    /// The text in the name of the file in whose place the numbers stand.
    pub fn mark(self) -> &'static str {
        match self {
            TileNumbers::Udim => "<UDIM>",
            TileNumbers::UvTile => "<UVTILE>",
        }
    }

    /// Returns the number of the tile that a text in place of the mark stands for.
    pub fn number(self, text: &str) -> Option<u32> {
        match self {
            TileNumbers::Udim => {
                let is_number = text.len() == 4 && text.bytes().all(|it| it.is_ascii_digit());
                let number = text.parse().ok().filter(|_| is_number)?;
                (1001..=9999).contains(&number).then_some(number)
            }
            TileNumbers::UvTile => {
                let (u, v) = text.strip_prefix('u')?.split_once("_v")?;
                let [u, v]: [u32; 2] = [u.parse().ok()?, v.parse().ok()?];
                ((1..=10).contains(&u) && (1..=899).contains(&v)).then(|| 1000 + u + 10 * (v - 1))
            }
        }
    }
}

/// A class of the translation.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the document.
    pub name: String,
    /// The name of the class.
    pub class: String,
    /// The images that it refers to.
    pub images: Vec<ImageUse>,
    /// The materials that it refers to.
    pub parts: Vec<Part>,
    /// The text of the class.
    pub text: String,
    /// True if there may be only a part of the surface, or none of it, at some places.
    pub has_holes: bool,
}

/// A material that another refers to.
#[derive(Clone, Debug)]
pub struct Part {
    /// The member of the other's class.
    pub member: String,
    /// The material.
    pub material: Material,
}

/// The classes of a document.
#[derive(Clone, Debug, Default)]
pub struct Translation {
    /// The materials, in the order of the document.
    pub materials: Vec<Material>,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
    /// The errors of materials that have no translation.
    pub errors: Vec<Diagnostic>,
}

/// The modules of the library that classes use, with the names that they have there.
const MODULES: [(&str, &str); 6] = [
    ("mxClosures", "closures"),
    ("mxColor", "color"),
    ("mxHair", "hair"),
    ("mxNoise", "noise"),
    ("mxPlacement", "placement"),
    ("mxShapes", "shapes"),
];

impl Translation {
    /// Returns the text of a file with these classes.
    pub fn text(&self) -> String {
        let materials = self.materials.iter().flat_map(Material::with_parts);
        let classes: Vec<&str> = materials.map(|it| it.text.as_str()).collect();
        with_imports(&classes.join("\n"))
    }
}

impl Material {
    /// Returns the text of a file with this class alone.
    pub fn file_text(&self) -> String {
        with_imports(&self.text)
    }

    /// The materials that it refers to, directly or through others, and itself, which is the last.
    pub fn with_parts(&self) -> Vec<&Material> {
        let parts = self.parts.iter().flat_map(|part| part.material.with_parts());
        parts.chain([self]).collect()
    }
}

fn with_imports(classes: &str) -> String {
    let used = MODULES.iter().filter(|(name, _)| classes.contains(&format!("{name}.")));
    let imports: String =
        used.map(|(name, file)| format!("import shaders.materialx.{file} as {name};\n")).collect();
    let space = if imports.is_empty() { "" } else { "\n" };
    format!("{imports}{space}{classes}")
}

/// Translates the surface materials of a document, or the one with this name. `title` names the document in comments.
pub fn translate(document: &Document, title: &str, only: Option<&str>) -> Translation {
    deep_stack::run(|| {
        let mut translator = Translator::new(document, title);
        let found = translator.materials();
        let chosen: Vec<ElementId> = found
            .iter()
            .copied()
            .filter(|id| only.is_none_or(|name| document.get(*id).name() == name))
            .collect();
        if chosen.is_empty() {
            let error = translator.no_material(&found, only);
            translator.translation.errors.push(error);
        }
        let is_alone = chosen.len() == 1;
        for id in chosen {
            translator.add_material(id, is_alone);
        }
        translator.finish()
    })
}

/// True if a document has surface materials, whether or not they can be translated.
pub fn has_materials(document: &Document) -> bool {
    !Translator::new(document, "").materials().is_empty()
}

/// Translates the outputs of a document's graphs to textures, each a class.
pub fn translate_outputs(document: &Document, title: &str) -> Translation {
    deep_stack::run(|| {
        let mut translator = Translator::new(document, title);
        for id in translator.outputs() {
            translator.add_output(id);
        }
        translator.finish()
    })
}

struct Translator<'d> {
    document: &'d Document,
    title: &'d str,
    translation: Translation,
    classes: BTreeSet<String>,
    length: usize,
}

impl<'d> Translator<'d> {
    fn new(document: &'d Document, title: &'d str) -> Self {
        let translation =
            Translation { warnings: document.warnings.clone(), ..Translation::default() };
        Translator { document, title, translation, classes: BTreeSet::new(), length: 0 }
    }

    fn finish(self) -> Translation {
        self.translation
    }

    /// The materials of the document; without any, those within graphs; without these, its surfaces.
    fn materials(&self) -> Vec<ElementId> {
        let root = self.document.root();
        let of_root = |ty: &'static str| self.nodes_of(root, ty);
        let of_graphs = |ty: &'static str| {
            let outputs = self.graphs().flat_map(|graph| self.document.children(graph, "output"));
            outputs.filter(|id| self.is_of(*id, ty)).collect()
        };
        let in_graphs = || self.graphs().flat_map(|it| self.nodes_of(it, "material")).collect();
        let ways: [&dyn Fn() -> Vec<ElementId>; 5] = [
            &|| of_root("material"),
            &|| of_graphs("material"),
            &in_graphs,
            &|| of_root("surfaceshader"),
            &|| of_graphs("surfaceshader"),
        ];
        let mut found = ways.iter().map(|way| way()).find(|it| !it.is_empty()).unwrap_or_default();
        found.truncate(limits::MATERIALS);
        found
    }

    /// The graphs that do not implement nodes.
    fn graphs(&self) -> impl Iterator<Item = ElementId> {
        let graphs = self.document.children(self.document.root(), "nodegraph");
        graphs.filter(|id| self.document.get(*id).attribute("nodedef").is_none())
    }

    /// The nodes in a graph, or in the document, that have this type.
    fn nodes_of(&self, graph: ElementId, ty: &str) -> Vec<ElementId> {
        let is_node = |id: &ElementId| {
            let tag = self.document.get(*id).tag.as_str();
            !matches!(tag, "nodegraph" | "nodedef" | "input" | "output" | "volumematerial")
        };
        let children = self.document.get(graph).children.iter().copied();
        children.filter(is_node).filter(|id| self.is_of(*id, ty)).collect()
    }

    fn is_of(&self, id: ElementId, ty: &str) -> bool {
        let element = self.document.get(id);
        let is_material = element.tag == "surfacematerial" && ty == "material";
        is_material || element.attribute("type") == Some(ty)
    }

    fn no_material(&self, all: &[ElementId], only: Option<&str>) -> Diagnostic {
        let names: Vec<&str> = all.iter().map(|id| self.document.get(*id).name()).collect();
        let span = self.document.get(self.document.root()).span;
        match only {
            Some(name) if !names.is_empty() => {
                let message = format!("`{}` has no material `{name}`", self.title);
                let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message).at(span, "");
                match most_similar(name, names.iter().copied()) {
                    Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                    None => diagnostic.help(format!("it has `{}`", names.join("`, `"))),
                }
            }
            _ => {
                let message = format!("`{}` has no material", self.title);
                Diagnostic::new(codes::MATERIALX_UNKNOWN, message)
                    .at(span, "")
                    .help("a material is a `surfacematerial` with a surface")
            }
        }
    }

    /// The outputs of values, outside of graphs that implement nodes.
    fn outputs(&self) -> Vec<ElementId> {
        let document = self.document;
        let of_graphs = self.graphs().flat_map(|graph| document.children(graph, "output"));
        let is_value = |id: &ElementId| {
            let ty = document.get(*id).attribute("type").and_then(Type::named);
            ty.is_some_and(|ty| ty != Type::Text && ty.count() <= 4)
        };
        let own = document.children(document.root(), "output");
        own.chain(of_graphs).filter(is_value).take(limits::MATERIALS).collect()
    }

    /// Adds the class of a material. One without a surface is left out if there are others.
    fn add_material(&mut self, id: ElementId, is_alone: bool) {
        let mut graph = Graph::new(self.document);
        self.warn_of_unused(&mut graph, id);
        let made = match shader::of_material(&mut graph, id) {
            Ok(Some(shader)) => {
                let class = self.class_name(&self.name_of(id));
                self.material(&mut graph, &shader, id, class).map(Some)
            }
            Ok(None) if is_alone => Err(self.no_surface(id)),
            Ok(None) => {
                let name = self.document.get(id).name();
                graph.warn(format!("`{name}` has no surface: it is left out"), id);
                Ok(None)
            }
            Err(fault) => Err(fault),
        };
        self.add_warnings(graph.warnings);
        match made {
            Ok(material) => material.into_iter().for_each(|it| self.add(it, id)),
            Err(fault) => self.translation.errors.push(*fault),
        }
    }

    fn no_surface(&self, material: ElementId) -> Fault {
        let element = self.document.get(material);
        let message = format!("`{}` has no surface", element.name());
        let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message).at(element.span, "");
        Box::new(diagnostic.help("connect the input `surfaceshader` to a surface"))
    }

    /// The name of a material or an output, that of a graph's output after that of the graph.
    fn name_of(&self, id: ElementId) -> String {
        let element = self.document.get(id);
        let parent = element.parent.map(|it| self.document.get(it));
        match parent.and_then(|it| it.attribute("name")) {
            Some(parent) => format!("{parent}_{}", element.name()),
            None => element.name().to_owned(),
        }
    }

    fn add(&mut self, material: Material, id: ElementId) {
        let lengths = material.with_parts().into_iter().map(|it| it.text.len());
        self.length += lengths.sum::<usize>();
        if self.length > limits::OUTPUT {
            let message = "the classes of the document are too long";
            let diagnostic = Diagnostic::new(codes::MATERIALX_LIMIT, message);
            self.translation.errors.push(diagnostic.at(self.document.get(id).span, "of this"));
            return;
        }
        self.translation.materials.push(material);
    }

    fn add_warnings(&mut self, warnings: Vec<Diagnostic>) {
        for warning in warnings {
            if !self.translation.warnings.contains(&warning) {
                self.translation.warnings.push(warning);
            }
        }
    }

    /// A name that no other class of the translation has, nor one of the library that it derives from.
    fn class_name(&mut self, name: &str) -> String {
        let identifier = identifier(name);
        let mut letters = identifier.chars();
        let first = letters.next().map(|first| first.to_ascii_uppercase());
        let mut class: String = first.into_iter().chain(letters).collect();
        if class.is_empty() || class == "_" || is_base(&class) {
            class.push_str("Material");
        }
        let stem = class.clone();
        let mut number = 2;
        while !self.classes.insert(class.clone()) {
            class = format!("{stem}{number}");
            number += 1;
        }
        class
    }

    fn warn_of_unused(&self, graph: &mut Graph<'_>, material: ElementId) {
        for name in ["displacementshader", "backsurfaceshader"] {
            let Some(port) = graph.port(material, name) else { continue };
            if graph.source(ROOT, port).is_ok_and(|source| source.is_some()) {
                graph.warn(format!("the input `{name}` has no effect"), port);
            }
        }
    }

    /// The class of a shader. `named` is the element whose name it has in the document.
    fn material(
        &mut self,
        graph: &mut Graph<'d>,
        shader: &Shader,
        named: ElementId,
        class: String,
    ) -> Result<Material, Fault> {
        let name = self.document.get(named).name();
        let header = Header { title: self.title, name, class: &class };
        let mut parts: Vec<Part> = Vec::new();
        let (text, has_holes) = match &shader.kind {
            Kind::Model(surface) => {
                let settings = surface::settings(graph, surface, shader.scope, shader.node)?;
                let text = class::of_surface(graph, &header, surface, &settings);
                (text, settings.iter().any(Setting::makes_holes))
            }
            Kind::Hair(scope, node) => {
                let hair = hair::hair(graph, shader, *scope, *node)?;
                (hair::class(graph, &header, &hair), hair.opacity.is_some())
            }
            Kind::Closures => {
                let closures = closure::closures(graph, shader.scope, shader.node)?;
                (closure::class(graph, &header, &closures), closures.opacity.is_some())
            }
            Kind::Mix(_, _) => {
                for (member, part) in mixture::parts(shader) {
                    let material = self.part(graph, part)?;
                    parts.push(Part { member, material });
                }
                let text = mixture::class(graph, &header, shader, &parts)?;
                (text, parts.iter().any(|part| part.material.has_holes))
            }
        };
        let images = std::mem::take(&mut graph.images);
        Ok(Material { name: name.to_owned(), class, images, parts, text, has_holes })
    }

    /// The class of a part of a mixture, whose statements are its own.
    fn part(&mut self, graph: &mut Graph<'d>, shader: &Shader) -> Result<Material, Fault> {
        let mut own = graph.without_values();
        let class = self.class_name(&self.name_of(shader.node));
        let made = self.material(&mut own, shader, shader.node, class);
        graph.warnings.append(&mut own.warnings);
        made
    }

    fn add_output(&mut self, id: ElementId) {
        let mut graph = Graph::new(self.document);
        let class = self.class_name(&self.name_of(id));
        let made = self.texture(&mut graph, id, class);
        self.add_warnings(graph.warnings);
        match made {
            Ok(texture) => self.add(texture, id),
            Err(fault) => self.translation.errors.push(*fault),
        }
    }

    fn texture(
        &self,
        graph: &mut Graph<'_>,
        id: ElementId,
        class: String,
    ) -> Result<Material, Fault> {
        let scope = graph.scope_of_output(id);
        let Some(value) = graph.port_value(scope, id)? else {
            return Err(graph.unsupported("an output without a value".to_owned(), id));
        };
        let text = class::of_texture(graph, &class, &value);
        let name = self.document.get(id).name().to_owned();
        let images = std::mem::take(&mut graph.images);
        Ok(Material { name, class, images, parts: Vec::new(), text, has_holes: false })
    }
}

/// True for names of classes of the library that others derive from.
fn is_base(class: &str) -> bool {
    class == hair::CLASS
        || class == mixture::CLASS
        || surface::SURFACES.iter().any(|it| it.class == class)
}
