//! Elementary functions.

use rtsl::{CallMode, Method};

use crate::kernels::{Exp, InverseSqrt, Log, Pow, SinCos};
use crate::race::{Race, Shader, WrittenForms, independent};
use crate::random::Random;

pub fn races() -> Vec<Race> {
    let race = |name, class, rays, written| Race {
        name,
        shader: Shader {
            file: "functions.rtsl",
            class,
            method: Method::EvaluatePdf,
            mode: CallMode::Packet,
        },
        state: &["rt_HitDistance", "rt_PDF"],
        others: &[],
        inputs: 1,
        in_place: false,
        rays,
        parameters: Vec::new(),
        written,
    };
    vec![
        race("exp", "Exp", |it| numbers(it, -20.0, 5.0), WrittenForms::of::<Exp>()),
        race("log", "Log", |it| numbers(it, 0.01, 10.0), WrittenForms::of::<Log>()),
        Race {
            state: &["rt_HitDistance", "rt_Epsilon", "rt_PDF"],
            inputs: 2,
            ..race("pow", "Pow", powers, WrittenForms::of::<Pow>())
        },
        race("sincos", "SinCos", |it| numbers(it, -10.0, 10.0), WrittenForms::of::<SinCos>()),
        race(
            "inversesqrt",
            "InverseSqrt",
            |it| numbers(it, 0.01, 10.0),
            WrittenForms::of::<InverseSqrt>(),
        ),
    ]
}

fn numbers(random: &mut Random, low: f32, high: f32) -> Vec<Vec<f32>> {
    independent(random, |random| vec![random.between(low, high)])
}

fn powers(random: &mut Random) -> Vec<Vec<f32>> {
    independent(random, |random| vec![random.between(0.01, 10.0), random.between(-3.0, 3.0)])
}
