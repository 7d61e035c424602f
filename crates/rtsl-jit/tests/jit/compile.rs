//! Compiles small modules with every LLVM of this machine.
//!
//! A process can load only one LLVM, so each library is tested in a separate process: this test program, started again
//! with `RTSL_LLVM` set.

use std::process::Command;
use std::sync::Arc;

use rtsl_jit::{JitError, Llvm, Module, OptLevel, Target};

const LEVELS: [OptLevel; 4] = [OptLevel::O0, OptLevel::O1, OptLevel::O2, OptLevel::O3];

/// Runs `test` of this program in a process with `RTSL_LLVM`.
fn with_llvm(test: &str, library: &std::path::Path) -> (bool, String) {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test, "--ignored", "--nocapture"])
        .env("RTSL_LLVM", library)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    (output.status.success(), text.into_owned())
}

#[test]
fn every_llvm_of_this_machine() {
    for library in Llvm::installed() {
        let (passed, text) = with_llvm("compile::one_llvm", &library);
        let refused = text.contains("is too old");
        assert!(passed || refused, "{}:\n{text}", library.display());
        println!("{}: {}", library.display(), if refused { "refused" } else { "serves" });
    }
}

#[test]
fn an_unusable_choice_is_an_error_that_says_why() {
    for (path, reason) in
        [("/nonexistent/libLLVM.so", "no such file"), ("/proc", "contains no LLVM library")]
    {
        let (passed, text) = with_llvm("compile::one_llvm", std::path::Path::new(path));
        assert!(!passed && text.contains(reason) && text.contains("RTSL_LLVM"), "{text}");
    }
}

/// All tests of one library; started by the tests above.
#[test]
#[ignore = "is run once for each library, in a process of its own"]
fn one_llvm() {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    runs_at_every_level(&llvm);
    keeps_multiply_and_add_apart(&llvm);
    emits_for_other_machines(&llvm);
    refuses_calls_to_libraries(&llvm);
    provides_the_runtime(&llvm);
    reports_bad_modules(&llvm);
    survives_fatal_errors(&llvm);
    works_on_many_threads(&llvm);
    keeps_the_last_modules(&llvm);
}

/// Returns the targets that this build of LLVM supports: packages for one architecture omit the others.
fn targets_of<'n>(llvm: &Arc<Llvm>, names: &[&'n str]) -> Vec<(&'n str, Target)> {
    let targets = names.iter().map(|name| (*name, Target::by_name(name).unwrap()));
    let (present, absent): (Vec<_>, Vec<_>) = targets.partition(|(_, target)| {
        !matches!(llvm.assembly("", target, OptLevel::O0), Err(JitError::UnknownTarget { .. }))
    });
    for (name, target) in absent {
        let (architecture, _) = target.triple().split_once('-').unwrap();
        assert!(!llvm.host().triple().starts_with(architecture), "{llvm:?} has no {name}");
        println!("{llvm:?} makes no code for {name}");
    }
    present
}

fn function<T>(module: &Module, name: &str) -> T {
    let address = module.function(name).unwrap();
    assert_eq!(size_of::<T>(), size_of_val(&address));
    // Safety: every caller gives the type that the function has in the text.
    #[allow(unsafe_code, reason = "calls the compiled code")]
    unsafe {
        std::mem::transmute_copy(&address)
    }
}

const SCALE: &str = r"
@table = private unnamed_addr constant [4 x float] [float 1.0, float 2.0, float 4.0, float 8.0]
define void @scale(ptr %data, i32 %index) nounwind {
    %v = load <8 x float>, ptr %data, align 4
    %wide = zext i32 %index to i64
    %entry = getelementptr [4 x float], ptr @table, i64 0, i64 %wide
    %factor = load float, ptr %entry
    %one = insertelement <8 x float> poison, float %factor, i32 0
    %all = shufflevector <8 x float> %one, <8 x float> poison, <8 x i32> zeroinitializer
    %product = fmul <8 x float> %v, %all
    %sum = fadd <8 x float> %product, <float 0.5, float 1.5, float 2.5, float 3.5, float 4.5, float 5.5, float 6.5, float 7.5>
    store <8 x float> %sum, ptr %data, align 4
    ret void
}";

