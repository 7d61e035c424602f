//! The stages that a test file's input passes through. [`MODES`] has an entry for each stage that can be printed.

use std::sync::Arc;

use libtest_mimic::Failed;
use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compilation, Compiler, CompilerOptions, Emit,
    EmitRequest, Engine, EngineOptions, Instance, Instances, LaneIndices, LaneMask, Method,
    Outputs, Target, Variant, lookup_state, new_state, set_defaults,
};
use rtsl_ir::Function;
use rtsl_source::{Diagnostics, SourceMap, render};
use rtsl_syntax::MemoryLoader;
use rtsl_syntax::ast::TranslationUnit;

use crate::file::TestFile;

/// A way to turn an input into text.
pub struct Mode {
    /// The name in test files.
    pub name: &'static str,
    /// Gives the text that the expectation is compared with.
    pub run: fn(&TestFile<'_>) -> Result<String, Failed>,
}

/// All modes; `tests/README.md` describes them.
pub const MODES: &[Mode] = &[
    Mode { name: "ast", run: ast },
    Mode { name: "syntax-errors", run: syntax_errors },
    Mode { name: "lower", run: lower },
    Mode { name: "diagnostics", run: diagnostics },
    Mode { name: "ir", run: |test| emit(test, Emit::Ir) },
    Mode { name: "packet", run: |test| emit(test, Emit::Packet) },
    Mode { name: "llvm", run: |test| emit(test, Emit::Llvm) },
    Mode { name: "profile", run: profile },
    Mode { name: "verify", run: verify },
    Mode { name: "passes", run: passes },
];

/// The mode of this name.
pub fn find(name: &str) -> Option<&'static Mode> {
    MODES.iter().find(|mode| mode.name == name)
}

/// The tree of a text without errors.
fn ast(test: &TestFile<'_>) -> Result<String, Failed> {
    let (map, unit, diagnostics) = parse(test);
    if diagnostics.has_errors() {
        return Err(render::all_to_text(&map, diagnostics.iter(), false).into());
    }
    Ok(rtsl_syntax::print::print(&unit))
}

/// The diagnostics of preprocessor and parser.
fn syntax_errors(test: &TestFile<'_>) -> Result<String, Failed> {
    let (map, _, diagnostics) = parse(test);
    Ok(render::all_to_text(&map, diagnostics.iter(), false))
}

/// The functions of a text's classes as the lowering makes them: the methods that the first line names,
/// or the constructor and all methods. With `traced`, they keep their prints.
fn lower(test: &TestFile<'_>) -> Result<String, Failed> {
    let (_, text) = test.files().into_iter().next().unwrap_or_default();
    let traced = test.arguments.contains(&"traced");
    let compiler = Compiler::new(CompilerOptions { traced, ..CompilerOptions::default() });
    let compilation = compiler.compile("test.rtsl", &text);
    let Some(unit) = &compilation.unit else { return Err(compilation.report(false).into()) };
    let mut printed = String::new();
    for class in unit.classes() {
        let methods = test.arguments.iter().filter(|it| **it != "traced");
        let methods: Vec<&str> = methods.copied().collect();
        let wanted = |name: &str| methods.is_empty() || methods.contains(&name);
        let constructor = class.constructor.iter().filter(|_| wanted("constructor"));
        let methods = class.methods.iter().filter(|(method, _)| wanted(method.name()));
        for function in constructor.chain(methods.map(|(_, function)| function)) {
            rtsl_ir::verify::verify(function)?;
            let mut function = function.clone();
            function.renumber();
            printed.push_str(&function.to_string());
        }
    }
    Ok(printed)
}

/// The messages of the reader and of the verifier for each function of the IR.
fn verify(test: &TestFile<'_>) -> Result<String, Failed> {
    let mut text = String::new();
    for (name, function) in test.files() {
        let verdict = match function.parse::<Function>() {
            Ok(function) => match rtsl_ir::verify::verify(&function) {
                Ok(()) => "verified".to_owned(),
                Err(error) => error.to_string(),
            },
            Err(error) => error.to_string(),
        };
        text.push_str(&format!("{name}: {verdict}\n"));
    }
    Ok(text)
}

/// A function of the IR after the passes that the first line names, or after all of them.
fn passes(test: &TestFile<'_>) -> Result<String, Failed> {
    let (_, text) = test.files().into_iter().next().unwrap_or_default();
    let mut function: Function = text.parse()?;
    rtsl_ir::verify::verify(&function)?;
    for name in &test.arguments {
        let pass = rtsl_opt::PASSES.iter().find(|(known, _)| known == name);
        let (_, run) = pass.ok_or_else(|| format!("there is no pass `{name}`"))?;
        run(&mut function);
        rtsl_ir::verify::verify(&function).map_err(|error| format!("after {name}: {error}"))?;
    }
    if test.arguments.is_empty() {
        rtsl_opt::optimize(&mut function, &rtsl_opt::Options::default());
    }
    function.renumber();
    Ok(function.to_string())
}

