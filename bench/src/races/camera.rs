//! A camera.

use rtsl::{CallMode, Method};

use crate::kernels::Lens;
use crate::race::{Parameter, Race, Shader, WrittenForms, independent};
use crate::random::{cross, normalize};

pub fn races() -> Vec<Race> {
    let forward = normalize([0.2, -0.3, 1.0]);
    let right = normalize(cross([0.0, 1.0, 0.0], forward));
    let up = cross(forward, right);
    vec![Race {
        name: "lens",
        shader: Shader {
            file: "lens.rtsl",
            class: "Lens",
            method: Method::GenerateRay,
            mode: CallMode::Packet,
        },
        state: &["rt_ScreenCoord", "rt_LensCoord", "rt_RayOrigin", "rt_RayDirection"],
        others: &[],
        inputs: 4,
        in_place: false,
        rays: |random| {
            independent(random, |random| {
                let high = [512.0, 512.0, 1.0, 1.0];
                high.iter().map(|high| random.between(0.0, *high)).collect()
            })
        },
        parameters: vec![
            Parameter::new("eye", &[1.0, 2.0, -5.0]),
            Parameter::new("right", &right),
            Parameter::new("up", &up),
            Parameter::new("forward", &forward),
            Parameter::new("extent", &[0.55, 0.55]),
            Parameter::new("pixel", &[2.0 / 512.0, 2.0 / 512.0]),
            Parameter::new("lensRadius", &[0.1]),
            Parameter::new("focalDistance", &[6.0]),
        ],
        written: WrittenForms::of::<Lens>(),
    }]
}
