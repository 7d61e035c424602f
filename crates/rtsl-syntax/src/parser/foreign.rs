//! Forms of C++, HLSL and CUDA: each is reported with what to write instead, and read as what it stands for, so that
//! one form gives one error.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::{Parse, Parser, Reported};
use crate::ast::Identifier;
use crate::message::shorten;
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::{Keyword, Reading, Word};

/// The advice for addresses and pointers.
pub(super) const NO_POINTERS: &str =
    "there are no pointers: an `inout` parameter changes a variable of the caller";

/// The limit on tokens of the arguments of a type. It bounds the time that lookahead takes.
const LONGEST_ARGUMENTS: usize = 64;

const LEFT_OUT: &str = "leave the word out: functions and members need no such qualifier";

/// Words that precede a type in other languages, with what to do about them.
const QUALIFIERS: [(&str, &str); 27] = [
    ("__constant__", "declare a value that the host sets as a `public` member"),
    ("__device__", LEFT_OUT),
    ("__forceinline__", LEFT_OUT),
    ("__global__", "hosts call the interface methods of a class; leave the word out"),
    ("__host__", LEFT_OUT),
    ("__inline__", LEFT_OUT),
    ("__managed__", LEFT_OUT),
    ("__noinline__", LEFT_OUT),
    ("__restrict__", LEFT_OUT),
    ("__shared__", "rays are independent: there is no memory that they share"),
    ("column_major", "leave the word out: `m[i]` is a column"),
    ("consteval", "write `const`"),
    ("constexpr", "write `const`"),
    ("constinit", "write `const`"),
    ("explicit", LEFT_OUT),
    ("export", LEFT_OUT),
    ("friend", LEFT_OUT),
    ("globallycoherent", LEFT_OUT),
    ("groupshared", "rays are independent: there is no memory that they share"),
    ("mutable", LEFT_OUT),
    ("nointerpolation", LEFT_OUT),
    ("row_major", "leave the word out: `m[i]` is a column"),
    ("snorm", LEFT_OUT),
    ("thread_local", LEFT_OUT),
    ("typename", LEFT_OUT),
    ("unorm", LEFT_OUT),
    ("virtual", "leave the word out: a class may redefine each method that it inherits"),
];

