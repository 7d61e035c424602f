//! Callbacks for a host's own packets: rays with a hit get the bits that the interpreter's methods leave one after the
//! other, all others stay as they are.

use std::array::from_fn;
use std::mem::offset_of;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Callback, Class, Compiler, Engine, EngineOptions, Instance,
    InstanceBlock, Instances, LaneBlock, LaneMask, Mark, MarkWord, Method, Outputs, Program,
    RayRecord, Role, StateVariable, library, lookup_state, new_state, set_defaults,
};
use rtsl_testing::random::Random;

/// The variables that the host's rays have, in the order of their rows.
const VARIABLES: [&str; 9] = [
    "rt_RayOrigin",
    "rt_RayDirection",
    "rt_Epsilon",
    "rt_HitDistance",
    "rt_GeometricNormal",
    "rt_ShadingNormal",
    "rt_TextureUV",
    "rt_TextureUVW",
    "rt_dPdu",
];
/// Those that callbacks set.
const OUTPUTS: usize = 3;
const STATE_ROWS: usize = 22;
const MARKS: usize = 4;
const ROWS: usize = STATE_ROWS + MARKS;
const MAX_WIDTH: usize = 16;
const SURFACE: [Method; 3] =
    [Method::ComputeNormal, Method::ComputeTextureCoordinates, Method::ComputeDerivatives];

/// Classes with what the library's have little of.
const OTHERS: &str = "
class Kept : rt_Primitive; public rt_Primitive other; scratch vec3 place; scratch int face;
void intersect() {
    vec3 t = (vec3(0.5) - rt_RayOrigin) * rt_InverseRayDirection;
    float least[9];
    for (int i = 0; i < 9; i++) least[i] = t[i % 3];
    face = int(abs(rt_RayOrigin.x) * 7.0) % 9;
    if (hit(least[face])) place = vec3(rt_TimeSeed, least[2], float(face));
}
void computeNormal() {
    float few[9];
    for (int i = 0; i < 9; i++) few[i] = float(i) * rt_HitDistance;
    rt_GeometricNormal = place + vec3(few[face], place[face % 3], rt_HitPoint.y);
}
void computeBounds() { rt_BoundMin = vec3(-1.0); rt_BoundMax = vec3(1.0); }";

const RANDOM: &str = "class Random : rt_Primitive;
void intersect() { hit(rand()); }
void computeBounds() { rt_BoundMin = vec3(-1.0); rt_BoundMax = vec3(1.0); }
void computeNormal() { rt_GeometricNormal = vec3(1.0); }";

/// The argument of callbacks.
#[repr(C)]
struct Question {
    unused: u32,
    number: u32,
    mask: *const i32,
    rays: *mut f32,
    told: u32,
    blocks: *const u32,
    context: *const u32,
}

fn state(name: &str) -> &'static StateVariable {
    lookup_state(name).expect("the table has it")
}

/// The components of the variables, row by row.
fn components() -> impl Iterator<Item = usize> {
    VARIABLES.iter().flat_map(|name| {
        let variable = state(name);
        (variable.first_component..variable.first_component + variable.ty.components())
            .map(|component| component as usize)
    })
}

fn callback(width: usize, is_masked: bool, outputs: Outputs) -> Callback {
    let rows = components().zip(0..).map(|(component, row)| (component as u32, row));
    let first = STATE_ROWS as u32;
    Callback {
        width: width as u32,
        outputs,
        record: RayRecord {
            rays: offset_of!(Question, rays) as u32,
            mask: is_masked.then_some(offset_of!(Question, mask) as u32),
            instances: offset_of!(Question, blocks) as u32,
            number: Some(offset_of!(Question, number) as u32),
            rows: rows.collect(),
            marks: vec![
                Mark { row: first, word: MarkWord::Constant(0) },
                Mark { row: first + 1, word: MarkWord::Constant(0xc0de_f00d) },
                Mark {
                    row: first + 2,
                    word: MarkWord::Argument(offset_of!(Question, told) as u32),
                },
                Mark {
                    row: first + 3,
                    word: MarkWord::Behind {
                        pointer: offset_of!(Question, context) as u32,
                        offset: 8,
                    },
                },
            ],
        },
    }
}

const CONTEXT: [u32; 3] = [1, 2, 3];
const TOLD: u32 = 77;
const MARKED: [u32; MARKS] = [0, 0xc0de_f00d, TOLD, 3];

/// Rays of a host, and which of them take part.
#[derive(Clone)]
struct Packet {
    width: usize,
    words: Vec<u32>,
    mask: [i32; MAX_WIDTH],
}

impl Packet {
    fn new(width: usize, random: &mut Random) -> Packet {
        let mut packet = Packet {
            width,
            words: (0..ROWS * width).map(|_| random.bits()).collect(),
            mask: from_fn(|_| -i32::from(random.bits().is_multiple_of(4))),
        };
        packet.mask.iter_mut().for_each(|it| *it = !*it);
        for ray in 0..width {
            let origin: [f32; 3] = from_fn(|_| random.signed() * 3.0);
            let target: [f32; 3] = from_fn(|_| random.signed());
            for axis in 0..3 {
                packet.set(axis, ray, origin[axis]);
                packet.set(3 + axis, ray, target[axis] - origin[axis]);
            }
            packet.set(6, ray, 1e-3);
            packet.set(7, ray, if ray % 5 == 1 { 0.8 } else { f32::INFINITY });
        }
        packet
    }

