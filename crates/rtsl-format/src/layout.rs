//! The layout of a statement that does not fit on one line.
//!
//! - A chain of operators breaks before an operator whose operand does not fit on the line; where the operand fits on
//!   no line, it breaks inside.
//! - Conditionals break before `?` and `:`.
//! - Arguments that do not fit stand on the next line; on one line each if one line is too short for all, unless they
//!   are short. If only the last does not fit, and those before it are short, the list breaks inside it.
//! - A line is indented by four columns more than the line that has its innermost open bracket, or the statement's
//!   beginning.

use crate::lines::Lines;
use crate::node::{Element, Node, NodeKind};
use crate::token::{Token, Trivia};
use crate::{INDENT, MAX_WIDTH};

/// The greatest width of arguments that share lines with others.
const SHORT: usize = 24;

/// Writes nodes.
pub(crate) struct Layout<'t, 'a> {
    /// The tokens of the text.
    pub tokens: &'t [Token<'a>],
    /// The result.
    pub lines: Lines,
    /// The indentation of continued lines in each open bracket, after that of the statement.
    continued: Vec<usize>,
    /// The token whose comments before it are written.
    begun: Option<usize>,
    /// True if the statement does not fit on its line.
    is_long: bool,
}

impl<'t, 'a> Layout<'t, 'a> {
    /// Creates a layout without lines.
    pub fn new(tokens: &'t [Token<'a>]) -> Self {
        Layout {
            tokens,
            lines: Lines::default(),
            continued: Vec::new(),
            begun: None,
            is_long: false,
        }
    }

    /// Writes a statement from the current line on, so that `tail` more columns fit on its last line.
    pub fn statement(&mut self, node: &Node, tail: usize) {
        let indent = self.lines.indent() + INDENT;
        self.is_long = self.lines.width() + node.width + tail > MAX_WIDTH;
        self.within(indent, |this| this.node(node, tail));
    }

    /// Writes the head of a function with a body, whose parameters are indented more than the body is.
    pub fn head(&mut self, node: &Node, tail: usize) {
        let indent = self.lines.indent() + 2 * INDENT;
        self.within(indent, |this| match (&node.kind, this.fits(node, tail)) {
            (NodeKind::Adjacent(_), false) => this.parameters(node, indent, tail),
            (NodeKind::Words(words), false) => match words.split_last() {
                Some((last, before)) => {
                    for word in before {
                        this.node(word, 0);
                        this.blank();
                    }
                    this.parameters(last, indent, tail);
                }
                None => this.node(node, tail),
            },
            _ => this.node(node, tail),
        });
    }

    /// Writes `name(parameters)`.
    fn parameters(&mut self, node: &Node, indent: usize, tail: usize) {
        let NodeKind::Adjacent(parts) = &node.kind else { return self.node(node, tail) };
        for part in parts {
            match &part.kind {
                NodeKind::Group { open, content: Some(content), close } => {
                    self.token(*open);
                    self.vertical(content, indent, tail + 1);
                    self.token(*close);
                }
                _ => self.node(part, 0),
            }
        }
    }

    /// Notes that the comments before a token are written.
    pub fn set_begun(&mut self, index: usize) {
        self.begun = Some(index);
    }

    /// Writes a token with the comments before and after it.
    pub fn token(&mut self, index: usize) {
        if self.begun != Some(index) {
            self.comments_before(index);
        }
        let token = &self.tokens[index];
        self.continue_line();
        self.lines.push(token.text);
        if let Some(comment) = token.after {
            self.lines.end_with(comment);
        }
    }

    fn comments_before(&mut self, index: usize) {
        let indent = self.continued();
        for trivia in &self.tokens[index].before {
            if trivia.is_inline {
                self.continue_line();
                self.lines.push(trivia.text);
                self.lines.push(" ");
            } else {
                self.lines.begin(if trivia.is_directive { 0 } else { indent });
                self.lines.push(&shifted(trivia, indent));
                self.lines.begin(indent);
            }
        }
    }

    /// Writes a blank, except at the beginning of a line.
    pub fn blank(&mut self) {
        if self.lines.has_text() && !self.lines.is_ended() {
            self.lines.push(" ");
        }
    }

    /// Begins a new line if a comment ends the current one.
    fn continue_line(&mut self) {
        if self.lines.is_ended() {
            self.begin_continued();
        }
    }

    fn within(&mut self, indent: usize, write: impl FnOnce(&mut Self)) {
        self.continued.push(indent);
        write(self);
        self.continued.pop();
    }

    /// The indentation of a continued line.
    fn continued(&self) -> usize {
        self.continued.last().copied().unwrap_or(self.lines.indent())
    }

    fn begin_continued(&mut self) {
        self.lines.begin(self.continued());
    }

    fn fits(&self, node: &Node, tail: usize) -> bool {
        !self.lines.is_ended() && self.lines.width() + node.width + tail <= MAX_WIDTH
    }

    fn fits_alone(&self, node: &Node, before: usize, tail: usize) -> bool {
        self.continued() + before + node.width + tail <= MAX_WIDTH
    }

    fn node(&mut self, node: &Node, tail: usize) {
        match &node.kind {
            NodeKind::Token(index) => self.token(*index),
            NodeKind::Words(words) => self.words(words, tail),
            NodeKind::Prefix(operators, operand) => self.prefix(operators, operand, tail),
            NodeKind::Adjacent(parts) => self.adjacent(parts, tail),
            NodeKind::Chain(first, links) => self.chain(first, links, tail),
            NodeKind::Conditional { condition, question, first, colon, second } => {
                let is_flat = self.fits(node, tail);
                self.node(condition, 0);
                for (operator, part, tail) in [(question, first, 0), (colon, second, tail)] {
                    if is_flat {
                        self.blank();
                    } else {
                        self.begin_continued();
                    }
                    self.token(*operator);
                    self.blank();
                    self.node(part, tail);
                }
            }
            NodeKind::Assign { target, operator, value } => {
                self.node(target, 0);
                self.blank();
                self.token(*operator);
                self.value(value, tail);
            }
            NodeKind::List(elements) => self.flowing(elements, false, tail),
            NodeKind::Group { open, content, close } => {
                self.token(*open);
                if let Some(content) = content {
                    self.bracketed(*open, content, tail + 1);
                }
                self.token(*close);
            }
        }
    }

    fn words(&mut self, words: &[Node], tail: usize) {
        for (index, word) in words.iter().enumerate() {
            let is_last = index + 1 == words.len();
            self.node(word, if is_last { tail } else { 0 });
            if !is_last {
                self.after_word(word, &words[index + 1]);
            }
        }
    }

    /// Writes the blank between words. The annotation of a declaration ends its line if its author ended it there, or if
    /// the declaration does not fit on the rest.
    fn after_word(&mut self, word: &Node, next: &Node) {
        let is_annotation =
            matches!(&word.kind, NodeKind::Group { open, .. } if self.tokens[*open].is("["));
        let is_inside = self.continued.len() > 1;
        let is_broken = !is_inside && self.tokens[next.first()].newlines > 0;
        if !is_annotation {
            self.blank();
        } else if self.is_long || is_broken {
            let indent = self.continued();
            self.lines.begin(if is_inside { indent } else { indent - INDENT });
        } else {
            if !is_inside {
                self.lines.mark_column();
            }
            self.blank();
        }
    }

    fn prefix(&mut self, operators: &[usize], operand: &Node, tail: usize) {
        for (index, operator) in operators.iter().enumerate() {
            self.token(*operator);
            // `- -x` is not `--x`.
            let next = operators.get(index + 1).copied().unwrap_or(operand.first());
            if self.tokens[next].text.starts_with(&self.tokens[*operator].text[..1]) {
                self.blank();
            }
        }
        self.node(operand, tail);
    }

    fn adjacent(&mut self, parts: &[Node], tail: usize) {
        for (index, part) in parts.iter().enumerate() {
            let after: usize = parts[index + 1..].iter().map(Node::head_width).sum();
            self.node(part, if index + 1 == parts.len() { tail } else { after });
        }
    }

    fn chain(&mut self, first: &Node, links: &[(usize, Node)], tail: usize) {
        self.node(first, 0);
        for (index, (operator, operand)) in links.iter().enumerate() {
            let tail = if index + 1 == links.len() { tail } else { 0 };
            let before = self.tokens[*operator].text.len() + 1;
            if self.breaks_before(operand, before, tail) {
                self.begin_continued();
            } else {
                self.blank();
            }
            self.token(*operator);
            self.blank();
            self.node(operand, tail);
        }
    }

    /// True if a line break stands before an operand and its operator, which has `before` columns with its blank.
    fn breaks_before(&self, operand: &Node, before: usize, tail: usize) -> bool {
        let column = self.lines.width() + 1 + before;
        if column + operand.width + tail <= MAX_WIDTH {
            return false;
        }
        let is_first = self.lines.width() <= self.continued();
        if is_first {
            return false;
        }
        self.fits_alone(operand, before, tail)
            || !operand.can_break()
            || column + operand.head_width() > MAX_WIDTH
    }

    /// Writes the value of an assignment after its operator.
    fn value(&mut self, value: &Node, tail: usize) {
        let fits = self.lines.width() + 1 + value.width + tail <= MAX_WIDTH;
        let head_fits = self.lines.width() + 1 + value.head_width() <= MAX_WIDTH;
        if fits || (value.can_break() && head_fits) {
            self.blank();
        } else {
            self.begin_continued();
        }
        self.node(value, tail);
    }

    /// Writes what brackets contain. `tail` columns follow, with those of the closing bracket.
    fn bracketed(&mut self, open: usize, content: &Node, tail: usize) {
        let is_braces = self.tokens[open].is("{");
        let blank = usize::from(is_braces);
        if self.fits(content, tail + 2 * blank) {
            self.braces_blank(is_braces);
            self.node(content, tail);
            self.braces_blank(is_braces);
            return;
        }
        let outer = self.lines.indent();
        let indent = outer + INDENT;
        match &content.kind {
            NodeKind::List(elements)
                if self.tokens[open].is("[")
                    || (!is_braces && self.breaks_in_last(elements, tail)) =>
            {
                self.within(indent, |this| this.flowing(elements, false, tail));
            }
            NodeKind::List(_) => {
                self.vertical(content, indent, if is_braces { 1 } else { tail });
                if is_braces {
                    self.lines.begin(outer);
                }
            }
            _ => {
                self.braces_blank(is_braces);
                self.within(indent, |this| this.node(content, tail + blank));
                self.braces_blank(is_braces);
            }
        }
    }

    fn braces_blank(&mut self, is_braces: bool) {
        if is_braces {
            self.blank();
        }
    }

    /// True if a list breaks inside its last element alone.
    fn breaks_in_last(&self, elements: &[Element], tail: usize) -> bool {
        let Some((last, before)) = elements.split_last() else { return false };
        let Some(node) = &last.node else { return false };
        let width: usize = before.iter().map(|element| element.width(self.tokens) + 1).sum();
        let are_short = before.iter().all(|element| {
            element.width(self.tokens) <= SHORT && element.node.as_ref().is_none_or(Node::is_plain)
        });
        let fits_next = self.lines.indent() + INDENT + width + node.width + tail <= MAX_WIDTH;
        are_short
            && node.ends_with_list()
            && !fits_next
            && self.lines.width() + width + node.head_width() <= MAX_WIDTH
    }

    /// Writes the elements of a list on lines of their own, from the next line on.
    fn vertical(&mut self, content: &Node, indent: usize, tail: usize) {
        let NodeKind::List(elements) = &content.kind else {
            self.lines.begin(indent);
            return self.within(indent, |this| this.node(content, tail));
        };
        let fits = indent + content.width + tail <= MAX_WIDTH;
        let shares = elements.iter().all(|element| element.width(self.tokens) <= SHORT);
        self.within(indent, |this| {
            this.lines.begin(indent);
            if fits || shares {
                return this.flowing(elements, !fits, tail);
            }
            for (index, element) in elements.iter().enumerate() {
                if index > 0 {
                    this.lines.begin(indent);
                }
                let tail = if index + 1 == elements.len() { tail } else { 0 };
                this.within(indent + INDENT, |this| this.element(element, tail));
            }
        });
    }

    /// Writes the elements of a list one after another, with line breaks where the next does not fit. `keeps_rows`: and
    /// where the author's rows end.
    fn flowing(&mut self, elements: &[Element], keeps_rows: bool, tail: usize) {
        for (index, element) in elements.iter().enumerate() {
            let is_last = index + 1 == elements.len();
            let tail = if is_last { tail } else { 0 };
            if index > 0 && element.node.is_some() {
                let width = element.width(self.tokens) + tail;
                let is_row = keeps_rows && self.tokens[self.first_of(element)].newlines > 0;
                let fits = !is_row && self.lines.width() + 1 + width <= MAX_WIDTH;
                let can_break = is_last && element.node.as_ref().is_some_and(Node::can_break);
                let fits_next = self.continued() + width <= MAX_WIDTH;
                if fits || (can_break && !fits_next && !is_row) {
                    self.blank();
                } else {
                    self.begin_continued();
                }
            }
            self.element(element, tail);
        }
    }

    fn first_of(&self, element: &Element) -> usize {
        element.node.as_ref().map_or(0, Node::first)
    }

    fn element(&mut self, element: &Element, tail: usize) {
        let after = element.separator.map_or(0, |separator| self.tokens[separator].text.len());
        if let Some(node) = &element.node {
            let is_long = self.lines.width() + node.width + tail + after > MAX_WIDTH;
            let outer = std::mem::replace(&mut self.is_long, is_long);
            self.node(node, tail + after);
            self.is_long = outer;
        }
        if let Some(separator) = element.separator {
            self.token(separator);
        }
    }
}

