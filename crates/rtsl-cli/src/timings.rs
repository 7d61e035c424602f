//! The times of stages, as a table and as JSON.

use std::time::Duration;

use serde::Serialize;

/// Stages with the stages that they consist of. Spans of one name within one stage count as one stage.
#[derive(Debug, Default)]
pub struct StageTree {
    stages: Vec<Stage>,
}

#[derive(Debug)]
struct Stage {
    parent: Option<usize>,
    name: String,
    calls: u64,
    time: Duration,
}

impl StageTree {
    /// Returns the index of the stage of this name within `parent`.
    pub fn stage(&mut self, parent: Option<usize>, name: &str) -> usize {
        let known = self.stages.iter().position(|it| it.parent == parent && it.name == name);
        known.unwrap_or_else(|| {
            let stage = Stage { parent, name: name.to_owned(), calls: 0, time: Duration::ZERO };
            self.stages.push(stage);
            self.stages.len() - 1
        })
    }

    /// Adds a call of a stage.
    pub fn add(&mut self, stage: usize, time: Duration) {
        self.stages[stage].calls += 1;
        self.stages[stage].time += time;
    }
}

/// The times of a command's stages.
#[derive(Debug, Serialize)]
pub struct Timings {
    /// The time of the whole command.
    seconds: f64,
    stages: Vec<StageTimes>,
}

/// The times of a stage.
#[derive(Debug, Serialize)]
struct StageTimes {
    name: String,
    calls: u64,
    seconds: f64,
    /// The fraction of the whole command's time. Stages on several threads may add up to more than 1.
    share: f64,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    stages: Vec<StageTimes>,
}

impl Timings {
    /// Returns the times of all stages of a command that took `total`.
    pub fn new(tree: &StageTree, total: Duration) -> Timings {
        Timings { seconds: total.as_secs_f64(), stages: stages_within(tree, None, total) }
    }

    /// Returns a line of JSON with its end.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// Returns a table.
    pub fn to_text(&self) -> String {
        let mut text = format!("{:32} {:>7} {:>12} {:>8}\n", "stage", "calls", "ms", "share");
        self.stages.iter().for_each(|stage| stage.add_rows(0, &mut text));
        text + &row("total", 1, self.seconds, 1.0)
    }
}

/// Returns the stages within a stage, in the order in which they first began.
fn stages_within(tree: &StageTree, parent: Option<usize>, total: Duration) -> Vec<StageTimes> {
    let stages = tree.stages.iter().enumerate().filter(|(_, stage)| stage.parent == parent);
    let times = stages.map(|(index, stage)| StageTimes {
        name: stage.name.clone(),
        calls: stage.calls,
        seconds: stage.time.as_secs_f64(),
        share: stage.time.as_secs_f64() / total.as_secs_f64().max(f64::MIN_POSITIVE),
        stages: stages_within(tree, Some(index), total),
    });
    times.collect()
}

impl StageTimes {
    fn add_rows(&self, depth: usize, text: &mut String) {
        let name = format!("{:indent$}{}", "", self.name, indent = 2 * depth);
        text.push_str(&row(&name, self.calls, self.seconds, self.share));
        self.stages.iter().for_each(|stage| stage.add_rows(depth + 1, text));
    }
}

fn row(name: &str, calls: u64, seconds: f64, share: f64) -> String {
    format!("{name:32} {calls:7} {:12.3} {:6.1} %\n", seconds * 1e3, share * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_of_one_name_within_one_stage_are_one() {
        let mut tree = StageTree::default();
        let link = tree.stage(None, "link");
        for milliseconds in [1, 2] {
            let pass = tree.stage(Some(link), "dce");
            tree.add(pass, Duration::from_millis(milliseconds));
        }
        tree.add(link, Duration::from_millis(5));
        let timings = Timings::new(&tree, Duration::from_millis(10));
        assert_eq!(
            timings.to_text(),
            "stage                              calls           ms    share\n\
             link                                   1        5.000   50.0 %\n  \
             dce                                  2        3.000   30.0 %\n\
             total                                  1       10.000  100.0 %\n"
        );
        assert_eq!(
            timings.to_json(),
            "{\"seconds\":0.01,\"stages\":[{\"name\":\"link\",\"calls\":1,\"seconds\":0.005,\"share\":0.5,\
             \"stages\":[{\"name\":\"dce\",\"calls\":2,\"seconds\":0.003,\"share\":0.3}]}]}\n"
        );
    }
}
