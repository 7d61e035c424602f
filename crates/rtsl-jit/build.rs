//! Records the path of the Rust toolchain used for the build: its libLLVM is one that the program can load later, and a
//! known path avoids running `rustc`.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let sysroot = Command::new(rustc)
        .args(["--print", "sysroot"])
        .output()
        .ok()
        .filter(|output| output.status.success())
        .and_then(|output| String::from_utf8(output.stdout).ok());
    println!("cargo:rustc-env=RTSL_BUILD_SYSROOT={}", sysroot.as_deref().unwrap_or("").trim());
}
