#![no_main]

#[path = "../entries/gltf.rs"]
mod gltf;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    gltf::gltf_attributes(data);
});
