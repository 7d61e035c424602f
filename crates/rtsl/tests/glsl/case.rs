//! A case of a suite: the texts of a program, what a compiler says of them, and what they compute.

/// The version of GLSL that a case is written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Version {
    /// `110` to `460`, or `100` to `320`.
    pub number: u32,
    /// True for GLSL ES.
    pub es: bool,
}

impl Version {
    /// Reads `300 es`, `3.00 es` or `1.30`.
    pub fn parse(text: &str) -> Option<Version> {
        let mut words = text.split_whitespace();
        let number: u32 = words.next()?.replace('.', "").parse().ok()?;
        let es = words.next() == Some("es") || number == 100;
        Some(Version { number, es })
    }
}

/// The part of a pipeline that a text is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    Vertex,
    Fragment,
    /// A text that the suite compiles for both.
    Both,
    /// Geometry, tessellation, compute.
    Other,
}

/// The text of a stage.
#[derive(Clone, Debug)]
pub struct Shader {
    pub stage: Stage,
    pub text: String,
}

/// The expectation of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expect {
    /// The program computes the values.
    Values,
    /// The texts are accepted.
    Accepted,
    /// A text is refused.
    Refused,
    /// The texts do not go together, or the pipeline refuses the program.
    LinkRefused,
}

/// A value of a `values` block, for each row.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    pub ty: String,
    pub name: String,
    /// The words of one row after those of the other; bools are 0 or 1.
    pub rows: Vec<Vec<u32>>,
}

impl Value {
    /// The words of a row; a value that has one row has it for all.
    pub fn row(&self, index: usize) -> &[u32] {
        let last = self.rows.len().saturating_sub(1);
        self.rows.get(index.min(last)).map_or(&[], Vec::as_slice)
    }
}

/// The values that a program receives, and those that it computes from them.
#[derive(Clone, Debug, Default)]
pub struct Values {
    pub inputs: Vec<Value>,
    pub uniforms: Vec<Value>,
    pub outputs: Vec<Value>,
}

/// A step of a drawing program.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Uniform {
        ty: String,
        name: String,
        numbers: Vec<f64>,
    },
    /// The colour of the following `Clear`.
    ClearColor([f32; 4]),
    /// Everything gets the colour for it, black at first.
    Clear,
    /// A rectangle: left, bottom, width, height.
    Draw([f32; 4]),
    /// The first components of pixels. A place is a part of the window; without one, all pixels.
    Probe {
        place: Option<[f32; 2]>,
        color: Vec<f32>,
    },
    /// A step that the runner does not know.
    Unknown(String),
}

/// A case.
#[derive(Clone, Debug)]
pub struct Case {
    /// `folder/file/group/name`.
    pub path: String,
    pub version: Version,
    pub shaders: Vec<Shader>,
    pub expect: Expect,
    pub values: Values,
    pub steps: Vec<Step>,
    /// Extensions that the case needs, alternatives with `|` between them.
    pub extensions: Vec<String>,
}

/// The scalar of a type and the number of its scalars, such as `f` and 6 for `mat2x3`.
pub fn shape_of(ty: &str) -> Option<(char, usize)> {
    let digit = |at: usize| ty.as_bytes().get(at).map(|it| usize::from(it - b'0'));
    match ty {
        "float" => Some(('f', 1)),
        "int" => Some(('i', 1)),
        "uint" => Some(('u', 1)),
        "bool" => Some(('b', 1)),
        _ if ty.starts_with("vec") => Some(('f', digit(3)?)),
        _ if ty.starts_with("ivec") => Some(('i', digit(4)?)),
        _ if ty.starts_with("uvec") => Some(('u', digit(4)?)),
        _ if ty.starts_with("bvec") => Some(('b', digit(4)?)),
        _ if ty.starts_with("mat") => Some(('f', digit(3)? * digit(5).or(digit(3))?)),
        _ => None,
    }
}

/// The word of a number as a scalar.
pub fn word_of(scalar: char, number: f64) -> u32 {
    match scalar {
        'f' => (number as f32).to_bits(),
        'i' => number as i64 as i32 as u32,
        'u' => number as i64 as u32,
        _ => u32::from(number != 0.0),
    }
}