// Qualifiers, types and names.
impl Parser<'_> {
    fn complain_foreign(
        &mut self,
        message: impl Into<String>,
        place: Span,
        label: &str,
        help: impl Into<String>,
    ) {
        let diagnostic = Diagnostic::new(codes::FOREIGN_SYNTAX, message).at(place, label);
        self.diagnostics.push(diagnostic.help(help));
    }

    /// The advice for the qualifier of another language that is next, if one is: a type or another qualifier follows.
    pub(super) fn foreign_qualifier(&self) -> Option<&'static str> {
        if self.word_of(self.peek()) != Some(Word::Plain) || self.word_of(self.peek_at(1)).is_none()
        {
            return None;
        }
        let text = self.text(self.peek());
        QUALIFIERS.iter().find(|(theirs, _)| *theirs == text).map(|(_, help)| *help)
    }

    /// Reports and skips the qualifier that [`Parser::foreign_qualifier`] has found.
    pub(super) fn refuse_qualifier(&mut self, help: &str) {
        let token = self.bump();
        let message = format!("RTSL has no qualifier `{}`", self.text(token));
        self.complain_foreign(message, token.span, "not available here", help);
    }

    /// Reports qualifiers after the parameters of a function: `float f() const { }`.
    pub(super) fn refuse_trailing_qualifiers(&mut self) {
        loop {
            let token = self.peek();
            let is_const = self.at_keyword(Keyword::Const);
            let is_word = self.word_of(token) == Some(Word::Plain)
                && ["override", "final", "noexcept"].contains(&self.text(token));
            if !is_const && !is_word {
                return;
            }
            let message = format!("`{}` after the parameters of a function", self.text(token));
            self.complain_foreign(message, token.span, "not available here", LEFT_OUT);
            self.bump();
        }
    }

    /// True if `::` and a name begin at the token with this index.
    pub(super) fn is_scope(&self, index: usize) -> bool {
        let token = |distance: usize| self.tokens[(index + distance).min(self.tokens.len() - 1)];
        token(0).is(Punctuator::Colon)
            && token(1).is(Punctuator::Colon)
            && token(2).kind == TokenKind::Name
    }

    /// Reports the prefixes of `a::b::c`, of which `a` was consumed, and returns the last name.
    pub(super) fn without_scopes(&mut self, first: Token) -> Token {
        let mut last = first;
        while self.is_scope(self.position) {
            self.bump();
            self.bump();
            last = self.bump();
        }
        if last.span != first.span {
            let prefix = first.span.to(last.span.before());
            let diagnostic = Diagnostic::new(codes::FOREIGN_SYNTAX, "RTSL has no `::`")
                .at(prefix, "a prefix of the name")
                .note("functions of the language and choices of enumerations have no prefix; names of modules have one with a dot: `module.name`")
                .suggest("leave it out", prefix, "");
            self.diagnostics.push(diagnostic);
        }
        last
    }

    /// The index past `<...>` at `open`, if that consists of words, numbers and commas.
    pub(super) fn after_type_arguments(&self, open: usize) -> Option<usize> {
        let mut nesting = 0_usize;
        for (offset, token) in self.tokens[open..].iter().take(LONGEST_ARGUMENTS).enumerate() {
            match token.kind {
                TokenKind::Punctuator(Punctuator::Less) => nesting += 1,
                TokenKind::Punctuator(Punctuator::Greater) => nesting = nesting.checked_sub(1)?,
                TokenKind::Punctuator(Punctuator::ShiftRight) => {
                    nesting = nesting.checked_sub(2)?
                }
                TokenKind::Punctuator(Punctuator::Comma) | TokenKind::Name | TokenKind::Number => {}
                _ => return None,
            }
            if nesting == 0 {
                return Some(open + offset + 1);
            }
        }
        None
    }

    /// True at `<float...>`, which no expression has: types are no values.
    pub(super) fn is_type_argument(&self, open: usize) -> bool {
        let first = self.tokens[(open + 1).min(self.tokens.len() - 1)];
        self.tokens[open].is(Punctuator::Less) && self.names_type(first)
    }

    /// True for a word that is a type wherever it stands.
    fn names_type(&self, token: Token) -> bool {
        match self.word_of(token) {
            Some(Word::Type) => true,
            Some(Word::Reserved(reserved)) => matches!(reserved.reading, Reading::Type(_)),
            Some(Word::Plain | Word::Keyword(_)) | None => false,
        }
    }

    /// Reports the arguments of a type, as in `vector<float>`.
    pub(super) fn refuse_type_arguments(&mut self, ty: &Identifier) {
        if !self.at(Punctuator::Less) {
            return;
        }
        let Some(end) = self.after_type_arguments(self.position) else { return };
        let message = format!("RTSL has no type `{}<...>`", shorten(&ty.name));
        let span = ty.span.to(self.tokens[end - 1].span);
        self.complain_foreign(message, span, "a type with arguments", type_advice(&ty.name));
        self.position = end;
    }

    /// True if the token with this index is a `&` or `*` after the type of a declaration that begins at the next
    /// token: `float* p`, `Ray& r = rays`. No product of types is an expression, and none has a value assigned.
    pub(super) fn is_indirection(&self, index: usize) -> bool {
        let token = |distance: usize| self.tokens[(index + distance).min(self.tokens.len() - 1)];
        let marks = [Punctuator::Ampersand, Punctuator::AndAnd, Punctuator::Star];
        marks.iter().any(|mark| token(0).is(*mark))
            && token(1).kind == TokenKind::Name
            && (self.names_type(self.peek()) || token(2).is(Punctuator::Assign))
    }

    /// Reports `&`, `&&` or `*` after a type.
    pub(super) fn refuse_indirection(&mut self) {
        while let TokenKind::Punctuator(
            mark @ (Punctuator::Ampersand | Punctuator::AndAnd | Punctuator::Star),
        ) = self.peek().kind
        {
            let token = self.bump();
            let diagnostic = |message: &str, label: &str| {
                Diagnostic::new(codes::FOREIGN_SYNTAX, message).at(token.span, label)
            };
            self.diagnostics.push(if mark == Punctuator::Star {
                diagnostic("RTSL has no pointers", "a pointer").help(
                    "an `inout` parameter changes a variable of the caller; `float values[4]` is an array",
                )
            } else {
                diagnostic("RTSL has no references to variables", "a reference")
                    .help("parameters are passed by value, at no cost; one that the function changes is `inout`")
                    .suggest("leave it out", token.span, "")
            });
        }
    }

    /// Reports `: NAME` after a declared name: a semantic or a register of HLSL, or a type.
    pub(super) fn refuse_semantic(&mut self) {
        if !self.at(Punctuator::Colon) || self.peek_at(1).kind != TokenKind::Name {
            return;
        }
        let colon = self.bump();
        self.bump();
        if self.at(Punctuator::LeftParenthesis) {
            self.position = self.after_closing(self.position);
        }
        let span = colon.span.to(self.previous_span());
        self.complain_foreign(
            "a `:` after the name that is declared",
            span,
            "not available here",
            "leave out semantics and registers of HLSL; a type is written before the name",
        );
    }
}

