//! Attributes of primitives that shaders ask for by name.
//!
//! The application-specific attribute `_HEIGHT` is `HEIGHT`, or a name that differs in the case of its letters, as
//! `height`. `COLOR_0` is `Cd` and `color`, `TEXCOORD_0` is `uv0` and so on, `TEXCOORD_1` also `st`, and `TANGENT` is
//! `tangent`.

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use rtsl::{Numbers as Buffer, Scalar};

use super::file::{GltfFile, size};
use super::numbers::Numbers;
use crate::attributes::{GivenAttribute, Spread, WantedAttributes};
use crate::mesh::MeshError;

/// The names of the attribute that is the colour of vertices.
const COLOR_NAMES: [&str; 2] = ["Cd", "color"];

/// An attribute of a primitive that shaders read.
pub struct VertexAttribute {
    /// The name in shaders.
    pub name: String,
    /// The number of scalars in shaders, 1 to 4.
    pub scalars: usize,
    /// The attribute of the file.
    pub semantic: Semantic,
    accessor: Index<Accessor>,
    /// The number of scalars in the file, 1 to 4.
    found: usize,
}

impl VertexAttribute {
    /// Finds the wanted attributes of a primitive. Those of a type that shaders do not read are errors.
    pub fn all(
        file: &GltfFile<'_>,
        primitive: &Primitive,
        wanted: &WantedAttributes,
    ) -> Vec<Result<VertexAttribute, MeshError>> {
        let found = wanted.types().filter_map(|(name, types)| {
            let (semantic, accessor) = find(primitive, name)?;
            Some(VertexAttribute::new(file, name, types, semantic, accessor))
        });
        found.collect()
    }

    fn new(
        file: &GltfFile<'_>,
        name: &str,
        types: impl Iterator<Item = usize> + Clone,
        semantic: Semantic,
        accessor: Index<Accessor>,
    ) -> Result<VertexAttribute, MeshError> {
        let found = match &file.accessor(accessor)?.type_ {
            Checked::Valid(ty) => ty.multiplicity(),
            Checked::Invalid => 0,
        };
        let fits = |wanted: &usize| match semantic {
            Semantic::Colors(_) => matches!(found, 3 | 4) && matches!(wanted, 3 | 4),
            Semantic::Tangents => found == 4 && *wanted == 3,
            _ => false,
        };
        let mut same = types.clone().filter(|wanted| *wanted == found);
        let Some(scalars) = same.next().or_else(|| types.clone().find(fits)) else {
            let types: Vec<String> = types.map(|wanted| wanted.to_string()).collect();
            return Err(MeshError::OtherAttribute {
                attribute: semantic.to_string(),
                found,
                name: name.to_owned(),
                wanted: types.join(" or "),
            });
        };
        Ok(VertexAttribute { name: name.to_owned(), scalars, semantic, accessor, found })
    }

    /// Appends the values of so many vertices, or of those of them that are listed, each changed by `map`.
    ///
    /// # Errors
    /// If the numbers are not all in the file, or are those of another number of vertices.
    pub fn read(
        &self,
        file: &GltfFile<'_>,
        vertices: usize,
        used: Option<&[u32]>,
        map: &dyn Fn([f64; 4]) -> [f64; 4],
        values: &mut Vec<u32>,
    ) -> Result<(), MeshError> {
        let found = size(file.accessor(self.accessor)?.count);
        if found != vertices {
            let what = "of another attribute";
            return Err(MeshError::CountMismatch { what, found, vertices });
        }
        match self.found {
            1 => self.read_tuples::<1>(file, used, map, values),
            2 => self.read_tuples::<2>(file, used, map, values),
            3 => self.read_tuples::<3>(file, used, map, values),
            _ => self.read_tuples::<4>(file, used, map, values),
        }
    }

    fn read_tuples<const COUNT: usize>(
        &self,
        file: &GltfFile<'_>,
        used: Option<&[u32]>,
        map: &dyn Fn([f64; 4]) -> [f64; 4],
        values: &mut Vec<u32>,
    ) -> Result<(), MeshError> {
        let numbers = Numbers::<COUNT>::new(self.accessor, file)?;
        let mut push = |tuple: [f64; COUNT]| {
            // Colours without opacity have 1.
            let mut padded = [0.0, 0.0, 0.0, 1.0];
            padded[..COUNT].copy_from_slice(&tuple);
            let mapped = map(padded);
            values.extend(mapped[..self.scalars].iter().map(|it| (*it as f32).to_bits()));
        };
        match used {
            Some(used) => used.iter().for_each(|vertex| push(numbers.at(*vertex as usize))),
            None => numbers.iter().for_each(push),
        }
        Ok(())
    }

