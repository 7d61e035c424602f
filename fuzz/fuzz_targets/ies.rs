#![no_main]

#[path = "../entries/ies.rs"]
mod ies;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    ies::ies(data);
});
