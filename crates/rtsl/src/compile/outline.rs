//! The declarations of a text, without their meaning: what commands list and show.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use rtsl_source::{FileId, SourceMap, Span};
use rtsl_syntax::Comments;
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
        let classes = tree.items.iter().filter_map(|item| match item {
            Item::Class(class) => Some(class),
            _ => None,
        });
        let classes: Vec<&ast::Class> = classes.collect();
        let mut comments = BTreeMap::new();
        let mut start_of = |class: &ast::Class| {
            let text = &sources.file(class.span.file).text;
            let comments = comments.entry(class.span.file).or_insert_with(|| Comments::of(text));
            comments.start_before(text, class.span.start as usize) as u32
        };
        let starts: Vec<u32> = classes.iter().map(|class| start_of(class)).collect();
        // A class whose members follow its header lasts up to the next class of its file.
        let mut next: BTreeMap<FileId, u32> = BTreeMap::new();
        let mut outlines = Vec::new();
        for (class, start) in classes.iter().zip(starts).rev() {
            let file = class.span.file;
            let length = sources.file(file).text.len() as u32;
            let end = match class.form {
                ClassForm::Header => next.get(&file).copied().unwrap_or(length),
                ClassForm::Block if class.end.file == file => class.end.start,
                ClassForm::Block => length,
            };
            outlines.push(ClassOutline::of(class, start..end.max(start), sources));
            next.insert(file, start);
        }
        outlines.reverse();
        Outline {
            classes: outlines,
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
        let mut known: HashMap<&str, usize> = HashMap::new();
        for class in all() {
            *known.entry(&class.name).or_default() += 1;
        }
        // A class does not inherit itself, but may have the name of its base.
        let is_known = |class: &ClassOutline, base: &str| {
            known.get(base).copied().unwrap_or(0) > usize::from(class.name == base)
        };
        let bases = all().flat_map(|class| class.bases.iter().map(move |base| (class, base)));
        let missing = bases.filter(|(class, base)| !is_known(class, base));
        missing.map(|(_, base)| base.clone()).collect()
    }

    /// Returns a class and those that it inherits of this text and the standard library, the nearest first.
    pub fn generations(&self, name: &str) -> Vec<&ClassOutline> {
        let [own, inherited] = [&self.classes, &self.inherited].map(|classes| by_name(classes));
        let mut generations = Vec::new();
        let mut seen: HashSet<*const ClassOutline> = HashSet::new();
        let mut next = own.get(name).copied();
        while let Some(class) = next.filter(|it| seen.insert(*it)) {
            generations.push(class);
            next = class.bases.iter().map(String::as_str).find_map(|base| {
                // A class may have the name of the class of the library that it inherits.
                let of_text = own.get(base).filter(|_| base != class.name);
                of_text.or_else(|| inherited.get(base)).copied()
            });
        }
        generations
    }
}

/// The first class of each name.
fn by_name(classes: &[ClassOutline]) -> HashMap<&str, &ClassOutline> {
    let mut named = HashMap::new();
    for class in classes {
        named.entry(class.name.as_str()).or_insert(class);
    }
    named
}

impl ClassOutline {
    /// The outline of a class whose text is a range of its file.
    fn of(class: &ast::Class, range: Range<u32>, sources: &SourceMap) -> ClassOutline {
        let file = sources.file(class.span.file);
        let text = &file.text[range.start as usize..range.end as usize];
        ClassOutline {
            name: class.name.name.clone(),
            bases: class.bases.iter().map(|base| base.name.clone()).collect(),
            file: file.name.clone(),
            line: sources.line(class.span.file, range.start),
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

/// The functions among items, each once: prototypes announce others.
fn functions(items: &[Item], sources: &SourceMap) -> Vec<FunctionOutline> {
    let mut functions: Vec<FunctionOutline> = Vec::new();
    let mut places: HashMap<(String, Vec<String>), usize> = HashMap::new();
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
        let types = outline.parameters.iter().map(|parameter| parameter.ty.clone()).collect();
        let known = places.entry((outline.name.clone(), types)).or_insert(functions.len());
        match functions.get_mut(*known) {
            // The definition has the names of parameters.
            Some(known) => *known = outline,
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