fn runs_at_every_level(llvm: &Arc<Llvm>) {
    for level in LEVELS {
        let module = llvm.compile(SCALE, llvm.host(), level).unwrap();
        let scale: extern "C" fn(*mut f32, u32) = function(&module, "scale");
        let mut data = [1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        scale(data.as_mut_ptr(), 2);
        assert_eq!(data, [4.5, 9.5, 14.5, 19.5, 24.5, 29.5, 34.5, 39.5]);
        assert_eq!(
            module.function("other").unwrap_err(),
            JitError::MissingFunction("other".to_owned())
        );
    }
}

const MULTIPLY_ADD: &str = r"
declare float @llvm.fma.f32(float, float, float)
define float @apart(float %a, float %b, float %c) nounwind {
    %p = fmul float %a, %b
    %s = fadd float %p, %c
    ret float %s
}
define float @fused(float %a, float %b, float %c) nounwind {
    %s = call float @llvm.fma.f32(float %a, float %b, float %c)
    ret float %s
}";

fn keeps_multiply_and_add_apart(llvm: &Arc<Llvm>) {
    let (a, b) = (1.0 + f32::EPSILON, 1.0 - f32::EPSILON);
    for level in LEVELS {
        let module = llvm.compile(MULTIPLY_ADD, llvm.host(), level).unwrap();
        let apart: extern "C" fn(f32, f32, f32) -> f32 = function(&module, "apart");
        let fused: extern "C" fn(f32, f32, f32) -> f32 = function(&module, "fused");
        assert_eq!(apart(a, b, -1.0), 0.0, "{level:?}");
        assert_eq!(fused(a, b, -1.0), -f32::EPSILON * f32::EPSILON, "{level:?}");
        for (name, target) in targets_of(llvm, &["x86-64-v3", "x86-64-v4", "aarch64"]) {
            let text = llvm.assembly(MULTIPLY_ADD, &target, level).unwrap();
            let fused = text.lines().filter(|line| line.trim_start().contains("fmadd"));
            assert_eq!(fused.count(), 1, "{name}: {text}");
        }
    }
}

fn emits_for_other_machines(llvm: &Arc<Llvm>) {
    for (name, target) in targets_of(llvm, &["x86-64-v2", "x86-64-v3", "x86-64-v4", "aarch64"]) {
        let (instruction, machine) = match name {
            "x86-64-v2" => ("mulps", 62),
            "aarch64" => ("fmul", 183),
            _ => ("vmulps", 62),
        };
        let text = llvm.assembly(SCALE, &target, OptLevel::O2).unwrap();
        assert!(text.contains(instruction), "{name}: {text}");
        let object = llvm.object(SCALE, &target, OptLevel::O2).unwrap();
        assert_eq!((&object[..4], object[18]), (b"\x7fELF".as_slice(), machine));
        assert!(matches!(
            llvm.compile(SCALE, &target, OptLevel::O2),
            Err(JitError::ForeignTarget(_))
        ));
    }
    assert!(Target::by_name("pdp11").is_none());
}

const CALLS: &str = r"
declare float @powf(float, float)
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
define float @power(float %x) nounwind {
    %y = call float @powf(float %x, float %x)
    ret float %y
}";

fn refuses_calls_to_libraries(llvm: &Arc<Llvm>) {
    let error = llvm.compile(CALLS, llvm.host(), OptLevel::O2).unwrap_err();
    assert_eq!(error, JitError::UndefinedSymbol("powf".to_owned()));
}

const COPY: &str = r"
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
define void @copy(ptr %to, ptr %from, i64 %size) nounwind {
    call void @llvm.memset.p0.i64(ptr %to, i8 7, i64 %size, i1 false)
    %half = lshr i64 %size, 1
    call void @llvm.memcpy.p0.p0.i64(ptr %to, ptr %from, i64 %half, i1 false)
    ret void
}";

fn provides_the_runtime(llvm: &Arc<Llvm>) {
    let module = llvm.compile(COPY, llvm.host(), OptLevel::O2).unwrap();
    let copy: extern "C" fn(*mut u8, *const u8, usize) = function(&module, "copy");
    let (mut to, from) = ([0_u8; 6], [1_u8, 2, 3, 4, 5, 6]);
    copy(to.as_mut_ptr(), from.as_ptr(), 6);
    assert_eq!(to, [1, 2, 3, 7, 7, 7]);
}

fn reports_bad_modules(llvm: &Arc<Llvm>) {
    for text in [
        "garbage",
        "define void @f() { ret i32 0 }",
        "define void @f(i32 %x) {\n br i1 true, label %a, label %b\na:\n %y = add i32 %x, 1\n br label %b\nb:\n %z = add i32 %y, 1\n ret void\n}",
        "",
    ] {
        let result = llvm.compile(text, llvm.host(), OptLevel::O2);
        let accepted = text.is_empty();
        assert_eq!(result.is_ok(), accepted, "{text}");
        assert!(accepted || matches!(result, Err(JitError::InvalidModule(_))));
    }
}

/// An operation that the code generator cannot select ends the work, not the process.
fn survives_fatal_errors(llvm: &Arc<Llvm>) {
    let text = r#"
declare i32 @llvm.nvvm.read.ptx.sreg.tid.x()
define i32 @f() nounwind {
    %x = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
    ret i32 %x
}"#;
    let error = llvm.compile(text, llvm.host(), OptLevel::O2).unwrap_err();
    assert!(matches!(error, JitError::CodeGeneration(_) | JitError::InvalidModule(_)), "{error}");
    let inline =
        "define void @f() nounwind {\n call void asm \"no such instruction\", \"\"()\n ret void\n}";
    let error = llvm.compile(inline, llvm.host(), OptLevel::O2).unwrap_err();
    assert!(matches!(error, JitError::CodeGeneration(_)), "{error}");
    llvm.forget_modules().unwrap();
    runs_at_every_level(llvm);
}

fn works_on_many_threads(llvm: &Arc<Llvm>) {
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..8 {
                    llvm.forget_modules().unwrap();
                    runs_at_every_level(llvm);
                }
            });
        }
    });
}

