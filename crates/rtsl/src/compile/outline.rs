//! The declarations of a text, without their meaning: what commands list and show.

use rtsl_source::{SourceMap, Span};
use rtsl_syntax::ast::{self, ClassForm, Item, Qualifier, TranslationUnit, TypeName};

/// The classes and functions of a text, which is parsed and not checked. Those of imported modules are not among them.
///
/// ```
/// use rtsl::Compiler;
///
/// let text = "float halved(float x) { return 0.5 * x; }\nclass A : rt_Texture {\n    void lookup() { }\n};\n";
/// let outline = Compiler::default().outline("a.rtsl", text, &mut rtsl::NoIncludes);
/// assert_eq!(outline.functions[0].to_string(), "float halved(float x)");
/// assert_eq!((outline.classes[0].name.as_str(), outline.classes[0].line), ("A", 2));
/// assert_eq!(outline.classes[0].text, "class A : rt_Texture {\n    void lookup() { }\n};");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Outline {
    /// The classes, in the order of the text.
    pub classes: Vec<ClassOutline>,
    /// The functions at file scope.
    pub functions: Vec<FunctionOutline>,
    /// The classes of the standard library that those of the text inherit, at first or second hand.
    pub inherited: Vec<ClassOutline>,
}

/// A class.
#[derive(Clone, Debug)]
pub struct ClassOutline {
    /// Its name.
    pub name: String,
    /// Its roles and the class that it inherits.
    pub bases: Vec<String>,
    /// The file in which it is.
    pub file: String,
    /// The first line of its text.
    pub line: u32,
    /// Its text, with the comments before it.
    pub text: String,
    /// Its functions and methods.
    pub functions: Vec<FunctionOutline>,
}

/// A function or a method.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FunctionOutline {
    /// Its name.
    pub name: String,
    /// The type of its result as written; `void` if there is none.
    pub result: String,
    /// The parameters.
    pub parameters: Vec<ParameterOutline>,
}

/// A parameter of a function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterOutline {
    /// Its name; empty if it has none.
    pub name: String,
    /// Its type as written, with the sizes of arrays.
    pub ty: String,
    /// The way of its value.
    pub passing: Passing,
}

/// The way of a parameter's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passing {
    /// To the function.
    In,
    /// From the function.
    Out,
    /// To the function and back.
    InOut,
}

impl Outline {
    /// The outline of a parsed text.
    pub(super) fn of(tree: &TranslationUnit, sources: &SourceMap) -> Outline {
        let headers: Vec<Span> = tree.items.iter().filter_map(header).collect();
        let classes = tree.items.iter().filter_map(|item| match item {
            Item::Class(class) => Some(ClassOutline::of(class, &headers, sources)),
            _ => None,
        });
        Outline {
            classes: classes.collect(),
            functions: functions(&tree.items, sources),
            inherited: Vec::new(),
        }
    }

    /// Returns the class of this name.
    pub fn class(&self, name: &str) -> Option<&ClassOutline> {
        self.classes.iter().find(|class| class.name == name)
    }

    /// Returns the names of inherited classes that are neither in the text nor known yet.
    pub(super) fn missing_bases(&self) -> Vec<String> {
        let all = || self.classes.iter().chain(&self.inherited);
        let bases = all().flat_map(|class| class.bases.iter().map(move |base| (class, base)));
        let is_known = |class: &ClassOutline, base: &str| {
            all().any(|it| it.name == base && !std::ptr::eq(it, class))
        };
        let missing = bases.filter(|(class, base)| !is_known(class, base));
        missing.map(|(_, base)| base.clone()).collect()
    }

    /// Returns a class and those that it inherits of this text and the standard library, the nearest first.
    pub fn generations(&self, name: &str) -> Vec<&ClassOutline> {
        let mut generations: Vec<&ClassOutline> = self.class(name).into_iter().collect();
        while let Some(last) = generations.last() {
            // A class may have the name of the class of the library that it inherits.
            let others = || self.classes.iter().filter(|it| it.name != last.name);
            let base = last
                .bases
                .iter()
                .find_map(|base| others().chain(&self.inherited).find(|class| class.name == *base));
            match base {
                Some(base) if generations.iter().all(|it| !std::ptr::eq(*it, base)) => {
                    generations.push(base);
                }
                Some(_) | None => break,
            }
        }
        generations
    }
}

