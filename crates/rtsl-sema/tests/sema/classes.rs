//! Classes: roles, members, constructors, inheritance, state variables, references, implied methods.

use rtsl_sema::hir::Class;
use rtsl_testing::checked::{check, diagnostics};

/// The warnings about classes and members without effect: those here have only what a test is about.
const IDLE: [&str; 2] = ["W0340", "W0343"];

/// The codes of the other diagnostics.
fn codes(text: &str) -> Vec<&'static str> {
    let mut codes = rtsl_testing::checked::codes(text);
    codes.retain(|code| !IDLE.contains(code));
    codes
}

fn accepted<'t>(texts: impl IntoIterator<Item = &'t str>) {
    let report: String = texts
        .into_iter()
        .filter(|text| !codes(text).is_empty())
        .map(|text| format!("{text}\n{}\n", diagnostics(text)))
        .collect();
    assert!(report.is_empty(), "{report}");
}

fn refused<'t>(texts: impl IntoIterator<Item = (&'t str, &'t str)>) {
    let report: String = texts
        .into_iter()
        .filter(|(expected, text)| codes(text).join(" ") != *expected)
        .map(|(expected, text)| format!("expected {expected}:\n{text}\n{}\n", diagnostics(text)))
        .collect();
    assert!(report.is_empty(), "{report}");
}

/// The only class of a text that is accepted.
fn class(text: &str) -> Class {
    assert!(codes(text).is_empty(), "{}", diagnostics(text));
    let (module, _, _) = check(text);
    module.classes.into_iter().last().unwrap()
}

fn methods(text: &str) -> Vec<&'static str> {
    class(text).methods.iter().map(|(method, _)| method.name()).collect()
}

#[test]
fn classes_of_every_kind() {
    accepted([
        "class A : rt_Texture;\n",
        "class A : rt_Texture { }; class B : rt_Light { public float x = 1.0; };",
        "class A : rt_Primitive, rt_Material;\nscratch vec3 bary;\nvoid intersect() { if (hit(1.0)) bary = vec3(1.0); }\nvoid shade() { rt_SampleColor = color(bary); }",
        // A member is visible in the whole class.
        "class A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = scale * f(S(2.0)); }\nfloat f(S s) { return s.x; }\nstruct S { float x; };\npublic float scale = 1.0;",
        "class A : rt_Texture;\npublic uniform float x;\nvoid lookup() { rt_FloatTextureValue = x; }",
        "class A : rt_Camera;\nvoid generateRay() { rt_RayDirection = vec3(rt_ScreenCoord - 0.5, 1.0); rt_HitDistance *= 0.5; rt_SampleColor = color(rt_TimeSeed); }",
        "class A : rt_Light;\nvoid illumination() { rt_LightDirection = rt_HitPoint; rt_LightColor = color(1.0); rt_PDF = 0.0; }\nvoid emission() { rt_EmissionColor = color(rt_RayDirection); }",
        // The usual names of parameters.
        "class A : rt_Material;\nprivate float eta;\nconstructor(float inside, float outside = 1.0) { eta = inside / outside; }\nvoid shade() { rt_SampleColor = inside() ? color(eta) : ambient() + trace(rt_HitPoint, rt_RayDirection); }",
        "class A : rt_Material;\npublic rt_Texture kd;\npublic rt_Material layers[2];\nvoid shade() { if (isSet(kd)) rt_SampleColor = kd.lookup() * kd.lookupFloat(vec2(1)); for (int i = 0; i < 2; i++) rt_SampleColor += layers[i].shade(); }",
        "class A : rt_Texture;\npublic vec3 p[];\npublic ivec2 cells[][2];\nvoid lookup() { rt_FloatTextureValue = p[p.length() - 1].x + float(cells[0][1].y); }",
        "class A : rt_Texture;\n[[label \"Scale\", min 0, max 2 * 3.0, doc \"...\", hidden]] public float s = 1.0;\nconstructor([[unit \"m\"]] float r) { s *= r; }\nvoid lookup() { rt_FloatTextureValue = s; }",
        "class A : rt_Texture;\nfloat table[] = { 1, 2, 3 };\nvoid lookup() { rt_FloatTextureValue = table[2]; }",
        "class A : rt_Material;\nvoid shade() { illuminance(rt_HitPoint, rt_ShadingNormal, 1.5) { if (occluded(rt_HitPoint, rt_LightDirection, rt_LightDistance)) continue; rt_SampleColor += rt_LightColor; } }",
        // A helper may do what all methods that call it may do.
        "class A : rt_Primitive;\nvoid offer(float t) { hit(t); }\nvoid intersect() { offer(1.0); }",
        "void offer(float t) { hit(t); }\nclass A : rt_Primitive;\nvoid intersect() { offer(1.0); }",
        "class A : rt_Material;\nvoid add() { rt_SampleColor += rt_LightColor; }\nvoid shade() { illuminance add(); }",
        // A class may call its own methods as functions.
        "class A : rt_Material;\nvoid BSDF() { rt_BSDFValue = color(1.0); }\nvoid sampleBSDF() { rt_LightDirection = rt_ShadingNormal; rt_PDF = 1.0; BSDF(); }",
        "class A : rt_Camera;\nfloat lookup(float x) { return x; }\nvoid generateRay() { rt_RayOrigin.x = lookup(1.0); }",
        "class A : rt_Material;\npublic rt_Material a;\nvoid sampleBSDF() { rt_BSDFValue = a.sampleBSDF() * (rt_PDF > 0.0 ? 0.5 : 1.0); }\nvoid evaluatePDF() { rt_PDF = a.evaluatePDF(); }",
    ]);
}

