//! Parameters whose types are enumerations: hosts give the names of choices, or their numbers.

use std::sync::Arc;

use expect_test::{Expect, expect};
use rtsl::{Class, Compiler, Instance, Value};

const TEXT: &str = "
enum Blending { Linear, Smooth, Step = 5 };
class T : rt_Texture;
public Blending blending = Smooth;
public Blending pair[2] = Blending[](Linear, Step);
public int plain = 3;
void lookup() { rt_FloatTextureValue = float(blending + pair[0] + plain); }

class Made : rt_Texture;
enum Side { Left = -1, Right };
private int side;
constructor(Side start) { side = start; }
void lookup() { rt_FloatTextureValue = float(side); }
";

fn class(name: &str) -> Arc<Class> {
    let compilation = Compiler::default().compile("test.rtsl", TEXT);
    assert_eq!(compilation.report(false), "");
    compilation.unit.unwrap().class(name).unwrap().clone()
}

fn member(class: &str, arguments: Vec<(&str, Value)>, name: &str) -> Vec<i32> {
    let instance = Instance::new(&self::class(class), arguments).unwrap();
    instance.member(name).unwrap().iter().map(|word| word.cast_signed()).collect()
}

#[test]
fn names_and_numbers_set_choices() {
    assert_eq!(member("T", vec![], "blending"), [1]);
    assert_eq!(member("T", vec![("blending", "Step".into())], "blending"), [5]);
    assert_eq!(member("T", vec![("blending", 0.into())], "blending"), [0]);
    let pair = Value::List(vec!["Smooth".into(), 5.into()]);
    assert_eq!(member("T", vec![("pair", pair)], "pair"), [1, 5]);
    assert_eq!(member("Made", vec![("start", "Left".into())], "side"), [-1]);
}

#[test]
fn parameters_know_their_choices() {
    let (class, made) = (class("T"), class("Made"));
    let choices = |class: &Class, index: usize| {
        let choices = class.parameters[index].choices().into_iter();
        choices.map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>()
    };
    assert_eq!(choices(&class, 0), ["Linear 0", "Smooth 1", "Step 5"]);
    assert_eq!(choices(&class, 1), ["Linear 0", "Smooth 1", "Step 5"]);
    assert!(choices(&class, 2).is_empty());
    assert_eq!(choices(&made, 0), ["Left -1", "Right 0"]);
}

fn refused(arguments: Vec<(&str, Value)>, expected: Expect) {
    let problems = Instance::new(&class("T"), arguments).unwrap_err();
    let text: String = problems.iter().map(|it| format!("{}: {}\n", it.code, it.message)).collect();
    expected.assert_eq(&text);
}

#[test]
fn other_names_and_numbers_are_errors() {
    refused(
        vec![("blending", "Smoth".into())],
        expect![[r#"
        E0504: the parameter `blending` of `T` is out of range: `Smoth` is none of the choices `Linear` (0), `Smooth` (1), `Step` (5); did you mean `Smooth`?
    "#]],
    );
    refused(
        vec![("blending", "dashed".into())],
        expect![[r#"
        E0504: the parameter `blending` of `T` is out of range: `dashed` is none of the choices `Linear` (0), `Smooth` (1), `Step` (5)
    "#]],
    );
    refused(
        vec![("blending", 2.into())],
        expect![[r#"
        E0504: the parameter `blending` of `T` is out of range: 2 is none of the choices `Linear` (0), `Smooth` (1), `Step` (5)
    "#]],
    );
    refused(
        vec![("blending", 1.0.into())],
        expect![[r#"
        E0503: the parameter `blending` of `T` is an int, found a float
    "#]],
    );
    refused(
        vec![("pair", Value::List(vec!["Linear".into(), 7.into()]))],
        expect![[r#"
        E0504: the parameter `pair` of `T` is out of range: 7 is none of the choices `Linear` (0), `Smooth` (1), `Step` (5)
    "#]],
    );
    refused(
        vec![("plain", "Linear".into())],
        expect![[r#"
        E0503: the parameter `plain` of `T` is an int, found the text "Linear"
    "#]],
    );
}
