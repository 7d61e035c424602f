#![no_main]

#[path = "../entries/checkpoint.rs"]
mod checkpoint;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    checkpoint::checkpoint(data);
});
