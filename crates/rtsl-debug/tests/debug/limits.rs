//! Recordings that do not begin at the start, or are cut.

use rtsl::{Recording, SteppedLines, TraceLimits};
use rtsl_debug::Granularity::Line;
use rtsl_debug::Replay;

use crate::common::{SUMMED, place, replay, replay_with, variables, walk};

#[test]
fn cut_recordings_tell_it() {
    let cut = replay_with(SUMMED, 0.25, TraceLimits { skip: 0, keep: 20 });
    assert!(cut.dropped() > 0);
    assert_eq!(cut.skipped(), 0);
    let all = replay(SUMMED);
    assert_eq!(all.dropped(), 0);
    assert!(cut.len() < all.len());
}

/// A recording that begins later has the calls and the values that one from the start has there.
#[test]
fn later_starts_have_what_holds() {
    let mut all = replay(SUMMED);
    let count = 1 << 10;
    let mut compared = 0;
    for skip in 1..40 {
        let mut late = replay_with(SUMMED, 0.25, TraceLimits { skip, keep: count });
        assert_eq!(late.skipped(), skip);
        // Statements that are held are of calls; the first that has run follows.
        let before = all.len() - late.len();
        let held = late.frames().len();
        for offset in held..late.len() {
            late.jump(offset);
            all.jump(before + offset);
            assert_eq!(place(&late), place(&all), "{skip}, {offset}");
            assert_eq!(without_results(&late), without_results(&all), "{skip}, {offset}");
            compared += 1;
        }
        late.jump(0);
        walk(&mut late, 2, |it| it.step_in(Line));
    }
    assert!(compared > 300, "{compared}");
}

fn without_results(replay: &Replay) -> Vec<String> {
    let mut lines: Vec<String> = variables(replay)
        .lines()
        .filter(|line| !line.starts_with("result"))
        .map(str::to_owned)
        .collect();
    lines.sort();
    lines
}

#[test]
fn nothing_recorded() {
    let error =
        |recording| Replay::new(recording, SteppedLines::default()).unwrap_err().to_string();
    assert_eq!(error(Recording::default()), "no statement of a shader has run");
    let skipped = Recording { skipped: 7, ..Recording::default() };
    assert_eq!(error(skipped), "no statement has run after the 7 entries that are skipped");
}
