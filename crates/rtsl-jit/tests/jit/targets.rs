//! Code for every named target: LLVM accepts the text, and inserts no call of a library, whose results may differ.

use rtsl_abi::{CallMode, Layout};
use rtsl_ir::VariableKind;
use rtsl_jit::{JitError, Llvm, OptLevel, Target};
use rtsl_llvm::TargetFeatures;
use rtsl_testing::functions::seeded_function;

/// The functions that a kernel may call: memory is copied and filled exactly, and helpers are in the module.
const ALLOWED: [&str; 3] = ["memset", "memcpy", "rtsl."];

/// Returns the symbols that assembly calls or jumps to.
fn called(assembly: &str) -> impl Iterator<Item = &str> {
    let lines = assembly.lines().map(str::trim);
    let calls = lines.filter_map(|line| {
        let (instruction, target) = line.split_once(char::is_whitespace)?;
        matches!(instruction, "call" | "callq" | "bl" | "b" | "jmp").then_some(target)
    });
    // Without indirect calls and labels of the function.
    let symbols = calls.map(str::trim).filter(|target| !target.starts_with(['*', '.', '#']));
    symbols.map(|symbol| symbol.trim_matches('"'))
}

fn is_of_host(llvm: &Llvm, target: &Target) -> bool {
    let (architecture, _) = target.triple().split_once('-').unwrap();
    llvm.host().triple().starts_with(architecture)
}

#[test]
fn no_target_calls_a_library() {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    for name in Target::NAMES {
        let target = Target::by_name(name).unwrap();
        let features = TargetFeatures::new(target.triple(), target.cpu(), target.features());
        let mut kernels = Vec::new();
        for seed in 0..4 * CallMode::ALL.len() as u64 {
            let function = seeded_function(seed, 250);
            let variables =
                |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
            let layout = Layout::new(
                variables(VariableKind::Member),
                variables(VariableKind::Buffer),
                variables(VariableKind::Scratch),
            );
            let width = [1, 4, 8, 16][seed as usize % 4];
            let mode = CallMode::ALL[seed as usize / 4 % CallMode::ALL.len()];
            let kernel = rtsl_packet::lower(&function, &layout, mode, width).unwrap();
            kernels.push((format!("kernel.{seed}"), kernel));
        }
        let kernels = kernels.iter().map(|(symbol, kernel)| (symbol.as_str(), kernel));
        let text = rtsl_llvm::emit(kernels, &features);
        let assembly = match llvm.assembly(&text, &target, OptLevel::O2) {
            Ok(assembly) => assembly,
            // Packages of LLVM for one architecture omit the others.
            Err(JitError::UnknownTarget { .. }) if !is_of_host(&llvm, &target) => {
                println!("{llvm:?} makes no code for {name}");
                continue;
            }
            Err(error) => panic!("{name}: {error}"),
        };
        // Calls are detected: the only target without fma calls its emulation.
        let emulates = called(&assembly).any(|symbol| symbol.starts_with("rtsl.fma"));
        assert_eq!(emulates, name == "x86-64-v2", "{name}");
        for symbol in called(&assembly) {
            let allowed = ALLOWED.iter().any(|prefix| symbol.starts_with(prefix));
            assert!(allowed, "{name} calls {symbol}");
        }
    }
}
