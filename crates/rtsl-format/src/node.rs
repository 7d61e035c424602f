//! The structure of a statement's tokens: operators by their precedence, brackets, and words beside each other.

use std::ops::Range;

use rtsl_source::deep_stack;
use rtsl_syntax::raw::RawKind;

use crate::token::Token;

/// The width of what does not fit on any line, because a comment in it ends a line.
pub(crate) const ENDLESS: usize = 1 << 20;

/// A part of a statement.
#[derive(Debug)]
pub(crate) struct Node {
    /// The part's structure.
    pub kind: NodeKind,
    /// The number of columns on one line; at least [`ENDLESS`] if it cannot stand on one.
    pub width: usize,
}

/// The structures. Tokens are given by their indices.
#[derive(Debug)]
pub(crate) enum NodeKind {
    /// One token.
    Token(usize),
    /// Parts with a blank between them: `public float a`, `return x`.
    Words(Vec<Node>),
    /// Operators before their operand.
    Prefix(Vec<usize>, Box<Node>),
    /// Parts without a blank between them: `f(x)[1].y++`.
    Adjacent(Vec<Node>),
    /// Operands with operators of one precedence between them.
    Chain(Box<Node>, Vec<(usize, Node)>),
    /// `condition ? first : second`
    Conditional {
        condition: Box<Node>,
        question: usize,
        first: Box<Node>,
        colon: usize,
        second: Box<Node>,
    },
    /// `target = value`
    Assign { target: Box<Node>, operator: usize, value: Box<Node> },
    /// Parts with separators after them: commas, or the semicolons of `for`.
    List(Vec<Element>),
    /// Brackets and what they contain.
    Group { open: usize, content: Option<Box<Node>>, close: usize },
}

/// A part of a list, and the separator after it. One of both may be absent.
#[derive(Debug)]
pub(crate) struct Element {
    /// The part.
    pub node: Option<Node>,
    /// The separator.
    pub separator: Option<usize>,
}

