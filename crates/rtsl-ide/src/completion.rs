//! Completion: the words that could be typed at a place.

use rtsl::{Direction, IncludeLoader, Method, Role, state_variables};
use rtsl_sema::hir::Type;
use rtsl_sema::index::{CURSOR, Completion, CompletionPlace, VisibleName};
use rtsl_spec::builtins::{self, REFERENCE_METHODS, SpecStruct, Usable};
use rtsl_spec::{ANNOTATION_KEYS, AnnotationKey, AnnotationKind};
use rtsl_syntax::{DIRECTIVES, type_names};

use crate::cursor::Cursor;
use crate::declaration::DeclarationKind;
use crate::document::Document;
use crate::hover::{builtin_text, role_text, roles_of, state_text};
use crate::semantic::SemanticKind;

/// A word that could be typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompletionItem {
    /// The text that is shown, and inserted unless `insert` says otherwise.
    pub label: String,
    /// The kind.
    pub kind: SemanticKind,
    /// Its type or header.
    pub detail: Option<String>,
    /// Its description, in Markdown.
    pub documentation: Option<String>,
    /// The text to insert, with places for the author's own as `$1`, `$0`.
    pub insert: Option<String>,
    /// The rank: items with smaller numbers are likelier.
    pub rank: u8,
}

/// The bytes that are replaced, and what could stand there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completions {
    /// The bytes of the text.
    pub range: std::ops::Range<usize>,
    /// The items.
    pub items: Vec<CompletionItem>,
}

const STATEMENTS: [(&str, &str); 12] = [
    ("if", "if ($1) {\n    $0\n}"),
    ("else", "else {\n    $0\n}"),
    ("for", "for (int ${1:i} = 0; ${1:i} < $2; ++${1:i}) {\n    $0\n}"),
    ("while", "while ($1) {\n    $0\n}"),
    ("do", "do {\n    $0\n} while ($1);"),
    ("switch", "switch ($1) {\ncase $2:\n    $0\n}"),
    ("illuminance", "illuminance {\n    $0\n}"),
    ("return", "return $0;"),
    ("break", "break;"),
    ("continue", "continue;"),
    ("const", "const "),
    ("precise", "precise "),
];

const DECLARATIONS: [(&str, &str); 10] = [
    ("public", "public "),
    ("private", "private "),
    ("scratch", "scratch "),
    ("texture", "texture "),
    ("attribute", "attribute "),
    ("output", "output "),
    ("const", "const "),
    ("struct", "struct $1 {\n    $0\n};"),
    ("enum", "enum $1 { $0 };"),
    ("constructor", "constructor() {\n    $0\n}"),
];

const FILE_ITEMS: [(&str, &str); 5] = [
    ("class", "class ${1:Name} : $0;"),
    ("import", "import $0;"),
    ("const", "const "),
    ("struct", "struct $1 {\n    $0\n};"),
    ("enum", "enum $1 { $0 };"),
];

/// Returns what could be typed at an offset of a text, whose includes and modules come from `loader`.
pub fn complete(
    name: &str,
    text: &str,
    offset: usize,
    loader: &mut dyn IncludeLoader,
) -> Completions {
    let cursor = Cursor::at(text, offset);
    let range = cursor.start..cursor.end;
    let items = if cursor.is_inert { Vec::new() } else { items_at(name, text, &cursor, loader) };
    Completions { range, items }
}

fn items_at(
    name: &str,
    text: &str,
    cursor: &Cursor<'_>,
    loader: &mut dyn IncludeLoader,
) -> Vec<CompletionItem> {
    if let Some(directive) = cursor.directive() {
        let is_name =
            directive[1..].trim_start().chars().all(|letter| letter.is_ascii_alphanumeric());
        return if is_name { directives() } else { Vec::new() };
    }
    if cursor.is_annotation_key() {
        return annotation_keys();
    }
    // The text that probably follows is added if the word alone would end in an error; a function at the end of the text
    // may not be closed yet.
    for rest in ["", "()", ";", " x;", ");", "() { }", "; }", "); }"] {
        let text = format!("{}{CURSOR}{rest}{}", &text[..cursor.start], &text[cursor.end..]);
        let document = Document::new(name, &text, loader);
        let place = rtsl::Span::new(document.file(), cursor.start as u32, cursor.start as u32);
        if cursor.before(0) == "void" {
            return method_names(&document, place);
        }
        if let Some(found) = &document.analysis.index.completion {
            return items_of(&document, found, place);
        }
    }
    let begins_item =
        matches!(cursor.before(0), "" | ";" | "}") || cursor.before(0).starts_with('#');
    if begins_item { file_items() } else { Vec::new() }
}

