//! Comments in generated text, which must contain the shader's text entirely.

use crate::expression::LINE_LENGTH;

/// Appends the lines of a documentation comment, none for an empty text. The line breaks are those of the text if all
/// lines fit; otherwise its paragraphs are refilled. For any text, each line ends where the comment does.
pub(crate) fn write_documentation(documentation: &str, indentation: usize, text: &mut String) {
    let margin = format!("{}/// ", " ".repeat(indentation));
    let width = LINE_LENGTH.saturating_sub(margin.len());
    let fits = documentation.lines().all(|line| line.len() <= width);
    let filled = documentation.split("\n\n").map(|it| it.replace('\n', " "));
    let filled = filled.collect::<Vec<_>>().join("\n\n");
    for line in if fits { documentation } else { &filled }.lines() {
        for part in wrapped(line, width) {
            text.push_str(format!("{margin}{}", harmless(&part)).trim_end());
            text.push('\n');
        }
    }
}

/// Turns a phrase into a sentence with a capital letter and a full stop.
pub(crate) fn sentence(phrase: &str) -> String {
    let mut characters = phrase.chars();
    match characters.next() {
        None => String::new(),
        Some(first) => {
            format!("{}{}.", first.to_uppercase(), characters.as_str().trim_end_matches('.'))
        }
    }
}

/// Wraps a line to at most `width` characters, as far as the words allow.
fn wrapped(line: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in line.split(' ') {
        let last = lines.last_mut().expect("one at least");
        if !last.is_empty() && last.len() + 1 + word.len() > width {
            lines.push(word.to_owned());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

/// Replaces characters in a line that would continue or end a comment: backslashes at its end, their trigraphs, and
/// other line terminators.
pub(crate) fn harmless(line: &str) -> String {
    let printable = |character: char| match character {
        '\t' => ' ',
        '\u{2028}' | '\u{2029}' | '\u{85}' => ' ',
        other if other.is_control() => ' ',
        // Bidirectional control characters can disguise text.
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' => ' ',
        other => other,
    };
    let line: String = line.chars().map(printable).collect();
    let line = line.replace("??/", "? ?/").replace("*/", "* /");
    let line = line.trim_end();
    if line.ends_with('\\') { format!("{line} .") } else { line.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_stay_comments() {
        let mut text = String::new();
        let hostile = "a */ int x; \\\nb ??/\nc\rd\u{2028}e\n\\\\  \nf\u{202e}g";
        write_documentation(hostile, 4, &mut text);
        let expected = "    /// a * / int x; \\ .\n    /// b ? ?/\n    /// c d e\n    /// \\\\ .\n    /// f g\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn long_lines_are_wrapped() {
        let mut text = String::new();
        write_documentation(&"word ".repeat(30), 0, &mut text);
        assert_eq!(text.lines().count(), 2);
        assert!(text.lines().all(|line| line.len() <= LINE_LENGTH && line.starts_with("/// word")));
    }
}