impl ClassOutline {
    fn of(class: &ast::Class, headers: &[Span], sources: &SourceMap) -> ClassOutline {
        let file = sources.file(class.span.file);
        let start = with_comments(&file.text, class.span.start as usize);
        let mut later =
            headers.iter().filter(|it| it.file == class.span.file && it.start > class.span.start);
        let next = later.next().map(|it| with_comments(&file.text, it.start as usize));
        let end = match class.form {
            ClassForm::Header => next.unwrap_or(file.text.len()),
            ClassForm::Block => end_of_block(class, &file.text),
        };
        let text = file.text.get(start..end.max(start)).unwrap_or_default();
        ClassOutline {
            name: class.name.name.clone(),
            bases: class.bases.iter().map(|base| base.name.clone()).collect(),
            file: file.name.clone(),
            line: sources.position(class.span.file, start as u32).line,
            text: text.trim_end().to_owned(),
            functions: functions(&class.items, sources),
        }
    }
}

impl std::fmt::Display for FunctionOutline {
    /// `float f(vec3 p, out float d)`
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let parameters = self.parameters.iter().map(|parameter| {
            let passing = match parameter.passing {
                Passing::In => "",
                Passing::Out => "out ",
                Passing::InOut => "inout ",
            };
            format!("{passing}{} {}", parameter.ty, parameter.name).trim_end().to_owned()
        });
        let parameters: Vec<String> = parameters.collect();
        write!(f, "{} {}({})", self.result, self.name, parameters.join(", "))
    }
}

fn header(item: &Item) -> Option<Span> {
    match item {
        Item::Class(class) => Some(class.span),
        _ => None,
    }
}

/// The functions among items, each once: prototypes announce others.
fn functions(items: &[Item], sources: &SourceMap) -> Vec<FunctionOutline> {
    let mut functions: Vec<FunctionOutline> = Vec::new();
    for item in items {
        let Item::Function(function) = item else { continue };
        let Some(result) = &function.result else { continue };
        let parameters = function.parameters.iter().map(|parameter| {
            let has = |qualifier| parameter.qualifiers.find(qualifier).is_some();
            let passing = match (has(Qualifier::Out), has(Qualifier::InOut)) {
                (_, true) => Passing::InOut,
                (true, false) => Passing::Out,
                (false, false) => Passing::In,
            };
            let name = parameter.name.as_ref().map_or(String::new(), |name| name.name.clone());
            ParameterOutline { name, ty: written(&parameter.ty, sources), passing }
        });
        let outline = FunctionOutline {
            name: function.name.name.clone(),
            result: written(result, sources),
            parameters: parameters.collect(),
        };
        let types = |it: &FunctionOutline| -> Vec<String> {
            it.parameters.iter().map(|parameter| parameter.ty.clone()).collect()
        };
        let known = functions
            .iter()
            .position(|known| known.name == outline.name && types(known) == types(&outline));
        match known {
            // The definition has the names of parameters.
            Some(known) => functions[known] = outline,
            None => functions.push(outline),
        }
    }
    functions
}

/// A type with the sizes of arrays.
fn written(ty: &TypeName, sources: &SourceMap) -> String {
    let mut text = ty.name.name.clone();
    for size in &ty.sizes {
        let size = size.as_ref().map_or("", |size| {
            let Span { file, start, end } = size.span;
            sources.file(file).text.get(start as usize..end as usize).unwrap_or_default()
        });
        text += &format!("[{size}]");
    }
    text
}

/// The start of the comments in the lines just before a place.
fn with_comments(text: &str, place: usize) -> usize {
    let mut start = text[..place].rfind('\n').map_or(0, |end| end + 1);
    if !text[start..place].trim().is_empty() {
        // Something else is before it in the line.
        return place;
    }
    while start > 0 {
        let line = text[..start - 1].rfind('\n').map_or(0, |end| end + 1);
        if !text[line..start].trim_start().starts_with("//") {
            break;
        }
        start = line;
    }
    start
}

/// The end of a class in braces: after its last item only comments are before the brace.
fn end_of_block(class: &ast::Class, text: &str) -> usize {
    let ends = class.items.iter().map(|item| end_of_item(item, class.span));
    let mut at = ends.fold(class.span.end, u32::max) as usize;
    loop {
        let rest = text.get(at..).unwrap_or_default();
        at += if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(after) = rest.strip_prefix('}') {
            let end = at + 1;
            let space = after.len() - after.trim_start().len();
            return if after.trim_start().starts_with(';') { end + space + 1 } else { end };
        } else {
            match rest.chars().next() {
                Some(letter) => letter.len_utf8(),
                None => return text.len(),
            }
        };
    }
}

/// The end of an item in the file of its class.
fn end_of_item(item: &Item, class: Span) -> u32 {
    let span = match item {
        Item::Struct(it) => it.span,
        Item::Enumeration(it) => it.span,
        Item::Assertion(it) => it.span,
        Item::Variable(it) => it.span,
        Item::Class(it) => it.span,
        Item::Function(it) => it.body.as_ref().map_or(it.span, |body| body.span),
    };
    if span.file == class.file { span.end } else { 0 }
}