/// The words that begin the items of a file.
fn file_items() -> Vec<CompletionItem> {
    let mut items = keywords(&FILE_ITEMS);
    items.extend(types(1));
    items
}

fn items_of(document: &Document, found: &Completion, place: rtsl::Span) -> Vec<CompletionItem> {
    let functions = [DeclarationKind::Function, DeclarationKind::Constructor];
    let function = document.declarations.around(place, &functions);
    let function = function.filter(|(_, it)| it.header.end <= place.start);
    match &found.place {
        CompletionPlace::Value => values(document, found, function.map(|(_, it)| it.name.as_str())),
        CompletionPlace::Type => match function {
            Some((_, function)) => {
                let mut items = values(document, found, Some(&function.name));
                items.extend(roles());
                items
            }
            None => declarations(document, found),
        },
        CompletionPlace::Base => bases(document, found),
        CompletionPlace::Part { ty, shown, fields } => parts(ty, shown, fields),
        CompletionPlace::Module(module) => of_module(found, module),
        CompletionPlace::Inherited(functions) => {
            let item = |signature: &rtsl_sema::index::Signature| {
                let name = signature.text.split('(').next().unwrap_or_default();
                let name = name.rsplit(' ').next().unwrap_or_default();
                CompletionItem {
                    detail: Some(signature.text.clone()),
                    documentation: signature.documentation.clone(),
                    insert: Some(call(name, !signature.parameters.is_empty())),
                    ..item(name, SemanticKind::Method, 0)
                }
            };
            functions.iter().map(item).collect()
        }
    }
}

fn item(label: &str, kind: SemanticKind, rank: u8) -> CompletionItem {
    let label = label.to_owned();
    CompletionItem { label, kind, detail: None, documentation: None, insert: None, rank }
}

fn call(name: &str, has_parameters: bool) -> String {
    if has_parameters { format!("{name}($0)") } else { format!("{name}()") }
}

/// The names of values, functions and types, with keywords of statements.
fn values(document: &Document, found: &Completion, function: Option<&str>) -> Vec<CompletionItem> {
    let mut items: Vec<CompletionItem> = found
        .names
        .iter()
        .filter(|name| !name.name.contains('.') && name.name != CURSOR)
        .map(|name| visible(document, name))
        .collect();
    let method = function.and_then(Method::from_name);
    items.extend(states(&found.roles, method));
    items.extend(functions(method));
    items.extend(document.macros.names().map(|name| item(name, SemanticKind::Macro, 3)));
    items.extend(types(4));
    items.extend(["true", "false"].map(|name| item(name, SemanticKind::Keyword, 4)));
    items.extend(keywords(&STATEMENTS));
    items
}

fn keywords(list: &[(&str, &str)]) -> Vec<CompletionItem> {
    let keyword = |(label, insert): &(&str, &str)| CompletionItem {
        insert: Some((*insert).to_owned()),
        ..item(label, SemanticKind::Keyword, 5)
    };
    list.iter().map(keyword).collect()
}

fn visible(document: &Document, name: &VisibleName) -> CompletionItem {
    let (kind, rank) = match name.kind {
        "a variable" => (SemanticKind::Variable, 0),
        "a member" => (SemanticKind::Property, 1),
        "a constant" => (SemanticKind::Variable, 1),
        "a struct" => (SemanticKind::Struct, 2),
        "an enumeration" => (SemanticKind::Enumeration, 2),
        "a function" => (SemanticKind::Function, 1),
        "a class" => (SemanticKind::Class, 3),
        "a module" => (SemanticKind::Module, 2),
        _ => (SemanticKind::Variable, 2),
    };
    let declared = document.declarations.at(name.span).map(|id| document.declarations.get(id));
    let insert = (kind == SemanticKind::Function).then(|| {
        let has_parameters = declared.is_none_or(|it| !it.parameters.is_empty());
        call(&name.name, has_parameters)
    });
    CompletionItem {
        detail: name.ty.clone(),
        documentation: declared.and_then(|it| it.documentation.clone()),
        insert,
        ..item(&name.name, kind, rank)
    }
}

