//! Random methods whose colour is affine in what they ask for: what is deferred, added up by the host, and the method's
//! own colour are together the colour of the method as it was.

use rtsl_ir::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl_ir::{
    BinaryOp, Builder, CompareOp, Function, Interpreter, OpKind, Query, Scalar, Value, Values,
    Variable, VariableId, VariableKind, verify::verify,
};
use rtsl_testing::functions::{Entropy, Memory};

use super::{Request, run};
use crate::Options;

/// A scene whose answers depend on the request alone.
#[derive(Default)]
struct Scene {
    /// The light that is added to the colour.
    added: [f32; 3],
    /// The number of requests that add light.
    count: u32,
    /// If true, answers are small integers, so that sums and products are exact.
    is_exact: bool,
}

fn hash(words: impl IntoIterator<Item = f32>) -> u32 {
    let mixed = words.into_iter().fold(0x9e37_79b9_7f4a_7c15_u64, |hash, word| {
        (hash ^ u64::from((word + 0.0).to_bits()))
            .wrapping_mul(0xbf58_476d_1ce4_e5b9)
            .rotate_left(29)
    });
    (mixed >> 20) as u32
}

impl Scene {
    fn number(&self, hash: u32, component: usize) -> f32 {
        let bits = hash >> (4 * component) & 15;
        match self.is_exact {
            true => bits as f32 - 7.0,
            false => bits as f32 * 0.137 - 0.9,
        }
    }

    fn color(&self, words: impl IntoIterator<Item = f32>) -> [f32; 3] {
        let hash = hash(words);
        std::array::from_fn(|component| self.number(hash, component))
    }

    fn add(&mut self, light: [f32; 3], weight: [f32; 3]) {
        self.count += 1;
        for (sum, (light, weight)) in self.added.iter_mut().zip(light.into_iter().zip(weight)) {
            *sum += light * weight;
        }
    }

    /// Direction, distance, colour and density of a light sample.
    fn light(&self, index: f32, point: [f32; 3]) -> [f32; 8] {
        let hash = hash([index].into_iter().chain(point));
        std::array::from_fn(|component| {
            self.number(hash.rotate_left(3 * component as u32), component % 4)
        })
    }

    fn is_there(&self, index: f32, point: [f32; 3]) -> bool {
        hash([index, 5.0].into_iter().chain(point)) & 3 != 0
    }

    fn is_blocked(&self, point: [f32; 3], direction: [f32; 3]) -> bool {
        hash(point.into_iter().chain(direction)) & 1 != 0
    }
}

/// The lights of a [`Scene`].
const LIGHTS: u32 = 3;

impl Host for Scene {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for lane in lanes.iter() {
            let color = self.color(rays.origin.iter().map(|values| values[lane]));
            radiance.iter_mut().zip(color).for_each(|(values, color)| values[lane] = color);
        }
    }

    fn light_count(&mut self) -> u32 {
        LIGHTS
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let mut reached = 0;
        for lane in lanes.iter() {
            let point = query.point.each_ref().map(|values| values[lane]);
            let sample = self.light(index as f32, point);
            let direction = [sample[0], sample[1], sample[2]];
            if !self.is_there(index as f32, point) || self.is_blocked(point, direction) {
                continue;
            }
            reached |= 1 << lane;
            let LightLanes { direction, distance, color, pdf } = &mut *light;
            let values = direction.iter_mut().chain([distance]).chain(color).chain([pdf]);
            values.zip(sample).for_each(|(values, sample)| values[lane] = sample);
        }
        reached
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        lanes.iter().for_each(|lane| values[lane] = 1.0);
    }

    fn query(&mut self, _: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        let operands: Vec<f32> = operands.iter().map(|bits| f32::from_bits(*bits)).collect();
        let three = |first: usize| [0, 1, 2].map(|index| operands[first + index]);
        match query {
            Query::Spawn => self.add(self.color(three(0)), three(7)),
            Query::Contribute => {
                if !self.is_blocked(three(0), three(3)) {
                    self.add(three(7), [1.0; 3]);
                }
            }
            Query::UnshadowedLight => {
                let index = operands[0].to_bits() as f32;
                results[0] = u32::from(self.is_there(index, three(1)));
                let sample = self.light(index, three(1));
                results[1..].iter_mut().zip(sample).for_each(|(bits, it)| *bits = it.to_bits());
            }
            Query::Shade | Query::OwnShade => {
                // The own part of a surface's colour, and light that it defers.
                let own = self.color([operands[3], 1.0]);
                let deferred = self.color([operands[3], 2.0]);
                let is_whole = query == Query::Shade;
                let colors = own.iter().zip(deferred);
                for (bits, (own, deferred)) in results.iter_mut().zip(colors) {
                    *bits = if is_whole { own + deferred } else { *own }.to_bits();
                }
                if !is_whole {
                    self.add(deferred, three(14));
                }
            }
            _ => unreachable!("{query:?}"),
        }
    }
}

