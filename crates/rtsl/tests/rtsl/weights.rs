//! Weights of traced rays, as hosts receive them.

use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, RayLanes};
use rtsl::{
    Backend, CallArguments, CallMode, Compiler, Engine, EngineOptions, Instance, Instances, Method,
    OptLevel, Variant, new_state,
};

const COUNT: usize = 19;

/// Remembers the weights, ray by ray, as bits.
struct Weights(Vec<Vec<u32>>);

impl Host for Weights {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for lane in lanes.iter() {
            let asked = &mut self.0[lanes.base as usize + lane];
            let weight = rays.weight[lane];
            // Which NaN arithmetic makes is not defined.
            asked.push(if weight.is_nan() { f32::NAN } else { weight }.to_bits());
            radiance.iter_mut().for_each(|channel| channel[lane] = 0.5);
        }
    }

    /// A quarter of the ray's number.
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        lanes.iter().for_each(|lane| values[lane] = 0.25 * (lanes.base as usize + lane) as f32);
    }
}

/// The weights that every ray gives, which all ways to run `shade` agree on.
fn weights(body: &str) -> Vec<Vec<f32>> {
    let text = format!(
        "class Test : rt_Material;
        public color kr = color(0.5, 0.125, 0.75);
        public float gain = 0.5;
        vec3 away() {{ return vec3(0.0, 0.0, 1.0); }}
        void shade() {{ vec3 o = rt_HitPoint; vec3 d = away(); {body} }}"
    );
    let mut found: Option<Vec<Vec<u32>>> = None;
    for optimization in [OptLevel::O0, OptLevel::O2] {
        for engine in engines(optimization) {
            for is_known in [false, true] {
                let asked = run(&engine, &text, is_known);
                let first = found.get_or_insert_with(|| asked.clone());
                let options = engine.options();
                assert_eq!(*first, asked, "{options:?}, known: {is_known}, {body}");
            }
        }
    }
    let bits = found.expect("the interpreter is always there").into_iter();
    bits.map(|asked| asked.into_iter().map(f32::from_bits).collect()).collect()
}

/// Every backend and width.
fn engines(optimization: OptLevel) -> impl Iterator<Item = Engine> {
    let compiled = Engine::WIDTHS.into_iter().map(|width| (Backend::Jit, width));
    let all = compiled.chain([(Backend::Interpreter, 1)]);
    all.filter_map(move |(backend, width)| {
        let width = Some(width);
        let options = EngineOptions { backend, width, optimization, ..EngineOptions::default() };
        Some(Engine::new(options).ok()?.0)
    })
}

fn run(engine: &Engine, text: &str, is_known: bool) -> Vec<Vec<u32>> {
    let compilation = Compiler::default().compile("test.rtsl", text);
    let report = compilation.report(false);
    let unit = compilation.unit.unwrap_or_else(|| panic!("{report}"));
    let class = unit.classes().last().expect("a class");
    let instance = Instance::new(class, []).unwrap();
    let program = engine.program(&instance);
    let block = program.block(&instance);
    let mut variant = Variant::new(CallMode::Packet);
    if is_known {
        variant = variant.knowing(program.known_members(&instance));
    }
    let kernel = program.kernel(Method::Shade, variant).unwrap();
    let mut host = Weights(vec![Vec::new(); COUNT]);
    let status = kernel.call(CallArguments {
        state: &mut new_state(COUNT),
        scratch: &mut program.new_scratch(COUNT),
        count: COUNT,
        mask: None,
        accepted: None,
        instances: Instances::One(&block),
        host: &mut host,
    });
    assert!(!status.budget_exhausted);
    host.0
}

/// All rays ask with these weights.
fn check(body: &str, expected: &[f32]) {
    for asked in weights(body) {
        assert_eq!(asked, expected, "{body}");
    }
}

#[test]
fn a_product_weighs_what_its_greatest_factor_does() {
    check("rt_SampleColor += kr * trace(o, d);", &[0.75]);
    check("rt_SampleColor -= trace(o, d) * -kr;", &[0.75]);
    check("rt_SampleColor = gain * (trace(o, d) * kr);", &[0.375]);
    check("rt_SampleColor = mix(kr, trace(o, d), gain);", &[0.5]);
    check("color c = trace(o, d); rt_SampleColor = kr + c * 0.25;", &[0.25]);
}

#[test]
fn uses_that_are_no_products_weigh_all() {
    check("rt_SampleColor = kr + trace(o, d);", &[1.0]);
    check("color c = trace(o, d); rt_SampleColor = rgb(c).r > 0.2 ? kr : 0.25 * c;", &[1.0]);
    check("color c = trace(o, d); rt_SampleColor = c * c;", &[1.0]);
    check("color c = trace(o, d); rt_SampleColor = kr * c + rand() * c;", &[1.0]);
}

#[test]
fn branches_and_loops() {
    let either = "color c = trace(o, d);
        if (rand() > 1.0) { rt_SampleColor = c * gain; } else { rt_SampleColor = 0.25 * c; }";
    check(either, &[0.75]);
    let perhaps = "color c = color(0.0); if (gain > 0.2) { c = trace(o, d); }
        rt_SampleColor = gain * c;";
    check(perhaps, &[0.5]);
    let many = "for (int i = 0; i < 3; ++i) { color c = trace(o, d); rt_SampleColor += gain * c; }";
    check(many, &[0.5; 3]);
    let again = "color c = trace(o, d); for (int i = 0; i < 3; ++i) rt_SampleColor += gain * c;";
    check(again, &[1.0]);
}

#[test]
fn what_nobody_reads_weighs_nothing() {
    check("trace(o, d); rt_SampleColor = kr;", &[0.0]);
}

#[test]
fn weights_differ_from_ray_to_ray() {
    let asked = weights("float f = -rand(); rt_SampleColor = f * (gain * trace(o, d));");
    for (ray, asked) in asked.iter().enumerate() {
        assert_eq!(asked, &[0.125 * ray as f32]);
    }
}

#[test]
fn where_no_factor_is_a_number_the_weight_is_none() {
    let asked = weights("rt_SampleColor = (gain - gain) / (gain - gain) * trace(o, d);");
    assert!(asked.iter().all(|asked| asked[0].is_nan()));
}