/// The state variables of roles: those that the method receives or sets before others.
fn states(roles: &[Role], method: Option<Method>) -> Vec<CompletionItem> {
    let mut items = Vec::new();
    for variable in state_variables().iter().filter(|variable| !variable.is_hidden()) {
        let rows: Vec<_> = roles.iter().filter_map(|role| role.row(variable.name)).collect();
        if rows.is_empty() {
            continue;
        }
        let direction = method.and_then(|method| rows.iter().find_map(|row| row.direction(method)));
        let (rank, passes) = match direction {
            Some(Direction::In) => (1, " (input)"),
            Some(Direction::Out) => (1, " (output)"),
            Some(Direction::InOut) => (1, " (input and output)"),
            None => (2, ""),
        };
        items.push(CompletionItem {
            detail: Some(format!("{}{passes}", variable.ty.name())),
            documentation: Some(state_text(variable, roles, method)),
            ..item(variable.name, SemanticKind::Variable, rank)
        });
    }
    items
}

/// The built-in functions that a method may call; a function may be called by any.
fn functions(method: Option<Method>) -> Vec<CompletionItem> {
    let usable = builtins::all().filter(|builtin| match builtin.usable {
        Usable::Anywhere => true,
        Usable::Methods(methods) => method.is_none_or(|method| methods.contains(&method)),
        Usable::Prelude => false,
    });
    let is_plain = |builtin: &&builtins::Builtin| !builtins::overloads(builtin.name).is_empty();
    let mut names: Vec<&str> = usable.filter(is_plain).map(|builtin| builtin.name).collect();
    names.dedup();
    let function = |name: &str| {
        let overloads = builtins::overloads(name);
        let has_parameters = overloads.iter().any(|overload| !overload.parameters.is_empty());
        CompletionItem {
            detail: overloads.first().map(ToString::to_string),
            documentation: builtin_text(name, None),
            insert: Some(call(name, has_parameters)),
            ..item(name, SemanticKind::Function, 3)
        }
    };
    names.into_iter().map(function).collect()
}

fn roles() -> Vec<CompletionItem> {
    let role = |role: Role| CompletionItem {
        documentation: Some(role_text(role)),
        ..item(role.class(), SemanticKind::Class, 3)
    };
    Role::ALL.into_iter().map(role).collect()
}

/// The words that begin declarations: qualifiers, types, and the methods that the class does not have yet.
fn declarations(document: &Document, found: &Completion) -> Vec<CompletionItem> {
    let mut items = keywords(&DECLARATIONS);
    items.extend(types(1));
    items.extend(roles());
    let structs = found.names.iter().filter(|name| {
        matches!(name.kind, "a struct" | "an enumeration") && !name.name.contains('.')
    });
    items.extend(structs.map(|name| visible(document, name)));
    items.extend(keywords(&FILE_ITEMS[..1]));
    items.extend(methods(&found.roles, "void "));
    items
}

/// The methods of roles, each with a body to fill.
fn methods(roles: &[Role], before: &str) -> Vec<CompletionItem> {
    let mut methods: Vec<Method> = roles.iter().flat_map(|role| role.methods()).collect();
    methods.dedup();
    let method = |method: Method| {
        let written = roles.iter().flat_map(|role| {
            let rows = rtsl::rows().iter().filter(move |row| row.role == Some(*role));
            rows.filter(move |row| {
                row.direction(method) == Some(Direction::Out) && !row.is_optional
            })
        });
        let sets: Vec<String> =
            written.map(|row| format!("    {} = $0;", row.name)).take(1).collect();
        let body = if sets.is_empty() { "    $0".to_owned() } else { sets.join("\n") };
        CompletionItem {
            detail: Some(format!("void {}()", method.name())),
            documentation: Some(format!("{}: {}", method.name(), method.doc())),
            insert: Some(format!("{before}{}() {{\n{body}\n}}", method.name())),
            ..item(method.name(), SemanticKind::Method, 0)
        }
    };
    methods.into_iter().map(method).collect()
}

/// The names of the methods of the class at a place, after `void`.
fn method_names(document: &Document, place: rtsl::Span) -> Vec<CompletionItem> {
    let class = document.declarations.around(place, &[DeclarationKind::Class]);
    // A class whose members follow its header lasts up to the next.
    let before = || {
        let classes = document.declarations.iter().filter(|(_, it)| {
            it.kind == DeclarationKind::Class
                && it.span.file == place.file
                && it.span.start < place.start
        });
        classes.max_by_key(|(_, it)| it.span.start)
    };
    let Some((class, _)) = class.or_else(before) else { return Vec::new() };
    methods(&roles_of(document, class), "")
}

