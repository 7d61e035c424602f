//! Memory that LLVM holds for further compilations can be released, and is mapped again on use.
//!
//! A separate test program, since it measures the memory of the process.
#![cfg(target_os = "linux")]

use rtsl_jit::{Llvm, OptLevel};

const FUNCTION: &str = "define float @f(float %a) {\n%b = fadd float %a, %a\nret float %b\n}";

/// Returns the resident file memory of this process, in kibibytes.
fn held_of_files() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells");
    let line = status.lines().find_map(|line| line.strip_prefix("RssFile:"));
    let number = line.and_then(|line| line.split_whitespace().next());
    number.and_then(|number| number.parse().ok()).expect("a number")
}

#[test]
fn compilers_go_on_after_their_memory_was_released() {
    let llvm = Llvm::load().expect("tests need an LLVM");
    let compile = || llvm.object(FUNCTION, llvm.host(), OptLevel::O2).expect("it compiles");
    let object = compile();
    let before = held_of_files();
    Llvm::release_memory();
    let after = held_of_files();
    assert!(after + (8 << 10) < before, "{before} KiB before, {after} after");
    assert_eq!(compile(), object);
}
