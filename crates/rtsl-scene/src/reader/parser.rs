//! Commands of the scene format: a directive's word with its operands and parameters.
//!
//! The parser takes the syntax of each directive from the table in [`super::directive`] and does not depend on its
//! meaning. After an error it resumes at the next directive's word, so that one run reports several independent errors.
//! Each command consumes at least one token.

use rtsl::{Diagnostic, Diagnostics, FileId, Span, diagnostic_codes as codes, most_similar};
use rtsl_memory::{Held, InputBudget};

use super::directive::{Keyword, Operands, directive, directive_words};
use super::lexer::{Lexer, Token, TokenKind};
use super::parameter::{Parameter, ParameterType, Values, parameter_type, parameter_type_words};
use super::spectra::is_color;

/// A directive with its operands and parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// The directive.
    pub keyword: Keyword,
    /// The place of its word.
    pub span: Span,
    /// The numbers, as many as the directive requires.
    pub numbers: Vec<f64>,
    /// The place of the numbers.
    pub numbers_span: Span,
    /// Its quoted strings.
    pub texts: Vec<SpannedText>,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// True if an error in it was reported, so that only its beginning was read.
    pub is_broken: bool,
}

/// A quoted string and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct SpannedText {
    /// The string without its quotes.
    pub text: String,
    /// The place, quotes included.
    pub span: Span,
}

impl Command {
    /// A directive without operands.
    pub fn new(keyword: Keyword, span: Span) -> Self {
        Command {
            keyword,
            span,
            numbers: Vec::new(),
            numbers_span: span,
            texts: Vec::new(),
            parameters: Vec::new(),
            is_broken: false,
        }
    }
}

/// Reads the commands of one file.
pub struct Parser<'a> {
    lexer: Lexer<'a>,
    token: Token,
    budget: &'a InputBudget,
}

/// The number of a parameter's values below which the budget is not queried.
const UNCOUNTED_VALUES: usize = 4096;

impl<'a> Parser<'a> {
    /// Creates a parser at the beginning of `text`, which is the text of `file`. Lists of values take no more memory
    /// than is left in the budget.
    pub fn within(budget: &'a InputBudget, file: FileId, text: &'a str) -> Self {
        let mut lexer = Lexer::new(file, text);
        let token = lexer.next_token();
        Parser { lexer, token, budget }
    }

    /// Returns the next command; `None` at the end. After an error the command is broken, and the next one begins at
    /// the next directive's word.
    pub fn next_command(&mut self, diagnostics: &mut Diagnostics) -> Option<Command> {
        while self.token.kind != TokenKind::End {
            let word = self.advance();
            let problem = match self.expect_directive(&word) {
                Ok((keyword, operands)) => {
                    let mut command = Command::new(keyword, word.span);
                    let parsed = self.parse_operands(&mut command, operands);
                    return self.accept_command(command, parsed, diagnostics);
                }
                Err(problem) => problem,
            };
            diagnostics.push(*problem);
            self.skip_to_directive();
        }
        None
    }

    /// Adds the parameters that follow to a command of an included file, which ended before them.
    pub fn continue_command(
        &mut self,
        mut command: Command,
        diagnostics: &mut Diagnostics,
    ) -> Option<Command> {
        let parsed = self.parse_parameters(&mut command);
        self.accept_command(command, parsed, diagnostics)
    }

    /// True if there are no more commands.
    pub fn is_at_end(&self) -> bool {
        self.token.kind == TokenKind::End
    }

    /// True if a parameter follows.
    pub fn is_at_parameter(&self) -> bool {
        matches!(self.token.kind, TokenKind::Text(_))
    }

    /// Reports an error of a command, which is then broken; `None` if the memory is exhausted.
    fn accept_command(
        &mut self,
        mut command: Command,
        parsed: Parsed<()>,
        diagnostics: &mut Diagnostics,
    ) -> Option<Command> {
        if let Err(problem) = parsed {
            diagnostics.push(*problem);
            if self.budget.is_exceeded() {
                return None;
            }
            self.skip_to_directive();
            command.is_broken = true;
        }
        Some(command)
    }

