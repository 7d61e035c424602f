//! Translation of a document's materials, and of its outputs, to classes.

use std::collections::BTreeSet;

use rtsl_source::{Diagnostic, Span, deep_stack, diagnostic_codes as codes, most_similar};

use crate::closure;
use crate::document::{Document, ElementId, Fault};
use crate::graph::{Graph, ROOT, ScopeId, Source};
use crate::limits;
use crate::places::identifier;
use crate::surface::{self, Setting, Surface};
use crate::types::Type;

/// An image that a class refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageUse {
    /// The member of the class.
    pub member: String,
    /// The file, relative to that of the document.
    pub file: String,
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

/// A class of the translation.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the document.
    pub name: String,
    /// The name of the class.
    pub class: String,
    /// The images that it refers to.
    pub images: Vec<ImageUse>,
    /// The text of the class.
    pub text: String,
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
const MODULES: [(&str, &str); 5] = [
    ("mxClosures", "closures"),
    ("mxColor", "color"),
    ("mxNoise", "noise"),
    ("mxPlacement", "placement"),
    ("mxShapes", "shapes"),
];

impl Translation {
    /// Returns the text of a file with these classes.
    pub fn text(&self) -> String {
        let classes: Vec<&str> = self.materials.iter().map(|it| it.text.as_str()).collect();
        with_imports(&classes.join("\n"))
    }
}

