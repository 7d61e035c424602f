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
    let has =
        |text: &str, word: &str| text.match_indices(word).any(|(at, _)| is_word(text, at, word));
    has(text, END) || OLD_WORDS.iter().any(|word| has(head, word))
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

/// True if an occurrence of a word is neither a part of a longer one, nor of a comment or a string.
fn is_word(text: &str, at: usize, word: &str) -> bool {
    let is_blank = |byte: Option<&u8>| byte.is_none_or(u8::is_ascii_whitespace);
    let bytes = text.as_bytes();
    let line = text[..at].rfind('\n').map_or(0, |end| end + 1);
    let before = &text[line..at];
    is_blank(at.checked_sub(1).and_then(|before| bytes.get(before)))
        && bytes
            .get(at + word.len())
            .is_none_or(|it| it.is_ascii_whitespace() || b"\"#".contains(it))
        && before.matches('"').count() % 2 == 0
        && !before.contains('#')
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
