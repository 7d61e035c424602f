//! The types of rays that shaders tell apart, and their constants.

/// The way in which a ray came to a surface: the value of `rt_RayType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayType {
    /// A ray of the camera.
    Camera,
    /// A further ray that an integrator searches along, such as one that a surface scatters.
    Scattered,
    /// A ray that `trace` traces.
    Traced,
}

impl RayType {
    /// All types.
    pub const ALL: [RayType; 3] = [RayType::Camera, RayType::Scattered, RayType::Traced];

    /// Returns the type of the ray that an integrator has searched along last, after `before` earlier hits and
    /// searches, if its own ray has this depth.
    pub const fn of(depth: u32, before: u32) -> RayType {
        match (depth, before) {
            (0, 0) => RayType::Camera,
            (_, 0) => RayType::Traced,
            _ => RayType::Scattered,
        }
    }

    /// The constant of the language.
    pub const fn name(self) -> &'static str {
        match self {
            RayType::Camera => "rt_CAMERA_RAY",
            RayType::Scattered => "rt_SCATTERED_RAY",
            RayType::Traced => "rt_TRACED_RAY",
        }
    }

    /// The type that a constant of the language names.
    pub fn from_name(name: &str) -> Option<RayType> {
        RayType::ALL.into_iter().find(|each| each.name() == name)
    }

    /// The value of the constant.
    pub const fn value(self) -> f32 {
        self as u8 as f32
    }

    /// A description, for the manual.
    pub const fn doc(self) -> &'static str {
        match self {
            RayType::Camera => "a ray of the camera",
            RayType::Scattered => {
                "a further ray that the integrator searches along, such as one that a surface scatters"
            }
            RayType::Traced => "a ray that `trace` traces, up to the first surface",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_find_their_types() {
        for (each, value) in RayType::ALL.into_iter().zip([0.0, 1.0, 2.0]) {
            assert_eq!((RayType::from_name(each.name()), each.value()), (Some(each), value));
        }
        assert_eq!(RayType::from_name("rt_RayType"), None);
    }

    #[test]
    fn the_first_ray_is_of_the_camera_or_traced() {
        let types =
            [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(depth, before)| RayType::of(depth, before));
        use RayType::{Camera, Scattered, Traced};
        assert_eq!(types, [Camera, Scattered, Traced, Scattered]);
    }
}
