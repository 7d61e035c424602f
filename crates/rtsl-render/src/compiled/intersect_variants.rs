//! Variants of the kernels of `intersect`.

use rtsl::{CallMode, Outputs, Program, Variant, lookup_state};

/// The outputs of `intersect` that the traversal reads: only the distance of the hit. Other properties are computed for
/// the closest hit alone.
pub fn traversal_outputs() -> Outputs {
    Outputs::state(lookup_state("rt_HitDistance"))
}

/// The kernel of `intersect` that every scene with objects of this kind needs.
pub fn packet_variant(program: &Program, is_placed: bool) -> Variant {
    let form = program.separate_objects(is_placed);
    placed(Variant::new(CallMode::Packet), is_placed).reading(traversal_outputs()).of_objects(form)
}

/// Returns the variant for objects with or without transforms to their group's space.
pub fn placed(variant: Variant, is_placed: bool) -> Variant {
    if is_placed { variant.placed() } else { variant }
}
