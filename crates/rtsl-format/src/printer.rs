//! Writes items: their lines, blank lines, blocks and the comments before them.

use std::ops::Range;

use crate::item::{Block, Contents, Control, Item};
use crate::layout::{Layout, shifted};
use crate::node::{self, ENDLESS, Node};
use crate::token::Token;
use crate::{INDENT, MAX_WIDTH};

/// Writes items one after another.
pub(crate) struct Printer<'t, 'a> {
    tokens: &'t [Token<'a>],
    layout: Layout<'t, 'a>,
    is_too_deep: bool,
}

/// Returns the text of the items of a file; `None` if expressions are nested deeper than the compiler accepts.
pub(crate) fn print(tokens: &[Token<'_>], items: &[Item]) -> Option<String> {
    let mut printer = Printer { tokens, layout: Layout::new(tokens), is_too_deep: false };
    printer.items(items, 0);
    printer.before(tokens.len() - 1, 0, !items.is_empty());
    (!printer.is_too_deep).then(|| printer.layout.lines.finish())
}

impl Printer<'_, '_> {
    fn items(&mut self, items: &[Item], indent: usize) {
        let mut on_label_line = false;
        for (index, item) in items.iter().enumerate() {
            let is_label = matches!(item, Item::Label(_));
            let column = if is_label { indent.saturating_sub(INDENT) } else { indent };
            let shares = on_label_line && !is_label && self.shares_line(item);
            if shares {
                self.layout.blank();
            } else {
                self.before(item.first(), column, index > 0);
            }
            self.item(item, column);
            on_label_line = (is_label || shares) && !self.layout.lines.is_ended();
        }
    }

    /// True if an item stands on the line of the label before it, as its author wrote it.
    fn shares_line(&self, item: &Item) -> bool {
        let first = &self.tokens[item.first()];
        let fits = |width| self.layout.lines.width() + 1 + width <= MAX_WIDTH;
        let begins_block = item.as_body().is_some();
        first.newlines_before_all() == 0
            && (begins_block || self.flat_width(item).is_some_and(fits))
    }

    /// Begins the line of a token: writes the blank line and the comments before it.
    fn before(&mut self, index: usize, indent: usize, may_have_blank: bool) {
        self.layout.set_begun(index);
        let token = &self.tokens[index];
        let mut may_have_blank = may_have_blank;
        let mut is_inline = false;
        for trivia in &token.before {
            if may_have_blank && trivia.newlines > 1 {
                self.layout.lines.blank();
            }
            if !is_inline {
                self.layout.lines.begin(if trivia.is_directive { 0 } else { indent });
            }
            self.layout.lines.push(&shifted(trivia, indent));
            is_inline = trivia.is_inline;
            if is_inline {
                self.layout.lines.push(" ");
            }
            may_have_blank = true;
        }
        if may_have_blank && token.newlines > 1 && !token.is_end() {
            self.layout.lines.blank();
        }
        if !is_inline {
            self.layout.lines.begin(indent);
        }
    }

    /// Writes an item from the current line on.
    fn item(&mut self, item: &Item, indent: usize) {
        match item {
            Item::Simple(range) => self.simple(range.clone(), 0),
            Item::Label(range) => self.label(range.clone()),
            Item::Block(block) => self.block(block, indent),
            Item::Control(control) => self.control(control, indent),
            Item::DoWhile { keyword, body, tail } => {
                self.layout.token(*keyword);
                self.body(body, indent);
                self.after_body(body, tail.start, indent);
                self.simple(tail.clone(), 0);
            }
        }
    }

    /// Writes tokens up to a semicolon, so that `tail` columns fit after it.
    fn simple(&mut self, range: Range<usize>, tail: usize) {
        let (content, semicolon) = self.without_last(range, ";");
        if !content.is_empty() {
            let node = self.parse(content);
            self.layout.statement(&node, tail + usize::from(semicolon.is_some()));
        }
        if let Some(semicolon) = semicolon {
            self.layout.token(semicolon);
        }
    }

    fn label(&mut self, range: Range<usize>) {
        let (content, colon) = self.without_last(range, ":");
        let node = self.parse(content);
        self.layout.statement(&node, 1);
        if let Some(colon) = colon {
            self.layout.token(colon);
        }
    }

    fn block(&mut self, block: &Block, indent: usize) {
        if self.is_flat_block(block) {
            self.flat_block(block);
            return;
        }
        if !block.head.is_empty() {
            let node = self.parse(block.head.clone());
            self.layout.head(&node, 2);
            self.layout.blank();
        }
        self.braces(block, indent);
        self.tail(block);
    }

    /// Writes `{ ... }` on lines of their own.
    fn braces(&mut self, block: &Block, indent: usize) {
        self.layout.token(block.open);
        match &block.contents {
            Contents::Items(items)
                if items.is_empty() && !self.tokens[block.close].ends_lines() =>
            {
                self.layout.token(block.close);
                return;
            }
            Contents::Items(items) => self.items(items, indent + INDENT),
            Contents::Choices(range) => self.choices(range.clone(), indent + INDENT),
        }
        self.before_closing(block.close, indent);
        self.layout.token(block.close);
    }

    /// Begins the line of a closing brace, after the comments before it, which belong to the block's contents.
    fn before_closing(&mut self, index: usize, indent: usize) {
        self.layout.set_begun(index);
        let token = &self.tokens[index];
        for (place, trivia) in token.before.iter().enumerate() {
            let is_first = place == 0 && self.tokens[index - 1].is("{");
            if trivia.newlines > 1 && !is_first {
                self.layout.lines.blank();
            }
            let column = if trivia.is_directive { 0 } else { indent + INDENT };
            self.layout.lines.begin(column);
            self.layout.lines.push(&shifted(trivia, column));
        }
        self.layout.lines.begin(indent);
    }

    /// Writes the choices of an enumeration, one on a line.
    fn choices(&mut self, range: Range<usize>, indent: usize) {
        let mut start = range.start;
        let mut nesting = 0;
        for index in range.clone() {
            match self.tokens[index].text {
                "(" | "[" | "{" => nesting += 1,
                ")" | "]" | "}" => nesting -= 1,
                _ => {}
            }
            let ends = nesting == 0 && self.tokens[index].is(",");
            if ends || index + 1 == range.end {
                self.before(start, indent, start > range.start);
                let node = self.parse(start..index + 1);
                self.layout.statement(&node, 0);
                start = index + 1;
            }
        }
    }

    /// Writes what follows a block: `;`, or the declarators of a struct.
    fn tail(&mut self, block: &Block) {
        if block.tail.is_empty() {
            return;
        }
        if !self.tokens[block.tail.start].is(";") {
            self.layout.blank();
        }
        self.simple(block.tail.clone(), 0);
    }

    fn control(&mut self, control: &Control, indent: usize) {
        let mut control = control;
        loop {
            if self.is_flat_control(control) {
                return self.flat_control(control);
            }
            self.head(control.head.clone());
            self.body(&control.body, indent);
            let Some((keyword, otherwise)) = &control.otherwise else { return };
            self.after_body(&control.body, *keyword, indent);
            self.layout.token(*keyword);
            match &**otherwise {
                // A chain of any length stays at its indentation.
                Item::Control(next) if self.is_else_if(next) => {
                    self.layout.blank();
                    control = next;
                }
                other => return self.body(other, indent),
            }
        }
    }

    /// True for an `if` on the line of the `else` before it.
    fn is_else_if(&self, next: &Control) -> bool {
        let token = &self.tokens[next.head.start];
        token.is("if") && token.newlines_before_all() == 0 && token.before.is_empty()
    }

    /// Writes a keyword with its parentheses.
    fn head(&mut self, range: Range<usize>) {
        self.layout.token(range.start);
        if range.len() == 1 {
            return;
        }
        if !self.tokens[range.start].is("illuminance") {
            self.layout.blank();
        }
        let node = self.parse(range.start + 1..range.end);
        self.layout.statement(&node, 2);
    }

    /// Writes the statement of a head.
    fn body(&mut self, body: &Item, indent: usize) {
        if let Some(block) = body.as_body()
            && self.tokens[block.open].before.is_empty()
        {
            self.layout.blank();
            self.braces(block, indent);
            return;
        }
        if matches!(body, Item::Simple(range) if range.len() <= 1) {
            return self.item(body, indent);
        }
        let first = &self.tokens[body.first()];
        let fits = |width| self.layout.lines.width() + 1 + width <= MAX_WIDTH;
        let is_head = matches!(body, Item::Control(_));
        let stays = first.newlines_before_all() == 0
            && first.before.is_empty()
            && !self.layout.lines.is_ended()
            && (is_head || self.flat_width(body).is_some_and(fits));
        if stays {
            self.layout.blank();
            self.item(body, indent);
        } else {
            self.before(body.first(), indent + INDENT, false);
            self.item(body, indent + INDENT);
        }
    }

    /// Goes on after a body to the `else` or `while` at `index`: on the line of a closing brace, else on the next.
    fn after_body(&mut self, body: &Item, index: usize, indent: usize) {
        let token = &self.tokens[index];
        let stays =
            body.as_body().is_some() && token.before.is_empty() && !self.layout.lines.is_ended();
        if stays {
            self.layout.blank();
        } else {
            self.before(index, indent, false);
        }
    }

    fn parse(&mut self, range: Range<usize>) -> Node {
        let start = range.start;
        node::parse(self.tokens, range).unwrap_or_else(|| {
            self.is_too_deep = true;
            Node { kind: node::NodeKind::Token(start), width: 0 }
        })
    }

    /// Splits off the last token if it is `text`.
    fn without_last(&self, range: Range<usize>, text: &str) -> (Range<usize>, Option<usize>) {
        match !range.is_empty() && self.tokens[range.end - 1].is(text) {
            true => (range.start..range.end - 1, Some(range.end - 1)),
            false => (range, None),
        }
    }
}

// Items on one line, as their author wrote them.
impl Printer<'_, '_> {
    /// The number of columns of an item on one line; `None` if it has several.
    fn flat_width(&self, item: &Item) -> Option<usize> {
        let width = match item {
            Item::Simple(range) | Item::Label(range) => {
                self.range_width(range.clone(), item.first())?
            }
            Item::Block(block) => self.block_width(block)?,
            Item::Control(control) => self.control_width(control)?,
            Item::DoWhile { body, tail, .. } => {
                self.flat_width(body)? + self.range_width(tail.clone(), tail.start)? + 4
            }
        };
        (width < MAX_WIDTH).then_some(width)
    }

    /// The number of columns of tokens on one line. A comment after the last does not count.
    fn range_width(&self, range: Range<usize>, first: usize) -> Option<usize> {
        let last = range.end.checked_sub(1)?;
        if range.len() > MAX_WIDTH {
            return None;
        }
        let ends = |index: usize| {
            let token = &self.tokens[index];
            let before = index != first && token.before.iter().any(|trivia| !trivia.is_inline);
            before || (index != last && token.after.is_some())
        };
        if range.clone().any(ends) {
            return None;
        }
        let content = self.without_last(range, ";");
        let semicolon = usize::from(content.1.is_some());
        if content.0.is_empty() {
            return Some(semicolon);
        }
        let node = node::parse(self.tokens, content.0)?;
        (node.width < ENDLESS).then_some(node.width + semicolon)
    }

    fn block_width(&self, block: &Block) -> Option<usize> {
        let head = match block.head.is_empty() {
            true => 0,
            false => self.range_width(block.head.clone(), block.head.start)? + 1,
        };
        let tail = match block.tail.is_empty() {
            true => 0,
            false => self.range_width(block.tail.clone(), block.tail.start)? + 1,
        };
        let stays = |index: usize| {
            let token = &self.tokens[index];
            token.newlines_before_all() == 0 && token.before.is_empty()
        };
        let open = &self.tokens[block.open];
        if open.after.is_some() || !open.before.is_empty() || !stays(block.close) {
            return None;
        }
        let contents = match &block.contents {
            Contents::Items(items) => {
                let mut width = 0;
                for item in items {
                    let last_has_comment = !stays(item.first());
                    if last_has_comment || matches!(item, Item::Label(_)) {
                        return None;
                    }
                    width += self.flat_width(item)? + 1;
                }
                width
            }
            Contents::Choices(range) if range.is_empty() => 0,
            Contents::Choices(range) if stays(range.start) => {
                self.range_width(range.clone(), range.start)? + 1
            }
            Contents::Choices(_) => return None,
        };
        let before_close = &self.tokens[block.close - 1];
        (before_close.after.is_none()).then_some(head + contents + tail + 3)
    }

    fn control_width(&self, control: &Control) -> Option<usize> {
        let stays = |index: usize| {
            let token = &self.tokens[index];
            token.newlines_before_all() == 0 && token.before.is_empty()
        };
        let head = self.range_width(control.head.clone(), control.head.start)? + 1;
        let body = self.flat_width(&control.body)?;
        let otherwise = match &control.otherwise {
            None => 0,
            Some((keyword, item)) => {
                if !stays(*keyword) || !stays(item.first()) {
                    return None;
                }
                self.flat_width(item)? + 6
            }
        };
        stays(control.body.first()).then_some(head + body + otherwise)
    }

    fn is_flat_block(&self, block: &Block) -> bool {
        let width = self.block_width(block);
        width.is_some_and(|width| self.layout.lines.width() + width <= MAX_WIDTH)
    }

    fn is_flat_control(&self, control: &Control) -> bool {
        let width = self.control_width(control);
        width.is_some_and(|width| self.layout.lines.width() + width <= MAX_WIDTH)
    }

    fn flat_item(&mut self, item: &Item) {
        match item {
            Item::Simple(range) | Item::Label(range) => self.simple(range.clone(), 0),
            Item::Block(block) => self.flat_block(block),
            Item::Control(control) => self.flat_control(control),
            Item::DoWhile { keyword, body, tail } => {
                self.layout.token(*keyword);
                self.layout.blank();
                self.flat_item(body);
                self.layout.blank();
                self.simple(tail.clone(), 0);
            }
        }
    }

    fn flat_block(&mut self, block: &Block) {
        if !block.head.is_empty() {
            let node = self.parse(block.head.clone());
            self.layout.statement(&node, 0);
            self.layout.blank();
        }
        self.layout.token(block.open);
        match &block.contents {
            Contents::Items(items) => {
                for item in items {
                    self.layout.blank();
                    self.flat_item(item);
                }
                if !items.is_empty() {
                    self.layout.blank();
                }
            }
            Contents::Choices(range) if range.is_empty() => {}
            Contents::Choices(range) => {
                self.layout.blank();
                self.simple(range.clone(), 0);
                self.layout.blank();
            }
        }
        self.layout.token(block.close);
        self.tail(block);
    }

    fn flat_control(&mut self, control: &Control) {
        self.head(control.head.clone());
        if !matches!(&*control.body, Item::Simple(range) if range.len() <= 1) {
            self.layout.blank();
        }
        self.flat_item(&control.body);
        if let Some((keyword, item)) = &control.otherwise {
            self.layout.blank();
            self.layout.token(*keyword);
            self.layout.blank();
            self.flat_item(item);
        }
    }
}