    fn set(&mut self, row: usize, ray: usize, value: f32) {
        self.words[row * self.width + ray] = value.to_bits();
    }

    /// As a callback leaves it.
    fn called(&self, compiled: &rtsl::CompiledCallback, blocks: &[u32], number: u32) -> Packet {
        let mut called = self.clone();
        let question = Question {
            unused: 0,
            number,
            mask: called.mask.as_ptr(),
            rays: called.words.as_mut_ptr().cast(),
            told: TOLD,
            blocks: blocks.as_ptr(),
            context: CONTEXT.as_ptr(),
        };
        // Safety: the record is of this struct, whose pointers lead to as many rays, blocks and words as it says.
        unsafe {
            let function: unsafe extern "C" fn(&Question) = std::mem::transmute(compiled.address());
            function(&question);
        }
        called
    }

    /// As methods on the interpreter leave it, called one after the other.
    fn expected(
        &self,
        program: &Program,
        block: &InstanceBlock,
        is_masked: bool,
        outputs: Outputs,
    ) -> Packet {
        let mut lanes = new_state(self.width);
        set_defaults(&mut lanes, Role::Primitive);
        for (component, row) in components().zip(0..) {
            let words = &self.words[row * self.width..][..self.width];
            lanes.words_mut(component)[..self.width].copy_from_slice(words);
        }
        let first = |name| state(name).first_component as usize;
        for axis in 0..3 {
            for ray in 0..self.width {
                let direction = lanes.floats(first("rt_RayDirection") + axis)[ray];
                lanes.floats_mut(first("rt_InverseRayDirection") + axis)[ray] = 1.0 / direction;
            }
        }
        let mut scratch = program.new_scratch(self.width);
        let mask = LaneMask::from_fn(self.width, |ray| !is_masked || self.mask[ray] != 0);
        let mut accepted = LaneMask::new(self.width);
        let method = Method::Intersect;
        call(program, block, method, &mut lanes, &mut scratch, &mask, Some(&mut accepted));
        for axis in 0..3 {
            for ray in 0..self.width {
                let of = |name, axis| lanes.floats(first(name) + axis)[ray];
                let way = of("rt_HitDistance", 0) * of("rt_RayDirection", axis);
                let point = of("rt_RayOrigin", axis) + way;
                lanes.floats_mut(first("rt_HitPoint") + axis)[ray] = point;
            }
        }
        for method in SURFACE.into_iter().filter(|method| program.has(*method)) {
            call(program, block, method, &mut lanes, &mut scratch, &accepted, None);
        }
        let mut expected = self.clone();
        for ray in (0..self.width).filter(|ray| accepted.get(*ray)) {
            for (component, row) in components().zip(0..) {
                let variable = rtsl::state_variables()
                    .iter()
                    .rfind(|it| it.first_component as usize <= component);
                if outputs.has_state(variable.expect("the table has it")) {
                    expected.words[row * self.width + ray] = lanes.words(component)[ray];
                }
            }
            for (mark, word) in MARKED.into_iter().enumerate() {
                expected.words[(STATE_ROWS + mark) * self.width + ray] = word;
            }
        }
        expected
    }
}

/// Calls a method for the rays of a mask.
fn call(
    program: &Program,
    block: &InstanceBlock,
    method: Method,
    state: &mut LaneBlock,
    scratch: &mut LaneBlock,
    mask: &LaneMask,
    accepted: Option<&mut LaneMask>,
) {
    let kernel = program.kernel(method, CallMode::Packet).expect("it has code");
    let _ = kernel.call(CallArguments {
        count: state.lanes(),
        state,
        scratch,
        mask: Some(mask),
        accepted,
        instances: Instances::One(block),
        host: &mut NoHost,
    });
}

/// An engine for machine code, if there can be one, and the oracle.
fn engines() -> Option<(Engine, Engine)> {
    let engine = |backend| {
        let options = EngineOptions { backend, ..EngineOptions::default() };
        Engine::new(options).expect("an engine").0
    };
    let auto = engine(Backend::Auto);
    if auto.llvm().is_none() {
        eprintln!("left out: there is no LLVM");
        return None;
    }
    Some((auto, engine(Backend::Interpreter)))
}

