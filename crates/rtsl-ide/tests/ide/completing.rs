//! Completion, and the functions that a call could mean.

use expect_test::{Expect, expect};
use rtsl_ide::{complete, signature_help};

use crate::{DISC, Question, loader};

/// The labels of the likeliest items.
fn completes(text: &str, count: usize, expected: Expect) {
    let question = Question::new(text);
    let found = complete("test.rtsl", &question.text, question.offset, &mut loader());
    let prefix = &question.text[found.range.start..question.offset];
    let mut items = found.items;
    items.retain(|item| item.label.starts_with(prefix));
    items.sort_by(|left, right| (left.rank, &left.label).cmp(&(right.rank, &right.label)));
    let shown = items.iter().take(count).map(|item| {
        let detail = item.detail.as_deref().unwrap_or("-");
        format!("{} ({:?}, {detail})", item.label, item.kind)
    });
    expected.assert_eq(&shown.collect::<Vec<_>>().join("\n"));
}

/// The disc's text with another statement at the end of `intersect`.
fn in_intersect(statement: &str) -> String {
    DISC.replace("    int steps = 3;\n", &format!("    int steps = 3;\n    {statement}\n"))
}

/// The disc's text with another declaration.
fn in_class(declaration: &str) -> String {
    DISC.replace("scratch vec2 where;\n", &format!("scratch vec2 where;\n{declaration}\n"))
}

