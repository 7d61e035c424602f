//! The pages of the checker's codes: the failing text of each gives its code and no other, the
//! corrected one nothing.

use rtsl_source::codes;
use rtsl_testing::checked::{codes as codes_of, diagnostics};

#[test]
fn pages_give_their_codes() {
    let mut failures = String::new();
    for info in codes() {
        let code = info.code.as_str();
        if !("0200".."0410").contains(&&code[1..]) {
            continue;
        }
        let failing = block(info.explanation, "```rtsl,fails\n")
            .unwrap_or_else(|| panic!("{code} shows no failing text"));
        if codes_of(failing) != [code] {
            failures += &format!("the failing text of {code}:\n{}\n", diagnostics(failing));
        }
        let mended = block(info.explanation, "```rtsl\n")
            .unwrap_or_else(|| panic!("{code} shows no mended text"));
        if !codes_of(mended).is_empty() {
            failures += &format!("the mended text of {code}:\n{}\n", diagnostics(mended));
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

fn block<'t>(page: &'t str, opening: &str) -> Option<&'t str> {
    let (_, rest) = page.split_once(opening)?;
    rest.split_once("\n```").map(|(text, _)| text)
}
