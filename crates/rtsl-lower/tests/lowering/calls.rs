//! Calls and their arguments.

use crate::harness::eval_with;

#[test]
fn in_arguments_are_copies() {
    let helper = "float f(float x) { x += 1.0; return x; }
        float g(float x[2]) { x[0] = 9.0; return x[0] + x[1]; }";
    let body = "float a[2] = float[2](1.0, 2.0); result = f(u) + u * 10.0 + g(a) * 100.0 + a[0];";
    assert_eq!(eval_with(helper, body, 3.0), 4.0 + 30.0 + 1100.0 + 1.0);
}

#[test]
fn out_arguments_begin_as_zero_and_are_copied_at_the_return() {
    let helper = "float f(out float x, inout float y) { x += 1.0; y += x; return x; }";
    let body = "float a = 5.0; float b = u; float c = f(a, b); result = a + b * 10.0 + c * 100.0;";
    assert_eq!(eval_with(helper, body, 3.0), 1.0 + 40.0 + 100.0);
}

#[test]
fn the_last_copy_out_wins() {
    let helper = "void f(out float x, out float y) { x = 1.0; y = 2.0; }";
    assert_eq!(eval_with(helper, "f(result, result);", 0.0), 2.0);
}

#[test]
fn parts_of_variables_are_out_arguments() {
    let helper = "struct S { vec3 v; float a[6]; };
        void set(inout float x) { x += 10.0; }
        void swap(inout vec2 v) { v = v.yx; }";
    let body = "S s; s.v = vec3(1.0, 2.0, 3.0); int i = int(u);
        set(s.a[i]); set(s.a[i++]); swap(s.v.zx); set(s.v.y);
        result = s.a[3] + s.v.x * 100.0 + s.v.y * 1000.0 + s.v.z + float(i);";
    assert_eq!(eval_with(helper, body, 3.0), 20.0 + 300.0 + 12000.0 + 1.0 + 4.0);
}

#[test]
fn the_target_of_an_out_argument_is_found_before_the_call() {
    let helper = "private int at; float f(out float x) { at = 2; x = 7.0; return 1.0; }";
    let body = "float a[4]; at = int(u); f(a[at]); result = a[1] + a[2] * 10.0;";
    assert_eq!(eval_with(helper, body, 1.0), 7.0);
}

#[test]
fn implicit_conversions_of_out_arguments() {
    let helper = "void f(out int x) { x = 7; }";
    assert_eq!(eval_with(helper, "f(result);", 0.0), 7.0);
}

#[test]
fn functions_return_structs_and_arrays() {
    let helper = "struct S { float a; vec2 b; };
        S make(float x) { S s; s.a = x; s.b = vec2(x, x + 1.0); return s; }
        float[6] table(float x) { float t[6]; for (int i = 0; i < 6; i++) t[i] = x * float(i); \
        return t; }";
    let body = "result = make(u).b.y + table(u)[2] * 10.0 + table(u)[int(u)] * 100.0;";
    assert_eq!(eval_with(helper, body, 3.0), 4.0 + 60.0 + 900.0);
}

#[test]
fn overloads_and_prototypes() {
    let helper = "float f(float x); float f(vec2 x) { return f(x.x) + 1.0; }
        float f(float x) { return x * 2.0; }";
    assert_eq!(eval_with(helper, "result = f(vec2(u));", 3.0), 7.0);
}

#[test]
fn a_call_in_a_loop_begins_with_fresh_variables() {
    let helper = "float f(int i) { float t[5]; t[i] += 1.0; float s; for (int j = 0; j < 5; j++) s \
                  += t[j]; return s; }";
    let body = "for (int i = 0; i < 5; i++) result += f(i);";
    assert_eq!(eval_with(helper, body, 0.0), 5.0);
}
