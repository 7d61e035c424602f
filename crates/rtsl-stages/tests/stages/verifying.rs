//! Each invariant of stages has its error; the text form is read back.

use expect_test::expect;
use rtsl_stages::verify::verify;
use rtsl_stages::{ParseError, Stages};

/// Two searches: what the first found is asked about after each, so the second is resumed without a surface, and
/// dispatches.
const TEXT: &str = "\
stages Test.radiance
slot 0: i32 first
slot 1: f32

stage 0: start
function Test.radiance.0
state rt_HitDistance: f32[1]
scratch request.0: f32[1]
scratch request.1: f32[1]
scratch request.2: f32[1]
scratch request.3: f32[1]
scratch request.4: f32[1]
scratch request.5: f32[1]
scratch request.6: f32[1]
scratch request.7: f32[1]
scratch next: i32[1]
{
  %0: f32 = load state:rt_HitDistance@0
  %1: i32 = constant 1
  return scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, \
scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, \
scratch:request.7@0 = %0, scratch:next@0 = %1
}

stage 1: nearest_hit, surface answer
function Test.radiance.1
state rt_HitDistance: f32[1]
scratch answer.0: bool[1]
scratch answer.1: i32[1]
scratch answer.2: i32[1]
scratch answer.3: i32[1]
scratch answer.4: f32[1]
scratch frame.0: i32[1]
scratch surface.0: i32[1]
scratch surface.1: i32[1]
scratch surface.2: i32[1]
scratch next: i32[1]
{
  %0: i32 = load scratch:answer.1@0
  %1: i32 = load scratch:answer.2@0
  %2: i32 = load scratch:answer.3@0
  %3: f32 = load scratch:answer.4@0
  %4: f32, %5: f32, %6: f32 = query light_emission %0, %1, %2, %3, %3, %3, %3, %3, %3, %3, %3, %3, %3, %3
  %7: bool = load scratch:answer.0@0
  %8: i32 = constant 2
  %9: i32 = constant -1
  %10: i32 = if %7 {
    yield %8
  } else {
    yield %9
  }
  return scratch:frame.0@0 = %0, scratch:surface.0@0 = %0, scratch:surface.1@0 = %1, scratch:surface.2@0 = %2, \
scratch:next@0 = %10, state:rt_HitDistance@0 = %4
}

stage 2: dispatch, surface request, live 0
function Test.radiance.2
state rt_HitDistance: f32[1]
scratch frame.0: i32[1]
scratch surface.0: i32[1]
scratch surface.1: i32[1]
scratch surface.2: i32[1]
scratch next: i32[1]
{
  %0: i32 = load scratch:frame.0@0
  %1: i32 = load scratch:surface.0@0
  %2: i32 = load scratch:surface.1@0
  %3: i32 = load scratch:surface.2@0
  %4: f32 = convert %0
  %5: f32, %6: f32, %7: f32 = query light_emission %1, %2, %3, %4, %4, %4, %4, %4, %4, %4, %4, %4, %4, %4
  %8: i32 = constant -1
  return scratch:next@0 = %8, state:rt_HitDistance@0 = %5
}
";

#[test]
fn texts_are_read_back() {
    let stages: Stages = TEXT.parse().unwrap();
    verify(&stages).unwrap();
    assert_eq!(stages.to_string(), TEXT);
}

