//! The statements and declarations of a text, found by brackets, semicolons and keywords alone, so that texts with
//! macros, which the parser sees only when they are expanded, have them too.

use std::ops::Range;

use rtsl_source::deep_stack;
use rtsl_syntax::raw::RawKind;

use crate::token::Token;

/// A statement, declaration or label.
#[derive(Debug)]
pub(crate) enum Item {
    /// Tokens up to a semicolon.
    Simple(Range<usize>),
    /// `case 1:`, `default:`.
    Label(Range<usize>),
    /// A block, with the head of a function, struct or class.
    Block(Block),
    /// `if`, `for`, `while`, `switch`, `illuminance`.
    Control(Control),
    /// `do body while (condition);`
    DoWhile {
        /// The index of `do`.
        keyword: usize,
        /// The body.
        body: Box<Item>,
        /// The tokens from `while` to the semicolon.
        tail: Range<usize>,
    },
}

/// `head { items } tail`
#[derive(Debug)]
pub(crate) struct Block {
    /// The tokens before the brace.
    pub head: Range<usize>,
    /// The index of `{`.
    pub open: usize,
    /// The contents.
    pub contents: Contents,
    /// The index of `}`.
    pub close: usize,
    /// The semicolon after the block, or the declarators of a struct.
    pub tail: Range<usize>,
}

/// The contents of a block.
#[derive(Debug)]
pub(crate) enum Contents {
    /// Statements or declarations.
    Items(Vec<Item>),
    /// The choices of an enumeration.
    Choices(Range<usize>),
}

/// A head in front of a statement.
#[derive(Debug)]
pub(crate) struct Control {
    /// The keyword and its parentheses.
    pub head: Range<usize>,
    /// The statement.
    pub body: Box<Item>,
    /// The index of `else`, and the statement after it.
    pub otherwise: Option<(usize, Box<Item>)>,
}

impl Item {
    /// The index of the first token.
    pub fn first(&self) -> usize {
        match self {
            Item::Simple(range) | Item::Label(range) => range.start,
            Item::Block(block) if block.head.is_empty() => block.open,
            Item::Block(block) => block.head.start,
            Item::Control(control) => control.head.start,
            Item::DoWhile { keyword, .. } => *keyword,
        }
    }

    /// True for a block without a head: the body of a control statement.
    pub fn as_body(&self) -> Option<&Block> {
        match self {
            Item::Block(block) if block.head.is_empty() => Some(block),
            _ => None,
        }
    }
}

/// Returns the items of a text; `None` if statements are nested deeper than the compiler accepts.
pub(crate) fn items(tokens: &[Token<'_>]) -> Option<Vec<Item>> {
    let mut reader = Reader { tokens, position: 0, depth: 0, is_too_deep: false };
    let items = reader.items();
    (!reader.is_too_deep).then_some(items)
}

struct Reader<'t, 'a> {
    tokens: &'t [Token<'a>],
    position: usize,
    depth: usize,
    is_too_deep: bool,
}

impl<'t, 'a> Reader<'t, 'a> {
    fn peek(&self) -> &'t Token<'a> {
        self.at(self.position)
    }

    fn at(&self, index: usize) -> &'t Token<'a> {
        &self.tokens[index.min(self.tokens.len() - 1)]
    }

    /// Reads items up to a `}` or the end.
    fn items(&mut self) -> Vec<Item> {
        let mut items = Vec::new();
        while !self.peek().is_end() && !self.peek().is("}") {
            items.push(self.item());
        }
        items
    }

    fn item(&mut self) -> Item {
        if self.depth >= deep_stack::depth() {
            self.is_too_deep = true;
        }
        if self.is_too_deep {
            let rest = self.position..self.tokens.len() - 1;
            self.position = rest.end;
            return Item::Simple(rest);
        }
        self.depth += 1;
        let item = match self.peek().text {
            "if" | "for" | "while" | "switch" | "illuminance" => self.control(),
            "do" => self.do_while(),
            "case" | "default" => self.label(),
            _ => self.simple_or_block(),
        };
        self.depth -= 1;
        item
    }

    fn control(&mut self) -> Item {
        let start = self.position;
        let is_if = self.peek().is("if");
        self.position += 1;
        if self.peek().is("(") {
            self.position = self.after_closing(self.position);
        }
        let head = start..self.position;
        let body = Box::new(self.body());
        let mut otherwise = None;
        if is_if && self.peek().is("else") {
            let index = self.position;
            self.position += 1;
            otherwise = Some((index, Box::new(self.body())));
        }
        Item::Control(Control { head, body, otherwise })
    }