    fn parse_operands(&mut self, command: &mut Command, operands: Operands) -> Parsed<()> {
        if command.keyword == Keyword::ActiveTransform {
            self.expect_word_operand(command)?;
        }
        self.parse_numbers(command, operands)?;
        self.parse_texts(command, operands)?;
        if operands.parameters {
            self.parse_parameters(command)?;
        }
        Ok(())
    }

    fn expect_directive(&self, word: &Token) -> Parsed<(Keyword, Operands)> {
        if word.kind != TokenKind::Word {
            return Err(unexpected(word, "a directive"));
        }
        let spelling = self.text_of(word.span);
        directive(spelling).ok_or_else(|| {
            let diagnostic = Diagnostic::new(
                codes::UNKNOWN_DIRECTIVE,
                format!("unknown directive `{}`", shorten(spelling)),
            )
            .at(word.span, "not a directive of the scene format");
            Box::new(match most_similar(spelling, directive_words()) {
                Some(near) => diagnostic.suggest("did you mean this?", word.span, near),
                None => diagnostic,
            })
        })
    }

    /// `ActiveTransform` is followed by an unquoted word.
    fn expect_word_operand(&mut self, command: &mut Command) -> Parsed<()> {
        let token = self.advance();
        if token.kind != TokenKind::Word {
            return Err(unexpected(&token, "`StartTime`, `EndTime` or `All`"));
        }
        let text = self.text_of(token.span).to_owned();
        command.texts.push(SpannedText { text, span: token.span });
        Ok(())
    }

    fn parse_numbers(&mut self, command: &mut Command, operands: Operands) -> Parsed<()> {
        if operands.numbers == 0 {
            return Ok(());
        }
        command.numbers_span = self.token.span;
        let bracketed = self.accept(&TokenKind::Open);
        while command.numbers.len() < operands.numbers {
            let TokenKind::Number(value) = self.token.kind else {
                let expected = format!(
                    "{} numbers after `{}`, of which this is number {}",
                    operands.numbers,
                    command.keyword.word(),
                    command.numbers.len() + 1
                );
                return Err(unexpected(&self.token, &expected).label_boxed(command.span));
            };
            command.numbers_span = command.numbers_span.to(self.token.span);
            self.advance();
            command.numbers.push(value);
        }
        if bracketed {
            command.numbers_span = command.numbers_span.to(self.token.span);
            if !self.accept(&TokenKind::Close) {
                return Err(unexpected(&self.token, "`]`"));
            }
        }
        Ok(())
    }

    fn parse_texts(&mut self, command: &mut Command, operands: Operands) -> Parsed<()> {
        for index in 0..operands.texts + operands.optional_texts {
            match &self.token.kind {
                TokenKind::Text(text) => {
                    let text = SpannedText { text: text.clone(), span: self.token.span };
                    command.texts.push(text);
                    self.advance();
                }
                _ if index >= operands.texts => break,
                _ => {
                    let expected = format!("a quoted name after `{}`", command.keyword.word());
                    return Err(unexpected(&self.token, &expected).label_boxed(command.span));
                }
            }
        }
        Ok(())
    }

    fn parse_parameters(&mut self, command: &mut Command) -> Parsed<()> {
        while let TokenKind::Text(declaration) = &self.token.kind {
            let declaration = SpannedText { text: declaration.clone(), span: self.token.span };
            self.advance();
            let (kind, name) = match command.keyword {
                Keyword::Option => parse_option(&declaration)?,
                _ => parse_declaration(&declaration)?,
            };
            let (mut values, values_span) = self.parse_values(&declaration)?;
            check_values(&kind, &values, &declaration, values_span)?;
            if declaration.text.split_ascii_whitespace().next() == Some("xyz") {
                from_tristimulus(&mut values);
            }
            command.parameters.push(Parameter {
                kind,
                name,
                declaration: declaration.span,
                values,
                values_span,
            });
        }
        Ok(())
    }

