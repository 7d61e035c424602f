//! Every race's contenders compute the same, so that their times mean something.

use std::time::Duration;

use rtsl_bench::arena::Arena;
use rtsl_bench::compare::{difference, outputs};
use rtsl_bench::contenders::{Contender, Engines};
use rtsl_bench::leaf::{leaves, run_leaf};
use rtsl_bench::measure::Plan;
use rtsl_bench::races;

#[test]
fn contenders_agree_with_the_reference() {
    let Ok(engines) = Engines::new(None) else {
        eprintln!("without LLVM there is nothing to race");
        return;
    };
    for race in races() {
        let scratch_arrays = engines.scratch_arrays(&race).unwrap();
        let mut arena = Arena::new(&race, 16, scratch_arrays);
        let reference = Contender::written(&race, "reference", race.written.reference);
        let expected = outputs(&reference, &mut arena);
        for contender in engines.contenders(&race).unwrap() {
            let found = difference(&outputs(&contender, &mut arena), &expected);
            assert!(
                found.error < 1e-3 && found.unmatched <= 1,
                "{} of {}: {found:?}",
                contender.name,
                race.name,
            );
        }
    }
}

#[test]
fn a_leaf_finds_what_single_calls_find() {
    let Ok(engines) = Engines::new(None) else { return };
    for leaf in leaves(None) {
        run_leaf(&leaf, &engines, Plan { repetitions: 1, time: Duration::ZERO }).unwrap();
    }
}
