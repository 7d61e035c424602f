//! Computations for many rays: eight lanes at a time in registers, masks, requests, random numbers.

pub mod delta_light;
pub mod eight;
pub mod fours;
pub mod lane_maps;
pub mod mask_bits;
pub mod surface_offset;
