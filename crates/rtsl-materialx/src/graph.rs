//! Graphs: the values of nodes and of their inputs, through graphs inside one another.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes, most_similar};

use crate::color_space::ColorSpace;
use crate::document::{Document, Element, ElementId, Fault};
use crate::statements::{Statements, Value};
use crate::translation::ImageUse;
use crate::types::Type;
use crate::{limits, literal, places, special, table, types};

/// The index of a scope.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ScopeId(u32);

/// A graph, or the document's root, with what its inputs are connected to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Scope {
    /// The element whose children are the nodes.
    graph: ElementId,
    /// The node that the graph implements, and the scope of that node.
    instance: Option<(ElementId, ScopeId)>,
    /// The definition of that node.
    definition: Option<ElementId>,
}

/// The source of an input's value.
#[derive(Clone, Debug)]
pub enum Source {
    /// An output of a node.
    Node(ScopeId, ElementId, Option<String>),
    /// A value in the text of an element.
    Constant(ElementId),
    /// A property of the surface, by its name.
    Property(String),
}

/// The values of one material.
pub struct Graph<'d> {
    /// The document.
    pub document: &'d Document,
    /// The statements.
    pub statements: Statements,
    /// The images that it refers to.
    pub images: Vec<ImageUse>,
    /// The attributes that it reads: declarations by name.
    pub attributes: BTreeMap<String, String>,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
    scopes: Vec<Scope>,
    scope_ids: BTreeMap<Scope, ScopeId>,
    values: HashMap<(ScopeId, ElementId, String), Value>,
    open: BTreeSet<(ScopeId, ElementId, String)>,
    depth: usize,
    visits: usize,
    /// The definitions of the document, by the nodes that they define.
    definitions: BTreeMap<String, Vec<ElementId>>,
}

/// The scope of the document's own nodes.
pub const ROOT: ScopeId = ScopeId(0);

impl<'d> Graph<'d> {
    /// A graph without statements.
    pub fn new(document: &'d Document) -> Self {
        let mut definitions: BTreeMap<String, Vec<ElementId>> = BTreeMap::new();
        for id in document.children(document.root(), "nodedef") {
            if let Some(node) = document.get(id).attribute("node") {
                if document.get(id).attribute("namespace").is_none() {
                    definitions.entry(node.to_owned()).or_default().push(id);
                }
                // With the prefix of its namespace, whose colon the reader replaces.
                if let Some(namespace) = document.inherited(id, "namespace") {
                    definitions.entry(format!("{namespace}_{node}")).or_default().push(id);
                }
            }
        }
        let root = Scope { graph: document.root(), instance: None, definition: None };
        Graph {
            document,
            statements: Statements::default(),
            images: Vec::new(),
            attributes: BTreeMap::new(),
            warnings: Vec::new(),
            scopes: vec![root],
            scope_ids: BTreeMap::from([(root, ROOT)]),
            values: HashMap::new(),
            open: BTreeSet::new(),
            depth: 0,
            visits: 0,
            definitions,
        }
    }

    /// A graph of the same scopes, without statements.
    #[must_use]
    pub fn without_values(&self) -> Self {
        Graph {
            document: self.document,
            statements: Statements::default(),
            images: Vec::new(),
            attributes: BTreeMap::new(),
            warnings: Vec::new(),
            scopes: self.scopes.clone(),
            scope_ids: self.scope_ids.clone(),
            values: HashMap::new(),
            open: BTreeSet::new(),
            depth: 0,
            visits: self.visits,
            definitions: self.definitions.clone(),
        }
    }

    /// Adds a statement and returns its value.
    pub fn add(&mut self, ty: Type, expression: String) -> Value {
        let name = self.statements.add(ty.rtsl(), expression);
        Value::new(ty, name)
    }