    /// One value, or any number of values of one type in brackets.
    fn parse_values(&mut self, declaration: &SpannedText) -> Parsed<(Values, Span)> {
        let start = self.token.span;
        if !self.accept(&TokenKind::Open) {
            let mut values = self.first_value(&self.token, declaration)?;
            self.shrink(&mut values);
            self.advance();
            return Ok((values, start));
        }
        let mut values: Option<Values> = None;
        let mut held: Option<Held> = None;
        loop {
            let end = self.token.span;
            if self.accept(&TokenKind::Close) {
                let mut values = values.unwrap_or(Values::Numbers(Vec::new()));
                self.shrink(&mut values);
                return Ok((values, start.to(end)));
            }
            match &mut values {
                None => values = Some(self.first_value(&self.token, declaration)?),
                Some(values) => {
                    self.push_value(values, &self.token, declaration)?;
                    if values.len() > UNCOUNTED_VALUES && values.len().is_power_of_two() {
                        held = Some(self.hold(values, held, declaration)?);
                    }
                }
            }
            self.advance();
        }
    }

    /// Holds memory for a list that is about to double: its current size, and twice that for the copy.
    fn hold(&self, values: &Values, held: Option<Held>, declaration: &SpannedText) -> Parsed<Held> {
        drop(held);
        self.budget.hold(values.memory().times(3)).map_err(|error| {
            let what = shorten(&declaration.text);
            Box::new(error.diagnostic(what).at(declaration.span, "it has too many values"))
        })
    }

    fn first_value(&self, token: &Token, declaration: &SpannedText) -> Parsed<Values> {
        match &token.kind {
            TokenKind::Number(value) => Ok(Values::Numbers(vec![*value])),
            TokenKind::Text(text) => Ok(Values::Texts(vec![text.clone()])),
            TokenKind::Word if self.boolean(token).is_some() => {
                Ok(Values::Booleans(self.boolean(token).into_iter().collect()))
            }
            _ => Err(unexpected(token, "a value").label_boxed(declaration.span)),
        }
    }

    fn push_value(
        &self,
        values: &mut Values,
        token: &Token,
        declaration: &SpannedText,
    ) -> Parsed<()> {
        match (values, &token.kind) {
            (Values::Numbers(values), TokenKind::Number(value)) => values.push(*value),
            (Values::Texts(values), TokenKind::Text(text)) => values.push(text.clone()),
            (Values::Booleans(values), TokenKind::Word) if self.boolean(token).is_some() => {
                values.extend(self.boolean(token));
            }
            (values, _) => {
                let expected = format!("more {} or `]`", values.description());
                return Err(unexpected(token, &expected).label_boxed(declaration.span));
            }
        }
        Ok(())
    }

    fn shrink(&self, values: &mut Values) {
        match values {
            Values::Numbers(values) => values.shrink_to_fit(),
            Values::Booleans(values) => values.shrink_to_fit(),
            Values::Texts(values) => values.shrink_to_fit(),
            Values::Buffer(_) => {}
        }
    }

    fn boolean(&self, token: &Token) -> Option<bool> {
        match self.text_of(token.span) {
            "true" => Some(true),
            "false" => Some(false),
            _ => None,
        }
    }

    fn skip_to_directive(&mut self) {
        while self.token.kind != TokenKind::End {
            let is_word = self.token.kind == TokenKind::Word;
            if is_word && directive(self.text_of(self.token.span)).is_some() {
                return;
            }
            self.advance();
        }
    }

    fn text_of(&self, span: Span) -> &'a str {
        self.lexer.text().get(span.start as usize..span.end as usize).unwrap_or("")
    }

    fn advance(&mut self) -> Token {
        let next = self.lexer.next_token();
        std::mem::replace(&mut self.token, next)
    }

    fn accept(&mut self, kind: &TokenKind) -> bool {
        let found = self.token.kind == *kind;
        if found {
            self.advance();
        }
        found
    }
}

