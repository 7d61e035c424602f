//! The pages of the checker's codes: the failing text of each gives its code and no other, the mended
//! one nothing.

mod support;

use rtsl_source::codes;
use support::{codes as codes_of, diagnostics};

#[test]
fn pages_give_their_codes() {
    for info in codes() {
        let code = info.code.as_str();
        if !("0200".."0410").contains(&&code[1..]) {
            continue;
        }
        let failing = block(info.explanation, "```rtsl,fails\n")
            .unwrap_or_else(|| panic!("{code} shows no failing text"));
        assert_eq!(codes_of(failing), [code], "{}", diagnostics(failing));
        let mended = block(info.explanation, "```rtsl\n")
            .unwrap_or_else(|| panic!("{code} shows no mended text"));
        assert_eq!(diagnostics(mended), "", "the mended text of {code}");
    }
}

fn block<'t>(page: &'t str, opening: &str) -> Option<&'t str> {
    let (_, rest) = page.split_once(opening)?;
    rest.split_once("\n```").map(|(text, _)| text)
}
