//! Textures of the standard library against values of pbrt-v4's functions of the same name.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Compiler, Engine, EngineOptions, Instance, Instances, Method,
    Numbers, Scalar, Value, library, lookup_state, new_state,
};

type Arguments = Vec<(&'static str, Value)>;

fn texture(class: &str, arguments: Arguments) -> Arc<Instance> {
    let declares = |text: &str| text.contains(&format!("class {class} :"));
    let file = library::files().iter().find(|file| declares(file.text)).expect(class);
    let unit = Compiler::default().compile(file.path, file.text).unit.expect(class);
    Instance::new(unit.class(class).unwrap(), arguments)
        .unwrap_or_else(|problems| panic!("{class}: {:?}", problems.into_vec()))
}

/// The colour and the number of a texture at a point and with variables, each a name and components.
fn lookup(texture: &Instance, variables: &[(&str, &[f32])]) -> [f32; 4] {
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the interpreter is there");
    let program = engine.program(texture);
    let kernel = program.kernel(Method::Lookup, CallMode::Packet).unwrap();
    let place = |name: &str| lookup_state(name).unwrap().first_component as usize;
    let mut state = new_state(1);
    for (name, components) in variables {
        for (index, component) in components.iter().enumerate() {
            let [value] = state.vectors_mut::<1>(place(name) + index);
            value[0] = *component;
        }
    }
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(1),
        count: 1,
        mask: None,
        accepted: None,
        instances: Instances::One(&program.block(texture)),
        host: &mut NoHost,
    });
    let color = place("rt_TextureColor");
    let mut read = |place: usize| {
        let [value] = state.vectors_mut::<1>(place);
        value[0]
    };
    [read(color), read(color + 1), read(color + 2), read(place("rt_FloatTextureValue"))]
}

fn number(texture: &Instance, variables: &[(&str, &[f32])]) -> f32 {
    lookup(texture, variables)[3]
}

fn assert_near(found: f32, expected: f32, what: &str) {
    assert!(
        (found - expected).abs() <= 2e-5 * expected.abs().max(1.0),
        "{what}: {found}, expected {expected}"
    );
}

/// Points, and there: noise, sums of 5 octaves and of 8 with a filter 0.01 wide, turbulence, waves, and the red of
/// marble, as functions of pbrt-v4 give them.
const NOISE: [([f32; 3], [f32; 6]); 4] = [
    ([0.5, 0.25, 0.75], [-0.3750787, -0.3396019, -0.3519488, 0.539_079, -0.1181938, 0.7934375]),
    ([1.3, -2.7, 3.1], [0.5043408, 0.7357371, 0.7302275, 0.8186945, 0.3465316, 0.6525394]),
    ([-10.2, 20.6, -30.9], [0.4738474, 0.8050095, 0.7869526, 0.8205615, 0.0292338, 0.8497875]),
    (
        [255.5, 256.5, 257.25],
        [-0.3210449, -0.5191293, -0.5326924, 0.6963157, -0.0846274, 0.7829263],
    ),
];

#[test]
fn noise_is_that_of_pbrt() {
    let sum = |class: &str, octaves: i32| {
        texture(class, vec![("octaves", octaves.into()), ("roughness", 0.6.into())])
    };
    let (noise, five, eight) = (sum("PerlinFbm", 1), sum("PerlinFbm", 5), sum("PerlinFbm", 8));
    let (wrinkled, windy) = (sum("Wrinkled", 5), texture("Windy", vec![]));
    let marble = texture("PerlinMarble", vec![("scale", 2.0.into()), ("variation", 0.4.into())]);
    for (point, expected) in NOISE {
        let at: &[(&str, &[f32])] = &[("rt_HitPoint", &point)];
        let filtered: &[(&str, &[f32])] = &[
            ("rt_HitPoint", &point),
            ("rt_du", &[0.01]),
            ("rt_dPdu", &[1.0, 0.0, 0.0]),
            ("rt_dPdv", &[0.0, 1.0, 0.0]),
        ];
        assert_near(number(&noise, at), expected[0], "noise");
        assert_near(number(&five, at), expected[1], "five octaves");
        assert_near(number(&eight, filtered), expected[2], "filtered octaves");
        assert_near(number(&wrinkled, at), expected[3], "wrinkled");
        assert_near(number(&windy, at), expected[4], "windy");
        assert_near(lookup(&marble, at)[0], expected[5], "marble");
    }
}

