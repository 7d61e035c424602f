//! No document takes unbounded time, memory or stack.

use proptest::prelude::*;

use crate::{document, outputs_of, text_of, with_material};

/// Words of documents, joined at random.
const PARTS: [&str; 33] = [
    "<materialx version=\"1.39\">",
    "</materialx>",
    "<nodegraph name=\"g\">",
    "</nodegraph>",
    "<nodedef name=\"d\" node=\"add\">",
    "</nodedef>",
    "<add name=\"a\" type=\"float\">",
    "</add>",
    "<image name=\"i\" type=\"color4\">",
    "</image>",
    "<input name=\"in1\" type=\"float\" nodename=\"a\"/>",
    "<input name=\"in2\" type=\"color3\" nodegraph=\"g\"/>",
    "<input name=\"in1\" type=\"float\" interfacename=\"in1\"/>",
    "<input name=\"file\" type=\"filename\" value=\"a.png\"/>",
    "<output name=\"o\" type=\"float\" nodename=\"a\"/>",
    "<output name=\"p\" type=\"color3\" nodename=\"i\" channels=\"bgr\"/>",
    "<standard_surface name=\"s\" type=\"surfaceshader\">",
    "</standard_surface>",
    "<input name=\"base\" type=\"float\" nodename=\"a\"/>",
    "<surfacematerial name=\"m\"><input name=\"surfaceshader\" nodename=\"s\"/></surfacematerial>",
    "<material name=\"n\"><shaderref name=\"s\" node=\"standard_surface\"/></material>",
    "<swizzle name=\"a\" type=\"color3\"/>",
    "<mix name=\"s\" type=\"surfaceshader\"><input name=\"fg\" nodename=\"a\"/><input name=\"bg\" nodename=\"s\"/>",
    "<mix name=\"a\" type=\"surfaceshader\"><input name=\"fg\" nodename=\"b\"/><input name=\"bg\" nodename=\"b\"/>",
    "</mix>",
    "<gltf_pbr name=\"b\" type=\"surfaceshader\"/>",
    "<surface name=\"b\" type=\"surfaceshader\"><input name=\"bsdf\" nodename=\"a\"/></surface>",
    "<chiang_hair_bsdf name=\"a\" type=\"BSDF\"/>",
    "<LamaLayer name=\"a\" type=\"BSDF\"><input name=\"materialTop\" nodename=\"a\"/></LamaLayer>",
    "<texcoord name=\"a\"><input name=\"index\" type=\"integer\" value=\"1\"/></texcoord>",
    "<material name=\"n\" inherit=\"n\"/>",
    "<xi:include href=\"nodes.mtlx\"/>",
    "&#60;",
];

proptest! {
    #[test]
    fn any_text_is_translated_or_refused(parts in prop::collection::vec(0..PARTS.len(), 0..60)) {
        let text: String = parts.iter().map(|part| PARTS[*part]).collect();
        let whole = format!("<materialx xmlns:xi=\"x\">{text}</materialx>");
        for text in [&text, &whole] {
            text_of(text);
            outputs_of(text);
        }
    }

    #[test]
    fn any_bytes_are_refused(text in ".{0,200}") {
        text_of(&text);
    }
}

#[test]
fn deep_elements_are_refused() {
    let text = format!("<materialx>{}{}</materialx>", "<a>".repeat(50_000), "</a>".repeat(50_000));
    assert!(document(&text).is_err_and(|error| error.contains("E0633")));
}

#[test]
fn long_chains_are_refused() {
    let node = |index: usize| {
        format!(
            "<sin name=\"n{index}\" type=\"float\"><input name=\"in\" type=\"float\" nodename=\"n{}\"/></sin>",
            index + 1
        )
    };
    let chain: String = (0..5000).map(node).collect();
    let text = with_material(&format!(
        "{chain}<standard_surface name=\"surface\" type=\"surfaceshader\">\
         <input name=\"base\" type=\"float\" nodename=\"n0\"/></standard_surface>"
    ));
    assert!(text_of(&text).contains("E0633"));
}

/// Each definition uses the one below it twice, so that the values double with each.
#[test]
fn graphs_that_double_are_refused() {
    let definition = |index: usize| {
        let below = if index == 0 { "sin".to_owned() } else { format!("d{}", index - 1) };
        format!(
            "<nodedef name=\"ND{index}\" node=\"d{index}\"><input name=\"in\" type=\"float\"/>\
             <output name=\"out\" type=\"float\"/></nodedef>\
             <nodegraph name=\"NG{index}\" nodedef=\"ND{index}\">\
             <{below} name=\"a\" type=\"float\"><input name=\"in\" type=\"float\" interfacename=\"in\"/></{below}>\
             <{below} name=\"b\" type=\"float\"><input name=\"in\" type=\"float\" nodename=\"a\"/></{below}>\
             <output name=\"out\" type=\"float\" nodename=\"b\"/></nodegraph>"
        )
    };
    let definitions: String = (0..40).map(definition).collect();
    let text = with_material(&format!(
        "{definitions}<texcoord name=\"uv\" type=\"vector2\"/>\
         <extract name=\"u\" type=\"float\"><input name=\"in\" type=\"vector2\" nodename=\"uv\"/></extract>\
         <d39 name=\"all\" type=\"float\"><input name=\"in\" type=\"float\" nodename=\"u\"/></d39>\
         <standard_surface name=\"surface\" type=\"surfaceshader\">\
         <input name=\"base\" type=\"float\" nodename=\"all\"/></standard_surface>"
    ));
    assert!(text_of(&text).contains("E0633"));
}