#[test]
fn wrong_declarations() {
    refused([
        ("E0302", "class A;\nvoid f() { }"),
        ("E0301", "class A : B;\nclass B : rt_Texture;"),
        ("E0302", "class A : rt_Texture { }; class B : rt_Texture { }; class D : A, B { };"),
        ("E0203", "class A : rt_Texture { }; class A : rt_Texture { };"),
        ("E0203", "class A : rt_Texture;\npublic float x = 1.0;\nfloat x() { return 1.0; }"),
        ("E0203", "class A : rt_Texture;\npublic float x, x;"),
        ("E0222", "class A : rt_Texture;\npublic private float x;"),
        ("E0222", "class A : rt_Texture;\npublic scratch float x;"),
        ("E0222", "class A : rt_Texture;\nout float x;"),
        ("E0202", "class B : rt_Texture { }; class A : rt_Texture;\npublic B b;"),
        ("E0227", "class A : rt_Texture;\nprivate vec3 p[];"),
        ("E0227", "class A : rt_Texture;\npublic vec3 p[2][];"),
        ("E0229", "struct S { rt_Texture t; };\nclass A : rt_Texture;"),
        ("E0317", "class A : rt_Texture;\nscratch rt_Texture p;"),
        ("E0314", "class A : rt_Texture;\nfloat f() { return 1.0; }\npublic float x = f();"),
        ("E0307", "class A : rt_Texture;\npublic float x = rt_TextureUV.x;"),
        ("E0309", "class A : rt_Texture;\npublic float x = rand();"),
        ("E0310", "class A : rt_Texture;\nconstructor() { }\nconstructor(float x) { x += 1.0; }"),
        ("E0310", "class A : rt_Texture;\nconstructor(out float x) { x = 1.0; }"),
        ("E0310", "class A : rt_Texture;\nconstructor();"),
        ("E0204", "class A : rt_Texture;\npublic float x;\nconstructor(float r = true) { x = r; }"),
        ("E0303", "class A : rt_Texture;\nvoid BSDF() { }"),
        ("E0304", "class A : rt_Material;\nvoid shade(float x) { }"),
        ("W0332", "class A : rt_Texture;\n[[colour 3]] public float x = 1.0;"),
        ("E0316", "class A : rt_Texture;\n[[min \"a\"]] public float x = 1.0;"),
        ("E0309", "class A : rt_Texture;\n[[min rand()]] public float x = 1.0;"),
        ("E0318", "class A : rt_Texture;\n[[element \"b\"]] public int i;"),
        ("E0318", "class A : rt_Texture;\npublic int b[];\n[[element \"b\"]] public float i;"),
        ("E0318", "class A : rt_Texture;\npublic int b[];\n[[element \"b\"]] private int i;"),
        ("E0318", "class A : rt_Texture;\npublic int b[];\n[[element \"b\"]] public int i, j;"),
        (
            "E0318",
            "class A : rt_Texture;\npublic int b[];\n[[element \"b\", stride 0]] public int i;",
        ),
        ("E0318", "class A : rt_Texture;\n[[stride 3]] public int i = 0;"),
        (
            "E0221",
            "class A : rt_Texture;\nfloat f();\nvoid lookup() { rt_FloatTextureValue = f(); }",
        ),
    ]);
}

