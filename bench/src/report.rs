//! Tables of results.

use std::fmt::Write as _;

use serde::Serialize;

use crate::compare::Difference;
use crate::measure::Timing;

/// One contender of one race.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Entry {
    /// The race.
    pub race: &'static str,
    /// The contender.
    pub contender: String,
    /// The number of packets processed in turn.
    pub packets: usize,
    /// The median, in nanoseconds per ray.
    pub median: f64,
    /// The minimum.
    pub least: f64,
    /// The 90th percentile.
    pub slow: f64,
    /// The greatest relative error, compared with the reference in double precision.
    pub error: f64,
    /// The number of rays for which only the contender or only the reference has a result.
    pub unmatched: usize,
    #[serde(skip)]
    timing: Timing,
}

impl Entry {
    /// Creates a result.
    pub fn new(
        race: &'static str,
        contender: &str,
        packets: usize,
        timing: Timing,
        difference: Difference,
    ) -> Entry {
        let Timing { median, least, slow, .. } = timing;
        let Difference { error, unmatched } = difference;
        let contender = contender.to_owned();
        Entry { race, contender, packets, median, least, slow, error, unmatched, timing }
    }
}

/// A comparison of one contender's time with the best of others, [repetition by repetition](Timing::ratio).
struct Ratio {
    title: &'static str,
    own: &'static str,
    others: &'static [&'static str],
    /// True if a ratio of at most 1 wins a race.
    is_race: bool,
}

const RATIOS: &[Ratio] = &[
    Ratio { title: "w8/h256", own: "w8", others: &["h256"], is_race: true },
    Ratio { title: "f8/best", own: "f8", others: &["h256", "h256t"], is_race: true },
    Ratio { title: "w16/h512", own: "w16", others: &["h512"], is_race: true },
    Ratio { title: "f16/best", own: "f16", others: &["h512", "h512t"], is_race: true },
    Ratio { title: "w1/w8", own: "w1", others: &["w8"], is_race: false },
    Ratio { title: "w1/w16", own: "w1", others: &["w16"], is_race: false },
];

/// A comparison with a library of vector functions.
const LIBRARY_RATIOS: &[Ratio] = &[
    Ratio { title: "w8/mvec", own: "w8", others: &["mvec"], is_race: false },
    Ratio { title: "w8/sleef", own: "w8", others: &["sleef10", "sleef35"], is_race: false },
];

/// The contenders in the order of the table's columns.
const CONTENDERS: &[&str] =
    &["scalar", "w1", "w4", "w8", "f8", "h256", "h256t", "w16", "f16", "h512", "h512t"];

/// The contenders in the table of vector libraries.
const LIBRARY_CONTENDERS: &[&str] = &["w8", "f8", "h256", "mvec", "sleef10", "sleef35"];

/// Returns tables of all races with the same number of packets: the races, then those with contenders from vector
/// libraries.
pub fn tables(entries: &[Entry]) -> String {
    let is_library =
        |entry: &Entry| LIBRARY_RATIOS.iter().any(|it| it.others.contains(&&*entry.contender));
    let with_library: Vec<&str> =
        entries.iter().filter(|it| is_library(it)).map(|it| it.race).collect();
    let raced: Vec<Entry> =
        entries.iter().filter(|it| with_library.contains(&it.race)).cloned().collect();
    let mut text = table(entries, CONTENDERS, RATIOS);
    if !raced.is_empty() {
        let libraries = table(&raced, LIBRARY_CONTENDERS, LIBRARY_RATIOS);
        let _ = write!(text, "\nWith libraries of vector functions. {libraries}");
    }
    text
}

