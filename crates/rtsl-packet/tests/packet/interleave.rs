//! Tests of the choice of interleaving.

use rtsl_abi::{CallMode, Layout};
use rtsl_ir::{Function, VariableKind};
use rtsl_packet::Kernel;
use rtsl_packet::interleave::{FACTORS, choose};

fn lower(text: &str, mode: CallMode, width: u32) -> Kernel {
    let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
    rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error}"));
    let variables = |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
    let layout = Layout::new(
        variables(VariableKind::Member),
        variables(VariableKind::Buffer),
        variables(VariableKind::Scratch),
    );
    rtsl_packet::lower(&function, &layout, mode, width).unwrap()
}

/// A method that reads `x` and gives `r`.
fn method(body: &str) -> String {
    format!(
        "function f state rt_HitDistance: f32[1] state rt_RayOrigin: f32[3] local s: f32[8] {{
            %x: f32 = load state:rt_HitDistance@0 %one: f32 = constant 1.0
            {body}
            return state:rt_HitDistance@0 = %r
        }}"
    )
}

fn chosen(body: &str) -> Option<u32> {
    choose(&lower(&method(body), CallMode::Packet, 8), None)
}

#[test]
fn chains_of_roots_in_a_loop_are_interleaved_most() {
    let body = "%r: f32 = loop (%y: f32 = %x) {
        %a: f32 = sqrt %y %b: f32 = add %a, %one %c: f32 = sqrt %b
        %again: bool = less %one, %c
        repeat %again, %c
    }";
    assert_eq!(chosen(body), Some(4));
}

#[test]
fn short_code_is_interleaved_for_the_sake_of_its_loop() {
    assert_eq!(chosen("%r: f32 = divide %one, %x"), Some(4));
    assert_eq!(chosen("%r: f32 = multiply %x, %x"), Some(4));
    let accepting = method("%hit: bool = less %one, %x %r: f32 = add %x, %one")
        .replace("local s", "accepted rt_Accepted: bool[1] local s")
        .replace("return ", "return accepted:rt_Accepted@0 = %hit, ");
    assert_eq!(choose(&lower(&accepting, CallMode::Packet, 8), None), Some(2), "stores if any hit");
}

/// Independent sums, and a chain of short operations.
fn wide(sums: u32) -> String {
    let terms: Vec<String> = (0..sums)
        .map(|it| format!("%a{it}: f32 = constant {it}.5 %b{it}: f32 = add %x, %a{it}"))
        .collect();
    let chain = (1..sums).fold("%c0: f32 = multiply %b0, %b0 ".to_owned(), |text, it| {
        text + &format!("%c{it}: f32 = min %c{}, %b{it} ", it - 1)
    });
    format!("{} {chain} %r: f32 = add %c{}, %x", terms.join(" "), sums - 1)
}

#[test]
fn wide_code_is_not_interleaved() {
    assert_eq!(chosen(&wide(45)), Some(1));
    assert_eq!(chosen(&wide(120)), None, "too long for a function of its own");
}

#[test]
fn loops_are_interleaved_though_they_keep_the_machine_busy() {
    let wide = wide(60).replace("%r:", "%sum:");
    let body = format!(
        "%r: f32 = loop (%y: f32 = %x) {{ {wide} %again: bool = less %y, %one repeat %again, %sum }}"
    );
    assert_eq!(chosen(&body), Some(2));
}

#[test]
fn some_kernels_cannot_be_interleaved() {
    let forced = |body: &str, mode, width| {
        let kernel = lower(&method(body), mode, width);
        FACTORS.map(|factor| choose(&kernel, Some(factor)).is_some())
    };
    let root = "%r: f32 = sqrt %x";
    assert_eq!(forced(root, CallMode::Packet, 8), [true; 3]);
    assert_eq!(forced(root, CallMode::Packet, 1), [false; 3], "one ray");
    assert_eq!(forced("%r: f32 = rand", CallMode::Packet, 8), [true, false, false], "a request");
    let local = "%n: i32 = convert %x store local:s@%n, %x %r: f32 = load local:s@0";
    assert_eq!(forced(local, CallMode::Packet, 8), [true; 3], "a small array");
    let large = lower(&method(local).replace("f32[8]", "f32[100]"), CallMode::Packet, 8);
    assert_eq!(choose(&large, Some(2)), Some(2));
    assert_eq!(choose(&large, Some(4)), None, "a large array");
    let kernel = lower(&method(root), CallMode::Packet, 8);
    assert_eq!(choose(&kernel, Some(3)), None);
    let text = method(root).replace("return ", "return state:rt_RayOrigin@0 = %r, ");
    let kernel = lower(&text, CallMode::CommonOrigin, 8);
    assert_eq!(choose(&kernel, Some(1)), None, "the shared origin is overwritten");
    assert_eq!(choose(&lower(&text, CallMode::Packet, 8), Some(1)), Some(1));
}