/// Errors are boxed: they are large and rare.
type Parsed<T> = Result<T, Box<Diagnostic>>;

trait LabelBoxed {
    fn label_boxed(self, directive: Span) -> Self;
}

impl LabelBoxed for Box<Diagnostic> {
    /// Adds a label at the start of the construct that contains the error, unless the error is there.
    fn label_boxed(self, start: Span) -> Self {
        Box::new((*self).label(start, "for this"))
    }
}

fn unexpected(token: &Token, expected: &str) -> Box<Diagnostic> {
    let (code, found) = match &token.kind {
        TokenKind::Word => (codes::SCENE_SYNTAX, "a word"),
        TokenKind::Number(_) => (codes::SCENE_SYNTAX, "a number"),
        TokenKind::Text(_) => (codes::SCENE_SYNTAX, "a quoted string"),
        TokenKind::Open => (codes::SCENE_SYNTAX, "`[`"),
        TokenKind::Close => (codes::SCENE_SYNTAX, "`]`"),
        TokenKind::BadNumber => {
            (codes::BAD_NUMBER, "a number that is not finite or not well-formed")
        }
        TokenKind::UnclosedText => (codes::SCENE_SYNTAX, "a string without its closing quote"),
        TokenKind::End => (codes::SCENE_SYNTAX, "the end of the file"),
    };
    let message = format!("found {found}, expected {expected}");
    Box::new(Diagnostic::new(code, message).at(token.span, ""))
}

/// The declaration of an option, whose type may be left out.
fn parse_option(declaration: &SpannedText) -> Parsed<(ParameterType, String)> {
    let mut words = declaration.text.split_ascii_whitespace();
    match (words.next(), words.next()) {
        (Some(name), None) => Ok((ParameterType::Given, name.to_owned())),
        _ => parse_declaration(declaration),
    }
}

fn parse_declaration(declaration: &SpannedText) -> Parsed<(ParameterType, String)> {
    let mut words = declaration.text.split_ascii_whitespace();
    let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
        let shown = shorten(&declaration.text);
        return Err(Box::new(
            Diagnostic::new(
                codes::BAD_DECLARATION,
                format!("`{shown}` does not declare a parameter, expected a type and a name"),
            )
            .at(declaration.span, "expected for example \"float radius\""),
        ));
    };
    let found = parameter_type(kind).ok_or_else(|| {
        let diagnostic = Diagnostic::new(
            codes::BAD_DECLARATION,
            format!("unknown parameter type `{}`", shorten(kind)),
        )
        .at(declaration.span, "not a type that a parameter can have");
        Box::new(match most_similar(kind, parameter_type_words()) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None if kind == "blackbody" => {
                diagnostic.help("give the colour as `rgb`: spectra are not supported")
            }
            None => diagnostic,
        })
    })?;
    Ok((found, name.to_owned()))
}

