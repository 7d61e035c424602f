//! Buffer views that `EXT_meshopt_compression` compresses: the decoders of its three modes and three filters, by the
//! extension's specification.
//!
//! Lengths in the file reserve no memory: the output grows as far as there are bytes.

/// The compression of a buffer view.
#[derive(Clone, Copy, Debug)]
pub struct Compression {
    /// The bytes of an element.
    pub stride: usize,
    /// The number of elements.
    pub count: usize,
    /// The kind of the elements.
    pub mode: Mode,
    /// The change of elements after decoding.
    pub filter: Filter,
}

/// The kind of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Attributes of vertices.
    Attributes,
    /// Corners of triangles.
    Triangles,
    /// Indices in any order.
    Indices,
}

/// The change of elements after decoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// None.
    None,
    /// Unit vectors on an octahedron.
    Octahedral,
    /// Unit quaternions without their greatest part.
    Quaternion,
    /// Floats with a common exponent.
    Exponential,
}

type Decoded<T> = Result<T, &'static str>;

const ENDED: &str = "its compressed data end too early";

impl Compression {
    /// Reads the names of mode and filter.
    ///
    /// # Errors
    /// If they are unknown, or the size of elements is wrong.
    pub fn new(stride: usize, count: usize, mode: &str, filter: &str) -> Decoded<Self> {
        let mode = match mode {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            _ => return Err("its mode of compression is unknown"),
        };
        let filter = match filter {
            "NONE" => Filter::None,
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            _ => return Err("its filter of compression is unknown"),
        };
        let is_valid = match mode {
            Mode::Attributes => stride > 0 && stride <= 256 && stride.is_multiple_of(4),
            Mode::Triangles => (stride == 2 || stride == 4) && count.is_multiple_of(3),
            Mode::Indices => stride == 2 || stride == 4,
        };
        let suits_filter = match filter {
            Filter::None => true,
            Filter::Octahedral => stride == 4 || stride == 8,
            Filter::Quaternion => stride == 8,
            Filter::Exponential => stride.is_multiple_of(4),
        };
        if !is_valid || !suits_filter {
            return Err("its elements have a size that their compression does not");
        }
        Ok(Compression { stride, count, mode, filter })
    }

    /// Returns the elements.
    ///
    /// # Errors
    /// If the data are damaged.
    pub fn decode(self, data: &[u8]) -> Decoded<Vec<u8>> {
        let mut bytes = match self.mode {
            Mode::Attributes => attributes(data, self.count, self.stride)?,
            Mode::Triangles => packed(&triangles(data, self.count)?, self.stride),
            Mode::Indices => packed(&indices(data, self.count)?, self.stride),
        };
        match self.filter {
            Filter::None => {}
            Filter::Octahedral if self.stride == 4 => octahedral_bytes(&mut bytes),
            Filter::Octahedral => octahedral_words(&mut bytes),
            Filter::Quaternion => quaternions(&mut bytes),
            Filter::Exponential => exponents(&mut bytes),
        }
        Ok(bytes)
    }
}

/// The bytes that are left to read.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Decoded<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(ENDED)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Decoded<u8> {
        Ok(self.take(1)?[0])
    }

    /// A number of seven bits in each byte, the lowest first.
    fn number(&mut self) -> Decoded<u32> {
        let mut number = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u32::from(byte & 127).wrapping_shl(shift);
            if byte < 128 {
                break;
            }
        }
        Ok(number)
    }
}

/// Elements whose bytes differ little from those of the element before.
fn attributes(data: &[u8], count: usize, stride: usize) -> Decoded<Vec<u8>> {
    const LARGEST_BLOCK: usize = 256;
    const BLOCK_BYTES: usize = 8192;
    const GROUP: usize = 16;
    let mut reader = Reader(data);
    if reader.byte()? != 0xa0 {
        return Err("its version of compressed attributes is unknown");
    }
    // The element before the first comes last.
    let tail = data.len().checked_sub(stride).ok_or(ENDED)?;
    let mut last = data[tail..].to_vec();
    let per_block = (BLOCK_BYTES / stride / GROUP * GROUP).min(LARGEST_BLOCK);
    let mut bytes = Vec::new();
    let mut channel = [0; LARGEST_BLOCK];
    while bytes.len() / stride < count {
        let block = per_block.min(count - bytes.len() / stride);
        let start = bytes.len();
        bytes.resize(start + block * stride, 0);
        for (at, last) in last.iter_mut().enumerate() {
            let groups = block.div_ceil(GROUP);
            let header = reader.take(groups.div_ceil(4))?;
            for group in 0..groups {
                let bits = header[group / 4] >> (group % 4 * 2) & 3;
                let values = &mut channel[group * GROUP..][..GROUP];
                group_of_bytes(&mut reader, bits, values)?;
            }
            for (element, value) in channel[..block].iter().enumerate() {
                // The sign is in the lowest bit.
                let difference = (value >> 1) ^ (value & 1).wrapping_neg();
                *last = last.wrapping_add(difference);
                bytes[start + element * stride + at] = *last;
            }
        }
    }
    Ok(bytes)
}

