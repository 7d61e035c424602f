//! Documents: the tree of a document's elements, with those of the documents that it includes.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Node, ParsingOptions};
use rtsl_source::{Diagnostic, FileId, SourceMap, Span, diagnostic_codes as codes};

use crate::{color_surfaces, limits, old_versions};

/// The text of a file that a document includes.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The path of the file.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// Reads included documents: from the path that the document gives and the path of the including file.
type Load<'l> = dyn FnMut(&str, &str) -> Result<Loaded, String> + 'l;

/// The index of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementId(u32);

/// An element.
#[derive(Clone, Debug)]
pub struct Element {
    /// The tag, without a namespace.
    pub tag: String,
    attributes: Vec<(String, String)>,
    /// The elements inside.
    pub children: Vec<ElementId>,
    /// The element around it.
    pub parent: Option<ElementId>,
    /// The place of its start tag.
    pub span: Span,
    /// The children that have names, by name; the first counts.
    names: BTreeMap<String, ElementId>,
}

impl Element {
    /// Returns an attribute that is not empty.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(other, _)| other == name);
        found.map(|(_, value)| value.as_str()).filter(|value| !value.is_empty())
    }

    /// Returns an attribute, even if it is empty.
    pub fn attribute_or_empty(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(other, _)| other == name);
        found.map(|(_, value)| value.as_str())
    }

    /// The element's name, or the word for one without a name.
    pub fn name(&self) -> &str {
        self.attribute("name").unwrap_or("without name")
    }

    /// Sets an attribute.
    pub fn set(&mut self, name: &str, value: impl Into<String>) {
        self.attributes.retain(|(other, _)| other != name);
        self.attributes.push((name.to_owned(), value.into()));
    }
}

/// A document with the documents that it includes.
#[derive(Clone, Debug)]
pub struct Document {
    elements: Vec<Element>,
    /// Warnings of reading.
    pub warnings: Vec<Diagnostic>,
}

/// A diagnostic that ends the work on a document or a material.
pub type Fault = Box<Diagnostic>;

impl Document {
    /// Reads a document. `load` reads the documents that it includes; files are added to `sources`.
    ///
    /// # Errors
    /// If the text is no XML document of MaterialX, or exceeds a limit.
    pub fn read(
        name: &str,
        text: &str,
        load: &mut Load<'_>,
        sources: &mut SourceMap,
    ) -> Result<Document, Fault> {
        let root = Element {
            tag: "materialx".to_owned(),
            attributes: Vec::new(),
            children: Vec::new(),
            parent: None,
            span: Span::new(sources.add(name, text), 0, 0),
            names: BTreeMap::new(),
        };
        let document = Document { elements: vec![root], warnings: Vec::new() };
        let mut reader = Reader {
            document,
            load,
            sources,
            included: BTreeSet::from([name.to_owned()]),
            bytes: text.len(),
        };
        let file = reader.document.elements[0].span.file;
        reader.read_file(name, text, file, 0)?;
        reader.add_lama()?;
        let mut document = reader.document;
        old_versions::upgrade(&mut document);
        color_surfaces::replace(&mut document);
        document.index_names();
        Ok(document)
    }

    /// The root, whose children are those of all documents.
    pub fn root(&self) -> ElementId {
        ElementId(0)
    }

    /// Returns an element.
    pub fn get(&self, id: ElementId) -> &Element {
        &self.elements[id.0 as usize]
    }

    /// Returns an element, to be changed.
    pub fn get_mut(&mut self, id: ElementId) -> &mut Element {
        &mut self.elements[id.0 as usize]
    }

    /// Adds an element to another.
    pub fn add(&mut self, parent: ElementId, tag: &str, span: Span) -> ElementId {
        let id = ElementId(self.elements.len() as u32);
        self.elements.push(Element {
            tag: tag.to_owned(),
            attributes: Vec::new(),
            children: Vec::new(),
            parent: Some(parent),
            span,
            names: BTreeMap::new(),
        });
        self.get_mut(parent).children.push(id);
        id
    }

    /// Copies an element, without those inside it, into another.
    pub fn copy(&mut self, id: ElementId, parent: ElementId) -> ElementId {
        let Element { tag, attributes, span, .. } = self.get(id).clone();
        let copy = self.add(parent, &tag, span);
        self.get_mut(copy).attributes = attributes;
        copy
    }

    /// All elements, the root first.
    pub fn ids(&self) -> impl Iterator<Item = ElementId> + use<> {
        (0..self.elements.len() as u32).map(ElementId)
    }

