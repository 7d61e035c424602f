//! Films: the sums of samples, and what is kept beside their radiance.

pub(crate) mod aov_plan;
pub(crate) mod features;
pub(crate) mod sample_film;
pub(crate) mod sample_sums;
pub(crate) mod samples;
