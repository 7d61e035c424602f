//! The comments of a file, and the declarations that they document.

use std::ops::Range;

use rtsl_source::FileId;

use crate::lexer::lex_with_comments;
use crate::symbol::Interner;

/// The comments of a file.
#[derive(Clone, Debug, Default)]
pub struct Comments {
    /// The bytes of each, in the order of the text.
    pub(crate) ranges: Vec<Range<usize>>,
}

impl Comments {
    /// The comments of a text.
    pub fn of(text: &str) -> Comments {
        let (_, ranges) = lex_with_comments(FileId(0), text, &mut Interner::default());
        Comments { ranges }
    }

    /// True at an offset of `text` inside a comment, or at the end of a `//` comment.
    pub fn contain(&self, text: &str, offset: usize) -> bool {
        let end_of = |it: &Range<usize>| it.end - usize::from(is_block(text, it));
        self.ranges.iter().any(|it| it.start < offset && offset <= end_of(it))
    }

    /// Returns the comment of `text` that documents what begins at `offset`, without comment marks:
    /// the `/* */` or the run of `//` lines that ends on the line before, or a `/* */` on its line.
    /// `None` if there is none or it is blank.
    pub fn before(&self, text: &str, offset: usize) -> Option<String> {
        let run = self.run_before(text, offset);
        let marked = run.iter().map(|range| &text[range.clone()]);
        let lines: Vec<&str> = match run {
            [one] if is_block(text, one) => {
                let inside = text[one.clone()].trim_start_matches('/').trim_end_matches('/');
                inside.trim_end_matches('*').lines().map(strip_star).collect()
            }
            _ => marked.map(strip_slashes).collect(),
        };
        let joined = lines.join("\n");
        let trimmed = joined.trim();
        (!trimmed.is_empty()).then(|| trimmed.to_string())
    }

    /// Returns the beginning of the comment of `text` that documents what begins at `offset`, or
    /// `offset` if there is none.
    pub fn start_before(&self, text: &str, offset: usize) -> usize {
        self.run_before(text, offset).first().map_or(offset, |first| first.start)
    }

    fn run_before(&self, text: &str, offset: usize) -> &[Range<usize>] {
        let end = self.ranges.partition_point(|comment| comment.end <= offset);
        let before = &self.ranges[..end];
        match before.last() {
            Some(last) if is_block(text, last) => {
                let gap = &text[last.end..offset];
                let is_near = adjoins(gap) && (!gap.contains('\n') || begins_line(text, last));
                &before[end - usize::from(is_near)..]
            }
            _ => {
                let mut next = offset;
                let in_run = before.iter().rev().take_while(|comment| {
                    let is_near = adjoins(&text[comment.end..next]);
                    next = comment.start;
                    is_near && !is_block(text, comment) && begins_line(text, comment)
                });
                let count = in_run.count();
                &before[end - count..]
            }
        }
    }
}

/// True if the text between two pieces ends the first one's line at most.
fn adjoins(gap: &str) -> bool {
    gap.trim_start().is_empty() && gap.matches('\n').count() <= 1
}

/// True if a comment is the first thing on its line.
fn begins_line(text: &str, comment: &Range<usize>) -> bool {
    let before = text[..comment.start].trim_end_matches([' ', '\t', '\u{feff}']);
    before.is_empty() || before.ends_with(['\n', '\r'])
}

fn is_block(text: &str, comment: &Range<usize>) -> bool {
    text[comment.clone()].starts_with("/*")
}

fn strip_star(line: &str) -> &str {
    let line = line.trim();
    let line = line.trim_start_matches('*');
    line.strip_prefix(' ').unwrap_or(line).trim_end()
}

fn strip_slashes(line: &str) -> &str {
    let line = line.trim_end().trim_start_matches(['/', '!']);
    line.strip_prefix(' ').unwrap_or(line)
}

#[cfg(test)]
mod tests {
    use super::Comments;

    fn documentation(text: &str) -> Option<String> {
        Comments::of(text).before(text, text.find("class")?)
    }

    #[test]
    fn the_comment_just_before_counts() {
        assert_eq!(documentation("// a\n// b\nclass").as_deref(), Some("a\nb"));
        assert_eq!(documentation("/// a\nclass").as_deref(), Some("a"));
        assert_eq!(documentation("/** a\n * b\n */\nclass").as_deref(), Some("a\nb"));
        assert_eq!(documentation("int x; /* a */ class").as_deref(), Some("a"));
        assert_eq!(documentation("// licence\n\nclass"), None);
        assert_eq!(documentation("int x;\nclass"), None);
        assert_eq!(documentation("class"), None);
    }

    #[test]
    fn comments_of_other_code_and_marks_in_comments_do_not_count() {
        assert_eq!(documentation("int x; /* of x */\nclass"), None);
        assert_eq!(documentation("int x; // of x\nclass"), None);
        assert_eq!(documentation("int x; // of x\n// a\nclass").as_deref(), Some("a"));
        assert_eq!(documentation("// a /* b */\nclass").as_deref(), Some("a /* b */"));
        assert_eq!(documentation("/* a /* b */\nclass").as_deref(), Some("a /* b"));
        assert_eq!(documentation("/* a\n// b\n// c */\nclass").as_deref(), Some("a\n// b\n// c"));
    }
}
