//! The integration tests of `rtsl-render`, as one program: linking is most of the work of building tests.

mod aovs;
mod batch_radiance;
mod cameras;
mod checkpoint;
mod film;
mod format;
mod fuzz;
mod gallery;
mod gltf;
mod guide;
mod hand_made;
mod importance;
mod kernels;
mod leaving;
mod lights;
mod measure;
mod mesh;
mod moving;
mod not_finite;
mod pbrt_scenes;
mod progress;
mod radiance;
mod refit;
mod scenes;
mod scratch;
mod shapes;
