//! The lines that two versions of a text share.

use std::time::{Duration, Instant};

use similar::{Algorithm, DiffOp, capture_diff_slices_deadline};

/// The time after which a comparison may find fewer lines.
const MAX_TIME: Duration = Duration::from_millis(100);

/// Returns for each line of the old text its line in the new text; `None` if it has changed.
pub fn unchanged_lines(old: &str, new: &str) -> Vec<Option<u32>> {
    let (old, new) = (lines(old), lines(new));
    let deadline = Some(Instant::now() + MAX_TIME);
    let mut places = vec![None; old.len()];
    for part in capture_diff_slices_deadline(Algorithm::Patience, &old, &new, deadline) {
        if let DiffOp::Equal { old_index, new_index, len } = part {
            for at in 0..len {
                places[old_index + at] = Some((new_index + at) as u32);
            }
        }
    }
    places
}

/// Returns true if two texts have the same lines. Editors drop marks of byte order, and may end the last line.
pub fn has_same_lines(left: &str, right: &str) -> bool {
    lines(left) == lines(right)
}

fn lines(text: &str) -> Vec<&str> {
    text.trim_start_matches('\u{feff}').lines().collect()
}
