//! Tests of the generated text: functions in, C++ out.

use expect_test::{Expect, expect};
use rtsl_abi::description::{ClassDescription, Field, FieldKind, LibraryDescription};
use rtsl_cpp::{ClassCode, emit};
use rtsl_ir::Function;
use rtsl_spec::Method;

const VARIABLES: &str = "
state rt_RayOrigin: f32[3]
state rt_HitDistance: f32[1]
member radius: f32[1]
member weights: f32[4]
member count: i32[1]
member mask: u32[1]
member flag: bool[1]
buffer points: f32[3]
scratch kept: f32[2]
local stack: f32[4]
accepted accepted: bool[1]
";

fn class() -> ClassDescription {
    let mut offset = 0;
    let mut field = |name: &str, kind, scalar, len, words: u32| {
        let field = Field { name: name.to_owned(), kind, scalar, len, offset };
        offset += words;
        field
    };
    use rtsl_ir::Scalar::{Bool, F32, I32, U32};
    let fields = vec![
        field("points", FieldKind::Buffer, F32, 3, 4),
        field("radius", FieldKind::Member, F32, 1, 1),
        field("weights", FieldKind::Member, F32, 4, 4),
        field("count", FieldKind::Member, I32, 1, 1),
        field("mask", FieldKind::Member, U32, 1, 1),
        field("flag", FieldKind::Member, Bool, 1, 1),
    ];
    let kept =
        Field { name: "kept".to_owned(), kind: FieldKind::Scratch, scalar: F32, len: 2, offset: 0 };
    let mut initial = vec![0; 12];
    initial[4] = 1f32.to_bits();
    initial[6] = 0.5f32.to_bits();
    initial[11] = 1;
    ClassDescription {
        name: "Thing".to_owned(),
        documentation: Some("A thing. */ int x;\\".to_owned()),
        roles: Vec::new(),
        parameters: Vec::new(),
        element: None,
        fields,
        block_words: 12,
        construct_words: 12,
        initial,
        scratch: vec![kept],
        scratch_arrays: 2,
        constructor: None,
        method_documentation: Default::default(),
        kernels: Vec::new(),
    }
}

fn text(body: &str) -> String {
    let function: Function =
        format!("function Thing.shade\n{VARIABLES}{{{body}}}").parse().unwrap();
    let library = LibraryDescription { prefix: "test".to_owned(), classes: vec![class()] };
    let code = ClassCode { constructors: Vec::new(), methods: vec![(Method::Shade, &function)] };
    emit(&library, &[code])
}

/// Checks the statements of a method.
fn check(body: &str, expected: Expect) {
    let text = text(body);
    let start = text.find(" shade(").expect("there is the method");
    let method = &text[start..];
    let (_, rest) = method.split_once('\n').unwrap();
    let end = rest.find("\n    }\n").unwrap();
    let body: String = rest[..end]
        .lines()
        .map(|line| format!("{}\n", line.strip_prefix("        ").unwrap_or(line)))
        .collect();
    expected.assert_eq(&body);
}