impl Node {
    /// The index of the first token.
    pub fn first(&self) -> usize {
        match &self.kind {
            NodeKind::Token(index) | NodeKind::Group { open: index, .. } => *index,
            NodeKind::Words(parts) | NodeKind::Adjacent(parts) => {
                parts.first().map_or(0, Node::first)
            }
            NodeKind::Prefix(operators, operand) => {
                operators.first().copied().unwrap_or_else(|| operand.first())
            }
            NodeKind::Chain(first, _) => first.first(),
            NodeKind::Conditional { condition, .. } => condition.first(),
            NodeKind::Assign { target, .. } => target.first(),
            NodeKind::List(elements) => match elements.first() {
                Some(Element { node: Some(node), .. }) => node.first(),
                Some(Element { separator, .. }) => separator.unwrap_or(0),
                None => 0,
            },
        }
    }

    /// The number of columns before the first place where the node can break.
    fn head_width(&self) -> usize {
        match &self.kind {
            NodeKind::Token(_) => self.width,
            NodeKind::Group { content, .. } => {
                if content.is_some() {
                    1
                } else {
                    self.width
                }
            }
            NodeKind::Words(parts) | NodeKind::Adjacent(parts) => {
                let mut width = 0;
                for part in parts {
                    if part.can_break() {
                        return width + part.head_width();
                    }
                    width += part.width + 1;
                }
                width
            }
            NodeKind::Prefix(operators, operand) => operators.len() + operand.head_width(),
            NodeKind::Chain(first, _) => first.head_width(),
            NodeKind::Conditional { condition, .. } => condition.head_width(),
            NodeKind::Assign { target, .. } => target.width + 3,
            NodeKind::List(elements) => elements
                .first()
                .and_then(|element| element.node.as_ref())
                .map_or(1, Node::head_width),
        }
    }

