//! The numbers of a glTF accessor: tuples at regular distances in a buffer, some of which may be replaced.

use gltf::json::Index;
use gltf::json::accessor::sparse::Sparse;
use gltf::json::accessor::{Accessor, ComponentType};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;

use super::file::{GltfFile, size};
use crate::mesh::MeshError;

/// Tuples of `COUNT` numbers, all of them within their buffers.
pub struct Numbers<'a, const COUNT: usize> {
    /// The tuples; zeros if there are none.
    tuples: Option<Tuples<'a>>,
    count: usize,
    /// The replacements, by the indices of tuples in ascending order.
    replacements: Vec<(usize, [f64; COUNT])>,
}

/// Tuples in a buffer.
struct Tuples<'a> {
    bytes: &'a [u8],
    /// The distance in bytes between tuples.
    stride: usize,
    format: Format,
}

/// The form of a number in a buffer.
#[derive(Clone, Copy)]
struct Format {
    component: ComponentType,
    /// True if integers represent fractions of their type's greatest value.
    normalized: bool,
}

impl<'a, const COUNT: usize> Numbers<'a, COUNT> {
    /// The numbers that an accessor describes.
    pub fn new(index: Index<Accessor>, file: &'a GltfFile<'_>) -> Result<Self, MeshError> {
        let accessor = file.accessor(index)?;
        let wrong = |what: &str| MeshError::Malformed(format!("accessor {} {what}", index.value()));
        let (Checked::Valid(component), Checked::Valid(ty)) =
            (&accessor.component_type, &accessor.type_)
        else {
            return Err(wrong("has numbers of no known type"));
        };
        if ty.multiplicity() != COUNT {
            return Err(wrong("has groups of another size than its use"));
        }
        let format = Format { component: component.0, normalized: accessor.normalized };
        let count = size(accessor.count);
        let tuples = match (file.decoded.array(index), accessor.buffer_view) {
            (Some(bytes), _) if count <= bytes.len() / (4 * COUNT) => {
                Some(Tuples { bytes, stride: 4 * COUNT, format })
            }
            (Some(_), _) => return Err(wrong("ends outside its compressed data")),
            (None, Some(view)) => {
                let offset = accessor.byte_offset.map_or(0, size);
                Some(tuples(file, view, offset, format, COUNT, count).map_err(wrong)?)
            }
            (None, None) => None,
        };
        let replacements = match &accessor.sparse {
            Some(sparse) => replacements(file, sparse, format, count).map_err(wrong)?,
            None => Vec::new(),
        };
        Ok(Numbers { tuples, count, replacements })
    }

    /// Returns the tuple at an index, which is below their number.
    pub fn at(&self, index: usize) -> [f64; COUNT] {
        match self.replacements.binary_search_by_key(&index, |(replaced, _)| *replaced) {
            Ok(place) => self.replacements[place].1,
            Err(_) => self.tuples.as_ref().map_or([0.0; COUNT], |tuples| tuples.get(index)),
        }
    }

    /// Iterates over the tuples.
    pub fn iter(&self) -> impl Iterator<Item = [f64; COUNT]> {
        let mut replacements = self.replacements.iter().peekable();
        (0..self.count).map(move |index| {
            match replacements.next_if(|(replaced, _)| *replaced == index) {
                Some((_, tuple)) => *tuple,
                None => self.tuples.as_ref().map_or([0.0; COUNT], |tuples| tuples.get(index)),
            }
        })
    }
}

impl Tuples<'_> {
    fn get<const COUNT: usize>(&self, index: usize) -> [f64; COUNT] {
        let size = self.format.component.size();
        let group = &self.bytes[index * self.stride..];
        std::array::from_fn(|number| self.format.number(&group[number * size..]))
    }
}

/// `count` tuples in a buffer view.
fn tuples<'a>(
    file: &'a GltfFile<'_>,
    view: Index<View>,
    offset: usize,
    format: Format,
    numbers: usize,
    count: usize,
) -> Result<Tuples<'a>, &'static str> {
    let bytes = file.buffers.view(&file.root, view)?;
    let view = file.root.buffer_views.get(view.value()).ok_or("refers to no buffer view")?;
    let size = format.component.size() * numbers;
    let stride = view.byte_stride.map_or(size, |stride| stride.0);
    if stride < size {
        return Err("has groups that overlap");
    }
    let last = count.checked_sub(1).and_then(|last| last.checked_mul(stride));
    let end = last.and_then(|last| last.checked_add(size));
    match (bytes.get(offset..), end) {
        (Some(bytes), Some(end)) if end <= bytes.len() => Ok(Tuples { bytes, stride, format }),
        _ => Err("ends outside its buffer"),
    }
}

/// The replaced tuples of a sparse accessor.
fn replacements<const COUNT: usize>(
    file: &GltfFile<'_>,
    sparse: &Sparse,
    format: Format,
    count: usize,
) -> Result<Vec<(usize, [f64; COUNT])>, &'static str> {
    let replaced = size(sparse.count);
    if replaced == 0 {
        return Ok(Vec::new());
    }
    let Checked::Valid(component) = &sparse.indices.component_type else {
        return Err("has indices of no known type");
    };
    let whole = Format { component: component.0, normalized: false };
    let offset = size(sparse.indices.byte_offset);
    let indices = tuples(file, sparse.indices.buffer_view, offset, whole, 1, replaced)?;
    let offset = size(sparse.values.byte_offset);
    let values = tuples(file, sparse.values.buffer_view, offset, format, COUNT, replaced)?;
    let mut pairs = Vec::with_capacity(replaced);
    for pair in 0..replaced {
        let [index] = indices.get::<1>(pair);
        let index = index as usize;
        if index >= count || pairs.last().is_some_and(|(before, _)| *before >= index) {
            return Err("has sparse indices that are out of order");
        }
        pairs.push((index, values.get(pair)));
    }
    Ok(pairs)
}

impl Format {
    fn number(self, bytes: &[u8]) -> f64 {
        let (number, greatest): (f64, f64) = match self.component {
            ComponentType::I8 => (i8::from_le_bytes([bytes[0]]).into(), i8::MAX.into()),
            ComponentType::U8 => (bytes[0].into(), u8::MAX.into()),
            ComponentType::I16 => {
                (i16::from_le_bytes([bytes[0], bytes[1]]).into(), i16::MAX.into())
            }
            ComponentType::U16 => {
                (u16::from_le_bytes([bytes[0], bytes[1]]).into(), u16::MAX.into())
            }
            ComponentType::U32 => (u32::from_le_bytes(four(bytes)).into(), u32::MAX.into()),
            ComponentType::F32 => return f32::from_le_bytes(four(bytes)).into(),
        };
        if self.normalized { f64::max(number / greatest, -1.0) } else { number }
    }
}

fn four(bytes: &[u8]) -> [u8; 4] {
    [bytes[0], bytes[1], bytes[2], bytes[3]]
}
