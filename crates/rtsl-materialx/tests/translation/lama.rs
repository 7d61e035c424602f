//! The nodes of MaterialX Lama.

use crate::{link, node, text_of, with_closure, with_material};

/// Nodes without other closures.
const LOBES: [&str; 8] = [
    "LamaConductor",
    "LamaDielectric",
    "LamaDiffuse",
    "LamaGeneralizedSchlick",
    "LamaIridescence",
    "LamaSSS",
    "LamaSheen",
    "LamaTranslucent",
];

#[test]
fn lobes_are_classes_of_closures() {
    for lobe in LOBES {
        let text = text_of(&with_closure(&node(lobe, "lobe", "BSDF", ""), "lobe"));
        assert!(
            text.contains("mxClosures.Lobe lobe0") && !text.contains("error"),
            "{lobe}: {text}"
        );
    }
}

#[test]
fn lobes_are_combined() {
    let [metal, matte] = [("LamaConductor", "metal"), ("LamaDiffuse", "matte")]
        .map(|(tag, name)| node(tag, name, "BSDF", ""));
    let lobes = metal + &matte;
    for (tag, inputs) in [
        ("LamaLayer", ["materialTop", "materialBase"]),
        ("LamaMix", ["material1", "material2"]),
        ("LamaAdd", ["material1", "material2"]),
    ] {
        let inputs = link(inputs[0], "BSDF", "metal") + &link(inputs[1], "BSDF", "matte");
        let text =
            text_of(&with_closure(&(lobes.clone() + &node(tag, "all", "BSDF", &inputs)), "all"));
        assert!(text.contains("mxClosures.Lobe lobe1") && !text.contains("error"), "{tag}: {text}");
    }
}

#[test]
fn a_surface_is_a_material() {
    let text = text_of(&format!(
        "<materialx>{}{}</materialx>",
        node("LamaDiffuse", "matte", "BSDF", ""),
        node("LamaSurface", "All", "material", &link("materialFront", "BSDF", "matte"))
    ));
    assert!(text.contains("class All : rt_Material") && !text.contains("error"), "{text}");
}

#[test]
fn definitions_of_the_document_count() {
    let elements = [
        "<nodedef name=\"ND\" node=\"LamaDiffuse\"><output name=\"out\" type=\"BSDF\"/></nodedef>\n",
        "<nodegraph name=\"NG\" nodedef=\"ND\"><conductor_bsdf name=\"c\" type=\"BSDF\"/>",
        "<output name=\"out\" type=\"BSDF\" nodename=\"c\"/></nodegraph>\n",
    ];
    let own = elements.concat() + &node("LamaDiffuse", "lobe", "BSDF", "");
    assert!(text_of(&with_closure(&own, "lobe")).contains("mxClosures.conductor("));
    assert!(!text_of(&with_material("")).contains("Lama"));
}