impl Material {
    /// Returns the text of a file with this class alone.
    pub fn file_text(&self) -> String {
        with_imports(&self.text)
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
        for id in chosen {
            translator.add_material(id);
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

    /// The materials of the document; without any, its surfaces.
    fn materials(&self) -> Vec<ElementId> {
        let document = self.document;
        let root = document.root();
        let materials: Vec<ElementId> =
            document.children(root, "surfacematerial").take(limits::MATERIALS).collect();
        if !materials.is_empty() {
            return materials;
        }
        let is_material = |id: &ElementId| document.get(*id).attribute("type") == Some("material");
        let custom: Vec<ElementId> =
            document.get(root).children.iter().copied().filter(is_material).collect();
        if !custom.is_empty() {
            return custom.into_iter().take(limits::MATERIALS).collect();
        }
        let is_surface = |id: &ElementId| {
            let element = document.get(*id);
            element.tag != "nodegraph"
                && element.tag != "nodedef"
                && element.attribute("type") == Some("surfaceshader")
        };
        let children = document.get(root).children.iter().copied();
        let surfaces: Vec<ElementId> =
            children.filter(is_surface).take(limits::MATERIALS).collect();
        if surfaces.is_empty() { self.surfaces_of_graphs() } else { surfaces }
    }

    /// The outputs of graphs that are surfaces, but not those that implement nodes.
    fn surfaces_of_graphs(&self) -> Vec<ElementId> {
        let document = self.document;
        let graphs = document.children(document.root(), "nodegraph");
        let graphs = graphs.filter(|id| document.get(*id).attribute("nodedef").is_none());
        let outputs = graphs.flat_map(|graph| document.children(graph, "output"));
        let is_surface =
            |id: &ElementId| document.get(*id).attribute("type") == Some("surfaceshader");
        outputs.filter(is_surface).take(limits::MATERIALS).collect()
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
        let root = document.root();
        let graphs = document.children(root, "nodegraph");
        let graphs = graphs.filter(|id| document.get(*id).attribute("nodedef").is_none());
        let of_graphs = graphs.flat_map(|graph| document.children(graph, "output"));
        let is_value = |id: &ElementId| {
            let ty = document.get(*id).attribute("type").and_then(Type::named);
            ty.is_some_and(|ty| ty != Type::Text && ty.count() <= 4)
        };
        let own = document.children(root, "output");
        own.chain(of_graphs).filter(is_value).take(limits::MATERIALS).collect()
    }

    fn add_material(&mut self, id: ElementId) {
        let mut graph = Graph::new(self.document);
        let class = self.class_name(&self.name_of(id));
        match self.material(&mut graph, id, &class) {
            Ok(text) => self.add(graph, id, class, text),
            Err(fault) => self.fail(graph, *fault),
        }
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

    fn fail(&mut self, graph: Graph<'_>, fault: Diagnostic) {
        self.add_warnings(graph.warnings);
        self.translation.errors.push(fault);
    }

    fn add(&mut self, graph: Graph<'_>, id: ElementId, class: String, text: String) {
        self.length += text.len();
        if self.length > limits::OUTPUT {
            let message = "the classes of the document are too long";
            let diagnostic = Diagnostic::new(codes::MATERIALX_LIMIT, message);
            self.translation.errors.push(diagnostic.at(self.document.get(id).span, "of this"));
            return;
        }
        let name = self.document.get(id).name().to_owned();
        self.translation.materials.push(Material { name, class, images: graph.images, text });
        self.add_warnings(graph.warnings);
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
        let is_base = |class: &str| surface::SURFACES.iter().any(|it| it.class == class);
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

    fn material(&self, graph: &mut Graph<'_>, id: ElementId, class: &str) -> Result<String, Fault> {
        let (scope, node) = self.shader_of(graph, id)?;
        let tag = &self.document.get(node).tag;
        if closure::is_surface(tag) {
            self.warn_of_displacement(graph, id);
            let closures = closure::closures(graph, scope, node)?;
            let mut text = self.header(self.document.get(id).name(), class, "rt_Material");
            write_members(graph, &mut text);
            text.push_str(&closure::write(graph, &closures));
            return Ok(text);
        }
        let Some(surface) = surface::named(tag) else {
            let message = format!("the surface `{tag}` is not supported");
            return Err(graph.unsupported(message, node));
        };
        self.warn_of_displacement(graph, id);
        let settings = surface::settings(graph, surface, scope, node)?;
        Ok(self.write(graph, surface, &settings, self.document.get(id).name(), class))
    }

    fn warn_of_displacement(&self, graph: &mut Graph<'_>, id: ElementId) {
        for name in ["displacementshader", "backsurfaceshader"] {
            let Some(port) = graph.port(id, name) else { continue };
            if graph.source(ROOT, port).is_ok_and(|source| source.is_some()) {
                graph.warn(format!("the input `{name}` has no effect"), port);
            }
        }
    }

    /// Follows a material to the node of its surface.
    fn shader_of(
        &self,
        graph: &mut Graph<'_>,
        material: ElementId,
    ) -> Result<(ScopeId, ElementId), Fault> {
        let document = self.document;
        let mut scope = graph.scope_of_output(material);
        let mut node = material;
        let mut output: Option<String> = None;
        for _ in 0..limits::DEPTH {
            let tag = document.get(node).tag.clone();
            let is_surface = surface::named(&tag).is_some() || closure::is_surface(&tag);
            if is_surface {
                return Ok((scope, node));
            }
            let port = match tag.as_str() {
                "surfacematerial" => graph.port(node, "surfaceshader"),
                "dot" => graph.port(node, "in"),
                "output" => Some(node),
                _ => match graph.implementation(scope, node, output.as_deref())? {
                    Some((inner, port)) => {
                        scope = inner;
                        Some(port)
                    }
                    None => return Ok((scope, node)),
                },
            };
            let source = match port {
                Some(port) => graph.source(scope, port)?,
                None => None,
            };
            let Some(Source::Node(outer, next, name)) = source else {
                let message = format!("`{}` has no surface", document.get(material).name());
                let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message)
                    .at(document.get(node).span, "")
                    .help("connect the input `surfaceshader` to a surface");
                return Err(Box::new(diagnostic));
            };
            (scope, node, output) = (outer, next, name);
        }
        Err(graph.unsupported("a surface through too many graphs".to_owned(), material))
    }

    fn header(&self, name: &str, class: &str, base: &str) -> String {
        format!(
            "/// `{}` of `{}`, translated from MaterialX.\nclass {class} : {base};\n\n",
            name.replace('`', "'"),
            self.title.replace('`', "'")
        )
    }

    fn write(
        &self,
        graph: &Graph<'_>,
        surface: &Surface,
        settings: &[Setting],
        name: &str,
        class: &str,
    ) -> String {
        let mut text = self.header(name, class, surface.class);
        write_members(graph, &mut text);
        for setting in settings {
            if let Setting::Initial(declaration) = setting {
                text.push_str(declaration);
                text.push('\n');
            }
        }
        for setting in settings {
            if let Setting::Computed { header, result } = setting {
                text.push_str(&format!("\n{header}() {{\n"));
                graph.statements.write(result, &mut text);
                text.push_str(&format!("    return {result};\n}}\n"));
            }
        }
        let has_normal = settings.iter().any(|setting| {
            matches!(setting, Setting::Computed { header, .. } if header == "vec3 surfaceNormal")
        });
        if has_normal {
            text.push_str(WITH_NORMAL);
        }
        text
    }

    fn add_output(&mut self, id: ElementId) {
        let mut graph = Graph::new(self.document);
        let class = self.class_name(&self.name_of(id));
        match self.texture(&mut graph, id, &class) {
            Ok(text) => self.add(graph, id, class, text),
            Err(fault) => self.fail(graph, *fault),
        }
    }

    fn texture(&self, graph: &mut Graph<'_>, id: ElementId, class: &str) -> Result<String, Fault> {
        let scope = graph.scope_of_output(id);
        let Some(value) = graph.port_value(scope, id)? else {
            return Err(graph.unsupported("an output without a value".to_owned(), id));
        };
        let mut text = format!("class {class} : rt_Texture;\n\n");
        write_members(graph, &mut text);
        text.push_str("void lookup() {\n");
        graph.statements.write(&value.text, &mut text);
        let result = &value.text;
        text.push_str(&match value.ty.count() {
            1 => format!("    rt_FloatTextureValue = float({result});\n"),
            2 => format!("    rt_TextureColor = color({result}.x, {result}.y, 0.0);\n"),
            3 => format!("    rt_TextureColor = color({result});\n"),
            _ => format!(
                "    rt_TextureColor = color({result}.xyz);\n    rt_FloatTextureValue = {result}.w;\n"
            ),
        });
        text.push_str("}\n");
        Ok(text)
    }
}

/// The renderer weighs light by the cosine with the surface's own normal.
const WITH_NORMAL: &str = "
float cosineRatio(mat3 frame) { return mxPlacement.cosineRatio(rt_LightDirection, rt_ShadingNormal, frame[2]); }
";

/// The members that are not parameters of the base.
fn write_members(graph: &Graph<'_>, text: &mut String) {
    for image in &graph.images {
        let file = image.file.replace(['"', '\\', '\n', '\r'], "'");
        let space = if image.is_srgb { "sRGB" } else { "linear" };
        text.push_str(&format!(
            "[[doc \"The image `{file}`, {space}.\"]]\npublic rt_Texture {};\n",
            image.member
        ));
        if image.has_opacity {
            text.push_str(&format!(
                "[[doc \"Whether it has opacity.\"]]\npublic bool {}HasOpacity = true;\n",
                image.member
            ));
        }
    }
    for declaration in graph.attributes.values() {
        text.push_str(declaration);
        text.push('\n');
    }
}