/// Checks that the values have the type and the count that the declaration requires.
fn check_values(
    kind: &ParameterType,
    values: &Values,
    declaration: &SpannedText,
    span: Span,
) -> Parsed<()> {
    use super::parameter::Component;
    let wrong = |message: String| {
        let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message).at(span, "");
        Err(Box::new(diagnostic.label(declaration.span, "declared here")))
    };
    let name = shorten(&declaration.text);
    match (kind, values) {
        (
            ParameterType::Numeric { component: Component::Bool, count, .. },
            Values::Booleans(list),
        ) => {
            check_groups(*count, list.len()).or_else(|problem| wrong(format!("`{name}` {problem}")))
        }
        // Files of older versions quote booleans.
        (
            ParameterType::Numeric { component: Component::Bool, count: 1, .. },
            Values::Texts(list),
        ) if list.iter().all(|text| text == "true" || text == "false") => Ok(()),
        (ParameterType::Numeric { component: Component::Bool, .. }, other) => {
            wrong(format!("`{name}` takes `true` or `false`, found {}", other.description()))
        }
        (ParameterType::Numeric { component, count, color }, Values::Numbers(list)) => {
            // The format allows one grey value for a constant RGB "spectrum".
            let grey = *color && list.len() == 1;
            let groups = if grey { Ok(()) } else { check_groups(*count, list.len()) };
            groups
                .and_then(|()| list.iter().try_for_each(|value| check_range(*component, *value)))
                .or_else(|problem| wrong(format!("`{name}` {problem}")))
        }
        (ParameterType::Numeric { .. }, other) => {
            wrong(format!("`{name}` takes numbers, found {}", other.description()))
        }
        (
            ParameterType::Text | ParameterType::Spectrum | ParameterType::Reference(_),
            Values::Texts(_),
        ) => Ok(()),
        (ParameterType::Given, _) => Ok(()),
        (ParameterType::Spectrum, Values::Numbers(list)) => {
            let groups = if is_color(list) { Ok(()) } else { check_groups(2, list.len()) };
            groups
                .and_then(|()| check_floats(list))
                .or_else(|problem| wrong(format!("`{name}` {problem}")))
        }
        // Earlier versions of the format give a factor after the temperature.
        (ParameterType::Blackbody, Values::Numbers(list))
            if matches!(list.len(), 1 | 2) && list[0] > 0.0 =>
        {
            check_floats(list).or_else(|problem| wrong(format!("`{name}` {problem}")))
        }
        (ParameterType::Blackbody, _) => wrong(format!("`{name}` takes one temperature in kelvin")),
        (ParameterType::Spectrum, Values::Booleans(_) | Values::Buffer(_)) => {
            wrong(format!("`{name}` takes numbers or a name, found booleans"))
        }
        (ParameterType::Text | ParameterType::Reference(_), other) => {
            wrong(format!("`{name}` takes quoted strings, found {}", other.description()))
        }
    }
}

fn check_groups(count: usize, length: usize) -> Result<(), String> {
    if length == 0 {
        Err("has no value".to_owned())
    } else if !length.is_multiple_of(count) {
        Err(format!("takes {count} numbers a value, found {length}"))
    } else {
        Ok(())
    }
}

fn check_floats(list: &[f64]) -> Result<(), String> {
    list.iter().try_for_each(|value| check_range(super::parameter::Component::Float, *value))
}

fn check_range(component: super::parameter::Component, value: f64) -> Result<(), String> {
    use super::parameter::Component;
    match component {
        Component::Float if (value as f32).is_finite() => Ok(()),
        Component::Float => Err(format!("takes binary32 numbers, {value:e} is too large")),
        Component::Int if value == f64::from(value as i32) => Ok(()),
        Component::Int => Err(format!("takes whole numbers of 32 bits, found {value}")),
        Component::Uint if value == f64::from(value as u32) => Ok(()),
        Component::Uint => Err(format!("takes whole numbers from 0 to 4294967295, found {value}")),
        Component::Bool => Err("takes `true` or `false`".to_owned()),
    }
}

/// Converts CIE XYZ, in which earlier versions of the format give colours, to linear red, green and blue.
fn from_tristimulus(values: &mut Values) {
    const TO_RGB: [[f64; 3]; 3] = [
        [3.240_479, -1.537_150, -0.498_535],
        [-0.969_256, 1.875_991, 0.041_556],
        [0.055_648, -0.204_043, 1.057_311],
    ];
    if let Values::Numbers(numbers) = values {
        let (colors, _) = numbers.as_chunks_mut::<3>();
        for color in colors {
            let component =
                |row: [f64; 3]| (0..3).map(|it| row[it] * color[it]).sum::<f64>().max(0.0);
            *color = TO_RGB.map(component);
        }
    }
}

/// Shortens a long text for messages.
fn shorten(text: &str) -> String {
    const LIMIT: usize = 60;
    if text.len() <= LIMIT {
        return text.to_owned();
    }
    format!("{}...", &text[..text.floor_char_boundary(LIMIT)])
}