#[test]
fn state_variables_are_those_of_the_role_and_the_method() {
    completes(
        &in_intersect("rt_Hi|"),
        10,
        expect![[r#"
        rt_HitDistance (Variable, float (input and output))
        rt_HitPoint (Variable, vec3)"#]],
    );
    completes(
        &in_intersect("float x = rt_Ra|;"),
        10,
        expect![[r#"
        rt_RayDirection (Variable, vec3 (input))
        rt_RayOrigin (Variable, vec3 (input))"#]],
    );
    completes(
        &in_intersect("rt_T|"),
        10,
        expect![[r#"
        rt_TimeSeed (Variable, float (input))
        rt_TextureUV (Variable, vec2)
        rt_TextureUVW (Variable, vec3)"#]],
    );
}

#[test]
fn names_are_those_that_are_visible() {
    completes(
        &in_intersect("float x = st|"),
        10,
        expect![[r#"
        steps (Variable, int)
        step (Function, float step(float edge, float x))"#]],
    );
    completes(
        &in_intersect("float x = max(ra|, 2.0);"),
        10,
        expect![[r#"
        radius (Property, float)
        radians (Function, float radians(float degrees))
        rand (Function, float rand())"#]],
    );
    completes(&in_intersect("if (squ|"), 10, expect!["squared (Property, float)"]);
    completes(&in_intersect("Mee|"), 10, expect!["Meeting (Struct, -)"]);
    completes(&in_intersect("LI|"), 10, expect!["LIMIT (Macro, -)"]);
}

#[test]
fn parts_follow_dots() {
    completes(
        &in_intersect("float x = at.|"),
        10,
        expect![[r#"
        distance (Property, float)
        place (Property, vec2)"#]],
    );
    completes(
        &in_intersect("float x = at.place.|;"),
        12,
        expect![[r#"
        x (Property, -)
        y (Property, -)
        g (Property, -)
        r (Property, -)
        rg (Property, -)
        xy (Property, -)
        length (Method, int length())"#]],
    );
    completes(
        &in_intersect("float x = scale.|"),
        10,
        expect![[r#"
            HALF (Variable, float)
            twice (Function, float twice(float x))"#]],
    );
    completes(
        "class A : rt_Texture; public rt_Texture map; void lookup() { rt_TextureColor = map.| }",
        10,
        expect![[r#"
            lookup (Method, color lookup(...))
            lookupFloat (Method, float lookupFloat(...))"#]],
    );
    completes(
        "class A : rt_Texture; public float t[]; void lookup() { int n = t.le| }",
        10,
        expect!["length (Method, int length())"],
    );
    completes(
        "class A : rt_Texture { float f(float x) { return x; } };\nclass B : A { float f(float x) { return super.| } };",
        10,
        expect!["f (Method, float f(float x))"],
    );
}

#[test]
fn declarations_begin_with_qualifiers_types_and_methods() {
    completes(&in_class("pub|"), 10, expect!["public (Keyword, -)"]);
    completes(
        &in_class("void compute|"),
        10,
        expect![[r#"
        computeBounds (Method, void computeBounds())
        computeDerivatives (Method, void computeDerivatives())
        computeNormal (Method, void computeNormal())
        computeTextureCoordinates (Method, void computeTextureCoordinates())"#]],
    );
    completes(
        &in_class("compute|"),
        10,
        expect![[r#"
        computeBounds (Method, void computeBounds())
        computeDerivatives (Method, void computeDerivatives())
        computeNormal (Method, void computeNormal())
        computeTextureCoordinates (Method, void computeTextureCoordinates())"#]],
    );
    completes(&in_class("[[mi|]] public float x = 0.0;"), 10, expect!["min (Property, -)"]);
    completes(&in_class("[[min 0, d|]] public float x = 0.0;"), 10, expect!["doc (Property, -)"]);
    completes("class A : rt_T|", 10, expect!["rt_Texture (Class, -)"]);
    completes("class A : Torus|", 10, expect!["Torus (Class, shaders/primitives/torus.rtsl)"]);
    completes(
        "#if|",
        10,
        expect![[r#"
        if (Macro, -)
        ifdef (Macro, -)
        ifndef (Macro, -)"#]],
    );
    completes("cla|", 10, expect!["class (Keyword, -)"]);
}

#[test]
fn nothing_is_offered_in_comments_texts_and_numbers() {
    completes(&in_intersect("// rt_|"), 10, expect![[""]]);
    completes(&in_intersect("print(\"rt_|\");"), 10, expect![[""]]);
    completes(&in_intersect("float x = 1.|"), 10, expect![[""]]);
}

fn signs(text: &str, expected: Expect) {
    let question = Question::new(text);
    let found = signature_help("test.rtsl", &question.text, question.offset, &mut loader());
    let shown = found.map_or("nothing".to_owned(), |help| {
        let active = &help.signatures[help.active];
        let parameter = active.parameters.get(help.argument);
        let parameter = parameter.map_or("none", |range| &active.text[range.clone()]);
        format!("{} of {}; {} ({parameter})", help.active, help.signatures.len(), active.text)
    });
    expected.assert_eq(&shown);
}

#[test]
fn signatures_follow_the_arguments() {
    signs(
        &in_intersect("float x = mix(|"),
        expect!["0 of 27; float mix(float x, float y, float a) (float x)"],
    );
    signs(
        &in_intersect("float x = mix(1.0, rt_|, 2.0);"),
        expect!["0 of 27; float mix(float x, float y, float a) (float y)"],
    );
    signs(
        &in_intersect("Meeting m = meet(vec3(0.0), |)"),
        expect!["0 of 1; Meeting meet(vec3 o, vec3 d) (vec3 d)"],
    );
    signs(&in_intersect("Meeting m = meet(vec3(0.0, |"), expect!["nothing"]);
    signs(
        &in_intersect("Meeting m = Meeting(1.0, |);"),
        expect!["0 of 1; Meeting(float distance, vec2 place) (vec2 place)"],
    );
    signs(
        &in_intersect("float x = scale.twice(|);"),
        expect!["0 of 1; float twice(float x) (float x)"],
    );
    signs(&in_intersect("if (hit(|"), expect!["0 of 1; bool hit(float t) (float t)"]);
    signs(
        "class A : rt_Texture; public rt_Texture map; void lookup() { rt_TextureColor = map.lookup(|) }",
        expect!["1 of 4; color lookup(vec2 uv) (vec2 uv)"],
    );
    signs(&in_intersect("float x = (|"), expect![["nothing"]]);
}
