//! Text of commands, in the format of pbrt-v4.

use std::fmt::Write as _;

use rtsl::{SourceMap, Span};

use super::directive::Keyword;
use super::lexer::{Lexer, TokenKind};
use super::parameter::{
    COLOR, Component, Parameter, ParameterType, ReferenceKind, Values, parameter_type,
};
use super::parser::Command;

/// Writes commands as a text. What an upgrade did not change keeps the spelling that it has in its file.
pub struct Writer {
    text: String,
    depth: usize,
}

/// The columns that lists of numbers fill.
const COLUMNS: usize = 100;

/// The columns of a level of indentation.
const INDENTATION: usize = 4;

/// Types that pbrt-v4 calls by other names.
const TYPES: [(&str, &str); 6] = [
    ("color", "rgb"),
    ("xyz", "rgb"),
    ("point", "point3"),
    ("vector", "vector3"),
    ("normal3", "normal"),
    ("int", "integer"),
];

impl Writer {
    pub fn new() -> Self {
        Writer { text: String::new(), depth: 0 }
    }

    /// The length of the text so far.
    pub fn len(&self) -> usize {
        self.text.len()
    }

    pub fn finish(self) -> String {
        self.text
    }

    /// Writes a line that names a file.
    pub fn include(&mut self, keyword: Keyword, path: &str) {
        self.indent(0);
        self.text.push_str(keyword.word());
        self.text.push(' ');
        self.quoted(path);
        self.text.push('\n');
    }

    pub fn command(&mut self, command: &Command, map: &SourceMap) {
        match command.keyword {
            Keyword::AttributeEnd | Keyword::ObjectEnd => self.depth = self.depth.saturating_sub(1),
            Keyword::WorldBegin => self.text.push('\n'),
            _ => {}
        }
        self.indent(0);
        self.text.push_str(command.keyword.word());
        self.numbers(command, map);
        for text in &command.texts {
            self.text.push(' ');
            match command.keyword {
                Keyword::ActiveTransform => self.text.push_str(&text.text),
                _ => self.quoted(&text.text),
            }
        }
        for parameter in &command.parameters {
            match command.keyword {
                Keyword::Option => self.text.push(' '),
                _ => self.indent_after_break(),
            }
            self.parameter(parameter, map);
        }
        self.text.push('\n');
        match command.keyword {
            Keyword::AttributeBegin | Keyword::ObjectBegin => self.depth += 1,
            Keyword::WorldBegin => self.text.push('\n'),
            _ => {}
        }
    }

    fn indent(&mut self, further: usize) {
        let columns = INDENTATION * (self.depth + further);
        self.text.extend(std::iter::repeat_n(' ', columns));
    }

    fn indent_after_break(&mut self) {
        self.text.push('\n');
        self.indent(1);
    }

    /// The numbers of a directive, which are in brackets for matrices alone.
    fn numbers(&mut self, command: &Command, map: &SourceMap) {
        if command.numbers.is_empty() {
            return;
        }
        let source = map.text(command.numbers_span);
        let inner = source.trim_start_matches('[').trim_end_matches(']');
        let is_matrix = matches!(command.keyword, Keyword::Transform | Keyword::ConcatTransform);
        self.text.push_str(if is_matrix { " [ " } else { " " });
        if !source.contains(['#', ','])
            && spelled_numbers(command.numbers_span, map) == command.numbers
        {
            let words: Vec<&str> = inner.split_ascii_whitespace().collect();
            self.text.push_str(&words.join(" "));
        } else {
            let words: Vec<String> = command.numbers.iter().map(f64::to_string).collect();
            self.text.push_str(&words.join(" "));
        }
        if is_matrix {
            self.text.push_str(" ]");
        }
    }

    fn parameter(&mut self, parameter: &Parameter, map: &SourceMap) {
        let source = map.text(parameter.declaration).trim_matches('"');
        let word = source.split_ascii_whitespace().next().unwrap_or_default();
        if parameter.kind == ParameterType::Given {
            // An option without a type.
            self.quoted(&parameter.name);
        } else {
            let declaration = format!("{} {}", type_word(parameter, word), parameter.name);
            self.quoted(&declaration);
        }
        self.text.push(' ');
        if keeps_spelling(parameter, map) {
            self.text.push_str(map.text(parameter.values_span));
        } else {
            self.values(parameter);
        }
    }

    fn values(&mut self, parameter: &Parameter) {
        self.text.push('[');
        match &parameter.values {
            Values::Numbers(numbers) => match numbers[..] {
                [grey] if parameter.is_color() => {
                    let _ = write!(self.text, " {grey} {grey} {grey}");
                }
                _ => self.list(numbers),
            },
            Values::Booleans(values) => {
                values
                    .iter()
                    .for_each(|value| self.text.push_str(if *value { " true" } else { " false" }));
            }
            Values::Texts(texts) => {
                let is_boolean = matches!(
                    parameter.kind,
                    ParameterType::Numeric { component: Component::Bool, .. }
                );
                for text in texts {
                    self.text.push(' ');
                    if is_boolean { self.text.push_str(text) } else { self.quoted(text) }
                }
            }
            // Only the parameters of texts are written.
            Values::Buffer(_) => {}
        }
        self.text.push_str(" ]");
    }