    /// The children of an element with this tag.
    pub fn children<'d>(
        &'d self,
        id: ElementId,
        tag: &'d str,
    ) -> impl Iterator<Item = ElementId> + 'd {
        let all = self.get(id).children.iter().copied();
        all.filter(move |child| self.get(*child).tag == tag)
    }

    /// Returns the child of an element with this name.
    pub fn named(&self, id: ElementId, name: &str) -> Option<ElementId> {
        self.get(id).names.get(name).copied()
    }

    /// Returns the input of a node with this name.
    pub fn input(&self, node: ElementId, name: &str) -> Option<ElementId> {
        self.children(node, "input").find(|it| self.get(*it).attribute("name") == Some(name))
    }

    /// Returns an attribute of an element or of the nearest element around it that has it.
    pub fn inherited(&self, id: ElementId, attribute: &str) -> Option<&str> {
        let mut at = Some(id);
        while let Some(id) = at {
            let element = self.get(id);
            if let Some(value) = element.attribute_or_empty(attribute) {
                return Some(value);
            }
            at = element.parent;
        }
        None
    }

    /// The names of the children of an element.
    pub fn names(&self, id: ElementId) -> impl Iterator<Item = &str> {
        self.get(id).names.keys().map(String::as_str)
    }

    fn index_names(&mut self) {
        for id in self.ids() {
            let named =
                self.get(id).children.iter().filter_map(|child| {
                    Some((self.get(*child).attribute("name")?.to_owned(), *child))
                });
            // Of several children with one name the first counts.
            let names: BTreeMap<String, ElementId> = named.rev().collect();
            self.get_mut(id).names = names;
        }
    }
}

struct Reader<'l, 'r> {
    document: Document,
    load: &'r mut Load<'l>,
    sources: &'r mut SourceMap,
    included: BTreeSet<String>,
    bytes: usize,
}

/// The definitions of the nodes of MaterialX Lama.
const LAMA: &str = include_str!("lama.mtlx");

impl Reader<'_, '_> {
    /// Adds the definitions of Lama to a document that uses such nodes without definitions.
    fn add_lama(&mut self) -> Result<(), Fault> {
        let is_lama = |name: &str| name.starts_with("Lama");
        let elements = &self.document.elements;
        let is_used = elements.iter().any(|it| is_lama(&it.tag));
        let is_definition =
            |it: &Element| it.tag == "nodedef" && it.attribute("node").is_some_and(is_lama);
        if !is_used || elements.iter().any(is_definition) {
            return Ok(());
        }
        let name = "lama.mtlx of rtsl";
        let file = self.sources.add(name, LAMA);
        self.read_file(name, LAMA, file, 1)
    }

    fn read_file(
        &mut self,
        name: &str,
        text: &str,
        file: FileId,
        depth: usize,
    ) -> Result<(), Fault> {
        let options =
            ParsingOptions { nodes_limit: limits::XML_NODES, ..ParsingOptions::default() };
        let strict = strict(text);
        let tree = roxmltree::Document::parse_with_options(&strict, options)
            .map_err(|error| syntax_error(text, file, &error))?;
        let root = tree.root_element();
        if root.tag_name().name() != "materialx" {
            let message = format!("`{name}` is no MaterialX document");
            let found = format!("found `{}`, expected `materialx`", root.tag_name().name());
            let span = span_of(root, file);
            return Err(Box::new(
                Diagnostic::new(codes::MATERIALX_SYNTAX, message).at(span, found),
            ));
        }
        if depth == 0 {
            let id = self.document.root();
            *self.document.get_mut(id) = element_of(root, file, None);
        }
        self.read_children(root, name, file, depth)
    }

    fn read_children(
        &mut self,
        root: Node<'_, '_>,
        name: &str,
        file: FileId,
        depth: usize,
    ) -> Result<(), Fault> {
        let document_root = self.document.root();
        // The attributes of an included document hold for its elements only.
        let own: Vec<(String, String)> = attributes_of(root)
            .filter(|(name, _)| matches!(name.as_str(), "colorspace" | "fileprefix" | "version"))
            .collect();
        let mut open = vec![(root.first_element_child(), document_root, 1)];
        while let Some((next, parent, level)) = open.pop() {
            let Some(node) = next else { continue };
            open.push((node.next_sibling_element(), parent, level));
            if level == 1 && node.tag_name().name().ends_with(INCLUDE) {
                self.include(node, name, file, depth)?;
                continue;
            }
            if level > limits::DEPTH {
                let message = format!("elements are nested more than {} deep", limits::DEPTH);
                let diagnostic = Diagnostic::new(codes::MATERIALX_LIMIT, message);
                return Err(Box::new(diagnostic.at(span_of(node, file), "")));
            }
            let id = self.document.add(parent, "", span_of(node, file));
            let mut element = element_of(node, file, Some(parent));
            if level == 1 && depth > 0 {
                for (name, value) in &own {
                    if element.attribute_or_empty(name).is_none() {
                        element.set(name, value.clone());
                    }
                }
            }
            *self.document.get_mut(id) = element;
            open.push((node.first_element_child(), id, level + 1));
        }
        Ok(())
    }

