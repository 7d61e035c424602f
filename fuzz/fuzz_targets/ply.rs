#![no_main]

#[path = "../entries/ply.rs"]
mod ply;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    ply::ply(data);
});
