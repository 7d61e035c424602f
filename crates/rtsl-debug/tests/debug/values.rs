//! The values of variables at statements.

use expect_test::expect;
use rtsl_debug::Granularity::{Line, Statement};

use crate::common::{SUMMED, frame, place, replay, variables, walk};

#[test]
fn variables_so_far() {
    let mut replay = replay(SUMMED);
    expect![[r#"
        member count = 3
    "#]]
    .assert_eq(&variables(&replay));
    walk(&mut replay, 4, |it| it.step_in(Line));
    assert_eq!(place(&replay), "square:5 Summed.lookup:14");
    expect![[r#"
        local x = -1.0
        member count = 3
    "#]]
    .assert_eq(&variables(&replay));
    walk(&mut replay, 2, |it| it.step_in(Line));
    assert_eq!(place(&replay), "square:8 Summed.lookup:14");
    expect![[r#"
        local x = -1.0
        member count = 3
        returns 0.0
    "#]]
    .assert_eq(&variables(&replay));
    replay.jump(usize::MAX);
    expect![[r#"
        local sum = 1.0
        local best = {t = 1.0, n = (0.0, 0.0, 1.0)}
        member count = 3
        state set rt_TextureColor = (1.0, 1.0, 1.0)
    "#]]
    .assert_eq(&variables(&replay));
}

#[test]
fn callers_have_the_values_of_their_calls() {
    let mut replay = replay(SUMMED);
    walk(&mut replay, 4, |it| it.step_in(Line));
    let caller = replay.frames().swap_remove(1);
    let scopes = replay.scopes(&caller);
    let names = scopes.locals.iter().map(|value| format!("{} = {value}", value.name()));
    let names: Vec<String> = names.collect();
    expect![[r#"
        sum = 0.0
        best = {t = 0.0, n = (0.0, 0.0, 1.0)}
        i = 0"#]]
    .assert_eq(&names.join("\n"));
}

#[test]
fn results_of_calls() {
    let mut replay = replay(SUMMED);
    walk(&mut replay, 4, |it| it.step_over(Line));
    assert_eq!(place(&replay), "Summed.lookup:15");
    let results = replay.scopes(&frame(&replay)).results;
    let results: Vec<_> = results.iter().map(|(name, it)| format!("{name} = {it}")).collect();
    assert_eq!(results, ["square = 0.0"]);
}

/// A variable is shown where it is visible, with the value of its own, though others have its name.
#[test]
fn variables_of_one_name() {
    let mut replay = replay(
        "class Shadowed : rt_Texture;
void lookup() {
    float x = 1.0;
    {
        float x = 2.0;
        x += 1.0;
    }
    x += 10.0;
    for (int i = 0; i < 2; i++) {
        float seen = x;
        float late;
        if (i == 0) late = 7.0;
        rt_FloatTextureValue = late + seen;
    }
    if (x > 0.0) { float only = 1.0; x += only; } else { x = 0.0; }
    rt_TextureColor = color(x);
}",
    );
    let mut lines = Vec::new();
    loop {
        let scopes = replay.scopes(&frame(&replay));
        let values = scopes.locals.iter().map(|it| format!("{} = {it}", it.name()));
        let values = values.collect::<Vec<_>>().join(", ");
        lines.push(format!("{}: {values}", frame(&replay).line().unwrap()));
        if replay.position() + 1 == replay.len() {
            break;
        }
        replay.step_in(Statement);
    }
    expect![[r#"
        3: 
        5: x = 1.0
        6: x = 2.0
        8: x = 1.0
        9: x = 11.0
        9: x = 11.0, i = 0
        10: x = 11.0, i = 0
        12: x = 11.0, i = 0, seen = 11.0, late = 0.0
        12: x = 11.0, i = 0, seen = 11.0, late = 0.0
        13: x = 11.0, i = 0, seen = 11.0, late = 7.0
        9: x = 11.0, i = 0
        9: x = 11.0, i = 1
        10: x = 11.0, i = 1
        12: x = 11.0, i = 1, seen = 11.0, late = 0.0
        13: x = 11.0, i = 1, seen = 11.0, late = 0.0
        9: x = 11.0, i = 1
        9: x = 11.0, i = 2
        15: x = 11.0
        15: x = 11.0
        15: x = 11.0, only = 1.0
        16: x = 12.0
        17: x = 12.0"#]]
    .assert_eq(&lines.join("\n"));
}

#[test]
fn parts_of_variables() {
    let mut replay = replay(
        "struct Pair { float a; float b[2]; };
class Parts : rt_Texture;
void take(out float[2] values, inout vec3 v) { values[1] = 5.0; v.y = 2.0; }
void lookup() {
    Pair pairs[2];
    pairs[1].b[0] = 3.0;
    vec3 v = vec3(1.0);
    v.zx = vec2(8.0, 9.0);
    mat2 m = mat2(1.0);
    m[1][0] = 4.0;
    int k = int(rt_TextureUV.x * 4.0);
    float table[3];
    table[k] = 6.0;
    table[k]++;
    float taken[2];
    take(taken, v);
    rt_FloatTextureValue = v.y;
}",
    );
    replay.jump(usize::MAX);
    expect![[r#"
        local pairs = [{a = 0.0, b = [0.0, 0.0]}, {a = 0.0, b = [3.0, 0.0]}]
        local v = (9.0, 2.0, 8.0)
        local m = ((1.0, 0.0), (4.0, 1.0))
        local k = 1
        local table = [0.0, 7.0, 0.0]
        local taken = [0.0, 5.0]
        state read rt_TextureUV = (0.25, 0.0)
        state set rt_FloatTextureValue = 2.0
    "#]]
    .assert_eq(&variables(&replay));
}

/// The effects of lines when they ran last.
#[test]
fn effects_of_lines() {
    let mut replay = replay(SUMMED);
    replay.jump(usize::MAX);
    let effects = replay.line_effects(&frame(&replay));
    let lines = effects.iter().map(|(line, effects)| {
        let effects: Vec<String> = effects.iter().map(ToString::to_string).collect();
        format!("{line}: {}", effects.join(", "))
    });
    expect![[r#"
        10: sum = 0.0
        12: best.n = (0.0, 0.0, 1.0)
        13: i = 3, false
        14: term = 1.0
        15: false
        17: best.t = 1.0
        18: sum = 1.0
        20: prints "sum 1.0"
        21: rt_TextureColor = (1.0, 1.0, 1.0)"#]]
    .assert_eq(&lines.collect::<Vec<_>>().join("\n"));
}

/// Members that a function of the class sets are those of the method.
#[test]
fn members_and_state_of_functions() {
    let mut replay = replay(
        "class Kept : rt_Texture;
scratch float kept;
public float scale = 2.0;
void keep(float value) {
    kept = value * scale;
    rt_TextureColor = color(kept);
}
void lookup() {
    keep(rt_TextureUV.x);
    kept += 1.0;
    rt_FloatTextureValue = kept;
}",
    );
    replay.step_over(Line);
    assert_eq!(place(&replay), "Kept.lookup:10");
    expect![[r#"
        member scale = 2.0
        member kept = 0.5
        state read rt_TextureUV = (0.25, 0.0)
        state set rt_TextureColor = (0.5, 0.5, 0.5)
    "#]]
    .assert_eq(&variables(&replay));
}

/// Of a variable that is too large, there are the parts that were set, which say so.
#[test]
fn large_variables() {
    let mut replay = replay(
        "class Large : rt_Texture;
void lookup() {
    float table[100];
    int k = int(rt_TextureUV.x * 8.0);
    table[k] = 1.5;
    k++;
    table[3] = 2.5;
    rt_FloatTextureValue = table[k] + table[3];
}",
    );
    replay.jump(usize::MAX);
    let call = frame(&replay);
    expect![[r#"
        local k = 3
        local table[k], as set last = 1.5
        local table[3], as set last = 2.5
        state read rt_TextureUV = (0.25, 0.0)
        state set rt_FloatTextureValue = 5.0
    "#]]
    .assert_eq(&variables(&replay));
    let error = replay.evaluate("table[k]", &call).unwrap_err();
    assert_eq!(error, "`table[k]` can't be evaluated: there is no `table` here");
}
