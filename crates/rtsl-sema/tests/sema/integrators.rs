//! Integrators: their methods, the structs of the language, and outputs.

use rtsl_testing::checked::{codes, diagnostics};

fn integrator(body: &str) -> String {
    format!("class C : rt_Integrator;\noutput color seen;\nvoid radiance() {{ {body} }}\n")
}

fn material(body: &str) -> String {
    format!("class C : rt_Material;\nvoid shade() {{ {body} }}\nvoid BSDF() {{ }}\n")
}

#[test]
fn surfaces_are_values() {
    for body in [
        "rt_Surface s = nearestHit(); if (s.found) rt_SampleColor = s.emission();",
        "rt_Surface s; s = nearestHit(rt_RayOrigin, vec3(0.0, 1.0, 0.0), 2.0); seen = color(s.uv.x);",
        "rt_Surface s[2]; s[0] = nearestHit(); s[1] = s[0].follow(s[0].shadingNormal, 0.0);
         rt_SampleColor = s[1].BSDF(s[1].point);",
        "vec3 a, b; nearestHit().facingNormals(a, b); rt_SampleColor = color(a * b);",
        "rt_LightSample l = nearestHit().sampleLight(rand()); rt_SampleColor = l.light;",
        "rt_SampleColor = trace(rt_RayOrigin, -rt_RayDirection) * float(occluded(rt_RayOrigin, vec3(1), 2.0));",
    ] {
        assert_eq!(diagnostics(&integrator(body)), "", "{body}");
    }
}

/// `shade` may search as well, and compute with what it finds.
#[test]
fn materials_search_for_surfaces() {
    for body in [
        "rt_Surface s = nearestHit(rt_HitPoint, -rt_GeometricNormal); if (s.found) rt_SampleColor = color(s.distance);",
        "vec3 a, b; nearestHit(rt_HitPoint, vec3(1), 2.0, 0.0, 0.1).facingNormals(a, b); rt_SampleColor = color(a * b);",
        "rt_Surface s = nearestHit(rt_HitPoint, vec3(1), 2.0).follow(vec3(1), 0.0);
         rt_SampleColor = color(float(s.occluded(vec3(1), 1.0)) * s.cosine(vec3(1)) * s.side()) * color(s.leave(vec3(1)));",
        "if (rt_RayType == rt_CAMERA_RAY || rt_RayType == rt_SCATTERED_RAY) rt_SampleColor = color(rt_TRACED_RAY);",
    ] {
        assert_eq!(diagnostics(&material(body)), "", "{body}");
    }
    let said = diagnostics(&material("rt_SampleColor = color(nearestHit().uv.x);"));
    assert!(
        said.contains("`nearestHit` without arguments is only for `radiance`, not for `shade`"),
        "{said}"
    );
}

#[test]
fn mistakes_have_their_codes() {
    for (code, text) in [
        ("E0206", integrator("rt_SampleColor = nearestHit().BSFD(vec3(1));")),
        ("E0206", integrator("rt_SampleColor = color(nearestHit().pointt);")),
        ("E0211", integrator("rt_SampleColor = nearestHit().BSDF();")),
        ("E0211", integrator("rt_SampleColor = nearestHit().BSDF(1.0);")),
        ("E0211", integrator("nearestHit(vec3(1));")),
        ("E0306", integrator("rt_RayOrigin = vec3(1.0);")),
        ("E0309", material("rt_SampleColor = color(nearestHit().point);")),
        ("E0309", material("rt_SampleColor = nearestHit(rt_HitPoint, vec3(1)).emission();")),
        ("E0309", material("rt_SampleColor = nearestHit(rt_HitPoint, vec3(1)).shade();")),
        (
            "E0309",
            "class C : rt_Material; void BSDF() { rt_BSDFValue = color(nearestHit(rt_HitPoint, vec3(1)).uv.x); }"
                .into(),
        ),
        ("E0306", material("rt_RayType = rt_TRACED_RAY;")),
        ("E0306", integrator("rt_RayType = rt_CAMERA_RAY;")),
        ("E0309", material("contribute(rt_HitPoint, vec3(1), 1.0, color(1));")),
        ("E0309", integrator("rt_SampleColor = ambient();")),
        ("E0305", integrator("rt_SampleColor = color(rt_HitPoint);")),
        ("E0201", integrator("rt_sampleLight(vec3(1), vec3(1), vec3(1), 0.0, 0.0);")),
        (
            "E0215",
            "class C : rt_Integrator;\noutput color seen = color(1);\nvoid radiance() { }".into(),
        ),
    ] {
        assert_eq!(codes(&text).join(" "), code, "{text}\n{}", diagnostics(&text));
    }
}

#[test]
fn messages_name_the_methods_of_surfaces() {
    let said = diagnostics(&integrator("rt_SampleColor = nearestHit().BSFD(vec3(1));"));
    assert!(said.contains("a `rt_Surface` has no method `BSFD`"), "{said}");
    assert!(said.contains("did you mean `BSDF`") || said.contains("BSDF"), "{said}");
    let said = diagnostics(&integrator("rt_SampleColor = nearestHit().BSDF();"));
    assert!(
        said.contains("there is `color BSDF(rt_Surface surface, vec3 direction)`, whose first argument is before the dot"),
        "{said}"
    );
}