fn bases(document: &Document, found: &Completion) -> Vec<CompletionItem> {
    let mut items = roles();
    let own = found.names.iter().filter(|name| name.kind == "a class");
    items.extend(own.map(|name| visible(document, name)));
    let library = rtsl::library::classes().map(|(class, file)| CompletionItem {
        detail: Some(file.path.to_owned()),
        ..item(class, SemanticKind::Class, 4)
    });
    items.extend(library);
    items
}

/// The names that may follow a dot.
fn parts(ty: &Type, shown: &str, fields: &[(String, String)]) -> Vec<CompletionItem> {
    match ty {
        Type::Reference(role) => {
            let mut methods: Vec<&builtins::ReferenceMethod> =
                REFERENCE_METHODS.iter().filter(|method| method.role == *role).collect();
            methods.dedup_by_key(|method| method.name);
            let method = |method: &builtins::ReferenceMethod| CompletionItem {
                detail: Some(format!("{} {}(...)", method.result, method.name)),
                documentation: Some(method.doc.to_owned()),
                insert: Some(format!("{}($0)", method.name)),
                ..item(method.name, SemanticKind::Method, 0)
            };
            methods.into_iter().map(method).collect()
        }
        Type::Struct(_) => {
            let field = |(name, ty): &(String, String)| CompletionItem {
                detail: Some(ty.clone()),
                ..item(name, SemanticKind::Property, 0)
            };
            let mut items: Vec<CompletionItem> = fields.iter().map(field).collect();
            if let Some(of) = SpecStruct::from_name(shown) {
                items.extend(builtins::methods_of(of).map(|method| CompletionItem {
                    documentation: Some(method.doc.to_owned()),
                    insert: Some(format!("{}($0)", method.name)),
                    ..item(method.name, SemanticKind::Method, 0)
                }));
            }
            items
        }
        Type::Vector(_, size) => {
            let count = usize::from(*size);
            let mut items = Vec::new();
            for (rank, set) in ["xyzw", "rgba"].into_iter().enumerate() {
                let component = |at: usize| item(&set[at..=at], SemanticKind::Property, rank as u8);
                items.extend((0..count).map(component));
                let leading = (2..=count).map(|end| item(&set[..end], SemanticKind::Property, 2));
                items.extend(leading);
            }
            items.push(length());
            items
        }
        Type::Array(..) | Type::Buffer(_) | Type::Matrix(..) => vec![length()],
        Type::Void | Type::Scalar(_) | Type::Color | Type::Error => Vec::new(),
    }
}

fn length() -> CompletionItem {
    CompletionItem {
        detail: Some("int length()".to_owned()),
        documentation: Some("The number of elements.".to_owned()),
        insert: Some("length()".to_owned()),
        ..item("length", SemanticKind::Method, 3)
    }
}

fn of_module(found: &Completion, module: &str) -> Vec<CompletionItem> {
    let part = |name: &VisibleName| {
        let own = name.name.strip_prefix(module)?.strip_prefix('.')?;
        if own == CURSOR {
            return None;
        }
        let kind = match name.kind {
            "a function" => SemanticKind::Function,
            "a struct" => SemanticKind::Struct,
            "a class" => SemanticKind::Class,
            _ => SemanticKind::Variable,
        };
        let insert = (kind == SemanticKind::Function).then(|| call(own, true));
        Some(CompletionItem { detail: name.ty.clone(), insert, ..item(own, kind, 0) })
    };
    found.names.iter().filter_map(part).collect()
}

fn annotation_keys() -> Vec<CompletionItem> {
    let key = |key: &AnnotationKey| {
        let name = key.name;
        let insert = match key.kind {
            AnnotationKind::Text => format!("{name} \"$0\""),
            AnnotationKind::Number => format!("{name} $0"),
            AnnotationKind::Flag => name.to_owned(),
        };
        let documentation = Some(key.doc.to_owned());
        CompletionItem {
            documentation,
            insert: Some(insert),
            ..item(name, SemanticKind::Property, 0)
        }
    };
    ANNOTATION_KEYS.iter().map(key).collect()
}

fn directives() -> Vec<CompletionItem> {
    DIRECTIVES.iter().map(|name| item(name, SemanticKind::Macro, 0)).collect()
}

fn types(rank: u8) -> impl Iterator<Item = CompletionItem> {
    let names = type_names().chain(["color".to_owned()]);
    names.map(move |name| item(&name, SemanticKind::Type, rank))
}
