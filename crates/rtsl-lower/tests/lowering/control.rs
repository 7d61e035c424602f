//! Statements and jumps.

use rtsl_spec::Method;

use crate::harness::{class, count, eval, eval_with, text_of};

#[track_caller]
fn check(body: &str, cases: &[(f32, f32)]) {
    for (u, expected) in cases {
        assert_eq!(eval(body, *u), *expected, "for u = {u}: {body}");
    }
}

#[test]
fn branches_give_what_they_assign() {
    check("if (u > 0.5) result = 1.0; else result = 2.0;", &[(0.0, 2.0), (1.0, 1.0)]);
    check("result = 3.0; if (u > 0.5) result += u;", &[(0.0, 3.0), (1.0, 4.0)]);
    check(
        "if (u > 0.5) { if (u > 0.75) result = 1.0; } else { result = u; }",
        &[(1.0, 1.0), (0.6, 0.0), (0.25, 0.25)],
    );
}

#[test]
fn loops_count() {
    check("for (int i = 0; i < 5; i++) result += float(i);", &[(0.0, 10.0)]);
    check("int i = 0; while (i < int(u)) { result += 2.0; ++i; }", &[(0.0, 0.0), (3.0, 6.0)]);
    check("do { result += 1.0; } while (result < u);", &[(0.0, 1.0), (3.0, 3.0)]);
    check("for (int i = 0, j = 10; i < j; i++, j--) result = float(i * 100 + j);", &[(0.0, 406.0)]);
    check(
        "int n = 3; while (bool more = n > 0) { result += more ? 1.0 : 100.0; n--; }",
        &[(0.0, 3.0)],
    );
}

#[test]
fn break_and_continue_in_loops() {
    let body = "for (int i = 0; i < 10; i++) {
        if (i == 2) continue;
        if (float(i) > u) break;
        result = result * 10.0 + float(i);
    }";
    check(body, &[(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (4.0, 134.0)]);
    let body = "int i = 0;
    do { i++; if (i == 2) continue; result += float(i); } while (i < int(u));";
    check(body, &[(0.0, 1.0), (2.0, 1.0), (3.0, 4.0)]);
    let body = "for (;;) { result += 1.0; if (result > u) break; }";
    check(body, &[(0.0, 1.0), (3.5, 4.0)]);
}

#[test]
fn jumps_in_nested_loops_stay_inside() {
    let body = "for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            if (j == i) continue;
            if (float(j) > u) break;
            result += 1.0;
        }
        if (float(i) > u) break;
        result += 10.0;
    }";
    // For each i the j below or at u other than i, and 10 for each i up to u.
    check(body, &[(0.0, 11.0), (1.0, 24.0), (10.0, 39.0)]);
}

#[test]
fn return_leaves_all_loops() {
    let helper = "float find(float u) {
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++)
                if (float(i * j) >= u) return float(i * 10 + j);
        return -1.0;
    }";
    for (u, expected) in [(0.0, 0.0), (1.0, 11.0), (5.0, 23.0), (9.0, 33.0), (10.0, -1.0)] {
        assert_eq!(eval_with(helper, "result = find(u) + 100.0;", u), expected + 100.0, "{u}");
    }
}

#[test]
fn early_returns_need_no_flags() {
    let text = "class T : rt_Texture;
        float f(float x) { if (x < 0.0) return 0.0; if (x > 1.0) return 1.0; return x * 2.0; }
        void lookup() { rt_FloatTextureValue = f(rt_TextureUV.x); rt_TextureColor = color(1.0); }";
    let text = text_of(&class(text), Method::Lookup);
    assert_eq!(count(&text, "not") + count(&text, "or"), 0, "{text}");
    assert_eq!(count(&text, "if") + count(&text, "select"), 2, "{text}");
}

#[test]
fn return_inside_a_branch_skips_the_rest() {
    let helper = "float f(float u) {
        float x = 1.0;
        if (u > 1.0) { x = 2.0; if (u > 2.0) return x; x = 3.0; }
        x *= 10.0;
        if (u > 1.5) { if (u < 1.75) return x; }
        return x + 1.0;
    }";
    for (u, expected) in [(0.0, 11.0), (1.25, 31.0), (1.6, 30.0), (1.9, 31.0), (3.0, 2.0)] {
        assert_eq!(eval_with(helper, "result = f(u);", u), expected, "{u}");
    }
}

#[test]
fn a_function_may_end_without_return() {
    assert_eq!(eval_with("void f(out float x) { x = 4.0; }", "f(result);", 0.0), 4.0);
    let helper = "void f(float u, inout float x) { if (u > 0.5) return; x = 4.0; }";
    assert_eq!(eval_with(helper, "result = 1.0; f(u, result);", 1.0), 1.0);
    assert_eq!(eval_with(helper, "result = 1.0; f(u, result);", 0.0), 4.0);
}

#[test]
fn switch_falls_through_until_break() {
    let body = "switch (int(u)) {
        case 0: result += 1.0;
        case 1: result += 10.0; break;
        case 2: { result += 100.0; if (u > 2.25) break; }
        default: result += 1000.0;
        case 7: result += 10000.0;
    }";
    let expected =
        [(0.0, 11.0), (1.0, 10.0), (2.0, 11100.0), (2.5, 100.0), (3.0, 11000.0), (7.0, 10000.0)];
    check(body, &expected);
}

#[test]
fn default_may_come_first() {
    let body = "switch (uint(u)) { default: result = 1.0; break; case 3u: result = 2.0; }";
    check(body, &[(0.0, 1.0), (3.0, 2.0)]);
}

#[test]
fn continue_in_a_switch_continues_the_loop() {
    let body = "for (int i = 0; i < 6; i++) {
        switch (i) { case 1: continue; case 2: break; case 4: result += 100.0; break; }
        result += 1.0;
        if (i == 4) { switch (i) { case 4: break; } break; }
    }";
    check(body, &[(0.0, 104.0)]);
}

#[test]
fn return_in_a_switch() {
    let helper = "float f(int i) {
        for (;;) { switch (i) { case 0: return 1.0; case 1: i = 0; break; default: i--; } }
    }";
    assert_eq!(eval_with(helper, "result = f(int(u));", 4.0), 1.0);
}

#[test]
fn variables_jumped_over_by_a_switch_are_zero() {
    let body = "switch (int(u)) { case 0: float x = 5.0; case 1: result = x + 1.0; }";
    check(body, &[(0.0, 6.0), (1.0, 1.0)]);
}

#[test]
fn variables_are_reset_in_every_iteration() {
    let body = "for (int i = 0; i < 3; i++) { float x; x += 1.0; result += x; }";
    check(body, &[(0.0, 3.0)]);
}

#[test]
fn known_conditions_make_no_branches() {
    let text = "class T : rt_Texture;
        void lookup() {
            rt_TextureColor = color(1.0);
            if (1 > 2) rt_FloatTextureValue = 1.0; else rt_FloatTextureValue = rt_TextureUV.x;
        }";
    let text = text_of(&class(text), Method::Lookup);
    assert_eq!(count(&text, "if"), 0, "{text}");
}

#[test]
fn a_long_list_of_returns_does_not_nest_without_end() {
    let tests: String = (0..500).map(|i| format!("if (u < {i}.5) return {i}.0;\n")).collect();
    let helper = format!("float f(float u) {{ {tests} return -1.0; }}");
    assert_eq!(eval_with(&helper, "result = f(u);", 3.0), 3.0);
    assert_eq!(eval_with(&helper, "result = f(u);", 321.0), 321.0);
    assert_eq!(eval_with(&helper, "result = f(u);", 1000.0), -1.0);
}
