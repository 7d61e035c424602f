//! The command line of the races.

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;

use crate::arena::Arena;
use crate::compare::{difference, outputs};
use crate::contenders::{Contender, Engines};
use crate::leaf::{LeafResult, OBJECTS, leaves, run_leaf};
use crate::measure::{Plan, measure};
use crate::packet::RAYS;
use crate::race::{Race, races};
use crate::report::{self, Entry};

/// Races kernels compiled from RTSL against the same kernels written by hand.
///
/// `w8` is RTSL with 8 rays at a time, `f8` the same with --math=fast; `h256` and `h512` are
/// AVX2 and AVX-512 intrinsics, `t` their tuned forms; `mvec`, `sleef10` and `sleef35` are functions of libraries
/// that are there. For steady results run it on one processor:
/// `taskset -c 1 cargo bench`.
#[derive(Debug, Parser)]
#[command(name = "races")]
struct Arguments {
    /// Only races whose name contains this text.
    filter: Option<String>,
    /// The number of packets that are processed in turn: 1 packet stays in the first-level cache, with well predicted
    /// branches.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 64])]
    packets: Vec<usize>,
    /// The number of SIMD vectors that RTSL processes at a time, 1, 2 or 4; selected for each kernel if not given.
    #[arg(long)]
    interleave: Option<u32>,
    /// The number of times that each contender is timed.
    #[arg(long, default_value_t = 61)]
    repetitions: usize,
    /// Few and short repetitions.
    #[arg(long)]
    quick: bool,
    /// Print one JSON object per line for each contender of each race.
    #[arg(long)]
    json: bool,
    /// Passed by cargo; without it, as under `cargo test`, there is one short repetition.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Runs the races.
pub fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let engines = Engines::new(arguments.interleave)?;
    let named = |race: &Race| arguments.filter.as_ref().is_none_or(|it| race.name.contains(it));
    let races: Vec<Race> = races().into_iter().filter(named).collect();
    if !arguments.json {
        println!("{}\n", engines.describe());
    }
    for packets in &arguments.packets {
        let mut entries = Vec::new();
        for race in &races {
            entries.extend(run_race(race, *packets, &engines, arguments.plan())?);
        }
        print(&entries, arguments.json);
    }
    let leaves = leaves(arguments.filter.as_deref());
    let leaves: Result<Vec<_>, _> =
        leaves.iter().map(|leaf| run_leaf(leaf, &engines, arguments.plan())).collect();
    print_leaves(&leaves?, arguments.json);
    Ok(())
}

impl Arguments {
    fn plan(&self) -> Plan {
        match (self.bench, self.quick) {
            (false, _) => Plan { repetitions: 1, time: Duration::from_micros(100) },
            (true, true) => Plan { repetitions: 7, time: Duration::from_micros(300) },
            (true, false) => {
                Plan { repetitions: self.repetitions.max(1), time: Duration::from_micros(500) }
            }
        }
    }
}

fn run_race(
    race: &Race,
    packets: usize,
    engines: &Engines,
    plan: Plan,
) -> Result<Vec<Entry>, String> {
    let contenders = engines.contenders(race)?;
    let mut arena = Arena::new(race, packets, engines.scratch_arrays(race)?);
    let reference = Contender::written(race, "reference", race.written.reference);
    let expected = outputs(&reference, &mut arena);
    let differences: Vec<_> = contenders
        .iter()
        .map(|contender| difference(&outputs(contender, &mut arena), &expected))
        .collect();
    let timings = measure(&contenders, &mut arena, packets * RAYS, plan);
    let results = contenders.iter().zip(timings).zip(differences);
    let entries = results.map(|((contender, timing), difference)| {
        Entry::new(race.name, &contender.name, packets, timing, difference)
    });
    Ok(entries.collect())
}

fn print_leaves(results: &[LeafResult], json: bool) {
    if !json && !results.is_empty() {
        println!("One ray against {OBJECTS} objects, nanoseconds an object");
    }
    for result in results {
        if json {
            println!("{}", serde_json::to_string(result).unwrap_or_default());
        } else {
            println!("{result}");
        }
    }
}

fn print(entries: &[Entry], json: bool) {
    if json {
        for entry in entries {
            println!("{}", serde_json::to_string(entry).unwrap_or_default());
        }
    } else {
        println!("{}\n{}", report::tables(entries), report::differences(entries));
    }
}