    /// True if the node can be continued on further lines.
    fn can_break(&self) -> bool {
        match &self.kind {
            NodeKind::Token(_) => false,
            NodeKind::Group { content, .. } => content.is_some(),
            NodeKind::Words(parts) | NodeKind::Adjacent(parts) => parts.iter().any(Node::can_break),
            NodeKind::Prefix(_, operand) => operand.can_break(),
            NodeKind::Chain(..) | NodeKind::Conditional { .. } | NodeKind::Assign { .. } => true,
            NodeKind::List(_) => true,
        }
    }

    /// True for names, numbers and what has no brackets but those of indices.
    fn is_plain(&self) -> bool {
        match &self.kind {
            NodeKind::Token(_) => true,
            NodeKind::Words(parts) | NodeKind::Adjacent(parts) => parts.iter().all(Node::is_plain),
            NodeKind::Prefix(_, operand) => operand.is_plain(),
            _ => false,
        }
    }

    /// True for a call or brackets.
    fn ends_with_list(&self) -> bool {
        match &self.kind {
            NodeKind::Group { content, .. } => content.is_some(),
            NodeKind::Adjacent(parts) => parts.last().is_some_and(Node::ends_with_list),
            _ => false,
        }
    }
}

/// Returns a comment of several lines with its lines after the first indented as the first will be, if they begin with
/// a star; directives and other comments stay as they are.
pub(crate) fn shifted(trivia: &Trivia<'_>, indent: usize) -> String {
    let text = trivia.text;
    let mut lines = text.lines();
    let first = lines.next().unwrap_or_default();
    let has_stars = text.lines().skip(1).all(|line| line.trim_start().starts_with('*'));
    if trivia.is_directive || !has_stars {
        return text.replace("\r\n", "\n");
    }
    lines.fold(first.to_owned(), |mut shifted, line| {
        shifted.push('\n');
        shifted.extend(std::iter::repeat_n(' ', indent + 1));
        shifted.push_str(line.trim());
        shifted
    })
}