/// The advice for types with arguments.
fn type_advice(name: &str) -> &'static str {
    match name {
        "ConstantBuffer" | "ParameterBlock" => "declare each value as a member: `public float x;`",
        _ if name.starts_with("Texture") || name.starts_with("RWTexture") => {
            "declare a `public rt_Texture` member and call its `lookup(uv)`"
        }
        _ if name.ends_with("Buffer") => {
            "an unsized array is read-only data that the host sets: `public float values[];`"
        }
        "vector" | "array" => "arrays have a size that is known: `float values[4];`",
        _ => "write the type itself; parameters of functions may be of type `genType`",
    }
}

// Expressions.
impl Parser<'_> {
    /// True at `->` and a name, after an operand.
    pub(super) fn at_arrow(&self) -> bool {
        self.at(Punctuator::Minus)
            && self.peek_at(1).is(Punctuator::Greater)
            && self.peek_at(2).kind == TokenKind::Name
    }

    /// Reports `->` and consumes its first token; the second stands for the dot.
    pub(super) fn refuse_arrow(&mut self) {
        let arrow = self.bump().span.to(self.peek().span);
        let diagnostic = Diagnostic::new(codes::FOREIGN_SYNTAX, "RTSL has no `->`")
            .at(arrow, "not an operator")
            .suggest("write instead", arrow, ".");
        self.diagnostics.push(diagnostic);
    }

    /// Reports and skips `(float)` in front of an operand, or `static_cast<float>` in front of a parenthesis.
    /// Returns false if none begins here.
    pub(super) fn refuse_cast(&mut self) -> bool {
        let first = self.peek();
        let (ty, end) = if self.is_c_cast() {
            (self.peek_at(1), self.position + 3)
        } else if first.kind == TokenKind::Name
            && self.text(first).ends_with("_cast")
            && self.peek_at(1).is(Punctuator::Less)
            && let Some(end) = self.after_type_arguments(self.position + 1)
            && self.tokens[end].is(Punctuator::LeftParenthesis)
        {
            (self.peek_at(2), end)
        } else {
            return false;
        };
        let help = format!("constructors convert: `{}(...)`", shorten(self.text(ty)));
        let span = first.span.to(self.tokens[end - 1].span);
        self.complain_foreign("RTSL has no casts", span, "a cast", help);
        self.position = end;
        true
    }

    /// True at `(type)` and an operand.
    fn is_c_cast(&self) -> bool {
        let (ty, after) = (self.peek_at(1), self.peek_at(3));
        if !self.at(Punctuator::LeftParenthesis)
            || !self.peek_at(2).is(Punctuator::RightParenthesis)
        {
            return false;
        }
        let begins_operand = matches!(after.kind, TokenKind::Number)
            || matches!(self.word_of(after), Some(Word::Plain | Word::Type));
        match self.word_of(ty) {
            Some(Word::Plain) => begins_operand && !after.starts_line,
            _ => {
                let sign = after.is(Punctuator::LeftParenthesis) || after.is(Punctuator::Minus);
                self.names_type(ty) && (begins_operand || sign)
            }
        }
    }
}

