//! Statements that make values that are not finite.

use expect_test::expect;
use rtsl_debug::Granularity::Line;
use rtsl_debug::{Pauses, Reason};

use crate::common::{after, place, replay, walk};

const TEXT: &str = "class Spoilt : rt_Texture;
float root(float x) {
    return sqrt(x);
}
void lookup() {
    float unused = 1.0 / (rt_TextureUV.x - 0.25);
    float value = 0.0;
    for (int i = 0; i < 4; i++) {
        float next = root(1.5 - float(i));
        if (i < 3) value += next;
    }
    rt_TextureColor = color(value, unused > 0.0 ? 1.0 : 0.0, 0.0);
}";

/// The run ends where the value is made, in the iteration that makes it, and not for values that leave no method.
#[test]
fn the_statement_that_makes_a_value() {
    let mut replay = replay(TEXT);
    replay.set_pauses(Pauses { not_finite: true, ..Pauses::default() });
    let stopped = replay.run();
    let place = after(&replay, &stopped);
    expect!["root:3 Spoilt.lookup:9: this statement makes NaN of finite numbers: sqrt(x)"]
        .assert_eq(&place);
    let caller = replay.frames().swap_remove(1);
    assert_eq!(replay.scopes(&caller).find("i").unwrap().to_string(), "2");
    assert_eq!(replay.run().reason, Reason::End);
}

/// From the end of the recording back to the operation.
#[test]
fn backwards() {
    let mut replay = replay(TEXT);
    replay.jump(usize::MAX);
    replay.set_pauses(Pauses { not_finite: true, ..Pauses::default() });
    let found = replay.run_back();
    assert!(matches!(found.reason, Reason::NotFinite(_)), "{found:?}");
    assert_eq!(place(&replay), "root:3 Spoilt.lookup:9");
    expect![[r#"
        Spoilt.lookup:9
        Spoilt.lookup:8
    "#]]
    .assert_eq(&walk(&mut replay, 2, |it| it.step_back(Line)));
}
