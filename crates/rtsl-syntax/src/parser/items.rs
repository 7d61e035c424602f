//! Items at file scope and in classes: classes, structs, functions and members.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::{Parse, Parser};
use crate::ast::{
    Annotation, AnnotationValue, Class, ClassForm, Field, Function, Identifier, Import, Item,
    Parameter, Qualifiers, Struct, TranslationUnit, TypeName,
};
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::{Keyword, Word};

/// The scope whose items are parsed; it determines where parsing stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    File,
    HeaderClass,
    BlockClass,
}

impl Parser<'_> {
    pub(super) fn parse_translation_unit(&mut self) -> TranslationUnit {
        let mut items = Vec::new();
        while !self.at_end() {
            let before = self.position;
            if self.at_import() {
                if self.parse_import().is_err() {
                    self.recover_statement();
                }
            } else if self.at_class() {
                if let Ok(class) = self.parse_class() {
                    items.push(Item::Class(class));
                }
            } else {
                self.parse_items(Scope::File, &mut items);
            }
            self.ensure_progress(before);
        }
        let imports = std::mem::take(&mut self.imports);
        TranslationUnit { imports, items, skipped: std::mem::take(&mut self.skipped) }
    }

    /// True at `import`, which is no keyword: a name follows, and then no declaration of that name.
    fn at_import(&self) -> bool {
        let token = self.peek();
        let begins = token.kind == TokenKind::Name && self.text(token) == "import";
        begins && self.peek_at(1).kind == TokenKind::Name
    }

    /// Parses `import a.b as c;`.
    fn parse_import(&mut self) -> Parse<()> {
        self.bump();
        let mut path = vec![self.expect_identifier("the name of a file")?];
        while self.maybe(Punctuator::Dot).is_some() {
            path.push(self.expect_identifier("the name of a file")?);
        }
        let span = path[0].span.to(self.previous_span());
        let mut alias = None;
        if self.peek().kind == TokenKind::Name && self.text(self.peek()) == "as" {
            self.bump();
            alias = Some(self.expect_identifier("a name for the module")?);
        }
        self.expect_semicolon("the import")?;
        self.imports.push(Import { path, alias, span });
        Ok(())
    }

    /// Appends the name after a dot, as in `module.Name`.
    pub(super) fn parse_qualified(&mut self, mut name: Identifier) -> Parse<Identifier> {
        if self.maybe(Punctuator::Dot).is_some() {
            let last = self.expect_identifier("a name of the module")?;
            name = Identifier {
                name: format!("{}.{}", name.name, last.name),
                span: name.span.to(last.span),
            };
        }
        Ok(name)
    }

    fn parse_class(&mut self) -> Parse<Class> {
        let keyword = self.bump();
        let documentation = self.documentation_of(keyword);
        let (name, bases) = match self.parse_class_head() {
            Ok(head) => head,
            Err(reported) => {
                self.recover_class_header();
                return Err(reported);
            }
        };
        let (form, header_end) = match self.maybe(Punctuator::LeftBrace) {
            Some(brace) => (ClassForm::Block, brace),
            None => {
                if self.expect_semicolon("the class header").is_err() {
                    self.recover_class_header();
                }
                (ClassForm::Header, self.tokens[self.position - 1])
            }
        };
        let mut items = Vec::new();
        self.class = Some(name.name.clone());
        match form {
            ClassForm::Header => self.parse_items(Scope::HeaderClass, &mut items),
            ClassForm::Block => {
                self.parse_items(Scope::BlockClass, &mut items);
                if self.expect_closing(header_end, Punctuator::RightBrace).is_ok() {
                    self.maybe(Punctuator::Semicolon);
                }
            }
        }
        self.class = None;
        let span = keyword.span.to(header_end.span);
        let end = self.previous_span().after();
        Ok(Class { name, bases, form, items, documentation, span, end })
    }

    fn documentation_of(&self, first: Token) -> Option<String> {
        let file = self.map.file(first.span.file);
        self.comments.get(&first.span.file)?.before(&file.text, first.span.start as usize)
    }

    fn parse_class_head(&mut self) -> Parse<(Identifier, Vec<Identifier>)> {
        let name = self.expect_identifier("the class's name")?;
        let mut bases = Vec::new();
        if self.maybe(Punctuator::Colon).is_some() {
            loop {
                // C++ syntax: `class A : public B`.
                if self.maybe_keyword(Keyword::Public).is_some() {
                    let place = self.previous_span();
                    self.complain(
                        codes::UNEXPECTED_TOKEN,
                        "bases have no access; expected the name of a role or class",
                        place,
                        "leave this out",
                    );
                }
                let base = self.expect_identifier("the name of a role or class")?;
                bases.push(self.parse_qualified(base)?);
                if self.maybe(Punctuator::Comma).is_none() {
                    break;
                }
            }
        }
        Ok((name, bases))
    }

    fn recover_class_header(&mut self) {
        while !self.at_end() && !self.at_class() {
            let token = self.peek();
            if token.is(Punctuator::Semicolon) {
                self.bump();
                return;
            }
            if token.starts_line || token.is(Punctuator::LeftBrace) {
                return;
            }
            self.bump();
        }
    }

    fn parse_items(&mut self, scope: Scope, items: &mut Vec<Item>) {
        while !self.at_end() {
            let before = self.position;
            if self.at_import() {
                if scope == Scope::File {
                    return;
                }
                let place = self.peek().span;
                self.complain(
                    codes::MISPLACED_IMPORT,
                    "an import inside a class",
                    place,
                    "imports come before the first class",
                );
                self.recover_statement();
                self.ensure_progress(before);
                continue;
            }
            if self.at_class() {
                match scope {
                    Scope::File | Scope::HeaderClass => return,
                    Scope::BlockClass => {
                        let place = self.peek().span;
                        // An unclosed class is likelier than a nested one.
                        self.report(
                            Diagnostic::new(codes::NESTED_CLASS, "a class inside a class")
                                .at(place, "not allowed here")
                                .help("close the class before it with `};`"),
                        );
                        return;
                    }
                }
            }
            if self.at(Punctuator::RightBrace) {
                if scope == Scope::BlockClass {
                    return;
                }
                let place = self.peek().span;
                self.report(
                    Diagnostic::new(codes::UNCLOSED_DELIMITER, "unmatched `}`")
                        .at(place, "there is no open `{` before it"),
                );
                self.bump();
            } else if self.parse_item(items).is_err() {
                self.recover_statement();
                // The remainder of a body whose head could not be parsed.
                if self.position == before {
                    self.bump();
                }
                self.note_skipped(before);
            }
            self.ensure_progress(before);
        }
    }

    /// Parses a declaration at file scope or in a class.
    fn parse_item(&mut self, items: &mut Vec<Item>) -> Parse<()> {
        if self.maybe(Punctuator::Semicolon).is_some() {
            return Ok(());
        }
        if self.at_keyword(Keyword::Precision) {
            return self.parse_precision();
        }
        if self.at_assertion() {
            items.push(Item::Assertion(self.parse_assertion()?));
            return Ok(());
        }
        if self.refuse_access_label("write `public` or `private` before each member") {
            return Ok(());
        }
        self.refuse_constant_buffer()?;
        if self.at_attribute() && !self.peek_at(1).is(Punctuator::LeftBracket) {
            self.refuse_attribute();
        }
        let start = self.position;
        let annotations = self.parse_annotations()?;
        let first = self.peek();
        let qualifiers = self.parse_qualifiers();
        if self.at_constructor() {
            let name = self.bump();
            let name = self.identifier(name);
            let function = self.parse_function(qualifiers, None, name, first)?;
            items.push(Item::Function(function));
            return Ok(());
        }
        if self.at_keyword(Keyword::Struct) {
            let cost = self.cost_since(start);
            let (structure, variables) =
                self.parse_struct_declaration(annotations, cost, qualifiers)?;
            items.push(Item::Struct(structure));
            items.extend(variables.into_iter().map(Item::Variable));
            return Ok(());
        }
        if self.at_keyword(Keyword::Enum) {
            self.refuse_before_enumeration(&annotations, &qualifiers);
            items.push(Item::Enumeration(self.parse_enumeration()?));
            return Ok(());
        }
        self.refuse_other_declarations(&qualifiers)?;
        let ty = self.parse_type("a declaration")?;
        let cost = self.cost_since(start);
        if self.declares_nothing(&ty) {
            return Ok(());
        }
        self.skip_empty_declarator(&ty);
        let name = self.expect_declared_name(&ty)?;
        self.refuse_operator(&name)?;
        if self.at(Punctuator::LeftParenthesis) {
            if let Some(annotation) = annotations.first() {
                self.complain(
                    codes::UNEXPECTED_TOKEN,
                    "annotations belong to members and parameters",
                    annotation.key.span,
                    "this declares a function",
                );
            }
            items.push(Item::Function(self.parse_function(qualifiers, Some(ty), name, first)?));
            return Ok(());
        }
        let mut variables = Vec::new();
        let result =
            self.parse_declarators(annotations, qualifiers, ty, name, cost, &mut variables);
        items.extend(variables.into_iter().map(Item::Variable));
        result?;
        self.expect_semicolon("the declaration")
    }

    fn at_constructor(&self) -> bool {
        let token = self.peek();
        token.kind == TokenKind::Name
            && self.text(token) == "constructor"
            && self.peek_at(1).is(Punctuator::LeftParenthesis)
    }

    /// Expects the name after the type of a declaration.
    fn expect_declared_name(&mut self, ty: &TypeName) -> Parse<Identifier> {
        let next = self.peek();
        if next.is(Punctuator::LeftParenthesis) {
            let diagnostic = Diagnostic::new(
                codes::UNEXPECTED_TOKEN,
                format!("function `{}` has no result type", crate::message::shorten(&ty.name.name)),
            )
            .at(ty.span, "expected a type before the name");
            // C++ syntax: a constructor named like the class.
            let diagnostic = if self.class.as_ref() == Some(&ty.name.name) {
                diagnostic.suggest(
                    "the function that initializes an instance is called",
                    ty.span,
                    "constructor",
                )
            } else {
                diagnostic.suggest("for a function without result", ty.span.before(), "void ")
            };
            return Err(self.report(diagnostic));
        }
        self.expect_identifier("the declaration's name")
    }

    /// Reports declarations of GLSL that RTSL does not support: interface blocks and
    /// redeclarations.
    fn refuse_other_declarations(&mut self, qualifiers: &Qualifiers) -> Parse<()> {
        if self.word_of(self.peek()) != Some(Word::Plain) || qualifiers.list.is_empty() {
            return Ok(());
        }
        let (message, help) = match self.peek_at(1).kind {
            TokenKind::Punctuator(Punctuator::LeftBrace) => (
                "RTSL has no interface blocks",
                "declare the values as members, or in a `struct` that a member has as its type",
            ),
            TokenKind::Punctuator(Punctuator::Semicolon | Punctuator::Comma) => (
                "a qualifier can't be added to a name declared before",
                "write the qualifier where the name is declared",
            ),
            _ => return Ok(()),
        };
        let place = self.peek().span;
        let diagnostic = Diagnostic::new(codes::UNSUPPORTED_DECLARATION, message)
            .at(place, "a declaration of GLSL only")
            .help(help);
        Err(self.report(diagnostic))
    }

    /// Parses parameters and body; the name has been parsed.
    pub(super) fn parse_function(
        &mut self,
        qualifiers: Qualifiers,
        result: Option<TypeName>,
        name: Identifier,
        first: Token,
    ) -> Parse<Function> {
        let open = self.expect(Punctuator::LeftParenthesis)?;
        let parameters = match self.parse_parameters(open) {
            Ok(parameters) => parameters,
            // The body is parsed all the same, to report its errors.
            Err(_) => {
                let before = self.position;
                self.recover_parenthesis();
                let skipped = open.span.to(self.tokens[before].span).to(self.previous_span());
                self.skipped.push(skipped);
                Vec::new()
            }
        };
        let span = first.span.to(self.previous_span());
        self.refuse_semantic();
        self.refuse_trailing_qualifiers();
        let body = if self.at(Punctuator::LeftBrace) {
            Some(self.parse_block()?)
        } else if self.maybe(Punctuator::Semicolon).is_some() {
            None
        } else {
            return Err(self.unexpected("the function's body, or `;`"));
        };
        let documentation = self.documentation_of(first);
        Ok(Function { qualifiers, result, name, parameters, body, documentation, span })
    }

    fn parse_parameters(&mut self, open: Token) -> Parse<Vec<Parameter>> {
        let mut parameters = Vec::new();
        let only_void = self.peek().kind == TokenKind::Name
            && self.text(self.peek()) == "void"
            && self.peek_at(1).is(Punctuator::RightParenthesis);
        if only_void {
            self.bump();
        }
        if self.maybe(Punctuator::RightParenthesis).is_some() {
            return Ok(parameters);
        }
        loop {
            parameters.push(self.parse_parameter()?);
            if self.maybe(Punctuator::Comma).is_none() {
                break;
            }
        }
        self.expect_closing(open, Punctuator::RightParenthesis)?;
        Ok(parameters)
    }

    fn parse_parameter(&mut self) -> Parse<Parameter> {
        let first = self.peek();
        let annotations = self.parse_annotations()?;
        let qualifiers = self.parse_qualifiers();
        let mut ty = self.parse_type("a parameter")?;
        let mut name = None;
        if self.peek().kind == TokenKind::Name {
            name = Some(self.expect_identifier("the parameter's name")?);
            self.parse_declarator_sizes(&mut ty)?;
            self.refuse_semantic();
        }
        let default = match self.maybe(Punctuator::Assign) {
            Some(_) => Some(self.parse_initializer()?),
            None => None,
        };
        let span = first.span.to(self.previous_span());
        Ok(Parameter { annotations, qualifiers, ty, name, default, span })
    }

    /// Parses `struct Name { fields }` up to the closing brace.
    pub(super) fn parse_struct(&mut self) -> Parse<Struct> {
        let keyword = self.bump();
        let name = if self.at(Punctuator::LeftBrace) {
            self.unnamed_structs += 1;
            Identifier { name: format!("struct@{}", self.unnamed_structs), span: keyword.span }
        } else {
            self.expect_identifier("the struct's name")?
        };
        self.refuse_bases_of_struct();
        let open = self.expect(Punctuator::LeftBrace)?;
        let mut fields = Vec::new();
        while !self.at_end() && !self.at(Punctuator::RightBrace) && !self.at_class() {
            let before = self.position;
            if self.parse_fields(&name.name, &mut fields).is_err() {
                self.recover_statement();
            }
            self.ensure_progress(before);
        }
        let close = self.expect_closing(open, Punctuator::RightBrace)?;
        Ok(Struct { name, fields, span: keyword.span.to(close.span) })
    }

    /// Parses fields of the struct of this name.
    fn parse_fields(&mut self, structure: &str, fields: &mut Vec<Field>) -> Parse<()> {
        if self.refuse_access_label("leave it out: all fields can be read and written")
            || self.refuse_constructor_of_struct(structure)
        {
            return Ok(());
        }
        let qualifiers = self.parse_qualifiers();
        if let Some((_, place)) = qualifiers.list.first() {
            self.complain(
                codes::UNSUPPORTED_DECLARATION,
                "a field of a struct has no qualifiers",
                *place,
                "leave this out",
            );
        }
        if self.at_keyword(Keyword::Struct) {
            let place = self.peek().span;
            let diagnostic =
                Diagnostic::new(codes::UNSUPPORTED_DECLARATION, "a struct declared in a struct")
                    .at(place, "not allowed here, as in GLSL")
                    .help("declare it before and name it here");
            return Err(self.report(diagnostic));
        }
        let start = self.position;
        let ty = self.parse_type("a field")?;
        let cost = self.cost_since(start);
        loop {
            let name = self.expect_identifier("the field's name")?;
            self.refuse_operator(&name)?;
            if self.refuse_method_of_struct(structure, &name) {
                return Ok(());
            }
            self.charge_copy(cost)?;
            let mut ty = ty.clone();
            self.parse_declarator_sizes(&mut ty)?;
            self.refuse_semantic();
            fields.push(Field { ty, name });
            if self.at(Punctuator::Assign) {
                let place = self.peek().span;
                self.report(
                    Diagnostic::new(
                        codes::UNSUPPORTED_DECLARATION,
                        "a field of a struct has no initial value",
                    )
                    .at(place, "not allowed here, as in GLSL")
                    .help("give the values where a variable of the struct is declared"),
                );
                self.recover_declarator();
            }
            if self.maybe(Punctuator::Comma).is_none() {
                break;
            }
        }
        self.expect_semicolon("the field")
    }

    /// Parses any number of `[[key value, ...]]`.
    fn parse_annotations(&mut self) -> Parse<Vec<Annotation>> {
        let mut annotations = Vec::new();
        while self.at(Punctuator::LeftBracket) && self.peek_at(1).is(Punctuator::LeftBracket) {
            let open = self.bump();
            self.bump();
            while !self.at(Punctuator::RightBracket) {
                annotations.push(self.parse_annotation()?);
                if self.maybe(Punctuator::Comma).is_none() {
                    break;
                }
            }
            self.expect_closing(open, Punctuator::RightBracket)?;
            self.expect_closing(open, Punctuator::RightBracket)?;
        }
        Ok(annotations)
    }

    fn parse_annotation(&mut self) -> Parse<Annotation> {
        if self.peek().kind != TokenKind::Name {
            return Err(self.unexpected("an annotation's key"));
        }
        let key = self.bump();
        let key = self.identifier(key);
        self.maybe(Punctuator::Assign);
        let next = self.peek();
        let value = match next.kind {
            TokenKind::Punctuator(Punctuator::Comma | Punctuator::RightBracket) => {
                AnnotationValue::None
            }
            TokenKind::Text => self.parse_text(),
            _ => AnnotationValue::Expression(self.parse_argument()?),
        };
        Ok(Annotation { key, value })
    }

    /// Parses double-quoted text; adjacent texts are concatenated.
    pub(super) fn parse_text(&mut self) -> AnnotationValue {
        let mut text = String::new();
        let mut span = self.peek().span;
        while self.peek().kind == TokenKind::Text {
            let token = self.bump();
            span = span.to(token.span);
            let quoted = self.text(token);
            self.append_unescaped(&quoted[1..quoted.len() - 1], token, &mut text);
        }
        AnnotationValue::Text(text, span)
    }

    fn append_unescaped(&mut self, written: &str, token: Token, text: &mut String) {
        let mut characters = written.chars();
        while let Some(character) = characters.next() {
            if character != '\\' {
                text.push(character);
                continue;
            }
            match characters.next() {
                Some('n') => text.push('\n'),
                Some('t') => text.push('\t'),
                Some(other @ ('"' | '\\' | '\'')) => text.push(other),
                Some(other) => {
                    let shown = other.escape_default();
                    self.complain(
                        codes::UNKNOWN_ESCAPE,
                        format!("unknown escape `\\{shown}` in text"),
                        token.span,
                        r#"texts know `\n`, `\t`, `\"` and `\\`"#,
                    );
                }
                None => {}
            }
        }
    }
}
