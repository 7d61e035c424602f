//! The program `rtsl`.

fn main() -> std::process::ExitCode {
    rtsl_cli::main()
}
