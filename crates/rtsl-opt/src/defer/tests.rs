//! Texts in, texts out.

use expect_test::{Expect, expect};
use rtsl_ir::{Function, verify::verify};

use super::{Reason, run};
use crate::dce;

/// The variables that bodies may use.
const VARIABLES: &str = "
    scratch f: f32[8] scratch i: i32[4] scratch b: bool[4] member m: f32[3]
    local s: f32[4] state rt_SampleColor: f32[3] state rt_PDF: f32[1]";

/// A continuation's values: `%a` to `%d`, `%t`, `%u`, `%one` and `%zero`.
const KNOWN: &str = "
    %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %c: f32 = load scratch:f@2
    %d: f32 = load scratch:f@3 %t: bool = load scratch:b@0 %u: bool = load scratch:b@1
    %one: f32 = constant 1 %zero: f32 = constant 0";

/// A ray with the answer `%r`, `%g`, `%b`.
const RAY: &str = "%red: f32, %green: f32, %blue: f32 = trace %a, %b, %c, %a, %b, %c, %d, %one";

fn function_of(body: &str) -> Function {
    let text = format!("function f {VARIABLES} {{ {KNOWN} {body} }}");
    let mut function: Function = text.parse().unwrap_or_else(|error| panic!("{error}\n{body}"));
    verify(&function).unwrap_or_else(|error| panic!("{error}"));
    dce::run(&mut function);
    function
}

/// The body after the pass, with the reasons of what is kept.
fn deferred(body: &str) -> String {
    let mut function = function_of(body);
    let kept = run(&mut function);
    verify(&function).unwrap_or_else(|error| panic!("{error}\n{function}"));
    dce::run(&mut function);
    function.renumber();
    let text = function.to_string();
    let (_, body) = text.split_once("\n{\n").expect("a body");
    let lines = body.lines().filter(|line| !line.contains("= load scratch:") && *line != "}");
    let lines = lines.map(|line| format!("{}\n", line.strip_prefix("  ").unwrap_or(line)));
    let kept = kept.iter().map(|it| format!("kept {:?}: {:?}\n", it.request, it.reason));
    lines.chain(kept).collect()
}

fn check(body: &str, expected: Expect) {
    expected.assert_eq(&deferred(body));
}

/// The colour is a ray's answer after these operations, which give `%x`, `%y` and `%z`.
fn check_ray(rest: &str, expected: Expect) {
    check(&format!("{RAY} {rest} {COLOR}"), expected);
}

const COLOR: &str = "return state:rt_SampleColor@0 = %x, state:rt_SampleColor@1 = %y,
    state:rt_SampleColor@2 = %z";