/// Everything that the compiler says of a text.
fn diagnostics(test: &TestFile<'_>) -> Result<String, Failed> {
    Ok(compile(test).report(false))
}

/// A method in one of its forms. The mode's further arguments: `reads=` for a caller that reads
/// these variables, `known` for one that knows the members to be the defaults.
fn emit(test: &TestFile<'_>, emit: Emit) -> Result<String, Failed> {
    let Asked { class, method, shape, engine } = Asked::by(test)?;
    let program = engine.program_of_class(&class);
    let mut variant = Variant::new(shape);
    if let Some(names) = test.argument("reads") {
        let variables = names.split(',').map(|name| lookup_state(name).ok_or(name));
        let variables = variables.collect::<Result<Vec<_>, _>>();
        let variables = variables.map_err(|name| format!("there is no variable `{name}`"))?;
        variant = variant.reading(Outputs::state(variables));
    }
    if test.arguments.contains(&"known") {
        let instance = Instance::new(&class, []).map_err(|problems| format!("{problems:?}"))?;
        variant = variant.knowing(program.known_members(&instance));
    }
    // The text for a named machine needs no LLVM.
    let target = Target::by_name("x86-64-v3");
    let request = EmitRequest { emit, method, variant, target };
    let text = program.emit(&request).map_err(|error| error.message)?;
    Ok(String::from_utf8(text)?)
}

/// The profile of the packet code of a method for `rays=` rays, 8 if not given. Ray `i` has the default
/// and `i / 8` in every float of its state. Scratch is zero, the host has nothing.
fn profile(test: &TestFile<'_>) -> Result<String, Failed> {
    let Asked { class, method, shape, engine } = Asked::by(test)?;
    let count = test.argument("rays").map_or(Ok(8), str::parse)?;
    let instance = Instance::new(&class, []).map_err(|_| "the class needs parameters")?;
    let program = engine.program(&instance);
    let kernel = program.packet_kernel(method, shape).map_err(|error| error.message)?;
    let block = program.block(&instance);
    let indices = LaneIndices::new(count);
    let objects = program.objects(std::iter::repeat_n(&*instance, count.max(1)));
    let mut state = new_state(count);
    let mut roles = class.roles.iter().filter(|role| method.roles().contains(role));
    set_defaults(&mut state, *roles.next().ok_or("the class lacks the method's role")?);
    for component in 0..state.components() {
        let floats = state.floats_mut(component).iter_mut().enumerate();
        floats.for_each(|(ray, float)| *float += ray as f32 / 8.0);
    }
    let call = CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(count),
        count,
        mask: None,
        accepted: Some(&mut LaneMask::new(count)),
        instances: match shape {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => Instances::One(&block),
            CallMode::Stream => Instances::Many(&objects, &indices),
            CallMode::Leaf => Instances::Range(&objects, 0),
        },
        host: &mut NoHost,
    };
    Ok(kernel.run(call, u64::MAX).profile.to_string())
}

/// The mode's arguments: `class=` where there are several, `method=`, `shape=` and
/// `width=` where they matter.
struct Asked {
    class: Arc<Class>,
    method: Method,
    shape: CallMode,
    /// Needs no LLVM.
    engine: Engine,
}

impl Asked {
    fn by(test: &TestFile<'_>) -> Result<Asked, Failed> {
        let compilation = compile(test);
        let unit = compilation.unit.as_ref().ok_or_else(|| compilation.report(false))?;
        let class = match test.argument("class") {
            Some(name) => unit.class(name).map_err(|error| error.message)?,
            None => unit.classes().first().ok_or("the text has no class")?,
        };
        let method = test.argument("method").ok_or("the mode needs `method=`")?;
        let shape = test.argument("shape").unwrap_or("packet");
        let width = test.argument("width").map(str::parse).transpose()?;
        let options =
            EngineOptions { backend: Backend::Interpreter, width, ..EngineOptions::default() };
        let (engine, _) = Engine::new(options).map_err(|error| error.message)?;
        Ok(Asked {
            class: class.clone(),
            method: Method::from_name(method).ok_or("there is no such method")?,
            shape: CallMode::from_name(shape).ok_or("there is no such shape")?,
            engine,
        })
    }
}

fn compile(test: &TestFile<'_>) -> Compilation {
    let files = test.files();
    let (name, text) = &files[0];
    let mut loader = MemoryLoader { files: files.iter().cloned().collect() };
    Compiler::default().compile_with(name, text, &mut loader)
}

fn parse(test: &TestFile<'_>) -> (SourceMap, TranslationUnit, Diagnostics) {
    let mut files = test.files().into_iter();
    let (name, text) = files.next().unwrap_or_default();
    let mut map = SourceMap::new();
    let file = map.add(name.clone(), text.clone());
    // The file itself is there too, so that it can include itself.
    let mut loader = MemoryLoader { files: files.collect() };
    loader.files.insert(name, text);
    let mut diagnostics = Diagnostics::new();
    let unit = rtsl_syntax::parse(&mut map, file, &mut loader, &mut diagnostics);
    (map, unit, diagnostics)
}
