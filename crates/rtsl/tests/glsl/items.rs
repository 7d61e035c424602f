//! The declarations of a shader at file scope.

use std::ops::Range;

use crate::tokens::{Kind, Token};

/// The source of a variable's value, and its reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// Another stage, or the host.
    In,
    /// The next stage reads it.
    Out,
    /// Nobody else.
    Global,
}

/// A variable that is no constant.
#[derive(Clone, Debug)]
pub struct Variable {
    pub name: String,
    /// The type without qualifiers.
    pub ty: String,
    /// The sizes after the name.
    pub sizes: String,
    pub initial: Option<String>,
    pub storage: Storage,
    pub is_uniform: bool,
}

/// The kind of an item.
#[derive(Clone, Debug)]
pub enum ItemKind {
    Directive,
    Variables(Vec<Variable>),
    Function {
        name: String,
        /// The tokens in its braces; `None` for a prototype.
        body: Option<Range<usize>>,
        has_parameters: bool,
    },
    /// A struct with the variables of its type.
    StructVariables,
    /// A constant, a struct, a statement such as `precision`, or what is not understood.
    Other,
}

/// An item: a range of tokens that begins with a significant one.
#[derive(Clone, Debug)]
pub struct Item {
    pub range: Range<usize>,
    pub kind: ItemKind,
    /// True between `#if` and `#endif`.
    pub is_conditional: bool,
}

const QUALIFIERS: &[&str] = &[
    "uniform",
    "varying",
    "attribute",
    "in",
    "out",
    "flat",
    "smooth",
    "noperspective",
    "centroid",
    "sample",
    "invariant",
    "precise",
    "highp",
    "mediump",
    "lowp",
    "const",
];

