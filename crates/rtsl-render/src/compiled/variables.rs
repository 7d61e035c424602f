//! The components of state variables in a block of state, and access to vectors and colours.

use std::sync::LazyLock;

use rtsl::{LaneBlock, lookup_state};

macro_rules! variables {
    ($($field:ident $name:literal;)*) => {
        /// The first component of each variable that the renderer sets or reads.
        #[derive(Debug)]
        pub struct Variables {
            $(#[doc = concat!("`", $name, "`")] pub $field: usize,)*
        }

        static VARIABLES: LazyLock<Variables> = LazyLock::new(|| Variables {
            $($field: lookup_state($name).map_or(0, |variable| variable.first_component as usize),)*
        });

        #[cfg(test)]
        const NAMES: &[&str] = &[$($name),*];
    };
}

variables! {
    time_seed "rt_TimeSeed";
    du "rt_du";
    dv "rt_dv";
    ray_origin "rt_RayOrigin";
    ray_direction "rt_RayDirection";
    inverse_ray_direction "rt_InverseRayDirection";
    epsilon "rt_Epsilon";
    hit_distance "rt_HitDistance";
    bound_min "rt_BoundMin";
    bound_max "rt_BoundMax";
    bsdf_seed "rt_BSDFSeed";
    bsdf_value "rt_BSDFValue";
    texture_uv "rt_TextureUV";
    texture_uvw "rt_TextureUVW";
    dpdu "rt_dPdu";
    dpdv "rt_dPdv";
    dsdu "rt_dsdu";
    dsdv "rt_dsdv";
    dtdu "rt_dtdu";
    dtdv "rt_dtdv";
    light_direction "rt_LightDirection";
    pdf "rt_PDF";
    relative_index "rt_RelativeIndex";
    regularization "rt_Regularization";
    float_texture_value "rt_FloatTextureValue";
    emission_color "rt_EmissionColor";
    sample_color "rt_SampleColor";
    ray_width "rt_RayWidth";
    ray_spread "rt_RaySpread";
    ray_depth "rt_RayDepth";
    ray_type "rt_RayType";
    object_number "rt_ObjectNumber";
    instance_number "rt_InstanceNumber";
    element_number "rt_ElementNumber";
    attributes "rt__Attributes";
    to_object "rt__ToObject";
    to_world "rt__ToWorld";
}

/// Returns the components of all variables.
pub fn variables() -> &'static Variables {
    &VARIABLES
}

/// Returns the number of components without those that programs cannot name, which come last.
pub fn visible_components() -> usize {
    let v = variables();
    v.attributes.min(v.to_object).min(v.to_world)
}

/// Returns the vector or colour of a lane that starts at component `first`.
#[inline]
pub fn vector(block: &LaneBlock, first: usize, lane: usize) -> [f32; 3] {
    [block.floats(first)[lane], block.floats(first + 1)[lane], block.floats(first + 2)[lane]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_components_come_last() {
        for variable in rtsl::state_variables() {
            let is_late = variable.first_component as usize >= visible_components();
            assert_eq!(variable.is_hidden(), is_late, "{}", variable.name);
        }
    }

    #[test]
    fn every_variable_is_in_the_table() {
        for name in NAMES {
            assert!(lookup_state(name).is_some(), "{name}");
        }
    }
}
