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
        %n: f32 = negate %blue %k: f32 = multiply %n, %b %l: f32 = divide %k, %c
        %z: f32 = fma %l, %d, %a",
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
            "%x: f32, %y: f32, %z: f32, %n: f32 =
                loop (%r0: f32 = %a, %g0: f32 = %a, %b0: f32 = %a, %n0: f32 = %zero) {{
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

/// Operations that compute a factor move to before the request, or to before the operation around it.
#[test]
fn factors_from_behind_the_request() {
    check(
        &format!(
            "%p: f32, %q: f32, %s: f32 = if %t {{ {RAY} yield %red, %green, %blue }} else {{ yield %a, %a, %a }}
            %w: f32 = if %u {{ %e: f32 = sqrt %b yield %e }} else {{ yield %c }}
            %x: f32 = multiply %p, %w %y: f32 = multiply %q, %w %z: f32 = multiply %s, %w {COLOR}"
        ),
        expect![[r#"
            %6: f32 = if %5 {
              %7: f32 = sqrt %1
              yield %7
            } else {
              yield %2
            }
            %8: f32, %9: f32, %10: f32 = if %4 {
              query spawn %0, %1, %2, %0, %1, %2, %3, %6, %6, %6
              %11: f32 = constant 0.0
              %12: f32 = constant 0.0
              %13: f32 = constant 0.0
              yield %11, %12, %13
            } else {
              yield %0, %0, %0
            }
            %14: f32 = multiply %8, %6
            %15: f32 = multiply %9, %6
            %16: f32 = multiply %10, %6
            return state:rt_SampleColor@0 = %14, state:rt_SampleColor@1 = %15, state:rt_SampleColor@2 = %16
        "#]],
    );
}

#[test]
fn what_nobody_needs_is_not_asked_for() {
    check(
        &format!("{RAY} return state:rt_SampleColor@0 = %a"),
        expect![[r#"
        return state:rt_SampleColor@0 = %0
    "#]],
    );
}

#[test]
fn two_rays_that_are_multiplied() {
    check(
        &format!(
            "{RAY} %r2: f32, %g2: f32, %b2: f32 = trace %c, %b, %a, %a, %b, %c, %d, %one
            %x: f32 = multiply %red, %r2 return state:rt_SampleColor@0 = %x"
        ),
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32, %6: f32, %7: f32 = trace %2, %1, %0, %0, %1, %2, %3, %4
            %8: f32 = constant 0.0
            query spawn %0, %1, %2, %0, %1, %2, %3, %5, %8, %8
            %9: f32 = constant 0.0
            return state:rt_SampleColor@0 = %9
            kept Trace: DeferredFactor
        "#]],
    );
}

/// Values that only reports need have no influence.
#[test]
fn reports_do_not_count() {
    check_ray(
        "report print %red %k: bool = less %green, %a report condition %k
        %x: f32 = multiply %red, %b %y: f32 = multiply %green, %b %z: f32 = multiply %blue, %b",
        expect![[r#"
            query spawn %0, %1, %2, %0, %1, %2, %3, %1, %1, %1
            %4: f32 = constant 0.0
            report print %4
            %5: f32 = constant 0.0
            %6: bool = less %5, %0
            report condition %6
            %7: f32 = constant 0.0
            %8: f32 = constant 0.0
            %9: f32 = constant 0.0
            return state:rt_SampleColor@0 = %7, state:rt_SampleColor@1 = %8, state:rt_SampleColor@2 = %9
        "#]],
    );
}

#[test]
fn surfaces() {
    check(
        &format!(
            "%i: i32 = load scratch:i@0
            %red: f32, %green: f32, %blue: f32 =
                query shade %i, %i, %i, %a, %a, %a, %a, %a, %a, %a, %a, %a, %a, %a
            %w: f32 = sqrt %b
            %x: f32 = fma %red, %w, %a %y: f32 = add %green, %c %z: f32 = add %blue, %c {COLOR}"
        ),
        expect![[r#"
            %4: f32 = sqrt %1
            %5: f32 = constant 1.0
            %6: f32, %7: f32, %8: f32 = query own_shade %3, %3, %3, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0, %4, %5, %5
            %9: f32 = fma %6, %4, %0
            %10: f32 = add %7, %2
            %11: f32 = add %8, %2
            return state:rt_SampleColor@0 = %9, state:rt_SampleColor@1 = %10, state:rt_SampleColor@2 = %11
        "#]],
    );
    let text = deferred(&format!(
        "%i: i32 = load scratch:i@0
        %red: f32, %green: f32, %blue: f32 =
            query shade %i, %i, %i, %a, %a, %a, %a, %a, %a, %a, %a, %a, %a, %a
        %w: f32 = rand
        %x: f32 = multiply %red, %w %y: f32 = multiply %green, %w %z: f32 = multiply %blue, %w {COLOR}"
    ));
    assert!(text.contains("kept Shade: UnknownFactor"), "{text}");
}

/// A loop over lights: in its body, `%r0`, `%g0`, `%b0` and `%n0` are carried.
fn lights(body: &str, yields: &str, rest: &str) -> String {
    format!(
        "%count: i32 = light_count %i0: i32 = constant 0 %i1: i32 = constant 1
        %r4: f32, %g4: f32, %b4: f32, %n4: f32, %i4: i32 =
            loop (%r0: f32 = %zero, %g0: f32 = %zero, %b0: f32 = %zero, %n0: f32 = %d, %i: i32 = %i0) {{
            %found: bool, %lx: f32, %ly: f32, %lz: f32, %distance: f32, %lr: f32, %lg: f32, %lb: f32, %pdf: f32 =
                light_sample %i, %a, %b, %c, %zero, %zero, %one, %d
            %r3: f32, %g3: f32, %b3: f32, %n3: f32 =
                if %found {{ {body} yield {yields} }} else {{ yield %r0, %g0, %b0, %n0 }}
            %i3: i32 = add %i, %i1
            %more: bool = less %i3, %count
            repeat %more, %r3, %g3, %b3, %n3, %i3
        }} {rest}"
    )
}

const LIT: &str =
    "%r1: f32 = fma %lr, %a, %r0 %g1: f32 = add %lg, %g0 %b1: f32 = subtract %b0, %lb";

#[test]
fn sums_over_lights() {
    check(
        &lights(
            LIT,
            "%r1, %g1, %b1, %n0",
            "%w: f32 = sqrt %c %x: f32 = multiply %r4, %w %y: f32 = multiply %g4, %w %z: f32 = add %b4, %c
            return state:rt_SampleColor@0 = %x, state:rt_SampleColor@1 = %y, state:rt_SampleColor@2 = %z,
            state:rt_PDF@0 = %n4",
        ),
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = constant 0.0
            %6: i32 = light_count
            %7: i32 = constant 0
            %8: i32 = constant 1
            %9: f32 = sqrt %2
            %10: i32 = loop (%11: i32 = %7) {
              %12: bool, %13: f32, %14: f32, %15: f32, %16: f32, %17: f32, %18: f32, %19: f32, %20: f32, %21: f32 = query unshadowed_light %11, %0, %1, %2, %5, %5, %4, %3
              if %12 {
                %22: f32 = multiply %17, %0
                %23: f32 = negate %19
                %24: f32 = precise multiply %9, %22
                %25: f32 = precise multiply %9, %18
                query contribute %0, %1, %2, %13, %14, %15, %21, %24, %25, %23
                yield
              } else {
                yield
              }
              %26: i32 = add %11, %8
              %27: bool = less %26, %6
              repeat %27, %26
            }
            %28: f32 = constant 0.0
            %29: f32 = constant 0.0
            return state:rt_SampleColor@0 = %28, state:rt_SampleColor@1 = %29, state:rt_SampleColor@2 = %2, state:rt_PDF@0 = %3
        "#]],
    );
}

/// A branch, a select and a loop in the body; two sums that reach one component.
#[test]
fn bodies_that_branch() {
    let body = "%k: bool = less %pdf, %zero
        %r1: f32, %n1: f32 = if %k {
            %p: f32 = fma %lr, %a, %r0 yield %p, %n0
        } else { %q: f32 = fma %lr, %b, %n0 yield %r0, %q }
        %added: f32 = add %lg, %g0 %g1: f32 = select %k, %added, %g0
        %b1: f32, %m1: f32 = loop (%b2: f32 = %b0, %m: f32 = %zero) {
            %b3x: f32 = fma %lb, %m, %b2 %m2: f32 = add %m, %one %again: bool = less %m2, %pdf
            repeat %again, %b3x, %m2
        }";
    let rest = "%h: f32 = multiply %n4, %c %x: f32 = add %r4, %h
        return state:rt_SampleColor@0 = %x, state:rt_SampleColor@1 = %g4, state:rt_SampleColor@2 = %b4";
    check(
        &lights(body, "%r1, %g1, %b1, %n1", rest),
        expect![[r#"
        %4: f32 = constant 1.0
        %5: f32 = constant 0.0
        %6: i32 = light_count
        %7: i32 = constant 0
        %8: i32 = constant 1
        %9: i32 = loop (%10: i32 = %7) {
          %11: bool, %12: f32, %13: f32, %14: f32, %15: f32, %16: f32, %17: f32, %18: f32, %19: f32, %20: f32 = query unshadowed_light %10, %0, %1, %2, %5, %5, %4, %3
          if %11 {
            %21: bool = less %19, %5
            %22: f32, %23: f32 = if %21 {
              %24: f32 = multiply %16, %0
              %25: f32 = constant 0.0
              yield %24, %25
            } else {
              %26: f32 = multiply %16, %1
              %27: f32 = constant 0.0
              yield %27, %26
            }
            %28: f32 = constant 0.0
            %29: f32 = select %21, %17, %28
            %30: f32 = constant 0.0
            %31: f32, %32: f32 = loop (%33: f32 = %30, %34: f32 = %5) {
              %35: f32 = fma %18, %34, %33
              %36: f32 = add %34, %4
              %37: bool = less %36, %19
              repeat %37, %35, %36
            }
            %38: f32 = precise multiply %2, %23
            %39: f32 = precise add %22, %38
            query contribute %0, %1, %2, %12, %13, %14, %20, %39, %29, %31
            yield
          } else {
            yield
          }
          %40: i32 = add %10, %8
          %41: bool = less %40, %6
          repeat %41, %40
        }
        %42: f32 = multiply %3, %2
        %43: f32 = constant 0.0
        %44: f32 = constant 0.0
        return state:rt_SampleColor@0 = %42, state:rt_SampleColor@1 = %43, state:rt_SampleColor@2 = %44
    "#]],
    );
}

#[test]
fn reasons_of_lights() {
    let reason = |body: &str, yields: &str, rest: &str| {
        let text = deferred(&lights(body, yields, rest));
        let kept = text.lines().find_map(|line| line.strip_prefix("kept Light: "));
        assert_eq!(kept.is_some(), text.contains("light_sample"), "{text}");
        kept.map(str::to_owned)
    };
    let rest = "return state:rt_SampleColor@0 = %r4, state:rt_PDF@0 = %n4";
    let expected = |reason: Reason| Some(format!("{reason:?}"));
    let plain = format!("{LIT} %n1: f32 = add %n0, %one");
    let sums = "%r1, %g1, %b1, %n1";
    assert_eq!(reason(&plain, "%r1, %g1, %b1, %n0", rest), None);
    assert_eq!(reason(&plain, sums, rest), expected(Reason::OtherOutput));
    assert_eq!(reason(&plain, "%r1, %g1, %b1, %pdf", rest), expected(Reason::BodySets));
    let asks = format!("{LIT} %n1: f32 = rand");
    assert_eq!(reason(&asks, sums, rest), expected(Reason::BodyAsks));
    let scales = "%r1: f32 = multiply %lr, %r0 %g1: f32 = add %lg, %g0 %b1: f32 = add %lb, %b0";
    assert_eq!(reason(scales, "%r1, %g1, %b1, %n0", rest), expected(Reason::BodySets));
    let compares = "%k: bool = less %r0, %one %r1: f32 = select %k, %lr, %r0";
    assert_eq!(reason(compares, "%r1, %g0, %b0, %n0", rest), expected(Reason::Compared));
    let stores = format!("{LIT} %i5: i32 = convert %pdf store local:s@%i5, %pdf");
    let read = "%i6: i32 = convert %d %v: f32 = load local:s@%i6 %x: f32 = add %r4, %v
        return state:rt_SampleColor@0 = %x";
    assert_eq!(reason(&stores, "%r1, %g1, %b1, %n0", read), expected(Reason::BodySets));
    let used = "%l: f32 = select %found, %lr, %zero %r1: f32 = add %l, %r0";
    assert_eq!(reason(used, "%r1, %g0, %b0, %n0", rest), expected(Reason::SampleUsed));
    let multiplied = "%x: f32 = multiply %r4, %r4 return state:rt_SampleColor@0 = %x";
    assert_eq!(reason(LIT, "%r1, %g1, %b1, %n0", multiplied), expected(Reason::Multiplied));
    let random = "%n: f32 = rand %x: f32 = multiply %r4, %n return state:rt_SampleColor@0 = %x";
    assert_eq!(reason(LIT, "%r1, %g1, %b1, %n0", random), expected(Reason::UnknownFactor));
}

/// Long chains take neither much time nor much of the stack.
#[test]
fn long_chains_are_kept() {
    let mut rest = String::from("%x0: f32 = multiply %red, %b %m0: f32 = rand");
    for i in 1..20_000 {
        let p = i - 1;
        rest += &format!(" %m{i}: f32 = sqrt %m{p} %x{i}: f32 = multiply %x{p}, %m{i}");
    }
    let text = deferred(&format!("{RAY} {rest} return state:rt_SampleColor@0 = %x19999"));
    assert!(text.ends_with("kept Trace: TooLong\n"));
    let mut rest = String::from("%m0: f32 = sqrt %a");
    for i in 1..20_000 {
        rest += &format!(" %m{i}: f32 = sqrt %m{p}", p = i - 1);
    }
    rest += " %x: f32 = multiply %red, %m19999 return state:rt_SampleColor@0 = %x";
    let text = deferred(&format!("{RAY} {rest}"));
    assert!(text.contains("query spawn"), "a ray waits for what takes long to move");
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
    let stored = "%i: i32 = load scratch:i@0 store local:s@%i, %red %x: f32 = load local:s@%i";
    assert_eq!(x(stored), expected(Reason::Stored));
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