// Statements and declarations.
impl Parser<'_> {
    /// True at an attribute such as `[unroll]`. No statement or declaration begins so, but for annotations.
    pub(super) fn at_attribute(&self) -> bool {
        let after = self.peek_at(2);
        let is_listed = [Punctuator::RightBracket, Punctuator::LeftParenthesis, Punctuator::Comma];
        self.at(Punctuator::LeftBracket)
            && (self.peek_at(1).is(Punctuator::LeftBracket)
                || self.peek_at(1).kind == TokenKind::Name
                    && is_listed.iter().any(|each| after.is(*each)))
    }

    /// Reports and skips an attribute: `[unroll]`, `[[likely]]`, `[numthreads(8, 8, 1)]`.
    pub(super) fn refuse_attribute(&mut self) {
        let open = self.peek();
        let inner = usize::from(self.peek_at(1).is(Punctuator::LeftBracket));
        let name = self.text(self.peek_at(1 + inner));
        let (is_known, help) = match name {
            "unroll" | "loop" | "branch" | "flatten" | "fastopt" | "likely" | "unlikely" => {
                (true, "leave it out: the compiler chooses how it compiles loops and branches")
            }
            "numthreads" | "shader" | "maxvertexcount" => {
                (true, "leave it out: hosts call the interface methods of a class")
            }
            _ => (false, "annotations, in `[[...]]`, belong to members and parameters"),
        };
        let message = match is_known {
            true => format!("RTSL has no attribute `{name}`"),
            false => "an annotation where nothing takes one".to_owned(),
        };
        self.position = self.after_closing(self.position);
        let span = open.span.to(self.previous_span());
        self.complain_foreign(message, span, "not available here", help);
    }

    /// Reports `for (float x : list)`.
    pub(super) fn refuse_range(&mut self) -> Reported {
        let colon = self.peek();
        let diagnostic = Diagnostic::new(codes::FOREIGN_SYNTAX, "RTSL has no loops over elements")
            .at(colon.span, "not available here")
            .help("count: `for (int i = 0; i < values.length(); ++i)`");
        self.report(diagnostic)
    }

    /// Reports a constant buffer of HLSL, which is skipped.
    pub(super) fn refuse_constant_buffer(&mut self) -> Parse<()> {
        let token = self.peek();
        let begins = self.word_of(token) == Some(Word::Plain)
            && ["cbuffer", "tbuffer"].contains(&self.text(token))
            && self.peek_at(1).kind == TokenKind::Name;
        if !begins {
            return Ok(());
        }
        let message = format!("RTSL has no `{}`", self.text(token));
        let diagnostic = Diagnostic::new(codes::FOREIGN_SYNTAX, message)
            .at(token.span, "not available here")
            .help("declare each field as a member of a class: `public float x = 1.0;`");
        Err(self.report(diagnostic))
    }

    /// Reports `public:` and `private:`, which hold for all members up to the next in C++. Returns false if none is
    /// next.
    pub(super) fn refuse_access_label(&mut self, help: &str) -> bool {
        let is_access = matches!(self.peek_keyword(), Some(Keyword::Public | Keyword::Private))
            && self.peek_at(1).is(Punctuator::Colon);
        if is_access {
            let word = self.bump();
            let message = format!("RTSL has no label `{}:`", self.text(word));
            let span = word.span.to(self.bump().span);
            self.complain_foreign(message, span, "not available here", help);
        }
        is_access
    }

    /// Reports a declaration of an operator: `vec3 operator+(vec3 a, vec3 b)`.
    pub(super) fn refuse_operator(&mut self, name: &Identifier) -> Parse<()> {
        let allowed = [
            Punctuator::Assign,
            Punctuator::Comma,
            Punctuator::LeftBracket,
            Punctuator::LeftParenthesis,
            Punctuator::Semicolon,
        ];
        let next = self.peek();
        let is_operator = matches!(next.kind, TokenKind::Punctuator(it) if !allowed.contains(&it));
        if name.name != "operator" || !is_operator {
            return Ok(());
        }
        let diagnostic = Diagnostic::new(codes::FOREIGN_SYNTAX, "operators cannot be declared")
            .at(name.span.to(next.span), "not available here")
            .help("declare a function with a name, such as `add`");
        Err(self.report(diagnostic))
    }
}

// Structs.
impl Parser<'_> {
    /// Reports the bases of a struct.
    pub(super) fn refuse_bases_of_struct(&mut self) {
        if !self.at(Punctuator::Colon) {
            return;
        }
        let colon = self.peek();
        self.complain_foreign(
            "a struct has no bases",
            colon.span,
            "not available here",
            "declare a field whose type is the other struct",
        );
        let ends = |token: Token| {
            [Punctuator::LeftBrace, Punctuator::RightBrace, Punctuator::Semicolon]
                .iter()
                .any(|each| token.is(*each))
        };
        while !self.at_end() && !ends(self.peek()) {
            self.bump();
        }
    }

    /// Reports and skips a constructor or a destructor in the struct of this name. Returns false if none is next.
    pub(super) fn refuse_constructor_of_struct(&mut self, structure: &str) -> bool {
        let before = self.position;
        let distance = usize::from(self.at(Punctuator::Tilde));
        let name = self.peek_at(distance);
        let is_own = name.kind == TokenKind::Name && self.text(name) == structure;
        if !is_own || !self.peek_at(distance + 1).is(Punctuator::LeftParenthesis) {
            return false;
        }
        let structure = shorten(structure);
        let help = format!(
            "`{structure}(...)` takes the values of all fields in their order; for others, write a function that \
             returns a `{structure}`"
        );
        self.complain_foreign(
            "a struct has no constructors",
            name.span,
            "not available here",
            help,
        );
        self.position += distance + 1;
        self.skip_function();
        self.note_skipped(before);
        true
    }

    /// Reports and skips a method `name` in the struct of this name, from its parenthesis. Returns false if a field
    /// was declared.
    pub(super) fn refuse_method_of_struct(&mut self, structure: &str, name: &Identifier) -> bool {
        if !self.at(Punctuator::LeftParenthesis) {
            return false;
        }
        let before = self.position;
        let (structure, method) = (shorten(structure), shorten(&name.name));
        let help = format!(
            "write a function after the struct, `{method}({structure} self, ...)`, and call it as \
             `{method}(value, ...)`; a function that changes the struct takes it as `inout`"
        );
        self.complain_foreign("a struct has no methods", name.span, "not available here", help);
        self.skip_function();
        self.note_skipped(before);
        true
    }

    /// Skips parameters, of which the parenthesis is next, and the body.
    fn skip_function(&mut self) {
        self.position = self.after_closing(self.position);
        self.recover_statement();
    }
}