#[test]
fn called_methods_set_what_they_pass_out() {
    let shape = |more: &str| {
        format!(
            "class A : rt_Primitive;\nvoid set() {{ rt_GeometricNormal = rt_HitPoint; }}\nvoid intersect() {{ hit(1.0); }}\n\
             void computeNormal() {{ set(); }}\nvoid computeTextureCoordinates() {{ {more} }}"
        )
    };
    let called = shape("computeNormal(); rt_TextureUV = rt_GeometricNormal.xy;");
    accepted([&*called]);
    let (both, direct) = (shape("computeNormal(); set();"), shape("set(); computeNormal();"));
    refused([("E0306", &*both), ("E0306", &*direct)]);
}

#[test]
fn wrong_state() {
    refused([
        (
            "E0305",
            "class A : rt_Camera, rt_Light;\nvoid generateRay() { rt_RayOrigin = rt_TextureUVW; }",
        ),
        ("E0307", "class A : rt_Texture;\nconstructor() { rt_FloatTextureValue = 1.0; }"),
        ("E0306", "class A : rt_Camera;\nvoid generateRay() { rt_du += 1.0; }"),
        ("E0306", "class A : rt_Light;\nvoid evaluatePDF() { rt_LightDirection.x = 1.0; }"),
        (
            "E0306",
            "class A : rt_Material;\nvoid BSDF() { set(rt_LightDirection); }\nvoid set(out vec3 v) { v = vec3(1.0); }",
        ),
        // The helper is valid for one of the methods that call it.
        (
            "E0306",
            "class A : rt_Primitive;\nvoid set() { rt_HitPoint = vec3(1.0); }\nvoid generateSample() { set(); }\nvoid samplePDF() { set(); }",
        ),
        (
            "E0308",
            "class A : rt_Material;\nvoid set() { rt_PDF = 1.0; }\nvoid shade() { illuminance set(); }",
        ),
        (
            "E0309",
            "class A : rt_Material;\nvoid BSDF() { rt_BSDFValue = trace(rt_HitPoint, rt_RayDirection); }",
        ),
        (
            "E0309",
            "class A : rt_Material;\nvoid emission() { illuminance rt_EmissionColor += rt_LightColor; }",
        ),
        ("E0309", "void f() { illuminance { } }\nclass A : rt_Material;\nvoid shade() { f(); }"),
        (
            "E0309",
            "class A : rt_Light;\nvoid emission() { if (inside()) rt_EmissionColor = color(1.0); }",
        ),
        ("E0309", "class A : rt_Texture;\npublic float x;\nconstructor() { x = rand(); }"),
        (
            "E0309",
            "class A : rt_Texture;\npublic rt_Texture t;\npublic float x;\nconstructor() { x = t.lookupFloat(); }",
        ),
        (
            "E0309",
            "class A : rt_Texture;\npublic rt_Material m;\nvoid lookup() { rt_TextureColor = m.shade(); }",
        ),
        (
            "E0309",
            "class A : rt_Texture;\npublic rt_Material m;\nvoid lookup() { rt_TextureColor = m.sampleBSDF(); }",
        ),
        (
            "E0211",
            "class A : rt_Texture;\npublic rt_Texture t;\nvoid lookup() { rt_TextureColor = t.lookup(1.0); }",
        ),
        (
            "E0206",
            "class A : rt_Texture;\npublic rt_Camera t;\nvoid lookup() { rt_TextureColor = t.lookup(); }",
        ),
        (
            "E0211",
            "class A : rt_Texture;\npublic float t;\nvoid lookup() { if (isSet(t)) rt_FloatTextureValue = 1.0; }",
        ),
        (
            "W0331",
            "class A : rt_Texture;\nprivate float x;\nvoid set() { x = 1.0; }\nvoid lookup() { set(); rt_FloatTextureValue = x; }",
        ),
        ("W0333", "class A : rt_Primitive;\nvoid intersect() { hit(rt_HitPoint.x); }"),
        (
            "E0201",
            "class A : rt_Texture;\nvoid lookup() { rt_TextureColor = color(rt_TextureUw.x); }",
        ),
    ]);
}

