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
    /// Packets that are worked on in turn.
    pub packets: usize,
    /// Median, nanoseconds a ray.
    pub median: f64,
    /// Least time.
    pub least: f64,
    /// Ninth decile.
    pub slow: f64,
    /// Greatest relative error against the reference in double precision.
    pub error: f64,
    /// Rays for which only the contender or only the reference has a result.
    pub unmatched: usize,
}

impl Entry {
    /// A result.
    pub fn new(
        race: &'static str,
        contender: &str,
        packets: usize,
        timing: Timing,
        difference: Difference,
    ) -> Entry {
        let Timing { median, least, slow } = timing;
        let Difference { error, unmatched } = difference;
        let contender = contender.to_owned();
        Entry { race, contender, packets, median, least, slow, error, unmatched }
    }
}

/// A comparison: one contender's time over the best of others.
struct Ratio {
    title: &'static str,
    own: &'static str,
    others: &'static [&'static str],
    /// What the issue asks of every race and of the mean.
    goal: Option<f64>,
}

const RATIOS: &[Ratio] = &[
    Ratio { title: "w8/h256", own: "w8", others: &["h256"], goal: Some(1.0) },
    Ratio { title: "f8/best", own: "f8", others: &["h256", "h256t"], goal: Some(1.0) },
    Ratio { title: "w16/h512", own: "w16", others: &["h512"], goal: Some(1.0) },
    Ratio { title: "f16/best", own: "f16", others: &["h512", "h512t"], goal: Some(1.0) },
    Ratio { title: "w1/w8", own: "w1", others: &["w8"], goal: None },
    Ratio { title: "w1/w16", own: "w1", others: &["w16"], goal: None },
];

/// The contenders in the order of the table's columns.
const CONTENDERS: &[&str] =
    &["scalar", "w1", "w4", "w8", "f8", "h256", "h256t", "w16", "f16", "h512", "h512t"];

/// The results of all races with one number of packets, for people.
pub fn table(entries: &[Entry]) -> String {
    let mut text = String::new();
    let Some(first) = entries.first() else { return text };
    let present = |name: &str| entries.iter().any(|entry| entry.contender == name);
    let columns: Vec<_> = CONTENDERS.iter().filter(|name| present(name)).collect();
    let ratios: Vec<_> = RATIOS
        .iter()
        .filter(|it| present(it.own) && it.others.iter().all(|it| present(it)))
        .collect();
    let _ = writeln!(text, "Nanoseconds a ray, {} packets of 64 rays", first.packets);
    let names: String = columns.iter().map(|name| format!("{name:>8}")).collect();
    let titles: String = ratios.iter().map(|ratio| format!("{:>10}", ratio.title)).collect();
    let _ = writeln!(text, "{:<21}{names}{titles}", "");
    for race in races_of(entries) {
        let _ = write!(text, "{race:<21}");
        for name in &columns {
            let cell = median(entries, race, name).map_or("-".to_owned(), |it| format!("{it:.3}"));
            let _ = write!(text, "{cell:>8}");
        }
        for ratio in &ratios {
            let cell = ratio.of(entries, race).map_or("-".to_owned(), |it| format!("{it:.2}"));
            let _ = write!(text, "{cell:>10}");
        }
        text.push('\n');
    }
    let _ = write!(text, "{:<21}{:width$}", "geometric mean", "", width = 8 * columns.len());
    for ratio in &ratios {
        let _ = write!(text, "{:>10.2}", ratio.mean(entries));
    }
    text.push('\n');
    ratios.iter().filter_map(|ratio| ratio.verdict(entries)).for_each(|it| text.push_str(&it));
    text
}

/// What the contenders computed, for people: the greatest errors, and rays hit by one only.
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
        let others = self.others.iter().filter_map(|name| median(entries, race, name));
        Some(median(entries, race, self.own)? / others.reduce(f64::min)?)
    }

    fn mean(&self, entries: &[Entry]) -> f64 {
        let ratios: Vec<f64> =
            races_of(entries).filter_map(|race| self.of(entries, race)).collect();
        #[allow(clippy::disallowed_methods, reason = "printed with two digits")]
        let mean = (ratios.iter().map(|it| it.ln()).sum::<f64>() / ratios.len() as f64).exp();
        mean
    }

    fn verdict(&self, entries: &[Entry]) -> Option<String> {
        let goal = self.goal?;
        let races = races_of(entries).filter_map(|race| Some((race, self.of(entries, race)?)));
        let (won, lost): (Vec<_>, Vec<_>) = races.partition(|(_, ratio)| *ratio <= goal);
        let names = |races: Vec<(&str, f64)>| {
            races.iter().map(|(race, _)| *race).collect::<Vec<_>>().join(" ")
        };
        let (won, lost) = (names(won), names(lost));
        Some(format!(
            "{}: won {won}\n{:indent$}lost {lost}\n",
            self.title,
            "",
            indent = self.title.len() + 2
        ))
    }
}

fn median(entries: &[Entry], race: &str, contender: &str) -> Option<f64> {
    let mut entries = entries.iter();
    entries.find(|it| it.race == race && it.contender == contender).map(|it| it.median)
}

/// The races, in order, each once.
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