fn table(entries: &[Entry], contenders: &[&'static str], ratios: &'static [Ratio]) -> String {
    let Some(first) = entries.first() else { return String::new() };
    let present = |name: &str| entries.iter().any(|entry| entry.contender == name);
    let columns: Vec<&str> = contenders.iter().copied().filter(|name| present(name)).collect();
    let comparable = |it: &&Ratio| present(it.own) && it.others.iter().any(|it| present(it));
    let ratios: Vec<&Ratio> = ratios.iter().filter(comparable).collect();

    let mut text = heading(first.packets, &columns, &ratios);
    races_of(entries).for_each(|race| text += &row(entries, race, &columns, &ratios));
    text += &mean_row(entries, &columns, &ratios);
    ratios.iter().filter_map(|ratio| ratio.verdict(entries)).for_each(|it| text += &it);
    text
}

fn heading(packets: usize, columns: &[&str], ratios: &[&Ratio]) -> String {
    let plural = if packets == 1 { "" } else { "s" };
    let names: String = columns.iter().map(|name| format!("{name:>8}")).collect();
    let titles: String = ratios.iter().map(|ratio| format!("{:>10}", ratio.title)).collect();
    format!("Nanoseconds a ray, {packets} packet{plural} of 64 rays\n{:<21}{names}{titles}\n", "")
}

fn row(entries: &[Entry], race: &str, columns: &[&str], ratios: &[&Ratio]) -> String {
    let cell = |number: Option<f64>, width: usize, digits: usize| match number {
        Some(number) => format!("{number:>width$.digits$}"),
        None => format!("{:>width$}", "-"),
    };
    let times: String =
        columns.iter().map(|name| cell(median(entries, race, name), 8, 3)).collect();
    let ratios: String = ratios.iter().map(|it| cell(it.of(entries, race), 10, 2)).collect();
    format!("{race:<21}{times}{ratios}\n")
}

fn mean_row(entries: &[Entry], columns: &[&str], ratios: &[&Ratio]) -> String {
    let means: String =
        ratios.iter().map(|ratio| format!("{:>10.2}", ratio.mean(entries))).collect();
    format!("{:<width$}{means}\n", "geometric mean", width = 21 + 8 * columns.len())
}

/// Returns a table of the greatest errors, and of rays for which only one has a hit.
pub fn differences(entries: &[Entry]) -> String {
    let mut text = String::from("Greatest relative error against double precision");
    let _ = writeln!(text, " (+ rays with a result in one of both only)");
    for race in races_of(entries) {
        let _ = write!(text, "{race:<21}");
        for entry in entries.iter().filter(|entry| entry.race == race) {
            let _ = write!(text, " {} {:.0e}", entry.contender, entry.error);
            if entry.unmatched > 0 {
                let _ = write!(text, "+{}", entry.unmatched);
            }
        }
        text.push('\n');
    }
    text
}

impl Ratio {
    fn of(&self, entries: &[Entry], race: &str) -> Option<f64> {
        let own = find(entries, race, self.own)?;
        let others = self.others.iter().filter_map(|name| find(entries, race, name));
        others.map(|other| own.timing.ratio(&other.timing)).reduce(f64::max)
    }

    fn mean(&self, entries: &[Entry]) -> f64 {
        let ratios: Vec<f64> =
            races_of(entries).filter_map(|race| self.of(entries, race)).collect();
        #[allow(clippy::disallowed_methods, reason = "printed with two digits")]
        let mean = (ratios.iter().map(|it| it.ln()).sum::<f64>() / ratios.len() as f64).exp();
        mean
    }

    /// Returns the races that were won and those that were lost.
    fn verdict(&self, entries: &[Entry]) -> Option<String> {
        let races = races_of(entries).filter_map(|race| Some((race, self.of(entries, race)?)));
        let (won, lost): (Vec<_>, Vec<_>) = races.partition(|(_, ratio)| *ratio <= 1.0);
        let names = |races: Vec<(&'static str, f64)>| {
            races.into_iter().map(|(race, _)| format!(" {race}")).collect::<String>()
        };
        let (won, lost, title) = (names(won), names(lost), self.title);
        self.is_race.then(|| format!("{title:<10}won {won}\n{:<10}lost{lost}\n", ""))
    }
}

fn median(entries: &[Entry], race: &str, contender: &str) -> Option<f64> {
    find(entries, race, contender).map(|it| it.median)
}

fn find<'a>(entries: &'a [Entry], race: &str, contender: &str) -> Option<&'a Entry> {
    entries.iter().find(|it| it.race == race && it.contender == contender)
}

/// Returns the races, in order, each once.
fn races_of(entries: &[Entry]) -> impl Iterator<Item = &'static str> {
    let first = |(index, entry): &(usize, &Entry)| {
        entries[..*index].iter().all(|other| other.race != entry.race)
    };
    entries
        .iter()
        .enumerate()
        .filter(first)
        .map(|(_, entry)| entry.race)
        .collect::<Vec<_>>()
        .into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn races_are_won_by_the_faster() {
        let entry = |race, contender: &str, samples: [f64; 3]| {
            let timing = Timing::new(samples.to_vec());
            Entry::new(race, contender, 1, timing, Difference::default())
        };
        // In two of three repetitions of the cone the machine was slow for both contenders.
        let entries = [
            entry("cube", "w8", [1.0; 3]),
            entry("cube", "h256", [2.0; 3]),
            entry("cone", "w8", [6.0, 9.0, 3.0]),
            entry("cone", "h256", [3.0, 4.5, 1.5]),
        ];
        let expected = "\
Nanoseconds a ray, 1 packet of 64 rays
                           w8    h256   w8/h256
cube                    1.000   2.000      0.50
cone                    6.000   3.000      2.00
geometric mean                             1.00
w8/h256   won  cube
          lost cone
";
        assert_eq!(tables(&entries), expected);
    }
}