/// Sixteen bytes: zeros, or values of two or four bits the greatest of which stands for a byte that follows, or bytes.
fn group_of_bytes(reader: &mut Reader<'_>, bits: u8, values: &mut [u8]) -> Decoded<()> {
    let width = match bits {
        0 => {
            values.fill(0);
            return Ok(());
        }
        1 => 2,
        2 => 4,
        _ => {
            values.copy_from_slice(reader.take(16)?);
            return Ok(());
        }
    };
    let packed = reader.take(2 * width)?;
    let greatest = (1_u8 << width) - 1;
    let in_byte = 8 / width;
    for (at, value) in values.iter_mut().enumerate() {
        let shift = 8 - width * (at % in_byte + 1);
        let code = packed[at / in_byte] >> shift & greatest;
        *value = if code == greatest { reader.byte()? } else { code };
    }
    Ok(())
}

/// The latest edges and vertices, which triangles refer to.
#[derive(Default)]
struct Recent {
    edges: [[u32; 2]; 16],
    next_edge: usize,
    vertices: [u32; 16],
    next_vertex: usize,
}

impl Recent {
    fn edge(&self, back: u8) -> [u32; 2] {
        self.edges[self.next_edge.wrapping_sub(1 + usize::from(back)) & 15]
    }

    fn vertex(&self, back: usize) -> u32 {
        self.vertices[self.next_vertex.wrapping_sub(back) & 15]
    }

    fn push_edge(&mut self, edge: [u32; 2]) {
        self.edges[self.next_edge] = edge;
        self.next_edge = (self.next_edge + 1) & 15;
    }

    /// Writes a vertex to the next place, which is taken if `is_new`.
    fn push_vertex(&mut self, vertex: u32, is_new: bool) {
        self.vertices[self.next_vertex] = vertex;
        self.next_vertex = (self.next_vertex + usize::from(is_new)) & 15;
    }
}

/// Numbers that continue from the greatest vertex so far, or from the last that was given as a difference.
struct Vertices {
    next: u32,
    last: u32,
}

impl Vertices {
    fn fresh(&mut self) -> u32 {
        let fresh = self.next;
        self.next = self.next.wrapping_add(1);
        fresh
    }

    fn given(&mut self, reader: &mut Reader<'_>) -> Decoded<u32> {
        let number = reader.number()?;
        self.last = self.last.wrapping_add(signed(number));
        Ok(self.last)
    }
}

/// The number whose sign is in the lowest bit, in two's complement.
fn signed(number: u32) -> u32 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

/// The corners of triangles that share edges with those before.
fn triangles(data: &[u8], count: usize) -> Decoded<Vec<u32>> {
    const TABLE: usize = 16;
    let version = match data.first() {
        Some(0xe0) => 0,
        Some(0xe1) => 1,
        Some(_) | None => return Err("its version of compressed triangles is unknown"),
    };
    // In version 1 two codes are for the neighbours of the last vertex.
    let coded = if version == 0 { 15 } else { 13 };
    let (body, table) = data.split_at(data.len().checked_sub(TABLE).ok_or(ENDED)?);
    let (codes, rest) =
        body.get(1..).and_then(|body| body.split_at_checked(count / 3)).ok_or(ENDED)?;
    let mut reader = Reader(rest);
    let mut recent = Recent::default();
    let mut vertices = Vertices { next: 0, last: 0 };
    let mut corners = Vec::with_capacity(3 * codes.len());
    for code in codes {
        let low = code & 15;
        let [a, b, c] = match code {
            0..0xf0 => {
                let [a, b] = recent.edge(code >> 4);
                let (c, is_new) = if low == 0 {
                    (vertices.fresh(), true)
                } else if low < coded {
                    (recent.vertex(1 + usize::from(low)), false)
                } else if low == 15 {
                    (vertices.given(&mut reader)?, true)
                } else {
                    let step = if low == 13 { u32::MAX } else { 1 };
                    vertices.last = vertices.last.wrapping_add(step);
                    (vertices.last, true)
                };
                recent.push_vertex(c, is_new);
                recent.push_edge([c, b]);
                recent.push_edge([a, c]);
                corners.extend([a, b, c]);
                continue;
            }
            0xf0..0xfe => {
                let pair = table[usize::from(low)];
                let a = vertices.fresh();
                let b = if pair >> 4 == 0 {
                    vertices.fresh()
                } else {
                    recent.vertex((pair >> 4).into())
                };
                let c = if pair & 15 == 0 {
                    vertices.fresh()
                } else {
                    recent.vertex((pair & 15).into())
                };
                recent.push_vertex(a, true);
                recent.push_vertex(b, pair >> 4 == 0);
                recent.push_vertex(c, pair & 15 == 0);
                [a, b, c]
            }
            0xfe..=0xff => {
                let pair = reader.byte()?;
                if pair == 0 {
                    vertices.next = 0;
                }
                let first = if *code == 0xfe { 0 } else { 15 };
                let parts = [first, pair >> 4, pair & 15];
                let mut corner = [0; 3];
                for (corner, part) in corner.iter_mut().zip(parts) {
                    *corner = match part {
                        0 => vertices.fresh(),
                        15 => 0,
                        back => recent.vertex(back.into()),
                    };
                }
                for (corner, part) in corner.iter_mut().zip(parts) {
                    if part == 15 {
                        *corner = vertices.given(&mut reader)?;
                    }
                }
                for (corner, part) in corner.iter().zip(parts) {
                    recent.push_vertex(*corner, part == 0 || part == 15);
                }
                corner
            }
        };
        recent.push_edge([b, a]);
        recent.push_edge([c, b]);
        recent.push_edge([a, c]);
        corners.extend([a, b, c]);
    }
    Ok(corners)
}

