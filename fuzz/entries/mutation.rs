//! Random changes to texts, the same on every machine: a fuzzer for ordinary tests.

use std::path::{Path, PathBuf};

/// A small generator of random numbers (xorshift); quality matters little here.
pub struct Random(pub u64);

impl Random {
    /// A number below `bound`, which is not 0.
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % bound
    }
}

/// The texts of all files below `folder` that end in `extension`, sorted by name.
pub fn seeds(folder: &Path, extension: &str) -> Vec<Vec<u8>> {
    let mut paths = Vec::new();
    find(folder, extension, &mut paths);
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("the file can be read")).collect()
}

fn find(folder: &Path, extension: &str, paths: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    for path in entries.map(|entry| entry.expect("the folder can be read").path()) {
        if path.is_dir() {
            find(&path, extension, paths);
        } else if path.extension().is_some_and(|it| it == extension) {
            paths.push(path);
        }
    }
}

/// `seed` with a few words deleted, doubled, swapped, replaced by those of `other`, or damaged.
pub fn mutate(random: &mut Random, seed: &[u8], other: &[u8]) -> Vec<u8> {
    let mut words: Vec<&[u8]> = split(seed);
    let others = split(other);
    for _ in 0..1 + random.below(6) {
        if words.is_empty() {
            break;
        }
        let at = random.below(words.len());
        match random.below(7) {
            0 => {
                words.remove(at);
            }
            1 => words.insert(at, words[at]),
            2 => {
                let with = random.below(words.len());
                words.swap(at, with);
            }
            3 if !others.is_empty() => words[at] = others[random.below(others.len())],
            4 if !others.is_empty() => {
                let from = random.below(others.len());
                let until = (from + 1 + random.below(20)).min(others.len());
                words.splice(at..at, others[from..until].iter().copied());
            }
            5 => words.truncate(at),
            _ => {
                const ODD: [&[u8]; 12] = [
                    b"(",
                    b")",
                    b"{",
                    b"}",
                    b"[",
                    b"]",
                    b"\n#",
                    b"1e39",
                    b"-2147483648",
                    b"\xff",
                    b"/*",
                    b"0.0/0.0",
                ];
                words[at] = ODD[random.below(ODD.len())];
            }
        }
    }
    words.concat()
}

/// Overwrites bytes among the first `within` by a whole number that a size or a place in a file may not be.
#[allow(dead_code, reason = "targets for texts have none")]
pub fn overwrite(random: &mut Random, data: &mut [u8], within: usize) {
    const ODD: [u64; 8] = [0, 1, 4097, 1 << 16, 1 << 32, 1 << 61, u64::MAX - 8, u64::MAX];
    let width = [1, 2, 4, 8][random.below(4)];
    let number = ODD[random.below(ODD.len())].to_le_bytes();
    let at = random.below(within.min(data.len()).saturating_sub(width).max(1));
    if let Some(place) = data.get_mut(at..at + width) {
        place.copy_from_slice(&number[..width]);
    }
}

/// Words, and the single bytes between them.
fn split(text: &[u8]) -> Vec<&[u8]> {
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_' || *byte == b'.';
    text.chunk_by(|a, b| is_word(a) && is_word(b)).collect()
}
