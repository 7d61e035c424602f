//! Helpers for the text of diagnostics.

/// Returns `text`, truncated if it is too long for a message. Control characters become spaces.
pub(crate) fn shorten(text: &str) -> String {
    const LIMIT: usize = 40;
    let mut shown: String = text
        .chars()
        .take(LIMIT)
        .map(|character| if character.is_control() { ' ' } else { character })
        .collect();
    if text.chars().nth(LIMIT).is_some() {
        shown.push_str("...");
    }
    shown
}
