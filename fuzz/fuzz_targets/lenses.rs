#![no_main]

#[path = "../entries/lenses.rs"]
mod lenses;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    lenses::lenses(data);
});
