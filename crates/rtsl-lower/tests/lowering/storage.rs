//! Arrays, members, buffers, scratch and tables.

use rtsl_ir::VariableKind;
use rtsl_spec::Method;

use crate::harness::{Machine, class, count, eval, eval_with, text_of};

#[test]
fn dynamic_indices_are_clamped() {
    let arrays = "float a[6] = float[6](0.0, 1.0, 2.0, 3.0, 4.0, 5.0);";
    for (index, expected) in [("int(u)", 3.0), ("int(u) - 9", 0.0), ("uint(u) + 9u", 5.0)] {
        assert_eq!(eval(&format!("{arrays} result = a[{index}];"), 3.0), expected, "{index}");
        let write =
            format!("{arrays} a[{index}] = 10.0; for (int i = 0; i < 6; i++) result += a[i];");
        assert_eq!(eval(&write, 3.0), 25.0 - expected, "{index}");
    }
}

#[test]
fn vectors_and_matrices_with_dynamic_indices() {
    let body = "vec3 v = vec3(1.0, 2.0, 3.0); int i = int(u); v[i] += 10.0; v.zyx[i - 1] += 100.0;
        result = v[i] + v[i + 9] * 1000.0 + v[-1 - i];";
    assert_eq!(eval(body, 1.0), 12.0 + 103_000.0 + 1.0);
    let body =
        "mat2 m = mat2(1.0, 2.0, 3.0, 4.0); int i = int(u); m[i][1 - i] = 7.0; m[1 - i] *= 2.0;
        result = m[0].x + m[0].y * 10.0 + m[1].x * 100.0 + m[1].y * 1000.0;";
    assert_eq!(eval(body, 1.0), 2.0 + 40.0 + 700.0 + 4000.0);
}

#[test]
fn arrays_of_arrays_and_structs() {
    let helper = "struct S { vec2 a; float b[3]; };";
    let body = "S s[5][2]; int i = int(u);
        s[i][1].b[i - 1] = 4.0; s[i][0].a.y = 5.0; s[2][1].b[0] += 1.0;
        S t = s[i][1];
        result = t.b[1] + s[i][0].a[1] * 10.0 + s[2][1].b[0] * 100.0 + float(s.length() * \
                s[0].length()) * 1000.0 + (s[i] == s[i] ? 1.0 : 0.0);";
    assert_eq!(eval_with(helper, body, 2.0), 4.0 + 50.0 + 100.0 + 10_000.0 + 1.0);
}

#[test]
fn small_arrays_use_selects_and_large_ones_locals() {
    let text = |size: u32| {
        let text = format!(
            "class T : rt_Texture;
            void lookup() {{
                float a[{size}]; a[int(rt_TextureUV.x)] = 1.0;
                rt_FloatTextureValue = a[int(rt_TextureUV.y)]; rt_TextureColor = color(1.0);
            }}"
        );
        text_of(&class(&text), Method::Lookup)
    };
    assert_eq!(count(&text(4), "local"), 0);
    assert_eq!(count(&text(5), "local"), 1);
}

#[test]
fn locals_are_reused_by_consecutive_calls() {
    let text = "class T : rt_Texture;
        float f(int i) { float a[5]; a[i] = 1.0; return a[i + 1]; }
        void lookup() { int i = int(rt_TextureUV.x); rt_FloatTextureValue = f(i) + f(i + 1); }";
    assert_eq!(count(&text_of(&class(text), Method::Lookup), "local"), 1);
}

#[test]
fn tables_of_constants_are_members() {
    let helper = "const int table[9] = int[9](9, 8, 7, 6, 5, 4, 3, 2, 1);
        struct P { vec2 a; int b; }; const P pairs[3] = P[3](P(vec2(1.0, 2.0), 3), P(vec2(4.0, 5.0), 6), \
                  P(vec2(7.0, 8.0), 9));";
    let body = "int i = int(u); result = float(table[i] + table[1]) + pairs[i].a.y * 100.0
        + float(pairs[i - 1].b) * 1000.0;";
    assert_eq!(eval_with(helper, body, 2.0), 15.0 + 800.0 + 6000.0);
    let text = format!(
        "class T : rt_Texture; {helper} void lookup() {{ rt_FloatTextureValue = \
         float(table[int(rt_TextureUV.x)] + table[int(rt_TextureUV.y)]); }}"
    );
    let class = class(&text);
    assert_eq!(class.members.len(), 1, "{:?}", class.members);
    assert_eq!(class.parameters.len(), 0);
}