/// Splits the tokens of a shader.
pub fn items(tokens: &[Token<'_>], is_vertex: bool) -> Vec<Item> {
    let mut items = Vec::new();
    let mut depth = 0;
    let mut at = 0;
    while at < tokens.len() {
        let token = &tokens[at];
        if token.kind == Kind::Space {
            at += 1;
            continue;
        }
        if token.kind == Kind::Directive {
            let word = token.text[1..].trim_start();
            depth += i32::from(word.starts_with("if"));
            depth -= i32::from(word.starts_with("endif"));
            items.push(Item {
                range: at..at + 1,
                kind: ItemKind::Directive,
                is_conditional: depth > 0,
            });
            at += 1;
            continue;
        }
        let end = item_end(tokens, at);
        let kind = kind_of(tokens, at..end, is_vertex);
        items.push(Item { range: at..end, kind, is_conditional: depth > 0 });
        at = end;
    }
    items
}

/// The end of the item: after a semicolon outside of brackets, or after the body of a function.
fn item_end(tokens: &[Token<'_>], start: usize) -> usize {
    let mut depth = 0i32;
    let mut previous = "";
    let mut is_body = false;
    for (at, token) in tokens.iter().enumerate().skip(start) {
        match token.text {
            _ if matches!(token.kind, Kind::Space | Kind::Directive) => continue,
            "{" | "(" | "[" => {
                is_body |= depth == 0 && token.text == "{" && previous == ")";
                depth += 1;
            }
            "}" | ")" | "]" => {
                depth -= 1;
                if token.text == "}" && depth <= 0 && is_body {
                    return at + 1;
                }
            }
            ";" if depth <= 0 => return at + 1,
            _ => {}
        }
        previous = token.text;
    }
    tokens.len()
}

fn kind_of(tokens: &[Token<'_>], range: Range<usize>, is_vertex: bool) -> ItemKind {
    let significant: Vec<usize> = range
        .clone()
        .filter(|at| !matches!(tokens[*at].kind, Kind::Space | Kind::Directive))
        .collect();
    let text = |index: usize| significant.get(index).map_or("", |at| tokens[*at].text);
    // The mark that tells a function, outside of the sizes of arrays.
    let mut depth = 0;
    let parenthesis = (0..significant.len()).find(|index| {
        depth += i32::from(text(*index) == "[") - i32::from(text(*index) == "]");
        depth == 0 && matches!(text(*index), "(" | "=" | ";" | "{")
    });
    if let Some(index) = parenthesis.filter(|index| *index >= 2 && text(*index) == "(")
        && tokens[significant[index - 1]].kind == Kind::Word
        && text(index - 1) != "layout"
    {
        let open = significant.iter().copied().find(|at| tokens[*at].text == "{");
        let close = significant.last().copied().filter(|at| tokens[*at].text == "}");
        return ItemKind::Function {
            name: text(index - 1).to_owned(),
            body: open.zip(close).map(|(open, close)| open + 1..close),
            has_parameters: !matches!((text(index + 1), text(index + 2)), (")", _) | ("void", ")")),
        };
    }
    let significant: Vec<Token<'_>> = significant.iter().map(|at| tokens[*at]).collect();
    let count = significant.len();
    let has_name = count > 2 && !significant[count - 2].is("}");
    let is_constant = significant.iter().any(|it| it.is("const"));
    if significant.iter().any(|it| it.is("struct")) && has_name && !is_constant {
        return ItemKind::StructVariables;
    }
    variables(&significant, is_vertex).map_or(ItemKind::Other, ItemKind::Variables)
}

/// Reads a declaration of variables; `None` for all else, and for forms that RTSL has no translation of.
fn variables(tokens: &[Token<'_>], is_vertex: bool) -> Option<Vec<Variable>> {
    let mut storage = Storage::Global;
    let mut is_uniform = false;
    let mut at = 0;
    loop {
        let token = tokens.get(at)?;
        if token.is("layout") {
            at = layout_of_location(tokens, at)?;
            continue;
        }
        if !QUALIFIERS.contains(&token.text) {
            break;
        }
        match token.text {
            "const" => return None,
            "uniform" => (storage, is_uniform) = (Storage::In, true),
            "in" | "attribute" => storage = Storage::In,
            "varying" if is_vertex => storage = Storage::Out,
            "varying" => storage = Storage::In,
            "out" => storage = Storage::Out,
            _ => {}
        }
        at += 1;
    }
    if tokens[at].kind != Kind::Word || ["struct", "precision", "buffer"].contains(&tokens[at].text)
    {
        return None;
    }
    let mut ty = tokens[at].text.to_owned();
    at += 1;
    at = brackets(tokens, at, &mut ty);
    let like = Variable {
        name: String::new(),
        ty,
        sizes: String::new(),
        initial: None,
        storage,
        is_uniform,
    };
    declarators(&tokens[at..], &like)
}

/// The place after `layout(location = 1)`, which says nothing about values.
fn layout_of_location(tokens: &[Token<'_>], at: usize) -> Option<usize> {
    let parts: Vec<&str> = tokens.get(at..at + 6)?.iter().map(|it| it.text).collect();
    (parts[1] == "(" && parts[2] == "location" && parts[3] == "=" && parts[5] == ")")
        .then_some(at + 6)
}

/// Appends bracketed sizes to a text, and returns the place after them.
fn brackets(tokens: &[Token<'_>], mut at: usize, text: &mut String) -> usize {
    while tokens.get(at).is_some_and(|it| it.is("[")) {
        let mut depth = 0;
        while let Some(token) = tokens.get(at) {
            depth += i32::from(token.is("[")) - i32::from(token.is("]"));
            *text += token.text;
            *text += " ";
            at += 1;
            if depth == 0 {
                break;
            }
        }
    }
    at
}

/// Reads the names after a type. `like` has what all variables share.
fn declarators(tokens: &[Token<'_>], like: &Variable) -> Option<Vec<Variable>> {
    let mut variables = Vec::new();
    let mut at = 0;
    loop {
        let name = tokens.get(at).filter(|it| it.kind == Kind::Word)?.text;
        let mut sizes = String::new();
        at = brackets(tokens, at + 1, &mut sizes);
        let initial = tokens.get(at).is_some_and(|it| it.is("=")).then(|| {
            let start = at + 1;
            at = expression_end(tokens, start);
            tokens[start..at].iter().map(|it| it.text).collect::<Vec<_>>().join(" ")
        });
        variables.push(Variable { name: name.to_owned(), sizes, initial, ..like.clone() });
        match tokens.get(at)?.text {
            "," => at += 1,
            ";" => return Some(variables),
            _ => return None,
        }
    }
}

/// The place of the comma or semicolon after an expression.
fn expression_end(tokens: &[Token<'_>], start: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(start) {
        match token.text {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            "," | ";" if depth == 0 => return at,
            _ => {}
        }
    }
    tokens.len()
}
