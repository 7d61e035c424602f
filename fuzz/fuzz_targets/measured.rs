#![no_main]

#[path = "../entries/measured.rs"]
mod measured;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    measured::measured(data);
});
