//! Files of named arrays, in which the RGL database stores measured materials.
//!
//! A file begins with `tensor_file`, a byte 0, the version in two bytes and the number of fields in four. Each field
//! has the length of its name (two bytes), the name, the number of dimensions (two), the type of its numbers (one), the
//! place of its data in the file (eight), and the size of each dimension (eight). All numbers are little-endian.

use thiserror::Error;

const HEADER: &[u8] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];

/// More dimensions do not occur.
const MAX_DIMENSIONS: usize = 8;

/// The type of 32-bit floats, and the sizes of all types by number.
const FLOAT: u8 = 10;
const SIZES: [u64; 12] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];

/// The reason why a file cannot be read.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum TensorError {
    /// The file does not begin as such files do.
    #[error("it does not begin with `tensor_file` and the version 1.0")]
    Header,
    /// The file ends within the descriptions of fields.
    #[error("it ends after {0} bytes, within the description of field {1}")]
    Truncated(usize, u32),
    /// A field has an unknown type or too many dimensions.
    #[error("field `{0}` has type {1} and {2} dimensions")]
    Type(String, u8, u16),
    /// A field's data do not lie in the file.
    #[error("the data of field `{0}` do not lie in the file: it is truncated or damaged")]
    Data(String),
    /// A field is missing.
    #[error("it has no field `{0}`")]
    Missing(&'static str),
    /// A field is not what the reader expects.
    #[error("field `{0}` is not {1}")]
    Unexpected(&'static str, String),
}

/// A field: the sizes of its dimensions, and its data.
#[derive(Debug)]
struct Field<'f> {
    name: String,
    kind: u8,
    shape: Vec<u64>,
    data: &'f [u8],
}

/// The fields of a file.
#[derive(Debug)]
pub struct Tensors<'f>(Vec<Field<'f>>);

impl<'f> Tensors<'f> {
    /// Reads the descriptions of all fields.
    pub fn new(file: &'f [u8]) -> Result<Self, TensorError> {
        let rest = file.strip_prefix(HEADER).and_then(|rest| rest.strip_prefix(&VERSION));
        let mut cursor = Cursor { file, rest: rest.ok_or(TensorError::Header)?, field: 0 };
        let count = u32::from_le_bytes(cursor.take()?);
        let mut fields = Vec::new();
        for field in 0..count {
            cursor.field = field;
            fields.push(cursor.field()?);
        }
        Ok(Tensors(fields))
    }

    /// Returns the sizes of the dimensions of a field of floats.
    pub fn shape<const N: usize>(&self, name: &'static str) -> Result<[usize; N], TensorError> {
        let field = self.floats_field(name)?;
        let sizes: Vec<usize> = field.shape.iter().map(|size| *size as usize).collect();
        <[usize; N]>::try_from(sizes).map_err(|sizes| {
            TensorError::Unexpected(name, format!("of {N} dimensions but of {}", sizes.len()))
        })
    }

    /// Returns the numbers of a field of floats.
    pub fn floats(&self, name: &'static str) -> Result<impl Iterator<Item = f32>, TensorError> {
        let (words, _) = self.floats_field(name)?.data.as_chunks::<4>();
        Ok(words.iter().map(|word| f32::from_le_bytes(*word)))
    }

    fn floats_field(&self, name: &'static str) -> Result<&Field<'f>, TensorError> {
        let field = self.0.iter().find(|field| field.name == name);
        let field = field.ok_or(TensorError::Missing(name))?;
        if field.kind != FLOAT {
            return Err(TensorError::Unexpected(name, "of 32-bit floats".to_owned()));
        }
        Ok(field)
    }
}

/// The descriptions of fields that are not read yet.
struct Cursor<'f> {
    file: &'f [u8],
    rest: &'f [u8],
    field: u32,
}

impl<'f> Cursor<'f> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], TensorError> {
        let Some((taken, rest)) = self.rest.split_first_chunk::<N>() else {
            return Err(TensorError::Truncated(self.file.len(), self.field));
        };
        self.rest = rest;
        Ok(*taken)
    }

    fn field(&mut self) -> Result<Field<'f>, TensorError> {
        let length = usize::from(u16::from_le_bytes(self.take()?));
        let Some((name, rest)) = self.rest.split_at_checked(length) else {
            return Err(TensorError::Truncated(self.file.len(), self.field));
        };
        self.rest = rest;
        let name = String::from_utf8_lossy(name).into_owned();
        let dimensions = u16::from_le_bytes(self.take()?);
        let [kind] = self.take()?;
        let start = u64::from_le_bytes(self.take()?);
        let size = SIZES.get(usize::from(kind)).copied().unwrap_or(0);
        if size == 0 || usize::from(dimensions) > MAX_DIMENSIONS {
            return Err(TensorError::Type(name, kind, dimensions));
        }
        let mut shape = Vec::with_capacity(usize::from(dimensions));
        for _ in 0..dimensions {
            shape.push(u64::from_le_bytes(self.take()?));
        }
        let bytes = shape.iter().try_fold(size, |product, size| product.checked_mul(*size));
        let end = bytes.and_then(|bytes| start.checked_add(bytes));
        let in_file = |place: u64| usize::try_from(place).ok();
        let data = end
            .and_then(|end| self.file.get(in_file(start)?..in_file(end)?))
            .ok_or_else(|| TensorError::Data(name.clone()))?;
        Ok(Field { name, kind, shape, data })
    }
}