/// Generates methods.
struct Generator<'e> {
    entropy: Entropy<'e>,
    builder: Builder,
    inputs: VariableId,
    /// Visible colours, numbers and bools.
    colors: Vec<[Value; 3]>,
    numbers: Vec<Value>,
    bools: Vec<Value>,
    depth: u32,
    /// If true, no requests are generated.
    is_quiet: bool,
    is_exact: bool,
}

const COLOR: &str = "rt_SampleColor";

impl Generator<'_> {
    fn method(bytes: &[u8], is_exact: bool) -> Function {
        let mut builder = Builder::new("Generated.shade");
        let mut variable = |kind, name: &str, scalar, len| {
            builder.variable(Variable { kind, name: name.to_owned(), scalar, len })
        };
        let output = variable(VariableKind::State, COLOR, Scalar::F32, 3);
        let inputs = variable(VariableKind::Scratch, "inputs", Scalar::Bool, 4);
        let entropy = Entropy::new(bytes);
        let (colors, numbers, bools) = (Vec::new(), Vec::new(), Vec::new());
        let (depth, is_quiet) = (0, false);
        let mut generator = Generator {
            entropy,
            builder,
            inputs,
            colors,
            numbers,
            bools,
            depth,
            is_quiet,
            is_exact,
        };
        for index in 0..4 {
            let input = generator.builder.load(generator.inputs, index);
            generator.bools.push(input);
            generator.constant();
        }
        let numbers = [0, 1, 2].map(|_| generator.number());
        generator.colors.push(numbers);
        generator.statements(24);
        let mut color = generator.color();
        for _ in 0..4 {
            let other = generator.color();
            color = generator.combined(BinaryOp::Add, color, other);
        }
        for (component, value) in (0..).zip(color) {
            generator.builder.output(output, component, value);
        }
        generator.builder.finish()
    }

    fn statements(&mut self, count: usize) {
        for _ in 0..count {
            if !self.entropy.is_empty() {
                self.statement();
            }
        }
    }

    fn statement(&mut self) {
        match self.entropy.below(20) {
            0..3 | 15..17 if self.is_quiet => self.scaled(),
            0..3 => self.trace(),
            3 if !self.is_quiet => self.shade(),
            3..7 => {
                let (a, b) = (self.color(), self.color());
                let op = self.entropy.choose(&[BinaryOp::Add, BinaryOp::Add, BinaryOp::Subtract]);
                let color = self.combined(op, a, b);
                self.colors.push(color);
            }
            7..11 => self.scaled(),
            11 => {
                let (condition, a, b) = (self.bool(), self.color(), self.color());
                let color =
                    [0, 1, 2].map(|index| self.builder.select(condition, a[index], b[index]));
                self.colors.push(color);
            }
            12..14 => self.branch(),
            14 => self.repeat(),
            15..17 => self.lights(),
            17 => self.arithmetic(),
            18 => {
                let (a, b) = (self.number(), self.number());
                let bool = self.builder.compare(CompareOp::Less, a, b);
                self.bools.push(bool);
            }
            _ => self.other(),
        }
    }

    fn constant(&mut self) {
        let number = match self.is_exact {
            true => self.entropy.choose(&[-1.0, 0.0, 1.0, 2.0]),
            false => f32::from(self.entropy.byte()) * 0.01 - 1.0,
        };
        let number = self.builder.f32(number);
        self.numbers.push(number);
    }

    fn arithmetic(&mut self) {
        let (a, b) = (self.number(), self.number());
        let op = self.entropy.choose(&[BinaryOp::Min, BinaryOp::Max]);
        let number = match self.entropy.below(4) {
            3 => {
                let condition = self.bool();
                let chosen = self.builder.if_(condition, |_| vec![a], |_| vec![b]);
                chosen.get(0)
            }
            0 if !self.is_quiet => self.builder.emit(OpKind::Rand),
            1 => self.builder.select(self.bools[0], a, b),
            _ => self.builder.binary(op, a, b),
        };
        self.numbers.push(number);
    }

    /// Generates what is not affine, rarely.
    fn other(&mut self) {
        let ([a, ..], [_, b, _]) = (self.color(), self.color());
        match self.entropy.below(6) {
            0 => {
                let bool = self.builder.compare(CompareOp::Less, a, b);
                self.bools.push(bool);
            }
            1 => self.numbers.push(a),
            _ => self.constant(),
        }
    }

    fn color(&mut self) -> [Value; 3] {
        let count = self.colors.len();
        self.colors[count - 1 - self.entropy.below(count.min(6))]
    }

    fn number(&mut self) -> Value {
        let count = self.numbers.len();
        self.numbers[count - 1 - self.entropy.below(count.min(8))]
    }

    fn bool(&mut self) -> Value {
        self.entropy.choose(&self.bools)
    }

    fn trace(&mut self) {
        let id = self.builder.value_count() as f32;
        let id = self.builder.f32(id);
        let origin = [id, self.number(), self.number()];
        let weight = self.builder.f32(1.0);
        let kind = OpKind::Trace { origin, direction: origin, limit: id, weight };
        let results = self.builder.push(kind);
        self.colors.push(three(results, 0));
    }

    fn shade(&mut self) {
        let id = self.builder.value_count() as f32;
        let (id, object) = (self.builder.f32(id), self.builder.i32(0));
        let mut operands = vec![object; 3];
        operands.resize(rtsl_ir::SURFACE_SCALARS, id);
        let results = self.builder.push(OpKind::Query(Query::Shade, operands));
        self.colors.push(three(results, 0));
    }

    fn combined(&mut self, op: BinaryOp, a: [Value; 3], b: [Value; 3]) -> [Value; 3] {
        [0, 1, 2].map(|index| self.builder.binary(op, a[index], b[index]))
    }

    fn scaled(&mut self) {
        let (color, other) = (self.color(), self.color());
        let numbers = [0, 1, 2].map(|_| self.number());
        let how = self.entropy.below(5);
        let two = self.builder.f32(2.0);
        let scaled = [0, 1, 2].map(|index| match how {
            0 => self.builder.multiply(color[index], numbers[index]),
            1 => self.builder.multiply(numbers[index], color[index]),
            2 => self.builder.fma(color[index], numbers[index], other[index]),
            3 => self.builder.unary(rtsl_ir::UnaryOp::Negate, color[index]),
            _ => self.builder.divide(color[index], two),
        });
        self.colors.push(scaled);
    }

    /// Generates statements in a region, after which all that it defines is out of sight; returns a colour.
    fn region(&mut self, count: usize) -> [Value; 3] {
        let visible = (self.colors.len(), self.numbers.len(), self.bools.len());
        self.statements(count);
        let color = self.color();
        self.colors.truncate(visible.0);
        self.numbers.truncate(visible.1);
        self.bools.truncate(visible.2);
        color
    }

    fn branch(&mut self) {
        if self.depth > 2 {
            return;
        }
        self.depth += 1;
        let condition = self.bool();
        self.builder.begin_region();
        let color = self.region(5);
        let then = self.builder.end_region(color.to_vec());
        self.builder.begin_region();
        let color = self.region(3);
        let otherwise = self.builder.end_region(color.to_vec());
        let results = self.builder.if_regions(condition, then, otherwise);
        self.colors.push(three(results, 0));
        self.depth -= 1;
    }

    /// Generates a loop that adds to a colour.
    fn repeat(&mut self) {
        let rounds = self.builder.i32(2);
        self.counted(rounds, |generator, _, sum| {
            let added = generator.region(4);
            match generator.entropy.chance(200) {
                true => generator.combined(BinaryOp::Add, sum, added),
                false => added,
            }
        });
    }

    fn counted(
        &mut self,
        rounds: Value,
        body: impl FnOnce(&mut Self, Value, [Value; 3]) -> [Value; 3],
    ) {
        if self.depth > 2 {
            return;
        }
        self.depth += 1;
        let (zero, one) = (self.builder.i32(0), self.builder.i32(1));
        let mut initial = self.color().to_vec();
        initial.push(zero);
        let params = self.builder.begin_loop(initial);
        let index = params.get(3);
        let number = self.builder.convert(Scalar::F32, index);
        self.numbers.push(number);
        let sum = body(self, index, three(params, 0));
        self.numbers.pop();
        let next = self.builder.add(index, one);
        let more = self.builder.compare(CompareOp::Less, next, rounds);
        let mut yields = sum.to_vec();
        yields.push(next);
        let results = self.builder.end_loop(more, &yields);
        self.colors.push(three(results, 0));
        self.depth -= 1;
    }

    fn lights(&mut self) {
        let rounds = self.builder.i32(LIGHTS as i32);
        let point = [0, 1, 2].map(|_| self.number());
        let cosine = self.number();
        self.counted(rounds, |generator, index, sum| {
            let sample = OpKind::LightSample { index, point, normal: point, cosine };
            let sample = generator.builder.push(sample);
            generator.builder.begin_region();
            let (visible, numbers) = (generator.colors.len(), generator.numbers.len());
            // What is added depends on the light alone.
            let hidden = std::mem::replace(&mut generator.colors, vec![three(sample, 5)]);
            generator.numbers.extend([sample.get(1), sample.get(8)]);
            let is_quiet = generator.entropy.chance(220);
            let is_quiet = std::mem::replace(&mut generator.is_quiet, is_quiet);
            let added = generator.region(3);
            generator.is_quiet = is_quiet;
            generator.colors = hidden;
            generator.colors.truncate(visible);
            generator.numbers.truncate(numbers);
            let added = match generator.entropy.chance(240) {
                true => generator.combined(BinaryOp::Add, sum, added),
                false => added,
            };
            let then = generator.builder.end_region(added.to_vec());
            generator.builder.begin_region();
            let otherwise = generator.builder.end_region(sum.to_vec());
            let results = generator.builder.if_regions(sample.get(0), then, otherwise);
            three(results, 0)
        });
    }
}

