//! Every page is in the table of contents, and every link within the repository leads to a file and a heading.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::markdown::{anchors, link_targets};
use super::{book_pages, markdown_files, read, root};

/// Pages of the book name other files of the repository by these addresses.
const REPOSITORY: [&str; 2] = [
    "https://github.com/rtsl-lang/rtsl/blob/main/",
    "https://github.com/rtsl-lang/rtsl/tree/main/",
];

#[test]
fn contents_list_every_page_once() {
    let book = root().join("docs/src");
    let listed = link_targets(&read(&book.join("SUMMARY.md")));
    let unique: BTreeSet<PathBuf> = listed.iter().map(|page| book.join(page)).collect();
    assert_eq!(unique.len(), listed.len(), "a page is listed twice");
    let pages: BTreeSet<PathBuf> = book_pages().into_iter().collect();
    let missing: Vec<_> = pages.difference(&unique).collect();
    assert!(missing.is_empty(), "not in SUMMARY.md: {missing:?}");
    let gone: Vec<_> = unique.difference(&pages).collect();
    assert!(gone.is_empty(), "in SUMMARY.md, but there is no such page: {gone:?}");
}

#[test]
fn links_lead_somewhere() {
    let root = root();
    let mut problems = Vec::new();
    let mut checked = 0;
    for page in markdown_files(&root) {
        for target in link_targets(&read(&page)) {
            checked += 1;
            if let Err(problem) = check_link(&root, &page, &target) {
                let page = page.strip_prefix(&root).unwrap_or(&page);
                problems.push(format!("{}: `{target}` {problem}", page.display()));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
    assert!(checked > 100, "only {checked} links were found");
}

fn check_link(root: &Path, page: &Path, target: &str) -> Result<(), &'static str> {
    let in_repository = REPOSITORY.iter().find_map(|address| target.strip_prefix(address));
    if in_repository.is_none() && target.contains("://") {
        return Ok(());
    }
    let (path, anchor) = match in_repository.unwrap_or(target).split_once('#') {
        Some((path, anchor)) => (path, Some(anchor)),
        None => (in_repository.unwrap_or(target), None),
    };
    let file = match (in_repository, path) {
        (Some(path), _) => root.join(path.split('#').next().unwrap_or(path)),
        (None, "") => page.to_path_buf(),
        (None, path) => page.parent().unwrap_or(root).join(path),
    };
    let Ok(file) = file.canonicalize() else { return Err("does not exist") };
    let book = root.join("docs/src");
    if in_repository.is_none() && page.starts_with(&book) && !file.starts_with(&book) {
        return Err("leaves the book: name the file by its address on GitHub");
    }
    match anchor {
        Some(anchor) if !anchors(&read(&file)).iter().any(|known| known == anchor) => {
            Err("names a heading that does not exist")
        }
        _ => Ok(()),
    }
}
