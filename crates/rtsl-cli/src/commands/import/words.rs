//! The words of a program in GLSL, without those in comments.

/// A word, and the byte at which it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word<'t> {
    pub text: &'t str,
    pub start: usize,
}

/// Returns the names in a text, in their order. Numbers, comments and marks are left out.
pub fn words(text: &str) -> Vec<Word<'_>> {
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &text.as_bytes()[at..];
        at = match rest[0] {
            b'/' if rest.starts_with(b"//") => end_of(bytes, at + 2, b"\n"),
            b'/' if rest.starts_with(b"/*") => end_of(bytes, at + 2, b"*/"),
            first if is_of_word(first) => {
                let length = rest.iter().take_while(|byte| is_of_word(**byte)).count();
                if !first.is_ascii_digit() {
                    found.push(Word { text: &text[at..at + length], start: at });
                }
                at + length
            }
            _ => at + 1,
        };
    }
    found
}

fn is_of_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// The place after the next mark, or the end.
fn end_of(bytes: &[u8], from: usize, mark: &[u8]) -> usize {
    let found = bytes[from..].windows(mark.len()).position(|window| window == mark);
    found.map_or(bytes.len(), |position| from + position + mark.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_outside_comments() {
        let text = "a1 /* b */ c2.xyz // d\n1e5 _e/f; /*";
        let found: Vec<&str> = words(text).iter().map(|word| word.text).collect();
        assert_eq!(found, ["a1", "c2", "xyz", "_e", "f"]);
        assert_eq!(words("é = x").first().map(|word| word.start), Some(5));
        assert_eq!(words("/* open"), []);
    }
}