    /// Reads an included document, once. One that cannot be read is left out with a warning.
    fn include(
        &mut self,
        node: Node<'_, '_>,
        name: &str,
        file: FileId,
        depth: usize,
    ) -> Result<(), Fault> {
        let span = span_of(node, file);
        let Some(path) = node.attribute("href") else { return Ok(()) };
        let limit = |what: &str| {
            let diagnostic = Diagnostic::new(codes::MATERIALX_LIMIT, what.to_owned());
            Box::new(diagnostic.at(span, "included here"))
        };
        let Loaded { name: included, text } = match (self.load)(path, name) {
            Ok(loaded) => loaded,
            Err(reason) => {
                let message = format!("`{path}` is not included: {reason}");
                let warning = Diagnostic::new(codes::MATERIALX_IGNORED, message).at(span, "");
                self.document.warnings.push(warning);
                return Ok(());
            }
        };
        if !self.included.insert(included.clone()) {
            return Ok(());
        }
        self.bytes = self.bytes.saturating_add(text.len());
        if depth + 1 > limits::INCLUDE_DEPTH || self.included.len() > limits::INCLUDES {
            return Err(limit("documents include too many others"));
        }
        if self.bytes > limits::TEXT {
            return Err(limit("the included documents are too long"));
        }
        let id = self.sources.add(included.clone(), text.clone());
        self.read_file(&included, &text, id, depth + 1)
    }
}

/// The end of the name of elements that include documents, whatever the prefix of the namespace.
const INCLUDE: &str = "_include";

/// Returns the text with each letter that readers of MaterialX accept and XML does not replaced by another of the same
/// length: `<` in values, as in `<UDIM>`, by `[`, and the colon of prefixes, which documents do not declare, by `_`.
fn strict(text: &str) -> String {
    let mut letters = text.as_bytes().to_vec();
    let mut at = 0;
    while at < letters.len() {
        let rest = &text.as_bytes()[at..];
        at = if rest.starts_with(b"<!--") {
            end_of(text, at, "-->")
        } else if rest.starts_with(b"<![CDATA[") {
            end_of(text, at, "]]>")
        } else if rest.starts_with(b"<?") {
            end_of(text, at, "?>")
        } else if rest.starts_with(b"<!") {
            end_of(text, at, ">")
        } else if rest[0] == b'<' {
            strict_tag(&mut letters, at + 1)
        } else {
            at + 1
        };
    }
    // ASCII letters were replaced by others.
    String::from_utf8(letters).unwrap_or_else(|_| text.to_owned())
}

/// Replaces letters of a tag, and returns the place after it.
fn strict_tag(letters: &mut [u8], start: usize) -> usize {
    let mut quote = None;
    for (place, letter) in letters.iter_mut().enumerate().skip(start) {
        match (quote, *letter) {
            (None, b'>') => return place + 1,
            (None, b':') => *letter = b'_',
            (None, b'"' | b'\'') => quote = Some(*letter),
            (Some(mark), other) if mark == other => quote = None,
            (Some(_), b'<') => *letter = b'[',
            _ => {}
        }
    }
    letters.len()
}

/// The place after the next mark, or the end.
fn end_of(text: &str, from: usize, mark: &str) -> usize {
    let found = text.as_bytes()[from..].windows(mark.len()).position(|it| it == mark.as_bytes());
    found.map_or(text.len(), |place| from + place + mark.len())
}

fn attributes_of<'a>(node: Node<'a, '_>) -> impl Iterator<Item = (String, String)> + 'a {
    let all = node.attributes().collect::<Vec<_>>().into_iter();
    all.map(|it| (it.name().to_owned(), it.value().to_owned()))
}

fn element_of(node: Node<'_, '_>, file: FileId, parent: Option<ElementId>) -> Element {
    Element {
        tag: node.tag_name().name().to_owned(),
        attributes: attributes_of(node).collect(),
        children: Vec::new(),
        parent,
        span: span_of(node, file),
        names: BTreeMap::new(),
    }
}

/// The place of the start tag of an element.
fn span_of(node: Node<'_, '_>, file: FileId) -> Span {
    let range = node.range();
    let text = &node.document().input_text()[range.clone()];
    let length = text.find('>').map_or(text.len(), |end| end + 1);
    Span::new(file, range.start as u32, (range.start + length) as u32)
}

fn syntax_error(text: &str, file: FileId, error: &roxmltree::Error) -> Fault {
    let position = error.pos();
    let before: usize = text
        .split_inclusive('\n')
        .take(position.row.saturating_sub(1) as usize)
        .map(str::len)
        .sum();
    let line = text[before..].lines().next().unwrap_or_default();
    let column = position.col.saturating_sub(1) as usize;
    let ahead: usize = line.chars().take(column).map(char::len_utf8).sum();
    let start = (before + ahead) as u32;
    let (code, message) = match error {
        roxmltree::Error::NodesLimitReached => {
            (codes::MATERIALX_LIMIT, "the document has too many elements".to_owned())
        }
        roxmltree::Error::DtdDetected => (
            codes::MATERIALX_SYNTAX,
            "the document has a document type declaration, which is not read".to_owned(),
        ),
        error => (codes::MATERIALX_SYNTAX, format!("the document is no well-formed XML: {error}")),
    };
    Box::new(Diagnostic::new(code, message).at(Span::new(file, start, start), ""))
}
