//! "Did you mean": finds the name that was probably meant.

/// Names longer than this are not compared, because the cost grows with the product of the lengths.
const LENGTH_LIMIT: usize = 64;

/// Returns the candidate most similar to `name` if at most a third of its letters differ. A
/// difference in case counts half a letter. The first wins a tie.
pub fn most_similar<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    if name.len() > LENGTH_LIMIT {
        return None;
    }
    let limit = 2 * (name.chars().count() / 3).max(1);
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates.into_iter().filter(|candidate| candidate.len() <= LENGTH_LIMIT) {
        let distance = distance(name, candidate);
        if distance <= limit && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Twice the edit distance with insertion, deletion, replacement and transposition of neighbours; a
/// difference in case counts half an edit.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before_last: Vec<usize> = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).map(|count| 2 * count).collect();
    for i in 0..a.len() {
        let mut row = vec![2 * (i + 1)];
        for j in 0..b.len() {
            let replace = match (a[i], b[j]) {
                (x, y) if x == y => 0,
                (x, y) if x.eq_ignore_ascii_case(&y) => 1,
                _ => 2,
            };
            let mut least = (last[j] + replace).min(last[j + 1] + 2).min(row[j] + 2);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                least = least.min(before_last[j - 1] + 2);
            }
            row.push(least);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelled_names_are_found_and_other_names_are_not() {
        let names = ["rt_HitPoint", "rt_HitDistance", "radius", "r", "center"];
        for (name, meant) in [
            ("rt_Hitpoint", Some("rt_HitPoint")),
            ("rt_HitPiont", Some("rt_HitPoint")),
            ("raduis", Some("radius")),
            ("centre", Some("center")),
            ("R", Some("r")),
            ("roughness", None),
        ] {
            let found = most_similar(name, names);
            assert_eq!(found, meant, "{name}");
        }
        assert_eq!(most_similar(&"x".repeat(1 << 20), names), None);
    }
}
