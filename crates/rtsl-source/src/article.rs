//! "A" or "an" in front of a name.

/// Returns `name`, which may be in quotation marks, behind its indefinite article: `a camera`, `an integrator`,
/// `a uvec3`.
pub fn with_article(name: &str) -> String {
    let vowel = name.trim_start_matches('`').starts_with(['a', 'e', 'i', 'o', 'A', 'E', 'I', 'O']);
    // `uint` and `uvec3` are spoken "you-int", and the language has no other names with `u`.
    let article = if vowel { "an" } else { "a" };
    format!("{article} {name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_article_follows_the_sound() {
        let cases = [
            "an integrator",
            "an int",
            "a camera",
            "a uint",
            "an Image",
            "a vec3",
            "an `int`",
            "a `vec3`",
        ];
        for expected in cases {
            let (_, name) = expected.split_once(' ').unwrap();
            assert_eq!(with_article(name), expected);
        }
    }
}
