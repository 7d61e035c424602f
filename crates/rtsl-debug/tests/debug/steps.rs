//! Movements by lines and statements.

use expect_test::expect;
use rtsl_debug::Granularity::{Line, Statement};
use rtsl_debug::{Reason, Replay};

use crate::common::{SUMMED, frame, place, replay, walk};

#[test]
fn lines_with_calls() {
    let mut replay = replay(SUMMED);
    assert_eq!(place(&replay), "Summed.lookup:10");
    expect![[r#"
        Summed.lookup:12
        Summed.lookup:13
        Summed.lookup:14
        square:5 Summed.lookup:14
        square:6 Summed.lookup:14
        square:8 Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:16
        Summed.lookup:13
        Summed.lookup:14
        square:5 Summed.lookup:14
        square:7 Summed.lookup:14
        square:8 Summed.lookup:14
        Summed.lookup:15
    "#]]
    .assert_eq(&walk(&mut replay, 14, |it| it.step_in(Line)));
}

#[test]
fn lines_over_calls() {
    let mut replay = replay(SUMMED);
    expect![[r#"
        Summed.lookup:12
        Summed.lookup:13
        Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:16
        Summed.lookup:13
        Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:16
        Summed.lookup:13
        Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:17
        Summed.lookup:18
        Summed.lookup:13
        Summed.lookup:20
        Summed.lookup:21
        Summed.lookup:22
    "#]]
    .assert_eq(&walk(&mut replay, 18, |it| it.step_over(Line)));
}

#[test]
fn steps_over_end_in_the_caller() {
    let mut replay = replay(SUMMED);
    walk(&mut replay, 4, |it| it.step_in(Line));
    assert_eq!(place(&replay), "square:5 Summed.lookup:14");
    expect![[r#"
        square:6 Summed.lookup:14
        square:8 Summed.lookup:14
        Summed.lookup:15
    "#]]
    .assert_eq(&walk(&mut replay, 3, |it| it.step_over(Line)));
}

#[test]
fn a_function_is_left_forwards_and_backwards() {
    let mut replay = replay(SUMMED);
    walk(&mut replay, 5, |it| it.step_in(Line));
    assert_eq!(place(&replay), "square:6 Summed.lookup:14");
    let inside = replay.position();
    assert_eq!(walk(&mut replay, 1, Replay::step_out), "Summed.lookup:15\n");
    replay.jump(inside);
    assert_eq!(walk(&mut replay, 1, Replay::step_back_out), "Summed.lookup:14\n");
    // The renderer has called the method: its first statement is the call.
    assert_eq!(walk(&mut replay, 1, Replay::step_back_out), "Summed.lookup:10\n");
    assert_eq!(replay.step_back_out().reason, Reason::Start);
}

/// Every statement that runs is a stop: going back visits those that going forwards does.
#[test]
fn all_statements_backwards() {
    let mut replay = replay(SUMMED);
    let mut forwards = vec![place(&replay)];
    while replay.step_in(Statement).reason == Reason::Step {
        forwards.push(place(&replay));
    }
    assert_eq!(forwards.len(), replay.len());
    let mut backwards = vec![place(&replay)];
    while replay.position() > 0 {
        replay.step_back_in(Statement);
        backwards.push(place(&replay));
    }
    backwards.reverse();
    assert_eq!(forwards, backwards);
    expect![[r#"
        Summed.lookup:10
        Summed.lookup:12
        Summed.lookup:13
        Summed.lookup:13
        Summed.lookup:14
        square:5 Summed.lookup:14
        square:6 Summed.lookup:14
        square:8 Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:16
        Summed.lookup:13
        Summed.lookup:13
        Summed.lookup:14
        square:5 Summed.lookup:14
        square:7 Summed.lookup:14
        square:8 Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:16
        Summed.lookup:13
        Summed.lookup:13
        Summed.lookup:14
        square:5 Summed.lookup:14
        square:7 Summed.lookup:14
        square:8 Summed.lookup:14
        Summed.lookup:15
        Summed.lookup:17
        Summed.lookup:18
        Summed.lookup:13
        Summed.lookup:13
        Summed.lookup:20
        Summed.lookup:21
        Summed.lookup:22"#]]
    .assert_eq(&forwards.join("\n"));
}

/// A step back is the reverse of a step over, where each is within one call.
#[test]
fn lines_backwards() {
    let mut replay = replay(SUMMED);
    let mut places = vec![place(&replay)];
    for _ in 0..12 {
        replay.step_over(Line);
        places.push(place(&replay));
    }
    while places.pop().is_some_and(|expected| {
        assert_eq!(place(&replay), expected);
        replay.position() > 0
    }) {
        replay.step_back(Line);
    }
    assert!(places.is_empty(), "{places:?}");
    assert_eq!(replay.step_back(Line).reason, Reason::Start);
}

#[test]
fn jumps() {
    let mut replay = replay(SUMMED);
    replay.jump(usize::MAX);
    assert_eq!(place(&replay), "Summed.lookup:22");
    assert_eq!(replay.step_over(Line).reason, Reason::End);
    assert_eq!(place(&replay), "Summed.lookup:22");
    let call = frame(&replay);
    replay.jump_to_start_of(&call);
    assert_eq!(replay.position(), 0);
    replay.jump(4);
    assert_eq!(replay.position(), 4);
}

#[test]
fn origins_of_values() {
    let mut replay = replay(SUMMED);
    replay.jump(usize::MAX);
    let origin = |replay: &mut Replay, name: &str| {
        let call = frame(replay);
        replay.jump_to_origin(name, &call).map(|_| place(replay))
    };
    assert_eq!(origin(&mut replay, "sum").unwrap(), "Summed.lookup:18");
    // Its last field that was set.
    assert_eq!(origin(&mut replay, "best").unwrap(), "Summed.lookup:17");
    assert_eq!(origin(&mut replay, "best").unwrap(), "Summed.lookup:12");
    let missing = origin(&mut replay, "count").unwrap_err();
    assert_eq!(missing, "no statement of `Summed.lookup` sets `count`");
    let unknown = origin(&mut replay, "nothing").unwrap_err();
    assert_eq!(unknown, "there is no variable `nothing` here");
}