    /// Reads the statement after a head; an empty one where the text has none.
    fn body(&mut self) -> Item {
        if self.peek().is_end() || self.peek().is("}") {
            return Item::Simple(self.position..self.position);
        }
        self.item()
    }

    fn do_while(&mut self) -> Item {
        let keyword = self.position;
        self.position += 1;
        let body = Box::new(self.body());
        let start = self.position;
        if self.peek().is("while") {
            self.position += 1;
            if self.peek().is("(") {
                self.position = self.after_closing(self.position);
            }
            if self.peek().is(";") {
                self.position += 1;
            }
        }
        Item::DoWhile { keyword, body, tail: start..self.position }
    }

    /// Reads `case value:`. Colons of conditionals in the value do not end it.
    fn label(&mut self) -> Item {
        let start = self.position;
        let mut questions = 0;
        while !self.peek().is_end() && !matches!(self.peek().text, ";" | "{" | "}") {
            match self.peek().text {
                "(" | "[" => {
                    self.position = self.after_closing(self.position);
                    continue;
                }
                "?" => questions += 1,
                ":" if questions == 0 => {
                    self.position += 1;
                    break;
                }
                ":" => questions -= 1,
                _ => {}
            }
            self.position += 1;
        }
        Item::Label(start..self.position.max(start + 1))
    }

    fn simple_or_block(&mut self) -> Item {
        let start = self.position;
        let call_end = self.call_end(start);
        let mut has_value = false;
        loop {
            let token = self.peek();
            let is_first = self.position == start;
            if token.is_end() || token.is("}") || (!is_first && self.begins_another(call_end)) {
                return Item::Simple(start..self.position);
            }
            match token.text {
                ";" => {
                    self.position += 1;
                    return Item::Simple(start..self.position);
                }
                "{" if !has_value => return self.block(start),
                "(" | "[" | "{" => self.position = self.after_closing(self.position),
                text => {
                    has_value |= text == "=";
                    self.position += 1;
                }
            }
        }
    }

    /// The end of the call of a function or macro with which an item begins.
    fn call_end(&self, start: usize) -> Option<usize> {
        let is_call = self.at(start).kind == RawKind::Name && self.at(start + 1).is("(");
        is_call.then(|| self.after_closing(start + 1))
    }

    /// True at a token that begins another item though no semicolon ends the one before: a keyword that only begins
    /// items, or whatever follows the call of a macro on the next line.
    fn begins_another(&self, call_end: Option<usize>) -> bool {
        let token = self.peek();
        if call_end == Some(self.position) {
            let kinds = [RawKind::Keyword, RawKind::Type, RawKind::Name];
            return token.newlines_before_all() > 0 && kinds.contains(&token.kind);
        }
        let begins = ["if", "for", "while", "switch", "do", "case", "default", "return", "class"];
        token.kind == RawKind::Keyword && begins.contains(&token.text)
    }

    /// Reads the block after a head that begins at `start`.
    fn block(&mut self, start: usize) -> Item {
        let open = self.position;
        let head = start..open;
        let has = |word| self.tokens[head.clone()].iter().any(|token| token.is(word));
        let has_declarators = has("struct") || has("enum");
        let is_enumeration = has("enum");
        let has_parameters = has("(");
        let contents = if is_enumeration && !has_parameters {
            let close = self.after_closing(open) - 1;
            self.position = close;
            Contents::Choices(open + 1..close)
        } else {
            self.position += 1;
            Contents::Items(self.items())
        };
        let close = self.position;
        self.position = (close + 1).min(self.tokens.len() - 1);
        let tail = self.tail(has_declarators && !has_parameters);
        Item::Block(Block { head, open, contents, close, tail })
    }

    /// Reads the semicolon after a block, and the declarators before it.
    fn tail(&mut self, has_declarators: bool) -> Range<usize> {
        let start = self.position;
        let first = self.peek();
        if first.is(";") {
            self.position += 1;
        } else if has_declarators && first.newlines_before_all() == 0 {
            while !self.peek().is_end() && !self.peek().is("}") {
                self.position += 1;
                if self.at(self.position - 1).is(";") {
                    break;
                }
            }
        }
        start..self.position
    }

    /// The index after the bracket that closes the one at `open`.
    fn after_closing(&self, open: usize) -> usize {
        let mut nesting = 0;
        for (offset, token) in self.tokens[open..].iter().enumerate() {
            match token.text {
                "(" | "[" | "{" => nesting += 1,
                ")" | "]" | "}" => {
                    nesting -= 1;
                    if nesting == 0 {
                        return open + offset + 1;
                    }
                }
                _ => {}
            }
        }
        self.tokens.len() - 1
    }
}
