//! Generated C++ gives the oracle's bits: every method and constructor of the standard library, and generated
//! functions, with g++ and clang++, also where they are told to contract and to use all of the machine.
//!
//! All of it is one program for each compiler and setting, which reads calls as words and writes what they leave.

mod compilers;
mod driver;
mod memory;
mod noise;
mod subjects;

use compilers::{Setting, settings};
use driver::Driver;
use subjects::Subject;

/// Calls of each method.
const CALLS: u64 = 24;

#[test]
fn cpp_gives_the_oracles_bits() {
    let settings = settings();
    if settings.is_empty() {
        return;
    }
    let subjects = subjects::all();
    std::thread::scope(|scope| {
        for setting in &settings {
            let taken: Vec<&Subject> = subjects.iter().filter(|it| setting.takes(it)).collect();
            scope.spawn(move || check(setting, &taken));
        }
    });
}

/// Compares these subjects by a compiler with the oracle.
fn check(setting: &Setting, subjects: &[&Subject]) {
    let driver = Driver::new(subjects);
    let mut words = Vec::new();
    let mut expected = Vec::new();
    for (number, subject) in subjects.iter().enumerate() {
        for seed in 0..CALLS {
            words.push(number as u32);
            expected.push(subject.call(seed, &mut words));
        }
    }
    let found = setting.run(driver.text(), driver.headers(), &words);
    compare(setting, subjects, &expected, &found);
}

fn compare(setting: &Setting, subjects: &[&Subject], expected: &[Vec<u32>], found: &[u32]) {
    let mut found = found;
    for (call, expected) in expected.iter().enumerate() {
        let subject = subjects[call / CALLS as usize];
        assert!(found.len() >= expected.len(), "{setting}: the program wrote too little");
        let (own, rest) = found.split_at(expected.len());
        found = rest;
        let canonical = subject.canonical(own);
        if let Some(at) = (0..expected.len()).find(|at| expected[*at] != canonical[*at]) {
            let (expected, found) = (expected[at], canonical[at]);
            let (name, seed) = (&subject.name, call as u64 % CALLS);
            panic!(
                "{setting}: {name}, call {seed}: {} is {found:#x}, not {expected:#x}",
                subject.output_name(at)
            );
        }
    }
    assert!(found.is_empty(), "{setting}: the program wrote too much");
}
