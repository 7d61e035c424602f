//! Files compressed by gzip, recognised by their first bytes whatever their names are.

use std::io::{self, Cursor, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use rtsl_memory::{Amount, InputBudget, reserved};

use super::files::{FileSource, Input};

/// The bytes with which every such file begins.
const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The number of bytes that the first allocation for a decompressed file takes.
const FIRST_CAPACITY: usize = 64 * 1024;

/// True if a file exists and is compressed.
pub fn is_compressed(files: &dyn FileSource, path: &Path) -> bool {
    let start = files.open(path).and_then(|mut source| start_of(&mut *source));
    start.is_ok_and(|start| start == MAGIC)
}

/// The first bytes of a file, fewer if it is shorter.
fn start_of(source: &mut dyn Read) -> io::Result<Vec<u8>> {
    let mut start = Vec::with_capacity(MAGIC.len());
    source.take(MAGIC.len() as u64).read_to_end(&mut start)?;
    Ok(start)
}

/// Decompresses a file if it is compressed. Memory is held before it is allocated, so that a small file that expands to
/// a large one is an error.
///
/// # Errors
/// If the file is damaged or would take too much memory.
pub fn decompressed(input: Input, budget: &InputBudget) -> io::Result<Input> {
    if !input.bytes.starts_with(&MAGIC) {
        return Ok(input);
    }
    let mut source = MultiGzDecoder::new(Cursor::new(&input.bytes));
    let mut capacity = FIRST_CAPACITY;
    let mut held = budget.hold(Amount(capacity as u64))?;
    let mut bytes: Vec<u8> = reserved(capacity)?;
    loop {
        let room = (capacity - bytes.len()) as u64;
        if source.by_ref().take(room).read_to_end(&mut bytes)? < room as usize {
            break;
        }
        // The old and the new allocation exist together while the bytes are copied.
        held.grow_to(Amount(capacity as u64).times(3))?;
        capacity *= 2;
        let mut larger = reserved(capacity)?;
        larger.extend_from_slice(&bytes);
        bytes = larger;
    }
    Ok(Input { bytes, held })
}

/// Returns a stream of a file's decompressed bytes.
///
/// # Errors
/// If its first bytes cannot be read.
pub fn opened(mut source: Box<dyn Read>) -> io::Result<Box<dyn Read>> {
    let start = start_of(&mut *source)?;
    let compressed = start == MAGIC;
    let whole = Cursor::new(start).chain(source);
    Ok(if compressed { Box::new(MultiGzDecoder::new(whole)) } else { Box::new(whole) })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;
    use rtsl_memory::OverBudget;

    use super::*;

    fn compressed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn read(bytes: Vec<u8>, budget: &InputBudget) -> io::Result<Input> {
        let held = budget.hold(Amount(bytes.len() as u64))?;
        decompressed(Input { bytes, held }, budget)
    }

    #[test]
    fn files_are_decompressed_by_their_first_bytes() {
        let text: Vec<u8> = (0..300_000_u32).flat_map(u32::to_le_bytes).collect();
        let budget = InputBudget::new(Some(Amount(64 << 20)));
        assert_eq!(read(compressed(&text), &budget).unwrap().bytes, text);
        let parts = [compressed(b"one "), compressed(b"other")].concat();
        assert_eq!(read(parts.clone(), &budget).unwrap().bytes, b"one other");
        assert_eq!(read(b"plain".to_vec(), &budget).unwrap().bytes, b"plain");
        assert_eq!(budget.taken(), Amount(0));
        for (file, expected) in [(parts, "one other"), (b"p".to_vec(), "p"), (Vec::new(), "")] {
            let mut streamed = String::new();
            opened(Box::new(Cursor::new(file))).unwrap().read_to_string(&mut streamed).unwrap();
            assert_eq!(streamed, expected);
        }
    }

    #[test]
    fn a_bomb_ends_with_the_budget() {
        let bomb = compressed(&vec![0; 32 << 20]);
        assert!(bomb.len() < 1 << 20);
        let error = read(bomb, &InputBudget::new(Some(Amount(8 << 20)))).err().unwrap();
        assert!(OverBudget::of(&error).is_some(), "{error}");
    }

    #[test]
    fn a_damaged_file_is_an_error() {
        let budget = InputBudget::new(Some(Amount(8 << 20)));
        let mut file = compressed(&[7; 1000]);
        file.truncate(file.len() - 9);
        assert!(read(file, &budget).is_err());
        assert!(read(vec![0x1f, 0x8b, 1, 2, 3], &budget).is_err());
    }
}
