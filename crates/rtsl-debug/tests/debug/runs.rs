//! Runs to breakpoints and to prints.

use expect_test::expect;
use rtsl::TraceLimits;
use rtsl_debug::Granularity::Line;
use rtsl_debug::{Pauses, Reason, Replay};

use crate::common::{SUMMED, place, replay, replay_with, walk};

#[test]
fn lines_in_both_directions() {
    let mut replay = replay(SUMMED);
    let breakpoint = replay.add_breakpoint("test.rtsl", 14, None).unwrap();
    assert!(breakpoint.is_reached);
    expect![[r#"
        Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:22: End
    "#]]
    .assert_eq(&walk(&mut replay, 4, Replay::run));
    expect![[r#"
        Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:10: Start
    "#]]
    .assert_eq(&walk(&mut replay, 4, Replay::run_back));
}

#[test]
fn breakpoints_move_to_statements() {
    let mut replay = replay(SUMMED);
    let line = |replay: &mut Replay, source: &str, line: u32| {
        let breakpoint = replay.add_breakpoint(source, line, None);
        breakpoint.map(|it| format!("{:?}, reached: {}", it.location, it.is_reached))
    };
    let lines: Vec<_> = [("test.rtsl", 1), ("test.rtsl", 16), ("test.rtsl", 11), ("test.rtsl", 99)]
        .iter()
        .map(|(source, at)| format!("{at}: {:?}", line(&mut replay, source, *at)))
        .collect();
    expect![[r#"
        1: Ok("Line { source: \"test.rtsl\", line: 5 }, reached: true")
        16: Ok("Line { source: \"test.rtsl\", line: 16 }, reached: true")
        11: Ok("Line { source: \"test.rtsl\", line: 12 }, reached: true")
        99: Err("`test.rtsl` has no statement from line 99 on")"#]]
    .assert_eq(&lines.join("\n"));
    assert!(line(&mut replay, "other.rtsl", 1).is_err());
}

#[test]
fn lines_that_do_not_run_are_known() {
    let mut replay = replay(
        "class Branches : rt_Texture;
void lookup() {
    if (rt_TextureUV.x > 0.5) {
        rt_TextureColor = color(1.0);
    }
}",
    );
    let breakpoint = replay.add_breakpoint("test.rtsl", 4, None).unwrap();
    assert!(!breakpoint.is_reached);
    assert_eq!(replay.run().reason, Reason::End);
}

#[test]
fn conditions() {
    let mut replay = replay(SUMMED);
    let condition = Some("term > 0.5 && i == 2".to_owned());
    replay.add_breakpoint("test.rtsl", 15, condition).unwrap();
    let stopped = replay.run();
    assert!(matches!(stopped.reason, Reason::Breakpoint(_, None)), "{stopped:?}");
    let call = replay.frames().swap_remove(0);
    assert_eq!(replay.evaluate("i", &call).unwrap().to_string(), "2");
    assert_eq!(replay.run().reason, Reason::End);
}

#[test]
fn conditions_that_fail_stop_with_the_error() {
    let mut replay = replay(SUMMED);
    replay.add_breakpoint("test.rtsl", 15, Some("term + 1.0".to_owned())).unwrap();
    let Reason::Breakpoint(_, Some(error)) = replay.run().reason else {
        panic!("it is no condition");
    };
    assert_eq!(error, "`term + 1.0` is float, not a bool");
    // It is evaluated no further.
    assert_eq!(replay.run().reason, Reason::End);
}

#[test]
fn functions() {
    let mut replay = replay(SUMMED);
    assert!(replay.add_function_breakpoint("square", Some("x > 0.0".to_owned())).is_reached);
    assert!(!replay.add_function_breakpoint("cube", None).is_reached);
    expect![[r#"
        square:5 Summed.lookup:14: Breakpoint(BreakpointId(1), None)
        Summed.lookup:22: End
    "#]]
    .assert_eq(&walk(&mut replay, 2, Replay::run));
    replay.retain_breakpoints(|_| false);
    assert_eq!(replay.run_back().reason, Reason::Start);
}

/// Steps end at breakpoints in the functions that they step over.
#[test]
fn steps_end_at_breakpoints() {
    let mut replay = replay(SUMMED);
    replay.add_breakpoint("test.rtsl", 6, None).unwrap();
    walk(&mut replay, 3, |it| it.step_over(Line));
    assert!(matches!(replay.step_over(Line).reason, Reason::Breakpoint(..)));
    assert_eq!(place(&replay), "square:6 Summed.lookup:14");
}

#[test]
fn prints() {
    let mut replay = replay(SUMMED);
    let end = replay.run();
    assert_eq!(end.prints, ["test.rtsl:20: Summed.lookup: sum 1.0"]);
    assert_eq!(end.reason, Reason::End);
    replay.set_pauses(Pauses { print: true, ..Pauses::default() });
    assert_eq!(replay.run_back().reason, Reason::Print("sum 1.0".to_owned()));
    assert_eq!(place(&replay), "Summed.lookup:20");
    assert_eq!(replay.step_over(Line).prints, ["test.rtsl:20: Summed.lookup: sum 1.0"]);
}

/// A run from the start can end at the first statement, too.
#[test]
fn the_first_statement() {
    let mut replay = replay(SUMMED);
    replay.add_function_breakpoint("Summed.lookup", None);
    assert!(matches!(replay.run_from_start().reason, Reason::Breakpoint(..)));
    assert_eq!(replay.position(), 0);
}

/// The condition of a line that runs often takes time in proportion, in both directions.
#[test]
fn conditions_of_long_loops() {
    let mut replay = replay_with(
        "class Long : rt_Texture;
float add(float a, float b) {
    return a + b;
}
void lookup() {
    float sum = 0.0;
    for (int i = 0; i < 5000; i++) sum = add(sum, float(i));
    rt_FloatTextureValue = sum;
}",
        0.25,
        TraceLimits { skip: 0, keep: 1 << 20 },
    );
    replay.add_breakpoint("test.rtsl", 3, Some("b == 4321.0".to_owned())).unwrap();
    assert!(matches!(replay.run().reason, Reason::Breakpoint(..)));
    let caller = replay.frames().swap_remove(1);
    assert_eq!(replay.evaluate("i", &caller).unwrap().to_string(), "4321");
    replay.jump(usize::MAX);
    assert!(matches!(replay.run_back().reason, Reason::Breakpoint(..)));
    assert_eq!(replay.evaluate("i", &caller).unwrap().to_string(), "4321");
}
