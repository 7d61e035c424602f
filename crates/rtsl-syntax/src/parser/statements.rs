//! Statements.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::{Parse, Parser};
use crate::ast::{
    Block, Condition, Expression, ExpressionKind, Qualifiers, Statement, StatementKind, SwitchCase,
    Variable,
};
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::{Keyword, Reading, Word};

impl Parser<'_> {
    /// Parses `{ ... }`. The next token is the brace.
    pub(super) fn parse_block(&mut self) -> Parse<Block> {
        let open = self.bump();
        let mut statements = Vec::new();
        self.parse_statements(&mut statements, false);
        let close = self.expect_closing(open, Punctuator::RightBrace)?;
        Ok(Block { statements, span: open.span.to(close.span) })
    }

    /// Parses statements up to a `}`, a class or the end, and, if `in_switch`, up to a label.
    fn parse_statements(&mut self, statements: &mut Vec<Statement>, in_switch: bool) {
        while !self.at_end() && !self.at(Punctuator::RightBrace) && !self.at_class() {
            if in_switch && self.at_label() {
                return;
            }
            let before = self.position;
            statements.push(self.parse_statement());
            self.ensure_progress(before);
        }
    }

    fn at_label(&self) -> bool {
        matches!(self.peek_keyword(), Some(Keyword::Case | Keyword::Default))
    }

    /// Parses a statement. Text that cannot be parsed is skipped and becomes the empty statement.
    fn parse_statement(&mut self) -> Statement {
        let first = self.peek();
        let before = self.position;
        let kind = match self.nested(Self::parse_statement_kind) {
            Ok(kind) => kind,
            Err(_) => {
                self.recover_statement();
                self.note_skipped(before);
                if self.position == before && self.at(Punctuator::RightBrace) {
                    // The caller's loop ends at this token.
                    return Statement { kind: StatementKind::Empty, span: first.span };
                }
                StatementKind::Empty
            }
        };
        Statement { kind, span: first.span.to(self.previous_span()) }
    }

    /// Parses the body of a loop, an `if` or similar. A closing brace or a class instead of it is
    /// an error here, since the caller has no list to end.
    fn parse_body(&mut self) -> Parse<Box<Statement>> {
        if self.at(Punctuator::RightBrace) || self.at_end() || self.at_class() {
            return Err(self.unexpected("a statement"));
        }
        Ok(Box::new(self.parse_statement()))
    }

    fn parse_statement_kind(&mut self) -> Parse<StatementKind> {
        let token = self.peek();
        match token.kind {
            TokenKind::Punctuator(Punctuator::LeftBrace) => {
                Ok(StatementKind::Block(self.parse_block()?))
            }
            TokenKind::Punctuator(Punctuator::Semicolon) => {
                self.bump();
                Ok(StatementKind::Empty)
            }
            TokenKind::Punctuator(Punctuator::LeftBracket) if self.at_attribute() => {
                self.refuse_attribute();
                self.nested(Self::parse_statement_kind)
            }
            TokenKind::Name => match self.symbols.word(token.spelling) {
                Word::Keyword(keyword) => self.parse_keyword_statement(keyword, token),
                Word::Reserved(reserved) => match reserved.reading {
                    Reading::Statement => {
                        self.complain_reserved(token, reserved);
                        self.bump();
                        self.recover_statement();
                        Ok(StatementKind::Empty)
                    }
                    Reading::Qualifier | Reading::Layout | Reading::Type(_) | Reading::Name => {
                        self.parse_simple_statement()
                    }
                },
                Word::Type | Word::Plain if self.at_assertion() => {
                    Ok(StatementKind::Assertion(self.parse_assertion()?))
                }
                Word::Type | Word::Plain if self.at_print() => {
                    Ok(StatementKind::Print(self.parse_print()?))
                }
                Word::Type | Word::Plain => self.parse_simple_statement(),
            },
            TokenKind::Number
            | TokenKind::Text
            | TokenKind::Punctuator(_)
            | TokenKind::Invalid(_)
            | TokenKind::End => self.parse_expression_statement(),
        }
    }

    fn parse_keyword_statement(&mut self, keyword: Keyword, token: Token) -> Parse<StatementKind> {
        match keyword {
            Keyword::If => self.parse_if(),
            Keyword::Switch => self.parse_switch(),
            Keyword::For => self.parse_for(),
            Keyword::While => self.parse_while(),
            Keyword::Do => self.parse_do(),
            Keyword::Illuminance => self.parse_illuminance(),
            Keyword::Return => self.parse_return(),
            Keyword::Break => self.parse_jump(StatementKind::Break, "`break`"),
            Keyword::Continue => self.parse_jump(StatementKind::Continue, "`continue`"),
            Keyword::Precision => {
                self.parse_precision()?;
                Ok(StatementKind::Empty)
            }
            Keyword::Case | Keyword::Default => {
                let message = format!("label `{}` outside a `switch`", self.text(token));
                let diagnostic = Diagnostic::new(codes::MISPLACED_LABEL, message)
                    .at(token.span, "labels must be directly inside the braces of a `switch`");
                self.report(diagnostic);
                self.bump();
                self.skip_label();
                Ok(StatementKind::Empty)
            }
            Keyword::Else => {
                let diagnostic = Diagnostic::new(codes::UNEXPECTED_TOKEN, "`else` without `if`")
                    .at(token.span, "no `if` ends just before it")
                    .help("an `if` whose body is several statements needs braces");
                self.report(diagnostic);
                self.bump();
                // The statement after it is parsed as an ordinary statement.
                self.parse_body().map(|body| body.kind)
            }
            Keyword::True | Keyword::False => self.parse_expression_statement(),
            Keyword::Attribute
            | Keyword::Struct
            | Keyword::Const
            | Keyword::Highp
            | Keyword::In
            | Keyword::InOut
            | Keyword::Invariant
            | Keyword::Lowp
            | Keyword::Mediump
            | Keyword::Out
            | Keyword::Output
            | Keyword::Precise
            | Keyword::Private
            | Keyword::Public
            | Keyword::Scratch
            | Keyword::Uniform => self.parse_simple_statement(),
            Keyword::Enum => {
                self.parse_enumeration()?;
                let diagnostic = Diagnostic::new(
                    codes::UNSUPPORTED_DECLARATION,
                    "an enumeration declared in a function",
                )
                .at(token.span, "not allowed here")
                .help("declare it in the class, or at file scope");
                self.report(diagnostic);
                Ok(StatementKind::Empty)
            }
            Keyword::Class => Err(self.unexpected("a statement")),
        }
    }

    /// Parses a declaration or an expression with its `;`.
    fn parse_simple_statement(&mut self) -> Parse<StatementKind> {
        if self.at_declaration() {
            self.parse_declaration_statement()
        } else {
            self.parse_expression_statement()
        }
    }

    fn parse_expression_statement(&mut self) -> Parse<StatementKind> {
        let expression = self.parse_expression()?;
        self.expect_semicolon("the expression")?;
        Ok(StatementKind::Expression(expression))
    }

    /// True if a declaration begins here: a qualifier, or a type and a name. No expression has two
    /// adjacent words.
    fn at_declaration(&self) -> bool {
        match self.word_of(self.peek()) {
            Some(Word::Keyword(Keyword::True | Keyword::False)) => return false,
            Some(Word::Keyword(_)) => return true,
            Some(Word::Reserved(reserved)) => match reserved.reading {
                Reading::Qualifier | Reading::Layout => return true,
                Reading::Type(_) => {}
                Reading::Statement | Reading::Name => return false,
            },
            Some(Word::Plain | Word::Type) => {}
            None => return false,
        }
        // `module.Type name`
        let is_qualified =
            self.peek_at(1).is(Punctuator::Dot) && self.peek_at(2).kind == TokenKind::Name;
        let mut end = self.position + if is_qualified { 3 } else { 1 };
        while self.is_scope(end) {
            end += 3;
        }
        if self.is_type_argument(end) {
            end = self.after_type_arguments(end).unwrap_or(end);
        }
        let after = self.tokens[self.after_array_sizes(end)];
        if self.is_indirection(end) {
            return true;
        }
        match self.word_of(after) {
            // A keyword on the next line begins the next statement: a `;` is missing.
            Some(Word::Keyword(_)) => !after.starts_line,
            Some(_) => true,
            None => {
                let ends = after.is(Punctuator::Semicolon) || after.is(Punctuator::Comma);
                ends && self.is_type_word(self.peek())
            }
        }
    }

    /// The index just past the `[...]` from `start` on. This lookahead ends with the statement, so
    /// that its cost on malformed text stays linear.
    pub(super) fn after_array_sizes(&self, start: usize) -> usize {
        let mut nesting = 0_usize;
        let mut next = start;
        loop {
            match self.tokens[next].kind {
                TokenKind::Punctuator(Punctuator::LeftBracket) => nesting += 1,
                TokenKind::Punctuator(Punctuator::RightBracket) if nesting > 0 => nesting -= 1,
                TokenKind::Punctuator(
                    Punctuator::Semicolon | Punctuator::LeftBrace | Punctuator::RightBrace,
                )
                | TokenKind::End => return next,
                _ if nesting == 0 => return next,
                _ => {}
            }
            next += 1;
        }
    }

    fn is_type_word(&self, token: Token) -> bool {
        self.word_of(token) == Some(Word::Type)
    }

    fn parse_declaration_statement(&mut self) -> Parse<StatementKind> {
        let first = self.peek();
        let start = self.position;
        let qualifiers = self.parse_qualifiers();
        if self.at_keyword(Keyword::Struct) {
            let cost = self.cost_since(start);
            let (structure, variables) =
                self.parse_struct_declaration(Vec::new(), cost, qualifiers)?;
            return Ok(StatementKind::Struct(structure, variables));
        }
        let ty = self.parse_type("a declaration")?;
        let cost = self.cost_since(start);
        if self.declares_nothing(&ty) {
            return Ok(StatementKind::Empty);
        }
        self.skip_empty_declarator(&ty);
        let name = self.expect_identifier("the declaration's name")?;
        if self.at(Punctuator::LeftParenthesis) {
            let function = self.parse_function(qualifiers, Some(ty), name, first)?;
            return Ok(StatementKind::Function(function));
        }
        let mut variables = Vec::new();
        let result = self.parse_declarators(Vec::new(), qualifiers, ty, name, cost, &mut variables);
        match result {
            Ok(()) => self.expect_semicolon("the declaration")?,
            // The variables parsed so far stay declared, so that their uses give no further errors.
            Err(_) => self.recover_statement(),
        }
        Ok(StatementKind::Variables(variables))
    }

    /// Parses `( condition )`. A condition that cannot be parsed becomes an error expression.
    fn parse_parenthesized(&mut self) -> Parse<Expression> {
        let open = self.expect(Punctuator::LeftParenthesis)?;
        let result = self.parse_expression().and_then(|expression| {
            self.expect_closing(open, Punctuator::RightParenthesis)?;
            Ok(expression)
        });
        Ok(result.unwrap_or_else(|_| self.recover_condition(open)))
    }

    fn recover_condition(&mut self, open: Token) -> Expression {
        self.recover_parenthesis();
        let span = open.span.to(self.previous_span());
        Expression { kind: ExpressionKind::Error, span }
    }

    fn parse_if(&mut self) -> Parse<StatementKind> {
        self.bump();
        let condition = self.parse_parenthesized()?;
        let then = self.parse_body()?;
        let otherwise = match self.maybe_keyword(Keyword::Else) {
            Some(_) => Some(self.parse_body()?),
            None => None,
        };
        Ok(StatementKind::If { condition, then, otherwise })
    }

    fn parse_switch(&mut self) -> Parse<StatementKind> {
        self.bump();
        let selector = self.parse_parenthesized()?;
        let open = self.expect(Punctuator::LeftBrace)?;
        let mut cases = Vec::new();
        self.refuse_unlabelled();
        while self.at_label() {
            cases.push(self.parse_case());
        }
        self.require_statement(&cases);
        self.expect_closing(open, Punctuator::RightBrace)?;
        Ok(StatementKind::Switch { selector, cases })
    }

    /// Parses and drops statements before the first label.
    fn refuse_unlabelled(&mut self) {
        let place = self.peek().span;
        let mut unlabelled = Vec::new();
        self.parse_statements(&mut unlabelled, true);
        if !unlabelled.is_empty() {
            self.complain(
                codes::MISPLACED_LABEL,
                "a statement before the first label of a `switch`",
                place,
                "expected `case` or `default`",
            );
        }
    }

    /// Reports a last label that parsed without errors and has no statement before the end of the
    /// `switch`.
    fn require_statement(&mut self, cases: &[SwitchCase]) {
        let Some(last) = cases.last() else { return };
        let whole = self.tokens[self.position - 1].is(Punctuator::Colon);
        if !last.statements.is_empty() || !whole || !self.at(Punctuator::RightBrace) {
            return;
        }
        let diagnostic = Diagnostic::new(
            codes::LABEL_WITHOUT_STATEMENT,
            "no statement between this label and the end of the `switch`",
        )
        .at(last.span, "expected a statement after this")
        .suggest("write", last.span.after(), " break;");
        self.diagnostics.push(diagnostic);
    }

    fn parse_case(&mut self) -> SwitchCase {
        let keyword = self.peek();
        let label = self.parse_label();
        let span = keyword.span.to(self.previous_span());
        let mut statements = Vec::new();
        self.parse_statements(&mut statements, true);
        SwitchCase { label, span, statements }
    }

    /// Parses `case value:` or `default:` and returns the value.
    fn parse_label(&mut self) -> Option<Expression> {
        let keyword = self.bump();
        if self.word_of(keyword) == Some(Word::Keyword(Keyword::Default)) {
            if self.expect(Punctuator::Colon).is_err() {
                self.skip_label();
            }
            return None;
        }
        let value = self.parse_expression().and_then(|value| {
            self.expect(Punctuator::Colon)?;
            Ok(value)
        });
        let error = |span: Span| Expression { kind: ExpressionKind::Error, span };
        Some(value.unwrap_or_else(|_| {
            self.skip_label();
            error(keyword.span)
        }))
    }

    /// Skips to the end of a label on its line.
    fn skip_label(&mut self) {
        while !self.at_end() && !self.at(Punctuator::RightBrace) && !self.peek().starts_line {
            if self.maybe(Punctuator::Colon).is_some() {
                return;
            }
            self.bump();
        }
    }

    fn parse_for(&mut self) -> Parse<StatementKind> {
        self.bump();
        let open = self.expect(Punctuator::LeftParenthesis)?;
        let header = self.parse_for_header(open);
        let (initializer, condition, step) = header.unwrap_or_else(|_| {
            let error = self.recover_condition(open);
            let empty = Statement { kind: StatementKind::Empty, span: open.span };
            (Box::new(empty), Some(Condition::Expression(error)), None)
        });
        let body = self.parse_body()?;
        Ok(StatementKind::For { initializer, condition, step, body })
    }

    fn parse_for_header(&mut self, open: Token) -> Parse<ForHeader> {
        let first = self.peek();
        let kind = match self.maybe(Punctuator::Semicolon) {
            Some(_) => StatementKind::Empty,
            None => self.parse_for_initializer()?,
        };
        let initializer = Box::new(Statement { kind, span: first.span.to(self.previous_span()) });
        let condition =
            if self.at(Punctuator::Semicolon) { None } else { Some(self.parse_condition()?) };
        self.expect(Punctuator::Semicolon)?;
        let step = if self.at(Punctuator::RightParenthesis) {
            None
        } else {
            Some(self.parse_expression()?)
        };
        self.expect_closing(open, Punctuator::RightParenthesis)?;
        Ok((initializer, condition, step))
    }

    fn parse_for_initializer(&mut self) -> Parse<StatementKind> {
        if !self.at_declaration() {
            let expression = self.parse_expression()?;
            self.expect(Punctuator::Semicolon)?;
            return Ok(StatementKind::Expression(expression));
        }
        let start = self.position;
        let qualifiers = self.parse_qualifiers();
        if self.at_keyword(Keyword::Struct) {
            let cost = self.cost_since(start);
            let (structure, variables) =
                self.parse_struct_declaration(Vec::new(), cost, qualifiers)?;
            return Ok(StatementKind::Struct(structure, variables));
        }
        let ty = self.parse_type("a declaration")?;
        let cost = self.cost_since(start);
        self.skip_empty_declarator(&ty);
        let name = self.expect_identifier("the declaration's name")?;
        let mut variables = Vec::new();
        self.parse_declarators(Vec::new(), qualifiers, ty, name, cost, &mut variables)?;
        if self.at(Punctuator::Colon) {
            return Err(self.refuse_range());
        }
        self.expect(Punctuator::Semicolon)?;
        Ok(StatementKind::Variables(variables))
    }

    /// Parses the condition of a loop: an expression, or a variable with its value.
    fn parse_condition(&mut self) -> Parse<Condition> {
        if !self.at_declaration() {
            return Ok(Condition::Expression(self.parse_expression()?));
        }
        let qualifiers: Qualifiers = self.parse_qualifiers();
        let ty = self.parse_type("a declaration")?;
        let name = self.expect_identifier("the declaration's name")?;
        self.expect(Punctuator::Assign)?;
        let initializer = Some(self.parse_initializer()?);
        let span = name.span.to(self.previous_span());
        let annotations = Vec::new();
        let variable = Variable { annotations, qualifiers, ty, name, initializer, span };
        Ok(Condition::Declaration(Box::new(variable)))
    }

    fn parse_while(&mut self) -> Parse<StatementKind> {
        self.bump();
        let open = self.expect(Punctuator::LeftParenthesis)?;
        let condition = self.parse_condition().and_then(|condition| {
            self.expect_closing(open, Punctuator::RightParenthesis)?;
            Ok(condition)
        });
        let condition =
            condition.unwrap_or_else(|_| Condition::Expression(self.recover_condition(open)));
        let body = self.parse_body()?;
        Ok(StatementKind::While { condition, body })
    }

    fn parse_do(&mut self) -> Parse<StatementKind> {
        self.bump();
        let body = self.parse_body()?;
        if self.maybe_keyword(Keyword::While).is_none() {
            return Err(self.unexpected("`while` after the body of `do`"));
        }
        let condition = self.parse_parenthesized()?;
        self.expect_semicolon("`do ... while (...)`")?;
        Ok(StatementKind::DoWhile { body, condition })
    }

    fn parse_illuminance(&mut self) -> Parse<StatementKind> {
        let keyword = self.bump();
        let arguments = self
            .parse_optional_arguments()
            .unwrap_or_else(|_| vec![self.recover_condition(keyword)]);
        let body = self.parse_body()?;
        Ok(StatementKind::Illuminance { arguments, body })
    }

    fn parse_return(&mut self) -> Parse<StatementKind> {
        self.bump();
        let nothing = self.at(Punctuator::Semicolon) || self.at(Punctuator::RightBrace);
        let value = if nothing { None } else { Some(self.parse_expression()?) };
        self.expect_semicolon("`return`")?;
        Ok(StatementKind::Return(value))
    }

    fn parse_jump(&mut self, kind: StatementKind, name: &str) -> Parse<StatementKind> {
        self.bump();
        self.expect_semicolon(name)?;
        Ok(kind)
    }
}

/// The parts of the parentheses of a `for`.
type ForHeader = (Box<Statement>, Option<Condition>, Option<Expression>);
