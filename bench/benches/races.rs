//! `cargo bench`: RTSL against hand-written SIMD.

fn main() -> std::process::ExitCode {
    rtsl_bench::command::main()
}