#[test]
fn arithmetic_on_floats() {
    check(
        "
        %a: f32 = load member:radius@0 %b: f32 = load state:rt_RayOrigin@1
        %sum: f32 = add %a, %b %difference: f32 = subtract %sum, %a %product: f32 = multiply %difference, %b
        %ratio: f32 = divide %product, %a %least: f32 = min %ratio, %b %greatest: f32 = max %least, %a
        %f: f32 = fma %greatest, %a, %b %n: f32 = negate %f %abs: f32 = abs %n %root: f32 = sqrt %abs
        %floor: f32 = floor %root %ceil: f32 = ceil %floor %trunc: f32 = trunc %ceil %even: f32 = round_even %trunc
        %r: f32 = approximate_reciprocal %even %i: f32 = approximate_inverse_sqrt %r %s: f32 = approximate_sqrt %i
        return scratch:kept@0 = %s",
        expect![[r#"
            const float sum = fused(std::fma(maximum(minimum((radius + state.rt_RayOrigin[1] - radius)
                                * state.rt_RayOrigin[1] / radius, state.rt_RayOrigin[1]), radius),
                    radius, state.rt_RayOrigin[1]));
            const float ratio = 1.0f
                / std::sqrt(1.0f
                        / std::nearbyint(std::trunc(std::ceil(std::floor(std::sqrt(std::fabs(-sum)))))));
            scratch.kept[0] = std::sqrt(ratio);
        "#]],
    );
}

#[test]
fn products_that_go_into_sums_are_rounded_before() {
    check(
        "
        %a: f32 = load member:radius@0 %b: f32 = load state:rt_RayOrigin@1 %c: bool = load member:flag@0
        %p: f32 = multiply %a, %b %sum: f32 = add %p, %a
        %q: f32 = multiply %b, %b %n: f32 = negate %q %chosen: f32 = select %c, %n, %a
        %difference: f32 = subtract %sum, %chosen
        %r: f32 = multiply %a, %a %alone: f32 = multiply %r, %b
        return scratch:kept@0 = %difference, scratch:kept@1 = %alone",
        expect![[r#"
            scratch.kept[0] = rounded(radius * state.rt_RayOrigin[1]) + radius
                - (flag != 0u ? -rounded(state.rt_RayOrigin[1] * state.rt_RayOrigin[1]) : radius);
            scratch.kept[1] = radius * radius * state.rt_RayOrigin[1];
        "#]],
    );
}

#[test]
fn fused_sums_that_are_negated_are_computed_before() {
    check(
        "
        %a: f32 = load member:radius@0 %b: f32 = load state:rt_RayOrigin@1 %c: bool = load member:flag@0
        %sum: f32 = fma %a, %b, %a %chosen: f32 = select %c, %sum, %a %negative: f32 = negate %chosen
        %other: f32 = fma %a, %a, %b
        return scratch:kept@0 = %negative, scratch:kept@1 = %other",
        expect![[r#"
            scratch.kept[0] = -(flag != 0u
                ? fused(std::fma(radius, state.rt_RayOrigin[1], radius))
                : radius);
            scratch.kept[1] = std::fma(radius, radius, state.rt_RayOrigin[1]);
        "#]],
    );
}

#[test]
fn arithmetic_on_integers() {
    check(
        "
        %i: i32 = load member:count@0 %u: u32 = load member:mask@0 %five: u32 = constant 5
        %a: i32 = add %i, %i %b: i32 = subtract %a, %i %c: i32 = multiply %b, %i %d: i32 = divide %c, %i
        %e: i32 = remainder %d, %i %f: i32 = shift_left %e, %i %g: i32 = shift_right %f, %i
        %h: i32 = multiply_high %g, %i %j: i32 = negate %h %k: i32 = abs %j %l: i32 = not %k %m: i32 = and %l, %i
        %n: i32 = or %m, %i %o: i32 = xor %n, %i %p: i32 = min %o, %i
        %v: u32 = add %u, %five %w: u32 = multiply %v, %u %x: u32 = shift_left %w, %five
        %y: u32 = shift_right %x, %u %z: u32 = divide %y, %five %q: u32 = remainder %z, %u %r: u32 = negate %q
        %fi: f32 = convert %p %fu: f32 = convert %r
        return scratch:kept@0 = %fi, scratch:kept@1 = %fu",
        expect![[r#"
            const int32_t value = multiply_high(shift_right(shift_left(modulo(quotient(wrapping_multiply(wrapping_subtract(wrapping_add(count,
                                            count), count), count), count), count), count), count),
                count);
            scratch.kept[0] = float(minimum(((~wrapping_abs(wrapping_negate(value)) & count) | count)
                        ^ count, count));
            scratch.kept[1] = float(0u
                    - modulo(shift_right(((mask + 5u) * mask) << 5u, mask) / 5u, mask));
        "#]],
    );
}

#[test]
fn conversions_and_bits() {
    check(
        "
        %f: f32 = load member:radius@0 %flag: bool = load member:flag@0
        %i: i32 = convert %f %u: u32 = convert %f %b: bool = convert %f
        %bits: u32 = bitcast %f %signed: i32 = bitcast %f %back: f32 = bitcast %bits
        %other: f32 = bitcast %signed %fi: f32 = convert %i %fu: f32 = convert %u
        %both: bool = and %b, %flag %either: bool = or %both, %b %differs: bool = xor %either, %flag
        %not: bool = not %differs %seldom: bool = seldom %not %number: f32 = convert %seldom
        %x: f32 = min %back, %other %y: f32 = min %fi, %fu %z: f32 = min %y, %number
        return scratch:kept@0 = %x, scratch:kept@1 = %z",
        expect![[r#"
            const bool differs = flag != 0u;
            const bool differs2 = radius != 0.0f;
            const float least = minimum(float(to_int(radius)), float(to_uint(radius)));
            scratch.kept[0] = minimum(float_of(bits_of(radius)),
                float_of(uint32_t(int32_t(bits_of(radius)))));
            scratch.kept[1] = minimum(least, float(((differs2 && differs) || differs2) == differs));
        "#]],
    );
}

#[test]
fn variables_and_indices() {
    check(
        "
        %i: i32 = load member:count@0 %four: i32 = constant 4 %zero: i32 = constant 0 %last: i32 = constant 3
        %w: f32 = load member:weights@%i %v: f32 = load member:weights@2
        %max: i32 = max %i, %zero %min: i32 = min %max, %last
        store local:stack@%i, %w
        store local:stack@1, %v
        %s: f32 = load local:stack@%min
        %p: f32 = load buffer:points@%i %q: f32 = load buffer:points@2 %n: i32 = length buffer:points
        %f: f32 = convert %n
        %x: f32 = max %s, %p %y: f32 = max %q, %f
        %old: f32 = load scratch:kept@1
        return scratch:kept@0 = %old, scratch:kept@1 = %x, state:rt_RayOrigin@2 = %y",
        expect![[r#"
            float stack[4] = {};
            stack[clamped_index(count, 4)] = weights[clamped_index(count, 4)];
            stack[1] = weights[2];
            const float stack2 = stack[minimum(maximum(count, 0), 3)];
            const float kept2 = scratch.kept[1];
            scratch.kept[0] = kept2;
            scratch.kept[1] = maximum(stack2, points[count]);
            state.rt_RayOrigin[2] = maximum(points[2], float(points.length()));
        "#]],
    );
}

#[test]
fn branches_and_loops() {
    check(
        "
        %c: bool = load member:flag@0 %a: f32 = load member:radius@0 %n: i32 = load member:count@0
        %zero: i32 = constant 0 %one: i32 = constant 1
        %x: f32, %unused: f32 = if %c {
            %y: f32 = sqrt %a %z: f32 = if %c { %r: f32 = rand yield %r } else { yield %a }
            yield %y, %z
        } else { yield %a, %a }
        %i: i32, %last: f32, %previous: f32 = loop (%j: i32 = %zero, %k: f32 = %x, %l: f32 = %a) {
            %next: i32 = add %j, %one
            %again: bool = less %next, %n
            %small: bool = less %k, %l
            %m: f32 = if %small { %h: f32 = floor %l %t: f32 = rand %sum: f32 = add %h, %t yield %sum } else { yield %l }
            repeat %again, %next, %m, %k
        }
        return scratch:kept@0 = %last, scratch:kept@1 = %previous",
        expect![[r#"
            const bool differs = flag != 0u;
            float result = radius;
            if (differs) {
                float result2 = radius;
                if (differs) {
                    const float random = host.rand();
                    result2 = random;
                }
                result = std::sqrt(radius);
            }
            int32_t result2 = 0;
            float result3 = result;
            float result4 = radius;
            for (;;) {
                const int32_t sum = wrapping_add(result2, 1);
                float result5 = result4;
                if (result3 < result4) {
                    const float random = host.rand();
                    result5 = std::floor(result4) + random;
                }
                result2 = sum;
                result4 = result3;
                result3 = result5;
                if (!(sum < count)) break;
            }
            scratch.kept[0] = result3;
            scratch.kept[1] = result4;
        "#]],
    );
}

/// A loop that starts with `%i` and computes a sum while the condition holds for the next `%i`.
fn sum_while(guard: &str, rest: &str) -> String {
    format!(
        "%zero: i32 = constant 0 %one: i32 = constant 1 %ten: i32 = constant 10 %f: f32 = constant 0
        %n: i32 = load member:count@0 %a: f32 = load member:radius@0
        {guard}
            %i: i32, %sum: f32 = loop (%j: i32 = %zero, %s: f32 = %f) {{
                %next: i32 = add %j, %one %t: f32 = add %s, %a
                {rest}
                repeat %again, %next, %t
            }}"
    )
}

#[test]
fn loops_ask_first_where_the_source_did() {
    let guarded = |guard: &str, again: &str, initial: &str| {
        let text = sum_while(&format!("{guard} %u: f32 = if %c {{"), again);
        format!("{text} yield %sum }} else {{ yield {initial} }} return scratch:kept@0 = %u")
    };
    // The same comparison with exchanged operands.
    for guard in ["%c: bool = less %zero, %n", "%c: bool = greater %n, %zero"] {
        check(
            &guarded(guard, "%again: bool = less %next, %n", "%f"),
            expect![[r#"
                int32_t result = 0;
                float result2 = 0.0f;
                while (result < count) {
                    result = wrapping_add(result, 1);
                    result2 = result2 + radius;
                }
                scratch.kept[0] = result2;
            "#]],
        );
    }
    // A larger condition.
    check(
        &guarded(
            "%m: i32 = multiply %zero, %n %b: i32 = subtract %m, %ten %c: bool = less_equal %b, %n",
            "%x: i32 = multiply %next, %n %y: i32 = subtract %x, %ten %again: bool = less_equal %y, %n",
            "%f",
        ),
        expect![[r#"
            int32_t result = 0;
            float result2 = 0.0f;
            while (wrapping_subtract(wrapping_multiply(result, count), 10) <= count) {
                result = wrapping_add(result, 1);
                result2 = result2 + radius;
            }
            scratch.kept[0] = result2;
        "#]],
    );
    // Another condition, or another value if there is no iteration.
    check(
        &guarded("%c: bool = less_equal %zero, %n", "%again: bool = less %next, %n", "%f"),
        expect![[r#"
            float kept_x = 0.0f;
            if (0 <= count) {
                int32_t result = 0;
                float result2 = 0.0f;
                for (;;) {
                    const int32_t sum = wrapping_add(result, 1);
                    result = sum;
                    result2 = result2 + radius;
                    if (!(sum < count)) break;
                }
                kept_x = result2;
            }
            scratch.kept[0] = kept_x;
        "#]],
    );
    check(
        &guarded("%c: bool = less %zero, %n", "%again: bool = less %next, %n", "%a"),
        expect![[r#"
            float kept_x = radius;
            if (0 < count) {
                int32_t result = 0;
                float result2 = 0.0f;
                for (;;) {
                    const int32_t sum = wrapping_add(result, 1);
                    result = sum;
                    result2 = result2 + radius;
                    if (!(sum < count)) break;
                }
                kept_x = result2;
            }
            scratch.kept[0] = kept_x;
        "#]],
    );
}

#[test]
fn loops_that_are_known_to_begin_ask_first() {
    let counted = |again: &str| sum_while("", again) + " return scratch:kept@0 = %sum";
    check(
        &counted("%again: bool = less %next, %ten"),
        expect![[r#"
        int32_t result = 0;
        float result2 = 0.0f;
        while (result < 10) {
            result = wrapping_add(result, 1);
            result2 = result2 + radius;
        }
        scratch.kept[0] = result2;
    "#]],
    );
    check(
        &counted("%again: bool = greater %next, %ten"),
        expect![[r#"
        int32_t result = 0;
        float result2 = 0.0f;
        for (;;) {
            const int32_t sum = wrapping_add(result, 1);
            result = sum;
            result2 = result2 + radius;
            if (!(sum > 10)) break;
        }
        scratch.kept[0] = result2;
    "#]],
    );
    check(
        &counted("%again: bool = less %t, %a"),
        expect![[r#"
        int32_t result = 0;
        float result2 = 0.0f;
        for (;;) {
            const float sum = result2 + radius;
            result = wrapping_add(result, 1);
            result2 = sum;
            if (!(sum < radius)) break;
        }
        scratch.kept[0] = result2;
    "#]],
    );
}

#[test]
fn intersect_stores_where_it_accepts() {
    check(
        "
        %t: f32 = load state:rt_HitDistance@0 %r: f32 = load member:radius@0
        %closer: bool = less %r, %t
        return state:rt_HitDistance@0 = %r, accepted:accepted@0 = %closer",
        expect![[r#"
            const float rt_HitDistance = state.rt_HitDistance;
            const bool accepted = radius < rt_HitDistance;
            if (accepted) {
                state.rt_HitDistance = radius;
            }
            return accepted;
        "#]],
    );
}

#[test]
fn requests() {
    check(
        "
        %x: f32 = load member:radius@0 %y: f32 = load state:rt_RayOrigin@0 %i: i32 = load member:count@0
        %r: f32, %g: f32, %b: f32 = trace %x, %y, %x, %y, %x, %y, %x, %y
        %shadow: bool = occluded %x, %y, %x, %y, %x, %y, %x
        %lights: i32 = light_count
        %reached: bool, %dx: f32, %dy: f32, %dz: f32, %distance: f32, %lr: f32, %lg: f32, %lb: f32, %pdf: f32 =
            light_sample %i, %x, %y, %x, %y, %x, %y, %x
        %ar: f32, %ag: f32, %ab: f32 = ambient
        %random: f32 = rand
        report_budget
        %n: f32 = convert %lights
        %a: f32 = max %r, %ag %c: f32 = max %distance, %lb %d: f32 = max %n, %random %e: f32 = max %a, %c
        %f: f32 = max %e, %d
        %s: f32 = select %shadow, %f, %pdf %u: f32 = select %reached, %s, %x
        return scratch:kept@0 = %u",
        expect![[r#"
            const float origin[3] = {radius, state.rt_RayOrigin[0], radius};
            const float direction[3] = {state.rt_RayOrigin[0], radius, state.rt_RayOrigin[0]};
            float radiance[3] = {};
            host.trace(origin, direction, radius, state.rt_RayOrigin[0], radiance);
            const float origin2[3] = {radius, state.rt_RayOrigin[0], radius};
            const float direction2[3] = {state.rt_RayOrigin[0], radius, state.rt_RayOrigin[0]};
            const bool is_occluded = host.occluded(origin2, direction2, radius);
            const int32_t light_count = host.light_count();
            const float point[3] = {radius, state.rt_RayOrigin[0], radius};
            const float normal[3] = {state.rt_RayOrigin[0], radius, state.rt_RayOrigin[0]};
            LightSample light = {};
            const bool reaches = host.light_sample(count, point, normal, radius, light);
            if (!reaches) {
                light = LightSample();
            }
            float ambient[3] = {};
            host.ambient(ambient);
            const float random = host.rand();
            state.budget_exceeded = true;
            scratch.kept[0] = reaches
                ? (is_occluded
                    ? maximum(maximum(maximum(radiance[0], ambient[1]),
                            maximum(light.distance, light.color[2])),
                        maximum(float(light_count), random))
                    : light.pdf)
                : radius;
        "#]],
    );
}

#[test]
fn large_expressions_are_taken_apart() {
    let mut body = "%0: f32 = load member:radius@0 %1: f32 = load state:rt_RayOrigin@0".to_owned();
    for index in 2..40 {
        body.push_str(
            &format!(" %{index}: f32 = divide %{}, %1", index - 1).replace("%1, %1", "%0, %1"),
        );
    }
    body.push_str(" return scratch:kept@0 = %39");
    let text = text(&body);
    let text = text.split(" shade(").nth(1).unwrap();
    let longest = text.split(';').map(|statement| statement.matches("/ ").count()).max();
    assert_eq!(longest, Some(8), "{text}");
}

#[test]
fn a_struct_is_laid_out_as_its_block() {
    let text = text("%x: f32 = load member:radius@0 return scratch:kept@0 = %x");
    let start = text.find("\n/// A thing").unwrap();
    expect![[r#"

        /// A thing. * / int x;\ .
        struct Thing {
            Buffer<float, 3> points = {};
            float radius = 1.0f;
            float weights[4] = {0.0f, 0.5f, 0.0f, 0.0f};
            int32_t count = 0;
            uint32_t mask = 0u;
            uint32_t flag = 1u;

            /// Values that methods of a class share for a ray and its hit.
            struct Scratch {
                float kept[2] = {};
            };

            /// Gives the radiance that returns to the ray.
            void shade(State &, Scratch &scratch) const {
                scratch.kept[0] = radius;
            }
        };
        static_assert(sizeof(Thing) == 48, "laid out as a block");

        } // namespace test

        // Kernels and tables of a library that serves hosts as an object file does. RTSL_EXPORT is its header, which
        // `rtsl build --emit header` writes for the same classes: -DRTSL_EXPORT='"shaders.h"'.
        #ifdef RTSL_EXPORT

        #include RTSL_EXPORT

        static const RtslParameter test_Thing_parameters[] = {{}};
        static const RtslMethod test_Thing_methods[] = {{}};
        static const uint32_t test_Thing_initial[] = {0x0u, 0x0u, 0x0u, 0x0u, 0x3f800000u, 0x0u, 0x3f000000u, 0x0u, 0x0u, 0x0u, 0x0u, 0x1u};
        extern "C" const RtslClass test_Thing = {
            "Thing",
            "A thing. */ int x;\\",
            test_Thing_parameters,
            test_Thing_methods,
            test_Thing_initial,
            nullptr,
            0,
            0,
            0,
            12,
            12,
            2,
            4294967295u,
            4294967295u,
            0,
            0};

        static const RtslClass *const test_library_classes[] = {&test_Thing};
        extern "C" const RtslLibrary test_library = {RTSL_ABI, 1, test_library_classes, "0.1.0", "C++"};

        #endif

        #if defined(__GNUC__) && !defined(__clang__)
        #pragma GCC pop_options
        #endif

        #endif // TEST_CLASSES_H
    "#]]
    .assert_eq(&text[start..]);
}