#[test]
fn solid_textures_are_placed_by_their_transform() {
    let mut twice: Vec<f32> = vec![0.0; 16];
    (twice[0], twice[5], twice[10], twice[15]) = (2.0, 2.0, 2.0, 1.0);
    twice[12] = -1.3;
    let moved = Value::Numbers(Numbers::floats(twice));
    let texture = texture("PerlinFbm", vec![("octaves", 1.into()), ("toTexture", moved)]);
    let (point, expected) = NOISE[1];
    let [x, y, z] = point;
    let at = [(x + 1.3) / 2.0, y / 2.0, z / 2.0];
    assert_near(number(&texture, &[("rt_HitPoint", &at)]), expected[0], "noise");
}

/// Rows of texture coordinates (0, 0.1), (0.5, 0.1), ... and (0, 0.6) and so on, by pbrt-v4's function.
const DOTS: [&str; 8] = [
    "0000000000100010",
    "1000000000000000",
    "1000000000000000",
    "0000000010000000",
    "1010101010100010",
    "0000100000000000",
    "1010101010000010",
    "0000001000100000",
];

#[test]
fn dots_are_where_pbrt_has_them() {
    let dots = texture("Dots", vec![]);
    for (row, expected) in DOTS.into_iter().enumerate() {
        let inside = |column: usize| {
            let st = [0.5 * column as f32, 0.5 * row as f32 + 0.1];
            number(&dots, &[("rt_TextureUV", &st)])
        };
        let found: String = (0..16).map(|it| if inside(it) > 0.5 { '1' } else { '0' }).collect();
        assert_eq!(found, expected, "row {row}");
    }
}

#[test]
fn mappings_give_coordinates_on_their_surfaces() {
    let at = |mapping: i32, point: [f32; 3]| {
        let arguments = vec![
            ("mapping", mapping.into()),
            ("repeat", [3.0, 5.0].into()),
            ("offset", [0.25, 0.5].into()),
            ("v1", [2.0, 0.0, 0.0].into()),
            ("v2", [0.0, 0.0, 1.0].into()),
            ("v10", [1.0, 0.0, 0.0].into()),
            ("v01", [0.0, 1.0, 0.0].into()),
            ("v11", [1.0, 1.0, 0.0].into()),
        ];
        let [s, t, ..] = lookup(
            &texture("Bilerp", arguments),
            &[("rt_HitPoint", &point), ("rt_TextureUV", &[0.5, 0.2])],
        );
        [s, t]
    };
    let near = |found: [f32; 2], expected: [f32; 2]| {
        assert_near(found[0], expected[0], "s");
        assert_near(found[1], expected[1], "t");
    };
    near(at(0, [1.0, 2.0, 3.0]), [1.75, 1.5]);
    // The angle from the pole, then that around it.
    near(at(1, [0.0, 2.0, 0.0]), [0.5, 0.25]);
    near(at(1, [1.0, -1.0, 2.0_f32.sqrt()]), [0.25, 0.875]);
    near(at(2, [0.0, 2.0, 7.0]), [0.75, 7.0]);
    near(at(3, [1.5, 2.0, 3.0]), [3.25, 3.5]);
}

#[test]
fn a_checkerboard_in_space_has_cubes() {
    let cubes = texture("Checkerboard", vec![("dimension", 3.into())]);
    for (point, expected) in [
        ([0.5, 0.5, 0.5], 1.0),
        ([1.5, 0.5, 0.5], 0.0),
        ([1.5, -0.5, 0.5], 1.0),
        ([-0.5, -0.5, -0.5], 0.0),
    ] {
        assert_near(number(&cubes, &[("rt_HitPoint", &point)]), expected, "cube");
    }
    let wide: &[(&str, &[f32])] = &[
        ("rt_HitPoint", &[0.5; 3]),
        ("rt_du", &[2.0]),
        ("rt_dv", &[2.0]),
        ("rt_dPdu", &[1.0, 0.0, 0.0]),
        ("rt_dPdv", &[0.0, 1.0, 0.0]),
    ];
    assert_near(number(&cubes, wide), 0.5, "mean of cubes");
}

#[test]
fn mixtures_take_numbers_as_they_are() {
    let constant = |value: f32| Value::Instance(texture("Constant", vec![("value", value.into())]));
    let beyond = texture("MixTexture", vec![("amount", constant(1.5))]);
    assert_near(number(&beyond, &[]), 1.5, "mix");
    let scaled = texture("Scale", vec![("texture", constant(0.5)), ("scale", constant(3.0))]);
    assert_near(number(&scaled, &[]), 1.5, "scale");
    let slanted: &[(&str, &[f32])] =
        &[("rt_dPdu", &[1.0, 0.0, 0.0]), ("rt_dPdv", &[0.0, 3.0, 3.0])];
    let direction = texture(
        "DirectionMix",
        vec![("first", constant(3.0)), ("direction", [0.0, -2.0, 0.0].into())],
    );
    let weight = 0.5_f32.sqrt();
    assert_near(number(&direction, slanted), 3.0 * weight + (1.0 - weight), "direction mix");
    let corners = texture("Bilerp", vec![("v00", 1.0.into()), ("v11", [0.0, 4.0, 8.0].into())]);
    let [red, green, blue, _] = lookup(&corners, &[("rt_TextureUV", &[0.25, 0.5])]);
    assert_eq!([red, green, blue], [0.75, 1.25, 1.75]);
}

