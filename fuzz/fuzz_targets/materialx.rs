#![no_main]

#[path = "../entrmaterialx/materialx.rs"]
mod materialx;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    materialx::materialx(data);
});