#[test]
fn inheritance_checks_again_and_warns_once() {
    let base = "class A : rt_Texture { public float x = 1.0; float f() { float unused; return x; } void lookup() { rt_FloatTextureValue = f(); } };\n";
    refused([
        ("W0242", base),
        ("W0242", &format!("{base}class B : A {{ float f() {{ return 2.0 * x; }} }};")),
        ("W0242 E0203", &format!("{base}class B : A {{ public vec2 x; }};")),
        ("W0242 E0305", &format!("{base}class B : A {{ void g() {{ rt_HitDistance = 1.0; }} }};")),
    ]);
    let (module, ..) = check(&format!(
        "{base}class B : A, rt_Light {{ float f() {{ return 2.0; }} public float y; constructor(float z) {{ y = z; }} }};"
    ));
    let derived = &module.classes[1];
    assert_eq!(
        derived.roles.iter().map(|role| role.name()).collect::<Vec<_>>(),
        ["texture", "light"]
    );
    let members: Vec<&str> = derived.members.iter().map(|member| member.name.as_str()).collect();
    assert_eq!(members, ["x", "y"]);
    assert!(derived.constructor.is_some() && module.classes[0].constructor.is_none());
    let lookup = derived.methods[0].1;
    assert_ne!(lookup, module.classes[0].methods[0].1);
    assert_eq!(module.functions[lookup.0 as usize].class.map(|class| class.0), Some(1));
}

#[test]
fn materials_receive_implied_methods() {
    let with = |methods: &str| format!("class A : rt_Material;\n{methods}");
    let shade = "void shade() { rt_SampleColor = color(1.0); }\n";
    let bsdf = "void BSDF() { rt_BSDFValue = color(1.0); }\n";
    let sample = "void sampleBSDF() { rt_LightDirection = rt_ShadingNormal; }\n";
    let emission = "void emission() { rt_EmissionColor = color(1.0); }\n";
    assert_eq!(methods(&with("")), [""; 0]);
    assert_eq!(methods(&with(shade)), ["shade"]);
    let all = ["shade", "BSDF", "sampleBSDF", "evaluatePDF", "emission"];
    assert_eq!(methods(&with(bsdf)), all);
    assert_eq!(methods(&with(&(bsdf.to_owned() + shade))), all);
    assert_eq!(
        methods(&with(&(bsdf.to_owned() + sample))),
        ["shade", "BSDF", "sampleBSDF", "emission"]
    );
    assert_eq!(methods(&with(emission)), all);
    assert_eq!(methods(&with(&(emission.to_owned() + shade))), ["shade", "emission"]);
    // Names that the class declares are not captured by the implied methods.
    let shadows = "public float abs = 1.0; vec3 dot(vec3 a, vec3 b) { return a + b; } float makeFrame(vec3 n) { return n.x * abs; }\n";
    assert_eq!(methods(&with(&(bsdf.to_owned() + shadows))), all);
    let shadows = "attribute float color = 0.5; void BSDF() { rt_BSDFValue *= color; }\n";
    assert_eq!(methods(&with(shadows)), all);
}

#[test]
fn primitives_receive_normals_and_derivatives() {
    let with = |methods: &str| format!("class A : rt_Primitive;\n{methods}");
    let intersect = "void intersect() { hit(1.0); }\n";
    let normal = "void computeNormal() { rt_GeometricNormal = vec3(1.0); }\n";
    let coordinates = "void computeTextureCoordinates() { rt_TextureUV = rt_HitPoint.xy; }\n";
    let derivatives = "void computeDerivatives() { rt_dPdu = vec3(1.0); }\n";
    let of = |texts: &[&str]| methods(&with(&texts.concat()));
    assert_eq!(of(&[normal]), ["computeNormal"]);
    assert_eq!(of(&[intersect]), ["intersect", "computeNormal"]);
    assert_eq!(of(&[intersect, normal]), ["intersect", "computeNormal"]);
    let all = ["intersect", "computeNormal", "computeTextureCoordinates", "computeDerivatives"];
    assert_eq!(of(&[intersect, coordinates]), all);
    assert_eq!(of(&[intersect, normal, coordinates, derivatives]), all);
    let sample = "void generateSample() { rt_HitPoint = vec3(1.0); }\n";
    assert_eq!(of(&[intersect, sample]), ["intersect", "generateSample"]);
    // Names of the class are not captured.
    let names = "float makeFrame(vec3 v) { return v.x; } public float dot = 1.0;\n";
    assert_eq!(of(&[intersect, coordinates, names]), all);
}
