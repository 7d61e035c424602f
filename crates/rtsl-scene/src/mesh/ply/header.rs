//! The header of a PLY file: lines of text that describe the numbers after it.

use std::io::{BufRead, Read};

use rtsl::encoding;

use crate::mesh::MeshError;

/// The content of a header.
#[derive(Debug)]
pub struct Header {
    /// The encoding of numbers.
    pub encoding: Encoding,
    /// The elements, in file order.
    pub elements: Vec<Element>,
}

/// The encoding of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As text.
    Text,
    /// Binary, little-endian.
    LittleEndian,
    /// Binary, big-endian.
    BigEndian,
}

/// A number of elements with the same properties.
#[derive(Debug)]
pub struct Element {
    /// `vertex`, `face` or another.
    pub name: String,
    /// The number of elements, as the header claims.
    pub count: usize,
    /// The properties of each.
    pub properties: Vec<Property>,
}

/// A property.
#[derive(Debug)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: Kind,
}

/// The type of a property.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// One number.
    Scalar(NumberType),
    /// A count followed by as many numbers.
    List {
        /// The type of the count.
        count: NumberType,
        /// The type of the numbers.
        item: NumberType,
    },
}

/// The types of numbers.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names are those of the format")]
pub enum NumberType {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Float32,
    Float64,
}

impl NumberType {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => NumberType::Int8,
            "uchar" | "uint8" => NumberType::Uint8,
            "short" | "int16" => NumberType::Int16,
            "ushort" | "uint16" => NumberType::Uint16,
            "int" | "int32" => NumberType::Int32,
            "uint" | "uint32" => NumberType::Uint32,
            "float" | "float32" => NumberType::Float32,
            "double" | "float64" => NumberType::Float64,
            _ => return None,
        })
    }
}

/// The greatest length of a header line.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// The greatest length of a header: its content takes memory.
const MAX_HEADER_BYTES: usize = 16 << 20;

impl Header {
    /// Reads the lines up to `end_header`.
    pub fn read(reader: &mut impl BufRead) -> Result<Header, MeshError> {
        encoding::check_width(reader.fill_buf()?)
            .map_err(|problem| MeshError::Malformed(problem.to_owned()))?;
        if next_line(reader)?.trim_start_matches('\u{feff}').trim_end() != "ply" {
            return Err(MeshError::OtherFormat("it is not a PLY file".to_owned()));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut length = 0;
        loop {
            let line = next_line(reader)?;
            length += line.len();
            if length > MAX_HEADER_BYTES {
                return Err(MeshError::Malformed("its header is longer than 16 MiB".to_owned()));
            }
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words.as_slice() {
                ["end_header"] => break,
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, _version] => encoding = Some(parse_encoding(name)?),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| bad_line(&line))?;
                    let name = (*name).to_owned();
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                ["property", ty @ .., name] => {
                    let kind = parse_kind(ty).ok_or_else(|| bad_line(&line))?;
                    let element = elements.last_mut().ok_or_else(|| bad_line(&line))?;
                    element.properties.push(Property { name: (*name).to_owned(), kind });
                }
                _ => return Err(bad_line(&line)),
            }
        }
        let missing = || MeshError::Malformed("its header has no line `format`".to_owned());
        Ok(Header { encoding: encoding.ok_or_else(missing)?, elements })
    }
}

/// Reads the next line, including its end. Comments may have any encoding, so invalid UTF-8 is replaced.
fn next_line(reader: &mut impl BufRead) -> Result<String, MeshError> {
    let mut line = Vec::new();
    reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
    if line.last() != Some(&b'\n') {
        return Err(match line.len() as u64 == MAX_LINE_BYTES {
            true => MeshError::Malformed("its header has an endless line".to_owned()),
            false => MeshError::Truncated("its header".to_owned()),
        });
    }
    Ok(String::from_utf8_lossy(&line).into_owned())
}

fn parse_encoding(name: &str) -> Result<Encoding, MeshError> {
    match name {
        "ascii" => Ok(Encoding::Text),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err(MeshError::Malformed(format!("its format is `{}`", shorten(name)))),
    }
}

fn parse_kind(words: &[&str]) -> Option<Kind> {
    match words {
        ["list", count, item] => {
            let (count, item) = (NumberType::named(count)?, NumberType::named(item)?);
            Some(Kind::List { count, item })
        }
        [scalar] => NumberType::named(scalar).map(Kind::Scalar),
        _ => None,
    }
}

fn bad_line(line: &str) -> MeshError {
    MeshError::Malformed(format!("its header has the line `{}`", shorten(line.trim_end())))
}

/// Shortens a text of the file for messages.
fn shorten(text: &str) -> &str {
    &text[..text.floor_char_boundary(60)]
}
