//! The bytes of a checkpoint. All numbers are little-endian.
//!
//! | | |
//! |---|---|
//! | 8 bytes | `RTSLckp` and a line feed |
//! | u32 | the version of the format |
//! | u64 | the length of the file in bytes |
//! | u32 | the number of fingerprint entries; then for each its name, a byte for its kind, and its value as text, or 32 bytes of digest |
//! | u32 | the number of sections; then for each its name, a byte for its kind, a u64 for the count of its numbers, and the numbers |
//! | 32 bytes | the BLAKE3 digest of all preceding bytes |
//!
//! A text is a u32 for its length, followed by as many bytes of UTF-8. BLAKE3 is also the hash of the files' digests;
//! as a checksum it detects any change and takes a millisecond for a few megabytes.

use std::borrow::Cow;
use std::io::{self, Read, Write};

use rtsl_memory::{filled, reserved};
use rtsl_scene::reader::Digest;

use super::fingerprint::{Fingerprint, FingerprintValue};
use super::{Checkpoint, Damage, Numbers, Section};

const MAGIC: [u8; 8] = *b"RTSLckp\n";
const VERSION: u32 = 1;
/// Magic, version and length.
const HEADER: u64 = 8 + 4 + 8;
/// The digest at the end.
const CHECKSUM: u64 = 32;
/// The count of numbers that are converted to bytes and back at a time.
const CHUNK: usize = 4096;

const TEXT: u8 = 0;
const DIGEST: u8 = 1;

const F64: u8 = 0;
const F32: u8 = 1;
const U32: u8 = 2;

/// Writes a checkpoint.
pub fn write(checkpoint: &Checkpoint<'_>, writer: &mut dyn Write) -> io::Result<()> {
    let mut output = Output { writer, hasher: blake3::Hasher::new() };
    output.put(&MAGIC)?;
    output.put(&VERSION.to_le_bytes())?;
    output.put(&length(checkpoint).to_le_bytes())?;
    let entries = checkpoint.fingerprint.entries();
    output.put(&(entries.len() as u32).to_le_bytes())?;
    for (name, value) in entries {
        output.put_text(name)?;
        match value {
            FingerprintValue::Text(text) => {
                output.put(&[TEXT])?;
                output.put_text(text)?;
            }
            FingerprintValue::Digest(Digest(bytes)) => {
                output.put(&[DIGEST])?;
                output.put(bytes)?;
            }
        }
    }
    output.put(&(checkpoint.sections.len() as u32).to_le_bytes())?;
    for section in &checkpoint.sections {
        output.put_text(&section.name)?;
        match &section.numbers {
            Numbers::F64(numbers) => output.put_numbers(F64, numbers, f64::to_le_bytes)?,
            Numbers::F32(numbers) => output.put_numbers(F32, numbers, f32::to_le_bytes)?,
            Numbers::U32(numbers) => output.put_numbers(U32, numbers, u32::to_le_bytes)?,
        }
    }
    let checksum = output.hasher.finalize();
    writer.write_all(checksum.as_bytes())
}

/// The length of a checkpoint in bytes.
fn length(checkpoint: &Checkpoint<'_>) -> u64 {
    let text = |text: &str| 4 + text.len() as u64;
    let entries = checkpoint.fingerprint.entries().map(|(name, value)| {
        let value = match value {
            FingerprintValue::Text(value) => text(value),
            FingerprintValue::Digest(Digest(bytes)) => bytes.len() as u64,
        };
        text(name) + 1 + value
    });
    let sections = checkpoint.sections.iter().map(|section| {
        let numbers = match &section.numbers {
            Numbers::F64(numbers) => size_of_val::<[f64]>(numbers),
            Numbers::F32(numbers) => size_of_val::<[f32]>(numbers),
            Numbers::U32(numbers) => size_of_val::<[u32]>(numbers),
        };
        text(&section.name) + 1 + 8 + numbers as u64
    });
    HEADER + 4 + entries.sum::<u64>() + 4 + sections.sum::<u64>() + CHECKSUM
}

struct Output<'a> {
    writer: &'a mut dyn Write,
    hasher: blake3::Hasher,
}

impl Output<'_> {
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.writer.write_all(bytes)
    }

    fn put_text(&mut self, text: &str) -> io::Result<()> {
        let length = u32::try_from(text.len()).map_err(io::Error::other)?;
        self.put(&length.to_le_bytes())?;
        self.put(text.as_bytes())
    }

    fn put_numbers<T: Copy, const SIZE: usize>(
        &mut self,
        kind: u8,
        numbers: &[T],
        to_bytes: impl Fn(T) -> [u8; SIZE],
    ) -> io::Result<()> {
        self.put(&[kind])?;
        self.put(&(numbers.len() as u64).to_le_bytes())?;
        for chunk in numbers.chunks(CHUNK) {
            let bytes: Vec<u8> = chunk.iter().flat_map(|number| to_bytes(*number)).collect();
            self.put(&bytes)?;
        }
        Ok(())
    }
}

