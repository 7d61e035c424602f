//! Documentation comments: the comment just before a declaration.

/// The maximum distance in bytes at which a comment may begin. It keeps the cost of many classes
/// proportional to the length of the text.
const MAX_BYTES: usize = 1 << 14;

/// Returns the comment that ends on the line before `offset` (or on its line), without comment
/// marks: one `/* */` or a run of `//` lines. `None` if there is none or it is blank.
pub fn comment_before(text: &str, offset: usize) -> Option<String> {
    let window = text.floor_char_boundary(offset.saturating_sub(MAX_BYTES));
    let before = text.get(window..offset)?.trim_end_matches([' ', '\t']);
    let before = before.strip_suffix('\n').unwrap_or(before).trim_end_matches(['\r', ' ', '\t']);
    let lines = match before.strip_suffix("*/") {
        Some(inside) => {
            let start = inside.rfind("/*")? + "/*".len();
            inside[start..].lines().map(strip_star).collect()
        }
        None => line_comments(before),
    };
    let joined = lines.join("\n");
    let trimmed = joined.trim();
    (!trimmed.is_empty()).then(|| trimmed.to_string())
}

fn strip_star(line: &str) -> &str {
    let line = line.trim();
    let line = line.strip_prefix('*').unwrap_or(line);
    line.strip_prefix(' ').unwrap_or(line).trim_end()
}

fn line_comments(text: &str) -> Vec<&str> {
    let marked = text.rsplit('\n').map(|line| line.trim().strip_prefix("//"));
    let mut lines: Vec<&str> = marked
        .take_while(Option::is_some)
        .flatten()
        .map(|line| line.trim_start_matches(['/', '!']))
        .map(|line| line.strip_prefix(' ').unwrap_or(line))
        .collect();
    lines.reverse();
    lines
}

#[cfg(test)]
mod tests {
    use super::comment_before;

    fn documentation(text: &str) -> Option<String> {
        comment_before(text, text.find("class")?)
    }

    #[test]
    fn the_comment_just_before_counts() {
        assert_eq!(documentation("// a\n// b\nclass").as_deref(), Some("a\nb"));
        assert_eq!(documentation("/// a\nclass").as_deref(), Some("a"));
        assert_eq!(documentation("/** a\n * b\n */\nclass").as_deref(), Some("a\nb"));
        assert_eq!(documentation("// licence\n\nclass"), None);
        assert_eq!(documentation("int x;\nclass"), None);
        assert_eq!(documentation("class"), None);
    }
}
