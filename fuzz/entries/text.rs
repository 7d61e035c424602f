//! Reads arbitrary text as a shader.

use rtsl::{
    Backend, CallMode, Compiler, CompilerOptions, Emit, EmitRequest, Engine, EngineOptions,
    MemoryLoader, Target, Trace, TraceDetail,
};
use rtsl_source::{Diagnostics, SourceMap, render};
use rtsl_syntax::{parse, print};

/// Directives, macros and includes: the text can include itself by another name.
pub fn preprocessor(data: &[u8]) {
    let text = String::from_utf8_lossy(data).into_owned();
    let once = format!("#pragma once\n{text}");
    let files = [("again.rtsl", text.clone()), ("once.rtsl", once)];
    let start = format!("#include \"again.rtsl\"\n#include \"once.rtsl\"\n{text}");
    read(&start, files.map(|(name, text)| (name.to_owned(), text)));
}

/// The grammar.
pub fn parser(data: &[u8]) {
    read(&String::from_utf8_lossy(data), []);
}

fn read<const N: usize>(text: &str, files: [(String, String); N]) {
    let mut map = SourceMap::new();
    let file = map.add("fuzz.rtsl", text);
    let mut loader = MemoryLoader { files: files.into_iter().collect() };
    let mut diagnostics = Diagnostics::new();
    let unit = parse(&mut map, file, &mut loader, &mut diagnostics);
    print::print(&unit);
    render::all_to_text(&map, diagnostics.iter(), false);
}

/// Every stage up to LLVM text, and traced code for the interpreter. Gives whether the text compiled.
pub fn compile(data: &[u8]) -> bool {
    let text = String::from_utf8_lossy(data);
    trace(&text);
    emit(&text)
}

/// Links the traced methods of a text and makes kernels of them for the interpreter.
fn trace(text: &str) {
    let options =
        CompilerOptions { loop_budget: Some(1000), traced: true, ..CompilerOptions::default() };
    let compiler = Compiler::new(options);
    let compilation = compiler.compile_with("fuzz.rtsl", text, &mut MemoryLoader::default());
    let Some(unit) = &compilation.unit else { return };
    let options = EngineOptions {
        loop_budget: Some(1000),
        trace: Some(Trace::new(TraceDetail::Lines)),
        ..EngineOptions::default()
    };
    let (engine, _) = Engine::new(options).expect("the interpreter is always there");
    for class in unit.classes() {
        let program = engine.program_of_class(class);
        for method in class.methods.keys().copied() {
            // A limit may be passed; that is an error, not a failure.
            let _ = program.kernel(method, CallMode::Packet);
        }
    }
}

fn emit(text: &str) -> bool {
    let options = CompilerOptions { loop_budget: Some(1000), ..CompilerOptions::default() };
    let compiler = Compiler::new(options);
    let compilation = compiler.compile_with("fuzz.rtsl", text, &mut MemoryLoader::default());
    compilation.report(false);
    let Some(unit) = &compilation.unit else { return false };
    let options = EngineOptions {
        backend: Backend::Interpreter,
        width: Some(4),
        loop_budget: Some(1000),
        ..EngineOptions::default()
    };
    let (engine, _) = Engine::new(options).expect("the interpreter is always there");
    for class in unit.classes() {
        let program = engine.program_of_class(class);
        for method in class.methods.keys().copied() {
            for shape in CallMode::ALL {
                let target = Target::by_name("x86-64-v3");
                let request =
                    EmitRequest { emit: Emit::Llvm, method, variant: shape.into(), target };
                // A limit may be passed; that is an error, not a failure.
                let _ = program.emit(&request);
            }
        }
    }
    true
}