    /// Returns the number that vertices of primitives without the attribute have: their colour is white, as without
    /// attributes.
    fn missing(&self) -> u32 {
        let is_color = matches!(self.semantic, Semantic::Colors(_));
        if is_color { 1.0_f32.to_bits() } else { 0 }
    }
}

/// The attribute of a primitive that has this name in shaders. One of the application has precedence.
fn find(primitive: &Primitive, name: &str) -> Option<(Semantic, Index<Accessor>)> {
    let given = || {
        primitive.attributes.iter().filter_map(|(semantic, accessor)| match semantic {
            Checked::Valid(semantic) => Some((semantic, *accessor)),
            Checked::Invalid => None,
        })
    };
    let own = |is_name: &dyn Fn(&str) -> bool| {
        given().find(|(semantic, _)| matches!(semantic, Semantic::Extras(it) if is_name(it)))
    };
    let is_standard = |semantic: &Semantic| match semantic {
        Semantic::Colors(0) => COLOR_NAMES.contains(&name),
        Semantic::TexCoords(set) => name == format!("uv{set}") || (*set == 1 && name == "st"),
        Semantic::Tangents => name == "tangent",
        _ => false,
    };
    let found = own(&|it| it == name)
        .or_else(|| own(&|it| it.eq_ignore_ascii_case(name)))
        .or_else(|| given().find(|(semantic, _)| is_standard(semantic)));
    found.map(|(semantic, accessor)| (semantic.clone(), accessor))
}

/// The values of an attribute for the vertices of a mesh.
#[derive(Clone, Debug)]
pub struct VertexValues {
    name: String,
    scalars: usize,
    values: Vec<u32>,
}

impl VertexValues {
    /// The attribute without vertices.
    pub fn new(attribute: &VertexAttribute) -> VertexValues {
        let VertexAttribute { name, scalars, .. } = attribute;
        VertexValues { name: name.clone(), scalars: *scalars, values: Vec::new() }
    }

    /// Returns the numbers, to which those of further vertices are appended.
    pub fn values(&mut self) -> &mut Vec<u32> {
        &mut self.values
    }

    /// Gives vertices of their own to these, of which some may be the same.
    pub fn spread(&mut self, vertices: &[u32]) {
        let values = vertices.iter().flat_map(|vertex| {
            let first = *vertex as usize * self.scalars;
            self.values[first..first + self.scalars].iter().copied()
        });
        self.values = values.collect();
    }

    /// Returns the attribute.
    pub fn finish(self) -> GivenAttribute {
        GivenAttribute {
            name: self.name,
            scalars: self.scalars,
            spread: Spread::Vertices,
            numbers: Buffer::from_words(Scalar::F32, self.values),
        }
    }
}

/// The attributes of a mesh of several primitives, of which some may lack one.
#[derive(Debug, Default)]
pub struct JoinedAttributes(Vec<Joined>);

/// An attribute with the number that fills its gaps.
#[derive(Debug)]
struct Joined {
    values: VertexValues,
    missing: u32,
}

impl JoinedAttributes {
    /// Returns the count of numbers, if there are so many vertices and those of these attributes are added.
    pub fn numbers(&self, vertices: usize, more: &[VertexAttribute]) -> usize {
        let known = self.0.iter().map(|it| it.values.scalars);
        let scalars: usize = known.chain(more.iter().map(|it| it.scalars)).sum();
        vertices.saturating_mul(scalars)
    }

    /// Returns the numbers of an attribute, of which `first` vertices come before those that are to be added.
    ///
    /// # Errors
    /// If earlier vertices have it with another type.
    pub fn values(
        &mut self,
        attribute: &VertexAttribute,
        first: usize,
    ) -> Result<&mut Vec<u32>, MeshError> {
        let known = self.0.iter().position(|it| it.values.name == attribute.name);
        let at = known.unwrap_or_else(|| {
            let values = VertexValues::new(attribute);
            self.0.push(Joined { values, missing: attribute.missing() });
            self.0.len() - 1
        });
        let Joined { values: VertexValues { name, scalars, values }, missing } = &mut self.0[at];
        if *scalars != attribute.scalars {
            return Err(MeshError::OtherAttribute {
                attribute: attribute.semantic.to_string(),
                found: attribute.scalars,
                name: name.clone(),
                wanted: format!("{scalars} in another primitive"),
            });
        }
        values.resize(first * *scalars, *missing);
        Ok(values)
    }

    /// Returns the attributes of so many vertices.
    pub fn finish(self, vertices: usize) -> Vec<GivenAttribute> {
        let finished = self.0.into_iter().map(|Joined { mut values, missing }| {
            values.values.resize(vertices * values.scalars, missing);
            values.finish()
        });
        finished.collect()
    }
}
