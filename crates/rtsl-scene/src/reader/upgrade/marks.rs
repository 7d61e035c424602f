//! Recognition of scenes in the format of earlier versions of pbrt.

use super::materials::is_old_material;
use super::textures::is_old_texture;
use crate::reader::directive::Keyword;
use crate::reader::parser::Command;

/// The directive with which all scenes of earlier versions end.
const END: &str = "WorldEnd";

/// Directives before the world that only earlier versions have.
const OLD_WORDS: [&str; 5] =
    ["SurfaceIntegrator", "VolumeIntegrator", "Renderer", "SearchPath", "Volume"];

/// The length of the part of a text that has the directives before the world.
const HEAD: usize = 1 << 16;

/// Names of entities, before the world, that only earlier versions have.
const OLD_NAMES: [(Keyword, &[&str]); 4] = [
    (Keyword::Film, &["image"]),
    (Keyword::Camera, &["environment"]),
    (Keyword::Sampler, &["lowdiscrepancy", "02sequence", "maxmindist", "bestcandidate"]),
    (Keyword::AreaLightSource, &["area"]),
];

/// True if a text has a directive that only earlier versions of the format have.
pub fn is_old_text(text: &str) -> bool {
    let head = &text[..text.floor_char_boundary(HEAD)];
    has_word(text, &[END]) || has_word(head, &OLD_WORDS)
}

/// True if the name of a command's entity is one that only earlier versions have.
pub fn is_old_name(command: &Command) -> bool {
    let name = |index: usize| command.texts.get(index).map_or("", |it| it.text.as_str());
    match command.keyword {
        Keyword::Material => is_old_material(name(0)),
        Keyword::MakeNamedMaterial => {
            let class = command.parameters.iter().find(|it| it.name == "type");
            class.and_then(|it| it.first_text()).is_some_and(is_old_material)
        }
        Keyword::Texture => name(1) == "color" && is_old_texture(name(2)),
        keyword => {
            OLD_NAMES.iter().any(|(other, names)| *other == keyword && names.contains(&name(0)))
        }
    }
}

/// True if a text has one of these words, alone and neither in a comment nor in a string, which end with their lines at
/// the latest. The time is proportional to the text's length, whatever it contains.
fn has_word(text: &str, words: &[&str]) -> bool {
    let words: Vec<&[u8]> =
        words.iter().filter(|word| text.contains(**word)).map(|word| word.as_bytes()).collect();
    if words.is_empty() {
        return false;
    }
    let bytes = text.as_bytes();
    let is_word = |at: usize| {
        let ends = |word: &[u8]| {
            bytes
                .get(at + word.len())
                .is_none_or(|it| it.is_ascii_whitespace() || b"\"#".contains(it))
        };
        words.iter().any(|word| bytes[at..].starts_with(word) && ends(word))
    };
    let (mut is_string, mut is_comment, mut follows_blank) = (false, false, true);
    for (at, byte) in bytes.iter().enumerate() {
        match byte {
            b'\n' => (is_string, is_comment) = (false, false),
            b'"' if !is_comment => is_string = !is_string,
            b'#' if !is_string => is_comment = true,
            _ if follows_blank && !is_string && !is_comment && is_word(at) => return true,
            _ => {}
        }
        follows_blank = byte.is_ascii_whitespace();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_directives_are_words_outside_of_comments_and_strings() {
        for old in [
            "WorldEnd",
            "WorldBegin\n  WorldEnd # done",
            "SurfaceIntegrator \"path\"",
            "a \"b\" WorldEnd\n",
            "\"#\" WorldEnd",
        ] {
            assert!(is_old_text(old), "{old}");
        }
        for current in
            ["", "# WorldEnd", "\"x WorldEnd y\"", "MyWorldEnd", "WorldEnds", "Integrator \"path\""]
        {
            assert!(!is_old_text(current), "{current}");
        }
    }
}
