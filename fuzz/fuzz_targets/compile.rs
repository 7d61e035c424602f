#![no_main]

#[path = "../entries/text.rs"]
#[allow(dead_code, reason = "each target runs one of its functions")]
mod text;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    text::compile(data);
});