#[test]
fn factors_of_products_and_sums() {
    check_ray(
        "%p: f32 = multiply %red, %b %x: f32 = add %a, %p
        %q: f32 = multiply %c, %green %y: f32 = subtract %a, %q
        %n: f32 = negate %blue %k: f32 = multiply %n, %b %l: f32 = divide %k, %c %z: f32 = fma %l, %d, %a",
        expect![[r#"
            %4: f32 = negate %2
            %5: f32 = negate %1
            %6: f32 = precise divide %5, %2
            %7: f32 = precise multiply %6, %3
            query spawn %0, %1, %2, %0, %1, %2, %3, %1, %4, %7
            return state:rt_SampleColor@0 = %0, state:rt_SampleColor@1 = %0, state:rt_SampleColor@2 = %0
        "#]],
    );
}

#[test]
fn a_factor_of_one_is_no_operation() {
    check_ray(
        "%x: f32 = add %a, %red %y: f32 = multiply %one, %green %z: f32 = fma %a, %b, %blue",
        expect![[r#"
            %4: f32 = constant 1.0
            query spawn %0, %1, %2, %0, %1, %2, %3, %4, %4, %4
            %5: f32 = multiply %0, %1
            %6: f32 = constant 0.0
            return state:rt_SampleColor@0 = %0, state:rt_SampleColor@1 = %6, state:rt_SampleColor@2 = %5
        "#]],
    );
}

#[test]
fn branches() {
    check(
        &format!(
            "%x: f32, %y: f32, %z: f32 = if %t {{
                {RAY} %w: f32 = sqrt %b
                %p: f32 = fma %red, %w, %a %q: f32 = fma %w, %green, %a %s: f32 = fma %w, %blue, %a
                yield %p, %q, %s
            }} else {{ yield %a, %a, %a }} {COLOR}"
        ),
        expect![[r#"
            if %4 {
              %5: f32 = sqrt %1
              query spawn %0, %1, %2, %0, %1, %2, %3, %5, %5, %5
              yield
            } else {
              yield
            }
            return state:rt_SampleColor@0 = %0, state:rt_SampleColor@1 = %0, state:rt_SampleColor@2 = %0
        "#]],
    );
    check_ray(
        "%x: f32, %y: f32 = if %t {
            %w: f32 = sqrt %b %p: f32 = fma %red, %w, %a yield %p, %green
        } else { yield %red, %a }
        %z: f32 = select %u, %blue, %zero",
        expect![[r#"
            %6: f32 = constant 0.0
            %7: f32 = sqrt %1
            %8: f32 = constant 1.0
            %9: f32 = select %4, %7, %8
            %10: f32 = constant 0.0
            %11: f32 = select %4, %8, %10
            %12: f32 = select %5, %8, %10
            query spawn %0, %1, %2, %0, %1, %2, %3, %9, %11, %12
            %13: f32, %14: f32 = if %4 {
              %15: f32 = constant 0.0
              yield %0, %15
            } else {
              %16: f32 = constant 0.0
              yield %16, %0
            }
            %17: f32 = constant 0.0
            %18: f32 = select %5, %17, %6
            return state:rt_SampleColor@0 = %13, state:rt_SampleColor@1 = %14, state:rt_SampleColor@2 = %18
        "#]],
    );
}

#[test]
fn a_ray_waits_for_its_factor() {
    check_ray(
        "%w: f32 = rand %x: f32 = multiply %w, %red %y: f32 = multiply %w, %green %z: f32 = multiply %w, %blue",
        expect![[r#"
            %4: f32 = rand
            query spawn %0, %1, %2, %0, %1, %2, %3, %4, %4, %4
            %5: f32 = constant 0.0
            %6: f32 = constant 0.0
            %7: f32 = constant 0.0
            return state:rt_SampleColor@0 = %5, state:rt_SampleColor@1 = %6, state:rt_SampleColor@2 = %7
        "#]],
    );
}

#[test]
fn sums_of_loops() {
    check(
        &format!(
            "%x: f32, %y: f32, %z: f32, %n: f32 = loop (%r0: f32 = %a, %g0: f32 = %a, %b0: f32 = %a, %n0: f32 = %zero) {{
                {RAY}
                %r1: f32 = fma %red, %n0, %r0 %g1: f32 = fma %green, %n0, %g0 %b1: f32 = add %blue, %b0
                %n1: f32 = add %n0, %one %more: bool = less %n1, %d
                repeat %more, %r1, %g1, %b1, %n1
            }} {COLOR}"
        ),
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = constant 0.0
            %6: f32 = loop (%7: f32 = %5) {
              %8: f32 = constant 1.0
              query spawn %0, %1, %2, %0, %1, %2, %3, %7, %7, %8
              %9: f32 = add %7, %4
              %10: bool = less %9, %3
              repeat %10, %9
            }
            return state:rt_SampleColor@0 = %0, state:rt_SampleColor@1 = %0, state:rt_SampleColor@2 = %0
        "#]],
    );
}

#[test]
fn reasons() {
    let reason = |rest: &str| {
        let text = deferred(&format!("{RAY} {rest}"));
        let kept: Vec<&str> =
            text.lines().filter_map(|line| line.strip_prefix("kept Trace: ")).collect();
        assert_eq!(kept.len(), 1, "{text}");
        kept[0].to_owned()
    };
    let x = |rest: &str| reason(&format!("{rest} return state:rt_SampleColor@0 = %x"));
    let expected = |reason: Reason| format!("{reason:?}");
    assert_eq!(
        x("%k: bool = less %red, %a %x: f32 = select %k, %a, %b"),
        expected(Reason::Compared)
    );
    assert_eq!(x("%x: f32 = multiply %red, %red"), expected(Reason::Multiplied));
    assert_eq!(x("%x: f32 = divide %a, %red"), expected(Reason::Divisor));
    assert_eq!(x("%x: f32 = sqrt %red"), expected(Reason::Argument));
    assert_eq!(x("%x: f32 = add %a, %green"), expected(Reason::Mixed));
    assert_eq!(
        x("%k: bool = occluded %red, %a, %a, %a, %a, %a, %a %x: f32 = select %k, %a, %b"),
        expected(Reason::Asked)
    );
    assert_eq!(reason("return state:rt_PDF@0 = %red"), expected(Reason::OtherOutput));
    assert_eq!(
        x(
            "%x: f32 = loop (%s: f32 = %a) { %n: f32 = fma %red, %b, %s %more: bool = less %b, %c repeat %more, %n }"
        ),
        expected(Reason::Repeated)
    );
    assert_eq!(
        x(
            "%x: f32 = loop (%s: f32 = %red) { %n: f32 = multiply %b, %s %more: bool = less %b, %c repeat %more, %n }"
        ),
        expected(Reason::Repeated)
    );
    assert_eq!(
        x(
            "%x: f32 = if %t { %w: f32 = rand %p: f32 = multiply %red, %w yield %p } else { yield %zero }"
        ),
        expected(Reason::UnknownFactor)
    );
}