#[test]
fn tables_are_not_copied_for_calls_and_variables() {
    let text = "class T : rt_Texture; public float knots[40];
        float at(float table[40], int i) { return table[i] + table[i + 1]; }
        float own(int i) { float weights[6] = float[6](1.0, 4.0, 6.0, 4.0, 1.0, 9.0); return weights[i]; }
        float changed(float table[40], int i) { table[i] = 1.0; return table[i + 1]; }
        float given(float table[6], int i) { return table[i]; }
        void lookup() {
            int i = int(rt_TextureUV.x);
            rt_FloatTextureValue = at(knots, i) + own(i) + given(float[6](1.0, 2.0, 3.0, 4.0, 5.0, 6.0), i)
                + float[5](1, 2, -3, 4, 5)[i];
            rt_TextureColor = color(1.0);
        }
        void unused() { changed(knots, 1); }";
    let class = class(text);
    let printed = text_of(&class, Method::Lookup);
    assert_eq!(count(&printed, "local") + count(&printed, "store"), 0, "{printed}");
    let mut machine = Machine::instance(&class);
    let knots: Vec<f32> = (0..40).map(|i| i as f32 * 100.0).collect();
    machine.set(VariableKind::Member, "knots", &knots).set_state("rt_TextureUV", &[2.0, 0.0]);
    machine.run(&class.methods[&Method::Lookup]);
    assert_eq!(machine.state("rt_FloatTextureValue"), [506.0]);
}

#[test]
fn a_table_that_is_written_is_copied_per_ray() {
    let helper = "public float knots[6] = float[6](1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
        float changed(float table[6], int i) { table[i] = 10.0; return table[i] + table[i + 1]; }";
    let body = "int i = int(u); result = changed(knots, i) + knots[i] * 100.0;";
    assert_eq!(eval_with(helper, body, 2.0), 14.0 + 300.0);
    let helper = "void set(inout float x) { x = 7.0; }";
    let body = "float t[6] = float[6](1.0, 2.0, 3.0, 4.0, 5.0, 6.0); set(t[int(u)]); result = t[int(u)] + t[0];";
    assert_eq!(eval_with(helper, body, 2.0), 8.0);
    let body = "switch (int(u)) { case 0: float t[6] = float[6](1.0, 2.0, 3.0, 4.0, 5.0, 6.0); default: \
                result = t[int(u)] + 1.0; }";
    assert_eq!(eval_with("", body, 0.0), 2.0);
    assert_eq!(eval_with("", body, 3.0), 1.0);
}

const MEMBERS: &str = "class T : rt_Texture;
    public float scale = 2.0;
    private float table[6];
    private vec2 pair;
    constructor(float first, float more[3] = float[3](1.0, 2.0, 3.0)) {
        first *= scale;
        for (int i = 0; i < 6; i++) table[i] = first + more[i];
        pair.y = first;
    }
    void lookup() {
        int i = int(rt_TextureUV.x);
        float before = table[i];
        scale = 100.0;
        rt_FloatTextureValue = before + pair.y * 10.0 + scale;
    }";

#[test]
fn members_belong_to_the_instance() {
    let class = class(MEMBERS);
    let mut machine = Machine::default();
    machine.run(&class.initializer);
    assert_eq!(machine.get(VariableKind::Parameter, "more"), [1.0, 2.0, 3.0]);
    machine.set(VariableKind::Parameter, "first", &[5.0]);
    machine.run(class.constructor.as_ref().unwrap());
    assert_eq!(machine.get(VariableKind::Member, "table"), [11.0, 12.0, 13.0, 13.0, 13.0, 13.0]);
    machine.set_state("rt_TextureUV", &[1.0, 0.0]);
    machine.run(&class.methods[&Method::Lookup]);
    assert_eq!(machine.state("rt_FloatTextureValue"), [12.0 + 100.0 + 100.0]);
    assert_eq!(machine.get(VariableKind::Member, "scale"), [2.0], "a method's write is local");
}

#[test]
fn members_only_read_are_loaded_where_they_are_read() {
    let text = "class T : rt_Texture; public float table[1000];
        void lookup() { rt_FloatTextureValue = table[int(rt_TextureUV.x)] + table[7]; }";
    let text = text_of(&class(text), Method::Lookup);
    assert_eq!(count(&text, "load"), 3, "{text}");
    assert_eq!(count(&text, "local"), 0, "{text}");
}

