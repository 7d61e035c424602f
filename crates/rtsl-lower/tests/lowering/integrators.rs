//! Queries of integrators.

use rtsl_ir::{OpKind, Query};
use rtsl_spec::Method;

use crate::harness::class;

/// The queries of a body, with the number of operands of each.
fn queries(body: &str) -> Vec<(Query, usize)> {
    let text = format!("class C : rt_Integrator; void radiance() {{ {body} }}");
    let class = class(&text);
    let mut found = Vec::new();
    class.methods[&Method::Radiance].body.for_each_op(&mut |op| {
        if let OpKind::Query(query, operands) = &op.kind {
            found.push((*query, operands.len()));
        }
    });
    found
}

#[test]
fn a_search_is_a_hit_and_its_properties() {
    assert_eq!(
        queries("rt_SampleColor = color(nearestHit().point);"),
        [(Query::NearestHit, 8), (Query::SurfaceProperties, 14)]
    );
}

#[test]
fn methods_take_the_scalars_that_identify_surfaces() {
    let body = "rt_Surface s; s.object = 3; rt_SampleColor = s.BSDF(vec3(1)) + s.emission();";
    assert_eq!(queries(body), [(Query::Bsdf, 18), (Query::Emission, 14)]);
    let body = "rt_Surface s; rt_SampleColor = s.sampleBSDF(vec3(1)).weight;";
    assert_eq!(queries(body), [(Query::SampleBsdf, 18)]);
}

#[test]
fn outputs_are_stored_as_scratch() {
    let class = class(
        "class C : rt_Integrator; output vec2 place; scratch float other; public float given;
         void radiance() { place.x += 1.0; }",
    );
    let names: Vec<&str> = class.outputs.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["place"]);
    let scratch: Vec<&str> = class.scratch.iter().map(|variable| variable.name.as_str()).collect();
    assert_eq!(scratch, ["place", "other"]);
    // It starts with zeros.
    let text = class.methods[&Method::Radiance].to_string();
    assert!(!text.contains("load scratch"), "{text}");
}
