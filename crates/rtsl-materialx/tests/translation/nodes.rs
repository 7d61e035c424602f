//! Every node of the table has a statement.

use rtsl_materialx::nodes;

use crate::outputs_of;

/// The types of outputs in the order in which they are tried.
const TYPES: [&str; 8] =
    ["float", "color3", "vector3", "color4", "vector2", "integer", "boolean", "matrix33"];

#[test]
fn every_node_has_a_value() {
    for node in nodes() {
        let of_type = |ty: &&str| {
            let output = if *ty == "matrix33" { "color3" } else { ty };
            let text = format!(
                "<materialx><nodegraph name=\"g\">\n<{node} name=\"n\" type=\"{ty}\">\n\
                 <input name=\"geomprop\" type=\"string\" value=\"a\"/>\n\
                 <input name=\"varname\" type=\"string\" value=\"a\"/>\n</{node}>\n\
                 <output name=\"out\" type=\"{output}\" nodename=\"n\"/>\n</nodegraph></materialx>"
            );
            let text = outputs_of(&text);
            text.contains("class") && !text.contains("error")
        };
        assert!(TYPES.iter().any(of_type), "{node}");
    }
}

#[test]
fn nodes_are_listed_once() {
    let all: Vec<&str> = nodes().collect();
    assert!(all.is_sorted() && all.len() > 140, "{}", all.len());
}
