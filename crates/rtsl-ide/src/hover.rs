//! The description of a word, in Markdown.

use rtsl::{Direction, Method, Role, Span, StateVariable, rows};
use rtsl_sema::index::Symbol;
use rtsl_source::with_article;
use rtsl_spec::builtins;

use crate::declaration::{Declaration, DeclarationKind};
use crate::document::{Document, Meaning, Word};

/// A description of a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hover {
    /// The word.
    pub span: Span,
    /// The description, in Markdown.
    pub text: String,
}

/// Describes the word at an offset.
pub fn hover(document: &Document, offset: u32) -> Option<Hover> {
    let word = document.word(offset)?;
    let text = match &word.meaning {
        Meaning::Declared(id) => of_declaration(document, document.declarations.get(*id), &word),
        Meaning::Language(symbol) => of_symbol(document, symbol, &word)?,
        Meaning::Macro(definition) => code(document.analysis.sources.text(*definition)),
    };
    Some(Hover { span: word.span, text })
}

fn of_declaration(document: &Document, declaration: &Declaration, word: &Word) -> String {
    let mut parts = vec![code(&declaration.text)];
    let parent = declaration.parent.map(|id| document.declarations.get(id));
    if let Some(parent) = parent
        && matches!(parent.kind, DeclarationKind::Class | DeclarationKind::Struct)
    {
        parts.push(format!("Of `{}`.", parent.name));
        let method = Method::from_name(&declaration.name);
        let is_method = declaration.kind == DeclarationKind::Function;
        if let Some(method) = method.filter(|_| is_method) {
            parts.push(method_text(method));
        }
    }
    let ty = word.ty.as_deref().filter(|ty| !declaration.text.contains(*ty));
    if let Some(ty) = ty.filter(|_| declaration.kind != DeclarationKind::Choice) {
        parts.push(format!("Here: `{ty}`."));
    }
    parts.extend(declaration.documentation.clone());
    parts.join("\n\n")
}

fn of_symbol(document: &Document, symbol: &Symbol, word: &Word) -> Option<String> {
    Some(match symbol {
        Symbol::Declared(_) => code(word.ty.as_deref()?),
        Symbol::State(variable) => {
            let class = document.declarations.around(word.span, &[DeclarationKind::Class]);
            let around = document.declarations.around(word.span, &[DeclarationKind::Function]);
            let method = around.and_then(|(_, function)| Method::from_name(&function.name));
            let roles = class.map(|(id, _)| roles_of(document, id)).unwrap_or_default();
            state_text(variable, &roles, method)
        }
        Symbol::Builtin(name, _) => builtin_text(name, word.ty.as_deref())?,
        Symbol::Method(method) => {
            let parameters = method.parameters.iter().map(|(name, ty)| format!("{ty} {name}"));
            let parameters: Vec<String> = parameters.collect();
            let role = method.role.class();
            let header =
                format!("{} {role}.{}({})", method.result, method.name, parameters.join(", "));
            format!("{}\n\n{}", code(&header), method.doc)
        }
        Symbol::Role(role) => role_text(*role),
        Symbol::Type(name) => format!("{}\n\nA type of the language.", code(name)),
        Symbol::RayType(ray_type) => format!("{}\n\n{}", code(ray_type.name()), ray_type.doc()),
    })
}

/// The roles of a class, with those that it inherits from classes of the document.
pub(crate) fn roles_of(document: &Document, class: crate::DeclarationId) -> Vec<Role> {
    let name = &document.declarations.get(class).name;
    let classes = document.analysis.module.classes.iter().rev();
    classes.filter(|it| it.name == *name).flat_map(|it| it.roles.clone()).collect()
}

/// Describes a state variable as a method sees it.
pub(crate) fn state_text(
    variable: &StateVariable,
    roles: &[Role],
    method: Option<Method>,
) -> String {
    let all: Vec<_> = rows().iter().filter(|row| row.name == variable.name).collect();
    let in_roles: Vec<_> =
        all.iter().filter(|row| row.role.is_none_or(|role| roles.contains(&role))).collect();
    let chosen = if in_roles.is_empty() { all.iter().collect() } else { in_roles };
    let mut parts = vec![code(&format!("{} {}", variable.ty.name(), variable.name))];
    for row in chosen {
        let mut line = sentence(row.doc);
        let direction = method.and_then(|method| row.direction(method));
        if let (Some(method), Some(direction)) = (method, direction) {
            let passes = match direction {
                Direction::In => "reads it",
                Direction::Out => "sets it",
                Direction::InOut => "reads and sets it",
            };
            line.push_str(&format!(" `{}` {passes}.", method.name()));
        }
        if let Some(role) = row.role.filter(|_| roles.len() != 1) {
            line = format!("*{}*: {line}", role.name());
        }
        parts.push(line);
    }
    parts.join("\n\n")
}

/// Ends a text with a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    let mut sentence: String = first.into_iter().chain(letters).collect();
    if !sentence.ends_with('.') {
        sentence.push('.');
    }
    sentence
}

/// Describes a built-in function by all its forms.
pub(crate) fn builtin_text(name: &str, chosen: Option<&str>) -> Option<String> {
    let builtin = builtins::find(name).or_else(|| {
        let overload = builtins::SpecStruct::ALL
            .into_iter()
            .find_map(|receiver| builtins::method_overloads(receiver, name).first());
        overload.map(|overload| overload.builtin)
    })?;
    let mut lines: Vec<&str> = builtin.signatures.to_vec();
    if lines.len() > 8 {
        lines.truncate(8);
    }
    let mut text = code(&lines.join("\n"));
    if let Some(chosen) = chosen.filter(|chosen| !lines.contains(chosen)) {
        text.push_str(&format!("\n\nHere: `{chosen}`."));
    }
    Some(format!("{text}\n\n{}", builtin.doc))
}

pub(crate) fn role_text(role: Role) -> String {
    let methods: Vec<String> =
        role.methods().map(|method| format!("- `{}` {}", method.name(), method.doc())).collect();
    format!(
        "{}\n\nThe role of {}. Its methods:\n\n{}",
        code(role.class()),
        with_article(role.name()),
        methods.join("\n")
    )
}

fn method_text(method: Method) -> String {
    format!("A method that renderers call: it {}.", method.doc())
}

/// A block of code in Markdown.
pub(crate) fn code(text: &str) -> String {
    format!("```rtsl\n{text}\n```")
}
