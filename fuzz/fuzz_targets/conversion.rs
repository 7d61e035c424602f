#![no_main]

#[path = "../entries/scene.rs"]
mod scene;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    scene::conversion(data);
});
