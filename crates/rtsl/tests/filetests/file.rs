//! The form of a test file.

use libtest_mimic::Failed;

/// The prefix of the line that names the mode, after a comment mark of the input's language.
const MODE: &str = "mode:";
/// The prefix of a line of the expectation.
const EXPECTED: &str = "//=";
/// The prefix of the line before a further file of the input.
const FILE: &str = "//# file:";

/// A test file, taken apart.
pub struct TestFile<'a> {
    /// The name of the mode.
    pub mode: String,
    /// The words after it.
    pub arguments: Vec<&'a str>,
    /// Everything before the expectation.
    input: &'a str,
    /// The lines of the expectation, without their marks.
    expected: String,
}

impl<'a> TestFile<'a> {
    pub fn parse(text: &'a str) -> Result<Self, Failed> {
        let first = text.lines().next().unwrap_or_default();
        let (_, words) = first.split_once(MODE).ok_or("the first line names no `mode:`")?;
        let mut words = words.split_whitespace();
        let mode = words.next().ok_or("the first line names no mode")?;
        let is_expected = |line: &str| line.starts_with(EXPECTED);
        let input_length: usize =
            text.split_inclusive('\n').take_while(|line| !is_expected(line)).map(str::len).sum();
        let (input, expectation) = text.split_at(input_length);
        let mut expected = String::new();
        for line in expectation.lines() {
            let line = line.strip_prefix(EXPECTED).ok_or("input after the expectation")?;
            expected.push_str(line.strip_prefix(' ').unwrap_or(line));
            expected.push('\n');
        }
        Ok(TestFile { mode: mode.to_owned(), arguments: words.collect(), input, expected })
    }

    /// The value of the argument `name=value` of the mode's line.
    pub fn argument(&self, name: &str) -> Option<&str> {
        let mut pairs = self.arguments.iter().filter_map(|argument| argument.split_once('='));
        pairs.find(|(key, _)| *key == name).map(|(_, value)| value)
    }

    /// The files of the input with their names: the text itself, called `test.rtsl`, then those
    /// that `//# file: NAME` lines begin.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = vec![("test.rtsl".to_owned(), String::new())];
        for line in self.input.split_inclusive('\n') {
            match line.strip_prefix(FILE) {
                Some(name) => files.push((name.trim().to_owned(), String::new())),
                None => {
                    if let Some((_, text)) = files.last_mut() {
                        text.push_str(line);
                    }
                }
            }
        }
        files
    }

    /// The test file with `actual` as its expectation.
    pub fn with_expectation(&self, actual: &str) -> String {
        // The input stays as it is: what a stage says of its end must stay true.
        let mut text = self.input.to_owned();
        if !text.ends_with('\n') {
            text.push('\n');
        }
        for line in actual.lines() {
            text.push_str(format!("{EXPECTED} {line}").trim_end());
            text.push('\n');
        }
        text
    }

    pub fn compare(&self, actual: &str) -> Result<(), Failed> {
        let trim = |text: &str| {
            text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n").trim_end().to_owned()
        };
        let (expected, actual) = (trim(&self.expected), trim(actual));
        if expected == actual {
            return Ok(());
        }
        let differing = expected.lines().zip(actual.lines()).take_while(|(a, b)| a == b).count();
        Err(format!(
            "line {} of the expectation differs\n--- expected\n{expected}\n--- actual\n{actual}\n\
             UPDATE_EXPECT=1 accepts it",
            differing + 1
        )
        .into())
    }
}
