//! Errors name the place and the remedy.

use expect_test::expect;

use crate::{text_of, with_material};

fn with_input(input: &str) -> String {
    with_material(&format!(
        "<standard_surface name=\"surface\" type=\"surfaceshader\">\n{input}\n</standard_surface>"
    ))
}

#[test]
fn texts_that_are_no_documents() {
    expect![[r#"
        error[E0630]: the document is no well-formed XML: expected 'a' tag, not 'b' at 2:4
          ┌─ test.mtlx:2:4
          │
        2 │ <a></b>
          │    ^

    "#]]
    .assert_eq(&text_of("<materialx>\n<a></b>\n</materialx>"));
    expect![[r#"
        error[E0630]: `test.mtlx` is no MaterialX document
          ┌─ test.mtlx:1:1
          │
        1 │ <svg/>
          │ ^^^^^^ found `svg`, expected `materialx`

    "#]]
    .assert_eq(&text_of("<svg/>"));
    expect![[r#"
        error[E0630]: the document has a document type declaration, which is not read
          ┌─ test.mtlx:1:1
          │
        1 │ <!DOCTYPE x [<!ENTITY a "b">]><materialx/>
          │ ^

    "#]]
    .assert_eq(&text_of("<!DOCTYPE x [<!ENTITY a \"b\">]><materialx/>"));
}

#[test]
fn names_that_nothing_has() {
    let of = |input: &str| text_of(&with_input(input));
    expect![[r#"
        error[E0631]: there is no node `nothing`
          ┌─ test.mtlx:3:1
          │
        3 │ <input name="base" type="float" nodename="nothing"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ named here
          │
          = help: the name is that of a sibling, or of a node graph of the document

    "#]]
    .assert_eq(&of(r#"<input name="base" type="float" nodename="nothing"/>"#));
    expect![[r#"
        error[E0631]: there is no node `surfac`
          ┌─ test.mtlx:3:1
          │
        3 │ <input name="base" type="float" nodegraph="surfac" output="out"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ named here
          │
          = help: did you mean `surface`?

    "#]]
    .assert_eq(&of(r#"<input name="base" type="float" nodegraph="surfac" output="out"/>"#));
    let text = with_material("<multiplie name=\"surface\" type=\"surfaceshader\"/>");
    expect![[r#"
        error[E0632]: the surface `multiplie` is not supported
          ┌─ test.mtlx:2:1
          │
        2 │ <multiplie name="surface" type="surfaceshader"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

    "#]]
    .assert_eq(&text_of(&text));
    expect![[r#"
        error[E0631]: `test.mtlx` has no material
          ┌─ test.mtlx:1:1
          │
        1 │ <materialx/>
          │ ^^^^^^^^^^^^
          │
          = help: a material is a `surfacematerial` with a surface

    "#]]
    .assert_eq(&text_of("<materialx/>"));
}

#[test]
fn values_of_other_types() {
    let of = |input: &str| text_of(&with_input(input));
    expect![[r#"
        error[E0630]: `1, 0.5` is no value of type `color3`
          ┌─ test.mtlx:3:1
          │
        3 │ <input name="base_color" type="color3" value="1, 0.5"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: expected 3 numbers, with commas between them

    "#]]
    .assert_eq(&of(r#"<input name="base_color" type="color3" value="1, 0.5"/>"#));
    expect![[r#"
        error[E0630]: `red` is no value of type `float`
          ┌─ test.mtlx:3:1
          │
        3 │ <input name="base" type="float" value="red"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: expected a number

    "#]]
    .assert_eq(&of(r#"<input name="base" type="float" value="red"/>"#));
}

#[test]
fn numbers_beyond_those_of_the_type_are_left_out() {
    let of = |input: &str| text_of(&with_input(input));
    expect![[r#"
        warning[W0605]: `10, 5, 1` has too many numbers for the type `float`: the first one counts
          ┌─ test.mtlx:3:1
          │
        3 │ <input name="base" type="float" value="10, 5, 1"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : StandardSurface;

        public texture float base = 10.0;
    "#]]
    .assert_eq(&of(r#"<input name="base" type="float" value="10, 5, 1"/>"#));
    expect![[r#"
        warning[W0605]: `1, 0.5, 0, 1` has too many numbers for the type `color3`: the first ones count
          ┌─ test.mtlx:3:1
          │
        3 │ <input name="base_color" type="color3" value="1, 0.5, 0, 1"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : StandardSurface;

        public texture color baseColor = color(vec3(1.0, 0.5, 0.0));
    "#]]
        .assert_eq(&of(r#"<input name="base_color" type="color3" value="1, 0.5, 0, 1"/>"#));
}

#[test]
fn unknown_types_are_warnings() {
    let text = with_material(
        "<constant name=\"c\" type=\"float\"><input name=\"value\" type=\"float\" value=\"0.5\"/></constant>\n\
         <dot name=\"a\" type=\"flot\"><input name=\"in\" type=\"floMat\" nodename=\"c\"/></dot>\n\
         <standard_surface name=\"surface\" type=\"surfaceshader\">\n\
         <input name=\"base\" type=\"float\" nodename=\"a\"/>\n</standard_surface>",
    );
    expect![[r#"
        warning[W0605]: unknown type `floMat`: the value keeps the type of what it is connected to
          ┌─ test.mtlx:3:27
          │
        3 │ <dot name="a" type="flot"><input name="in" type="floMat" nodename="c"/></dot>
          │                           ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: did you mean `float`?

        warning[W0605]: unknown type `flot`: the node counts as one of the type `float`
          ┌─ test.mtlx:3:1
          │
        3 │ <dot name="a" type="flot"><input name="in" type="floMat" nodename="c"/></dot>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: did you mean `float`?

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : StandardSurface;

        public texture float base = 0.5;
    "#]]
    .assert_eq(&text_of(&text));
    let text =
        text.replace("<constant", "<typedef name=\"floMat\"/><typedef name=\"flot\"/>\n<constant");
    assert!(!text_of(&text).contains("unknown type"));
}

#[test]
fn parts_that_are_not_supported() {
    let text = with_material(
        "<curveadjust name=\"a\" type=\"float\"/>\n\
         <standard_surface name=\"surface\" type=\"surfaceshader\">\n\
         <input name=\"base\" type=\"float\" nodename=\"a\"/>\n</standard_surface>",
    );
    expect![[r#"
        error[E0632]: `curveadjust` is not supported: its curve is no part of the standard library
          ┌─ test.mtlx:2:1
          │
        2 │ <curveadjust name="a" type="float"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

    "#]]
    .assert_eq(&text_of(&text));
}

#[test]
fn parts_without_effect_are_warnings() {
    let text = with_input(r#"<input name="tangent" type="vector3" value="1, 0, 0"/>"#)
        .replace("<standard_surface", "<xi:include href=\"missing.mtlx\"/>\n<standard_surface");
    expect![[r#"
        warning[W0605]: `missing.mtlx` is not included: there is no such file
          ┌─ test.mtlx:2:1
          │
        2 │ <xi:include href="missing.mtlx"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

        warning[W0605]: the input `tangent` of `standard_surface` has no effect
          ┌─ test.mtlx:4:1
          │
        4 │ <input name="tangent" type="vector3" value="1, 0, 0"/>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : StandardSurface;

    "#]]
    .assert_eq(&text_of(&text));
}

#[test]
fn circles() {
    let text = with_input(r#"<input name="base" type="float" nodename="a"/>"#).replace(
        "<standard_surface",
        "<add name=\"a\" type=\"float\"><input name=\"in1\" type=\"float\" nodename=\"b\"/></add>\n\
         <add name=\"b\" type=\"float\"><input name=\"in1\" type=\"float\" nodename=\"a\"/></add>\n\
         <standard_surface",
    );
    expect![[r#"
        error[E0633]: connections form a circle, or are too long
          ┌─ test.mtlx:2:1
          │
        2 │ <add name="a" type="float"><input name="in1" type="float" nodename="b"/></add>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = note: at most 512 nodes may follow one another

    "#]]
    .assert_eq(&text_of(&text));
    let text = with_input("")
        .replace("<standard_surface", "<xi:include href=\"circle.mtlx\"/><standard_surface");
    assert!(!text_of(&text).contains("error"));
}