#[test]
fn buffers_are_clamped_to_their_length() {
    let text = "class T : rt_Texture;
        struct Vertex { vec3 point; float weights[2]; };
        public float heights[];
        public Vertex vertices[];
        void lookup() {
            int i = int(rt_TextureUV.x);
            rt_FloatTextureValue = heights[i] + float(heights.length()) * 10.0 + heights[0] + heights[1]
                + vertices[i].weights[i] + vertices[1].point.z * 100.0;
        }";
    let class = class(text);
    let names: Vec<&str> = class.buffers.iter().map(|place| place.name.as_str()).collect();
    assert_eq!(names, ["heights", "vertices.point", "vertices.weights"]);
    let mut machine = Machine::instance(&class);
    machine.set(VariableKind::Buffer, "heights", &[1.0, 2.0, 4.0]);
    machine.set(VariableKind::Buffer, "vertices.point", &[0.0, 0.0, 0.0, 0.0, 0.0, 9.0]);
    machine.set(VariableKind::Buffer, "vertices.weights", &[0.25, 0.5, 0.125, 0.0625]);
    for (u, expected) in [
        (0.0, 1.0 + 30.0 + 3.0 + 0.25 + 900.0),
        (2.0, 4.0 + 30.0 + 3.0 + 0.0625 + 900.0),
        (9.0, 4.0 + 30.0 + 3.0 + 0.0625 + 900.0),
        (-9.0, 1.0 + 30.0 + 3.0 + 0.25 + 900.0),
    ] {
        machine.set_state("rt_TextureUV", &[u, 0.0]).run(&class.methods[&Method::Lookup]);
        assert_eq!(machine.state("rt_FloatTextureValue"), [expected], "{u}");
    }
    machine.set(VariableKind::Buffer, "heights", &[]).set(
        VariableKind::Buffer,
        "vertices.point",
        &[],
    );
    machine.set(VariableKind::Buffer, "vertices.weights", &[]);
    machine.run(&class.methods[&Method::Lookup]);
    assert_eq!(machine.state("rt_FloatTextureValue"), [0.0], "an empty buffer is zero");
}

const SCRATCH: &str = "class P : rt_Primitive;
    scratch float kept;
    scratch vec2 other;
    void intersect() { kept += 1.0; if (hit(rt_RayOrigin.x)) kept += 10.0; }
    void computeNormal() { rt_GeometricNormal = vec3(kept, other); other.y = 5.0; }";

#[test]
fn scratch_is_kept_from_intersect_to_later_methods() {
    let class = class(SCRATCH);
    let mut machine = Machine::instance(&class);
    machine.set(VariableKind::Scratch, "kept", &[77.0]);
    machine.set_state("rt_Epsilon", &[0.001]).set_state("rt_HitDistance", &[100.0]);
    machine.set_state("rt_RayOrigin", &[200.0, 0.0, 0.0]);
    let missed = machine.run(&class.methods[&Method::Intersect]);
    assert!(!missed.accepted);
    assert_eq!(machine.get(VariableKind::Scratch, "kept"), [77.0], "a miss changes nothing");
    machine.set_state("rt_RayOrigin", &[2.0, 0.0, 0.0]);
    let hit = machine.run(&class.methods[&Method::Intersect]);
    assert!(hit.accepted);
    assert_eq!(machine.get(VariableKind::Scratch, "kept"), [11.0], "it begins as zero");
    assert_eq!(machine.state("rt_HitDistance"), [2.0]);
    machine.set(VariableKind::Scratch, "other", &[3.0, 4.0]);
    machine.run(&class.methods[&Method::ComputeNormal]);
    assert_eq!(machine.state("rt_GeometricNormal"), [11.0, 3.0, 4.0]);
    assert_eq!(machine.get(VariableKind::Scratch, "other"), [3.0, 4.0], "it changes its own");
}

#[test]
fn the_nearest_hit_of_several_is_accepted() {
    let text = "class P : rt_Primitive;
        scratch float which;
        void intersect() {
            for (int i = 0; i < 4; i++)
                if (hit(rt_RayOrigin[i % 3] - rt_RayDirection.x)) { which = float(i); if (i == 2) return; }
        }";
    let class = class(text);
    let run = |origin: [f32; 3], far: f32| {
        let mut machine = Machine::instance(&class);
        machine.set_state("rt_Epsilon", &[0.001]).set_state("rt_HitDistance", &[far]);
        machine.set_state("rt_RayOrigin", &origin).set_state("rt_RayDirection", &[0.0; 3]);
        let accepted = machine.run(&class.methods[&Method::Intersect]).accepted;
        let which = accepted.then(|| machine.get(VariableKind::Scratch, "which")[0]);
        (which, machine.state("rt_HitDistance")[0])
    };
    assert_eq!(run([3.0, 2.0, 5.0], 100.0), (Some(1.0), 2.0));
    assert_eq!(run([3.0, 2.0, 1.0], 100.0), (Some(2.0), 1.0));
    assert_eq!(run([0.0, -1.0, f32::NAN], 100.0), (None, 100.0));
    assert_eq!(run([3.0, 4.0, 5.0], 2.0), (None, 2.0));
    assert_eq!(run([2.0, f32::NAN, 0.001], 2.5), (Some(0.0), 2.0));
}