fn three(values: Values, first: u32) -> [Value; 3] {
    [0, 1, 2].map(|index| values.get(first + index))
}

/// The colour of a function and all light that is added, and the number of requests that added it.
fn color(function: &Function, inputs: &[u8], is_exact: bool) -> ([f32; 3], u32) {
    let mut scene = Scene { is_exact, ..Scene::default() };
    let mut memory = Memory::new(function, &mut Entropy::new(inputs));
    let mut interpreter = Interpreter::prepare(function).unwrap();
    interpreter.run(0, &mut memory, &mut scene);
    let output = function.find_variable(VariableKind::State, COLOR).unwrap();
    let own = memory.bits(output).iter().map(|bits| f32::from_bits(*bits));
    let mut sums = own.zip(scene.added).map(|(own, added)| own + added);
    (std::array::from_fn(|_| sums.next().unwrap_or_default()), scene.count)
}

#[test]
fn own_colors_and_deferred_light_add_up() {
    let (mut added, mut compared) = (0, 0);
    let (mut kept, mut deferred) = ([0; 3], [0; 3]);
    for seed in 0..2000 {
        let is_exact = seed % 2 == 0;
        let mut before = Generator::method(&Entropy::bytes(seed, 400), is_exact);
        crate::dce::run(&mut before);
        verify(&before).unwrap_or_else(|error| panic!("{error}\n{before}"));
        let mut after = before.clone();
        before.body.for_each_op(&mut |op| match op.kind {
            OpKind::Trace { .. } => deferred[Request::Trace as usize] += 1,
            OpKind::Query(..) => deferred[Request::Shade as usize] += 1,
            OpKind::LightSample { .. } => deferred[Request::Light as usize] += 1,
            _ => {}
        });
        for it in run(&mut after) {
            kept[it.request as usize] += 1;
            deferred[it.request as usize] -= 1;
        }
        verify(&after).unwrap_or_else(|error| panic!("seed {seed}: {error}\n{before}\n{after}"));
        for inputs in 0..4 {
            let inputs = Entropy::bytes(seed << 8 | inputs, 64);
            let ((expected, _), (found, count)) =
                (color(&before, &inputs, is_exact), color(&after, &inputs, is_exact));
            added += count;
            for (expected, found) in expected.into_iter().zip(found) {
                let is_small = expected.abs() < 1e5 && found.abs() < 1e5;
                let error = if is_exact { 0.0 } else { 1e-3 * (1.0 + expected.abs()) };
                compared += u32::from(is_small);
                assert!(
                    !is_small || (expected - found).abs() <= error,
                    "seed {seed}: {expected} {found}\n{before}\n{after}"
                );
            }
        }
    }
    assert!(added > 10_000 && compared > 20_000, "{added} {compared}");
    let all = kept.iter().chain(&deferred);
    assert!(all.into_iter().all(|count| *count > 100), "{kept:?} {deferred:?}");
}

/// The requests that are deferred, and the bits of their light, do not depend on how much is optimised.
#[test]
fn levels_of_optimization_agree() {
    for seed in 5000..5200 {
        let before = Generator::method(&Entropy::bytes(seed, 400), false);
        let inputs = Entropy::bytes(seed, 64);
        let outcomes = [false, true].map(|optimize| {
            let mut function = before.clone();
            let options = Options { defer: true, optimize, ..Options::default() };
            crate::optimize(&mut function, &options);
            let (color, count) = color(&function, &inputs, false);
            (color.map(f32::to_bits), count)
        });
        assert_eq!(outcomes[0], outcomes[1], "{seed}");
    }
}
