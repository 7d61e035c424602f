//! The tokens of a shader's text, as parts of it, so that what a translation leaves alone stays as it was written.

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Word,
    Number,
    /// An operator or another mark.
    Mark,
    /// A line of the preprocessor, with those that continue it.
    Directive,
    /// Space or a comment.
    Space,
}

/// A token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token<'a> {
    pub kind: Kind,
    pub text: &'a str,
}

impl Token<'_> {
    /// True if it is this word or mark.
    pub fn is(&self, text: &str) -> bool {
        self.kind != Kind::Directive && self.text == text
    }
}

/// Splits a text. The tokens one after another are the text.
pub fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut rest = text;
    let mut starts_line = true;
    while let Some(first) = rest.chars().next() {
        let (kind, length) = match first {
            '#' if starts_line => (Kind::Directive, directive_length(rest)),
            _ if first.is_whitespace() || rest.starts_with("\\\n") => {
                (Kind::Space, space_length(rest))
            }
            '/' if rest.starts_with("//") => (Kind::Space, line_length(rest)),
            '/' if rest.starts_with("/*") => (Kind::Space, comment_length(rest)),
            _ if is_word(first) && !first.is_ascii_digit() => (Kind::Word, word_length(rest)),
            _ if first.is_ascii_digit() => (Kind::Number, number_length(rest)),
            '.' if rest[1..].starts_with(|c: char| c.is_ascii_digit()) => {
                (Kind::Number, number_length(rest))
            }
            _ => (Kind::Mark, mark_length(rest, first)),
        };
        let (text, after) = rest.split_at(length);
        starts_line = match kind {
            Kind::Space => starts_line || text.contains('\n'),
            Kind::Directive => true,
            _ => false,
        };
        tokens.push(Token { kind, text });
        rest = after;
    }
    tokens
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The length of a word, which may be continued on the next line.
fn word_length(text: &str) -> usize {
    let mut length = 0;
    loop {
        length += text[length..].find(|c| !is_word(c)).unwrap_or(text.len() - length);
        match text[length..].strip_prefix("\\\n") {
            Some(rest) if rest.starts_with(is_word) => length += 2,
            _ => return length,
        }
    }
}

fn mark_length(text: &str, first: char) -> usize {
    const LONG: [&str; 21] = [
        "<<=", ">>=", "<<", ">>", "==", "!=", "<=", ">=", "&&", "||", "^^", "++", "--", "+=", "-=",
        "*=", "/=", "%=", "&=", "|=", "^=",
    ];
    LONG.iter().find(|it| text.starts_with(*it)).map_or(first.len_utf8(), |it| it.len())
}

fn space_length(text: &str) -> usize {
    let mut length = 0;
    loop {
        let rest = &text[length..];
        if rest.starts_with("\\\n") {
            length += 2;
            continue;
        }
        let space = rest.len() - rest.trim_start().len();
        if space == 0 {
            return length;
        }
        length += space;
    }
}

/// The length of a comment, whose end may be continued on the next line.
fn comment_length(text: &str) -> usize {
    let ends = ["*/", "*\\\n/"].iter().filter_map(|end| Some(text[2..].find(end)? + 2 + end.len()));
    ends.min().unwrap_or(text.len())
}

/// The length up to the end of the line, after the lines that a backslash continues it by.
fn line_length(text: &str) -> usize {
    let mut length = 0;
    loop {
        let rest = &text[length..];
        let Some(end) = rest.find('\n') else { return text.len() };
        if !rest[..end].ends_with('\\') {
            return length + end;
        }
        length += end + 1;
    }
}

/// The same for a directive, in which a comment may contain ends of lines.
fn directive_length(text: &str) -> usize {
    let mut length = line_length(text);
    while let Some(start) = text[..length].rfind("/*") {
        let is_line_comment =
            text[..start].rfind("//").is_some_and(|at| !text[at..start].contains('\n'));
        if is_line_comment || text[start..length].contains("*/") {
            break;
        }
        let Some(end) = text[start..].find("*/") else { return text.len() };
        let after = start + end + 2;
        length = after + line_length(&text[after..]);
    }
    length
}

fn number_length(text: &str) -> usize {
    let mut previous = ' ';
    for (at, c) in text.char_indices() {
        let is_sign = matches!(c, '+' | '-') && matches!(previous, 'e' | 'E');
        let is_hexadecimal = text.starts_with("0x") || text.starts_with("0X");
        if !(is_word(c) || c == '.' || (is_sign && !is_hexadecimal)) {
            return at;
        }
        previous = c;
    }
    text.len()
}