/// Tests a class with some instances; how many rays hit one.
fn check(engines: &(Engine, Engine), instances: &[Arc<Instance>], random: &mut Random) -> usize {
    let (engine, oracle) = engines;
    let first = &instances[0];
    let (program, oracle) = (engine.program(first), oracle.program(first));
    let blocks: Vec<InstanceBlock> = instances.iter().map(|it| program.block(it)).collect();
    // Of 8-byte words, as kernels want them.
    let words: Vec<u64> = blocks
        .iter()
        .flat_map(|block| block.words().as_chunks::<2>().0)
        .map(|[low, high]| u64::from(*low) | u64::from(*high) << 32)
        .collect();
    // Safety: words of 8 bytes are twice as many of 4.
    let words = unsafe { std::slice::from_raw_parts(words.as_ptr().cast(), words.len() * 2) };
    let methods = [Method::Intersect].into_iter().chain(SURFACE);
    let written = methods.filter_map(|method| Some(program.method(method).ok()?.writes.clone()));
    let written: Vec<_> = written.flatten().collect();
    let rows = VARIABLES[OUTPUTS..].iter().map(|name| state(name));
    let set = Outputs::state(rows.filter(|variable| written.contains(variable)));
    let mut hits = 0;
    for width in [1, 4, 8, 16] {
        let calls = [
            (true, set, set),
            (false, set, set),
            (true, Outputs::ALL, set),
            (true, Outputs::NONE, Outputs::NONE),
        ];
        for (is_masked, wanted, outputs) in calls {
            let callback = callback(width, is_masked, wanted);
            let compiled = program.callback(&callback).expect("it compiles");
            for _ in 0..64 / width {
                let number = random.bits() as usize % instances.len();
                let packet = Packet::new(width, random);
                let found = packet.called(&compiled, words, number as u32);
                let block = &blocks[number];
                let expected = packet.expected(&oracle, block, is_masked, outputs);
                hits +=
                    (0..width).filter(|ray| expected.words[STATE_ROWS * width + ray] == 0).count();
                for (at, (found, expected)) in found.words.iter().zip(&expected.words).enumerate() {
                    let is_nan = |bits: u32| f32::from_bits(bits).is_nan();
                    let same = found == expected || is_nan(*found) && is_nan(*expected);
                    let (row, ray) = (at / width, at % width);
                    let name = &first.class().name;
                    assert!(
                        same,
                        "{name}, width {width}, row {row}, ray {ray}: {found:x} {expected:x}"
                    );
                }
            }
        }
    }
    hits
}

#[test]
fn every_primitive_of_the_library_gives_the_bits_of_the_oracle() {
    let Some(engines) = engines() else { return };
    let mut random = Random::new(3);
    let mut hit_classes = 0;
    for class in primitives() {
        let settings = rtsl_contract::settings(&class, &[]);
        let instances = settings.iter().filter_map(|it| it.instance(&class, &[]).ok());
        let instances: Vec<Arc<Instance>> = instances.collect();
        if !instances.is_empty() {
            let hits = check(&engines, &instances, &mut random);
            // Without parameters it has no parts.
            let is_empty = class.name == "SdfUnion";
            assert!(hits > 20 || is_empty, "{}: {hits} rays hit", class.name);
            hit_classes += 1;
        }
    }
    assert!(hit_classes >= 7, "{hit_classes} classes were hit");
}

fn primitives() -> Vec<Arc<Class>> {
    let compile = |file: &library::LibraryFile| {
        Compiler::default().compile(file.path, file.text).unit.expect("it compiles")
    };
    let units = library::files().iter().map(compile);
    let classes = units.flat_map(|unit| unit.classes().to_vec());
    classes.filter(|class| class.roles.contains(&Role::Primitive)).collect()
}

#[test]
fn scratch_arrays_and_state_without_rows_are_values() {
    let Some(engines) = engines() else { return };
    let unit = Compiler::default().compile("others.rtsl", OTHERS).unit.expect("it compiles");
    let kept = Instance::new(unit.class("Kept").expect("there is one"), []).expect("an instance");
    assert!(check(&engines, &[kept], &mut Random::new(5)) > 100);
}

#[test]
fn what_a_record_cant_do_is_told() {
    let Some((engine, oracle)) = engines() else { return };
    let unit = Compiler::default().compile("random.rtsl", RANDOM).unit.expect("it compiles");
    let instance = Instance::new(unit.class("Random").expect("there is one"), []).expect("it is");
    let told = |engine: &Engine, callback: &Callback| {
        let told = engine.program(&instance).callback(callback).expect_err("it fails");
        format!("{}: {}", told.code.as_str(), told.message)
    };
    let hits = Outputs::state([state("rt_HitDistance")]);
    let good = callback(4, true, hits);
    assert_eq!(
        told(&oracle, &good),
        "E0701: callbacks of `Random` are machine code, and this engine makes none"
    );
    assert_eq!(
        told(&engine, &good),
        "E0702: `Random.hit` can't be compiled: it makes requests to its host, but a record has no host"
    );
    assert_eq!(
        told(&engine, &Callback { width: 5, ..good.clone() }),
        "E0703: there are no kernels for 5 rays at a time"
    );
    let outputs = Outputs::state([state("rt_BSDFValue")]);
    assert_eq!(
        told(&engine, &Callback { outputs, ..good.clone() }),
        "E0508: `Random` has no method that sets `rt_BSDFValue` where a ray has hit"
    );
    let outputs = Outputs::state([state("rt_dPdv")]);
    assert_eq!(
        told(&engine, &Callback { outputs, ..good }),
        "E0702: `Random.hit` can't be compiled: the record has no row for a component of `rt_dPdv`"
    );
}
