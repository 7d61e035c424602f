//! The declarations of texts.

use rtsl::{ClassOutline, Compiler, NoIncludes, Outline};

/// With so many classes, a search among all for each would outlast the patience of whoever runs the tests.
#[test]
fn generations_of_long_chains_are_found_by_name() {
    const COUNT: usize = 200_000;
    let class = |index: usize| ClassOutline {
        name: format!("C{index}"),
        bases: vec!["rt_Texture".to_owned(), format!("C{}", index + 1)],
        file: String::new(),
        line: 1,
        text: String::new(),
        functions: Vec::new(),
    };
    let outline = Outline { classes: (0..COUNT).map(class).collect(), ..Outline::default() };
    let generations = outline.generations("C0");
    assert_eq!(generations.len(), COUNT);
    assert_eq!(generations[COUNT - 1].name, format!("C{}", COUNT - 1));
}

#[test]
fn generations_end_where_classes_inherit_each_other() {
    let text =
        "class A : B { }; class B : A { }; class Sphere : Sphere { }; class Loop : Loop { };";
    let outline = Compiler::default().outline("a.rtsl", text, &mut NoIncludes);
    let files = |name: &str| -> Vec<String> {
        let generations = outline.generations(name);
        generations.iter().map(|class| format!("{} {}", class.name, class.file)).collect()
    };
    assert_eq!(files("A"), ["A a.rtsl", "B a.rtsl"]);
    assert_eq!(files("Loop"), ["Loop a.rtsl"]);
    assert!(files("Nothing").is_empty());
    // The one of the text inherits that of the library, which has its name.
    let [own, library] = &files("Sphere")[..] else { panic!("{:?}", files("Sphere")) };
    assert!(
        own == "Sphere a.rtsl" && library.starts_with("Sphere ") && library != own,
        "{library}"
    );
}
