//! The directives of the scene format and of its earlier versions, as a table of the words and their operands.

/// A directive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "each is the word of the same spelling")]
pub enum Keyword {
    Accelerator,
    ActiveTransform,
    AreaLightSource,
    Attribute,
    AttributeBegin,
    AttributeEnd,
    Camera,
    ColorSpace,
    ConcatTransform,
    CoordinateSystem,
    CoordSysTransform,
    Film,
    Identity,
    Import,
    Include,
    Integrator,
    LightSource,
    LookAt,
    MakeNamedMaterial,
    MakeNamedMedium,
    Material,
    MediumInterface,
    NamedMaterial,
    ObjectBegin,
    ObjectEnd,
    ObjectInstance,
    Option,
    PixelFilter,
    Renderer,
    ReverseOrientation,
    Rotate,
    Sampler,
    Scale,
    SearchPath,
    Shape,
    SurfaceIntegrator,
    Texture,
    Transform,
    TransformBegin,
    TransformEnd,
    TransformTimes,
    Translate,
    Volume,
    VolumeIntegrator,
    WorldBegin,
    WorldEnd,
}

/// The operands of a directive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operands {
    /// The count of numbers, with or without brackets around them.
    pub numbers: usize,
    /// The least count of quoted strings.
    pub texts: usize,
    /// The count of further, optional quoted strings.
    pub optional_texts: usize,
    /// True if a list of parameters follows.
    pub parameters: bool,
}

const NOTHING: Operands = Operands { numbers: 0, texts: 0, optional_texts: 0, parameters: false };
const NAME: Operands = Operands { texts: 1, ..NOTHING };
const PARAMETERS: Operands = Operands { parameters: true, ..NOTHING };
const ENTITY: Operands = Operands { texts: 1, ..PARAMETERS };

const fn numbers(numbers: usize) -> Operands {
    Operands { numbers, ..NOTHING }
}

/// Every directive, in alphabetical order.
const DIRECTIVES: &[(&str, Keyword, Operands)] = &[
    ("Accelerator", Keyword::Accelerator, ENTITY),
    ("ActiveTransform", Keyword::ActiveTransform, NOTHING),
    ("AreaLightSource", Keyword::AreaLightSource, ENTITY),
    ("Attribute", Keyword::Attribute, ENTITY),
    ("AttributeBegin", Keyword::AttributeBegin, NOTHING),
    ("AttributeEnd", Keyword::AttributeEnd, NOTHING),
    ("Camera", Keyword::Camera, ENTITY),
    ("ColorSpace", Keyword::ColorSpace, NAME),
    ("ConcatTransform", Keyword::ConcatTransform, numbers(16)),
    ("CoordSysTransform", Keyword::CoordSysTransform, NAME),
    ("CoordinateSystem", Keyword::CoordinateSystem, NAME),
    ("Film", Keyword::Film, ENTITY),
    ("Identity", Keyword::Identity, NOTHING),
    ("Import", Keyword::Import, NAME),
    ("Include", Keyword::Include, NAME),
    ("Integrator", Keyword::Integrator, ENTITY),
    ("LightSource", Keyword::LightSource, ENTITY),
    ("LookAt", Keyword::LookAt, numbers(9)),
    ("MakeNamedMaterial", Keyword::MakeNamedMaterial, ENTITY),
    ("MakeNamedMedium", Keyword::MakeNamedMedium, ENTITY),
    ("Material", Keyword::Material, ENTITY),
    ("MediumInterface", Keyword::MediumInterface, Operands { optional_texts: 1, ..NAME }),
    ("NamedMaterial", Keyword::NamedMaterial, NAME),
    ("ObjectBegin", Keyword::ObjectBegin, NAME),
    ("ObjectEnd", Keyword::ObjectEnd, NOTHING),
    ("ObjectInstance", Keyword::ObjectInstance, NAME),
    ("Option", Keyword::Option, PARAMETERS),
    ("PixelFilter", Keyword::PixelFilter, ENTITY),
    ("Renderer", Keyword::Renderer, ENTITY),
    ("ReverseOrientation", Keyword::ReverseOrientation, NOTHING),
    ("Rotate", Keyword::Rotate, numbers(4)),
    ("Sampler", Keyword::Sampler, ENTITY),
    ("Scale", Keyword::Scale, numbers(3)),
    ("SearchPath", Keyword::SearchPath, NAME),
    ("Shape", Keyword::Shape, ENTITY),
    ("SurfaceIntegrator", Keyword::SurfaceIntegrator, ENTITY),
    ("Texture", Keyword::Texture, Operands { texts: 3, ..PARAMETERS }),
    ("Transform", Keyword::Transform, numbers(16)),
    ("TransformBegin", Keyword::TransformBegin, NOTHING),
    ("TransformEnd", Keyword::TransformEnd, NOTHING),
    ("TransformTimes", Keyword::TransformTimes, numbers(2)),
    ("Translate", Keyword::Translate, numbers(3)),
    ("Volume", Keyword::Volume, ENTITY),
    ("VolumeIntegrator", Keyword::VolumeIntegrator, ENTITY),
    ("WorldBegin", Keyword::WorldBegin, NOTHING),
    ("WorldEnd", Keyword::WorldEnd, NOTHING),
];

/// Returns the directive spelled `word`, and its operands.
pub fn directive(word: &str) -> Option<(Keyword, Operands)> {
    DIRECTIVES
        .iter()
        .find(|(spelling, ..)| *spelling == word)
        .map(|(_, keyword, operands)| (*keyword, *operands))
}

/// Returns the words of all directives.
pub fn directive_words() -> impl Iterator<Item = &'static str> {
    DIRECTIVES.iter().map(|(spelling, ..)| *spelling)
}

impl Keyword {
    /// Returns the spelling of the directive.
    pub fn word(self) -> &'static str {
        DIRECTIVES.iter().find(|(_, keyword, _)| *keyword == self).map_or("", |(word, ..)| word)
    }
}