    /// Returns the member that refers to an image; uses of one image share it.
    pub fn image_member(&mut self, wanted: ImageUse) -> String {
        let is_same = |other: &&ImageUse| {
            other.file == wanted.file
                && other.is_srgb == wanted.is_srgb
                && other.is_repeated == wanted.is_repeated
                && other.is_nearest == wanted.is_nearest
        };
        if let Some(index) = self.images.iter().position(|it| is_same(&it)) {
            self.images[index].has_opacity |= wanted.has_opacity;
            return self.images[index].member.clone();
        }
        let member = format!("image{}", self.images.len() + 1);
        self.images.push(ImageUse { member: member.clone(), ..wanted });
        member
    }

    /// Warns about an element, once for each message.
    pub fn warn(&mut self, message: String, id: ElementId) {
        if self.warnings.iter().all(|other| other.message != message) {
            let warning = Diagnostic::new(codes::MATERIALX_IGNORED, message);
            self.warnings.push(warning.at(self.document.get(id).span, ""));
        }
    }

    /// Returns the value of a node's input; `None` if the document gives none.
    ///
    /// # Errors
    /// If the value cannot be computed.
    pub fn input(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        name: &str,
    ) -> Result<Option<Value>, Fault> {
        match self.port(node, name) {
            Some(port) => self.port_value(scope, port),
            None => Ok(None),
        }
    }

    /// Returns the element of a node's input.
    pub fn port(&self, node: ElementId, name: &str) -> Option<ElementId> {
        self.document.input(node, name)
    }

    /// Returns the value of an input or output.
    pub fn port_value(&mut self, scope: ScopeId, port: ElementId) -> Result<Option<Value>, Fault> {
        let Some(source) = self.source(scope, port)? else { return Ok(None) };
        if matches!(source, Source::Node(..)) {
            self.check_type(port, "the value keeps the type of what it is connected to");
        }
        let value = match source {
            Source::Node(scope, node, output) => self.node(scope, node, output.as_deref())?,
            Source::Constant(element) => self.constant(element, port)?,
            Source::Property(name) => places::property(self, &name, port)?,
        };
        match self.document.get(port).attribute("channels") {
            Some(channels) => {
                let channels = channels.to_owned();
                let ty = self.document.get(port).attribute("type").and_then(Type::named);
                special::swizzled(self, &value, &channels, ty.unwrap_or(value.ty), port).map(Some)
            }
            None => Ok(Some(value)),
        }
    }

    /// Follows the connections of an input or output to a node or a value.
    pub fn source(&mut self, scope: ScopeId, port: ElementId) -> Result<Option<Source>, Fault> {
        let (mut scope, mut port) = (scope, port);
        for _ in 0..limits::GRAPH_DEPTH {
            let element = self.document.get(port);
            let output = element.attribute("output");
            if let Some(name) = element.attribute("nodegraph") {
                let graph = self.child(self.scopes[scope.0 as usize].graph, name, port)?;
                (scope, port) = self.output_of_graph(scope, graph, output, port)?;
            } else if let Some(name) = element.attribute("nodename") {
                let node = self.child(self.scopes[scope.0 as usize].graph, name, port)?;
                match self.document.get(node).tag.as_str() {
                    "nodegraph" => {
                        (scope, port) = self.output_of_graph(scope, node, output, port)?;
                    }
                    "input" | "output" => port = node,
                    _ => return Ok(Some(Source::Node(scope, node, output.map(str::to_owned)))),
                }
            } else if let Some(name) = element.attribute("interfacename") {
                match self.interface(scope, name, port)? {
                    Some((outer, next)) => (scope, port) = (outer, next),
                    None => return Ok(None),
                }
            } else if let Some(name) = output.filter(|_| element.tag == "input") {
                port = self.child(self.scopes[scope.0 as usize].graph, name, port)?;
            } else if has_value(element) {
                return Ok(Some(Source::Constant(port)));
            } else {
                let property = element.attribute("defaultgeomprop");
                return Ok(property.map(|name| Source::Property(name.to_owned())));
            }
        }
        Err(self.cycle(port))
    }

