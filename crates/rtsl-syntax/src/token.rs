//! Tokens, which the lexer produces and the preprocessor and parser consume.

use rtsl_source::{Code, Diagnostic, Span, diagnostic_codes};

use crate::message::shorten;
use crate::symbol::Symbol;

/// A token. Copies are cheap: the spelling is interned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token {
    pub kind: TokenKind,
    /// The text with line continuations removed.
    pub spelling: Symbol,
    /// The span in the source; for tokens from a macro, that of the macro's invocation.
    pub span: Span,
    /// True if it is the first token of its line, so that a `#` begins a directive.
    pub starts_line: bool,
    /// True if white space precedes it.
    pub spaced: bool,
    /// True if an invalid token before it was reported. A parse error here is then probably a
    /// consequence and is not reported.
    pub after_invalid: bool,
    /// True for a macro's name met inside the macro's own expansion, which is never expanded again.
    pub painted: bool,
}

impl Token {
    /// True if the token is the punctuator `punctuator`.
    pub fn is(&self, punctuator: Punctuator) -> bool {
        self.kind == TokenKind::Punctuator(punctuator)
    }
}

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TokenKind {
    /// A word: a name or a keyword.
    Name,
    /// A number, its form not yet checked.
    Number,
    /// Double-quoted text, including the quotes.
    Text,
    Punctuator(Punctuator),
    /// Text that is not a token; an error only if it is not skipped.
    Invalid(LexicalError),
    /// The end of the translation unit.
    End,
}

/// The reason why a piece of text is not a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LexicalError {
    UnexpectedCharacter,
    NonAsciiCharacter,
    /// A word with letters outside ASCII, which the spelling contains.
    NonAsciiName,
    UnterminatedComment,
    UnterminatedText,
}

impl LexicalError {
    /// The code of the diagnostic for this error.
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

    /// The diagnostic for this error in `text`, which lies at `span`.
    pub fn diagnostic(self, span: Span, text: &str) -> Diagnostic {
        let shown = shorten(text);
        let new = |message: String| Diagnostic::new(self.code(), message);
        match self {
            LexicalError::UnexpectedCharacter => {
                new(format!("unexpected character `{shown}`")).at(span, "no token begins with this")
            }
            LexicalError::NonAsciiCharacter | LexicalError::NonAsciiName => match look_alike(text) {
                Some((name, instead)) => new(format!("`{shown}` is {name}, which is not ASCII"))
                    .at(span, "outside a comment")
                    .suggest("write the character of the keyboard", span, instead),
                None => new(format!("`{shown}` is not ASCII")).at(span, "outside a comment").note(
                    "names are ASCII as in GLSL; other characters may appear in comments and in \
                     the text of annotations",
                ),
            },
            LexicalError::UnterminatedComment => new("a comment that never ends".to_string())
                .at(Span { end: span.start + 2, ..span }, "begins here")
                .note("comments do not nest: the first `*/` ends a comment"),
            LexicalError::UnterminatedText => {
                new("text without its closing quotation mark".to_string())
                    .at(span, "begins here")
                    .suggest("add the mark", span.after(), "\"")
            }
        }
    }
}

/// The name of a character that looks like a token, or stands for one in mathematics, and the token. Word processors
/// and web pages write such characters.
fn look_alike(text: &str) -> Option<(&'static str, &'static str)> {
    Some(match text {
        "\u{2010}" | "\u{2011}" => ("a hyphen", "-"),
        "\u{2012}" | "\u{2013}" => ("an en dash", "-"),
        "\u{2014}" | "\u{2015}" => ("an em dash", "-"),
        "\u{2212}" => ("a minus sign", "-"),
        "\u{201c}" | "\u{201d}" | "\u{201e}" => ("a typographic quotation mark", "\""),
        "\u{d7}" | "\u{22c5}" | "\u{b7}" | "\u{2217}" => ("a multiplication sign", "*"),
        "\u{f7}" => ("a division sign", "/"),
        "\u{2215}" | "\u{2044}" => ("a slash of mathematics", "/"),
        "\u{2264}" => ("a sign of mathematics", "<="),
        "\u{2265}" => ("a sign of mathematics", ">="),
        "\u{2260}" => ("a sign of mathematics", "!="),
        "\u{a0}" | "\u{2007}" | "\u{202f}" => ("a space that does not break", " "),
        "\u{200b}" | "\u{feff}" => ("a space without width", ""),
        "\u{ff0c}" => ("a fullwidth comma", ","),
        "\u{ff1b}" => ("a fullwidth semicolon", ";"),
        "\u{ff08}" => ("a fullwidth parenthesis", "("),
        "\u{ff09}" => ("a fullwidth parenthesis", ")"),
        _ => return None,
    })
}

macro_rules! punctuators {
    ($($name:ident $text:literal)*) => {
        /// Operators and delimiters.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum Punctuator { $($name),* }

        impl Punctuator {
            /// All punctuators, longest first, so that the first match is the right one.
            pub const ALL: &'static [Punctuator] = &[$(Punctuator::$name),*];

            /// The punctuator as it is written.
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
