//! The numbers of a glTF accessor: tuples at regular distances in a buffer.

use gltf::Accessor;
use gltf::accessor::DataType;

use super::buffers::Buffers;
use crate::mesh::MeshError;

/// Tuples of `COUNT` numbers, all of them within their buffer.
pub struct Numbers<'a, const COUNT: usize> {
    bytes: &'a [u8],
    /// The distance in bytes between tuples.
    stride: usize,
    count: usize,
    ty: DataType,
    /// True if integers represent fractions of their type's greatest value.
    normalized: bool,
}

impl<'a, const COUNT: usize> Numbers<'a, COUNT> {
    /// The numbers that `accessor` describes.
    pub fn new(accessor: &Accessor<'_>, buffers: &'a Buffers<'_>) -> Result<Self, MeshError> {
        let wrong =
            |what: &str| Err(MeshError::Malformed(format!("accessor {} {what}", accessor.index())));
        if accessor.dimensions().multiplicity() != COUNT {
            return wrong("has groups of another size than its use");
        }
        let Some(view) = accessor.view().filter(|_| accessor.sparse().is_none()) else {
            return wrong("is sparse, which is not supported");
        };
        let size = accessor.data_type().size() * COUNT;
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            return wrong("has groups that overlap");
        }
        let last = accessor.count().checked_sub(1).and_then(|last| last.checked_mul(stride));
        let end = last.and_then(|last| last.checked_add(size));
        let bytes = buffers.view(&view).and_then(|bytes| bytes.get(accessor.offset()..));
        match (bytes, end) {
            (Some(bytes), Some(end)) if end <= bytes.len() => Ok(Numbers {
                bytes,
                stride,
                count: accessor.count(),
                ty: accessor.data_type(),
                normalized: accessor.normalized(),
            }),
            _ => wrong("ends outside its buffer"),
        }
    }

    /// Iterates over the tuples.
    pub fn iter(&self) -> impl Iterator<Item = [f64; COUNT]> {
        let size = self.ty.size();
        (0..self.count).map(move |index| {
            let group = &self.bytes[index * self.stride..];
            std::array::from_fn(|number| self.number(&group[number * size..]))
        })
    }

    fn number(&self, bytes: &[u8]) -> f64 {
        let (number, greatest): (f64, f64) = match self.ty {
            DataType::I8 => (i8::from_le_bytes([bytes[0]]).into(), i8::MAX.into()),
            DataType::U8 => (bytes[0].into(), u8::MAX.into()),
            DataType::I16 => (i16::from_le_bytes([bytes[0], bytes[1]]).into(), i16::MAX.into()),
            DataType::U16 => (u16::from_le_bytes([bytes[0], bytes[1]]).into(), u16::MAX.into()),
            DataType::U32 => (u32::from_le_bytes(four(bytes)).into(), u32::MAX.into()),
            DataType::F32 => return f32::from_le_bytes(four(bytes)).into(),
        };
        if self.normalized { f64::max(number / greatest, -1.0) } else { number }
    }
}

fn four(bytes: &[u8]) -> [u8; 4] {
    [bytes[0], bytes[1], bytes[2], bytes[3]]
}
