//! The stages of integrators: what they may ask of a scene becomes a part of them.
//!
//! A stage, which `rtsl-stages` has split from an integrator, asks for surfaces, lights and random numbers. This crate
//! links it ([`stage::link_stage`]) with the methods of the classes that answer. What lies between these methods is
//! text in RTSL, in `prelude/renderer`, whose functions [`renderer_text`] holds, and [`text_call`] copies:
//!
//! | text | calls |
//! |---|---|
//! | `sampler.rtsl` | [`sampler`], and [`sequences`] for their keys |
//! | `camera.rtsl` | [`camera`] |
//! | `surface.rtsl`, `space.rtsl` | [`surface`] |
//! | `lights.rtsl` | [`light_selection`], [`lights`], [`area_light`], [`indexed_lights`] |
//!
//! [`host_query`] makes kernels of the same for hosts. [`search`] tests rays against the objects of small scenes,
//! [`stage_search`] at the ends of stages. Requests that wait for a host are kept in columns ([`kept_requests`],
//! [`contribution`], [`spawning`]). This crate makes no code for machines, and binds no data of instances.

pub mod area_light;
mod arithmetic;
pub mod camera;
pub mod chosen_light;
pub mod contribution;
pub mod host_query;
pub mod indexed_lights;
pub mod kept_requests;
pub mod light_selection;
pub mod lights;
pub mod next_stages;
mod passed_values;
pub mod prepared_surface;
pub mod query_columns;
pub mod renderer_text;
pub mod sampler;
pub mod search;
pub mod sequences;
pub mod shade_call;
pub mod spawning;
pub mod stage;
mod stage_linker;
pub mod stage_search;
pub mod surface;
pub mod text_call;
pub mod unread_slots;
