//! Linking: a method and the methods that it calls through references become one function, once the classes of the
//! instances are known.

pub(crate) mod area_light;
mod arithmetic;
pub(crate) mod attributes;
mod called_scratch;
pub(crate) mod camera;
pub(crate) mod chosen_light;
pub(crate) mod class_tree;
pub(crate) mod contribution;
pub(crate) mod hit;
pub(crate) mod indexed_lights;
pub(crate) mod kept_requests;
pub(crate) mod light_selection;
pub(crate) mod lights;
pub(crate) mod linked_method;
pub(crate) mod linker;
mod loads;
pub(crate) mod next_stages;
pub(crate) mod outputs;
mod passed_values;
pub(crate) mod prepared_surface;
pub(crate) mod reported_calls;
pub(crate) mod sampler;
pub(crate) mod search;
pub(crate) mod sequences;
pub(crate) mod shade_call;
pub(crate) mod spawning;
pub(crate) mod stage;
pub(crate) mod stage_search;
pub(crate) mod surface;
#[cfg(test)]
mod tests;
pub(crate) mod text_call;
pub(crate) mod unread_slots;
mod zeroed_locals;