#[test]
fn each_invariant_has_its_error() {
    let table = [
        (
            "%0: i32 = load scratch:answer.1@0",
            "%0: i32 = constant 1",
            ".1: a query is about another surface than that of the stage",
        ),
        (
            "query light_emission %1, %2, %3",
            "query light_emission %0, %2, %3",
            ".2: a query is about another surface than that of the stage",
        ),
        (
            "hit, surface answer",
            "hit",
            ".1: a query is about another surface than that of the stage",
        ),
        (
            "hit, surface answer",
            "hit, surface request",
            ".1: resumed by nearest_hit, its surface cannot be `request`",
        ),
        (
            "dispatch, surface",
            "start, surface",
            ".2: the first stage, and no other, is resumed by the start",
        ),
        (
            "stage 0: start",
            "stage 0: dispatch",
            ".0: the first stage, and no other, is resumed by the start",
        ),
        ("stage 0: start", "stage 0: start, live 0", ".0: slots are live at the start"),
        ("live 0\n", "live 1 0\n", ".2: live slots are not in ascending order"),
        ("live 0\n", "live 0 0\n", ".2: live slots are not in ascending order"),
        ("live 0\n", "live 0 2\n", ".2: there is no slot 2"),
        ("live 0\n", "live 1\n", ".1: slot 1, which is live in stage 2, has no value"),
        (", live 0\n", "\n", ".2: scratch `frame.0` has no value when the stage is resumed"),
        ("slot 0: i32 first", "slot 0: u32 first", ".1: scratch `frame.0` cannot be i32[1]"),
        (
            "scratch request.7: f32[1]",
            "scratch request.7: f32[1] scratch request.14: f32[1]",
            ".0: scratch `request.14` cannot be f32[1]",
        ),
        (
            "scratch answer.4: f32[1]",
            "scratch answer.4: f32[1] scratch answer.5: f32[1]",
            ".1: scratch `answer.5` cannot be f32[1]",
        ),
        ("scratch:next@0 = %8,", "", ".2: it does not store `next`"),
        (
            "scratch:next@0 = %8",
            "scratch:next@0 = %0",
            ".2: `next` is not one of several constants",
        ),
        (
            "%8: i32 = constant 2",
            "%8: i32 = constant 3",
            ".1: `next` names stage 3, which there is not",
        ),
        (
            "%8: i32 = constant 2",
            "%8: i32 = constant 0",
            ".1: `next` names stage 0, which there is not",
        ),
        (
            "%8: i32 = constant 2",
            "%8: i32 = constant -2",
            ".1: `next` names stage -2, which there is not",
        ),
        ("scratch:request.7@0 = %0, ", "", ".0: it does not store `request.7` for stage 1"),
        ("scratch:surface.1@0 = %1, ", "", ".1: it does not store `surface.1` for stage 2"),
        ("scratch:frame.0@0 = %0, ", "", ".1: slot 0, which is live in stage 2, has no value"),
        ("state:rt_HitDistance@0 = %4", "scratch:answer.1@0 = %0", ".1: it stores `answer.1`"),
        (
            "%4: f32 = convert %0",
            "%x: i32 = load scratch:next@0 %4: f32 = convert %0",
            ".2: scratch `next` has no value when the stage is resumed",
        ),
        (
            "%4: f32 = convert %0",
            "%4: f32 = convert %0 %x: bool = occluded %4, %4, %4, %4, %4, %4, %4",
            ".2: it waits for occluded",
        ),
        (
            "{
  %0: i32 = load scratch:frame.0@0",
            "state rt_RayOrigin: f32[3] {
  %x: f32 = load state:rt_RayOrigin@0 %0: i32 = load scratch:frame.0@0",
            ".2: state `rt_RayOrigin` has no value when the stage is resumed",
        ),
        (
            "%4: f32 = convert %0",
            "%4: f32 = convert %0 %x: f32 = add %0, %0",
            ".2: Test.radiance.2: `%5: f32 = add %0, %0`: %5 is f32, expected i32",
        ),
    ];
    for (from, to, expected) in table {
        let text = TEXT.replacen(from, to, 1);
        assert_ne!(text, TEXT, "{from}");
        let stages: Stages = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
        let found = verify(&stages).expect_err(to).to_string();
        assert_eq!(found, format!("Test.radiance{expected}"), "{from} to {to}");
    }
    let empty: Stages = "stages f\n".parse().unwrap();
    assert_eq!(verify(&empty).unwrap_err().to_string(), "f: there is no stage");
}

#[test]
fn texts_that_are_no_stages_have_errors() {
    let mut found = String::new();
    let texts = [
        "",
        "stages f\nslot 1: f32",
        "stages f\nslot 0: x",
        "stages f\nstage 0: begin\nfunction f { return }",
        "stages f\nstage 0: start, surface all\nfunction f { return }",
        "stages f\nstage 0: start, live a\nfunction f { return }",
        "stages f\nstage 0: start\nfunction f { frob }",
        "stages f\nfunction f { return }",
    ];
    for text in texts {
        let error: ParseError = text.parse::<Stages>().unwrap_err();
        found.push_str(&format!("{error}\n"));
    }
    expect![[r#"
        line 1: expected `stages` and a name
        line 2: expected a slot like `slot 0: f32 name`
        line 2: expected a slot like `slot 0: f32 name`
        line 2: expected a stage like `stage 0: start`
        line 2: expected a stage like `stage 0: start`
        line 2: expected a stage like `stage 0: start`
        stage 0: 1:14: `frob` is not an operation
        line 2: expected a slot or a stage
    "#]]
    .assert_eq(&found);
}
