//! The outline, folds, colours and commands of a text.

use expect_test::expect;
use rtsl_ide::{OutlineEntry, folds, lenses, outline, semantic_tokens};

use crate::{DISC, document};

fn lines(entries: &[OutlineEntry], depth: usize, shown: &mut Vec<String>) {
    for entry in entries {
        shown.push(format!(
            "{}{} {:?}: {}",
            "  ".repeat(depth),
            entry.name,
            entry.kind,
            entry.detail
        ));
        lines(&entry.children, depth + 1, shown);
    }
}

#[test]
fn the_outline_lists_declarations() {
    let mut shown = Vec::new();
    lines(&outline(&document(DISC)), 0, &mut shown);
    expect![[r#"
        scale Module: import lib.scale
        Meeting Struct: struct Meeting
          distance Field: float distance
          place Field: vec2 place
        Kind Enumeration: enum Kind
          Round Choice: Kind.Round
          Square Choice: Kind.Square = 4
        Disc Class: class Disc : rt_Primitive
          radius Parameter: public float radius = 1.0
          kind Parameter: public Kind kind = Round
          squared Member: private float squared
          where Member: scratch vec2 where
          constructor Constructor: constructor()
          meet Function: Meeting meet(vec3 o, vec3 d)
          intersect Function: void intersect()
          computeNormal Function: void computeNormal()"#]]
    .assert_eq(&shown.join("\n"));
}

#[test]
fn blocks_comments_and_branches_fold() {
    let text = "// a\n// b\nvoid f() {\n    g(1,\n        2);\n}\n#if A\nint x;\n#else\nint y;\n#endif\n/* c\n d */\nvoid g() { }\n";
    let shown: Vec<String> = folds(text)
        .iter()
        .map(|fold| {
            format!(
                "{}..{}{}",
                fold.first,
                fold.last,
                if fold.is_comment { " comment" } else { "" }
            )
        })
        .collect();
    expect![[r#"
        0..1 comment
        2..4
        6..7
        8..9
        11..12 comment"#]]
    .assert_eq(&shown.join("\n"));
}

#[test]
fn words_have_kinds() {
    let document = document(DISC);
    let shown: Vec<String> = semantic_tokens(&document)
        .iter()
        .filter(|token| {
            !matches!(format!("{:?}", token.kind).as_str(), "Keyword" | "Number" | "Comment")
        })
        .map(|token| {
            let mut marks = String::new();
            if token.is_declaration {
                marks.push_str(" declares");
            }
            if token.is_readonly {
                marks.push_str(" readonly");
            }
            if token.is_of_language {
                marks.push_str(" language");
            }
            format!("{} {:?}{marks}", &DISC[token.start as usize..token.end as usize], token.kind)
        })
        .collect();
    expect![[r#"
        scale Module declares
        Meeting Struct declares
        float Type language
        distance Property declares
        vec2 Type language
        place Property declares
        Kind Enumeration declares
        Round Choice declares
        Square Choice declares
        Disc Class declares
        rt_Primitive Class language
        "Radius of the disc." Text
        float Type language
        radius Property declares
        Kind Enumeration
        kind Property declares
        Round Choice
        float Type language
        squared Property declares
        vec2 Type language
        where Property declares
        #define LIMIT 1e-3 Macro
        constructor Method declares
        squared Property
        scale Module
        twice Function
        radius Property
        radius Property
        Meeting Struct
        meet Method declares
        vec3 Type language
        o Parameter declares
        vec3 Type language
        d Parameter declares
        Meeting Struct
        it Variable declares
        it Variable
        distance Property
        o Parameter
        d Parameter
        it Variable
        place Property
        o Parameter
        it Variable
        distance Property
        d Parameter
        it Variable
        void Type language
        intersect Method declares
        Meeting Struct
        at Variable declares
        meet Method
        rt_RayOrigin Variable language
        rt_RayDirection Variable language
        int Type language
        steps Variable declares
        float Type language
        offset Variable declares
        radius Property
        steps Variable
        float Type language
        far Variable declares
        dot Function language
        at Variable
        place Property
        at Variable
        place Property
        LIMIT Macro
        far Variable
        squared Property
        offset Variable
        hit Function language
        at Variable
        distance Property
        where Property
        at Variable
        place Property
        void Type language
        computeNormal Method declares
        rt_GeometricNormal Variable language
        vec3 Type language"#]]
    .assert_eq(&shown.join("\n"));
}

#[test]
fn classes_and_methods_have_commands() {
    let document = document(DISC);
    let shown: Vec<String> = lenses(&document)
        .iter()
        .map(|lens| format!("{} {}", lens.class, lens.method.as_deref().unwrap_or("test")))
        .collect();
    expect![[r#"
        Disc test
        Disc intersect
        Disc computeNormal"#]]
    .assert_eq(&shown.join("\n"));
}