/// A text that was compiled has its module again, unless others have taken the room since or it was forgotten.
fn keeps_the_last_modules(llvm: &Arc<Llvm>) {
    let compile = |text: &str, level| llvm.compile(text, llvm.host(), level).unwrap();
    let scale = compile(SCALE, OptLevel::O2);
    assert!(Arc::ptr_eq(&scale, &compile(SCALE, OptLevel::O2)));
    assert!(!Arc::ptr_eq(&scale, &compile(SCALE, OptLevel::O1)));
    assert!(!Arc::ptr_eq(&scale, &compile(COPY, OptLevel::O2)));
    for number in 0..24 {
        // A mebibyte each.
        let large = format!(
            "@large = private constant [1048576 x i8] c\"{}\"\ndefine ptr @f() nounwind {{\n ret ptr @large\n}}",
            format!("\\{number:02}").repeat(1 << 20)
        );
        let first = compile(&large, OptLevel::O2);
        assert!(first.size() > 1 << 20 && Arc::ptr_eq(&first, &compile(&large, OptLevel::O2)));
        if number < 8 {
            assert!(Arc::ptr_eq(&scale, &compile(SCALE, OptLevel::O2)), "used again, so kept");
        }
    }
    let again = compile(SCALE, OptLevel::O2);
    assert!(!Arc::ptr_eq(&scale, &again), "dropped");
    llvm.forget_modules().unwrap();
    assert!(!Arc::ptr_eq(&again, &compile(SCALE, OptLevel::O2)), "forgotten");
}
