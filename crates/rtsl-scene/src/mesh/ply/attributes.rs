//! Attributes in PLY files: properties of vertices or faces that shaders ask for by name.
//!
//! The property `height` is the number of that name. The numbers of a vector or colour are the properties `wind_x`,
//! `wind_y` and so on, `wind_r`, or `wind_0`. The properties `red`, `green`, `blue` and `alpha` are the attributes `Cd`
//! and `color`; as bytes they have the transfer function of sRGB.

use rtsl::{Numbers, Scalar};
use rtsl_image::Encoding;

use super::header::{Element, Kind, NumberType};
use crate::attributes::{GivenAttribute, Spread, WantedAttributes};

/// The names of the attribute that is the colour of vertices.
const COLOR_NAMES: [&str; 2] = ["Cd", "color"];
const COLOR_PROPERTIES: [&str; 4] = ["red", "green", "blue", "alpha"];
/// The endings of the properties of a vector.
const ENDINGS: [[&str; 4]; 3] =
    [["_x", "_y", "_z", "_w"], ["_r", "_g", "_b", "_a"], ["_0", "_1", "_2", "_3"]];

/// The attributes that are read of the vertices or faces of a file.
#[derive(Debug)]
pub struct AttributeColumns {
    spread: Spread,
    columns: Vec<Column>,
}

/// An attribute that is read.
#[derive(Debug)]
struct Column {
    name: String,
    /// The indices of its properties.
    properties: Vec<usize>,
    /// The encodings of bytes; `None` for numbers that mean themselves.
    encodings: Vec<Option<Encoding>>,
    /// The value of the vertex or face that is being read.
    current: Vec<u32>,
    values: Vec<u32>,
}

impl AttributeColumns {
    /// Finds the wanted attributes among the properties of an element.
    pub fn new(element: &Element, wanted: &WantedAttributes, spread: Spread) -> Self {
        let columns = wanted.iter().filter_map(|(name, size)| Column::new(element, name, size));
        AttributeColumns { spread, columns: columns.collect() }
    }

    /// The number of scalars of a vertex or face.
    pub fn scalars(&self) -> usize {
        self.columns.iter().map(|column| column.properties.len()).sum()
    }

    /// Takes a number of the vertex or face that is being read.
    pub fn take(&mut self, property: usize, number: f64) {
        for column in &mut self.columns {
            if let Some(at) = column.properties.iter().position(|it| *it == property) {
                let encoding = column.encodings[at];
                let number = encoding.map_or(number, |it| it.decode(number / 255.0));
                column.current[at] = (number as f32).to_bits();
            }
        }
    }

    /// Ends a vertex, or a face that became so many faces of the mesh.
    pub fn push(&mut self, count: usize) {
        for Column { current, values, .. } in &mut self.columns {
            (0..count).for_each(|_| values.extend_from_slice(current));
        }
    }

    /// Returns the attributes.
    pub fn finish(self) -> impl Iterator<Item = GivenAttribute> {
        let spread = self.spread;
        self.columns.into_iter().map(move |column| GivenAttribute {
            name: column.name,
            scalars: column.properties.len(),
            spread,
            numbers: Numbers::from_words(Scalar::F32, column.values),
        })
    }
}

impl Column {
    fn new(element: &Element, name: &str, size: usize) -> Option<Column> {
        let find = |wanted: &str| {
            let mut properties = element.properties.iter();
            properties.position(|it| it.name == wanted && matches!(it.kind, Kind::Scalar(_)))
        };
        let all = |names: &mut dyn Iterator<Item = String>| {
            names.take(size).map(|name| find(&name)).collect::<Option<Vec<usize>>>()
        };
        let is_color = COLOR_NAMES.contains(&name) && size >= 3;
        let properties = if size == 1 { find(name).map(|it| vec![it]) } else { None }
            .or_else(|| {
                let mut endings = ENDINGS.iter().filter(|_| size > 1);
                endings.find_map(|ends| all(&mut ends.iter().map(|end| format!("{name}{end}"))))
            })
            .or_else(|| {
                let colors = || all(&mut COLOR_PROPERTIES.iter().map(|it| (*it).to_owned()));
                is_color.then(colors).flatten()
            })?;
        let encodings = properties.iter().enumerate().map(|(at, property)| {
            let property = &element.properties[*property];
            let is_byte = matches!(property.kind, Kind::Scalar(NumberType::Uint8));
            match (is_byte && COLOR_PROPERTIES.contains(&property.name.as_str()), at) {
                (false, _) => None,
                (true, 3) => Some(Encoding::Linear),
                (true, _) => Some(Encoding::Srgb),
            }
        });
        Some(Column {
            name: name.to_owned(),
            encodings: encodings.collect(),
            current: vec![0; properties.len()],
            properties,
            values: Vec::new(),
        })
    }
}
