//! The meaning of names: hover, definitions, references, renaming.

use expect_test::{Expect, expect};
use rtsl_ide::{definition, hover, key_at, name_refusal, occurrences, rename_refusal};

use crate::{DISC, Question, document, shown};

/// Asks at the n-th occurrence of a text in the disc's.
fn at(text: &str, nth: usize) -> Question {
    let offset = DISC.match_indices(text).nth(nth).expect("it occurs").0;
    Question { text: DISC.to_owned(), offset: offset + 1 }
}

fn hovers(question: &Question, expected: Expect) {
    let document = question.document();
    let found = hover(&document, question.offset());
    expected.assert_eq(&found.map_or("nothing".to_owned(), |hover| hover.text));
}

#[test]
fn the_disc_has_no_errors() {
    let document = document(DISC);
    let errors = document.analysis.diagnostics.iter().filter(|it| it.is_error());
    let report: Vec<String> = errors.map(ToString::to_string).collect();
    assert!(report.is_empty(), "{report:?}");
}

#[test]
fn hovers_describe_names() {
    hovers(
        &at("radius", 1),
        expect![[r#"
        ```rtsl
        public float radius = 1.0
        ```

        Of `Disc`.

        Radius of the disc. At least 0."#]],
    );
    hovers(
        &at("rt_RayOrigin", 0),
        expect![[r#"
            ```rtsl
            vec3 rt_RayOrigin
            ```

            Origin of the ray, in the primitive's space; in `generateSample` and `samplePDF` the point to be lit. `intersect` reads it."#]],
    );
    hovers(
        &at("meet(", 1),
        expect![[r#"
        ```rtsl
        Meeting meet(vec3 o, vec3 d)
        ```

        Of `Disc`.

        The meeting with the plane."#]],
    );
    hovers(
        &at("dot(", 0),
        expect![[r#"
        ```rtsl
        float dot(genF a, genF b)
        ```

        Here: `float dot(float a, float b)`.

        The sum of the products of the components."#]],
    );
    hovers(
        &at("distance", 2),
        expect![[r#"
        ```rtsl
        float distance
        ```

        Of `Meeting`."#]],
    );
    hovers(
        &at("twice", 0),
        expect![[r#"
        ```rtsl
        float twice(float x)
        ```

        Twice as much."#]],
    );
    hovers(
        &at("LIMIT", 1),
        expect![[r#"
        ```rtsl
        #define LIMIT 1e-3
        ```"#]],
    );
    hovers(
        &at("intersect", 0),
        expect![[r#"
        ```rtsl
        void intersect()
        ```

        Of `Disc`.

        A method that renderers call: it offers the ray's hits to `hit()`."#]],
    );
    hovers(
        &at("rt_Primitive", 0),
        expect![[r#"
        ```rtsl
        rt_Primitive
        ```

        The role of a primitive. Its methods:

        - `intersect` offers the ray's hits to `hit()`
        - `computeBounds` gives an axis-aligned box around the primitive
        - `computeNormal` gives the normals at the hit point
        - `computeTextureCoordinates` gives the texture coordinates of the hit point
        - `computeDerivatives` gives the surface's and the coordinates' derivatives
        - `generateSample` chooses a point on the primitive, seen from a point to be lit
        - `samplePDF` gives the density with which `generateSample` chooses a point"#]],
    );
    hovers(
        &at("Round", 1),
        expect![[r#"
            ```rtsl
            Kind.Round
            ```"#]],
    );
    hovers(
        &at("steps", 1),
        expect![[r#"
        ```rtsl
        int steps = 3
        ```"#]],
    );
    hovers(
        &at("vec3(0.0", 0),
        expect![[r#"
        ```rtsl
        vec3
        ```

        A type of the language."#]],
    );
    hovers(&at("= ", 0), expect![["nothing"]]);
}

#[test]
fn definitions_lead_to_declarations() {
    let names = [
        ("radius", 1),
        ("meet(", 1),
        ("distance", 2),
        ("twice", 0),
        ("scale.", 0),
        ("LIMIT", 1),
        ("Round", 1),
        ("Meeting", 2),
        ("Kind", 1),
        ("dot(", 0),
        ("where", 1),
        ("it.", 1),
        ("rt_RayOrigin", 0),
    ];
    let found = names.map(|(name, nth)| {
        let question = at(name, nth);
        let document = question.document();
        let found = definition(&document, question.offset());
        format!("{name}: {}", found.map_or("none".to_owned(), |span| shown(&document, span)))
    });
    expect![[r#"
        radius: test.rtsl:10:51 `radius`
        meet(: test.rtsl:19:9 `meet`
        distance: test.rtsl:4:24 `distance`
        twice: lib/scale.rtsl:2:7 `twice`
        scale.: lib/scale.rtsl:1:1 ``
        LIMIT: test.rtsl:14:1 `#define LIMIT 1e-3`
        Round: test.rtsl:5:13 `Round`
        Meeting: test.rtsl:4:8 `Meeting`
        Kind: test.rtsl:5:6 `Kind`
        dot(: prelude/geometric.rtsl:3:1 `float dot(float a, float b)`
        where: test.rtsl:13:14 `where`
        it.: test.rtsl:20:13 `it`
        rt_RayOrigin: none"#]]
    .assert_eq(&found.join("\n"));
}

#[test]
fn occurrences_are_those_of_one_declaration() {
    let names = [("radius", 1), ("place", 3), ("Meeting", 0), ("rt_RayDirection", 0), ("twice", 0)];
    let found = names.map(|(name, nth)| {
        let question = at(name, nth);
        let document = question.document();
        let key = key_at(&document, question.offset()).expect("a name");
        let places = occurrences(&document, &key).into_iter().map(|it| {
            let mark = if it.is_declaration { " declares" } else { "" };
            format!("  {}{mark}", shown(&document, it.span))
        });
        format!("{name}\n{}", places.collect::<Vec<_>>().join("\n"))
    });
    expect![[r#"
        radius
          test.rtsl:10:51 `radius` declares
          test.rtsl:16:39 `radius`
          test.rtsl:16:49 `radius`
          test.rtsl:29:20 `radius`
        place
          test.rtsl:4:39 `place` declares
          test.rtsl:22:8 `place`
          test.rtsl:30:24 `place`
          test.rtsl:30:34 `place`
          test.rtsl:31:64 `place`
        Meeting
          test.rtsl:4:8 `Meeting` declares
          test.rtsl:19:1 `Meeting`
          test.rtsl:20:5 `Meeting`
          test.rtsl:27:5 `Meeting`
        rt_RayDirection
          test.rtsl:27:37 `rt_RayDirection`
        twice
          test.rtsl:16:33 `twice`
          lib/scale.rtsl:2:7 `twice` declares"#]]
    .assert_eq(&found.join("\n"));
}

#[test]
fn functions_that_replace_others_are_renamed_with_them() {
    let question = Question::new(
        "class A : rt_Texture {
    float pro|file(float x);
    float profile(float x) { return x; }
    float profile(vec2 x) { return x.x; }
    void lookup() { rt_FloatTextureValue = profile(rt_TextureUV.x) + profile(rt_TextureUV); }
};
class B : A { float profile(float x) { return 0.5 * super.profile(x); } };
class C : B { float profile(float x) { return 0.25; } };
",
    );
    let document = question.document();
    let key = key_at(&document, question.offset()).expect("a name");
    let places: Vec<String> =
        occurrences(&document, &key).into_iter().map(|it| shown(&document, it.span)).collect();
    expect![[r#"
        test.rtsl:2:11 `profile`
        test.rtsl:3:11 `profile`
        test.rtsl:5:44 `profile`
        test.rtsl:7:21 `profile`
        test.rtsl:7:59 `profile`
        test.rtsl:8:21 `profile`"#]]
    .assert_eq(&places.join("\n"));
}

#[test]
fn renaming_is_refused_with_a_reason() {
    let refusals = [
        at("rt_RayOrigin", 0),
        at("intersect", 0),
        at("constructor", 0),
        at("scale", 0),
        at("dot", 0),
        at("LIMIT", 1),
        at("= ", 0),
        at("radius", 0),
        Question::new("class A : Sphere { void computeBounds() { rt_BoundMin = vec3(-ra|dius); rt_BoundMax = rt_BoundMin; } };"),
    ]
    .map(|question| {
        let refusal = rename_refusal(&question.document(), question.offset());
        refusal.unwrap_or_else(|| "may be renamed".to_owned())
    });
    expect![[r#"
        this name belongs to the language
        renderers call this method by its name
        hosts call the constructor by this name
        a module has the name of its file
        this name belongs to the language
        macros are not renamed, since their text may have any meaning
        there is no name here
        may be renamed
        this is declared in the standard library"#]]
    .assert_eq(&refusals.join("\n"));
    let names = ["wide", "rt_x", "a__b", "2x", "if", "a b", "", "float"];
    let refusals = names.map(|name| name_refusal(name).unwrap_or_else(|| "fine".to_owned()));
    expect![[r#"
        fine
        names that start with `rt_` belong to the language
        names with two underscores in a row are reserved
        `2x` is no name
        `if` is no name
        `a b` is no name
        `` is no name
        `float` is no name"#]]
    .assert_eq(&refusals.join("\n"));
}

#[test]
fn words_of_comments_and_texts_name_no_macros() {
    let text = "#define LIMIT 1.0 // LIMIT of it\nclass A : rt_Texture; // The LIMIT\n\
                [[doc \"LIMIT\"]] public float x = LIMIT; /* LIMIT */\n";
    let document = document(text);
    let places = text.match_indices("LIMIT").map(|(offset, _)| offset as u32 + 1);
    let named: Vec<bool> = places.map(|offset| hover(&document, offset).is_some()).collect();
    assert_eq!(named, [true, false, false, false, true, false]);
}

/// Functions of one name, as often as a text may have them, are not compared with each other.
#[test]
fn many_functions_of_one_name_have_their_uses() {
    let count = 3_000;
    let text = "float f();\n".repeat(count)
        + "class A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = f(); }\n";
    let document = document(&text);
    let key = key_at(&document, text.find("f();").expect("it is there") as u32).expect("a name");
    assert_eq!(occurrences(&document, &key).len(), count + 1);
}
