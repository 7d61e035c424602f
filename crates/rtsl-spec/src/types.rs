//! The types of state variables.

/// The number of components of a `color` in this build: red, green and blue, linear, Rec. 709
/// primaries. Shaders cannot observe the number.
pub const COLOR_COMPONENTS: u32 = 3;

/// The type of a state variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StateType {
    /// One f32.
    Float,
    /// Two f32.
    Vec2,
    /// Three f32.
    Vec3,
    /// [`COLOR_COMPONENTS`] f32.
    Color,
    /// This many f32, as an array.
    Floats(u32),
}

impl StateType {
    /// The number of f32 components.
    pub const fn components(self) -> u32 {
        match self {
            StateType::Float => 1,
            StateType::Vec2 => 2,
            StateType::Vec3 => 3,
            StateType::Color => COLOR_COMPONENTS,
            StateType::Floats(count) => count,
        }
    }

    /// The name of the type in RTSL.
    pub const fn name(self) -> &'static str {
        match self {
            StateType::Float => "float",
            StateType::Vec2 => "vec2",
            StateType::Vec3 => "vec3",
            StateType::Color => "color",
            StateType::Floats(_) => "float[]",
        }
    }
}
