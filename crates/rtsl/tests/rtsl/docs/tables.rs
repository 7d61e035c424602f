//! Tables of measurements are generated from the files in `docs/data`.
//!
//! A page contains `<!-- table: FILE -->`, the table, and `<!-- end table -->`. `COLUMN=VALUE` after the name of the
//! file selects rows, and leaves out the column. A data file is CSV with a header of lines `# key: value`.
//!
//! `UPDATE_EXPECT=1 cargo test -p rtsl --test rtsl docs::tables` writes the tables; without it the test fails where a
//! table is stale.

use std::fmt::Write as _;
use std::path::Path;

use super::{book_pages, read, root};

const END: &str = "<!-- end table -->";
const ADDRESS: &str = "https://github.com/rtsl-lang/rtsl/blob/main/docs/data";
/// The length of the lines of the source of a table.
const LINE: usize = 120;

#[test]
fn tables_are_current() {
    let mut stale = Vec::new();
    let mut tables = 0;
    for page in book_pages() {
        let text = read(&page);
        let expected = with_tables(&text, &mut tables);
        if text != expected {
            if std::env::var_os("UPDATE_EXPECT").is_some() {
                std::fs::write(&page, &expected).expect("the page can be written");
            } else {
                stale.push(page);
            }
        }
    }
    assert!(stale.is_empty(), "run this test with UPDATE_EXPECT=1: {stale:?}");
    assert!(tables > 10, "only {tables} tables were found");
}

#[test]
fn data_has_a_date_and_a_machine_and_is_shown() {
    let pages: String = book_pages().iter().map(|page| read(page)).collect();
    for entry in std::fs::read_dir(root().join("docs/data")).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        let data = Data::read(&path);
        for key in ["date", "machine", "software"] {
            assert!(data.header.iter().any(|each| each.0 == key), "{path:?} has no {key}");
        }
        let columns = data.rows[0].len();
        assert!(
            data.rows.iter().all(|row| row.len() == columns),
            "{path:?}: rows differ in length"
        );
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(pages.contains(&name), "no page shows {name}");
    }
}

/// The text of a page with its tables as the data have them.
fn with_tables(page: &str, count: &mut usize) -> String {
    let mut text = String::new();
    let mut inside = false;
    for line in page.lines() {
        if line == END {
            assert!(inside, "a table ends that has not begun");
            inside = false;
        }
        if !inside {
            text.push_str(line);
            text.push('\n');
        }
        let directive =
            line.strip_prefix("<!-- table: ").and_then(|rest| rest.strip_suffix(" -->"));
        if let Some(directive) = directive {
            inside = true;
            *count += 1;
            text.push_str(&table(directive));
        }
    }
    assert!(!inside, "a table does not end");
    text
}

/// The table that a directive asks for, with a line about its source.
fn table(directive: &str) -> String {
    let mut words = directive.split(' ');
    let name = words.next().unwrap_or_default();
    let mut data = Data::read(&root().join("docs/data").join(name));
    for condition in words {
        let (column, value) = condition.split_once('=').expect("a condition is COLUMN=VALUE");
        data.select(column, value);
    }
    format!("\n{}\n{}\n", data.table(), data.source(name))
}

/// A data file: the first row has the names of the columns.
struct Data {
    header: Vec<(String, String)>,
    rows: Vec<Vec<String>>,
}

impl Data {
    fn read(path: &Path) -> Data {
        let text = read(path);
        let header = text.lines().map_while(|line| line.strip_prefix("# "));
        let header = header.filter_map(|line| line.split_once(": "));
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        Data {
            header: header.map(|(key, value)| (key.to_owned(), value.to_owned())).collect(),
            rows: rows.map(cells).collect(),
        }
    }

    /// Keeps the rows with this value in a column, without the column.
    fn select(&mut self, column: &str, value: &str) {
        let index = self.rows[0].iter().position(|name| name == column);
        let index = index.unwrap_or_else(|| panic!("there is no column {column}"));
        let mut first = true;
        self.rows.retain(|row| std::mem::take(&mut first) || row[index] == value);
        for row in &mut self.rows {
            row.remove(index);
        }
    }

    fn table(&self) -> String {
        let mut table = String::new();
        let (names, rows) = self.rows.split_first().expect("there is a row of names");
        let _ = writeln!(table, "| {} |", names.join(" | "));
        for column in 0..names.len() {
            let numbers = rows.iter().all(|row| is_number(&row[column]));
            table.push_str(if numbers { "|---:" } else { "|---" });
        }
        table.push_str("|\n");
        for row in rows {
            let _ = writeln!(table, "| {} |", row.join(" | "));
        }
        table
    }

    /// The name of the file and its header, in lines of the usual length.
    fn source(&self, name: &str) -> String {
        let facts = self.header.iter().map(|(key, value)| format!("{key}: {value}"));
        let facts = facts.collect::<Vec<_>>().join("; ");
        let mut lines = vec![format!("*[{name}]({ADDRESS}/{name}):")];
        for word in format!("{facts}.*").split(' ') {
            let line = lines.last_mut().expect("there is a line");
            if line.len() + 1 + word.len() <= LINE {
                line.push(' ');
                line.push_str(word);
            } else {
                lines.push(word.to_owned());
            }
        }
        format!("{}\n", lines.join("\n"))
    }
}

fn is_number(cell: &str) -> bool {
    cell.is_empty() || cell.parse::<f64>().is_ok()
}

/// The cells of a line; those with commas are in double quotes.
fn cells(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            letter => cells.last_mut().expect("there is a cell").push(letter),
        }
    }
    cells
}