/// An image of two columns and one row: (1, 0.5, 0.25) and (0, 0.25, 1).
fn image(channels: i32, bits: i32, words: Vec<u32>, more: Arguments) -> Arc<Instance> {
    let decoded = (0..256).map(|code| code as f32 / 4.0);
    let mut arguments = vec![
        ("words", Value::Numbers(Numbers::from_words(Scalar::U32, words))),
        ("channels", channels.into()),
        ("bits", bits.into()),
        ("decoded", Value::Numbers(Numbers::floats(decoded))),
        ("size", [2, 1].into()),
    ];
    arguments.extend(more);
    texture("Image", arguments)
}

#[test]
fn every_format_of_texels_is_read() {
    let left: &[(&str, &[f32])] = &[("rt_TextureUV", &[0.25, 0.5])];
    let right: &[(&str, &[f32])] = &[("rt_TextureUV", &[0.75, 0.5])];
    let both = |image: &Instance| [lookup(image, left), lookup(image, right)];
    let floats = |numbers: &[f32]| numbers.iter().map(|it| it.to_bits()).collect::<Vec<_>>();
    let mean = (1.0 + 0.5 + 0.25) / 3.0;
    let colors = [[1.0, 0.5, 0.25, mean], [0.0, 0.25, 1.0, 1.25 / 3.0]];
    assert_eq!(both(&image(3, 8, vec![0xff01_0204, 0xff04_0100], vec![])), colors);
    let halves = vec![0x3800_3c00, 0x3c00_3400, 0x3400_0000, 0x3c00_3c00];
    assert_eq!(both(&image(3, 16, halves, vec![])), colors);
    let rgb = [1.0, 0.5, 0.25, 0.0, 0.25, 1.0];
    assert_eq!(both(&image(3, 32, floats(&rgb), vec![])), colors);
    let opacities = [[1.0, 0.5, 0.25, 0.75], [0.0, 0.25, 1.0, 0.0]];
    assert_eq!(both(&image(4, 8, vec![0x0301_0204, 0x0004_0100], vec![])), opacities);
    let rgba = [1.0, 0.5, 0.25, 0.75, 0.0, 0.25, 1.0, 0.0];
    assert_eq!(both(&image(4, 32, floats(&rgba), vec![])), opacities);
    let texels = Value::Numbers(Numbers::floats(rgba));
    let vectors = texture("Image", vec![("texels", texels), ("size", [2, 1].into())]);
    assert_eq!(both(&vectors), opacities);
    let greys = [[0.5; 4], [2.0; 4]];
    assert_eq!(both(&image(1, 8, vec![0x0802], vec![])), greys);
    assert_eq!(both(&image(1, 16, vec![0x4000_3800], vec![])), greys);
    assert_eq!(both(&image(1, 32, floats(&[0.5, 2.0]), vec![])), greys);
}

#[test]
fn images_are_scaled_then_inverted_and_wrapped() {
    let value = |s: f32, more: Arguments| {
        number(&image(1, 8, vec![0x0002_0802], more), &[("rt_TextureUV", &[s, 0.5])])
    };
    assert_near(value(0.25, vec![("scale", 1.5.into()), ("invert", true.into())]), 0.25, "invert");
    assert_near(value(0.75, vec![("invert", true.into())]), 0.0, "invert to no less than 0");
    assert_near(value(0.49, vec![("filtering", 1.into())]), 0.5, "the nearest");
    assert_near(value(0.5, vec![]), 1.25, "between");
    for (wrap, outside) in [(0, 0.5), (1, 2.0), (2, 0.0), (3, 2.0)] {
        let wrapped = vec![("wrap", wrap.into()), ("filtering", 1.into())];
        assert_near(value(1.25, wrapped), outside, "wrapped");
    }
    // Across the right edge of 2 by 2 texels an octahedral map continues in the other row.
    let words = vec![0x0804_0201, 3];
    let octahedral = image(
        1,
        8,
        words,
        vec![("size", [2, 2].into()), ("wrap", 3.into()), ("filtering", 1.into())],
    );
    assert_near(number(&octahedral, &[("rt_TextureUV", &[1.1, 0.75])]), 2.0, "folded");
}
