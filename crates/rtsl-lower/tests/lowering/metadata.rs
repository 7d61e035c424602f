//! The metadata of a class for hosts.

use expect_test::{Expect, expect};
use rtsl_ir::VariableKind;
use rtsl_ir::class::Element;

use crate::harness::{Machine, class};

fn check(text: &str, expected: Expect) {
    let class = class(text);
    let mut shown = String::new();
    for parameter in &class.parameters {
        let required = if parameter.required { " required" } else { "" };
        let (target, ty) = (parameter.target, &parameter.ty);
        shown += &format!("{} {ty:?} of {target:?}{required}", parameter.name);
        for annotation in &parameter.annotations {
            shown += &format!(" [{} {:?}]", annotation.key, annotation.value);
        }
        shown.push('\n');
    }
    for place in class.members.iter().chain(&class.buffers).chain(&class.scratch) {
        shown += &format!(
            "{} {}: {} x {}\n",
            place.kind.name(),
            place.name,
            place.scalar.name(),
            place.len
        );
    }
    for reference in &class.references {
        shown += &format!("{reference:?}\n");
    }
    expected.assert_eq(&shown);
}

#[test]
fn public_members_are_parameters() {
    check(
        r#"class M : rt_Material;
        struct Layer { vec3 tint; int kind[2]; mat2x3 m; };
        [[label "Roughness", min 0]] public float roughness = 0.1;
        public Layer layers[2];
        public color tint;
        public rt_Texture kd;
        public rt_Texture maps[4];
        public vec2 grid[];
        private bool hidden;
        scratch Layer seen;
        const float PI = 3.0;
        void BSDF() { if (isSet(maps[1])) rt_BSDFValue = tint * roughness; }"#,
        expect![[r#"
            roughness Scalar(F32) of Member [label Text("Roughness")] [min Constant(I32(0))]
            layers Array(Struct("Layer", [("tint", Vector(F32, 3)), ("kind", Array(Scalar(I32), 2)), ("m", Matrix(2, 3))]), 2) of Member required
            tint Color of Member required
            kd Reference(Texture) of Member
            maps Array(Reference(Texture), 4) of Member
            grid Buffer(Vector(F32, 2)) of Member required
            member roughness: f32 x 1
            member layers.tint: f32 x 6
            member layers.kind: i32 x 4
            member layers.m: f32 x 12
            member tint: f32 x 3
            member hidden: bool x 1
            buffer grid: f32 x 2
            scratch seen.tint: f32 x 3
            scratch seen.kind: i32 x 2
            scratch seen.m: f32 x 6
            Reference { name: "kd", role: Texture, count: Single, tested: false }
            Reference { name: "maps", role: Texture, count: Array(4), tested: true }
        "#]],
    );
}

#[test]
fn the_element_parameter_names_its_buffer() {
    let text = r#"class Mesh : rt_Primitive;
        public vec3 positions[];
        public int indices[];
        [[element "indices", stride 3]] public int face;
        private vec3 corner;
        constructor() { corner = positions[indices[3 * face]]; }
        void intersect() { hit(corner.x); }"#;
    let class = class(text);
    let element = Element { parameter: "face", buffer: "indices", stride: 3 };
    assert_eq!(class.element(), Some(element));
    let is_required = |name: &str| class.parameters.iter().any(|it| it.name == name && it.required);
    assert!(is_required("indices") && !is_required("face"));
}

#[test]
fn constructor_parameters_come_first_and_hide_members() {
    check(
        "class S : rt_Primitive;
        public float radius;
        public vec3 center;
        constructor(float radius, int count = 3) { center = vec3(radius * float(count)); }
        void intersect() { hit(radius); }",
        expect![[r#"
            radius Scalar(F32) of Constructor required
            count Scalar(I32) of Constructor
            center Vector(F32, 3) of Member
            member radius: f32 x 1
            member center: f32 x 3
        "#]],
    );
}

#[test]
fn the_initializer_computes_initial_values() {
    let class = class(
        "class S : rt_Texture;
        struct P { vec2 a; float b; };
        public P points[2] = P[2](P(vec2(1.0, 2.0), sqrt(9.0)), P(vec2(4.0), 5.0));
        private mat2 m = mat2(2.0);
        private bool flag = true;
        private float zero;
        void lookup() { rt_FloatTextureValue = points[1].b + (flag ? m[0][0] : zero); }",
    );
    let machine = Machine::instance(&class);
    let member = |name| machine.get(VariableKind::Member, name);
    assert_eq!(member("points.a"), [1.0, 2.0, 4.0, 4.0]);
    assert_eq!(member("points.b"), [3.0, 5.0]);
    assert_eq!(member("m"), [2.0, 0.0, 0.0, 2.0]);
    assert_eq!(machine.values[&(VariableKind::Member, "flag".to_owned())], [1]);
    assert_eq!(member("zero"), [0.0]);
}