    /// Returns the node that an input is connected to, through graphs and nodes that the document defines.
    ///
    /// # Errors
    /// If the document names something that does not exist.
    pub fn connected(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        name: &str,
    ) -> Result<Option<(ScopeId, ElementId, Option<String>)>, Fault> {
        let Some(port) = self.port(node, name) else { return Ok(None) };
        let mut source = self.source(scope, port)?;
        for _ in 0..limits::DEPTH {
            let Some(Source::Node(scope, node, output)) = source else { return Ok(None) };
            match self.implementation(scope, node, output.as_deref())? {
                Some((inner, port)) => source = self.source(inner, port)?,
                None => return Ok(Some((scope, node, output))),
            }
        }
        Err(self.unsupported("closures through too many graphs".to_owned(), node))
    }

    fn cycle(&self, at: ElementId) -> Fault {
        let message = "connections form a circle, or are too long";
        let diagnostic = Diagnostic::new(codes::MATERIALX_LIMIT, message);
        Box::new(
            diagnostic
                .at(self.document.get(at).span, "")
                .note(format!("at most {} nodes may follow one another", limits::GRAPH_DEPTH)),
        )
    }

    fn child(&self, parent: ElementId, name: &str, at: ElementId) -> Result<ElementId, Fault> {
        // A node may be connected to one of the document itself.
        let found = self.document.named(parent, name);
        found.or_else(|| self.document.named(self.document.root(), name)).ok_or_else(|| {
            let message = format!("there is no node `{name}`");
            let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message)
                .at(self.document.get(at).span, "named here");
            Box::new(match most_similar(name, self.document.names(parent)) {
                Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                None => diagnostic
                    .help("the name is that of a sibling, or of a node graph of the document"),
            })
        })
    }

    /// The scope and the output of a graph that implements no node. The inputs of one within another graph are
    /// connected there.
    fn output_of_graph(
        &mut self,
        outer: ScopeId,
        graph: ElementId,
        output: Option<&str>,
        at: ElementId,
    ) -> Result<(ScopeId, ElementId), Fault> {
        let around = self.scopes[outer.0 as usize].graph;
        let is_inner = around != self.document.root()
            && self.document.get(graph).parent.is_some_and(|parent| parent == around);
        let instance = is_inner.then_some((graph, outer));
        let scope = self.scope(Scope { graph, instance, definition: None });
        Ok((scope, self.output(graph, output, at)?))
    }

    fn output(
        &self,
        graph: ElementId,
        output: Option<&str>,
        at: ElementId,
    ) -> Result<ElementId, Fault> {
        let mut outputs = self.document.children(graph, "output");
        let found = match output {
            Some(name) => outputs.find(|it| self.document.get(*it).attribute("name") == Some(name)),
            None => outputs.next(),
        };
        found.ok_or_else(|| {
            let graph = self.document.get(graph);
            let message = match output {
                Some(name) => format!("`{}` has no output `{name}`", graph.name()),
                None => format!("`{}` has no output", graph.name()),
            };
            let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message);
            let names: Vec<&str> = graph
                .children
                .iter()
                .map(|it| self.document.get(*it))
                .filter(|it| it.tag == "output")
                .map(|it| it.name())
                .collect();
            let diagnostic = diagnostic.at(self.document.get(at).span, "named here");
            Box::new(diagnostic.help(format!("its outputs are {}", list(&names))))
        })
    }

    /// The scope of an output: that of the graph around it.
    pub fn scope_of_output(&mut self, output: ElementId) -> ScopeId {
        let graph = self.document.get(output).parent.unwrap_or(self.document.root());
        self.scope(Scope { graph, instance: None, definition: None })
    }

    fn scope(&mut self, scope: Scope) -> ScopeId {
        if let Some(id) = self.scope_ids.get(&scope) {
            return *id;
        }
        let id = ScopeId(self.scopes.len() as u32);
        self.scopes.push(scope);
        self.scope_ids.insert(scope, id);
        id
    }

    /// The element that gives the value of a graph's input, with its scope.
    fn interface(
        &self,
        scope: ScopeId,
        name: &str,
        at: ElementId,
    ) -> Result<Option<(ScopeId, ElementId)>, Fault> {
        let Scope { graph, instance, definition } = self.scopes[scope.0 as usize];
        let own = self.document.input(graph, name);
        if let Some((node, outer)) = instance {
            let given = self.document.input(node, name);
            let defined = definition.and_then(|it| self.document.input(it, name));
            let inherited = definition.and_then(|it| self.inherited_input(it, name));
            if let Some(port) = given {
                return Ok(Some((outer, port)));
            }
            if let Some(port) = defined.or(inherited).or(own) {
                return Ok(Some((outer, port)));
            }
        } else if let Some(port) = own {
            return Ok(Some((ROOT, port)));
        } else if let Some(port) =
            self.definition_of_graph(graph).and_then(|it| self.document.input(it, name))
        {
            // A graph that implements a definition, used for its outputs alone.
            return Ok(Some((ROOT, port)));
        }
        let message = format!("`{}` has no input `{name}`", self.document.get(graph).name());
        let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message);
        Err(Box::new(diagnostic.at(self.document.get(at).span, "named here")))
    }

    fn definition_of_graph(&self, graph: ElementId) -> Option<ElementId> {
        let name = self.document.get(graph).attribute("nodedef")?;
        self.document.named(self.document.root(), name)
    }

    /// An input of a definition that another inherits.
    fn inherited_input(&self, definition: ElementId, name: &str) -> Option<ElementId> {
        let mut at = definition;
        for _ in 0..limits::DEPTH {
            let parent = self.document.get(at).attribute("inherit")?;
            at = self.document.named(self.document.root(), parent)?;
            if let Some(port) = self.document.input(at, name) {
                return Some(port);
            }
        }
        None
    }

    /// The value that an element gives as text.
    fn constant(&mut self, element: ElementId, port: ElementId) -> Result<Value, Fault> {
        let document = self.document;
        let given = document.get(element);
        let text = given.attribute_or_empty("value").unwrap_or_default();
        let ty = given.attribute("type").or_else(|| document.get(port).attribute("type"));
        let name = ty.unwrap_or("float");
        let Some(ty) = Type::named(name) else {
            return Err(
                self.unsupported(format!("values of type `{name}` are not supported"), element)
            );
        };
        if ty == Type::Text {
            return Ok(Value::new(ty, text));
        }
        let mut numbers = self.numbers(text, ty, element)?;
        if ty.is_color() {
            let space = document.inherited(element, "colorspace").unwrap_or_default();
            match ColorSpace::named(space) {
                Some(space) => space.convert(&mut numbers),
                None => self.warn(unknown_space(space), element),
            }
        }
        if given.attribute("unit") == Some("radian") {
            numbers.iter_mut().for_each(|value| *value = value.to_degrees());
        }
        Ok(Value::constant(ty, numbers))
    }

    /// The numbers of a value that an element gives as text.
    fn numbers(&mut self, text: &str, ty: Type, element: ElementId) -> Result<Vec<f64>, Fault> {
        if let Some(numbers) = literal::numbers(text, ty) {
            return Ok(numbers);
        }
        let (name, count) = (ty.name(), ty.count());
        if let Some(numbers) = literal::first_numbers(text, ty) {
            let kept = if count == 1 { "the first one counts" } else { "the first ones count" };
            let message = format!("`{text}` has too many numbers for the type `{name}`: {kept}");
            self.warn(message, element);
            return Ok(numbers);
        }
        let expected = match ty {
            Type::Boolean => "expected `true` or `false`".to_owned(),
            _ if count == 1 => "expected a number".to_owned(),
            _ => format!("expected {count} numbers, with commas between them"),
        };
        let message = format!("`{text}` is no value of type `{name}`");
        let diagnostic = Diagnostic::new(codes::MATERIALX_SYNTAX, message);
        Err(Box::new(diagnostic.at(self.document.get(element).span, "").help(expected)))
    }

    /// Warns of an element whose type neither MaterialX nor the document defines, with what takes its place.
    fn check_type(&mut self, id: ElementId, instead: &str) {
        let document = self.document;
        let Some(name) = document.get(id).attribute("type") else { return };
        if types::names().any(|known| known == name) {
            return;
        }
        let mut known: Vec<&str> = types::names().collect();
        known.extend(
            document.children(document.root(), "typedef").map(|it| document.get(it).name()),
        );
        let message = format!("unknown type `{name}`: {instead}");
        if known.contains(&name) || self.warnings.iter().any(|other| other.message == message) {
            return;
        }
        let warning = Diagnostic::new(codes::MATERIALX_IGNORED, message);
        let warning = warning.at(document.get(id).span, "");
        self.warnings.push(match most_similar(name, known) {
            Some(near) => warning.help(format!("did you mean `{near}`?")),
            None => warning,
        });
    }

    /// Returns the value of a node's output.
    pub fn node(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        output: Option<&str>,
    ) -> Result<Value, Fault> {
        let key = (scope, node, output.unwrap_or_default().to_owned());
        if let Some(value) = self.values.get(&key) {
            return Ok(value.clone());
        }
        self.visits += 1;
        let is_long = self.visits > limits::VISITS || self.statements.len() > limits::STATEMENTS;
        if is_long {
            let message = "the material has too many nodes";
            let diagnostic = Diagnostic::new(codes::MATERIALX_LIMIT, message)
                .at(self.document.get(node).span, "")
                .note(format!("it may have {} different ones", limits::STATEMENTS));
            return Err(Box::new(diagnostic));
        }
        if self.depth > limits::GRAPH_DEPTH.min(rtsl_source::deep_stack::depth())
            || !self.open.insert(key.clone())
        {
            return Err(self.cycle(node));
        }
        self.depth += 1;
        let value = self.new_node(scope, node, output);
        self.depth -= 1;
        self.open.remove(&key);
        let value = value?;
        self.values.insert(key, value.clone());
        Ok(value)
    }

    fn new_node(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        output: Option<&str>,
    ) -> Result<Value, Fault> {
        if let Some((inner, port)) = self.implementation(scope, node, output)? {
            let value = self.port_value(inner, port)?;
            return match value {
                Some(value) => Ok(value),
                None => self.default_of_port(port),
            };
        }
        if let Some(value) = special::value(self, scope, node, output)? {
            self.check_type(node, "the node counts as one of the type `float`");
            return Ok(value);
        }
        match table::value(self, scope, node)? {
            Some(value) => Ok(value),
            None => Err(self.unknown_node(node)),
        }
    }

    fn default_of_port(&self, port: ElementId) -> Result<Value, Fault> {
        let ty = self.document.get(port).attribute("type").and_then(Type::named);
        match ty.filter(|ty| *ty != Type::Text) {
            Some(ty) => Ok(Value::constant(ty, vec![0.0; ty.count()])),
            None => Err(self.unsupported("an output without a value".to_owned(), port)),
        }
    }

    /// For a node that the document itself defines, the scope of the graph that implements it, and the output.
    pub fn implementation(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        output: Option<&str>,
    ) -> Result<Option<(ScopeId, ElementId)>, Fault> {
        let document = self.document;
        let element = document.get(node);
        let Some(definition) = self.definition_of(node) else { return Ok(None) };
        let Some(graph) = self.graph_of(definition) else {
            if special::is_known(&element.tag) || table::is_known(&element.tag) {
                return Ok(None);
            }
            let message = format!("`{}` is defined, but no node graph implements it", element.tag);
            return Err(self.unsupported(message, node));
        };
        let instance = Some((node, scope));
        let inner = self.scope(Scope { graph, instance, definition: Some(definition) });
        if self.scopes.len() > limits::STATEMENTS {
            return Err(self.cycle(node));
        }
        Ok(Some((inner, self.output(graph, output, node)?)))
    }

    /// The definition that a node names, or the one that fits it best.
    fn definition_of(&self, node: ElementId) -> Option<ElementId> {
        let document = self.document;
        let element = document.get(node);
        let named = element.attribute("nodedef");
        let named = named.and_then(|name| document.named(document.root(), name));
        let named = named.filter(|it| document.get(*it).tag == "nodedef");
        named.or_else(|| self.best_definition(node, self.definitions.get(&element.tag)?))
    }

    /// The first definition with the type of a node and its version.
    fn best_definition(&self, node: ElementId, among: &[ElementId]) -> Option<ElementId> {
        let document = self.document;
        let element = document.get(node);
        let version = element.attribute("version");
        let fits = |definition: &&ElementId| {
            let outputs: Vec<ElementId> = document.children(**definition, "output").collect();
            let ty = element.attribute("type").unwrap_or_default();
            let is_same = ty.is_empty()
                || outputs.is_empty()
                || (ty == "multioutput" && outputs.len() > 1)
                || outputs.iter().any(|it| document.get(*it).attribute("type") == Some(ty));
            let own = document.get(**definition).attribute("version");
            is_same && (version.is_none() || own.is_none() || own == version)
        };
        let is_default =
            |it: &&ElementId| document.get(**it).attribute("isdefaultversion") == Some("true");
        let fitting: Vec<&ElementId> = among.iter().filter(fits).collect();
        let chosen = fitting.iter().find(|it| is_default(it)).or(fitting.first());
        chosen.map(|id| **id).or(among.first().copied())
    }

    fn graph_of(&self, definition: ElementId) -> Option<ElementId> {
        let document = self.document;
        let name = document.get(definition).attribute("name")?;
        let root = document.root();
        let implements = |it: &ElementId| document.get(*it).attribute("nodedef") == Some(name);
        if let Some(graph) = document.children(root, "nodegraph").find(implements) {
            return Some(graph);
        }
        let implementation = document.children(root, "implementation").find(implements)?;
        document.named(root, document.get(implementation).attribute("nodegraph")?)
    }

    /// The error of a node that is not supported.
    pub fn unsupported(&self, message: String, at: ElementId) -> Fault {
        let span: Span = self.document.get(at).span;
        Box::new(Diagnostic::new(codes::MATERIALX_UNSUPPORTED, message).at(span, ""))
    }

    fn unknown_node(&self, node: ElementId) -> Fault {
        let element = self.document.get(node);
        let tag = &element.tag;
        if let Some(why) = special::reason(tag) {
            return self.unsupported(format!("`{tag}` is not supported: {why}"), node);
        }
        if table::is_known(tag) {
            let ty = element.attribute("type").unwrap_or("none");
            return self.unsupported(format!("`{tag}` of type `{ty}` is not supported"), node);
        }
        let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, format!("unknown node `{tag}`"))
            .at(element.span, "");
        let mut known: Vec<&str> = table::nodes().collect();
        known.extend(self.definitions.keys().map(String::as_str));
        Box::new(match most_similar(tag, known.iter().copied()) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic.help(
                "the document defines nodes of its own by `nodedef` and a `nodegraph`; include the document that does",
            ),
        })
    }
}

/// True if an element gives a value. Only texts may be empty.
fn has_value(element: &Element) -> bool {
    let is_text = matches!(element.attribute("type"), Some("string" | "filename"));
    element.attribute("value").is_some()
        || (is_text && element.attribute_or_empty("value").is_some())
}

/// The warning about a colour space that is not known.
pub fn unknown_space(space: &str) -> String {
    format!("the colour space `{space}` is not known: its values count as linear")
}

fn list(names: &[&str]) -> String {
    match names.is_empty() {
        true => "none".to_owned(),
        false => names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
    }
}
