//! Tokens, as the lexer makes them and the preprocessor and parser read them.

use rtsl_source::{Code, Span, diagnostic_codes};

use crate::symbol::Symbol;

/// A token. Copies are cheap: the spelling is interned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token {
    pub kind: TokenKind,
    /// The text with line continuations removed.
    pub spelling: Symbol,
    /// Where the author wrote it; for what a macro made, the macro's invocation.
    pub span: Span,
    /// Whether it is the first of its line, so that a `#` begins a directive.
    pub starts_line: bool,
    /// Whether white space stands before it.
    pub spaced: bool,
    /// Whether something before it was reported as no token: what the parser would say of it is
    /// probably that one's fault.
    pub after_invalid: bool,
    /// A macro's name met inside the macro's own expansion: never expanded again.
    pub painted: bool,
}

impl Token {
    /// Whether it is the punctuator `punctuator`.
    pub fn is(&self, punctuator: Punctuator) -> bool {
        self.kind == TokenKind::Punctuator(punctuator)
    }
}

/// The kinds of token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TokenKind {
    /// A word: a name or a keyword.
    Name,
    /// A number, its form not yet checked.
    Number,
    /// Double-quoted text, quotes included.
    Text,
    Punctuator(Punctuator),
    /// What is no token; an error only where it is not skipped.
    Invalid(LexicalError),
    /// The end of the translation unit.
    End,
}

/// Why a piece of text is no token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LexicalError {
    UnexpectedCharacter,
    NonAsciiCharacter,
    /// A word with letters outside ASCII; the spelling holds it.
    NonAsciiName,
    UnterminatedComment,
    UnterminatedText,
}

impl LexicalError {
    /// The code that reports it.
    pub fn code(self) -> Code {
        match self {
            LexicalError::UnexpectedCharacter => diagnostic_codes::UNEXPECTED_CHARACTER,
            LexicalError::NonAsciiCharacter | LexicalError::NonAsciiName => {
                diagnostic_codes::NON_ASCII_CHARACTER
            }
            LexicalError::UnterminatedComment => diagnostic_codes::UNTERMINATED_COMMENT,
            LexicalError::UnterminatedText => diagnostic_codes::UNTERMINATED_TEXT,
        }
    }
}

macro_rules! punctuators {
    ($($name:ident $text:literal)*) => {
        /// Operators and delimiters.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum Punctuator { $($name),* }

        impl Punctuator {
            /// Longest first, so that the first match is the right one.
            pub const ALL: &'static [Punctuator] = &[$(Punctuator::$name),*];

            /// As it is written.
            pub const fn text(self) -> &'static str {
                match self { $(Punctuator::$name => $text),* }
            }
        }
    };
}

punctuators! {
    ShiftLeftAssign "<<=" ShiftRightAssign ">>="
    HashHash "##" Increment "++" Decrement "--" ShiftLeft "<<" ShiftRight ">>"
    LessEqual "<=" GreaterEqual ">=" EqualEqual "==" NotEqual "!=" AndAnd "&&" OrOr "||"
    XorXor "^^" MultiplyAssign "*=" DivideAssign "/=" AddAssign "+=" SubtractAssign "-="
    RemainderAssign "%=" AndAssign "&=" XorAssign "^=" OrAssign "|="
    LeftParenthesis "(" RightParenthesis ")" LeftBracket "[" RightBracket "]"
    LeftBrace "{" RightBrace "}" Dot "." Comma "," Colon ":" Semicolon ";" Question "?"
    Assign "=" Bang "!" Minus "-" Tilde "~" Plus "+" Star "*" Slash "/" Percent "%"
    Less "<" Greater ">" Bar "|" Caret "^" Ampersand "&" Hash "#"
}
