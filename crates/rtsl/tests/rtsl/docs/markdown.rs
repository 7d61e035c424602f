//! The parts of Markdown that the checks need: fenced blocks, headings, links.

use std::collections::BTreeMap;

/// A fenced block.
pub struct Block {
    /// The text after the opening fence.
    pub info: String,
    pub text: String,
    /// The line of the opening fence, from 1.
    pub line: usize,
}

/// The fenced blocks of a page.
pub fn blocks(page: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut inside = false;
    for (index, line) in page.lines().enumerate() {
        if let Some(info) = line.strip_prefix("```") {
            inside = !inside;
            if inside {
                found.push(Block { info: info.to_string(), text: String::new(), line: index + 1 });
            }
        } else if inside && let Some(block) = found.last_mut() {
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    found
}

/// The lines of a page outside code blocks.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut inside = false;
    page.lines().filter(move |line| {
        let fence = line.starts_with("```");
        inside ^= fence;
        !inside && !fence && !line.starts_with("    ")
    })
}

/// The anchors of the headings of a page, as mdBook and GitHub make them.
pub fn anchors(page: &str) -> Vec<String> {
    let mut uses: BTreeMap<String, usize> = BTreeMap::new();
    let headings = prose(page).filter_map(|line| {
        let title = line.trim_start_matches('#');
        if title.len() < line.len() { title.strip_prefix(' ') } else { None }
    });
    let named = headings.map(|title| {
        let name = anchor(title.trim());
        let earlier = uses.entry(name.clone()).or_default();
        *earlier += 1;
        if *earlier == 1 { name } else { format!("{name}-{}", *earlier - 1) }
    });
    named.collect()
}

fn anchor(title: &str) -> String {
    title
        .chars()
        .filter_map(|letter| match letter {
            ' ' => Some('-'),
            '-' | '_' => Some(letter),
            letter if letter.is_alphanumeric() => Some(letter.to_ascii_lowercase()),
            _ => None,
        })
        .collect()
}

/// The targets of the links and images of a page.
pub fn link_targets(page: &str) -> Vec<String> {
    let text = prose(page).collect::<Vec<_>>().join("\n");
    // Code spans can contain what looks like a link.
    let mut outside = String::new();
    for (index, part) in text.split('`').enumerate() {
        outside.push_str(if index % 2 == 0 { part } else { "code" });
    }
    let targets = outside.split("](").skip(1);
    targets.filter_map(|rest| rest.split(')').next()).map(str::to_owned).collect()
}
