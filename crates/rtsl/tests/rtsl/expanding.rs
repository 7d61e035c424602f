//! Short texts that become long programs: by macros, calls, loops, arrays and structs. What is made of them is in
//! proportion to what they say, or they get the error of a limit.

use rtsl::aot::AotOptions;
use rtsl::{
    Backend, CallMode, Compiler, Emit, EmitRequest, Engine, EngineOptions, Instance, Method,
};

/// The codes of limits.
const LIMITS: [&str; 5] = ["E0404", "E0451", "E0452", "E0453", "E0510"];

/// A text whose program doubles with each level at most.
struct Family {
    name: &'static str,
    text: fn(usize) -> String,
    /// The result of a text of 40 levels.
    deepest: Deepest,
}

#[derive(PartialEq)]
enum Deepest {
    Program,
    Limit,
    /// The error of a limit that other tests reach; getting there takes seconds.
    NotTried,
}

const FAMILIES: [Family; 8] = [
    Family { name: "macros", text: macros, deepest: Deepest::NotTried },
    Family { name: "arguments of macros", text: macro_arguments, deepest: Deepest::NotTried },
    Family { name: "calls", text: calls, deepest: Deepest::NotTried },
    Family { name: "choices", text: choices, deepest: Deepest::NotTried },
    Family { name: "loops", text: loops, deepest: Deepest::Program },
    Family { name: "arrays", text: arrays, deepest: Deepest::Limit },
    Family { name: "arrays of arrays", text: arrays_of_arrays, deepest: Deepest::Limit },
    Family { name: "structs", text: structs, deepest: Deepest::Limit },
];

fn texture(declarations: &str, body: &str) -> String {
    format!(
        "{declarations}class T : rt_Texture;\nvoid lookup() {{\nfloat x = rt_TextureUV.x, y = rt_TextureUV.y;\n\
         {body}\nrt_FloatTextureValue = x;\n}}\n"
    )
}

fn levels(depth: usize, level: impl Fn(usize) -> String) -> String {
    (1..=depth).map(level).collect()
}

fn macros(depth: usize) -> String {
    let doubled = levels(depth, |k| format!("#define A{k} A{0} A{0}\n", k - 1));
    texture(&format!("#define A0 x = x * y + 0.5;\n{doubled}"), &format!("A{depth}"))
}

fn macro_arguments(depth: usize) -> String {
    let (open, close) = ("D(".repeat(depth), ")".repeat(depth));
    texture("#define D(a) a a\n", &format!("{open}x = x * y + 0.5;{close}"))
}

fn calls(depth: usize) -> String {
    let doubled = levels(depth, |k| {
        format!("float f{k}(float x, float y) {{ return f{0}(f{0}(x, y), y); }}\n", k - 1)
    });
    let first = "float f0(float x, float y) { return x * y + 0.5; }\n";
    texture(&format!("{first}{doubled}"), &format!("x = f{depth}(x, y);"))
}

fn loops(depth: usize) -> String {
    let open = levels(depth, |k| format!("for (int i{k} = 0; i{k} < 2; i{k}++) {{ "));
    texture("", &format!("{open} x = x * y + 0.5; {}", "}".repeat(depth)))
}

fn arrays(depth: usize) -> String {
    let size = 1_u64 << depth.min(30);
    texture(
        "",
        &format!("float a[{size}]; a[int(x * 9.0)] = y; float b[{size}] = a; x = b[int(y)];"),
    )
}

fn arrays_of_arrays(depth: usize) -> String {
    let sizes = "[2]".repeat(depth);
    let place = "[int(x)]".repeat(depth);
    texture("", &format!("float a{sizes}; a{place} = y; float b{sizes} = a; x = b{place};"))
}

fn structs(depth: usize) -> String {
    let doubled = levels(depth, |k| format!("struct S{k} {{ S{0} a, b; }};\n", k - 1));
    let path = ".b".repeat(depth);
    texture(
        &format!("struct S0 {{ float x; }};\n{doubled}S{depth} same(S{depth} s) {{ return s; }}\n"),
        &format!("S{depth} s, t; s{path}.x = x * y; t = same(s); if (s == t) x = t{path}.x;"),
    )
}