/// Reads a checkpoint from a source of `length` bytes.
pub fn read(source: &mut dyn Read, length: u64) -> Result<Checkpoint<'static>, Damage> {
    let mut input = Input { source, hasher: blake3::Hasher::new(), left: length };
    input.header(length)?;
    let fingerprint = input.fingerprint()?;
    let sections = input.sections()?;
    if input.left > CHECKSUM {
        return Err(Damage::Malformed("bytes follow its last section".to_owned()));
    }
    let checksum = input.hasher.finalize();
    // The library compares in constant time, which is not needed here.
    if checksum != input.array::<32>()? {
        return Err(Damage::Checksum);
    }
    Ok(Checkpoint { fingerprint, sections })
}

/// Reads only the fingerprint from a source of `length` bytes. The checksum comes after all numbers and is not
/// verified, so the fingerprint of a damaged checkpoint may be wrong.
pub fn read_fingerprint(source: &mut dyn Read, length: u64) -> Result<Fingerprint, Damage> {
    let mut input = Input { source, hasher: blake3::Hasher::new(), left: length };
    input.header(length)?;
    input.fingerprint()
}

struct Input<'a> {
    source: &'a mut dyn Read,
    hasher: blake3::Hasher,
    /// The number of bytes left in the source: a limit for reads and for allocations.
    left: u64,
}

impl Input<'_> {
    fn header(&mut self, length: u64) -> Result<(), Damage> {
        if length < HEADER || self.array::<8>()? != MAGIC {
            return Err(Damage::NotACheckpoint);
        }
        let version = self.u32()?;
        if version != VERSION {
            return Err(Damage::UnknownVersion(version, VERSION));
        }
        let expected = u64::from_le_bytes(self.array()?);
        match length.cmp(&expected) {
            std::cmp::Ordering::Less => Err(Damage::Truncated { expected, found: length }),
            std::cmp::Ordering::Equal => Ok(()),
            std::cmp::Ordering::Greater => {
                let message = format!("it has {length} bytes, expected {expected}");
                Err(Damage::Malformed(message))
            }
        }
    }

    fn fingerprint(&mut self) -> Result<Fingerprint, Damage> {
        let mut fingerprint = Fingerprint::default();
        for _ in 0..self.u32()? {
            let name = self.text()?;
            let value = match self.array()? {
                [TEXT] => FingerprintValue::Text(self.text()?),
                [DIGEST] => FingerprintValue::Digest(Digest(self.array()?)),
                [kind] => return Err(Damage::Malformed(format!("`{name}` is of kind {kind}"))),
            };
            fingerprint.set_value(name, value);
        }
        Ok(fingerprint)
    }

    fn sections(&mut self) -> Result<Vec<Section<'static>>, Damage> {
        let mut sections = Vec::new();
        for _ in 0..self.u32()? {
            let name = self.text()?;
            let numbers = match self.array()? {
                [F64] => Numbers::F64(self.numbers(&name, f64::from_le_bytes)?),
                [F32] => Numbers::F32(self.numbers(&name, f32::from_le_bytes)?),
                [U32] => Numbers::U32(self.numbers(&name, u32::from_le_bytes)?),
                [kind] => return Err(Damage::Malformed(format!("`{name}` is of kind {kind}"))),
            };
            sections.push(Section { name: name.into(), numbers });
        }
        Ok(sections)
    }

    fn numbers<T: Clone, const SIZE: usize>(
        &mut self,
        name: &str,
        from_bytes: impl Fn([u8; SIZE]) -> T,
    ) -> Result<Cow<'static, [T]>, Damage> {
        let count = u64::from_le_bytes(self.array()?);
        let bytes = count.checked_mul(SIZE as u64).filter(|bytes| *bytes <= self.left);
        let Some(bytes) = bytes else {
            let message = format!("`{name}` has {count} numbers, more than the file holds");
            return Err(Damage::Malformed(message));
        };
        let mut numbers = reserved((bytes / SIZE as u64) as usize)
            .map_err(|error| Damage::Unreadable(error.to_string()))?;
        let mut chunk = vec![0; SIZE * CHUNK];
        let mut left = bytes as usize;
        while left > 0 {
            let part = &mut chunk[..left.min(SIZE * CHUNK)];
            self.take(part)?;
            numbers.extend(part.as_chunks::<SIZE>().0.iter().map(|bytes| from_bytes(*bytes)));
            left -= part.len();
        }
        Ok(numbers.into())
    }

    fn text(&mut self) -> Result<String, Damage> {
        let length = self.u32()?;
        if u64::from(length) > self.left {
            return Err(Damage::Malformed(format!(
                "a text has {length} bytes, more than the file"
            )));
        }
        let mut bytes =
            filled(length as usize, 0).map_err(|error| Damage::Unreadable(error.to_string()))?;
        self.take(&mut bytes)?;
        String::from_utf8(bytes).map_err(|_| Damage::Malformed("a text is not UTF-8".to_owned()))
    }

    fn u32(&mut self) -> Result<u32, Damage> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn array<const SIZE: usize>(&mut self) -> Result<[u8; SIZE], Damage> {
        let mut bytes = [0; SIZE];
        self.take(&mut bytes)?;
        Ok(bytes)
    }

    fn take(&mut self, bytes: &mut [u8]) -> Result<(), Damage> {
        self.left = self.left.checked_sub(bytes.len() as u64).ok_or_else(|| {
            Damage::Malformed("its contents need more bytes than it has".to_owned())
        })?;
        self.source.read_exact(bytes).map_err(|error| Damage::Unreadable(error.to_string()))?;
        self.hasher.update(bytes);
        Ok(())
    }
}
