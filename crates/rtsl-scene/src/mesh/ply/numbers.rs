//! The numbers after the header of a PLY file.

use std::io::{BufRead, BufReader, Read};

use super::header::{Encoding, NumberType};
use crate::mesh::MeshError;

/// The greatest length of a number as text.
const MAX_NUMBER_BYTES: usize = 128;

/// Reads numbers as binary64, which represents each of the format's types exactly.
pub struct NumberReader<R> {
    reader: BufReader<R>,
    encoding: Encoding,
    /// The text of the current number in text files.
    text: Vec<u8>,
}

impl<R: Read> NumberReader<R> {
    /// Creates a reader of the numbers that follow.
    pub fn new(reader: BufReader<R>, encoding: Encoding) -> Self {
        NumberReader { reader, encoding, text: Vec::new() }
    }

    /// Reads the next number; `ty` is its type in binary files.
    pub fn next(&mut self, ty: NumberType) -> Result<f64, MeshError> {
        match self.encoding {
            Encoding::Text => self.next_text(),
            Encoding::LittleEndian => self.next_binary(ty, false),
            Encoding::BigEndian => self.next_binary(ty, true),
        }
    }

    fn next_binary(&mut self, ty: NumberType, big_endian: bool) -> Result<f64, MeshError> {
        Ok(match ty {
            NumberType::Int8 => i8::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Uint8 => u8::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Int16 => i16::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Uint16 => u16::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Int32 => i32::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Uint32 => u32::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Float32 => f32::from_le_bytes(self.bytes(big_endian)?).into(),
            NumberType::Float64 => f64::from_le_bytes(self.bytes(big_endian)?),
        })
    }

    /// Reads the next bytes in little-endian order.
    fn bytes<const COUNT: usize>(&mut self, reverse: bool) -> Result<[u8; COUNT], MeshError> {
        let mut bytes = [0; COUNT];
        self.reader.read_exact(&mut bytes)?;
        if reverse {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn next_text(&mut self) -> Result<f64, MeshError> {
        self.text.clear();
        loop {
            let buffer = self.reader.fill_buf()?;
            if buffer.is_empty() {
                break;
            }
            let blanks = if self.text.is_empty() { count_blanks(buffer) } else { 0 };
            let rest = &buffer[blanks..];
            let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
            let ends = length < rest.len();
            self.text.extend_from_slice(&rest[..length.min(MAX_NUMBER_BYTES + 1)]);
            self.reader.consume(blanks + length);
            let is_started = !self.text.is_empty();
            if is_started && ends || self.text.len() > MAX_NUMBER_BYTES {
                break;
            }
        }
        parse(&self.text)
    }
}

fn count_blanks(bytes: &[u8]) -> usize {
    bytes.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(bytes.len())
}

fn parse(text: &[u8]) -> Result<f64, MeshError> {
    if text.is_empty() {
        return Err(MeshError::Truncated("its numbers".to_owned()));
    }
    let number = str::from_utf8(text).ok().and_then(|text| text.parse().ok());
    number.ok_or_else(|| {
        let shown = String::from_utf8_lossy(&text[..text.len().min(40)]).into_owned();
        MeshError::Malformed(format!("it has `{shown}` where a number should be"))
    })
}