impl Element {
    /// The number of columns of both.
    pub fn width(&self, tokens: &[Token<'_>]) -> usize {
        let node = self.node.as_ref().map_or(0, |node| node.width);
        node + self.separator.map_or(0, |separator| width_of(tokens, separator))
    }
}

/// Returns the structure of these tokens; `None` if operators are nested deeper than the compiler accepts.
pub(crate) fn parse(tokens: &[Token<'_>], range: Range<usize>) -> Option<Node> {
    let first = range.start;
    let mut parser = Parser {
        tokens,
        position: first,
        end: range.end,
        first,
        last: range.end.saturating_sub(1),
        depth: 0,
        open_conditionals: 0,
        is_too_deep: false,
    };
    let node = parser.list();
    (!parser.is_too_deep).then_some(node)
}

/// The number of columns of a token with the comments beside it that are on its line.
pub(crate) fn width_of(tokens: &[Token<'_>], index: usize) -> usize {
    let token = &tokens[index];
    if token.ends_lines() || token.text.contains('\n') {
        return ENDLESS;
    }
    let comments: usize = token.before.iter().map(|trivia| columns(trivia.text) + 1).sum();
    comments + columns(token.text)
}

/// The number of columns of a text of one line.
pub(crate) fn columns(text: &str) -> usize {
    text.chars().count()
}

struct Parser<'t, 'a> {
    tokens: &'t [Token<'a>],
    position: usize,
    /// The end of the tokens of the statement, or of the innermost brackets.
    end: usize,
    /// The first token of the statement: the comments before it are not part of the statement.
    first: usize,
    /// The last token of the statement.
    last: usize,
    depth: usize,
    /// The number of `?` whose `:` is still to come, in the innermost brackets.
    open_conditionals: usize,
    is_too_deep: bool,
}

impl<'t, 'a> Parser<'t, 'a> {
    fn peek(&self) -> Option<&'t Token<'a>> {
        (self.position < self.end).then(|| &self.tokens[self.position])
    }

    fn at(&self, text: &str) -> bool {
        self.peek().is_some_and(|token| token.is(text))
    }

    fn bump(&mut self) -> usize {
        self.position += 1;
        self.position - 1
    }

    /// Parses parts with separators, up to the end.
    fn list(&mut self) -> Node {
        let mut elements: Vec<Element> = Vec::new();
        while self.position < self.end {
            let is_separator = self.at(",") || self.at(";");
            let node = if is_separator { None } else { Some(self.assignment()) };
            let separator = (self.at(",") || self.at(";")).then(|| self.bump());
            elements.push(Element { node, separator });
        }
        match elements.as_mut_slice() {
            [Element { node, separator: None }] if node.is_some() => {
                node.take().unwrap_or_else(|| self.node(NodeKind::Words(Vec::new())))
            }
            _ => self.node(NodeKind::List(elements)),
        }
    }

    fn assignment(&mut self) -> Node {
        self.nested(|this| {
            let target = this.conditional();
            let operator = this.peek().filter(|token| is_assignment(token));
            if operator.is_none() {
                return target;
            }
            let operator = this.bump();
            let value = Box::new(this.assignment());
            this.node(NodeKind::Assign { target: Box::new(target), operator, value })
        })
    }

    fn conditional(&mut self) -> Node {
        let condition = self.chain(0);
        if !self.at("?") {
            return condition;
        }
        let question = self.bump();
        self.open_conditionals += 1;
        let first = Box::new(self.assignment());
        self.open_conditionals -= 1;
        if !self.at(":") {
            let rest = vec![(question, *first)];
            return self.node(NodeKind::Chain(Box::new(condition), rest));
        }
        let colon = self.bump();
        let second = Box::new(self.assignment());
        let condition = Box::new(condition);
        self.node(NodeKind::Conditional { condition, question, first, colon, second })
    }

    /// Parses operands with operators between them that bind at least as tightly as `min`.
    fn chain(&mut self, min: u8) -> Node {
        let mut left = self.operand();
        while let Some(binding) = self.binding().filter(|binding| *binding >= min) {
            let mut links = Vec::new();
            while self.binding() == Some(binding) {
                let operator = self.bump();
                links.push((operator, self.nested(|this| this.chain(binding + 1))));
            }
            left = self.node(NodeKind::Chain(Box::new(left), links));
        }
        left
    }

    fn binding(&self) -> Option<u8> {
        let token = self.peek().filter(|token| token.kind == RawKind::Punctuator)?;
        Some(match token.text {
            // Between a class and its bases.
            ":" if self.open_conditionals == 0 => 1,
            "||" => 4,
            "^^" => 5,
            "&&" => 6,
            "|" => 7,
            "^" => 8,
            "&" => 9,
            "==" | "!=" => 10,
            "<" | ">" | "<=" | ">=" => 11,
            "<<" | ">>" => 12,
            "+" | "-" => 13,
            "*" | "/" | "%" => 14,
            "##" => 15,
            _ => return None,
        })
    }

    /// Parses words beside each other, each with the operators before and after it.
    fn operand(&mut self) -> Node {
        let mut words = vec![self.word()];
        while self.peek().is_some_and(|token| self.continues(token)) {
            words.push(self.word());
        }
        match words.len() {
            1 => words.swap_remove(0),
            _ => self.node(NodeKind::Words(words)),
        }
    }

    /// True at a token that stands beside the operand before it.
    fn continues(&self, token: &Token<'_>) -> bool {
        if token.kind != RawKind::Punctuator {
            return true;
        }
        let after_keyword = self.tokens[self.position - 1].kind == RawKind::Keyword;
        match token.text {
            "(" | "[" | "{" => true,
            "-" | "+" | "!" | "~" | "++" | "--" => after_keyword,
            _ => false,
        }
    }

    fn word(&mut self) -> Node {
        let mut operators = Vec::new();
        while self.peek().is_some_and(|token| is_prefix(token)) {
            operators.push(self.bump());
        }
        if self.position >= self.end {
            let tokens = operators.into_iter().map(|index| self.token(index)).collect();
            return self.node(NodeKind::Adjacent(tokens));
        }
        let operand = self.postfix();
        if operators.is_empty() {
            return operand;
        }
        self.node(NodeKind::Prefix(operators, Box::new(operand)))
    }

    /// Parses a token or brackets, with calls, indices, fields and steps after it.
    fn postfix(&mut self) -> Node {
        let is_word = self.peek().is_some_and(|token| token.kind != RawKind::Keyword);
        let first = self.primary();
        let is_braces =
            matches!(&first.kind, NodeKind::Group { open, .. } if self.tokens[*open].is("{"));
        // `[[min 0]] float`: brackets before which nothing stands take nothing after them.
        let is_annotation =
            matches!(&first.kind, NodeKind::Group { open, .. } if self.tokens[*open].is("["));
        let mut parts = vec![first];
        let takes_parts = is_word && !is_braces && !is_annotation;
        while let Some(token) = self.peek().filter(|_| takes_parts) {
            match token.text {
                "(" | "[" => {
                    let group = self.group();
                    parts.push(group);
                }
                "." => {
                    let dot = self.bump();
                    parts.push(self.token(dot));
                    if self.position < self.end {
                        let name = self.bump();
                        parts.push(self.token(name));
                    }
                }
                "++" | "--" => {
                    let step = self.bump();
                    parts.push(self.token(step));
                }
                _ => break,
            }
        }
        match parts.len() {
            1 => parts.swap_remove(0),
            _ => self.node(NodeKind::Adjacent(parts)),
        }
    }

    fn primary(&mut self) -> Node {
        if self.at("(") || self.at("[") || self.at("{") {
            return self.group();
        }
        let index = self.bump();
        self.token(index)
    }

    fn group(&mut self) -> Node {
        let open = self.bump();
        let close = self.closing(open);
        let outer = std::mem::replace(&mut self.end, close);
        let conditionals = std::mem::take(&mut self.open_conditionals);
        let is_annotation = self.tokens[open].is("[")
            && (self.at("[") || open > 0 && self.tokens[open - 1].is("["));
        let content = (self.position < close).then(|| {
            Box::new(
                self.nested(|this| if is_annotation { this.annotations() } else { this.list() }),
            )
        });
        self.end = outer;
        self.open_conditionals = conditionals;
        self.position = (close + 1).min(outer);
        self.node(NodeKind::Group { open, content, close })
    }

    /// Parses `key value, key value`. A value may begin with a sign, which is no operator between key and value.
    fn annotations(&mut self) -> Node {
        if self.at("[") {
            return self.list();
        }
        let mut elements = Vec::new();
        while self.position < self.end {
            let mut words = Vec::new();
            if !self.at(",") {
                let key = self.bump();
                words.push(self.token(key));
            }
            if self.position < self.end && !self.at(",") {
                words.push(self.assignment());
            }
            let node = (!words.is_empty()).then(|| self.node(NodeKind::Words(words)));
            let separator = self.at(",").then(|| self.bump());
            elements.push(Element { node, separator });
        }
        self.node(NodeKind::List(elements))
    }

    /// The index of the bracket that closes the one at `open`, before the end.
    fn closing(&self, open: usize) -> usize {
        let mut nesting = 0;
        for (offset, token) in self.tokens[open..self.end].iter().enumerate() {
            match token.text {
                "(" | "[" | "{" => nesting += 1,
                ")" | "]" | "}" => {
                    nesting -= 1;
                    if nesting == 0 {
                        return open + offset;
                    }
                }
                _ => {}
            }
        }
        self.end
    }

    /// Parses one level deeper; at the limit the rest becomes words.
    fn nested(&mut self, parse: impl FnOnce(&mut Self) -> Node) -> Node {
        if self.depth >= deep_stack::depth() {
            self.is_too_deep = true;
            let rest = self.position..self.end;
            self.position = self.end;
            let tokens = rest.map(|index| self.token(index)).collect();
            return self.node(NodeKind::Words(tokens));
        }
        self.depth += 1;
        let node = parse(self);
        self.depth -= 1;
        node
    }

    fn token(&self, index: usize) -> Node {
        let token = &self.tokens[index];
        // The comments before the statement and after it do not make it longer.
        let ends_inside = token.after.is_some() && index != self.last;
        let width = match index == self.first {
            _ if ends_inside || token.text.contains('\n') => ENDLESS,
            true => columns(token.text),
            false if token.after.is_some() && token.before.is_empty() => columns(token.text),
            false => width_of(self.tokens, index),
        };
        Node { kind: NodeKind::Token(index), width }
    }

    fn width(&self, index: usize) -> usize {
        self.token(index).width
    }

    fn node(&self, kind: NodeKind) -> Node {
        let sum = |nodes: &[Node]| nodes.iter().map(|node| node.width).sum::<usize>();
        let width = match &kind {
            NodeKind::Token(index) => self.width(*index),
            NodeKind::Words(words) => sum(words) + words.len().saturating_sub(1),
            NodeKind::Prefix(operators, operand) => {
                operators.iter().map(|index| self.width(*index)).sum::<usize>() + operand.width
            }
            NodeKind::Adjacent(parts) => sum(parts),
            NodeKind::Chain(first, links) => {
                let each =
                    |(operator, node): &(usize, Node)| self.width(*operator) + node.width + 2;
                first.width + links.iter().map(each).sum::<usize>()
            }
            NodeKind::Conditional { condition, question, first, colon, second } => {
                let operators = self.width(*question) + self.width(*colon) + 4;
                condition.width + first.width + second.width + operators
            }
            NodeKind::Assign { target, operator, value } => {
                target.width + self.width(*operator) + value.width + 2
            }
            NodeKind::List(elements) => {
                let widths = elements.iter().map(|element| element.width(self.tokens));
                widths.sum::<usize>() + elements.len().saturating_sub(1)
            }
            NodeKind::Group { open, content, close } => {
                let blanks = if self.tokens[*open].is("{") && content.is_some() { 2 } else { 0 };
                let close = if *close < self.tokens.len() { self.width(*close) } else { 0 };
                self.width(*open) + content.as_ref().map_or(0, |node| node.width) + close + blanks
            }
        };
        Node { kind, width: width.min(ENDLESS) }
    }
}

fn is_assignment(token: &Token<'_>) -> bool {
    let operators = ["=", "+=", "-=", "*=", "/=", "%=", "<<=", ">>=", "&=", "^=", "|="];
    token.kind == RawKind::Punctuator && operators.contains(&token.text)
}

fn is_prefix(token: &Token<'_>) -> bool {
    token.kind == RawKind::Punctuator && matches!(token.text, "-" | "+" | "!" | "~" | "++" | "--")
}
