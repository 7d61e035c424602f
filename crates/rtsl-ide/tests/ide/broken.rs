//! Texts with errors: a broken line does not silence the rest, and causes no further errors.

use expect_test::{Expect, expect};
use rtsl_ide::hover;

use crate::{DISC, Question, document};

fn reports(text: &str, expected: Expect) {
    let document = document(text);
    let sources = &document.analysis.sources;
    let shown = document.analysis.diagnostics.iter().map(|diagnostic| {
        let label = diagnostic.primary.as_ref().expect("a place");
        let line = sources.position(label.span.file, label.span.start).line;
        format!("{line}: {diagnostic}")
    });
    expected.assert_eq(&shown.collect::<Vec<_>>().join("\n"));
}

#[test]
fn other_errors_are_found_beside_a_broken_statement() {
    reports(
        "class A : rt_Texture;
public float scale = 1.0;
float f(float x) { return x +; }
void lookup() {
    float a = scale * ;
    float b c = 2.0;
    float d = a + b + c;
    rt_FloatTextureValue = scael * d;
}
",
        expect![[r#"
            3: error[E0101]: expected an expression, found `;`
            5: error[E0101]: expected an expression, found `;`
            6: error[E0101]: expected `;` after the declaration, found name `c`
            8: error[E0201]: there is no `scael` here"#]],
    );
}

#[test]
fn a_broken_header_hides_its_parameters_and_its_function() {
    reports(
        "class A : rt_Texture;
float f(float x, flaot) { return x; }
float g(float x { return x; }
void lookup() { rt_FloatTextureValue = f(1.0, 2.0) + g(1.0) + h(1.0); }
",
        expect![[r#"
            3: error[E0102]: expected `)`, found `{`
            2: error[E0202]: there is no type `flaot`
            4: error[E0201]: there is no function `h`"#]],
    );
}

#[test]
fn an_unclosed_brace_leaves_the_rest() {
    reports(
        "class A : rt_Texture;
void lookup() {
    if (rt_TextureUV.x > 0.5) {
        rt_FloatTextureValue = 1.0;
}
class B : rt_Texture;
void lookup() { rt_FloatTextureValue = unknown; }
",
        expect![[r#"
            6: error[E0102]: expected `}`, found keyword `class`
            7: error[E0201]: there is no `unknown` here"#]],
    );
}

#[test]
fn names_keep_their_meaning_beside_broken_lines() {
    let broken = DISC.replace("    int steps = 3;\n", "    int steps = 3 +;\n    float = ;\n");
    let at = broken.find("squared + offset").expect("it is there");
    let question = Question { text: broken, offset: at + 1 };
    let found = hover(&question.document(), question.offset()).expect("a meaning");
    expect![[r#"
        ```rtsl
        private float squared
        ```

        Of `Disc`."#]]
    .assert_eq(&found.text);
}

#[test]
fn any_text_has_answers() {
    // Each prefix of a text is a text that someone has typed so far.
    for end in (0..DISC.len()).step_by(7) {
        let document = document(&DISC[..end]);
        hover(&document, end as u32);
        rtsl_ide::hints(&document);
        rtsl_ide::semantic_tokens(&document);
        rtsl_ide::outline(&document);
    }
}