fn choices(depth: usize) -> String {
    let doubled = levels(depth, |k| format!("#define C{k} (x > {k}.5 ? C{0} : C{0} + y)\n", k - 1));
    texture(&format!("#define C0 x * y\n{doubled}"), &format!("x = C{depth};"))
}

fn engine() -> Engine {
    let options =
        EngineOptions { backend: Backend::Interpreter, width: Some(16), ..Default::default() };
    Engine::new(options).expect("the interpreter needs nothing").0
}

/// The number of lines of packet code that a text becomes, or the code of the error.
fn size(engine: &Engine, text: &str) -> Result<usize, &'static str> {
    let compilation = Compiler::default().compile("test.rtsl", text);
    let Some(unit) = compilation.unit else {
        let error = compilation.diagnostics.iter().find(|it| it.is_error()).expect("a reason");
        return Err(error.code.as_str());
    };
    let instance = Instance::new(&unit.classes()[0], []).expect("it has no parameters");
    let (emit, method, variant) = (Emit::Packet, Method::Lookup, CallMode::Packet.into());
    let request = EmitRequest { emit, method, variant, target: None };
    let code = engine.program(&instance).emit(&request).map_err(|it| it.code.as_str())?;
    Ok(code.iter().filter(|byte| **byte == b'\n').count())
}

#[test]
fn code_grows_with_what_a_text_says() {
    let engine = engine();
    for Family { name, text, deepest } in FAMILIES {
        let sizes: Vec<usize> =
            (3..=7).map(|depth| size(&engine, &text(depth)).expect(name)).collect();
        for pair in sizes.windows(2) {
            assert!(pair[1] <= 2 * pair[0] + 16, "{name}: {sizes:?}");
        }
        if deepest == Deepest::NotTried {
            continue;
        }
        match (deepest, size(&engine, &text(40))) {
            (Deepest::Program, Ok(size)) => assert!(size < 2_000, "{name}: {size}"),
            (Deepest::Limit, Err(code)) => assert!(LIMITS.contains(&code), "{name}: {code}"),
            (_, found) => panic!("{name}: {found:?}"),
        }
    }
}

/// 6,561 numbers that all wait for their use, made by a short text.
fn waiting_numbers() -> String {
    let mut text =
        "#define S0(n) scratch float n;\n#define U0(n) n = (p = p * x + n);\n".to_owned();
    for level in 1..=4 {
        for each in ["S", "U"] {
            let calls: String =
                (0..9).map(|digit| format!("{each}{}(n##{digit}) ", level - 1)).collect();
            text += &format!("#define {each}{level}(n) {calls}\n");
        }
    }
    let (all, body) = ("S4(a)", "U4(a)");
    text + &format!(
        "class T : rt_Texture;\n{all}\nvoid lookup() {{ float x = rt_TextureUV.x, p = x;\n{body}\n}}\n"
    )
}

/// The compiler of machine code takes its time by the square of the number of values, so it does not begin with a
/// kernel that cannot fit the stack: what the error says is the need of the values alone.
#[test]
fn values_without_room_are_refused_before_machine_code() {
    let unit = Compiler::default().compile("test.rtsl", &waiting_numbers()).unit.expect("valid");
    let options = AotOptions { modes: vec![(CallMode::Packet, 16)], ..AotOptions::default() };
    let library = engine().aot_library(unit.classes(), &options).expect("it is short enough");
    if rtsl::Llvm::load().is_err() {
        return;
    }
    let error = library.object(None).unwrap_err();
    assert_eq!(error.code.as_str(), "E0510");
    let needed = "`rtsl_T_lookup_packet16` needs 411 KiB of stack for 16 rays at a time, where 256 KiB are allowed";
    assert_eq!(error.message, needed);
}