    fn list(&mut self, numbers: &[f64]) {
        let mut line = self.text.len();
        for number in numbers {
            if self.text.len() - line > COLUMNS {
                self.text.push('\n');
                self.indent(2);
                line = self.text.len();
            } else {
                self.text.push(' ');
            }
            let _ = write!(self.text, "{number}");
        }
    }

    fn quoted(&mut self, text: &str) {
        push_quoted(&mut self.text, text);
    }
}

/// Appends a quoted text, with escapes that pbrt-v4 reads.
pub fn push_quoted(target: &mut String, text: &str) {
    target.push('"');
    for character in text.chars() {
        match character {
            '"' | '\\' => target.extend(['\\', character]),
            '\n' => target.push_str("\\n"),
            '\t' => target.push_str("\\t"),
            '\r' => target.push_str("\\r"),
            other => target.push(other),
        }
    }
    target.push('"');
}

/// The name of a parameter's type in pbrt-v4. `word` is that in the file.
fn type_word<'w>(parameter: &Parameter, word: &'w str) -> &'w str {
    if parameter.kind == ParameterType::Spectrum && matches!(parameter.values, Values::Numbers(_)) {
        return if matches!(parameter.values.len(), 1 | 3) { "rgb" } else { "spectrum" };
    }
    if parameter_type(word) == Some(parameter.kind) {
        return TYPES.iter().find(|(old, _)| *old == word).map_or(word, |(_, new)| new);
    }
    match parameter.kind {
        COLOR => "rgb",
        ParameterType::Numeric { component: Component::Float, count: 1, .. } => "float",
        ParameterType::Numeric { component: Component::Float, count: 2, .. } => "point2",
        ParameterType::Numeric { component: Component::Float, .. } if parameter.name == "N" => {
            "normal"
        }
        ParameterType::Numeric { component: Component::Float, .. } => "point3",
        ParameterType::Numeric { component: Component::Bool, .. } => "bool",
        ParameterType::Numeric { component: Component::Int | Component::Uint, .. } => "integer",
        ParameterType::Spectrum => "spectrum",
        ParameterType::Blackbody => "blackbody",
        ParameterType::Text | ParameterType::Given => "string",
        ParameterType::Reference(ReferenceKind::Texture) => "texture",
        ParameterType::Reference(kind) => kind.word(),
    }
}

/// True if the values of a parameter are those at its place in the file, as pbrt-v4 spells them.
fn keeps_spelling(parameter: &Parameter, map: &SourceMap) -> bool {
    let source = map.text(parameter.values_span);
    if source.contains(',') && matches!(parameter.values, Values::Numbers(_)) {
        return false;
    }
    match (&parameter.values, parameter.kind) {
        (Values::Numbers(numbers), ParameterType::Numeric { component, .. }) => {
            let is_spelled = match component {
                Component::Int | Component::Uint => !source.contains(['.', 'e', 'E']),
                Component::Float | Component::Bool => true,
            };
            let is_whole = !parameter.is_color() || numbers.len() != 1;
            is_spelled && is_whole && spelled_numbers(parameter.values_span, map) == *numbers
        }
        (Values::Numbers(numbers), _) => {
            let is_whole = !parameter.is_color() || numbers.len() != 1;
            is_whole && spelled_numbers(parameter.values_span, map) == *numbers
        }
        (Values::Texts(_), ParameterType::Numeric { .. }) | (Values::Buffer(_), _) => false,
        (Values::Texts(texts), _) => spelled_texts(parameter.values_span, map) == *texts,
        (Values::Booleans(_), _) => !source.contains('"') && !source.is_empty(),
    }
}

/// The numbers at a place of a file; none if there is something else.
fn spelled_numbers(span: Span, map: &SourceMap) -> Vec<f64> {
    let tokens = tokens(span, map);
    let numbers = tokens.map(|kind| if let TokenKind::Number(it) = kind { Some(it) } else { None });
    numbers.collect::<Option<Vec<f64>>>().unwrap_or_default()
}

fn spelled_texts(span: Span, map: &SourceMap) -> Vec<String> {
    let tokens = tokens(span, map);
    let texts = tokens.map(|kind| if let TokenKind::Text(it) = kind { Some(it) } else { None });
    texts.collect::<Option<Vec<String>>>().unwrap_or_default()
}

/// The tokens at a place of a file, without brackets.
fn tokens(span: Span, map: &SourceMap) -> impl Iterator<Item = TokenKind> {
    let mut lexer = Lexer::new(span.file, map.text(span));
    std::iter::from_fn(move || Some(lexer.next_token().kind).filter(|it| *it != TokenKind::End))
        .filter(|kind| !matches!(kind, TokenKind::Open | TokenKind::Close))
}
