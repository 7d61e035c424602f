#![no_main]

#[path = "../entries/ply.rs"]
#[allow(dead_code, reason = "other targets use the rest")]
mod ply;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    ply::obj(data);
});
