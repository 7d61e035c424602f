//! Colors. The forms of `pow`, `mix` and so on for colors are entered with those for floats.

use crate::builtins::{Builtin, Chapter, Special, Usable};

pub(super) static COLOR: &[Builtin] = &[
    Builtin::special(
        Chapter::Color,
        "rgb",
        Special::Rgb,
        Usable::Anywhere,
        &["vec3 rgb(color c)"],
        "The color as linear red, green and blue with the primaries of Rec. 709.",
    ),
    Builtin::prelude(
        Chapter::Color,
        "luminance",
        &["float luminance(color c)"],
        "The luminance: 0.2126 red + 0.7152 green + 0.0722 blue.",
    ),
];
