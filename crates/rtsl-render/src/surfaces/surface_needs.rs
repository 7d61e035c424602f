//! The surface properties that methods read.

use rtsl::{ATTRIBUTES, Outputs, TO_OBJECT, TO_WORLD, lookup_state};

/// The surface properties that are read besides normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceNeeds {
    /// Texture coordinates.
    pub coordinates: bool,
    /// Derivatives.
    pub derivatives: bool,
    /// The reciprocal directions of rays.
    pub inverse_directions: bool,
    /// The widths of rays.
    pub footprints: bool,
    /// The indices of objects, instances and elements.
    pub numbers: bool,
    /// The maps between the objects' spaces and the world.
    pub maps: bool,
}

impl SurfaceNeeds {
    /// Returns the properties needed for reading these outputs.
    pub fn of(read: Outputs) -> SurfaceNeeds {
        let any = |names: &[&str]| {
            let named = Outputs::state(names.iter().filter_map(|name| lookup_state(name)));
            read.intersection(named) != Outputs::NONE
        };
        SurfaceNeeds {
            coordinates: any(&COORDINATES),
            derivatives: any(&DERIVATIVES),
            inverse_directions: any(&["rt_InverseRayDirection"]),
            footprints: any(&FOOTPRINTS),
            numbers: any(&NUMBERS),
            maps: any(&[TO_OBJECT, TO_WORLD]),
        }
    }
}

/// The state variables that the shapes' method for texture coordinates computes.
const COORDINATES: [&str; 3] = ["rt_TextureUV", "rt_TextureUVW", ATTRIBUTES];
const NUMBERS: [&str; 3] = ["rt_ObjectNumber", "rt_InstanceNumber", "rt_ElementNumber"];
const FOOTPRINTS: [&str; 2] = ["rt_du", "rt_dv"];
const DERIVATIVES: [&str; 6] = ["rt_dPdu", "rt_dPdv", "rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"];