/// Indices as differences from one of the two before.
fn indices(data: &[u8], count: usize) -> Decoded<Vec<u32>> {
    let mut reader = Reader(data);
    if !matches!(reader.byte()?, 0xd0 | 0xd1) {
        return Err("its version of compressed indices is unknown");
    }
    let mut last = [0_u32; 2];
    let mut indices = Vec::new();
    for _ in 0..count {
        let number = reader.number()?;
        let line = &mut last[(number & 1) as usize];
        *line = line.wrapping_add(signed(number >> 1));
        indices.push(*line);
    }
    Ok(indices)
}

/// Indices of two or four bytes.
fn packed(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
}

/// The unit vector at a place on the octahedron whose extent is `one`.
fn unfolded(x: f32, y: f32, one: f32) -> [f32; 3] {
    let z = one - x.abs() - y.abs();
    let folded = z.min(0.0);
    let x = if x >= 0.0 { x + folded } else { x - folded };
    let y = if y >= 0.0 { y + folded } else { y - folded };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

fn octahedral_bytes(bytes: &mut [u8]) {
    for element in bytes.as_chunks_mut::<4>().0 {
        let part = |at: usize| f32::from(element[at].cast_signed());
        let vector = unfolded(part(0), part(1), part(2));
        let codes = vector.map(|part| (part * 127.0).round() as i8);
        (0..3).for_each(|at| element[at] = codes[at].cast_unsigned());
    }
}

fn octahedral_words(bytes: &mut [u8]) {
    for element in bytes.as_chunks_mut::<8>().0 {
        let vector =
            unfolded(word(element, 0).into(), word(element, 1).into(), word(element, 2).into());
        (0..3).for_each(|at| set_word(element, at, (vector[at] * 32767.0).round() as i16));
    }
}

fn quaternions(bytes: &mut [u8]) {
    for element in bytes.as_chunks_mut::<8>().0 {
        let last = word(element, 3);
        let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(last | 3);
        let [x, y, z] = [0, 1, 2].map(|at| scale * f32::from(word(element, at)));
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let greatest = (last & 3) as usize;
        for (step, part) in [w, x, y, z].into_iter().enumerate() {
            set_word(element, (greatest + step) & 3, (part * 32767.0).round() as i16);
        }
    }
}

/// Floats of 24 bits of a mantissa below 8 bits of an exponent, both signed.
fn exponents(bytes: &mut [u8]) {
    for element in bytes.as_chunks_mut::<4>().0 {
        let code = i32::from_le_bytes(*element);
        let (mantissa, exponent) = (code << 8 >> 8, code >> 24);
        // Powers of two from 2^-128 to 2^127 are exact as f64.
        let power = f64::from_bits(((1023 + exponent) as u64) << 52);
        *element = ((f64::from(mantissa) * power) as f32).to_le_bytes();
    }
}

fn word(element: &[u8; 8], at: usize) -> i16 {
    i16::from_le_bytes([element[2 * at], element[2 * at + 1]])
}

fn set_word(element: &mut [u8; 8], at: usize, value: i16) {
    element[2 * at..2 * at + 2].copy_from_slice(&value.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(stride: usize, count: usize, mode: &str, filter: &str, data: &[u8]) -> Vec<u8> {
        let compression = Compression::new(stride, count, mode, filter).expect("it is valid");
        for length in 0..data.len() {
            // Some bytes at the end are not needed.
            let _ = compression.decode(&data[..length]);
        }
        compression.decode(data).expect("it is whole")
    }

    #[test]
    fn attributes_are_sums_of_differences_in_four_widths() {
        let mut data = vec![0xa0];
        // 17 elements of four bytes are two groups a channel. Zeros, then in two bits, four bits and bytes.
        data.push(0b00_00);
        // 1, -1, and 7 in a byte of its own; the second group is zeros.
        data.push(0b00_01);
        data.extend([0b10_01_11_00, 0, 0, 0, 14]);
        data.push(0b00_10);
        data.extend([0x2e, 0xf0, 0, 0, 0, 0, 0, 0, 200]);
        data.push(0b11_00);
        data.extend([6, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        // The element before the first.
        data.extend([5, 6, 7, 8]);
        let bytes = decoded(4, 17, "ATTRIBUTES", "NONE", &data);
        assert_eq!(bytes.len(), 68);
        assert_eq!(bytes[..16], [5, 7, 8, 8, 5, 6, 15, 8, 5, 13, 115, 8, 5, 13, 115, 8]);
        assert_eq!(bytes[64..], [5, 13, 115, 11]);
    }

    #[test]
    fn triangles_refer_to_recent_edges_and_vertices() {
        // A fan of new vertices, a triangle from the table, one whose corners are given, and neighbours of the last.
        let codes = [0xf0, 0x10, 0x01, 0xff, 0x0d, 0x0e, 0x0f];
        let given = [0xf0, 40, 6, 20];
        let table = [0; 16];
        let data = [&[0xe1][..], &codes, &given, &table].concat();
        let bytes = decoded(2, 21, "TRIANGLES", "NONE", &data);
        let corners: Vec<u16> =
            bytes.as_chunks::<2>().0.iter().map(|it| u16::from_le_bytes(*it)).collect();
        assert_eq!(corners[..3], [0, 1, 2]);
        // The edge before the last is from 2 to 1.
        assert_eq!(corners[3..6], [2, 1, 3]);
        // The last edge, from 2 to 3, and the vertex before the latest.
        assert_eq!(corners[6..9], [2, 3, 2]);
        // 20 and 23 are given; the last corner is new.
        assert_eq!(corners[9..12], [20, 23, 4]);
        assert_eq!(corners[12..15], [20, 4, 22]);
        assert_eq!(corners[15..18], [20, 22, 23]);
        assert_eq!(corners[18..21], [20, 23, 33]);
    }

    #[test]
    fn indices_continue_two_lines() {
        let data = [0xd1, 40, 2, 5, 0x84, 1, 0, 0, 0, 0];
        let bytes = decoded(4, 4, "INDICES", "NONE", &data);
        let indices: Vec<u32> =
            bytes.as_chunks::<4>().0.iter().map(|it| u32::from_le_bytes(*it)).collect();
        assert_eq!(indices, [10, 9, 1, 42]);
    }

    #[test]
    fn filters_restore_vectors_quaternions_and_floats() {
        let mut vectors = [127, 0, 127, 9, 0, 200, 127, 0];
        octahedral_bytes(&mut vectors);
        assert_eq!(vectors[..4], [127, 0, 0, 9]);
        // (0, -56, 71) of the length 90.4.
        assert_eq!(vectors[4..], [0, (-79_i8).cast_unsigned(), 100, 0]);
        let mut rotation = [0, 0, 0, 0, 0, 0, 0xfe, 0x7f];
        quaternions(&mut rotation);
        // The greatest part is the third.
        assert_eq!(rotation, [0, 0, 0, 0, 0xff, 0x7f, 0, 0]);
        let mut floats = [3, 0, 0, 0xfe, 0xff, 0xff, 0xff, 4];
        exponents(&mut floats);
        assert_eq!(f32::from_le_bytes([floats[0], floats[1], floats[2], floats[3]]), 0.75);
        assert_eq!(f32::from_le_bytes([floats[4], floats[5], floats[6], floats[7]]), -16.0);
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        assert!(Compression::new(3, 1, "ATTRIBUTES", "NONE").is_err());
        assert!(Compression::new(2, 4, "TRIANGLES", "NONE").is_err());
        assert!(Compression::new(12, 4, "ATTRIBUTES", "QUATERNION").is_err());
        let huge = Compression::new(4, usize::MAX, "ATTRIBUTES", "NONE").expect("it is valid");
        assert_eq!(huge.decode(&[0xa0, 0, 0, 0, 0, 1, 2, 3, 4]), Err(ENDED));
    }
}
