//! The titles of edits that diagnostics suggest.

use rtsl::Suggestion;

/// Returns the title of an edit: its description, and the new text if there is one.
pub fn advice(suggestion: &Suggestion) -> String {
    match suggestion.replacement.trim() {
        "" => suggestion.message.clone(),
        replacement => format!("{}: `{replacement}`", suggestion.message),
    }
}
